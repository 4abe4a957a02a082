#include "collapse/recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <span>
#include <type_traits>

#include "base/disjoint_sets.h"
#include "base/interpolate.h"
#include "base/rotation_fit.h"
#include "base/unit.h"
#include "mbs/zone.h"
#include "record/told.h"

namespace topple::collapse {

namespace {

constexpr size_t kMostContacts = 300;  // events of parts hitting each other kept in a record
constexpr double kLeastSpeed = 0.5;    // of a contact that is worth an event [m/s]

}  // namespace

MeanForce find_largest_mean(const std::vector<double>& time, const std::vector<double>& impulse) {
  MeanForce out;
  if (time.size() < 2) return out;
  out.window = std::min(kForceWindow, time.back() - time.front());
  constexpr double rounding = 1e-9;  // [s]
  // straight lines: the largest mean begins or ends at one of the times
  for (const double t : time)
    for (const double begin : {t - out.window, t}) {
      if (begin < time.front() - rounding || begin + out.window > time.back() + rounding) continue;
      const double change = interpolate(time, impulse, begin + out.window) - interpolate(time, impulse, begin);
      if (change / out.window > out.force) out.force = change / out.window, out.time = begin + 0.5 * out.window;
    }
  // on one straight line: of the whole interval
  const size_t i = static_cast<size_t>(std::upper_bound(time.begin(), time.end(), out.time) - time.begin());
  if (i > 0 && i < time.size() && time[i] - time[i - 1] > out.window) {
    out.window = time[i] - time[i - 1];
    out.time = 0.5 * (time[i] + time[i - 1]);
  }
  return out;
}

Recorder::Recorder(const mbs::Model& model, const ModelMap& map, const Knowledge& k, record::Record& record,
                   const RunCallbacks& callbacks)
    : model_(model), map_(map), k_(k), record_(record), callbacks_(callbacks), block_(map.structures.size()) {
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    record::BodyInfo info;
    info.name = map.bodies[b].name;
    info.kind = map.bodies[b].kind;
    info.storey = map.bodies[b].storey;
    info.mass = model.bodies[b].mass;
    info.fixed = model.bodies[b].fixed;
    info.shapes = map.bodies[b].shapes;
    if (map.bodies[b].structure < 0) info.belongs = record::Belonging::Beside;
    record.bodies.push_back(std::move(info));
  }
  for (size_t d = 0; d < map.debris.size(); ++d) {
    record::BodyInfo info;
    int piece = 1;
    for (size_t e = 0; e < d; ++e) piece += map.debris[e].member == map.debris[d].member;
    info.name = map.debris[d].member + "/debris" + (piece > 1 ? std::to_string(piece) : "");
    info.kind = "debris";
    info.storey = map.debris[d].storey;
    info.mass = map.debris[d].mass;
    info.shapes.push_back({{{}, exp_rotation({0, 0, map.debris[d].turn})}, map.debris[d].half, "concrete"});
    record.bodies.push_back(std::move(info));
  }
  for (const auto* list : {&map.elements, &map.rotationals})
    for (const ZoneEntry& z : *list) record.zones.push_back({z.name, z.member, z.subsystem, z.body_a, z.body_b, z.p_W});
  for (size_t j = 0; j < model.joints.size(); ++j) {
    if (model.joints[j].kind != mbs::Joint::Kind::Fixed) continue;
    fixed_joints_.push_back(static_cast<int>(j));
    const ZoneEntry& z = map.joints[j];
    record.zones.push_back({z.name, z.member, z.subsystem, z.body_a, z.body_b, z.p_W});
  }
  find_crushed_ends();
  record.series = {{"tilt_angle", "Tilt angle", "rad", "angle", {}},
                   {"ground_force", "Force at the instant of each frame", "N", "force", {}},
                   {"mass_centre_height", "Height of the mass centre", "m", "height", {}},
                   {"energy_kinetic", "Kinetic", "J", "energy", {}},
                   {"energy_gravity", "Potential", "J", "energy", {}},
                   {"energy_elastic", "Elastic", "J", "energy", {}},
                   {"energy_contact", "Stored in contacts", "J", "energy", {}},
                   {"energy_plastic", "Dissipated in zones", "J", "energy", {}},
                   {"energy_damping", "Dissipated by damping", "J", "energy", {}},
                   {"energy_friction", "Dissipated by friction", "J", "energy", {}},
                   {"energy_contact_loss", "Dissipated by impact", "J", "energy", {}},
                   {"energy_removed", "Taken away with debris", "J", "energy", {}},
                   {"energy_residual", "Error of the balance", "J", "energy", {}},
                   {"broken_zones", "Broken zones and joints", "1", "count", {}},
                   {"connected_share", "Connected share of the upper block", "1", "share", {}}};
  for (const mbs::Cable& c : model.cables) record.series.push_back({"cable_" + c.name, c.name, "N", "cable", {}});
  if (!model.loads.empty()) record.series.push_back({"energy_loads", "Work of loads", "J", "energy", {}});
}

namespace {

record::CrushedEnd end_of(const mbs::CrushedBox& box) { return {box.body, box.shape, box.axis, box.end}; }

}  // namespace

