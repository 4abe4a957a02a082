#include "study/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace topple::study {
namespace {

constexpr std::size_t most_said = 2000;  // of standard error that is kept

void close_end(int& fd) {
  if (fd >= 0) close(fd);
  fd = -1;
}

/// Whether the command is one program with its arguments. A shell that waits for it would hold its output open.
bool is_program(const std::string& command) {
  if (command.find_first_of(";|&()`\n") != std::string::npos) return false;
  const std::size_t begin = command.find_first_not_of(' ');
  if (begin == std::string::npos) return false;
  const std::string name = command.substr(begin, command.find(' ', begin) - begin);
  if (name.find_first_of("='\"$~\\{}!<>*?[]#") != std::string::npos) return false;
  if (name.find('/') != std::string::npos) return true;
  const char* path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');)
    if (access(folder.append("/").append(name).c_str(), X_OK) == 0) return true;
  return false;
}

}  // namespace

void Process::start(const std::string& command) {
  end();
  int in[2] = {-1, -1}, out[2] = {-1, -1}, error[2] = {-1, -1};
  const auto close_all = [&] {
    for (int* pair : {in, out, error})
      for (int k = 0; k < 2; ++k) close_end(pair[k]);
  };
  if (pipe2(in, O_CLOEXEC) != 0 || pipe2(out, O_CLOEXEC) != 0 || pipe2(error, O_CLOEXEC) != 0) {
    close_all();
    throw std::runtime_error(fmt::format("no pipe for the evaluator: {}", std::strerror(errno)));
  }
  // who writes to a program that has ended gets an error, not a signal
  sigset_t broken;
  sigemptyset(&broken);
  sigaddset(&broken, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &broken, nullptr);
  const std::string line = is_program(command) ? "exec " + command : command;
  const char* words[] = {"/bin/sh", "-c", line.c_str(), nullptr};
  const pid_t parent = getpid(), pid = fork();
  if (pid == 0) {
    setpgid(0, 0);
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(126);
    sigset_t none;
    sigemptyset(&none);
    sigprocmask(SIG_SETMASK, &none, nullptr);
    std::signal(SIGPIPE, SIG_DFL);
    if (dup2(in[0], 0) < 0 || dup2(out[1], 1) < 0 || dup2(error[1], 2) < 0) _exit(126);
    execv(words[0], const_cast<char**>(words));
    _exit(127);
  }
  if (pid < 0) {
    const int why = errno;
    close_all();
    throw std::runtime_error(fmt::format("no process for the evaluator: {}", std::strerror(why)));
  }
  setpgid(pid, pid);  // whoever is first
  pid_ = pid;
  in_ = in[1], out_ = out[0], error_ = error[0];
  close(in[0]), close(out[1]), close(error[1]);
  for (const int fd : {in_, out_, error_}) fcntl(fd, F_SETFL, O_NONBLOCK);
  to_write_.clear(), read_.clear(), said_.clear();
  searched_ = 0;
  close_after_ = false;
}

void Process::end() {
  if (pid_ <= 0) return;
  kill(-pid_, SIGKILL);
  kill(pid_, SIGKILL);
  waitpid(pid_, nullptr, 0);
  pid_ = 0;
  close_end(in_), close_end(out_), close_end(error_);
}

void Process::send(const std::string& text, bool close) {
  to_write_ += text;
  close_after_ = close;
}

bool Process::take_line(std::string& line) {
  const std::size_t end = read_.find('\n', searched_);
  searched_ = read_.size();
  if (end == std::string::npos) return false;
  line = read_.substr(0, end);
  read_.erase(0, end + 1);
  searched_ = 0;
  if (!line.empty() && line.back() == '\r') line.pop_back();
  return true;
}

void Process::look() {
  char buffer[65536];
  for (ssize_t n = 0; out_ >= 0 && read_.size() < longest_line && (n = read(out_, buffer, sizeof buffer)) > 0;)
    read_.append(buffer, static_cast<std::size_t>(n));
}

bool Process::has_ended() const {
  siginfo_t info{};
  return pid_ > 0 && waitid(P_PID, static_cast<id_t>(pid_), &info, WEXITED | WNOHANG | WNOWAIT) == 0 &&
         info.si_pid == pid_;
}

