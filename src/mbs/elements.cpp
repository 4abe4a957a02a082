/// Zone elements of a running system: their slots in the kernel's lanes, the full law for those outside their bounds,
/// and the sums of their forces over the bodies (docs/theory/zones.md, multibody.md).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/parallel.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

using namespace kernel;

constexpr size_t kBlocksForThreads = 256;  // below, waking threads costs more than they save
constexpr size_t kChunk = 32;              // blocks a thread takes at once
constexpr long kLayoutInterval = 64;       // steps between looks whether zones that flow still lie side by side

/// The element in a slot of a system's lanes or of a batch's.
size_t element_at(const Lanes& l, size_t slot) { return l.is_batch ? slot / l.W : l.element_of[slot]; }

/// Spring behind the damper of a slot times the stiffness.
double calc_rate(const Lanes& l, size_t slot, int i) { return l.field(slot, kViscous) * l.field(slot, kStiffness + i); }

/// As the kernel has the axes of a marker: in a plane the turn about y that brings x there.
Quat turn_in_plane(Plane plane, const Quat& q) {
  return plane == Plane::AboutZ ? q * Quat{std::sqrt(0.5), std::sqrt(0.5), 0, 0} : q;
}

/// What a spring leaves of its deformations as elastic ones: of each bending plane two by two, shear and bending.
void find_softness(const ZoneParameters& p, const ZoneState& z, bool is_softened, double soft[8]) {
  for (int q = 0; q < 2; ++q) {
    const double ks = z.share * p.stiffness[q == 0 ? 2 : 1], kb = z.share * p.stiffness[q == 0 ? 4 : 5];
    double* at = soft + (q == 0 ? 0 : 4);
    at[0] = is_softened && ks > 0 ? z.plane[q][0] / ks : 1;
    at[1] = is_softened && ks > 0 ? z.plane[q][1] / ks : 0;
    at[2] = is_softened && kb > 0 ? z.plane[q][1] / kb : 0;
    at[3] = is_softened && kb > 0 ? z.plane[q][2] / kb : 1;
  }
}

/// What the kernel may use of a biaxial exponent.
double floor_exponent(double e) { return e >= 2 ? 2 : e >= 1.5 ? 1.5 : 1; }

}  // namespace

bool System::keeps_planes() const {
  if (!model.is_planar) return false;
  for (size_t b = 0; b < B; ++b) {
    const Quat q = state.q[b];
    const Vec3 v = state.v[b], w = state.w[b];
    if (q.x != 0 || q.z != 0 || v.y != 0 || w.x != 0 || w.z != 0) return false;
  }
  return true;
}

Plane System::find_plane(int a, int b, const Pose& X_AF, const Pose& X_BM) const {
  constexpr double tilted = 1e-12, beside = 1e-10;  // round-off of axes, of places [m]
  if (!lanes->is_planar) return Plane::Space;
  if (std::abs((pose_of(b) * X_BM.p).y - (pose_of(a) * X_AF.p).y) > beside) return Plane::Space;
  const Mat3 axes_a = to_matrix(X_AF.q), axes_b = to_matrix(X_BM.q);
  const auto is_normal = [&](int axis) {
    return norm(axes_a.column(axis) - Vec3{0, 1, 0}) < tilted && norm(axes_b.column(axis) - Vec3{0, 1, 0}) < tilted;
  };
  return is_normal(1) ? Plane::AboutY : is_normal(2) ? Plane::AboutZ : Plane::Space;
}

size_t System::slot_of(size_t e) const { return lanes->is_batch ? e * lanes->W + lane : lanes->slot_of[e]; }

void System::kill_slot(size_t e) {
  const size_t slot = slot_of(e);
  if (slot == Lanes::kNoSlot || lanes->field(slot, kMostTurn) == kUnlimited) return;
  lanes->still_slot(slot);
  if (--lanes->live[slot / lanes->W] == 0) lanes->has_dead_entries = lanes->is_batch;
  --lanes->live_elements;
  --state.live_elements;
}

void System::add_slots(const std::vector<size_t>& begun) {
  if (begun.empty()) return;
  Lanes& l = *lanes;
  if (!l.is_batch) lay_out_elements();
  for (const size_t e : begun) {
    if (!state.element[e].live) continue;
    ++state.live_elements;
    if (l.is_batch && l.live[e]++ == 0) l.list_entries(incidence);
    pack_element(e);
  }
}

