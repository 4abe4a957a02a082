#pragma once
/// What contact remembers from step to step, and the points of one step (docs/theory/contact.md).

#include <compare>
#include <cstdint>
#include <vector>

#include "base/aligned.h"
#include "base/disjoint_sets.h"
#include "mbs/boxes.h"
#include "mbs/contact_law.h"
#include "mbs/ground_kernel.h"
#include "mbs/lane_array.h"
#include "mbs/model.h"

namespace topple::mbs {

inline constexpr double kContactAngle = 0.18;  // of a contact's swing in a step that the engine chooses, at most [rad]

/// A friction spring at a touching point, as the step before left it.
struct Stick {
  Vec3 at;    // from the first body's mass centre [m]
  Vec3 slip;  // of the first body against the second [m]
};

/// Those of a pair, or of a shape on the ground.
struct StickRange {
  int first = 0, count = 0;  // in ContactScratch::sticks
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
  int crushed = -1;          // into State::crushed_boxes: the member whose end it has
  int first_corner = 0;      // into State::ground_points: 8 of a box, 1 of a sphere, the vertices of a polyhedron
  bool is_straight = false;  // its axes are those of the body
  bool is_clear = false;     // no point touches the ground or remembers that it did
  bool is_touching = false;  // the ground
  StickRange sticks;         // to the ground
  int group = -1;            // on the ground, in Touching::group of the last look, of a member that can be crushed
};

/// A corner's contact with the ground.
struct GroundPoint {
  double born = 0;      // penetration allowed because it was there when contact became possible [m]
  bool active = false;  // contact is possible
  bool touches = false;
};

/// What a body of one box remembers of the ground where it touches nothing else; fields as kernel::GroundState.
struct GroundBox {
  double born[8];                           // [m]
  Vec3 slip[8];                             // [m]
  double loss = 0, loss_power = 0;          // [J, W]
  double friction = 0, friction_power = 0;  // [J, W]
  double pressed = 0, stuck = 0;            // [J]
  Vec3 push;                                // [N]

