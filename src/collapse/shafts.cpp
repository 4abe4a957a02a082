/// Shafts of rings: bodies between levels at which they may break, and sectors at mouths (docs/theory/ring.md).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "base/interpolate.h"
#include "base/unit.h"
#include "base/words.h"
#include "collapse/builder.h"
#include "nearfield/shell.h"
#include "record/told.h"

namespace topple::collapse {

using product::Member;
using product::Shaft;

namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kLeastStaves = 16;
constexpr int kPieces = 12;                    // a shaft without a given spacing has about so many
constexpr double kFixedStump = 1.5;            // a mouth lower than so many diameters stands on a rigid stump
constexpr double kLeastRing = 0.3;             // between mouths, cuts and the ends of the shaft [m]
constexpr double kLeastStiffnessShare = 1e-3;  // of a fired sector, so that its forces die out smoothly
constexpr double kCrushing = 0.25;             // of the thickness: shortening after which the pieces meet as a contact
constexpr double kClosing = 0.8;               // share of a mouth's height whose closing ends what still connects it

/// A mouth or a cut.
struct Level {
  double at = 0, height = 0;  // its middle above the foot [m]
  bool is_mouth = false;
  double low() const { return at - 0.5 * height; }
  double high() const { return at + 0.5 * height; }
};

constexpr double kSameLevel = 1e-6;  // [m]

std::vector<Level> find_levels(const product::Plan& plan, int index) {
  std::vector<Level> out;
  for (const product::Stage& s : plan.stages)
    for (const product::Charge& c : s.charges) {
      if (c.member != index) continue;
      const auto same = std::find_if(out.begin(), out.end(),
                                     [&](const Level& l) { return std::abs(l.at - c.position) < kSameLevel; });
      if (same == out.end())
        out.push_back({c.position, c.destroyed_length, true});
      else
        same->height = std::max(same->height, c.destroyed_length);
    }
  // the highest cut of a level first, whatever the order in the plan
  std::vector<product::Weakening> cuts = plan.members[static_cast<size_t>(index)].weakenings;
  std::stable_sort(cuts.begin(), cuts.end(), [](const product::Weakening& a, const product::Weakening& b) {
    return a.height != b.height ? a.height > b.height : a.at < b.at;
  });
  for (const product::Weakening& w : cuts) {
    const auto is_in = [&](const Level& l) { return w.at >= l.low() - 0.01 && w.at <= l.high() + 0.01; };
    if (std::any_of(out.begin(), out.end(), [&](const Level& l) { return l.is_mouth && is_in(l); })) continue;
    const auto same =
        std::find_if(out.begin(), out.end(), [&](const Level& l) { return std::abs(l.at - w.at) < kSameLevel; });
    if (same != out.end())
      same->height = std::max(same->height, w.height);
    else if (std::none_of(out.begin(), out.end(), is_in))
      out.push_back({w.at, w.height, false});
  }
  std::sort(out.begin(), out.end(), [](const Level& a, const Level& b) { return a.at < b.at; });
  return out;
}

double wrap(double angle) {
  const double a = std::fmod(angle, 2 * kPi);
  return a < 0 ? a + 2 * kPi : a;
}

/// Of a charge or a cut.
struct Sector {
  double at = 0, middle = 0, opening = 0;  // above the foot [m]; in W [rad]
};

/// The angle below which what is left of a ring between two charges or cuts bears nothing [rad].
double find_sliver(const Shaft& s, double share) {
  constexpr double kMost = kPi / 180, kOfThickness = 0.5;
  const double t = s.thickness(share);
  return std::min(kMost, kOfThickness * t / (s.outer(share) - 0.5 * t));
}

/// Slivers between sectors of a level go to both of their sides by half.
void close_slivers(std::vector<Sector>& sectors, const Shaft& s, double height) {
  const std::vector<Sector> as_given = sectors;
  for (size_t i = 0; i < sectors.size(); ++i)
    for (size_t j = 0; j < sectors.size(); ++j) {
      const Sector &a = as_given[i], &b = as_given[j];
      if (i == j || std::abs(a.at - b.at) > kSameLevel) continue;
      if (product::is_all_around(a.opening) || product::is_all_around(b.opening)) continue;
      const double gap = wrap(b.middle - 0.5 * b.opening - a.middle - 0.5 * a.opening);
      if (gap >= find_sliver(s, a.at / height)) continue;
      sectors[i].middle += 0.25 * gap, sectors[i].opening += 0.5 * gap;
      sectors[j].middle -= 0.25 * gap, sectors[j].opening += 0.5 * gap;
    }
}

/// Edges of the sectors of charges and cuts, from 0 to 2 pi, each once; angles count from `azimuth`.
std::vector<double> find_edges(const std::vector<Sector>& sectors, double azimuth) {
  std::vector<double> edges;
  for (const Sector& s : sectors) {
    if (product::is_all_around(s.opening)) continue;
    for (const double side : {-0.5, 0.5}) edges.push_back(wrap(s.middle + side * s.opening - azimuth));
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end(), [](double a, double b) { return b - a < 1e-6; }), edges.end());
  if (edges.size() > 1 && edges.front() + 2 * kPi - edges.back() < 1e-6) edges.pop_back();
  return edges;
}

