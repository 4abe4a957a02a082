#include "base/file.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>

#include "base/error.h"
#include "base/unfinished_file.h"

namespace topple {

namespace {

/// The name under which a file is being written, for signal handlers; of several at once, one.
class UnfinishedName {
 public:
  explicit UnfinishedName(const std::string& path) {
    bool expected = false;
    if (path.size() >= sizeof shown_name || !is_taken.compare_exchange_strong(expected, true)) return;
    std::memcpy(shown_name, path.c_str(), path.size() + 1);
    is_own_ = true;
    is_shown = true;
  }
  ~UnfinishedName() {
    if (!is_own_) return;
    is_shown = false;
    is_taken = false;
  }
  UnfinishedName(const UnfinishedName&) = delete;
  UnfinishedName& operator=(const UnfinishedName&) = delete;
  static const char* get() { return is_shown ? shown_name : nullptr; }

 private:
  inline static char shown_name[4096] = {};
  inline static std::atomic<bool> is_taken = false, is_shown = false;
  static_assert(std::atomic<bool>::is_always_lock_free);
  bool is_own_ = false;
};

/// Closes its descriptor.
class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  int number() const { return number_; }
  /// Closes now, so that the answer can be looked at.
  int close() {
    const int answer = ::close(number_);
    number_ = -1;
    return answer;
  }

 private:
  int number_;
};

std::string reason_of(int error) { return std::generic_category().message(error); }

[[noreturn]] void fail(const std::string& path, const std::string& reason) {
  throw std::runtime_error("cannot write " + path + ": " + reason);
}

/// The file's new bytes, on disk under another name; errno, 0 when all is well.
int write_whole(const std::string& path, std::string_view bytes) {
  Descriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
  if (file.number() < 0) return errno;
  while (!bytes.empty()) {
    const ssize_t count = ::write(file.number(), bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  // a file system without fsync says EINVAL, which is not a failure to write
  if (::fsync(file.number()) != 0 && errno != EINVAL) return errno;
  return file.close() == 0 ? 0 : errno;
}

}  // namespace

std::string read_file(const std::string& path) {
  const auto complain = [&](int error) {
    throw InputError("E701", "cannot read " + path + ": " + reason_of(error), "check the path and its permissions");
  };
  Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.number() < 0) complain(errno);
  std::string bytes;
  std::size_t size = 0;
  for (;;) {
    bytes.resize(size + (std::size_t{1} << 20));
    const ssize_t count = ::read(file.number(), bytes.data() + size, bytes.size() - size);
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) complain(errno);
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  bytes.resize(size);
  return bytes;
}

void remove_unfinished_file() {
  if (const char* name = UnfinishedName::get()) ::unlink(name);
}

void replace_file(const std::string& path, std::string_view bytes) {
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  std::error_code error;
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  if (error) fail(path, error.message());
  const std::string beside = path + ".part";
  const UnfinishedName unfinished(beside);
  if (const int number = write_whole(beside, bytes); number != 0) {
    ::unlink(beside.c_str());
    fail(path, reason_of(number));
  }
  std::filesystem::rename(beside, path, error);
  if (error) {
    ::unlink(beside.c_str());
    fail(path, error.message());
  }
}

}  // namespace topple
