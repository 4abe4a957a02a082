#include "material/steel.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/error.h"
#include "base/unit.h"

namespace topple::material {

namespace {
constexpr double infinity = std::numeric_limits<double>::infinity();
}

double calc_buckling_stress(double fy, double Es, double diameter, double buckling_length) {
  constexpr double pi = 3.14159265358979323846;
  const double slenderness = buckling_length / (diameter / 4);
  const double euler = pi * pi * Es / (slenderness * slenderness);
  // Johnson's parabola touches Euler's hyperbola at half the yield stress.
  return euler >= fy / 2 ? fy * (1 - fy / (4 * euler)) : euler;
}

Steel make_steel(const SteelInput& in) {
  const auto positive = [](double v) { return v > 0 && std::isfinite(v); };
  if (!positive(in.fy) || !positive(in.Es) || !positive(in.fu) || !positive(in.eps_u))
    throw InputError("E605", "steel: fy, fu, Es and eps_u must be positive");
  if (in.fu < in.fy) throw InputError("E605", "steel: fu lies below fy", "fu is the tensile strength, at least fy");
  if (in.eps_u <= in.fy / in.Es) throw InputError("E605", "steel: eps_u lies below the yield strain fy / Es");
  if (!(in.diameter >= 0) || !(in.free_length >= 0))
    throw InputError("E605", "steel: diameter and free length must not be negative");
  Steel s;
  s.Es = in.Es, s.fy = in.fy, s.fu = in.fu, s.eps_y = in.fy / in.Es, s.eps_u = in.eps_u;
  s.hardening = (in.fu - in.fy) / (in.eps_u - s.eps_y);
  s.buckling_stress = s.eps_star = s.eps_residual = infinity;
  s.stress_star = s.fy;
  s.slope_star = s.hardening;
  if (in.diameter <= 0 || in.free_length <= 0) return s;
  const double slenderness = in.free_length / in.diameter;
  if (slenderness <= 5) return s;
  // Ties hold the bar on both sides: it is clamped there, half the free length buckles.
  s.buckling_stress = calc_buckling_stress(in.fy, in.Es, in.diameter, 0.5 * in.free_length);
  if (s.buckling_stress >= 0.95 * in.fy) s.buckling_stress = infinity;  // squashes first; Dhakal & Maekawa from there
  const double scaled = std::sqrt(in.fy / (100 * unit::MPa)) * slenderness;
  s.eps_star = std::max(7.0, 55 - 2.3 * scaled) * s.eps_y;
  s.residual = std::min(0.2 * in.fy, s.buckling_stress);
  const double unbuckled = in.fy + s.hardening * (s.eps_star - s.eps_y);
  s.stress_star = std::max(s.residual, std::min({unbuckled, s.fu, s.buckling_stress}) * (1.1 - 0.016 * scaled));
  s.slope_star = (s.stress_star - s.fy) / (s.eps_star - s.eps_y);
  s.eps_residual = s.eps_star + (s.stress_star - s.residual) / (0.02 * in.Es);
  return s;
}

SteelResponse advance(const Steel& s, SteelState& state, double eps) {
  const SteelResponse out = calc_response(s, state, eps);
  if (state.ruptured || eps > s.eps_u) {
    state.ruptured = true;
    return out;
  }
  // Flow of linear kinematic hardening; what buckling takes from the stress becomes plastic strain too.
  const double H = s.hardening * s.Es / (s.Es - s.hardening);
  const double elastic = s.Es * (eps - state.plastic), trial = elastic - state.back, excess = std::abs(trial) - s.fy;
  if (excess > 0) state.back += (trial > 0 ? 1 : -1) * H * excess / (s.Es + H);
  if (out.stress != elastic) state.plastic = eps - out.stress / s.Es;
  return out;
}

}  // namespace topple::material