Process::Event Process::next_line(std::string& line, double seconds, const std::atomic<bool>& cancel) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  auto looked = start, heard = start;  // heard: it, or behind its end what it started
  constexpr int patience = 50;         // for a cancellation [ms]
  for (;;) {
    is_whole_ = true;
    if (take_line(line)) return Event::Line;
    if (read_.size() > longest_line) {
      line = read_.substr(0, 100);
      return Event::TooLong;
    }
    if (out_ < 0) {
      // a last line without its end
      if (read_.empty()) return Event::Closed;
      line = std::exchange(read_, {});
      is_whole_ = false;
      searched_ = 0;
      return Event::Line;
    }
    if (cancel.load(std::memory_order_relaxed)) return Event::Cancelled;
    const auto now = Clock::now();
    if (seconds > 0 && std::chrono::duration<double>(now - start).count() > seconds) {
      look();  // it may have come while we were stopped
      if (take_line(line)) return Event::Line;
      return Event::TimeOut;
    }
    // what it started may hold its output open, and may have a last word
    if (now - looked > std::chrono::milliseconds(patience)) {
      looked = now;
      if (!has_ended()) {
        heard = now;
      } else if (now - heard > std::chrono::seconds(1)) {
        look();
        close_end(out_);
        continue;
      }
    }
    if (in_ >= 0 && to_write_.empty() && close_after_) close_end(in_);
    pollfd wanted[3] = {{out_, POLLIN, 0}, {error_, POLLIN, 0}, {to_write_.empty() ? -1 : in_, POLLOUT, 0}};
    if (poll(wanted, 3, patience) <= 0) continue;
    char buffer[65536];
    if (wanted[0].revents) {
      const ssize_t n = read(out_, buffer, sizeof buffer);
      if (n > 0) read_.append(buffer, static_cast<std::size_t>(n)), heard = Clock::now();
      if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) close_end(out_);
    }
    if (wanted[1].revents) {
      const ssize_t n = read(error_, buffer, sizeof buffer);
      if (n > 0) said_.append(buffer, static_cast<std::size_t>(n));
      if (said_.size() > 2 * most_said) said_.erase(0, said_.size() - most_said);
      if (n == 0 || (n < 0 && errno != EAGAIN && errno != EINTR)) close_end(error_);
    }
    if (wanted[2].revents) {
      const ssize_t n = write(in_, to_write_.data(), to_write_.size());
      if (n > 0) to_write_.erase(0, static_cast<std::size_t>(n));
      if (n < 0 && errno != EAGAIN && errno != EINTR) {
        close_end(in_);
        to_write_.clear();
      }
    }
  }
}

std::string Process::find_ending() {
  if (pid_ <= 0) return {};
  close_end(in_);
  // it closed its output and should end; a child may hold standard error open
  int status = 0;
  bool has_ended = false;
  for (int i = 0; i < 100 && !has_ended; ++i) {
    has_ended = waitpid(pid_, &status, WNOHANG) == pid_;
    if (!has_ended) usleep(10000);
  }
  char buffer[4096];
  for (ssize_t n = 0; error_ >= 0 && (n = read(error_, buffer, sizeof buffer)) > 0;)
    said_.append(buffer, static_cast<std::size_t>(n));
  std::string words;
  if (!has_ended) {
    words = "it closed its output and went on";
    end();
  } else {
    kill(-pid_, SIGKILL);  // what it started
    pid_ = 0;
    close_end(out_), close_end(error_);
    // a shell tells of a signal by its exit code
    const bool is_shells = WIFEXITED(status) && WEXITSTATUS(status) > 128 && WEXITSTATUS(status) <= 128 + SIGSYS;
    const int signal = WIFSIGNALED(status) ? WTERMSIG(status) : is_shells ? WEXITSTATUS(status) - 128 : 0;
    if (signal > 0)
      words = fmt::format("signal {} ({})", signal, strsignal(signal));
    else if (WEXITSTATUS(status) != 0)
      words = fmt::format("exit code {}", WEXITSTATUS(status));
  }
  while (!said_.empty() && std::isspace(static_cast<unsigned char>(said_.back()))) said_.pop_back();
  if (said_.size() > most_said) said_ = "..." + said_.substr(said_.size() - most_said);
  if (!said_.empty()) words += (words.empty() ? "" : ": ") + said_;
  return words;
}

}  // namespace topple::study
