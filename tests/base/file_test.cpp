#include "base/file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <csignal>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

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

TEST_F(File, KeepsLinksAndWritesWhatTheyStandFor) {
  replace_file(path("there/plan"), "old");
  fs::create_symlink("there/plan", path("link"));
  fs::create_symlink("link", path("second"));
  fs::create_symlink("there/none", path("dangling"));
  replace_file(path("second"), "new");
  replace_file(path("dangling"), "first");
  EXPECT_TRUE(fs::is_symlink(path("link")) && fs::is_symlink(path("second")) && fs::is_symlink(path("dangling")));
  EXPECT_EQ(read_file(path("there/plan")), "new");
  EXPECT_EQ(read_file(path("there/none")), "first");
  fs::create_symlink("round", path("round"));
  EXPECT_THROW(replace_file(path("round"), "x"), std::runtime_error);
}

TEST_F(File, KeepsTheRightsOfAnOldFile) {
  replace_file(path("a"), "old");
  for (const fs::perms rights : {fs::perms{0600}, fs::perms{0640}, fs::perms{0755}, fs::perms{0444}}) {
    fs::permissions(path("a"), rights);
    replace_file(path("a"), "new");
    EXPECT_EQ(fs::status(path("a")).permissions(), rights);
  }
  const mode_t before = umask(027);
  replace_file(path("b"), "x");
  umask(before);
  EXPECT_EQ(fs::status(path("b")).permissions(), fs::perms{0640});
}

TEST_F(File, WritesToPipesAndDevices) {
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  std::string got;
  std::thread reader([&] { got = read_file(path("pipe")); });
  replace_file(path("pipe"), "through");
  reader.join();
  EXPECT_EQ(got, "through");
  EXPECT_TRUE(fs::is_fifo(path("pipe")));
  fs::create_symlink("/dev/null", path("nothing"));
  replace_file(path("nothing"), "x");
  EXPECT_TRUE(fs::is_symlink(path("nothing")) && fs::is_character_file(path("nothing")));
  EXPECT_THROW(replace_file("/dev/full", "x"), std::runtime_error);
}

TEST_F(File, LeavesOthersBesideItAlone) {
  replace_file(path("a.part"), "mine");
  replace_file(path("a"), "x");
  EXPECT_EQ(read_file(path("a.part")), "mine");
  // writers of one file do not meet: it is always one of theirs, whole
  std::vector<std::thread> writers;
  std::atomic<int> failed = 0;
  for (const char letter : {'p', 'q', 'r', 's'})
    writers.emplace_back([&, letter] {
      for (int i = 0; i < 50; ++i) try {
          replace_file(path("a"), std::string(200000, letter));
        } catch (const std::runtime_error&) { ++failed; }
    });
  for (std::thread& writer : writers) writer.join();
  EXPECT_EQ(failed, 0);
  const std::string text = read_file(path("a"));
  EXPECT_EQ(text, std::string(200000, text.at(0)));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 2);
}

TEST_F(File, TakesTheLongestNames) {
  const std::string longest(255, 'n');
  replace_file(path(longest), "x");
  EXPECT_EQ(read_file(path(longest)), "x");
  EXPECT_THROW(replace_file(path(longest + "n"), "x"), std::runtime_error);
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_.path()), {}), 1);
}

TEST_F(File, TakesAwayWhatProcessesThatAreNoMoreHaveLeft) {
  const std::string own = std::to_string(getpid());
  const pid_t gone = fork();
  if (gone == 0) _exit(0);
  ASSERT_GT(gone, 0);
  ASSERT_EQ(waitpid(gone, nullptr, 0), gone);
  const std::vector<std::string> kept = {"checkpoint.bin", ".topple-" + own + "-0.part", ".topple-x-0.part",
                                         ".topple-" + std::to_string(gone) + ".part", "topple-1-1.part"};
  for (const std::string& name : kept) replace_file(path(name), "kept");
  replace_file(path(".topple-" + std::to_string(gone) + "-17.part"), "half");
  EXPECT_EQ(find_unfinished_files(folder_.str()),
            std::vector<std::string>{path(".topple-" + std::to_string(gone) + "-17.part")});
  remove_unfinished_files(folder_.str());
  EXPECT_FALSE(fs::exists(path(".topple-" + std::to_string(gone) + "-17.part")));
  for (const std::string& name : kept) EXPECT_TRUE(fs::exists(path(name))) << name;
  remove_unfinished_files(path("missing"));
}

TEST_F(File, RefusesToReadWhatIsNotAFile) {
  EXPECT_THROW(read_file(path("missing")), InputError);
  EXPECT_THROW(read_file(folder_.str()), InputError);
}

}  // namespace
}  // namespace topple
