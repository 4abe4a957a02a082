/// Structures that stand beside each other in one plan (docs/theory/findings.md, section 1).

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <map>
#include <set>

#include "base/disjoint_sets.h"
#include "collapse/builder.h"

namespace topple::collapse {

namespace {

/// Bodies that hold together without the ground.
struct Group {
  double mass = 0;
  bool has_upper = false, is_shaft = false, is_charged = false;
  std::string name;
};

std::string join(const std::vector<std::string>& names) {
  std::string out;
  for (const std::string& n : names) out += (out.empty() ? "" : ", ") + n;
  return out;
}

}  // namespace

void Builder::find_structures() {
  if (condensation) return;  // what stands for all frames is one building
  const size_t B = model.bodies.size();
  DisjointSets linked(B);
  const auto link = [&](mbs::BodyId a, mbs::BodyId b) {
    for (const mbs::BodyId id : {a, b})
      if (id == mbs::kGround || model.bodies[static_cast<size_t>(id.index)].fixed) return;
    linked.join_under_lower(a.index, b.index);
  };
  for (const mbs::ZoneElement& e : model.elements) link(e.a, e.b);
  for (const mbs::Joint& j : model.joints) link(j.parent, j.child);

  // the lowest charge that fires on each member; one that fails tells what is to come down all the same
  std::map<int, double> fired;
  std::set<int> charged;
  for (const product::Stage& s : plan.stages)
    for (const product::Charge& c : s.charges) {
      charged.insert(c.member);
      if (c.fails) continue;
      if (const auto [it, is_new] = fired.emplace(c.member, c.position); !is_new)
        it->second = std::min(it->second, c.position);
    }
  for (const auto& [index, position] : fired)
    if (const auto shaft = shafts.find(index); shaft != shafts.end())
      for (const ShaftJoint& j : shaft->second.joints)
        if (j.at < position - 1e-6) map.bodies[static_cast<size_t>(j.above)].is_upper = false;

  std::map<int, Group> groups;  // by their first body
  for (size_t b = 0; b < B; ++b) {
    if (model.bodies[b].fixed) continue;
    Group& g = groups[linked.find(static_cast<int>(b))];
    g.mass += model.bodies[b].mass;
    g.has_upper |= map.bodies[b].is_upper;
    g.is_shaft |= map.bodies[b].kind == "shaft";
    for (const Part& p : assemblies[b].parts) {
      g.is_charged |= charged.contains(p.member);
      if (g.name.empty() && p.member >= 0) g.name = member(p.member).name;
    }
  }
  std::vector<int> order;  // groups that are structures, by mass
  for (const auto& [root, g] : groups)
    if (g.has_upper) order.push_back(root);
  if (order.size() < 2) return;
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return groups[a].mass > groups[b].mass; });
  const bool has_charges = std::any_of(order.begin(), order.end(), [&](int root) { return groups[root].is_charged; });

  map.structures.clear();
  std::map<int, int> structure_of;
  std::vector<std::string> judged, left;
  int of_frames = 0;  // that walls of the ground storey belong to, which nothing holds
  bool has_frames = false;
  for (const int root : order) {
    const Group& g = groups[root];
    const bool is_judged = g.is_charged || !has_charges;
    (is_judged ? judged : left).push_back(g.name);
    structure_of[root] = is_judged ? static_cast<int>(map.structures.size()) : -1;
    if (is_judged) map.structures.push_back({g.name, 0});
    if (!g.is_shaft && !has_frames) of_frames = structure_of[root], has_frames = true;
  }
  for (size_t b = 0; b < B; ++b) {
    if (model.bodies[b].fixed) continue;
    const auto it = structure_of.find(linked.find(static_cast<int>(b)));
    BodyEntry& body = map.bodies[b];
    body.structure = it == structure_of.end() ? of_frames : it->second;
    body.is_upper &= body.structure >= 0;
    if (body.structure >= 0) map.structures[static_cast<size_t>(body.structure)].mass += model.bodies[b].mass;
  }
  // what stands fast belongs to what hangs on it
  const auto follow = [&](mbs::BodyId a, mbs::BodyId b) {
    if (a == mbs::kGround || b == mbs::kGround) return;
    const size_t i = static_cast<size_t>(a.index), j = static_cast<size_t>(b.index);
    if (model.bodies[i].fixed && !model.bodies[j].fixed) map.bodies[i].structure = map.bodies[j].structure;
    if (model.bodies[j].fixed && !model.bodies[i].fixed) map.bodies[j].structure = map.bodies[i].structure;
  };
  for (const mbs::ZoneElement& e : model.elements) follow(e.a, e.b);
  for (const mbs::Joint& j : model.joints) follow(j.parent, j.child);
  if (!left.empty())
    map.notes.push_back(
        {"Structures without a charge",
         fmt::format("No charge acts on {} of {} separate structures (with {}): the mechanism is judged "
                     "without what stands there.",
                     left.size(), order.size(), join(left))});
  if (judged.size() > 1 && has_charges)
    map.notes.push_back(
        {"Separate structures",
         fmt::format("Charges act on {} separate structures (with {}): the mechanism of each is judged by "
                     "itself. Curves of tilt and height are those of the one with {}.",
                     judged.size(), join(judged), judged.front())});
}

}  // namespace topple::collapse
