#include "nearfield/fired.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "nearfield/family.h"
#include "nearfield/fibres.h"
#include "nearfield/zone.h"

namespace topple::nearfield {

namespace {

/// One bar between the faces of the destroyed length: force over elongation, docs/theory/rcc.md (18), (19).
struct FreeBar {
  double at = 0, area = 0;                   // along the gradient [m], [m²]
  double length = 0;                         // [m]
  double Es = 0, fy = 0, fu = 0, eps_u = 0;  // [Pa]
  double buckling = 0;                       // stress at which it buckles [Pa]
  double mechanism = 0;                      // 4 M_p / (A h_d) [Pa]
  double calc_stress(double elongation, double& tangent) const {
    const double eps = elongation / length;
    if (eps >= 0) {
      const double eps_y = fy / Es;
      if (eps <= eps_y) return tangent = Es, Es * eps;
      if (eps > eps_u) return tangent = 0, 0;
      tangent = (fu - fy) / (eps_u - eps_y);
      return fy + tangent * (eps - eps_y);
    }
    if (-Es * eps <= buckling) return tangent = Es, Es * eps;
    // Three plastic hinges, θ from the shortening.
    const double cosine = std::max(0.0, 1 + eps), sine = std::sqrt(std::max(1e-12, 1 - cosine * cosine));
    const double stress = mechanism / sine;
    if (stress >= buckling) return tangent = 0, -buckling;
    tangent = -mechanism * cosine / (sine * sine * sine);
    return -stress;
  }
};

struct CageForces {
  double N = 0, M = 0, dN = 0;  // [N], [N·m], ∂N/∂u [N/m]
};
CageForces calc_forces(const std::vector<FreeBar>& bars, double u, double phi) {
  CageForces out;
  for (const FreeBar& b : bars) {
    double tangent = 0;
    const double F = b.area * b.calc_stress(u + phi * b.at, tangent);
    out.N += F, out.M += F * b.at, out.dN += b.area * tangent / b.length;
  }
  return out;
}

/// Elongation in the middle at which the cage carries N, as a cage under a dead force moves; false: none on that way.
bool find_elongation(const std::vector<FreeBar>& bars, double N, double tolerance, double phi, double& u,
                     CageForces& at) {
  const double length = bars.front().length, largest = 2e-3 * length;
  at = calc_forces(bars, u, phi);
  if (std::abs(at.N - N) <= tolerance) return true;
  const double direction = at.N > N ? -1 : 1;
  double other = u, step = 0;
  for (int i = 0; (at.N - N) * direction < 0; ++i) {
    const double newton = at.dN > 0 ? 1.02 * std::abs(at.N - N) / at.dN : largest;
    step = std::min(std::max(newton, 1.5 * step), largest * (1 + 0.2 * i));
    other = u, u += direction * step;
    if (std::abs(u) > length) return false;
    at = calc_forces(bars, u, phi);
    if (std::abs(at.N - N) <= tolerance) return true;
  }
  double low = std::min(u, other), high = std::max(u, other);
  for (int i = 0; i < 200 && high - low > 1e-16 * length; ++i) {
    double next = at.dN > 0 ? u - (at.N - N) / at.dN : low - 1;
    if (!(next > low && next < high) || i % 5 == 4) next = 0.5 * (low + high);
    u = next, at = calc_forces(bars, u, phi);
    if (std::abs(at.N - N) <= tolerance) return true;
    (at.N > N ? high : low) = u;
  }
  return true;
}

/// Rotation without moment under N; bars that differ between the sides turn the cage under N alone.
bool find_origin(const std::vector<FreeBar>& bars, double N, double tolerance, double step, double& u, double& origin) {
  CageForces f;
  origin = 0;
  if (!find_elongation(bars, N, tolerance, 0, u, f)) return false;
  double scale = 0;
  for (const FreeBar& b : bars) scale += b.area * b.fy * std::abs(b.at);
  if (std::abs(f.M) <= 1e-9 * scale) return true;
  const double sign = f.M > 0 ? -1 : 1;
  double inside = 0, outside = sign * step;
  for (int i = 0;; ++i, inside = outside, outside *= 1.5) {
    if (i == 30 || !find_elongation(bars, N, tolerance, outside, u, f)) return false;
    if (f.M * sign > 0) break;
  }
  for (int i = 0; i < 60 && std::abs(f.M) > 1e-9 * scale; ++i) {
    origin = 0.5 * (inside + outside);
    if (!find_elongation(bars, N, tolerance, origin, u, f)) return false;
    (f.M * sign > 0 ? outside : inside) = origin;
  }
  return true;
}

MomentFamily make_cage_family(std::vector<FreeBar> bars, int direction, double depth) {
  MomentFamily out;
  double crushing = 0, rupture = 0;
  for (FreeBar& b : bars) {
    b.at *= direction;
    crushing += b.area * b.buckling, rupture += b.area * b.fu;
  }
  const FreeBar& any = bars.front();
  const double yield = 1.7 * any.fy / any.Es * any.length / depth;
  out.normal_force = make_forces(crushing, rupture);
  out.rotation = make_rotations(0.1 * std::min(1.0, any.buckling / any.fy) * yield, yield, 1.0);
  const size_t K = out.normal_force.size(), J = out.rotation.size();
  out.moment.assign(K * J, 0.0);
  const double tolerance = 1e-9 * rupture;
  for (size_t k = 0; k < K; ++k) {
    double peak = 0;
    size_t held = 0;
    double u = 0, origin = 0;
    CageForces f;
    double* M = &out.moment[k * J];
    if (k > 0 && k + 1 < K && find_origin(bars, out.normal_force[k], tolerance, 0.01 * yield, u, origin)) {
      for (size_t j = 1; j + 1 < J; ++j) {
        if (!find_elongation(bars, out.normal_force[k], tolerance, origin + out.rotation[j], u, f)) break;
        M[j] = std::max(0.0, f.M);
        peak = std::max(peak, M[j]);
        held = j;
      }
    }
    // First yield or buckling shows as three quarters of the peak.
    double at = 0;
    for (size_t j = 1; j <= held && peak > 0; ++j)
      if (M[j] >= 0.75 * peak) {
        at = out.rotation[j - 1] +
             (0.75 * peak - M[j - 1]) / (M[j] - M[j - 1]) * (out.rotation[j] - out.rotation[j - 1]);
        break;
      }
    out.yield_rotation.push_back(at > 0 ? at : yield), out.yield_moment.push_back(0.75 * peak);
  }
  return out;
}

}  // namespace

ZoneInput make_partial_zone(const ZoneInput& intact, const LocalDamage& damage) {
  ZoneInput left = intact;
  left.concrete_loss = std::max(intact.concrete_loss, damage.transition_damage);
  lose_cover(left);
  left.length = std::min(damage.destroyed_length, kLongestZoneShare * calc_largest_zone_length(intact.concrete));
  left.cut_concrete = 1 - (1 - intact.cut_concrete) * damage.residual_concrete;
  left.cut_bars = 1 - (1 - intact.cut_bars) * damage.residual_bars;
  left.section.tie_spacing = 0;
  left.free_bars = 2 * damage.destroyed_length;  // they buckle over all of it, as those of the cage
  return left;
}

FiredZone make_fired_zone(const ZoneInput& intact, const LocalDamage& damage) {
  const auto is_share = [](double v) { return v >= 0 && v <= 1; };
  if (!is_share(damage.transition_damage) || !is_share(damage.residual_concrete))
    throw InputError("E613", "transition damage and residual concrete must lie between 0 and 1");
  FiredZone out;
  out.cage = make_residual_cage(intact, damage.destroyed_length, damage.residual_bars);
  const product::Section& s = intact.section;
  const double h = damage.destroyed_length, share = damage.residual_bars * (1 - intact.cut_bars);
  std::vector<FreeBar> about_y, about_z;
  for (const product::Bar& bar : s.bars) {
    const double round = 0.25 * 3.14159265358979323846 * bar.diameter * bar.diameter;
    FreeBar b{bar.z, share * bar.area, h, intact.steel.Es, intact.steel.fy, intact.steel.fu, intact.steel.eps_u, 0, 0};
    b.buckling = material::calc_buckling_stress(b.fy, b.Es, bar.diameter, h);
    b.mechanism = 4 * b.fy * std::pow(bar.diameter, 3) / 6 / (round * h);
    about_y.push_back(b);
    b.at = -bar.y;  // a positive rotation about z pulls at -y
    about_z.push_back(b);
  }
  if (share > 0 && !about_y.empty()) {
    out.y_pos = make_cage_family(about_y, 1, s.height), out.y_neg = make_cage_family(about_y, -1, s.height);
    out.z_pos = make_cage_family(about_z, 1, s.width), out.z_neg = make_cage_family(about_z, -1, s.width);
  }

  ZoneInput beside = intact;
  beside.concrete_loss = std::max(intact.concrete_loss, damage.transition_damage);
  lose_cover(beside);
  beside.length = std::min(std::max(s.width, s.height), kLongestZoneShare * calc_largest_zone_length(intact.concrete));
  out.transition = make_rcc(beside);

  if (damage.residual_concrete > 0) out.partial = make_rcc(make_partial_zone(intact, damage));
  return out;
}

}  // namespace topple::nearfield