void System::lay_out_elements() {
  Lanes& l = *lanes;
  const size_t W = l.W;
  std::vector<std::uint32_t> kept;  // kNoSlot: a gap
  std::vector<Plane> planes;        // of blocks
  std::vector<unsigned char> single;
  size_t live = 0;
  const bool first = l.slot_of.empty();
  std::vector<Work> work(elements.size(), Work::None);
  for (size_t e = 0; e < elements.size(); ++e) {
    const bool has_slot = !first && l.slot_of[e] != Lanes::kNoSlot;
    work[e] = has_slot ? find_work(l.slot_of[e]) : state.element[e].live ? Work::Springs : Work::None;
  }
  // blocks of one plane each, with one station or two; in them elements of like work side by side
  constexpr std::pair<Plane, bool> kinds[] = {{Plane::Space, true},   {Plane::Space, false}, {Plane::AboutY, true},
                                              {Plane::AboutY, false}, {Plane::AboutZ, true}, {Plane::AboutZ, false}};
  for (const auto& [plane, is_single] : kinds) {
    for (const Work here : {Work::Flows, Work::MayFlow, Work::Springs}) {
      for (size_t e = 0; e < elements.size(); ++e) {
        const ZoneParameters& zone = elements[e].zone;
        if (work[e] != here || zone.plane != plane || (zone.stations < 2) != is_single) continue;
        if (kept.size() % W == 0) planes.push_back(plane), single.push_back(is_single);
        kept.push_back(static_cast<std::uint32_t>(e));
        ++live;
      }
    }
    kept.resize((kept.size() + W - 1) / W * W, Lanes::kNoSlot);
  }
  const size_t slots = kept.size();
  if (first) {
    l.allocate_elements(slots);
    for (size_t slot = 0; slot < slots; ++slot) {
      l.clear_slot(slot);
      if (kept[slot] != Lanes::kNoSlot) l.set(slot, kMostTurn, kLargestTurn);
    }
  } else {
    std::vector<std::uint32_t> from = kept;
    for (std::uint32_t& slot : from)
      if (slot != Lanes::kNoSlot) slot = l.slot_of[slot];
    l.move_slots(from);
  }
  l.planes = planes;
  l.single = single;
  l.live.assign(l.element_blocks, 0);
  l.softened.assign(l.element_blocks, 0);
  l.slot_of.assign(elements.size(), Lanes::kNoSlot);
  l.element_of.assign(slots, Lanes::kNoSlot);
  l.body_a.assign(slots, static_cast<std::uint32_t>(B));
  l.body_b.assign(slots, static_cast<std::uint32_t>(B));
  const auto body = [&](int b) { return b < 0 ? static_cast<std::uint32_t>(B) : static_cast<std::uint32_t>(b); };
  for (size_t slot = 0; slot < slots; ++slot) {
    const std::uint32_t e = kept[slot];
    if (e == Lanes::kNoSlot) continue;
    l.slot_of[e] = static_cast<std::uint32_t>(slot);
    l.element_of[slot] = e;
    l.body_a[slot] = body(elements[e].a);
    l.body_b[slot] = body(elements[e].b);
    ++l.live[slot / W];
    if (!first && state.element[e].is_softened) l.softened[slot / W] = 1;
  }
  l.used_slots = l.live_elements = live;
  l.first_entry.assign(B + 1, 0);
  l.entries.clear();
  for (size_t b = 0; b < B; ++b) {
    for (const int entry : incidence[b]) {
      const std::uint32_t slot = l.slot_of[static_cast<size_t>(entry / 2)];
      if (slot == Lanes::kNoSlot) continue;
      const size_t at = slot / W * kForceFields * W + slot % W;
      l.entries.push_back(static_cast<std::uint32_t>(2 * at) + static_cast<std::uint32_t>(entry % 2));
    }
    l.first_entry[b + 1] = static_cast<std::uint32_t>(l.entries.size());
  }
}

System::Work System::find_work(size_t slot) const {
  const Lanes& l = *lanes;
  if (l.field(slot, kMostTurn) == kUnlimited) return Work::None;
  if (!(l.field(slot, kFlows) > 0)) return Work::Springs;
  return l.flow(slot, kIdle) != 0 ? Work::MayFlow : Work::Flows;
}

