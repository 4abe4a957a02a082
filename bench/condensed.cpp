/// How far condensed samples are from whole ones: the fuzzy storehouse at points of a Sobol sequence, as CSV.
///   topple_condensed_bench [points=24] [seed=1] [frequency=1400] [step=1] [law=cells|full] [lanes=no|yes]
///                          [pass=yes|no] [nudge=0] [whole=yes|no]
/// frequency: in place of rule body.highest_frequency [rad/s]; step: share of the engine's own; law: full for every
/// zone at each step; lanes: one sample in each; pass: over quiet times; nudge: share by which every value is moved.
/// The same seed gives the same points. Seeds 1 to 9 were used while the condensation was made, 11 and above only to
/// measure it (docs/decisions/0034-condensed-samples.md).

#include <fmt/format.h>

#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/error.h"
#include "base/unit.h"
#include "study/plan_mapping.h"

namespace {

using namespace topple;

void print_times(const char* name, const study::PlanMappingTimes& t, double n) {
  fmt::print(stderr,
             "{}: {:.2f} ms a sample: plans {:.2f}, models {:.2f}, equilibria {:.2f}, standing {:.2f}, falling {:.2f}, "
             "outputs {:.2f}\n",
             name, 1e3 / n * (t.plans + t.models + t.equilibria + t.standing + t.falling + t.outputs),
             1e3 / n * t.plans, 1e3 / n * t.models, 1e3 / n * t.equilibria, 1e3 / n * t.standing, 1e3 / n * t.falling,
             1e3 / n * t.outputs);
}

struct Settings {
  int points = 24;
  std::uint64_t seed = 1;
  study::PlanMappingOptions mapping;
  collapse::Knowledge knowledge = collapse::default_knowledge();
  double nudge = 0;
  bool with_whole = true;
};

int compare(const Settings& settings) {
  std::vector<Diagnostic> warnings;
  std::string text;
  const product::Plan plan = product::read_plan_file(TOPPLE_EXAMPLES "/weida/plan-fuzzy.toml", warnings, text);
  study::PlanMappingOptions options = settings.mapping;
  options.threads = 0;
  options.vibration = options.sideways = false;  // condensed runs have neither
  const study::PlanMapping whole(plan, settings.knowledge, options);
  options.condensed = true;
  const study::PlanMapping condensed(plan, settings.knowledge, options);
  if (condensed.outputs().size() != whole.outputs().size())
    throw std::logic_error("condensed and whole runs have other outputs");
  const uncertainty::Box support = uncertainty::make_box(whole.space(), 0);
  std::vector<uncertainty::Point> points;
  for (const uncertainty::Point& p :
       uncertainty::make_sobol_points(whole.space().size(), 0, settings.points, settings.seed)) {
    points.push_back(uncertainty::place_in(support, p));
    for (double& x : points.back()) x *= 1 + settings.nudge;
  }
  std::vector<uncertainty::Result> a(points.size()), b(points.size());
  study::PlanMappingTimes spent_a, spent_b;
  condensed.evaluate(points, b, nullptr, &spent_b);
  print_times("condensed", spent_b, settings.points);
  if (settings.with_whole) {
    whole.evaluate(points, a, nullptr, &spent_a);
    print_times("whole", spent_a, settings.points);
  }
  std::string header = "point";
  for (const auto& q : whole.inputs()) header += "," + q.name;
  header += ",outcome,condensed outcome";
  for (const auto& q : whole.outputs()) header += fmt::format(",{} [{}],condensed", q.name, q.symbol);
  fmt::print("{}\n", header);
  for (std::size_t i = 0; i < points.size(); ++i) {
    std::string line = std::to_string(i);
    for (std::size_t k = 0; k < whole.inputs().size(); ++k)
      line += fmt::format(",{:.5g}", points[i][k] / whole.inputs()[k].unit);
    for (const auto* r : {&a[i], &b[i]})
      line += "," + (r->values.empty() ? "failed" : study::plan_outcomes()[static_cast<std::size_t>(r->outcome)]);
    for (std::size_t k = 0; k < whole.outputs().size(); ++k)
      for (const auto* r : {&a[i], &b[i]})
        line += r->values.empty() ? "," : fmt::format(",{:.5g}", r->values[k] / whole.outputs()[k].unit);
    fmt::print("{}{}\n", line, b[i].text.empty() ? "" : "," + b[i].text);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Settings settings;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const std::size_t at = word.find('=');
    const std::string name = word.substr(0, at), value = at == std::string::npos ? "" : word.substr(at + 1);
    if (name == "points") {
      settings.points = std::atoi(value.c_str());
    } else if (name == "seed") {
      settings.seed = static_cast<std::uint64_t>(std::atoi(value.c_str()));
    } else if (name == "frequency") {
      settings.knowledge.body_highest_frequency = std::atof(value.c_str());
    } else if (name == "step") {
      settings.mapping.step_share = std::atof(value.c_str());
    } else if (name == "law") {
      settings.mapping.full_law = value == "full";
    } else if (name == "lanes") {
      settings.mapping.lanes = value == "yes";
    } else if (name == "pass") {
      settings.mapping.passes_quiet = value != "no";
    } else if (name == "nudge") {
      settings.nudge = std::atof(value.c_str());
    } else if (name == "whole") {
      settings.with_whole = value != "no";
    } else {
      fmt::print(stderr, "{}: not one of points, seed, frequency, step, law, lanes, pass, nudge, whole\n", word);
      return 2;
    }
  }
  try {
    return compare(settings);
  } catch (const topple::InputError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 2;
  }
}
