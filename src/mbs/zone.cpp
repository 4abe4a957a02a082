#include "mbs/zone.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "mbs/kernel.h"

namespace topple::mbs {

namespace {

using kernel::ActiveComponents;
using kernel::components_of;
using kernel::first_bending;
using kernel::last_bending;
using kernel::Plane;

constexpr double kTiny = 1e-300;
constexpr double kRoundOff = 1e-12;

/// Largest i with grid[i] <= x, within [0, n-2]; `hint` is where it was last time.
inline int find_interval(const std::vector<double>& grid, double x, int hint) {
  const int last = static_cast<int>(grid.size()) - 2;
  int i = std::clamp(hint, 0, last);
  while (i > 0 && x < grid[static_cast<size_t>(i)]) --i;
  while (i < last && x >= grid[static_cast<size_t>(i) + 1]) ++i;
  return i;
}

}  // namespace

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
    to.limit.resize(from.positive.size() * 2);
    double largest = 0;
    for (size_t i = 0; i < from.positive.size(); ++i) {
      const size_t at = to.place(i / from.plastic_rotation.size(), i % from.plastic_rotation.size());
      to.limit[at] = from.positive[i];
      to.limit[at + 1] = from.negative[i];
      largest = std::max({largest, from.positive[i], from.negative[i]});
    }
    if (!from.elongation_positive.empty()) {
      const size_t J = from.plastic_rotation.size();
      to.lift.resize(to.limit.size());
      for (size_t i = 0; i < from.positive.size(); ++i) {
        const size_t j = std::min(i % J, J - 2), row = i - i % J;  // the last interval goes on
        const double step = to.rotation[j + 1] - to.rotation[j];
        const size_t at = to.place(i / J, i % J);
        to.lift[at] = (from.elongation_positive[row + j + 1] - from.elongation_positive[row + j]) / step;
        to.lift[at + 1] = (from.elongation_negative[row + j + 1] - from.elongation_negative[row + j]) / step;
      }
    }
    // The capacity at a rotation is where the interpolated limit reaches zero on the side of compression.
    to.capacity.resize(static_cast<size_t>(to.J));
    for (int j = 0; j < to.J; ++j) {
      double capacity = 0;
      for (int k = 0; k < to.K; ++k) {
        const size_t i = to.place(static_cast<size_t>(k), static_cast<size_t>(j));
        if (std::max(to.limit[i], to.limit[i + 1]) > 1e-3 * largest) {
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
  c.elongates = !c.moment[0].lift.empty() || !c.moment[1].lift.empty();
  c.compression = {law.compression.x, law.compression.f};
  c.tension = {law.tension.x, law.tension.f};
  if (!law.compression.f.empty()) {
    const auto peak = std::max_element(law.compression.f.begin(), law.compression.f.end());
    c.peak_compression = *peak;
    c.peak_shortening = law.compression.x[static_cast<size_t>(peak - law.compression.f.begin())];
  } else {
    c.peak_shortening = kUnlimited;
  }
  c.biaxial_exponent = law.biaxial_exponent;
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

namespace {

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
  const double *a = &family.limit[family.place(K, J)], *b = &family.limit[family.place(K, J + 1)];
  const double w00 = (1 - t) * (1 - s), w01 = (1 - t) * s, w10 = t * (1 - s), w11 = t * s;
  return {w00 * a[0] + w01 * b[0] + w10 * a[2] + w11 * b[2], w00 * a[1] + w01 * b[1] + w10 * a[3] + w11 * b[3]};
}

MomentLimit calc_moment_slope(const CompiledFamily& family, double normal_force, double rotation, int k, int j) {
  if (family.K == 0) return {0, 0};
  normal_force = put_on_edge(family, normal_force);
  if (!is_within(family, normal_force)) return {0, 0};
  const size_t K = static_cast<size_t>(find_interval(family.force, normal_force, k));
  const size_t J = static_cast<size_t>(find_interval(family.rotation, rotation, j));
  const double s =
      std::clamp((rotation - family.rotation[J]) / (family.rotation[J + 1] - family.rotation[J]), 0.0, 1.0);
  const double *a = &family.limit[family.place(K, J)], *b = &family.limit[family.place(K, J + 1)];
  const double width = family.force[K + 1] - family.force[K];
  return {((1 - s) * (a[2] - a[0]) + s * (b[2] - b[0])) / width, ((1 - s) * (a[3] - a[1]) + s * (b[3] - b[1])) / width};
}

Lift calc_lift(const CompiledFamily& family, double normal_force, double rotation, int& k, int& j) {
  if (family.lift.empty()) return {};
  normal_force = put_on_edge(family, normal_force);
  if (!is_within(family, normal_force)) return {};
  k = find_interval(family.force, normal_force, k);
  j = find_interval(family.rotation, rotation, j);
  const size_t K = static_cast<size_t>(k);
  const size_t J = static_cast<size_t>(rotation < family.rotation.back() ? j : family.J - 1);
  const double t = (normal_force - family.force[K]) / (family.force[K + 1] - family.force[K]);
  const double* a = &family.lift[family.place(K, J)];
  return {(1 - t) * a[0] + t * a[2], (1 - t) * a[1] + t * a[3]};
}

double calc_compression_capacity(const CompiledFamily& family, double rotation, int j) {
  if (family.K == 0) return kUnlimited;
  const size_t last = static_cast<size_t>(family.J) - 1;
  if (rotation >= family.rotation[last]) return family.capacity[last];
  const size_t i = static_cast<size_t>(find_interval(family.rotation, rotation, j));
  const double t = (rotation - family.rotation[i]) / (family.rotation[i + 1] - family.rotation[i]);
  return family.capacity[i] + t * (family.capacity[i + 1] - family.capacity[i]);
}

namespace {

/// The limits in force at a moment in time: those of one law, or two of them blended while a charge takes effect.
class Limits {
 public:
  Limits(const std::vector<CompiledLaw>& laws, int law, const ZoneState& z, double time)
      : from_(laws[static_cast<size_t>(z.base_law < 0 ? law : z.base_law)]), to_(from_) {
    if (z.next_law < 0) return;
    to_ = laws[static_cast<size_t>(z.next_law)];
    share_ = z.ramp > 0 ? std::clamp((time - z.ramp_begin) / z.ramp, 0.0, 1.0) : 1.0;
  }

  /// The law that governs lengths of rupture.
  const CompiledLaw& law() const { return share_ > 0 ? to_.get() : from_.get(); }
  double tension(double elongated) const {
    return blend([&](const CompiledLaw& l) { return calc_curve(l.tension, elongated); });
  }
  /// Share of the section that is still there: 1 until the peak of the compression curve, then what is left of it.
  double integrity(double shortened) const {
    return blend([&](const CompiledLaw& l) {
      if (shortened <= l.peak_shortening) return 1.0;
      return l.peak_compression > 0 ? calc_curve(l.compression, shortened) / l.peak_compression : 0.0;
    });
  }
  /// Largest compression after a rotation and a plastic shortening.
  ///   near  a station that has turned about as far
  double compression(double rotation, double shortened, double integrity, const StationState& near) const {
    return blend([&](const CompiledLaw& l) {
      return std::min(
          calc_curve(l.compression, shortened),
          (l.elongates ? 1 : integrity) * std::min(calc_compression_capacity(l.moment[0], rotation, near.j[0]),
                                                   calc_compression_capacity(l.moment[1], rotation, near.j[1])));
    });
  }
  MomentLimit moment(int axis, double normal_force, StationState& s) const {
    MomentLimit a{0, 0}, b{0, 0};
    if (share_ < 1) a = calc_moment_limit(from_.get().moment[axis], normal_force, s.reached, s.k[axis], s.j[axis]);
    if (share_ > 0) {
      int k = 0, j = 0;
      b = calc_moment_limit(to_.get().moment[axis], normal_force, s.reached, k, j);
    }
    return {mix(a.positive, b.positive), mix(a.negative, b.negative)};
  }
  /// Rise of the limits with the normal force.
  MomentLimit slope(int axis, double normal_force, const StationState& s) const {
    MomentLimit a{0, 0}, b{0, 0};
    if (share_ < 1) a = calc_moment_slope(from_.get().moment[axis], normal_force, s.reached, s.k[axis], s.j[axis]);
    if (share_ > 0) b = calc_moment_slope(to_.get().moment[axis], normal_force, s.reached, 0, 0);
    return {mix(a.positive, b.positive), mix(a.negative, b.negative)};
  }
  bool elongates() const { return from_.get().elongates || to_.get().elongates; }
  Lift lift(int axis, double normal_force, double rotation, StationState& s) const {
    Lift a, b;
    if (share_ < 1) a = calc_lift(from_.get().moment[axis], normal_force, rotation, s.k[axis], s.j[axis]);
    if (share_ > 0) {
      int k = 0, j = 0;
      b = calc_lift(to_.get().moment[axis], normal_force, rotation, k, j);
    }
    return {mix(a.positive, b.positive), mix(a.negative, b.negative)};
  }
  double shear(int axis, double slipped, double compression) const {
    return blend([&](const CompiledLaw& l) {
      const double left = l.slip_softening > 0 ? std::max(0.0, 1 - slipped / l.slip_softening) : 0.0;
      const double own = l.shear[axis] == kUnlimited ? kUnlimited : l.shear[axis] * left;
      return own + l.shear_friction * std::max(0.0, compression);
    });
  }
  double torsion() const {
    return blend([](const CompiledLaw& l) { return l.torsion; });
  }

 private:
  double mix(double a, double b) const { return share_ <= 0 ? a : share_ >= 1 ? b : (1 - share_) * a + share_ * b; }
  template <class F>
  double blend(F&& f) const {
    if (share_ <= 0) return f(from_.get());
    if (share_ >= 1) return f(to_.get());
    return mix(f(from_.get()), f(to_.get()));
  }
  std::reference_wrapper<const CompiledLaw> from_, to_;
  double share_ = 0;
};

/// Rotations and moments of the stations of one bending plane, and the resultants at the marker.
///   sign  +1 about y (shear along z), -1 about z (shear along y)
struct Bending {
  double shear_stiffness, bending_stiffness, sign;
  double shear_deformation;  // elastic and that of the stations, slip taken out
  double rotation;

  double shear(const double x[2], const double phi[2], int n) const {
    double u = shear_deformation;
    for (int s = 0; s < n; ++s) u -= sign * x[s] * phi[s];
    return shear_stiffness * u;
  }
  double moment(const double phi[2], int n) const {
    double r = rotation;
    for (int s = 0; s < n; ++s) r -= phi[s];
    return bending_stiffness * r;
  }
  /// Moment at a station: that at the marker plus the lever of the shear.
  static double at(double moment, double shear, double x, double sign) { return moment + sign * x * shear; }
};

/// Least limit moment of a family between two normal forces: at an end or at a force of the table, for it is linear
/// between.
///   k, j  where to look first
double find_least_moment(const CompiledFamily& family, double from, double to, double rotation, int k, int j) {
  double least = kUnlimited;
  const auto look = [&](double force) {
    const MomentLimit limit = calc_moment_limit(family, force, rotation, k, j);
    least = std::min({least, limit.positive, limit.negative});
  };
  look(from);
  look(to);
  for (const double f : family.force)
    if (f > from && f < to) look(f);
  return least;
}

void find_safe_bounds(const ZoneParameters& p, const std::vector<CompiledLaw>& laws, const Limits& limits, double force,
                      ZoneState& z) {
  const auto law_of = [&](int s) -> const CompiledLaw& {
    return laws[static_cast<size_t>(z.base_law < 0 ? p.law[s] : z.base_law)];
  };
  const int first = first_bending(p.plane), last = last_bending(p.plane);
  double reach = kUnlimited, reached = 0;
  for (int s = 0; s < p.stations; ++s) {
    reached = std::max(reached, z.station[s].reached);
    for (const CompiledFamily& family : law_of(s).moment)
      if (family.K > 0) reach = std::min(reach, 0.06 * (family.force.back() - family.force.front()));
  }
  const double whole = limits.integrity(z.shortened);
  double from = force - reach, to = force + reach;
  if (!p.external_axial) {
    from = std::max(from, -limits.compression(reached, z.shortened, whole, z.station[0]));
    to = std::min(to, limits.tension(z.elongated));
  }
  for (int s = 0; s < p.stations; ++s)
    if (z.station[s].reached >= law_of(s).rupture_rotation) to = std::min(to, -kTiny);  // held by what presses it
  z.safe_force[0] = 1, z.safe_force[1] = -1;
  if (whole != 1 || !(from <= to)) return;
  for (int q = first; q <= last; ++q) {
    z.safe_moment[q] = kUnlimited;
    for (int s = 0; s < p.stations; ++s)
      z.safe_moment[q] = std::min(
          z.safe_moment[q],
          find_least_moment(law_of(s).moment[q], from, to, z.station[s].reached, z.station[s].k[q], z.station[s].j[q]));
    z.safe_shear[1 - q] = limits.shear(1 - q, z.slipped, -to);
    if (!(z.safe_moment[q] > 0 && z.safe_shear[1 - q] > 0 && limits.torsion() > 0)) return;
  }
  for (int q = first; q <= last; ++q) {
    z.safe_moment[q] = 1 / z.safe_moment[q];
    z.safe_shear[1 - q] = 1 / z.safe_shear[1 - q];
  }
  z.safe_torsion = 1 / limits.torsion();
  z.safe_exponent = kUnlimited;
  for (int s = 0; s < p.stations; ++s) z.safe_exponent = std::min(z.safe_exponent, law_of(s).biaxial_exponent);
  // what the springs do not see, and how damage softens them: flexibilities add up
  double turned[2] = {0, 0}, shifted[2] = {0, 0};
  z.is_softened = false;
  for (int q = first; q <= last; ++q) {
    const double ks = z.share * p.stiffness[q == 0 ? 2 : 1], kb = z.share * p.stiffness[q == 0 ? 4 : 5];
    const double sign = q == 0 ? 1 : -1;
    double c = 0, cx = 0, cxx = 0;
    for (int s = 0; s < p.stations; ++s) {
      turned[q] += z.station[s].phi[q];
      shifted[q] += p.x[s] * z.station[s].phi[q];
      c += z.station[s].soft[q];
      cx += sign * p.x[s] * z.station[s].soft[q];
      cxx += p.x[s] * p.x[s] * z.station[s].soft[q];
    }
    double* plane = z.plane[q];
    plane[0] = ks, plane[1] = 0, plane[2] = kb;
    if (c == 0) continue;
    z.is_softened = true;
    if (!(kb > 0)) return;
    if (ks > 0) {
      const double f11 = 1 / ks + cxx, f12 = cx, f22 = 1 / kb + c, determinant = f11 * f22 - f12 * f12;
      plane[0] = f22 / determinant, plane[1] = -f12 / determinant, plane[2] = f11 / determinant;
    } else {
      plane[2] = 1 / (1 / kb + c);
    }
  }
  z.safe_force[0] = from;
  z.safe_force[1] = to;
  const double offset[6] = {z.axial, z.slip[0] - shifted[1], z.slip[1] + shifted[0], z.twist, turned[0], turned[1]};
  std::copy(offset, offset + 6, z.offset);
}

/// x to the power e, quickly for the exponent that is usual.
double raised(double x, double e) { return e == 1.5 ? x * std::sqrt(x) : std::pow(x, e); }
/// and its inverse.
double root_of(double x, double e) { return e == 1.5 ? std::cbrt(x * x) : std::pow(x, 1 / e); }

using kernel::kMostDamage;

/// The stiffness goes over to its share without a jump of the forces: the rest of the deformation becomes permanent.
/// The stations of a two-station element share the change of rotation evenly, and its shear the change of displacement.
void soften(const ZoneParameters& p, ZoneState& z) {
  const double change = 1 / (z.next_share) - 1 / z.share;
  const auto flexed = [&](int i) { return p.stiffness[i] > 0 ? change * z.elastic_force[i] / p.stiffness[i] : 0; };
  z.axial -= flexed(0);
  z.slip[0] -= flexed(1);
  z.slip[1] -= flexed(2);
  z.twist -= flexed(3);
  if (p.stations > 0) {
    for (int q = 0; q < 2; ++q) {
      for (int s = 0; s < p.stations; ++s) z.station[s].phi[q] -= flexed(4 + q) / p.stations;
      double lever = 0;
      for (int s = 0; s < p.stations; ++s) lever += p.x[s] / p.stations;
      (q == 0 ? z.slip[1] : z.slip[0]) += (q == 0 ? 1 : -1) * lever * flexed(4 + q);
    }
  }
  for (int i = 0; i < 6; ++i) {
    z.elastic[i] += flexed(i);
    z.flowed[i] += flexed(i);
  }
  double stored = 0;
  for (int i = p.external_axial ? 1 : 0; i < 6; ++i) stored += 0.5 * z.elastic_force[i] * flexed(i);
  z.energy += stored;
  z.plastic -= stored;
  z.share = z.next_share;
}

}  // namespace

void elongate_zone(const ZoneParameters& p, double by, ZoneState& z) {
  if (!z.live || by == 0) return;
  z.axial += by;
  z.lifted += by;
  z.offset[0] += by;
  z.is_adjusted = true;
  if (!z.has_elastic) return;
  const double released = by * (z.elastic_force[0] - 0.5 * z.share * p.stiffness[0] * by);
  z.energy -= released;
  z.plastic += released;
}

void break_zone(ZoneState& z, BreakReason reason) {
  z.live = false;
  z.reason = reason;
  z.plastic += z.energy + z.damper_energy;
  z.energy = z.damper_energy = 0;
  z.resultant = {};
  for (int i = 0; i < 6; ++i) z.elastic_force[i] = z.damper_force[i] = 0;
  z.has_elastic = false;
}

namespace {

/// The common case: a zone whose forces stay inside its safe bounds is a spring with a damper. False if it is not so.
template <Plane In>
bool advance_inside_bounds(const ZoneParameters& p, const Six& d, double h, ZoneState& z) {
  if (!is_bounded(z, false) || h <= 0 || z.is_adjusted) return false;
  constexpr ActiveComponents active = components_of(In);
  constexpr int first = first_bending(In), last = last_bending(In);
  double u[6], e[6], f[6], k[6];  // deformation from the offset, its elastic part, resultant, stiffness
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    k[i] = z.share * p.stiffness[i];
    u[i] = e[i] = d.c[i] - z.offset[i];
    f[i] = k[i] * e[i];
  }
  if (p.external_axial) {
    u[0] = e[0] = 0;
    f[0] = d.c[0];
  }
  if (z.is_softened) {
    for (int q = first; q <= last; ++q) {
      const int shear = q == 0 ? 2 : 1, bend = q == 0 ? 4 : 5;
      f[shear] = z.plane[q][0] * u[shear] + z.plane[q][1] * u[bend];
      f[bend] = z.plane[q][1] * u[shear] + z.plane[q][2] * u[bend];
      e[shear] = k[shear] > 0 ? f[shear] / k[shear] : 0;
      e[bend] = k[bend] > 0 ? f[bend] / k[bend] : 0;
    }
  }
  if (f[0] < z.safe_force[0] || f[0] > z.safe_force[1]) return false;
  if constexpr (In == Plane::Space) {
    if (std::abs(f[3]) * z.safe_torsion > 1) return false;
    const double vy = f[1] * z.safe_shear[0], vz = f[2] * z.safe_shear[1];
    if (vy * vy + vz * vz > 1) return false;
    for (int s = 0; s < p.stations; ++s) {
      const double my = std::abs(f[4] + p.x[s] * f[2]) * z.safe_moment[0];
      const double mz = std::abs(f[5] - p.x[s] * f[1]) * z.safe_moment[1];
      if (my + mz > 1 && raised(my, z.safe_exponent) + raised(mz, z.safe_exponent) > 1) return false;
    }
  } else {
    constexpr int shear = active.at[1], bend = active.at[2];
    constexpr double sign = first == 0 ? 1 : -1;
    if (std::abs(f[shear]) * z.safe_shear[shear - 1] > 1) return false;
    for (int s = 0; s < p.stations; ++s)
      if (std::abs(f[bend] + sign * p.x[s] * f[shear]) * z.safe_moment[first] > 1) return false;
  }
  double energy = 0, damper_energy = 0, damped = 0, bled = 0;
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    const double before = z.elastic[i], stretched = e[i] - before;
    const double flowed = z.flowed[i] + p.relaxation * (0.5 * (e[i] + before) - z.flowed[i]);
    const double stretch = e[i] - flowed, damper = p.viscous * k[i] * stretch;
    energy += 0.5 * f[i] * u[i];
    damper_energy += 0.5 * damper * stretch;
    const double mean = 0.5 * (damper + z.damper_force[i]);
    damped += mean * stretched;
    bled += mean * (d.c[i] - z.deformation[i] - stretched);
    z.flowed[i] = flowed;
    z.damper_force[i] = damper;
    z.elastic[i] = e[i];
    z.elastic_force[i] = f[i];
    z.deformation[i] = d.c[i];
    z.resultant.c[i] = f[i] + damper;
  }
  if (z.is_softened) z.plastic += bled;  // what the damper does on the part that damage softened
  z.damping += damped - (damper_energy - z.damper_energy);
  z.damper_energy = damper_energy;
  z.energy = energy;
  z.normal_force = f[0];
  return true;
}

}  // namespace

namespace {

/// Moments over their limits and the root of (|My|/Ly)^p + (|Mz|/Lz)^p: 1 on the limit, infinite where an axis has
/// none.
struct Excess {
  double ry = 0, rz = 0, r = 0;
};
double calc_excess(double m, const MomentLimit& most) {
  const double limit = m >= 0 ? most.positive : most.negative, size = std::abs(m);
  return limit > 0 ? size / limit : (size > 0 ? kUnlimited : 0);
}
Excess calc_excess(double my, double mz, const MomentLimit& ly, const MomentLimit& lz, double exponent) {
  Excess e;
  e.ry = calc_excess(my, ly), e.rz = calc_excess(mz, lz);
  // the larger ratio taken out of the power, so that an uniaxial state keeps its limit to round-off
  const double big = std::max(e.ry, e.rz), small = std::min(e.ry, e.rz);
  e.r = !std::isinf(big) && small > 1e-9 * big ? big * root_of(1 + raised(small / big, exponent), exponent) : big;
  return e;
}

/// Shares of both moments that (|My|/Ly)^p + (|Mz|/Lz)^p = 1 leaves; false if they are inside.
bool find_return(double my, double mz, const MomentLimit& ly, const MomentLimit& lz, double exponent, double scale[2]) {
  if (std::abs(my) <= 0.5 * (my >= 0 ? ly.positive : ly.negative) &&
      std::abs(mz) <= 0.5 * (mz >= 0 ? lz.positive : lz.negative))
    return false;  // p >= 1: inside for sure
  const Excess e = calc_excess(my, mz, ly, lz, exponent);
  if (e.r <= 1) return false;
  if (std::isinf(e.r)) {
    scale[0] = std::isinf(e.ry) ? 0 : std::min(1.0, 1 / std::max(e.ry, kTiny));
    scale[1] = std::isinf(e.rz) ? 0 : std::min(1.0, 1 / std::max(e.rz, kTiny));
    return true;
  }
  scale[0] = scale[1] = 1 / e.r;
  return true;
}

/// The same of one moment.
bool find_return(double m, const MomentLimit& most, double& scale) {
  const double limit = m >= 0 ? most.positive : most.negative, size = std::abs(m);
  if (size <= limit) return false;
  scale = limit / size;
  return true;
}

/// In space, or what is left of it in a plane.
template <Plane In>
void advance_in(const ZoneParameters& p, const std::vector<CompiledLaw>& laws, const Six& d, double time, double h,
                ZoneState& z) {
  constexpr ActiveComponents active = components_of(In);
  constexpr int first = first_bending(In), last = last_bending(In);
  constexpr bool is_plane = In != Plane::Space;
  if (advance_inside_bounds<In>(p, d, h, z)) return;
  if (z.next_law >= 0 && time >= z.ramp_begin + z.ramp) {
    // the switch is done
    if (z.next_share != z.share) soften(p, z);
    z.base_law = z.next_law;
    z.next_law = -1;
  }
  double k[6];
  for (int i = 0; i < 6; ++i) k[i] = z.share * p.stiffness[i];
  const int n = p.stations;

  double force[6] = {0, 0, 0, 0, 0, 0};  // elastic resultants at the marker
  double phi[2][2];                      // inelastic rotation [plane][station], damage included
  double m[2][2];                        // moment at the station [plane][station]
  bool flowed = false;

  force[0] = p.external_axial ? d.c[0] : k[0] * (d.c[0] - z.axial);
  if constexpr (!is_plane) force[3] = k[3] * (d.c[3] - z.twist);

  // plane 0 bends about y with shear along z; plane 1 bends about z with shear along y
  const Bending planes[2] = {{k[2], k[4], +1, d.c[2] - z.slip[1], d.c[4]},
                             {k[1], k[5], -1, d.c[1] - z.slip[0], d.c[5]}};
  double station_stiffness[2][2];
  for (int q = first; q <= last; ++q) {
    for (int s = 0; s < n; ++s) {
      station_stiffness[q][s] = planes[q].bending_stiffness + p.x[s] * p.x[s] * planes[q].shear_stiffness;
      phi[q][s] = z.station[s].phi[q];
    }
    // damage adds flexibility at the stations: (1 + S C) m = m0, two by two at most
    double c[2] = {0, 0};
    for (int s = 0; s < n; ++s) c[s] = z.station[s].soft[q];
    if (c[0] > 0 || c[1] > 0) {
      double m0[2] = {0, 0};
      const double v = planes[q].shear(p.x, phi[q], n), b = planes[q].moment(phi[q], n);
      for (int s = 0; s < n; ++s) m0[s] = Bending::at(b, v, p.x[s], planes[q].sign);
      const double cross = planes[q].bending_stiffness + p.x[0] * p.x[1] * planes[q].shear_stiffness;
      const double s11 = 1 + station_stiffness[q][0] * c[0], s22 = n > 1 ? 1 + station_stiffness[q][1] * c[1] : 1;
      const double s12 = n > 1 ? cross * c[1] : 0, s21 = n > 1 ? cross * c[0] : 0;
      const double determinant = s11 * s22 - s12 * s21;
      phi[q][0] += c[0] * (m0[0] * s22 - m0[1] * s12) / determinant;
      if (n > 1) phi[q][1] += c[1] * (m0[1] * s11 - m0[0] * s21) / determinant;
    }
    const double v = planes[q].shear(p.x, phi[q], n), b = planes[q].moment(phi[q], n);
    force[q == 0 ? 2 : 1] = v;
    force[q == 0 ? 4 : 5] = b;
    for (int s = 0; s < n; ++s) m[q][s] = Bending::at(b, v, p.x[s], planes[q].sign);
  }

  const auto elastic_energy = [&]() {
    double e = 0;
    for (int c = 0; c < active.count; ++c)
      if (const int i = active.at[c]; k[i] > 0) e += 0.5 * force[i] * force[i] / k[i];
    return e;
  };
  const auto soft_energy = [&]() {
    double e = 0;
    for (int q = first; q <= last; ++q)
      for (int s = 0; s < n; ++s) e += 0.5 * z.station[s].soft[q] * m[q][s] * m[q][s];
    return e;
  };
  const double energy_trial = elastic_energy() + soft_energy();

  BreakReason broke = BreakReason::None;
  if (n > 0) {
    const Limits limits(laws, p.law[0], z, time);

    // axial force
    double reached = z.station[0].reached;
    if (n > 1) reached = std::max(reached, z.station[1].reached);
    double integrity = limits.integrity(z.shortened);
    if (p.external_axial) {
      // held by somebody else
    } else if (force[0] < 0) {
      double limit = limits.compression(reached, z.shortened, integrity, z.station[0]);
      if (-force[0] > limit) {
        // the curve falls while the zone shortens: one more look at it after the first estimate
        const double guess = (-force[0] - limit) / k[0];
        integrity = limits.integrity(z.shortened + guess);
        limit = limits.compression(reached, z.shortened + guess, integrity, z.station[0]);
        const double shortening = std::max(0.0, (-force[0] - limit) / k[0]);
        z.axial -= shortening;
        z.shortened += shortening;
        force[0] = std::max(force[0], -limit);
        flowed = true;
      }
    } else {
      double limit = limits.tension(z.elongated);
      if (force[0] > limit) {
        const double guess = (force[0] - limit) / k[0];
        limit = limits.tension(z.elongated + guess);
        const double elongation = (force[0] - limit) / k[0];
        z.axial += elongation;
        z.elongated += elongation;
        force[0] = limit;
        flowed = true;
      }
    }
    if (z.shortened >= limits.law().crush_length) broke = BreakReason::Crushing;
    if (z.elongated >= limits.law().rupture_elongation) broke = BreakReason::Tension;

    // bending at the stations: radial return on (|My|/Ly)^p + (|Mz|/Lz)^p = 1
    const Limits station_limits[2] = {limits, n > 1 ? Limits(laws, p.law[1], z, time) : limits};
    // what is left of the section carries both the force and the moment
    const double axial = integrity > 0 ? force[0] / integrity : 0;
    MomentLimit most[2][2];  // [plane][station]
    for (int s = 0; s < n; ++s)
      for (int q = first; q <= last; ++q) {
        most[q][s] = station_limits[s].moment(q, axial, z.station[s]);
        most[q][s].positive *= integrity;
        most[q][s].negative *= integrity;
      }
    const auto measure = [&](int s) {
      for (int q = first; q <= last; ++q)
        m[q][s] = Bending::at(planes[q].moment(phi[q], n), planes[q].shear(p.x, phi[q], n), p.x[s], planes[q].sign);
    };
    // share of the station's moments that its limits allow; true if that is not all
    const auto is_outside = [&](int s, double scale[2]) {
      if constexpr (is_plane) return find_return(m[first][s], most[first][s], scale[first]);
      return find_return(m[0][s], m[1][s], most[0][s], most[1][s], station_limits[s].law().biaxial_exponent, scale);
    };
    bool turned[2] = {false, false};
    double phi_trial[2][2];
    for (int q = first; q <= last; ++q)
      for (int s = 0; s < n; ++s) phi_trial[q][s] = phi[q][s];
    const auto turn = [&](int s, const double scale[2]) {
      bool far = false;  // enough for the other station to feel it
      for (int q = first; q <= last; ++q) {
        const double by = station_stiffness[q][s] > 0 ? m[q][s] * (1 - scale[q]) / station_stiffness[q][s] : 0;
        phi[q][s] += by;
        m[q][s] *= scale[q];
        if (by != 0) turned[s] = true;
        far = far || std::abs(by) > 1e-9 * std::abs(phi[q][s]);
      }
      return far;
    };
    double scale[2][2];    // [station][plane]
    double m_trial[2][2];  // [plane][station]
    bool outside[2] = {false, false};
    for (int s = 0; s < n; ++s) {
      measure(s);
      for (int q = first; q <= last; ++q) m_trial[q][s] = m[q][s];
      outside[s] = is_outside(s, scale[s]);
    }
    if (n == 1) {
      if (outside[0]) (void)turn(0, scale[0]);
    } else if (outside[0] || outside[1]) {
      double trial[2][2];  // moments and rotations before either station turns
      double before[2][2];
      for (int q = first; q <= last; ++q)
        for (int s = 0; s < 2; ++s) trial[q][s] = m[q][s], before[q][s] = phi[q][s];
      if (outside[0] != outside[1]) {
        const int one = outside[0] ? 0 : 1, other = 1 - one;
        if (turn(one, scale[one])) {
          measure(other);
          outside[other] = is_outside(other, scale[other]);
        }
      }
      if (outside[0] && outside[1]) {
        // both at once: two by two in each plane
        double target[2][2], by[2][2];
        bool good = true;
        for (int q = first; q <= last && good; ++q) {
          const double s12 = planes[q].bending_stiffness + p.x[0] * p.x[1] * planes[q].shear_stiffness;
          const double s11 = station_stiffness[q][0], s22 = station_stiffness[q][1];
          const double determinant = s11 * s22 - s12 * s12;
          good = determinant > 1e-9 * s11 * s22;
          for (int s = 0; s < 2; ++s) target[q][s] = turned[s] ? trial[q][s] * scale[s][q] : m[q][s] * scale[s][q];
          const double over0 = trial[q][0] - target[q][0], over1 = trial[q][1] - target[q][1];
          by[q][0] = (s22 * over0 - s12 * over1) / determinant;
          by[q][1] = (s11 * over1 - s12 * over0) / determinant;
        }
        for (int s = 0; s < 2 && good; ++s) {
          double work = 0;
          for (int q = first; q <= last; ++q) work += target[q][s] * by[q][s];
          good = work >= 0;
        }
        if (good) {
          for (int q = first; q <= last; ++q)
            for (int s = 0; s < 2; ++s) {
              phi[q][s] = before[q][s] + by[q][s];
              turned[s] = turned[s] || by[q][s] != 0;
            }
        } else {
          // in turns
          for (int sweep = 0; sweep < 12; ++sweep) {
            bool changed = false;
            for (int s = 0; s < 2; ++s) {
              measure(s);
              if (is_outside(s, scale[s]) && turn(s, scale[s])) changed = true;
            }
            if (!changed) break;
          }
        }
      }
    }
    // what turns further lengthens or shortens
    const double axial_stiffness = p.external_axial ? 0 : k[0], relief = p.external_axial ? p.relief : k[0];
    const auto length_of = [](const double turns[2][2], int s) {
      return is_plane ? std::abs(turns[first][s]) : std::sqrt(turns[0][s] * turns[0][s] + turns[1][s] * turns[1][s]);
    };
    // rotation up to which a station had gone in the step before, by plastic flow or on the flexibility of its damage
    double so_far[2] = {0, 0};
    for (int s = 0; s < n; ++s) {
      if (!turned[s] || !station_limits[s].elongates()) continue;
      const StationState& st = z.station[s];
      double before[2][2];
      for (int q = first; q <= last; ++q) {
        const double b = z.elastic_force[q == 0 ? 4 : 5], v = z.elastic_force[q == 0 ? 2 : 1];
        before[q][s] = st.phi[q] + st.soft[q] * Bending::at(b, v, p.x[s], planes[q].sign);
      }
      so_far[s] = std::max(st.reached, length_of(before, s));
    }
    const auto grows = [&](int s) {
      return turned[s] && station_limits[s].elongates() && length_of(phi, s) > so_far[s];
    };
    const auto calc_elongation = [&]() {
      double sum = 0;
      for (int s = 0; s < n; ++s) {
        if (!grows(s)) continue;
        StationState& st = z.station[s];
        double squares = 0, along = 0, bending = 0;
        for (int q = first; q <= last; ++q) {
          const Lift lift = station_limits[s].lift(q, axial, st.reached, st);
          squares += phi[q][s] * phi[q][s];
          along += phi[q][s] * phi[q][s] * (phi[q][s] >= 0 ? lift.positive : lift.negative);
          bending += m[q][s] * (phi[q][s] - phi_trial[q][s]);
        }
        if (along == 0) continue;
        double by = (length_of(phi, s) - so_far[s]) * along / squares;
        // the axial spring takes no more than bending brings: |by| (½ k |by| - N') <= brought, N' pulling the way of by
        const double brought = (1 - 0.5 * station_limits[s].law().damage_share) * std::max(0.0, bending);
        const double pull = std::copysign(1.0, by) * (force[0] - axial_stiffness * sum);
        const double root = std::sqrt(pull * pull + 2 * axial_stiffness * brought);
        const double bound = pull < 0              ? 2 * brought / (root - pull)
                             : axial_stiffness > 0 ? (pull + root) / axial_stiffness
                                                   : kUnlimited;
        by = std::copysign(std::min(std::abs(by), bound), by);
        sum += by;
      }
      return sum;
    };
    for (int s = 0; s < n && (grows(0) || (n > 1 && grows(1))); ++s) measure(s);
    double elongation = calc_elongation();
    if (elongation != 0 && relief > 0) {
      // that changes the normal force and with it the limits: a station turns to the limit under the force that is left
      double share = 1;  // of the turn
      for (int s = 0; s < n; ++s) {
        if (!grows(s)) continue;
        const double exponent = station_limits[s].law().biaxial_exponent;
        double excess = 0;
        if constexpr (is_plane)
          excess = calc_excess(m_trial[first][s], most[first][s]);
        else
          excess = calc_excess(m_trial[0][s], m_trial[1][s], most[0][s], most[1][s], exponent).r;
        if (!(excess > 1) || std::isinf(excess)) continue;
        // rise of what the limit leaves of the moments with the force; that of I L(N/I) is that of L
        const double left = 1 / excess;
        double slope = 0;
        for (int q = first; q <= last; ++q) {
          const bool is_positive = m_trial[q][s] >= 0;
          const double limit = is_positive ? most[q][s].positive : most[q][s].negative;
          if (!(limit > 0) || limit == kUnlimited) continue;
          const MomentLimit rise = station_limits[s].slope(q, axial, z.station[s]);
          slope += raised(left * std::abs(m_trial[q][s]) / limit, exponent) *
                   (is_positive ? rise.positive : rise.negative) / limit;
        }
        const double rise = -left * slope * relief * elongation;
        if (!(rise > 0)) continue;
        const double length = length_of(phi, s), trial = std::max(so_far[s], length_of(phi_trial, s));
        const double ahead = (trial - so_far[s]) / (length - so_far[s]);  // by damage, before it turns
        share = std::min(share, std::max(0.0, (1 - left - rise * ahead) / (1 - left + rise * (1 - ahead))));
      }
      if (share < 1) {
        for (int q = first; q <= last; ++q)
          for (int s = 0; s < n; ++s) phi[q][s] = phi_trial[q][s] + share * (phi[q][s] - phi_trial[q][s]);
        for (int s = 0; s < n; ++s) measure(s);
        elongation = calc_elongation();
      }
    }
    for (int s = 0; s < n; ++s) {
      StationState& st = z.station[s];
      if (turned[s]) {
        flowed = true;
        st.reached = std::max(st.reached, length_of(phi, s));
      }
      const CompiledLaw& law = station_limits[s].law();
      if (st.reached >= (force[0] < 0 ? law.rupture_rotation_pressed : law.rupture_rotation))
        broke = BreakReason::Rotation;
    }
    if (flowed) {
      // split what is new of the inelastic rotation into a plastic part and added flexibility
      for (int q = first; q <= last; ++q) {
        force[q == 0 ? 2 : 1] = planes[q].shear(p.x, phi[q], n);
        force[q == 0 ? 4 : 5] = planes[q].moment(phi[q], n);
        for (int s = 0; s < n; ++s) {
          StationState& st = z.station[s];
          m[q][s] = Bending::at(force[q == 0 ? 4 : 5], force[q == 0 ? 2 : 1], p.x[s], planes[q].sign);
          const double added = phi[q][s] - st.phi[q] - st.soft[q] * m[q][s];
          const double share = station_limits[s].law().damage_share;
          if (share > 0 && added * m[q][s] > 0) {
            const double top =
                std::min(share * std::abs(phi[q][s]) / std::abs(m[q][s]), kMostDamage / station_stiffness[q][s]);
            st.soft[q] = std::max(st.soft[q], std::min(top, st.soft[q] + share * added / m[q][s]));
          }
          st.phi[q] = phi[q][s] - st.soft[q] * m[q][s];
        }
      }
    }

    z.axial += elongation;
    z.lifted += elongation;
    force[0] -= axial_stiffness * elongation;

    // shear
    {
      const double compression = -force[0];
      double over2 = 0;  // square of the demand over the limits
      for (int a = 1 - last; a <= 1 - first; ++a) {
        const double limit = limits.shear(a, z.slipped, compression);
        const double ratio = limit > 0 ? std::abs(force[1 + a]) / limit : (force[1 + a] != 0 ? kUnlimited : 0);
        over2 += ratio * ratio;
      }
      if (const double r = std::sqrt(over2); r > 1) {
        const double s = std::isinf(r) ? 0 : 1 / r;
        double way2 = 0;
        for (int a = 1 - last; a <= 1 - first; ++a) {
          const double by = k[1 + a] > 0 ? force[1 + a] * (1 - s) / k[1 + a] : 0;
          z.slip[a] += by;
          way2 += by * by;
          force[1 + a] *= s;
        }
        z.slipped += std::sqrt(way2);
        flowed = true;
        for (int q = first; q <= last; ++q)
          for (int st = 0; st < n; ++st)
            m[q][st] = Bending::at(force[q == 0 ? 4 : 5], force[q == 0 ? 2 : 1], p.x[st], planes[q].sign);
      }
      if (z.slipped >= limits.law().slip_rupture) broke = BreakReason::Shear;
    }

    // torsion
    if constexpr (!is_plane) {
      if (const double limit = limits.torsion(); std::abs(force[3]) > limit) {
        const double over = std::copysign((std::abs(force[3]) - limit) / k[3], force[3]);
        z.twist += over;
        z.twisted += std::abs(over);
        force[3] = std::copysign(limit, force[3]);
        flowed = true;
      }
    }
    if (z.twisted >= limits.law().twist_rupture) broke = BreakReason::Torsion;
    if (flowed || z.next_law >= 0) {
      z.safe_force[0] = 1, z.safe_force[1] = -1;
    } else if (!(force[0] >= z.safe_force[0] && force[0] <= z.safe_force[1])) {
      // bounds are the least limits around this force: none that are far enough away can be found near the limits here
      bool is_near = !p.external_axial;
      for (int s = 0; s < n; ++s) is_near = is_near && station_limits[s].law().biaxial_exponent == 1.5;
      if (is_near) {
        double used = 0;
        for (int s = 0; s < n; ++s) {
          double sum = 0;
          for (int q = first; q <= last; ++q)
            sum += std::abs(m[q][s]) / std::max(std::min(most[q][s].positive, most[q][s].negative), kTiny);
          used = std::max(used, sum);
        }
        is_near = used > kNearBounds;
      }
      if (is_near) {
        z.safe_force[0] = 1, z.safe_force[1] = -1;
      } else {
        find_safe_bounds(p, laws, limits, force[0], z);
      }
    }
  }

  const bool broken = broke != BreakReason::None;
  const double energy = broken ? 0 : flowed ? elastic_energy() + soft_energy() : energy_trial;
  if (broken)
    for (double& f : force) f = 0;
  if (flowed || broken || z.is_adjusted) {
    // what was put in since the last evaluation and is not stored is gone; work by the trapezium, as the bodies feel it
    double work = 0;
    for (int c = p.external_axial ? 1 : 0; c < active.count; ++c) {
      const int i = active.at[c];
      work += 0.5 * (z.elastic_force[i] + force[i]) * (d.c[i] - z.deformation[i]);
    }
    z.plastic += work - (energy - z.energy);
    z.yielded = z.yielded || flowed || broken;
    z.is_adjusted = false;
  }
  z.energy = energy;
  z.normal_force = force[0];
  if (broken) {
    for (int i = 0; i < 6; ++i) z.deformation[i] = d.c[i];
    break_zone(z, broke);
    return;
  }

  // A damper in series with a spring, both beside the elastic deformation (standard linear solid): no plastic flow is
  // damped, and at rest it carries nothing. The damper follows the mean of the step.
  double damper_energy = 0;
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    const double e = k[i] > 0 ? force[i] / k[i] : 0;
    double damper = 0;
    if (p.viscous > 0 && z.has_elastic && h > 0) {
      z.flowed[i] += p.relaxation * (0.5 * (e + z.elastic[i]) - z.flowed[i]);
      const double stretch = e - z.flowed[i];
      damper = p.viscous * k[i] * stretch;
      damper_energy += 0.5 * damper * stretch;
      const double mean = 0.5 * (damper + z.damper_force[i]), stretched = e - z.elastic[i];
      z.damping += mean * stretched;
      z.plastic += mean * (d.c[i] - z.deformation[i] - stretched);
    } else {
      z.flowed[i] = e;
    }
    z.damper_force[i] = damper;
    z.elastic[i] = e;
    z.elastic_force[i] = force[i];
    z.deformation[i] = d.c[i];
    z.resultant.c[i] = force[i] + damper;
  }
  z.damping -= damper_energy - z.damper_energy;
  z.damper_energy = damper_energy;
  z.has_elastic = true;
}

}  // namespace

void advance_zone(const ZoneParameters& p, const std::vector<CompiledLaw>& laws, const Six& d, double time, double h,
                  ZoneState& z) {
  switch (p.plane) {
    case Plane::Space:
      return advance_in<Plane::Space>(p, laws, d, time, h, z);
    case Plane::AboutY:
      return advance_in<Plane::AboutY>(p, laws, d, time, h, z);
    case Plane::AboutZ:
      return advance_in<Plane::AboutZ>(p, laws, d, time, h, z);
  }
}

double calc_bound_utilisation(const ZoneParameters& p, const ZoneState& z) {
  if (p.stations == 0) return 0;
  const double* f = z.elastic_force;
  const double vy = f[1] * z.safe_shear[0], vz = f[2] * z.safe_shear[1];
  double u = std::max(std::abs(f[3]) * z.safe_torsion, std::sqrt(vy * vy + vz * vz));
  for (int s = 0; s < p.stations; ++s) {
    const double my = std::abs(f[4] + p.x[s] * f[2]) * z.safe_moment[0];
    const double mz = std::abs(f[5] - p.x[s] * f[1]) * z.safe_moment[1];
    u = std::max(u, my + mz);
  }
  return u;
}

bool write_flow(const ZoneParameters& p, const std::vector<CompiledLaw>& laws, const ZoneState& z, double time,
                double* out) {
  using namespace kernel;
  constexpr double unlimited = 1e300;
  if (!z.live || !z.has_elastic || z.next_law >= 0 || p.stations == 0 || p.external_axial) return false;
  const Limits limits(laws, p.law[0], z, time);
  // what is left of a crushed section carries both force and moment
  const double whole = limits.integrity(z.shortened);
  if (!(whole > 0)) return false;
  std::fill(out, out + kFlowFields, 0.0);
  out[kAxial] = z.axial, out[kSlip] = z.slip[0], out[kSlip + 1] = z.slip[1], out[kTwist] = z.twist;
  double far = 0;           // no cell reaches beyond this rotation
  bool is_pressed = false;  // only what presses it holds it together
  for (int s = 0; s < 2; ++s) {
    double* station = &out[kStations + s * kStationFields];
    station[kRupture] = kUnlimited;
    const CompiledLaw* law = nullptr;
    if (s < p.stations) {
      law = &laws[static_cast<size_t>(z.base_law < 0 ? p.law[s] : z.base_law)];
      if (law->biaxial_exponent != 1.5) return false;
      for (int q = 0; q < 2; ++q)
        station[kPhi + q] = z.station[s].phi[q], station[kSoftness + q] = z.station[s].soft[q];
      station[kReached] = z.station[s].reached;
      station[kShare] = law->damage_share;
      const bool is_far = z.station[s].reached >= law->rupture_rotation;
      is_pressed = is_pressed || is_far;
      station[kRupture] = is_far ? law->rupture_rotation_pressed : law->rupture_rotation;
      far = std::max(far, z.station[s].reached);
    }
    for (int q = 0; q < 2; ++q) {
      double* cell = &station[kCell + q * kCellFields];
      const CompiledFamily* family = law != nullptr ? &law->moment[q] : nullptr;
      if (family == nullptr || family->K == 0) {
        std::fill(cell + kCellPositive, cell + kCellLiftPositive, unlimited);
        continue;
      }
      const double force = z.normal_force / whole, reached = z.station[s].reached;
      if (!(force > family->force.front() && force < family->force.back())) return false;
      // the interval that the force is in and the nearer one beside it
      const std::vector<double>& forces = family->force;
      const size_t k = static_cast<size_t>(find_interval(forces, force, z.station[s].k[q])), last = forces.size() - 1;
      const bool is_low = force - forces[k] < forces[k + 1] - force;
      const size_t middle = (is_low && k > 0) || k + 1 == last ? k : k + 1;
      const size_t row[3] = {middle > 0 ? middle - 1 : middle, middle, std::min(middle + 1, last)};
      cell[kCellForce] = whole * forces[middle];
      // no width: nothing but the full law beyond
      cell[kCellForce + 1] = row[0] < middle ? 1 / (whole * (forces[middle] - forces[row[0]])) : unlimited;
      cell[kCellForce + 2] = row[2] > middle ? 1 / (whole * (forces[row[2]] - forces[middle])) : unlimited;
      size_t j[2] = {family->rotation.size() - 1, family->rotation.size() - 1};
      cell[kCellRotation] = reached;
      if (reached < family->rotation.back()) {
        j[0] = static_cast<size_t>(find_interval(family->rotation, reached, z.station[s].j[q])), j[1] = j[0] + 1;
        cell[kCellRotation] = family->rotation[j[0]];
        cell[kCellRotation + 1] = 1 / (family->rotation[j[1]] - family->rotation[j[0]]);
        far = std::max(far, family->rotation[j[1]]);
      }
      for (size_t c = 0; c < 6; ++c) {
        const double* limit = &family->limit[family->place(row[c / 2], j[c % 2])];
        cell[static_cast<size_t>(kCellPositive) + c] = whole * limit[0];
        cell[static_cast<size_t>(kCellNegative) + c] = whole * limit[1];
      }
      for (size_t c = 0; c < 3 && !family->lift.empty(); ++c) {
        const double* lift = &family->lift[family->place(row[c], j[0])];
        cell[static_cast<size_t>(kCellLiftPositive) + c] = lift[0];
        cell[static_cast<size_t>(kCellLiftNegative) + c] = lift[1];
      }
    }
  }
  const CompiledLaw& law = limits.law();
  // where little compression is left at the end of the cell, it is asked again before
  const double reached = std::max(z.station[0].reached, z.station[1].reached);
  if (far > reached && limits.compression(far, z.shortened, whole, z.station[0]) <
                           limits.compression(reached, z.shortened, whole, z.station[0])) {
    far = reached + 0.25 * (far - reached);
    for (int s = 0; s < p.stations; ++s) {
      double& rupture = out[kStations + s * kStationFields + kRupture];
      rupture = std::min(rupture, far);
    }
  }
  out[kFlowLeast] = -limits.compression(far, z.shortened, whole, z.station[0]);
  out[kFlowMost] = is_pressed ? -kTiny : limits.tension(z.elongated);
  for (int axis = 0; axis < 2; ++axis)
    out[kShearOwn + axis] = law.slip_softening > 0 ? std::min(law.shear[axis], unlimited) : 0;
  out[kShearFriction] = law.shear_friction;
  out[kSlipped] = z.slipped;
  out[kSlipSoftening] = law.slip_softening > 0 ? 1 / law.slip_softening : 0;
  out[kSlipRupture] = law.slip_rupture;
  out[kTwisted] = z.twisted;
  out[kTwistRupture] = law.twist_rupture;
  out[kTorsion] = law.torsion;
  for (int i = 0; i < 6; ++i) {
    out[kFlexibility + i] = p.stiffness[i] > 0 ? 1 / (z.share * p.stiffness[i]) : 0;
    out[kBefore + i] = z.deformation[i];
  }
  out[kStored] = z.energy;
  return true;
}

double calc_utilisation(const ZoneParameters& p, const std::vector<CompiledLaw>& laws, double time,
                        const ZoneState& z) {
  if (!z.live || p.stations == 0) return 0;
  const Limits limits(laws, p.law[0], z, time);
  const auto ratio = [](double demand, double capacity) {
    if (capacity == kUnlimited) return 0.0;
    return capacity > 0 ? demand / capacity : (demand > 0 ? 1.0 : 0.0);
  };
  double force[6];
  for (int i = 0; i < 6; ++i) force[i] = z.elastic_force[i];
  force[0] = z.normal_force;
  double reached = z.station[0].reached;
  if (p.stations > 1) reached = std::max(reached, z.station[1].reached);
  const double integrity = limits.integrity(z.shortened);
  double u = p.external_axial ? 0.0
             : force[0] < 0   ? ratio(-force[0], limits.compression(reached, z.shortened, integrity, z.station[0]))
                              : ratio(force[0], limits.tension(z.elongated));
  for (int s = 0; s < p.stations; ++s) {
    const Limits station_limits(laws, p.law[s], z, time);
    StationState st = z.station[s];
    const double my = force[4] + p.x[s] * force[2], mz = force[5] - p.x[s] * force[1];
    const double axial = integrity > 0 ? force[0] / integrity : 0;
    const MomentLimit ly = station_limits.moment(0, axial, st), lz = station_limits.moment(1, axial, st);
    const double ry = ratio(std::abs(my), integrity * (my >= 0 ? ly.positive : ly.negative));
    const double rz = ratio(std::abs(mz), integrity * (mz >= 0 ? lz.positive : lz.negative));
    const double e = station_limits.law().biaxial_exponent;
    u = std::max(u, root_of(raised(ry, e) + raised(rz, e), e));
  }
  const double vy = ratio(std::abs(force[1]), limits.shear(0, z.slipped, -force[0]));
  const double vz = ratio(std::abs(force[2]), limits.shear(1, z.slipped, -force[0]));
  u = std::max(u, std::sqrt(vy * vy + vz * vz));
  return std::max(u, ratio(std::abs(force[3]), limits.torsion()));
}

bool is_softening(const ZoneParameters& p, const std::vector<CompiledLaw>& laws, double time, const ZoneState& z) {
  if (!z.live || p.stations == 0) return false;
  const Limits limits(laws, p.law[0], z, time);
  const double integrity = limits.integrity(z.shortened);
  if (integrity < 0.95) return true;
  const double axial = z.normal_force / integrity;
  for (int s = 0; s < p.stations; ++s)
    for (int q = 0; q < 2; ++q) {
      const Limits station_limits(laws, p.law[s], z, time);
      StationState now = z.station[s], fresh;
      if (now.reached == 0) continue;
      const MomentLimit a = station_limits.moment(q, axial, now), b = station_limits.moment(q, axial, fresh);
      if (b.positive != kUnlimited && a.positive + a.negative < 0.85 * (b.positive + b.negative)) return true;
    }
  return false;
}

}  // namespace topple::mbs
