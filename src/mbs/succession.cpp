#include "mbs/succession.h"

#include <cmath>

#include "base/error.h"
#include "mbs/snapshot.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr const char* kCounted[] = {
    "bodies",   "elements", "rotational elements", "joints",        "springs", "torsion springs",
    "bushings", "loads",    "polyhedra",           "moving bodies", "laws"};
constexpr size_t kAddable = 10;  // from here on more are allowed

std::array<size_t, 11> count_items(const System& s) {
  size_t moving = 0;
  for (const unsigned char f : s.fixed) moving += f == 0;
  return {s.B,
          s.E,
          s.rotationals.size(),
          s.joints.size(),
          s.state.spring.size(),
          s.state.torsion.size(),
          s.state.bushing.size(),
          s.state.load.size(),
          s.hull_shapes.size(),
          moving,
          s.laws.size()};
}

std::vector<int> laws_of(const System& s) {
  std::vector<int> laws;
  for (const CompiledElement& e : s.elements) laws.insert(laws.end(), {e.zone.law[0], e.zone.law[1]});
  for (const CompiledRotational& r : s.rotationals) laws.insert(laws.end(), {r.zone.law[0], r.zone.law[1]});
  return laws;
}

[[noreturn]] void refuse(const std::string& why) {
  throw InputError("E625", "the model cannot go on from this moment: " + why);
}

/// A law in the place of another: what was found for that one is void.
void forget_law(ZoneState& z) {
  z.safe_force[0] = 1, z.safe_force[1] = -1;
  for (StationState& s : z.station)
    for (int q = 0; q < 2; ++q) s.k[q] = s.j[q] = 0;
}

Vec3 place_of(const System& s, BodyId id, const Vec3& p) {
  if (id == kGround) return p;
  const size_t b = static_cast<size_t>(id.index);
  return s.state.p[b] + s.state.R[b] * (p - s.state.p_offset[b]);
}

}  // namespace

Moment keep_moment(System& s, const Course& course) {
  Moment m;
  m.time = s.state.time;
  m.next_time = s.state.time + s.step;
  m.steps = s.state.step_index;
  m.state = write_state(s);
  m.course = course.state();
  m.summary = s.summary;
  m.summary.joint_drift = s.state.largest_drift;
  m.summary.energy_error = course.calc_energy_error();
  m.joint_notes = s.joint_notes;
  m.noted_pairs = s.noted_pairs;
  m.counts = count_items(s);
  for (size_t i = 0; i < s.state.next_event; ++i) {
    const Event& e = s.model.events[s.event_order[i]];
    m.fired.emplace_back(e.time, e.name);
  }
  m.laws = laws_of(s);
  return m;
}

void go_on(const Moment& m, System& s, bool is_successor) {
  const std::array<size_t, 11> counts = count_items(s);
  for (size_t i = 0; i < counts.size(); ++i)
    if (counts[i] < m.counts[i] || (counts[i] > m.counts[i] && !(is_successor && i >= kAddable)))
      refuse("it has " + std::to_string(counts[i]) + " " + kCounted[i] + " instead of " + std::to_string(m.counts[i]));
  if (s.event_order.size() < m.fired.size()) refuse("events that have fired are missing");
  for (size_t i = 0; i < m.fired.size(); ++i) {
    const Event& e = s.model.events[s.event_order[i]];
    if (e.time != m.fired[i].first || e.name != m.fired[i].second)
      refuse("the event \"" + m.fired[i].second + "\" has fired and must stay as it is");
  }
  const size_t compiled_cables = s.state.cable.size();
  read_state(m.state, s);
  if (s.state.next_event != m.fired.size()) refuse("its events are not those");
  if (is_successor && !s.state.waiting.empty()) refuse("events wait for their triggers");
  if (s.state.cable.size() > compiled_cables) refuse("cables are missing");
  if (!is_successor && s.state.cable.size() != compiled_cables) refuse("cables were added");
  s.summary = m.summary;
  s.joint_notes = m.joint_notes;
  s.noted_pairs = m.noted_pairs;
  if (!is_successor) return;

  bool is_other_stiffness = false;
  // a new cable is cut to length where its ends are now; what it stores comes from outside
  for (size_t i = s.state.cable.size(); i < compiled_cables; ++i) {
    const Cable& k = s.model.cables[i];
    CableState c;
    c.rest_length = norm(place_of(s, k.b, k.p_B) - place_of(s, k.a, k.p_A)) - k.pretension / k.stiffness;
    s.state.removed -= 0.5 * k.pretension * k.pretension / k.stiffness;
    s.state.cable.push_back(c);
    is_other_stiffness = true;
  }
  const std::vector<int> laws = laws_of(s);
  for (size_t e = 0; e < s.elements.size(); ++e) {
    if (laws[2 * e] == m.laws[2 * e] && laws[2 * e + 1] == m.laws[2 * e + 1]) continue;
    forget_law(s.state.element[e]);
    s.pack_element(e);
    is_other_stiffness = true;
  }
  for (size_t r = 0; r < s.rotationals.size(); ++r) {
    const size_t at = 2 * (s.elements.size() + r);
    if (laws[at] == m.laws[at] && laws[at + 1] == m.laws[at + 1]) continue;
    forget_law(s.state.rotational[r]);
    is_other_stiffness = true;
  }
  s.lanes->share_constants();
  // the next step looks whether it must be shorter; without need it stays, and with it the course of the debris
  if (is_other_stiffness) s.state.review_times.push_back(s.state.time);
  s.state.quiet_steps = 0;
}

}  // namespace topple::mbs
