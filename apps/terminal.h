#pragma once
/// What people see while it runs: progress, events, findings.

#include <chrono>
#include <cstdio>
#include <map>
#include <string>

#include "record/record.h"

namespace topple::apps {

/// Whether escape sequences may be written to a stream: a terminal, and NO_COLOR unset or empty.
bool has_colour(std::FILE*);

/// Columns of a terminal, 40 to 120; 0 where lines may be as long as they like.
int find_width(std::FILE*);

/// Breaks a text at spaces so that no line passes `width`, if that is not 0. Lines after the first begin with `indent`
/// spaces; the first is printed after as many.
std::string wrap(const std::string& text, int width, int indent);

/// A text from elsewhere without what a terminal would obey: line breaks and tabs become spaces, other control
/// characters question marks.
std::string to_printable(const std::string&);

/// A word as a shell takes it: in quotation marks where it needs them.
std::string quote_word(const std::string&);

/// Progress of simulated time on standard error: one line that renews itself on a terminal, a line now and then
/// otherwise.
class ProgressLine {
 public:
  ProgressLine();
  void show(double done, double whole);
  /// Words of one's own, for work that has no simulated time.
  void say(const std::string& words);
  /// Done and whole amount of work, with what is left.
  void show_work(const std::string& what, double done, double whole);
  /// Takes the line away, so that something else can be written.
  void clear();
  /// Words of the line: simulated time, real-time factor and what is left.
  static std::string words(double done, double whole, double elapsed);

 private:
  using Clock = std::chrono::steady_clock;
  bool is_due();
  void show_bar(double share, const std::string& words);
  bool is_terminal_ = false, is_shown_ = false;
  Clock::time_point start_, last_;
};

/// Prints events as they happen; of the frequent kinds only the first few, unless `verbose`.
class EventPrinter {
 public:
  EventPrinter(std::FILE* out, bool verbose, ProgressLine& progress);
  void print(const record::Event&);

 private:
  std::FILE* out_;
  bool verbose_, colour_;
  ProgressLine& progress_;
  std::map<std::string, int> shown_;
};

void print_findings(std::FILE*, const record::Record&);
std::string tell_counts(const record::Counts&, double standing_mass);

}  // namespace topple::apps
