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

using Vector = std::array<double, 3>;
using Matrix = std::array<Vector, 3>;
using Voigt = std::array<double, 6>;

/// Principal values, falling, and their directions (one row each).
struct Principal {
  Vector value;
  Matrix axis;
};

/// Cyclic Jacobi rotations: exact to round-off also for values that nearly coincide.
Principal find_principal(const Voigt& strain) {
  double a[3][3] = {{strain[0], 0.5 * strain[3], 0.5 * strain[5]},
                    {0.5 * strain[3], strain[1], 0.5 * strain[4]},
                    {0.5 * strain[5], 0.5 * strain[4], strain[2]}};
  double v[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 12; ++sweep) {
    const double off = std::abs(a[0][1]) + std::abs(a[1][2]) + std::abs(a[0][2]);
    const double size = std::abs(a[0][0]) + std::abs(a[1][1]) + std::abs(a[2][2]);
    if (off <= 1e-17 * size) break;
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (a[p][q] == 0) continue;
        const double theta = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
        const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double c = 1 / std::sqrt(t * t + 1), s = t * c;
        const int r = 3 - p - q;
        const double change = t * a[p][q], pr = a[p][r], qr = a[q][r];
        a[p][p] -= change, a[q][q] += change;
        a[p][q] = a[q][p] = 0;
        a[p][r] = a[r][p] = c * pr - s * qr;
        a[q][r] = a[r][q] = s * pr + c * qr;
        for (int k = 0; k < 3; ++k) {
          const double vp = v[p][k], vq = v[q][k];
          v[p][k] = c * vp - s * vq, v[q][k] = s * vp + c * vq;
        }
      }
  }
  int order[3] = {0, 1, 2};
  if (a[order[0]][order[0]] < a[order[1]][order[1]]) std::swap(order[0], order[1]);
  if (a[order[1]][order[1]] < a[order[2]][order[2]]) std::swap(order[1], order[2]);
  if (a[order[0]][order[0]] < a[order[1]][order[1]]) std::swap(order[0], order[1]);
  Principal out;
  for (int i = 0; i < 3; ++i) {
    out.value[i] = a[order[i]][order[i]];
    for (int k = 0; k < 3; ++k) out.axis[i][k] = v[order[i]][k];
  }
  return out;
}

/// n_i n_i and n_i n_j + n_j n_i in Voigt order: with engineering strains both project and build.
Voigt make_dyad(const Vector& n) {
  return {n[0] * n[0], n[1] * n[1], n[2] * n[2], n[0] * n[1], n[1] * n[2], n[2] * n[0]};
}
Voigt make_dyad(const Vector& a, const Vector& b) {
  return {2 * a[0] * b[0],           2 * a[1] * b[1],           2 * a[2] * b[2],
          a[0] * b[1] + a[1] * b[0], a[1] * b[2] + a[2] * b[1], a[2] * b[0] + a[0] * b[2]};
}

/// Σ normal_ij N_i N_j + Σ shear_k M_k M_k with k = 12, 23, 13.
std::array<double, 36> turn(const Matrix& normal, const Vector& shear, const std::array<Voigt, 3>& N,
                            const std::array<Voigt, 3>& M) {
  std::array<double, 36> out{};
  for (int i = 0; i < 3; ++i) {
    Voigt w;
    for (int b = 0; b < 6; ++b) w[b] = normal[i][0] * N[0][b] + normal[i][1] * N[1][b] + normal[i][2] * N[2][b];
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b < 6; ++b) out[6 * a + b] += N[i][a] * w[b] + shear[i] * M[i][a] * M[i][b];
  }
  return out;
}

/// Solves J x = rhs in place, n unknowns, m columns; false if singular.
bool solve(double (&J)[4][4], double (&rhs)[4][4], int n, int m) {
  for (int k = 0; k < n; ++k) {
    int pivot = k;
    for (int i = k + 1; i < n; ++i)
      if (std::abs(J[i][k]) > std::abs(J[pivot][k])) pivot = i;
    if (!(std::abs(J[pivot][k]) > 1e-14)) return false;
    if (pivot != k) {
      std::swap(J[pivot], J[k]);
      std::swap(rhs[pivot], rhs[k]);
    }
    const double inverse = 1 / J[k][k];
    for (int i = k + 1; i < n; ++i) {
      const double f = J[i][k] * inverse;
      if (f == 0) continue;
      for (int j = k; j < n; ++j) J[i][j] -= f * J[k][j];
      for (int j = 0; j < m; ++j) rhs[i][j] -= f * rhs[k][j];
    }
  }
  for (int k = n - 1; k >= 0; --k) {
    const double inverse = 1 / J[k][k];
    for (int j = 0; j < m; ++j) {
      double x = rhs[k][j];
      for (int i = k + 1; i < n; ++i) x -= J[k][i] * rhs[i][j];
      rhs[k][j] = x * inverse;
    }
  }
  return true;
}

