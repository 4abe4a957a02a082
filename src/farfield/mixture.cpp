#include "farfield/mixture.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "nearfield/fibres.h"

namespace topple::farfield {

namespace {

constexpr double kPoisson = 0.2;
/// What crushed concrete keeps of its strength when its element goes; the hyperbola of its softening never ends.
constexpr double kSpent = 0.05;
/// Part of the peak that a law keeps at least, so that its yield surface does not vanish.
constexpr double kLeast = 0.01;
/// Softening of at most so many E: the solver refuses three shear moduli, 1.25 E.
constexpr double kSteepest = 0.5;

/// Largest mean tension over the yield stress in tension: that of pure pull along a member, and in both directions of a
/// panel. What is held from contracting sideways, at a foot or beside a stiffer part, cracks all the same.
constexpr double kAlongMember = 1.0 / 3, kInPanel = 2.0 / 3;

/// Stress over the gross area as a function of strain, both positive in tension.
using Curve = std::function<double(double)>;

/// A yield stress over the plastic strain, points in rising order.
struct Path {
  std::vector<double> strain, stress;
  /// Adds a point, not steeper down than the solver takes.
  void add(double x, double y, double E) {
    if (!strain.empty()) {
      if (x < strain.back() + 1e-6) return;
      y = std::max(y, stress.back() - kSteepest * E * (x - strain.back()));
    }
    strain.push_back(x), stress.push_back(y);
  }
  double at(double x) const {
    const size_t i = static_cast<size_t>(std::upper_bound(strain.begin(), strain.end(), x) - strain.begin());
    if (i == 0) return stress.front();
    if (i == strain.size()) return stress.back();
    return stress[i - 1] + (stress[i] - stress[i - 1]) * (x - strain[i - 1]) / (strain[i] - strain[i - 1]);
  }
};

/// Strains between which straight lines come nearest to both paths: one after the other in the piece with the largest
/// area between chord and path (in parts of the path's largest stress), where they are farthest apart.
std::vector<double> choose_strains(const Path& c, const Path& t) {
  std::vector<double> all = c.strain;
  all.insert(all.end(), t.strain.begin(), t.strain.end());
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end(), [](double a, double b) { return b - a < 1e-6; }), all.end());
  const double scale[2] = {*std::max_element(c.stress.begin(), c.stress.end()),
                           *std::max_element(t.stress.begin(), t.stress.end())};
  std::vector<size_t> chosen{0, all.size() - 1};
  while (chosen.size() < fem::kMostYieldPoints) {
    double worst = 0;
    size_t where = 0, best = 0;
    for (size_t i = 0; i + 1 < chosen.size(); ++i)
      for (int which = 0; which < 2; ++which) {
        const Path& path = which == 0 ? c : t;
        const double from = all[chosen[i]], to = all[chosen[i + 1]], low = path.at(from), high = path.at(to);
        double area = 0, farthest = 0;
        size_t middle = 0;
        for (size_t k = chosen[i] + 1; k < chosen[i + 1]; ++k) {
          const double gap = std::abs(path.at(all[k]) - low - (high - low) * (all[k] - from) / (to - from));
          area += gap * 0.5 * (all[k + 1] - all[k - 1]) / scale[which];
          if (gap > farthest) farthest = gap, middle = k;
        }
        if (middle > 0 && area > worst) worst = area, where = i, best = middle;
      }
    if (best == 0) break;
    chosen.insert(chosen.begin() + static_cast<std::ptrdiff_t>(where) + 1, best);
  }
  std::vector<double> out;
  for (const size_t i : chosen) out.push_back(all[i]);
  return out;
}

/// Points of a law from the curve of the whole section. Plastic strain is what elasticity of the mixture does not give,
/// so that the work is the curve's. Up to the yield of the bars cracks spread over the element; from there, and in
/// compression from the peak, strains gather in the zone.
///   eps_cr  strain at which concrete cracks, eps_y at which the bars yield, eps_u at which they tear
///   spread  length of the zone over that of the element
void fill_law(fem::ExplicitMaterial& m, const Curve& curve, double eps_cr, double eps_y, double eps_u, double spread) {
  // compression: peak, and where it has come down to what the bars leave
  double peak = 0, at_peak = 0;
  for (double e = 1e-4; e < 0.05; e += 1e-4)
    if (const double s = -curve(-e); s > peak) peak = s, at_peak = e;
  const double rest = -curve(-0.5);
  Path c, t;
  c.add(0, peak, m.E);
  m.compression_limit = 0;
  for (double e = at_peak, step = 2e-5; e < 0.5 && (m.compression_limit == 0 || e < at_peak + eps_u);
       step = std::min(1.02 * step, 2e-3)) {
    e += step;
    const double s = std::max(-curve(-e), kLeast * peak);
    c.add(spread * (e - at_peak + (peak - s) / m.E), s, m.E);
    if (m.compression_limit == 0 && s <= rest + kSpent * (peak - rest)) m.compression_limit = c.strain.back();
  }
  if (m.compression_limit == 0) m.compression_limit = c.strain.back();

  // tension: cracked concrete, then bars. One crack takes all if they are weaker than the concrete was.
  const double cracking = curve(eps_cr), yielding = curve(eps_y), early = cracking < yielding ? 1 : spread;
  t.add(0, std::max(cracking, kLeast * peak), m.E);
  for (double e = eps_cr, step = 1e-5; e < eps_u; step = std::min(1.03 * step, 2e-3)) {
    const double last = e;
    e += step;
    // a corner of the curve is met
    if (last < eps_y && e > eps_y) e = eps_y;
    if (e > 0.999 * eps_u) break;
    const double s = std::max(curve(e), kLeast * peak);
    const double before = early * ((std::min(e, eps_y) - eps_cr) - (std::min(s, yielding) - cracking) / m.E);
    if (e <= eps_y) m.crack_strain = std::max(before, 0.0);
    t.add(std::max(before, 0.0) + spread * std::max(0.0, e - eps_y), s, m.E);
  }
  m.tension_limit = std::max(t.strain.back(), spread * eps_u);
  for (const double e : choose_strains(c, t)) m.yield.push_back({e, t.at(e), c.at(e)});
}

}  // namespace

