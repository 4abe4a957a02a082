#include "material/solid_concrete.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"

namespace topple::material {

namespace {

std::string show(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

[[noreturn]] void refuse(const std::string& what, const std::string& help = {}) {
  throw InputError("E604", "concrete: " + what, help);
}

std::array<double, 36> make_elastic(double E, double nu) {
  std::array<double, 36> c{};
  const double G = E / (2 * (1 + nu)), lambda = E * nu / ((1 + nu) * (1 - 2 * nu));
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) c[6 * i + j] = lambda;
    c[7 * i] += 2 * G;
    c[7 * (i + 3)] = G;
  }
  return c;
}

}  // namespace

SolidConcrete make_solid_concrete(const SolidConcreteInput& in) {
  if (!(in.l_eq_tension >= 0) || !std::isfinite(in.l_eq_tension))
    refuse("l_eq_tension = " + show(in.l_eq_tension) + " must not be negative");
  SolidConcrete c;
  c.l_eq_tension = in.l_eq_tension > 0 ? in.l_eq_tension : in.uniaxial.l_eq;
  // Each of the two lengths limits its own branch only.
  ConcreteInput crushing = in.uniaxial, cracking = in.uniaxial;
  crushing.fct = 0;
  cracking.l_eq = c.l_eq_tension;
  cracking.Gcl = std::max(in.uniaxial.Gcl, in.uniaxial.Gcl * c.l_eq_tension / in.uniaxial.l_eq);
  c.law = make_concrete(crushing);
  const Concrete tension = make_concrete(cracking);
  c.law.fct = tension.fct, c.law.eps_ct = tension.eps_ct, c.law.eps_tu = tension.eps_tu;
  if (!(in.nu >= 0 && in.nu < 0.45)) refuse("nu = " + show(in.nu) + " must lie between 0 and 0.45");
  if (!(in.biaxial_ratio > 1 && in.biaxial_ratio <= 1.5))
    refuse("biaxial_ratio = " + show(in.biaxial_ratio) + " must lie between 1 and 1.5");
  if (!(in.stiffness_floor >= 0 && in.stiffness_floor < 0.1)) refuse("stiffness_floor must lie between 0 and 0.1");
  c.nu = in.nu;
  c.floor = in.stiffness_floor;
  c.alpha = (in.biaxial_ratio - 1) / (2 * in.biaxial_ratio - 1);
  const double plain = 1 + 3 * c.alpha / (1 - c.alpha);
  c.slope = in.confinement_slope > 0 ? in.confinement_slope : plain;
  if (!(c.slope >= plain * (1 - 1e-12)) || !(c.slope <= 10))
    refuse("confinement_slope = " + show(in.confinement_slope) + " must lie between " + show(plain) + " and 10");
  c.gamma = std::max(0.0, (c.slope - 1) * (1 - c.alpha) - 3 * c.alpha);
  c.alpha_flow = in.dilatancy * std::sqrt(1.5);
  // Plastic work must not be negative at any pressure.
  const double most = (c.slope - 1) / (c.slope + 2);
  if (!(in.dilatancy >= 0 && c.alpha_flow <= most * (1 + 1e-12)))
    refuse("dilatancy = " + show(in.dilatancy) + " must lie between 0 and " + show(most / std::sqrt(1.5)),
           "a greater one would win energy from the lateral pressure");
  const double fct_most = in.uniaxial.limit_ratio * in.uniaxial.fc * (1 - c.alpha) / (1 + c.alpha);
  if (!(in.uniaxial.fct <= fct_most))
    refuse("fct = " + show(in.uniaxial.fct) + " Pa must not exceed " + show(fct_most) + " Pa",
           "above it the compressive surface lies before the tensile strength");
  return c;
}

SolidUpdate advance(const SolidConcrete& c, const SolidConcreteState& old, const std::array<double, 6>& strain,
                    SolidConcreteState& now) {
  SolidUpdate u;
  u.response.tangent = u.response.secant = make_elastic(c.law.Ec, c.nu);
  for (int i = 0; i < 6; ++i) {
    u.response.stress[i] = 0;
    for (int j = 0; j < 6; ++j) u.response.stress[i] += u.response.tangent[6 * i + j] * strain[j];
  }
  now = old;
  return u;
}

SolidUpdate calc_implex(const SolidConcrete& c, const SolidConcreteState& old, const std::array<double, 6>& strain,
                        double) {
  SolidConcreteState now;
  return advance(c, old, strain, now);
}

double calc_crack_width(const SolidConcrete& c, const SolidConcreteState& state) {
  return state.crack * c.l_eq_tension;
}

double calc_crushing(const SolidConcrete& c, const SolidConcreteState& state) {
  if (state.compression <= c.law.eps_c1) return 0;
  return 1 - calc_compression(c.law, state.compression).stress / c.law.fc;
}

double calc_compressive_damage(const SolidConcrete& c, const SolidConcreteState& state) {
  return calc_damage(c.law, {state.compression, 0});
}

}  // namespace topple::material
