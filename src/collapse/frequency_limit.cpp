#include "collapse/frequency_limit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace topple::collapse {

namespace {

/// Of an element, at one of its bodies.
struct End {
  int body;
  Vec3 lever;  // from the body's centre, in its axes [m]
};

std::array<End, 2> ends_of(const mbs::ZoneElement& e) { return {End{e.a.index, e.X_AF.p}, End{e.b.index, e.X_BM.p}}; }

/// Of an element's own axes, in W.
Mat3 axes_of(const mbs::Model& model, const mbs::ZoneElement& e) {
  return to_matrix(e.a == mbs::kGround ? e.X_AF.q : model.bodies[static_cast<size_t>(e.a.index)].X_WB.q * e.X_AF.q);
}

/// How much stiffer what acts on an element with its damper is than its spring alone, at the fastest mode.
template <class Element>
double with_damper(const Element& e) {
  return 1 + 4 * e.damping_ratio / (1 - 2 * e.damping_ratio);
}

/// Stiffness along an axis of W of three springs along the columns of R.
double along(const Mat3& R, const Vec3& k, int axis) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += R(axis, i) * R(axis, i) * k[i];
  return sum;
}

/// Stiffness against a turn about an axis through a point of what three springs along the columns of R hold at a lever.
double against_turn(const Mat3& R, const Vec3& k, const Vec3& lever, int axis) {
  const int u = (axis + 1) % 3, v = (axis + 2) % 3;
  return along(R, k, u) * lever[v] * lever[v] + along(R, k, v) * lever[u] * lever[u];
}

class Limiter {
 public:
  Limiter(mbs::Model& model, double highest) : model_(model), square_(highest * highest) {}

  void cut_horizontal_springs() {
    for (mbs::ZoneElement& e : model_.elements) {
      const double most = square_ * reduced_mass(e) / with_damper(e);
      const Mat3 R = axes_of(model_, e);
      const auto is_cut = [&](int i) { return model_.is_planar ? R(0, i) * R(0, i) > 0.5 : R(2, i) * R(2, i) <= 0.5; };
      for (int i = 0; i < 3; ++i)
        if (is_cut(i)) e.translational_stiffness[i] = std::min(e.translational_stiffness[i], most);
    }
  }

  /// Of each body against turns about an axis of W through its centre, which is one of its own.
  std::vector<double> find_turning(int axis) const {
    std::vector<double> turn(model_.bodies.size(), 0.0);
    for (const mbs::ZoneElement& e : model_.elements) {
      const Mat3 R = axes_of(model_, e);
      for (const End& end : ends_of(e))
        if (is_free(end.body))
          turn[at(end.body)] += with_damper(e) * (along(R, e.rotational_stiffness, axis) +
                                                  against_turn(R, e.translational_stiffness, end.lever, axis));
    }
    for (const mbs::RotationalElement& r : model_.rotational_elements) {
      const mbs::Joint& j = model_.joints[at(r.joint.index)];
      for (const int b : {j.parent.index, j.child.index})
        if (is_free(b)) turn[at(b)] += with_damper(r) * r.stiffness;
    }
    return turn;
  }

  void raise_inertia(mbs::Body& body, int axis, double stiffness) const {
    body.inertia(axis, axis) = std::max(body.inertia(axis, axis), stiffness / square_);
  }

  /// Of a joint that comes loose under a stub, and what it adds against turns of the stub.
  Vec3 cut_loose_springs(mbs::RotationalElement& r, const mbs::Body& stub, const Mat3& R_WB) const {
    const mbs::Joint& j = model_.joints[at(r.joint.index)];
    const Mat3 R = R_WB * to_matrix(j.X_PF.q);
    const Vec3 lever = j.X_PF.p - stub.X_WB.p;
    for (int i = 0; i < 3; ++i)
      r.loose_translational[i] = std::min(r.loose_translational[i], square_ * stub.mass / with_damper(r));
    Vec3 turn;
    for (int axis = 0; axis < 3; ++axis)
      turn[axis] = with_damper(r) * against_turn(R, r.loose_translational, lever, axis);
    return turn;
  }

 private:
  static size_t at(int i) { return static_cast<size_t>(i); }
  bool is_free(int b) const { return b >= 0 && !model_.bodies[at(b)].fixed; }

  /// Of both bodies against each other; what is fixed moves no more than the ground.
  double reduced_mass(const mbs::ZoneElement& e) const {
    double sum = 0;
    for (const End& end : ends_of(e))
      if (is_free(end.body)) sum += 1 / model_.bodies[at(end.body)].mass;
    return sum > 0 ? 1 / sum : mbs::kUnlimited;
  }

  mbs::Model& model_;
  double square_;  // of the frequency
};

/// The least that a body with such moments of inertia can have about each axis.
void complete_inertia(mbs::Body& body) {
  Mat3& I = body.inertia;
  for (int i = 0; i < 3; ++i) {
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    const double lack = I(i, i) - I(j, j) - I(k, k);
    if (lack > 0) I(j, j) += 0.5 * lack, I(k, k) += 0.5 * lack;
  }
}

std::vector<int> turning_axes(const mbs::Model& model) {
  return model.is_planar ? std::vector<int>{1} : std::vector<int>{0, 1, 2};
}

}  // namespace

void limit_frequency(mbs::Model& model, double highest) {
  Limiter limiter(model, highest);
  limiter.cut_horizontal_springs();
  for (const int axis : turning_axes(model)) {
    const std::vector<double> turn = limiter.find_turning(axis);
    for (size_t b = 0; b < turn.size(); ++b)
      if (!model.bodies[b].fixed) limiter.raise_inertia(model.bodies[b], axis, turn[b]);
  }
  if (!model.is_planar)
    for (mbs::Body& b : model.bodies) complete_inertia(b);
}

void limit_frequency_of_stubs(mbs::Model& model, double highest) {
  Limiter limiter(model, highest);
  std::array<std::vector<double>, 3> turn;
  for (const int axis : turning_axes(model)) turn[static_cast<size_t>(axis)] = limiter.find_turning(axis);
  for (mbs::Event& event : model.events)
    for (mbs::Action& a : event.actions) {
      if (a.kind != mbs::Action::Kind::ReplaceBody) continue;
      const size_t b = static_cast<size_t>(a.body.index);
      Vec3 stub;
      for (mbs::RotationalElement& r : model.rotational_elements)
        if (model.joints[static_cast<size_t>(r.joint.index)].parent == a.body && can_be_loosened(r))
          stub += limiter.cut_loose_springs(r, a.replacement, to_matrix(model.bodies[b].X_WB.q));
      for (const int axis : turning_axes(model))
        limiter.raise_inertia(a.replacement, axis, turn[static_cast<size_t>(axis)][b] + stub[axis]);
      if (!model.is_planar) complete_inertia(a.replacement);
    }
}

}  // namespace topple::collapse
