#pragma once
/// A real PostgreSQL of its own for a test: data folder below the temporary folder, loopback, a free port. A test that
/// runs as root starts it as another user, because PostgreSQL refuses root.

#include <arpa/inet.h>
#include <grp.h>
#include <netinet/in.h>
#include <pwd.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "study/database.h"

namespace topple::study {

/// Starts a program in a process group of its own; `user` (0: as we are) and its files go to `log`.
inline pid_t spawn(const std::vector<std::string>& words, const std::string& log, const passwd* user = nullptr) {
  std::vector<char*> arguments;
  for (const std::string& w : words) arguments.push_back(const_cast<char*>(w.c_str()));
  arguments.push_back(nullptr);
  const pid_t pid = fork();
  if (pid != 0) return pid;
  setpgid(0, 0);
  if (!freopen(log.c_str(), "a", stdout) || !freopen(log.c_str(), "a", stderr)) _exit(126);
  if (user && (setgroups(0, nullptr) != 0 || setgid(user->pw_gid) != 0 || setuid(user->pw_uid) != 0)) _exit(126);
  execv(arguments[0], arguments.data());
  _exit(127);
}

/// Its exit code, or minus the signal that ended it.
inline int wait_for(pid_t pid) {
  int status = 0;
  waitpid(pid, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

/// A port of the loopback that nobody listens on.
inline int find_port() {
  const int s = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in place{};
  place.sin_family = AF_INET;
  place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof place;
  if (bind(s, reinterpret_cast<sockaddr*>(&place), size) != 0 ||
      getsockname(s, reinterpret_cast<sockaddr*>(&place), &size) != 0)
    throw std::runtime_error("no free port");
  close(s);
  return ntohs(place.sin_port);
}

class Server {
 public:
  /// nullptr where PostgreSQL is not installed, or the build cannot reach one.
  static std::unique_ptr<Server> make(bool is_durable = false) {
#ifdef TOPPLE_POSTGRESQL
    namespace fs = std::filesystem;
    fs::path programs;
    if (fs::exists("/usr/lib/postgresql"))
      for (const auto& version : fs::directory_iterator("/usr/lib/postgresql"))
        if (fs::exists(version.path() / "bin/initdb")) programs = version.path() / "bin";
    if (programs.empty()) return nullptr;
    return std::unique_ptr<Server>(new Server(programs, is_durable));
#else
    (void)is_durable;
    return nullptr;
#endif
  }
  ~Server() {
    stop(SIGQUIT);
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  std::string url() const {
    return "postgresql://tester@127.0.0.1:" + std::to_string(port_) + "/postgres?sslmode=disable";
  }
  void start() {
    std::vector<std::string> words = {
        (programs_ / "postgres").string(), "-D", (folder_ / "data").string(), "-p", std::to_string(port_), "-c",
        "listen_addresses=127.0.0.1",      "-c", "unix_socket_directories=",  "-c", "max_connections=100"};
    if (!is_durable_) words.insert(words.end(), {"-c", "fsync=off"});
    // a server that was killed leaves children, which must have gone
    for (int attempt = 0; attempt < 600; ++attempt) {
      if (pid_ == 0) pid_ = spawn(words, (folder_ / "log").string(), user_);
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      if (waitpid(pid_, nullptr, WNOHANG) == pid_) pid_ = 0;
      try {
        open_database(url());
        return;
      } catch (const ConnectionLost&) { continue; }
    }
    throw std::runtime_error("PostgreSQL does not start; see " + (folder_ / "log").string());
  }
  /// SIGKILL as if the power went; SIGINT, SIGQUIT: PostgreSQL's fast and immediate shutdown.
  void stop(int signal) {
    if (pid_ == 0) return;
    kill(pid_, signal);
    waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }

 private:
  Server(const std::filesystem::path& programs, bool is_durable) : programs_(programs), is_durable_(is_durable) {
    std::string name = (std::filesystem::temp_directory_path() / "topple-server-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
    folder_ = name;
    if (geteuid() == 0) {
      user_ = getpwnam("postgres");
      if (!user_) user_ = getpwnam("nobody");
      if (!user_ || chown(name.c_str(), user_->pw_uid, user_->pw_gid) != 0) throw std::runtime_error("no user");
    }
    port_ = find_port();
    const int code = wait_for(spawn({(programs_ / "initdb").string(), "-D", (folder_ / "data").string(), "-U", "tester",
                                     "-A", "trust", "-N", "--locale=C", "-E", "UTF8"},
                                    (folder_ / "log").string(), user_));
    if (code != 0) throw std::runtime_error("initdb failed; see " + (folder_ / "log").string());
    start();
  }
  std::filesystem::path programs_, folder_;
  const passwd* user_ = nullptr;
  int port_ = 0;
  pid_t pid_ = 0;
  bool is_durable_ = false;
};

/// A temporary folder that goes with it.
class Folder {
 public:
  Folder() {
    std::string name = (std::filesystem::temp_directory_path() / "topple-study-XXXXXX").string();
    if (!mkdtemp(name.data())) throw std::runtime_error("no temporary folder");
    path_ = name;
  }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;
  const std::filesystem::path& path() const { return path_; }
  std::string operator/(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

}  // namespace topple::study
