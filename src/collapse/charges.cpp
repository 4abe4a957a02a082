/// Charges as events of the model (docs/theory/manager.md, section 5).

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "base/error.h"
#include "base/words.h"
#include "collapse/builder.h"

namespace topple::collapse {

namespace {

constexpr double kLeastStiffnessShare = 1e-3;  // of a fired zone, so that its forces die out smoothly

/// Upper end of what a charge destroys, from the member's start [m].
double upper_end(const product::Charge& c) { return c.position + 0.5 * c.destroyed_length; }

/// Whether a charge leaves less of a zone: fewer bars, or as few over a greater length.
bool leaves_less(const product::Charge& a, const product::Charge& b) {
  return a.residual_bars != b.residual_bars ? a.residual_bars < b.residual_bars
                                            : a.destroyed_length > b.destroyed_length;
}

}  // namespace

using product::Member;
using product::MemberKind;

std::vector<Firing> Builder::order_firings() const {
  std::vector<Firing> out;
  for (const Firing& f : map.schedule)
    if (!f.fails) out.push_back(f);
  // those of a member in one instant: the one that leaves least of it comes first, then the higher one
  const auto is_before = [this](const Firing& a, const Firing& b) {
    const product::Charge &first = charge_of(a), &second = charge_of(b);
    if (leaves_less(first, second) || leaves_less(second, first)) return leaves_less(first, second);
    return first.position > second.position;
  };
  for (size_t i = 0; i < out.size(); ++i)
    for (size_t j = i + 1; j < out.size() && out[j].time == out[i].time; ++j)
      if (charge_of(out[i]).member == charge_of(out[j]).member &&
          member(charge_of(out[i]).member).kind != MemberKind::Shaft && is_before(out[j], out[i]))
        std::swap(out[i], out[j]);
  return out;
}

mbs::LawId Builder::partial_law_of(const Firing& firing, const MemberZones& z, size_t station) {
  const product::Charge& c = charge_of(firing);
  const Member& m = member(c.member);
  const int zone = partial_zones.at({firing.stage, firing.charge, static_cast<int>(station)});
  const Stiffness s = calc_stiffness(z);
  const auto key = std::make_tuple(zone, s.EI_y, s.EI_z, fmt::format("{}/charge of {} m", m.name, c.destroyed_length));
  if (const auto it = hinge_laws.find(key); it != hinge_laws.end()) return it->second;
  const Bending bending = m.kind == MemberKind::Column ? bending_of_column() : bending_of_x_beam();
  const Lever& lever = z.lever[station];
  const std::string name = m.name + "/charge";
  const mbs::SharedLaw beside = make_law(z.station[station].zone, s, name, bending, lever);
  const double thickness = std::min(section_of(c.member).width, section_of(c.member).height);
  mbs::ZoneLaw law = make_partial_law(*make_law(zone, s, name, bending, lever), c.destroyed_length, thickness, *beside);
  law.name = name;
  return hinge_laws[key] = mbs::add_law(model, std::move(law));
}

/// What is above a charge in a column of the ground storey becomes a stub under its joint: whatever it meets can crush
/// it, shear it off or turn it.
void Builder::make_stub(const product::Charge& c, const MemberZones& z, mbs::Event& event, mbs::Event& lighter) {
  const MemberStation& top = z.station[1];
  const double length = z.clear_length - upper_end(c);
  if (!(length > 0)) return;
  // it turns about its own end alone
  mbs::Action act =
      make_switch(stub_law_of(top.damaged >= 0 ? top.damaged : top.zone, calc_stiffness(z), c.member, length),
                  1 / (z.lever[1].moment_z * z.lever[1].rotation));
  act.rotational = z.rotational;
  event.actions.push_back(act);
  act = {};
  act.kind = mbs::Action::Kind::LoosenJoint;
  act.joint = model.rotational_elements[static_cast<size_t>(z.rotational)].joint;
  lighter.actions.push_back(std::move(act));

  const mbs::Curve& curve = model.laws[static_cast<size_t>(event.actions.back().law.index)].compression;
  const auto peak = std::max_element(curve.f.begin(), curve.f.end());
  StubEntry stub{member(c.member).name, static_cast<int>(model.elements.size()) + z.rotational, lighter.time, length,
                 0};
  if (peak != curve.f.end()) stub.peak = curve.x[static_cast<size_t>(peak - curve.f.begin())];
  map.stubs.push_back(std::move(stub));
}

namespace {

/// What charges destroy of columns in more than one place, as findings say it; empty: nothing.
std::string tell_pieces_between_gaps(const product::Plan& plan) {
  std::map<int, std::vector<const product::Charge*>> charges;  // by column
  for (const product::Stage& s : plan.stages)
    for (const product::Charge& c : s.charges)
      if (!c.fails && plan.members[static_cast<size_t>(c.member)].kind == MemberKind::Column)
        charges[c.member].push_back(&c);
  std::vector<std::string> columns;
  double falls = 0, gaps_alone = 0;  // of the first [m]
  for (auto& [index, list] : charges) {
    std::sort(list.begin(), list.end(),
              [](const product::Charge* a, const product::Charge* b) { return a->position < b->position; });
    const double low = list.front()->position - 0.5 * list.front()->destroyed_length;
    double top = low, gaps = 0;
    bool has_piece = false;
    for (const product::Charge* charge : list) {
      const double from = std::max(top, charge->position - 0.5 * charge->destroyed_length), to = upper_end(*charge);
      has_piece |= from - top > kSliver;
      gaps += std::max(0.0, to - from);
      top = std::max(top, to);
    }
    if (!has_piece) continue;
    if (columns.empty()) falls = top - low, gaps_alone = gaps;
    columns.push_back(plan.members[static_cast<size_t>(index)].name);
  }
  if (columns.empty()) return {};
  return fmt::format(
      "Columns with two gaps, the piece between which is not modelled but leaves with the debris of a charge: {} (the "
      "first is {}). What stands on {} falls by both gaps and the piece, {:.2f} m; the gaps alone have {:.2f} m.",
      columns.size(), columns.front(), columns.front(), falls, gaps_alone);
}

/// "stage 1 "Rear": 5 charges, 1 fails", without those that were taken out of the plan.
std::string tell_stage(const product::Stage& stage, size_t number, const std::vector<Firing>& schedule) {
  size_t charges = 0, failing = 0;
  for (const Firing& f : schedule) {
    if (static_cast<size_t>(f.stage) + 1 != number) continue;
    const bool is_planned_to_fail = stage.charges[static_cast<size_t>(f.charge)].fails;
    if (f.fails && !is_planned_to_fail) continue;
    ++charges;
    failing += f.fails;
  }
  std::string text =
      fmt::format("stage {} \"{}\": {}", number, stage.name, count_words(static_cast<long long>(charges), "charge"));
  if (failing > 0) text += fmt::format(", {} {}", failing, failing == 1 ? "fails" : "fail");
  return text;
}

}  // namespace

void Builder::add_events(std::vector<Firing> schedule) {
  constexpr const char* between_gaps = "Piece between two gaps";
  constexpr const char* without_hold = "Cable without hold";
  map.schedule = std::move(schedule);
  map.remarks.clear();
  // events may be added anew
  std::erase_if(map.notes,
                [](const ModelNote& note) { return note.title == between_gaps || note.title == without_hold; });
  if (const std::string text = tell_pieces_between_gaps(plan); !text.empty()) map.notes.push_back({between_gaps, text});
  for (size_t s = 0; s < plan.stages.size(); ++s) map.stages.push_back(tell_stage(plan.stages[s], s + 1, map.schedule));
  std::vector<Assembly> current = assemblies;  // as they are after the events so far
  std::vector<Vec3> centre;                    // their centres of mass at the start, in W
  for (const mbs::Body& b : model.bodies) centre.push_back(b.X_WB.p);
  std::set<std::string> without_zone;             // members with damage beside a charge that no zone has
  std::map<int, const product::Charge*> weakest;  // element -> charge so far that leaves least of it
  std::map<int, double> highest;                  // column -> upper end of what charges so far destroyed [m]
  std::vector<const Firing*> partial;             // of lengths that are not wholly destroyed
  std::set<size_t> loose_cables;                  // tied to what charges so far destroyed
  const std::vector<Firing> firings = order_firings();
  // a higher charge makes the stub if it fires in the same instant
  const auto is_highest = [&](const Firing& f) {
    return std::none_of(firings.begin(), firings.end(), [&](const Firing& other) {
      return other.time == f.time && charge_of(other).member == charge_of(f).member &&
             charge_of(other).position > charge_of(f).position;
    });
  };

  // a destroyed length is thrown out, and with it what it cuts off from the part of a column above it
  const auto throw_out = [&](const product::Charge& c, int axis, double from, double to,
                             const std::function<bool(const Part&)>& applies, mbs::Event& lighter, EventEntry& entry) {
    const Member& m = member(c.member);
    const bool is_shaft = m.kind == MemberKind::Shaft;
    const int below = stump_body.count(c.member) ? stump_body.at(c.member) : -1;
    const double loose_from = below < 0 ? from : std::min(from, m.start.z + lowest_charge.at(c.member));
    for (size_t i = 0; i < std::min(plan.cables.size(), model.cables.size()); ++i) {
      const product::Cable& cable = plan.cables[i];
      const double at = m.start[axis] + cable.position;
      if (cable.member != c.member || (is_shaft && !product::is_all_around(c.opening))) continue;
      if (at < (model.cables[i].a.index == below ? from : loose_from) || at > to) continue;
      if (!loose_cables.insert(i).second) continue;
      mbs::Action act;
      act.kind = mbs::Action::Kind::ReleaseCable;
      act.cable = static_cast<int>(i);
      lighter.actions.push_back(std::move(act));
      map.notes.push_back(
          {without_hold, fmt::format("{} lets go at {:.2f} s: what it is tied to on {} is destroyed then.", cable.name,
                                     lighter.time, m.name)});
    }
    std::set<int> touched;
    for (size_t b = 0; b < current.size(); ++b)
      for (const Part& p : current[b].parts)
        if (p.member == c.member && (!applies || applies(p)) &&
            p.centre[axis] + p.half[axis] > (static_cast<int>(b) == below ? from : loose_from) &&
            p.centre[axis] - p.half[axis] < to)
          touched.insert(static_cast<int>(b));
    for (const int b : touched) {
      Assembly& a = current[static_cast<size_t>(b)];
      const std::vector<Part> removed = cut_member(a, c.member, axis, b == below ? from : loose_from, to, applies);
      if (removed.empty()) continue;
      for (const Part& p : removed) {
        entry.debris_mass += p.mass;
        map.debris.push_back({m.name, m.storey, p.mass, p.centre, p.half, entry.time, p.turn, volume_of(p)});
      }
      mbs::Body replacement = make_body(a, k);
      const Vec3 p_WB = replacement.X_WB.p;
      if (a.fixed) {
        // nothing may hit what is going to be gone: a fixed body carries nothing else
        mbs::Body& stump = model.bodies[static_cast<size_t>(b)];
        const Vec3 shift = p_WB - stump.X_WB.p;
        stump.shapes = replacement.shapes;
        for (mbs::Shape& s : stump.shapes) s.X_BS.p += shift;
        continue;
      }
      replacement.X_WB = {p_WB - centre[static_cast<size_t>(b)], {}};
      centre[static_cast<size_t>(b)] = p_WB;
      mbs::Action act;
      act.kind = mbs::Action::Kind::ReplaceBody;
      act.body = mbs::BodyId{b};
      act.replacement = std::move(replacement);
      lighter.actions.push_back(std::move(act));
    }
  };

  for (const Firing& firing : firings) {
    const product::Charge& c = charge_of(firing);
    const Member& m = member(c.member);
    // a beam between frames has no zones of its own in a condensed model and is refused before
    if (!has_frame(m.frame_a)) continue;
    const bool is_shaft = m.kind == MemberKind::Shaft;
    if (is_shaft && !shafts.count(c.member)) continue;
    const MemberZones& z = zones[c.member];
    const int axis = m.kind == MemberKind::Column || is_shaft ? 2 : m.row_a != m.row_b ? 0 : 1;
    double from = m.start[axis] + c.position - 0.5 * c.destroyed_length;
    // a column that was not built with a stump leaves nothing below its charge
    if (m.kind == MemberKind::Column && !lowest_charge.count(c.member)) from = m.start[axis];
    const double to = m.start[axis] + c.position + 0.5 * c.destroyed_length;
    const bool is_beam = m.kind == MemberKind::Beam, is_partial = c.residual_concrete > 0;
    int which = is_beam ? find_nearer_station(z, c.position) : 0;
    mbs::Event event;
    event.name = m.name;
    // concrete and stiffness go together, when the ramp of the limits is over
    mbs::Event lighter;
    lighter.time = firing.time + k.charge_release_time;
    lighter.name = m.name + " thrown out";
    event.time = firing.time;
    EventEntry entry{firing.stage, firing.charge, m.name, firing.time, 0, c.residual_concrete, false, {}};

    const int element = z.element[which];
    std::function<bool(const Part&)> applies;
    if (is_shaft) {
      fire_shaft(firing, event, lighter);
      applies = [&c, &m](const Part& p) {
        // a stave in the middle of two charges belongs to one
        const double at = std::atan2(p.centre.y - m.start.y, p.centre.x - m.start.x) - 1e-7;
        return p.is_solid && product::is_in_sector(at, c.azimuth, c.opening);
      };
    }
    for (const int end : {0, 1}) {
      const int reached = z.element[end];
      if (is_shaft ||
          (end != which && !(is_beam && reached != element && reaches_station(c, z.station[static_cast<size_t>(end)]))))
        continue;
      const auto it = weakest.find(reached);
      if (it != weakest.end() && !leaves_less(c, *it->second)) continue;
      weakest[reached] = &c;
      mbs::Action act;
      if (is_partial) {
        act = make_switch(partial_law_of(firing, z, static_cast<size_t>(end)));
      } else {
        const nearfield::ZoneInput& in = library.input(z.station[static_cast<size_t>(end)].zone);
        const nearfield::ResidualCage cage = make_residual_cage(in, c.destroyed_length, c.residual_bars);
        const auto key = std::make_tuple(reached, c.destroyed_length, c.residual_bars, c.position);
        if (!cage_laws.count(key))
          cage_laws[key] = mbs::add_law(model, make_cage_law(cage, c.destroyed_length, m.name + "/charge", k));
        // bars alone are as soft as they are long
        const double before = model.elements[static_cast<size_t>(reached)].translational_stiffness.x;
        act =
            make_switch(cage_laws[key], std::clamp(cage.EA / (c.destroyed_length * before), kLeastStiffnessShare, 1.0));
      }
      act.element = mbs::ElementId{reached};
      event.actions.push_back(act);
      ZoneEntry& zone = map.elements[static_cast<size_t>(reached)];
      double& time = is_partial ? zone.weakening_time : zone.firing_time;
      time = std::min(time, firing.time);
    }

    if (is_partial)
      partial.push_back(&firing);
    else
      throw_out(c, axis, from, to, applies, lighter, entry);
    if (m.kind == MemberKind::Column && m.storey == 0)
      for (GroundColumn& g : map.ground_columns) g.is_fired |= g.member == m.name;

    // the hinge of a column that is not wholly destroyed stays
    if (is_partial && z.rotational >= 0 && z.station[1].damaged >= 0) {
      mbs::Action act =
          make_switch(hinge_law_of(z.station[1].damaged, calc_stiffness(z), m.name + "/transition", z.lever[1]));
      act.rotational = z.rotational;
      event.actions.push_back(std::move(act));
    }

    // transition zones
    bool weakens = is_shaft || (z.rotational >= 0 && z.station[1].damaged >= 0);
    for (int other : {0, 1}) {
      if (is_shaft) break;
      const MemberStation& station = z.station[static_cast<size_t>(other)];
      if (other == which || station.damaged < 0) continue;
      if (z.element[other] >= 0 && z.element[other] != element) {
        weakens = true;
        if (weakest.count(z.element[other])) continue;  // it has fired, and stays
        mbs::Action act = make_switch(law_of(station.damaged, calc_stiffness(z), m.name + "/transition"));
        act.element = mbs::ElementId{z.element[other]};
        event.actions.push_back(act);
      }
    }
    if (c.transition_damage > 0 && !weakens) without_zone.insert(m.name);
    const auto top = highest.try_emplace(c.member, 0).first;
    if (!is_partial && z.rotational >= 0 && upper_end(c) > top->second && is_highest(firing))
      make_stub(c, z, event, lighter);
    top->second = std::max(top->second, upper_end(c));
    model.events.push_back(std::move(event));
    map.events.push_back(entry);
    if (lighter.actions.empty()) continue;
    model.events.push_back(std::move(lighter));
    entry.is_aftermath = true;
    map.events.push_back(entry);
  }

  if (!partial.empty()) {
    const product::Charge& first = charge_of(*partial.front());
    map.remarks.push_back(
        {"Lengths not wholly destroyed",
         fmt::format("Charges that leave part of the concrete: {} (the first leaves {:.3g} % on {}). Nothing is thrown "
                     "out there; what is left is crushed, bent and sheared off as a section of its own.",
                     partial.size(), 100 * first.residual_concrete, member(first.member).name)});
  }
  if (!without_zone.empty())
    map.remarks.push_back(
        {"Damage without effect", fmt::format("Members in which the damage beside charges (transition_damage) changes "
                                              "nothing, as no other zone of theirs is "
                                              "near enough: {} (the first is {}).",
                                              without_zone.size(), *without_zone.begin())});

  // a record's body has one set of shapes: what remains; what is thrown out is drawn as debris
  for (size_t b = 0; b < current.size(); ++b) {
    map.bodies[b].volume = volume_of(current[b]);
    if (current[b].mass() != assemblies[b].mass())
      map.bodies[b].shapes = make_shapes(current[b], model.bodies[b].X_WB.p, plan);
  }
}

}  // namespace topple::collapse
