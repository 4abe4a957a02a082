#include "study/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <system_error>

#include "base/error.h"
#include "base/file.h"
#include "study/fans.h"
#include "study/limits.h"
#include "study/permissible.h"
#include "study/randomness.h"
#include "study/requirement.h"
#include "study/story.h"
#include "uncertainty/measures.h"

namespace topple::study {
namespace {

using json = nlohmann::ordered_json;
using uncertainty::Result;

/// Shortest text that reads back to the same number; empty for none.
std::string cell(double x) { return std::isfinite(x) ? fmt::format("{}", x) : std::string(); }

std::string cell(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

/// A number in a unit that gives the same bits when it is read with it again, where there is one.
double read_in(double unit, double x) {
  const double y = x / unit;
  for (const double near : {y, std::nextafter(y, -HUGE_VAL), std::nextafter(y, HUGE_VAL)})
    if (near * unit == x) return near;
  return y;
}

double necessity_of(const StudyResult& r, int outcome) { return uncertainty::calc_necessity(r.possibilities, outcome); }

json bounds_json(const uncertainty::OutputBounds& bounds, double unit) {
  json levels = json::array();
  for (const auto& l : bounds.levels)
    levels.push_back({{"alpha", l.alpha},
                      {"lower", l.lower.value / unit},
                      {"upper", l.upper.value / unit},
                      {"samples", {l.lower.sample, l.upper.sample}},
                      {"converged", {l.lower.converged, l.upper.converged}}});
  return levels;
}

/// JSON has no NaN and no infinity.
json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

double unit_of(const Problem& p, const std::string& output) { return find_output(p, output).unit_value; }

std::string title_of(const Quantity& q) { return q.unit.empty() ? q.name : q.name + " [" + q.unit + "]"; }

json outputs_json(const Problem& p, const std::vector<std::string>& names,
                  const std::vector<uncertainty::OutputBounds>& bounds) {
  json list = json::array();
  for (std::size_t i = 0; i < bounds.size() && i < names.size(); ++i)
    list.push_back({{"name", names[i]},
                    {"unit", find_output(p, names[i]).unit},
                    {"levels", bounds_json(bounds[i], unit_of(p, names[i]))}});
  return list;
}

json driver_json(const uncertainty::Driver& d, const uncertainty::Rank& rank) {
  return {{"first", number(d.first)},
          {"first_error", number(d.first_error)},
          {"total", number(d.total)},
          {"total_error", number(d.total_error)},
          {"places", {rank.best, rank.worst}}};
}

json drivers_json(const std::vector<uncertainty::Driver>& drivers) {
  json list = json::array();
  const std::vector<uncertainty::Rank> ranks = uncertainty::calc_ranks(drivers);
  for (std::size_t i = 0; i < drivers.size(); ++i) list.push_back(driver_json(drivers[i], ranks[i]));
  return list;
}

json insights_json(const Problem& p, const StudyResult& r) {
  json out = json::object();
  const Insights& in = r.insights;
  json& drivers = out["drivers"];
  drivers["from"] = in.source == Insights::Source::Design   ? "rows of Sobol's design"
                    : in.source == Insights::Source::Spread ? "spread runs"
                    : !p.has_drivers                        ? "not asked for"
                                                            : "nothing";
  drivers["runs"] = in.source == Insights::Source::Design ? in.drivers.rows * (static_cast<int>(p.inputs.size()) + 2)
                                                          : in.drivers.rows;
  drivers["outputs"] = json::array();
  drivers["outcomes"] = json::array();
  if (in.source != Insights::Source::None) {
    for (std::size_t o = 0; o < in.drivers.outputs.size() && o < r.outputs.size(); ++o)
      drivers["outputs"].push_back({{"name", r.outputs[o]}, {"inputs", drivers_json(in.drivers.outputs[o])}});
    for (const auto& c : in.drivers.outcomes)
      drivers["outcomes"].push_back(
          {{"name", name_of_outcome(r, c.outcome)}, {"share", c.share}, {"inputs", drivers_json(c.inputs)}});
  }
  out["known"] = json::array();
  for (const uncertainty::Fixed& f : in.knowing) {
    json classes = json::array();
    for (const auto& c : r.alpha.classes) {
      double degree = 0;
      bool is_converged = false;
      for (const auto& k : f.classes)
        if (k.outcome == c.outcome) degree = k.possibility, is_converged = k.converged;
      classes.push_back(
          {{"name", name_of_outcome(r, c.outcome)}, {"possibility", degree}, {"converged", is_converged}});
    }
    out["known"].push_back({{"input", p.inputs.at(static_cast<std::size_t>(f.input)).name}, {"outcomes", classes}});
  }
  out["boxes"] = nullptr;
  if (!in.has_boxes) return out;
  const uncertainty::DesignResult& d = in.boxes;
  json& boxes = out["boxes"];
  boxes = {{"requirement", p.permissible},
           {"permissible_part", d.spread > 0 ? json(d.fraction) : json()},
           {"permissible_part_error", d.spread > 0 ? json(d.fraction_error) : json()},
           {"permissible_part_points", d.spread},
           {"permissible_runs", d.permissible},
           {"forbidden_runs", d.forbidden},
           {"failed_runs", d.failed},
           {"ending", uncertainty::to_text(d.ending)},
           {"list", json::array()}};
  for (const uncertainty::PermissibleBox& b : d.boxes) {
    json inputs = json::array();
    for (std::size_t i = 0; i < p.inputs.size(); ++i) {
      const double unit = p.inputs[i].unit_value;
      json one{{"name", p.inputs[i].name}, {"lower", b.box.lower[i] / unit}, {"upper", b.box.upper[i] / unit}};
      one["core"] = b.centre >= 0 && static_cast<std::size_t>(b.centre) < r.alpha.archive.size()
                        ? number(r.alpha.archive[b.centre].x[i] / unit)
                        : json(nullptr);
      inputs.push_back(one);
    }
    boxes["list"].push_back({{"kept", b.kept},
                             {"guarantee", tell_guarantee(b, d.forbidden + d.failed, p.space.has_interaction())},
                             {"inputs", inputs},
                             {"volume", b.volume},
                             {"runs", b.samples},
                             {"violating_runs", b.broken},
                             {"fresh", b.fresh},
                             {"tries", b.tries},
                             {"violating", b.fresh > 0 ? json(b.violating) : json(nullptr)},
                             {"distance", b.distance},
                             {"robustness", number(b.robustness)},
                             {"outputs", outputs_json(p, r.outputs, b.outputs)}});
  }
  return out;
}

json confirmation_json(const Problem& p, const StudyResult& r) {
  const Confirmation& c = r.confirmation;
  json runs = json::array(), bounds = json::array(), outcomes = json::array();
  const auto values = [&](const Result& result) {
    json list = json::array();
    for (std::size_t o = 0; o < result.values.size() && o < r.outputs.size(); ++o)
      list.push_back(number(result.values[o] / unit_of(p, r.outputs[o])));
    return list;
  };
  for (const Confirmation::Run& run : c.runs) {
    const Result& condensed = r.alpha.archive[run.sample].result;
    runs.push_back({{"sample", run.sample},
                    {"membership", run.membership},
                    {"outcome", name_of_outcome(r, uncertainty::outcome_of(condensed))},
                    {"whole_outcome", run.whole.state == Result::State::NotRun
                                          ? json(nullptr)
                                          : json(name_of_outcome(r, uncertainty::outcome_of(run.whole)))},
                    {"whole_failure", run.whole.state == Result::State::Failed ? json(run.whole.text) : json(nullptr)},
                    {"values", values(condensed)},
                    {"whole_values", values(run.whole)}});
  }
  for (const Confirmation::Bound& b : c.bounds) {
    const std::string& output = r.outputs[static_cast<std::size_t>(b.output)];
    const auto& level = r.alpha.outputs[static_cast<std::size_t>(b.output)].levels[static_cast<std::size_t>(b.level)];
    const double unit = unit_of(p, output);
    bounds.push_back({{"output", output},
                      {"alpha", level.alpha},
                      {"side", b.is_upper ? "upper" : "lower"},
                      {"condensed", number((b.is_upper ? level.upper.value : level.lower.value) / unit)},
                      {"whole", number(b.whole / unit)},
                      {"state", to_text(b.state)}});
  }
  for (const Confirmation::Outcome& o : c.outcomes)
    outcomes.push_back(
        {{"outcome", name_of_outcome(r, o.outcome)},
         {"sample", o.sample},
         {"whole", o.state == Confirmation::State::NotRun ? json(nullptr) : json(name_of_outcome(r, o.whole))},
         {"state", to_text(o.state)}});
  return {{"limit", c.limit},
          {"tolerance", confirmation_tolerance},
          {"runs", runs},
          {"bounds", bounds},
          {"outcomes", outcomes}};
}

json fans_json(const Problem& p, const StudyResult& r) {
  json out{{"curves", json::array()}, {"fans", json::array()}, {"debris", json::array()}};
  const std::vector<Curve> curves = list_curves(p, r.alpha.archive);
  for (const Curve& c : curves)
    out["curves"].push_back({{"name", c.name},
                             {"unit", c.unit},
                             {"over", c.over},
                             {"over_unit", c.over_unit},
                             {"at", c.at},
                             {"is_outline", c.is_outline}});
  for (const CurveFan& f : calc_fans(p, r)) {
    const Curve& c = curves[static_cast<std::size_t>(f.curve)];
    const std::string outcome = f.outcome == uncertainty::all_outcomes ? "" : name_of_outcome(r, f.outcome);
    const bool is_all = f.outcome == uncertainty::all_outcomes;
    json levels = json::array();
    if (c.is_outline) {
      for (const DebrisLevel& d : calc_debris(c, f))
        levels.push_back({{"alpha", d.alpha}, {"runs", d.runs}, {"corners", d.corners}});
      out["debris"].push_back({{"is_all", is_all}, {"outcome", outcome}, {"levels", levels}});
      continue;
    }
    for (const auto& l : f.levels) {
      json lower = json::array(), upper = json::array();
      for (const double v : l.lower) lower.push_back(number(v / c.unit_value));
      for (const double v : l.upper) upper.push_back(number(v / c.unit_value));
      levels.push_back({{"alpha", l.alpha}, {"runs", l.curves}, {"lower", lower}, {"upper", upper}});
    }
    out["fans"].push_back({{"curve", c.name}, {"is_all", is_all}, {"outcome", outcome}, {"levels", levels}});
  }
  return out;
}

void add_search(json& out, const uncertainty::Possibility& found) {
  out["resolution"] = found.resolution;
  out["converged"] = found.converged;
  out["runs_above"] = found.above;
}

json requirement_json(const Problem& p, const StudyResult& r) {
  const std::vector<RequirementClass> list = list_requirement(p, r);
  if (list.empty()) return nullptr;
  json classes = json::array();
  for (const RequirementClass& c : list) {
    json& one = classes.emplace_back(json{{"name", c.name},
                                          {"runs", c.runs},
                                          {"possibility", c.found.possibility},
                                          {"necessity", c.necessity},
                                          {"necessity_converged", c.is_necessity_converged},
                                          {"sample", c.found.sample}});
    add_search(one, c.found);
  }
  return {{"text", p.permissible}, {"classes", classes}};
}

const char* name_of_kind(Limit::Kind kind) {
  switch (kind) {
    case Limit::Kind::Reach:
      return "reach";
    case Limit::Kind::Clearance:
      return "clearance";
    case Limit::Kind::Direction:
      return "direction";
    case Limit::Kind::Screening:
      break;
  }
  return "screening";
}

json limits_json(const Problem& p, const StudyResult& r) {
  json list = json::array();
  for (const LimitFinding& f : list_limits(p, r)) {
    const Limit& limit = p.limits[static_cast<std::size_t>(f.limit)];
    const Quantity q = find_output(p, limit.output);
    json& one = list.emplace_back(json{{"output", limit.output},
                                       {"kind", name_of_kind(limit.kind)},
                                       {"place", limit.place},
                                       {"unit", q.unit},
                                       {"limit", limit.least / q.unit_value},
                                       {"source", limit.source},
                                       {"runs", f.runs},
                                       {"broken", f.broken},
                                       {"open", f.open},
                                       {"possibility", f.found.possibility},
                                       {"sample", f.found.sample}});
    add_search(one, f.found);
  }
  return list;
}

json quantities_json(const std::vector<Quantity>& list) {
  json out = json::array();
  for (const Quantity& q : list) out.push_back({{"name", q.name}, {"unit", q.unit}});
  return out;
}

}  // namespace

std::string name_of_outcome(const StudyResult& r, int outcome) {
  if (outcome == uncertainty::failed_outcome) {
    // a model may have an outcome of this name
    const bool is_taken = std::find(r.outcomes.begin(), r.outcomes.end(), failed_name) != r.outcomes.end();
    return is_taken ? "failed run" : failed_name;
  }
  const auto i = static_cast<std::size_t>(outcome);
  return i < r.outcomes.size() ? r.outcomes[i] : fmt::format("{}", outcome);
}

std::vector<std::string> list_unmet_outcomes(const Problem& p, const StudyResult& r) {
  std::vector<std::string> unmet;
  for (const std::string& name : p.outcomes) {
    const auto found = std::find(r.outcomes.begin(), r.outcomes.end(), name);
    // whole runs of a condensed study have named theirs, too
    const auto is_met = [index = static_cast<int>(found - r.outcomes.begin())](const auto& c) {
      return c.outcome == index && c.count > 0;
    };
    if (found == r.outcomes.end() || std::none_of(r.alpha.classes.begin(), r.alpha.classes.end(), is_met))
      unmet.push_back(name);
  }
  return unmet;
}

bool is_necessity_converged(const Problem& p, const StudyResult& r, int outcome) {
  // what was never met was not searched for to an end either
  return necessity_of(r, outcome) <= 0 ||
         (uncertainty::is_necessity_converged(r.possibilities, outcome) && list_unmet_outcomes(p, r).empty());
}

std::string words_of_outcome(const StudyResult& r, int outcome) {
  const std::string name = name_of_outcome(r, outcome);
  return name.empty() ? "(no name)" : name;
}

double possibility_of(const StudyResult& r, const uncertainty::ClassBounds& c) {
  for (const auto& p : r.possibilities.classes)
    if (p.outcome == c.outcome) return std::max(p.possibility, c.possibility);
  return c.possibility;
}

bool is_possibility_converged(const StudyResult& r, const uncertainty::ClassBounds& c) {
  return std::any_of(r.possibilities.classes.begin(), r.possibilities.classes.end(),
                     [&c](const auto& p) { return p.outcome == c.outcome && p.converged; });
}

double calc_robustness_of(const Problem& p, const StudyResult& r, std::size_t output) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> entropies;
  for (const auto& f : p.space.inputs) {
    if (!(f.width() > 0)) continue;
    if (f.centre() == 0) return nan;
    entropies.push_back(uncertainty::calc_entropy(f, std::abs(f.centre())));
  }
  try {
    const uncertainty::FuzzyNumber y = uncertainty::make_number(r.alpha.outputs.at(output));
    const double result = y.centre() == 0 ? nan : uncertainty::calc_entropy(y, std::abs(y.centre()));
    return std::isfinite(result) ? uncertainty::calc_robustness(entropies, result) : nan;
  } catch (const InputError&) { return nan; }
}

json make_results_json(const Problem& p, const StudyResult& r) {
  json out;
  out["title"] = p.title;
  out["state"] = r.is_finished ? "finished" : "open";
  out["ending"] = uncertainty::to_text(r.ending);
  out["asked"] = p.asked;
  out["verdict"] = json::array();
  for (const Sentence& v : tell(p, r))
    out["verdict"].push_back({{"id", v.id}, {"status", name_of(v.status)}, {"text", v.text}});
  out["runs"] = r.alpha.archive.size();
  out["failed"] = r.alpha.failed;
  out["seed"] = p.seed;
  out["inputs"] = quantities_json(p.inputs);
  for (std::size_t i = 0; i < p.inputs.size(); ++i) {
    json cuts = json::array();
    const double unit = p.inputs[i].unit_value;
    for (const auto& c : p.space.inputs[i].cuts()) cuts.push_back({c.alpha, c.left / unit, c.right / unit});
    out["inputs"][i]["label"] = make_short_names(p.inputs)[i];
    out["inputs"][i]["cuts"] = cuts;
  }
  out["derived"] = quantities_json(p.derived);
  if (p.random) out["random"] = make_random_json(p);
  out["outputs"] = json::array();
  for (std::size_t i = 0; i < r.alpha.outputs.size() && i < r.outputs.size(); ++i) {
    const Quantity q = find_output(p, r.outputs[i]);
    json o{{"name", q.name}, {"unit", q.unit}, {"levels", bounds_json(r.alpha.outputs[i], q.unit_value)}};
    try {
      const uncertainty::FuzzyNumber y = uncertainty::make_number(r.alpha.outputs[i]);
      o["centroid"] = uncertainty::calc_centroid(y) / q.unit_value;
      o["mean_of_midpoints"] = uncertainty::calc_mean_of_midpoints(y) / q.unit_value;
      o["jain"] = uncertainty::calc_jain(y) / q.unit_value;
      o["chen"] = uncertainty::calc_chen(y) / q.unit_value;
      o["entropy"] = uncertainty::calc_entropy(y) / q.unit_value;
      o["robustness"] = number(calc_robustness_of(p, r, i));
    } catch (const InputError&) {
      o["centroid"] = nullptr;  // a level without a value
    }
    out["outputs"].push_back(o);
  }
  out["outcomes"] = json::array();
  for (const auto& c : r.alpha.classes) {
    json o{{"name", name_of_outcome(r, c.outcome)},
           {"is_failure", c.outcome == uncertainty::failed_outcome},
           {"runs", c.count},
           {"possibility", possibility_of(r, c)},
           {"necessity", necessity_of(r, c.outcome)},
           {"necessity_converged", is_necessity_converged(p, r, c.outcome)},
           {"sample", c.sample}};
    for (const auto& found : r.possibilities.classes)
      if (found.outcome == c.outcome) add_search(o, found);
    o["outputs"] = outputs_json(p, r.outputs, c.outputs);
    out["outcomes"].push_back(o);
  }
  out["not_met"] = list_unmet_outcomes(p, r);
  out["requirement"] = requirement_json(p, r);
  out["limits"] = limits_json(p, r);
  out["coverage"] = json::array();
  for (const auto& c : r.alpha.coverage)
    out["coverage"].push_back({{"alpha", c.alpha}, {"samples", c.samples}, {"spread", c.space_points}});
  out["failures"] = r.failures;
  out["notable"] = json::array();
  for (const NotableRun& n : list_notable_runs(p, r)) out["notable"].push_back({{"sample", n.sample}, {"why", n.why}});
  out.update(insights_json(p, r));
  out.update(fans_json(p, r));
  if (r.confirmation.limit > 0) out["confirmation"] = confirmation_json(p, r);
  return out;
}

std::string write_results_json(const Problem& p, const StudyResult& r) {
  return make_results_json(p, r).dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

std::string write_membership_csv(const Problem& p, const StudyResult& r) {
  std::string text = "output,outcome,alpha,lower,upper,lower_converged,upper_converged\n";
  const auto add = [&](const std::vector<uncertainty::OutputBounds>& outputs, const std::string& outcome) {
    for (std::size_t i = 0; i < outputs.size() && i < r.outputs.size(); ++i)
      for (const auto& l : outputs[i].levels)
        text += fmt::format("{},{},{},{},{},{:d},{:d}\n", cell(title_of(find_output(p, r.outputs[i]))), cell(outcome),
                            cell(l.alpha), cell(l.lower.value / unit_of(p, r.outputs[i])),
                            cell(l.upper.value / unit_of(p, r.outputs[i])), l.lower.converged, l.upper.converged);
  };
  add(r.alpha.outputs, "");
  if (count_outcomes(r.alpha) > 1)
    for (const auto& c : r.alpha.classes) add(c.outputs, words_of_outcome(r, c.outcome));
  return text;
}

std::string write_outcomes_csv(const Problem& p, const StudyResult& r) {
  std::string text = "outcome,runs,possibility,necessity,possibility_converged,necessity_converged\n";
  for (const auto& c : r.alpha.classes)
    text += fmt::format("{},{},{},{},{:d},{:d}\n", cell(name_of_outcome(r, c.outcome)), c.count,
                        cell(possibility_of(r, c)), cell(necessity_of(r, c.outcome)), is_possibility_converged(r, c),
                        is_necessity_converged(p, r, c.outcome));
  return text;
}

std::string write_requirement_csv(const Problem& p, const StudyResult& r) {
  std::string text;
  for (const RequirementClass& c : list_requirement(p, r))
    text += fmt::format("{},{},{},{},{},{:d},{:d}\n", cell(p.permissible), c.name, c.runs, cell(c.found.possibility),
                        cell(c.necessity), c.found.converged, c.is_necessity_converged);
  if (text.empty()) return text;
  return "requirement,class,runs,possibility,necessity,possibility_converged,necessity_converged\n" + text;
}

std::string write_limits_csv(const Problem& p, const StudyResult& r) {
  std::string text;
  for (const LimitFinding& f : list_limits(p, r)) {
    const Limit& limit = p.limits[static_cast<std::size_t>(f.limit)];
    const Quantity q = find_output(p, limit.output);
    text += fmt::format("{},{},{},{},{},{},{},{},{},{:d}\n", cell(limit.output), name_of_kind(limit.kind),
                        cell(limit.place), cell(q.unit), cell(limit.least / q.unit_value), f.runs, f.broken, f.open,
                        cell(f.found.possibility), f.found.converged);
  }
  if (text.empty()) return text;
  return "output,kind,place,unit,limit,runs,broken,open,possibility_of_breaking,possibility_converged\n" + text;
}

std::string write_samples_csv(const Problem& p, const StudyResult& r) {
  // inputs have names of their own; those of outputs are the model's, and may be any
  std::set<std::string> titles = {"sample", "membership", "outcome", "failure"};
  std::string text;
  const auto add_title = [&](std::string title, const char* kind) {
    while (!titles.insert(title).second) title += kind;
    text += "," + cell(title);
  };
  for (const auto* list : {&p.inputs, &p.derived})
    for (const Quantity& q : *list) add_title(title_of(q), " (input)");
  text += ",membership,outcome";
  for (const std::string& name : r.outputs) add_title(title_of(find_output(p, name)), " (output)");
  text = "sample" + text + ",failure\n";
  for (std::size_t i = 0; i < r.alpha.archive.size(); ++i) {
    const uncertainty::Sample& s = r.alpha.archive.samples()[i];
    text += std::to_string(i);
    for (std::size_t k = 0; k < s.x.size(); ++k) text += "," + cell(read_in(p.inputs[k].unit_value, s.x[k]));
    if (p.calc_derived) {
      const std::vector<double> derived = p.calc_derived(s.x);
      for (std::size_t k = 0; k < derived.size(); ++k) text += "," + cell(derived[k] / p.derived[k].unit_value);
    }
    text += "," + cell(uncertainty::calc_membership(p.space, s.x)) + "," +
            cell(name_of_outcome(r, uncertainty::outcome_of(s.result)));
    for (std::size_t k = 0; k < r.outputs.size(); ++k)
      text += "," + (k < s.result.values.size() ? cell(s.result.values[k] / unit_of(p, r.outputs[k])) : std::string());
    text += "," + cell(s.result.text) + "\n";
  }
  return text;
}

std::string write_trajectories_csv(const Problem& p, const StudyResult& r) {
  std::vector<double> units;  // of each ordinate
  for (const Curve& c : list_curves(p, r.alpha.archive)) units.insert(units.end(), c.at.size(), c.unit_value);
  std::string text;
  for (std::size_t i = 0; i < r.alpha.archive.size(); ++i) {
    const Result& result = r.alpha.archive.samples()[i].result;
    if (result.trajectory.empty()) continue;
    text += std::to_string(i);
    for (std::size_t k = 0; k < result.trajectory.size(); ++k)
      text += "," + cell(result.trajectory[k] / (k < units.size() ? units[k] : 1));
    text += "\n";
  }
  return text;
}

std::string write_drivers_csv(const Problem& p, const StudyResult& r) {
  const Insights& in = r.insights;
  if (in.source == Insights::Source::None && in.knowing.empty()) return {};
  std::string text =
      "kind,name,input,first,first_error,total,total_error,best_place,worst_place,possibility,possibility_known,"
      "known_converged\n";
  const auto add = [&](const char* kind, const std::string& name, const std::vector<uncertainty::Driver>& drivers,
                       const uncertainty::ClassBounds* c) {
    const std::vector<uncertainty::Rank> ranks = uncertainty::calc_ranks(drivers);
    for (std::size_t i = 0; i < p.inputs.size(); ++i) {
      text += fmt::format("{},{},{}", kind, cell(name), cell(p.inputs[i].name));
      if (i < drivers.size())
        text += fmt::format(",{},{},{},{},{},{}", cell(drivers[i].first), cell(drivers[i].first_error),
                            cell(drivers[i].total), cell(drivers[i].total_error), ranks[i].best, ranks[i].worst);
      else
        text += ",,,,,,";
      text += c ? "," + cell(possibility_of(r, *c)) : ",";
      std::string known = ",";
      for (const uncertainty::Fixed& f : in.knowing)
        if (c && f.input == static_cast<int>(i)) {
          known = "0,0";
          for (const auto& k : f.classes)
            if (k.outcome == c->outcome) known = fmt::format("{},{:d}", cell(k.possibility), k.converged);
        }
      text += "," + known + "\n";
    }
  };
  if (in.source != Insights::Source::None)
    for (std::size_t o = 0; o < in.drivers.outputs.size() && o < r.outputs.size(); ++o)
      add("output", r.outputs[o], in.drivers.outputs[o], nullptr);
  for (const auto& c : r.alpha.classes) {
    std::vector<uncertainty::Driver> drivers;
    for (const auto& d : in.drivers.outcomes)
      if (d.outcome == c.outcome) drivers = d.inputs;
    add("outcome", name_of_outcome(r, c.outcome), drivers, &c);
  }
  return text;
}

std::string write_boxes_csv(const Problem& p, const StudyResult& r) {
  if (!r.insights.has_boxes) return {};
  std::string text = "box,kept,input,lower,core,upper,volume,runs,fresh,tries,violating,distance,robustness\n";
  int kept = 0, dropped = 0;
  for (const uncertainty::PermissibleBox& b : r.insights.boxes.boxes) {
    const std::string name = b.kept ? std::to_string(++kept) : fmt::format("dropped {}", ++dropped);
    for (std::size_t i = 0; i < p.inputs.size(); ++i) {
      const double unit = p.inputs[i].unit_value;
      const bool has_core = b.centre >= 0 && static_cast<std::size_t>(b.centre) < r.alpha.archive.size();
      text += fmt::format("{},{:d},{},{},{},{},{},{},{},{},{},{},{}\n", name, b.kept, cell(title_of(p.inputs[i])),
                          cell(b.box.lower[i] / unit), has_core ? cell(r.alpha.archive[b.centre].x[i] / unit) : "",
                          cell(b.box.upper[i] / unit), cell(b.volume), b.samples, b.fresh, b.tries,
                          b.fresh > 0 ? cell(b.violating) : "", cell(b.distance), cell(b.robustness));
    }
  }
  return text;
}

std::string write_fans_csv(const Problem& p, const StudyResult& r) {
  const std::vector<Curve> curves = list_curves(p, r.alpha.archive);
  std::string text;
  for (const CurveFan& f : calc_fans(p, r)) {
    const Curve& c = curves[static_cast<std::size_t>(f.curve)];
    const std::string name = title_of({c.name, c.unit, 1});
    const std::string outcome = f.outcome == uncertainty::all_outcomes ? "" : words_of_outcome(r, f.outcome);
    for (const auto& l : f.levels)
      for (std::size_t t = 0; t < l.lower.size() && t < c.at.size(); ++t)
        text += fmt::format("{},{},{},{},{},{}\n", cell(name), cell(outcome), cell(l.alpha), cell(c.at[t]),
                            cell(l.lower[t] / c.unit_value), cell(l.upper[t] / c.unit_value));
  }
  return text.empty() ? text : "curve,outcome,alpha,at,lower,upper\n" + text;
}

std::string write_debris_csv(const Problem& p, const StudyResult& r) {
  const std::vector<Curve> curves = list_curves(p, r.alpha.archive);
  std::string text;
  for (const CurveFan& f : calc_fans(p, r)) {
    const Curve& c = curves[static_cast<std::size_t>(f.curve)];
    if (!c.is_outline) continue;
    const std::string outcome = f.outcome == uncertainty::all_outcomes ? "" : words_of_outcome(r, f.outcome);
    for (const DebrisLevel& d : calc_debris(c, f))
      for (const auto& corner : d.corners)
        text += fmt::format("{},{},{},{}\n", cell(outcome), cell(d.alpha), cell(corner[0]), cell(corner[1]));
  }
  return text.empty() ? text : "outcome,alpha,x [m],y [m]\n" + text;
}

std::string write_confirmation_csv(const Problem& p, const StudyResult& r) {
  const Confirmation& c = r.confirmation;
  if (c.limit == 0) return {};
  std::string text = "output,outcome,alpha,side,condensed,whole,state\n";
  for (const Confirmation::Bound& b : c.bounds) {
    const std::string& output = r.outputs[static_cast<std::size_t>(b.output)];
    const auto& level = r.alpha.outputs[static_cast<std::size_t>(b.output)].levels[static_cast<std::size_t>(b.level)];
    const double unit = unit_of(p, output);
    text +=
        fmt::format("{},,{},{},{},{},{}\n", cell(title_of(find_output(p, output))), cell(level.alpha),
                    b.is_upper ? "upper" : "lower", cell((b.is_upper ? level.upper.value : level.lower.value) / unit),
                    cell(b.whole / unit), to_text(b.state));
  }
  for (const Confirmation::Outcome& o : c.outcomes)
    text +=
        fmt::format(",{},,,{},{},{}\n", cell(name_of_outcome(r, o.outcome)), cell(name_of_outcome(r, o.outcome)),
                    o.state == Confirmation::State::NotRun ? "" : cell(name_of_outcome(r, o.whole)), to_text(o.state));
  return text;
}

void remove_result(const std::string& path, std::string_view begin) {
  std::error_code failure;
  if (std::filesystem::is_directory(path, failure)) return;
  {
    std::ifstream in(path, std::ios::binary);
    for (const char wanted : begin) {
      if (wanted == 'N') {
        if (!std::isdigit(in.peek())) return;
        while (std::isdigit(in.peek())) in.get();
      } else if (in.get() != wanted) {
        return;
      }
    }
  }
  std::filesystem::remove(path, failure);
  if (failure) throw std::runtime_error(path + " holds no longer and cannot be removed: " + failure.message());
}

std::vector<std::string> write_results(const std::string& folder, const Problem& p, const StudyResult& r) {
  std::vector<std::string> paths;
  const auto write = [&](const char* name, const std::string& text, std::string_view begin = {}) {
    const std::string path = (std::filesystem::path(folder) / name).string();
    if (text.empty()) {
      remove_result(path, begin);  // of earlier settings
      return;
    }
    paths.push_back(path);
    replace_file(path, text);
  };
  write("results.json", write_results_json(p, r));
  write("membership.csv", write_membership_csv(p, r));
  write("outcomes.csv", write_outcomes_csv(p, r));
  write("requirement.csv", write_requirement_csv(p, r), "requirement,class,runs,");
  write("limits.csv", write_limits_csv(p, r), "output,kind,place,");
  write("samples.csv", write_samples_csv(p, r));
  write("trajectories.csv", write_trajectories_csv(p, r), "N,");
  write("drivers.csv", write_drivers_csv(p, r), "kind,name,input,");
  write("boxes.csv", write_boxes_csv(p, r), "box,kept,input,");
  write("fans.csv", write_fans_csv(p, r), "curve,outcome,alpha,");
  write("debris.csv", write_debris_csv(p, r), "outcome,alpha,x [m],");
  write("confirmation.csv", write_confirmation_csv(p, r), "output,outcome,alpha,side,");
  return paths;
}

int calc_digits(double low, double high, int digits) {
  const double size = std::max(std::abs(low), std::abs(high)), width = high - low;
  if (!(width > 0) || !std::isfinite(size)) return digits;
  return std::min(17, digits + std::max(0, static_cast<int>(std::floor(std::log10(size / width) + 1e-9))));
}

}  // namespace topple::study