/// Line on which cracks close and open again, for the largest equivalent strain `limit` so far, equation (25).
struct CrackLine {
  double limit = 0, zero = 0, slope = 0;
  double zero_rate = 0, slope_rate = 0;  // d/d limit
};

CrackLine make_crack_line(const Concrete& c, double limit) {
  const Response top = calc_tension(c, limit);
  CrackLine line{limit, limit, 0, 0, 0};
  if (!(top.stress > 0)) {
    line.zero = c.b_t * limit, line.zero_rate = c.b_t;
    return line;
  }
  line.zero = c.b_t * (limit - top.stress / c.Ec);
  line.zero_rate = c.b_t * (1 - top.tangent / c.Ec);
  const double length = 1 / (limit - line.zero);
  line.slope = top.stress * length;
  line.slope_rate = (top.tangent - line.slope * (1 - line.zero_rate)) * length;
  return line;
}

/// The compressive curve in effective stresses, equations (21) and (26).
struct Hardening {
  double plastic, plastic_rate;      // P(κ)
  double effective, effective_rate;  // Q(κ)
  double integrity, integrity_rate;  // 1 - D
};

Hardening calc_hardening(const Concrete& c, double kappa) {
  if (kappa <= c.eps_linear) return {0, 0, c.Ec * kappa, c.Ec, 1, 0};
  const Response s = calc_compression(c, kappa);
  Hardening h;
  h.plastic = c.b_c * (kappa - s.stress / c.Ec), h.plastic_rate = c.b_c * (1 - s.tangent / c.Ec);
  h.effective = c.Ec * (kappa - h.plastic), h.effective_rate = c.Ec * (1 - h.plastic_rate);
  h.integrity = s.stress / h.effective;
  h.integrity_rate = (s.tangent - h.integrity * h.effective_rate) / h.effective;
  return h;
}

double calc_mises(const Vector& s) {
  const double a = s[0] - s[1], b = s[1] - s[2], d = s[2] - s[0];
  return std::sqrt(0.5 * (a * a + b * b + d * d));
}

/// Of 1/β in equation (32): a tenth of the strength is left along cracks of any width.
constexpr double kMostLoss = 9;

/// Effective principal stresses and what they depend on.
struct Stresses {
  Vector value{};
  Matrix rate{};          // ∂σ_i/∂u_k
  Vector by_kappa{};      // ∂σ_i/∂κ, through the crack that compression across it lets grow
  bool cracking = false;  // the widest crack grows
  double tension = 0;     // its equivalent strain u_m
  // What compresses across an open crack: share of S(κ = peak) in effective stress, and by σ_i.
  double across = 0;
  Vector across_rate{};
  double loss = 0, loss_rate = 0;  // of compressive strength by the crack's opening, 1/β - 1 of equation (32), by u_0
};

/// Compression beside cracks, equation (31): √(3 J2) + α I1 of the compressive part over (1 - α) f_c.
void find_compression_across(const SolidConcrete& c, Stresses& s) {
  Vector n;
  for (int i = 0; i < 3; ++i) n[i] = std::min(s.value[i], 0.0);
  const double q = calc_mises(n), sum = n[0] + n[1] + n[2];
  if (!(q > 0)) return;
  const double scale = 1 / ((1 - c.alpha) * c.law.fc);
  s.across = (q + c.alpha * sum) * scale;
  for (int i = 0; i < 3; ++i) s.across_rate[i] = s.value[i] < 0 ? (1.5 * (n[i] - sum / 3) / q + c.alpha) * scale : 0;
}

