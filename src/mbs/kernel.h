#pragma once
/// The arithmetic of a step, many at a time in SIMD lanes: bodies' motion and the forces of elements inside their safe
/// bounds. Compiled for several instruction sets, the best one that the machine has is chosen at run time. Every lane
/// does the same operations in the same order whatever is in the others, so its bits do not depend on them.
/// W lanes make a block; field f of a block begins at block + f * W.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace topple::mbs::kernel {

/// Widest block, for those who need room before they know.
inline constexpr size_t kMostLanes = 8;

/// What of an element's six components can be other than zero: all, or those of a plane whose normal is its axis y or
/// z. Bodies of such an element keep to the plane y = const of W and turn about y alone, in which its markers lie.
enum class Plane : unsigned char { Space, AboutY, AboutZ };

/// Components along x, across it and about the normal.
struct ActiveComponents {
  int at[6], count;
};
constexpr ActiveComponents components_of(Plane plane) {
  return plane == Plane::Space    ? ActiveComponents{{0, 1, 2, 3, 4, 5}, 6}
         : plane == Plane::AboutY ? ActiveComponents{{0, 2, 4}, 3}
                                  : ActiveComponents{{0, 1, 5}, 3};
}
/// Bending planes, 0: about y with shear along z, 1: about z with shear along y.
constexpr int first_bending(Plane plane) { return plane == Plane::AboutZ ? 1 : 0; }
constexpr int last_bending(Plane plane) { return plane == Plane::AboutY ? 0 : 1; }

// Field numbers are constants, and named so.
// NOLINTBEGIN(readability-identifier-naming)

/// Fields of an element's slot: what changes in every step, then what seldom does. The latter lie in a pool of lane
/// vectors that blocks share where they are equal, so that large models and batches move less memory.
enum Slot : int {
  kStretch = 0,  // deformation from the offset at the step before (6)
  kBehind = 6,   // stretch of the springs behind the dampers (6)
  kDamped = 12,  // work of the dampers so far
  kBled = 13,    // the part of it on what damage softened
  kStateFields = 14,
  kMarkerA = kStateFields,  // p_AF, from the present centre of mass (3), q_AF (4); in a plane the turn of x about y
  kMarkerB = 21,            // p_BM (3), q_BM (4)
  kStiffness = 28,          // x y z, about x y z (6)
  kViscous = 34,            // stiffness behind the damper over the elastic one
  kRelaxation = 35,         // share of its spring's stretch that a damper takes in a step
  kStation = 36,            // x of both stations (2)
  kLeastForce = 38,         // range of normal force; an empty range sends the element to the full law
  kMostForce = 39,          //
  kMomentScale = 40,        // about y, z (2)
  kShearScale = 42,         // along y, z (2)
  kTorsionScale = 44,       //
  kExponent = 45,           // of the biaxial bound; used as 1, 1.5 or 2, whichever is next below
  kMostTurn = 46,           // sin² of half the largest rotation that the series hold for; infinite for an empty slot
  kOffset = 47,             // inelastic deformation at the marker (6)
  kSoft = 53,               // about y: elastic shear and rotation from both (2 x 2), about z (2 x 2)
  kFlows = 61,              // 1: the law of flowing zones below governs instead of the bounds
  kCrackScale = 62,         // of a station, about y and z, for moments > 0 and < 0 (2 x 2 x 2)
  kSlotFields = 70,
  kConstants = kSlotFields - kStateFields
};
inline constexpr double kLargestTurn = 0.25;  // kMostTurn of a live element: 60 degrees

