#include "study_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "study/requirement.h"
#include "study/results.h"
#include "study/story.h"
#include "terminal.h"

namespace topple::apps {

namespace {

using study::Problem;
using study::StudyResult;

constexpr std::size_t most_columns = 3;  // of levels on a line

std::string words_of_time(double seconds) {
  if (seconds < 100) return fmt::format("{:.0f} s", seconds);
  if (seconds < 6000) return fmt::format("{:.0f} min", seconds / 60);
  return fmt::format("{:.1f} h", seconds / 3600);
}

void print_heading(std::FILE* out, const char* text) { std::fprintf(out, "\n%s\n", text); }

void print_line(std::FILE* out, const std::string& text) {
  std::fprintf(out, "  %s\n", wrap(to_printable(text), find_width(out), 2).c_str());
}

/// "0.031", "4.5", "37", "100": two digits, no powers of ten for whole percentages.
std::string words_of_percent(double percent) {
  return percent >= 9.95 ? fmt::format("{:.0f}", percent) : fmt::format("{:.2g}", percent);
}

void print_head_of_degrees(std::FILE* out, const char* title) {
  std::fprintf(out, "\n%-27s possibility   necessity\n                               at least     at most    runs\n",
               title);
}

/// Whether one of the two may change.
bool print_degrees(std::FILE* out, const std::string& name, double possibility, bool is_found, double necessity,
                   bool is_necessity_found, long runs) {
  std::fprintf(out, "  %-26s %11s%s %9s%s %6ld\n", to_printable(name).c_str(),
               study::words_of_least(possibility, 5).c_str(), is_found ? " " : "*",
               study::words_of_most(necessity, 5).c_str(), is_necessity_found ? " " : "*", runs);
  return !is_found || !is_necessity_found;
}

void print_open_degrees(std::FILE* out, bool has_open, const StudyResult& r) {
  if (has_open && r.is_finished)
    print_line(out, "* no search has ended there: a possibility may be higher, a necessity lower");
}

void print_outcomes(std::FILE* out, const Problem& p, const StudyResult& r) {
  if (r.alpha.classes.size() < 2 && (r.outcomes.empty() || r.outcomes[0].empty())) return;
  print_head_of_degrees(out, "Outcomes");
  bool has_open = false;
  for (const auto& c : r.alpha.classes) {
    const bool is_open =
        print_degrees(out, study::words_of_outcome(r, c.outcome), study::possibility_of(r, c),
                      study::is_possibility_converged(r, c), uncertainty::calc_necessity(r.possibilities, c.outcome),
                      study::is_necessity_converged(p, r, c.outcome), c.count);
    has_open = has_open || is_open;
  }
  for (const std::string& name : study::list_unmet_outcomes(p, r)) {
    has_open = true;
    std::fprintf(out, "  %-26s %11.5f* %9.5f  %6d   not met in %zu runs\n", name.c_str(), 0.0, 0.0, 0,
                 static_cast<std::size_t>(r.alpha.archive.size()));
  }
  print_open_degrees(out, has_open, r);
}

void print_requirement(std::FILE* out, const Problem& p, const StudyResult& r) {
  const std::vector<study::RequirementClass> classes = study::list_requirement(p, r);
  if (classes.empty()) return;
  print_head_of_degrees(out, "Requirement");
  bool has_open = false;
  for (const study::RequirementClass& c : classes) {
    const bool is_open = print_degrees(out, c.name, c.found.possibility, c.found.converged, c.necessity,
                                       c.is_necessity_converged, c.runs);
    has_open = has_open || is_open;
  }
  print_open_degrees(out, has_open, r);
}

/// Some levels of each output; files hold all of them.
void print_outputs(std::FILE* out, const Problem& p, const StudyResult& r) {
  if (r.alpha.outputs.empty() || r.outputs.empty()) return;
  const auto& levels = r.alpha.outputs.front().levels;
  std::vector<std::size_t> shown;
  for (std::size_t k = 0; k < most_columns && k < levels.size(); ++k)
    shown.push_back(levels.size() <= most_columns ? k : k * (levels.size() - 1) / (most_columns - 1));
  std::size_t width = 6;
  const auto title = [&](std::size_t o) {
    const study::Quantity q = study::find_output(p, r.outputs[o]);
    return to_printable(q.unit.empty() ? q.name : q.name + " [" + q.unit + "]");
  };
  for (std::size_t o = 0; o < r.outputs.size(); ++o) width = std::max(width, title(o).size());
  std::string head = fmt::format("{:<{}}", "Output", width + 2);
  for (const std::size_t k : shown) head += fmt::format("  {:^23}", fmt::format("alpha = {:.4g}", levels[k].alpha));
  std::fprintf(out, "\n%s\n", head.c_str());
  bool has_open = false, has_hidden = false, has_gap = false;
  for (std::size_t o = 0; o < r.alpha.outputs.size() && o < r.outputs.size(); ++o) {
    const double unit = study::find_output(p, r.outputs[o]).unit_value;
    const uncertainty::LevelBounds& support = r.alpha.outputs[o].levels.front();
    const int digits = study::calc_digits(support.lower.value, support.upper.value, 5);
    std::string line = fmt::format("  {:<{}}", title(o), width);
    for (const std::size_t k : shown) {
      const auto& l = r.alpha.outputs[o].levels[k];
      const auto bound = [unit, digits](const uncertainty::Bound& b) {
        return b.sample < 0 ? std::string("-")
                            : fmt::format("{:.{}g}{}", b.value / unit + 0.0, digits, b.converged ? "" : "*");
      };
      line += fmt::format("  {:>10} to {:<9}", bound(l.lower), bound(l.upper));
      has_gap = has_gap || l.lower.sample < 0;
    }
    for (std::size_t k = 0; k < r.alpha.outputs[o].levels.size(); ++k) {
      const auto& l = r.alpha.outputs[o].levels[k];
      bool& is_open = std::find(shown.begin(), shown.end(), k) != shown.end() ? has_open : has_hidden;
      for (const uncertainty::Bound& b : {l.lower, l.upper}) is_open = is_open || (b.sample >= 0 && !b.converged);
    }
    std::fprintf(out, "%s\n", line.substr(0, line.find_last_not_of(' ') + 1).c_str());
  }
  if (has_open && r.is_finished) std::fprintf(out, "  * no search has converged there\n");
  if (has_hidden && r.is_finished)
    std::fprintf(out, "  at levels that are not shown there are bounds at which no search has converged\n");
  if (has_gap) std::fprintf(out, "  - no run has a value there\n");
}

/// "fc 0.45 +- 0.08; not told apart from nothing: Ec, As".
std::string words_of_drivers(const Problem& p, const std::vector<uncertainty::Driver>& drivers) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < drivers.size(); ++i)
    if (p.space.inputs[i].width() > 0) order.push_back(i);
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return drivers[a].first > drivers[b].first; });
  std::string known, unknown;
  bool has_total = false;
  const std::vector<std::string> names = study::make_short_names(p.inputs);
  for (const std::size_t i : order) {
    const uncertainty::Driver& d = drivers[i];
    if (study::is_share_known(d)) {
      known += fmt::format("{}{} {:.2f} +- {:.2f}", known.empty() ? "" : ", ", names[i], d.first, d.first_error);
      if (std::isfinite(d.total)) known += fmt::format(" (with others {:.2f} +- {:.2f})", d.total, d.total_error);
    } else {
      unknown += fmt::format("{}{}", unknown.empty() ? "" : ", ", names[i]);
      // what acts only together with others has a total that is known
      if (!(d.total > 2 * d.total_error) || !(d.total >= 0.05)) continue;
      unknown += fmt::format(" (with others {:.2f} +- {:.2f})", d.total, d.total_error);
      has_total = true;
    }
  }
  if (known.empty()) return has_total ? "unknown alone: " + unknown : "unknown: no share is larger than its error";
  return unknown.empty() ? known : known + "; unknown: " + unknown;
}