bool System::is_work_scattered() const {
  const Lanes& l = *lanes;
  // a zone at its limit is as much again, and one that may come there half of that
  size_t blocks = 0, done = 0, may_flow[6] = {}, flow[6] = {};  // the last two in lanes, by kind of block
  for (size_t block = 0; block < l.element_blocks; ++block) {
    if (l.live[block] == 0) continue;
    ++blocks;
    const size_t kind = 2 * static_cast<size_t>(l.planes[block]) + l.single[block];
    size_t here = 0, at_work = 0;
    for (size_t slot = block * l.W; slot < (block + 1) * l.W; ++slot) {
      const Work work = find_work(slot);
      here += work == Work::MayFlow || work == Work::Flows ? 1 : 0;
      at_work += work == Work::Flows ? 1 : 0;
    }
    may_flow[kind] += here, flow[kind] += at_work;
    done += (here > 0 ? 1 : 0) + (at_work > 0 ? 2 : 0);
  }
  const auto blocks_of = [&](size_t in_lanes) { return (in_lanes + l.W - 1) / l.W; };
  for (size_t kind = 0; kind < 6; ++kind) done -= blocks_of(may_flow[kind]) + 2 * blocks_of(flow[kind]);
  return 4 * done > blocks;
}

void System::pack_element(size_t e, bool has_moved) {
  ZoneState& z = state.element[e];
  if (!z.live) return kill_slot(e);
  Lanes& l = *lanes;
  const size_t slot = slot_of(e);
  if (slot == Lanes::kNoSlot) return;
  const CompiledElement& c = elements[e];
  const auto put = [&](int f, double x) { l.set(slot, f, x); };
  if (has_moved) {
    // of a member its stations
    const Vec3 at_a = c.p_AF + c.zone.span().a * to_matrix(c.q_AF).column(0);
    const Vec3 at_b = c.p_BM + c.zone.span().b * to_matrix(c.q_BM).column(0);
    const Vec3 pa = c.a >= 0 ? at_a - state.p_offset[static_cast<size_t>(c.a)] : at_a;
    const Vec3 pb = c.b >= 0 ? at_b - state.p_offset[static_cast<size_t>(c.b)] : at_b;
    for (int i = 0; i < 3; ++i) put(kMarkerA + i, pa[i]), put(kMarkerB + i, pb[i]);
    const Quat q_a = turn_in_plane(c.zone.plane, c.q_AF), q_b = turn_in_plane(c.zone.plane, c.q_BM);
    const double qa[4] = {q_a.w, q_a.x, q_a.y, q_a.z}, qb[4] = {q_b.w, q_b.x, q_b.y, q_b.z};
    for (int i = 0; i < 4; ++i) put(kMarkerA + 3 + i, qa[i]), put(kMarkerB + 3 + i, qb[i]);
  }
  const ActiveComponents active = components_of(c.zone.plane);
  const int first = first_bending(c.zone.plane), last = last_bending(c.zone.plane);
  for (int i = 0; i < active.count; ++i) put(kStiffness + active.at[i], z.share * c.zone.stiffness[active.at[i]]);
  if (has_moved) {
    put(kViscous, c.zone.viscous);
    put(kRelaxation, c.zone.relaxation);
    put(kStation, c.zone.x[0]), put(kStation + 1, c.zone.x[c.zone.stations > 1 ? 1 : 0]);
    put(kMostTurn, kLargestTurn);
  }
  const bool had_flow = l.field(slot, kFlows) > 0;  // its constants are there
  find_crack_bounds(c.zone, z);
  const bool free = c.zone.stations == 0;
  double fields[kFlowFields];
  // near its bounds a zone is better served by the law itself
  const bool in_lanes = (free || !options.full_law) && !z.is_adjusted;
  const bool flows = !free && in_lanes && (!is_bounded(z, false) || calc_bound_utilisation(c.zone, z) > kNearBounds) &&
                     write_flow(c.zone, laws, z, state.time, fields);
  const bool bounded = !flows && in_lanes && is_bounded(z, free);
  put(kFlows, flows ? 1 : 0);
  put(kLeastForce, !bounded ? 1 : free ? -kUnlimited : z.safe_force[0]);
  put(kMostForce, !bounded ? -1 : free ? kUnlimited : z.safe_force[1]);
  put(kTorsionScale, bounded && !free ? z.safe_torsion : 0);
  if (!bounded && !flows) {
    pack_crack_bounds(slot, z);
    return;
  }
  if (flows) {
    l.open_flows();
    const auto copy = [&](int from, int to) {
      for (int f = from; f < to; ++f) l.flow(slot, f) = fields[f];
    };
    if (had_flow) {
      fields[kIdle] = kLongestIdle - kLongestIdleAgain;  // the full law has found no bounds
      copy(kAxial, kShearOwn), copy(kSlipped, kSlipped + 1), copy(kTwisted, kTwisted + 1), copy(kBefore, kStations);
      for (int station = 0; station < c.zone.stations; ++station) {
        const int at = kStations + station * kStationFields;
        copy(at + kPhi, at + kCell);
        const int law = z.base_law < 0 ? c.zone.law[station] : z.base_law;
        for (int q = first; q <= last; ++q)
          if (laws[static_cast<size_t>(law)].moment[q].K > 0)
            copy(at + kCell + q * kCellFields, at + kCell + (q + 1) * kCellFields);
      }
    } else {
      copy(0, kFlowFields);
    }
    z.safe_force[0] = 1, z.safe_force[1] = -1;  // void as soon as it flows
  } else {
    for (int q = first; q <= last; ++q) {
      put(kMomentScale + q, free ? 0 : z.safe_moment[q]);
      put(kShearScale + 1 - q, free ? 0 : z.safe_shear[1 - q]);
    }
    put(kExponent, floor_exponent(z.safe_exponent));
  }
  pack_springs(e, slot, flows);
}

