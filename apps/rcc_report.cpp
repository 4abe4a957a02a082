#include "rcc_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/unit.h"
#include "nearfield/biaxial.h"
#include "nearfield/moment_curve.h"

namespace topple::apps {

namespace {

using nearfield::Axis;

struct Bending {
  Axis axis;
  int direction;
  const nearfield::MomentFamily* family;
  const nearfield::Fibres* fibres;
  double EI;
};

char letter_of(Axis axis) { return axis == Axis::Y ? 'y' : 'z'; }

/// 1234.5 as 1200.
double round_to_two_digits(double v) {
  if (!(v > 0)) return 0;
  const double unit = std::pow(10.0, std::floor(std::log10(v)) - 1);
  return std::round(v / unit) * unit;
}

std::string ending_of(const nearfield::MomentCurve& c, const nearfield::Rcc& rcc) {
  const double crushing = -rcc.y_pos.normal_force.front(), rupture = rcc.y_pos.normal_force.back();
  if (c.rotation.empty() && c.N < 0)
    return fmt::format("cannot be carried: strained evenly the section crushes at {:.3g} MN", crushing / unit::MN);
  if (c.rotation.empty())
    return fmt::format("cannot be carried: strained evenly the section tears at {:.3g} MN", rupture / unit::MN);
  if (!c.is_balanced && !(*std::max_element(c.moment.begin(), c.moment.end()) > 0))
    return "no moment: the normal force is carried only with one in the other direction";
  if (c.carried_to > c.rotation.back())
    return fmt::format("no moment is left beyond {:.4g} rad; the normal force is carried up to {:.4g} rad{}",
                       c.rotation.back(), c.carried_to, c.loses_force ? "" : ", as far as was computed");
  if (c.loses_force)
    return fmt::format("beyond {:.4g} rad the section can no longer carry the normal force", c.rotation.back());
  const double peak = *std::max_element(c.moment.begin(), c.moment.end());
  if (c.moment.back() < kNothingLeft * peak) return fmt::format("nothing is left at {:.3g} rad", c.rotation.back());
  return fmt::format("computed up to {:.3g} rad", c.rotation.back());
}

record::RccPoint to_record(const nearfield::CurvePoint& p) { return {p.rotation, p.moment}; }

record::RccCurve to_record(const nearfield::MomentCurve& c, const nearfield::Rcc& rcc, double EI) {
  record::RccCurve out;
  out.axis = letter_of(c.axis), out.direction = c.direction, out.normal_force = -c.N;
  out.rotation = c.rotation, out.moment = c.moment;
  const nearfield::CurvePoints p = nearfield::find_points(c);
  // none where N is carried with a moment only, or makes the bars yield by itself
  const bool yields = nearfield::has_yield(c, p);
  if (yields) out.yield = to_record(p.yield);
  out.peak = to_record(p.peak);
  out.ultimate = to_record(p.ultimate), out.residual = to_record(p.residual);
  if (!c.rotation.empty()) out.end = {c.rotation.back(), c.moment.back()};
  out.stiffness_uncracked = EI;
  if (yields) out.stiffness_effective = c.yield_moment / c.yield_rotation * c.length;
  out.ending = ending_of(c, rcc);
  return out;
}

/// The section where the curve has this rotation.
record::RccState make_state(const nearfield::ZoneInput& in, const nearfield::Fibres& fibres,
                            const nearfield::MomentCurve& c, const std::string& point, const record::RccPoint& at) {
  const auto above = std::lower_bound(c.rotation.begin(), c.rotation.end(), at.rotation * (1 - 1e-12));
  const size_t j = std::min(static_cast<size_t>(above - c.rotation.begin()), c.rotation.size() - 1),
               i = j > 0 ? j - 1 : 0;
  const double s = j > 0 ? std::clamp((at.rotation - c.rotation[i]) / (c.rotation[j] - c.rotation[i]), 0.0, 1.0) : 1;
  record::RccState out;
  out.point = point;
  out.axis = letter_of(c.axis), out.direction = c.direction, out.normal_force = -c.N;
  out.rotation = at.rotation, out.moment = at.moment;
  out.eps_0 = c.eps_0[i] + s * (c.eps_0[j] - c.eps_0[i]);
  out.curvature = c.kappa[i] + s * (c.kappa[j] - c.kappa[i]);
  nearfield::BarStates bars = c.bars[i];
  if (at.rotation == c.first_torn.rotation)
    out.eps_0 = c.torn.eps_0, out.curvature = c.torn.kappa, bars = c.bars[c.torn.after];
  else if (at.rotation < c.first_torn.rotation && c.rotation[j] > c.first_torn.rotation)
    out.eps_0 = c.eps_0[i];  // the chord leads to where a bar has torn
  // the chord may lead to another branch than the curve's, as where the section cracks through
  double best = std::numeric_limits<double>::infinity();
  for (const double begin : {out.eps_0, c.eps_0[i], c.eps_0[j]}) {
    double eps_0 = begin;
    const bool is_found = nearfield::find_equilibrium(fibres, c.N, out.curvature, eps_0, bars);
    const double M = c.direction * nearfield::calc_resultants(fibres, eps_0, out.curvature, bars).M;
    const double off = is_found ? std::abs(M - at.moment) : std::numeric_limits<double>::max();
    if (off < 0.9 * best) best = off, out.eps_0 = eps_0;
  }
  const nearfield::SectionState state =
      nearfield::make_section_state(in, fibres, c.axis, out.eps_0, out.curvature, bars);
  for (const auto& l : state.layers)
    out.layers.push_back({l.from, l.to, l.core_breadth, l.cover_breadth, l.strain, l.core_stress, l.cover_stress,
                          nearfield::name_of(l.core), nearfield::name_of(l.cover)});
  for (const auto& b : state.bars)
    out.bars.push_back({b.y, b.z, b.diameter, b.strain, b.stress, nearfield::name_of(b.condition)});
  return out;
}

/// Forces in words, at most three of them.
std::string list_forces(const std::vector<double>& forces) {
  std::string out;
  for (size_t i = 0; i < forces.size() && i < 3; ++i)
    out += fmt::format("{}{:.4g}", i > 0 ? ", " : "", -forces[i] / unit::MN);
  if (forces.size() <= 3) return out + " MN";
  return out + fmt::format(" MN and {} other force{}", forces.size() - 3, forces.size() > 4 ? "s" : "");
}

/// One line for each normal force, from a moment about y alone to one about z alone.
void add_biaxial(const nearfield::ZoneInput& in, const std::vector<double>& normal_forces, record::RccReport& r) {
  constexpr int steps = 12;
  std::vector<nearfield::BiaxialPoint> all;
  std::vector<double> open, bulging;
  for (const double N : normal_forces) {
    if (N <= -r.crushing_force || N >= r.rupture_force) continue;
    nearfield::BiaxialLine line = nearfield::make_biaxial_line(in, N, steps);
    if (!line.ends_at_z) open.push_back(N);
    if (line.y.size() < 2) continue;
    // beyond an end no power law goes; half a percent is the grid of rotations
    const auto is_beyond = [](const nearfield::BiaxialPoint& q) { return std::max(q.y, q.z) > 1.005; };
    if (std::any_of(line.inside.begin(), line.inside.end(), is_beyond))
      bulging.push_back(N);
    else
      all.insert(all.end(), line.inside.begin(), line.inside.end());
    r.biaxial.push_back({-N, std::move(line.y), std::move(line.z)});
  }
  if (!all.empty()) r.biaxial_exponent = nearfield::fit_biaxial(all).exponent;
  if (!open.empty())
    r.notes.push_back(fmt::format(
        "Under {}, there is no moment about z alone, or none about y alone: the curve of both axes does not "
        "reach it, and the exponent leaves it out.",
        list_forces(open)));
  if (!bulging.empty())
    r.notes.push_back(
        fmt::format("Under {}, a larger moment about one axis is resisted together with one about the other than "
                    "without it: no exponent meets that curve, and it is left out.",
                    list_forces(bulging)));
}

/// Effective stiffness of a zone that "yields" before it has cracked.
void add_uncracked(record::RccReport& r) {
  std::string list;
  int more = 0;
  for (const auto& [curve, about] : record::group_curves(r)) {
    constexpr double uncracked = 0.8, far = 10;  // of EI; peak over yield rotation: it is no compressed, brittle one
    if (!(curve->stiffness_effective > uncracked * curve->stiffness_uncracked) ||
        !(curve->peak.rotation > far * curve->yield.rotation))
      continue;
    if (list.empty())
      list = fmt::format("{} under {:.4g} MN ({:.4g} MNm2)", about, curve->normal_force / unit::MN,
                         curve->stiffness_effective / 1e6);
    else
      ++more;
  }
  if (!list.empty())
    r.notes.push_back(fmt::format(
        "EI eff is that before cracking about {}{}: 0.75 of the peak lies below the moment that cracks it; cracked it "
        "is softer.",
        list, more > 0 ? fmt::format(" and in {} more", more) : ""));
}

/// What comes with the moments of an unsymmetric section that turns about one axis alone.
void add_crossed(const nearfield::ZoneInput& in, const std::vector<double>& normal_forces, record::RccReport& r) {
  for (const auto axis : {Axis::Y, Axis::Z}) {
    if (axis == Axis::Y && in.flange.breadth > 0) continue;  // only webs are known about oblique axes
    for (const double N : normal_forces) {
      if (N <= -r.crushing_force || N >= r.rupture_force) continue;
      const nearfield::CrossedPeak p = nearfield::find_crossed_peak(in, axis, 1, N);
      constexpr double worth_telling = 0.01;
      if (!(std::abs(p.across) > worth_telling * std::abs(p.moment))) continue;
      const char about = letter_of(axis), other = axis == Axis::Y ? 'z' : 'y';
      r.notes.push_back(fmt::format(
          "Curves and interaction about {0} are those of turning about {0} alone: with the largest moment under "
          "{1:.4g} "
          "MN, {2:.4g} kNm, come {3:.4g} kNm about {4}. What it resists without these is the end of the curve of both "
          "axes.",
          about, -N / unit::MN, p.moment / unit::kNm, p.across / unit::kNm, other));
      break;  // one force shows it
    }
  }
}

/// Both axial curves as one, with the elastic part that make_rcc takes out.
record::RccAxial make_axial(const nearfield::Rcc& rcc) {
  record::RccAxial out;
  const double per_force = rcc.length / rcc.EA;
  for (size_t i = rcc.tension.force.size(); i-- > 0;) {
    out.shortening.push_back(-(rcc.tension.displacement[i] + rcc.tension.force[i] * per_force));
    out.normal_force.push_back(-rcc.tension.force[i]);
  }
  out.shortening.push_back(0);
  out.normal_force.push_back(0);
  for (size_t i = 0; i < rcc.compression.force.size(); ++i) {
    const double u = rcc.compression.displacement[i] + rcc.compression.force[i] * per_force;
    out.shortening.push_back(u);
    out.normal_force.push_back(rcc.compression.force[i]);
  }
  return out;
}

void add_inputs(const nearfield::ZoneInput& in, record::RccReport& r) {
  const auto add = [&r](const char* group, const char* key, const std::string& value) {
    r.inputs.push_back({group, key, value});
  };
  const product::Section& s = in.section;
  add("Section", "Name", s.name);
  add("Section", "Width x height", fmt::format("{:.4g} x {:.4g} cm", s.width / unit::cm, s.height / unit::cm));
  add("Section", "Bars",
      fmt::format("{}, {:.4g} cm2 ({:.2g} %)", s.bars.size(), s.steel_area() / unit::cm2,
                  100 * s.steel_area() / s.area()));
  if (const nearfield::Flange& f = in.flange; f.breadth > 0)
    add("Section", "Flange",
        fmt::format("{:.3g} m beside the web, {:.3g} cm thick, bars {:.3g} cm2", f.breadth, f.thickness / unit::cm,
                    f.bar_area() / unit::cm2));
  add("Section", "Clear cover", fmt::format("{:.3g} cm", s.cover / unit::cm));
  add("Section", "Ties",
      fmt::format("{:.3g} mm every {:.3g} cm, {} legs along y, {} along z", s.tie_diameter / unit::mm,
                  s.tie_spacing / unit::cm, s.tie_legs_y, s.tie_legs_z));
  const product::Concrete& c = in.concrete;
  add("Concrete", "fc, fct", fmt::format("{:.4g}, {:.4g} N/mm2", c.fc / unit::MPa, c.fct / unit::MPa));
  add("Concrete", "Ec", fmt::format("{:.5g} N/mm2", c.Ec / unit::MPa));
  add("Concrete", "Strain at the peak", fmt::format("{:.3g}", c.eps_c1));
  add("Concrete", "Gf, Gcl", fmt::format("{:.4g} N/m, {:.4g} N/mm", c.Gf, c.Gcl / 1e3));
  add("Steel", "fy, fu", fmt::format("{:.4g}, {:.4g} N/mm2", in.steel.fy / unit::MPa, in.steel.fu / unit::MPa));
  add("Steel", "Es, strain at rupture",
      fmt::format("{:.6g} N/mm2, {:.3g} %", in.steel.Es / unit::MPa, 100 * in.steel.eps_u));
  add("Zone", "Length", fmt::format("{:.4g} m", in.length));
  if (in.cut_bars > 0) add("Zone", "Bars cut", fmt::format("{:.3g} %", 100 * in.cut_bars));
  if (in.cut_concrete > 0) add("Zone", "Concrete cut", fmt::format("{:.3g} %", 100 * in.cut_concrete));
  if (in.concrete_loss > 0) add("Zone", "Strength lost", fmt::format("{:.3g} %", 100 * in.concrete_loss));
  if (in.cover_lost) add("Zone", "Cover", "lost");
}

bool is_same(const nearfield::MomentFamily& a, const nearfield::MomentFamily& b) { return a.moment == b.moment; }

}  // namespace

std::vector<double> choose_forces(const nearfield::Rcc& rcc) {
  const double crushing = -rcc.y_pos.normal_force.front();
  std::vector<double> out;
  for (const double share : {0.0, 0.1, 0.2, 0.4, 0.6}) out.push_back(-round_to_two_digits(share * crushing));
  return out;
}

record::RccReport make_rcc_report(const nearfield::ZoneInput& in, const nearfield::Rcc& rcc,
                                  const std::vector<double>& normal_forces) {
  record::RccReport r;
  r.width = in.section.width, r.height = in.section.height, r.length = in.length;
  add_inputs(in, r);
  r.EA = rcc.EA, r.EI_y = rcc.EI_y, r.EI_z = rcc.EI_z, r.GA = rcc.GA, r.GJ = rcc.GJ;
  r.shear_y = rcc.shear_y, r.shear_z = rcc.shear_z, r.shear_friction = rcc.shear_friction, r.torsion = rcc.torsion;
  r.crushing_force = -rcc.y_pos.normal_force.front(), r.rupture_force = rcc.y_pos.normal_force.back();
  const nearfield::Fibres about_y = nearfield::make_fibres(in, Axis::Y), about_z = nearfield::make_fibres(in, Axis::Z);
  const Bending all[] = {{Axis::Y, 1, &rcc.y_pos, &about_y, rcc.EI_y},
                         {Axis::Y, -1, &rcc.y_neg, &about_y, rcc.EI_y},
                         {Axis::Z, 1, &rcc.z_pos, &about_z, rcc.EI_z},
                         {Axis::Z, -1, &rcc.z_neg, &about_z, rcc.EI_z}};
  constexpr int parts = 4, forces = 61;
  for (const Bending& b : all) {
    r.families.push_back(
        {letter_of(b.axis), b.direction, b.family->normal_force, b.family->rotation, b.family->moment});
    record::RccFamily& family = r.families.back();
    // compression positive and rising
    const size_t K = family.normal_force.size(), J = family.rotation.size();
    std::reverse(family.normal_force.begin(), family.normal_force.end());
    for (double& N : family.normal_force) N = -N;
    for (size_t k = 0; k < K; ++k)
      std::copy_n(b.family->moment.begin() + static_cast<std::ptrdiff_t>((K - 1 - k) * J), J,
                  family.moment.begin() + static_cast<std::ptrdiff_t>(k * J));

    const nearfield::Interaction i =
        nearfield::make_interaction(*b.fibres, b.axis, b.direction, *b.family, in.length, forces);
    record::RccInteraction interaction{"layered",      letter_of(b.axis), b.direction,
                                       i.normal_force, i.yield_moment,    i.peak_moment};
    for (auto* list : {&interaction.normal_force, &interaction.yield_moment, &interaction.peak_moment})
      std::reverse(list->begin(), list->end());
    for (double& N : interaction.normal_force) N = -N;
    r.interactions.push_back(std::move(interaction));

    const std::vector<double> rotation = nearfield::refine_rotations(*b.family, parts);
    for (const double N : normal_forces) {
      const nearfield::MomentCurve curve =
          nearfield::make_moment_curve(*b.fibres, b.axis, N, b.direction, in.length, rotation);
      r.curves.push_back(to_record(curve, rcc, b.EI));
      const record::RccCurve& c = r.curves.back();
      for (const auto& [name, point] : {std::pair{"yield", &c.yield}, {"peak", &c.peak}, {"ultimate", &c.ultimate}})
        if (std::isfinite(point->rotation)) r.states.push_back(make_state(in, *b.fibres, curve, name, *point));
    }
  }
  add_uncracked(r);
  add_crossed(in, normal_forces, r);
  add_biaxial(in, normal_forces, r);
  if (in.flange.breadth > 0 && !r.biaxial.empty())
    r.notes.push_back("The curve of both axes is that of the web alone, without the slabs beside it.");
  r.axial.push_back(make_axial(rcc));
  if (is_same(rcc.y_pos, rcc.y_neg) && is_same(rcc.z_pos, rcc.z_neg))
    r.notes.push_back("The section is symmetric: both directions of each axis give the same curve.");
  else if (!r.biaxial.empty())
    r.notes.push_back(
        "The curve of both axes is that of positive moments about both; the section is not symmetric, and towards its "
        "other sides it has others.");
  r.not_modelled = {
      "Slip of bars and their anchorage beyond the zone: bond is perfect.",
      "Shear deformation, and loss of shear strength with rotation; shear and torsion are limits of their own.",
      "Concrete follows its envelope: layers that unload while the rotation rises are taken as never loaded. Bars "
      "remember.",
      "Creep, shrinkage, corrosion, rate of loading and heat."};
  return r;
}

}  // namespace topple::apps