/// Stress of each direction from its equivalent uniaxial strain. `history` is the line of the cracks so far; if the
/// widest may grow and does, the others follow the line that it drags along.
Stresses calc_stresses(const SolidConcrete& solid, const Vector& u, const CrackLine& history, bool may_grow,
                       const Hardening& h) {
  const Concrete& c = solid.law;
  Stresses s;
  for (int i = 0; i < 3; ++i)
    if (u[i] <= 0) s.value[i] = c.Ec * u[i], s.rate[i][i] = c.Ec;
  s.tension = history.limit;
  if (u[0] <= 0) return s;
  if (u[2] < 0) find_compression_across(solid, s);
  // Share of the tensile strength that the compression across leaves.
  const double plain = 1 / h.integrity - solid.tension_loss * s.across;
  const double left = std::min(1.0, plain);
  CrackLine line = history;
  s.cracking = may_grow && u[0] > left * history.limit;
  if (s.cracking) {
    s.tension = u[0] / left;
    line = make_crack_line(c, s.tension);
  }
  const bool weakened = s.cracking && left < 1;
  Vector left_rate{};
  double left_by_kappa = 0;
  if (weakened) {
    for (int k = 0; k < 3; ++k) left_rate[k] = -solid.tension_loss * s.across_rate[k] * s.rate[k][k];
    left_by_kappa = -h.integrity_rate / (h.integrity * h.integrity);
  }
  const double by_left = -s.tension / left;  // ∂u_m/∂left
  for (int i = 0; i < 3; ++i) {
    if (u[i] <= 0) continue;
    if (i == 0 && s.cracking && !weakened) {
      const Response r = calc_tension(c, u[0]);
      s.value[0] = r.stress, s.rate[0][0] = r.tangent;
    } else if (u[i] > line.zero) {
      s.value[i] = line.slope * (u[i] - line.zero), s.rate[i][i] += line.slope;
      if (!s.cracking) continue;
      const double widening = line.slope_rate * (u[i] - line.zero) - line.slope * line.zero_rate;  // ∂σ_i/∂u_m
      s.rate[i][0] += widening / left;
      for (int k = 0; k < 3; ++k) s.rate[i][k] += widening * by_left * left_rate[k];
      s.by_kappa[i] = widening * by_left * left_by_kappa;
    }
  }
  s.loss_rate = solid.softening / c.eps_c1;
  s.loss = solid.softening_foot + s.loss_rate * u[0] - 1;
  if (s.loss > kMostLoss) s.loss = kMostLoss, s.loss_rate = 0;
  if (!(s.across > 0 && s.loss > 0)) s.loss = s.loss_rate = 0;
  return s;
}

/// Plastic strain per plastic strain of the unconfined curve, before and after the peak, equations (28) and (29).
struct Ductility {
  double before = 1, after = 1;
};

Ductility calc_ductility(const SolidConcrete& c, double confinement) {
  Ductility x;
  if (!(confinement > 0) || !(c.plastic_peak > 0)) return x;
  // Under constant pressure the effective stresses are 1 + (slope - 2 ν) pressure / S times Q.
  const double share = confinement / c.law.fc, gain = 1 + c.slope * share, per_share = c.slope - 2 * c.nu;
  const double at_peak = c.effective_peak * (1 + per_share * share);
  const double at_tail = (c.effective_peak + c.effective_tail) * (1 + per_share * share / 0.8);
  const double peak = c.law.eps_c1 * gain * gain, later = std::max(0.0, 0.2 * share - (peak - c.law.eps_c1));
  x.before = (peak - at_peak) / c.plastic_peak;
  x.after = std::max(1.0, (c.tail + later - (at_tail - at_peak)) / c.plastic_tail);
  return x;
}

/// One problem of the return map in principal directions.
struct ReturnMap {
  const SolidConcrete& c;
  Vector trial;       // principal strains less the plastic strain of the step's beginning
  CrackLine history;  // of cracks
  bool may_grow;      // cracks may
  double kappa_old;
  Hardening start;
  Ductility ductility{};
  bool crushing = false;  // the compressive surface is active
  bool frozen = false;    // κ is given; the surface is only looked at
  // The unknowns and what follows from them.
  Vector u{};
  double kappa;
  Stresses stress{};
  Hardening hardening;
  Vector flow{};
  double multiplier = 0;
  double residual[4] = {};
};

ReturnMap make_return_map(const SolidConcrete& c, const Vector& trial, double tension, double kappa, const Hardening& h,
                          bool may_grow) {
  ReturnMap m{.c = c,
              .trial = trial,
              .history = make_crack_line(c.law, tension),
              .may_grow = may_grow,
              .kappa_old = kappa,
              .start = h,
              .kappa = kappa,
              .hardening = h};
  return m;
}

