/// Which shapes are near each other (docs/theory/contact.md).

#include <algorithm>
#include <cmath>
#include <span>

#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr double kLeastAllowance = 0.05;  // [m]; way of a body until the next search
constexpr double kAllowedTime = 0.05;     // [s]; more for fast bodies
constexpr double kMostAllowance = 0.6;    // [m]
constexpr double kSlowShare = 0.8;        // of the bodies

/// Who is joined to a body, or joined to the same third body that can move: what joins them governs instead of contact.
class NearBodies {
 public:
  NearBodies(PairSearch& search, const std::vector<unsigned char>& fixed) : search_(search), fixed_(fixed) {
    search_.near.assign(fixed.size(), -1);
  }

  /// Quick for the same a in turn.
  bool operator()(int a, int b) {
    std::vector<int>& near = search_.near;  // the last body that the body is near to in this sense
    if (marked_ != a) {
      // other bodies may have overwritten what was marked for this one before
      marked_ = a;
      near[static_cast<size_t>(a)] = a;
      for (const int i : holders(a)) {
        near[static_cast<size_t>(i)] = a;
        if (fixed_[static_cast<size_t>(i)]) continue;  // as the ground
        for (const int j : holders(i)) near[static_cast<size_t>(j)] = a;
      }
    }
    return near[static_cast<size_t>(b)] == a;
  }

 private:
  std::span<const int> holders(int b) const {
    const size_t i = static_cast<size_t>(b);
    return {search_.link.data() + search_.first_link[i],
            static_cast<size_t>(search_.first_link[i + 1] - search_.first_link[i])};
  }
  PairSearch& search_;
  const std::vector<unsigned char>& fixed_;
  int marked_ = -1;  // whose neighbours are marked
};

}  // namespace

void System::add_travel(double h) {
  State& s = state;
  s.travel.resize(B);
  s.allowance.resize(B);
  s.is_fast.resize(B);
  bool is_far = false;
  if (h > 0 && model.contact.bodies) {
    // the drift before this evaluation was by the speeds of half a step ago
    double of_slow = 0, of_all = 0;
    const LaneLayout layout = lanes->body_layout(lane);
    const size_t first = layout.at(0, 0, 1), stride = layout.at(1, 0, 1) - first;
    const double* ways = lanes->way.data() + first;
    for (size_t b = 0; b < B; ++b) {
      const double way = ways[b * stride];
      of_slow = std::max(of_slow, s.is_fast[b] ? 0.0 : way);
      of_all = std::max(of_all, way);
      s.travel[b] += way;
      is_far |= s.travel[b] > s.allowance[b];
    }
    s.clock[0] += of_slow;
    s.clock[1] += of_all;
  }
  // what a link held together touches from the moment on when it breaks
  if (is_far || s.search_due) {
    find_pairs();
  } else if (s.links_due) {
    release_pairs();
  }
}

bool System::is_grounded(int body) const { return body < 0 || fixed[static_cast<size_t>(body)]; }

void System::list_grounded_links() {
  PairSearch& search = contact.search;
  const auto list = [&](size_t count, std::vector<size_t>& grounded, auto&& ends_of) {
    grounded.clear();
    for (size_t i = 0; i < count; ++i) {
      const auto [a, b] = ends_of(i);
      if (is_grounded(a) || is_grounded(b)) grounded.push_back(i);
    }
  };
  list(elements.size(), search.grounded_elements, [&](size_t e) { return std::pair(elements[e].a, elements[e].b); });
  list(forces.bushings.size(), search.grounded_bushings,
       [&](size_t i) { return std::pair(forces.bushings[i].a, forces.bushings[i].b); });
  list(joints.size(), search.grounded_joints, [&](size_t j) { return std::pair(joints[j].parent, joints[j].child); });
}

