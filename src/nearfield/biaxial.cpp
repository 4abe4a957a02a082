#include "nearfield/biaxial.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "nearfield/family.h"
#include "nearfield/fibres.h"
#include "nearfield/moment_curve.h"
#include "nearfield/zone.h"

namespace topple::nearfield {

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr double kShares[] = {0.6, 0.4, 0.2, 0.0};  // forces of the exponent, over that of crushing

/// Factor by which (y, z) lies outside of the curve of exponent p.
double calc_excess(const BiaxialPoint& q, double p) {
  const double most = std::max(q.y, q.z);
  return most * std::pow(std::pow(q.y / most, p) + std::pow(q.z / most, p), 1 / p);
}

double calc_mean_excess(const std::vector<BiaxialPoint>& points, double p) {
  double sum = 0;
  for (const BiaxialPoint& q : points) sum += calc_excess(q, p);
  return sum / static_cast<double>(points.size());
}

/// Largest moment about an axis, and the moment across it there.
struct ObliquePeak {
  double along = 0, across = 0;
};
ObliquePeak find_oblique_peak(const ZoneInput& in, double angle, double N) {
  const Fibres f = make_fibres(in, angle);
  std::vector<double> kappa = make_rotations(in, 2 * f.half_depth, f.cover);
  for (double& k : kappa) k /= in.length;
  const March m = march_curvature(f, N, 1, kappa);
  const auto peak = std::max_element(m.moment.begin(), m.moment.end());
  const auto j = static_cast<size_t>(peak - m.moment.begin());
  if (j >= m.eps_0.size() || !(*peak > 0)) return {};
  return {*peak, calc_cross_moment(f, m.eps_0[j], m.origin + kappa[j], m.bars_at(j))};
}

double choose_exponent(const std::vector<BiaxialPoint>& points) {
  return points.empty() ? 1.5 : fit_biaxial(points).exponent;
}

BiaxialPoint make_point(double angle, double N, const ObliquePeak& peak, double peak_y, double peak_z) {
  const double c = std::cos(angle), s = std::sin(angle);
  // shares of what each axis resists alone; a moment of the other sign counts as none
  return {angle, N, std::max(0.0, peak.along * c - peak.across * s) / peak_y,
          std::max(0.0, peak.along * s + peak.across * c) / peak_z};
}

struct Moments {
  double y = 0, z = 0;
  bool exist = false;
};

/// The largest moment about the axis at `angle` on a refined grid, as moments about y and z.
Moments find_moments(const ZoneInput& in, double angle, double N) {
  const Fibres f = make_fibres(in, angle);
  constexpr int parts = 4;  // as the report's curves
  MomentFamily grid;
  grid.rotation = make_rotations(in, 2 * f.half_depth, f.cover);
  const MomentCurve curve = make_moment_curve(f, Axis::Y, N, 1, in.length, refine_rotations(grid, parts));
  const CurvePoint peak = find_points(curve).peak;
  if (!(peak.moment > 0)) return {};
  size_t j = static_cast<size_t>(std::upper_bound(curve.rotation.begin(), curve.rotation.end(), peak.rotation) -
                                 curve.rotation.begin());
  j = j > 0 ? j - 1 : 0;
  double eps_0 = curve.eps_0[j], kappa = curve.kappa[j] + (peak.rotation - curve.rotation[j]) / in.length;
  if (peak.rotation > curve.rotation[j]) find_equilibrium(f, N, kappa, eps_0, curve.bars[j]);
  const double across = calc_cross_moment(f, eps_0, kappa, curve.bars[j]);
  const double c = std::cos(angle), s = std::sin(angle);
  return {peak.moment * c - across * s, peak.moment * s + across * c, true};
}

double to_angle(const ZoneInput& in, double skew) {
  return std::atan2(in.section.height * std::sin(skew), in.section.width * std::cos(skew));
}

struct End {
  double skew = 0, moment = 0;
  bool exists = false;
};

/// Where the moment across the wanted one vanishes, next to a skew. `across` falls from + to - as `outwards` says.
template <typename Wanted, typename Across>
End find_end(const ZoneInput& in, double N, double from, int outwards, Wanted wanted, Across across) {
  constexpr double step = pi / 24;
  Moments here = find_moments(in, to_angle(in, from), N);
  if (!here.exist) return {};
  constexpr double none = 1e-9;  // round-off of a symmetric section
  if (std::abs(across(here)) <= none * std::abs(wanted(here))) return {from, wanted(here), true};
  const int way = across(here) > 0 ? outwards : -outwards;
  double skew = from;
  Moments before = here;
  for (int i = 0;; ++i) {
    if (i == 12) return {};
    before = here, skew += way * step;
    here = find_moments(in, to_angle(in, skew), N);
    if (!here.exist) return {};
    if (across(here) * across(before) <= 0) break;
  }
  double low = skew - way * step, high = skew;
  for (int i = 0; i < 24; ++i) {
    const double middle = 0.5 * (low + high);
    const Moments m = find_moments(in, to_angle(in, middle), N);
    if (!m.exist) return {};
    if (across(m) * across(before) > 0)
      low = middle, before = m;
    else
      high = middle, here = m;
  }
  // the grid of rotations leaves a leap: on its chord
  const double s = across(before) / (across(before) - across(here));
  const double moment = wanted(before) + s * (wanted(here) - wanted(before));
  return {0.5 * (low + high), moment, moment > 0};
}

}  // namespace