/// (√(3 J2) + α I1 - γ<-σ_max>) - (1 - α) Q, equation (22), and what an open crack adds, (32).
double calc_surface(const SolidConcrete& c, const Stresses& stress, double effective) {
  const Vector& s = stress.value;
  return calc_mises(s) + c.alpha * (s[0] + s[1] + s[2]) + c.gamma * std::min(0.0, std::max({s[0], s[1], s[2]})) +
         (1 - c.alpha) * (c.law.fc * stress.loss * stress.across - effective);
}

double calc_unconfined_plastic(const ReturnMap& m, const Hardening& h, bool beyond) {
  if (!beyond) return m.ductility.before * h.plastic;
  return m.ductility.before * m.c.plastic_peak + m.ductility.after * (h.plastic - m.c.plastic_peak);
}

/// Residuals at m.u and m.kappa, in strains.
void calc_residual(ReturnMap& m) {
  const double E = m.c.law.Ec;
  if (m.crushing) m.hardening = calc_hardening(m.c.law, m.kappa);
  m.stress = calc_stresses(m.c, m.u, m.history, m.may_grow, m.hardening);
  const Vector& s = m.stress.value;
  const double sum = s[0] + s[1] + s[2];
  for (int i = 0; i < 3; ++i) m.residual[i] = m.u[i] - m.trial[i] - m.c.nu / E * (sum - s[i]);
  if (!m.crushing) return;
  m.multiplier = calc_unconfined_plastic(m, m.hardening, m.kappa > m.c.law.eps_c1) -
                 calc_unconfined_plastic(m, m.start, m.kappa_old > m.c.law.eps_c1);
  const double q = calc_mises(s), scale = 1 / (1 - m.c.alpha_flow), mean = sum / 3;
  for (int i = 0; i < 3; ++i) {
    m.flow[i] = q > 0 ? (1.5 * (s[i] - mean) / q + m.c.alpha_flow) * scale : 0;
    m.residual[i] += m.multiplier * m.flow[i];
  }
  m.residual[3] = calc_surface(m.c, m.stress, m.hardening.effective) / E;
}

int count_unknowns(const ReturnMap& m) { return m.crushing && !m.frozen ? 4 : 3; }

/// Sum of the residuals' magnitudes; not a number as soon as one of them is not.
double calc_size(const ReturnMap& m) {
  double size = 0;
  for (int i = 0; i < count_unknowns(m); ++i) size += std::abs(m.residual[i]);
  return size;
}

double calc_stretch(const ReturnMap& m) { return m.kappa > m.c.law.eps_c1 ? m.ductility.after : m.ductility.before; }

/// Residual that counts as zero: `tolerance`, or what the last digit of κ is worth where the curve falls steeply.
bool is_solved(const ReturnMap& m, double tolerance) {
  if (m.crushing) tolerance += 1e-15 * m.kappa * calc_stretch(m) * m.hardening.plastic_rate;
  return calc_size(m) <= tolerance;
}

void calc_jacobian(const ReturnMap& m, double (&J)[4][4]) {
  const double E = m.c.law.Ec;
  const Matrix& rate = m.stress.rate;
  Matrix d{};  // ∂residual_i/∂σ_j
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) d[i][j] = i == j ? 0 : -m.c.nu / E;
  if (m.crushing) {
    const Vector& s = m.stress.value;
    const double q = calc_mises(s), mean = (s[0] + s[1] + s[2]) / 3;
    const double f = q > 0 ? 1.5 * m.multiplier / (q * (1 - m.c.alpha_flow)) : 0;
    Vector gradient;
    for (int i = 0; i < 3; ++i) gradient[i] = q > 0 ? 1.5 * (s[i] - mean) / q : 0;
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) d[i][j] += f * ((i == j ? 1 : 0) - 1.0 / 3 - gradient[i] * gradient[j] / 1.5);
    const double x = calc_stretch(m);
    const Vector& by = m.stress.by_kappa;
    for (int i = 0; i < 3; ++i) {
      J[i][3] = x * m.hardening.plastic_rate * m.flow[i] + d[i][0] * by[0] + d[i][1] * by[1] + d[i][2] * by[2];
      gradient[i] += m.c.alpha;
    }
    if (s[0] < 0) gradient[0] += m.c.gamma;
    // An open crack's share of the surface.
    const double loss = m.stress.loss, weight = (1 - m.c.alpha) * m.c.law.fc, across = weight * m.stress.across;
    for (int i = 0; i < 3; ++i) gradient[i] += weight * loss * m.stress.across_rate[i];
    for (int k = 0; k < 3; ++k)
      J[3][k] = (gradient[0] * rate[0][k] + gradient[1] * rate[1][k] + gradient[2] * rate[2][k]) / E;
    J[3][0] += across * m.stress.loss_rate / E;
    J[3][3] = (gradient[0] * by[0] + gradient[1] * by[1] + gradient[2] * by[2] -
               (1 - m.c.alpha) * m.hardening.effective_rate) /
              E;
  }
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      J[i][k] = (i == k ? 1 : 0) + d[i][0] * rate[0][k] + d[i][1] * rate[1][k] + d[i][2] * rate[2][k];
}