/// Sectors of a shaft's charges, middle and opening; those that touch and act as one (at a level, in a stage, after a
/// delay, of one height) as one.
std::vector<Sector> find_mouths(const product::Plan& plan, const std::vector<Sector>& sectors, int index) {
  struct Mouth {
    std::tuple<size_t, double, double, double, bool> alike;
    double middle = 0, opening = 0;
  };
  std::vector<Mouth> mouths;
  for (size_t stage = 0; stage < plan.stages.size(); ++stage)
    for (const product::Charge& c : plan.stages[stage].charges)
      if (c.member == index) {
        const Sector& s = sectors[mouths.size()];
        mouths.push_back({{stage, c.delay, c.position, c.destroyed_length, c.fails}, s.middle, s.opening});
      }
  const auto join = [&mouths](size_t i, size_t j) {
    Mouth& a = mouths[i];
    const Mouth& b = mouths[j];
    const double apart = std::remainder(b.middle - a.middle, 2 * kPi);
    if (a.alike != b.alike || std::abs(apart) > 0.5 * (a.opening + b.opening) + 1e-6) return false;
    const double from = std::min(-0.5 * a.opening, apart - 0.5 * b.opening);
    const double to = std::max(0.5 * a.opening, apart + 0.5 * b.opening);
    a.middle += 0.5 * (from + to), a.opening = std::min(to - from, 2 * kPi);
    mouths.erase(mouths.begin() + static_cast<std::ptrdiff_t>(j));
    return true;
  };
  bool has_joined = true;
  while (has_joined) {
    has_joined = false;
    for (size_t i = 0; i < mouths.size() && !has_joined; ++i)
      for (size_t j = i + 1; j < mouths.size() && !has_joined; ++j) has_joined = join(i, j);
  }
  std::vector<Sector> out;
  for (const Mouth& m : mouths) out.push_back({std::get<2>(m.alike), m.middle, m.opening});
  return out;
}

product::Concrete concrete_of_shaft(const product::Plan& plan, const Shaft& s) {
  return s.concrete >= 0 ? plan.concretes[static_cast<size_t>(s.concrete)]
                         : nearfield::make_masonry(s.strength, s.modulus);
}

/// The last rotation at which the section still bears its force: the last column of a family is without any.
double find_end(const nearfield::Rcc& rcc) {
  double end = mbs::kUnlimited;
  for (const nearfield::MomentFamily* f : {&rcc.y_pos, &rcc.y_neg, &rcc.z_pos, &rcc.z_neg})
    if (f->rotation.size() > 2) end = std::min(end, 0.98 * f->rotation[f->rotation.size() - 2]);
  return end;
}

/// A ring's zone ends, pressed or not, where edges that are crushed meet as a contact, and the lips of a mouth of this
/// height (0: none) that closes.
void end_at_contact(mbs::ZoneLaw& law, const nearfield::Rcc& rcc, const nearfield::RingInput& ring, double height) {
  law.crush_length = std::min(law.crush_length, kCrushing * ring.thickness);
  law.rupture_rotation = find_end(rcc);
  law.rupture_rotation_pressed = 0;
  if (height > 0) law.rupture_rotation = std::min(law.rupture_rotation, kClosing * height / (2 * ring.outer));
}

/// Moments over plastic rotations under a normal force; none outside of the family.
std::vector<double> find_row(const mbs::MomentFamily& f, bool is_positive, double N) {
  const size_t J = f.plastic_rotation.size();
  const std::vector<double>& M = is_positive ? f.positive : f.negative;
  std::vector<double> row(J, 0.0);
  for (size_t n = 0; n + 1 < f.normal_force.size(); ++n) {
    if (N < f.normal_force[n] || N > f.normal_force[n + 1]) continue;
    const double s = (N - f.normal_force[n]) / (f.normal_force[n + 1] - f.normal_force[n]);
    for (size_t j = 0; j < J; ++j) row[j] = (1 - s) * M[n * J + j] + s * M[(n + 1) * J + j];
    break;
  }
  return row;
}

