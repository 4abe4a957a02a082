#include "collapse/vibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/unit.h"

namespace topple::collapse {

namespace {

/// A row of the table: up to 10 Hz, at 50 Hz, at 100 Hz and above, linear between [mm/s].
struct Row {
  const char* name;
  int line;
  double low, middle, high;
};
Row row_of(product::BuildingClass c) {
  switch (c) {
    case product::BuildingClass::Commercial:
      return {"commercial and industrial buildings", 1, 20, 40, 50};
    case product::BuildingClass::Residential:
      return {"residential buildings", 2, 5, 15, 20};
    case product::BuildingClass::Sensitive:
      return {"buildings that are sensitive and worth preserving", 3, 3, 8, 10};
    case product::BuildingClass::Unknown:
      break;
  }
  return {"", 0, 0, 0, 0};
}

}  // namespace

Shaking find_shaking(const product::VibrationLaw& law, const std::vector<Touchdown>& touchdowns,
                     const Polygon& footprint) {
  std::vector<const Touchdown*> order;
  for (const Touchdown& t : touchdowns)
    if (t.energy > 0) order.push_back(&t);
  std::stable_sort(order.begin(), order.end(),
                   [](const Touchdown* a, const Touchdown* b) { return a->time < b->time; });
  // energy that would shake as much from the reference distance
  std::vector<double> weighed, distance;
  for (const Touchdown* t : order) {
    const double r = std::max(calc_distance({t->place}, footprint), law.least_distance);
    distance.push_back(r);
    weighed.push_back(t->energy * std::pow(law.distance / r, law.distance_exponent / law.energy_exponent));
  }
  Shaking out;
  size_t first = 0;
  for (size_t last = 0; last < order.size(); ++last) {
    while (order[last]->time - order[first]->time > law.window) ++first;
    double sum = 0, energy = 0;
    size_t most = first;
    for (size_t i = first; i <= last; ++i) {
      sum += weighed[i];
      energy += order[i]->energy;
      if (weighed[i] > weighed[most]) most = i;
    }
    const double v = law.velocity * std::pow(sum / law.energy, law.energy_exponent);
    if (v > out.velocity) out = {v, order[last]->time, energy, distance[most], order[most]->body};
  }
  return out;
}

double calc_vibration_limit(product::BuildingClass c, double frequency) {
  const Row row = row_of(c);
  const double f = std::min(frequency, 100.0);
  const double limit = f <= 10   ? row.low
                       : f <= 50 ? row.low + (row.middle - row.low) * (f - 10) / 40
                                 : row.middle + (row.high - row.middle) * (f - 50) / 50;
  return limit * unit::mm;
}

std::string describe_vibration_limit(product::BuildingClass c) {
  const Row row = row_of(c);
  return fmt::format("{} (line {}): {:g} mm/s up to 10 Hz, rising to {:g} at 50 Hz and {:g} at 100 Hz", row.name,
                     row.line, row.low, row.middle, row.high);
}

}  // namespace topple::collapse
