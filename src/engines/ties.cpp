#include "engines/ties.h"

#include <algorithm>

#include "engines/articulation.h"

namespace topple::engines {

Ties find_ties(const mbs::Model& model, const Forces& forces, const std::vector<unsigned char>& joint_live) {
  const size_t B = model.bodies.size();
  Ties ties;
  ties.is_grounded.assign(B, 0);
  std::vector<std::vector<int>> held(B);  // by whom, fixed bodies included
  const auto link = [&](int a, int b) {
    if (a >= 0 && b >= 0) {
      held[static_cast<size_t>(a)].push_back(b);
      held[static_cast<size_t>(b)].push_back(a);
    }
    if (is_ground(model, a) && b >= 0) ties.is_grounded[static_cast<size_t>(b)] = 1;
    if (is_ground(model, b) && a >= 0) ties.is_grounded[static_cast<size_t>(a)] = 1;
  };
  for (size_t e = 0; e < model.elements.size(); ++e)
    if (forces.is_live(e)) link(model.elements[e].a.index, model.elements[e].b.index);
  for (size_t i = 0; i < model.bushings.size(); ++i)
    if (forces.is_bushing_live(i)) link(model.bushings[i].a.index, model.bushings[i].b.index);
  for (size_t j = 0; j < model.joints.size(); ++j)
    if (joint_live[j]) link(model.joints[j].parent.index, model.joints[j].child.index);
  for (const mbs::Contact::Pair& p : model.contact.pairs) {
    if (p.touches) continue;
    if (p.b == mbs::kGround)
      ties.is_grounded[static_cast<size_t>(p.a.index)] = 1;
    else
      ties.pairs.emplace_back(std::min(p.a.index, p.b.index), std::max(p.a.index, p.b.index));
  }
  const auto add = [&](int a, int b) {
    if (a < b && !(is_ground(model, a) && is_ground(model, b))) ties.pairs.emplace_back(a, b);
  };
  for (size_t a = 0; a < B; ++a)
    for (const int n : held[a]) {
      add(static_cast<int>(a), n);
      if (is_ground(model, n)) continue;
      for (const int m : held[static_cast<size_t>(n)]) add(static_cast<int>(a), m);
    }
  std::sort(ties.pairs.begin(), ties.pairs.end());
  ties.pairs.erase(std::unique(ties.pairs.begin(), ties.pairs.end()), ties.pairs.end());
  return ties;
}

}  // namespace topple::engines
