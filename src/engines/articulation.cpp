#include "engines/articulation.h"

namespace topple::engines {

Articulation make_articulation(const mbs::Model& model, const std::vector<unsigned char>& joint_live) {
  using mbs::Joint;
  const size_t B = model.bodies.size(), J = model.joints.size();
  Articulation out;
  // joints at each moving body, and at the ground
  std::vector<std::vector<int>> at_body(B);
  std::vector<int> at_ground;
  std::vector<unsigned char> is_used(J, 0);
  const auto counts = [&](size_t j) {
    const Joint& x = model.joints[j];
    return joint_live[j] && !(is_ground(model, x.parent.index) && is_ground(model, x.child.index));
  };
  for (size_t j = 0; j < J; ++j) {
    if (!counts(j) || model.joints[j].kind == Joint::Kind::Distance) continue;
    for (const int b : {model.joints[j].parent.index, model.joints[j].child.index})
      (is_ground(model, b) ? at_ground : at_body[static_cast<size_t>(b)]).push_back(static_cast<int>(j));
  }
  std::vector<unsigned char> is_placed(B, 0);
  const auto place = [&](int inboard, int j) {
    const Joint& x = model.joints[static_cast<size_t>(j)];
    const bool reversed = inboard < 0 ? is_ground(model, x.child.index) : x.child.index == inboard;
    const int body = reversed ? x.parent.index : x.child.index;
    if (is_ground(model, body) || is_placed[static_cast<size_t>(body)]) return;
    is_placed[static_cast<size_t>(body)] = 1;
    is_used[static_cast<size_t>(j)] = 1;
    out.branches.push_back({body, inboard, j, reversed});
  };
  size_t next = 0;  // branches whose joints have been followed
  const auto follow = [&] {
    for (; next < out.branches.size(); ++next) {
      const int body = out.branches[next].body;
      for (const int j : at_body[static_cast<size_t>(body)])
        if (!is_used[static_cast<size_t>(j)]) place(body, j);
    }
  };
  for (const int j : at_ground) place(-1, j);
  follow();
  for (size_t b = 0; b < B; ++b) {
    if (model.bodies[b].fixed || is_placed[b]) continue;
    is_placed[b] = 1;
    out.branches.push_back({static_cast<int>(b), -1, -1, false});
    follow();
  }
  for (size_t j = 0; j < J; ++j)
    if (counts(j) && !is_used[j]) out.loops.push_back(static_cast<int>(j));
  return out;
}

}  // namespace topple::engines
