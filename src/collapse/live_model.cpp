#include "collapse/live_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/unit.h"
#include "collapse/frequency_limit.h"
#include "product/plan_limits.h"

namespace topple::collapse {

using product::Member;
using product::MemberKind;

const char* word_of(Edit::Kind kind) {
  switch (kind) {
    case Edit::Kind::Fire:
      return "fire";
    case Edit::Kind::SetDelay:
      return "set_delay";
    case Edit::Kind::AddCharge:
      return "add_charge";
    case Edit::Kind::RemoveCharge:
      return "remove_charge";
    case Edit::Kind::AddPreCut:
      return "add_pre_cut";
    case Edit::Kind::AddCable:
      return "add_cable";
    case Edit::Kind::RemoveCable:
      return "remove_cable";
    case Edit::Kind::SetFriction:
      return "set_friction";
  }
  return "";
}

namespace {

[[noreturn]] void refuse_value(const std::string& what, const std::string& help = {}) {
  throw InputError("E912", what, help);
}

void demand(bool holds, const std::string& what, const std::string& help = {}) {
  if (!holds) refuse_value(what, help);
}

namespace limits = product::limits;
constexpr double kLongestTime = limits::duration.high;  // [s]

bool is_share(double x) { return x >= 0 && x <= 1; }

/// Whether what is due at t lies behind a time of a run; what is due at the start does not before the first step.
bool is_past(double t, double time) { return time > 0 ? t <= time : t < time; }

/// A time with no more digits than it needs.
std::string words_of_time(double t) { return fmt::format("{:.6g} s", t); }

}  // namespace

LiveModel::LiveModel(product::Plan plan, const Knowledge& k, int threads)
    : given_(std::make_shared<const product::Plan>(plan)), plan_(std::move(plan)), k_(&k) {
  Builder builder(plan_, k, map_, threads);
  builder.build();
  limit_frequency(builder.model, k.body_highest_frequency);
  built_ = std::move(static_cast<BuilderState&>(builder));
  for (const mbs::Body& b : built_.model.bodies) shapes_.push_back(b.shapes);
  for (const BodyEntry& b : map_.bodies) drawn_.push_back(b.shapes);
  for (const mbs::RotationalElement& r : built_.model.rotational_elements) loose_.push_back(r.loose_translational);
  // places in the plan, not in time
  for (size_t s = 0; s < plan_.stages.size(); ++s)
    for (size_t c = 0; c < plan_.stages[s].charges.size(); ++c)
      charges_.push_back({static_cast<int>(s), static_cast<int>(c), 0, plan_.stages[s].charges[c].fails});
  for (const Firing& f : make_schedule(plan_, k))
    for (LiveCharge& c : charges_)
      if (c.stage == f.stage && c.index == f.charge) {
        c.time = f.time;
        c.offset = f.time - plan_.stages[static_cast<size_t>(c.stage)].time - charge(c).delay;
      }
  lay_out_events();
}

LiveModel::LiveModel(const LiveModel&) = default;

void LiveModel::lay_out_events() {
  mbs::Model& model = built_.model;
  model.events.clear();
  map_.events.clear();
  map_.debris.clear();
  map_.stubs.clear();
  map_.stages.clear();
  for (ZoneEntry& z : map_.elements) z.firing_time = z.weakening_time = std::numeric_limits<double>::infinity();
  for (GroundColumn& g : map_.ground_columns) g.is_fired = false;
  for (size_t b = 0; b < shapes_.size(); ++b) {
    model.bodies[b].shapes = shapes_[b];
    map_.bodies[b].shapes = drawn_[b];
  }
  for (size_t r = 0; r < loose_.size(); ++r) model.rotational_elements[r].loose_translational = loose_[r];
  std::vector<Firing> schedule;
  for (const LiveCharge& c : charges_) schedule.push_back({c.stage, c.index, c.time, c.fails || c.is_removed});
  std::stable_sort(schedule.begin(), schedule.end(), [](const Firing& a, const Firing& b) { return a.time < b.time; });
  Builder builder(std::move(built_), plan_, *k_, map_);
  builder.add_events(std::move(schedule));
  limit_frequency_of_stubs(builder.model, k_->body_highest_frequency);
  built_ = std::move(static_cast<BuilderState&>(builder));
  for (const Extra& e : extras_) {
    built_.model.events.push_back(e.event);
    map_.events.push_back(e.entry);
  }
}

int LiveModel::law_of_zone(size_t zone) const {
  const mbs::Model& m = built_.model;
  if (zone < m.elements.size())
    return m.elements[zone].stations.empty() ? -1 : m.elements[zone].stations.front().law.index;
  zone -= m.elements.size();
  return zone < m.rotational_elements.size() ? m.rotational_elements[zone].law.index : -1;
}

int LiveModel::member_named(const std::string& name) const {
  const int i = plan_.find_member(name);
  if (i >= 0) return i;
  std::vector<std::string> known;
  for (const Member& m : plan_.members) known.push_back(m.name);
  const std::string near = nearest_name(name, known);
  throw InputError("E920", "there is no member \"" + name + "\"", near.empty() ? "" : "did you mean \"" + near + "\"?");
}

bool LiveModel::has_fired(const LiveCharge& c, double time) {
  return is_past(c.time, time) && !c.fails && !c.is_removed;
}

LiveCharge& LiveModel::unfired(int charge, double time) {
  if (charge < 0 || charge >= static_cast<int>(charges_.size()))
    throw InputError("E920", fmt::format("there is no charge {}; there are {}", charge, charges_.size()));
  LiveCharge& c = charges_[static_cast<size_t>(charge)];
  if (c.is_removed) throw InputError("E931", "the charge on " + member_of(c) + " is taken out");
  if (has_fired(c, time))
    throw InputError("E931", fmt::format("the charge on {} has fired at {}", member_of(c), words_of_time(c.time)),
                     "rewind to a time before that");
  return c;
}

std::string LiveModel::apply(const Edit& e, double time, double next) {
  std::string text;
  switch (e.kind) {
    case Edit::Kind::Fire:
      text = fire(e, time, next);
      break;
    case Edit::Kind::SetDelay:
      text = set_delay(e, time);
      break;
    case Edit::Kind::AddCharge:
      text = add_charge(e, time, next);
      break;
    case Edit::Kind::RemoveCharge:
      text = remove_charge(e, time);
      break;
    case Edit::Kind::AddPreCut:
      text = add_pre_cut(e, time);
      break;
    case Edit::Kind::AddCable:
      text = add_cable(e);
      break;
    case Edit::Kind::RemoveCable:
      text = remove_cable(e, time, next);
      break;
    case Edit::Kind::SetFriction:
      text = set_friction(e);
      break;
  }
  lay_out_events();
  applied_.push_back({e, text, time});
  return text;
}

void LiveModel::refuse_in_stump(int member, double position) const {
  const auto it = built_.lowest_charge.find(member);
  if (it == built_.lowest_charge.end() || position >= it->second) return;
  throw InputError("E933",
                   fmt::format("{} stands on a stump up to {:.3g} m, which cannot be cut while it runs",
                               plan_.members[static_cast<size_t>(member)].name, it->second),
                   "write the charge into the plan and apply it");
}

void LiveModel::request_zones_of(int member) {
  if (plan_.members[static_cast<size_t>(member)].kind == MemberKind::Shaft) return;
  Builder builder(std::move(built_), plan_, *k_, map_);
  for (int which : {0, 1}) builder.request_station(member, which);
  builder.library.compute(1);
  built_ = std::move(static_cast<BuilderState&>(builder));
}

void LiveModel::note_without_stump(const product::Charge& c) {
  const Member& m = plan_.members[static_cast<size_t>(c.member)];
  if (m.kind != MemberKind::Column || built_.lowest_charge.count(c.member)) return;
  map_.notes.push_back({"Added charge", c.residual_concrete > 0
                                            ? m.name + " was built without a charge: what the added one leaves is "
                                                       "taken at its foot."
                                            : m.name + " was built without a charge: what lies below the added one "
                                                       "leaves with it."});
}

std::string LiveModel::fire(const Edit& e, double time, double next) {
  LiveCharge& c = unfired(e.charge, time);
  refuse_in_stump(charge(c).member, charge(c).position);
  c.time = next;
  c.offset = 0;
  if (c.fails) {
    c.fails = false;
    plan_.stages[static_cast<size_t>(c.stage)].charges[static_cast<size_t>(c.index)].fails = false;
    request_zones_of(charge(c).member);
    note_without_stump(charge(c));
  }
  return fmt::format("{} fires now, at {}", member_of(c), words_of_time(next));
}

std::string LiveModel::set_delay(const Edit& e, double time) {
  demand((e.charge >= 0) != (e.stage >= 0), "set_delay wants either a charge or a stage");
  demand(e.delay.has_value() != e.time.has_value(), "set_delay wants either a delay or a time");
  const auto check = [&](double t, const std::string& what) {
    demand(t >= 0 && t <= kLongestTime, fmt::format("{} must fire at 0 to {:g} s", what, kLongestTime));
    demand(
        !is_past(t, time),
        fmt::format("{} would have to fire at {}, and it is {} already", what, words_of_time(t), words_of_time(time)),
        "fire it now, or rewind");
  };
  if (e.charge >= 0) {
    LiveCharge& c = unfired(e.charge, time);
    demand(!e.delay || *e.delay >= 0, "delay must be >= 0 s");
    product::Stage& stage = plan_.stages[static_cast<size_t>(c.stage)];
    product::Charge& charge = stage.charges[static_cast<size_t>(c.index)];
    const double scatter = c.time - std::max(stage.time, stage.time + charge.delay);
    const double t = e.time ? *e.time : std::max(stage.time, stage.time + *e.delay + scatter);
    check(t, member_of(c));
    const double before = c.time;
    c.time = t;
    c.offset = e.time ? 0 : t - stage.time - *e.delay;
    charge.delay = e.time ? t - stage.time : *e.delay;
    if (c.fails)
      return fmt::format("{} does not fire, as the plan says; it would at {} instead of {}", member_of(c),
                         words_of_time(t), words_of_time(before));
    return fmt::format("{} fires at {} instead of {}", member_of(c), words_of_time(t), words_of_time(before));
  }
  if (e.stage >= static_cast<int>(plan_.stages.size()))
    throw InputError("E920", fmt::format("there is no stage {}; there are {}", e.stage, plan_.stages.size()));
  product::Stage& stage = plan_.stages[static_cast<size_t>(e.stage)];
  const double first = plan_.stages.front().time;
  const double t = e.time ? *e.time : first + *e.delay;
  check(t, stage.name);
  int moved = 0;
  for (LiveCharge& c : charges_) {
    if (c.stage != e.stage || c.is_removed || is_past(c.time, time)) continue;
    if (t != stage.time) c.time = std::max(t, t + (c.time - stage.time));
    ++moved;
  }
  if (moved == 0) throw InputError("E931", stage.name + " has fired already", "rewind to a time before that");
  const double before = stage.time;
  stage.time = t;
  return fmt::format("{} fires at {} instead of {}", stage.name, words_of_time(t), words_of_time(before));
}

std::string LiveModel::add_charge(const Edit& e, double time, double next) {
  const int index = member_named(e.member);
  const Member& m = plan_.members[static_cast<size_t>(index)];
  const auto refuse = [&](const std::string& why, const std::string& help = {}) {
    throw InputError("E932", m.name + ": " + why, help);
  };
  if (m.removed) refuse("was taken out before the first charge");
  const bool is_column = m.kind == MemberKind::Column;
  if (!is_column && m.kind != MemberKind::Beam) refuse("charges act on columns and beams only");
  const MemberZones& z = built_.zones[index];
  if (z.element[0] < 0) refuse("has no zone of its own");
  demand(product::is_within(e.destroyed_length, limits::destroyed_length), "destroyed_length must be 0.01 to 100 m");
  demand(is_share(e.residual_bars), "residual_bars must be 0 to 1");
  demand(is_share(e.transition_damage), "transition_damage must be 0 to 1");
  demand(product::is_within(e.residual_concrete, limits::residual_concrete), "residual_concrete must be 0 to 0.95");
  demand(!(e.residual_concrete > 0 && e.residual_bars == 0 && e.transition_damage == 1),
         "of concrete without strength and no bars nothing is left", "leave residual_concrete out");
  if (e.residual_concrete > 0 && !product::can_keep_concrete(m))
    refuse("residual_concrete is known of columns of the ground storey and of beams along x");
  const double low = e.position - 0.5 * e.destroyed_length, high = e.position + 0.5 * e.destroyed_length;
  const double from = z.clear_start, to = z.clear_start + z.clear_length;
  demand(low >= from && high <= to,
         fmt::format("{}: a charge at {:.3g} m that destroys {:.3g} m must lie between {:.3g} and {:.3g} m", m.name,
                     e.position, e.destroyed_length, from, to));
  refuse_in_stump(index, e.position);
  constexpr double slack = 1e-9;  // round-off, as in plans [m]
  for (const LiveCharge& c : charges_) {
    const product::Charge& other = charge(c);
    if (c.is_removed || other.member != index) continue;
    if (e.residual_concrete > 0 || other.residual_concrete > 0)
      refuse("has another charge, and one leaves concrete", "take that one out first");
    if (std::abs(other.position - e.position) < 0.5 * (other.destroyed_length + e.destroyed_length) - slack)
      refuse(fmt::format("has another charge on the same length, {:.3g} to {:.3g} m",
                         other.position - 0.5 * other.destroyed_length, other.position + 0.5 * other.destroyed_length),
             "take that one out first, or move this one away from it");
  }
  const double t = e.time.value_or(next);
  demand(!is_past(t, time), "the charge would have to fire in the past");
  demand(t <= kLongestTime, fmt::format("the charge must fire before {:g} s", kLongestTime));
  size_t stage = 0;
  if (plan_.stages.empty()) plan_.stages.push_back({"added", t, {}, {}});
  for (size_t s = 0; s < plan_.stages.size(); ++s)
    if (plan_.stages[s].time <= t) stage = s;
  product::Charge c;
  c.member = index;
  c.position = e.position;
  c.destroyed_length = e.destroyed_length;
  c.residual_bars = e.residual_bars;
  c.residual_concrete = e.residual_concrete;
  c.transition_damage = e.transition_damage;
  c.delay = t - plan_.stages[stage].time;
  plan_.stages[stage].charges.push_back(c);
  charges_.push_back(
      {static_cast<int>(stage), static_cast<int>(plan_.stages[stage].charges.size()) - 1, t, false, false, true});
  request_zones_of(index);
  note_without_stump(c);
  return fmt::format("a charge on {} at {:.3g} m, destroying {:.3g} m, fires at {}", m.name, e.position,
                     e.destroyed_length, words_of_time(t));
}

std::string LiveModel::remove_charge(const Edit& e, double time) {
  LiveCharge& c = unfired(e.charge, time);
  c.is_removed = true;
  if (const Member& m = plan_.members[static_cast<size_t>(charge(c).member)]; m.kind == MemberKind::Shaft) {
    // what was said of its mouths, and of the block above them, holds for all its charges
    const std::string title = "The mouth of " + m.name;
    std::erase_if(map_.notes, [&](const ModelNote& note) { return note.title == title; });
    std::erase_if(map_.ground_columns, [&](const GroundColumn& g) { return g.member == m.name; });
    map_.notes.push_back(
        {title, fmt::format("The mouth of {}: a charge is taken out, and what it leaves of the ring is "
                            "not known here; apply the edits to the plan to have it anew.",
                            m.name)});
  }
  return fmt::format("the charge on {} at {} is taken out", member_of(c), words_of_time(c.time));
}

std::string LiveModel::add_pre_cut(const Edit& e, double time) {
  const int index = member_named(e.member);
  Member& m = plan_.members[static_cast<size_t>(index)];
  const auto refuse = [&](const std::string& why) { throw InputError("E932", m.name + ": " + why); };
  if (m.removed) refuse("was taken out before the first charge");
  if (m.kind != MemberKind::Column && m.kind != MemberKind::Beam) refuse("pre-cuts weaken columns and beams only");
  MemberZones& z = built_.zones[index];
  if (z.element[0] < 0) refuse("has no zone of its own");
  demand(is_share(e.cut_bars) && is_share(e.cut_concrete), "cut_bars and cut_concrete must be 0 to 1");
  demand(e.cut_bars > 0 || e.cut_concrete > 0, "cut_bars or cut_concrete must be more than 0");
  demand(e.cut_concrete < 1, "cut_concrete must be less than 1", "a charge takes out all of it");
  const double length = norm(m.end - m.start);
  demand(e.position >= 0 && e.position <= length, fmt::format("{}: at must be 0 to {:.3g} m", m.name, length));
  const size_t which = std::abs(e.position - z.station[1].at) < std::abs(e.position - z.station[0].at) ? 1 : 0;
  const int element = z.element[which];
  if (element >= 0 && is_past(map_.elements[static_cast<size_t>(element)].firing_time, time))
    refuse("its charge has fired there");
  for (const LiveCharge& c : charges_)
    if (charge(c).member == index && has_fired(c, time)) refuse("its charge has fired already");
  m.weakenings.push_back({e.position, e.cut_bars, e.cut_concrete});

  Builder builder(std::move(built_), plan_, *k_, map_);
  MemberZones& zones = builder.zones[index];
  // a cut is local: the member keeps its stiffness
  const Builder::Stiffness stiffness = builder.calc_stiffness(zones);
  builder.request_station(index, static_cast<int>(which));
  builder.library.compute(1);
  const int zone = zones.station[which].zone;
  if (element >= 0) {
    mbs::ZoneElement& el = builder.model.elements[static_cast<size_t>(element)];
    // limits about the axes that the member's own law has
    const bool is_y_beam = m.kind == MemberKind::Beam && m.row_a == m.row_b;
    const Bending bending = m.kind == MemberKind::Column ? builder.bending_of_column()
                            : is_y_beam                  ? Bending::Both
                                                         : builder.bending_of_x_beam();
    const mbs::LawId law = builder.law_of(zone, stiffness, m.name + "/cut", bending, zones.lever[which]);
    size_t station = 0;
    // of a whole member, the station on the cut's side
    if (el.stations.size() == 2) station = (el.stations[0].x < 0) == (which == 0) ? 0 : 1;
    el.stations[station].law = law;
  } else {
    builder.model.rotational_elements[static_cast<size_t>(z.rotational)].law =
        builder.hinge_law_of(zone, stiffness, m.name + "/cut", zones.lever[1]);
  }
  built_ = std::move(static_cast<BuilderState&>(builder));
  return fmt::format("{} is cut at {:.3g} m: {:.3g} % of the bars, {:.3g} % of the concrete", m.name, e.position,
                     100 * e.cut_bars, 100 * e.cut_concrete);
}

std::string LiveModel::add_cable(const Edit& e) {
  const int index = member_named(e.member);
  const Member& m = plan_.members[static_cast<size_t>(index)];
  const double length = norm(m.end - m.start);
  demand(e.position >= 0 && e.position <= length, fmt::format("{}: position must be 0 to {:.3g} m", m.name, length));
  demand(product::is_within(e.stiffness, limits::cable_stiffness), "stiffness must be > 0 N/m, at most 1e12");
  demand(product::is_within(e.pretension, limits::cable_pretension), "pretension must be 0 to 1e9 N");
  demand(e.strength >= 0, "strength must be >= 0 N; 0: it never breaks");
  demand(e.strength == 0 || e.strength > e.pretension,
         fmt::format("strength, {:g} N, must be above the pretension, {:g} N", e.strength, e.pretension),
         "0: it never breaks");
  for (int i = 0; i < 3; ++i)
    demand(product::is_within(e.anchor[i], limits::site),
           "anchor must be three numbers, each within 10 km of the origin");
  demand(norm(m.start + (length > 0 ? e.position / length : 0) * (m.end - m.start) - e.anchor) >= 1e-3,
         "anchor is where the cable is tied to " + m.name, "a cable without length pulls in no direction");
  product::Cable c;
  size_t number = plan_.cables.size();
  do c.name = fmt::format("added {}", ++number);
  while (
      std::any_of(plan_.cables.begin(), plan_.cables.end(), [&c](const auto& other) { return other.name == c.name; }));
  c.member = index;
  c.position = e.position;
  c.anchor = e.anchor;
  c.stiffness = e.stiffness;
  c.pretension = e.pretension;
  c.strength = e.strength;
  plan_.cables.push_back(c);
  Builder builder(std::move(built_), plan_, *k_, map_);
  builder.connect_cable(plan_.cables.back());
  built_ = std::move(static_cast<BuilderState&>(builder));
  if (!built_.complaints.empty()) throw InputError("E932", built_.complaints.front().message);
  return fmt::format("cable {} from {} pulls with {:.3g} kN", c.name, m.name, e.pretension / unit::kN);
}

size_t LiveModel::count_own_cables() const {
  const auto is_added = [](const Applied& a) { return a.edit.kind == Edit::Kind::AddCable; };
  return plan_.cables.size() - static_cast<size_t>(std::count_if(applied_.begin(), applied_.end(), is_added));
}

bool LiveModel::has_added_cable(const std::string& name) const {
  return std::any_of(plan_.cables.begin() + static_cast<std::ptrdiff_t>(count_own_cables()), plan_.cables.end(),
                     [&name](const product::Cable& c) { return c.name == name; });
}

bool LiveModel::lets_go(const std::string& cable) const {
  return std::find(cables_off_.begin(), cables_off_.end(), cable) != cables_off_.end();
}

std::string LiveModel::remove_cable(const Edit& e, double time, double next) {
  std::vector<mbs::Cable>& cables = built_.model.cables;
  for (size_t i = 0; i < cables.size(); ++i) {
    if (cables[i].name != e.cable) continue;
    if (lets_go(e.cable)) throw InputError("E931", "cable \"" + e.cable + "\" is let go already");
    cables_off_.push_back(e.cable);
    constexpr double nothing = 1e-6;  // [N/m]
    if (time <= 0 && has_added_cable(e.cable)) cables[i].pretension = 0, cables[i].stiffness = nothing;
    Extra x;
    x.event.time = next;
    x.event.name = "cable " + e.cable + " let go";
    mbs::Action act;
    act.kind = mbs::Action::Kind::ReleaseCable;
    act.cable = static_cast<int>(i);
    x.event.actions.push_back(act);
    x.entry.time = next;
    x.entry.member = e.cable;
    x.entry.note = "cable " + e.cable + " is let go";
    extras_.push_back(x);
    return x.entry.note;
  }
  std::vector<std::string> known;
  for (const mbs::Cable& c : cables)
    if (!lets_go(c.name)) known.push_back(c.name);
  const std::string near = nearest_name(e.cable, known);
  throw InputError("E920", "there is no cable \"" + e.cable + "\" that holds",
                   near.empty() ? "" : "did you mean \"" + near + "\"?");
}

std::string LiveModel::set_friction(const Edit& e) {
  demand(e.ground || e.bodies, "set_friction wants ground, bodies or both");
  const auto check = [](const std::optional<double>& x, const char* what) {
    if (x) demand(*x >= 0 && *x <= 2, std::string(what) + " must be 0 to 2");
  };
  check(e.ground, "ground"), check(e.bodies, "bodies");
  mbs::Contact& c = built_.model.contact;
  std::string text = "friction";
  if (e.ground) {
    c.friction = plan_.ground.friction = *e.ground;
    text += fmt::format(" of the ground {:g}", *e.ground);
  }
  if (e.bodies) {
    c.body_friction = *e.bodies;
    text += fmt::format("{} of the parts {:g}", e.ground ? "," : "", *e.bodies);
  }
  return text;
}

}  // namespace topple::collapse
