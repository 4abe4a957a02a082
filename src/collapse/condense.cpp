#include "collapse/condense.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "collapse/builder.h"
#include "collapse/frequency_limit.h"

namespace topple::collapse {

namespace {

using product::Member;
using product::MemberKind;

/// Lengths are alike to a micrometre.
void append_length(std::string& to, double v) { append_bytes(to, std::round(1e6 * v)); }

/// What a member is, without its place along y.
std::string describe(const product::Plan& plan, size_t index) {
  const Member& m = plan.members[index];
  std::string key;
  for (const int v : {static_cast<int>(m.kind), m.storey, m.row_a, m.row_b, m.section, m.panel}) append_bytes(key, v);
  for (const double v : {m.start.x, m.end.x, m.start.z, m.end.z, m.height, m.end.y - m.start.y}) append_length(key, v);
  append_bytes(key, static_cast<double>(m.openings.size()));
  for (const product::Opening& o : m.openings)
    for (const double v : {o.left, o.sill, o.width, o.height}) append_length(key, v);
  append_bytes(key, static_cast<double>(m.weakenings.size()));
  for (const product::Weakening& w : m.weakenings)
    for (const double v : {w.at, w.cut_bars, w.cut_concrete}) append_length(key, v);
  for (size_t s = 0; s < plan.stages.size(); ++s)
    for (const product::Charge& c : plan.stages[s].charges)
      if (c.member == static_cast<int>(index))
        for (const double v : {static_cast<double>(s), c.position, c.destroyed_length, c.residual_bars,
                               c.residual_concrete, c.transition_damage, c.delay, c.scatter, c.fails ? 1.0 : 0.0})
          append_length(key, v);
  return key;
}

std::string join(std::vector<std::string>& list) {
  std::sort(list.begin(), list.end());
  std::string all;
  for (const std::string& s : list) {
    append_bytes(all, static_cast<double>(s.size()));
    all += s;
  }
  return all;
}

/// What spans from each frame to the next.
std::vector<std::string> describe_bays(const product::Plan& plan) {
  std::vector<std::vector<std::string>> spans(plan.frame_names.size());
  for (size_t i = 0; i < plan.members.size(); ++i) {
    const Member& m = plan.members[i];
    if (!m.removed && m.frame_a != m.frame_b)
      spans[static_cast<size_t>(std::min(m.frame_a, m.frame_b))].push_back(describe(plan, i));
  }
  std::vector<std::string> out;
  for (std::vector<std::string>& s : spans) out.push_back(join(s));
  return out;
}

/// Whether members join all columns with each other above the ground.
bool is_one_structure(const product::Plan& plan) {
  const auto F = static_cast<int>(plan.frame_names.size());
  DisjointSets joined(plan.row_names.size() * plan.frame_names.size());
  std::set<int> used;
  for (const Member& m : plan.members) {
    if (m.removed || m.kind == MemberKind::Shaft) continue;
    const int first = m.row_a * F + m.frame_a;
    for (const int at : {first, m.row_a * F + m.frame_b, m.row_b * F + m.frame_a, m.row_b * F + m.frame_b}) {
      joined.join_under_lower(first, at);
      used.insert(at);
    }
  }
  std::set<int> roots;
  for (const int at : used) roots.insert(joined.find(at));
  return roots.size() < 2;
}

/// What each frame is and carries; mirrored frames have the same text.
std::vector<std::string> describe_frames(const product::Plan& plan) {
  struct Parts {
    std::vector<std::string> own, side[2];
  };
  std::vector<Parts> parts(plan.frame_names.size());
  for (size_t i = 0; i < plan.members.size(); ++i) {
    const Member& m = plan.members[i];
    if (m.removed) continue;
    const size_t a = static_cast<size_t>(m.frame_a), b = static_cast<size_t>(m.frame_b);
    if (a == b) {
      parts[a].own.push_back(describe(plan, i));
    } else {
      parts[std::min(a, b)].side[1].push_back(describe(plan, i));
      parts[std::max(a, b)].side[0].push_back(describe(plan, i));
    }
  }
  std::vector<std::string> out;
  for (Parts& p : parts) {
    std::vector<std::string> sides{join(p.side[0]), join(p.side[1])};
    std::string text = join(p.own);
    append_bytes(text, static_cast<double>(text.size()));
    out.push_back(text + join(sides));
  }
  return out;
}

std::string find_refusal(const product::Plan& plan, const Knowledge& k) {
  ModelMap map;
  Builder builder(plan, k, map, 1);
  builder.find_direction();
  constexpr double along = 1e-3;  // [rad]
  if (std::abs(map.fall_direction.y) > along) return "the fall is not along the frames";
  if (!plan.cables.empty()) return "cables pull at single frames";
  if (!is_one_structure(plan)) return "parts of it stand apart";
  for (size_t i = 0; i < plan.members.size(); ++i) {
    const Member& m = plan.members[i];
    if (m.kind == MemberKind::Shaft && !m.removed) return m.name + " is a shaft";
    if (m.frame_a == m.frame_b || m.removed) continue;
    if (m.kind == MemberKind::Wall && m.storey == 0)
      return "wall " + m.name + " stands across the fall in the ground storey";
    for (const product::Stage& s : plan.stages)
      for (const product::Charge& c : s.charges)
        if (c.member == static_cast<int>(i)) return "a charge lies on " + m.name + ", between two frames";
  }
  return {};
}

mbs::SharedLaw scale(const mbs::SharedLaw& one, double n) {
  mbs::ZoneLaw law = *one;
  const auto all = [n](std::vector<double>& list) {
    for (double& v : list) v *= n;
  };
  for (mbs::MomentFamily* f : {&law.moment_y, &law.moment_z}) all(f->normal_force), all(f->positive), all(f->negative);
  all(law.compression.f), all(law.tension.f);
  law.shear_y *= n, law.shear_z *= n, law.torsion *= n;
  return law;
}

mbs::Cracking scale(mbs::Cracking c, double n) {
  for (int side : {0, 1}) c.begin[side] *= n, c.end[side] *= n;
  c.flexibility /= n;
  return c;
}

/// Goes from the bodies of all frames, of which one of each class is connected, to one frame a class.
class Condenser {
 public:
  Condenser(Builder& b, const Condensation& c, mbs::Model& model)
      : b_(b), c_(c), model_(model), key_(model.bodies.size()), frame_(key_.size(), -1), to_(key_.size(), -1) {}

