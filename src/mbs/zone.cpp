#include "mbs/zone.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "mbs/kernel.h"
#include "mbs/zone_limits.h"

namespace topple::mbs {

namespace {

using kernel::ActiveComponents;
using kernel::components_of;
using kernel::first_bending;
using kernel::kMostDamage;
using kernel::last_bending;
using kernel::Plane;
using kernel::SpringCracks;

constexpr double kTiny = 1e-300;
constexpr double kFound = 1e-14;  // share of a way that may be left over

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
      for (int s = 0; s < p.stations; ++s)  // it turns no station
        for (double* x : {&z.station[s].phi[q], &z.station[s].bow[q]}) *x -= flexed(4 + q) / p.stations;
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
  z.safe_force[0] = 1, z.safe_force[1] = -1;  // the bounds were those of the stiff zone
}

/// What a section shortens by turning need not be crushed: gives back what was in the last evaluation, as far as that
/// goes. Returns by how much the zone is longer for it [m].
double take_back_crushing(double elongation, ZoneState& z) {
  const double back = std::min(z.crushed, std::max(0.0, -elongation));
  z.shortened -= back;
  z.crushed -= back;
  return back;
}

}  // namespace

double calc_hinge_bearing(const ZoneParameters& p, const CompiledLaws& laws, double time, const ZoneState& z) {
  return Limits(laws, p.law[0], z, time).capacity(1, z.station[0]);
}

void begin_switch(const ZoneParameters& p, const CompiledLaws& laws, const LawSwitch& to, ZoneState& z) {
  if (z.next_law >= 0) z.base_law = z.next_law;
  z.next_law = to.law;
  z.ramp_begin = to.time;
  z.ramp = to.ramp;
  z.next_share = to.stiffness_share;
  z.safe_force[0] = 1, z.safe_force[1] = -1;  // the bounds are those of the law that goes
  const double ratio = laws[static_cast<size_t>(to.law)].rotation_ratio;
  for (int s = 0; s < p.stations; ++s) {
    StationState& st = z.station[s];
    const int before = z.base_law < 0 ? p.law[s] : z.base_law;
    st.outgoing_measure = 1;
    if (st.reached == 0 || laws[static_cast<size_t>(before)].rotation_ratio == ratio) continue;
    // in the direction in which it stands
    const double about_y = st.phi[0] - st.bow[0], about_z = st.phi[1] - st.bow[1],
                 length = std::hypot(about_y, about_z);
    const double was = st.strained;
    st.strained = length > 0 ? st.reached * std::hypot(about_y, ratio * about_z) / length : st.reached;
    st.outgoing_measure = st.strained > 0 ? was / st.strained : 1;
  }
}

void elongate_zone(const ZoneParameters& p, double by, ZoneState& z) {
  if (!z.live || by == 0) return;
  z.lifted += by;
  by += take_back_crushing(by, z);
  z.axial += by;
  z.offset[0] += by;
  z.is_adjusted = true;
  if (!z.has_elastic) return;
  const double released = by * (z.elastic_force[0] - 0.5 * z.share * p.stiffness[0] * by);
  z.energy -= released;
  z.plastic += released;
}

namespace {

/// Makes the cracks of all stations what they are at first yield; deformations and forces stay.
void crack_zone(const ZoneParameters& p, ZoneState& z) {
  for (int s = 0; s < p.stations; ++s)
    for (int q = 0; q < 2; ++q) {
      StationState& st = z.station[s];
      if (!(p.cracking[q].flexibility > 0)) continue;
      for (int side = 0; side < 2; ++side) st.crest[q][side] = p.cracking[q].end[side];
      const CrackLine line = make_crack_line(p.cracking[q], st.crest[q]);
      const double grown = line.flexibility - st.crack[q];
      if (grown == 0) continue;
      const double lever = (q == 0 ? 1 : -1) * p.x[s], m = z.elastic_force[4 + q] + lever * z.elastic_force[2 - q];
      st.crack[q] += grown;
      st.soft[q] += grown;
      st.phi[q] -= grown * m, st.bow[q] -= grown * m;  // it turns no station
      const double stored = 0.5 * grown * m * m;
      z.energy += stored;
      z.plastic -= stored;
      z.safe_force[0] = 1, z.safe_force[1] = -1;  // the bounds were those of the stiff zone
    }
}

}  // namespace

void free_zone(const ZoneParameters& p, const Six& carried, ZoneState& z) {
  crack_zone(p, z);
  z.axial = z.lifted = 0;  // those of the element that took them
  z.deformation[0] = z.elastic[0] = z.elastic_force[0] = z.damper_force[0] = z.flowed[0] = 0;
  z.normal_force = z.resultant.c[0] = 0;
  for (double& x : z.offset) x = 0;
  // what the joint bore, from where the bodies are
  double* const unstrained[] = {&z.axial, &z.slip[0], &z.slip[1], &z.twist, &z.station[0].phi[0]};
  const ActiveComponents active = components_of(p.plane);
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    const double k = z.share * p.stiffness[i], f = carried.c[i];
    if (i == 5 || !(k > 0)) continue;
    const double give = 1 / k + (i == 4 ? z.station[0].soft[0] : 0), stored = 0.5 * f * f * give;
    *unstrained[i] -= f * give;
    if (i == 4) z.station[0].bow[0] -= f * give;
    z.offset[i] = -f * give;
    z.elastic[i] = z.flowed[i] = f / k;
    z.elastic_force[i] = z.resultant.c[i] = f;
    z.energy += stored;
    z.plastic -= stored;
  }
  z.normal_force = z.resultant.c[0];
  z.safe_force[0] = 1, z.safe_force[1] = -1;
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

/// Whether a moment is beyond the bounds of a station's cracks.
bool cracks_grow(const ZoneState& z, int station, int axis, double moment) {
  const double* scale = z.crack_scale[station][axis];
  return std::max(moment * scale[0], -moment * scale[1]) > 1;
}