void System::find_links() {
  State& s = state;
  PairSearch& search = contact.search;
  const bool had_links = search.has_links;
  search.has_links = true;
  s.links_due = false;
  search.first_link_before.swap(search.first_link);
  search.link_before.swap(search.link);
  const std::vector<unsigned char> tied = s.tied_to_ground;
  std::fill(s.tied_to_ground.begin(), s.tied_to_ground.end(), 0);
  std::fill(s.ground_clear.begin(), s.ground_clear.end(), 0);
  if (!had_links) list_grounded_links();
  const auto tie = [&](int body) {
    if (body >= 0) s.tied_to_ground[static_cast<size_t>(body)] = 1;
  };
  const auto tie_ends = [&](int a, int b) {
    if (is_grounded(a)) tie(b);
    if (is_grounded(b)) tie(a);
  };
  for (const size_t e : search.grounded_elements)
    if (s.element[e].live) tie_ends(elements[e].a, elements[e].b);
  for (const size_t i : search.grounded_bushings)
    if (s.bushing[i].live) tie_ends(forces.bushings[i].a, forces.bushings[i].b);
  for (const size_t j : search.grounded_joints)
    if (s.joint[j].live) tie_ends(joints[j].parent, joints[j].child);
  for (size_t b = 0; b < B; ++b)
    if (s.tied_to_ground[b] != tied[b]) pack_ground_box(b);
  if (!model.contact.bodies) return;  // nobody asks who is tied to whom
  const auto each_link = [&](auto&& f) {
    for (size_t e = 0; e < elements.size(); ++e)
      if (s.element[e].live) f(elements[e].a, elements[e].b);
    for (size_t i = 0; i < forces.bushings.size(); ++i)
      if (s.bushing[i].live) f(forces.bushings[i].a, forces.bushings[i].b);
    for (size_t j = 0; j < joints.size(); ++j)
      if (s.joint[j].live) f(joints[j].parent, joints[j].child);
  };
  search.first_link.assign(B + 2, 0);
  each_link([&](int a, int b) {
    if (a < 0 || b < 0) return;
    ++search.first_link[static_cast<size_t>(a) + 2];
    ++search.first_link[static_cast<size_t>(b) + 2];
  });
  for (size_t b = 2; b < B + 2; ++b) search.first_link[b] += search.first_link[b - 1];
  search.link.resize(static_cast<size_t>(search.first_link[B + 1]));
  each_link([&](int a, int b) {
    if (a < 0 || b < 0) return;
    search.link[static_cast<size_t>(search.first_link[static_cast<size_t>(a) + 1]++)] = b;
    search.link[static_cast<size_t>(search.first_link[static_cast<size_t>(b) + 1]++)] = a;
  });
  const auto links_of = [](const std::vector<int>& first, const std::vector<int>& link, size_t b) {
    return std::span(link).subspan(static_cast<size_t>(first[b]), static_cast<size_t>(first[b + 1] - first[b]));
  };
  search.relinked.assign(B, 1);
  for (size_t b = 0; b < B && had_links; ++b)
    search.relinked[b] = !std::ranges::equal(links_of(search.first_link, search.link, b),
                                             links_of(search.first_link_before, search.link_before, b));
}

/// Speeds of the bodies' farthest points, as the ways are counted, and which are the fastest.
void System::find_fast_bodies() {
  State& s = state;
  const State& now = state;
  std::vector<double>&speeds = contact.search.speeds, &sorted = contact.search.extents;
  speeds.resize(B);
  for (size_t b = 0; b < B; ++b)
    speeds[b] = norm(now.v[b] - s.search_velocity) + (fixed[b] ? 0 : norm(now.w[b]) * s.body[b].radius);
  sorted = speeds;
  const auto at = sorted.begin() + static_cast<std::ptrdiff_t>(kSlowShare * static_cast<double>(B));
  if (at == sorted.end()) return;
  std::nth_element(sorted.begin(), at, sorted.end());
  for (size_t b = 0; b < B; ++b) s.is_fast[b] = speeds[b] > *at;
}

