#include "material/concrete.h"

#include <algorithm>
#include <limits>
#include <string>

#include "base/error.h"
#include "base/unit.h"

namespace topple::material {

namespace {

constexpr double pi = 3.14159265358979323846;

std::string show(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

void check_positive(double value, const char* name) {
  if (!(value > 0) || !std::isfinite(value))
    throw InputError("E601", std::string("concrete: ") + name + " = " + show(value) + " must be positive");
}

void check_input(const ConcreteInput& in) {
  check_positive(in.fc, "fc");
  check_positive(in.Ec, "Ec");
  check_positive(in.eps_c1, "eps_c1");
  check_positive(in.Gcl, "Gcl");
  if (!(in.fct >= 0) || !std::isfinite(in.fct))
    throw InputError("E601", "concrete: fct = " + show(in.fct) + " must not be negative");
  if (in.fct > 0) check_positive(in.Gf, "Gf");
  if (!(in.b_c >= 0 && in.b_c <= 1) || !(in.b_t >= 0 && in.b_t <= 1))
    throw InputError("E601", "concrete: the plastic shares b_c and b_t must lie between 0 and 1");
  if (!(in.limit_ratio > 0 && in.limit_ratio < 1))
    throw InputError("E601", "concrete: the linear limit must lie between 0 and 1 of fc");
  constexpr double kLeastPeakStrain = 1.05;  // as plans are read
  // The second branch rises monotonically only if the curve bends below the elastic line: k > 1.
  if (in.eps_c1 < kLeastPeakStrain * in.fc / in.Ec)
    throw InputError("E602",
                     "concrete: eps_c1 = " + show(in.eps_c1) + " is less than " + show(kLeastPeakStrain) +
                         " fc / Ec = " + show(kLeastPeakStrain * in.fc / in.Ec),
                     "the rising branch must bend below the elastic line on its way to the peak");
}

/// Energy per volume that unloading from the peak gives back, equation (8).
double calc_peak_energy(const ConcreteInput& in) {
  return 0.5 * in.fc * (in.eps_c1 * (1 - in.b_c) + in.b_c * in.fc / in.Ec);
}

}  // namespace

double calc_largest_l_eq(const ConcreteInput& in) {
  check_input(in);
  const double compression = in.Gcl / calc_peak_energy(in);
  const double tension = in.fct > 0 ? 2 * in.Ec * in.Gf / (in.fct * in.fct) : std::numeric_limits<double>::infinity();
  return std::min(compression, tension);
}

Concrete make_concrete(const ConcreteInput& in) {
  check_input(in);
  check_positive(in.l_eq, "l_eq");
  const double largest = calc_largest_l_eq(in);
  if (in.l_eq >= largest)
    throw InputError("E603",
                     "concrete: softening localises over " + show(in.l_eq) +
                         " m, but its energy suffices for less than " + show(largest) + " m only",
                     "use a shorter zone or a larger fracture or crushing energy");
  Concrete c;
  c.Ec = in.Ec, c.fc = in.fc, c.eps_c1 = in.eps_c1, c.fct = in.fct, c.b_c = in.b_c, c.b_t = in.b_t;
  const double y = in.limit_ratio;
  c.eps_linear = y * in.fc / in.Ec;
  const double n = c.eps_linear / in.eps_c1;
  c.k = (y / n - 2 * y + n) / (1 - y);
  const double g = in.Gcl / in.l_eq - calc_peak_energy(in);
  c.gamma = pi * pi * in.fc * in.eps_c1 / (2 * g * g);
  c.inverse_fc = 1 / in.fc;
  c.tail = c.gamma / (2 * in.eps_c1);
  c.eps_ct = in.fct / in.Ec;
  const double g_t = in.fct > 0 ? in.Gf / in.l_eq - 0.5 * in.fct * c.eps_ct : 1;
  c.eps_tu = in.fct > 0 ? 5.14 * g_t / in.fct : 1;
  return c;
}

ConcreteInput confine(ConcreteInput in, const Confinement& confinement) {
  const double s = std::max(0.0, confinement.stress) / in.fc;
  if (s <= 0) return in;
  const double gain = s <= 0.05 ? 1 + 5 * s : 1.125 + 2.5 * s;
  const double tail = in.Gcl / in.l_eq - calc_peak_energy(in);
  const double later = 0.2 * s - in.eps_c1 * (gain * gain - 1);
  in.fc *= gain;
  in.eps_c1 *= gain * gain;
  // The strain at which a fifth of the strength is lost moves out by 0.2 σ2 / f_c.
  in.Gcl = in.l_eq * (gain * tail + pi * in.fc * std::max(0.0, later) + calc_peak_energy(in));
  return in;
}

double calc_fracture_energy(double fcm) { return 73 * std::pow(fcm / unit::MPa, 0.18); }
double calc_initial_modulus(double fcm, double alpha_E) {
  return 21500 * unit::MPa * alpha_E * std::cbrt(fcm / (10 * unit::MPa));
}
double calc_parabola_modulus(const Concrete& c) { return c.k * c.fc / c.eps_c1; }

double calc_plastic_strain(const Concrete& c, const ConcreteState& state) {
  return c.b_c * (state.compression - calc_compression(c, state.compression).stress / c.Ec);
}

double calc_damage(const Concrete& c, const ConcreteState& state) {
  if (state.compression <= c.eps_linear) return 0;
  const double stress = calc_compression(c, state.compression).stress;
  return 1 - stress / (c.Ec * (state.compression - calc_plastic_strain(c, state)));
}

Response advance(const Concrete& c, ConcreteState& state, double eps) {
  if (-eps >= state.compression && -eps > 0) {
    state.compression = -eps;
    return calc_envelope(c, eps);
  }
  const double eps_pl = calc_plastic_strain(c, state), integrity = 1 - calc_damage(c, state);
  // Unloading and reloading in compression run along one line through the plastic strain.
  const double e = eps + eps_pl;  // measured from the stress-free point
  if (e <= 0) return {integrity * c.Ec * e, integrity * c.Ec};
  // Tension from the shifted origin, weakened by what compression has damaged.
  if (e >= state.tension) {
    state.tension = e;
    const Response a = calc_tension(c, e);
    return {integrity * a.stress, integrity * a.tangent};
  }
  const double s_max = calc_tension(c, state.tension).stress;
  const double e_pl = c.b_t * (state.tension - s_max / c.Ec);
  if (e <= e_pl) return {0, 0};  // rough faces touch; compression starts at e = 0
  const double slope = integrity * s_max / (state.tension - e_pl);
  return {slope * (e - e_pl), slope};
}

}  // namespace topple::material
