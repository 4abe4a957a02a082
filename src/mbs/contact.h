#pragma once
/// What contact remembers from step to step, and the points of one step (docs/theory/contact.md).

#include <compare>
#include <vector>

#include "mbs/boxes.h"
#include "mbs/contact_law.h"
#include "mbs/model.h"

namespace topple::mbs {

/// Displacement of a friction spring, of the first body against the second.
struct Stick {
  Vec3 slip;         // [m]
  double twist = 0;  // about the normal [rad]
};

/// Contact shape in its body's frame.
struct CompiledShape {
  Shape::Kind kind = Shape::Kind::Box;
  Vec3 p_BS;
  Mat3 R_BS;
  Vec3 half;
  double radius = 0;
  double reach = 0;          // radius of the sphere around p_BS that holds it, infinite for a plane [m]
  int hull = -1;             // into System::hulls
  int first_corner = 0;      // into State::ground_points: 8 of a box, 1 of a sphere, the vertices of a polyhedron
  bool is_clear = false;     // no point touches the ground or remembers that it did
  bool is_touching = false;  // the ground
  Stick stick;               // to the ground
};

/// A corner's contact with the ground.
struct GroundPoint {
  double born = 0;      // penetration allowed because it was there when contact became possible [m]
  bool active = false;  // contact is possible
};

/// Two bodies near each other.
struct PairState {
  int a = -1, b = -1;            // bodies, a < b
  int shape_a = 0, shape_b = 0;  // indices within the bodies
  int law = 0;                   // into System::contact_laws
  int axis = 0;                  // separating axis of the last look
  double allowed = 0;            // penetration without force [m]
  double depth = 0;              // of the deepest point beyond it at the last look, or minus the gap [m]
  double way = 0;                // State::travel of both bodies then [m]
  bool touching = false;
  Stick stick;
};

/// Two bodies with rules of their own, a < b.
struct PairRule {
  int a = 0, b = 0, law = 0;
  friend auto operator<=>(const PairRule&, const PairRule&) = default;
};

/// A body as the contacts of one step see it. The ground and fixed bodies neither move nor give way.
struct ContactBody {
  Vec3 v, w;    // half a step ago
  Vec3 dv, dw;  // what the forces known so far add within the step
  Vec3 force, torque;
  double inverse_mass = 0;
  Mat3 inverse_inertia;  // in W
  int groups = 0;
};

/// A point at which two bodies touch, or one and the ground.
struct ContactPoint {
  Vec3 ra, rb;           // from the mass centres [m]
  Vec3 la, lb;           // levers of the normal force
  double depth = 0;      // [m]
  double stiffness = 0;  // k [N/m]
  double full = 0;       // k δ [N]
  double speed = 0;      // of approach, half a step ago [m/s]
  double change = 0;     // what the forces known so far add to it within the step
  double impedance = 0;  // sqrt(k m) with the mass m felt along the normal [N·s/m]
  double rate = 0;       // of the dashpot [N·s/m]
  double normal = 0;     // normal force [N]
  double dashpot = 0;    // its part by the dashpot [N]
  Vec3 held;             // force of the friction spring on a [N]
  Vec3 slide;            // speed of a against b across the normal
  Vec3 friction;         // on a [N]
};

/// Points of a pair of shapes, or of one on the ground, with a common normal and friction spring.
struct ContactGroup {
  int a = 0, b = 0;  // bodies; B stands for the ground
  int first = 0, count = 0;
  Vec3 n;  // from a to b
  const ContactLaw* law = nullptr;
  Stick* stick = nullptr;
  double stiffness = 0;  // k of one corner of a box [N/m]
  bool fresh = false;    // not touched in the step before
  double held = 0;       // energy of the friction spring [J]
};

/// The contacts of one step; scratch.
struct ContactScratch {
  std::vector<ContactBody> body;  // (B + 1), the last is the ground
  std::vector<int> touched;       // bodies in groups
  std::vector<ContactPoint> point;
  std::vector<ContactGroup> group;
};

}  // namespace topple::mbs