/// Boxes around the shapes, grown by the way their bodies may make until the next search, sorted by place: that of the
/// lower ends, then of the upper ones, the axis along which the shapes reach farthest first.
void System::find_bounds() {
  State& s = state;
  PairSearch& search = contact.search;
  search.bounds.clear();
  Vec3 least{kUnlimited, kUnlimited, kUnlimited}, most = -least;
  for (size_t b = 0; b < B; ++b) {
    const BodyConstants& body = s.body[b];
    if (body.shapes == 0) continue;
    const Vec3 p = s.p[b];
    const Mat3 R_WB = s.R[b];
    const double margin = s.allowance[b] = std::min(kLeastAllowance + kAllowedTime * search.speeds[b], kMostAllowance);
    for (int i = body.first_shape; i < body.first_shape + body.shapes; ++i) {
      const CompiledShape& shape = s.shapes[static_cast<size_t>(i)];
      const Vec3 c = p + R_WB * shape.p_BS;
      Vec3 reach{shape.reach, shape.reach, shape.reach};
      if (shape.kind == Shape::Kind::Box) {
        const Mat3 R = shape.is_straight ? R_WB : R_WB * shape.R_BS;
        for (int k = 0; k < 3; ++k)
          reach[k] =
              std::abs(R(k, 0)) * shape.half.x + std::abs(R(k, 1)) * shape.half.y + std::abs(R(k, 2)) * shape.half.z;
      }
      ShapeBounds& x = search.bounds.emplace_back();
      x.body = static_cast<int>(b);
      x.shape = i;
      for (int k = 0; k < 3; ++k) {
        x.low[k] = c[k] - reach[k] - margin;
        x.high[k] = c[k] + reach[k] + margin;
      }
      if (shape.kind == Shape::Kind::Plane) continue;
      for (int k = 0; k < 3; ++k) least[k] = std::min(least[k], c[k]), most[k] = std::max(most[k], c[k]);
    }
  }
  const Vec3 spread = most - least;
  const int first = spread.x >= spread.y && spread.x >= spread.z ? 0 : spread.y >= spread.z ? 1 : 2;
  const int second = (first + 1) % 3, third = (first + 2) % 3;
  for (ShapeBounds& x : search.bounds) {
    const ShapeBounds y = x;
    const int axes[3] = {first, spread[second] >= spread[third] ? second : third,
                         spread[second] >= spread[third] ? third : second};
    for (int k = 0; k < 3; ++k) x.low[k] = y.low[axes[k]], x.high[k] = y.high[axes[k]];
  }
  std::sort(search.bounds.begin(), search.bounds.end(), [](const ShapeBounds& x, const ShapeBounds& y) {
    for (int k = 0; k < 3; ++k)
      if (x.low[k] != y.low[k]) return x.low[k] < y.low[k];
    for (int k = 0; k < 3; ++k)
      if (x.high[k] != y.high[k]) return x.high[k] < y.high[k];
    return x.shape < y.shape;
  });
}

namespace {

/// Puts keys of two ranks below `n` in order: by the second, then, those alike kept in order, by the first.
void sort_ranks(std::vector<std::uint64_t>& keys, size_t n, PairSearch& search) {
  std::vector<std::uint64_t>& sorted = search.sorted;
  std::vector<std::uint32_t>& next = search.next;
  sorted.resize(keys.size());
  for (const int shift : {0, 32}) {
    next.assign(n + 1, 0);
    for (const std::uint64_t key : keys) ++next[static_cast<std::uint32_t>(key >> shift) + 1];
    for (size_t i = 1; i < n; ++i) next[i] += next[i - 1];
    for (const std::uint64_t key : keys) sorted[next[static_cast<std::uint32_t>(key >> shift)]++] = key;
    keys.swap(sorted);
  }
}

}  // namespace