/// Fields of the slot of a zone that may flow in bending, shear, torsion and compression, or be slack once it has
/// buckled; for tension the full law is asked.
enum Flow : int {
  kAxial = 0,           // plastic elongation
  kSlip = 1,            // along y, z (2)
  kTwist = 3,           //
  kFlowMost = 4,        // normal force at which it flows in tension
  kTurnedFrom = 5,      // lowest rotation of the interval of each family's compression capacity (2)
  kTurnedLeast = 7,     // normal force there at which it flows while the section is whole (2)
  kTurnedSlope = 9,     // and its rise with the rotation (2)
  kTurnedFar = 11,      // rotation up to which that holds
  kTurnedPart = 12,     // 1 where that falls with the section that is left, 0 where not
  kTurnedHinge = 13,    // compression at most, by a hinge of the same member
  kLifted = 14,         // of the plastic elongation, what came with rotation
  kShortened = 15,      // plastic shortening so far
  kCrushed = 16,        // of it, in the step before
  kCurveFrom = 17,      // interval of the compression curve: shortening where it begins ...
  kCurveForce = 18,     // limit there
  kCurveSlope = 19,     // and its rise
  kCurveFar = 20,       // ... and ends
  kWhole = 21,          // section that is left: this, and ...
  kWholePerForce = 22,  // ... so much for each newton of that limit
  kWrittenWhole = 23,   // what was left when the cells were written
  kCrushLength = 24,    //
  kBuckles = 25,        // 1: what has been shortened becomes straight before it pulls
  kShearOwn = 26,       // limits without normal force and slip, along y, z (2)
  kShearFriction = 28,  //
  kSlipped = 29,        // so far
  kSlipSoftening = 30,  // one over the slip at which nothing of the own limits is left
  kSlipRupture = 31,    //
  kTwisted = 32,        // so far
  kTwistRupture = 33,   //
  kTorsion = 34,        // limit
  kFlexibility = 35,    // one over the stiffness, 0 for none (6)
  kBefore = 41,         // deformation at the step before (6)
  kStored = 47,         // elastic energy at the step before
  kPlastic = 48,        // dissipated since the slot was written
  kIdle = 49,           // steps without flow
  kStations = 50,       // both stations, kStationFields each
  kStationFields = 63,
  kFlowFields = kStations + 2 * kStationFields
};
/// Fields of a station: inelastic rotations, damage, and the cell of the moment family about each axis.
enum FlowStation : int {
  kPhi = 0,             // plastic rotation about y, z (2)
  kSoftness = 2,        // flexibility added by damage about y, z (2)
  kReached = 4,         //
  kShare = 5,           // of damage
  kRupture = 6,         // rotation
  kCracked = 7,         // of the softness, by cracks, about y, z (2)
  kBow = 9,             // of the plastic rotation, that of cracks (2)
  kStrained = 11,       // rotation about y that strains the edges as what was reached does
  kRotationRatio = 12,  // that of a rotation about z
  kGrowth = 13,         // one over the moments beyond which cracks grow, about y, z, for moments > 0 and < 0 (2 x 2)
  kCell = 17,           // about y, about z: kCellFields each
  kCellFields = 23
};
/// Fields of a cell, which is two intervals of normal force and one of rotation: the middle force, one over the widths
/// below and above it; the lowest rotation and one over the width; and the limits for positive and for negative moments
/// at (force, rotation): low low, low high, middle low, middle high, high low, high high; then the elongation per
/// rotation, for positive and for negative rotations, at the three forces.
enum FlowCell : int {
  kCellForce = 0,
  kCellRotation = 3,
  kCellPositive = 5,
  kCellNegative = 11,
  kCellLiftPositive = 17,
  kCellLiftNegative = 20
};
/// Steps without flow after which the full law is asked for bounds as soon as forces are far below the limits, and
/// after which again if it found none.
inline constexpr double kLongestIdle = 50, kLongestIdleAgain = 200;
/// Most flexibility that damage adds, over the elastic one: unloading keeps a twentieth of the stiffness.
inline constexpr double kMostDamage = 19;
/// Of two stations that turn one after the other, and the share of its rotation by which none turns any more then.
inline constexpr int kMostSweeps = 200;
inline constexpr double kStill = 1e-11;

/// Fields of a body's constants.
enum BodyField : int {
  kInverseMass = 0,
  kInverseInertia = 1,  // xx xy xz yy yz zz in B
  kDrifts = 7,          // 1: moved here, 0: by the joints or not at all
  kFree = 8,            // 1: gravity acts
  kBodyFields = 9
};
// NOLINTEND(readability-identifier-naming)

/// Of an element: force on a (3; on b the opposite), torque on a (3), and the opposite of that on b (3); in W, about
/// the centres of mass. In a plane all but forces along x and z and torques about y stay zero.
inline constexpr int kForceFields = 9;

/// The spin in the middle of a step is settled until (half the turn of the step)² times its last change is no more than
/// this part of it: beyond that nothing is left of it in the turn.
inline constexpr double kSpinTolerance = 1e-15;
inline constexpr int kMostSpinRounds = 50;

