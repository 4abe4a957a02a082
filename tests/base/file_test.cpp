#include "base/file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>

#include "base/error.h"
#include "own_folder.h"

namespace topple {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::ThrowsMessage;

class File : public testing::Test {
 protected:
  std::string path(const std::string& name) const { return folder_ / name; }

  OwnFolder folder_;
};

TEST_F(File, ComesBackByteForByte) {
  std::string bytes;
  for (int i = 0; i < 3000000; ++i) bytes += static_cast<char>(i * 7 + i / 256);
  replace_file(path("a"), bytes);
  EXPECT_EQ(read_file(path("a")), bytes);
  replace_file(path("a"), "");
  EXPECT_EQ(read_file(path("a")), "");
}

TEST_F(File, MakesMissingFolders) {
  replace_file(path("one/two/a"), "x");
  EXPECT_EQ(read_file(path("one/two/a")), "x");
}

TEST_F(File, SaysWhichFileCannotBeWritten) {
  replace_file(path("plain"), "x");
  EXPECT_THAT([&] { replace_file(path("plain/a"), "y"); },
              ThrowsMessage<std::runtime_error>(HasSubstr(path("plain/a"))));
  EXPECT_THAT([&] { replace_file("/proc/topple/a", "y"); },
              ThrowsMessage<std::runtime_error>(HasSubstr("/proc/topple/a")));
  fs::create_directories(path("folder/inside"));
  EXPECT_THAT([&] { replace_file(path("folder"), "y"); }, ThrowsMessage<std::runtime_error>(HasSubstr(path("folder"))));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 2) << "a half-written file was left";
}

TEST_F(File, KeepsTheOldOneWhenTheDiskIsFull) {
  replace_file(path("a"), "old");
  // a limit on the size of files makes write() fail as a full disk does
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(replace_file(path("a"), std::string(5000, 'n')), std::runtime_error);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(read_file(path("a")), "old");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 1);
}

TEST_F(File, RefusesToReadWhatIsNotAFile) {
  EXPECT_THROW(read_file(path("missing")), InputError);
  EXPECT_THROW(read_file(folder_.str()), InputError);
}

}  // namespace
}  // namespace topple