void System::find_pairs() {
  State& s = state;
  PairSearch& search = contact.search;
  if (s.links_due || !search.has_links) find_links();
  s.search_due = false;
  // bodies that are nowhere are near no other; the step ends as diverged
  Vec3 sum;
  for (size_t b = 0; b < B; ++b) sum += s.p[b] + s.v[b] + s.w[b];
  if (!std::isfinite(sum.x + sum.y + sum.z)) return;
  s.travel.resize(B);
  s.is_fast.resize(B);
  if (!model.contact.bodies) {
    std::fill(s.travel.begin(), s.travel.end(), 0);
    return;
  }
  // pairs remember their ways as seen so far; what follows is as seen from a new frame
  const std::vector<double>& ways = search.ways = s.travel;
  std::fill(s.travel.begin(), s.travel.end(), 0);
  choose_search_velocity();
  find_fast_bodies();
  find_bounds();
  const std::vector<ShapeBounds>& bounds = search.bounds;
  const size_t n = bounds.size();

  // slabs across the second axis, twice as wide as most shapes, so that each meets few others along the first
  search.unbounded.clear();
  search.extents.clear();
  double least = kUnlimited, most = -kUnlimited;
  for (size_t i = 0; i < n; ++i) {
    if (!std::isfinite(bounds[i].low[0])) {
      search.unbounded.push_back(static_cast<int>(i));
      continue;
    }
    search.extents.push_back(bounds[i].high[1] - bounds[i].low[1]);
    least = std::min(least, bounds[i].low[1]), most = std::max(most, bounds[i].high[1]);
  }
  size_t slabs = 1;
  double per_width = 0;
  if (!search.extents.empty()) {
    const auto middle = search.extents.begin() + static_cast<std::ptrdiff_t>(search.extents.size() / 2);
    std::nth_element(search.extents.begin(), middle, search.extents.end());
    const double width = std::max(2 * *middle, (most - least) / static_cast<double>(4 * n));
    per_width = 1 / width;
    slabs = static_cast<size_t>((most - least) * per_width) + 1;
  }
  search.first_in_slab.assign(slabs + 2, 0);
  for (ShapeBounds& x : search.bounds) {
    if (!std::isfinite(x.low[0])) continue;
    x.first_slab = static_cast<int>((x.low[1] - least) * per_width);
    x.last = static_cast<int>((x.high[1] - least) * per_width);
    for (int k = x.first_slab; k <= x.last; ++k) ++search.first_in_slab[static_cast<size_t>(k) + 2];
  }
  for (size_t k = 2; k < slabs + 2; ++k) search.first_in_slab[k] += search.first_in_slab[k - 1];
  search.in_slab.resize(static_cast<size_t>(search.first_in_slab[slabs + 1]));
  for (size_t i = 0; i < n; ++i) {
    const ShapeBounds& x = bounds[i];
    if (!std::isfinite(x.low[0])) continue;
    for (int k = x.first_slab; k <= x.last; ++k)
      search.in_slab[static_cast<size_t>(search.first_in_slab[static_cast<size_t>(k) + 1]++)] = static_cast<int>(i);
  }

  NearBodies are_near(search, fixed);
  search.found.clear();
  search.held.clear();
  const auto look = [&](size_t i, size_t j) {
    const ShapeBounds &x = bounds[i], &y = bounds[j];
    if (x.body == y.body || (fixed[static_cast<size_t>(x.body)] && fixed[static_cast<size_t>(y.body)])) return;
    if (!contact_laws[static_cast<size_t>(find_pair_law(x.body, y.body))].touches) return;
    (are_near(x.body, y.body) ? search.held : search.found)
        .push_back(static_cast<std::uint64_t>(std::min(i, j)) << 32 | std::max(i, j));
  };
  for (size_t k = 0; k < slabs; ++k) {
    const std::span<const int> slab(search.in_slab.data() + search.first_in_slab[k],
                                    static_cast<size_t>(search.first_in_slab[k + 1] - search.first_in_slab[k]));
    search.here.clear();
    for (const int i : slab) search.here.push_back(bounds[static_cast<size_t>(i)]);
    search.hits.resize(slab.size());
    for (size_t i = 0; i < slab.size(); ++i) {
      const ShapeBounds& x = search.here[i];
      // no branch depends on what is compared
      size_t hits = 0;
      for (size_t j = i + 1; j < slab.size() && search.here[j].low[0] <= x.high[0]; ++j) {
        const ShapeBounds& y = search.here[j];
        // in the first slab that both reach into
        const bool hit = (x.low[1] <= y.high[1]) & (y.low[1] <= x.high[1]) & (x.low[2] <= y.high[2]) &
                         (y.low[2] <= x.high[2]) & (std::max(x.first_slab, y.first_slab) == static_cast<int>(k));
        search.hits[hits] = static_cast<int>(j);
        hits += hit;
      }
      for (size_t j = 0; j < hits; ++j)
        look(static_cast<size_t>(slab[i]), static_cast<size_t>(slab[static_cast<size_t>(search.hits[j])]));
    }
  }
  for (const int u : search.unbounded)
    for (size_t i = 0; i < n; ++i)
      if (std::isfinite(bounds[i].low[0])) look(static_cast<size_t>(u), i);
  for (std::vector<std::uint64_t>* keys : {&search.found, &search.held}) sort_ranks(*keys, n, search);
  s.held_pairs.clear();
  for (const std::uint64_t key : search.held) {
    const ShapeBounds &x = bounds[key >> 32], &y = bounds[key & 0xffffffffU];
    s.held_pairs.push_back({x.body, y.body, x.shape, y.shape});
  }

  // keep what old pairs remember
  search.first_old.assign(s.shapes.size() + 2, 0);
  const auto lower = [](int a, int b) { return static_cast<size_t>(std::min(a, b)); };
  for (const PairDue& p : s.pair_due) ++search.first_old[lower(p.shape_a, p.shape_b) + 2];
  for (size_t i = 2; i < search.first_old.size(); ++i) search.first_old[i] += search.first_old[i - 1];
  search.old.resize(s.pairs.size());
  for (size_t i = 0; i < s.pairs.size(); ++i)
    search.old[static_cast<size_t>(search.first_old[lower(s.pair_due[i].shape_a, s.pair_due[i].shape_b) + 1]++)] =
        static_cast<int>(i);
  search.pairs.clear();
  search.pairs.reserve(search.found.size());
  std::vector<PairDue>& due = search.due;
  due.clear();
  search.clock.clear();
  search.fast.clear();
  for (const std::uint64_t key : search.found) {
    const ShapeBounds &x = bounds[key >> 32], &y = bounds[key & 0xffffffffU];
    const size_t first = lower(x.shape, y.shape);
    int known = -1;
    for (int i = search.first_old[first]; i < search.first_old[first + 1] && known < 0; ++i) {
      const PairDue& p = s.pair_due[static_cast<size_t>(search.old[static_cast<size_t>(i)])];
      if (std::max(p.shape_a, p.shape_b) == std::max(x.shape, y.shape)) known = search.old[static_cast<size_t>(i)];
    }
    PairState& p = search.pairs.emplace_back();
    PairDue& d = due.emplace_back();
    if (known >= 0) {
      p = s.pairs[static_cast<size_t>(known)];
      d = s.pair_due[static_cast<size_t>(known)];
      const double way = ways[static_cast<size_t>(d.a)] + ways[static_cast<size_t>(d.b)];
      p.way -= way;
      d.way -= way;
    } else {
      d = make_pair_due({x.body, y.body, x.shape, y.shape});
      p.law = find_pair_law(d.a, d.b);
    }
    search.fast.push_back(s.is_fast[static_cast<size_t>(d.a)] | s.is_fast[static_cast<size_t>(d.b)]);
    search.clock.push_back(s.clock[search.fast.back()] + 0.5 * d.way);
  }
  s.pairs.swap(search.pairs);
  s.pair_due.swap(due);
  s.pair_clock.swap(search.clock);
  s.pair_fast.swap(search.fast);
}