/// Newton's method with a line search. The number of iterations, negative if it did not converge.
int find_root(ReturnMap& m, double tolerance) {
  calc_residual(m);
  double size = calc_size(m);
  for (int iteration = 1; iteration <= 60; ++iteration) {
    if (is_solved(m, tolerance)) return iteration;
    const int n = count_unknowns(m);
    double J[4][4], step[4][4];
    calc_jacobian(m, J);
    for (int i = 0; i < n; ++i) step[i][0] = -m.residual[i];
    if (!solve(J, step, n, 1)) return -iteration;
    const Vector u = m.u;
    const double kappa = m.kappa;
    double share = 1, best = size;
    for (int cut = 0;; ++cut) {
      for (int i = 0; i < 3; ++i) m.u[i] = u[i] + share * step[i][0];
      if (n == 4) m.kappa = std::max(m.kappa_old, kappa + share * step[3][0]);
      calc_residual(m);
      best = calc_size(m);
      if (best < size || cut == 8) break;
      share *= 0.5;
    }
    size = best;
  }
  return is_solved(m, tolerance) ? 60 : -60;
}

/// Cracks alone: a contraction as long as no branch is steeper than E_c / (2 ν).
int find_fixed_point(ReturnMap& m, double tolerance) {
  for (int iteration = 1; iteration <= 200; ++iteration) {
    calc_residual(m);
    if (calc_size(m) <= tolerance) return iteration;
    for (int i = 0; i < 3; ++i) m.u[i] -= m.residual[i];
  }
  return -200;
}

Voigt subtract(const Voigt& a, const Voigt& b) {
  Voigt out;
  for (int i = 0; i < 6; ++i) out[i] = a[i] - b[i];
  return out;
}

bool is_finite(const Voigt& v) {
  double sum = 0;
  for (double x : v) sum += std::abs(x);
  return std::isfinite(sum);
}

double calc_largest(const Vector& v) { return std::max({std::abs(v[0]), std::abs(v[1]), std::abs(v[2])}); }

/// Where the curve falls so steeply that the surface first moves away from the returning stress, Newton's method finds
/// nothing: the first change of sign is bracketed instead, with the directions solved at each given κ.
int find_bracketed(ReturnMap& m, double tolerance) {
  m.frozen = true;
  int iterations = 0;
  // Positive outside of the surface; NaN if the directions cannot be found.
  const auto look = [&](double kappa) {
    m.kappa = kappa;
    const int n = find_root(m, tolerance);
    iterations += std::abs(n);
    return n > 0 ? m.residual[3] : std::nan("");
  };
  double low = m.kappa_old, high = low, at_high = look(low);
  while (at_high > 0 && high < 1e3 * m.kappa_old) {
    low = high;
    high *= 1.05;
    at_high = look(high);
  }
  if (!(at_high <= 0)) {
    m.frozen = false;
    return -iterations;
  }
  for (int i = 0; i < 30 && high - low > 1e-9 * high; ++i) {
    const double middle = 0.5 * (low + high), at = look(middle);
    (at > 0 ? low : high) = middle;
  }
  look(low);
  m.frozen = false;
  const int polish = find_root(m, tolerance);
  return polish > 0 ? iterations + polish : -iterations + polish;
}

