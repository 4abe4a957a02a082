/// Touching points of pairs of shapes (docs/theory/contact.md).

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "mbs/box_kernel.h"
#include "mbs/contact_kernel.h"
#include "mbs/system.h"

namespace topple::mbs {

void System::drop_pairs_of(size_t b) {
  State& s = state;
  size_t kept = 0;
  for (size_t i = 0; i < s.pairs.size(); ++i) {
    if (s.pair_due[i].a == static_cast<int>(b) || s.pair_due[i].b == static_cast<int>(b)) continue;
    s.pairs[kept] = s.pairs[i];
    s.pair_clock[kept] = s.pair_clock[i];
    s.pair_fast[kept] = s.pair_fast[i];
    s.pair_due[kept++] = s.pair_due[i];
  }
  s.pairs.resize(kept);
  s.pair_clock.resize(kept);
  s.pair_fast.resize(kept);
  s.pair_due.resize(kept);
}

void System::find_pair_points(double h) {
  State& s = state;
  const State& now = state;
  const Contact& c = model.contact;
  // each shape where it is now, boxes for the kernel at most once a step
  const size_t idle = s.shapes.size();
  if (contact.boxes.size() != (idle + 1) * kernel::kBoxFields) {
    contact.boxes.assign((idle + 1) * kernel::kBoxFields, 0);
    contact.box_step.assign(idle, -1);
  }
  const auto solid_of = [&](size_t body, int shape) -> Solid {
    const CompiledShape& c_shape = s.shapes[static_cast<size_t>(shape)];
    const Mat3 R = now.R[body];
    return {c_shape.kind,
            now.p[body] + R * c_shape.p_BS,
            c_shape.is_straight ? R : R * c_shape.R_BS,
            c_shape.half,
            c_shape.radius,
            c_shape.reach,
            hull_of(shape)};
  };
  const auto write = [&](size_t body, int shape) {
    const size_t i = static_cast<size_t>(shape);
    if (contact.box_step[i] == s.step_index) return;
    contact.box_step[i] = s.step_index;
    const CompiledShape& box = s.shapes[i];
    const Mat3 R = now.R[body];
    const Vec3 p = now.p[body] + R * box.p_BS;
    double* row = &contact.boxes[i * kernel::kBoxFields];
    box.is_straight ? write_box(p, R, box.half, box.reach, row) : write_box(p, R * box.R_BS, box.half, box.reach, row);
  };
  // those that are due; two boxes go to the kernel, those that touched side by side
  const size_t W = kernel::lanes();
  // no branch depends on what is compared
  contact.candidates.resize(s.pairs.size());
  size_t candidates = 0;
  for (size_t i = 0; i < s.pairs.size(); ++i) {
    contact.candidates[candidates] = static_cast<std::uint32_t>(i);
    candidates += s.pair_clock[i] <= s.clock[s.pair_fast[i]];
  }
  if (contact.looks.size() < candidates) contact.looks.resize(candidates);
  size_t found = 0;
  for (const size_t i : std::span(contact.candidates).first(candidates)) {
    const PairDue& due = s.pair_due[i];
    const double way = s.travel[static_cast<size_t>(due.a)] + s.travel[static_cast<size_t>(due.b)];
    s.pair_clock[i] = s.clock[s.pair_fast[i]] + 0.5 * (due.way - way);
    contact.looks[found].pair = i;
    contact.looks[found].way = way;
    found += way >= due.way;
  }
  const std::span looks(contact.looks.data(), found);
  size_t boxes[2] = {0, 0};  // that did not touch, that did
  for (PairLook& look : looks) {
    const PairDue& due = s.pair_due[look.pair];
    if (due.are_boxes) look.slot = boxes[due.touching ? 1 : 0]++;
  }
  const size_t first_touching = (boxes[0] + W - 1) / W * W, blocks = first_touching / W + (boxes[1] + W - 1) / W;
  contact.box_a.assign(blocks * W, static_cast<std::uint32_t>(idle));
  contact.box_b.assign(blocks * W, static_cast<std::uint32_t>(idle));
  contact.box_answers.resize(blocks * W * kernel::kBoxAnswerFields);
  for (PairLook& look : looks) {
    const PairDue& due = s.pair_due[look.pair];
    if (!due.are_boxes) continue;
    if (due.touching) look.slot += first_touching;
    write(static_cast<size_t>(due.a), due.shape_a);
    write(static_cast<size_t>(due.b), due.shape_b);
    contact.box_a[look.slot] = static_cast<std::uint32_t>(due.shape_a);
    contact.box_b[look.slot] = static_cast<std::uint32_t>(due.shape_b);
  }
  kernel::find_box_contacts(
      {blocks, contact.boxes.data(), contact.box_a.data(), contact.box_b.data(), contact.box_answers.data()});

  BoxContact points;
  const int passed = std::max(1, s.touching.steps);
  for (const PairLook& look : looks) {
    const double way = look.way;
    PairState& pair = s.pairs[look.pair];
    PairDue& due = s.pair_due[look.pair];
    const size_t a = static_cast<size_t>(due.a), b = static_cast<size_t>(due.b);
    points.count = 0;
    const auto approach_at = [&](const Vec3& at) {
      return dot(points.normal,
                 now.v[a] + cross(now.w[a], at - Vec3{now.p[a]}) - now.v[b] - cross(now.w[b], at - Vec3{now.p[b]}));
    };
    if (due.are_boxes) {
      read_box_contact(&contact.box_answers[look.slot / W * kernel::kBoxAnswerFields * W + look.slot % W], W, points);
    } else {
      const Solid A = solid_of(a, due.shape_a), Bb = solid_of(b, due.shape_b);
      const double reach = A.reach + Bb.reach;
      if (const double distance2 = dot(Bb.p - A.p, Bb.p - A.p); distance2 < reach * reach) {
        find_contact(A, Bb, pair.axis, points);
      } else {
        points.gap = std::sqrt(distance2) - reach;
      }
    }
    const double moved = way - std::exchange(pair.way, way);
    const Earnings earnings = pair.group >= 0 ? contact.earnings[static_cast<size_t>(pair.group)] : Earnings{};
    pair.group = -1;
    if (points.count == 0) {
      if (options.tells_lost_contact) note_lost_contact(due, -points.gap, h * passed);
      contact.lost += std::max(0.0, earnings.stored);
      due.way = way + points.gap;
      due.touching = false;
      pair.sticks = {};
      pair.allowed = 0;
      pair.depth = -points.gap;
      continue;
    }
    // a depth that the bodies cannot have come to since the last look, because another axis counts or because they
    // overlap at birth, is allowed. Ways are those against the mean motion of all bodies; what touches is looked at
    // each time, and how fast both move against each other is known
    const auto turning = [&](size_t body) { return fixed[body] ? 0 : norm(now.w[body]) * s.body[body].radius; };
    const double speed = norm(now.v[a] - now.v[b]) + turning(a) + turning(b);
    const double fastest = std::max(speed, std::exchange(pair.speed, speed));
    double possible = pair.depth + (due.touching ? kernel::kSlowed * fastest * h * passed : moved);
    double deepest = 0;
    for (int i = 0; i < points.count; ++i) deepest = std::max(deepest, points.depth[i]);
    if (!due.touching) {
      double approach = 0;
      for (int i = 0; i < points.count; ++i) approach = std::max(approach, approach_at(points.p[i]));
      possible = std::min(possible, kernel::kSlowed * approach * h * passed);
    }
    pair.allowed = std::max(std::min(pair.allowed, deepest), deepest - std::max(0.0, possible));
    pair.depth = deepest - pair.allowed;
    if (pair.depth <= 0) {
      contact.lost += std::max(0.0, earnings.stored);
      due.touching = false;
      pair.sticks = {};
      continue;
    }
    if (options.tells_lost_contact) note_lost_contact(due, pair.depth, h * passed);
    const ContactLaw& law = contact_laws[static_cast<size_t>(pair.law)];
    const double stiffness = law.stiffness > 0 ? law.stiffness
                                               : c.contact_frequency * c.contact_frequency /
                                                     (s.body[a].inverse_mass + s.body[b].inverse_mass);
    const Vec3 p_a = now.p[a];
    if (!due.touching) {
      const int low = std::min(due.a, due.b), high = std::max(due.a, due.b);
      const long number = static_cast<long>(low) * static_cast<long>(B) + high;
      const auto at = std::lower_bound(s.touched_pairs.begin(), s.touched_pairs.end(), number);
      if (at == s.touched_pairs.end() || *at != number) {
        s.touched_pairs.insert(at, number);
        say({Happening::Kind::BodyContact, s.time, low, high, {}, std::max(0.0, approach_at(points.p[0]))});
      }
    }
    const size_t first = contact.point.size();
    for (int i = 0; i < points.count; ++i) {
      const double depth = points.depth[i] - pair.allowed;
      if (depth > 0)
        add_contact_point(points.p[i] - p_a, depth, points.weight[i] * stiffness,
                          (due.touching ? 1 : kernel::kSlowed) * passed);
    }
    ContactGroup fitted;
    const bool is_held = fit_points(a, b, points.normal, first, law, fitted);
    pair.depth -= crush_ends(a, due.shape_a, b, due.shape_b, points.normal, law, first, h);
    body_contacts += static_cast<int>(contact.point.size() - first);
    add_contact_group(a, b, points.normal, first, pair.law, is_held ? fitted.stiffness : stiffness, pair.sticks);
    if (is_held) keep_mobility(fitted);
    pair.group = static_cast<int>(s.touching.group.size()) - 1;
    s.touching.group.back().earnings = earnings;
    due.touching = true;
  }
}

}  // namespace topple::mbs
