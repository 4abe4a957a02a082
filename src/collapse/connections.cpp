/// Zones, joints and force elements between the bodies (docs/theory/manager.md, sections 2 and 3).

#include <algorithm>
#include <cmath>
#include <tuple>

#include "base/error.h"
#include "collapse/builder.h"
#include "nearfield/fired.h"

namespace topple::collapse {

using product::Member;
using product::MemberKind;

namespace {

constexpr const char* kSixComponents = "six-component element";
constexpr const char* kHinge = "revolute joint + rotational element";
constexpr const char* kRigid = "rigid joint";
constexpr double kCrushedThrough = 0.95;  // of a column: at its end both ends meet, and the chord has no direction
constexpr double kLeastFootShare = 0.2;   // of the head's moment, at a charge near or above the middle of a column

double largest_moment(const mbs::MomentFamily& f) {
  double m = 0;
  for (double v : f.positive) m = std::max(m, v);
  for (double v : f.negative) m = std::max(m, v);
  return m;
}

/// Length along a wall over which there are openings, those above each other counted once [m].
///   at_base  only those that reach the floor
double calc_open_length(const Member& m, bool at_base) {
  std::vector<std::pair<double, double>> spans;
  for (const product::Opening& o : m.openings)
    if (!at_base || o.sill < 1e-6) spans.emplace_back(o.left, o.left + o.width);
  std::sort(spans.begin(), spans.end());
  double open = 0, upto = -1e30;
  for (const auto& [from, to] : spans) {
    if (to <= upto) continue;
    // all of one that stands alone, without round-off
    open += from >= upto ? to - from : to - upto;
    upto = to;
  }
  return open;
}

/// The same law by a name.
mbs::SharedLaw named(const mbs::SharedLaw& from, const std::string& name) {
  if (from->name == name) return from;
  mbs::ZoneLaw law = *from;
  law.name = name;
  return law;
}

/// Turns both ends by as much, apart about y, so that the element at rest has no force where M is turned by it [rad].
void turn_apart(mbs::ZoneElement& e, double turn) {
  e.X_AF.q = e.X_AF.q * exp_rotation({0, -0.5 * turn, 0});
  e.X_BM.q = e.X_BM.q * exp_rotation({0, 0.5 * turn, 0});
}

}  // namespace

double Builder::kept_of(int index) const {
  double kept = 1;
  for (const product::Weakening& w : member(index).weakenings) kept = std::min(kept, 1 - w.cut_concrete);
  return std::max(kept, 1e-3);
}

void Builder::estimate_normal_forces() {
  // weights go straight down from joint to joint; beams and the walls on them give half to each end
  std::map<GridPoint, double> load;
  const double g = plan.analysis.gravity;
  for (const auto& [at, body] : node_body) load[at] += g * assemblies[static_cast<size_t>(body)].mass();
  const auto share = [&](int index, const GridPoint& a, const GridPoint& b) {
    if (!own_body.count(index)) return;
    if (is_cast_on_beam(index)) return;  // counted with the beam
    const double w = 0.5 * g * assemblies[static_cast<size_t>(own_body[index])].mass();
    if (load.count(a)) load[a] += w;
    if (load.count(b)) load[b] += w;
  };
  for (const auto& [at, index] : x_beams) share(index, at, {at.row + 1, at.frame, at.storey});
  for (const auto& [at, index] : x_walls)
    share(index, {at.row, at.frame, at.storey - 1}, {at.row + 1, at.frame, at.storey - 1});
  std::map<GridPoint, double> above;
  for (int s = static_cast<int>(plan.storey_heights.size()) - 1; s >= 0; --s)
    for (const auto& [at, index] : columns) {
      if (at.storey != s) continue;
      const GridPoint up{at.row, at.frame, s + 1};
      const double force = load[at] + (above.count(up) ? above[up] : 0.0);
      above[at] = force;
      zones[index].normal_force = -force;
    }
}

nearfield::Flange Builder::find_flange(const GridPoint& at, int beam) const {
  nearfield::Flange out;
  const product::Section& web = section_of(beam);
  const auto add_bars = [](nearfield::Flange::Bars& to, double bars, double depth) {
    if (!(bars > 0)) return;
    // of two slabs at the depth that has their first moment
    if (to.depth != depth) to.depth = (to.area * to.depth + bars * depth) / (to.area + bars);
    to.area += bars;
  };
  for (const int side : {-1, 0}) {
    const int slab = find_at(slabs, {at.row, at.frame + side, at.storey});
    if (slab < 0 || panel_of(slab).concrete < 0) continue;
    const Member& m = member(slab);
    const product::Panel& panel = panel_of(slab);
    const double half_gap = 0.5 * (m.end.y - m.start.y - web.width);
    if (!(half_gap > 0) || panel.thickness > web.height) continue;
    const double breadth =
        k.slab_flange_share * kept_of(slab) * calc_flange_breadth(half_gap, zones.at(beam).clear_length);
    const double strength = plan.concretes[static_cast<size_t>(panel.concrete)].fc / concrete_of(web).fc;
    out.breadth += std::min(1.0, strength) * breadth;
    // of two slabs the thinner one
    if (out.thickness == 0 || panel.thickness < out.thickness) out.thickness = panel.thickness;
    if (panel.steel < 0) continue;
    // it spans from beam to beam, so what lies along this one only distributes
    const double bars = k.slab_distribution_share * breadth;
    add_bars(out.top, bars * panel.as_top, panel.cover);
    add_bars(out.bottom, bars * panel.as_bottom, panel.thickness - panel.cover);
    // and of the weaker steel
    const product::Steel& steel = plan.steels[static_cast<size_t>(panel.steel)];
    if (!(out.steel.fy > 0) ||
        std::tie(steel.fy, steel.fu, steel.eps_u) < std::tie(out.steel.fy, out.steel.fu, out.steel.eps_u))
      out.steel = steel;
  }
  for (nearfield::Flange::Bars* bars : {&out.top, &out.bottom}) bars->depth = std::min(bars->depth, out.thickness);
  return out;
}

void Builder::request_station(int index, int which) {
  const Member& m = member(index);
  const product::Section& s = section_of(index);
  MemberZones& z = zones[index];
  MemberStation& station = z.station[static_cast<size_t>(which)];
  nearfield::ZoneInput in;
  in.section = s;
  in.concrete = concrete_of(s);
  in.steel = steel_of(s);
  const bool is_column = m.kind == MemberKind::Column;
  const double depth = is_column && hinge_about_y ? s.width : s.height;
  if (const GridPoint at{m.row_a, m.frame_a, m.storey}; find_at(x_beams, at) == index)
    in.flange = find_flange(at, index);
  in.length = calc_zone_length(s, in.concrete, in.steel, depth, z.clear_length, k);
  for (const product::Weakening& w : m.weakenings) {
    if (find_nearer_station(z, w.at) != which) continue;
    in.cut_bars = std::max(in.cut_bars, w.cut_bars);
    in.cut_concrete = std::max(in.cut_concrete, w.cut_concrete);
  }
  station.zone = library.request(in);
  if (is_column && m.storey > 0) return;
  const nearfield::ZoneInput prepared = in;
  for (size_t stage = 0; stage < plan.stages.size(); ++stage)
    for (size_t i = 0; i < plan.stages[stage].charges.size(); ++i) {
      const product::Charge& c = plan.stages[stage].charges[i];
      if (c.member != index || c.fails) continue;
      const bool acts_here = which == (is_column ? 0 : find_nearer_station(z, c.position));
      if (c.residual_concrete > 0 && (acts_here || (!is_column && reaches_station(c, station))))
        partial_zones[{static_cast<int>(stage), static_cast<int>(i), which}] =
            library.request(nearfield::make_partial_zone(
                prepared, {c.destroyed_length, c.residual_bars, c.transition_damage, c.residual_concrete}));
      // a charge elsewhere in the member may reach this zone
      if (!(c.transition_damage > 0)) continue;
      const double gap = std::abs(c.position - station.at) - 0.5 * c.destroyed_length;
      if (acts_here || gap > k.charge_transition_reach * depth) continue;
      in.concrete_loss = std::max(in.concrete_loss, c.transition_damage);
      lose_cover(in);
      station.damaged = library.request(in);
    }
}

void Builder::set_lever(MemberZones& z, double share) const {
  // of the head's moment what the foot has at the charge, as in a column whose ends do not turn
  const double foot = std::max(2 * share - 1, kLeastFootShare), head = 2 * share / (1 + foot);
  z.lever[0] = {share, foot * head, share};
  if (!hinge_about_y) std::swap(z.lever[0].moment_y, z.lever[0].moment_z);
  z.lever[1] = {head, head, share};
}

void Builder::request_zones() {
  for (const auto& [at, index] : columns) {
    MemberZones& z = zones[index];
    z.clear_length = core_low[at] - member(index).start.z;
    const auto charged = lowest_charge.find(index);
    z.station[1].at = z.clear_length;
    if (at.storey > 0 || charged == lowest_charge.end() || stump_body.count(index) == 0) continue;
    z.station[0].at = charged->second;
    set_lever(z, 1 - charged->second / z.clear_length);
  }
  for (const auto* beams : {&x_beams, &y_beams})
    for (const auto& [at, index] : *beams) {
      MemberZones& z = zones[index];
      z.station[0].at = z.clear_start;
      z.station[1].at = z.clear_start + z.clear_length;
    }
  for (const auto* members : {&columns, &x_beams, &y_beams})
    for (const auto& [at, index] : *members)
      if (members == &y_beams ? has_link(at.frame) : has_frame(at.frame))
        for (int which : {0, 1}) request_station(index, which);
}

bool Builder::has_frame(int frame) const {
  if (!condensation) return true;
  const int c = condensation->class_of[static_cast<size_t>(frame)];
  return c >= 0 && condensation->frames[static_cast<size_t>(c)].front() == frame;
}

bool Builder::has_link(int frame) const {
  if (!condensation) return true;
  // the first one between two classes stands for all of them
  const auto pair_of = [&](int f) {
    const size_t i = static_cast<size_t>(f);
    return std::minmax(condensation->class_of[i], condensation->class_of[i + 1]);
  };
  const std::pair<int, int> here = pair_of(frame);
  if (here.first == here.second || here.first < 0) return false;
  for (int f = 0; f < frame; ++f)
    if (std::pair<int, int>(pair_of(f)) == here) return false;
  return true;
}

Builder::Stiffness Builder::calc_stiffness(const MemberZones& z) const {
  Stiffness s;
  for (const MemberStation& station : z.station) {
    // a preparation is local, so the member keeps the stiffness of its better end
    const nearfield::Rcc& rcc = library.rcc(station.zone);
    s.EA = std::max(s.EA, rcc.EA);
    s.GA = std::max(s.GA, rcc.GA);
    s.GJ = std::max(s.GJ, rcc.GJ);
    s.EI_y = std::max(s.EI_y, rcc.calc_EI_effective_y(z.normal_force));
    s.EI_z = std::max(s.EI_z, rcc.calc_EI_effective_z(z.normal_force));
    s.uncracked_EI_y = std::max(s.uncracked_EI_y, rcc.EI_y);
    s.uncracked_EI_z = std::max(s.uncracked_EI_z, rcc.EI_z);
  }
  const auto mix = [share = k.member_uncracked_share](double at_yield, double uncracked) {
    return at_yield + share * std::max(0.0, uncracked - at_yield);
  };
  s.uncracked_EI_y = mix(s.EI_y, s.uncracked_EI_y);
  s.uncracked_EI_z = mix(s.EI_z, s.uncracked_EI_z);
  return s;
}

std::array<mbs::Cracking, 2> Builder::calc_cracking(const MemberZones& z, const Stiffness& s, double length_y,
                                                    double length_z) const {
  // of the end that the stiffness is of
  const auto stiffness = [&](const MemberStation& station) { return library.rcc(station.zone).EI_y; };
  const bool first = stiffness(z.station[0]) >= stiffness(z.station[1]);
  const nearfield::Rcc& rcc = library.rcc(z.station[first ? 0 : 1].zone);
  return {make_cracking(rcc.y_pos, rcc.y_neg, rcc.length, z.normal_force, s.uncracked_EI_y, s.EI_y, length_y),
          make_cracking(rcc.z_pos, rcc.z_neg, rcc.length, z.normal_force, s.uncracked_EI_z, s.EI_z, length_z)};
}

mbs::SharedLaw Builder::make_law(int zone, const Stiffness& s, const std::string& name, Bending bending,
                                 const Lever& lever) {
  if (const auto same = laws.find({zone, s.EI_y, s.EI_z, lever, bending}); same != laws.end())
    return model.laws.shared(static_cast<size_t>(same->second.index));
  std::string key = library.key(zone);
  append_bytes(key, s.EI_y), append_bytes(key, s.EI_z), append_bytes(key, static_cast<double>(bending));
  append_bytes(key, lever.moment_y), append_bytes(key, lever.moment_z), append_bytes(key, lever.rotation);
  if (known)
    if (const auto found = known->laws.find(key); found != known->laws.end()) return found->second;
  mbs::SharedLaw law;
  if (lever == Lever{}) {
    law = make_zone_law(library.rcc(zone), s.EI_y, s.EI_z, name, k, PlasticFrom::Yield, bending);
  } else {
    const auto [whole, is_new] = whole_laws.try_emplace({zone, s.EI_y, s.EI_z, bending});
    if (is_new) whole->second = make_law(zone, s, name, bending);
    law = scale_lever(whole->second, lever);
  }
  if (made) made->laws.emplace(std::move(key), law);
  return law;
}

mbs::LawId Builder::law_of(int zone, const Stiffness& s, const std::string& name, Bending bending, const Lever& lever) {
  const auto key = std::make_tuple(zone, s.EI_y, s.EI_z, lever, bending);
  if (const auto it = laws.find(key); it != laws.end()) return it->second;
  const mbs::LawId id = mbs::add_law(model, named(make_law(zone, s, name, bending, lever), name));
  laws[key] = id;
  return id;
}

mbs::SharedLaw Builder::make_hinge_law(int zone, const Stiffness& s, const std::string& name, const Lever& lever) {
  mbs::SharedLaw same = make_law(zone, s, name, bending_of_column(), lever);
  if (hinge_about_y) return same;
  // y of the joint is -z of the column, its z is y of the column
  mbs::ZoneLaw law = *same;
  std::swap(law.moment_y, law.moment_z);
  std::swap(law.moment_y.positive, law.moment_y.negative);
  std::swap(law.moment_y.elongation_positive, law.moment_y.elongation_negative);
  std::swap(law.shear_y, law.shear_z);
  law.rotation_ratio = 1 / law.rotation_ratio;
  return law;
}

mbs::LawId Builder::hinge_law_of(int zone, const Stiffness& s, const std::string& name, const Lever& lever) {
  const auto key = std::make_tuple(zone, s.EI_y, s.EI_z, name);
  if (const auto it = hinge_laws.find(key); it != hinge_laws.end()) return it->second;
  return hinge_laws[key] = mbs::add_law(model, named(make_hinge_law(zone, s, name, lever), name));
}

mbs::LawId Builder::stub_law_of(int zone, const Stiffness& s, int index, double length) {
  const std::string name = "stub of " + std::to_string(length) + " m";  // of all columns alike
  const auto key = std::make_tuple(zone, s.EI_y, s.EI_z, name);
  if (const auto it = hinge_laws.find(key); it != hinge_laws.end()) return it->second;
  mbs::ZoneLaw law = *make_hinge_law(zone, s, name);
  law.name = name;
  // crushing goes on until nothing of it is left, and it is off its joint when it has slid by its own thickness
  law.crush_length = length;
  law.slip_rupture = std::max(law.slip_rupture, std::min(section_of(index).width, section_of(index).height));
  return hinge_laws[key] = mbs::add_law(model, std::move(law));
}

Pose Builder::frame_in(int body, const Vec3& p_W, const Mat3& R_WF) const {
  const Vec3 origin = body < 0 ? Vec3{} : model.bodies[static_cast<size_t>(body)].X_WB.p;
  return {p_W - origin, to_quat(R_WF)};
}

mbs::ElementId Builder::add_element(const std::string& name, int index, int a, int b, const Vec3& p_W, const Mat3& R_WF,
                                    const Vec3& translational, const Vec3& rotational,
                                    std::vector<mbs::Station> stations, const std::array<mbs::Cracking, 2>& cracking) {
  mbs::ZoneElement e;
  e.name = name;
  e.a = a < 0 ? mbs::kGround : mbs::BodyId{a};
  e.b = mbs::BodyId{b};
  e.X_AF = frame_in(a, p_W, R_WF);
  e.X_BM = frame_in(b, p_W, R_WF);
  e.translational_stiffness = translational;
  e.rotational_stiffness = rotational;
  e.damping_ratio = k.zone_damping_ratio;
  e.stations = std::move(stations);
  std::copy(cracking.begin(), cracking.end(), e.cracking);
  ZoneEntry entry;
  entry.name = name, entry.member = member(index).name, entry.subsystem = kSixComponents;
  entry.body_a = a, entry.body_b = b, entry.p_W = p_W;
  map.elements.push_back(entry);
  return mbs::add_element(model, std::move(e));
}

/// Both stations of a whole member, the weaker one first: its law also limits axial force, shear and torsion.
std::vector<mbs::Station> Builder::order_stations(const MemberZones& z, const Stiffness& s, const std::string& name,
                                                  Bending bending) {
  const auto capacity = [this](const MemberStation& station) {
    const nearfield::Rcc& rcc = library.rcc(station.zone);
    return *std::max_element(rcc.compression.force.begin(), rcc.compression.force.end());
  };
  std::vector<mbs::Station> out{{-0.5 * z.clear_length, law_of(z.station[0].zone, s, name, bending)},
                                {0.5 * z.clear_length, law_of(z.station[1].zone, s, name, bending)}};
  if (capacity(z.station[1]) < capacity(z.station[0])) std::swap(out[0], out[1]);
  return out;
}

void Builder::connect_ground_column(const GridPoint& at, int index) {
  const Member& m = member(index);
  MemberZones& z = zones[index];
  const Stiffness s = calc_stiffness(z);
  const double L = z.clear_length;
  const int shaft = own_body.at(index), node = node_at(at);
  const int stump = stump_body.count(index) ? stump_body[index] : -1;
  Vec3 foot = m.start;
  if (stump >= 0) foot.z += z.station[0].at;
  // both ends of the column turn about the hinge axis, only its foot about the other one
  const double ends_y = hinge_about_y ? 3 : 6, ends_z = hinge_about_y ? 6 : 3;
  // docs/theory/manager.md (1d)
  const Lever &foot_lever = z.lever[0], &top_lever = z.lever[1];
  const double soft_y = foot_lever.moment_y * foot_lever.rotation, soft_z = foot_lever.moment_z * foot_lever.rotation;
  const Vec3 rotational{s.GJ / L, soft_y * ends_y * s.uncracked_EI_y / L, soft_z * ends_z * s.uncracked_EI_z / L};
  std::array<mbs::Cracking, 2> cracking_foot = calc_cracking(z, s, L / ends_y, L / ends_z);
  cracking_foot[0] = scale_lever(cracking_foot[0], foot_lever.moment_y, foot_lever.rotation);
  cracking_foot[1] = scale_lever(cracking_foot[1], foot_lever.moment_z, foot_lever.rotation);
  z.element[0] =
      add_element(m.name + "/foot", index, stump, shaft, foot, column_axes(), {s.EA / L, s.GA / L, s.GA / L},
                  rotational, {{0, law_of(z.station[0].zone, s, m.name + "/foot", bending_of_column(), foot_lever)}},
                  cracking_foot)
          .index;
  model.elements.back().crush_through = L;

  mbs::Joint joint;
  joint.kind = mbs::Joint::Kind::Revolute;
  joint.name = m.name + "/top";
  joint.parent = mbs::BodyId{shaft};
  joint.child = mbs::BodyId{node};
  const Vec3 top{m.start.x, m.start.y, core_low.at(at)};
  // x along the member from the parent to the child, z the hinge axis
  const Mat3 axes = hinge_about_y ? column_axes() : Mat3::from_columns({0, 0, 1}, {0, -1, 0}, {1, 0, 0});
  joint.X_PF = frame_in(shaft, top, axes);
  joint.X_CM = frame_in(node, top, axes);
  const nearfield::Rcc& rcc = library.rcc(z.station[1].zone);
  const mbs::LawId law_id = hinge_law_of(z.station[1].zone, s, m.name + "/top", top_lever);
  const mbs::ZoneLaw& law = model.laws[static_cast<size_t>(law_id.index)];
  const double stiffness =
      top_lever.moment_z * top_lever.rotation * 6 * (hinge_about_y ? s.uncracked_EI_z : s.uncracked_EI_y) / L;
  // the stub's, which it becomes: no cracking changes with a law
  const mbs::Cracking cracking = calc_cracking(z, s, L / 6, L / 6)[hinge_about_y ? 1 : 0];
  joint.tension_limit = *std::max_element(rcc.tension.force.begin(), rcc.tension.force.end());
  // the limit that follows the normal force is the foot's, which carries the same shear; here the largest possible one
  const double crushing = *std::max_element(rcc.compression.force.begin(), rcc.compression.force.end());
  joint.shear_limit = std::max(rcc.shear_y, rcc.shear_z) + rcc.shear_friction * crushing;
  // one whose hinge has broken before, because nothing presses it, turns freely
  joint.rotation_limit = std::max(law.rupture_rotation, law.rupture_rotation_pressed) +
                         largest_moment(law.moment_z) * (1 / stiffness + cracking.flexibility);
  ZoneEntry entry;
  entry.name = joint.name, entry.member = m.name, entry.subsystem = kHinge;
  entry.body_a = shaft, entry.body_b = node, entry.p_W = top;
  map.joints.push_back(entry);
  map.rotationals.push_back(entry);
  mbs::RotationalElement hinge;
  hinge.name = joint.name;
  hinge.joint = mbs::add_joint(model, joint);
  hinge.stiffness = stiffness;
  hinge.damping_ratio = k.zone_damping_ratio;
  hinge.law = law_id;
  hinge.cracking = cracking;
  hinge.axial_element = mbs::ElementId{z.element[0]};
  // a charge makes a stub of the column, which whatever it meets can crush, shear and turn: as soft as the foot
  hinge.loose_translational = {s.EA / L, s.GA / L, s.GA / L};
  hinge.loose_torsion = s.GJ / L;
  hinge.loose_bending = 6 * (hinge_about_y ? s.EI_y : s.EI_z) / L;
  z.rotational = static_cast<int>(model.rotational_elements.size());
  model.rotational_elements.push_back(hinge);
  map.ground_columns.push_back({m.name, m.start, top, false, z.normal_force, hinge, joint.child.index});
}

void Builder::connect_column(const GridPoint& at, int index) {
  const Member& m = member(index);
  const int below = node_at({at.row, at.frame, at.storey - 1});
  if (below < 0) return complain(index, "stands on nothing", "a column or a beam must end below it");
  MemberZones& z = zones[index];
  const Stiffness s = calc_stiffness(z);
  const double L = z.clear_length;
  const auto bending = [&](double EI) { return 12 * EI / (L * L * L) / (1 + 12 * EI / (s.GA * L * L)); };
  Vec3 middle = m.start;
  middle.z += 0.5 * L;
  z.element[0] = z.element[1] =
      add_element(m.name, index, below, node_at(at), middle, column_axes(),
                  {s.EA / L, bending(s.uncracked_EI_z), bending(s.uncracked_EI_y)},
                  {s.GJ / L, s.uncracked_EI_y / L, s.uncracked_EI_z / L},
                  order_stations(z, s, m.name, bending_of_column()), calc_cracking(z, s, L / 6, L / 6))
          .index;
  model.elements.back().crush_through = kCrushedThrough * L;
}

void Builder::connect_x_beam(const GridPoint& at, int index) {
  const Member& m = member(index);
  MemberZones& z = zones[index];
  const Stiffness s = calc_stiffness(z);
  const double L = z.clear_length;
  const int body = own_body.at(index);
  // a slab pushes sideways all along it: its mean deflection between ends that are held is p L^4 / (720 EI)
  const double sideways = 1 / (L / (2 * s.GA) + L * L * L / (360 * s.uncracked_EI_z));
  const Vec3 translational{2 * s.EA / L, sideways, 2 * s.GA / L};
  const Vec3 rotational{2 * s.GJ / L, 6 * s.uncracked_EI_y / L, 6 * s.uncracked_EI_z / L};
  const std::array<mbs::Cracking, 2> cracking = calc_cracking(z, s, L / 6, L / 6);
  // fixed-end moments of the weight it carries: at rest the ends are turned so that they pull at the top
  double mass = assemblies[static_cast<size_t>(body)].mass();
  if (const int wall = find_at(x_walls, {at.row, at.frame, at.storey + 1});
      wall >= 0 && own_body.count(wall) && !is_cast_on_beam(wall))
    mass += assemblies[static_cast<size_t>(own_body.at(wall))].mass();
  const double fixed_end = plan.analysis.gravity * mass * L / 12;
  for (int end : {0, 1}) {
    const int node = node_at({at.row + end, at.frame, at.storey});
    const std::string name = m.name + (end == 0 ? "/start" : "/end");
    Vec3 face = m.start;
    face.x += z.station[static_cast<size_t>(end)].at;
    z.element[end] =
        add_element(name, index, end == 0 ? node : body, end == 0 ? body : node, face, x_beam_axes(), translational,
                    rotational, {{0, law_of(z.station[static_cast<size_t>(end)].zone, s, name, bending_of_x_beam())}},
                    cracking)
            .index;
    mbs::ZoneElement& e = model.elements.back();
    const double turn = fixed_end / rotational.y + calc_crack_rotation(cracking[0], fixed_end);
    turn_apart(e, turn);
  }
}

void Builder::connect_y_beam(const GridPoint& at, int index) {
  const Member& m = member(index);
  MemberZones& z = zones[index];
  Stiffness s = calc_stiffness(z);
  // joints of a condensed model do not turn about x, which makes these beams softer in the building: uncracked they
  // would hand gable frames 8 % too much
  if (condensation) s.uncracked_EI_y = s.EI_y, s.uncracked_EI_z = s.EI_z;
  const double L = z.clear_length;
  const auto bending = [&](double EI) { return 12 * EI / (L * L * L) / (1 + 12 * EI / (s.GA * L * L)); };
  Vec3 middle = m.start;
  middle.y += z.clear_start + 0.5 * L;
  z.element[0] = z.element[1] =
      add_element(m.name, index, node_at(at), node_at({at.row, at.frame + 1, at.storey}), middle, y_beam_axes(),
                  {s.EA / L, bending(s.uncracked_EI_z), bending(s.uncracked_EI_y)},
                  {s.GJ / L, s.uncracked_EI_y / L, s.uncracked_EI_z / L}, order_stations(z, s, m.name),
                  calc_cracking(z, s, L / 6, L / 6))
          .index;
}

nearfield::PanelRcc Builder::make_rcc_of_panel(int index) const {
  const product::Panel& panel = panel_of(index);
  return nearfield::make_panel_rcc(panel,
                                   panel.concrete < 0 ? nullptr : &plan.concretes[static_cast<size_t>(panel.concrete)],
                                   panel.steel < 0 ? nullptr : &plan.steels[static_cast<size_t>(panel.steel)]);
}

void Builder::connect_slab(const GridPoint& at, int index) {
  const Member& m = member(index);
  const nearfield::PanelRcc rcc = make_rcc_of_panel(index);
  const double kept = kept_of(index), span_x = m.end.x - m.start.x, span_y = m.end.y - m.start.y;
  const Vec3 middle = 0.5 * (m.start + m.end);
  // a strip as a prismatic member, concentrated at its middle; in its plane a deep beam with shear
  const auto join = [&](const std::string& name, int a, int b, const Vec3& p_W, const Mat3& axes, double width,
                        double span, bool has_ends, double mid_moment = 0) {
    if (a < 0 || b < 0 || a == b) return;
    if (!(span > 0)) return complain(index, "no clear span is left between its columns");
    const double EA = rcc.EA * width * kept, EI = rcc.EI * width * kept;
    const mbs::LawId law = mbs::add_law(model, make_slab_law(rcc, width, kept, name, k));
    std::vector<mbs::Station> stations{{0, law}};
    if (has_ends) stations = {{-0.5 * span, law}, {0.5 * span, law}};
    add_element(name, index, a, b, p_W, axes, {EA / span, EA / 2.4 / 1.2 / span, 12 * EI / (span * span * span)},
                {EI / span, EI / span, EA * width * width / 12 / span}, std::move(stations));
    mbs::ZoneElement& e = model.elements.back();
    turn_apart(e, -mid_moment * span / EI);
  };
  // on each side a beam carries it, or the two joints at its corners do
  std::array<int, 2> beam{};
  std::array<std::array<int, 2>, 2> corner{};  // [side][x]
  std::array<std::array<Vec3, 2>, 2> half{};   // of the joints there
  for (size_t side : {0UL, 1UL}) {
    const int frame = at.frame + static_cast<int>(side);
    const int x_beam = find_at(x_beams, {at.row, frame, at.storey});
    beam[side] = x_beam < 0 ? -1 : own_body.at(x_beam);
    for (size_t x : {0UL, 1UL}) {
      const GridPoint joint{at.row + static_cast<int>(x), frame, at.storey};
      corner[side][x] = node_at(joint), half[side][x] = half_of_node(joint);
    }
  }
  if (beam[0] >= 0 && beam[1] >= 0) {
    // clear of the joints on both sides
    const double left = std::max(half[0][0].x, half[1][0].x), right = std::max(half[0][1].x, half[1][1].x),
                 width = span_x - left - right;
    // between edges that do not turn its middle bears w s^2 / 24 of its weight, the edges w s^2 / 12
    join(m.name, beam[0], beam[1], {m.start.x + left + 0.5 * width, middle.y, middle.z}, y_beam_axes(), width, span_y,
         false, plan.analysis.gravity * mass_of_slab(at, index) * span_y / 24);
    return;
  }
  // between joints it is held at their faces and turns there
  for (size_t x : {0UL, 1UL}) {
    const double low = beam[0] >= 0 ? 0 : half[0][x].y, high = beam[1] >= 0 ? 0 : half[1][x].y;
    join(m.name + (x == 0 ? "/y1" : "/y2"), beam[0] >= 0 ? beam[0] : corner[0][x],
         beam[1] >= 0 ? beam[1] : corner[1][x],
         {middle.x + (x == 0 ? -0.25 : 0.25) * span_x, middle.y + 0.5 * (low - high), middle.z}, y_beam_axes(),
         0.5 * span_x, span_y - low - high, true);
  }
  for (size_t side : {0UL, 1UL})
    if (beam[side] < 0) {
      const double low = half[side][0].x, high = half[side][1].x;
      join(m.name + (side == 0 ? "/x1" : "/x2"), corner[side][0], corner[side][1],
           {middle.x + 0.5 * (low - high), middle.y + (side == 0 ? -0.25 : 0.25) * span_y, middle.z}, x_beam_axes(),
           0.5 * span_y, span_x - low - high, true);
    }
}

void Builder::connect_wall(const GridPoint& at, int index, bool along_x) {
  if (!own_body.count(index)) return;  // part of the joints below
  const Member& m = member(index);
  const int body = own_body.at(index);
  const product::Panel& panel = panel_of(index);
  const nearfield::PanelRcc rcc = make_rcc_of_panel(index);
  const int axis = along_x ? 0 : 1;
  double low = 1e30, high = -1e30;
  for (const Part& p : assemblies[static_cast<size_t>(body)].parts) {
    if (p.member != index) continue;
    low = std::min(low, p.centre[axis] - p.half[axis]);
    high = std::max(high, p.centre[axis] + p.half[axis]);
  }
  const double width = std::max(high - low - calc_open_length(m, false), 0.05 * (high - low)), kept = kept_of(index),
               height = m.height;
  const int floor = at.storey == 0 ? -1 : own_body.at(find_at(x_beams, {at.row, at.frame, at.storey - 1}));
  Vec3 base = m.start;
  base[axis] = 0.5 * (low + high);

  if (floor != body) join_wall(index, rcc, base, low, high, width, floor);

  const int beam = along_x ? find_at(x_beams, at) : -1;
  if (beam < 0) return;
  const double E_t = rcc.EA * kept;  // modulus times thickness
  const double shear = k.wall_stiffness_share * E_t / 2.4 * width / height;
  const double axial = k.wall_axial_share * E_t * width / height;
  const double across = 3 * rcc.EI * width / (height * height * height);
  // an open bed joint without bars bears no more of a moment across the wall than its axial stiffness gives
  const bool has_open_joint = panel.concrete < 0 && !(panel.steel >= 0 && panel.as_top + panel.as_bottom > 0);
  const double bending = has_open_joint ? axial * panel.thickness * panel.thickness / 12 : 3 * rcc.EI * width / height;
  Vec3 head = base;
  head.z += height;
  const double span = high - low;
  add_element(m.name + "/head", index, body, own_body.at(beam), head, column_axes(), {axial, shear, across},
              {across * span * span / 12, bending, axial * span * span / 12},
              {{0, mbs::add_law(model, make_wall_law(rcc, width, height, kept, m.name + "/head", k))}});
}

/// The rigid joint at a wall's base.
///   low, high  ends along the wall, width  net length at its head [m]; floor  body, -1: the ground
void Builder::join_wall(int index, const nearfield::PanelRcc& rcc, const Vec3& base, double low, double high,
                        double width, int floor) {
  const Member& m = member(index);
  const int body = own_body.at(index);
  const double kept = kept_of(index), height = m.height;
  mbs::Joint joint;
  joint.kind = mbs::Joint::Kind::Fixed;
  joint.name = m.name + "/base";
  joint.parent = floor < 0 ? mbs::kGround : mbs::BodyId{floor};
  joint.child = mbs::BodyId{body};
  joint.X_PF = frame_in(floor, base, column_axes());
  joint.X_CM = frame_in(body, base, column_axes());
  // openings seldom reach the floor, so the base is longer than the wall above it
  const double base_width = std::max(high - low - calc_open_length(m, true), width);
  joint.tension_limit = rcc.tension * base_width * kept;
  joint.shear_limit = rcc.shear_in_plane * base_width * kept;
  // the shear flow of a panel runs around its edges, so the joint bears the couple of the largest shear at the head
  joint.moment_limit =
      rcc.shear_in_plane * width * kept * height +
      0.5 * (high - low) *
          (0.5 * joint.tension_limit + plan.analysis.gravity * assemblies[static_cast<size_t>(body)].mass());
  ZoneEntry entry;
  entry.name = joint.name, entry.member = m.name, entry.subsystem = kRigid;
  entry.body_a = floor, entry.body_b = body, entry.p_W = base;
  map.joints.push_back(entry);
  mbs::add_joint(model, joint);
}

void Builder::connect_cables() {
  for (const product::Cable& c : plan.cables) connect_cable(c);
}

void Builder::connect_cable(const product::Cable& c) {
  const Member& m = member(c.member);
  if (m.removed) {
    complaints.push_back(
        {Severity::Error, "E624", c.where, 1, "cable " + c.name + ": " + m.name + " was taken out", ""});
    return;
  }
  const GridPoint at{m.row_a, m.frame_a, m.storey};
  const double length = norm(m.end - m.start), share = length > 0 ? c.position / length : 0;
  const Vec3 p_W = m.start + share * (m.end - m.start);
  int body = -1;
  if (m.kind == MemberKind::Shaft) {
    body = shafts[c.member].joints.empty() ? -1 : shafts[c.member].joints.front().below;  // a stump
    for (const ShaftJoint& joint : shafts[c.member].joints)
      if (joint.at <= c.position) body = joint.above;
  } else if (m.kind == MemberKind::Column) {
    body = node_at(at);
    if (at.storey == 0 && c.position < zones[c.member].clear_length) body = own_body.at(c.member);
    if (stump_body.count(c.member) && c.position < lowest_charge[c.member]) body = stump_body[c.member];
  } else if (own_body.count(c.member)) {
    body = own_body.at(c.member);
  } else if (m.kind == MemberKind::Beam || m.kind == MemberKind::Wall) {
    const int floor = m.kind == MemberKind::Wall ? at.storey - 1 : at.storey;
    const int a = node_at({m.row_a, m.frame_a, floor}), b = node_at({m.row_b, m.frame_b, floor});
    body = share < 0.5 || b < 0 ? (a < 0 ? b : a) : b;
  } else if (m.kind == MemberKind::Slab) {
    const int frame = share < 0.5 ? m.frame_a : m.frame_b;
    const int beam = find_at(x_beams, {m.row_a, frame, m.storey});
    body = beam >= 0 ? own_body.at(beam) : node_at({share < 0.5 ? m.row_a : m.row_b, frame, m.storey});
  }
  if (body < 0) {
    complaints.push_back({Severity::Error, "E624", c.where, 1, "cable " + c.name + ": nothing to tie it to", ""});
    return;
  }
  mbs::Cable cable;
  cable.name = c.name;
  cable.a = mbs::BodyId{body};
  cable.b = mbs::kGround;
  cable.p_A = p_W - model.bodies[static_cast<size_t>(body)].X_WB.p;
  cable.p_B = c.anchor;
  cable.stiffness = c.stiffness;
  cable.pretension = c.pretension;
  cable.strength = c.strength > 0 ? c.strength : mbs::kUnlimited;
  model.cables.push_back(cable);
}

}  // namespace topple::collapse
