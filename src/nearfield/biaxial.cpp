#include "nearfield/biaxial.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "nearfield/family.h"
#include "nearfield/fibres.h"
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
  return {angle, N, std::max(0.0, peak.along * c - peak.across * s) / peak_y,
          std::max(0.0, peak.along * s + peak.across * c) / peak_z};
}

}  // namespace

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