void Recorder::find_crushed_ends() {
  for (size_t e = 0; e < model_.elements.size(); ++e) {
    const mbs::ZoneElement& element = model_.elements[e];
    if (!(element.crush_through > 0)) continue;
    std::vector<double> stations;
    for (const mbs::Station& s : element.stations) stations.push_back(s.x);
    for (const bool is_b : {false, true}) {
      const mbs::BodyId id = is_b ? element.b : element.a;
      if (id == mbs::kGround) continue;
      const size_t b = static_cast<size_t>(id.index);
      const std::vector<mbs::Shape>& modelled = model_.bodies[b].shapes;
      // what is drawn as a box must be one
      if (std::any_of(modelled.begin(), modelled.end(), [](auto& s) { return s.kind != mbs::Shape::Kind::Box; }))
        continue;
      std::vector<mbs::Shape> drawn;
      for (const record::BoxShape& s : map_.bodies[b].shapes)
        drawn.push_back({mbs::Shape::Kind::Box, s.X_BS, s.half, 0, {}});
      const size_t first = crushed_.size();
      mbs::find_crushed_boxes(static_cast<int>(e), is_b ? element.X_BM : element.X_AF, is_b, stations, drawn, crushed_);
      for (mbs::CrushedBox& box : std::span(crushed_).subspan(first)) box.body = id.index;
    }
  }
  std::stable_sort(crushed_.begin(), crushed_.end(), [](auto& a, auto& b) { return end_of(a) < end_of(b); });
  for (const mbs::CrushedBox& box : crushed_) record_.crushed_ends.push_back(end_of(box));
}

void Recorder::let_ends_recede(const mbs::View& v) {
  if (v.crushed.empty()) return;  // finite elements have no members
  const auto is_same_shape = [](const mbs::CrushedBox& a, const mbs::CrushedBox& b) {
    return a.body == b.body && a.shape == b.shape && a.axis == b.axis;
  };
  for (size_t i = 0; i < crushed_.size(); ++i) {
    mbs::CrushedBox& box = crushed_[i];
    const size_t e = static_cast<size_t>(box.element);
    const double wanted = v.crushed[e][model_.elements[e].b.index == box.body ? 1 : 0] - box.begin;
    if (!(wanted > box.taken)) continue;
    // what other ends of the box have left of it
    double most = box.most;
    for (size_t k = i; k-- > 0 && is_same_shape(crushed_[k], box);) most -= crushed_[k].taken;
    for (size_t k = i + 1; k < crushed_.size() && is_same_shape(crushed_[k], box); ++k) most -= crushed_[k].taken;
    box.taken = std::max(box.taken, std::min(wanted, most));
  }
}

void Recorder::take_crushed_ends(const Recorder& from, double until) {
  const std::vector<double>& time = from.record_.time;
  const auto frames = static_cast<size_t>(std::upper_bound(time.begin(), time.end(), until) - time.begin());
  const size_t C = from.crushed_.size();
  size_t row = 0;
  for (mbs::CrushedBox& box : crushed_) {
    while (row < C && end_of(from.crushed_[row]) < end_of(box)) ++row;
    if (row == C || end_of(box) < end_of(from.crushed_[row])) continue;
    box.taken = from.last_time_ <= until ? from.crushed_[row].taken
                : frames > 0             ? from.record_.crushed_length[(frames - 1) * C + row]
                                         : 0;
    ++row;
  }
}

const ZoneEntry& Recorder::entry_of(int element) const {
  const size_t i = static_cast<size_t>(element);
  return i < map_.elements.size() ? map_.elements[i] : map_.rotationals[i - map_.elements.size()];
}

const StubEntry* Recorder::find_crushed_stub(size_t zone, const mbs::View& v) const {
  const mbs::ElementState state = v.element_state[zone];
  if (zone < model_.elements.size() || state < mbs::ElementState::Yielded || state > mbs::ElementState::Softening)
    return nullptr;
  for (const StubEntry& s : map_.stubs)
    if (s.zone == static_cast<int>(zone) && s.time <= v.time && v.shortening[zone] > s.peak) return &s;
  return nullptr;
}

