/// Pairs of bodies near each other, and their touching points (docs/theory/contact.md).

#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdint>
#include <span>
#include <tuple>
#include <utility>

#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr double kSearchMargin = 0.2;   // [m]; shapes nearer than this are watched
constexpr double kSearchTravel = 0.09;  // [m]; less than half the margin
constexpr long kSearchPause = 80;       // steps between searches that breaks ask for

/// Two bodies and their shapes, in the order of the list of pairs.
struct PairKey {
  std::uint64_t bodies, shapes;
  friend auto operator<=>(const PairKey&, const PairKey&) = default;
};
PairKey key_of(int a, int b, int shape_a, int shape_b) {
  const auto two = [](int x, int y) { return (static_cast<std::uint64_t>(x) << 32) | static_cast<std::uint64_t>(y); };
  return {two(a, b), two(shape_a, shape_b)};
}

}  // namespace

void System::find_pairs() {
  State& s = state;
  s.search_due = false;
  s.last_search = s.step_index;
  s.travel.resize(B);

  // who holds whom
  std::vector<std::array<int, 2>> links;
  links.reserve(2 * (elements.size() + joints.size()));
  std::fill(s.tied_to_ground.begin(), s.tied_to_ground.end(), 0);
  const auto link = [&](int a, int b) {
    if (a >= 0 && b >= 0) {
      links.push_back({a, b});
      links.push_back({b, a});
    }
    const auto grounded = [&](int x) { return x < 0 || fixed[static_cast<size_t>(x)]; };
    if (grounded(a) && b >= 0) s.tied_to_ground[static_cast<size_t>(b)] = 1;
    if (grounded(b) && a >= 0) s.tied_to_ground[static_cast<size_t>(a)] = 1;
  };
  for (size_t e = 0; e < elements.size(); ++e)
    if (s.element[e].live) link(elements[e].a, elements[e].b);
  for (size_t i = 0; i < forces.bushings.size(); ++i)
    if (s.bushing[i].live) link(forces.bushings[i].a, forces.bushings[i].b);
  for (size_t j = 0; j < joints.size(); ++j)
    if (s.joint[j].live) link(joints[j].parent, joints[j].child);
  std::vector<int> first(B + 1, 0), held(links.size());
  for (const auto& l : links) ++first[static_cast<size_t>(l[0]) + 1];
  for (size_t b = 0; b < B; ++b) first[b + 1] += first[b];
  std::vector<int> filled(first.begin(), first.end() - 1);
  for (const auto& l : links) held[static_cast<size_t>(filled[static_cast<size_t>(l[0])]++)] = l[1];
  const auto holders = [&](int b) {
    const size_t i = static_cast<size_t>(b);
    return std::span<const int>(held.data() + first[i], static_cast<size_t>(first[i + 1] - first[i]));
  };

  if (model.contact.bodies) {
    struct Item {
      Vec3 low, high;
      int body, shape;
    };
    std::vector<Item> items;
    for (size_t b = 0; b < B; ++b)
      for (int i = 0; i < s.body[b].shapes; ++i) {
        const CompiledShape& shape = s.shapes[static_cast<size_t>(s.body[b].first_shape + i)];
        const Vec3 c = s.p[b] + s.R[b] * shape.p_BS;
        Vec3 reach{shape.reach, shape.reach, shape.reach};
        if (shape.kind == Shape::Kind::Box) {
          const Mat3 R = s.R[b] * shape.R_BS;
          for (int k = 0; k < 3; ++k)
            reach[k] =
                std::abs(R(k, 0)) * shape.half.x + std::abs(R(k, 1)) * shape.half.y + std::abs(R(k, 2)) * shape.half.z;
        }
        const Vec3 pad = reach + 0.5 * Vec3{kSearchMargin, kSearchMargin, kSearchMargin};
        items.push_back({c - pad, c + pad, static_cast<int>(b), i});
      }
    // sweep along the axis on which the shapes spread most
    Vec3 mean, spread;
    const auto is_bounded = [](const Item& it) { return topple::is_finite(it.low); };  // planes are not
    for (const Item& it : items)
      if (is_bounded(it)) mean += (0.5 / static_cast<double>(items.size())) * (it.low + it.high);
    for (const Item& it : items)
      for (int k = 0; k < 3 && is_bounded(it); ++k) spread[k] += std::pow(0.5 * (it.low[k] + it.high[k]) - mean[k], 2);
    const int axis = spread.x >= spread.y && spread.x >= spread.z ? 0 : spread.y >= spread.z ? 1 : 2;
    std::sort(items.begin(), items.end(), [&](const Item& x, const Item& y) {
      const double a = x.low[axis], b = y.low[axis];
      return std::tie(a, x.body, x.shape) < std::tie(b, y.body, y.shape);
    });
    // the other two axes lie in rows of their own, so that the sweep compares many at a time
    const int other[2] = {(axis + 1) % 3, (axis + 2) % 3};
    std::vector<double> begins(items.size()), low[2], high[2];
    for (int k = 0; k < 2; ++k) low[k].resize(items.size()), high[k].resize(items.size());
    for (size_t i = 0; i < items.size(); ++i) {
      begins[i] = items[i].low[axis];
      for (int k = 0; k < 2; ++k) low[k][i] = items[i].low[other[k]], high[k][i] = items[i].high[other[k]];
    }
    std::vector<unsigned char> meets(items.size());
    std::vector<PairKey> found;
    // joined, or joined to the same third body: the joint or element between them governs
    std::vector<int> near(B, -1);  // the last body that the body is near to in this sense
    const auto mark_near = [&](int a) {
      near[static_cast<size_t>(a)] = a;
      for (const int n : holders(a)) {
        near[static_cast<size_t>(n)] = a;
        for (const int m : holders(n)) near[static_cast<size_t>(m)] = a;
      }
    };
    for (size_t i = 0; i < items.size(); ++i) {
      const Item& x = items[i];
      const size_t end = static_cast<size_t>(
          std::upper_bound(begins.begin() + static_cast<std::ptrdiff_t>(i), begins.end(), x.high[axis]) -
          begins.begin());
      const double x0 = x.low[other[0]], x1 = x.high[other[0]], y0 = x.low[other[1]], y1 = x.high[other[1]];
      for (size_t k = i + 1; k < end; ++k)
        meets[k] =
            static_cast<unsigned char>((low[0][k] <= x1) & (high[0][k] >= x0) & (low[1][k] <= y1) & (high[1][k] >= y0));
      bool marked = false;
      for (size_t k = i + 1; k < end; ++k) {
        if (meets[k] == 0) continue;
        const Item& y = items[k];
        if (x.body == y.body) continue;
        if (fixed[static_cast<size_t>(x.body)] && fixed[static_cast<size_t>(y.body)]) continue;
        if (!marked) mark_near(x.body);
        marked = true;
        if (near[static_cast<size_t>(y.body)] == x.body) continue;
        if (!contact_laws[static_cast<size_t>(find_pair_law(x.body, y.body))].touches) continue;
        found.push_back(x.body < y.body ? key_of(x.body, y.body, x.shape, y.shape)
                                        : key_of(y.body, x.body, y.shape, x.shape));
      }
    }
    std::sort(found.begin(), found.end());
    // keep what old pairs remember
    std::vector<PairState> pairs(found.size());
    std::vector<double> due(found.size(), 0);
    size_t old = 0;
    const auto key = [](const PairState& p) { return key_of(p.a, p.b, p.shape_a, p.shape_b); };
    for (size_t i = 0; i < found.size(); ++i) {
      PairState& p = pairs[i];
      p.a = static_cast<int>(found[i].bodies >> 32), p.b = static_cast<int>(found[i].bodies & 0xffffffff);
      p.shape_a = static_cast<int>(found[i].shapes >> 32), p.shape_b = static_cast<int>(found[i].shapes & 0xffffffff);
      while (old < s.pairs.size() && key(s.pairs[old]) < found[i]) ++old;
      if (old < s.pairs.size() && key(s.pairs[old]) == found[i]) {
        p = s.pairs[old];
        const double way = s.travel[static_cast<size_t>(p.a)] + s.travel[static_cast<size_t>(p.b)];
        p.way -= way;
        due[i] = s.pair_due[old] - way;
      } else {
        p.law = find_pair_law(p.a, p.b);
      }
    }
    s.pairs = std::move(pairs);
    s.pair_due = std::move(due);
  }
  std::fill(s.travel.begin(), s.travel.end(), 0);
}

