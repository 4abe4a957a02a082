#include "terminal.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "base/unit.h"

namespace topple::apps {

bool has_colour(std::FILE* f) {
  const char* no = std::getenv("NO_COLOR");
  return (no == nullptr || *no == '\0') && isatty(fileno(f)) != 0;
}

std::string wrap(const std::string& text, int width, int indent) {
  std::string out;
  int column = indent;
  size_t i = 0;
  while (i < text.size()) {
    const size_t end = std::min(text.find(' ', i), text.size());
    const int length = static_cast<int>(end - i);
    if (column > indent) {
      if (width > 0 && column + 1 + length > width) {
        out += "\n" + std::string(static_cast<size_t>(indent), ' ');
        column = indent;
      } else {
        out += ' ';
        ++column;
      }
    }
    out.append(text, i, end - i);
    column += length;
    i = end + 1;
  }
  return out;
}

std::string to_printable(const std::string& text) {
  std::string out;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const auto next = i + 1 < text.size() ? static_cast<unsigned char>(text[i + 1]) : 0U;
    if (c == '\n' || c == '\r' || c == '\t') {
      out += ' ';
    } else if (c < 0x20 || c == 0x7F) {
      out += '?';
    } else if (c == 0xC2 && next >= 0x80 && next < 0xA0) {  // U+0080 to U+009F
      out += '?';
      ++i;
    } else {
      out += text[i];
    }
  }
  return out;
}

