#pragma once
/// A command that runs beside us and is talked to in lines.

#include <sys/types.h>

#include <atomic>
#include <functional>
#include <string>

namespace topple::study {

/// A shell command with its standard streams on pipes, in a process group of its own. Used by one thread.
class Process {
 public:
  Process() = default;
  ~Process() { end(); }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// Throws std::runtime_error if no process can be made.
  void start(const std::string& command);
  bool is_running() const { return pid_ > 0; }
  /// Kills it with all its children.
  void end();

  enum class Event { Line, Closed, TimeOut, Cancelled, TooLong };
  /// Text that will be written while we wait for lines. `close`: and then the end of the file.
  void send(const std::string& text, bool close);
  /// Waits for the next line of its output; `seconds` <= 0: for ever. Closed: it ended, whoever else holds its output
  /// open and is silent, or closed its output. TooLong: more than longest_line bytes without an end; `line` has the
  /// first hundred of them.
  Event next_line(std::string& line, double seconds, const std::atomic<bool>& cancel);
  /// Whether the last line had an end: output may break off within one.
  bool is_whole() const { return is_whole_; }
  /// How it ended, after Closed: "exit code 3", "signal 11 (Segmentation fault)", with the end of what it wrote on
  /// standard error. Empty for exit code 0 without words. It is not running any more.
  std::string find_ending();

  static constexpr std::size_t longest_line = std::size_t{16} << 20;
  /// A whole line that it has written and nobody has taken; false: there is none.
  bool take_line(std::string& line);
  /// Takes in what it has written so far, without waiting.
  void look();

 private:
  bool has_ended() const;

  pid_t pid_ = 0;
  int in_ = -1, out_ = -1, error_ = -1;
  std::string to_write_, read_, said_;
  std::size_t searched_ = 0;  // bytes of read_ without an end of a line
  bool close_after_ = false, is_whole_ = true;
};

}  // namespace topple::study