/// True if the point is surely elastic: no need for principal directions. `stress` is the effective stress.
bool is_elastic(const SolidConcrete& c, const Voigt& elastic, double tension, const Hardening& h, Voigt& stress) {
  const double E = c.law.Ec, two_G = E / (1 + c.nu), share = c.nu / (1 - 2 * c.nu);
  const double volume = elastic[0] + elastic[1] + elastic[2];
  for (int i = 0; i < 3; ++i) {
    stress[i] = two_G * (elastic[i] + share * volume);
    stress[i + 3] = 0.5 * two_G * elastic[i + 3];
  }
  const double sum = stress[0] + stress[1] + stress[2], a = stress[0] - stress[1], b = stress[1] - stress[2],
               d = stress[2] - stress[0];
  const double q = std::sqrt(0.5 * (a * a + b * b + d * d) +
                             3 * (stress[3] * stress[3] + stress[4] * stress[4] + stress[5] * stress[5]));
  const double largest = sum / 3 + 2 * q / 3;  // at least the largest principal stress
  const double cone = q + c.alpha * sum;
  double limit = 0;
  if (tension <= c.law.eps_ct)
    limit = c.law.fct * std::min(1.0, 1 / h.integrity - c.tension_loss * cone / ((1 - c.alpha) * c.law.fc));
  return largest <= std::max(limit, 0.0) && cone + c.gamma * std::min(0.0, largest) <= (1 - c.alpha) * h.effective;
}

/// All-round pressure: the least compressive principal stress.
double calc_pressure(const Voigt& stress) {
  if (std::max({stress[0], stress[1], stress[2]}) >= 0) return 0;
  Voigt as_strain = stress;
  for (int a = 3; a < 6; ++a) as_strain[a] *= 2;
  return std::max(0.0, -find_principal(as_strain).value[0]);
}

SolidResponse make_elastic_response(const SolidConcrete& c, const Voigt& stress, double integrity) {
  SolidResponse out;
  for (int a = 0; a < 6; ++a) out.stress[a] = integrity * stress[a];
  out.tangent.fill(0);
  const double G = 0.5 * integrity * c.law.Ec / (1 + c.nu), lambda = 2 * G * c.nu / (1 - 2 * c.nu);
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) out.tangent[6 * i + j] = lambda;
    out.tangent[7 * i] += 2 * G;
    out.tangent[7 * (i + 3)] = G;
  }
  out.secant = out.tangent;
  if (integrity < c.floor)
    for (double& entry : out.secant) entry *= c.floor / integrity;
  return out;
}

/// Cracks without crushing, from the elastic prediction.
int solve_cracks(ReturnMap& m, double tolerance) {
  const double nu = m.c.nu, share = nu / (1 - 2 * nu) * (m.trial[0] + m.trial[1] + m.trial[2]);
  for (int i = 0; i < 3; ++i) m.u[i] = (m.trial[i] + share) / (1 + nu);
  m.crushing = false;
  int iterations = find_root(m, tolerance);
  if (iterations < 0) iterations = find_fixed_point(m, tolerance);
  return iterations;
}

/// Equal principal strains have equal directions: the mean of the two one-sided answers.
void even_out(Matrix& a, int i, int j) {
  const int k = 3 - i - j;
  a[i][i] = a[j][j] = 0.5 * (a[i][i] + a[j][j]);
  a[i][j] = a[j][i] = 0.5 * (a[i][j] + a[j][i]);
  a[i][k] = a[j][k] = 0.5 * (a[i][k] + a[j][k]);
  a[k][i] = a[k][j] = 0.5 * (a[k][i] + a[k][j]);
}