  void condense() {
    find_keys();
    find_offsets();
    condense_bodies();
    condense_elements();
    condense_joints();
    condense_events();
    model_.is_planar = true;
  }

 private:
  using Key = std::tuple<int, int, int, int>;  // what it is, row, storey, class
  enum What { kNode, kBeam, kWall, kShaft, kStump };

  void find_keys() {
    const auto note = [this](int body, What what, const GridPoint& at) {
      frame_[static_cast<size_t>(body)] = at.frame;
      key_[static_cast<size_t>(body)] = {what, at.row, at.storey, c_.class_of[static_cast<size_t>(at.frame)]};
    };
    for (const auto& [at, body] : b_.node_body) note(body, kNode, at);
    for (const auto& [members, what] : {std::pair{&b_.x_beams, kBeam}, {&b_.x_walls, kWall}, {&b_.columns, kShaft}})
      for (const auto& [at, index] : *members)
        if (const auto body = b_.own_body.find(index); body != b_.own_body.end() && !b_.is_cast_on_beam(index))
          note(body->second, what, at);
    for (const auto& [at, index] : b_.columns)
      if (const auto body = b_.stump_body.find(index); body != b_.stump_body.end() && at.storey == 0)
        note(body->second, kStump, at);
  }

  /// How far each body's centre is beside the plane of its frame, into which it goes.
  void find_offsets() {
    offset_.assign(key_.size(), 0);
    for (size_t i = 0; i < key_.size(); ++i)
      if (frame_[i] >= 0)
        offset_[i] = model_.bodies[i].X_WB.p.y - b_.plan.frame_offsets[static_cast<size_t>(frame_[i])];
  }
  double offset_of(mbs::BodyId id) const { return id == mbs::kGround ? 0 : offset_[static_cast<size_t>(id.index)]; }