/// Whether resultants at the marker are inside the safe bounds of a zone that has any; of cracks they say nothing.
template <Plane In>
bool is_inside_bounds(const ZoneParameters& p, const ZoneState& z, const double f[6]) {
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
    constexpr ActiveComponents active = components_of(In);
    constexpr int q = first_bending(In), shear = active.at[1], bend = active.at[2];
    constexpr double sign = q == 0 ? 1 : -1;
    if (std::abs(f[shear]) * z.safe_shear[shear - 1] > 1) return false;
    for (int s = 0; s < p.stations; ++s)
      if (std::abs(f[bend] + sign * p.x[s] * f[shear]) * z.safe_moment[q] > 1) return false;
  }
  return true;
}

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
  if (!is_inside_bounds<In>(p, z, f)) return false;
  for (int s = 0; s < p.stations; ++s)
    for (int q = first; q <= last; ++q) {
      const double sign = q == 0 ? 1 : -1;
      if (cracks_grow(z, s, q, f[4 + q] + sign * p.x[s] * f[2 - q])) return false;
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

/// Goes to the first place from `low` on where nothing is left over; the last call of `over` is there.
///   over(x)      how far beyond x what flows comes under the limits at x; falls through 0, nearly straight between
///   rows next_row(x)  of the limits, unlimited behind the last one
template <class Over, class NextRow>
void find_on_law(double low, const Over& over, const NextRow& next_row) {
  double above = over(low);
  if (!(above > 0)) return;
  double high = low, below = above;
  while (below > 0) {
    low = high, above = below;
    high = std::max(next_row(low), std::nextafter(low, kUnlimited));
    if (high == kUnlimited) {  // limits stay as they are
      (void)over(low + above);
      return;
    }
    below = over(high);
  }
  // secants, and halves where those leave one end where it is
  constexpr int most_cuts = 100;
  for (int cut = 0; cut < most_cuts && below < 0; ++cut) {
    const double way = cut % 4 == 3 ? 0.5 : above / (above - below), at = low + way * (high - low);
    if (!(at > low && at < high)) {  // round-off: the nearer end
      (void)over(above < -below ? low : high);
      return;
    }
    const double left = over(at);
    if (std::abs(left) <= kFound * at) return;
    if (left > 0)
      low = at, above = left;
    else
      high = at, below = left;
  }
}

/// One evaluation of a zone by its full law, in space or what is left of it in a plane. Numbers of a bending plane q: 0
/// bends about y with shear along z, 1 bends about z with shear along y; of a station s.
template <Plane In>
struct Evaluation {
  static constexpr ActiveComponents active = components_of(In);
  static constexpr int first = first_bending(In), last = last_bending(In);
  static constexpr bool is_plane = In != Plane::Space;

  const ZoneParameters& p;
  const Six& d;
  ZoneState& z;
  const int n;                            // stations
  const double k[6];                      // stiffnesses of now
  const Bending planes[2];                //
  double force[6] = {0, 0, 0, 0, 0, 0};   // elastic resultants at the marker
  double station_stiffness[2][2];         // [q][s]
  double cross[2] = {0, 0};               // of two stations against each other's rotation [q]
  double phi[2][2];                       // inelastic rotation, damage included [q][s]
  double m[2][2];                         // moment at the station [q][s]
  double phi_trial[2][2], m_trial[2][2];  // before stations turn [q][s]
  MomentLimit most[2][2];                 // [q][s]
  bool turned[2] = {false, false};        // [s]
  bool cracked = false, flowed = false;
  BreakReason broke = BreakReason::None;

  Evaluation(const ZoneParameters& parameters, const Six& deformation, ZoneState& state)
      : p(parameters),
        d(deformation),
        z(state),
        n(p.stations),
        k{z.share * p.stiffness[0], z.share * p.stiffness[1], z.share * p.stiffness[2],
          z.share * p.stiffness[3], z.share * p.stiffness[4], z.share * p.stiffness[5]},
        planes{{k[2], k[4], +1, d.c[2] - z.slip[1], d.c[4]}, {k[1], k[5], -1, d.c[1] - z.slip[0], d.c[5]}} {
    find_trial();
  }

  static constexpr int shear_of(int q) { return q == 0 ? 2 : 1; }
  static constexpr int bend_of(int q) { return q == 0 ? 4 : 5; }

  /// Moments of a station as the inelastic rotations are.
  void measure(int s) {
    for (int q = first; q <= last; ++q)
      m[q][s] = Bending::at(planes[q].moment(phi[q], n), planes[q].shear(p.x, phi[q], n), p.x[s], planes[q].sign);
  }

  /// Resultants without any flow in this step.
  void find_trial() {
    force[0] = p.external_axial ? d.c[0] : k[0] * (d.c[0] - z.axial);
    if constexpr (!is_plane) force[3] = k[3] * (d.c[3] - z.twist);
    for (int q = first; q <= last; ++q) find_trial(q);
  }
  void find_trial(int q) {
    for (int s = 0; s < n; ++s) {
      station_stiffness[q][s] = planes[q].bending_stiffness + p.x[s] * p.x[s] * planes[q].shear_stiffness;
      phi[q][s] = z.station[s].phi[q];
    }
    if (n > 1) cross[q] = planes[q].bending_stiffness + p.x[0] * p.x[1] * planes[q].shear_stiffness;
    spring_back(q);
    force[shear_of(q)] = planes[q].shear(p.x, phi[q], n);
    force[bend_of(q)] = planes[q].moment(phi[q], n);
    for (int s = 0; s < n; ++s) m[q][s] = Bending::at(force[bend_of(q)], force[shear_of(q)], p.x[s], planes[q].sign);
  }

  /// Adds to plastic rotations those of cracks and damage, which are flexibility at the stations: (1 + S C) m = m0, two
  /// by two at most.
  void spring_back(int q) {
    double c[2] = {0, 0};
    for (int s = 0; s < n; ++s) c[s] = z.station[s].soft[q];
    if (!(c[0] > 0 || c[1] > 0)) return;
    double m0[2] = {0, 0};
    const double v = planes[q].shear(p.x, phi[q], n), b = planes[q].moment(phi[q], n);
    for (int s = 0; s < n; ++s) m0[s] = Bending::at(b, v, p.x[s], planes[q].sign);
    const double s11 = 1 + station_stiffness[q][0] * c[0], s22 = n > 1 ? 1 + station_stiffness[q][1] * c[1] : 1;
    const double s12 = cross[q] * c[1], s21 = cross[q] * c[0];
    const double determinant = s11 * s22 - s12 * s21;
    phi[q][0] += c[0] * (m0[0] * s22 - m0[1] * s12) / determinant;
    if (n > 1) phi[q][1] += c[1] * (m0[1] * s11 - m0[0] * s21) / determinant;
  }

  /// What a station that does not turn loses of its moment where the other one turns, for its rotation [N·m/rad].
  double calc_carried(int q, int s) const { return cross[q] / (1 + station_stiffness[q][s] * z.station[s].soft[q]); }

  /// Stored in the springs and in what damage softened [J].
  double calc_energy() const {
    double elastic = 0, soft = 0;
    for (int c = 0; c < active.count; ++c)
      if (const int i = active.at[c]; k[i] > 0) elastic += 0.5 * force[i] * force[i] / k[i];
    for (int q = first; q <= last; ++q)
      for (int s = 0; s < n; ++s) soft += 0.5 * z.station[s].soft[q] * m[q][s] * m[q][s];
    return elastic + soft;
  }

  /// Flow along the axis. Returns the share of the section that is still there.
  double flow_axially(const Limits (&of_stations)[2]) {
    const Limits& limits = of_stations[0];
    const StationState& strained = most_strained(z);
    double integrity = limits.integrity(z.shortened);
    z.crushed = 0;
    if (p.external_axial) {
      // held by somebody else
    } else if (force[0] < 0) {
      double limit = limits.compression(strained, z.shortened, integrity);
      if (-force[0] > limit) {
        double shortening = (-force[0] - limit) / k[0];
        const auto shorten_under = [&](double by) {
          integrity = limits.integrity(z.shortened + by);
          limit = limits.compression(strained, z.shortened + by, integrity);
          shortening = std::max(0.0, (-force[0] - limit) / k[0]);
          return shortening - by;
        };
        // where the curve falls while the zone shortens, one more look at it after the first estimate; where it rises
        // it may be steeper than the spring
        const double begin = limit, next = limits.next_shortening(z.shortened);
        const bool rises = next < kUnlimited && limits.compression(strained, next, limits.integrity(next)) > begin;
        const bool is_found = !p.is_at_rest && !rises && (shorten_under(shortening), limit <= begin);
        if (!is_found)
          find_on_law(0, shorten_under,
                      [&](double by) { return limits.next_shortening(z.shortened + by) - z.shortened; });
        z.axial -= shortening;
        z.shortened += shortening;
        z.crushed = shortening;
        force[0] = std::max(force[0], -limit);
        flowed = true;
      }
    } else {
      if (limits.law().buckles && z.shortened > 0 && force[0] > 0) {
        // what has buckled becomes straight first
        const double back = std::min(z.shortened, force[0] / k[0]);
        z.axial += back;
        z.shortened -= back;
        force[0] = z.shortened > 0 ? 0 : force[0] - k[0] * back;
        integrity = limits.integrity(z.shortened);
        flowed = true;
      }
      // a hinge that has turned far holds what presses it, and does not pull
      const bool is_far = has_turned_far(of_stations, z);
      double limit = is_far ? 0 : limits.tension(z.elongated, z.shortened);
      if (force[0] > limit) {
        double elongation = (force[0] - limit) / k[0];
        const auto elongate_under = [&](double by) {
          if (!is_far) limit = limits.tension(z.elongated + by, z.shortened);
          elongation = (force[0] - limit) / k[0];
          return elongation - by;
        };
        const double begin = limit, next = limits.next_elongation(z.elongated);
        const bool rises = !is_far && next < kUnlimited && limits.tension(next, z.shortened) > begin;
        const bool is_found = !p.is_at_rest && !rises && (elongate_under(elongation), limit <= begin);
        if (!is_found)
          find_on_law(0, elongate_under,
                      [&](double by) { return limits.next_elongation(z.elongated + by) - z.elongated; });
        z.axial += elongation;
        z.elongated += elongation;
        force[0] = limit;
        flowed = true;
      }
    }
    if (z.shortened >= calc_crush_length(p.crush_through, limits.law())) broke = BreakReason::Crushing;
    if (z.elongated >= limits.law().rupture_elongation) broke = BreakReason::Tension;
    return integrity;
  }

  /// Finds the share of the station's moments that its limits allow; true if that is not all.
  bool is_outside(const Limits& limits, int s, double scale[2]) const {
    if constexpr (is_plane) return find_return(m[first][s], most[first][s], scale[first]);
    return find_return(m[0][s], m[1][s], most[0][s], most[1][s], limits.law().biaxial_exponent, scale);
  }

  /// Turns a station alone until its moments are this share of what they are, while the other one turns on its cracks
  /// and damage; true if that one can feel it.
  bool turn(int s, const double scale[2]) {
    bool far = false;
    const int other = 1 - s;
    for (int q = first; q <= last; ++q) {
      const double soft = n > 1 ? z.station[other].soft[q] : 0, carried = n > 1 ? calc_carried(q, other) : 0;
      const double stiffness = station_stiffness[q][s] - cross[q] * carried * soft;
      const double by = station_stiffness[q][s] > 0 ? m[q][s] * (1 - scale[q]) / stiffness : 0;
      phi[q][s] += by;
      m[q][s] *= scale[q];
      if (n > 1) {
        phi[q][other] -= soft * carried * by;
        m[q][other] -= carried * by;
      }
      if (by != 0) turned[s] = true;
      far = far || std::abs(by) > 1e-9 * std::abs(phi[q][s]);
    }
    return far;
  }

  /// Limit moments under this normal force of the whole section.
  void find_limits(const Limits& limits, int s, double axial, double integrity, StationState& station) {
    for (int q = first; q <= last; ++q) {
      most[q][s] = limits.moment(q, axial, station);
      most[q][s].positive *= integrity;
      most[q][s].negative *= integrity;
    }
  }

  /// Cracks grow where a station comes to a larger moment than they are known from (zones.md, eq. 7b).
  ///   h  since the last evaluation [s]
  void crack_stations(double h) {
    // at rest as far ahead as motion leaves them
    const double ahead = h > 0 ? 1 : kCracksAhead;
    for (int q = first; q <= last; ++q) {
      bool grow = false;
      for (int s = 0; s < n; ++s) {
        z.station[s].tangent[q] = z.station[s].soft[q];
        if (!(p.cracking[q].flexibility > 0)) continue;
        grow = grow || std::abs(m[q][s]) > cracks_of(p, z, s, q, ahead).calc_bound(m[q][s]);
      }
      if (grow) {
        double plastic[2] = {0, 0};
        for (int s = 0; s < n; ++s) plastic[s] = z.station[s].phi[q];
        (void)crack_plane(q, plastic, {cracks_of(p, z, 0, q, ahead), cracks_of(p, z, n - 1, q, ahead)});
      }
    }
  }

  /// Under dead load a station that turns may load the other one beyond what its cracks are known from. True if they
  /// have grown; then moments are those without the turn again.
  bool crack_behind_turns() {
    bool grown = false;
    for (int q = first; q <= last; ++q) {
      if (!(p.cracking[q].flexibility > 0)) continue;
      const std::array<Cracks, 2> cracks{cracks_of(p, z, 0, q, kCracksAhead), cracks_of(p, z, n - 1, q, kCracksAhead)};
      bool grow = false;
      double plastic[2] = {0, 0};
      for (int s = 0; s < n; ++s) {
        plastic[s] = phi[q][s] - z.station[s].soft[q] * m[q][s];
        grow = grow || std::abs(m[q][s]) > cracks[static_cast<size_t>(s)].calc_bound(m[q][s]);
      }
      if (grow) grown = crack_plane(q, plastic, cracks) || grown;
    }
    if (!grown) return false;
    for (int q = first; q <= last; ++q) find_trial(q);
    turned[0] = turned[1] = false;
    return true;
  }

  /// The same from outside, in motion. False if nothing has grown.
  bool grow_cracks(double time) {
    constexpr double in_motion = 1;  // [s]
    crack_stations(in_motion);
    if (cracked) z.cracked_at = time;
    return cracked;
  }

  /// m + S φ(m) = m of the plastic rotations alone, where φ(m) is straight in pieces. False if no crack has grown.
  ///   plastic  of the stations, where they have turned in this evaluation too, with what cracks have at no moment
  bool crack_plane(int q, const double plastic[2], const std::array<Cracks, 2>& cracks) {
    double m0[2] = {0, 0}, other[2] = {0, 0};
    bool grown = false;
    for (int s = 0; s < n; ++s) {
      m0[s] = Bending::at(planes[q].moment(plastic, n), planes[q].shear(p.x, plastic, n), p.x[s], planes[q].sign);
      other[s] = z.station[s].soft[q] - z.station[s].crack[q];
    }
    const double s12 = cross[q];
    const double s11 = station_stiffness[q][0], s22 = n > 1 ? station_stiffness[q][1] : 0;
    // each station by itself with the other one as it is finds the pieces, both together then the moments
    Cracks::Piece piece[2];
    double at[2] = {m[q][0], n > 1 ? m[q][1] : 0};
    constexpr int most_sweeps = 40;
    for (int sweep = 0; sweep < most_sweeps; ++sweep) {
      for (int s = 0; s < n; ++s) {
        const double beside = n > 1 ? s12 * (piece[1 - s].from + (other[1 - s] + piece[1 - s].slope) * at[1 - s]) : 0;
        at[s] = cracks[static_cast<size_t>(s)].find_moment(m0[s] - beside, station_stiffness[q][s], other[s], piece[s]);
      }
      if (n == 1) break;
      const double c1 = other[0] + piece[0].slope, c2 = other[1] + piece[1].slope;
      const double r1 = m0[0] - s11 * piece[0].from - s12 * piece[1].from;
      const double r2 = m0[1] - s12 * piece[0].from - s22 * piece[1].from;
      const double a11 = 1 + s11 * c1, a12 = s12 * c2, a21 = s12 * c1, a22 = 1 + s22 * c2, det = a11 * a22 - a12 * a21;
      const double both[2] = {(r1 * a22 - r2 * a12) / det, (r2 * a11 - r1 * a21) / det};
      bool same = true;
      for (int s = 0; s < 2; ++s)
        same =
            same && cracks[static_cast<size_t>(s)].find_piece(both[s]).slope == piece[s].slope && both[s] * at[s] >= 0;
      if (!same) continue;
      std::copy(both, both + 2, at);
      break;
    }
    for (size_t s = 0; s < static_cast<size_t>(n); ++s) {
      StationState& st = z.station[s];
      st.tangent[q] = other[s] + piece[s].slope;
      if (!(std::abs(at[s]) > cracks[s].calc_bound(at[s]))) continue;
      const size_t side = at[s] >= 0 ? 0 : 1;
      st.crest[q][side] = std::min(kCracksAhead * std::abs(at[s]), p.cracking[q].end[side]);
      const CrackLine line = make_crack_line(p.cracking[q], st.crest[q]);
      st.phi[q] += line.bow - st.bow[q];
      st.bow[q] = line.bow;
      st.crack[q] = line.flexibility;
      st.soft[q] = other[s] + st.crack[q];
      grown = cracked = true;
    }
    if (grown) find_trial(q);
    return grown;
  }

  /// Rotation of a station beyond that of its cracks.
  double beyond_cracks(const double turns[2][2], const double moments[2][2], int q, int s) const {
    return turns[q][s] - z.station[s].bow[q] - z.station[s].crack[q] * moments[q][s];
  }

  /// Takes back what a station has turned in this step, as the other one is; both spring back.
  void turn_back(int s) {
    for (int q = first; q <= last; ++q) {
      for (int i = 0; i < n; ++i) phi[q][i] -= z.station[i].soft[q] * m[q][i];
      phi[q][s] = z.station[s].phi[q];
      spring_back(q);
    }
    for (int i = 0; i < n; ++i) measure(i);
    turned[s] = false;
  }

  /// One station after the other, each anew as the other one is.
  ///   still  share of a rotation by which none moves any more
  template <class Turn>
  void take_turns(int most_sweeps, double still, const Turn& turn_anew) {
    for (int sweep = 0; sweep < most_sweeps; ++sweep) {
      bool changed = false;
      for (int s = 0; s < n; ++s) {
        double before[2] = {0, 0};
        for (int q = first; q <= last; ++q) before[q] = phi[q][s];
        turn_back(s);
        turn_anew(s);
        for (int q = first; q <= last; ++q)
          changed = changed || std::abs(phi[q][s] - before[q]) > still * std::abs(phi[q][s]);
      }
      if (n == 1 || !changed) break;
    }
  }

  /// Turns a station alone from where it was before until its moments stand on the limits of the rotation that it comes
  /// to, the first one that does on the way.
  ///   peak  not less than limits at any rotation [q][s]
  void turn_onto_law(const Limits& limits, int s, double axial, double integrity, const MomentLimit (&peak)[2][2]) {
    StationState ahead = z.station[s];
    double start[2][2] = {}, moment[2][2] = {}, scale[2];  // [q][s]
    for (int q = first; q <= last; ++q)
      for (int i = 0; i < n; ++i) start[q][i] = phi[q][i], moment[q][i] = m[q][i];
    // rotation that the station comes to under the limits that are set
    const auto turn_to_limits = [&] {
      for (int q = first; q <= last; ++q)
        for (int i = 0; i < n; ++i) phi[q][i] = start[q][i], m[q][i] = moment[q][i];
      turned[s] = false;
      if (!is_outside(limits, s, scale)) return z.station[s].strained;
      (void)turn(s, scale);
      return std::max(z.station[s].strained, strain_of(phi, m, s, limits.rotation_ratio()));
    };
    double begin = z.station[s].strained;
    if (z.station[s].reached == 0) {  // it turns at least as far as there
      for (int q = first; q <= last; ++q) most[q][s] = peak[q][s];
      begin = turn_to_limits();
    }
    const auto turn_under = [&](double rotation) {
      ahead.strained = rotation;
      find_limits(limits, s, axial, integrity, ahead);
      return turn_to_limits() - rotation;
    };
    find_on_law(begin, turn_under, [&](double rotation) { return limits.next_row(rotation); });
  }

  /// All stations by turns until each stands on its law as the other one is.
  void turn_onto_laws(const Limits (&limits)[2], double axial, double integrity) {
    constexpr int most_sweeps = 60;
    constexpr double still = 1e-13;  // share of a rotation
    MomentLimit peak[2][2];          // not less than limits at any rotation [q][s]
    for (int s = 0; s < n; ++s)
      for (int q = first; q <= last; ++q) {
        peak[q][s] = limits[s].find_peak(q, axial, z.station[s]);
        peak[q][s].positive *= integrity;
        peak[q][s].negative *= integrity;
      }
    take_turns(most_sweeps, still, [&](int s) { turn_onto_law(limits[s], s, axial, integrity, peak); });
  }

  /// Bending at the stations: radial return on (|My|/Ly)^p + (|Mz|/Lz)^p = 1.
  void turn_stations(const Limits (&limits)[2], double axial, double integrity) {
    for (int s = 0; s < n; ++s)
      for (int q = first; q <= last; ++q) phi_trial[q][s] = phi[q][s];
    double scale[2][2];  // [s][q]
    bool outside[2] = {false, false};
    for (int s = 0; s < n; ++s) {
      measure(s);
      for (int q = first; q <= last; ++q) m_trial[q][s] = m[q][s];
      outside[s] = is_outside(limits[s], s, scale[s]);
    }
    if (p.is_at_rest) {
      if (outside[0] || outside[1]) turn_onto_laws(limits, axial, integrity);
      return;
    }
    if (n == 1) {
      if (outside[0]) (void)turn(0, scale[0]);
      return;
    }
    if (!outside[0] && !outside[1]) return;
    if (outside[0] != outside[1]) {
      const int one = outside[0] ? 0 : 1, other = 1 - one;
      if (turn(one, scale[one])) {
        measure(other);
        outside[other] = is_outside(limits[other], other, scale[other]);
      }
    }
    if (!outside[0] || !outside[1] || turn_both(scale)) return;
    take_turns(kernel::kMostSweeps, kernel::kStill, [&](int s) {
      if (is_outside(limits[s], s, scale[s])) (void)turn(s, scale[s]);
    });
  }

  /// Both stations at once: two by two in each plane. False, and nothing changed, if that would bring work.
  bool turn_both(const double scale[2][2]) {
    double target[2][2], by[2][2];  // [q][s]
    for (int q = first; q <= last; ++q) {
      const double s12 = cross[q], s11 = station_stiffness[q][0], s22 = station_stiffness[q][1];
      const double determinant = s11 * s22 - s12 * s12;
      if (!(determinant > 1e-9 * s11 * s22)) return false;
      for (int s = 0; s < 2; ++s) target[q][s] = (turned[s] ? m_trial[q][s] : m[q][s]) * scale[s][q];
      const double over0 = m_trial[q][0] - target[q][0], over1 = m_trial[q][1] - target[q][1];
      by[q][0] = (s22 * over0 - s12 * over1) / determinant;
      by[q][1] = (s11 * over1 - s12 * over0) / determinant;
    }
    for (int s = 0; s < 2; ++s) {
      double work = 0;  // of what is plastic: cracks and damage spring back
      for (int q = first; q <= last; ++q)
        work += target[q][s] * (by[q][s] + z.station[s].soft[q] * (m_trial[q][s] - target[q][s]));
      if (!(work >= 0)) return false;
    }
    for (int q = first; q <= last; ++q)
      for (int s = 0; s < 2; ++s) {
        phi[q][s] = phi_trial[q][s] + by[q][s];
        turned[s] = turned[s] || by[q][s] != 0;
      }
    return true;
  }

  static double length_of(const double turns[2][2], int s) {
    return is_plane ? std::abs(turns[first][s]) : std::sqrt(turns[0][s] * turns[0][s] + turns[1][s] * turns[1][s]);
  }
  /// Of what a station has turned beyond its cracks.
  double length_of(const double turns[2][2], const double moments[2][2], int s) const {
    double beyond[2][2] = {};
    for (int q = first; q <= last; ++q) beyond[q][s] = beyond_cracks(turns, moments, q, s);
    return length_of(beyond, s);
  }
  /// The same as its edges feel it.
  ///   ratio  of the law, what a rotation about z strains over one about y
  double strain_of(const double turns[2][2], const double moments[2][2], int s, double ratio) const {
    double beyond[2][2] = {};
    for (int q = first; q <= last; ++q) beyond[q][s] = (q == 0 ? 1 : ratio) * beyond_cracks(turns, moments, q, s);
    return length_of(beyond, s);
  }

  /// What turns further lengthens or shortens. Returns by how much; stations then turn to the limit under the force
  /// that is left.
  double lengthen(const Limits (&limits)[2], double axial) {
    if (p.is_at_rest) {
      for (int s = 0; s < n && (turned[0] || turned[1]); ++s) measure(s);
      return 0;
    }
    const double axial_stiffness = p.external_axial ? 0 : k[0], relief = p.external_axial ? p.relief : k[0];
    const auto ratio_of = [&](int q, int s) { return q == 0 ? 1 : limits[s].rotation_ratio(); };
    // rotation up to which a station had gone in the step before, by plastic flow or on the flexibility of its damage
    double so_far[2] = {0, 0};
    for (int s = 0; s < n; ++s) {
      if (!turned[s] || !limits[s].elongates()) continue;
      const StationState& st = z.station[s];
      double before[2][2];
      for (int q = first; q <= last; ++q) {
        const double b = z.elastic_force[bend_of(q)], v = z.elastic_force[shear_of(q)];
        before[q][s] = ratio_of(q, s) *
                       (st.phi[q] - st.bow[q] + (st.soft[q] - st.crack[q]) * Bending::at(b, v, p.x[s], planes[q].sign));
      }
      so_far[s] = std::max(st.strained, length_of(before, s));
    }
    const auto calc_strain = [&](int s) { return strain_of(phi, m, s, ratio_of(1, s)); };
    const auto grows = [&](int s) { return turned[s] && limits[s].elongates() && calc_strain(s) > so_far[s]; };
    const auto calc_elongation = [&]() {
      double sum = 0;
      for (int s = 0; s < n; ++s) {
        if (!grows(s)) continue;
        StationState& st = z.station[s];
        double squares = 0, along = 0, bending = 0;
        for (int q = first; q <= last; ++q) {
          const Lift lift = limits[s].lift(q, axial, st.strained, st);
          const double gone = ratio_of(q, s) * beyond_cracks(phi, m, q, s);
          squares += gone * gone;
          along += gone * gone * (gone >= 0 ? lift.positive : lift.negative);
          bending += m[q][s] * (phi[q][s] - phi_trial[q][s]);
        }
        if (along == 0) continue;
        double by = (calc_strain(s) - so_far[s]) * along / squares;
        // the axial spring takes no more than bending brings: |by| (½ k |by| - N') <= brought, N' pulling the way of by
        const double brought = (1 - 0.5 * limits[s].law().damage_share) * std::max(0.0, bending);
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
    if (turned[0] || (n > 1 && turned[1]))
      for (int s = 0; s < n; ++s) measure(s);
    const double elongation = calc_elongation();
    if (elongation == 0 || !(relief > 0)) return elongation;
    // that changes the normal force and with it the limits
    double share = 1;  // of the turn
    for (int s = 0; s < n; ++s) {
      if (!grows(s)) continue;
      double excess = 0;
      if constexpr (is_plane)
        excess = calc_excess(m_trial[first][s], most[first][s]);
      else
        excess = calc_excess(m_trial[0][s], m_trial[1][s], most[0][s], most[1][s], limits[s].law().biaxial_exponent).r;
      if (!(excess > 1) || std::isinf(excess)) continue;
      const double left = 1 / excess, rise = -left * calc_rise(limits[s], axial, s, left) * relief * elongation;
      if (!(rise > 0)) continue;
      const double length = calc_strain(s);
      const double trial = std::max(so_far[s], strain_of(phi_trial, m_trial, s, ratio_of(1, s)));
      const double ahead = (trial - so_far[s]) / (length - so_far[s]);  // by damage, before it turns
      share = std::min(share, std::max(0.0, (1 - left - rise * ahead) / (1 - left + rise * (1 - ahead))));
    }
    if (!(share < 1)) return elongation;
    for (int q = first; q <= last; ++q)
      for (int s = 0; s < n; ++s) phi[q][s] = phi_trial[q][s] + share * (phi[q][s] - phi_trial[q][s]);
    for (int s = 0; s < n; ++s) measure(s);
    return calc_elongation();
  }

  /// Rise of the share `left` that a station's limits leave of its moments, with the normal force and over itself
  /// [1/N]; that of I L(N/I) is that of L.
  double calc_rise(const Limits& limits, double axial, int s, double left) const {
    double rise = 0;
    for (int q = first; q <= last; ++q) {
      const bool is_positive = m_trial[q][s] >= 0;
      const double limit = is_positive ? most[q][s].positive : most[q][s].negative;
      if (!(limit > 0) || limit == kUnlimited) continue;
      const MomentLimit slope = limits.slope(q, axial, z.station[s]);
      rise += raised(left * std::abs(m_trial[q][s]) / limit, limits.law().biaxial_exponent) *
              (is_positive ? slope.positive : slope.negative) / limit;
    }
    return rise;
  }

  /// Splits what is new of the inelastic rotations into a plastic part and added flexibility.
  ///   laws  of the stations
  void keep_rotations(const CompiledLaw* const laws[2]) {
    for (int q = first; q <= last; ++q) {
      force[shear_of(q)] = planes[q].shear(p.x, phi[q], n);
      force[bend_of(q)] = planes[q].moment(phi[q], n);
      for (int s = 0; s < n; ++s) m[q][s] = Bending::at(force[bend_of(q)], force[shear_of(q)], p.x[s], planes[q].sign);
    }
    const auto added_of = [&](int q, int s) {
      return phi[q][s] - z.station[s].phi[q] - z.station[s].soft[q] * m[q][s];
    };
    const auto spring_of = [&](int q, int s) {
      return station_stiffness[q][s] / (1 + station_stiffness[q][s] * z.station[s].soft[q]);
    };
    // a station that is turned about an axis by the other end has hardly a moment there: both axes together bound it
    const auto bound = [&](int q, int s) {
      if constexpr (is_plane) return kUnlimited;
      // an axis that has no limit left is lost as it was
      if (!((m_trial[q][s] >= 0 ? most[q][s].positive : most[q][s].negative) > 0)) return kUnlimited;
      double turn2 = 0, moment2 = 0;
      for (int r = first; r <= last; ++r) {
        turn2 += std::pow(added_of(r, s) * spring_of(r, s), 2);
        moment2 += m[r][s] * m[r][s];
      }
      return std::sqrt(turn2 / moment2) / spring_of(q, s);
    };
    double grown[2][2];
    for (int q = first; q <= last; ++q) {
      for (int s = 0; s < n; ++s) {
        StationState& st = z.station[s];
        grown[q][s] = st.soft[q];
        const double added = added_of(q, s);
        const double share = laws[s]->damage_share;
        if (turned[s] && share > 0 && added * m[q][s] > 0) {
          const double top = std::min(st.crack[q] + share * std::abs(beyond_cracks(phi, m, q, s)) / std::abs(m[q][s]),
                                      kMostDamage / station_stiffness[q][s]);
          grown[q][s] =
              std::max(st.soft[q], std::min(top, st.soft[q] + share * std::min(added / m[q][s], bound(q, s))));
        }
      }
    }
    for (int q = first; q <= last; ++q)
      for (int s = 0; s < n; ++s) {
        z.station[s].soft[q] = grown[q][s];
        z.station[s].phi[q] = phi[q][s] - grown[q][s] * m[q][s];
      }
  }

  void slip(const Limits& limits) {
    const double compression = -force[0], trial[2] = {force[1], force[2]};
    double by[2] = {0, 0}, way = 0;
    bool is_beyond = false;
    const auto slip_under = [&](double further) {
      double over2 = 0, way2 = 0;  // square of the demand over the limits
      for (int a = 1 - last; a <= 1 - first; ++a) {
        const double limit = limits.shear(a, z.slipped + further, compression);
        const double ratio = limit > 0 ? std::abs(trial[a]) / limit : (trial[a] != 0 ? kUnlimited : 0);
        over2 += ratio * ratio;
      }
      const double r = std::sqrt(over2);
      is_beyond = r > 1;
      const double scale = !is_beyond ? 1 : std::isinf(r) ? 0 : 1 / r;
      for (int a = 1 - last; a <= 1 - first; ++a) {
        by[a] = k[1 + a] > 0 ? trial[a] * (1 - scale) / k[1 + a] : 0;
        way2 += by[a] * by[a];
        force[1 + a] = trial[a] * scale;
      }
      way = std::sqrt(way2);
      return way - further;
    };
    if (!p.is_at_rest)
      (void)slip_under(0);
    else
      find_on_law(0, slip_under, [&](double further) { return limits.next_slip(z.slipped + further) - z.slipped; });
    if (is_beyond) {
      for (int a = 1 - last; a <= 1 - first; ++a) z.slip[a] += by[a];
      z.slipped += way;
      flowed = true;
      for (int q = first; q <= last; ++q)
        for (int s = 0; s < n; ++s)
          m[q][s] = Bending::at(force[bend_of(q)], force[shear_of(q)], p.x[s], planes[q].sign);
    }
    if (z.slipped >= limits.law().slip_rupture) broke = BreakReason::Shear;
  }

  void twist(const Limits& limits) {
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
  }

  /// Safe bounds for the steps to come.
  void renew_bounds(const CompiledLaws& laws, const Limits (&limits)[2]) {
    const bool is_in_range = force[0] >= z.safe_force[0] && force[0] <= z.safe_force[1];
    // limits do not know of cracks
    if (cracked && !flowed && z.next_law < 0 && is_in_range && find_springs(p, z)) return;
    if (!flowed && !cracked && z.next_law < 0) {
      if (is_in_range) return;
      // bounds are the least limits around this force: none that are far enough away can be found near the limits here
      bool is_near = !p.external_axial;
      for (int s = 0; s < n; ++s) is_near = is_near && limits[s].law().biaxial_exponent == 1.5;
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
      if (!is_near) return find_safe_bounds(p, laws, limits[0], force[0], z);
    }
    z.safe_force[0] = 1, z.safe_force[1] = -1;
  }

  /// A bounded zone that no more happens to than that it cracks: inside the bounds there is no limit to ask. False, and
  /// nothing but cracks changed, if that is not all.
  bool crack_inside_bounds(const CompiledLaws& laws) {
    if (!cracked || !is_bounded(z, false) || z.is_adjusted || !is_inside_bounds<In>(p, z, force)) return false;
    const CompiledLaw* of[2];
    for (int s = 0; s < 2; ++s) of[s] = &laws[static_cast<size_t>(z.base_law < 0 ? p.law[s < n ? s : 0] : z.base_law)];
    z.crushed = 0;
    keep_rotations(of);
    if (!find_springs(p, z)) z.safe_force[0] = 1, z.safe_force[1] = -1;
    return true;
  }

  /// All flow of this step, and what breaks the zone.
  ///   h  since the last evaluation [s]
  void flow(const CompiledLaws& laws, double time, double h) {
    cracked = z.cracked_at == time;  // then once is enough
    if (!cracked) crack_stations(h);
    if (crack_inside_bounds(laws)) return;
    const Limits limits[2] = {Limits(laws, p.law[0], z, time), Limits(laws, p.law[n > 1 ? 1 : 0], z, time)};
    const double integrity = flow_axially(limits);
    // what is left of the section carries both the force and the moment
    const double axial = integrity > 0 ? force[0] / integrity : 0;
    for (int s = 0; s < n; ++s) find_limits(limits[s], s, axial, integrity, z.station[s]);
    turn_stations(limits, axial, integrity);
    constexpr int most_rounds = 60;  // of turns and the cracks that they bring
    for (int i = 0; p.is_at_rest && n > 1 && i < most_rounds && crack_behind_turns(); ++i)
      turn_stations(limits, axial, integrity);
    const double elongation = lengthen(limits, axial);
    for (int s = 0; s < n; ++s) {
      StationState& st = z.station[s];
      const CompiledLaw& law = limits[s].law();
      const bool was_far = st.reached >= law.rupture_rotation;
      if (turned[s]) flowed = true;
      if (turned[s] || (!p.is_at_rest && is_damaged(st))) {
        const double length = length_of(phi, m, s), strain = strain_of(phi, m, s, limits[s].rotation_ratio());
        if (length > st.reached || strain > st.strained) z.safe_force[0] = 1, z.safe_force[1] = -1;
        st.reached = std::max(st.reached, length), st.strained = std::max(st.strained, strain);
      }
      if (st.reached >= (force[0] < 0 || was_far ? law.rupture_rotation_pressed : law.rupture_rotation))
        broke = BreakReason::Rotation;
    }
    const CompiledLaw* const of[2] = {&limits[0].law(), &limits[1].law()};
    if (flowed || cracked) keep_rotations(of);
    z.lifted += elongation;
    const double longer = elongation + take_back_crushing(elongation, z);
    z.axial += longer;
    if (!p.external_axial) force[0] -= k[0] * longer;
    slip(limits[0]);
    twist(limits[0]);
    renew_bounds(laws, limits);
  }

  /// Books what was dissipated. False if the zone is broken.
  bool keep(double energy_trial) {
    const bool broken = broke != BreakReason::None;
    const double energy = broken ? 0 : flowed || cracked ? calc_energy() : energy_trial;
    if (broken)
      for (double& f : force) f = 0;
    if (flowed || cracked || broken || z.is_adjusted) {
      // what was put in since the last evaluation and is not stored is gone; work by the trapezium, as the bodies feel
      // it
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
    if (!broken) return true;
    for (int i = 0; i < 6; ++i) z.deformation[i] = d.c[i];
    break_zone(z, broke);
    return false;
  }

  /// A damper in series with a spring, both beside the elastic deformation (standard linear solid): no plastic flow is
  /// damped, and at rest it carries nothing. The damper follows the mean of the step.
  void damp(double h) {
    double damper_energy = 0;
    for (int c = 0; c < active.count; ++c) {
      const int i = active.at[c];
      const double e = k[i] > 0 ? force[i] / k[i] : 0;
      double damper = 0;
      if (p.viscous > 0 && z.has_elastic && h > 0) {
        // where the limits fall, what the spring gives up is no motion that would be damped
        const double way = d.c[i] - z.deformation[i], stretched = e - z.elastic[i];
        const double driven =
            flowed || cracked ? std::clamp(stretched, std::min(way, 0.0), std::max(way, 0.0)) : stretched;
        const double before = e - driven;
        z.flowed[i] += before - z.elastic[i];
        z.flowed[i] += p.relaxation * (0.5 * (e + before) - z.flowed[i]);
        const double stretch = e - z.flowed[i];
        damper = p.viscous * k[i] * stretch;
        damper_energy += 0.5 * damper * stretch;
        const double mean = 0.5 * (damper + z.damper_force[i]);
        z.damping += mean * driven;
        z.plastic += mean * (way - driven);
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
};

template <Plane In>
void advance_in(const ZoneParameters& p, const CompiledLaws& laws, const Six& d, double time, double h, ZoneState& z) {
  if (advance_inside_bounds<In>(p, d, h, z)) return;
  const bool is_switched = z.next_law >= 0 && time >= z.ramp_begin + z.ramp;
  if (is_switched) {
    z.base_law = z.next_law;
    z.next_law = -1;
  }
  Evaluation<In> now(p, d, z);
  const double energy = now.calc_energy();
  if (now.n > 0) now.flow(laws, time, h);
  if (!now.keep(energy)) return;
  now.damp(h);
  // only now: on the soft springs, forces beyond the new limits would leave long ways of flow, and dampers that pull
  if (is_switched && z.next_share != z.share) soften(p, z);
}

/// Answer of `f` to an evaluation in the zone's plane.
template <class F>
auto evaluate_in_plane(const ZoneParameters& p, const Six& d, ZoneState& z, F&& f) {
  switch (p.plane) {
    case Plane::AboutY:
      return f(Evaluation<Plane::AboutY>(p, d, z));
    case Plane::AboutZ:
      return f(Evaluation<Plane::AboutZ>(p, d, z));
    case Plane::Space:
      break;
  }
  return f(Evaluation<Plane::Space>(p, d, z));
}

}  // namespace

bool grow_cracks(const ZoneParameters& p, const Six& d, double time, ZoneState& z) {
  return evaluate_in_plane(p, d, z, [&](auto now) { return now.grow_cracks(time); });
}

SpringCracks crack_spring(const ZoneParameters& p, const CompiledLaws& laws, const Six& d, double time, ZoneState& z) {
  return evaluate_in_plane(p, d, z, [&](auto now) {
    if (!now.grow_cracks(time)) return SpringCracks::Hold;
    if (calc_bound_utilisation(p, z, now.force) > kNearBounds) {
      z.safe_force[0] = 1, z.safe_force[1] = -1;  // near its bounds the full law finds others
      return SpringCracks::Beyond;
    }
    return now.crack_inside_bounds(laws) && is_bounded(z, false) ? SpringCracks::Grown : SpringCracks::Beyond;
  });
}

void advance_zone(const ZoneParameters& p, const CompiledLaws& laws, const Six& d, double time, double h,
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

}  // namespace topple::mbs