void print_drivers(std::FILE* out, const Problem& p, const StudyResult& r) {
  const study::Insights& in = r.insights;
  if (in.source != study::Insights::Source::None) {
    print_heading(out, "Drivers: part of the variance that an input explains alone, over the support");
    for (const auto& c : in.drivers.outcomes)
      if (in.drivers.outcomes.size() > 1)
        print_line(out,
                   fmt::format("outcome {}: {}", study::words_of_outcome(r, c.outcome), words_of_drivers(p, c.inputs)));
    for (std::size_t o = 0; o < in.drivers.outputs.size() && o < r.outputs.size(); ++o)
      print_line(out, fmt::format("{}: {}", r.outputs[o], words_of_drivers(p, in.drivers.outputs[o])));
    print_line(out, in.source == study::Insights::Source::Design
                        ? fmt::format("From {} rows of Sobol's design.", in.drivers.rows)
                        : fmt::format("From {} spread runs.", in.drivers.rows));
  }
  if (in.knowing.empty()) return;
  print_heading(out, "If an input were known to have its core value, possibilities would be (at least)");
  bool has_open = false;
  for (const auto& f : in.knowing) {
    std::string text = study::make_short_names(p.inputs)[static_cast<std::size_t>(f.input)] + ":";
    for (const auto& c : r.alpha.classes) {
      double degree = 0;
      bool is_converged = false;
      for (const auto& k : f.classes)
        if (k.outcome == c.outcome) degree = k.possibility, is_converged = k.converged;
      text += fmt::format(" {} {}{},", study::words_of_outcome(r, c.outcome), study::words_of_least(degree),
                          is_converged ? "" : "*");
      has_open = has_open || !is_converged;
    }
    text.pop_back();
    print_line(out, text);
  }
  if (has_open) print_line(out, "* no search has ended there; it may be higher");
}

