#include "nearfield/shell.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/unit.h"
#include "nearfield/axial.h"
#include "nearfield/family.h"
#include "nearfield/fibres.h"

namespace topple::nearfield {

namespace {

/// Bars whose share across the hinge line is below this are left out.
constexpr double least_share = 0.01;

double calc_share(const ShellInput::Mesh& m) {
  const double c = std::cos(m.angle);
  return c * c;
}

void check_shell(const ShellInput& in) {
  const auto complain = [&](const std::string& what) { throw InputError("E614", "panel '" + in.name + "': " + what); };
  if (!(in.thickness > 0) || !std::isfinite(in.thickness)) complain("thickness must be positive");
  if (!(in.length > 0) || !std::isfinite(in.length)) complain("the length of a zone must be positive");
  for (const ShellInput::Mesh& m : in.mesh) {
    if (!(m.area >= 0)) complain("reinforcement must not be negative");
    if (!(std::abs(m.at) < 0.5 * in.thickness)) complain("bars lie outside of the thickness");
    if (!std::isfinite(m.angle)) complain("the direction of bars must be a number");
  }
}

Fibres make_layers(const ShellInput& in) {
  Fibres f;
  material::ConcreteInput c;
  c.fc = in.concrete.fc, c.fct = in.concrete.fct, c.Ec = in.concrete.Ec, c.eps_c1 = in.concrete.eps_c1;
  c.Gf = in.concrete.Gf, c.Gcl = in.concrete.Gcl, c.l_eq = in.length;
  f.core = f.cover = material::make_concrete(c);
  f.half_depth = 0.5 * in.thickness;
  constexpr int layers = 40;
  const double t = in.thickness / layers;
  for (int i = 0; i < layers; ++i) {
    f.at.push_back((i + 0.5) * t - f.half_depth);
    f.core_area.push_back(t), f.cover_area.push_back(0);
  }
  for (const ShellInput::Mesh& m : in.mesh) {
    // A bar at an angle is strained by cos² of what the zone is, and gives cos² of its force across the line.
    const double share = calc_share(m);
    if (!(m.area > 0) || share < least_share) continue;
    material::SteelInput s;
    s.fy = in.steel.fy, s.fu = in.steel.fu, s.Es = in.steel.Es * share, s.eps_u = in.steel.eps_u / share;
    s.diameter = m.diameter, s.free_length = m.diameter > 0 ? in.length : 0;
    f.bar_at.push_back(m.at), f.bar_area.push_back(m.area * share), f.bar_law.push_back(material::make_steel(s));
  }
  return f;
}

/// Without bars a zone turns until its one crack has opened and its edge has crushed.
std::vector<double> make_plain_rotations(const Fibres& f, double thickness, double length) {
  const double crack = 2 * f.core.eps_ct * length / thickness, crush = f.core.eps_c1 * length / thickness;
  const double first = crack > 0 ? 0.5 * crack : 0.05 * crush;
  const double last = std::min(1.0, std::max(4 * f.core.eps_tu * (crack > 0) * length / thickness, 80 * crush));
  return make_rotations(first, std::max(2 * first, crush), last);
}

}  // namespace

product::Concrete make_masonry(double strength, double modulus) {
  product::Concrete c;
  c.fc = strength, c.Ec = modulus;
  c.fct = std::min(0.04 * strength, 0.3 * unit::MPa);
  c.Gf = 10;
  c.Gcl = 1.6e-3 * strength;
  c.eps_c1 = 2 * strength / modulus;
  return c;
}

ShellInput make_shell_input(const product::Panel& panel, const product::Concrete* concrete, const product::Steel* steel,
                            double length) {
  make_panel_rcc(panel, concrete, steel);  // the same refusals
  ShellInput in;
  in.name = panel.name, in.thickness = panel.thickness;
  in.length = length > 0 ? length : panel.thickness;
  in.concrete = concrete ? *concrete : make_masonry(panel.strength, panel.modulus);
  if (!steel) return in;
  in.steel = *steel;
  const double at = 0.5 * panel.thickness - panel.cover;
  if (panel.as_bottom > 0) in.mesh.push_back({at, panel.as_bottom, 0, 0});
  if (panel.as_top > 0) in.mesh.push_back({-at, panel.as_top, 0, 0});
  return in;
}

double ShellRcc::calc_EI_effective(double N) const {
  return 0.5 * (interpolate_EI(pos, N, length) + interpolate_EI(neg, N, length));
}

ShellRcc make_shell_rcc(const ShellInput& in) {
  check_shell(in);
  const Fibres f = make_layers(in);
  ShellRcc out;
  out.length = in.length;
  const double t = in.thickness, n = in.concrete.Ec;
  out.EA = n * t, out.EI = n * t * t * t / 12;
  TensionBars bars;
  double least_strain = 1;
  for (size_t i = 0; i < f.bar_at.size(); ++i) {
    const material::Steel& s = f.bar_law[i];
    out.EA += (s.Es - n) * f.bar_area[i], out.EI += (s.Es - n) * f.bar_area[i] * f.bar_at[i] * f.bar_at[i];
    bars.yield += f.bar_area[i] * s.fy, bars.rupture += f.bar_area[i] * s.fu;
    least_strain = std::min(least_strain, s.eps_u - s.fu / s.Es);
  }
  // Without bars the zone has parted when its crack has opened.
  bars.plastic_strain = f.bar_at.empty() ? f.core.eps_tu / 0.9 : least_strain;

  const Peak peak = find_crushing(f);
  out.compression = make_compression(f, peak, out.EA, in.length);
  out.tension = make_tension(bars, f.core, t, in.length);
  const double rupture = std::max({bars.rupture, t * f.core.fct, 1e-6 * peak.force});
  const std::vector<double> force = make_forces(peak.force, rupture);
  ZoneInput grid;  // the grid of a zone of the same depth
  grid.steel = in.steel, grid.length = in.length;
  const auto rotation = f.bar_at.empty() ? make_plain_rotations(f, t, in.length) : make_rotations(grid, t, f.core);
  out.pos = make_family(f, 1, force, rotation, in.length);
  out.neg = make_family(f, -1, force, rotation, in.length);
  return out;
}

}  // namespace topple::nearfield