/// What resists tipping to one side, under a normal force.
struct Tipping {
  std::vector<double> rotation, moment;  // plastic; [N·m]
  double most() const { return *std::max_element(moment.begin(), moment.end()); }
};

/// Both moments together, as a zone's limits join them.
///   angle  of the side that goes down, from local y [rad]
Tipping find_tipping(const mbs::ZoneLaw& law, double angle, double N) {
  const double c = std::cos(angle), s = std::sin(angle), p = law.biaxial_exponent;
  const std::vector<double> about_z = find_row(law.moment_z, c > 0, N), about_y = find_row(law.moment_y, s < 0, N);
  Tipping out;
  out.rotation = std::abs(c) > std::abs(s) ? law.moment_z.plastic_rotation : law.moment_y.plastic_rotation;
  for (const double r : out.rotation) {
    double use = 0;
    for (const auto& [part, f, row] :
         {std::make_tuple(std::abs(c), &law.moment_z, &about_z), std::make_tuple(std::abs(s), &law.moment_y, &about_y)})
      if (part > 1e-9) use += std::pow(part / std::max(interpolate(f->plastic_rotation, *row, r), 1e-3), p);
    out.moment.push_back(std::pow(use, -1 / p));
  }
  return out;
}

/// Whether what is let go at once comes to a stop while its zone holds: there its weight has done no more work than the
/// zone took.
///   moment, growth  of the weight at the start [N·m] and with the rotation [N·m/rad]
///   stiffness       of the zone before it yields [N·m/rad]
///   end             last plastic rotation [rad]
bool comes_to_a_stop(const Tipping& t, double moment, double growth, double stiffness, double end) {
  double taken = 0;
  for (size_t j = 0; j < t.rotation.size() && t.rotation[j] <= end; ++j) {
    if (j > 0) taken += 0.5 * (t.moment[j] + t.moment[j - 1]) * (t.rotation[j] - t.rotation[j - 1]);
    const double elastic = t.moment[j] / stiffness, all = t.rotation[j] + elastic;
    if (taken + 0.5 * t.moment[j] * elastic >= moment * all + 0.5 * growth * all * all) return true;
  }
  return false;
}

}  // namespace

std::optional<MouthLeft> find_mouth_left(const product::Plan& plan, int member, double at) {
  std::vector<Sector> sectors;
  for (const product::Stage& s : plan.stages)
    for (const product::Charge& c : s.charges)
      if (c.member == member && !c.fails && std::abs(c.position - at) < kSameLevel)
        sectors.push_back({at, c.azimuth, c.opening});
  if (sectors.empty()) return std::nullopt;
  const Member& m = plan.members[static_cast<size_t>(member)];
  close_slivers(sectors, plan.shafts[static_cast<size_t>(m.shaft)], m.end.z - m.start.z);
  MouthLeft out;
  double x = 0, y = 0;
  const std::vector<double> edges = find_edges(sectors, 0);
  for (size_t i = 0; i < edges.size(); ++i) {
    const double from = edges[i], to = i + 1 < edges.size() ? edges[i + 1] : edges.front() + 2 * kPi;
    const auto is_out = [&](const auto& s) { return product::is_in_sector(0.5 * (from + to), s.middle, s.opening); };
    if (std::any_of(sectors.begin(), sectors.end(), is_out)) continue;
    out.angle += to - from;
    x += std::sin(to) - std::sin(from), y += std::cos(from) - std::cos(to);
  }
  out.has_direction = std::hypot(x, y) > 1e-6;
  if (out.has_direction) out.azimuth = std::atan2(-y, -x);
  return out;
}