  void condense_bodies() {
    std::map<Key, std::pair<double, Mat3>> sums;
    for (size_t i = 0; i < key_.size(); ++i) {
      auto& [mass, inertia] = sums[key_[i]];
      mass += model_.bodies[i].mass;
      inertia = inertia + model_.bodies[i].inertia;
    }
    std::map<Key, int> place;
    std::vector<mbs::Body> bodies;
    std::vector<BodyEntry> entries;
    share_.assign(key_.size(), 1);
    for (size_t i = 0; i < key_.size(); ++i) {
      if (!b_.has_frame(frame_[i])) continue;
      const auto& [mass, inertia] = sums[key_[i]];
      mbs::Body body = model_.bodies[i];
      share_[i] = mass / body.mass;
      body.mass = mass;
      body.inertia = inertia;
      merge_shapes(b_.assemblies[i], body);
      for (mbs::Shape& s : body.shapes) s.X_BS.p.y += offset_[i];
      body.X_WB.p.y += calc_shift(frame_[i]) - offset_[i];
      place[key_[i]] = static_cast<int>(bodies.size());
      bodies.push_back(std::move(body));
      entries.push_back(b_.map.bodies[i]);
      for (record::BoxShape& s : entries.back().shapes) s.X_BS.p.y += offset_[i];
    }
    for (size_t i = 0; i < key_.size(); ++i) to_[i] = place.at(key_[i]);
    model_.bodies = std::move(bodies);
    b_.map.bodies = std::move(entries);
  }

  /// One box around all that a body carries in its plane, and one around each wall, windows filled: seen along y they
  /// cover each other.
  void merge_shapes(const Assembly& a, mbs::Body& body) const {
    if (a.parts.size() != body.shapes.size()) return;
    std::map<int, std::pair<Vec3, Vec3>> boxes;  // by wall, -1: the rest
    for (size_t i = 0; i < a.parts.size(); ++i) {
      const mbs::Shape& s = body.shapes[i];
      const Vec3 low = s.X_BS.p - s.half, high = s.X_BS.p + s.half;
      const int member = a.parts[i].member;
      const auto [at, is_new] = boxes.try_emplace(b_.member(member).kind == MemberKind::Wall ? member : -1, low, high);
      for (int k = 0; k < 3; ++k) {
        at->second.first[k] = std::min(at->second.first[k], low[k]);
        at->second.second[k] = std::max(at->second.second[k], high[k]);
      }
    }
    body.shapes.clear();
    for (const auto& [wall, box] : boxes) {
      mbs::Shape s;
      s.X_BS.p = 0.5 * (box.first + box.second);
      s.half = 0.5 * (box.second - box.first);
      body.shapes.push_back(s);
    }
  }

  /// Slices of different classes lie apart, so that they do not touch.
  double calc_shift(int frame) const {
    const std::vector<double>& y = b_.plan.frame_offsets;
    const double apart = y.back() - y.front() + 10;
    return apart * c_.class_of[static_cast<size_t>(frame)];
  }

  mbs::BodyId body_of(mbs::BodyId id) const {
    return id == mbs::kGround ? id : mbs::BodyId{to_[static_cast<size_t>(id.index)]};
  }
  int frame_of(mbs::BodyId id) const { return id == mbs::kGround ? -1 : frame_[static_cast<size_t>(id.index)]; }

  /// How many connections of the building one of the model stands for.
  double count(mbs::BodyId a, mbs::BodyId b) const {
    const int f = frame_of(b), g = a == mbs::kGround ? f : frame_of(a);
    const size_t c = static_cast<size_t>(c_.class_of[static_cast<size_t>(f)]);
    if (f == g) return static_cast<double>(c_.frames[c].size());
    double links = 0;
    const auto pair_of = [this](size_t i) {
      return std::pair<int, int>(std::minmax(c_.class_of[i], c_.class_of[i + 1]));
    };
    const auto here = pair_of(static_cast<size_t>(std::min(f, g)));
    for (size_t i = 0; i + 1 < c_.class_of.size(); ++i)
      if (pair_of(i) == here) ++links;
    return links;
  }

