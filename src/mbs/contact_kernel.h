#pragma once
/// Forces at touching points (docs/theory/contact.md), a group in each SIMD lane. Same promises as kernel.h: a lane's
/// bits do not depend on the others. A step calls press, damp and rub in turn, and brings the bodies up to date between
/// them.

#include <cstddef>
#include <cstdint>

#include "mbs/kernel.h"

namespace topple::mbs::kernel {

// Field numbers are constants, and named so.
// NOLINTBEGIN(readability-identifier-naming)

/// Fields of a touched body, in blocks of lanes as bodies are.
enum Touched : int {
  kTouchedMass = 0,     // one over it
  kTouchedInertia = 1,  // inverse inertia in W: xx xy xz yy yz zz
  kChangeBefore = 7,    // what other forces than those of contact add to v, w within the step (6)
  kTouchedFields = 13
};

/// The same for those who meet it, in a row.
enum TouchedRow : int {
  kRowSpeed = 0,    // v, w half a step ago (6)
  kRowMass = 6,     // one over it
  kRowInertia = 7,  // as above
  kRowGroups = 13,  // that the body has
  kTouchedRow = 16
};
/// Rows of what the forces known so far add to v, w within the step, of force and torque, and of two wrenches.
inline constexpr int kWrenchRow = 8;

/// Fields of a group: what is given, what press leaves to the others, and the answers.
enum Group : int {
  kNormal = 0,     // from a to b (3)
  kApart = 3,      // from b's mass centre to a's (3)
  kMean = 6,       // of the law, as ContactLaw
  kBand = 7,       //
  kMost = 8,       //
  kZeta = 9,       //
  kDamping = 10,   //
  kFriction = 11,  //
  kStick = 12,     // stiffness of the friction spring [N/m]
  kMotion = 13,    // motion of a against b at a's centre (6)
  kMassA = 19,
  kInertiaA = 20,
  kGroupsA = 26,
  kMassB = 27,
  kInertiaB = 28,
  kGroupsB = 34,      // of the bodies
  kImpedance = 35,    // sum over the points [N·s/m]
  kTotal = 36,        // normal force of all points [N]
  kDamp = 37,         // wrench on a about its centre, by the dashpots (6)
  kRub = 43,          // by friction: damp gives its springs' part, rub puts all in its stead (6)
  kPressEnergy = 49,  // stored by the springs [J]
  kStickEnergy = 50,  // and by those of friction [J]
  kGroupLoss = 51,  // power of the dashpots with the speeds before and after the forces, taken from the motion (2) [W]
  kGroupRubPower = 53,  // of friction, given to it (2) [W]
  kHeldForce = 55,      // normal force of the springs, (4) of the theory left out [N]
  kHeldTorque = 56,     // and its torque on a (3)
  kEarned = 59,         // energy of the pair's points before, and their work since; below 0: there were none [J]
  kSpent = 60,          // work of the pair's dashpots since points were looked for [J]
  kLost = 61,      // of what was earned, that which the points that are found cannot store, less what they took [J]
  kMeets = 62,     // 1: it has points that have just been met
  kTogether = 63,  // force times the speed that it makes over its power, of dashpots of several
                   // groups that act as one [1/s]; below 0: they do not
  kGroupFields = 64
};

/// Fields of a point; a place without a point has no stiffness.
enum Point : int {
  kPlace = 0,           // from a's mass centre (3) [m]
  kDepth = 3,           // [m]
  kPointStiffness = 4,  // [N/m]
  kSpringSlip = 5,      // displacement of the friction spring (3) [m]
  kFresh = 8,           // 1: did not touch in the step before
  kMet = 9,             // steps within which it may have been met; press leaves s of (4), 0: it touched before
  kApproach = 10,       // speed of approach, half a step ago
  kFull = 11,           // spring force at the rate k [N]
  kRate = 12,           // of the dashpot [N·s/m]
  kNormalForce = 13,    // normal force [N]
  kSlide = 14,          // speed across the normal (3)
  kPointFields = 17
};
/// What joints take of the motion that a wrench on a body gives it, a symmetric matrix of v, w over force, torque, of a
/// body a and of b: vv as kInertiaA, vw (9), ww.
inline constexpr int kHeldTurn = 6, kHeldSpin = 15, kHeldBody = 21, kHeldFields = 2 * kHeldBody;

/// How much faster a point that has just been met may have been while it came.
inline constexpr double kSlowed = 1.5;
/// What a point keeps at least of its bodies' mobility, whatever joints take.
inline constexpr double kLeastMobility = 1e-9;
/// Stiffness of a friction spring over the mean normal stiffness of a corner.
inline constexpr double kStickStiffness = 1.2;
// NOLINTEND(readability-identifier-naming)

/// How low bodies reach: the box around their shapes over the plane n·p = offset, a value of each lane.
struct LowJob {
  size_t blocks = 0;                    // of bodies
  const double *p, *R;                  // 3, 9 fields a block
  const double* bounds;                 // the box in B: centre (3), half edges (3) a block
  const double *nx, *ny, *nz, *offset;  // (W)
  double* low;                          // above the plane, at least (W a block) [m]
};
void find_lows(const LowJob&);
void find_lows_singly(const LowJob&);

/// How far the farthest points of bodies have come in a motion, at most, seen from a frame that moves.
struct WayJob {
  size_t blocks = 0;            // of bodies
  const double *v, *w;          // 3, 3 fields a block
  const double* reach;          // radius of the shapes about the centre of mass (W a block) [m]
  const double *x, *y, *z, *h;  // the frame's velocity; the step (W)
  double* way;                  // (W a block) [m]
};
void find_ways(const WayJob&);
void find_ways_singly(const WayJob&);

/// Bodies of a run, seen from the touched ones.
struct TouchJob {
  size_t blocks = 0;                       // of touched bodies
  const std::uint32_t *vectors, *tensors;  // of each, where its vectors and its matrices and constants begin
  size_t stride = 1;                       // between their components
  const double *v, *w, *R, *constants;
  const double *force, *torque, *joint_force, *joint_torque;
  const double* groups;  // of each (W a block)
  double* touched;       // kTouchedFields a block
  double* rows;          // kTouchedRow each
  double* changes;       // kWrenchRow each
  double* sums;          // of the wrenches on each, kWrenchRow
  double h = 0;
  double gravity[3] = {0, 0, 0};
};

/// Speeds, inertia and what other forces change; no wrenches yet.
void read_touched(const TouchJob&);
/// What all forces known so far add to the speeds within the step.
void update_touched(const TouchJob&);

struct ContactJob {
  size_t blocks = 0;
  const std::uint32_t* rows;            // block i has the points in rows[i] to rows[i + 1], W in each
  size_t count = 0;                     // groups; idle lanes are behind them
  const std::uint32_t *a, *b;           // which of the touched bodies (W a block)
  const double *bodies, *changes;       // rows of the touched bodies
  double* sums;                         // the same
  double* wrenches;                     // what a stage adds on a and takes from b, two rows a group
  double* groups;                       // kGroupFields a block
  double* points;                       // kPointFields a row
  double h = 0;                         // the step that has led to the positions [s]
  const int* held = nullptr;            // of each block, into held_fields, -1: joints hold none; null: nowhere
  const double* held_fields = nullptr;  // kHeldFields a block
  bool follows = false;                 // the points are those of the step before, moved with the bodies
};

/// Springs: speeds, forces and the wrench of all.
void press_contacts(const ContactJob&);
/// Dashpots with the speeds that the springs leave, and friction springs.
void damp_contacts(const ContactJob&);
/// What else friction takes to stop the sliding, within its limit.
void rub_contacts(const ContactJob&);
/// Adds the wrenches of a stage to the sums of their bodies, group after group.
void sum_wrenches(const ContactJob&);
/// Powers of dashpots and friction, once all forces are known.
void book_contacts(const ContactJob&);

}  // namespace topple::mbs::kernel
