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
      : from_(laws[static_cast<size_t>(z.base_law < 0 ? law : z.base_law)]), to_(from_), hinge_bears_(z.hinge_bears) {
    if (z.next_law < 0) return;
    is_switching_ = true;
    to_ = laws[static_cast<size_t>(z.next_law)];
    share_ = z.ramp > 0 ? std::clamp((time - z.ramp_begin) / z.ramp, 0.0, 1.0) : 1.0;
  }

  /// The law that governs lengths of rupture.
  const CompiledLaw& law() const { return share_ > 0 ? to_.get() : from_.get(); }
  /// In whose measure StationState::strained is: that of the law that comes, from the beginning of a switch on.
  double rotation_ratio() const { return to_.get().rotation_ratio; }
  double tension(double elongated, double shortened) const {
    return blend(
        [&](const CompiledLaw& l) { return l.buckles && shortened > 0 ? 0.0 : calc_curve(l.tension, elongated); });
  }
  /// Share of the section that is still there: 1 until the peak of the compression curve, then what is left of it.
  double integrity(double shortened) const {
    return blend([&](const CompiledLaw& l) { return calc_integrity(l, shortened); });
  }
  /// Largest compression after a rotation and a plastic shortening, a hinge of the same member included.
  double compression(const StationState& s, double shortened, double integrity) const {
    const double own = blend([&](const CompiledLaw& l) {
      return std::min(calc_curve(l.compression, shortened),
                      (l.elongates ? 1 : integrity) *
                          std::min(calc_compression_capacity(l.moment[0], strained_under(l, s, s.strained), s.j[0]),
                                   calc_compression_capacity(l.moment[1], strained_under(l, s, s.strained), s.j[1])));
    });
    return std::min(own, hinge_bears_);
  }
  /// That of a whole section which has turned about this axis alone.
  double capacity(int axis, const StationState& s) const {
    return blend([&](const CompiledLaw& l) {
      return calc_compression_capacity(l.moment[axis], strained_under(l, s, s.strained), s.j[axis]);
    });
  }
  MomentLimit moment(int axis, double normal_force, StationState& s) const {
    MomentLimit a{0, 0}, b{0, 0};
    if (share_ < 1)
      a = calc_moment_limit(from_.get().moment[axis], normal_force, strained_under(from_.get(), s, s.strained),
                            s.k[axis], s.j[axis]);
    if (share_ > 0) {
      int k = 0, j = 0;
      b = calc_moment_limit(to_.get().moment[axis], normal_force, s.strained, k, j);
    }
    return {mix(a.positive, b.positive), mix(a.negative, b.negative)};
  }
  /// Rise of the limits with the normal force.
  MomentLimit slope(int axis, double normal_force, const StationState& s) const {
    MomentLimit a{0, 0}, b{0, 0};
    if (share_ < 1)
      a = calc_moment_slope(from_.get().moment[axis], normal_force, strained_under(from_.get(), s, s.strained),
                            s.k[axis], s.j[axis]);
    if (share_ > 0) b = calc_moment_slope(to_.get().moment[axis], normal_force, s.strained, 0, 0);
    return {mix(a.positive, b.positive), mix(a.negative, b.negative)};
  }
  /// Not less than the limits at any rotation: the largest ones under the forces of the table beside this one.
  MomentLimit find_peak(int axis, double normal_force, const StationState& s) const {
    const CompiledFamily& family = law().moment[axis];
    if (family.K == 0) return {kUnlimited, kUnlimited};
    const size_t k = static_cast<size_t>(find_interval(family.force, normal_force, s.k[axis]));
    MomentLimit peak{0, 0};
    for (size_t j = 0; j < family.rotation.size(); ++j)
      for (const size_t beside : {k, k + 1}) {
        const FamilyPoint& point = *family.at(beside, j);
        peak = {std::max(peak.positive, point.positive), std::max(peak.negative, point.negative)};
      }
    return peak;
  }
  /// The next rotation of a row of the limit moments, in those about y; unlimited behind the last one [rad].
  double next_row(double rotation) const {
    return std::min(next_of(law().moment[0].rotation, rotation), next_of(law().moment[1].rotation, rotation));
  }
  /// The next points of the curves, and where the softening by slip ends [m].
  double next_shortening(double shortened) const { return next_of(law().compression.x, shortened); }
  double next_elongation(double elongated) const { return next_of(law().tension.x, elongated); }
  double next_slip(double slipped) const { return slipped < law().slip_softening ? law().slip_softening : kUnlimited; }
  bool elongates() const { return from_.get().elongates || to_.get().elongates; }
  Lift lift(int axis, double normal_force, double rotation, StationState& s) const {
    Lift a, b;
    if (share_ < 1)
      a = calc_lift(from_.get().moment[axis], normal_force, strained_under(from_.get(), s, rotation), s.k[axis],
                    s.j[axis]);
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
  /// The first beyond x of what rises, unlimited if there is none.
  static double next_of(const std::vector<double>& rising, double x) {
    const auto next = std::upper_bound(rising.begin(), rising.end(), x);
    return next == rising.end() ? kUnlimited : *next;
  }
  double mix(double a, double b) const { return share_ <= 0 ? a : share_ >= 1 ? b : (1 - share_) * a + share_ * b; }
  template <class F>
  double blend(F&& f) const {
    if (share_ <= 0) return f(from_.get());
    if (share_ >= 1) return f(to_.get());
    return mix(f(from_.get()), f(to_.get()));
  }
  /// What the edges feel of a rotation, in the measure of one of the laws: it is kept in that of the law that comes.
  double strained_under(const CompiledLaw& l, const StationState& s, double strained) const {
    return is_switching_ && &l == &from_.get() ? s.outgoing_measure * strained : strained;
  }
  std::reference_wrapper<const CompiledLaw> from_, to_;
  bool is_switching_ = false;
  double share_ = 0;
  double hinge_bears_;
};