std::vector<BlockFrame> Recorder::calc_blocks(const mbs::View& v) {
  const size_t B = model_.bodies.size(), S = map_.structures.size();
  std::vector<BlockFrame> out(S);
  DisjointSets linked(B);
  const auto is_upper = [&](int b) { return b >= 0 && map_.bodies[static_cast<size_t>(b)].is_upper; };
  const auto centre_of = [&](size_t b) { return v.centre.size() == B ? v.centre[b] : v.X_WB[b].p; };
  // where the body had at the start what is its mass centre now
  const auto start_of = [&](size_t b) {
    return start_[b] * transpose_times(to_matrix(v.X_WB[b].q), centre_of(b) - v.X_WB[b].p);
  };
  const auto link = [&](mbs::BodyId a, mbs::BodyId b) {
    if (is_upper(a.index) && is_upper(b.index)) linked.join(a.index, b.index);
  };
  for (size_t e = 0; e < model_.elements.size(); ++e)
    if (v.element_state[e] < mbs::ElementState::Broken) link(model_.elements[e].a, model_.elements[e].b);
  for (size_t j = 0; j < model_.joints.size(); ++j)
    if (!v.joint_released[j]) link(model_.joints[j].parent, model_.joints[j].child);
  std::vector<double> group(B, 0);
  std::vector<double> upper(S, 0), moving(S, 0), apart(S, 0);
  std::vector<bool> has_come_down(B, false);
  if (apart_since_.empty()) apart_since_.assign(B, std::numeric_limits<double>::infinity());
  is_of_block_.assign(B, 0);
  const auto is_apart = [this](size_t b) { return std::isfinite(apart_since_[b]); };
  double beside = 0, beside_moved = 0;
  const double share = k_.mechanism_moved_displacement;
  for (size_t b = 0; b < B; ++b) {
    if (model_.bodies[b].fixed) continue;
    // a shaft has no storeys
    const bool has_storeys = map_.bodies[b].kind != "shaft" && map_.ground_storey_height > 0;
    const double far = share * (has_storeys ? map_.ground_storey_height : 1.0);
    const double m = v.mass[b];
    const double fall = start_[b].p.z - v.X_WB[b].p.z;
    const bool has_moved = norm(v.X_WB[b].p - start_[b].p) > far;
    // what is low cannot fall far: half of its height, or it has turned over
    const auto has_turned_over = [&] {
      return to_matrix(v.X_WB[b].q * conjugate(start_[b].q))(2, 2) < std::cos(k_.mechanism_topple_rotation);
    };
    const bool is_down = has_moved && (fall > std::min(far, 0.5 * start_[b].p.z) || has_turned_over());
    if (map_.bodies[b].structure < 0) {
      beside += m;
      if (is_down) beside_moved += m;
      continue;
    }
    const size_t s = static_cast<size_t>(map_.bodies[b].structure);
    BlockFrame& f = out[s];
    moving[s] += m;
    f.centre += m * centre_of(b);
    if (has_moved) f.moved += m;
    if (is_down) f.down += m;
    if (!map_.bodies[b].is_upper) continue;
    has_come_down[b] = is_down;
    f.fastest = std::max(f.fastest, norm(v.v_WB[b]));
    if (is_apart(b)) {
      apart[s] += m;
      continue;
    }
    upper[s] += m;
    group[static_cast<size_t>(linked.find(static_cast<int>(b)))] += m;
    const double turn = calc_tilt(v.X_WB[b].q * conjugate(start_[b].q), map_.fall_direction);
    if (turn > k_.mechanism_fold_rotation) f.forward += m;
    if (turn < -k_.mechanism_fold_rotation) f.backward += m;
    const double aside = calc_tilt(v.X_WB[b].q * conjugate(start_[b].q), cross({0, 0, 1}, map_.fall_direction));
    if (aside > k_.mechanism_fold_rotation) f.left += m;
    if (aside < -k_.mechanism_fold_rotation) f.right += m;
  }
  for (size_t s = 0; s < S; ++s) {
    BlockFrame& f = out[s];
    f.time = v.time;
    if (beside > 0) f.beside = beside_moved / beside;
    if (moving[s] > 0) {
      f.centre *= 1 / moving[s];
      f.height = f.centre.z;
      f.moved = f.moved / moving[s];
      f.down = f.down / moving[s];
    }
    if (!(upper[s] > 0)) continue;
    f.forward = f.forward / upper[s];
    f.backward = f.backward / upper[s];
    f.left = f.left / upper[s];
    f.right = f.right / upper[s];
    size_t largest = B;
    for (size_t b = 0; b < B; ++b)
      if (group[b] > 0 && map_.bodies[b].structure == static_cast<int>(s) &&
          (largest == B || group[b] > group[largest]))
        largest = b;
    f.connected = group[largest] / upper[s];
    f.apart = apart[s] / (upper[s] + apart[s]);
    const auto find_motion = [&](double mass, auto belongs) {
      std::vector<FitBody> bodies;
      BlockFrame::Motion motion;
      for (size_t b = 0; b < B; ++b) {
        if (!is_upper(static_cast<int>(b)) || is_apart(b) || !belongs(static_cast<int>(b))) continue;
        bodies.push_back({v.mass[b], model_.bodies[b].inertia, start_[b], v.X_WB[b]});
        motion.displacement += v.mass[b] * (centre_of(b) - start_of(b));
        motion.above += v.mass[b] * start_of(b).z;
      }
      motion.rotation = fit_rotation(bodies);
      motion.displacement *= 1 / mass;
      motion.above /= mass;
      return motion;
    };
    const BlockFrame::Motion block =
        find_motion(group[largest], [&](int b) { return linked.find(b) == static_cast<int>(largest); });
    f.rotation = block.rotation, f.displacement = block.displacement, f.above = block.above;
    f.pieces = f.connected == 1 ? block : find_motion(upper[s], [&](int b) {
      return map_.bodies[static_cast<size_t>(b)].structure == static_cast<int>(s);
    });
    f.standing = f.pieces.displacement;
    f.in_place = 0;
    std::vector<Vec3> moment(B);  // of each piece: mass times displacement
    for (size_t b = 0; b < B; ++b)
      if (is_upper(static_cast<int>(b)) && !is_apart(b) && map_.bodies[b].structure == static_cast<int>(s))
        moment[static_cast<size_t>(linked.find(static_cast<int>(b)))] += v.mass[b] * (centre_of(b) - start_of(b));
    Vec3 sum;
    for (size_t b = 0; b < B; ++b) {
      if (!(group[b] > 0) || map_.bodies[b].structure != static_cast<int>(s)) continue;
      BlockFrame piece;
      piece.height = f.height, piece.displacement = (1 / group[b]) * moment[b];
      if (calc_away(piece, k_) < 1) f.in_place += group[b], sum += moment[b];
    }
    if (f.in_place >= k_.mechanism_coherent_share * upper[s]) f.standing = (1 / f.in_place) * sum;
    f.in_place /= upper[s];
    // what comes down and lands while the rest stands has fallen off: it is no part of how that falls
    const bool has_landed = std::any_of(touchdowns_.begin(), touchdowns_.end(), [&](const Touchdown& t) {
      return is_upper(t.body) && map_.bodies[static_cast<size_t>(t.body)].structure == static_cast<int>(s);
    });
    const bool stands = has_landed && -f.displacement.z < k_.stands_displacement &&
                        group[largest] >= k_.mechanism_coherent_share * (upper[s] + apart[s]);
    const bool is_in_pieces = f.connected < k_.mechanism_coherent_share;
    for (size_t b = 0; b < B; ++b) {
      if (!is_upper(static_cast<int>(b)) || is_apart(b) || map_.bodies[b].structure != static_cast<int>(s)) continue;
      const bool is_in_largest = linked.find(static_cast<int>(b)) == static_cast<int>(largest);
      is_of_block_[b] = is_in_largest || is_in_pieces;
      if (stands && !is_in_largest && has_come_down[b]) apart_since_[b] = v.time, is_of_block_[b] = 0;
    }
  }
  return out;
}

