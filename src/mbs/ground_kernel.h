#pragma once
/// Bodies of one box on the ground (docs/theory/contact.md), a body in each SIMD lane: corners, springs, dashpots and
/// friction at once. Same promises as kernel.h: a lane's bits do not depend on the others. For bodies that touch
/// nothing but the ground.

#include <cstddef>
#include <cstdint>
#include <vector>

#include "mbs/kernel.h"

namespace topple::mbs::kernel {

// Field numbers are constants, and named so.
// NOLINTBEGIN(readability-identifier-naming)

/// What a box on the ground remembers from step to step; corner i is at the upper end of x, y, z if bit 0, 1, 2 is set.
enum GroundState : int {
  kBorn = 0,        // penetration without force of each corner, -1: contact was not possible (8) [m]
  kCornerSlip = 8,  // displacement of each corner's friction spring, x infinite: does not touch (3 each) [m]
  kLoss = 32,       // dissipated by the dashpots so far [J]
  kLossPower = 33,  // and at the end of the last step [W]
  kRubWork = 34,    // work of friction on the body so far [J]
  kRubPower = 35,   //
  kPressed = 36,    // energy of the springs [J]
  kStuck = 37,      // of the friction springs [J]
  kPush = 38,       // force of the ground on the body (3) [N]
  kGroundFields = 41
};

/// Constants of a box and of the law between it and the ground.
enum GroundConstant : int {
  kBoxCentre = 0,         // in B (3) [m]
  kBoxEdges = 3,          // half edges along its x, y, z as vectors in B (3 each) [m]
  kCornerStiffness = 12,  // k [N/m]
  kGroundMean = 13,       // of the law, as ContactLaw
  kGroundBand = 14,       //
  kGroundMost = 15,       //
  kGroundZeta = 16,       //
  kGroundDamping = 17,    //
  kGroundFriction = 18,   //
  kPossible = 19,         // 1: may touch the ground
  kGroundConstants = 20
};
// NOLINTEND(readability-identifier-naming)

/// When a body is looked at, in GroundJob::watch: always as well where it touched in the last step.
inline constexpr double kNeverLook = 0, kLookWhenLow = 1, kAlwaysLook = 2, kTouches = 3;

struct GroundJob {
  size_t blocks = 0;                         // of bodies
  const double *p, *v, *w, *R;               // 3, 3, 3, 9 fields a block
  const double* body_constants;              // kBodyFields
  const double *joint_force, *joint_torque;  // 3, 3
  double *force, *torque;                    // of everything else on the body; the ground's are added (3, 3)
  const double* reach;                       // of the shapes about the centre of mass (W a block) [m]
  double* watch;                             // (W a block)
  double* states;                            // kGroundFields
  const double* constants;                   // kGroundConstants
  const double *nx, *ny, *nz, *offset;       // of the ground's plane (W)
  const double *gx, *gy, *gz, *h;            // gravity, step (W)
  std::vector<std::uint32_t>* landed;        // slots that touch and are not known to have done so
};
void press_ground(const GroundJob&);
void press_ground_singly(const GroundJob&);

}  // namespace topple::mbs::kernel
