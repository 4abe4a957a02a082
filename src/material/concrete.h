#pragma once
/// Concrete at one point, uniaxial: elastic-plastic with damage after Krätzig & Pölling; docs/theory/material.md.
/// Strains and stresses are positive in tension. The model is constant; the state is two numbers.

#include <cmath>

namespace topple::material {

/// What a concrete is made of. All magnitudes are positive.
struct ConcreteInput {
  double fc = 0;                 // compressive strength                                   [Pa]
  double fct = 0;                // tensile strength, 0: none                              [Pa]
  double Ec = 0;                 // modulus of elasticity                                  [Pa]
  double eps_c1 = 2.2e-3;        // strain at the peak                                     [-]
  double Gf = 0;                 // fracture energy in tension                             [J/m²]
  double Gcl = 15e3;             // crushing energy                                        [J/m²]
  double l_eq = 0;               // length over which softening localises                  [m]
  double b_c = 0.7;              // share of the inelastic strain that is plastic, compression
  double b_t = 0.1;              // the same in tension
  double limit_ratio = 1.0 / 3;  // y: linear up to y f_c
};

/// Constant parameters, made once by make_concrete.
struct Concrete {
  double Ec = 0, fc = 0, eps_c1 = 1, fct = 0;
  double b_c = 0, b_t = 0;
  double eps_linear = 0;            // end of the linear branch, y f_c / E_c
  double k = 2;                     // of the parabola-like branch, equation (3)
  double gamma = 0;                 // of the softening branch, equation (6)
  double eps_ct = 0;                // cracking strain
  double eps_tu = 0;                // crack strain at which the tensile stress has vanished, w_c / l_eq
  double inverse_fc = 0, tail = 0;  // 1 / f_c and γ / (2 ε_c1)
};

/// Throws InputError: a value out of range, or l_eq so long that softening would give back more than G_cl or G_f.
Concrete make_concrete(const ConcreteInput&);

/// Largest l_eq (excluded) for which the compressive and the tensile softening branches exist [m].
double calc_largest_l_eq(const ConcreteInput&);

/// Lateral stress of ties and what it does to the core, Eurocode 2, 3.1.9; equations (12) to (15).
struct Confinement {
  double stress = 0;  // σ2, effective [Pa]
};
/// The core's parameters at the length l_eq of the input; the crushing energy grows with the strain that ties allow.
ConcreteInput confine(ConcreteInput, const Confinement&);

/// Model Code 2010, 5.1.5.2: 73 f_cm^0.18 N/m. [J/m²]
double calc_fracture_energy(double fcm);
/// Model Code 2010, 5.1.7.2: 21500 α_E (f_cm / 10 MPa)^(1/3) MPa. [Pa]
double calc_initial_modulus(double fcm, double alpha_E = 1);
/// Modulus at the foot of the second branch extended to zero strain, k f_c / ε_c1: the table's E_ci. [Pa]
double calc_parabola_modulus(const Concrete&);

struct Response {
  double stress = 0;   // [Pa]
  double tangent = 0;  // dσ/dε [Pa]
};

/// Monotonic compression, strain and stress as magnitudes.
inline Response calc_compression(const Concrete& c, double eps) {
  if (eps <= c.eps_linear) return {c.Ec * eps, c.Ec};
  if (eps <= c.eps_c1) {
    const double r = eps / c.eps_c1, denominator = 1 / (1 + (c.k - 2) * r);
    const double s = (c.k - r) * r * denominator;
    return {c.fc * s, c.fc / c.eps_c1 * (c.k - 2 * r - s * (c.k - 2)) * denominator};
  }
  const double x = eps - c.eps_c1, s = 1 / (c.inverse_fc + c.tail * x * x);
  return {s, -2 * c.tail * x * s * s};
}

/// Monotonic tension.
inline Response calc_tension(const Concrete& c, double eps) {
  if (eps <= c.eps_ct) return {c.Ec * eps, c.Ec};
  const double x = (eps - c.eps_ct) / c.eps_tu;
  if (!(x < 1)) return {0, 0};
  // Hordijk; the last term makes the stress vanish at x = 1.
  constexpr double end = 28 * 9.7800e-4;  // (1 + 3³) e^-6.93
  const double e = std::exp(-6.93 * x), p = 1 + 27 * x * x * x;
  const double s = p * e - x * end;
  return {c.fct * (s > 0 ? s : 0), c.fct / c.eps_tu * ((81 * x * x - 6.93 * p) * e - end)};
}

/// Envelope of monotonic loading: no history.
inline Response calc_envelope(const Concrete& c, double eps) {
  if (eps >= 0) return calc_tension(c, eps);
  const Response a = calc_compression(c, -eps);
  return {-a.stress, a.tangent};
}

/// History: the largest compressive strain (magnitude) and the largest tensile strain measured from where compression
/// has left the origin.
struct ConcreteState {
  double compression = 0, tension = 0;
};

/// Stress at a strain after a history; the state moves on.
Response advance(const Concrete&, ConcreteState&, double eps);

/// Plastic strain (magnitude) and damage of compression reached in a state.
double calc_plastic_strain(const Concrete&, const ConcreteState&);
double calc_damage(const Concrete&, const ConcreteState&);

}  // namespace topple::material