void print_boxes(std::FILE* out, const Problem& p, const StudyResult& r) {
  if (!r.insights.has_boxes) return;
  const uncertainty::DesignResult& d = r.insights.boxes;
  print_heading(out, "Permissible values");
  if (d.spread > 0)
    print_line(out,
               fmt::format("asked: {}; kept by {:.1f} % of the support ({:.1f} % standard error, of {} spread runs)",
                           p.permissible, 100 * d.fraction, 100 * d.fraction_error, d.spread));
  else
    print_line(out,
               fmt::format("asked: {}; no spread run tells by which part of the support it is kept", p.permissible));
  if (d.boxes.empty()) print_line(out, "no box was found");
  int kept = 0;
  for (const uncertainty::PermissibleBox& b : d.boxes) {
    std::string text = fmt::format("{}, {} % of the support: ", b.kept ? fmt::format("box {}", ++kept) : "dropped box",
                                   words_of_percent(100 * b.volume));
    for (std::size_t i = 0; i < p.inputs.size(); ++i)
      text += fmt::format("{}{} {} to {}", i ? ", " : "", study::make_short_names(p.inputs)[i],
                          study::words_of_number(b.box.lower[i] / p.inputs[i].unit_value,
                                                 p.space.inputs[i].width() / p.inputs[i].unit_value),
                          study::words_of_value(p.inputs[i], b.box.upper[i], p.space.inputs[i].width()));
    print_line(out, text);
    print_line(out, study::tell_guarantee(b, d.forbidden + d.failed, p.space.has_interaction()));
  }
}