void Builder::make_shaft(int index) {
  const Member& m = member(index);
  const Shaft& s = plan.shafts[static_cast<size_t>(m.shaft)];
  const double H = m.end.z - m.start.z;
  ShaftModel& shaft = shafts[index];
  shaft.azimuth = std::atan2(map.fall_direction.y, map.fall_direction.x);
  std::vector<Sector> sectors;  // of charges as the plan has them, then of cuts
  for (const product::Stage& stage : plan.stages)
    for (const product::Charge& c : stage.charges)
      if (c.member == index) sectors.push_back({c.position, c.azimuth, c.opening});
  const size_t charges = sectors.size();
  for (const product::Weakening& w : m.weakenings) sectors.push_back({w.at, w.azimuth, w.opening});
  close_slivers(sectors, s, H);

  // levels: the foot or a mouth above a rigid stump, other mouths and cuts, and between them as far apart as wanted
  const std::vector<Level> levels = find_levels(plan, index);
  for (size_t i = 1; i < levels.size(); ++i)
    if (levels[i].low() < levels[i - 1].high() + kLeastRing - kSameLevel) {
      complain_of_charge(index, levels[i].at,
                         fmt::format("the mouths or cuts at {:.2f} m and {:.2f} m are too near to each other",
                                     levels[i - 1].at, levels[i].at),
                         "leave at least 0.3 m of the shaft between them, or give them the same position");
      return;
    }
  const bool has_stump =
      !levels.empty() && levels.front().is_mouth && levels.front().at <= kFixedStump * s.diameter_foot;
  std::vector<double> fixed;
  if (!has_stump) fixed.push_back(0);
  for (const Level& l : levels) {
    if (l.high() > H - kLeastRing + kSameLevel || (!has_stump && l.low() < 0.1 - kSameLevel)) {
      complain_of_charge(index, l.at,
                         fmt::format("a mouth or cut at {:.2f} m leaves nothing of the shaft on one side", l.at));
      return;
    }
    fixed.push_back(l.at);
  }
  fixed.push_back(H);
  const double spacing = s.joint_spacing > 0 ? s.joint_spacing : std::max(H / kPieces, 0.8 * s.diameter_foot);
  // a piece within a mouth would be left without mass, and its zones without what the charge does to the ring
  const double margin = std::max(kLeastRing, 0.25 * spacing);
  const auto is_free = [&](double height) {
    return std::none_of(levels.begin(), levels.end(), [&](const Level& l) {
      return l.is_mouth && height > l.low() - margin && height < l.high() + margin;
    });
  };
  std::vector<double> at;
  for (size_t i = 0; i + 1 < fixed.size(); ++i) {
    const double length = fixed[i + 1] - fixed[i];
    const int n = std::max(1, static_cast<int>(std::lround(length / spacing)));
    at.push_back(fixed[i]);
    for (int j = 1; j < n; ++j)
      if (const double height = fixed[i] + length * j / n; is_free(height)) at.push_back(height);
  }

  // staves between the edges of mouths and cuts, the same at every height
  std::vector<double> bounds;
  const std::vector<double> edges = find_edges(sectors, shaft.azimuth);
  std::vector<Sector> mouths = find_mouths(plan, sectors, index);
  mouths.insert(mouths.end(), sectors.begin() + static_cast<std::ptrdiff_t>(charges), sectors.end());
  const std::vector<double> ends = find_edges(mouths, shaft.azimuth);
  if (ends.empty()) {
    for (int i = 0; i <= kLeastStaves; ++i) bounds.push_back((i - 0.5) * 2 * kPi / kLeastStaves);
  } else {
    for (size_t i = 0; i < ends.size(); ++i) {
      const double from = ends[i], to = i + 1 < ends.size() ? ends[i + 1] : ends.front() + 2 * kPi;
      const int n = std::max(1, static_cast<int>(std::ceil((to - from) / (2 * kPi / kLeastStaves) - 1e-6)));
      for (int j = 0; j < n; ++j) bounds.push_back(from + (to - from) * j / n);
    }
    bounds.push_back(bounds.front() + 2 * kPi);
  }

  Shaft bare = s;
  bare.loads.clear();
  const std::string material = s.concrete >= 0 ? "concrete" : "masonry";
  const auto make_piece = [&](double low, double high) {
    std::vector<Part> parts;
    const int rings = std::max(1, static_cast<int>(std::ceil((high - low) * kPieces / H - 0.2)));
    for (int r = 0; r < rings; ++r) {
      const double a = low + (high - low) * r / rings, b = low + (high - low) * (r + 1) / rings;
      const double share = 0.5 * (a + b) / H, t = s.thickness(share), mean = s.outer(share) - 0.5 * t;
      const double mass = product::calc_shaft_mass(plan, bare, H, a / H, b / H);
      for (size_t i = 0; i + 1 < bounds.size(); ++i) {
        const double angle = bounds[i + 1] - bounds[i], turn = shaft.azimuth + 0.5 * (bounds[i] + bounds[i + 1]);
        // boxes whose inertia about the axis is that of the ring
        double radius = mean, breadth = 0;
        for (int iteration = 0; iteration < 4; ++iteration) {
          breadth = 2 * (radius + 0.5 * t) * std::tan(0.5 * angle);
          radius = std::sqrt(std::max(0.25 * mean * mean, mean * mean + t * t / 6 - breadth * breadth / 12));
        }
        Part p;
        p.centre = m.start + Vec3{radius * std::cos(turn), radius * std::sin(turn), 0.5 * (a + b)};
        p.half = {0.5 * t, 0.5 * breadth, 0.5 * (b - a)};
        p.mass = mass * angle / (2 * kPi);
        p.member = index, p.material = material, p.turn = turn;
        parts.push_back(p);
      }
    }
    for (const Shaft::Load& l : s.loads) {
      if (l.at < low || (l.at >= high && !(high >= H - 1e-9))) continue;
      const double r = s.outer(l.at / H) * std::sqrt(1.5);  // as much inertia as a ring of the shaft's radius
      Part p = make_part(m.start + Vec3{-r, -r, l.at - 0.05}, m.start + Vec3{r, r, l.at + 0.05}, l.mass, -1);
      p.is_solid = false;
      parts.push_back(p);
    }
    return parts;
  };
  int below = -1;
  if (has_stump) below = add_assembly({m.name + "/stump", "stump", 0, true, make_piece(0, at.front())});
  for (size_t i = 0; i < at.size(); ++i) {
    const double top = i + 1 < at.size() ? at[i + 1] : H, bottom = at[i];
    ShaftJoint joint;
    joint.at = bottom;
    joint.below = below;
    joint.above = below =
        add_assembly({fmt::format("{}/{}", m.name, i + 1), "shaft", 0, false, make_piece(bottom, top)});
    joint.length = 0.5 * (top - bottom) + (i > 0 ? 0.5 * (bottom - at[i - 1]) : has_stump ? bottom : 0.0);
    for (const Level& l : levels)
      if (std::abs(l.at - bottom) < 1e-9) joint.height = l.height;
    shaft.joints.push_back(joint);
  }
  // slits that are cut through
  for (const product::Weakening& w : m.weakenings) {
    if (w.cut_concrete < 1) continue;
    const auto applies = [&](const Part& p) {
      return p.is_solid &&
             product::is_in_sector(std::atan2(p.centre.y - m.start.y, p.centre.x - m.start.x), w.azimuth, w.opening);
    };
    for (Assembly& a : assemblies)
      if (std::any_of(a.parts.begin(), a.parts.end(), [&](const Part& p) { return p.member == index; }))
        cut_member(a, index, 2, m.start.z + w.at - 0.5 * w.height, m.start.z + w.at + 0.5 * w.height, applies);
  }

  // what holds together at each level
  for (ShaftJoint& joint : shaft.joints) {
    nearfield::RingInput ring;
    const double share = joint.at / H;
    ring.name = fmt::format("{} at {:.2f} m", m.name, joint.at);
    ring.outer = s.outer(share), ring.thickness = s.thickness(share);
    ring.concrete = concrete_of_shaft(plan, s);
    if (s.steel >= 0) ring.steel = plan.steels[static_cast<size_t>(s.steel)];
    ring.as_outer = s.as_outer, ring.as_inner = s.as_inner;
    ring.bar_diameter = s.bar_diameter, ring.cover = s.cover;
    ring.hoop_diameter = s.hoop_diameter, ring.hoop_spacing = s.hoop_spacing;
    ring.length = std::min({k.zone_length_by_depth * 2 * ring.outer, joint.length,
                            nearfield::kLongestZoneShare * nearfield::calc_largest_zone_length(ring.concrete)});
    if (joint.height > 0) ring.length = std::min(ring.length, joint.height);

    struct Owner {
      int stage = -1, charge = -1;
      std::vector<nearfield::RingSector> sectors;
    };
    std::vector<Owner> owners(1);
    std::vector<double> cuts = edges;
    if (cuts.empty()) cuts = {0};
    for (size_t i = 0; i < cuts.size(); ++i) {
      const double from = cuts[i], to = i + 1 < cuts.size() ? cuts[i + 1] : cuts.front() + 2 * kPi;
      const double angle = shaft.azimuth + 0.5 * (from + to);
      nearfield::RingSector sector{from, to, 1, 1};
      for (const product::Weakening& w : m.weakenings) {
        if (std::abs(w.at - joint.at) > std::max(0.5 * joint.height, 0.5 * w.height) + 0.01) continue;
        if (!product::is_in_sector(angle, w.azimuth, w.opening)) continue;
        sector.concrete = std::min(sector.concrete, 1 - w.cut_concrete);
        sector.bars = std::min(sector.bars, 1 - w.cut_bars);
      }
      if (!(sector.concrete > 0) && !(sector.bars > 0 && (s.as_outer > 0 || s.as_inner > 0))) continue;
      Owner by;
      for (size_t stage = 0; stage < plan.stages.size(); ++stage)
        for (size_t c = 0; c < plan.stages[stage].charges.size(); ++c) {
          const product::Charge& charge = plan.stages[stage].charges[c];
          if (charge.member != index || std::abs(charge.position - joint.at) > kSameLevel) continue;
          if (product::is_in_sector(angle, charge.azimuth, charge.opening))
            by = {static_cast<int>(stage), static_cast<int>(c), {}};
        }
      auto owner = std::find_if(owners.begin(), owners.end(),
                                [&](const Owner& o) { return o.stage == by.stage && o.charge == by.charge; });
      if (owner == owners.end()) owner = owners.insert(owners.end(), by);
      owner->sectors.push_back(sector);
    }
    for (Owner& o : owners) {
      if (o.sectors.empty()) continue;
      ShaftElement e;
      e.ring = ring;
      e.stage = o.stage, e.charge = o.charge;
      // the whole ring as it is needs no sectors
      const bool is_whole = edges.empty() && o.sectors.front().concrete == 1 && o.sectors.front().bars == 1;
      if (!is_whole) e.ring.sectors = std::move(o.sectors);
      double around = 0;
      for (const nearfield::RingSector& x : e.ring.sectors) around += x.concrete == 1 && x.bars == 1 ? x.angle() : 0;
      if (around > 2 * kPi - 1e-6) e.ring.sectors.clear();
      e.azimuth = shaft.azimuth + nearfield::turn_to_principal_axes(e.ring);
      e.whole = nearfield::calc_ring_properties(e.ring);
      joint.elements.push_back(std::move(e));
    }
    if (joint.elements.empty()) complain(index, fmt::format("nothing is left of the ring at {:.2f} m", joint.at));
  }
}