std::vector<BlockFrame> Recorder::farthest_block_frames(const std::vector<bool>& counts) const {
  std::vector<BlockFrame> out;
  for (size_t s = 0; s < block_.size(); ++s) {
    if (!counts.empty() && !counts[s]) continue;
    if (out.empty()) {
      out = block_[s];
      continue;
    }
    for (size_t i = 0; i < out.size(); ++i) {
      const BlockFrame& other = block_[s][i];
      const double fastest = std::max(out[i].fastest, other.fastest);
      if (calc_away(other, k_) > calc_away(out[i], k_)) out[i] = other;
      out[i].fastest = fastest;
    }
  }
  return out;
}

std::vector<double> Recorder::upper_touchdowns(size_t structure, bool of_block) const {
  std::vector<double> times;
  for (const Touchdown& t : touchdowns_) {
    const BodyEntry& body = map_.bodies[static_cast<size_t>(t.body)];
    if (body.is_upper && body.structure == static_cast<int>(structure) && (t.is_of_block || !of_block))
      times.push_back(t.time);
  }
  std::sort(times.begin(), times.end());
  return times;
}

void Recorder::put_pose(const Pose& X) {
  for (double c : {X.p.x, X.p.y, X.p.z}) record_.position.push_back(static_cast<float>(c));
  for (double c : {X.q.w, X.q.x, X.q.y, X.q.z}) record_.orientation.push_back(static_cast<float>(c));
}

Pose calc_debris_pose(const DebrisEntry& d, double gravity, double time) {
  const double t = std::max(0.0, time - d.time);
  Vec3 p = d.centre;
  p.z = std::max(std::min(p.z, d.half.z), p.z - 0.5 * gravity * t * t);
  return {p, {}};
}

void Recorder::put_crushed_ends() {
  for (const mbs::CrushedBox& box : crushed_) record_.crushed_length.push_back(static_cast<float>(box.taken));
}

void Recorder::put_debris(double time) {
  for (const DebrisEntry& d : map_.debris) put_pose(calc_debris_pose(d, norm(model_.gravity), time));
}

void Recorder::look(const mbs::View& v) {
  // what changes the momentum of the masses that are there now, but for their weight
  if (last_v_.size() == model_.bodies.size())
    for (size_t b = 0; b < model_.bodies.size(); ++b)
      if (!model_.bodies[b].fixed)
        impulse_until_now_ +=
            v.mass[b] * dot(v.v_WB[b] - last_v_[b] - (v.time - last_time_) * model_.gravity, model_.contact.normal);
  last_time_ = v.time;
  last_v_ = v.v_WB;
  shortening_ = v.shortening;
  let_ends_recede(v);
}