void System::pack_crack_bounds(size_t slot, const ZoneState& z) {
  for (int s = 0; s < 2; ++s)
    for (int q = 0; q < 2; ++q)
      for (int side : {0, 1}) lanes->set(slot, kCrackScale + 4 * s + 2 * q + side, z.crack_scale[s][q][side]);
}

void System::pack_spring_constants(size_t e, size_t slot, bool flows) {
  const ZoneState& z = state.element[e];
  Lanes& l = *lanes;
  const Plane in = elements[e].zone.plane;
  pack_crack_bounds(slot, z);
  const ActiveComponents active = components_of(in);
  for (int c = 0; c < active.count; ++c) l.set(slot, kOffset + active.at[c], flows ? 0 : z.offset[active.at[c]]);
  double soft[8];
  find_softness(elements[e].zone, z, !flows && z.is_softened, soft);
  for (int plane = first_bending(in); plane <= last_bending(in); ++plane)
    for (int i = 4 * plane; i < 4 * plane + 4; ++i) l.set(slot, kSoft + i, soft[i]);
  if (!flows && z.is_softened) l.softened[slot / l.W] = 1;
}

void System::pack_springs(size_t e, size_t slot, bool flows) {
  ZoneState& z = state.element[e];
  Lanes& l = *lanes;
  pack_spring_constants(e, slot, flows);
  const ActiveComponents active = components_of(elements[e].zone.plane);
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    l.set_state(slot, kStretch + i, flows ? z.elastic[i] : z.deformation[i] - z.offset[i]);
    l.set_state(slot, kBehind + i, z.elastic[i] - z.flowed[i]);
  }
  l.set_state(slot, kDamped, 0);
  l.set_state(slot, kBled, 0);
  z.packed_damping = z.damping, z.packed_plastic = z.plastic, z.packed_behind = z.damper_energy;
}

SpringCracks System::crack_spring(size_t slot, const double* deformation, size_t stride, double* spring) {
  const size_t e = element_at(*lanes, slot);
  const ZoneParameters& zone = elements[e].zone;
  ZoneState& z = state.element[e];
  Six d;
  for (size_t i = 0; i < 6; ++i) d.c[i] = deformation[i * stride];
  const SpringCracks cracks = mbs::crack_spring(zone, laws, d, state.time, z);
  if (cracks != SpringCracks::Grown) return cracks;
  double soft[8];
  find_softness(zone, z, z.is_softened, soft);
  for (size_t i = 0; i < 6; ++i) spring[(kSpringOffset + i) * stride] = z.offset[i];
  for (size_t i = 0; i < 8; ++i) spring[(kSpringSoft + i) * stride] = soft[i];
  return cracks;
}

void System::keep_spring(size_t slot) { pack_spring_constants(element_at(*lanes, slot), slot, false); }

