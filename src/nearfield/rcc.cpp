#include "nearfield/rcc.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "base/unit.h"
#include "nearfield/axial.h"
#include "nearfield/biaxial.h"
#include "nearfield/family.h"
#include "nearfield/fibres.h"
#include "nearfield/zone.h"

namespace topple::nearfield {

namespace {

constexpr double pi = 3.14159265358979323846;

double calc_bar_force(const ZoneInput& in, double stress) {
  return (1 - in.cut_bars) * in.section.steel_area() * stress;
}

double calc_flange_bar_force(const ZoneInput& in, double stress) {
  return (1 - in.cut_bars) * in.flange.bar_area() * stress;
}

bool is_symmetric(const ZoneInput& in, const Fibres& f, Axis axis) {
  if (axis == Axis::Y && in.flange.breadth > 0) return false;
  for (size_t i = 0; i < f.bar_at.size(); ++i) {
    double here = 0, mirrored = 0;
    for (size_t j = 0; j < f.bar_at.size(); ++j) {
      if (f.bar_law[j].eps_star != f.bar_law[i].eps_star) continue;
      if (std::abs(f.bar_at[j] - f.bar_at[i]) < 1e-6) here += f.bar_area[j];
      if (std::abs(f.bar_at[j] + f.bar_at[i]) < 1e-6) mirrored += f.bar_area[j];
    }
    if (std::abs(here - mirrored) > 1e-9 * here) return false;
  }
  return true;
}

/// Shear and torsion, docs/theory/rcc.md (12) to (16).
void add_shear(const ZoneInput& in, Rcc& out) {
  const product::Section& s = in.section;
  const material::ConcreteInput c = make_concrete_input(in);
  const double edge = 2 * (s.cover + 0.5 * s.tie_diameter);
  const double b_core = std::max(0.0, s.width - edge), h_core = std::max(0.0, s.height - edge);
  const double kept = in.concrete_loss >= 1 ? 0 : 1 - in.cut_concrete;
  const double b = in.cover_lost ? b_core : s.width, h = in.cover_lost ? h_core : s.height;
  const double area = kept * (b * h);
  const bool tied = s.tie_diameter > 0 && s.tie_spacing > 0;
  const double leg = 0.25 * pi * s.tie_diameter * s.tie_diameter;
  const double cot30 = std::sqrt(3.0);
  const double concrete = 0.29 * std::sqrt(c.fc / unit::MPa) * unit::MPa * 0.8 * area;
  const double crushing = 0.6 * c.fc * 0.8 * area / (cot30 + 1 / cot30);
  const auto shear = [&](double depth, int legs) {
    const double ties = tied && depth > 0 ? legs * leg * in.steel.fy * depth * cot30 / s.tie_spacing : 0;
    return std::min(concrete + ties, crushing);
  };
  out.shear_y = shear(b_core, s.tie_legs_y);
  out.shear_z = shear(h_core, s.tie_legs_z);
  out.shear_friction = kept > 0 ? (1 - 0.3) / (2 * 3.0) : 0;
  // a section that is all bars still has their dowels, which bend over the zone or yield in shear
  double dowel = 0;
  for (const product::Bar& bar : s.bars)
    dowel += (1 - in.cut_bars) * in.steel.fy *
             std::min(2 * std::pow(bar.diameter, 3) / 6 / in.length, bar.area / std::sqrt(3.0));
  out.shear_y = std::max(out.shear_y, dowel);
  out.shear_z = std::max(out.shear_z, dowel);

  const double enclosed = b_core * h_core, perimeter = 2 * (b_core + h_core);
  const double a = std::max({b, h, 1e-6}), t = std::min(b, h);
  const double cracking = kept * c.fct * t * t * a / (3 + 1.8 * t / a);
  double truss = 0;
  if (tied && perimeter > 0) {
    const double along = calc_bar_force(in, in.steel.fy) / perimeter, around = leg * in.steel.fy / s.tie_spacing;
    const double wall = b * h / (2 * (b + h));
    truss = std::min(2 * enclosed * std::sqrt(along * around), 0.6 * c.fc * kept * enclosed * wall);
  }
  out.torsion = std::max(cracking, truss);
  // Saint-Venant's constant of a rectangle.
  const double saint_venant = a * t * t * t * (1.0 / 3 - 0.21 * t / a * (1 - std::pow(t / a, 4) / 12));
  const double G = c.Ec / 2.4;
  out.GA = 5.0 / 6 * G * kept * (b * h);
  out.GJ = 0.2 * G * kept * saint_venant;
  if (kept <= 0) out.GA = out.GJ = 0;
}

}  // namespace

double Rcc::calc_EI_effective_y(double N) const {
  return 0.5 * (interpolate_EI(y_pos, N, length) + interpolate_EI(y_neg, N, length));
}
double Rcc::calc_EI_effective_z(double N) const {
  return 0.5 * (interpolate_EI(z_pos, N, length) + interpolate_EI(z_neg, N, length));
}

double calc_largest_zone_length(const product::Concrete& concrete) {
  ZoneInput in;
  in.concrete = concrete;
  in.length = 1;
  return material::calc_largest_l_eq(make_concrete_input(in));
}

void check_zone(const ZoneInput& in) {
  const product::Section& s = in.section;
  const auto complain = [&](const std::string& what, const std::string& help = {}) {
    throw InputError("E611", "section '" + s.name + "': " + what, help);
  };
  const auto is_share = [](double v) { return v >= 0 && v <= 1; };
  if (!(s.width > 0) || !(s.height > 0)) complain("width and height must be positive");
  if (!(in.length > 0) || !std::isfinite(in.length)) complain("the length of a zone must be positive");
  if (!(s.cover >= 0) || !(s.tie_diameter >= 0) || !(s.tie_spacing >= 0))
    complain("cover, diameter and spacing of the ties must not be negative");
  if (!is_share(in.cut_bars) || !is_share(in.cut_concrete) || !is_share(in.concrete_loss))
    complain("cut_bars, cut_concrete and concrete_loss must lie between 0 and 1");
  const Flange& flange = in.flange;
  if (!(flange.breadth >= 0)) complain("the breadth of a flange must not be negative");
  if (flange.breadth > 0 && !(flange.thickness > 0 && flange.thickness <= s.height))
    complain("a flange must be thinner than the section is high");
  for (const Flange::Bars& bars : {flange.top, flange.bottom})
    if (!(bars.area >= 0) || !(bars.depth >= 0 && bars.depth <= s.height))
      complain("a flange's bar lies outside of it");
  for (const product::Bar& bar : s.bars) {
    if (!(bar.area > 0) || !(bar.diameter > 0)) complain("bars need a positive area and diameter");
    if (!(std::abs(bar.y) <= 0.5 * s.width) || !(std::abs(bar.z) <= 0.5 * s.height))
      complain("a bar lies outside of the section", "bars are placed from the section's centre");
  }
  if (s.steel_area() > 0.2 * s.area()) complain("the bars fill more than a fifth of the section");
}

Rcc make_rcc(const ZoneInput& in) {
  check_zone(in);
  const Fibres about_y = make_fibres(in, Axis::Y), about_z = make_fibres(in, Axis::Z);
  Rcc out;
  out.length = in.length;

  double area = 0;
  for (size_t i = 0; i < about_y.at.size(); ++i) area += about_y.core_area[i] + about_y.cover_area[i];
  const double n = in.steel.Es - (area > 0 ? about_y.kept * about_y.cover.Ec : 0);
  const auto calc_EI = [n, has_flange = in.flange.breadth > 0](const Fibres& f) {
    // about the centroid; that of a section with a flange is its concrete's
    double A = 0, S = 0, EI = 0;
    for (size_t i = 0; i < f.at.size(); ++i) {
      const double a = f.core_area[i] + f.cover_area[i];
      A += a, S += a * f.at[i];
    }
    for (size_t i = 0; i < f.bar_at.size() && !has_flange; ++i) {
      const double a = n / f.cover.Ec * f.bar_area[i];
      A += a, S += a * f.bar_at[i];
    }
    // of a symmetric section only round-off
    const double centre = A > 0 && std::abs(S) > 1e-9 * A * f.half_depth ? S / A : 0;
    const auto add = [&EI, centre](double EA, double at) { EI += EA * (at - centre) * (at - centre); };
    for (size_t i = 0; i < f.at.size(); ++i) add(f.cover.Ec * (f.core_area[i] + f.cover_area[i]), f.at[i]);
    for (size_t i = 0; i < f.bar_at.size(); ++i) add(n * f.bar_area[i], f.bar_at[i]);
    return EI;
  };
  out.EI_y = calc_EI(about_y), out.EI_z = calc_EI(about_z);
  out.EA = about_y.cover.Ec * area;
  for (const double a : about_y.bar_area) out.EA += n * a;
  if (!(out.EA > 0)) throw InputError("E612", "section '" + in.section.name + "': nothing is left of it");

  const Peak peak = find_crushing(about_y);
  out.compression = make_compression(about_y, peak, out.EA, in.length);
  const TensionBars bars{calc_bar_force(in, in.steel.fy) + calc_flange_bar_force(in, in.flange.steel.fy),
                         calc_bar_force(in, in.steel.fu) + calc_flange_bar_force(in, in.flange.steel.fu),
                         in.steel.eps_u - in.steel.fu / in.steel.Es};
  out.tension = make_tension(bars, about_y.cover, area, in.length);
  const std::vector<double> force = make_forces(peak.force, calc_rupture_force(in, area, about_y.cover, peak.force));

  const auto rotation_y = make_rotations(in, in.section.height, about_y.cover);
  const auto rotation_z = make_rotations(in, in.section.width, about_z.cover);
  out.y_pos = make_family(about_y, 1, force, rotation_y, in.length);
  out.y_neg = is_symmetric(in, about_y, Axis::Y) ? out.y_pos : make_family(about_y, -1, force, rotation_y, in.length);
  const bool same = about_y.at == about_z.at && about_y.core_area == about_z.core_area &&
                    about_y.cover_area == about_z.cover_area && about_y.bar_at == about_z.bar_at &&
                    about_y.bar_area == about_z.bar_area && in.section.width == in.section.height;
  if (same) {
    out.z_pos = out.y_neg, out.z_neg = out.y_pos;
  } else {
    out.z_pos = make_family(about_z, -1, force, rotation_z, in.length);
    out.z_neg = is_symmetric(in, about_z, Axis::Z) ? out.z_pos : make_family(about_z, 1, force, rotation_z, in.length);
  }
  add_shear(in, out);
  // a slab does not bend aside with its beam: that of the web
  out.biaxial_exponent = in.flange.breadth > 0 ? calc_biaxial_exponent(in) : calc_biaxial_exponent(in, out);
  out.damage_share = 1 - about_y.core.b_c;
  return out;
}

}  // namespace topple::nearfield
