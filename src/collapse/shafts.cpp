/// Shafts of rings: bodies between levels at which they may break, and sectors at mouths (docs/theory/ring.md).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/unit.h"
#include "collapse/builder.h"
#include "nearfield/shell.h"

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

std::vector<Level> find_levels(const product::Plan& plan, int index) {
  std::vector<Level> out;
  for (const product::Stage& s : plan.stages)
    for (const product::Charge& c : s.charges)
      if (c.member == index &&
          std::none_of(out.begin(), out.end(), [&](const Level& l) { return std::abs(l.at - c.position) < 1e-6; }))
        out.push_back({c.position, c.destroyed_length, true});
  for (const product::Weakening& w : plan.members[static_cast<size_t>(index)].weakenings) {
    const auto is_in = [&](const Level& l) { return w.at >= l.low() - 0.01 && w.at <= l.high() + 0.01; };
    if (std::none_of(out.begin(), out.end(), is_in)) out.push_back({w.at, w.height, false});
  }
  std::sort(out.begin(), out.end(), [](const Level& a, const Level& b) { return a.at < b.at; });
  return out;
}

double wrap(double angle) {
  const double a = std::fmod(angle, 2 * kPi);
  return a < 0 ? a + 2 * kPi : a;
}

/// Edges of the sectors of charges and cuts, from 0 to 2 pi, each once; angles count from `azimuth`.
std::vector<double> find_edges(const std::vector<std::pair<double, double>>& sectors, double azimuth) {
  std::vector<double> edges;
  for (const auto& [middle, opening] : sectors) {
    if (product::is_all_around(opening)) continue;
    for (const double side : {-0.5, 0.5}) edges.push_back(wrap(middle + side * opening - azimuth));
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end(), [](double a, double b) { return b - a < 1e-6; }), edges.end());
  if (edges.size() > 1 && edges.front() + 2 * kPi - edges.back() < 1e-6) edges.pop_back();
  return edges;
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

/// Largest moment about z that presses the side of positive y, under a normal force.
double find_resistance(const mbs::MomentFamily& f, double N) {
  const size_t J = f.plastic_rotation.size();
  double most = 0;
  for (size_t n = 0; n + 1 < f.normal_force.size(); ++n) {
    if (N < f.normal_force[n] || N > f.normal_force[n + 1]) continue;
    const double s = (N - f.normal_force[n]) / (f.normal_force[n + 1] - f.normal_force[n]);
    for (size_t j = 0; j < J; ++j)
      most = std::max(most, (1 - s) * f.positive[n * J + j] + s * f.positive[(n + 1) * J + j]);
  }
  return most;
}

}  // namespace

