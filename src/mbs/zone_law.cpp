#include "mbs/zone_law.h"

#include <algorithm>
#include <cmath>

namespace topple::mbs {

int find_interval(const std::vector<double>& grid, double x, int hint) {
  const int last = static_cast<int>(grid.size()) - 2;
  int i = std::clamp(hint, 0, last);
  while (i > 0 && x < grid[static_cast<size_t>(i)]) --i;
  while (i < last && x >= grid[static_cast<size_t>(i) + 1]) ++i;
  return i;
}

CompiledLaw compile_law(const ZoneLaw& law) {
  CompiledLaw c;
  const MomentFamily* families[2] = {&law.moment_y, &law.moment_z};
  for (int axis = 0; axis < 2; ++axis) {
    const MomentFamily& from = *families[axis];
    CompiledFamily& to = c.moment[axis];
    to.K = static_cast<int>(from.normal_force.size());
    to.J = static_cast<int>(from.plastic_rotation.size());
    to.force = from.normal_force;
    to.rotation = from.plastic_rotation;
    if (axis == 1)
      for (double& r : to.rotation) r *= law.rotation_ratio;
    const size_t J = from.plastic_rotation.size();
    to.points.resize(from.positive.size());
    to.lifts = !from.elongation_positive.empty();
    double largest = 0;
    for (size_t i = 0; i < from.positive.size(); ++i) {
      FamilyPoint& point = *to.at(i / J, i % J);
      point = {from.positive[i], from.negative[i], 0, 0};
      largest = std::max({largest, from.positive[i], from.negative[i]});
      if (!to.lifts) continue;
      const size_t j = std::min(i % J, J - 2), row = i - i % J;  // the last interval goes on
      const double step = to.rotation[j + 1] - to.rotation[j];
      point.lift_positive = (from.elongation_positive[row + j + 1] - from.elongation_positive[row + j]) / step;
      point.lift_negative = (from.elongation_negative[row + j + 1] - from.elongation_negative[row + j]) / step;
    }
    // The capacity at a rotation is where the interpolated limit reaches zero on the side of compression.
    to.capacity.resize(static_cast<size_t>(to.J));
    for (int j = 0; j < to.J; ++j) {
      double capacity = 0;
      for (int k = 0; k < to.K; ++k) {
        const FamilyPoint& point = *to.at(static_cast<size_t>(k), static_cast<size_t>(j));
        if (std::max(point.positive, point.negative) > 1e-3 * largest) {
          capacity = -to.force[static_cast<size_t>(std::max(k - 1, 0))];
          break;
        }
      }
      to.capacity[static_cast<size_t>(j)] = std::max(capacity, 0.0);
    }
    // a zone does not regain capacity by turning further
    for (int j = 1; j < to.J; ++j)
      to.capacity[static_cast<size_t>(j)] =
          std::min(to.capacity[static_cast<size_t>(j)], to.capacity[static_cast<size_t>(j) - 1]);
  }
  c.elongates = c.moment[0].lifts || c.moment[1].lifts;
  c.compression = {law.compression.x, law.compression.f};
  c.tension = {law.tension.x, law.tension.f};
  if (!law.compression.f.empty()) {
    // what lies behind a length that is kept is of the end that has been crushed so far
    auto end = static_cast<std::ptrdiff_t>(law.compression.f.size());
    if (law.keeps_length) {
      const std::vector<double>& x = law.compression.x;
      end = std::upper_bound(x.begin(), x.end(), law.crush_length) - x.begin();
      // both ends bear at once where the curve rises to what lies behind within a share of that length; else along it
      constexpr double meets = 1.002;
      const bool bears_at_once =
          end < static_cast<std::ptrdiff_t>(x.size()) && x[static_cast<size_t>(end)] <= meets * law.crush_length;
      c.end_begins = bears_at_once ? x[static_cast<size_t>(end)] : law.crush_length;
    }
    const auto peak = std::max_element(law.compression.f.begin(), law.compression.f.begin() + end);
    c.peak_compression = *peak;
    c.peak_shortening = law.compression.x[static_cast<size_t>(peak - law.compression.f.begin())];
  } else {
    c.peak_shortening = kUnlimited;
  }
  c.buckles = law.buckles, c.keeps_length = law.keeps_length;
  c.biaxial_exponent = law.biaxial_exponent;
  c.rotation_ratio = law.rotation_ratio;
  c.damage_share = law.damage_share;
  c.rupture_rotation = law.rupture_rotation;
  c.rupture_rotation_pressed = std::max(law.rupture_rotation, law.rupture_rotation_pressed);
  c.crush_length = law.crush_length;
  c.rupture_elongation = law.rupture_elongation;
  c.shear[0] = law.shear_y;
  c.shear[1] = law.shear_z;
  c.shear_friction = law.shear_friction;
  c.slip_softening = law.slip_softening;
  c.slip_rupture = law.slip_rupture;
  c.torsion = law.torsion;
  c.twist_rupture = law.twist_rupture;
  return c;
}

double calc_curve(const CompiledCurve& curve, double x) {
  if (curve.x.empty()) return kUnlimited;
  if (x <= curve.x.front()) return curve.f.front();
  if (x >= curve.x.back()) return curve.f.back();
  const size_t i = static_cast<size_t>(std::upper_bound(curve.x.begin(), curve.x.end(), x) - curve.x.begin()) - 1;
  const double t = (x - curve.x[i]) / (curve.x[i + 1] - curve.x[i]);
  return curve.f[i] + t * (curve.f[i + 1] - curve.f[i]);
}

double calc_mean(const CompiledCurve& curve, double from, double to) {
  if (curve.x.empty() || !(to > from)) return calc_curve(curve, from);
  double work = 0, x = from, f = calc_curve(curve, from);
  const auto go = [&](double next) {
    const double at = calc_curve(curve, next);
    work += 0.5 * (f + at) * (next - x);
    x = next, f = at;
  };
  for (auto i = std::upper_bound(curve.x.begin(), curve.x.end(), from); i != curve.x.end() && *i < to; ++i) go(*i);
  go(to);
  return work / (to - from);
}

double calc_integrity(const CompiledLaw& law, double shortened) {
  if (shortened <= law.peak_shortening) return 1;
  return law.peak_compression > 0 ? calc_curve(law.compression, shortened) / law.peak_compression : 0;
}

namespace {

constexpr double kRoundOff = 1e-12;

/// A force on the edge of a family, where a section is while it is crushed, may be beyond it by round-off.
double put_on_edge(const CompiledFamily& family, double normal_force) {
  const double inside = std::clamp(normal_force, family.force.front(), family.force.back());
  return std::abs(normal_force - inside) <= kRoundOff * std::abs(inside) ? inside : normal_force;
}
bool is_within(const CompiledFamily& family, double normal_force) {
  return normal_force >= family.force.front() && normal_force <= family.force.back();
}

}  // namespace

MomentLimit calc_moment_limit(const CompiledFamily& family, double normal_force, double rotation, int& k, int& j) {
  if (family.K == 0) return {kUnlimited, kUnlimited};
  normal_force = put_on_edge(family, normal_force);
  if (!is_within(family, normal_force)) return {0, 0};
  k = find_interval(family.force, normal_force, k);
  j = find_interval(family.rotation, rotation, j);
  const size_t K = static_cast<size_t>(k), J = static_cast<size_t>(j);
  const double t = (normal_force - family.force[K]) / (family.force[K + 1] - family.force[K]);
  const double s =
      std::clamp((rotation - family.rotation[J]) / (family.rotation[J + 1] - family.rotation[J]), 0.0, 1.0);
  const FamilyPoint *a = family.at(K, J), *b = family.at(K, J + 1);
  const double w00 = (1 - t) * (1 - s), w01 = (1 - t) * s, w10 = t * (1 - s), w11 = t * s;
  return {w00 * a[0].positive + w01 * b[0].positive + w10 * a[1].positive + w11 * b[1].positive,
          w00 * a[0].negative + w01 * b[0].negative + w10 * a[1].negative + w11 * b[1].negative};
}

MomentLimit calc_moment_slope(const CompiledFamily& family, double normal_force, double rotation, int k, int j) {
  if (family.K == 0) return {0, 0};
  normal_force = put_on_edge(family, normal_force);
  if (!is_within(family, normal_force)) return {0, 0};
  const size_t K = static_cast<size_t>(find_interval(family.force, normal_force, k));
  const size_t J = static_cast<size_t>(find_interval(family.rotation, rotation, j));
  const double s =
      std::clamp((rotation - family.rotation[J]) / (family.rotation[J + 1] - family.rotation[J]), 0.0, 1.0);
  const FamilyPoint *a = family.at(K, J), *b = family.at(K, J + 1);
  const double width = family.force[K + 1] - family.force[K];
  return {((1 - s) * (a[1].positive - a[0].positive) + s * (b[1].positive - b[0].positive)) / width,
          ((1 - s) * (a[1].negative - a[0].negative) + s * (b[1].negative - b[0].negative)) / width};
}

Lift calc_lift(const CompiledFamily& family, double normal_force, double rotation, int& k, int& j) {
  if (!family.lifts) return {};
  normal_force = put_on_edge(family, normal_force);
  if (!is_within(family, normal_force)) return {};
  k = find_interval(family.force, normal_force, k);
  j = find_interval(family.rotation, rotation, j);
  const size_t K = static_cast<size_t>(k);
  const size_t J = static_cast<size_t>(rotation < family.rotation.back() ? j : family.J - 1);
  const double t = (normal_force - family.force[K]) / (family.force[K + 1] - family.force[K]);
  const FamilyPoint* a = family.at(K, J);
  return {(1 - t) * a[0].lift_positive + t * a[1].lift_positive, (1 - t) * a[0].lift_negative + t * a[1].lift_negative};
}

double calc_compression_capacity(const CompiledFamily& family, double rotation, int j) {
  if (family.K == 0) return kUnlimited;
  const size_t last = static_cast<size_t>(family.J) - 1;
  if (rotation >= family.rotation[last]) return family.capacity[last];
  const size_t i = static_cast<size_t>(find_interval(family.rotation, rotation, j));
  const double t = (rotation - family.rotation[i]) / (family.rotation[i + 1] - family.rotation[i]);
  return family.capacity[i] + t * (family.capacity[i + 1] - family.capacity[i]);
}

}  // namespace topple::mbs
