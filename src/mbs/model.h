#pragma once
/// The special multibody system as a constant description. Rigid bodies, ideal joints, force elements, contact, events.
/// SI; W is the inertial frame; a body's frame B has its origin in the centre of mass. Knows no concrete.

#include <limits>
#include <string>
#include <vector>

#include "base/id.h"
#include "base/linalg.h"

namespace topple::mbs {

using BodyId = Id<struct BodyTag>;
using JointId = Id<struct JointTag>;
using ElementId = Id<struct ElementTag>;
using LawId = Id<struct LawTag>;

inline constexpr BodyId kGround{-1};  // the inertial frame as a partner of joints and elements
inline constexpr double kUnlimited = std::numeric_limits<double>::infinity();

/// Contact geometry fixed in a body.
struct Shape {
  enum class Kind { Box, Sphere };
  Kind kind = Kind::Box;
  Pose X_BS;          // centre of the shape
  Vec3 half;          // half edges of a box [m]
  double radius = 0;  // of a sphere [m]
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

/// Magnitude of a force against a displacement that only grows; linear between points, constant after the last.
struct Curve {
  std::vector<double> x;  // rising from 0
  std::vector<double> f;  // >= 0
};

/// Limit moments of one axis against plastic rotation, one row for each normal force (tension positive).
/// K forces, J rotations; outside the range of forces the limit is 0.
struct MomentFamily {
  std::vector<double> normal_force;      // rising [N] (K)
  std::vector<double> plastic_rotation;  // rising from 0 [rad] (J)
  std::vector<double> positive;          // limit for moments > 0 [N·m] (K x J)
  std::vector<double> negative;          // magnitude of the limit for moments < 0 [N·m] (K x J)
};

/// Limits of what a zone can transmit: an rcc in the form of the multibody system (docs/theory/zones.md).
/// Axes: x along the member from a to b, y and z across. An empty curve or family means unlimited (elastic).
struct ZoneLaw {
  std::string name;
  MomentFamily moment_y, moment_z;
  double biaxial_exponent = 1.5;           // (|My|/Ly)^p + (|Mz|/Lz)^p <= 1
  double damage_share = 0;                 // share of the inelastic rotation that is recovered on unloading, 0..1
  double rupture_rotation = kUnlimited;    // plastic rotation at which the element breaks altogether [rad]
  Curve compression;                       // limit against plastic shortening [m] -> [N]
  Curve tension;                           // limit against plastic elongation [m] -> [N]
  double crush_length = kUnlimited;        // plastic shortening at which the element breaks [m]
  double rupture_elongation = kUnlimited;  // plastic elongation at which it breaks [m]
  double shear_y = kUnlimited, shear_z = kUnlimited;  // limits without normal force [N]
  double shear_friction = 0;                          // further limit per newton of compression
  double slip_softening = kUnlimited;  // slip over which the shear limits fall to their friction part [m]
  double slip_rupture = kUnlimited;    // slip at which the element breaks [m]
  double torsion = kUnlimited;         // [N·m]
  double twist_rupture = kUnlimited;   // [rad]
};

/// A station where inelastic rotation gathers, on the member's axis.
struct Station {
  double x = 0;  // from the marker, along x of F [m]
  LawId law;
};

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
};

/// Two bodies joined by an ideal joint. Frames F on the parent and M on the child coincide at the start; x of F points
/// from the parent to the child where a member's axis matters, the axis of a revolute joint is Fz = Mz. The reaction is
/// that of the parent on the child, in F: pulled apart, its x component is negative.
struct Joint {
  enum class Kind { Fixed, Revolute };
  Kind kind = Kind::Fixed;
  std::string name;
  BodyId parent, child;
  Pose X_PF, X_CM;
  // The joint is released for good when its reaction in F passes one of these.
  double tension_limit = kUnlimited;   // pull along x of F [N]
  double shear_limit = kUnlimited;     // resultant across x of F [N]
  double moment_limit = kUnlimited;    // resultant of the constrained moments [N·m]
  double rotation_limit = kUnlimited;  // |angle| of a revolute joint [rad]
};

/// Rotational force element of a revolute joint about its axis Fz = Mz: elastic with the moment_z limits of a law, the
/// normal force being the joint's own reaction along x of F (of the step before).
struct RotationalElement {
  std::string name;
  JointId joint;
  double stiffness = 0;         // [N·m/rad]
  double damping_ratio = 0.05;  // as of a zone element
  LawId law;                    // invalid: elastic
};

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
  Vec3 normal{0, 0, 1};  // of the ground's plane, unit length
  double offset = 0;     // the plane is dot(normal, p) = offset [m]
  double friction = 0.6;
  double restitution = 0.1;  // Poisson
  double body_friction = 0.6;
  double body_restitution = 0.1;
  double contact_frequency = 1500;  // [rad/s]
  bool ground = true;               // bodies touch the ground
  bool bodies = true;               // bodies touch each other
};

/// What an event does.
struct Action {
  enum class Kind {
    RemoveElement,  // element
    SwitchLaw,      // element: the limits of all its stations go over to those of `law` within `ramp`
    ReleaseJoint,   // joint
    ReplaceBody,  // body: mass, inertia and shapes of `replacement`; X_WB of it is its new centre of mass in the old B
    ReleaseCable  // cable
  };
  Kind kind = Kind::RemoveElement;
  ElementId element;
  JointId joint;
  BodyId body;
  int cable = -1;
  int rotational = -1;  // SwitchLaw: a rotational element instead of an element
  LawId law;
  double ramp = 0;             // [s]
  double stiffness_share = 1;  // SwitchLaw: what is left of the element's stiffness after the ramp, (0, 1]
  Body replacement;
};

struct Event {
  double time = 0;  // [s]
  std::string name;
  std::vector<Action> actions;
};

struct Model {
  std::string name;
  Vec3 gravity{0, 0, -9.81};  // [m/s²]
  /// Where the damping of elements peaks; it falls with the distance from it in both directions (standard linear
  /// solid), so it costs the step nothing and resists no rigid motion [rad/s].
  double damping_frequency = 62.8;
  std::vector<Body> bodies;
  std::vector<Joint> joints;
  std::vector<ZoneElement> elements;
  std::vector<RotationalElement> rotational_elements;
  std::vector<ZoneLaw> laws;
  std::vector<Cable> cables;
  Contact contact;
  std::vector<Event> events;  // any order; same times fire in this order
};

BodyId add_body(Model&, Body);
JointId add_joint(Model&, Joint);
ElementId add_element(Model&, ZoneElement);
LawId add_law(Model&, ZoneLaw);

/// Throws InputError with every complaint: ids out of range, masses or inertias not positive (definite), tables that do
/// not rise, numbers that are not finite, frames of a joint that do not meet.
void check_model(const Model&);

}  // namespace topple::mbs