void Builder::connect_shaft(int index) {
  const Member& m = member(index);
  const Shaft& s = plan.shafts[static_cast<size_t>(m.shaft)];
  const double H = m.end.z - m.start.z;
  ShaftModel& shaft = shafts[index];
  const Vec3 up{0, 0, 1};
  for (ShaftJoint& joint : shaft.joints) {
    const double weight = plan.analysis.gravity * product::calc_shaft_mass(plan, s, H, joint.at / H, 1);
    double EA = 0;
    const bool is_mouth = joint.elements.size() > 1;
    bool fails = false;
    for (const ShaftElement& e : joint.elements) {
      EA += e.whole.EA;
      fails |= e.charge >= 0 && charge_of(e).fails;
    }
    int number = 0;
    for (ShaftElement& e : joint.elements) {
      const Vec3 along{std::cos(e.azimuth), std::sin(e.azimuth), 0}, across = cross(up, along);
      const nearfield::Rcc rcc = nearfield::make_ring_rcc(e.ring);
      const double N = -weight * e.whole.EA / EA, l = joint.length;
      // a closed ring bends alike about all axes
      const double EI_z = rcc.calc_EI_effective_z(N), EI_y = e.ring.sectors.empty() ? EI_z : rcc.calc_EI_effective_y(N);
      std::string name = fmt::format("{}/{:.1f}m", m.name, joint.at);
      if (e.charge >= 0) name += number++ > 0 ? fmt::format("/mouth{}", number) : "/mouth";
      mbs::ZoneLaw law = make_zone_law(rcc, EI_y, EI_z, name, k);
      law.biaxial_exponent = std::clamp(rcc.biaxial_exponent, 1.0, 4.0);
      end_at_contact(law, rcc, e.ring, joint.height);
      const Vec3 p_W = m.start + joint.at * up + e.whole.y * along + e.whole.z * across;
      const mbs::LawId id = mbs::add_law(model, law);
      e.element = add_element(name, index, joint.below, joint.above, p_W, Mat3::from_columns(up, along, across),
                              {rcc.EA / l, rcc.GA / l, rcc.GA / l}, {rcc.GJ / l, EI_y / l, EI_z / l}, {{0, id}})
                      .index;
      // a block turns over one hinge, on what is left of the ring if all charges fire
      if (!is_mouth || e.charge >= 0 || fails) continue;
      GroundColumn hinge;
      hinge.member = m.name;
      hinge.p_foot = hinge.p_top = p_W;
      hinge.normal_force = -weight;
      hinge.element.name = name;
      hinge.element.law = id;
      hinge.body = joint.above;
      map.ground_columns.push_back(hinge);
    }
    note_mouth(m, s, shaft, joint);
  }
}

