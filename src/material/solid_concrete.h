#pragma once
/// Concrete at one point in three dimensions: Drucker–Prager in compression and Rankine in tension on the curves of the
/// uniaxial law, with damage; docs/theory/material.md, "Concrete in three dimensions".
/// Voigt order xx yy zz xy yz zx; strains with engineering shear; tension positive; Pa.
/// The model is constant, the state is a few numbers, nothing here throws but make_solid_concrete.

#include <array>

#include "material/concrete.h"

namespace topple::material {

/// What a concrete is made of.
struct SolidConcreteInput {
  ConcreteInput uniaxial;          // the curves; its l_eq is the length of crushing
  double l_eq_tension = 0;         // length over which a crack localises; 0: as l_eq      [m]
  double nu = 0.2;                 // Poisson's ratio
  double biaxial_ratio = 1.16;     // f_b / f_c
  double confinement_slope = 4.1;  // d f_cc / d σ_lateral (Richart); 0: plain Drucker–Prager, which gives 1.41
  double dilatancy = 0.2;          // α_p of the plastic potential √(2 J2) + α_p I1 (Lee & Fenves)
  double tension_loss = 0.8;       // of f_ct, under compression at f_c across (Kupfer); 0: none
  double crack_softening = 0.34;   // of compression along open cracks (Vecchio & Collins), equation (32); 0: none
  double stiffness_floor = 1e-4;   // least stiffness in `secant` and in IMPL-EX tangents, share of E_c; no stress
};

/// Constant parameters, made once by make_solid_concrete.
struct SolidConcrete {
  Concrete law;  // uniaxial; its tensile softening is that of l_eq_tension
  double nu = 0, l_eq_tension = 0;
  double alpha = 0;       // friction, equation (22)
  double gamma = 0;       // part of the all-round pressure in the strength, equation (23)
  double alpha_flow = 0;  // dilatancy in the potential √(3 J2) + α I1
  double slope = 0;       // d f_cc / d σ_lateral
  double tension_loss = 0, softening = 0, softening_foot = 0.8;  // equations (31) and (32)
  double floor = 0;
  // Of the compressive curve, at the peak and where a fifth of the strength is lost: plastic strain, effective stress
  // over E_c, and the strain between the two.
  double plastic_peak = 0, plastic_tail = 0, effective_peak = 0, effective_tail = 0, tail = 0;
};

/// Throws InputError: a value out of range, what make_concrete refuses, or strengths for which the surfaces overlap.
SolidConcrete make_solid_concrete(const SolidConcreteInput&);

/// History of one integration point; a value-initialised one is virgin.
struct SolidConcreteState {
  std::array<double, 6> plastic{};  // plastic strain, engineering shear
  double compression = 0;           // largest equivalent uniaxial compressive strain, magnitude
  double tension = 0;               // largest equivalent uniaxial tensile strain
  double confinement = 0;           // all-round pressure at the end of the last step [Pa]
  double crack = 0;                 // largest principal crack strain now
  // Growth in the last step, for IMPL-EX.
  std::array<double, 6> plastic_step{};
  double compression_step = 0, tension_step = 0;
};

/// stress = secant · (strain - plastic). Matrices are row-major.
struct SolidResponse {
  std::array<double, 6> stress;    // [Pa]
  std::array<double, 36> tangent;  // dσ/dε of the algorithm; not symmetric where it crushes or two cracks grow
  std::array<double, 36> secant;   // of unloading; symmetric, positive definite down to the floor
};

struct SolidUpdate {
  SolidResponse response;
  bool converged = true;
  int iterations = 0;  // of the return map; 0: elastic
};

/// Stress at a strain after the history `old`; `now` is what `old` becomes there. `old` is not changed and may not be
/// the same object as `now`. Implicit. Never throws; if the return map does not converge it says so.
SolidUpdate advance(const SolidConcrete&, const SolidConcreteState& old, const std::array<double, 6>& strain,
                    SolidConcreteState& now);

/// IMPL-EX (Oliver, Huespe & Cante 2008), for structures that soften: the stress with the history extrapolated from the
/// last step, step_ratio = new step / last step; 0 where the loading turns round. The tangent is consistent, symmetric
/// and positive definite down to the floor, so that Newton's method with a symmetric factorisation converges in two or
/// three iterations; the error falls with the step. Follow it with `advance` at the converged strain for the next
/// state.
SolidUpdate calc_implex(const SolidConcrete&, const SolidConcreteState& old, const std::array<double, 6>& strain,
                        double step_ratio = 1);
/// Both at once: the response of calc_implex with the history of advance.
SolidUpdate advance_implex(const SolidConcrete&, const SolidConcreteState& old, const std::array<double, 6>& strain,
                           double step_ratio, SolidConcreteState& now);

/// Opening of the widest crack at a point now: crack strain times length [m].
double calc_crack_width(const SolidConcrete&, const SolidConcreteState&);
/// Share of the strength lost by crushing: 0 before the peak of the compressive curve, 1 crushed.
double calc_crushing(const SolidConcrete&, const SolidConcreteState&);
/// Damage of compression, 1 - (unloading stiffness / E_c).
double calc_compressive_damage(const SolidConcrete&, const SolidConcreteState&);

}  // namespace topple::material