void System::unpack_element(size_t e) {
  ZoneState& z = state.element[e];
  const size_t slot = slot_of(e);
  if (!z.live || slot == Lanes::kNoSlot) return;
  const Lanes& l = *lanes;
  if (l.field(slot, kMostTurn) == kUnlimited) return;  // not there yet
  const bool flows = l.field(slot, kFlows) > 0;
  if (!flows && l.field(slot, kLeastForce) > l.field(slot, kMostForce)) return;  // the full law has it
  const Plane in = elements[e].zone.plane;
  const ActiveComponents active = components_of(in);
  const int first = first_bending(in), last = last_bending(in);
  double u[6], stretch[6];
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    u[i] = stretch[i] = l.field(slot, kStretch + i);
  }
  if (!flows)
    for (int plane = first; plane <= last; ++plane) {
      const int shear = plane == 0 ? 2 : 1, bend = plane == 0 ? 4 : 5, at = kSoft + 4 * plane;
      stretch[shear] = l.field(slot, at) * u[shear] + l.field(slot, at + 1) * u[bend];
      stretch[bend] = l.field(slot, at + 2) * u[shear] + l.field(slot, at + 3) * u[bend];
    }
  z.energy = z.damper_energy = 0;
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    const double behind = l.field(slot, kBehind + i), k = l.field(slot, kStiffness + i), rate = calc_rate(l, slot, i);
    z.elastic[i] = stretch[i];
    z.elastic_force[i] = k * stretch[i];
    z.damper_force[i] = rate * behind;
    z.flowed[i] = stretch[i] - behind;
    z.deformation[i] = flows ? l.flow(slot, kBefore + i) : u[i] + z.offset[i];
    z.resultant.c[i] = z.elastic_force[i] + z.damper_force[i];
    z.energy += 0.5 * z.elastic_force[i] * u[i];
    z.damper_energy += 0.5 * rate * behind * behind;
  }
  z.normal_force = z.elastic_force[0];
  z.damping = z.packed_damping + l.field(slot, kDamped) - (z.damper_energy - z.packed_behind);
  z.plastic = z.packed_plastic + l.field(slot, kBled);
  if (!flows) return;
  z.energy = l.flow(slot, kStored);
  z.plastic += l.flow(slot, kPlastic);
  z.axial = l.flow(slot, kAxial), z.lifted = l.flow(slot, kLifted);
  z.shortened = l.flow(slot, kShortened), z.crushed = l.flow(slot, kCrushed);
  for (int a = 1 - last; a <= 1 - first; ++a) z.slip[a] = l.flow(slot, kSlip + a);
  z.slipped = l.flow(slot, kSlipped);
  z.twist = l.flow(slot, kTwist);
  z.twisted = l.flow(slot, kTwisted);
  for (int s = 0; s < elements[e].zone.stations; ++s) {
    const int at = kStations + s * kStationFields;
    for (int q = first; q <= last; ++q) {
      z.station[s].phi[q] = l.flow(slot, at + kPhi + q);
      z.station[s].soft[q] = l.flow(slot, at + kSoftness + q);
    }
    z.station[s].reached = l.flow(slot, at + kReached);
    z.station[s].strained = l.flow(slot, at + kStrained);
  }
}

void System::unpack_elements() {
  for (size_t e = 0; e < elements.size(); ++e) unpack_element(e);
}

void System::pack_elements() {
  for (size_t e = 0; e < elements.size(); ++e) pack_element(e);
  lanes->share_constants();
}

ElementGeometry System::measure_zone(const CompiledElement& e) const {
  const Quat q_A = pose_of(e.a).q, q_B = pose_of(e.b).q;
  return measure_element({calc_point(e.a, e.p_AF), q_A * e.q_AF}, {calc_point(e.b, e.p_BM), q_B * e.q_BM},
                         e.zone.span());
}

void System::note_turned_over(size_t i, const Six& d, const ZoneState& before) {
  const Vec3 now{d.c[3], d.c[4], d.c[5]}, then{before.deformation[3], before.deformation[4], before.deformation[5]};
  constexpr double far = 2;  // [rad]; a rotation vector ends at a half turn
  if (!(dot(now, then) < -far * far) || std::find(turned_over.begin(), turned_over.end(), i) != turned_over.end())
    return;
  turned_over.push_back(i);
  if (turned_over.size() == 1)
    summary.notes.push_back(
        fmt::format("element \"{}\" is turned by more than half a turn at {:.4g} s, where its "
                    "rotations end: they go on from the other side, and so does its moment",
                    i < E ? model.elements[i].name : model.rotational_elements[i - E].name, state.time));
}

/// By the full law, from the state of the zone; the force goes to the slot.
void System::evaluate_element(size_t i, double h) {
  ZoneState& z = state.element[i];
  const size_t slot = slot_of(i);
  if (!z.live || slot == Lanes::kNoSlot) return;
  const CompiledElement& e = elements[i];
  const ElementGeometry g = measure_zone(e);
  if (h > 0) note_turned_over(i, g.deformation, z);
  if (ignores_limits) {
    ZoneParameters elastic = e.zone;
    elastic.stations = 0;
    advance_zone(elastic, laws, g.deformation, state.time, h, z);
  } else {
    advance_zone(e.zone, laws, g.deformation, state.time, h, z);
  }
  tell_yield(i, z);
  Vec3 on_a, torque_a, torque_b;
  if (z.live) {
    const ElementForces f = calc_element_forces(g, z.resultant);
    on_a = f.force;
    torque_a = cross(g.p_a - centre_of(e.a), on_a) + f.torque_a;
    torque_b = cross(g.p_b - centre_of(e.b), on_a) + f.torque_b;
  } else {
    break_element(i, z.reason);
  }
  for (size_t k = 0; k < 3; ++k) {
    lanes->force_field(slot, k) = on_a[static_cast<int>(k)];
    lanes->force_field(slot, 3 + k) = torque_a[static_cast<int>(k)];
    lanes->force_field(slot, 6 + k) = torque_b[static_cast<int>(k)];
  }
}