/// Stress and matrices of a solved return map.
SolidResponse make_response(const ReturnMap& m, const Matrix& axis, double integrity, double integrity_rate,
                            double tangent_floor) {
  const SolidConcrete& c = m.c;
  const double E = c.law.Ec, least = c.floor * E;
  const Vector& s = m.stress.value;
  std::array<Voigt, 3> N, M;
  for (int i = 0; i < 3; ++i) N[i] = make_dyad(axis[i]);
  constexpr int first[3] = {0, 1, 0}, second[3] = {1, 2, 2};
  for (int k = 0; k < 3; ++k) M[k] = make_dyad(axis[first[k]], axis[second[k]]);

  SolidResponse out;
  for (int a = 0; a < 6; ++a) out.stress[a] = integrity * (s[0] * N[0][a] + s[1] * N[1][a] + s[2] * N[2][a]);

  // Derivatives of the principal stresses by the trial strains.
  const int n = m.crushing ? 4 : 3;
  double J[4][4], x[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 0}};
  ReturnMap at = m;
  if (tangent_floor > 0)
    for (int i = 0; i < 3; ++i) at.stress.rate[i][i] = std::max(at.stress.rate[i][i], tangent_floor * E);
  calc_jacobian(at, J);
  Matrix A{};
  if (solve(J, x, n, 3)) {
    const Matrix& rate = at.stress.rate;
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k)
        A[j][k] = integrity * (rate[j][0] * x[0][k] + rate[j][1] * x[1][k] + rate[j][2] * x[2][k]) +
                  (m.crushing ? (integrity_rate * s[j] + integrity * m.stress.by_kappa[j]) * x[3][k] : 0);
  }
  const double near = 1e-7 * calc_largest(m.trial);
  const bool same01 = m.trial[0] - m.trial[1] <= near, same12 = m.trial[1] - m.trial[2] <= near;
  if (same01) even_out(A, 0, 1);
  if (same12) even_out(A, 1, 2);
  if (same01 && same12) even_out(A, 0, 1);

  // Secant of unloading: each direction's own modulus, the elastic coupling between them.
  Vector modulus, strain;
  const double sum = s[0] + s[1] + s[2];
  double C[4][4], S[4][4] = {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 0}};
  for (int i = 0; i < 3; ++i) {
    modulus[i] = m.u[i] > 0 ? std::max(s[i] / m.u[i], least) : E;
    strain[i] = m.u[i] - c.nu / E * (sum - s[i]);
    for (int j = 0; j < 3; ++j) C[i][j] = -c.nu;
    C[i][i] = E / modulus[i];
  }
  Matrix secant{};
  const double weight = E * std::max(integrity, c.floor);
  if (solve(C, S, 3, 3))
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) secant[i][j] = 0.5 * weight * (S[i][j] + S[j][i]);

  Vector shear, secant_shear;
  for (int k = 0; k < 3; ++k) {
    const int i = first[k], j = second[k];
    const double gap = m.trial[i] - m.trial[j], fall = s[i] - s[j], width = strain[i] - strain[j];
    shear[k] = gap > near ? 0.5 * integrity * fall / gap : 0.25 * (A[i][i] - A[i][j] + A[j][j] - A[j][i]);
    if (tangent_floor > 0) shear[k] = std::max(shear[k], 0.5 * tangent_floor * E);
    const double plain = 0.5 * std::min(modulus[i], modulus[j]) / (1 + c.nu);
    secant_shear[k] = weight / E * std::max(width > near ? 0.5 * fall / width : plain, 0.5 * least);
  }
  out.tangent = turn(A, shear, N, M);
  out.secant = turn(secant, secant_shear, N, M);
  return out;
}

