#pragma once
/// The limits of a zone while it flows, and the bounds within which it cannot (docs/theory/zones.md).

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

#include "mbs/zone.h"

namespace topple::mbs {

/// The limits in force at a moment in time: those of one law, or two of them blended while a charge takes effect.
class Limits {
 public:
  Limits(const CompiledLaws& laws, int law, const ZoneState& z, double time)
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
    return blend([&](const CompiledLaw& l) { return calc_integrity(l, shortened); });
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

/// x to the power e, quickly for the exponent that is usual.
inline double raised(double x, double e) { return e == 1.5 ? x * std::sqrt(x) : std::pow(x, e); }
/// and its inverse.
inline double root_of(double x, double e) { return e == 1.5 ? std::cbrt(x * x) : std::pow(x, 1 / e); }

/// Sets the safe bounds around a normal force [N], an empty range of forces if there are none.
void find_safe_bounds(const ZoneParameters&, const CompiledLaws&, const Limits&, double normal_force, ZoneState&);

}  // namespace topple::mbs