  GroundBox() { forget(); }
  /// No corner touches or has been where contact is possible.
  void forget() {
    for (double& x : born) x = -1;
    for (Vec3& x : slip) x = {kUnlimited, 0, 0};
  }
};
template <>
struct Components<GroundBox> {
  static constexpr size_t D = kernel::kGroundFields;
};

/// Two shapes near each other, in an order that does not depend on the bodies' numbers, and when to look at them again.
struct PairDue {
  double way = 0;                // of both bodies, before which they cannot meet [m]
  int a = -1, b = -1;            // bodies
  int shape_a = 0, shape_b = 0;  // into State::shapes
  bool are_boxes = false;
  bool touching = false;
};

/// What else is remembered of them.
struct PairState {
  int law = 0;         // into System::contact_laws
  int axis = 0;        // that separated two polyhedra at the last look
  double allowed = 0;  // penetration without force [m]
  double depth = 0;    // of the deepest point beyond it at the last look, or minus the gap [m]
  double way = 0;      // State::travel of both bodies then [m]
  double speed = 0;    // of one of the shapes against the other then, at most [m/s]
  StickRange sticks;
  int group = -1;  // in Touching::group of the last look, -1: did not touch
};

/// Two shapes near each other whose bodies are linked: a pair once the link ends. In the order of pairs.
struct HeldPair {
  int a = -1, b = -1;            // bodies
  int shape_a = 0, shape_b = 0;  // into State::shapes
};

/// Two bodies with rules of their own, a < b.
struct PairRule {
  int a = 0, b = 0, law = 0;
  friend auto operator<=>(const PairRule&, const PairRule&) = default;
};

/// A point at which two bodies touch, or one and the ground, as it is found.
struct ContactPoint {
  Vec3 at;               // from the first body's mass centre [m]
  double depth = 0;      // [m]
  double stiffness = 0;  // k [N/m]
  Vec3 slip;             // displacement of the friction spring [m]
  bool is_fresh = true;  // not touched in the step before
  double unseen = 0;     // steps within which it may have been met, at its speed now; 0: it touched before
};

/// Energy that a pair's points leave to those that are found after them [J].
struct Earnings {
  double stored = -1;  // kernel::kEarned
  double spent = 0;    // kernel::kSpent
};

/// Points of a pair of shapes, or of one on the ground, with a common normal.
struct ContactGroup {
  int a = 0, b = 0;  // into the touched bodies
  int first = 0, count = 0;
  Vec3 n;                                 // from a to b
  Vec3 apart;                             // from b's mass centre to a's, 0 on the ground [m]
  int law = 0;                            // into System::contact_laws
  double stiffness = 0;                   // k of one corner of a box [N/m]
  double stick = 0;                       // the same for the friction spring [N/m]
  double mobility_a = 0, mobility_b = 0;  // of bodies that joints hold, along n, 0: of others [1/kg]
  bool hands_on = false;  // its energy goes over to the points that are found next; corners on the ground stay what
                          // they are, unless they are those of a member that can be crushed
  Earnings earnings;
  std::uint32_t slot = 0;  // in the kernel's blocks
};

/// A shape in the search: the box around it and what surely touches nothing farther.
struct ShapeBounds {
  double low[3], high[3];
  int body = 0, shape = 0;       // shape: into State::shapes
  int first_slab = 0, last = 0;  // slabs that it reaches into
};

/// Who may be near whom; scratch of the search.
struct PairSearch {
  bool has_links = false;
  std::vector<size_t> grounded_elements, grounded_bushings, grounded_joints;  // tied to what does not move
  std::vector<int> first_link, link;                                          // bodies that each body is tied to
  std::vector<int> first_link_before, link_before;
  std::vector<unsigned char> relinked;  // whether they are others than those before (B)
  std::vector<ShapeBounds> bounds;      // by place
  std::vector<int> first_in_slab, in_slab, unbounded, near, hits;
  std::vector<ShapeBounds> here;  // of one slab
  std::vector<double> extents, ways, speeds;
  std::vector<std::uint64_t> found, held, sorted;  // ranks of both shapes
  std::vector<std::uint32_t> next;
  std::vector<int> first_old, old;  // old pairs of each shape
  std::vector<PairState> pairs;
  std::vector<PairDue> due;
  std::vector<double> clock;
  std::vector<unsigned char> fast;
};

/// A pair that is due.
struct PairLook {
  size_t pair = 0;  // into State::pairs
  double way = 0;   // of both bodies [m]
  size_t slot = 0;  // two boxes: in the kernel's blocks
};

/// A body with joints that touches something.
struct JointedBody {
  int body = 0;
  int place = 0;            // among the touched bodies
  int cluster = -1;         // into Touching::jointed_clusters; -1: its joints have ended
  size_t first_answer = 0;  // into Touching::joint_answers: six times the cluster's rows, as JointedMobility has them
  /// What joints add to its speeds in the step by other forces than those of contact, beyond what they answered in the
  /// step before [m/s, rad/s].
  Vec3 more_v, more_w;
};

/// A cluster one of whose bodies touches something.
struct JointedCluster {
  int rows = 0;
  size_t first_rate = 0;                       // into ContactScratch::joint_rates
  size_t first_meeting = 0, last_meeting = 0;  // into Touching::meetings
};

/// A joint of such a cluster at one of its bodies.
struct JointMeeting {
  int body = 0, first_row = 0, rows = 0;
  size_t at = 0;  // into Touching::meeting_rows: of each unit force and torque on the body its rows of J M⁻¹
};

/// What joints take of the motion that forces on one body, or on another one of its cluster, would give it.
struct JointedPair {
  int to = 0, from = 0;  // into Touching::held
  double coupling = 1;   // how much one of them feels the other, 0 to 1
  double less[36] = {};  // v, w over force, torque, row by row
};

/// What joints leave of the mobility of a body; scratch of a look.
struct JointedMobility {
  int body = 0, cluster = 0;
  std::vector<double> rows, answers;  // six columns: J M⁻¹ of unit forces and torques, and (J M⁻¹ Jᵀ)⁺ of these
  double less[36] = {}, left[36] = {};  // taken from the body's own, and what it has then
};

/// A group whose dashpots act as one with those of the others of its number.
struct GroupTogether {
  int group = 0;   // of Touching::group
  int number = 0;  // the last of the touched bodies, or of those that move as one with it, that they meet
};

/// What touches, as the last look found it. T touched bodies; the first stands for the ground and all fixed ones.
struct Touching {
  int steps = 0;          // since then
  std::vector<int> body;  // B for the ground (T)
  std::vector<ContactGroup> group;
  // the kernel's blocks, groups of like counts of points together
  std::vector<std::uint32_t> rows, a, b;
  AlignedVector<double> groups, points;
  AlignedVector<double> share;          // groups of each body, filled up to blocks (T)
  std::vector<GroupTogether> together;  // in the order of groups
  // of bodies that joints hold
  std::vector<JointedBody> held;
  std::vector<JointedPair> jointed_pairs;
  std::vector<JointedCluster> jointed_clusters;
  std::vector<JointMeeting> meetings;
  std::vector<double> meeting_rows, joint_answers;
  std::vector<int> held_block;        // of each block, into held_fields; -1: none. Empty: nowhere any
  AlignedVector<double> held_fields;  // kernel::kHeldFields a block
};

/// Scratch of contacts.
struct ContactScratch {
  std::vector<int> place;                                        // of each body among those touched, -1: is not (B)
  std::vector<int> groups;                                       // of each touched body
  AlignedVector<double> touched, rows, changes, sums, wrenches;  // as of kernel::TouchJob and ContactJob
  std::vector<std::uint32_t> vectors, tensors;                   // places of what belongs to them
  std::vector<ContactPoint> point;
  std::vector<Stick> sticks;       // of all points of the step before
  std::vector<Earnings> earnings;  // of all groups of the step before
  double lost = 0;                 // by pairs that touched before and do not now [J]
  std::vector<std::uint32_t> by_count;
  std::vector<std::uint32_t> candidates;  // pairs that may be due
  std::vector<PairLook> looks;
  AlignedVector<double> boxes;              // rows for the kernel, one a shape and one for idle lanes
  std::vector<long> box_step;               // in which a row was written
  std::vector<std::uint32_t> box_a, box_b;  // which of them, in the kernel's blocks of pairs of boxes
  AlignedVector<double> box_answers;
  PairSearch search;
  std::vector<JointedMobility> mobility;
  std::vector<int> mobility_of;    // of each body, -1: none (B)
  std::vector<int> read_clusters;  // of each cluster in this look, into Touching::jointed_clusters, -1: not yet
  std::vector<Vec3> force_before, torque_before;  // all forces on jointed bodies in the step before (B)
  std::vector<double> joint_rates;                // of the rows of all jointed clusters
  std::vector<int> first_of_cluster, next_of_cluster;
  DisjointSets units;                      // of touched bodies that move as one
  std::vector<int> island, count;          // of touched bodies
  std::vector<double> pulls, power, made;  // of dashpots: wrenches on the touched bodies, of each island their power
                                           // and force times the speed that they make
};

}  // namespace topple::mbs
