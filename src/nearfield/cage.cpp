#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "material/steel.h"
#include "nearfield/rcc.h"
#include "nearfield/zone.h"

namespace topple::nearfield {

namespace {

/// Plastic moment of a round bar [N·m].
double calc_plastic_moment(double fy, double diameter) { return fy * diameter * diameter * diameter / 6; }

/// Moment of bars of which each gives between -compression and +tension, at no normal force: the linear programme
/// max Σ F z with Σ F = 0, solved by filling from the outside; docs/theory/rcc.md (20).
struct BarForce {
  double at = 0, tension = 0, compression = 0;
};
double calc_couple(std::vector<BarForce> bars, bool reversed) {
  for (BarForce& bar : bars)
    if (reversed) bar.at = -bar.at;
  std::sort(bars.begin(), bars.end(), [](const BarForce& a, const BarForce& b) { return a.at < b.at; });
  // All in compression, then bars turn to tension from the far side until the forces balance.
  double force = 0, moment = 0;
  for (const BarForce& bar : bars) force -= bar.compression, moment -= bar.compression * bar.at;
  for (auto bar = bars.rbegin(); bar != bars.rend() && force < 0; ++bar) {
    const double turned = std::min(bar->tension + bar->compression, -force);
    force += turned, moment += turned * bar->at;
  }
  return moment;
}

}  // namespace

ResidualCage make_residual_cage(const ZoneInput& in, double destroyed_length, double residual_bars) {
  check_zone(in);
  if (!(destroyed_length > 0) || !std::isfinite(destroyed_length))
    throw InputError("E613", "the destroyed length of a charge must be positive");
  if (!(residual_bars >= 0 && residual_bars <= 1))
    throw InputError("E613", "the share of residual bars must lie between 0 and 1");
  const double h = destroyed_length, share = residual_bars * (1 - in.cut_bars), fy = in.steel.fy;
  ResidualCage out;
  std::vector<BarForce> about_y, about_z;
  double yield = 0, rupture = 0, buckling = 0, mechanism = 0;
  for (const product::Bar& bar : in.section.bars) {
    const double A = share * bar.area;
    const double P = A * material::calc_buckling_stress(fy, in.steel.Es, bar.diameter, h);
    // Plastic moment scaled with the bar's area, should area and diameter not be a round bar's.
    const double round = 0.25 * 3.14159265358979323846 * bar.diameter * bar.diameter;
    const double Mp = A / round * calc_plastic_moment(fy, bar.diameter);
    yield += A * fy, rupture += A * in.steel.fu, buckling += P, mechanism += 4 * Mp / h;
    out.shear += 2 * Mp / h;
    out.EA += A * in.steel.Es;
    about_y.push_back({bar.z, A * fy, P});
    about_z.push_back({bar.y, A * fy, P});
  }
  out.moment_y = std::min(calc_couple(about_y, false), calc_couple(about_y, true));
  out.moment_z = std::min(calc_couple(about_z, false), calc_couple(about_z, true));

  // Buckled bars as mechanisms of three plastic hinges: P = 4 M_p / (h sin θ), shortening h (1 - cos θ).
  const auto buckled = [&](double u) {
    const double cosine = std::max(0.0, 1 - u / h);
    return std::min(buckling, mechanism / std::sqrt(std::max(1e-12, 1 - cosine * cosine)));
  };
  constexpr int points = 20;
  for (int i = 0; i <= points; ++i) {
    const double s = static_cast<double>(i) / points, u = h * s * s * s;
    out.compression.displacement.push_back(u);
    out.compression.force.push_back(i == 0 ? buckling : buckled(u));
  }
  const double broken = h * std::max(1e-4, in.steel.eps_u - in.steel.fu / in.steel.Es);
  out.tension.displacement = {0, broken, 1.001 * broken};
  out.tension.force = {yield, rupture, 0};
  return out;
}

}  // namespace topple::nearfield
