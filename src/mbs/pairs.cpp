/// Touching points of pairs of shapes (docs/theory/contact.md).

#include <algorithm>
#include <cmath>

#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr double kMostSpare = 0.05;  // [m]; an axis is looked for anew at least so often

}  // namespace

void System::drop_pairs_of(size_t b) {
  size_t kept = 0;
  for (size_t i = 0; i < state.pairs.size(); ++i) {
    if (state.pairs[i].a == static_cast<int>(b) || state.pairs[i].b == static_cast<int>(b)) continue;
    state.pairs[kept] = state.pairs[i];
    state.pair_due[kept++] = state.pair_due[i];
  }
  state.pairs.resize(kept);
  state.pair_due.resize(kept);
}

void System::find_pair_points() {
  State& s = state;
  const State& now = state;
  const Contact& c = model.contact;
  // each shape where it is now, at most once a step
  solids.resize(s.shapes.size());
  solid_step.resize(s.shapes.size(), -1);
  const auto solid_of = [&](size_t body, int shape) -> const Solid& {
    const size_t i = static_cast<size_t>(shape);
    if (solid_step[i] != s.step_index) {
      solid_step[i] = s.step_index;
      const CompiledShape& c_shape = s.shapes[i];
      const Mat3 R = now.R[body];
      solids[i] = {c_shape.kind,
                   now.p[body] + R * c_shape.p_BS,
                   R * c_shape.R_BS,
                   c_shape.half,
                   c_shape.radius,
                   c_shape.reach,
                   c_shape.hull >= 0 ? &hulls[static_cast<size_t>(c_shape.hull)] : nullptr};
    }
    return solids[i];
  };
  BoxContact points;
  for (size_t number_of_pair = 0; number_of_pair < s.pairs.size(); ++number_of_pair) {
    const PairDue& due = s.pair_due[number_of_pair];
    const size_t a = static_cast<size_t>(due.a), b = static_cast<size_t>(due.b);
    const double way = s.travel[a] + s.travel[b];
    if (way < due.way) continue;
    PairState& pair = s.pairs[number_of_pair];
    const Solid &A = solid_of(a, pair.shape_a), &Bb = solid_of(b, pair.shape_b);
    const double reach = A.reach + Bb.reach;
    points.count = 0;
    const bool decided = pair.touching && way < pair.axis_way && find_contact_along(A, Bb, pair.axis, points);
    if (!decided) {
      if (const double distance2 = dot(Bb.p - A.p, Bb.p - A.p); distance2 < reach * reach) {
        find_contact(A, Bb, pair.axis, points);
        pair.axis_way = way + std::min(points.spare, kMostSpare);
      } else {
        points.gap = std::sqrt(distance2) - reach;
      }
    }
    // a depth that the bodies cannot have come to since the last look, because another axis counts or because they
    // overlap at birth, is allowed
    const double possible = pair.depth + way - pair.way;
    pair.way = way;
    if (points.count == 0) {
      s.pair_due[number_of_pair].way = way + points.gap;
      pair.touching = false;
      pair.sticks = {};
      pair.allowed = 0;
      pair.depth = -points.gap;
      continue;
    }
    double deepest = 0;
    for (int i = 0; i < points.count; ++i) deepest = std::max(deepest, points.depth[i]);
    pair.allowed = std::max(std::min(pair.allowed, deepest), deepest - std::max(0.0, possible));
    pair.depth = deepest - pair.allowed;
    if (pair.depth <= 0) {
      pair.touching = false;
      pair.sticks = {};
      continue;
    }
    const ContactLaw& law = contact_laws[static_cast<size_t>(pair.law)];
    const double stiffness = law.stiffness > 0 ? law.stiffness
                                               : c.contact_frequency * c.contact_frequency /
                                                     (s.body[a].inverse_mass + s.body[b].inverse_mass);
    const Vec3 p_a = now.p[a], p_b = now.p[b];
    if (!pair.touching) {
      const int low = std::min(pair.a, pair.b), high = std::max(pair.a, pair.b);
      const long number = static_cast<long>(low) * static_cast<long>(B) + high;
      const auto at = std::lower_bound(s.touched_pairs.begin(), s.touched_pairs.end(), number);
      if (at == s.touched_pairs.end() || *at != number) {
        s.touched_pairs.insert(at, number);
        const Vec3 v = now.v[a] + cross(now.w[a], points.p[0] - p_a) - now.v[b] - cross(now.w[b], points.p[0] - p_b);
        say({Happening::Kind::BodyContact, s.time, low, high, {}, std::max(0.0, dot(points.normal, v))});
      }
    }
    const size_t first = contact.point.size();
    for (int i = 0; i < points.count; ++i) {
      const double depth = points.depth[i] - pair.allowed;
      if (depth > 0) add_contact_point(points.p[i] - p_a, depth, points.weight[i] * stiffness);
    }
    body_contacts += static_cast<int>(contact.point.size() - first);
    add_contact_group(a, b, points.normal, first, law, stiffness, pair.sticks);
    pair.touching = true;
  }
}

}  // namespace topple::mbs