void Recorder::follow(const Recorder& before, double until) {
  start_ = before.start_;
  take_crushed_ends(before, until);
  reaction_error_ = before.reaction_error_;
  for (const auto& told : before.stages_told_)
    if (told.first <= until) stages_told_.push_back(told);
  for (const double t : before.contacts_told_)
    if (t <= until) contacts_told_.push_back(t);
  constexpr double rounding = 1e-9;  // [s]
  const std::vector<double>& times = before.record_.time;
  const auto Z = static_cast<std::ptrdiff_t>(before.record_.zones.size()),
             frame = std::upper_bound(times.begin(), times.end(), until + rounding) - times.begin() - 1;
  states_before_ = before.states_before_;
  if (frame >= 0 && Z > 0) {
    const auto first = before.record_.zone_state.begin() + frame * Z;
    states_before_.assign(first, first + Z);
  }
  if (before.last_time_ <= until) {
    last_time_ = before.last_time_;
    last_v_ = before.last_v_;
    shortening_ = before.shortening_;
    impulse_until_now_ = before.impulse_until_now_;
    is_of_block_ = before.is_of_block_;
  } else if (!before.impulse_.empty()) {
    impulse_until_now_ = interpolate(before.record_.time, before.impulse_, until);
  }
  for (const Touchdown& t : before.touchdowns_)
    if (t.time <= until) touchdowns_.push_back(t);
  if (before.first_.time <= until) first_ = before.first_;
  apart_since_ = before.apart_since_;
  for (double& since : apart_since_)
    if (since > until) since = std::numeric_limits<double>::infinity();
}

void Recorder::append(const Recorder& from, size_t frames, double until) {
  stages_told_.clear();
  contacts_told_.clear();
  touchdowns_.clear();
  follow(from, until);
  const record::Record& r = from.record_;
  const size_t B = model_.bodies.size(), stride = r.bodies.size(), Z = record_.zones.size();
  for (size_t i = 0; i < frames; ++i) {
    record_.time.push_back(r.time[i]);
    const auto p = r.position.begin() + static_cast<std::ptrdiff_t>(3 * i * stride);
    const auto q = r.orientation.begin() + static_cast<std::ptrdiff_t>(4 * i * stride);
    record_.position.insert(record_.position.end(), p, p + static_cast<std::ptrdiff_t>(3 * B));
    record_.orientation.insert(record_.orientation.end(), q, q + static_cast<std::ptrdiff_t>(4 * B));
    put_debris(r.time[i]);
  }
  const auto copy = [](auto& to, const auto& source, size_t n) {
    to.insert(to.end(), source.begin(), source.begin() + static_cast<std::ptrdiff_t>(n));
  };
  for (size_t i = 0; i < frames; ++i) {
    take_crushed_ends(from, r.time[i]);
    put_crushed_ends();
  }
  take_crushed_ends(from, until);
  copy(record_.zone_state, r.zone_state, frames * Z);
  copy(record_.zone_utilisation, r.zone_utilisation, frames * Z);
  for (record::Series& s : record_.series) {
    const auto same = std::find_if(r.series.begin(), r.series.end(), [&](const auto& o) { return o.id == s.id; });
    if (same != r.series.end())
      copy(s.value, same->value, frames);
    else  // a cable that came later
      s.value.resize(s.value.size() + frames, std::numeric_limits<double>::quiet_NaN());
  }
  for (size_t s = 0; s < block_.size(); ++s) copy(block_[s], from.block_[s], frames);
  copy(zone_frames_, from.zone_frames_, frames);
  copy(impulse_, from.impulse_, frames);
  if (keeps_speeds_) {
    copy(speeds_.velocity, from.speeds_.velocity, 3 * frames * B);
    copy(speeds_.spin, from.speeds_.spin, 3 * frames * B);
  }
  for (const record::Event& e : r.events)
    if (e.time <= until) record_.events.push_back(e);
}

namespace {

template <class Io, class Events>
void pass_events(Io& io, Events& events) {
  size_t count = events.size();
  io(count);
  if constexpr (!std::is_const_v<Events>) events.resize(count);
  for (auto& e : events) io(e.time), io(e.kind), io(e.subject), io(e.text);
}

}  // namespace

template <class Io, class R>
void Recorder::pass(Io& io, R& r) {
  auto& record = r.record_;
  io(record.time), io(record.position), io(record.orientation), io(record.zone_state), io(record.zone_utilisation),
      io(record.crushed_length);
  for (auto& s : record.series) io(s.value);
  for (auto& o : record.outputs) io(o.time), io(o.value);
  pass_events(io, record.events), pass_events(io, r.coming_);
  io(r.start_), io(r.block_), io(r.zone_frames_), io(r.shortening_), io(r.crushed_), io(r.stages_told_), io(r.last_v_),
      io(r.last_time_), io(r.touchdowns_), io(r.first_), io(r.speeds_.velocity), io(r.speeds_.spin),
      io(r.reaction_error_), io(r.impulse_until_now_), io(r.impulse_), io(r.contacts_told_), io(r.states_before_),
      io(r.apart_since_), io(r.is_of_block_);
}

void Recorder::write(ArchiveWriter& out) const { pass(out, *this); }
void Recorder::read(ArchiveReader& in) { pass(in, *this); }