/// Whether a station has turned so far that it holds what presses the zone, and does not pull.
inline bool has_turned_far(const Limits (&limits)[2], const ZoneState& z) {
  return z.station[0].reached >= limits[0].law().rupture_rotation ||
         z.station[1].reached >= limits[1].law().rupture_rotation;
}

/// The station whose rotation has strained its edges most; a missing one has not turned.
inline const StationState& most_strained(const ZoneState& z) {
  return z.station[z.station[1].strained > z.station[0].strained ? 1 : 0];
}

/// Cracks grow a little ahead of their moment, so that not every step has to see to them and dead load leaves them at
/// rest.
inline constexpr double kCracksAhead = 1.01;

/// Rotation of cracks as a straight line: without a moment [rad], and its rise with the moment [rad/(N·m)].
struct CrackLine {
  double bow = 0, flexibility = 0;
};
/// From where the largest moment that is known on one side has come, or cracks begin, to the same on the other side
/// (zones.md, eq. 7b); all a little before, since they are known from ahead.
///   crest  moments that are known, > 0 and < 0, both without their sign [N·m]
inline CrackLine make_crack_line(const Cracking& law, const double crest[2]) {
  double moment[2], turn[2];
  for (int side : {0, 1}) {
    const double known = std::clamp(crest[side], law.begin[side], law.end[side]);
    moment[side] = known / kCracksAhead;
    turn[side] = calc_crack_rotation(law, side, known) / kCracksAhead;
  }
  const double flexibility = (turn[0] + turn[1]) / (moment[0] + moment[1]);
  return {turn[0] - flexibility * moment[0], flexibility};
}

/// The cracks of a station about one axis while they may grow.
struct Cracks {
  Cracking law;
  double crest[2] = {0, 0};  // moments that they are known from, > 0 and < 0 [N·m]
  CrackLine line;            // that they are on; its bow is part of the station's plastic rotation
  double ahead = 1;          // moments that they are known from over those at which they are

  /// Moment of this sign beyond which they grow.
  double calc_bound(double sign) const {
    const int side = side_of(sign);
    if (!(law.flexibility > 0) || crest[side] >= law.end[side]) return kUnlimited;
    return std::max(crest[side], law.begin[side]) / ahead;
  }
  /// Rotation by cracks around a moment beside the bow, from + slope m.
  struct Piece {
    double from = 0, slope = 0;
  };
  Piece find_piece(double moment) const {
    if (!(std::abs(moment) > calc_bound(moment))) return {0, line.flexibility};
    return is_growing(moment) ? find_growing(moment) : find_grown(moment);
  }
  /// m of m + S (c m + φ(m)) = trial, and the piece that it is on.
  ///   stiffness  S;  other  c, flexibility besides
  double find_moment(double trial, double stiffness, double other, Piece& piece) const {
    const auto solve = [&] { return (trial - stiffness * piece.from) / (1 + stiffness * (other + piece.slope)); };
    piece = {0, line.flexibility};
    double m = solve();
    if (!(std::abs(m) > calc_bound(trial))) return m;
    piece = find_growing(trial);
    m = solve();
    if (is_growing(m)) return m;
    piece = find_grown(trial);
    return solve();
  }

 private:
  static int side_of(double moment) { return moment >= 0 ? 0 : 1; }
  bool is_growing(double moment) const { return std::abs(moment) < law.end[side_of(moment)] / ahead; }
  Piece find_growing(double moment) const {
    const int side = side_of(moment);
    const double slope = law.flexibility * law.end[side] / (law.end[side] - law.begin[side]);
    return {(side == 0 ? -slope : slope) * law.begin[side] / ahead - line.bow, slope};
  }
  Piece find_grown(double moment) const {
    double to[2] = {crest[0], crest[1]};
    to[side_of(moment)] = law.end[side_of(moment)];
    const CrackLine grown = make_crack_line(law, to);
    return {grown.bow - line.bow, grown.flexibility};
  }
};
/// Of a station of a live zone whose law is still that of the model.
///   ahead  moment that cracks are known from over the one at which they are
inline Cracks cracks_of(const ZoneParameters& p, const ZoneState& z, int station, int axis, double ahead = 1) {
  const StationState& st = z.station[station];
  const bool may_grow = p.cracking[axis].flexibility > 0 && st.reached == 0 && z.next_law < 0 && z.base_law < 0;
  return {may_grow ? p.cracking[axis] : Cracking{},
          {st.crest[axis][0], st.crest[axis][1]},
          {st.bow[axis], st.crack[axis]},
          ahead};
}

/// x to the power e, quickly for the exponent that is usual.
inline double raised(double x, double e) { return e == 1.5 ? x * std::sqrt(x) : std::pow(x, e); }
/// and its inverse.
inline double root_of(double x, double e) { return e == 1.5 ? std::cbrt(x * x) : std::pow(x, 1 / e); }

/// Stiffness of a bending plane whose stations have these flexibilities beside the elastic one [rad/(N·m)]: shear,
/// coupling, bending.
void soften_plane(const ZoneParameters&, double share, int plane, const double flexibility[2], double stiffness[3]);

/// Sets what a zone is as a spring inside its safe bounds: its planes as cracks and damage have softened them, what the
/// springs do not see of its deformation, and the bounds of its cracks. False if it is none: softened without a
/// stiffness against bending.
bool find_springs(const ZoneParameters&, ZoneState&);
/// Sets the safe bounds around a normal force [N], an empty range of forces if there are none.
void find_safe_bounds(const ZoneParameters&, const CompiledLaws&, const Limits&, double normal_force, ZoneState&);

}  // namespace topple::mbs
