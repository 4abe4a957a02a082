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

/// Envelope of monotonic loading: no history.
inline SteelResponse calc_envelope(const Steel& s, double eps) {
  if (eps >= 0) {
    if (eps <= s.eps_y) return {s.Es * eps, s.Es};
    if (eps > s.eps_u) return {0, 0};
    return {s.fy + s.hardening * (eps - s.eps_y), s.hardening};
  }
  const double e = -eps;
  double stress = s.Es * e, tangent = s.Es;
  if (e > s.eps_y) stress = s.fy + s.hardening * (e - s.eps_y), tangent = s.hardening;
  if (stress > s.fu) stress = s.fu, tangent = 0;
  if (stress > s.buckling_stress) stress = s.buckling_stress, tangent = 0;
  if (e > s.eps_y) {
    // Dhakal & Maekawa: linear to (ε*, σ*), then down to the residual.
    double limit, slope;
    if (e <= s.eps_star) {
      slope = s.slope_star;
      limit = s.fy + slope * (e - s.eps_y);
    } else if (e < s.eps_residual) {
      slope = -0.02 * s.Es;
      limit = s.stress_star + slope * (e - s.eps_star);
    } else {
      slope = 0;
      limit = s.residual;
    }
    if (limit < stress) stress = limit, tangent = slope;
  }
  return {-stress, tangent};
}

/// History of one bar.
struct SteelState {
  double plastic = 0;  // plastic strain
  double back = 0;     // centre of the elastic range (kinematic hardening) [Pa]
  bool ruptured = false;
};

/// Stress at a strain after a history; the state moves on.
SteelResponse advance(const Steel&, SteelState&, double eps);

}  // namespace topple::material