void Recorder::add_frame(const mbs::View& v) {
  // an engine may show the last state twice
  if (!record_.time.empty() && v.time <= record_.time.back()) return;
  const size_t B = model_.bodies.size();
  if (start_.empty()) {
    start_ = v.X_WB;
    double weight = 0;
    for (size_t b = 0; b < B; ++b)
      if (!model_.bodies[b].fixed) weight += model_.bodies[b].mass * norm(model_.gravity);
    reaction_error_ = weight > 0 ? std::abs(norm(v.ground_force) - weight) / weight : 0;
  }
  record_.time.push_back(v.time);
  for (size_t b = 0; b < B; ++b) put_pose(v.X_WB[b]);
  put_debris(v.time);

  ZoneFrame zf;
  zf.time = v.time;
  const size_t E = model_.elements.size(), n = E + model_.rotational_elements.size();
  for (size_t i = 0; i < n; ++i) {
    const bool fired = entry_of(static_cast<int>(i)).firing_time <= v.time;
    record::ZoneState state = record::ZoneState::Elastic;
    switch (v.element_state[i]) {
      case mbs::ElementState::Elastic:
        state = record::ZoneState::Elastic;
        break;
      case mbs::ElementState::Yielded:
        state = record::ZoneState::Yielded;
        break;
      case mbs::ElementState::Softening:
        state = record::ZoneState::Softening;
        break;
      case mbs::ElementState::Broken:
        state = record::ZoneState::Broken;
        break;
      case mbs::ElementState::Removed:
        state = record::ZoneState::Fired;
        break;
    }
    if (fired) state = record::ZoneState::Fired;
    if (const StubEntry* stub = find_crushed_stub(i, v)) {
      state = record::ZoneState::Crushed;
      const size_t frames = zone_frames_.size(), Z = record_.zones.size();
      const auto was = frames > 0                  ? record_.zone_state[(frames - 1) * Z + i]
                       : i < states_before_.size() ? states_before_[i]
                                                   : static_cast<std::uint8_t>(record::ZoneState::Elastic);
      if (was != static_cast<std::uint8_t>(state))
        add_event({v.time, "crushing", stub->member, fmt::format("the stub of {} is being crushed", stub->member)});
    }
    record_.zone_state.push_back(static_cast<std::uint8_t>(state));
    // what has yielded gives way at its limit: above 1 is how far that fell in the last step, as far as it likes near
    // zero
    const double use = state == record::ZoneState::Elastic ? v.utilisation[i] : std::min(v.utilisation[i], 1.0);
    record_.zone_utilisation.push_back(static_cast<float>(use));
    zf.broken += state == record::ZoneState::Broken;
    zf.yielded += state == record::ZoneState::Yielded || state == record::ZoneState::Softening;
    if (state < record::ZoneState::Broken && use > zf.utilisation) {
      zf.utilisation = use;
      zf.zone = static_cast<int>(i);
    }
  }
  for (size_t f = 0; f < fixed_joints_.size(); ++f) {
    const size_t j = static_cast<size_t>(fixed_joints_[f]);
    const mbs::Joint& joint = model_.joints[j];
    const Vec3 r = v.joint_force[j];
    const double u = v.joint_released[j]
                         ? 0
                         : std::max({-r.x / joint.tension_limit, std::hypot(r.y, r.z) / joint.shear_limit,
                                     norm(v.joint_moment[j]) / joint.moment_limit, 0.0});
    record_.zone_state.push_back(
        static_cast<std::uint8_t>(v.joint_released[j] ? record::ZoneState::Broken : record::ZoneState::Elastic));
    record_.zone_utilisation.push_back(static_cast<float>(u));
    zf.broken += v.joint_released[j];
    if (u > zf.utilisation) {
      zf.utilisation = u;
      zf.zone = static_cast<int>(n + f);
    }
  }
  zone_frames_.push_back(zf);
  if (keeps_speeds_)
    for (size_t b = 0; b < B; ++b) {
      const Vec3 lever = v.centre.size() == B ? v.X_WB[b].p - v.centre[b] : Vec3{};
      const Vec3 velocity = v.v_WB[b] + cross(v.w_WB[b], lever);
      for (const double c : {velocity.x, velocity.y, velocity.z}) speeds_.velocity.push_back(static_cast<float>(c));
      for (const double c : {v.w_WB[b].x, v.w_WB[b].y, v.w_WB[b].z}) speeds_.spin.push_back(static_cast<float>(c));
    }
  look(v);
  impulse_.push_back(impulse_until_now_);
  put_crushed_ends();

  const std::vector<BlockFrame> blocks = calc_blocks(v);
  for (size_t s = 0; s < block_.size(); ++s) block_[s].push_back(blocks[s]);
  const BlockFrame& block = blocks.front();
  const mbs::Energy& e = v.energy;
  const double ground_force = dot(v.ground_force, model_.contact.normal);
  // in the order of the list that the constructor makes
  const double values[] = {calc_tilt(block.rotation, map_.fall_direction),
                           ground_force,
                           block.height,
                           e.kinetic,
                           e.gravity,
                           e.elastic,
                           e.contact,
                           e.plastic,
                           e.damping,
                           e.friction,
                           e.contact_loss,
                           e.removed,
                           e.residual,
                           static_cast<double>(zf.broken),
                           block.connected};
  for (size_t i = 0; i < std::size(values); ++i) series(i).value.push_back(values[i]);
  for (size_t i = 0; i < model_.cables.size(); ++i) series(std::size(values) + i).value.push_back(v.cable_force[i]);
  if (!model_.loads.empty()) record_.series.back().value.push_back(e.loads);
}

void Recorder::add_event(record::Event event) {
  tell_coming(event.time);
  record::add_event(record_, std::move(event));
  if (callbacks_.on_event) callbacks_.on_event(record_.events.back());
}