BiaxialLine make_biaxial_line(const ZoneInput& in, double N, int steps) {
  check_zone(in);
  const auto y = [](const Moments& m) { return m.y; };
  const auto z = [](const Moments& m) { return m.z; };
  BiaxialLine out;
  const End first = find_end(in, N, 0, -1, y, z);
  if (!first.exists) return out;
  const End last = find_end(in, N, 0.5 * pi, 1, z, y);
  out.ends_at_z = last.exists && last.skew > first.skew;
  out.y.push_back(first.moment), out.z.push_back(0);
  const double whole = out.ends_at_z ? last.skew - first.skew : pi;
  for (int i = 1; out.ends_at_z ? i < steps : i <= 2 * steps; ++i) {
    const double skew = first.skew + whole * i / (out.ends_at_z ? steps : 2 * steps);
    const Moments m = find_moments(in, to_angle(in, skew), N);
    if (!m.exist || m.y < 0 || m.z < 0) {
      if (out.ends_at_z) continue;
      break;
    }
    out.y.push_back(m.y), out.z.push_back(m.z);
    if (out.ends_at_z) out.inside.push_back({to_angle(in, skew), N, m.y / first.moment, m.z / last.moment});
  }
  if (out.ends_at_z) out.y.push_back(0), out.z.push_back(last.moment);
  return out;
}

CrossedPeak find_crossed_peak(const ZoneInput& in, Axis axis, int direction, double N) {
  const double angle = (axis == Axis::Y ? 0 : 0.5 * pi) + (direction > 0 ? 0 : pi);
  const Moments m = find_moments(in, angle, N);
  if (!m.exist) return {};
  return axis == Axis::Y ? CrossedPeak{m.y, m.z} : CrossedPeak{m.z, m.y};
}

MomentFamily make_oblique_family(const ZoneInput& in, double angle) {
  check_zone(in);
  const Fibres f = make_fibres(in, angle);
  double area = 0;
  for (size_t i = 0; i < f.at.size(); ++i) area += f.core_area[i] + f.cover_area[i];
  const double crushing = find_crushing(f).force;
  return make_family(f, 1, make_forces(crushing, calc_rupture_force(in, area, f.cover, crushing)),
                     make_rotations(in, 2 * f.half_depth, f.cover), in.length);
}

std::vector<BiaxialPoint> calc_biaxial_points(const ZoneInput& in, const std::vector<double>& skew,
                                              const std::vector<double>& compression) {
  check_zone(in);
  const double crushing = find_crushing(make_fibres(in, 0.0)).force;
  std::vector<BiaxialPoint> out;
  for (const double share : compression) {
    const double N = -share * crushing;
    const double peak_y = find_oblique_peak(in, 0, N).along, peak_z = find_oblique_peak(in, 0.5 * pi, N).along;
    if (!(peak_y > 0) || !(peak_z > 0)) continue;
    for (const double beta : skew) {
      const double angle = std::atan2(in.section.height * std::sin(beta), in.section.width * std::cos(beta));
      const ObliquePeak peak = find_oblique_peak(in, angle, N);
      if (peak.along > 0) out.push_back(make_point(angle, N, peak, peak_y, peak_z));
    }
  }
  return out;
}

double calc_biaxial_exponent(const ZoneInput& in, const Rcc& rcc) {
  const MomentFamily &y = rcc.y_pos, &z = rcc.z_pos;
  const auto find_peak = [](const MomentFamily& f, size_t k) {
    const auto row = f.moment.begin() + static_cast<std::ptrdiff_t>(k * f.rotation.size());
    return *std::max_element(row, row + static_cast<std::ptrdiff_t>(f.rotation.size()));
  };
  const double angle = std::atan2(in.section.height, in.section.width);
  std::vector<BiaxialPoint> points;
  for (const double share : kShares) {
    size_t k = 0;
    while (k + 1 < y.normal_force.size() && y.normal_force[k] < share * y.normal_force.front() * (1 + 1e-9)) ++k;
    const double peak_y = find_peak(y, k), peak_z = find_peak(z, k);
    if (!(peak_y > 0) || !(peak_z > 0)) continue;
    const ObliquePeak peak = find_oblique_peak(in, angle, y.normal_force[k]);
    if (peak.along > 0) points.push_back(make_point(angle, y.normal_force[k], peak, peak_y, peak_z));
  }
  return choose_exponent(points);
}

double calc_biaxial_exponent(const ZoneInput& in) {
  return choose_exponent(calc_biaxial_points(in, {0.25 * pi}, {std::begin(kShares), std::end(kShares)}));
}

BiaxialFit fit_biaxial(const std::vector<BiaxialPoint>& points) {
  BiaxialFit out;
  if (points.empty()) return out;
  double low = 1, high = 4;
  for (int i = 0; i < 60; ++i) {
    const double p = 0.5 * (low + high);
    (calc_mean_excess(points, p) > 1 ? low : high) = p;
  }
  out.exponent = 0.5 * (low + high);
  out.least = out.greatest = calc_excess(points[0], out.exponent);
  for (const BiaxialPoint& q : points) {
    const double e = calc_excess(q, out.exponent);
    out.least = std::min(out.least, e), out.greatest = std::max(out.greatest, e);
  }
  return out;
}

}  // namespace topple::nearfield