void System::elongate_element(size_t e, double by) {
  ZoneState& z = state.element[e];
  const size_t slot = slot_of(e);
  if (!z.live || slot == Lanes::kNoSlot) return;
  Lanes& l = *lanes;
  if (l.field(slot, kFlows) > 0) {
    l.flow(slot, kLifted) += by;
    // what it shortens by turning need not be crushed
    const double back = std::min(l.flow(slot, kCrushed), std::max(0.0, -by));
    l.flow(slot, kShortened) -= back, l.flow(slot, kCrushed) -= back;
    by += back;
    const double k = l.field(slot, kStiffness), released = by * k * (l.field(slot, kStretch) - 0.5 * by);
    l.flow(slot, kAxial) += by;
    l.flow(slot, kStored) -= released;
    l.flow(slot, kPlastic) += released;
    z.is_adjusted = true;  // for the full law, if it takes over
    return;
  }
  unpack_element(e);
  elongate_zone(elements[e].zone, by, z);
  // the full law books what the bodies feel of it
  l.set(slot, kLeastForce, 1);
  l.set(slot, kMostForce, -1);
}

void System::limit_element(size_t e, double compression) {
  ZoneState& z = state.element[e];
  if (!z.live || !(compression < z.hinge_bears)) return;
  z.hinge_bears = compression;
  z.safe_force[0] = std::max(z.safe_force[0], -compression);
  const size_t slot = slot_of(e);
  if (slot == Lanes::kNoSlot) return;
  Lanes& l = *lanes;
  if (l.field(slot, kFlows) > 0)
    l.flow(slot, kTurnedHinge) = compression;
  else if (l.field(slot, kLeastForce) < -compression)
    l.set(slot, kLeastForce, -compression);
}

void System::evaluate_outside(size_t slot) {
  Lanes& l = *lanes;
  const size_t e = element_at(l, slot);
  unpack_element(e);
  const ZoneState& z = state.element[e];
  const double elongated = z.elongated;
  const bool was_switching = z.next_law >= 0;
  evaluate_element(e, step);
  if (z.live && (was_switching || z.elongated != elongated)) {
    // The full law keeps what flows in tension, for it will do so in the next step, and what has just got another
    // stiffness: the damper's force is still that of the one before.
    l.set(slot, kFlows, 0);
    l.set(slot, kLeastForce, 1);
    l.set(slot, kMostForce, -1);
    return;
  }
  // a spring that has only cracked keeps its limits
  if (z.live && !(l.field(slot, kFlows) > 0) && l.field(slot, kLeastForce) <= l.field(slot, kMostForce) &&
      is_bounded(z, false) && z.safe_force[0] == l.field(slot, kLeastForce) &&
      z.safe_force[1] == l.field(slot, kMostForce) && calc_bound_utilisation(elements[e].zone, z) <= kNearBounds)
    return pack_springs(e, slot, false);
  pack_element(e, false);
}

void System::write_cells(size_t slot, double axial) {
  Lanes& l = *lanes;
  const size_t e = element_at(l, slot);
  const ZoneParameters& zone = elements[e].zone;
  ZoneState& z = state.element[e];
  double strained[2] = {0, 0};
  for (int s = 0; s < zone.stations; ++s) strained[s] = l.flow(slot, kStations + s * kStationFields + kStrained);
  (void)write_flow_cells(zone, laws, z, axial, l.flow(slot, kShortened), strained, &l.flow(slot, 0), l.W);
}

