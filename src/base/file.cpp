#include "base/file.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "base/error.h"
#include "base/unfinished_file.h"

namespace topple {

namespace {

// .topple-PROCESS-NUMBER.part, beside what it will replace
constexpr std::string_view kUnfinished = ".topple-", kUnfinishedEnd = ".part";

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

/// All of `bytes` into an open file, on disk, which is then closed; errno, 0 when all is well.
int write_whole(Descriptor& file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file.number(), bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  // a file system without fsync, a device and a pipe say EINVAL, which is not a failure to write
  if (::fsync(file.number()) != 0 && errno != EINVAL) return errno;
  return file.close() == 0 ? 0 : errno;
}

/// What a link stands for, whether that is there or not; a link still if there is no end to it.
std::filesystem::path resolve_links(std::filesystem::path path) {
  std::error_code error;
  if (std::filesystem::path whole = std::filesystem::canonical(path, error); !error) return whole;
  constexpr int most = 40;  // as the system does
  for (int i = 0; i < most && std::filesystem::is_symlink(path, error); ++i) {
    const std::filesystem::path next = std::filesystem::read_symlink(path, error);
    if (error) break;
    path = path.parent_path() / next;  // an absolute one stands alone
  }
  return path;
}

/// Writes to `beside`, a name that nobody has, and renames it to `target`; with the rights of `old`, if there is one.
int write_beside(const std::string& beside, const std::string& target, std::string_view bytes, const struct stat* old) {
  const UnfinishedName unfinished(beside);
  Descriptor file(::open(beside.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
  if (file.number() < 0) return errno;
  int error = 0;
  if (old != nullptr) {
    // only root can give a file away
    if (::fchown(file.number(), old->st_uid, old->st_gid) != 0) error = 0;
    if (::fchmod(file.number(), old->st_mode & 07777) != 0) error = errno;
  }
  if (error == 0) error = write_whole(file, bytes);
  if (error == 0 && ::rename(beside.c_str(), target.c_str()) != 0) error = errno;
  if (error != 0) ::unlink(beside.c_str());
  return error;
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
  struct stat old {};
  const bool is_there = ::stat(path.c_str(), &old) == 0;
  if (is_there && S_ISDIR(old.st_mode)) fail(path, reason_of(EISDIR));
  if (is_there && !S_ISREG(old.st_mode)) {  // a device or a pipe is written to
    Descriptor file(::open(path.c_str(), O_WRONLY | O_CLOEXEC | O_NOCTTY));
    if (const int number = file.number() < 0 ? errno : write_whole(file, bytes); number != 0)
      fail(path, reason_of(number));
    return;
  }
  const std::filesystem::path target = resolve_links(path), folder = target.parent_path();
  std::error_code error;
  if (std::filesystem::is_symlink(target, error)) fail(path, reason_of(ELOOP));
  error.clear();
  if (!folder.empty()) std::filesystem::create_directories(folder, error);
  if (error) fail(path, error.message());
  static std::atomic<unsigned> count = 0;
  constexpr int most = 100;  // names that others may have
  int number = EEXIST;
  for (int i = 0; i < most && number == EEXIST; ++i) {
    std::string name(kUnfinished);
    name += std::to_string(::getpid()) + "-" + std::to_string(count++);
    name += kUnfinishedEnd;
    number = write_beside(folder / name, target, bytes, is_there ? &old : nullptr);
  }
  if (number != 0) fail(path, reason_of(number));
}

std::vector<std::string> find_unfinished_files(const std::string& folder) {
  std::error_code ignored;
  std::vector<std::string> found;
  for (const auto& entry : std::filesystem::directory_iterator(folder, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kUnfinished) || !name.ends_with(kUnfinishedEnd)) continue;
    pid_t process = 0;
    const char *begin = name.data() + kUnfinished.size(), *end = name.data() + name.size();
    const auto [behind, error] = std::from_chars(begin, end, process);
    if (error != std::errc() || process <= 0 || behind == end || *behind != '-') continue;
    if (::kill(process, 0) != 0 && errno == ESRCH) found.push_back(entry.path().string());
  }
  std::sort(found.begin(), found.end());
  return found;
}

void remove_unfinished_files(const std::string& folder) {
  std::error_code ignored;
  for (const std::string& path : find_unfinished_files(folder)) std::filesystem::remove(path, ignored);
}

}  // namespace topple