  mbs::LawId law_of(mbs::LawId id, double n) {
    if (!id.is_valid()) return id;
    const auto [at, is_new] = laws_.emplace(std::pair{id.index, n}, static_cast<int>(scaled_.size()));
    if (is_new) scaled_.push_back(scale_once(model_.laws.shared(static_cast<size_t>(id.index)), n));
    return mbs::LawId{at->second};
  }
  mbs::SharedLaw scale_once(const mbs::SharedLaw& law, double n) const {
    const std::pair key{law.identity(), n};
    if (b_.known)
      if (const auto found = b_.known->multiples.find(key); found != b_.known->multiples.end())
        return found->second.many;
    mbs::SharedLaw many = scale(law, n);
    if (b_.made) b_.made->multiples.emplace(key, KnownCurves::Multiple{law, many});
    return many;
  }

  void condense_elements() {
    for (size_t i = 0; i < model_.elements.size(); ++i) {
      mbs::ZoneElement& e = model_.elements[i];
      const double n = count(e.a, e.b);
      element_count_.push_back(n);
      const int f = frame_of(e.a), g = frame_of(e.b);
      e.X_AF.p.y += offset_of(e.a), e.X_BM.p.y += offset_of(e.b);
      if (f < 0) e.X_AF.p.y += calc_slice_shift(g);
      if (f >= 0 && f != g) {
        // one marker moves along y to the other, as their slices did
        const double shift_a = calc_slice_shift(f), shift_b = calc_slice_shift(g);
        e.X_BM.p.y -= shift_b - shift_a;
      }
      e.a = body_of(e.a), e.b = body_of(e.b);
      e.translational_stiffness = n * e.translational_stiffness;
      e.rotational_stiffness = n * e.rotational_stiffness;
      for (mbs::Cracking& c : e.cracking) c = scale(c, n);
      for (mbs::Station& s : e.stations) s.law = law_of(s.law, n);
      ZoneEntry& entry = b_.map.elements[i];
      entry.body_a = e.a.index, entry.body_b = e.b.index;
    }
  }

  /// Of a body of a frame to where its class is.
  double calc_slice_shift(int frame) const {
    const int first = c_.frames[static_cast<size_t>(c_.class_of[static_cast<size_t>(frame)])].front();
    const std::vector<double>& y = b_.plan.frame_offsets;
    return calc_shift(frame) + y[static_cast<size_t>(first)] - y[static_cast<size_t>(frame)];
  }

  void condense_joints() {
    std::vector<double> counts;
    for (size_t i = 0; i < model_.joints.size(); ++i) {
      mbs::Joint& j = model_.joints[i];
      const double n = count(j.parent, j.child);
      counts.push_back(n);
      j.X_PF.p.y += offset_of(j.parent), j.X_CM.p.y += offset_of(j.child);
      if (j.parent == mbs::kGround) j.X_PF.p.y += calc_slice_shift(frame_of(j.child));
      j.parent = body_of(j.parent), j.child = body_of(j.child);
      j.tension_limit *= n, j.shear_limit *= n, j.moment_limit *= n;
      b_.map.joints[i].body_a = j.parent.index, b_.map.joints[i].body_b = j.child.index;
    }
    for (size_t i = 0; i < model_.rotational_elements.size(); ++i) {
      mbs::RotationalElement& r = model_.rotational_elements[i];
      const double n = counts[static_cast<size_t>(r.joint.index)];
      rotational_count_.push_back(n);
      r.stiffness *= n;
      r.cracking = scale(r.cracking, n);
      r.loose_translational *= n;
      r.loose_torsion *= n, r.loose_bending *= n;
      r.law = law_of(r.law, n);
      ZoneEntry& entry = b_.map.rotationals[i];
      entry.body_a = model_.joints[static_cast<size_t>(r.joint.index)].parent.index;
      entry.body_b = model_.joints[static_cast<size_t>(r.joint.index)].child.index;
      b_.map.ground_columns[i].element = r;
    }
  }

  void condense_events() {
    for (mbs::Event& e : model_.events)
      for (mbs::Action& a : e.actions) {
        if (a.kind == mbs::Action::Kind::SwitchLaw) {
          a.law = law_of(a.law, a.rotational >= 0 ? rotational_count_[static_cast<size_t>(a.rotational)]
                                                  : element_count_[static_cast<size_t>(a.element.index)]);
        } else if (a.kind == mbs::Action::Kind::ReplaceBody) {
          const double share = share_[static_cast<size_t>(a.body.index)], moved = a.replacement.X_WB.p.y;
          a.replacement.mass *= share;
          for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) a.replacement.inertia(i, j) *= share;
          a.replacement.X_WB.p.y = 0;  // its centre stays in the plane, as the whole one's
          for (mbs::Shape& s : a.replacement.shapes) s.X_BS.p.y += moved + offset_of(a.body);
          a.body = body_of(a.body);
        }
      }
    model_.laws = std::move(scaled_);
  }

