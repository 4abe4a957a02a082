#include "collapse/schedule.h"

#include <algorithm>

namespace topple::collapse {

namespace {

std::uint64_t advance_splitmix(std::uint64_t& state) {
  std::uint64_t z = (state += 0x9E3779B97F4A7C15ULL);
  z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
  return z ^ (z >> 31);
}

}  // namespace

double calc_normal(std::uint64_t seed, std::uint64_t stream) {
  std::uint64_t state = seed;
  state = advance_splitmix(state) ^ (stream * 0xD1342543DE82EF95ULL + 1);
  double sum = -6;
  for (int i = 0; i < 12; ++i) sum += static_cast<double>(advance_splitmix(state) >> 11) * 0x1.0p-53;
  return sum;
}

std::vector<Firing> make_schedule(const product::Plan& plan, const Knowledge& knowledge) {
  std::vector<Firing> schedule;
  std::uint64_t stream = 0;
  for (size_t s = 0; s < plan.stages.size(); ++s)
    for (size_t c = 0; c < plan.stages[s].charges.size(); ++c, ++stream) {
      const product::Charge& charge = plan.stages[s].charges[c];
      const double limit = knowledge.charge_scatter_limit;
      const double off = std::clamp(calc_normal(plan.analysis.seed, stream), -limit, limit) * charge.scatter;
      Firing f;
      f.stage = static_cast<int>(s);
      f.charge = static_cast<int>(c);
      f.time = std::max(plan.stages[s].time, plan.stages[s].time + charge.delay + off);
      f.fails = charge.fails;
      schedule.push_back(f);
    }
  std::stable_sort(schedule.begin(), schedule.end(), [](const Firing& a, const Firing& b) { return a.time < b.time; });
  return schedule;
}

}  // namespace topple::collapse
