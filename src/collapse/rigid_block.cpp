#include "collapse/rigid_block.h"

#include <algorithm>
#include <cmath>

namespace topple::collapse {

std::vector<double> calc_rigid_block(const RigidBlock& b, const std::vector<double>& time) {
  constexpr double lying = 1.57079632679489661923, longest_step = 1e-3;  // [rad], [s]
  std::vector<double> angle;
  double t = b.release, theta = 0, omega = 0;
  const auto acceleration = [&](double a) {
    return (b.mass * b.gravity * (b.ahead * std::cos(a) + b.above * std::sin(a)) - b.plastic_moment) / b.inertia;
  };
  const bool starts = acceleration(0) > 0;
  for (const double wanted : time) {
    if (wanted > t && starts && theta < lying) {
      const int steps = std::max(1, static_cast<int>(std::ceil((wanted - t) / longest_step)));
      const double h = (wanted - t) / steps;
      for (int i = 0; i < steps && theta < lying; ++i) {
        // classical Runge-Kutta
        const double k1 = acceleration(theta), k2 = acceleration(theta + 0.5 * h * omega);
        const double k3 = acceleration(theta + 0.5 * h * omega + 0.25 * h * h * k1);
        const double k4 = acceleration(theta + h * omega + 0.5 * h * h * k2);
        theta += h * omega + h * h / 6 * (k1 + k2 + k3);
        omega += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
      }
      theta = std::min(theta, lying);
    }
    if (wanted > t) t = wanted;
    angle.push_back(theta);
  }
  return angle;
}

}  // namespace topple::collapse
