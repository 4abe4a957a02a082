#include <algorithm>
#include <cmath>
#include <span>

#include "mbs/kernel.h"
#include "mbs/zone_limits.h"

namespace topple::mbs {

namespace {

constexpr double kTiny = 1e-300;
constexpr double kMostLimit = 1e300;  // finite, for the kernel

/// Least limit moment of a family between two normal forces: at an end or at a force of the table, for it is linear
/// between.
///   k, j  where to look first
double find_least_moment(const CompiledFamily& family, double from, double to, double rotation, int k, int j) {
  if (family.K == 0) return kUnlimited;
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

}  // namespace

void soften_plane(const ZoneParameters& p, double share, int q, const double flexibility[2], double stiffness[3]) {
  const double ks = share * p.stiffness[q == 0 ? 2 : 1], kb = share * p.stiffness[q == 0 ? 4 : 5];
  const double sign = q == 0 ? 1 : -1;
  double c = 0, cx = 0, cxx = 0;  // flexibilities add up
  for (int s = 0; s < p.stations; ++s) {
    c += flexibility[s];
    cx += sign * p.x[s] * flexibility[s];
    cxx += p.x[s] * p.x[s] * flexibility[s];
  }
  stiffness[0] = ks, stiffness[1] = 0, stiffness[2] = kb;
  if (c == 0 || !(kb > 0)) return;
  if (ks > 0) {
    const double f11 = 1 / ks + cxx, f12 = cx, f22 = 1 / kb + c, determinant = f11 * f22 - f12 * f12;
    stiffness[0] = f22 / determinant, stiffness[1] = -f12 / determinant, stiffness[2] = f11 / determinant;
  } else {
    stiffness[2] = 1 / (1 / kb + c);
  }
}

void find_crack_bounds(const ZoneParameters& p, ZoneState& z) {
  for (int s = 0; s < p.stations; ++s)
    for (int q = kernel::first_bending(p.plane); q <= kernel::last_bending(p.plane); ++q) {
      const Cracks cracks = cracks_of(p, z, s, q);
      z.crack_scale[s][q][0] = 1 / cracks.calc_bound(1);
      z.crack_scale[s][q][1] = 1 / cracks.calc_bound(-1);
    }
}

bool find_springs(const ZoneParameters& p, ZoneState& z) {
  double turned[2] = {0, 0}, shifted[2] = {0, 0};
  z.is_softened = false;
  for (int q = kernel::first_bending(p.plane); q <= kernel::last_bending(p.plane); ++q) {
    double flexibility[2] = {0, 0};
    for (int s = 0; s < p.stations; ++s) {
      turned[q] += z.station[s].phi[q];
      shifted[q] += p.x[s] * z.station[s].phi[q];
      flexibility[s] = z.station[s].soft[q];
    }
    soften_plane(p, z.share, q, flexibility, z.plane[q]);
    if (flexibility[0] + flexibility[1] == 0) continue;
    z.is_softened = true;
    if (!(z.share * p.stiffness[q == 0 ? 4 : 5] > 0)) return false;
  }
  find_crack_bounds(p, z);
  const double offset[6] = {z.axial, z.slip[0] - shifted[1], z.slip[1] + shifted[0], z.twist, turned[0], turned[1]};
  std::copy(offset, offset + 6, z.offset);
  return true;
}

/// Share of moments up to which a damaged station turns no further on its flexibility than it has.
double find_share_within(const ZoneParameters& p, const StationState& st, double rotation_ratio,
                         const double moment[2]) {
  double share = 1;
  for (const bool felt : {false, true}) {  // by itself and as its edges feel it
    const double most = felt ? st.strained : st.reached;
    double a = 0, b = 0, c = -most * most;  // a x² + 2 b x + c = 0
    for (int q = kernel::first_bending(p.plane); q <= kernel::last_bending(p.plane); ++q) {
      const double w = felt && q == 1 ? rotation_ratio : 1, soft = st.soft[q] - st.crack[q];
      const double at = w * std::abs(st.phi[q] - st.bow[q]), by = soft > 0 ? w * soft * moment[q] : 0;
      a += by * by, b += at * by, c += at * at;
    }
    if (a + 2 * b + c > 0) share = std::min(share, c < 0 && std::isfinite(a) ? -c / (b + std::sqrt(b * b - a * c)) : 0);
  }
  return share;
}

void find_safe_bounds(const ZoneParameters& p, const CompiledLaws& laws, const Limits& limits, double normal_force,
                      ZoneState& z) {
  const auto law_of = [&](int s) -> const CompiledLaw& {
    return laws[static_cast<size_t>(z.base_law < 0 ? p.law[s] : z.base_law)];
  };
  const int first = kernel::first_bending(p.plane), last = kernel::last_bending(p.plane);
  double reach = kUnlimited;
  for (int s = 0; s < p.stations; ++s) {
    for (const CompiledFamily& family : law_of(s).moment)
      if (family.K > 0) reach = std::min(reach, 0.06 * (family.force.back() - family.force.front()));
  }
  const double whole = limits.integrity(z.shortened);
  double from = normal_force - reach, to = normal_force + reach;
  if (!p.external_axial) {
    from = std::max(from, -limits.compression(most_strained(z), z.shortened, whole));
    to = std::min(to, limits.tension(z.elongated, z.shortened));
  }
  for (int s = 0; s < p.stations; ++s)
    if (z.station[s].reached >= law_of(s).rupture_rotation) to = std::min(to, -kTiny);  // held by what presses it
  z.safe_force[0] = 1, z.safe_force[1] = -1;
  if (whole != 1 || !(from <= to)) return;
  for (int q = first; q <= last; ++q) z.safe_moment[q] = kUnlimited;
  for (int s = 0; s < p.stations; ++s) {
    const CompiledLaw& law = law_of(s);
    const StationState& st = z.station[s];
    double least[2] = {0, 0};
    for (int q = first; q <= last; ++q)
      least[q] = find_least_moment(law.moment[q], from, to, st.strained, st.k[q], st.j[q]);
    const double share = is_damaged(st) ? find_share_within(p, st, law.rotation_ratio, least) : 1;
    for (int q = first; q <= last; ++q) z.safe_moment[q] = std::min(z.safe_moment[q], share > 0 ? share * least[q] : 0);
  }
  for (int q = first; q <= last; ++q) {
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
  if (!find_springs(p, z)) return;
  z.safe_force[0] = from;
  z.safe_force[1] = to;
}

double calc_bound_utilisation(const ZoneParameters& p, const ZoneState& z) {
  return calc_bound_utilisation(p, z, z.elastic_force);
}

double calc_bound_utilisation(const ZoneParameters& p, const ZoneState& z, const double f[6]) {
  if (p.stations == 0) return 0;
  const double vy = f[1] * z.safe_shear[0], vz = f[2] * z.safe_shear[1];
  double u = std::max(std::abs(f[3]) * z.safe_torsion, std::sqrt(vy * vy + vz * vz));
  for (int s = 0; s < p.stations; ++s) {
    const double my = std::abs(f[4] + p.x[s] * f[2]) * z.safe_moment[0];
    const double mz = std::abs(f[5] - p.x[s] * f[1]) * z.safe_moment[1];
    u = std::max(u, my + mz);
  }
  return u;
}

namespace {

/// The interval of the compression curve that a shortening is in, and what of the section is left along it.
///   may_flow  false: the full law is to see the first flow
void write_curve(const CompiledLaw& law, double shortened, bool may_flow, double* out, size_t stride) {
  using namespace kernel;
  const auto put = [&](int field, double x) { out[static_cast<size_t>(field) * stride] = x; };
  const CompiledCurve& curve = law.compression;
  double from = 0, limit = kMostLimit, slope = 0, far = kUnlimited;
  if (!curve.x.empty()) {
    const auto next = std::upper_bound(curve.x.begin(), curve.x.end(), shortened);
    const size_t i = static_cast<size_t>(std::max<std::ptrdiff_t>(next - curve.x.begin(), 1)) - 1;
    from = curve.x[i], limit = curve.f[i];
    if (next != curve.x.end()) {
      far = *next;
      slope = (curve.f[i + 1] - curve.f[i]) / (far - from);
    }
  }
  const bool has_peak = law.peak_compression > 0, is_whole = from < law.peak_shortening || !has_peak;
  put(kCurveFrom, from), put(kCurveForce, limit), put(kCurveSlope, slope);
  put(kCurveFar, may_flow && (has_peak || curve.x.empty()) ? far : shortened);
  put(kWhole, is_whole ? 1 : 0);
  put(kWholePerForce, is_whole ? 0 : 1 / law.peak_compression);
}

/// Compression limit over the rotation, from the interval of each family that it is in.
void write_capacity(const CompiledLaw& law, const ZoneState& z, double strained, double* out, size_t stride) {
  using namespace kernel;
  const auto put = [&](int field, double x) { out[static_cast<size_t>(field) * stride] = x; };
  put(kTurnedPart, law.elongates ? 0 : 1);
  put(kTurnedHinge, std::min(z.hinge_bears, kMostLimit));
  double far = kUnlimited;
  for (int q = 0; q < 2; ++q) {
    const CompiledFamily& family = law.moment[q];
    double from = 0, least = -kMostLimit, slope = 0;
    if (family.K > 0 && strained >= family.rotation.back()) {
      least = -family.capacity.back();
    } else if (family.K > 0) {
      const size_t j = static_cast<size_t>(find_interval(family.rotation, strained, z.station[0].j[q]));
      from = family.rotation[j];
      least = -family.capacity[j];
      slope = -(family.capacity[j + 1] - family.capacity[j]) / (family.rotation[j + 1] - from);
      far = std::min(far, family.rotation[j + 1]);
    }
    put(kTurnedFrom + q, from), put(kTurnedLeast + q, least), put(kTurnedSlope + q, slope);
  }
  put(kTurnedFar, far);
}

}  // namespace

bool write_flow_cells(const ZoneParameters& p, const CompiledLaws& laws, ZoneState& z, double axial, double shortened,
                      const double strained[2], double* out, size_t stride) {
  using namespace kernel;
  const auto law_of = [&](int s) -> const CompiledLaw& {
    return laws[static_cast<size_t>(z.base_law < 0 ? p.law[s] : z.base_law)];
  };
  // what is left of a crushed section carries both force and moment
  const double whole = calc_integrity(law_of(0), shortened);
  if (!(whole > 0)) return false;
  // while a section is crushed its force is on the edge, and beside it once part of the crushing is taken back
  constexpr double on_edge = 1.01;
  for (int s = 0; s < p.stations; ++s)
    for (const CompiledFamily& family : law_of(s).moment)
      if (family.K > 0 && !(axial >= on_edge * family.force.front() && axial < family.force.back())) return false;
  for (int s = 0; s < p.stations; ++s)
    for (int q = 0; q < 2; ++q) {
      const CompiledFamily& family = law_of(s).moment[q];
      if (family.K == 0) continue;
      StationState& st = z.station[s];
      double* cell = out + static_cast<size_t>(kStations + s * kStationFields + kCell + q * kCellFields) * stride;
      const auto put = [&](size_t field, double x) { cell[field * stride] = x; };
      // the interval that the force is in and the nearer one beside it
      const std::vector<double>& forces = family.force;
      st.k[q] = find_interval(forces, axial, st.k[q]);
      const size_t k = static_cast<size_t>(st.k[q]), last = forces.size() - 1;
      const bool is_low = axial - forces[k] < forces[k + 1] - axial;
      const size_t middle = (is_low && k > 0) || k + 1 == last ? k : k + 1;
      const size_t row[3] = {middle > 0 ? middle - 1 : middle, middle, std::min(middle + 1, last)};
      // no width: nothing but the full law beyond
      const double force[3] = {whole * forces[middle],
                               row[0] < middle ? 1 / (whole * (forces[middle] - forces[row[0]])) : kMostLimit,
                               row[2] > middle ? 1 / (whole * (forces[row[2]] - forces[middle])) : kMostLimit};
      size_t j[2] = {family.rotation.size() - 1, family.rotation.size() - 1};
      double lowest = strained[s], per_width = 0;
      if (strained[s] < family.rotation.back()) {
        st.j[q] = find_interval(family.rotation, strained[s], st.j[q]);
        j[0] = static_cast<size_t>(st.j[q]), j[1] = j[0] + 1;
        lowest = family.rotation[j[0]];
        per_width = 1 / (family.rotation[j[1]] - family.rotation[j[0]]);
      }
      const double rotation[2] = {lowest, per_width};
      const auto has = [&](size_t field, std::span<const double> x) {
        for (size_t i = 0; i < x.size(); ++i)
          if (cell[(field + i) * stride] != x[i]) return false;
        return true;
      };
      if (has(kCellForce, force) && has(kCellRotation, rotation)) continue;  // of another station, or the curve
      for (size_t i = 0; i < 3; ++i) put(kCellForce + i, force[i]);
      for (size_t i = 0; i < 2; ++i) put(kCellRotation + i, rotation[i]);
      for (size_t c = 0; c < 6; ++c) {
        const FamilyPoint& point = *family.at(row[c / 2], j[c % 2]);
        put(kCellPositive + c, whole * point.positive);
        put(kCellNegative + c, whole * point.negative);
      }
      for (size_t c = 0; c < 3 && family.lifts; ++c) {
        const FamilyPoint& point = *family.at(row[c], j[0]);
        put(kCellLiftPositive + c, point.lift_positive);
        put(kCellLiftNegative + c, point.lift_negative);
      }
    }
  out[kWrittenWhole * stride] = whole;
  write_curve(law_of(0), shortened, z.yielded, out, stride);
  write_capacity(law_of(0), z, std::max(strained[0], strained[1]), out, stride);
  return true;
}

bool write_flow(const ZoneParameters& p, const CompiledLaws& laws, ZoneState& z, double time, double* out) {
  using namespace kernel;
  if (!z.live || !z.has_elastic || z.next_law >= 0 || p.stations == 0 || p.external_axial) return false;
  const Limits limits(laws, p.law[0], z, time);
  std::fill(out, out + kFlowFields, 0.0);
  out[kAxial] = z.axial, out[kSlip] = z.slip[0], out[kSlip + 1] = z.slip[1], out[kTwist] = z.twist;
  bool is_pressed = false;  // only what presses it holds it together
  for (int s = 0; s < 2; ++s) {
    double* station = &out[kStations + s * kStationFields];
    station[kRupture] = kUnlimited;
    const CompiledLaw* law = nullptr;
    if (s < p.stations) {
      law = &laws[static_cast<size_t>(z.base_law < 0 ? p.law[s] : z.base_law)];
      if (law->biaxial_exponent != 1.5) return false;
      for (int q = 0; q < 2; ++q)
        station[kPhi + q] = z.station[s].phi[q], station[kSoftness + q] = z.station[s].soft[q],
                       station[kCracked + q] = z.station[s].crack[q], station[kBow + q] = z.station[s].bow[q];
      for (int q = 0; q < 2; ++q)
        for (int side : {0, 1}) station[kGrowth + 2 * q + side] = z.crack_scale[s][q][side];
      station[kReached] = z.station[s].reached;
      station[kStrained] = z.station[s].strained;
      station[kRotationRatio] = law->rotation_ratio;
      station[kShare] = law->damage_share;
      const bool is_far = z.station[s].reached >= law->rupture_rotation;
      is_pressed = is_pressed || is_far;
      station[kRupture] = is_far ? law->rupture_rotation_pressed : law->rupture_rotation;
    }
    for (int q = 0; q < 2; ++q) {
      double* cell = &station[kCell + q * kCellFields];
      if (law == nullptr || law->moment[q].K == 0)
        std::fill(cell + kCellPositive, cell + kCellLiftPositive, kMostLimit);
    }
  }
  const double strained[2] = {z.station[0].strained, z.station[1].strained};
  const double whole = limits.integrity(z.shortened);
  if (!write_flow_cells(p, laws, z, z.normal_force / whole, z.shortened, strained, out, 1)) return false;
  const CompiledLaw& law = limits.law();
  out[kLifted] = z.lifted, out[kShortened] = z.shortened, out[kCrushed] = z.crushed;
  out[kCrushLength] = calc_crush_length(p.crush_through, law);
  out[kBuckles] = law.buckles ? 1 : 0;
  // what pulls once it is straight is for the full law
  out[kFlowMost] = is_pressed ? -kTiny : law.buckles ? 0 : limits.tension(z.elongated, z.shortened);
  for (int axis = 0; axis < 2; ++axis)
    out[kShearOwn + axis] = law.slip_softening > 0 ? std::min(law.shear[axis], kMostLimit) : 0;
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

double calc_utilisation(const ZoneParameters& p, const CompiledLaws& laws, double time, const ZoneState& z) {
  if (!z.live || p.stations == 0) return 0;
  const Limits limits(laws, p.law[0], z, time);
  const auto ratio = [](double demand, double capacity) {
    if (capacity == kUnlimited) return 0.0;
    return capacity > 0 ? demand / capacity : (demand > 0 ? 1.0 : 0.0);
  };
  double force[6];
  for (int i = 0; i < 6; ++i) force[i] = z.elastic_force[i];
  force[0] = z.normal_force;
  const double integrity = limits.integrity(z.shortened);
  double u = p.external_axial ? 0.0
             : force[0] < 0   ? ratio(-force[0], limits.compression(most_strained(z), z.shortened, integrity))
                              : ratio(force[0], limits.tension(z.elongated, z.shortened));
  for (int s = 0; s < p.stations; ++s) {
    const Limits station_limits(laws, p.law[s], z, time);
    StationState st = z.station[s];
    const double axial = integrity > 0 ? force[0] / integrity : 0;
    const auto bends = [&](int q, double m) {
      if (m == 0) return 0.0;
      const MomentLimit most = station_limits.moment(q, axial, st);
      return ratio(std::abs(m), integrity * (m >= 0 ? most.positive : most.negative));
    };
    const double ry = bends(0, force[4] + p.x[s] * force[2]), rz = bends(1, force[5] - p.x[s] * force[1]);
    const double e = station_limits.law().biaxial_exponent;
    u = std::max(u, ry == 0 ? rz : rz == 0 ? ry : root_of(raised(ry, e) + raised(rz, e), e));
  }
  const double vy = ratio(std::abs(force[1]), limits.shear(0, z.slipped, -force[0]));
  const double vz = ratio(std::abs(force[2]), limits.shear(1, z.slipped, -force[0]));
  u = std::max(u, std::sqrt(vy * vy + vz * vz));
  return std::max(u, ratio(std::abs(force[3]), limits.torsion()));
}

bool is_softening(const ZoneParameters& p, const CompiledLaws& laws, double time, const ZoneState& z) {
  if (!z.live || p.stations == 0 || (z.shortened == 0 && most_strained(z).strained == 0)) return false;
  const Limits limits(laws, p.law[0], z, time);
  const double integrity = limits.integrity(z.shortened);
  if (integrity < 0.95) return true;
  const double axial = z.normal_force / integrity;
  for (int s = 0; s < p.stations; ++s)
    for (int q = 0; q < 2; ++q) {
      const Limits station_limits(laws, p.law[s], z, time);
      StationState now = z.station[s], fresh;
      if (now.strained == 0) continue;
      std::copy(now.k, now.k + 2, fresh.k);  // where to look first
      const MomentLimit a = station_limits.moment(q, axial, now), b = station_limits.moment(q, axial, fresh);
      if (b.positive != kUnlimited && a.positive + a.negative < 0.85 * (b.positive + b.negative)) return true;
    }
  return false;
}

}  // namespace topple::mbs
