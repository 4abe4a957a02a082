#include "nearfield/ring.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/unit.h"
#include "nearfield/axial.h"
#include "nearfield/family.h"

namespace topple::nearfield {

namespace {

constexpr double pi = 3.14159265358979323846;
constexpr int strips = 64;
constexpr double kept_moment = 0.02;       // of a row's peak, when the pressure has moved to the back
constexpr double kept_force = 0.3;         // up to this share of crushing
constexpr double finest = 0.5 * pi / 180;  // angle of a cell [rad]

ZoneInput plain_zone(const RingInput& in) {
  ZoneInput zone;
  zone.concrete = in.concrete;
  zone.steel = in.steel;
  zone.length = in.length;
  zone.concrete_loss = in.concrete_loss;
  zone.section.name = in.name;
  zone.section.tie_diameter = in.hoop_diameter, zone.section.tie_spacing = in.hoop_spacing;
  return zone;
}

bool has_bars(const RingInput& in) { return in.as_outer > 0 || in.as_inner > 0; }

/// Circles of bars: radius and area per metre of it.
struct Circle {
  double radius = 0, per_metre = 0;
};
std::vector<Circle> circles_of(const RingInput& in) {
  const double inset = in.cover + 0.5 * in.bar_diameter;
  std::vector<Circle> out;
  if (in.as_outer > 0) out.push_back({in.outer - inset, in.as_outer});
  if (in.as_inner > 0) out.push_back({in.outer - in.thickness + inset, in.as_inner});
  return out;
}

std::vector<RingSector> sectors_of(const RingInput& in) {
  if (in.sectors.empty()) return {{0, 2 * pi, 1, 1}};
  return in.sectors;
}

/// Calls with the place of the centroid and the area of each cell: concrete, then bars.
template <typename Concrete, typename Bars>
void each_cell(const RingInput& in, Concrete concrete, Bars bars) {
  const double inner = in.outer - in.thickness;
  const std::vector<Circle> circles = circles_of(in);
  constexpr int rings = 4;
  for (const RingSector& s : sectors_of(in)) {
    const int n = std::max(1, static_cast<int>(std::ceil(s.angle() / finest - 1e-6)));
    const double step = s.angle() / n, chord = 2 * std::sin(0.5 * step) / step;
    for (int i = 0; i < n; ++i) {
      const double angle = s.from + (i + 0.5) * step, c = std::cos(angle), d = std::sin(angle);
      for (int k = 0; k < rings && s.concrete > 0; ++k) {
        const double a = inner + in.thickness * k / rings, b = inner + in.thickness * (k + 1) / rings;
        const double area = 0.5 * step * (b * b - a * a);
        const double r = 2.0 / 3 * (b * b * b - a * a * a) / (b * b - a * a) * chord;
        concrete(r * c, r * d, s.concrete * area);
      }
      for (const Circle& circle : circles)
        if (s.bars > 0)
          bars(circle.radius * chord * c, circle.radius * chord * d, s.bars * circle.per_metre * circle.radius * step);
    }
  }
}

void check_ring(const RingInput& in) {
  const auto complain = [&](const std::string& what) { throw InputError("E611", "ring '" + in.name + "': " + what); };
  if (!(in.outer > 0) || !(in.thickness > 0) || !(in.thickness < in.outer))
    complain("the thickness must be positive and less than the outer radius");
  if (!(in.length > 0) || !std::isfinite(in.length)) complain("the length of a zone must be positive");
  if (has_bars(in) && (!(in.bar_diameter > 0) || !(in.steel.fy > 0))) complain("bars need a diameter and a steel");
  double at = -1e30, sum = 0;
  for (const RingSector& s : sectors_of(in)) {
    const auto is_share = [](double v) { return v >= 0 && v <= 1; };
    if (!(s.angle() > 0) || s.from < at - 1e-9) complain("sectors must rise and not overlap");
    if (!is_share(s.concrete) || !is_share(s.bars)) complain("shares must lie between 0 and 1");
    at = s.to, sum += s.angle();
  }
  if (sum > 2 * pi + 1e-6) complain("the sectors are more than a ring");
}

/// Whether the ring is the same all around, whole or cut.
bool is_even(const RingInput& in) { return sectors_of(in).size() == 1 && sectors_of(in)[0].angle() > 2 * pi - 1e-6; }

/// Whether every sector has its mirror image about the y axis.
bool is_symmetric(const RingInput& in) {
  for (const RingSector& s : sectors_of(in)) {
    bool found = false;
    for (const RingSector& o : sectors_of(in))
      found |= std::abs(std::remainder(s.from + o.to, 2 * pi)) < 1e-9 && std::abs(s.angle() - o.angle()) < 1e-9 &&
               s.concrete == o.concrete && s.bars == o.bars;
    if (!found && s.angle() < 2 * pi - 1e-9) return false;
  }
  return true;
}

/// Places and areas gathered in strips of equal width.
struct Strips {
  double low = 0, width = 0;
  std::vector<double> area, moment;
  Strips(double from, double to) : low(from), width((to - from) / strips), area(strips, 0.0), moment(strips, 0.0) {}
  void add(double at, double a) {
    const int i = width > 0 ? std::clamp(static_cast<int>((at - low) / width), 0, strips - 1) : 0;
    area[static_cast<size_t>(i)] += a, moment[static_cast<size_t>(i)] += a * at;
  }
};

/// The band that is pressed moves to the back of the arc, where the ring is broad across the fall, so that it goes on
/// bearing while what resists is gone: a row keeps a remainder of its moment instead of losing its force.
void keep_bearing(MomentFamily& f) {
  const size_t J = f.rotation.size();
  for (size_t k = 1; k + 1 < f.normal_force.size(); ++k) {
    if (f.normal_force[k] < kept_force * f.normal_force.front()) continue;
    const auto row = f.moment.begin() + static_cast<std::ptrdiff_t>(k * J);
    const double least = kept_moment * *std::max_element(row, row + static_cast<std::ptrdiff_t>(J));
    for (size_t j = 1; j + 1 < J; ++j)
      row[static_cast<std::ptrdiff_t>(j)] = std::max(row[static_cast<std::ptrdiff_t>(j)], least);
  }
}

/// Shear and torsion, docs/theory/ring.md (6) to (8).
void add_shear(const RingInput& in, const RingProperties& p, Rcc& out) {
  const material::ConcreteInput c = make_concrete_input(plain_zone(in));
  const double mean = in.outer - 0.5 * in.thickness, t = in.thickness, cot30 = std::sqrt(3.0);
  const double web = 0.5 * p.area;
  const double hoop = 0.25 * pi * in.hoop_diameter * in.hoop_diameter;
  const double share = p.area / (2 * pi * mean * t);
  const double hoops = in.hoop_spacing > 0 && in.steel.fy > 0
                           ? 0.5 * pi * share * hoop * in.steel.fy * 2 * mean * cot30 / in.hoop_spacing
                           : 0;
  // masonry and weak concrete: by their tensile strength
  const double stress = std::min(0.29 * std::sqrt(c.fc / unit::MPa) * unit::MPa, 1.5 * c.fct);
  double shear = std::min(stress * web + hoops, 0.6 * c.fc * web / (cot30 + 1 / cot30));
  if (p.steel_area > 0) {
    const double one = 0.25 * pi * in.bar_diameter * in.bar_diameter;
    shear = std::max(shear, p.steel_area / one * 2 * in.steel.fy * std::pow(in.bar_diameter, 3) / 6 / in.length);
  }
  out.shear_y = out.shear_z = shear;
  out.shear_friction = p.area > 0 ? 0.6 : 0;
  const double G = c.Ec / 2.4, along = share * 2 * pi * mean;
  double least = 1, slack = 0;  // share of the concrete, and what the shear flow of a closed ring turns
  for (const RingSector& s : sectors_of(in)) least = std::min(least, s.concrete), slack += s.angle() / s.concrete;
  slack /= 2 * pi;
  out.torsion = p.is_closed ? c.fct * 2 * pi * mean * mean * t * least : c.fct * along * t * t / 3;
  out.torsion = std::max(out.torsion, 1e-6 * out.EA * t);
  out.GA = 0.5 * G * p.area;
  out.GJ = 0.2 * G * (p.is_closed ? 2 * pi * mean * mean * mean * t / slack : along * t * t * t / 3);
}

}  // namespace

RingProperties calc_ring_properties(const RingInput& in) {
  check_ring(in);
  RingProperties p;
  const double E = make_concrete_input(plain_zone(in)).Ec;
  double weight = 0, my = 0, mz = 0, yy = 0, zz = 0, yz = 0;
  const auto add = [&](double y, double z, double e) {
    weight += e, my += e * y, mz += e * z, yy += e * y * y, zz += e * z * z, yz += e * y * z;
  };
  bool has_concrete_left = false;
  for (const RingSector& s : sectors_of(in)) has_concrete_left |= s.concrete > 0;
  const double n = in.steel.Es - (has_concrete_left ? E : 0);
  each_cell(
      in, [&](double y, double z, double a) { p.area += a, add(y, z, E * a); },
      [&](double y, double z, double a) { p.steel_area += a, add(y, z, n * a); });
  if (!(weight > 0)) throw InputError("E612", "ring '" + in.name + "': nothing is left of it");
  p.EA = weight;
  p.y = my / weight, p.z = mz / weight;
  p.EI_y = zz - weight * p.z * p.z, p.EI_z = yy - weight * p.y * p.y;
  p.EI_yz = yz - weight * p.y * p.z;
  // what is exact round-off of a symmetric section
  if (std::abs(p.y) < 1e-9 * in.outer) p.y = 0;
  if (std::abs(p.z) < 1e-9 * in.outer) p.z = 0;
  double around = 0;
  for (const RingSector& s : sectors_of(in)) around += s.concrete > 0 ? s.angle() : 0;
  p.is_closed = around > 2 * pi - 1e-6;
  return p;
}

std::vector<RingSector> join_sectors(std::vector<RingSector> sectors) {
  constexpr double touching = 1e-6;  // [rad]
  std::sort(sectors.begin(), sectors.end(), [](const RingSector& a, const RingSector& b) { return a.from < b.from; });
  const auto is_alike = [](const RingSector& a, const RingSector& b) {
    return a.concrete == b.concrete && a.bars == b.bars;
  };
  std::vector<RingSector> out;
  for (const RingSector& s : sectors) {
    if (!out.empty() && is_alike(out.back(), s) && std::abs(out.back().to - s.from) < touching)
      out.back().to = s.to;
    else
      out.push_back(s);
  }
  if (out.size() > 1 && is_alike(out.front(), out.back()) &&
      std::abs(out.front().from + 2 * pi - out.back().to) < touching) {
    out.back().to = out.front().to + 2 * pi;
    out.erase(out.begin());
  }
  return out;
}

double turn_to_principal_axes(RingInput& in) {
  constexpr double round_off = 1e-9;
  in.sectors = join_sectors(std::move(in.sectors));
  const RingProperties p = calc_ring_properties(in);
  const double line = std::hypot(p.y, p.z) > round_off * in.outer ? std::atan2(p.z, p.y) : 0;
  double angle = line;
  const double apart = p.EI_z - p.EI_y;
  if (std::hypot(2 * p.EI_yz, apart) > round_off * (p.EI_y + p.EI_z)) {
    const double principal = 0.5 * std::atan2(2 * p.EI_yz, apart);
    const double off = std::remainder(principal - line, 0.5 * pi);
    if (std::abs(off) > 1e-6) angle += off;
  }
  if (std::cos(angle) < -round_off) angle -= std::copysign(pi, angle);
  for (RingSector& s : in.sectors) s.from -= angle, s.to -= angle;
  return angle;
}

Fibres make_ring_fibres(const RingInput& in, Axis axis, int direction, double y, double z) {
  check_ring(in);
  const ZoneInput zone = plain_zone(in);
  Fibres out;
  out.cover = out.core = material::make_concrete(make_concrete_input(zone));
  const auto at = [&](double cy, double cz) { return axis == Axis::Y ? cz - z : cy - y; };
  double low = 1e30, high = -1e30;
  const auto reach = [&](double cy, double cz, double) {
    low = std::min(low, at(cy, cz)), high = std::max(high, at(cy, cz));
  };
  each_cell(in, reach, reach);
  if (!(high > low)) return out;
  Strips concrete(low, high), bars(low, high);
  each_cell(
      in, [&](double cy, double cz, double a) { concrete.add(at(cy, cz), a); },
      [&](double cy, double cz, double a) { bars.add(at(cy, cz), a); });
  // the edge itself lies beyond the outermost cell's middle
  for (const RingSector& s : sectors_of(in)) {
    const int n = 64;
    for (int i = 0; i <= n && s.concrete > 0; ++i)
      for (const double r : {in.outer, in.outer - in.thickness}) {
        const double angle = s.from + s.angle() * i / n;
        const double v = at(r * std::cos(angle), r * std::sin(angle));
        low = std::min(low, v), high = std::max(high, v);
      }
  }
  out.half_depth = direction > 0 ? -low : high;
  if (!(out.half_depth > 0)) out.half_depth = 0.5 * (high - low);
  for (size_t i = 0; i < static_cast<size_t>(strips); ++i) {
    if (concrete.area[i] > 0 && in.concrete_loss < 1) {
      out.at.push_back(concrete.moment[i] / concrete.area[i]);
      out.core_area.push_back(concrete.area[i]);
      out.cover_area.push_back(0);
    }
    if (bars.area[i] > 0) {
      out.bar_at.push_back(bars.moment[i] / bars.area[i]);
      out.bar_area.push_back(bars.area[i]);
      out.bar_law.push_back(make_bar(zone, in.bar_diameter));
    }
  }
  return out;
}

Rcc make_ring_rcc(const RingInput& given) {
  const RingProperties p = calc_ring_properties(given);
  RingInput in = given;
  // rotations are spread around the yield of bars also where there are none
  if (!has_bars(in)) in.steel = {"", 500 * unit::MPa, 500 * unit::MPa, 200 * unit::GPa, 0.01};
  Rcc out;
  out.length = in.length;
  out.EA = p.EA, out.EI_y = p.EI_y, out.EI_z = p.EI_z;
  const Fibres z_pos = make_ring_fibres(in, Axis::Z, -1, p.y, p.z), z_neg = make_ring_fibres(in, Axis::Z, 1, p.y, p.z);
  const Peak peak = find_crushing(z_pos);
  out.compression = make_compression(z_pos, peak, out.EA, in.length);
  const TensionBars bars{p.steel_area * in.steel.fy, p.steel_area * in.steel.fu,
                         in.steel.eps_u - in.steel.fu / in.steel.Es};
  out.tension = make_tension(bars, z_pos.cover, p.area, in.length);
  const double rupture = std::max({p.steel_area * in.steel.fu, p.area * z_pos.cover.fct, 1e-6 * peak.force});
  const std::vector<double> force = make_forces(peak.force, rupture);
  ZoneInput zone = plain_zone(in);
  const std::vector<double> rotation_z = make_rotations(zone, z_pos.half_depth + z_neg.half_depth, z_pos.cover);
  out.z_pos = make_family(z_pos, -1, force, rotation_z, in.length);
  if (is_even(given)) {
    out.z_neg = out.y_pos = out.y_neg = out.z_pos;
  } else {
    out.z_neg = make_family(z_neg, 1, force, rotation_z, in.length);
    const Fibres y_pos = make_ring_fibres(in, Axis::Y, 1, p.y, p.z);
    const Fibres y_neg = is_symmetric(in) ? y_pos : make_ring_fibres(in, Axis::Y, -1, p.y, p.z);
    const std::vector<double> rotation_y = make_rotations(zone, y_pos.half_depth + y_neg.half_depth, y_pos.cover);
    out.y_pos = make_family(y_pos, 1, force, rotation_y, in.length);
    out.y_neg = is_symmetric(in) ? out.y_pos : make_family(y_neg, -1, force, rotation_y, in.length);
  }
  for (MomentFamily* f : {&out.y_pos, &out.y_neg, &out.z_pos, &out.z_neg}) {
    keep_bearing(*f);
    f->elongation.clear();  // not that of a band that moves back
  }
  add_shear(in, p, out);
  out.biaxial_exponent = is_even(given) ? 2 : 1.5;
  out.damage_share = 1 - z_pos.core.b_c;
  return out;
}

ResidualCage make_ring_cage(const RingInput& in, double destroyed_length, double residual_bars) {
  const RingProperties p = calc_ring_properties(in);
  ZoneInput zone = plain_zone(in);
  zone.section.width = zone.section.height = 4 * in.outer;
  if (!(zone.steel.fy > 0)) zone.steel = {"", 500 * unit::MPa, 500 * unit::MPa, 200 * unit::GPa, 0.01};
  for (const RingSector& s : sectors_of(in))
    for (const Circle& c : circles_of(in)) {
      const double one = 0.25 * pi * in.bar_diameter * in.bar_diameter;
      const double area = s.bars * c.per_metre * c.radius * s.angle();
      const int n = std::max(1, static_cast<int>(std::lround(area / one)));
      for (int i = 0; i < n && area > 0; ++i) {
        const double angle = s.from + s.angle() * (i + 0.5) / n;
        zone.section.bars.push_back(
            {c.radius * std::cos(angle) - p.y, c.radius * std::sin(angle) - p.z, area / n, in.bar_diameter});
      }
    }
  return make_residual_cage(zone, destroyed_length, residual_bars);
}

}  // namespace topple::nearfield