bool System::grow_cracks(size_t slot, const double* deformation, size_t stride) {
  Lanes& l = *lanes;
  const size_t e = element_at(l, slot);
  const ZoneParameters& zone = elements[e].zone;
  ZoneState& z = state.element[e];
  Six d;
  for (size_t i = 0; i < 6; ++i) d.c[i] = deformation[i * stride];
  const int first = first_bending(zone.plane), last = last_bending(zone.plane);
  for (int a = 1 - last; a <= 1 - first; ++a) z.slip[a] = l.flow(slot, kSlip + a);
  for (int s = 0; s < zone.stations; ++s) {
    const int at = kStations + s * kStationFields;
    StationState& station = z.station[s];
    station.reached = l.flow(slot, at + kReached);
    for (int q = first; q <= last; ++q)
      station.phi[q] = l.flow(slot, at + kPhi + q), station.soft[q] = l.flow(slot, at + kSoftness + q);
  }
  const bool has_grown = mbs::grow_cracks(zone, d, state.time, z);
  find_crack_bounds(zone, z);
  for (int s = 0; s < zone.stations; ++s) {
    const int at = kStations + s * kStationFields;
    const StationState& station = z.station[s];
    for (int q = first; q <= last; ++q) {
      l.flow(slot, at + kPhi + q) = station.phi[q], l.flow(slot, at + kSoftness + q) = station.soft[q];
      l.flow(slot, at + kCracked + q) = station.crack[q], l.flow(slot, at + kBow + q) = station.bow[q];
      for (int side : {0, 1}) l.flow(slot, at + kGrowth + 2 * q + side) = z.crack_scale[s][q][side];
    }
  }
  return has_grown;
}

void System::evaluate_elements_fully(double h) {
  for (size_t i = 0; i < elements.size(); ++i) evaluate_element(i, h);
  sum_element_forces();
}

void System::evaluate_elements() {
  Lanes& l = *lanes;
  l.outside.clear();
  l.cracked.clear();
  l.lay_poses();
  const FlowWriter writer{
      [](void* owner, size_t slot, double axial) { static_cast<System*>(owner)->write_cells(slot, axial); },
      [](void* owner, size_t slot, const double* deformation, size_t stride) {
        return static_cast<System*>(owner)->grow_cracks(slot, deformation, stride);
      },
      [](void* owner, size_t slot, const double* deformation, size_t stride, double* spring) {
        return static_cast<System*>(owner)->crack_spring(slot, deformation, stride, spring);
      },
      this};
  if (options.threads > 1 && l.element_blocks >= kBlocksForThreads) {
    // every block writes its own places only; reports follow in order, so threads change no bit
    const size_t chunks = (l.element_blocks + kChunk - 1) / kChunk;
    std::vector<std::vector<std::uint32_t>> beyond(chunks), cracked(chunks);
    (void)parallel_for(chunks, options.threads, [&](size_t c) {
      l.evaluate_elements(c * kChunk, std::min(l.element_blocks, (c + 1) * kChunk), writer, beyond[c], cracked[c]);
    });
    for (const auto& list : beyond) l.outside.insert(l.outside.end(), list.begin(), list.end());
    for (const auto& list : cracked) l.cracked.insert(l.cracked.end(), list.begin(), list.end());
  } else {
    l.evaluate_elements(0, l.element_blocks, writer, l.outside, l.cracked);
  }
  for (const std::uint32_t slot : l.cracked) keep_spring(slot);
  // where they lie says nothing about what is told first
  std::sort(l.outside.begin(), l.outside.end(),
            [&](std::uint32_t x, std::uint32_t y) { return l.element_of[x] < l.element_of[y]; });
  for (const std::uint32_t slot : l.outside) evaluate_outside(slot);
  const bool has_gaps = 8 * l.live_elements < 7 * l.used_slots && l.used_slots > 4 * l.W;
  if (has_gaps || (state.step_index % kLayoutInterval == 0 && is_work_scattered())) lay_out_elements();
  if (has_gaps) l.share_constants();
  sum_element_forces();
}

void System::sum_element_forces() {
  const Lanes& l = *lanes;
  const size_t W = l.W;
  if (model.is_planar) {
    for (size_t b = 0; b < B; ++b) {
      double x = 0, z = 0, turn = 0;
      for (std::uint32_t i = l.first_entry[b]; i < l.first_entry[b + 1]; ++i) {
        const double* from = l.element_forces.data() + l.entries[i] / 2;
        const bool is_b = l.entries[i] % 2 != 0;
        const double sign = is_b ? -1 : 1;
        x += sign * from[0], z += sign * from[2 * W], turn += sign * from[(is_b ? 7 : 4) * W];
      }
      force[b] = Vec3{x, 0, z};
      torque[b] = Vec3{0, turn, 0};
    }
    return;
  }
  for (size_t b = 0; b < B; ++b) {
    Vec3 f, t;
    for (std::uint32_t i = l.first_entry[b]; i < l.first_entry[b + 1]; ++i) {
      const double* from = l.element_forces.data() + l.entries[i] / 2;
      const Vec3 on_a{from[0], from[W], from[2 * W]};
      if (l.entries[i] % 2 == 0) {
        f += on_a;
        t += Vec3{from[3 * W], from[4 * W], from[5 * W]};
      } else {
        f -= on_a;
        t -= Vec3{from[6 * W], from[7 * W], from[8 * W]};
      }
    }
    force[b] = f;
    torque[b] = t;
  }
}