/// One step of all bodies: kick by the forces, then drift of those that nobody else moves.
struct BodyJob {
  size_t blocks = 0;
  double *p, *v, *L, *w, *q, *R;  // 3, 3, 3, 3, 4, 9 fields a block
  const double *force, *torque;   // 3, 3
  const double* constants;        // kBodyFields
  // one value a lane; `shared` lanes: block after block is the same sample's bodies
  const double *kick, *h;             // (W)
  const double *gx, *gy, *gz;         // gravity (W)
  bool is_planar;                     // bodies keep to y = const and turn about y alone
  double* sum;                        // of all places and speeds, finite as long as they are (W)
  std::vector<std::uint32_t>* spins;  // slots that turn too fast for the series, left where they were
};

/// What a spring is whose cracks have grown: where it is without force, and the two by two elastic parts of the shear
/// and bending deformations of both planes.
enum SpringField { kSpringOffset = 0, kSpringSoft = kSpringOffset + 6, kSpringFields = kSpringSoft + 8 };

/// What the cracks of a spring do whose moments are at their bounds.
enum class SpringCracks {
  Hold,    // nothing, and nothing has changed
  Grown,   // it is another spring
  Beyond,  // the full law is to be asked
};

/// What is done to a slot while the kernel waits: to that of a zone that flows, but for the last.
struct FlowWriter {
  /// Writes its cells anew, around a normal force that has left them or a rotation that has; leaves them as they are
  /// where no cell has that force. `force` is that over the section that is left.
  void (*write_cells)(void* owner, size_t slot, double force) = nullptr;
  /// Lets its cracks grow to where they hold at a deformation: six components, `stride` apart. False if they do not.
  bool (*grow_cracks)(void* owner, size_t slot, const double* deformation, size_t stride) = nullptr;
  /// The same of a spring; another one that it becomes goes to kSpringFields numbers, `stride` apart.
  SpringCracks (*crack_spring)(void* owner, size_t slot, const double* deformation, size_t stride,
                               double* spring) = nullptr;
  void* owner = nullptr;
};

/// One evaluation of all elements.
struct ElementJob {
  size_t first = 0, last = 0;            // blocks
  const unsigned char* live;             // per block: live lanes, 0 skips it
  const unsigned char* softened;         // per block: some lane is softened by damage
  const Plane* planes;                   // per block
  const unsigned char* single;           // per block: no element has more than one station
  double* states;                        // kStateFields a block
  const double* pool;                    // vectors of W
  const std::uint32_t* constants;        // which of the pool, kConstants a block
  double* flows;                         // kFlowFields a block
  double* forces;                        // kForceFields a block
  const std::uint32_t *a, *b;            // body slot of each lane (W a block); null: batch
  const std::uint32_t *body_a, *body_b;  // batch: body of each block
  const double *p, *q;                   // batch: of the bodies
  const double* poses;                   // of the bodies, kPoseRow numbers each
  FlowWriter writer;
  std::vector<std::uint32_t>* outside;  // slots that need the full law, untouched
  std::vector<std::uint32_t>* cracked;  // whose constants are no longer those of the spring that they are
};

/// Poses from blocks of bodies to a row for each, so that elements read whole rows: p (3), q (4), 0.
inline constexpr size_t kPoseRow = 8;
struct PoseJob {
  size_t blocks = 0;
  const double *p, *q;  // 3, 4 fields a block
  double* poses;        // W rows a block
};

/// Forces of the elements summed for each body, in the order of `entries`; batch only.
struct SumJob {
  size_t bodies = 0;
  const std::uint32_t *first, *entries;  // 2 * block + side (side 1: body b)
  const double* forces;
  bool is_planar = false;  // nothing but what acts in the plane y = const
  double *force, *torque;
};

size_t lanes();
std::string target_name();
void advance_bodies(const BodyJob&);
void lay_poses(const PoseJob&);
void evaluate_elements(const ElementJob&);
void sum_forces(const SumJob&);

/// The same with one lane at a time in the same instruction set, for tests of the claim above.
void advance_bodies_singly(const BodyJob&);
void lay_poses_singly(const PoseJob&);
void evaluate_elements_singly(const ElementJob&);
void sum_forces_singly(const SumJob&);

}  // namespace topple::mbs::kernel