bool System::comes_first(int body, int shape, int other_body, int other_shape) const {
  const size_t a = static_cast<size_t>(body), b = static_cast<size_t>(other_body);
  if (fixed[a] != fixed[b]) return fixed[a];
  constexpr double alike = 1e-9;
  const auto differ = [](double x, double y) { return !(std::abs(x - y) <= alike * std::min(x, y)) && x != y; };
  const double mass = state.body[a].mass, other_mass = state.body[b].mass;
  if (differ(mass, other_mass)) return mass > other_mass;
  const double reach = state.shapes[static_cast<size_t>(shape)].reach;
  const double other_reach = state.shapes[static_cast<size_t>(other_shape)].reach;
  if (differ(reach, other_reach)) return reach > other_reach;
  const Vec3 at = state.p[a], other_at = state.p[b];
  for (const int axis : {2, 0, 1})
    if (std::abs(at[axis] - other_at[axis]) > alike) return at[axis] < other_at[axis];
  return true;
}

PairDue System::make_pair_due(const HeldPair& pair) const {
  PairDue d;
  d.a = pair.a, d.b = pair.b;
  d.shape_a = pair.shape_a, d.shape_b = pair.shape_b;
  if (!comes_first(d.a, d.shape_a, d.b, d.shape_b)) std::swap(d.a, d.b), std::swap(d.shape_a, d.shape_b);
  const auto is_box = [&](int i) { return state.shapes[static_cast<size_t>(i)].kind == Shape::Kind::Box; };
  d.are_boxes = is_box(d.shape_a) && is_box(d.shape_b);
  return d;
}