void System::save_slot(size_t slot, std::vector<double>& to) const {
  for (int f = 0; f < kSlotFields; ++f) to.push_back(lanes->field(slot, f));
  for (size_t f = 0; f < static_cast<size_t>(kForceFields); ++f) to.push_back(lanes->force_field(slot, f));
  if (lanes->field(slot, kFlows) > 0)
    for (int f = 0; f < kFlowFields; ++f) to.push_back(lanes->flow(slot, f));
}

const double* System::restore_slot(size_t slot, const double* from) {
  for (int f = 0; f < kSlotFields; ++f) lanes->set(slot, f, *from++);
  for (size_t f = 0; f < static_cast<size_t>(kForceFields); ++f) lanes->force_field(slot, f) = *from++;
  if (lanes->field(slot, kFlows) > 0) {
    lanes->open_flows();
    for (int f = 0; f < kFlowFields; ++f) lanes->flow(slot, f) = *from++;
  }
  return from;
}

void System::save_elements() {
  unpack_elements();
  element_history.clear();
  for (size_t e = 0; e < elements.size(); ++e)
    if (state.element[e].live) save_slot(slot_of(e), element_history);
}

void System::restore_elements(const std::vector<double>& history) {
  const size_t live = state.live_elements;
  lanes->slot_of.clear();
  lay_out_elements();
  const double* next = history.data();
  for (size_t e = 0; e < elements.size(); ++e) {
    if (!state.element[e].live) {
      kill_slot(e);
      continue;
    }
    const size_t slot = slot_of(e);
    next = restore_slot(slot, next);
    if (state.element[e].is_softened) lanes->softened[slot / lanes->W] = 1;
  }
  state.live_elements = live;
  lanes->share_constants();
}

void System::join_batch(Lanes& batch, size_t to) {
  std::vector<double> moved;
  for (size_t e = 0; e < elements.size(); ++e)
    if (state.element[e].live) save_slot(slot_of(e), moved);
  const LaneLayout layout = batch.body_layout(to);
  const std::unique_ptr<Lanes> before = std::move(own_lanes);  // keeps what the arrays are copied from
  for (auto [array, store] : {std::pair{&state.p, &batch.p},
                              {&state.v, &batch.v},
                              {&state.L, &batch.L},
                              {&state.w, &batch.w},
                              {&force, &batch.force},
                              {&torque, &batch.torque},
                              {&joint_force, &batch.joint_force},
                              {&joint_torque, &batch.joint_torque}})
    array->attach(store->data(), layout);
  state.q.attach(batch.q.data(), layout);
  state.R.attach(batch.R.data(), layout);
  state.ground_box.attach(batch.ground_states.data(), layout);
  lanes = &batch;
  lane = to;
  clusters_due = true;
  for (size_t b = 0; b < B; ++b) pack_body(b);
  const double* next = moved.data();
  for (size_t e = 0; e < elements.size(); ++e) {
    if (!state.element[e].live) continue;
    const size_t slot = slot_of(e);
    next = restore_slot(slot, next);
    ++batch.live[e];
    if (state.element[e].is_softened) batch.softened[e] = 1;
  }
}

Vec3 System::calc_element_reaction() const {
  Vec3 sum;
  for (size_t e = 0; e < elements.size(); ++e) {
    const size_t slot = slot_of(e);
    if (slot == Lanes::kNoSlot || !state.element[e].live) continue;
    const Vec3 on_a{lanes->force_field(slot, 0), lanes->force_field(slot, 1), lanes->force_field(slot, 2)};
    if (is_grounded(elements[e].a)) sum -= on_a;
    if (is_grounded(elements[e].b)) sum += on_a;
  }
  return sum;
}

void System::tell_yield(size_t zone, ZoneState& z) {
  if (z.is_told || !has_yielded(z)) return;
  z.is_told = true;
  say({Happening::Kind::ElementYielded, state.time, static_cast<int>(zone), -1, {}, 0});
}

void System::tell_yields() {
  for (size_t i = 0; i < elements.size(); ++i) tell_yield(i, state.element[i]);
}

void System::break_element(size_t e, BreakReason reason) {
  static const char* const words[] = {"", "tension", "crushing", "shear", "rotation", "torsion", "removed"};
  mark_links_due();
  say({Happening::Kind::ElementBroken, state.time, static_cast<int>(e), -1, words[static_cast<int>(reason)], 0});
}

}  // namespace topple::mbs
