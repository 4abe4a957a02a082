#pragma once
/// The special multibody system as a constant description. Rigid bodies, ideal joints, force elements, contact, events.
/// SI; W is the inertial frame; a body's frame B has its origin in the centre of mass. Knows no concrete.

#include <string>
#include <vector>

#include "base/id.h"
#include "base/linalg.h"
#include "mbs/laws.h"

namespace topple::mbs {

using BodyId = Id<struct BodyTag>;
using JointId = Id<struct JointTag>;
using ElementId = Id<struct ElementTag>;
using LawId = Id<struct LawTag>;

inline constexpr BodyId kGround{-1};  // the inertial frame as a partner of joints and elements

/// Contact geometry fixed in a body.
struct Shape {
  enum class Kind { Box, Sphere, Hull, Plane };
  Kind kind = Kind::Box;
  Pose X_BS;                   // frame S of the shape: centre of a box or sphere, surface of a plane
  Vec3 half;                   // half edges of a box [m]
  double radius = 0;           // of a sphere [m]
  std::vector<Vec3> vertices;  // of a hull, in S; those inside the convex hull of the others count for nothing [m]
  // A plane is the half-space z <= 0 of S; only fixed bodies have one.
};

struct Body {
  std::string name;
  double mass = 1;                  // [kg]
  Mat3 inertia = Mat3::identity();  // about the centre of mass, axes of B [kg·m²]
  Pose X_WB;                        // at the start
  Vec3 v_WB;                        // of the centre of mass, in W [m/s]
  Vec3 w_WB;                        // in W [rad/s]
  std::vector<Shape> shapes;        // empty: touches nothing
  bool fixed = false;               // never moves (stumps, footings)
};

/// A station where inelastic rotation gathers, on the member's axis.
struct Station {
  double x = 0;  // from the marker, along x of F [m]
  LawId law;
};

/// How a station about an axis cracks before it has ever yielded: the rotation that cracks add rises along a straight
/// line from 0 at `begin` to `flexibility` times the moment at `end`, and goes back from there towards `begin`, or what
/// has cracked, of the other side.
struct Cracking {
  double begin[2] = {0, 0}, end[2] = {0, 0};  // moments > 0, and magnitudes of those < 0 [N·m]
  double flexibility = 0;                     // at `end`; 0: does not crack [rad/(N·m)]
};
/// Rotation on that line [rad].
///   side    0: moments > 0, 1: those < 0
///   moment  without its sign, from `begin` to `end` [N·m]
inline double calc_crack_rotation(const Cracking& c, int side, double moment) {
  return c.flexibility * c.end[side] * (moment - c.begin[side]) / (c.end[side] - c.begin[side]);
}

/// Six-component force element between marker F on body a and marker M on body b, at rest where F = M.
/// Elastic in series with the inelastic rotations of its stations (one for a zone; two, at x = -L/2 and +L/2 with the
/// markers at mid-length, for a whole prismatic member: exact with diagonal stiffness EA/L, 12EI/L³, GJ/L, EI/L). Axial
/// force, shear and torsion follow the law of the first station.
struct ZoneElement {
  std::string name;
  BodyId a, b;
  Pose X_AF, X_BM;
  Vec3 translational_stiffness;   // along x, y, z of F [N/m]
  Vec3 rotational_stiffness;      // about x, y, z of F [N·m/rad]
  double damping_ratio = 0.05;    // share of critical damping at Model::damping_frequency, 0 to 0.2
  std::vector<Station> stations;  // none: elastic; at most two
  // Length over which the member can be crushed, one zone after the other, where that is more than the law's
  // crush_length; boxes along it get shorter with it. A law that buckles or
  // keeps_length keeps its own. [m]
  double crush_through = 0;
  Cracking cracking[2];  // of each station, about y and about z
};

/// Two bodies joined by an ideal joint between frame F on the parent and frame M on the child. What each kind holds
/// must be closed at the start; what it leaves free may have any value:
///   Fixed        F = M
///   Revolute     same origin, Fz = Mz (the axis)
///   Spherical    same origin
///   Universal    same origin, Fx (first axis, of the parent) at right angles to My (second axis, of the child)
///   Prismatic    same axes, origin of M on the axis Fz
///   Cylindrical  Fz = Mz, origin of M on it
///   Distance     the distance between the origins stays what it is at the start
/// x of F points from the parent to the child where a member's axis matters (limits). The reaction is that of the
/// parent on the child at the origin of M, in the axes of F: pulled apart, its x component is negative.
struct Joint {
  enum class Kind { Fixed, Revolute, Spherical, Universal, Prismatic, Cylindrical, Distance };
  Kind kind = Kind::Fixed;
  std::string name;
  BodyId parent, child;
  Pose X_PF, X_CM;
  // The joint is released for good when its reaction in F passes one of these.
  double tension_limit = kUnlimited;   // pull along x of F, of a distance joint along its line [N]
  double shear_limit = kUnlimited;     // resultant across that [N]
  double moment_limit = kUnlimited;    // resultant of the constrained moments [N·m]
  double rotation_limit = kUnlimited;  // |angle| of a revolute or cylindrical joint [rad]
};

/// A scalar law of a spring or a damper: force against deformation, or against its rate. The force is what the element
/// pulls with (tension, or a moment against the rotation), so that a stable spring rises.
struct Characteristic {
  enum class Kind { Linear, Polynomial, Table };
  Kind kind = Kind::Linear;
  double rate = 0;                   // Linear: slope [N/m, N·s/m, N·m/rad, N·m·s/rad]
  std::vector<double> coefficients;  // Polynomial: c0 + c1 x + c2 x² + ...
  std::vector<double> x, f;          // Table: x rising, at least two; linear between, constant beyond the ends
};

/// Spring and damper along the line between two points. Positive force pulls the points together.
struct SpringDamper {
  std::string name;
  BodyId a, b;
  Vec3 p_A, p_B;           // in the bodies' frames; in W for the ground
  double free_length = 0;  // [m]
  Characteristic spring;   // of length - free_length [m] -> [N]
  Characteristic damper;   // of the rate of length [m/s] -> [N]
  double tension_strength = kUnlimited, compression_strength = kUnlimited;  // the spring breaks above [N]
};

/// Torsion spring and damper about the axis Fz = Mz of a revolute or cylindrical joint; positive torque turns the child
/// back towards smaller angles.
struct RotationalSpring {
  std::string name;
  JointId joint;
  double free_angle = 0;         // [rad]
  Characteristic spring;         // of angle - free_angle [rad] -> [N·m]
  Characteristic damper;         // of its rate [rad/s] -> [N·m]
  double strength = kUnlimited;  // |spring torque| at which it breaks [N·m]
};

/// Six-component bushing between marker F on body a and M on body b: each component follows its own law. Translations
/// are those of M's origin along the axes of F, rotations the components of the rotation vector from F to M in F.
struct Bushing {
  std::string name;
  BodyId a, b;
  Pose X_AF, X_BM;
  Characteristic spring[6];  // x y z [m] -> [N], x y z [rad] -> [N·m]
  Characteristic damper[6];  // of their rates
  double strength[6] = {kUnlimited, kUnlimited, kUnlimited, kUnlimited, kUnlimited, kUnlimited};  // breaks above
};

/// Force and torque on a body, constant or following a table of time.
struct Load {
  std::string name;
  BodyId body;
  Vec3 p_B;                          // where the force acts, in the body's frame [m]
  Vec3 force, torque;                // [N, N·m]
  bool follows_body = false;         // components in the body's frame instead of W
  std::vector<double> time, factor;  // both empty: 1 at all times; linear between, constant beyond the ends
};

/// Rotational force element of a revolute joint about its axis Fz = Mz: elastic with the moment_z limits of a law, the
/// normal force being the joint's own reaction along x of F (of the step before).
struct RotationalElement {
  std::string name;
  JointId joint;
  double stiffness = 0;         // [N·m/rad]
  double damping_ratio = 0.05;  // as of a zone element
  LawId law;                    // invalid: elastic
  Cracking cracking;            // as of a zone element, about z of F
  ElementId axial_element;      // takes the elongation that comes with this one's rotation; invalid: none
  // in place of the joint once an action has loosened it, at the origin of M; all 0: it cannot be loosened
  Vec3 loose_translational;                     // along x, y, z of F [N/m]
  double loose_torsion = 0, loose_bending = 0;  // about x, y of F [N·m/rad]
};
inline bool can_be_loosened(const RotationalElement& r) {
  const Vec3& k = r.loose_translational;
  return k.x > 0 && k.y > 0 && k.z > 0;
}

/// Tension-only cable between a point of a body and a point of another (or of the ground).
struct Cable {
  std::string name;
  BodyId a, b;
  Vec3 p_A, p_B;                 // in the bodies' frames; in W for the ground
  double stiffness = 0;          // [N/m]
  double pretension = 0;         // at the start [N]
  double strength = kUnlimited;  // breaks above [N]
};

/// Half-space of solid ground and how bodies touch. A pair's contact is a nonlinear spring whose rate follows from the
/// masses: frequency `contact_frequency` [rad/s] with the pair's reduced mass.
struct Contact {
  /// Rules for two bodies (or a body and the ground) that differ from the general ones.
  struct Pair {
    BodyId a, b;          // b may be the ground
    bool touches = true;  // false: they pass through each other
    double friction = 0.6;
    double restitution = 0.1;
    double stiffness = 0;  // of a point; 0: from masses and contact_frequency [N/m]
    double damping = -1;   // of a point, instead of restitution where >= 0 [N·s/m]
  };
  Vec3 normal{0, 0, 1};  // of the ground's plane, unit length
  double offset = 0;     // the plane is dot(normal, p) = offset [m]
  double friction = 0.6;
  double restitution = 0.1;  // Poisson
  double body_friction = 0.6;
  double body_restitution = 0.1;
  double contact_frequency = 1500;  // [rad/s]
  bool ground = true;               // bodies touch the ground
  bool bodies = true;               // bodies touch each other
  std::vector<Pair> pairs;
};

/// Something of the running system that an event can wait for or an output can ask for.
struct Quantity {
  enum class Kind {
    Position,            // body: origin of its frame, in W [m]
    Velocity,            // body: of its centre of mass, in W [m/s]
    AngularVelocity,     // body, in W [rad/s]
    Orientation,         // body: rotation vector of R_WB (outputs: quaternion) [rad]
    JointForce,          // joint: reaction on the child, in F [N]
    JointMoment,         // joint, in F [N·m]
    JointAngle,          // revolute or cylindrical joint [rad]
    JointDisplacement,   // prismatic or cylindrical joint, along Fz [m]
    ElementTranslation,  // zone element: of M against F, in its axes [m]
    ElementRotation,     // zone element [rad]
    ElementForce,        // zone element: of a on b, in its axes [N]
    ElementMoment,       // zone element [N·m]
    HingeRotation,       // rotational element: of its joint [rad]
    HingeMoment,         // rotational element: of the parent on the child, about Fz [N·m]
    BushingTranslation,  // bushing, as of a zone element
    BushingRotation,
    BushingForce,
    BushingMoment,
    SpringLength,   // spring-damper [m]
    SpringForce,    // spring-damper, pull positive, damper included [N]
    TorsionAngle,   // rotational spring: angle - free_angle [rad]
    TorsionTorque,  // rotational spring, damper included [N·m]
    CableLength,    // cable: between its ends [m]
    CableForce      // cable [N]
  };
  Kind kind = Kind::Position;
  int index = -1;  // of the body, joint, element ... in its list
};

/// An event that waits until a component of a quantity passes a limit.
struct Trigger {
  Quantity quantity;
  int component = 0;   // 0 1 2: x y z (0 for a scalar); 3: magnitude
  double limit = 0;    // unit of the quantity
  bool rising = true;  // fires at the first step with value >= limit; false: value <= limit
};

/// What a run writes: one quantity at a rate.
struct Output {
  std::string name;
  Quantity quantity;
  double rate = 100;  // [1/s]
};

/// What an event does.
struct Action {
  enum class Kind {
    RemoveElement,  // element, or rotational
    SwitchLaw,      // element: the limits of all its stations go over to those of `law` within `ramp`
    ReleaseJoint,   // joint
    ReplaceBody,   // body: mass, inertia and shapes of `replacement`; X_WB of it is its new centre of mass in the old B
    ReleaseCable,  // cable
    RemoveSpring,  // index: spring-damper
    RemoveRotationalSpring,  // index
    RemoveBushing,           // index
    RemoveLoad,              // index; a load is there from the start
    ApplyLoad,               // index; makes a load that some event applies absent until then; its table starts then
    LoosenJoint              // joint: its rotational element takes over as a six-component element by all of its law
  };
  Kind kind = Kind::RemoveElement;
  ElementId element;
  JointId joint;
  BodyId body;
  int cable = -1;
  int index = -1;       // spring, rotational spring, bushing or load
  int rotational = -1;  // RemoveElement, SwitchLaw: a rotational element instead of an element
  LawId law;
  double ramp = 0;             // [s]
  double stiffness_share = 1;  // SwitchLaw: of the element's own stiffness after the ramp, (0, 1000]
  Body replacement;
};

struct Event {
  double time = 0;  // when it fires, or from when on its trigger is looked at [s]
  std::string name;
  std::vector<Trigger> triggers;  // empty: at the time; else once, when the first of them holds
  std::vector<Action> actions;
};

struct Model {
  std::string name;
  Vec3 gravity{0, 0, -9.81};  // [m/s²]
  /// Where the damping of elements peaks; it falls with the distance from it in both directions (standard linear
  /// solid), so it costs the step nothing and resists no rigid motion [rad/s].
  double damping_frequency = 62.8;
  /// Bodies keep to planes y = const of W and turn about y alone: a slice of something that is alike along y.
  bool is_planar = false;
  std::vector<Body> bodies;
  std::vector<Joint> joints;
  std::vector<ZoneElement> elements;
  std::vector<RotationalElement> rotational_elements;
  Laws laws;
  std::vector<Cable> cables;
  std::vector<SpringDamper> springs;
  std::vector<RotationalSpring> rotational_springs;
  std::vector<Bushing> bushings;
  std::vector<Load> loads;
  Contact contact;
  std::vector<Event> events;  // any order; same times fire in this order
  std::vector<Output> outputs;
};

BodyId add_body(Model&, Body);
JointId add_joint(Model&, Joint);
ElementId add_element(Model&, ZoneElement);
LawId add_law(Model&, SharedLaw);

/// Throws InputError with every complaint: ids out of range, masses or inertias not positive (definite), tables that do
/// not rise, numbers that are not finite, frames of a joint that do not meet.
void check_model(const Model&);

}  // namespace topple::mbs