/// What the charges at a level leave of the ring, and whether it bears what is above.
void Builder::note_mouth(const Member& m, const Shaft& s, const ShaftModel& shaft, const ShaftJoint& joint) {
  const double H = m.end.z - m.start.z, g = plan.analysis.gravity;
  nearfield::RingInput left;
  std::vector<nearfield::RingSector> sectors;  // angles from the shaft's azimuth
  Shaft bare = s;
  bare.loads.clear();
  const double weight = g * product::calc_shaft_mass(plan, s, H, joint.at / H, 1);
  double stays = weight;
  Vec3 thrown;  // moment of what is thrown out about the shaft's axis [N·m]
  for (const ShaftElement& e : joint.elements) {
    left = e.ring;
    if (e.charge < 0 || charge_of(e).fails) {
      for (nearfield::RingSector x : e.ring.sectors) {
        const double from = wrap(x.from + e.azimuth - shaft.azimuth);
        x.to = from + x.angle(), x.from = from;
        sectors.push_back(x);
      }
      continue;
    }
    double share = 0;  // of the ring
    for (const nearfield::RingSector& x : e.ring.sectors) share += x.angle() / (2 * kPi);
    const double out =
        g * share *
        product::calc_shaft_mass(plan, bare, H, joint.at / H, (joint.at + 0.5 * charge_of(e).destroyed_length) / H);
    const double c = std::cos(e.azimuth), d = std::sin(e.azimuth);
    stays -= out, thrown += out * Vec3{e.whole.y * c - e.whole.z * d, e.whole.y * d + e.whole.z * c, 0};
  }
  if (stays == weight || sectors.empty()) return;
  left.sectors = sectors;
  const double azimuth = shaft.azimuth + nearfield::turn_to_principal_axes(left);
  // beside charges the concrete is weaker
  for (const ShaftElement& e : joint.elements)
    if (e.charge >= 0 && !charge_of(e).fails)
      left.concrete_loss = std::max(left.concrete_loss, charge_of(e).transition_damage);
  const nearfield::RingProperties p = nearfield::calc_ring_properties(left);
  const double c = std::cos(azimuth), d = std::sin(azimuth);
  const Vec3 centroid{p.y * c - p.z * d, p.y * d + p.z * c, 0};
  const Vec3 tips = -stays * centroid - thrown;  // towards where what is above goes [N·m]
  const double moment = norm(tips), way = std::atan2(tips.y, tips.x), off = std::hypot(p.y, p.z);

  const nearfield::Rcc rcc = nearfield::make_ring_rcc(left);
  double EA = 0;
  for (const ShaftElement& e : joint.elements) EA += e.whole.EA;
  const double N = -weight * p.EA / EA;  // before, as of the zone itself
  const double EI_z = rcc.calc_EI_effective_z(N), EI_y = rcc.calc_EI_effective_y(N);
  mbs::ZoneLaw law = make_zone_law(rcc, EI_y, EI_z, m.name, k);
  law.biaxial_exponent = std::clamp(rcc.biaxial_exponent, 1.0, 4.0);
  end_at_contact(law, rcc, left, joint.height);
  const Tipping tipping = find_tipping(law, way - azimuth, -stays);
  const double along_y = std::cos(way - azimuth), along_z = std::sin(way - azimuth);
  const double stiffness = 1 / (joint.length * (along_y * along_y / EI_z + along_z * along_z / EI_y));
  const double middle = m.start.z + joint.at;
  double lever = 0;  // of the weight above, over this level [N·m]
  for (const ShaftJoint& above : shaft.joints)
    if (above.at >= joint.at)
      for (const Part& part : assemblies[static_cast<size_t>(above.above)].parts)
        lever += g * part.mass * (part.centre.z - middle);
  const char* verdict = "does not turn over, nor does a rigid block that is let go at once on such a hinge";
  if (moment > tipping.most())
    verdict = "turns over";
  else if (!comes_to_a_stop(tipping, moment, lever, stiffness, law.rupture_rotation))
    verdict = "does not turn over by its weight alone, but a rigid block that is let go at once on such a hinge does";
  const bool is_pulled = std::ranges::any_of(
      plan.cables, [&](const product::Cable& x) { return &member(x.member) == &m && x.position > joint.at; });
  double degrees = 0;
  for (const nearfield::RingSector& x : left.sectors) degrees += x.concrete > 0 ? x.angle() / unit::deg : 0;
  map.notes.push_back(
      {"The mouth of " + m.name,
       fmt::format("The mouth of {} at {:.1f} m leaves {:.0f} deg of the ring. The weight of {} MN above it turns "
                   "with {} MNm towards {} about the centroid of what is left, {:.2f} m off the axis, which "
                   "resists with {} MNm at most: it {}.",
                   m.name, joint.at, degrees, decimal_words(stays * 1e-6, 2), decimal_words(moment * 1e-6, 2),
                   record::tell_azimuth(way), off, decimal_words(tipping.most() * 1e-6, 2), verdict)});
  if (is_pulled) map.notes.back().text += " Cables are not counted in that.";
}