void Builder::make_shaft(int index) {
  const Member& m = member(index);
  const Shaft& s = plan.shafts[static_cast<size_t>(m.shaft)];
  const double H = m.end.z - m.start.z;
  ShaftModel& shaft = shafts[index];
  shaft.azimuth = std::atan2(map.fall_direction.y, map.fall_direction.x);
  std::vector<std::pair<double, double>> sectors;  // middle and opening, in W
  bool has_mouth = false;
  for (const product::Stage& stage : plan.stages)
    for (const product::Charge& c : stage.charges) {
      if (c.member != index) continue;
      sectors.emplace_back(c.azimuth, c.opening);
      if (!has_mouth && !product::is_all_around(c.opening)) shaft.azimuth = c.azimuth, has_mouth = true;
    }
  for (const product::Weakening& w : m.weakenings) sectors.emplace_back(w.azimuth, w.opening);

  // levels: the foot or a mouth above a rigid stump, other mouths and cuts, and between them as far apart as wanted
  const std::vector<Level> levels = find_levels(plan, index);
  for (size_t i = 1; i < levels.size(); ++i)
    if (levels[i].low() < levels[i - 1].high() + kLeastRing) {
      complain(index,
               fmt::format("the mouths or cuts at {:.2f} m and {:.2f} m are too near to each other", levels[i - 1].at,
                           levels[i].at),
               "leave at least 0.3 m of the shaft between them, or give them the same position");
      return;
    }
  const bool has_stump =
      !levels.empty() && levels.front().is_mouth && levels.front().at <= kFixedStump * s.diameter_foot;
  std::vector<double> fixed;
  if (!has_stump) fixed.push_back(0);
  for (const Level& l : levels) {
    if (l.high() > H - kLeastRing || (!has_stump && l.low() < 0.1)) {
      complain(index, fmt::format("a cut at {:.2f} m leaves nothing of the shaft on one side", l.at));
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

  // staves between the edges of sectors, the same at every height
  std::vector<double> bounds;
  const std::vector<double> edges = find_edges(sectors, shaft.azimuth);
  if (edges.empty()) {
    for (int i = 0; i <= kLeastStaves; ++i) bounds.push_back((i - 0.5) * 2 * kPi / kLeastStaves);
  } else {
    for (size_t i = 0; i < edges.size(); ++i) {
      const double from = edges[i], to = i + 1 < edges.size() ? edges[i + 1] : edges.front() + 2 * kPi;
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
                            0.9 * nearfield::calc_largest_zone_length(ring.concrete)});
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
      Owner* owner = &owners.front();
      for (size_t stage = 0; stage < plan.stages.size(); ++stage)
        for (size_t c = 0; c < plan.stages[stage].charges.size(); ++c) {
          const product::Charge& charge = plan.stages[stage].charges[c];
          if (charge.member != index || std::abs(charge.position - joint.at) > 1e-6) continue;
          if (!product::is_in_sector(angle, charge.azimuth, charge.opening)) continue;
          const auto found = std::find_if(owners.begin(), owners.end(), [&](const Owner& o) {
            return o.stage == static_cast<int>(stage) && o.charge == static_cast<int>(c);
          });
          if (found != owners.end()) {
            owner = &*found;
          } else {
            owners.push_back({static_cast<int>(stage), static_cast<int>(c), {}});
            owner = &owners.back();
          }
        }
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
  const Vec3 up{0, 0, 1}, along{std::cos(shaft.azimuth), std::sin(shaft.azimuth), 0}, across = cross(up, along);
  const Mat3 axes = Mat3::from_columns(up, along, across);
  for (ShaftJoint& joint : shaft.joints) {
    const double weight = plan.analysis.gravity * product::calc_shaft_mass(plan, s, H, joint.at / H, 1);
    double EA = 0;
    for (const ShaftElement& e : joint.elements) EA += e.whole.EA;
    int number = 0;
    for (ShaftElement& e : joint.elements) {
      const nearfield::Rcc rcc = nearfield::make_ring_rcc(e.ring);
      const double N = -weight * e.whole.EA / EA, l = joint.length;
      // a closed ring bends alike about all axes
      const double EI_z = rcc.calc_EI_effective_z(N), EI_y = e.whole.is_closed ? EI_z : rcc.calc_EI_effective_y(N);
      std::string name = fmt::format("{}/{:.1f}m", m.name, joint.at);
      if (e.charge >= 0) name += number++ > 0 ? fmt::format("/mouth{}", number) : "/mouth";
      mbs::ZoneLaw law = make_zone_law(rcc, EI_y, EI_z, name, k);
      law.biaxial_exponent = std::clamp(rcc.biaxial_exponent, 1.0, 4.0);
      end_at_contact(law, rcc, e.ring, joint.height);
      const Vec3 p_W = m.start + joint.at * up + e.whole.y * along + e.whole.z * across;
      const mbs::LawId id = mbs::add_law(model, law);
      e.element = add_element(name, index, joint.below, joint.above, p_W, axes, {rcc.EA / l, rcc.GA / l, rcc.GA / l},
                              {rcc.GJ / l, EI_y / l, EI_z / l}, {{0, id}})
                      .index;
      const bool is_mouth = joint.elements.size() > 1;
      if (!is_mouth || e.charge >= 0) continue;
      GroundColumn hinge;
      hinge.member = m.name;
      hinge.p_foot = hinge.p_top = p_W;
      hinge.normal_force = -weight;
      hinge.element.name = name;
      hinge.element.law = id;
      hinge.body = joint.above;
      map.ground_columns.push_back(hinge);
      // once the concrete is out
      Shaft bare = s;
      bare.loads.clear();
      double stays = weight, overturning = -weight * e.whole.y;
      for (const ShaftElement& mouth : joint.elements) {
        if (mouth.charge < 0) continue;
        const product::Charge& c =
            plan.stages[static_cast<size_t>(mouth.stage)].charges[static_cast<size_t>(mouth.charge)];
        double share = 0;  // of the ring
        for (const nearfield::RingSector& x : mouth.ring.sectors) share += x.angle() / (2 * kPi);
        const double out = c.fails ? 0
                                   : plan.analysis.gravity * share *
                                         product::calc_shaft_mass(plan, bare, H, joint.at / H,
                                                                  (joint.at + 0.5 * c.destroyed_length) / H);
        stays -= out, overturning -= out * (mouth.whole.y - e.whole.y);
      }
      const double resistance = find_resistance(law.moment_z, -stays);
      double left = 0;
      for (const nearfield::RingSector& x : e.ring.sectors) left += x.concrete > 0 ? x.angle() : 0;
      map.notes.push_back(
          {"The mouth of " + m.name,
           fmt::format(
               "The mouth of {} at {:.1f} m leaves {:.0f} deg of the ring. The weight of {:.2f} MN above it turns with "
               "{:.2f} "
               "MNm about the centroid of what is left, {:.2f} m behind the axis, which resists with {:.2f} MNm at "
               "most: it "
               "{}.",
               m.name, joint.at, left / unit::deg, stays * 1e-6, overturning * 1e-6, -e.whole.y, resistance * 1e-6,
               overturning > resistance ? "turns over" : "does not turn over by its weight alone")});
    }
  }
}

void Builder::fire_shaft(const Firing& firing, mbs::Event& event, mbs::Event& lighter) {
  const product::Charge& c = plan.stages[static_cast<size_t>(firing.stage)].charges[static_cast<size_t>(firing.charge)];
  const Member& m = member(c.member);
  for (ShaftJoint& joint : shafts[c.member].joints) {
    const bool is_here = std::abs(joint.at - c.position) < 1e-6;
    for (ShaftElement& e : joint.elements) {
      if (e.element < 0 || !is_here) continue;
      const auto switch_to = [&](mbs::LawId law, double share) {
        mbs::Action act;
        act.kind = mbs::Action::Kind::SwitchLaw;
        act.element = mbs::ElementId{e.element};
        act.ramp = k.charge_release_time;
        act.law = law;
        act.stiffness_share = share;
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
        const auto damaged = std::make_tuple(e.element, -1.0, c.transition_damage, c.position);
        if (!cage_laws.count(damaged)) {
          nearfield::RingInput in = e.ring;
          in.concrete_loss = c.transition_damage;
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
