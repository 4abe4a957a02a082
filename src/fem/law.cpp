#include "fem/law.h"

#include <cmath>

#include "base/error.h"

namespace topple::fem {

namespace {

void check_elastic(double E, double nu) {
  if (!(E > 0) || !std::isfinite(E)) throw InputError("E652", "elastic solid: E must be positive");
  if (!(nu > -1 && nu < 0.5)) throw InputError("E652", "elastic solid: Poisson's number must lie between -1 and 0.5");
}

Voigt multiply(const Matrix6& a, const Voigt& v) {
  Voigt out{};
  for (size_t i = 0; i < 6; ++i)
    for (size_t j = 0; j < 6; ++j) out[i] += a[6 * i + j] * v[j];
  return out;
}

struct Nothing {};

struct J2State {
  double plastic[6] = {};
  double equivalent = 0;
};

}  // namespace

Matrix6 make_elastic_matrix(double E, double nu) {
  const double G = E / (2 * (1 + nu)), lame = E * nu / ((1 + nu) * (1 - 2 * nu));
  Matrix6 C{};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) C[6 * i + j] = lame;
    C[6 * i + i] += 2 * G;
    C[6 * (i + 3) + i + 3] = G;
  }
  return C;
}

std::shared_ptr<const SolidLaw> make_elastic(double E, double nu) {
  check_elastic(E, nu);
  const Matrix6 C = make_elastic_matrix(E, nu);
  return wrap_law(
      [C](const Nothing&, const Voigt& strain, Nothing&) {
        return PointResponse{multiply(C, strain), C, C};
      },
      Nothing{}, nu > 0 ? nu : 0);
}

std::shared_ptr<const SolidLaw> make_j2(const J2Input& in) {
  check_elastic(in.E, in.nu);
  if (!(in.yield > 0) || !(in.hardening >= 0) || !(in.lateral >= 0 && in.lateral <= 0.5))
    throw InputError("E652", "J2: yield must be positive, hardening not negative, lateral between 0 and 0.5");
  const Matrix6 C = make_elastic_matrix(in.E, in.nu);
  const double G = in.E / (2 * (1 + in.nu));
  const auto advance = [C, G, in](const J2State& old, const Voigt& strain, J2State& now) {
    PointResponse out;
    out.secant = out.tangent = C;
    Voigt elastic;
    for (size_t i = 0; i < 6; ++i) elastic[i] = strain[i] - old.plastic[i];
    out.stress = multiply(C, elastic);
    const double mean = (out.stress[0] + out.stress[1] + out.stress[2]) / 3;
    Voigt s = out.stress;
    for (size_t i = 0; i < 3; ++i) s[i] -= mean;
    const double size =
        std::sqrt(s[0] * s[0] + s[1] * s[1] + s[2] * s[2] + 2 * (s[3] * s[3] + s[4] * s[4] + s[5] * s[5]));
    const double root = std::sqrt(2.0 / 3), radius = root * (in.yield + in.hardening * old.equivalent);
    if (size <= radius) return out;
    const double flow = (size - radius) / (2 * G + 2.0 / 3 * in.hardening);
    Voigt n;
    for (size_t i = 0; i < 6; ++i) n[i] = s[i] / size;
    for (size_t i = 0; i < 6; ++i) {
      out.stress[i] -= 2 * G * flow * n[i];
      now.plastic[i] = old.plastic[i] + flow * n[i] * (i < 3 ? 1 : 2);
    }
    now.equivalent = old.equivalent + root * flow;
    // Consistent tangent: C - 2G (1 - θ) I_dev - 2G θ' n n
    const double theta = 1 - 2 * G * flow / size;
    const double theta_n = 1 / (1 + in.hardening / (3 * G)) - (1 - theta);
    for (size_t i = 0; i < 6; ++i)
      for (size_t j = 0; j < 6; ++j) {
        double dev = i == j ? (i < 3 ? 1 : 0.5) : 0;
        if (i < 3 && j < 3) dev -= 1.0 / 3;
        out.tangent[6 * i + j] -= 2 * G * (1 - theta) * dev + 2 * G * theta_n * n[i] * n[j];
      }
    return out;
  };
  return wrap_law(advance, J2State{}, in.lateral);
}

}  // namespace topple::fem