  Builder& b_;
  const Condensation& c_;
  mbs::Model& model_;
  std::vector<Key> key_;         // of each body before
  std::vector<int> frame_, to_;  // of each body before
  std::vector<double> share_;    // mass of each body's class over its own
  std::vector<double> offset_;   // of each body before, along y from its frame [m]
  std::map<std::pair<int, double>, int> laws_;
  mbs::Laws scaled_;
  std::vector<double> element_count_, rotational_count_;
};

mbs::Model build_condensed(Builder& b) {
  b.build();
  b.add_events(make_schedule(b.plan, b.k));
  mbs::Model model = std::move(b.model);
  Condenser(b, *b.condensation, model).condense();
  return model;
}

}  // namespace

Condensation find_like_frames(std::span<const product::Plan* const> plans, const Knowledge& k) {
  Condensation out;
  std::vector<std::string> text, bay;
  for (const product::Plan* plan : plans) {
    out.refusal = find_refusal(*plan, k);
    if (!out.refusal.empty()) return out;
    const std::vector<std::string> frames = describe_frames(*plan);
    text.resize(frames.size());
    for (size_t f = 0; f < frames.size(); ++f) text[f] += frames[f];
    const std::vector<std::string> bays = describe_bays(*plan);
    bay.resize(bays.size());
    for (size_t f = 0; f < bays.size(); ++f) bay[f] += bays[f];
  }
  std::map<std::string, int> known;
  for (size_t f = 0; f < text.size(); ++f) {
    const auto [at, is_new] = known.emplace(text[f], static_cast<int>(out.frames.size()));
    if (is_new) out.frames.emplace_back();
    out.frames[static_cast<size_t>(at->second)].push_back(static_cast<int>(f));
    out.class_of.push_back(at->second);
  }
  if (out.frames.size() == text.size()) return {{}, {}, "no two frames are alike"};
  // one bay between two classes stands for all of them
  std::map<std::pair<int, int>, size_t> bays;
  for (size_t f = 0; f + 1 < text.size(); ++f) {
    const std::pair<int, int> here = std::minmax(out.class_of[f], out.class_of[f + 1]);
    const size_t first = bays.emplace(here, f).first->second;
    if (here.first == here.second || bay[first] == bay[f]) continue;
    const auto name = [&](size_t i) {
      return plans.front()->frame_names[i] + " and " + plans.front()->frame_names[i + 1];
    };
    return {{}, {}, "bays between like frames differ: between " + name(first) + ", and between " + name(f)};
  }
  return out;
}

KnownCurves make_known_curves(const product::Plan& plan, const Knowledge& k, const Condensation& c) {
  KnownCurves out;
  ModelMap map;
  Builder builder(plan, k, map, 1);
  builder.condensation = &c;
  builder.made = &out;
  (void)build_condensed(builder);
  return out;
}

mbs::Model make_condensed_model(const product::Plan& plan, const Knowledge& k, const Condensation& c,
                                const KnownCurves* known, ModelMap& map) {
  map = {};
  // values of a sample may tell apart what was alike in those that the classes were found from
  const std::vector<std::string> frame = describe_frames(plan);
  for (const std::vector<int>& like : c.frames)
    for (const int f : like) {
      const auto first = static_cast<size_t>(like.front()), here = static_cast<size_t>(f);
      if (frame[here] == frame[first]) continue;
      throw InputError("E206",
                       "frames " + plan.frame_names[first] + " and " + plan.frame_names[here] +
                           " are one in a condensed run and differ with these values",
                       "run the study without --condensed");
    }
  Builder builder(plan, k, map, 1, known);
  builder.condensation = &c;
  mbs::Model model = build_condensed(builder);
  limit_frequency(model, k.body_highest_frequency);
  limit_frequency_of_stubs(model, k.body_highest_frequency);
  return model;
}

}  // namespace topple::collapse