/// The new history, and the response if it is `wanted`.
SolidUpdate advance_history(const SolidConcrete& c, const SolidConcreteState& old, const Voigt& strain,
                            SolidConcreteState& now, bool wanted) {
  const Voigt elastic = subtract(strain, old.plastic);
  const double kappa_old = std::max(old.compression, c.law.eps_linear);
  const double limit = std::max(old.tension, c.law.eps_ct);
  SolidUpdate update;
  const Hardening start = calc_hardening(c.law, kappa_old);
  Voigt trial{};
  if (!is_finite(elastic)) {
    update.converged = false;
    update.response = make_elastic_response(c, trial, start.integrity);
    now = old;
    return update;
  }
  if (is_elastic(c, elastic, limit, start, trial)) {
    if (wanted) update.response = make_elastic_response(c, trial, start.integrity);
    now = old;
    now.plastic_step = {};
    now.compression_step = now.tension_step = now.crack = 0;
    now.confinement = start.integrity * calc_pressure(trial);
    return update;
  }
  const Principal principal = find_principal(elastic);
  ReturnMap m = make_return_map(c, principal.value, limit, kappa_old, start, true);
  const double tolerance = 1e-13 * (calc_largest(principal.value) + c.law.eps_linear);

  int iterations = solve_cracks(m, tolerance);
  bool converged = iterations > 0;
  update.iterations = std::abs(iterations) - 1;
  if (calc_surface(c, m.stress, m.start.effective) > 1e-13 * m.start.effective) {
    m.crushing = true;
    m.ductility = calc_ductility(c, old.confinement);
    const Vector before = m.u;
    iterations = find_root(m, tolerance);
    if (iterations < 0) {
      update.iterations -= iterations;
      m.u = before;
      iterations = find_bracketed(m, tolerance);
    }
    converged = iterations > 0;
    update.iterations += std::abs(iterations);
  }
  update.converged = converged;
  if (wanted) update.response = make_response(m, principal.axis, m.hardening.integrity, m.hardening.integrity_rate, 0);

  now = old;
  if (!converged) return update;
  now.plastic_step = {};
  if (m.crushing) {
    for (int i = 0; i < 3; ++i) {
      const Voigt n = make_dyad(principal.axis[i]);
      for (int a = 0; a < 6; ++a) now.plastic_step[a] += (a < 3 ? 1 : 2) * m.multiplier * m.flow[i] * n[a];
    }
    for (int a = 0; a < 6; ++a) now.plastic[a] = old.plastic[a] + now.plastic_step[a];
    now.compression = m.kappa;
  }
  now.compression_step = m.kappa - kappa_old;
  if (m.stress.cracking) now.tension = m.stress.tension;
  now.tension_step = m.stress.cracking ? m.stress.tension - limit : 0;
  now.crack = std::max(0.0, m.u[0] - m.stress.value[0] / c.law.Ec);
  now.confinement = std::max(0.0, -m.hardening.integrity * m.stress.value[0]);
  return update;
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
  if (!(in.uniaxial.b_c <= 0.95))
    refuse("b_c = " + show(in.uniaxial.b_c) + " must not exceed 0.95",
           "crushed concrete that only yields has no effective stress left");
  if (!(in.tension_loss >= 0 && in.tension_loss <= 0.95))
    refuse("tension_loss = " + show(in.tension_loss) + " must lie between 0 and 0.95");
  if (!(in.crack_softening >= 0 && in.crack_softening <= 10))
    refuse("crack_softening = " + show(in.crack_softening) + " must lie between 0 and 10");
  c.nu = in.nu;
  c.floor = in.stiffness_floor;
  c.tension_loss = in.tension_loss;
  c.softening = in.crack_softening;
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
  const double strain_tail = c.law.eps_c1 + std::sqrt(0.25 / (c.law.fc * c.law.tail));
  const Hardening peak = calc_hardening(c.law, c.law.eps_c1), tail = calc_hardening(c.law, strain_tail);
  c.tail = strain_tail - c.law.eps_c1;
  c.plastic_peak = peak.plastic, c.effective_peak = peak.effective / c.law.Ec;
  c.plastic_tail = tail.plastic - peak.plastic, c.effective_tail = (tail.effective - peak.effective) / c.law.Ec;
  return c;
}

SolidUpdate advance(const SolidConcrete& c, const SolidConcreteState& old, const std::array<double, 6>& strain,
                    SolidConcreteState& now) {
  return advance_history(c, old, strain, now, true);
}

SolidUpdate advance_implex(const SolidConcrete& c, const SolidConcreteState& old, const std::array<double, 6>& strain,
                           double step_ratio, SolidConcreteState& now) {
  SolidUpdate update = calc_implex(c, old, strain, step_ratio);
  const SolidUpdate history = advance_history(c, old, strain, now, false);
  update.converged = update.converged && history.converged;
  update.iterations += history.iterations;
  return update;
}

SolidUpdate calc_implex(const SolidConcrete& c, const SolidConcreteState& old, const std::array<double, 6>& strain,
                        double step_ratio) {
  Voigt elastic, trial;
  for (int a = 0; a < 6; ++a) elastic[a] = strain[a] - old.plastic[a] - step_ratio * old.plastic_step[a];
  const double kappa = std::max(old.compression, c.law.eps_linear) + step_ratio * old.compression_step;
  const double limit = std::max(old.tension, c.law.eps_ct) + step_ratio * old.tension_step;
  SolidUpdate update;
  const Hardening start = calc_hardening(c.law, kappa);
  if (!is_finite(elastic)) {
    update.converged = false;
    update.response = make_elastic_response(c, {}, start.integrity);
    return update;
  }
  if (is_elastic(c, elastic, limit, start, trial)) {
    update.response = make_elastic_response(c, trial, start.integrity);
    return update;
  }
  const Principal principal = find_principal(elastic);
  ReturnMap m = make_return_map(c, principal.value, limit, kappa, start, false);
  const double tolerance = 1e-13 * (calc_largest(principal.value) + c.law.eps_linear);
  const int iterations = solve_cracks(m, tolerance);
  update.converged = iterations > 0;
  update.iterations = std::abs(iterations) - 1;
  update.response = make_response(m, principal.axis, m.hardening.integrity, 0, c.floor);
  return update;
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