const product::Charge& Builder::charge_of(const ShaftElement& e) const {
  return plan.stages[static_cast<size_t>(e.stage)].charges[static_cast<size_t>(e.charge)];
}

void Builder::fire_shaft(const Firing& firing, mbs::Event& event, mbs::Event& lighter) {
  const product::Charge& c = plan.stages[static_cast<size_t>(firing.stage)].charges[static_cast<size_t>(firing.charge)];
  const Member& m = member(c.member);
  for (ShaftJoint& joint : shafts[c.member].joints) {
    const bool is_here = std::abs(joint.at - c.position) < kSameLevel;
    for (ShaftElement& e : joint.elements) {
      if (e.element < 0 || !is_here) continue;
      const auto switch_to = [&](mbs::LawId law, double share) {
        mbs::Action act = make_switch(law, share);
        act.element = mbs::ElementId{e.element};
        event.actions.push_back(act);
      };
      const auto key = std::make_tuple(e.element, c.destroyed_length, c.residual_bars, c.position);
      if (e.stage == firing.stage && e.charge == firing.charge) {
        const nearfield::ResidualCage cage = nearfield::make_ring_cage(e.ring, c.destroyed_length, c.residual_bars);
        if (!cage_laws.count(key)) {
          mbs::ZoneLaw law = make_cage_law(cage, c.destroyed_length, m.name + "/charge", k);
          // lips that meet are a contact
          law.rupture_rotation = std::min(law.rupture_rotation, kClosing * c.destroyed_length / (2 * e.ring.outer));
          law.crush_length *= kClosing;
          // where the rest turns over, bars that have buckled or torn must not keep the lips from meeting
          for (const ShaftElement& rest : joint.elements)
            if (rest.charge < 0) {
              const auto& stations = model.elements[static_cast<size_t>(rest.element)].stations;
              const mbs::ZoneLaw& hinge = model.laws[static_cast<size_t>(stations.front().law.index)];
              law.rupture_rotation = std::min(law.rupture_rotation, hinge.rupture_rotation);
              law.crush_length = std::min(law.crush_length, hinge.crush_length);
            }
          cage_laws[key] = mbs::add_law(model, law);
        }
        const double before = model.elements[static_cast<size_t>(e.element)].translational_stiffness.x;
        switch_to(cage_laws[key], std::clamp(cage.EA / (c.destroyed_length * before), kLeastStiffnessShare, 1.0));
        if (!(cage.EA > 0)) {
          mbs::Action act;
          act.kind = mbs::Action::Kind::RemoveElement;
          act.element = mbs::ElementId{e.element};
          lighter.actions.push_back(act);
        }
        ZoneEntry& zone = map.elements[static_cast<size_t>(e.element)];
        zone.firing_time = std::min(zone.firing_time, firing.time);
      } else if (e.charge < 0 && c.transition_damage > 0) {
        double damage = 0;  // of the charges so far
        for (const Firing& f : map.schedule) {
          const product::Charge& other =
              plan.stages[static_cast<size_t>(f.stage)].charges[static_cast<size_t>(f.charge)];
          if (!f.fails && f.time <= firing.time && other.member == c.member &&
              std::abs(other.position - joint.at) < kSameLevel)
            damage = std::max(damage, other.transition_damage);
        }
        const auto damaged = std::make_tuple(e.element, -1.0, damage, c.position);
        if (!cage_laws.count(damaged)) {
          nearfield::RingInput in = e.ring;
          in.concrete_loss = damage;
          const mbs::ZoneElement& was = model.elements[static_cast<size_t>(e.element)];
          const nearfield::Rcc rcc = nearfield::make_ring_rcc(in);
          mbs::ZoneLaw law = make_zone_law(rcc, was.rotational_stiffness.y * joint.length,
                                           was.rotational_stiffness.z * joint.length, m.name + "/transition", k);
          end_at_contact(law, rcc, e.ring, joint.height);
          cage_laws[damaged] = mbs::add_law(model, law);
        }
        switch_to(cage_laws[damaged], 1);
      }
    }
  }
}

}  // namespace topple::collapse
