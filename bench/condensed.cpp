/// How far condensed samples are from whole ones: the fuzzy storehouse at points of a Sobol sequence, as CSV.
///   topple_condensed_bench [points [seed [highest frequency]]]
/// The same seed gives the same points. Seeds 1 to 9 were used while the condensation was made, 11 and above only to
/// measure it (docs/decisions/0034-condensed-samples.md).

#include <fmt/format.h>

#include <cstdlib>
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

int compare(int count, std::uint64_t seed, double frequency, bool with_whole) {
  std::vector<Diagnostic> warnings;
  std::string text;
  const product::Plan plan = product::read_plan_file(TOPPLE_EXAMPLES "/weida/plan-fuzzy.toml", warnings, text);
  study::PlanMappingOptions options;
  options.threads = 0;
  const study::PlanMapping whole(plan, collapse::default_knowledge(), options);
  options.condensed = true;
  options.highest_frequency = frequency;
  const study::PlanMapping condensed(plan, collapse::default_knowledge(), options);
  const uncertainty::Box support = uncertainty::make_box(whole.space(), 0);
  std::vector<uncertainty::Point> points;
  for (const uncertainty::Point& p : uncertainty::make_sobol_points(whole.space().size(), 0, count, seed))
    points.push_back(uncertainty::place_in(support, p));
  std::vector<uncertainty::Result> a(points.size()), b(points.size());
  study::PlanMappingTimes spent_a, spent_b;
  condensed.evaluate(points, b, nullptr, &spent_b);
  print_times("condensed", spent_b, count);
  if (with_whole) {
    whole.evaluate(points, a, nullptr, &spent_a);
    print_times("whole", spent_a, count);
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
  const int count = argc > 1 ? std::atoi(argv[1]) : 24;
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoi(argv[2]) : 1);
  try {
    return compare(count, seed, argc > 3 ? std::atof(argv[3]) : 1000, argc <= 4);
  } catch (const topple::InputError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 2;
  }
}
