#include "study/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "base/bytes.h"
#include "study/fans.h"
#include "study/randomness.h"
#include "study/results.h"
#include "study/story.h"

namespace topple::study {
namespace {

using json = nlohmann::ordered_json;

/// Seven digits of what varies are enough to draw and to read.
json number(double x, int digits = 7) {
  return std::isfinite(x) ? json(std::strtod(fmt::format("{:.{}g}", x, digits).c_str(), nullptr)) : json(nullptr);
}

/// Runs at places that do not count (beyond a constraint, or outside a support that was made smaller) are left out:
/// their outcome may be none of the results'.
std::vector<int> choose_runs(const Problem& p, const StudyResult& r, std::size_t most) {
  const uncertainty::Box support = uncertainty::make_box(p.space, 0);
  std::vector<int> all;
  for (int i = 0; i < static_cast<int>(r.alpha.archive.size()); ++i)
    if (uncertainty::is_in_cut(p.space, support, 0, r.alpha.archive[i].x)) all.push_back(i);
  std::set<int> chosen;
  for (const NotableRun& n : list_notable_runs(p, r)) chosen.insert(n.sample);
  const std::size_t even = std::min(all.size(), most);
  for (std::size_t k = 0; k < even; ++k) chosen.insert(all[k * all.size() / even]);
  return {chosen.begin(), chosen.end()};
}

json runs_json(const Problem& p, const StudyResult& r, const std::vector<int>& chosen) {
  json out{
      {"sample", chosen},         {"inputs", json::array()},  {"derived", json::array()}, {"membership", json::array()},
      {"outcome", json::array()}, {"outputs", json::array()}, {"failure", json::object()}};
  std::map<int, int> place;  // of classes among the outcomes of the results
  for (const auto& c : r.alpha.classes) place.emplace(c.outcome, static_cast<int>(place.size()));
  const std::vector<Curve> curves = list_curves(p, r.alpha.archive);
  std::size_t points = 0;
  for (const Curve& c : curves) points += c.is_outline ? 0 : c.at.size();
  std::vector<float> ordinates;  // over the first run that has them: what varies counts, not what all share
  ordinates.reserve(chosen.size() * points);
  std::vector<double> bases(points, std::numeric_limits<double>::quiet_NaN());
  std::vector<std::vector<double>> derived_values;
  if (p.calc_derived)
    for (const int i : chosen) derived_values.push_back(p.calc_derived(r.alpha.archive[i].x));
  // seven digits of what varies
  const auto list_digits = [&chosen](std::size_t count, const auto& values_of) {
    std::vector<int> digits;
    for (std::size_t k = 0; k < count; ++k) {
      double low = std::numeric_limits<double>::infinity(), high = -low;
      for (std::size_t n = 0; n < chosen.size(); ++n)
        if (const std::vector<double>& values = values_of(n); k < values.size() && std::isfinite(values[k]))
          low = std::min(low, values[k]), high = std::max(high, values[k]);
      digits.push_back(calc_digits(low, high, 7));
    }
    return digits;
  };
  const auto sample = [&](std::size_t n) -> const uncertainty::Sample& { return r.alpha.archive[chosen[n]]; };
  const std::vector<int> digits = list_digits(
      r.outputs.size(), [&](std::size_t n) -> const auto& { return sample(n).result.values; });
  const std::vector<int> input_digits = list_digits(
      p.inputs.size(), [&](std::size_t n) -> const auto& { return sample(n).x; });
  std::vector<int> derived_digits;
  if (p.calc_derived)
    derived_digits = list_digits(
        p.derived.size(), [&](std::size_t n) -> const auto& { return derived_values[n]; });
  for (std::size_t n = 0; n < chosen.size(); ++n) {
    const int i = chosen[n];
    const uncertainty::Sample& s = sample(n);
    json inputs = json::array(), derived = json::array(), outputs = json::array();
    for (std::size_t k = 0; k < s.x.size(); ++k)
      inputs.push_back(number(s.x[k] / p.inputs[k].unit_value, input_digits[k]));
    if (p.calc_derived)
      for (std::size_t k = 0; k < p.derived.size(); ++k)
        derived.push_back(number(derived_values[n][k] / p.derived[k].unit_value, derived_digits[k]));
    for (std::size_t k = 0; k < r.outputs.size(); ++k)
      outputs.push_back(k < s.result.values.size()
                            ? number(s.result.values[k] / find_output(p, r.outputs[k]).unit_value, digits[k])
                            : json(nullptr));
    out["inputs"].push_back(inputs);
    out["derived"].push_back(derived);
    out["outputs"].push_back(outputs);
    out["membership"].push_back(number(uncertainty::calc_membership(p.space, s.x)));
    out["outcome"].push_back(place.at(uncertainty::outcome_of(s.result)));
    if (s.result.state == uncertainty::Result::State::Failed) out["failure"][std::to_string(i)] = s.result.text;
    std::size_t begin = 0, point = 0;
    for (const Curve& c : curves) {
      for (std::size_t t = begin; t < begin + c.at.size() && !c.is_outline; ++t) {
        double& base = bases[point++];
        const double value = t < s.result.trajectory.size() ? s.result.trajectory[t] / c.unit_value
                                                            : std::numeric_limits<double>::quiet_NaN();
        if (!std::isfinite(base) && std::isfinite(value)) base = value;
        ordinates.push_back(static_cast<float>(value - base));
      }
      begin += c.at.size();
    }
  }
  out["points"] = points;
  out["trajectory_base"] = json::array();
  for (const double base : bases) out["trajectory_base"].push_back(number(base, 17));
  out["trajectories"] = encode_base64(to_little_endian(std::span<const float>(ordinates)));
  return out;
}

}  // namespace

std::string to_page_json(const Problem& p, const StudyResult& r, const PageOrigin& origin, std::size_t most) {
  json out{{"format", "topple-study"}, {"version", 1}};
  out.update(make_results_json(p, r));
  const std::vector<int> chosen = choose_runs(p, r, most);
  out["run_table"] = runs_json(p, r, chosen);
  json neighbours = json::array();
  for (const Site::Area& a : p.site.neighbours)
    neighbours.push_back({{"name", a.name}, {"footprint", a.corners}, {"is_utility", a.is_utility}});
  out["site"] = {{"footprint", p.site.footprint}, {"outlines", p.site.outlines}, {"neighbours", neighbours}};
  out["not_modelled"] = p.not_modelled;
  out["origin"] = {
      {"program_version", origin.program_version}, {"created", origin.created},         {"model", calc_model_hash(p)},
      {"kind", p.random ? p.random->of : p.kind},  {"source_name", origin.source_name}, {"source", origin.source}};
  return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace topple::study
