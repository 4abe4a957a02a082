#include "study/story.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <set>

#include "base/error.h"
#include "study/limits.h"
#include "study/permissible.h"
#include "study/randomness.h"
#include "study/requirement.h"
#include "study/results.h"
#include "uncertainty/measures.h"

namespace topple::study {
namespace {

constexpr const char* kNearCore = "values within a hundredth of their range of the core";

using record::Status;
using uncertainty::failed_outcome;

/// What a study gives with a mark of convergence: bounds, possibilities, those of a requirement, of limits that are
/// broken, and those with an input known.
struct Marks {
  int open = 0, all = 0;
};

Marks count_marks(const Problem& p, const StudyResult& r) {
  Marks m;
  const auto add = [&m](bool is_converged) { m.open += !is_converged, ++m.all; };
  const auto add_bounds = [&add](const std::vector<uncertainty::OutputBounds>& outputs) {
    for (const auto& o : outputs)
      for (const auto& l : o.levels)
        for (const uncertainty::Bound& b : {l.lower, l.upper})
          if (b.sample >= 0) add(b.converged);
  };
  add_bounds(r.alpha.outputs);
  // bounds of a class that alone has numbers are those of all runs
  if (count_outcomes(r.alpha) > 1)
    for (const auto& c : r.alpha.classes) add_bounds(c.outputs);
  for (const auto& c : r.possibilities.classes) add(c.converged);
  if (!is_of_outcomes(p))
    for (const auto& c : r.requirement)
      if (c.outcome != failed_outcome) add(c.converged);
  for (const auto& c : r.limits) add(c.converged);
  for (const auto& k : r.insights.knowing)
    for (const auto& c : k.classes)
      if (c.possibility > 0) add(c.converged);
  for (const auto& b : r.insights.boxes.boxes)
    if (b.kept) add_bounds(b.outputs);
  return m;
}

/// What an outcome is in a sentence.
std::string quoted(const std::string& name) { return name.empty() ? "the outcome without a name" : "\"" + name + "\""; }

std::string percent(double part) { return fmt::format("{:.0f} %", 100 * part); }

/// Rounded up or down to so many digits behind the point; what is a number of so many digits but for what searches
/// leave stays that number.
std::string round_towards(double x, int digits, bool is_up) {
  constexpr double left = 1e-5;  // of the last digit
  const double unit = std::pow(10, digits), y = x * unit;
  const double whole = is_up ? std::ceil(y - left) : std::floor(y + left);
  return fmt::format("{:.{}f}", whole / unit + 0.0, digits);
}

/// Class at the core; failed_outcome if that run failed, and nothing if it was not run.
const uncertainty::Sample* find_core(const Problem& p, const uncertainty::Archive& archive) {
  const int i = archive.find(uncertainty::calc_centre(p.space));
  return i < 0 ? nullptr : &archive[i];
}

int count_runs(const StudyResult& r, int outcome) {
  for (const auto& c : r.alpha.classes)
    if (c.outcome == outcome) return c.count;
  return 0;
}

/// Whether a whole run ended otherwise than the condensed one with the same values.
bool has_other_outcome(const StudyResult& r, const Confirmation::Run& whole) {
  const uncertainty::Sample& condensed = r.alpha.archive[static_cast<std::size_t>(whole.sample)];
  return whole.whole.state == uncertainty::Result::State::Done &&
         uncertainty::outcome_of(whole.whole) != uncertainty::outcome_of(condensed.result);
}

/// What was found, but by no run that is possible to more than 0.
///   is_searched  nothing more possible was found by a search for it
std::string tell_impossible(const std::string& what, long runs, std::size_t of_runs, bool is_searched) {
  std::string text = fmt::format("{} was found only where the inputs are not possible (membership 0): {} of {} runs.",
                                 what, runs, of_runs);
  if (!is_searched) text += " Its possibility was not searched to the end: it is at least 0.00.";
  return text;
}

/// What leads to something, beside the core.
std::string tell_least_change(const Problem& p, const Point& x) {
  const std::string words = words_of_point(p, x);
  return words == kNearCore ? " It takes no more than values within a hundredth of their range of the core."
                            : fmt::format(" It takes no more than {}.", words);
}

std::string tell_end_of_search(bool is_converged) {
  return is_converged ? " A search ended there, and found nothing more possible."
                      : " No search has ended there, so it may be higher.";
}

void tell_outcomes(const Problem& p, const StudyResult& r, std::vector<Sentence>& out) {
  const uncertainty::Sample* core = find_core(p, r.alpha.archive);
  std::vector<uncertainty::Possibility> classes = r.possibilities.classes;
  std::stable_sort(classes.begin(), classes.end(),
                   [](const auto& a, const auto& b) { return a.possibility > b.possibility; });
  int named = 0;
  for (const auto& c : classes) named += c.outcome != failed_outcome;
  for (const auto& c : classes) {
    if (c.outcome == failed_outcome) continue;
    const std::string name = name_of_outcome(r, c.outcome);
    const double necessity = uncertainty::calc_necessity(r.possibilities, c.outcome);
    if (named == 1 && name.empty()) continue;  // the model tells no outcomes
    Sentence s;
    s.id = "outcome." + name;
    if (!(c.possibility > 0)) {
      s.text = tell_impossible(quoted(name), count_runs(r, c.outcome), r.alpha.archive.size(), c.converged);
      if (!p.asked.empty()) s.status = name == p.asked || !c.converged ? Status::Warning : Status::Info;
      out.push_back(std::move(s));
      continue;
    }
    s.text = fmt::format("{} is {}: possibility {}{}, necessity at most {}.", quoted(name),
                         words_of_possibility(c.possibility), c.possibility >= 1 ? "" : "at least ",
                         words_of_least(c.possibility), words_of_most(necessity));
    if (c.sample >= 0 && core && uncertainty::outcome_of(core->result) != c.outcome)
      s.text += tell_least_change(p, r.alpha.archive[c.sample].x);
    if (!p.asked.empty())
      s.status = name == p.asked ? Status::Good : c.possibility >= 0.5 ? Status::Bad : Status::Warning;
    out.push_back(std::move(s));
  }
}

/// Of a model that tells no outcomes: its first outputs.
std::string tell_outputs(const Problem& p, const StudyResult& r, const uncertainty::Sample& core) {
  constexpr std::size_t most = 3;
  std::string text;
  for (std::size_t o = 0; o < std::min({most, r.outputs.size(), r.alpha.outputs.size()}); ++o) {
    const auto& levels = r.alpha.outputs[o].levels;
    if (o >= core.result.values.size() || levels.empty() || levels.front().lower.sample < 0) continue;
    const Quantity q = find_output(p, r.outputs[o]);
    const double width = levels.front().upper.value - levels.front().lower.value;
    const bool is_found = levels.front().lower.converged && levels.front().upper.converged;
    text += fmt::format("{}With the core values {} is {}; over the whole support it lies between {} and {}{}.",
                        text.empty() ? "" : " ", q.name, words_of_value(q, core.result.values[o], width),
                        words_of_number(levels.front().lower.value / q.unit_value, width / q.unit_value),
                        words_of_value(q, levels.front().upper.value, width), is_found ? "" : ", as far as found");
  }
  if (r.outputs.size() > most) text += fmt::format(" And {} more outputs.", r.outputs.size() - most);
  return text;
}

/// Of a run, by the output's name; nothing where there is none.
std::optional<double> value_of(const StudyResult& r, const uncertainty::Sample& run, const std::string& output) {
  const auto at = std::find(r.outputs.begin(), r.outputs.end(), output);
  const auto index = static_cast<std::size_t>(at - r.outputs.begin());
  if (at == r.outputs.end() || index >= run.result.values.size()) return std::nullopt;
  return run.result.values[index];
}

/// Runs that ended before anything had come down, though it was about to.
int count_unfinished(const Problem& p, const StudyResult& r) {
  if (!p.horizon) return 0;
  const auto is_unfinished = [&](const uncertainty::Sample& s) {
    return value_of(r, s, p.horizon->output) >= p.horizon->after &&
           name_of_outcome(r, uncertainty::outcome_of(s.result)) != p.horizon->unless;
  };
  const std::vector<uncertainty::Sample>& all = r.alpha.archive.samples();
  return static_cast<int>(std::count_if(all.begin(), all.end(), is_unfinished));
}

/// Whether a run of a plan ended with an outcome that is not the last word.
bool is_open(const Problem& p, const StudyResult& r, const uncertainty::Sample& run) {
  return p.horizon && value_of(r, run, p.horizon->open) > 0.0;
}

long count_open(const Problem& p, const StudyResult& r) {
  return std::ranges::count_if(r.alpha.archive.samples(),
                               [&](const uncertainty::Sample& run) { return is_open(p, r, run); });
}

/// The same of points whose inner runs may have ended so: only a statistic of theirs tells it.
void doubt_points(const Problem& p, const StudyResult& r, Sentence& s) {
  const std::string wanted = fmt::format("p(touchdown>={:g})", p.horizon->after);
  const auto is_wanted = [&](std::string name) {
    std::erase(name, ' ');
    return name == wanted;
  };
  const auto at = std::ranges::find_if(r.outputs, is_wanted);
  if (at == r.outputs.end()) {
    s.text += fmt::format(
        " Whether something had touched down in each inner run is not known: p(touchdown >= {:.4g}) would tell it.",
        p.horizon->after);
    s.status = Status::Info;
    return;
  }
  const auto index = static_cast<std::size_t>(at - r.outputs.begin());
  const auto points = std::ranges::count_if(r.alpha.archive.samples(), [index](const uncertainty::Sample& one) {
    return index < one.result.values.size() && one.result.values[index] > 0;
  });
  if (points == 0) return;
  s.text += fmt::format(" But in {} of the runs, inner ones ended before anything had touched down.", points);
  s.status = Status::Warning;
}

/// A sentence that says that all is well does not, where runs ended in the middle.
void doubt(const Problem& p, const StudyResult& r, Sentence& s) {
  if (s.status == Status::Good && p.random && p.horizon) return doubt_points(p, r, s);
  const int unfinished = count_unfinished(p, r);
  if (unfinished == 0 || s.status != Status::Good) return;
  s.text += fmt::format(" But {} of the runs ended before anything had touched down.", unfinished);
  s.status = Status::Warning;
}

/// How possible it is that a limit is broken, and by which values.
std::string tell_breaking(const Problem& p, const StudyResult& r, const LimitFinding& f, bool is_screening) {
  if (f.broken == 0) return is_screening ? "No run reaches the limit." : "No run breaks the limit.";
  const double possibility = f.found.possibility;
  if (!(possibility > 0))
    return tell_impossible(is_screening ? "Reaching the limit" : "Breaking the limit", f.broken,
                           static_cast<std::size_t>(f.runs), f.found.converged);
  const std::string word = words_of_possibility(possibility), least = words_of_least(possibility);
  std::string text =
      is_screening ? fmt::format("It is {} that the band reaches the limit: possibility at least {}.", word, least)
                   : fmt::format("It is {} that the limit is broken: possibility at least {}.", word, least);
  if (f.is_core_broken) return text;
  if (possibility < 1) text += tell_end_of_search(f.found.converged);
  return text + tell_least_change(p, r.alpha.archive[f.found.sample].x);
}

/// What lies between which values, how many runs keep it, and how possible it is that it is broken.
Sentence tell_debris_limit(const Problem& p, const StudyResult& r, const LimitFinding& f) {
  Sentence s;
  const Limit& limit = p.limits[static_cast<std::size_t>(f.limit)];
  const Quantity q = find_output(p, limit.output);
  const std::string what = limit.kind == Limit::Kind::Reach       ? "Reach of the debris"
                           : limit.kind == Limit::Kind::Direction ? "Deviation from the planned direction of fall"
                                                                  : "Clearance of " + quoted(limit.place);
  s.text = fmt::format("{}: between {} and {}; {} of {} runs keep the limit of {} ({}). ", what,
                       words_of_number(f.least / q.unit_value), words_of_value(q, f.most), f.runs - f.broken, f.runs,
                       words_of_value(q, limit.least), limit.source);
  s.text += tell_breaking(p, r, f, false);
  if (f.open > 0)
    s.text +=
        fmt::format(" In {} of the runs that keep it parts still moved when they ended, and may break it.", f.open);
  s.status = f.found.possibility >= 0.5 ? Status::Bad : f.broken > 0 || f.open > 0 ? Status::Warning : Status::Good;
  return s;
}

Sentence tell_screening(const Problem& p, const StudyResult& r, const LimitFinding& f) {
  Sentence s;
  const Limit& limit = p.limits[static_cast<std::size_t>(f.limit)];
  const Quantity q = find_output(p, limit.output);
  s.text = fmt::format(
      "Screening of ground vibration at {}: the upper end of the band lies between {} and {} over {} runs; limit {}{} "
      "({}). ",
      quoted(limit.place), words_of_number(f.least / q.unit_value), words_of_value(q, f.most), f.runs,
      words_of_value(q, limit.least),
      limit.most > limit.least ? fmt::format(" to {}, by frequency", words_of_value(q, limit.most)) : "", limit.source);
  s.text += tell_breaking(p, r, f, true);
  s.text += " This is a screening, no prediction.";
  // as a run has it: a band that reaches the limit is a warning, one that lies above it is more
  s.status = f.above >= 0.5 ? Status::Bad : f.broken > 0 ? Status::Warning : Status::Good;
  return s;
}

/// How many limits of a plan have been looked at, and how they fare; a screening's band reaches its limit.
struct LimitCount {
  int all = 0;
  int at_core = 0;         // broken with the core values
  int elsewhere = 0;       // of the others: broken by a run that is possible
  int open = 0;            // of the others: parts that still moved may break it
  double possibility = 0;  // of breaking one of `elsewhere`
  bool is_above = false;   // a whole band with the core values
};
struct LimitCounts {
  LimitCount debris, screenings;
};

LimitCounts tell_limits(const Problem& p, const StudyResult& r, std::vector<Sentence>& out) {
  LimitCounts counts;
  const uncertainty::Sample* core = find_core(p, r.alpha.archive);
  for (const LimitFinding& f : list_limits(p, r)) {
    const Limit& limit = p.limits[static_cast<std::size_t>(f.limit)];
    const bool is_screening = limit.kind == Limit::Kind::Screening;
    LimitCount& count = is_screening ? counts.screenings : counts.debris;
    ++count.all;
    if (f.is_core_broken) {
      const auto index = std::find(r.outputs.begin(), r.outputs.end(), limit.output) - r.outputs.begin();
      ++count.at_core;
      count.is_above |= core->result.values[static_cast<std::size_t>(index)] > limit.above;
    } else if (f.found.possibility > 0) {
      ++count.elsewhere;
      count.possibility = std::max(count.possibility, f.found.possibility);
    } else {
      count.open += f.open > 0;
    }
    Sentence s = is_screening ? tell_screening(p, r, f) : tell_debris_limit(p, r, f);
    s.id = "limit." + limit.output;
    doubt(p, r, s);
    out.push_back(std::move(s));
  }
  return counts;
}

/// An outcome as planned is no good verdict where limits of the plan are broken.
void weigh_limits(const Problem& p, const LimitCounts& limits, Sentence& verdict) {
  const auto add = [&](int count, int all, const std::string& text, Status status) {
    if (count == 0) return;
    verdict.text += fmt::format(" {}: {} of {}.", text, count, all);
    if (verdict.status != Status::Bad) verdict.status = status;
  };
  const LimitCount &debris = limits.debris, &screenings = limits.screenings;
  add(debris.at_core, debris.all, "Limits of the plan that are broken with the core values", Status::Bad);
  add(debris.elsewhere, debris.all,
      fmt::format("Limits of the plan that other values break, possible to at least {}",
                  words_of_least(debris.possibility)),
      debris.possibility >= 0.5 ? Status::Bad : Status::Warning);
  add(debris.open, debris.all, "Limits of the plan that parts may break which still moved", Status::Warning);
  add(screenings.at_core, screenings.all, "Screenings of vibration whose band reaches the limit with the core values",
      screenings.is_above ? Status::Bad : Status::Warning);
  add(screenings.elsewhere, screenings.all,
      fmt::format("Screenings of vibration whose band reaches the limit with other values, possible to at least {}",
                  words_of_least(screenings.possibility)),
      Status::Warning);
  if (p.not_judged.empty()) return;
  verdict.text += fmt::format(" Limits of the plan that are not judged here: {}.", p.not_judged.size());
  if (verdict.status == Status::Good) verdict.status = Status::Info;
}

void tell_splits(const Problem& p, const StudyResult& r, std::vector<Sentence>& out) {
  const uncertainty::Sample* core = find_core(p, r.alpha.archive);
  const std::vector<std::string> names = make_short_names(p.inputs);
  for (const Split& s : find_splits(p.space, r.alpha.archive, r.spread)) {
    // the core's own class follows from the others
    if (s.input < 0 || (core && uncertainty::outcome_of(core->result) == s.outcome)) continue;
    const Quantity& q = p.inputs[static_cast<std::size_t>(s.input)];
    const bool is_below = s.below > s.above;
    const double more = std::max(s.below, s.above), less = std::min(s.below, s.above);
    out.push_back({"split." + name_of_outcome(r, s.outcome),
                   fmt::format("{} goes with {} {} {}: {} of the {} spread runs there, {} of the {} others.",
                               quoted(name_of_outcome(r, s.outcome)), names[static_cast<std::size_t>(s.input)],
                               is_below ? "below" : "above",
                               words_of_value(q, s.value, p.space.inputs[static_cast<std::size_t>(s.input)].width()),
                               percent(more), is_below ? s.below_runs : s.above_runs, percent(less),
                               is_below ? s.above_runs : s.below_runs),
                   Status::Info});
  }
}

/// What whole runs say of a requirement that was searched with condensed ones.
void weigh_whole_runs(const Problem& p, const StudyResult& r, bool is_core_kept, Sentence& s) {
  const uncertainty::Classify classify = make_requirement_classes(p, r.outputs, r.outcomes);
  int compared = 0, against = 0;
  double possibility = 0;
  for (const Confirmation::Run& run : r.confirmation.runs) {
    if (run.whole.state != uncertainty::Result::State::Done) continue;
    ++compared;
    if ((classify(run.whole) == kept_class) == is_core_kept) continue;
    ++against;
    possibility = std::max(possibility, run.membership);
  }
  if (against == 0) return;
  s.text += is_core_kept ? fmt::format(
                               " These are condensed runs: {} of {} whole runs break the requirement, which is "
                               "possible to at least {}.",
                               against, compared, words_of_least(possibility))
                         : fmt::format(
                               " These are condensed runs: {} of {} whole runs keep the requirement, which is "
                               "possible to at least {}.",
                               against, compared, words_of_least(possibility));
  if (is_core_kept) s.status = s.status == Status::Bad || possibility >= 0.5 ? Status::Bad : Status::Warning;
}

/// How possible it is that the requirement is broken, failed runs among them; where the core values break it, that it
/// is kept.
void tell_requirement(const Problem& p, const StudyResult& r, std::vector<Sentence>& out) {
  const std::vector<RequirementClass> classes = list_requirement(p, r);
  if (classes.empty()) return;
  const uncertainty::Sample* core = find_core(p, r.alpha.archive);
  const bool is_core_kept = !core || make_requirement_classes(p, r.outputs, r.outcomes)(core->result) == kept_class;
  Sentence s;
  s.id = "requirement";
  if (core)
    s.text = is_core_kept ? fmt::format("The core values keep the requirement {}. ", p.permissible)
                          : fmt::format("The core values break the requirement {}. ", p.permissible);
  const std::string what = !is_core_kept ? "Keeping it"
                           : core        ? "Breaking it"
                                         : "Breaking the requirement " + p.permissible;
  uncertainty::Possibility found;
  long runs = 0;
  bool is_searched = true;
  for (const RequirementClass& c : classes) {
    if ((c.found.outcome == kept_class) == is_core_kept || c.runs == 0) continue;
    runs += c.runs;
    is_searched = is_searched && c.found.converged;
    if (c.found.sample >= 0 && (found.sample < 0 || c.found.possibility > found.possibility)) found = c.found;
  }
  const std::size_t all = r.alpha.archive.size();
  if (found.possibility > 0) {
    const std::string word = words_of_possibility(found.possibility), least = words_of_least(found.possibility);
    s.text += is_core_kept
                  ? fmt::format("{} is {}: possibility at least {}, so the necessity of keeping it is at most {}.",
                                what, word, least, words_of_most(1 - found.possibility))
                  : fmt::format("Keeping it is {}: possibility at least {}.", word, least);
    if (found.possibility < 1) s.text += tell_end_of_search(is_searched);
    if (found.outcome == failed_outcome) s.text += " The run with this possibility failed.";
    s.text += tell_least_change(p, r.alpha.archive[found.sample].x);
  } else if (runs > 0) {
    s.text += tell_impossible(what, runs, all, is_searched);
  } else {
    s.text +=
        is_core_kept ? fmt::format("None of {} runs broke it.", all) : fmt::format("None of {} runs kept it.", all);
  }
  if (!is_core_kept)
    s.status = Status::Bad;
  else if (found.possibility > 0)
    s.status = found.possibility >= 0.5 ? Status::Bad : Status::Warning;
  else
    s.status = runs > 0 ? Status::Warning : Status::Good;
  weigh_whole_runs(p, r, is_core_kept, s);
  const std::vector<std::string> wanted = read_permissible(p.permissible, p).outcomes;
  for (const std::string& name : wanted)
    if (std::find(r.outcomes.begin(), r.outcomes.end(), name) == r.outcomes.end())
      s.text += fmt::format(" No run had the outcome {}.", quoted(name));
  doubt(p, r, s);
  if (const long open = count_open(p, r); open > 0 && !wanted.empty() && s.status == Status::Good) {
    s.text += fmt::format(" But in {} of the runs the outcome could still become another one when they ended.", open);
    s.status = Status::Warning;
  }
  out.push_back(std::move(s));
}

}  // namespace

std::string tell_guarantee(const uncertainty::PermissibleBox& b, int violating, bool has_interaction) {
  std::string text;
  const bool is_small =
      b.samples == 0 || b.volume < uncertainty::calc_smallest(uncertainty::DesignOptions{}.smallest, b.box);
  if (b.kept) {
    text = fmt::format("No run violated the requirement in {} inside, {} of them at fresh random points", b.samples,
                       b.fresh);
    if (b.fresh > 0)
      text += fmt::format(": with a confidence of 95 % at most {} % of the box violates it",
                          words_of_most(100 * b.violating, 1));
    text += ". It is not proven, and smaller islands may exist.";
  } else if (is_small && violating == 0) {
    text = "This box was dropped: the runs were used up before it could be checked.";
    text += " More runs may find a box.";
  } else if (is_small) {
    text =
        "This box was dropped: what violates the requirement leaves too little room around these runs (below a "
        "thousandth of the support; of more than three inputs, below a tenth of its width in the mean).";
  } else if (b.broken < 0) {  // of an older version
    text = "This box was dropped: it is too small, or its check was not finished.";
  } else {
    text = b.broken > 0 ? fmt::format("This box was dropped: {} of the {} runs inside violate the requirement.",
                                      b.broken, b.samples)
                        : std::string("This box was dropped: its check at fresh random points was not finished.");
    text += " More runs may find a box.";
  }
  if (has_interaction) text += " The constraints take away a part of it, which its share of the support does not show.";
  return text;
}

std::string words_of_least(double x, int digits) { return round_towards(x, digits, false); }
std::string words_of_most(double x, int digits) { return round_towards(x, digits, true); }

std::string words_of_possibility(double degree) {
  if (degree >= 1) return "fully possible";
  if (degree >= 0.75) return "very possible";
  if (degree >= 0.5) return "well possible";
  if (degree >= 0.25) return "possible";
  if (degree > 0) return "hardly possible";
  return "not found";
}

std::string words_of_number(double value, double width) {
  value += 0.0;  // no "-0"
  // a thousandth of the width
  if (width > 0 && value != 0) {
    const int digits = static_cast<int>(std::floor(std::log10(std::abs(value))) - std::floor(std::log10(width))) + 4;
    if (digits > 4) return fmt::format("{:.{}g}", value, std::min(digits, 17));
  }
  // four digits; no powers of ten for what people write without
  if (std::abs(value) >= 1e4 && std::abs(value) < 1e7) {
    const double unit = std::pow(10, std::floor(std::log10(std::abs(value))) - 3);
    return fmt::format("{:.0f}", std::round(value / unit) * unit);
  }
  return fmt::format("{:.4g}", value);
}

std::string words_of_value(const Quantity& q, double value, double width) {
  const std::string number = words_of_number(value / q.unit_value, width / q.unit_value);
  return q.unit.empty() ? number : number + " " + q.unit;
}

std::string words_of_point(const Problem& p, const Point& x) {
  std::string text;
  const std::vector<std::string> names = make_short_names(p.inputs);
  for (std::size_t i = 0; i < p.inputs.size(); ++i) {
    const uncertainty::FuzzyNumber& f = p.space.inputs[i];
    if (!(std::abs(x[i] - f.centre()) > 0.01 * f.width())) continue;
    const auto shown = [&](double v) {
      return words_of_number(v / p.inputs[i].unit_value, f.width() / p.inputs[i].unit_value);
    };
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", names[i], words_of_value(p.inputs[i], x[i], f.width()));
    text += f.core().right - f.core().left > 0.01 * f.width()
                ? fmt::format(" (core {} to {})", shown(f.core().left), shown(f.core().right))
                : fmt::format(" (core {})", shown(f.centre()));
  }
  return text.empty() ? kNearCore : text;
}

std::vector<Split> find_splits(const uncertainty::Space& space, const uncertainty::Archive& archive,
                               const std::vector<int>& spread) {
  std::vector<Split> splits;
  std::set<int> outcomes;
  for (const int i : spread) outcomes.insert(uncertainty::outcome_of(archive[i].result));
  if (outcomes.size() < 2) return splits;
  const std::size_t count = spread.size(), least = std::max<std::size_t>(3, count / 10);
  for (const int outcome : outcomes) {
    Split best;
    best.outcome = outcome;
    for (int input = 0; input < space.size(); ++input) {
      if (!(space.inputs[input].width() > 0)) continue;
      std::vector<std::pair<double, bool>> runs;
      for (const int i : spread)
        runs.emplace_back(archive[i].x[static_cast<std::size_t>(input)],
                          uncertainty::outcome_of(archive[i].result) == outcome);
      std::stable_sort(runs.begin(), runs.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
      double all = 0, below = 0;
      for (const auto& [x, is_in] : runs) all += is_in;
      const double n = static_cast<double>(count), variance = all / n * (1 - all / n);
      if (!(variance > 0)) continue;
      for (std::size_t k = 1; k < count; ++k) {
        below += runs[k - 1].second;
        if (k < least || count - k < least || runs[k].first == runs[k - 1].first) continue;
        const double low = static_cast<double>(k), high = n - low, a = below / low, b = (all - below) / high;
        const double gain = low * high / (n * n) * (a - b) * (a - b) / variance;
        if (gain > best.gain)
          best = {outcome,
                  input,
                  0.5 * (runs[k - 1].first + runs[k].first),
                  static_cast<int>(k),
                  static_cast<int>(count - k),
                  a,
                  b,
                  gain};
      }
    }
    // a best of many thresholds explains a few percent by chance
    constexpr double least_gain = 0.1;
    if (best.gain < least_gain) best.input = -1;
    splits.push_back(best);
  }
  return splits;
}

std::vector<Sentence> tell(const Problem& p, const StudyResult& r) {
  std::vector<Sentence> out;
  const auto add = [&out](std::string id, std::string text, Status status = Status::Info) {
    out.push_back({std::move(id), std::move(text), status});
  };
  const std::size_t runs = r.alpha.archive.size();
  if (runs == 0) {
    add("verdict", "Nothing has been run so far.");
    return out;
  }
  if (static_cast<std::size_t>(r.alpha.failed) == runs) {
    add("verdict", fmt::format("All {} runs failed: nothing is known of this model.", runs), Status::Bad);
    if (!p.permissible.empty())
      add("requirement", fmt::format("No box of permissible values can be looked for: all {} runs failed.", runs),
          Status::Bad);
    return out;
  }
  const uncertainty::Sample* core = find_core(p, r.alpha.archive);
  const int at_core = core ? uncertainty::outcome_of(core->result) : failed_outcome;
  const int classes = count_outcomes(r.alpha);
  const bool has_names = classes > 1 || (at_core != failed_outcome && !name_of_outcome(r, at_core).empty());
  if (!core) {
    add("verdict", "The core values have not been run yet.");
  } else if (at_core == failed_outcome) {
    add("verdict", "The run at the core values failed: " + core->result.text + ".", Status::Bad);
  } else if (has_names) {
    const std::string name = name_of_outcome(r, at_core);
    double others = 0;
    long of_others = 0;
    bool is_searched = true;
    for (const auto& c : r.possibilities.classes) {
      if (c.outcome == at_core) continue;
      others = std::max(others, c.possibility);
      of_others += count_runs(r, c.outcome);
      is_searched = is_searched && c.converged;
    }
    std::string text = fmt::format("With the core values the outcome is {}", quoted(name));
    // whatever is asked for, as topple run has it
    Status status = p.horizon && (name == "early" || name == "wrong direction") ? Status::Bad : Status::Info;
    if (!p.asked.empty()) {
      text += name == p.asked ? ", as planned" : fmt::format(", not {} as planned", quoted(p.asked));
      status = name == p.asked ? Status::Good : Status::Bad;
    }
    // it may become another one; that others are possible weighs as before
    const bool is_core_open = is_open(p, r, *core);
    if (is_core_open && status != Status::Info) status = Status::Warning;
    if (others > 0) {
      text += fmt::format(
          ". It is not certain: another outcome is {} (possibility at least {}), so its necessity "
          "is at most {}.",
          words_of_possibility(others), words_of_least(others), words_of_most(1 - others));
      if (status != Status::Bad) status = others >= 0.5 ? Status::Bad : Status::Warning;
    } else if (of_others > 0) {
      text += ". " + tell_impossible("Another outcome", of_others, runs, is_searched);
      if (status != Status::Bad && !is_searched) status = Status::Warning;
    } else if (std::all_of(p.space.inputs.begin(), p.space.inputs.end(),
                           [](const auto& x) { return x.width() == 0; })) {
      text += ". No input varies, so there is no other.";
    } else {
      const int of_search = r.alpha.coverage.empty() ? 0 : r.alpha.coverage.front().space_points;
      const double spread = std::max({1, of_search, static_cast<int>(r.spread.size())});
      text += fmt::format(
          ". No other outcome was found in {} runs; an outcome that takes up {} of the inputs' support "
          "would have been missed with a probability of 5 %.",
          runs, words_of_most(100 * (1 - std::pow(0.05, 1.0 / spread)), 0) + " %");
    }
    for (const Confirmation::Run& run : r.confirmation.runs) {
      if (&r.alpha.archive[static_cast<std::size_t>(run.sample)] != core || !has_other_outcome(r, run)) continue;
      const int whole = uncertainty::outcome_of(run.whole);
      text += fmt::format(" That is of condensed runs: the whole run with these values has the outcome {}.",
                          quoted(words_of_outcome(r, whole)));
      status = p.asked.empty() || name_of_outcome(r, whole) == p.asked ? Status::Warning : Status::Bad;
    }
    if (is_core_open)
      text += " With the core values parts still moved when the run ended: what it was called then may become another.";
    add("verdict", std::move(text), status);
  } else if (std::string text = tell_outputs(p, r, *core); !text.empty()) {
    add("verdict", std::move(text));
  }
  std::vector<Sentence> of_limits;
  const LimitCounts limits = tell_limits(p, r, of_limits);
  if (core && at_core != failed_outcome && !out.empty()) weigh_limits(p, limits, out.front());
  tell_requirement(p, r, out);
  if (has_names && classes > 1) {
    tell_outcomes(p, r, out);
    tell_splits(p, r, out);
  }
  std::move(of_limits.begin(), of_limits.end(), std::back_inserter(out));
  if (p.random) add("random", tell_randomness(p));
  if (const int unfinished = count_unfinished(p, r); unfinished > 0)
    add("unfinished",
        fmt::format("In {} of {} runs nothing of the upper block had touched down when they ended, {:.4g} s after the "
                    "last stage or at rest: their outcome, energy and reach are those of that time.",
                    unfinished, runs, p.horizon->after),
        Status::Warning);
  long compared = 0, different = 0;
  for (const Confirmation::Run& run : r.confirmation.runs) {
    if (run.whole.state == uncertainty::Result::State::Done) ++compared;
    if (has_other_outcome(r, run)) ++different;
  }
  if (different > 0)
    add("confirmation",
        fmt::format("{} of {} whole runs have another outcome than the condensed runs with the same values.", different,
                    compared),
        2 * different >= compared ? Status::Bad : Status::Warning);
  if (constexpr double most = 3; p.whole && p.horizon && p.horizon->after > most)
    add("condensed",
        "Condensed runs hold until about a second behind the touchdown: reaches, heaps and outcomes at rest are not "
        "theirs. Let the runs end earlier ([fuzzy.search] after), or run the study without --condensed.",
        Status::Warning);
  if (p.horizon) {
    std::string text = fmt::format(
        "Times count from the last stage. Runs end at rest or {:.4g} s behind it, when parts may "
        "still move: reaches are those of that time.",
        p.horizon->after);
    if (const long open = count_open(p, r); open > 0)
      text += fmt::format(" In {} of {} runs the outcome could still become another one then.", open, runs);
    add("clock", std::move(text));
  }
  if (!p.not_judged.empty()) {
    std::string list;
    for (const std::string& what : p.not_judged) list += (list.empty() ? "" : ", ") + what;
    add("not_judged", fmt::format("Not judged here, but by topple run: {}.", list));
  }
  if (const int failed = count_runs(r, failed_outcome); failed > 0) {
    const auto found = std::find_if(r.possibilities.classes.begin(), r.possibilities.classes.end(),
                                    [](const auto& c) { return c.outcome == failed_outcome; });
    const double degree = found == r.possibilities.classes.end() ? 0 : found->possibility;
    add("failed",
        fmt::format("{} of {} runs failed; they are an outcome of their own, possible to at least {}. What would have "
                    "happened there is not known.",
                    failed, runs, words_of_least(degree)),
        Status::Warning);
  }
  const auto add_limit = [&] {
    const Marks marks = count_marks(p, r);
    const int left = make_alpha_options(p).limit - static_cast<int>(runs);
    if (left > 0 && marks.open > 0)
      add("limit",
          fmt::format("Of the runs that were allowed {} are left, too few for what was still to be searched: {} of {} "
                      "bounds and possibilities may be wider or higher than shown.",
                      left, marks.open, marks.all),
          Status::Warning);
    else if (marks.open > 0)
      add("limit",
          fmt::format("All runs that were allowed are used up before every search had converged: {} of {} bounds and "
                      "possibilities may be wider or higher than shown.",
                      marks.open, marks.all),
          Status::Warning);
    else if (left <= 0)
      add("limit",
          "All runs that were allowed are used up. Searches have converged for all bounds and possibilities; more runs "
          "would look for what none of them came near.",
          Status::Info);
  };
  if (!r.is_finished)
    add("open", "The study is not finished: bounds and possibilities may still grow.", Status::Warning);
  else if (r.ending == uncertainty::Ending::LimitReached)
    add_limit();
  else if (r.ending == uncertainty::Ending::NotConverged)
    add("not_converged",
        "Some searches have not converged, though runs were left: bounds may be wider and possibilities higher than "
        "shown.",
        Status::Warning);
  return out;
}

std::vector<NotableRun> list_notable_runs(const Problem& p, const StudyResult& r) {
  std::vector<NotableRun> runs;
  const uncertainty::Sample* core = find_core(p, r.alpha.archive);
  if (!is_of_outcomes(p))
    for (const RequirementClass& c : list_requirement(p, r))
      if (c.found.sample >= 0 && c.found.possibility < 1 && c.found.outcome != failed_outcome)
        runs.push_back(
            {c.found.sample, fmt::format(fmt::runtime(c.found.outcome == kept_class
                                                          ? "most possible run that keeps the requirement ({})"
                                                          : "most possible run that breaks the requirement ({})"),
                                         words_of_least(c.found.possibility))});
  for (const LimitFinding& f : list_limits(p, r))
    if (f.found.sample >= 0 && f.found.possibility < 1)
      runs.push_back({f.found.sample, fmt::format("most possible run that breaks the limit of {} ({})",
                                                  p.limits[static_cast<std::size_t>(f.limit)].output,
                                                  words_of_least(f.found.possibility))});
  for (const auto& c : r.possibilities.classes)
    if (c.sample >= 0 && (!core || uncertainty::outcome_of(core->result) != c.outcome))
      runs.push_back({c.sample, fmt::format("most possible run with the outcome {} ({})",
                                            words_of_outcome(r, c.outcome), words_of_least(c.possibility))});
  for (std::size_t o = 0; o < r.alpha.outputs.size() && o < r.outputs.size(); ++o) {
    if (r.alpha.outputs[o].levels.empty()) continue;
    const auto& support = r.alpha.outputs[o].levels.front();
    const Quantity q = find_output(p, r.outputs[o]);
    const double width = support.upper.value - support.lower.value;
    for (const auto& [bound, word] : {std::pair(&support.lower, "least"), std::pair(&support.upper, "largest")})
      if (bound->sample >= 0)
        runs.push_back({bound->sample, fmt::format("{} {}: {}", word, q.name, words_of_value(q, bound->value, width))});
  }
  return runs;
}

}  // namespace topple::study