void System::add_travel(double h) {
  State& s = state;
  const State& now = state;
  s.travel.resize(B);
  double most = 0;
  for (size_t b = 0; b < B && model.contact.bodies; ++b) {
    if (fixed[b]) continue;
    // the drift before this evaluation was by the speeds of half a step ago
    s.travel[b] += h * (norm(now.v[b]) + norm(now.w[b]) * s.body[b].radius);
    most = std::max(most, s.travel[b]);
  }
  if (most > kSearchTravel || (s.search_due && (s.last_search < 0 || s.step_index - s.last_search >= kSearchPause)))
    find_pairs();
}

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
    const size_t i = static_cast<size_t>(s.body[body].first_shape + shape);
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
    PairState& pair = s.pairs[number_of_pair];
    const size_t a = static_cast<size_t>(pair.a), b = static_cast<size_t>(pair.b);
    const double way = s.travel[a] + s.travel[b];
    if (way < s.pair_due[number_of_pair]) continue;
    const Solid &A = solid_of(a, pair.shape_a), &Bb = solid_of(b, pair.shape_b);
    const double reach = A.reach + Bb.reach;
    points.count = 0;
    if (const double distance2 = dot(Bb.p - A.p, Bb.p - A.p); distance2 < reach * reach) {
      find_contact(A, Bb, pair.axis, points);
    } else {
      points.gap = std::sqrt(distance2) - reach;
    }
    // a depth that the bodies cannot have come to since the last look, because another axis counts or because they
    // overlap at birth, is allowed
    const double possible = pair.depth + way - pair.way;
    pair.way = way;
    if (points.count == 0) {
      s.pair_due[number_of_pair] = way + points.gap;
      pair.touching = false;
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
      continue;
    }
    const ContactLaw& law = contact_laws[static_cast<size_t>(pair.law)];
    const double stiffness = law.stiffness > 0 ? law.stiffness
                                               : c.contact_frequency * c.contact_frequency /
                                                     (s.body[a].inverse_mass + s.body[b].inverse_mass);
    const Vec3 p_a = now.p[a], p_b = now.p[b];
    if (!pair.touching) {
      const long number = static_cast<long>(pair.a) * static_cast<long>(B) + pair.b;
      const auto at = std::lower_bound(s.touched_pairs.begin(), s.touched_pairs.end(), number);
      if (at == s.touched_pairs.end() || *at != number) {
        s.touched_pairs.insert(at, number);
        const Vec3 v = now.v[a] + cross(now.w[a], points.p[0] - p_a) - now.v[b] - cross(now.w[b], points.p[0] - p_b);
        say({Happening::Kind::BodyContact, s.time, pair.a, pair.b, {}, std::max(0.0, dot(points.normal, v))});
      }
    }
    const size_t first = contact.point.size();
    for (int i = 0; i < points.count; ++i) {
      const double depth = points.depth[i] - pair.allowed;
      if (depth > 0) add_contact_point(points.p[i] - p_a, points.p[i] - p_b, depth, points.weight[i] * stiffness);
    }
    body_contacts += static_cast<int>(contact.point.size() - first);
    add_contact_group(a, b, points.normal, first, law, stiffness, pair.stick, !pair.touching);
    pair.touching = true;
  }
}

}  // namespace topple::mbs