fem::ExplicitMaterial make_section_material(const nearfield::ZoneInput& in, double element_length,
                                            const std::string& name) {
  nearfield::ZoneInput zone = in;
  zone.length = std::min(in.length, 0.9 * nearfield::calc_largest_zone_length(in.concrete));
  nearfield::Fibres fibres = nearfield::make_fibres(zone, nearfield::Axis::Y);
  // bars buckle between ties, also where a zone is shorter
  nearfield::ZoneInput tied = zone;
  tied.length = std::clamp(in.section.tie_spacing, zone.length, 0.9 * nearfield::calc_largest_zone_length(in.concrete));
  fibres.bar_law = nearfield::make_fibres(tied, nearfield::Axis::Y).bar_law;
  const double area = in.section.area();
  double steel = 0;
  for (const double a : fibres.bar_area) steel += a;
  fem::ExplicitMaterial m;
  m.name = name;
  m.density = in.concrete.density;
  m.nu = kPoisson;
  m.E = in.concrete.Ec + steel / area * (in.steel.Es - in.concrete.Ec);
  m.tension_cutoff = m.compression_cutoff = kAlongMember;
  fill_law(
      m, [&](double e) { return nearfield::calc_resultants(fibres, e, 0).N / area; }, fibres.core.eps_ct,
      in.steel.fy / in.steel.Es, in.steel.eps_u, zone.length / element_length);
  return m;
}

fem::ExplicitMaterial make_panel_material(const product::Plan& plan, const product::Panel& panel, double zone_length,
                                          double element_length) {
  fem::ExplicitMaterial m;
  m.name = panel.name;
  m.density = panel.density;
  m.nu = kPoisson;
  m.tension_cutoff = m.compression_cutoff = kInPanel;
  if (panel.concrete < 0) {
    m.E = panel.modulus;
    m.yield = {{0, 0.1e6, panel.strength}};
    m.tension_limit = m.compression_limit = m.crack_strain = 0.01;
    return m;
  }
  const product::Concrete& concrete = plan.concretes[static_cast<size_t>(panel.concrete)];
  const double share = (panel.as_top + panel.as_bottom) / panel.thickness;
  if (panel.steel < 0 || !(share > 0)) {
    // plain concrete: its crack opens along two lines (Hillerborg 1985: a third of fct at 0.8, none at 3.6 Gf/fct) and
    // it crushes along one, each with its energy over the length
    m.E = concrete.Ec;
    const double most = concrete.fct / (kSteepest * m.E), opening = concrete.Gf / concrete.fct / element_length;
    const double knee = std::max(0.8 * opening, most), end = std::max(3.6 * opening, knee + most);
    const double crushed = std::max(2 * concrete.Gcl / concrete.fc / element_length, concrete.fc / (kSteepest * m.E));
    std::vector<double> strains{0, knee, end, crushed};
    std::sort(strains.begin(), strains.end());
    for (const double e : strains) {
      const double held = e < knee ? 1 - 2.0 / 3 * e / knee : std::max(0.0, (end - e) / (end - knee) / 3);
      if (!m.yield.empty() && e < m.yield.back().strain + 1e-9) continue;
      m.yield.push_back({e, std::max(held, kLeast) * concrete.fct, std::max(1 - e / crushed, kLeast) * concrete.fc});
    }
    m.crack_strain = end;
    m.tension_limit = std::max(end, 0.01);  // what has cracked still bears when pushed
    m.compression_limit = std::max(crushed, 0.01);
    return m;
  }
  const product::Steel& steel = plan.steels[static_cast<size_t>(panel.steel)];
  // a strip of the panel with its bars as a section without ties
  nearfield::ZoneInput in;
  in.concrete = concrete;
  in.steel = steel;
  in.section.name = panel.name;
  in.section.width = 1;
  in.section.height = panel.thickness;
  in.section.concrete = panel.concrete;
  in.section.steel = panel.steel;
  in.section.cover = panel.cover;
  // the plan gives no diameters of a panel's bars; they lie in concrete and are taken as held
  in.length = std::min(zone_length, 0.9 * nearfield::calc_largest_zone_length(concrete));
  const nearfield::Fibres plain = nearfield::make_fibres(in, nearfield::Axis::Y);
  const double area = in.section.area();
  m.E = concrete.Ec + share * (steel.Es - concrete.Ec);
  fill_law(
      m,
      [&](double e) {
        const double eps_y = steel.fy / steel.Es, plastic = std::max(0.0, std::abs(e) - eps_y);
        const double size = std::min(
            {std::abs(e) * steel.Es, steel.fy + plastic * (steel.fu - steel.fy) / (steel.eps_u - eps_y), steel.fu});
        return nearfield::calc_resultants(plain, e, 0).N / area + share * std::copysign(size, e);
      },
      plain.core.eps_ct, steel.fy / steel.Es, steel.eps_u, in.length / element_length);
  return m;
}

}  // namespace topple::farfield