void Recorder::add_coming_event(record::Event event) {
  const auto at = std::upper_bound(coming_.begin(), coming_.end(), event,
                                   [](const record::Event& a, const record::Event& b) { return a.time < b.time; });
  coming_.insert(at, event);
  record::add_event(record_, std::move(event));
}

void Recorder::tell_coming(double until) {
  const auto end = std::find_if(coming_.begin(), coming_.end(), [&](const auto& e) { return e.time > until; });
  if (callbacks_.on_event) std::for_each(coming_.begin(), end, callbacks_.on_event);
  coming_.erase(coming_.begin(), end);
}

void Recorder::add_happening(const mbs::Happening& h) {
  using Kind = mbs::Happening::Kind;
  const auto body = [&](int b) { return b < 0 ? std::string("the ground") : map_.bodies[static_cast<size_t>(b)].name; };
  switch (h.kind) {
    case Kind::EventFired: {
      const mbs::Event& event = model_.events[static_cast<size_t>(h.index)];
      if (map_.events.empty()) {
        const std::string name = event.name.empty() ? fmt::format("event {}", h.index) : event.name;
        add_event({h.time, "charge", name, fmt::format("{} at {:.3f} s", name, h.time)});
        break;
      }
      const EventEntry& entry = map_.events[static_cast<size_t>(h.index)];
      if (entry.is_aftermath) break;
      if (!entry.note.empty()) {
        add_event({h.time, "edit", entry.member, entry.note});
        break;
      }
      if (std::none_of(stages_told_.begin(), stages_told_.end(),
                       [&entry](const auto& told) { return told.second == entry.stage; })) {
        stages_told_.emplace_back(h.time, entry.stage);
        add_event({h.time, "stage", map_.stages[static_cast<size_t>(entry.stage)],
                   map_.stages[static_cast<size_t>(entry.stage)]});
      }
      add_event(
          {h.time, "charge", entry.member,
           entry.kept > 0
               ? fmt::format("{} fired, {:.3g} % of its concrete stays", entry.member, 100 * entry.kept)
               : fmt::format("{} fired, {:.1f} t of concrete thrown out", entry.member, entry.debris_mass / unit::t)});
      break;
    }
    case Kind::ElementYielded: {
      const ZoneEntry& z = entry_of(h.index);
      if (z.firing_time <= h.time) break;  // the charge did that
      add_event({h.time, "yield", z.name, fmt::format("zone {} yields", z.name)});
      break;
    }
    case Kind::ElementSoftening: {
      const ZoneEntry& z = entry_of(h.index);
      if (z.firing_time <= h.time) break;
      add_event({h.time, "softening", z.name, fmt::format("zone {} softens", z.name)});
      break;
    }
    case Kind::ElementBroken: {
      const ZoneEntry& z = entry_of(h.index);
      if (h.reason == "removed") break;
      const size_t i = static_cast<size_t>(h.index);
      std::string how = "breaks";
      if (h.reason == "tension") how = "is torn apart";
      if (h.reason == "shear") how = "is sheared off";
      if (h.reason == "torsion") how = "is twisted off";
      // lengths are those of the law that rules, which the zone has just reached
      const bool has_law = i < model_.elements.size() && !model_.elements[i].stations.empty();
      if (h.reason == "crushing") {
        how = "is crushed";
        const auto switches = [&](const mbs::Event& e) {
          return !(e.time > h.time) && std::any_of(e.actions.begin(), e.actions.end(), [i](const mbs::Action& a) {
            return a.kind == mbs::Action::Kind::SwitchLaw && a.element.index == static_cast<int>(i);
          });
        };
        if (has_law && std::min(z.firing_time, z.weakening_time) > h.time &&
            std::none_of(model_.events.begin(), model_.events.end(), switches)) {
          const mbs::ZoneElement& e = model_.elements[i];
          const mbs::ZoneLaw& law = model_.laws[static_cast<size_t>(e.stations.front().law.index)];
          const double u = mbs::calc_crush_length(e.crush_through, law);
          if (std::isfinite(u)) how = fmt::format("is crushed (shortening {:.2f} m)", u);
        }
      }
      if (h.reason == "rotation") how = "breaks by rotation";
      add_event({h.time, "rupture", z.name, fmt::format("zone {} {}", z.name, how)});
      break;
    }
    case Kind::JointReleased: {
      const ZoneEntry& z = map_.joints[static_cast<size_t>(h.index)];
      add_event({h.time, "release", z.name, fmt::format("joint {} comes off ({})", z.name, h.reason)});
      break;
    }
    case Kind::CableBroken: {
      const std::string name = model_.cables[static_cast<size_t>(h.index)].name;
      add_event({h.time, "cable", name, fmt::format("cable {} breaks", name)});
      break;
    }
    case Kind::SpringBroken: {
      const std::string name = model_.springs[static_cast<size_t>(h.index)].name;
      add_event({h.time, "rupture", name, fmt::format("spring {} breaks ({})", name, h.reason)});
      break;
    }
    case Kind::RotationalSpringBroken: {
      const std::string name = model_.rotational_springs[static_cast<size_t>(h.index)].name;
      add_event({h.time, "rupture", name, fmt::format("rotational spring {} breaks", name)});
      break;
    }
    case Kind::BushingBroken: {
      const std::string name = model_.bushings[static_cast<size_t>(h.index)].name;
      add_event({h.time, "rupture", name, fmt::format("bushing {} breaks ({})", name, h.reason)});
      break;
    }
    case Kind::GroundContact: {
      const bool upper = map_.bodies[static_cast<size_t>(h.index)].is_upper;
      const mbs::Landing& with = h.landing;
      touchdowns_.push_back({h.time,
                             h.index,
                             {with.p_WB.x, with.p_WB.y},
                             h.speed,
                             with.energy,
                             with.momentum,
                             with.kinetic,
                             is_of_block_.empty()
                                 ? apart_since_.empty() || !std::isfinite(apart_since_[static_cast<size_t>(h.index)])
                                 : is_of_block_[static_cast<size_t>(h.index)] != 0});
      if (upper && !std::isfinite(first_.time)) first_ = touchdowns_.back();
      add_event(
          {h.time, "touchdown", body(h.index),
           fmt::format("{} touches the ground at {:.1f} m/s ({}, {})", body(h.index), h.speed,
                       record::tell_measure(with.energy, "J", 2), record::tell_measure(with.momentum, "N s", 2))});
      break;
    }
    case Kind::BodyContact:
      if (h.speed < kLeastSpeed || contacts_told_.size() >= kMostContacts) break;
      contacts_told_.push_back(h.time);
      add_event({h.time, "contact", body(h.index),
                 fmt::format("{} hits {} at {:.1f} m/s", body(h.index), body(h.other), h.speed)});
      break;
  }
}

