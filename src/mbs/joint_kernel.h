#pragma once
/// The arithmetic of joints that share no moving body with other joints, many at a time in SIMD lanes: of one run, or
/// one joint of all samples of a batch. Same promises as kernel.h: a lane's bits do not depend on the others.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mbs/kernel.h"

namespace topple::mbs::kernel {

/// What a block of pairs holds; from Ball to Hinge, three lines and as many rotations as the kind is beyond Ball. A
/// planar hinge turns about y between bodies that keep to y = const.
enum class PairKind : unsigned char { None, Weld, Ball, Universal, Hinge, PlanarHinge };

/// Fields of a pair's constants. Vectors of the parent or the child are in their axes, from their centres of mass.
enum PairConstant : int {
  kPairLive = 0,  // 1: a joint, 0: nothing
  kInverseMassParent = 1,
  kInverseMassChild = 2,
  kLeverParent = 3,  // to the origin of F (3)
  kLeverChild = 6,   // to that of M; of a weld in the parent's axes (3)
  kLimitAxis = 9,    // x of F in the parent (3)
  kTensionLimit = 12,
  kShearLimit2 = 13,   // squares
  kMomentLimit2 = 14,  //
  kGapTolerance = 15,
  kTurnTolerance = 16,
  // a weld: both bodies as one, about its centre of mass, in the parent's axes
  kReach = 17,          // from the parent's centre to the child's (3)
  kRelative = 20,       // quaternion of the child in the parent (4)
  kChildShare = 24,     // of the mass
  kReducedMass = 25,    //
  kInverseWhole = 26,   // inverse inertia of both (6)
  kInertiaParent = 32,  // (6)
  kInertiaChild = 38,   // (6)
  // others
  kInverseInertiaParent = 17,  // in its own axes (6)
  kInverseInertiaChild = 23,   // (6)
  kParentAxes = 29,            // those that stay at right angles to the child's; of a hinge x and y of F (2 x 3)
  kChildAxes = 35,             // of a hinge z and z of M (2 x 3)
  kChildX = 41,                // x of M (3)
  kPairConstants = 44
};

/// Fields of a pair's state.
enum PairState : int {
  kCurvature = 0,  // what the last impulse had beyond the linear step: lines, rotations (6)
  kForce = 6,      // reaction on the child in W (3)
  kMoment = 9,     // (3)
  kCosine = 12,    // of the angle of a hinge
  kSine = 13,
  kOpen = 14,  // widest gap [m, rad]
  kPairStates = 15
};

struct PairJob {
  size_t blocks = 0;
  const PairKind* kind;           // of each block
  const unsigned char* straight;  // bit 0: the parents of a block are lanes of one block of bodies; bit 1: the children
  const std::uint32_t *parent, *child;  // slots of bodies, W a block
  const double* constants;              // kPairConstants a block
  double* states;                       // kPairStates a block
  double *p, *v, *L, *w, *q, *R;        // bodies, as in BodyJob
  double *force, *torque;               // of the joints on bodies, 3 fields a block
  const double *kick, *h;               // (W)
  std::vector<std::uint32_t>* unfit;    // slots that turn too fast or do not close, untouched
  std::vector<std::uint32_t>* over;     // slots whose reaction passes a limit
};

void close_pairs(const PairJob&);
void close_pairs_singly(const PairJob&);

}  // namespace topple::mbs::kernel
