#pragma once
/// General force elements at work: springs and dampers between points, about joint axes and in six components, and
/// loads (docs/theory/multibody.md, eq. F1 to F6). Constants and states; the functions are members of System in
/// forces.cpp, dampers.cpp and loads.cpp.

#include <string>
#include <vector>

#include "base/linalg.h"
#include "mbs/characteristic.h"
#include "mbs/model.h"

namespace topple::mbs {

/// Direction of a deformation: it grows at the rate line·(v_b - v_a) + turn_b·w_b - turn_a·w_a, with velocities of the
/// centres of mass. A pull f does -f line and -f turn_b on b, the opposite with turn_a on a. In W.
struct ForceRow {
  Vec3 line, turn_a, turn_b;
};

struct CompiledSpring {
  int a = -1, b = -1;
  Vec3 p_A, p_B;
  double free_length = 0;
  CompiledCharacteristic spring, damper;
  double tension_strength = kUnlimited, compression_strength = kUnlimited;
};

struct CompiledTorsion {
  int joint = -1;
  double free_angle = 0;
  CompiledCharacteristic spring, damper;
  double strength = kUnlimited;
};

struct CompiledBushing {
  int a = -1, b = -1;
  Vec3 p_AF, p_BM;
  Quat q_AF, q_BM;
  CompiledCharacteristic spring[6], damper[6];
  double strength[6];
  bool is_damped = false;
  bool turns = false;    // some rotation has a law
  bool is_bound = true;  // every spring's slope is bounded
};

/// Where frame M stands against frame F.
struct FrameDeformation {
  Vec3 u, r;  // place of M's origin and rotation vector, in F [m, rad]
  Vec3 p_M;   // in W
  Mat3 F;     // axes in W as columns
};

struct CompiledLoad {
  int body = -1;
  Vec3 p_B, force, torque;
  bool follows_body = false;
  bool is_constant = true;        // else factor
  CompiledCharacteristic factor;  // against the time since the load's begin
};

/// One deformation, its spring and its damper.
struct ComponentState {
  double deformation = 0, before = 0;  // now and at the evaluation before [m, rad]
  double spring = 0, damper = 0;       // pulls [N, N·m]
  double rate = 0;                     // that the damper saw [m/s, rad/s]
};

/// Of a spring-damper or a rotational spring.
struct SpringState {
  bool live = true;
  bool has_been_evaluated = false;
  double energy = 0, plastic = 0, damping = 0;  // stored, dissipated by breaking, by the damper [J]
  ComponentState component;
  Vec3 along;  // of the evaluation before, in W
};

struct BushingState {
  bool live = true;
  bool has_been_evaluated = false;
  double energy = 0, plastic = 0, damping = 0;
  ComponentState component[6];
};

struct LoadState {
  double begin = kUnlimited, end = kUnlimited;  // of its presence [s]
  double from = 0, until = 0;                   // what the last kick was to give the impulse of [s]
  double factor = 0, kick = 0;                  // its share of the force, and how long it was to last [s]
  double last_kick = 0;                         // State::last_kick then [s]
  double owed = 0;                              // by a presence that is over, over the force [s]
  Vec3 point;                                   // of the evaluation before, in W
  Quat q;                                       // of the body then
  Vec3 force, torque;                           // of the evaluation before, in W
  double work = 0;                              // done so far [J]
};

/// A damper waiting for the velocity at the time of the positions.
struct DamperRow {
  ForceRow row;
  int a = -1, b = -1;              // bodies, -1 for those that do not move
  int place_a = -1, place_b = -1;  // among the damped bodies
  const CompiledCharacteristic* law = nullptr;
  const std::string* name = nullptr;  // of the element
  ComponentState* state = nullptr;
  double* damping = nullptr;
  double last = 0;  // pull of the step before
  // inverse mass along the row: its own and that's root, what neighbours add over their roots, a bound with all of them
  double own = 0, root = 0, coupled = 0, bound = 0;
};

/// One body that dampers act on; scratch.
struct DampedBody {
  int body = -1;
  Mat3 inverse_inertia;  // in W
  Vec3 velocity, spin;   // at the time of the positions, in W
  struct Side {
    int row = 0;
    Vec3 turn, spin;  // of the row on this body, and what it makes of it
  };
  std::vector<Side> sides;
};

/// A spring's stiffness along a row, for the matrices of equilibrium.cpp.
struct StiffRow {
  int a = -1, b = -1;
  ForceRow row;
  double stiffness = 0;
};

/// Constants and scratch of all of them.
struct ForceElements {
  std::vector<CompiledSpring> springs;
  std::vector<CompiledTorsion> torsions;
  std::vector<CompiledBushing> bushings;
  std::vector<CompiledLoad> loads;
  std::vector<DampedBody> damped;      // empty: no dampers
  std::vector<int> damped_place;       // of each body, -1: none (B); empty without dampers
  std::vector<DamperRow> damper_rows;  // of this evaluation
  bool damps_jointed = false;          // some of these bodies have joints
};

}  // namespace topple::mbs