void Recorder::finish() {
  tell_coming(std::numeric_limits<double>::infinity());
  std::stable_sort(record_.events.begin(), record_.events.end(),
                   [](const record::Event& a, const record::Event& b) { return a.time < b.time; });
}

namespace {

/// The box that stands for a shape where it is shown; none for a half-space.
std::optional<record::BoxShape> box_of(const mbs::Shape& s) {
  switch (s.kind) {
    case mbs::Shape::Kind::Box:
      return record::BoxShape{s.X_BS, s.half, "concrete"};
    case mbs::Shape::Kind::Sphere:
      return record::BoxShape{s.X_BS, {s.radius, s.radius, s.radius}, "concrete"};
    case mbs::Shape::Kind::Hull: {
      Vec3 low = s.vertices.front(), high = low;
      for (const Vec3& v : s.vertices)
        for (int k = 0; k < 3; ++k) {
          low[k] = std::min(low[k], v[k]);
          high[k] = std::max(high[k], v[k]);
        }
      return record::BoxShape{{s.X_BS * (0.5 * (low + high)), s.X_BS.q}, 0.5 * (high - low), "concrete"};
    }
    case mbs::Shape::Kind::Plane:
      break;
  }
  return std::nullopt;
}

const char* words_of(mbs::Joint::Kind kind) {
  using Kind = mbs::Joint::Kind;
  switch (kind) {
    case Kind::Fixed:
      return "rigid joint";
    case Kind::Revolute:
      return "revolute joint";
    case Kind::Spherical:
      return "spherical joint";
    case Kind::Universal:
      return "universal joint";
    case Kind::Prismatic:
      return "prismatic joint";
    case Kind::Cylindrical:
      return "cylindrical joint";
    case Kind::Distance:
      return "distance joint";
  }
  return "";
}

}  // namespace

ModelMap describe_model(const mbs::Model& model) {
  ModelMap map;
  std::set<std::string> names;
  const auto unique_name = [&names](const std::string& given, const char* kind, size_t i) {
    std::string name = given.empty() ? std::string(kind) + "-" + std::to_string(i) : given;
    if (!names.insert(name).second) names.insert(name += "#" + std::to_string(i));
    return name;
  };
  for (size_t b = 0; b < model.bodies.size(); ++b) {
    const mbs::Body& body = model.bodies[b];
    BodyEntry entry;
    entry.name = unique_name(body.name, "body", b);
    entry.kind = "body";
    entry.is_upper = !body.fixed;
    for (const mbs::Shape& s : body.shapes) {
      if (const auto box = box_of(s)) entry.shapes.push_back(*box);
    }
    map.mass += body.mass;
    if (!body.fixed) map.moving_mass += body.mass;
    map.bodies.push_back(std::move(entry));
  }
  const auto place = [&](mbs::BodyId id, const Pose& X) {
    return id == mbs::kGround ? X.p : model.bodies[static_cast<size_t>(id.index)].X_WB * X.p;
  };
  for (const mbs::ZoneElement& e : model.elements)
    map.elements.push_back({e.name, "", "six-component element", e.a.index, e.b.index, place(e.a, e.X_AF)});
  for (const mbs::Joint& j : model.joints)
    map.joints.push_back({j.name, "", words_of(j.kind), j.parent.index, j.child.index, place(j.parent, j.X_PF)});
  for (const mbs::RotationalElement& r : model.rotational_elements) {
    ZoneEntry z = map.joints[static_cast<size_t>(r.joint.index)];
    z.name = r.name;
    z.subsystem = "revolute joint + rotational element";
    map.rotationals.push_back(z);
  }
  return map;
}

}  // namespace topple::collapse
