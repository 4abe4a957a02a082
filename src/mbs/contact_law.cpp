#include "mbs/contact_law.h"

#include <algorithm>
#include <cmath>

namespace topple::mbs {

namespace {

// The stronger the dashpot, the less restitution depends on how many points share an impact and on friction, and the
// more of the damping of small motions is left to the step.
constexpr double kLeastZeta = 10, kZetaByRestitution = 0.5, kMostZeta = 1000;

/// ∫ s / (s² + 2 ζ s + κ) ds between -a and a.
double integrate_ratio(double a, double zeta, double kappa) {
  const auto value = [&](double s) { return (s + 2 * zeta) * s + kappa; };
  const double part = 0.5 * std::log(value(a) / value(-a));
  const double root2 = zeta * zeta - kappa;
  double time;  // ∫ ds / (s² + 2 ζ s + κ)
  if (root2 > 0) {
    const double root = std::sqrt(root2);
    // of the roots of the quadratic, the one near 0 without cancellation
    const double far = -zeta - root, near = kappa / far;
    time = (std::log((a - near) / (-a - near)) - std::log((a - far) / (-a - far))) / (2 * root);
  } else if (root2 < 0) {
    const double root = std::sqrt(-root2);
    time = (std::atan((a + zeta) / root) - std::atan((-a + zeta) / root)) / root;
  } else {
    time = 1 / (zeta - a) - 1 / (zeta + a);
  }
  return part - zeta * time;
}

}  // namespace

double calc_restitution(double lower, double zeta) {
  // with x the depth, ω the frequency of the full rate and s = x' / (ω x): full rate from s = ∞ to a, mean rate and
  // dashpot to -a, lower rate from there
  const double a = (1 - lower) / (4 * zeta), kappa = (1 + lower) / 2;
  const double depth = std::exp(integrate_ratio(a, zeta, kappa)) / std::sqrt(1 + a * a);
  return depth * std::sqrt(a * a + lower);
}

ContactLaw make_contact_law(double restitution, double friction) {
  ContactLaw law;
  law.friction = friction;
  if (restitution >= 1) return law;
  law.zeta = std::clamp(restitution > 0 ? kZetaByRestitution / restitution : kMostZeta, kLeastZeta, kMostZeta);
  double low = 0, high = 1;
  if (calc_restitution(0, law.zeta) < restitution)
    for (int i = 0; i < 60; ++i) {
      const double middle = 0.5 * (low + high);
      (calc_restitution(middle, law.zeta) < restitution ? low : high) = middle;
    }
  law.mean = (1 + low) / 2;
  law.band = law.most = (1 - low) / 2;
  return law;
}

ContactLaw make_contact_law(const Contact::Pair& p) {
  ContactLaw law = make_contact_law(p.restitution, p.friction);
  if (p.damping >= 0) {
    law.mean = law.band = 1;
    law.most = kUnlimited;
    law.zeta = 0;
    law.damping = p.damping;
  }
  law.stiffness = p.stiffness;
  law.touches = p.touches;
  return law;
}

}  // namespace topple::mbs