std::string quote_word(const std::string& word) {
  const auto is_plain = [](char c) {
    constexpr std::string_view signs = "_-./,:=@%+";
    const auto u = static_cast<unsigned char>(c);
    return u >= 128 || std::isalnum(u) != 0 || signs.find(c) != std::string_view::npos;
  };
  if (!word.empty() && std::all_of(word.begin(), word.end(), is_plain)) return word;
  if (word.find_first_of("\"$`\\!") == std::string::npos) return '"' + word + '"';
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

int find_width(std::FILE* f) {
  winsize size{};
  if (isatty(fileno(f)) == 0) return 0;
  if (ioctl(fileno(f), TIOCGWINSZ, &size) != 0 || size.ws_col == 0) return 80;
  return std::clamp(static_cast<int>(size.ws_col), 40, 120);
}

ProgressLine::ProgressLine() : is_terminal_(isatty(fileno(stderr)) != 0), start_(Clock::now()), last_(start_) {}

std::string ProgressLine::words(double done, double whole, double elapsed) {
  const double factor = elapsed > 0 ? done / elapsed : 0;
  const double left = done > 0 ? elapsed * (whole - done) / done : 0;
  return fmt::format("{:.2f} of {:.2f} s simulated, {:.2f} x real time, about {:.0f} s left", done, whole, factor,
                     left);
}

bool ProgressLine::is_due() {
  const Clock::time_point now = Clock::now();
  if (std::chrono::duration<double>(now - last_).count() < (is_terminal_ ? 0.1 : 5.0)) return false;
  last_ = now;
  return true;
}

void ProgressLine::show_bar(double share, const std::string& text) {
  if (!is_terminal_) {
    std::fprintf(stderr, "%s\n", text.c_str());
    return;
  }
  constexpr int width = 24;
  const int full = std::clamp(static_cast<int>(width * share), 0, width);
  std::fprintf(stderr, "\r\x1b[K[%s%s] %s", std::string(static_cast<size_t>(full), '=').c_str(),
               std::string(static_cast<size_t>(width - full), ' ').c_str(), text.c_str());
  std::fflush(stderr);
  is_shown_ = true;
}

void ProgressLine::show(double done, double whole) {
  if (is_due()) show_bar(done / whole, words(done, whole, std::chrono::duration<double>(last_ - start_).count()));
}

void ProgressLine::show_work(const std::string& what, double done, double whole) {
  if (!is_due() || !(whole > 0)) return;
  const double elapsed = std::chrono::duration<double>(last_ - start_).count();
  const double left = done > 0 ? elapsed * (whole - done) / done : 0;
  show_bar(done / whole, fmt::format("{}: {:.0f} %{}", what, 100 * done / whole,
                                     done > 0 ? fmt::format(", about {:.0f} s left", left) : std::string()));
}

void ProgressLine::say(const std::string& text) {
  if (!is_due()) return;
  if (!is_terminal_) {
    std::fprintf(stderr, "%s\n", text.c_str());
    return;
  }
  std::fprintf(stderr, "\r\x1b[K%s", text.c_str());
  std::fflush(stderr);
  is_shown_ = true;
}

void ProgressLine::clear() {
  if (!is_shown_) return;
  std::fprintf(stderr, "\r\x1b[K");
  std::fflush(stderr);
  is_shown_ = false;
}

EventPrinter::EventPrinter(std::FILE* out, bool verbose, ProgressLine& progress)
    : out_(out), verbose_(verbose), colour_(has_colour(out)), progress_(progress) {}

void EventPrinter::print(const record::Event& e) {
  static const std::map<std::string, int> most{{"yield", 3},   {"softening", 4}, {"crushing", 4}, {"rupture", 8},
                                               {"release", 4}, {"touchdown", 4}, {"contact", 0}};
  const auto limit = most.find(e.kind);
  if (!verbose_ && limit != most.end()) {
    const int n = ++shown_[e.kind];
    if (n > limit->second) {
      if (n == limit->second + 1 && limit->second > 0) {
        progress_.clear();
        std::fprintf(out_, "  %8.3f s  ... more of kind \"%s\" in the record (--verbose shows all)\n", e.time,
                     e.kind.c_str());
      }
      return;
    }
  }
  progress_.clear();
  const bool strong = e.kind == "stage" || e.kind == "failure" || e.kind == "rest";
  std::fprintf(out_, "  %8.3f s  %s%s%s\n", e.time, strong && colour_ ? "\x1b[1m" : "", e.text.c_str(),
               strong && colour_ ? "\x1b[0m" : "");
  std::fflush(out_);
}

std::string tell_counts(const record::Counts& c, double standing_mass) {
  std::string text = fmt::format(
      "Model: {} rigid bodies, {} revolute joints, {} rigid joints, {} force elements{}; {:.0f} t", c.bodies,
      c.revolute_joints, c.rigid_joints, c.force_elements,
      c.cables > 0 ? fmt::format(", {} cable{}", c.cables, c.cables == 1 ? "" : "s") : "", standing_mass / unit::t);
  // what stays: stumps below charges
  const long all = std::lround(standing_mass / unit::t), moving = std::lround(c.mass / unit::t);
  if (moving != all) text += fmt::format(", {} t of it in motion ({} t of stumps stay)", moving, all - moving);
  return text;
}

void print_findings(std::FILE* out, const record::Record& r) {
  const bool colour = has_colour(out);
  const int width = find_width(out);
  std::string heading;
  for (const record::Finding& f : r.findings) {
    if (f.heading != heading) {
      heading = f.heading;
      std::fprintf(out, "\n%s%s%s\n", colour ? "\x1b[1m" : "", heading.c_str(), colour ? "\x1b[0m" : "");
    }
    const char* mark = "  ";
    const char* tint = "";
    switch (f.status) {
      case record::Status::Info:
        break;
      case record::Status::Good:
        mark = "ok", tint = "\x1b[32m";
        break;
      case record::Status::Warning:
        mark = "! ", tint = "\x1b[33m";
        break;
      case record::Status::Bad:
        mark = "X ", tint = "\x1b[31m";
        break;
      case record::Status::NotJudged:
        mark = "? ", tint = "\x1b[33m";
        break;
    }
    // "Mechanism: topple" under "Mechanism" says what its text says
    const std::string title = f.title == heading || f.title.rfind(heading + ": ", 0) == 0 ? "" : f.title + ": ";
    std::fprintf(out, "  %s%s%s %s\n", colour ? tint : "", mark, colour ? "\x1b[0m" : "",
                 wrap(title + f.text, width, 5).c_str());
  }
}

}  // namespace topple::apps
