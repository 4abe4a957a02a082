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
  std::vector<float> ordinates;
  ordinates.reserve(chosen.size() * points);
  std::vector<int> digits;  // of outputs
  for (std::size_t k = 0; k < r.outputs.size(); ++k) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const int i : chosen)
      if (const auto& values = r.alpha.archive[i].result.values; k < values.size() && std::isfinite(values[k]))
        low = std::min(low, values[k]), high = std::max(high, values[k]);
    digits.push_back(calc_digits(low, high, 7));
  }
  for (const int i : chosen) {
    const uncertainty::Sample& s = r.alpha.archive[i];
    json inputs = json::array(), derived = json::array(), outputs = json::array();
    for (std::size_t k = 0; k < s.x.size(); ++k) inputs.push_back(number(s.x[k] / p.inputs[k].unit_value));
    if (p.calc_derived) {
      const std::vector<double> values = p.calc_derived(s.x);
      for (std::size_t k = 0; k < values.size(); ++k) derived.push_back(number(values[k] / p.derived[k].unit_value));
    }
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
    std::size_t begin = 0;
    for (const Curve& c : curves) {
      for (std::size_t t = begin; t < begin + c.at.size() && !c.is_outline; ++t)
        ordinates.push_back(t < s.result.trajectory.size() ? static_cast<float>(s.result.trajectory[t] / c.unit_value)
                                                           : std::numeric_limits<float>::quiet_NaN());
      begin += c.at.size();
    }
  }
  out["points"] = points;
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
