/// Groups of points whose dashpots act along one direction together (docs/theory/contact.md, "In the step").

#include <algorithm>

#include "mbs/contact_kernel.h"
#include "mbs/system.h"

namespace topple::mbs {

namespace {

constexpr double kAsOne = 0.999;  // coupling of two bodies from which on they count as one

}  // namespace

void System::find_together() {
  Touching& t = state.touching;
  t.together.clear();
  if (t.group.size() < 2) return;
  // units of bodies that move as one; the ground is the first
  const size_t bodies = t.body.size();
  DisjointSets& units = contact.units;
  std::vector<int>&island = contact.island, &count = contact.count;
  const bool has_units = !t.jointed_pairs.empty();
  if (has_units) units.reset(bodies);
  const auto unit_of = [&](int place) { return has_units ? units.find(place) : place; };
  const auto each_coupling = [&](auto&& f) {
    for (const JointedPair& p : t.jointed_pairs) {
      const int to = t.held[static_cast<size_t>(p.to)].place, from = t.held[static_cast<size_t>(p.from)].place;
      if (to != from) f(to, from, p.coupling);
    }
  };
  each_coupling([&](int to, int from, double coupling) {
    if (coupling >= kAsOne) units.join(to, from);
  });
  // the one unit that each touches: -1 none yet, -2 several; and by how many groups
  island.assign(bodies, -1);
  count.assign(bodies, 0);
  const auto meet = [&](int unit, int other) {
    if (unit == 0) return;
    int& known = island[static_cast<size_t>(unit)];
    known = known == -1 || known == other ? other : -2;
  };
  for (const ContactGroup& g : t.group) {
    const int a = unit_of(g.a), b = unit_of(g.b);
    meet(a, b), meet(b, a);
    ++count[static_cast<size_t>(std::max(a, b))];
  }
  // bodies of a mechanism feel more than what they touch
  each_coupling([&](int to, int from, double) {
    if (unit_of(to) != unit_of(from))
      island[static_cast<size_t>(unit_of(to))] = island[static_cast<size_t>(unit_of(from))] = -2;
  });
  for (size_t i = 0; i < t.group.size(); ++i) {
    const int a = unit_of(t.group[i].a), b = unit_of(t.group[i].b), last = std::max(a, b);
    const auto is_alone = [&](int unit, int other) { return unit == 0 || island[static_cast<size_t>(unit)] == other; };
    if (count[static_cast<size_t>(last)] > 1 && a != b && is_alone(a, b) && is_alone(b, a))
      t.together.push_back({static_cast<int>(i), last});
  }
}

void System::match_dashpots() {
  Touching& t = state.touching;
  const size_t W = kernel::lanes();
  std::vector<double>&pulls = contact.pulls, &power = contact.power, &made = contact.made;
  pulls.assign(6 * t.body.size(), 0);
  power.assign(t.body.size(), 0);
  made.assign(t.body.size(), 0);
  // of each touched body, through its groups
  std::vector<int>& island = contact.island;
  island.assign(t.body.size(), -1);
  const auto three = [W](const double* slot, int field) {
    const double* at = slot + static_cast<size_t>(field) * W;
    return Vec3{at[0], at[W], at[2 * W]};
  };
  for (const GroupTogether& one : t.together) {
    const ContactGroup& group = t.group[static_cast<size_t>(one.group)];
    const size_t block = group.slot / W, place = group.slot % W, number = static_cast<size_t>(one.number);
    const double* g = t.groups.data() + block * kernel::kGroupFields * W + place;
    const Vec3 n = three(g, kernel::kNormal), apart = three(g, kernel::kApart);
    const auto change = [&](int body, int field) {
      const double* row = contact.changes.data() + static_cast<size_t>(body) * kernel::kWrenchRow + field;
      return Vec3{row[0], row[1], row[2]};
    };
    const Vec3 w_b = change(group.b, 3), w = change(group.a, 3) - w_b,
               v = change(group.a, 0) - change(group.b, 0) - cross(w_b, apart);
    double sum = 0;
    Vec3 turning;
    for (int k = 0; k < group.count; ++k) {
      const double* p = t.points.data() + (t.rows[block] + static_cast<size_t>(k)) * kernel::kPointFields * W + place;
      const Vec3 lever = cross(three(p, kernel::kPlace), n);
      const double speed = p[kernel::kApproach * W] + dot(n, v) + dot(lever, w), f = p[kernel::kRate * W] * speed;
      power[number] += f * speed;
      sum += f;
      turning -= f * lever;
    }
    const Vec3 pressing = -sum * n;
    const auto pull = [&](int body, const Vec3& on, const Vec3& turn) {
      island[static_cast<size_t>(body)] = one.number;
      double* to = &pulls[6 * static_cast<size_t>(body)];
      for (int k = 0; k < 3; ++k) to[k] += on[k], to[3 + k] += turn[k];
    };
    pull(group.a, pressing, turning);
    if (group.b != 0) pull(group.b, -pressing, -(turning + cross(apart, pressing)));
  }
  for (size_t i = 1; i < t.body.size(); ++i) {
    if (island[i] < 0) continue;
    const double *q = &pulls[6 * i], *row = contact.rows.data() + i * kernel::kTouchedRow;
    const double* I = row + kernel::kRowInertia;  // xx xy xz yy yz zz
    made[static_cast<size_t>(island[i])] +=
        row[kernel::kRowMass] * (q[0] * q[0] + q[1] * q[1] + q[2] * q[2]) +
        (q[3] * (I[0] * q[3] + I[1] * q[4] + I[2] * q[5]) + q[4] * (I[1] * q[3] + I[3] * q[4] + I[4] * q[5]) +
         q[5] * (I[2] * q[3] + I[4] * q[4] + I[5] * q[5]));
  }
  for (const JointedPair& p : t.jointed_pairs) {
    const int to = t.held[static_cast<size_t>(p.to)].place, from = t.held[static_cast<size_t>(p.from)].place;
    if (island[static_cast<size_t>(to)] < 0 || island[static_cast<size_t>(to)] != island[static_cast<size_t>(from)])
      continue;
    double& less = made[static_cast<size_t>(island[static_cast<size_t>(to)])];
    for (size_t x = 0; x < 6; ++x)
      for (size_t y = 0; y < 6; ++y)
        less -= pulls[6 * static_cast<size_t>(to) + x] * p.less[6 * x + y] * pulls[6 * static_cast<size_t>(from) + y];
  }
  for (const GroupTogether& one : t.together) {
    const size_t number = static_cast<size_t>(one.number), slot = t.group[static_cast<size_t>(one.group)].slot;
    t.groups[(slot / W * kernel::kGroupFields + kernel::kTogether) * W + slot % W] =
        power[number] > 0 ? std::max(0.0, made[number]) / power[number] : 0;
  }
}

}  // namespace topple::mbs
