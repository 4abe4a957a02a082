#include "mbs/quantity.h"

#include <cmath>
#include <iterator>
#include <limits>

namespace topple::mbs {

namespace {

using Kind = Quantity::Kind;

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();

double scalar_at(const std::vector<double>& list, int index) {
  const size_t i = static_cast<size_t>(index);
  return index >= 0 && i < list.size() ? list[i] : kUnknown;
}

Vec3 vector_at(const std::vector<Vec3>& list, int index) {
  const size_t i = static_cast<size_t>(index);
  return index >= 0 && i < list.size() ? list[i] : Vec3{kUnknown, kUnknown, kUnknown};
}

Pose pose_at(const View& v, int index) {
  const size_t i = static_cast<size_t>(index);
  if (index >= 0 && i < v.X_WB.size()) return v.X_WB[i];
  return {{kUnknown, kUnknown, kUnknown}, {kUnknown, kUnknown, kUnknown, kUnknown}};
}

/// Of the kinds that have one number.
double calc_scalar(const Quantity& q, const View& v) {
  switch (q.kind) {
    case Kind::JointAngle:
      return scalar_at(v.joint_angle, q.index);
    case Kind::JointDisplacement:
      return scalar_at(v.joint_displacement, q.index);
    case Kind::SpringLength:
      return scalar_at(v.spring_length, q.index);
    case Kind::SpringForce:
      return scalar_at(v.spring_force, q.index);
    case Kind::TorsionAngle:
      return scalar_at(v.torsion_angle, q.index);
    case Kind::TorsionTorque:
      return scalar_at(v.torsion_torque, q.index);
    case Kind::HingeRotation:
      return scalar_at(v.hinge_rotation, q.index);
    case Kind::HingeMoment:
      return scalar_at(v.hinge_moment, q.index);
    case Kind::CableLength:
      return scalar_at(v.cable_length, q.index);
    case Kind::CableForce:
      return scalar_at(v.cable_force, q.index);
    default:
      return kUnknown;
  }
}

/// Of the kinds that have three numbers; of an orientation the rotation vector.
Vec3 calc_vector(const Quantity& q, const View& v) {
  switch (q.kind) {
    case Kind::Position:
      return vector_at(v.centre, q.index);
    case Kind::Velocity:
      return vector_at(v.v_WB, q.index);
    case Kind::AngularVelocity:
      return vector_at(v.w_WB, q.index);
    case Kind::Orientation:
      return log_rotation(pose_at(v, q.index).q);
    case Kind::JointForce:
      return vector_at(v.joint_force, q.index);
    case Kind::JointMoment:
      return vector_at(v.joint_moment, q.index);
    case Kind::ElementTranslation:
      return vector_at(v.element_translation, q.index);
    case Kind::ElementRotation:
      return vector_at(v.element_rotation, q.index);
    case Kind::ElementForce:
      return vector_at(v.element_force, q.index);
    case Kind::ElementMoment:
      return vector_at(v.element_moment, q.index);
    case Kind::BushingTranslation:
      return vector_at(v.bushing_translation, q.index);
    case Kind::BushingRotation:
      return vector_at(v.bushing_rotation, q.index);
    case Kind::BushingForce:
      return vector_at(v.bushing_force, q.index);
    case Kind::BushingMoment:
      return vector_at(v.bushing_moment, q.index);
    default:
      return {kUnknown, kUnknown, kUnknown};
  }
}

}  // namespace

const QuantityTraits& traits_of(Kind kind) {
  static constexpr QuantityTraits kTraits[] = {
      {"body", "position", 3, "m", "world"},
      {"body", "velocity", 3, "m/s", "world"},
      {"body", "angular_velocity", 3, "rad/s", "world"},
      {"body", "orientation", 4, "1", "world"},
      {"joint", "force", 3, "N", "F"},
      {"joint", "moment", 3, "N m", "F"},
      {"joint", "angle", 1, "rad", ""},
      {"joint", "displacement", 1, "m", ""},
      {"element", "translation", 3, "m", "F"},
      {"element", "rotation", 3, "rad", "F"},
      {"element", "force", 3, "N", "F"},
      {"element", "moment", 3, "N m", "F"},
      {"rotational", "rotation", 1, "rad", ""},
      {"rotational", "moment", 1, "N m", ""},
      {"bushing", "translation", 3, "m", "F"},
      {"bushing", "rotation", 3, "rad", "F"},
      {"bushing", "force", 3, "N", "F"},
      {"bushing", "moment", 3, "N m", "F"},
      {"spring", "length", 1, "m", ""},
      {"spring", "force", 1, "N", ""},
      {"rotational_spring", "angle", 1, "rad", ""},
      {"rotational_spring", "torque", 1, "N m", ""},
      {"cable", "length", 1, "m", ""},
      {"cable", "force", 1, "N", ""},
  };
  static_assert(std::size(kTraits) == kQuantityKinds);
  return kTraits[static_cast<size_t>(kind)];
}

std::vector<std::string> column_names(Kind kind) {
  const QuantityTraits& t = traits_of(kind);
  if (t.components == 1) return {t.word};
  if (t.components == 4) return {"w", "x", "y", "z"};
  return {"x", "y", "z"};
}

std::vector<double> calc_quantity(const Quantity& q, const View& v) {
  if (q.kind == Kind::Orientation) {
    const Quat r = pose_at(v, q.index).q;
    return {r.w, r.x, r.y, r.z};
  }
  if (traits_of(q.kind).components == 1) return {calc_scalar(q, v)};
  const Vec3 r = calc_vector(q, v);
  return {r.x, r.y, r.z};
}

double calc_component(const Quantity& q, int component, const View& v) {
  if (traits_of(q.kind).components == 1) {
    const double x = calc_scalar(q, v);
    return component == 3 ? std::abs(x) : x;
  }
  const Vec3 r = calc_vector(q, v);
  return component == 3 ? norm(r) : r[component];
}

}  // namespace topple::mbs