/// Those that are no longer held follow behind the others, in their order.
void System::release_pairs() {
  State& s = state;
  find_links();
  if (s.held_pairs.empty()) return;
  NearBodies are_near(contact.search, fixed);
  size_t kept = 0;
  const std::vector<unsigned char>& relinked = contact.search.relinked;
  for (const HeldPair& pair : s.held_pairs) {
    // joined by a link of one of the two, or by one of each
    const bool is_due = relinked[static_cast<size_t>(pair.a)] || relinked[static_cast<size_t>(pair.b)];
    if (!is_due || are_near(pair.a, pair.b)) {
      s.held_pairs[kept++] = pair;
      continue;
    }
    PairDue& d = s.pair_due.emplace_back(make_pair_due(pair));
    PairState& p = s.pairs.emplace_back();
    p.law = find_pair_law(d.a, d.b);
    const size_t a = static_cast<size_t>(d.a), b = static_cast<size_t>(d.b);
    p.way = d.way = s.travel[a] + s.travel[b];  // due at once
    s.pair_fast.push_back(s.is_fast[a] | s.is_fast[b]);
    s.pair_clock.push_back(s.clock[s.pair_fast.back()]);
  }
  s.held_pairs.resize(kept);
}

/// Any frame serves that is the same for all bodies; in that of their mean motion they stay near their places longest.
/// The sum is one of integers, so that the order of bodies does not count.
void System::choose_search_velocity() {
  State& s = state;
  const State& now = state;
  constexpr double scale = 1 << 20;
  std::int64_t sum[3] = {0, 0, 0}, count = 0;
  for (size_t b = 0; b < B; ++b) {
    if (s.body[b].shapes == 0) continue;
    const Vec3 v = now.v[b];
    if (!(norm(v) < 1e4)) continue;  // thrown out of all bounds
    for (int k = 0; k < 3; ++k) sum[k] += std::llround(scale * v[k]);
    ++count;
  }
  if (count == 0) return;
  for (int k = 0; k < 3; ++k) s.search_velocity[k] = static_cast<double>(sum[k]) / (scale * static_cast<double>(count));
}

}  // namespace topple::mbs
