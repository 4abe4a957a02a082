#include "study/results.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "base/error.h"
#include "base/file.h"
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

double necessity_of(const StudyResult& r, int outcome) { return uncertainty::calc_necessity(r.possibilities, outcome); }

double possibility_of(const StudyResult& r, const uncertainty::ClassBounds& c) {
  for (const auto& p : r.possibilities.classes)
    if (p.outcome == c.outcome) return std::max(p.possibility, c.possibility);
  return c.possibility;
}

json bounds_json(const uncertainty::OutputBounds& bounds) {
  json levels = json::array();
  for (const auto& l : bounds.levels)
    levels.push_back({{"alpha", l.alpha},
                      {"lower", l.lower.value},
                      {"upper", l.upper.value},
                      {"samples", {l.lower.sample, l.upper.sample}},
                      {"converged", {l.lower.converged, l.upper.converged}}});
  return levels;
}

json quantities_json(const std::vector<Quantity>& list) {
  json out = json::array();
  for (const Quantity& q : list) out.push_back({{"name", q.name}, {"unit", q.unit}});
  return out;
}

}  // namespace

std::string name_of_outcome(const StudyResult& r, int outcome) {
  if (outcome == uncertainty::failed_outcome) return failed_name;
  const auto i = static_cast<std::size_t>(outcome);
  return i < r.outcomes.size() ? r.outcomes[i] : fmt::format("{}", outcome);
}

std::string write_results_json(const Problem& p, const StudyResult& r) {
  json out;
  out["title"] = p.title;
  out["state"] = r.is_finished ? "finished" : "open";
  out["ending"] = uncertainty::to_text(r.ending);
  out["runs"] = r.alpha.archive.size();
  out["failed"] = r.alpha.failed;
  out["seed"] = p.seed;
  out["inputs"] = quantities_json(p.inputs);
  for (std::size_t i = 0; i < p.inputs.size(); ++i) {
    json cuts = json::array();
    const double unit = p.inputs[i].unit_value;
    for (const auto& c : p.space.inputs[i].cuts()) cuts.push_back({c.alpha, c.left / unit, c.right / unit});
    out["inputs"][i]["cuts"] = cuts;
  }
  out["derived"] = quantities_json(p.derived);
  out["outputs"] = json::array();
  for (std::size_t i = 0; i < r.alpha.outputs.size() && i < r.outputs.size(); ++i) {
    json o{{"name", r.outputs[i]}, {"levels", bounds_json(r.alpha.outputs[i])}};
    try {
      const uncertainty::FuzzyNumber number = uncertainty::make_number(r.alpha.outputs[i]);
      o["centroid"] = uncertainty::calc_centroid(number);
      o["entropy"] = uncertainty::calc_entropy(number);
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
           {"sample", c.sample}};
    for (const auto& found : r.possibilities.classes)
      if (found.outcome == c.outcome) {
        o["resolution"] = found.resolution;
        o["converged"] = found.converged;
        o["runs_above"] = found.above;
      }
    o["outputs"] = json::array();
    for (std::size_t i = 0; i < c.outputs.size() && i < r.outputs.size(); ++i)
      o["outputs"].push_back({{"name", r.outputs[i]}, {"levels", bounds_json(c.outputs[i])}});
    out["outcomes"].push_back(o);
  }
  out["coverage"] = json::array();
  for (const auto& c : r.alpha.coverage)
    out["coverage"].push_back({{"alpha", c.alpha}, {"samples", c.samples}, {"spread", c.space_points}});
  out["failures"] = r.failures;
  return out.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

std::string write_membership_csv(const StudyResult& r) {
  std::string text = "output,outcome,alpha,lower,upper,lower_converged,upper_converged\n";
  const auto add = [&](const std::vector<uncertainty::OutputBounds>& outputs, const std::string& outcome) {
    for (std::size_t i = 0; i < outputs.size() && i < r.outputs.size(); ++i)
      for (const auto& l : outputs[i].levels)
        text += fmt::format("{},{},{},{},{},{:d},{:d}\n", cell(r.outputs[i]), cell(outcome), cell(l.alpha),
                            cell(l.lower.value), cell(l.upper.value), l.lower.converged, l.upper.converged);
  };
  add(r.alpha.outputs, "");
  if (r.alpha.classes.size() > 1)
    for (const auto& c : r.alpha.classes) add(c.outputs, name_of_outcome(r, c.outcome));
  return text;
}

std::string write_outcomes_csv(const StudyResult& r) {
  std::string text = "outcome,runs,possibility,necessity\n";
  for (const auto& c : r.alpha.classes)
    text += fmt::format("{},{},{},{}\n", cell(name_of_outcome(r, c.outcome)), c.count, cell(possibility_of(r, c)),
                        cell(necessity_of(r, c.outcome)));
  return text;
}

std::string write_samples_csv(const Problem& p, const StudyResult& r) {
  std::string text = "sample";
  for (const auto* list : {&p.inputs, &p.derived})
    for (const Quantity& q : *list) text += "," + cell(q.unit.empty() ? q.name : q.name + " [" + q.unit + "]");
  text += ",membership,outcome";
  for (const std::string& name : r.outputs) text += "," + cell(name);
  text += ",failure\n";
  for (std::size_t i = 0; i < r.alpha.archive.size(); ++i) {
    const uncertainty::Sample& s = r.alpha.archive.samples()[i];
    text += std::to_string(i);
    for (std::size_t k = 0; k < s.x.size(); ++k) text += "," + cell(s.x[k] / p.inputs[k].unit_value);
    if (p.calc_derived) {
      const std::vector<double> derived = p.calc_derived(s.x);
      for (std::size_t k = 0; k < derived.size(); ++k) text += "," + cell(derived[k] / p.derived[k].unit_value);
    }
    text += "," + cell(uncertainty::calc_membership(p.space, s.x)) + "," +
            cell(name_of_outcome(r, uncertainty::outcome_of(s.result)));
    for (std::size_t k = 0; k < r.outputs.size(); ++k)
      text += "," + (k < s.result.values.size() ? cell(s.result.values[k]) : std::string());
    text += "," + cell(s.result.text) + "\n";
  }
  return text;
}

std::string write_trajectories_csv(const StudyResult& r) {
  std::string text;
  for (std::size_t i = 0; i < r.alpha.archive.size(); ++i) {
    const Result& result = r.alpha.archive.samples()[i].result;
    if (result.trajectory.empty()) continue;
    text += std::to_string(i);
    for (const double y : result.trajectory) text += "," + cell(y);
    text += "\n";
  }
  return text;
}

std::vector<std::string> write_results(const std::string& folder, const Problem& p, const StudyResult& r) {
  std::vector<std::string> paths;
  const auto write = [&](const char* name, const std::string& text) {
    if (text.empty()) return;
    paths.push_back((std::filesystem::path(folder) / name).string());
    replace_file(paths.back(), text);
  };
  write("results.json", write_results_json(p, r));
  write("membership.csv", write_membership_csv(r));
  write("outcomes.csv", write_outcomes_csv(r));
  write("samples.csv", write_samples_csv(p, r));
  write("trajectories.csv", write_trajectories_csv(r));
  return paths;
}

}  // namespace topple::study
