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

/// Stress over the gross area as a function of strain, both positive in tension.
using Curve = std::function<double(double)>;

/// Points of a law from the curve of the whole section.
///   eps_y  strain at which the bars yield; eps_u at which they tear
void fill_law(fem::ExplicitMaterial& m, const Curve& curve, double eps_y, double eps_u) {
  // peak in compression
  double peak = 0, at_peak = 0;
  for (double e = 1e-4; e < 0.05; e += 1e-4)
    if (const double s = -curve(-e); s > peak) peak = s, at_peak = e;
  // where compression has come down to what the bars leave
  const double rest = -curve(-0.5);
  double spent = at_peak;
  while (spent < 0.5 && -curve(-spent) > rest + kSpent * (peak - rest)) spent += 1e-4;
  m.compression_limit = spent;
  m.tension_limit = eps_u;
  const double length = std::max(spent - at_peak, 1e-3);
  std::vector<double> strain{0};
  for (const double share : {0.1, 0.25, 0.5, 1.0}) strain.push_back(share * length);
  strain.push_back(std::max(0.5 * eps_u, 1.5 * strain.back()));
  strain.push_back(std::max(eps_u, 1.5 * strain.back()));
  const double steepest = 0.5 * m.E;  // the solver refuses three shear moduli, 1.25 E
  for (const double e : strain) {
    fem::YieldPoint p;
    p.strain = e;
    p.compression = std::max(-curve(-(at_peak + e)), kLeast * peak);
    p.tension = std::max(curve(std::min(eps_y + e, 0.999 * eps_u)), kLeast * peak);
    if (!m.yield.empty()) {
      const fem::YieldPoint& last = m.yield.back();
      p.compression = std::max(p.compression, last.compression - steepest * (e - last.strain));
      p.tension = std::max(p.tension, last.tension - steepest * (e - last.strain));
    }
    m.yield.push_back(p);
  }
}

}  // namespace

fem::ExplicitMaterial make_section_material(const nearfield::ZoneInput& in, const std::string& name) {
  nearfield::ZoneInput zone = in;
  zone.length = std::min(in.length, 0.9 * nearfield::calc_largest_zone_length(in.concrete));
  const nearfield::Fibres fibres = nearfield::make_fibres(zone, nearfield::Axis::Y);
  const double area = in.section.area();
  double steel = 0;
  for (const double a : fibres.bar_area) steel += a;
  fem::ExplicitMaterial m;
  m.name = name;
  m.density = in.concrete.density;
  m.nu = kPoisson;
  m.E = in.concrete.Ec + steel / area * (in.steel.Es - in.concrete.Ec);
  fill_law(
      m, [&](double e) { return nearfield::calc_resultants(fibres, e, 0).N / area; }, in.steel.fy / in.steel.Es,
      in.steel.eps_u);
  return m;
}

fem::ExplicitMaterial make_panel_material(const product::Plan& plan, const product::Panel& panel, double length) {
  fem::ExplicitMaterial m;
  m.name = panel.name;
  m.density = panel.density;
  m.nu = kPoisson;
  if (panel.concrete < 0) {
    m.E = panel.modulus;
    m.yield = {{0, 0.1e6, panel.strength}};
    m.tension_limit = m.compression_limit = 0.01;
    return m;
  }
  const product::Concrete& concrete = plan.concretes[static_cast<size_t>(panel.concrete)];
  const double share = (panel.as_top + panel.as_bottom) / panel.thickness;
  if (panel.steel < 0 || !(share > 0)) {
    // plain concrete: pulls with its own strength until its crack is open
    m.E = concrete.Ec;
    const double crack = 5.14 * concrete.Gf / concrete.fct / length;
    m.yield = {{0, concrete.fct, concrete.fc}};
    m.tension_limit = std::max(crack, 1e-3);
    m.compression_limit = 0.01;
    return m;
  }
  const product::Steel& steel = plan.steels[static_cast<size_t>(panel.steel)];
  // a strip of the panel with its bars as a section without ties
  nearfield::ZoneInput in;
  in.concrete = concrete;
  in.steel = steel;
  in.length = length;
  in.section.name = panel.name;
  in.section.width = 1;
  in.section.height = panel.thickness;
  in.section.concrete = panel.concrete;
  in.section.steel = panel.steel;
  in.section.cover = panel.cover;
  // the plan gives no diameters of a panel's bars; they lie in concrete and are taken as held
  in.length = std::min(length, 0.9 * nearfield::calc_largest_zone_length(concrete));
  const nearfield::Fibres plain = nearfield::make_fibres(in, nearfield::Axis::Y);
  const double area = in.section.area();
  m.E = concrete.Ec + share * (steel.Es - concrete.Ec);
  fill_law(
      m,
      [&](double e) {
        const double size =
            std::min(std::abs(e) * steel.Es,
                     steel.fy + std::max(0.0, std::abs(e) - steel.fy / steel.Es) * (steel.fu - steel.fy) / steel.eps_u);
        return nearfield::calc_resultants(plain, e, 0).N / area + share * std::copysign(size, e);
      },
      steel.fy / steel.Es, steel.eps_u);
  return m;
}

}  // namespace topple::farfield
