#include "engines/articulation.h"

#include <algorithm>
#include <random>

#include "engines/joint_frames.h"

namespace topple::engines {

namespace {

constexpr double kHeld = 1e-6;  // of the lengths in a loop, or rad; the native engine takes such joints for one, too

/// M against F at some coordinates of a joint.
///   size  of translations [m]
///   draw  numbers from -1 to 1
template <class Draw>
Pose draw_pose(mbs::Joint::Kind kind, double size, Draw& draw) {
  using Kind = mbs::Joint::Kind;
  const auto three = [&] {
    const double x = draw(), y = draw(), z = draw();
    return Vec3{x, y, z};
  };
  switch (kind) {
    case Kind::Fixed:
      return {};
    case Kind::Revolute:
      return {{}, exp_rotation({0, 0, draw()})};
    case Kind::Spherical:
      return {{}, exp_rotation(three())};
    case Kind::Universal: {  // about x of F, then y of M
      const Quat about_x = exp_rotation({draw(), 0, 0});
      return {{}, about_x * exp_rotation({0, draw(), 0})};
    }
    case Kind::Prismatic:
      return {{0, 0, size * draw()}, {}};
    case Kind::Cylindrical: {
      const double way = size * draw();
      return {{0, 0, way}, exp_rotation({0, 0, draw()})};
    }
    case Kind::Distance:  // no branch
      break;
  }
  const Vec3 p = size * three();
  return {p, exp_rotation(three())};
}

}  // namespace

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

std::vector<int> find_idle_loops(const mbs::Model& model, const Articulation& a, const std::vector<double>& distance) {
  std::vector<int> idle = a.loops;
  if (idle.empty()) return idle;
  // largest distance of a joint from the centre of a body that it moves, along the branch to each body
  std::vector<double> reach(model.bodies.size(), 0);
  const auto reach_of = [&](int body) { return is_ground(model, body) ? 0 : reach[static_cast<size_t>(body)]; };
  const auto find_reach = [&](const mbs::Joint& j) {
    return std::max({is_ground(model, j.parent.index) ? 0 : norm(j.X_PF.p),
                     is_ground(model, j.child.index) ? 0 : norm(j.X_CM.p), reach_of(j.parent.index),
                     reach_of(j.child.index)});
  };
  double size = 0;
  for (const Branch& b : a.branches) {
    if (b.joint < 0) continue;
    double& r = reach[static_cast<size_t>(b.body)];
    r = find_reach(model.joints[static_cast<size_t>(b.joint)]);
    size = std::max(size, r);
  }
  if (!(size > 0)) size = 1;
  std::mt19937 random(1);
  const auto draw = [&] { return 2 * (static_cast<double>(random()) / 4294967295.0) - 1; };
  std::vector<Pose> X_WB(model.bodies.size());
  for (size_t b = 0; b < X_WB.size(); ++b) X_WB[b] = model.bodies[b].X_WB;
  const auto pose_of = [&](int body) { return body < 0 ? Pose{} : X_WB[static_cast<size_t>(body)]; };
  // what vanishes at random coordinates vanishes at all: gaps are analytic functions of them
  for (int sample = 0; sample < 2; ++sample) {
    for (const Branch& b : a.branches) {
      Pose& X = X_WB[static_cast<size_t>(b.body)];
      if (b.joint < 0) {
        X = draw_pose(mbs::Joint::Kind::Distance, size, draw);
        continue;
      }
      const mbs::Joint& j = model.joints[static_cast<size_t>(b.joint)];
      const Pose X_FM = draw_pose(j.kind, size, draw);
      X = b.reversed ? pose_of(j.child.index) * j.X_CM * inverse(X_FM) * inverse(j.X_PF)
                     : pose_of(j.parent.index) * j.X_PF * X_FM * inverse(j.X_CM);
    }
    std::erase_if(idle, [&](int loop) {
      const mbs::Joint& j = model.joints[static_cast<size_t>(loop)];
      JointFrames f;
      f.X_WF = pose_of(j.parent.index) * j.X_PF;
      f.X_WM = pose_of(j.child.index) * j.X_CM;
      const JointGap gap = calc_gap(j.kind, f, distance[static_cast<size_t>(loop)]);
      const double length = find_reach(j);
      return gap.length > kHeld * (length > 0 ? length : size) || gap.angle > kHeld;
    });
  }
  return idle;
}

}  // namespace topple::engines
