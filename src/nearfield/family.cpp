#include "nearfield/family.h"

#include <algorithm>
#include <cmath>

namespace topple::nearfield {

std::vector<double> make_rotations(const ZoneInput& in, double depth, const material::Concrete& concrete) {
  const double per_strain = in.length / depth;
  const double eps_y = in.steel.fy / in.steel.Es;
  const double yield = 1.7 * eps_y * per_strain, crack = 2 * concrete.eps_ct * per_strain;
  const double first = crack > 0 ? std::min(0.5 * crack, 0.1 * yield) : 0.05 * yield;
  return make_rotations(first, yield, std::min(1.0, std::max(5 * in.steel.eps_u * per_strain, 12 * yield)));
}

std::vector<double> make_rotations(double first, double yield, double last) {
  std::vector<double> out{0};
  const auto extend = [&](double from, double to, double ratio) {
    if (to <= from) return;
    const int n = std::max(1, static_cast<int>(std::ceil(std::log(to / from) / std::log(ratio))));
    for (int i = 1; i <= n; ++i) out.push_back(from * std::pow(to / from, static_cast<double>(i) / n));
  };
  out.push_back(first);
  extend(first, 0.4 * yield, 1.4);
  extend(out.back(), 6 * yield, 1.15);
  extend(out.back(), last, 1.18);
  return out;
}

std::vector<double> make_forces(double crushing, double rupture) {
  // closest where members of buildings are: beams near 0, columns up to a half of crushing
  std::vector<double> out;
  for (double share :
       {1.0, 0.97, 0.9, 0.8, 0.7, 0.6, 0.5, 0.45, 0.4, 0.35, 0.3, 0.25, 0.2, 0.15, 0.1, 0.075, 0.05, 0.025})
    out.push_back(-share * crushing);
  for (double share : {0.0, 0.1, 0.25, 0.5, 0.75, 1.0}) out.push_back(share * rupture);
  return out;
}

double calc_rupture_force(const ZoneInput& in, double concrete_area, const material::Concrete& concrete,
                          double crushing) {
  const double in_flange = in.flange.bar_area() * in.flange.steel.fu;
  const double bars = (1 - in.cut_bars) * (in.section.steel_area() * in.steel.fu + in_flange);
  return std::max({bars, concrete_area * concrete.fct, 1e-6 * crushing});
}

MomentFamily make_family(const Fibres& fibres, int direction, const std::vector<double>& force,
                         const std::vector<double>& rotation, double length) {
  const size_t K = force.size();
  std::vector<double> kappa(rotation);
  for (double& k : kappa) k /= length;
  std::vector<March> marches;
  marches.reserve(K);
  int last = 1;
  for (size_t k = 0; k < K; ++k) {
    if (k == 0 || k + 1 == K) {
      marches.emplace_back();
      marches.back().moment.assign(kappa.size(), 0.0);
    } else {
      marches.push_back(march_curvature(fibres, force[k], direction, kappa));
    }
    last = std::max(last, marches.back().last);
  }
  // The last column is zero: broken.
  const size_t J = std::min(kappa.size(), static_cast<size_t>(last) + 2);
  MomentFamily out;
  out.normal_force = force;
  out.rotation.assign(rotation.begin(), rotation.begin() + static_cast<std::ptrdiff_t>(J));
  out.moment.reserve(K * J);
  for (const March& march : marches) {
    out.moment.insert(out.moment.end(), march.moment.begin(), march.moment.begin() + static_cast<std::ptrdiff_t>(J));
    out.moment.back() = 0;
    out.yield_rotation.push_back(march.yield_kappa * length);
    out.yield_moment.push_back(march.yield_moment);
  }
  out.elongation.reserve(K * J);
  for (const March& march : marches) {
    double slope = 0;
    for (size_t j = 0; j < J; ++j) {
      if (j == 0 || march.eps_0.empty()) {
        out.elongation.push_back(0);
        continue;
      }
      const double step = out.rotation[j] - out.rotation[j - 1];
      if (j < march.eps_0.size()) slope = (march.eps_0[j] - march.eps_0[j - 1]) * length / step;
      out.elongation.push_back(out.elongation.back() + slope * step);
    }
  }
  // Rows without moment borrow the rotation of the nearest row that has one.
  for (size_t k = 0; k < K; ++k) {
    if (out.yield_rotation[k] > 0) continue;
    for (size_t d = 1; d < K && !(out.yield_rotation[k] > 0); ++d) {
      if (k + d < K && marches[k + d].yield_kappa > 0)
        out.yield_rotation[k] = marches[k + d].yield_kappa * length;
      else if (k >= d && marches[k - d].yield_kappa > 0)
        out.yield_rotation[k] = marches[k - d].yield_kappa * length;
    }
    if (!(out.yield_rotation[k] > 0)) out.yield_rotation[k] = rotation[1];
  }
  return out;
}

double interpolate_EI(const MomentFamily& f, double N, double length) {
  const size_t K = f.normal_force.size();
  const auto EI = [&](size_t k) {
    // Rows without moment take the stiffness of the next row inside.
    size_t i = k;
    while (i + 1 < K && i < K / 2 && !(f.yield_moment[i] > 0)) ++i;
    while (i > 0 && i >= K / 2 && !(f.yield_moment[i] > 0)) --i;
    return f.yield_moment[i] / f.yield_rotation[i] * length;
  };
  if (N <= f.normal_force.front()) return EI(0);
  if (N >= f.normal_force.back()) return EI(K - 1);
  const size_t k =
      static_cast<size_t>(std::upper_bound(f.normal_force.begin(), f.normal_force.end(), N) - f.normal_force.begin());
  const double s = (N - f.normal_force[k - 1]) / (f.normal_force[k] - f.normal_force[k - 1]);
  return (1 - s) * EI(k - 1) + s * EI(k);
}

}  // namespace topple::nearfield