/// What whole runs say of a condensed study.
void print_confirmation(std::FILE* out, const Problem& p, const StudyResult& r) {
  const study::Confirmation& c = r.confirmation;
  if (c.limit == 0) return;
  using State = study::Confirmation::State;
  const auto count = [&c](State s) {
    return std::count_if(c.bounds.begin(), c.bounds.end(), [s](const auto& b) { return b.state == s; });
  };
  print_heading(out, fmt::format("Runs were condensed; {} whole runs beside them", c.runs.size()).c_str());
  print_line(out, fmt::format("bounds: {} confirmed, {} exceeded, {} not reached, {} not run (at most {} whole runs)",
                              count(State::Confirmed), count(State::Exceeded), count(State::NotReached),
                              count(State::NotRun), c.limit));
  const bool has_outcomes = r.outcomes.size() != 1 || !r.outcomes[0].empty();  // points of random inputs have none
  if (has_outcomes)
    for (const auto& o : c.outcomes)
      print_line(out, fmt::format("{}, most possible run, whole: {}", study::words_of_outcome(r, o.outcome),
                                  o.state == State::NotRun      ? "not run"
                                  : o.state == State::Confirmed ? "the same"
                                                                : study::words_of_outcome(r, o.whole)));
  for (const auto& b : c.bounds) {
    if (b.state != State::Exceeded && b.state != State::NotReached) continue;
    const auto& level = r.alpha.outputs[static_cast<std::size_t>(b.output)].levels[static_cast<std::size_t>(b.level)];
    const study::Quantity q = study::find_output(p, r.outputs[static_cast<std::size_t>(b.output)]);
    print_line(out, fmt::format("{} at alpha {:g}, {} {:.4g}: {} by whole runs, {}", q.name, level.alpha,
                                b.is_upper ? "upper" : "lower",
                                (b.is_upper ? level.upper.value : level.lower.value) / q.unit_value,
                                study::to_text(b.state), study::words_of_value(q, b.whole)));
  }
}

}  // namespace

std::string describe_state(const Problem& p, const study::StudyState& s) {
  const double rate = s.seconds > 0 ? static_cast<double>(s.run_here) / s.seconds : 0;
  std::string text = fmt::format("{}{} done, {} running, {} failed",
                                 s.is_confirming ? "confirming by whole runs: " : "", s.done, s.running, s.failed);
  if (s.run_here > 0) {
    text += fmt::format(", {:.3g}/s", rate);
    text += fmt::format(", at most {} left", words_of_time(static_cast<double>(std::max(0L, s.limit - s.done)) / rate));
  }
  if (!s.so_far) return text;
  for (std::size_t i = 0; i < std::min<std::size_t>(2, s.so_far->alpha.outputs.size()); ++i) {
    const auto& support = s.so_far->alpha.outputs[i].levels.front();
    const study::Quantity& q = study::find_output(p, s.so_far->outputs[i]);
    const int digits = study::calc_digits(support.lower.value, support.upper.value, 5);
    text += fmt::format("; {} {:.{}g} to {:.{}g}{}{}", to_printable(q.name), support.lower.value / q.unit_value, digits,
                        support.upper.value / q.unit_value, digits, q.unit.empty() ? "" : " ", q.unit);
  }
  return text;
}

void print_study(std::FILE* out, const Problem& p, const StudyResult& r) {
  if (!p.title.empty()) std::fprintf(out, "%s\n", to_printable(p.title).c_str());
  std::fprintf(out, "%zu runs, %d failed; %s\n", r.alpha.archive.size(), r.alpha.failed,
               r.is_finished ? uncertainty::to_text(r.ending).c_str() : "not finished, bounds so far");
  const std::vector<study::Sentence> sentences = study::tell(p, r);
  if (!sentences.empty()) std::fprintf(out, "\n");
  for (const study::Sentence& s : sentences) print_line(out, s.text);
  print_outcomes(out, p, r);
  print_requirement(out, p, r);
  print_outputs(out, p, r);
  print_drivers(out, p, r);
  print_boxes(out, p, r);
  print_confirmation(out, p, r);
  const std::vector<study::NotableRun> notable = study::list_notable_runs(p, r);
  if (!notable.empty()) print_heading(out, "Runs to look at (number in samples.csv)");
  for (const study::NotableRun& n : notable)
    print_line(out,
               fmt::format("{:>5}  {}; {}", n.sample, n.why, study::words_of_point(p, r.alpha.archive[n.sample].x)));
  constexpr std::size_t most_reasons = 5;
  if (!r.failures.empty()) print_heading(out, "Failed runs");
  for (std::size_t i = 0; i < std::min(most_reasons, r.failures.size()); ++i) print_line(out, r.failures[i]);
  if (r.failures.size() > most_reasons)
    std::fprintf(out, "  and %zu other reasons\n", r.failures.size() - most_reasons);
}

}  // namespace topple::apps
