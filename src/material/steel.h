#pragma once
/// Reinforcing steel at one point, uniaxial: elastic-plastic with linear kinematic hardening, rupture, and buckling of
/// bars in compression; docs/theory/material.md. Strains and stresses are positive in tension.

namespace topple::material {

/// A bar and what holds it sideways. Magnitudes.
struct SteelInput {
  double fy = 0, fu = 0;   // yield stress, tensile strength           [Pa]
  double Es = 0;           // modulus                                  [Pa]
  double eps_u = 0;        // strain at rupture                        [-]
  double diameter = 0;     // of the bar; 0: does not buckle           [m]
  double free_length = 0;  // between ties; 0: does not buckle         [m]
};

/// Constant parameters, made once by make_steel.
struct Steel {
  double Es = 0, fy = 0, fu = 0, eps_y = 0, eps_u = 0;
  double hardening = 0;        // slope from (ε_y, f_y) to (ε_u, f_u) [Pa]
  double buckling_stress = 0;  // cap of the compressive stress, Euler and Johnson; infinite if held [Pa]
  double eps_star = 0;         // compressive strain from which buckling is seen; infinite if held
  double stress_star = 0;      // stress there
  double slope_star = 0;       // from (ε_y, f_y) to (ε*, σ*); the hardening where bars are held [Pa]
  double eps_residual = 0;     // strain from which the residual is left
  double residual = 0;         // stress left when buckled, 0.2 f_y at most [Pa]
};

/// Throws InputError: values out of range.
Steel make_steel(const SteelInput&);

/// Euler's stress, or Johnson's parabola for stocky bars, of a round bar over its buckling length [Pa].
double calc_buckling_stress(double fy, double Es, double diameter, double buckling_length);

struct SteelResponse {
  double stress = 0, tangent = 0;
};

/// Largest compressive stress at a strain, a magnitude, and its growth with the shortening: the strength, Euler and
/// Johnson, then Dhakal & Maekawa.
inline SteelResponse calc_compression_limit(const Steel& s, double eps) {
  const double e = -eps, most = s.fu < s.buckling_stress ? s.fu : s.buckling_stress;
  if (!(e > s.eps_y)) return {most, 0};
  // linear to (ε*, σ*), then down to the residual
  SteelResponse limit{s.residual, 0};
  if (e <= s.eps_star)
    limit = {s.fy + s.slope_star * (e - s.eps_y), s.slope_star};
  else if (e < s.eps_residual)
    limit = {s.stress_star - 0.02 * s.Es * (e - s.eps_star), -0.02 * s.Es};
  return limit.stress < most ? limit : SteelResponse{most, 0};
}

/// Envelope of monotonic loading: no history.
inline SteelResponse calc_envelope(const Steel& s, double eps) {
  if (eps > s.eps_u) return {0, 0};
  const double e = eps < 0 ? -eps : eps;
  SteelResponse out{s.Es * e, s.Es};
  if (e > s.eps_y) out = {s.fy + s.hardening * (e - s.eps_y), s.hardening};
  if (eps >= 0) return out;
  const SteelResponse limit = calc_compression_limit(s, eps);
  if (limit.stress < out.stress) out = limit;
  return {-out.stress, out.tangent};
}

/// History of one bar.
struct SteelState {
  double plastic = 0;  // plastic strain
  double back = 0;     // centre of the elastic range (kinematic hardening) [Pa]
  bool ruptured = false;
};

/// Stress at a strain that is reached on a straight way from a history. Of a bar never loaded: calc_envelope.
inline SteelResponse calc_response(const Steel& s, const SteelState& state, double eps) {
  if (state.ruptured || eps > s.eps_u) return {0, 0};
  double stress = s.Es * (eps - state.plastic), tangent = s.Es;
  const double trial = stress - state.back, excess = (trial < 0 ? -trial : trial) - s.fy;
  if (excess > 0) {
    const double limit = s.fy + s.hardening / s.Es * excess;
    stress = state.back + (trial > 0 ? limit : -limit), tangent = s.hardening;
  }
  if (stress >= 0) return {stress, tangent};
  const SteelResponse limit = calc_compression_limit(s, eps);
  return -stress > limit.stress ? SteelResponse{-limit.stress, limit.tangent} : SteelResponse{stress, tangent};
}

/// The same; the state moves on.
SteelResponse advance(const Steel&, SteelState&, double eps);

}  // namespace topple::material
