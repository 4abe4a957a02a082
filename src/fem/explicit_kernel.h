#pragma once
/// The arithmetic of explicit hexahedra, many at a time in SIMD lanes: strain, plasticity, stabilisation, forces, and
/// the motion of nodes (docs/theory/explicit.md). Compiled for several instruction sets, chosen at run time. W lanes
/// make a block; field f of a block begins at block + f * W.

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "fem/explicit_model.h"

namespace topple::fem::kernel {

// Field numbers are constants, and named so.
// NOLINTBEGIN(readability-identifier-naming)

/// Fields of an element. Amplitudes of stress over the element, in its own axes ξ η ζ, belong to the functions of which
/// they are named: xx~ζ is the part of the normal stress along ξ that goes with ζ.
enum ElementField : int {
  kStress = 0,    // xx yy zz xy yz zx, in W [Pa]
  kStrain = 6,    // equivalent plastic strain
  kDamage = 7,    // 1: to be removed
  kBending = 8,   // xx~ζ yy~ζ, xx~η zz~η, yy~ξ zz~ξ [Pa]
  kTwist = 14,    // xy~ζ xz~η yz~ξ times 16 products of half edges [Pa m²]
  kCorner = 17,   // xx~ηζ yy~ζξ zz~ξη [Pa]
  kViscous = 20,  // pressure of bulk viscosity [Pa]
  kStateFields = 21,
  kMass = 21,    // 0: removed [kg]
  kLength = 22,  // of the element for bulk viscosity [m]
  kElementFields = 23
};

/// Fields of a node's row.
enum NodeField : int { kPlace = 0, kSpeed = 3, kInverseMass = 6, kNodeMass = 7, kNodeFields = 8 };

/// Flags of a node.
enum NodeFlag : std::uint8_t { kHoldX = 1, kHoldY = 2, kHoldZ = 4, kPushed = 8 };
// NOLINTEND(readability-identifier-naming)

inline constexpr int kMostGrounds = 4;

/// A material's constants.
struct Law {
  double lambda = 0, mu = 0;                                              // [Pa]
  double E = 0, nu = 0;                                                   //
  double bending = 0;                                                     // E/(1-ν²) [Pa]
  double bulk = 0;                                                        // [Pa]
  double speed = 0;                                                       // of pressure waves [m/s]
  int points = 0;                                                         // of the yield curve, 0: elastic
  double at[kMostYieldPoints]{};                                          // plastic strain where a line begins
  double tension[kMostYieldPoints]{}, tension_slope[kMostYieldPoints]{};  // value at strain 0 and slope of the line
  double compression[kMostYieldPoints]{}, compression_slope[kMostYieldPoints]{};
  double tension_cutoff = 0, compression_cutoff = 0;  // largest mean stress over the yield stress
  double crack_strain = 0;                            // cracks close where the plastic strain is below it
  double tension_rate = 0, compression_rate = 0;      // damage for plastic strain
  // of a step: times StepJob::past (set_step)
  double step_lambda = 0, step_mu = 0, step_E = 0, step_bending = 0, step_bending_nu = 0;  // [Pa s]
};

/// What is the same for all chunks of a step.
struct StepJob {
  double h = 0;                      // [s]
  double past = 0;                   // h, or 0 in a first step: what the speeds have strained before it does not count
  double keep = 1, kick = 0;         // v = keep v + kick (f/m) + fall
  double fall[3] = {0, 0, 0};        // gravity times the step [m/s]
  bool weighs = false;               // relaxation: masses of rows weigh, inverse ones are fictitious; sums of balance
  double weight[3] = {0, 0, 0};      // force of a mass [m/s²]
  double linear = 0, quadratic = 0;  // bulk viscosity
  bool removes = true;               // elements may fail
  int grounds = 0;
  double ground[kMostGrounds][4];  // n and n·p: below where n·x - n·p < 0
};

/// Of nodes in a relaxation, held components aside.
struct Balance {
  double force2 = 0;   // squares of forces out of balance [N²]
  double kinetic = 0;  // twice the energy of the fictitious masses [J]
};

/// Elements of a chunk and the nodes they touch.
struct ChunkJob {
  const Law* laws = nullptr;                    // of all materials
  const std::uint16_t* law_of_block = nullptr;  // into them
  size_t blocks = 0;
  double* elements = nullptr;                   // kElementFields a block
  double* cracks = nullptr;                     // strains of open cracks along ξ η ζ, read where there are some
  const std::uint16_t* corners = nullptr;       // 8 a block of W lanes: kNodeFields times the node's place
  const std::uint8_t* joined = nullptr;         // of blocks: faces ζ = -1 are those ζ = +1 of the block before
  const unsigned char* live = nullptr;          // bits of the lanes of a block
  size_t own = 0, shared = 0;                   // nodes: those of this chunk alone come first
  double* own_nodes = nullptr;                  // kNodeFields each; copies of shared nodes follow, written
  const double* nodes = nullptr;                // rows of all nodes
  const std::uint32_t* shared_nodes = nullptr;  // their rows
  double* shared_forces = nullptr;              // 4 each, written
  const std::uint8_t* own_flags = nullptr;      //
  const double* own_pushes = nullptr;           // forces of flagged nodes, 4 each
  double* forces = nullptr;                     // room: 4 a node of the chunk, all 0 before and after
  // written
  Balance balance;
  double sums[4] = {0, 0, 0, 0};  // dissipated: mean, over the element, the corner mode in it, bulk viscosity [J]
  std::vector<std::uint32_t>* failed = nullptr;    // 4 * slot + cause (1 tension, 2 compression, 3 degenerate)
  std::vector<std::uint32_t>* grounded = nullptr;  // own nodes below some ground after the step
};

/// Nodes that several chunks share.
struct SharedJob {
  size_t first = 0, last = 0;              // nodes
  double* nodes = nullptr;                 // rows of all nodes
  size_t first_row = 0;                    // of node 0 of these
  const std::uint32_t* starts = nullptr;   // of the entries of a node
  const std::uint32_t* entries = nullptr;  // rows of forces, 4 doubles each
  const double* forces = nullptr;
  const std::uint8_t* flags = nullptr;  // of all nodes
  const double* pushes = nullptr;       // of all nodes
  std::vector<std::uint32_t>* grounded = nullptr;
  Balance balance;  // written
};

size_t lanes();
std::string target_name();
/// What of a law goes with the path of the last step.
void set_step(Law&, double past);
/// Stresses and forces at the present places from the motion of the last half steps, then the motion of own nodes.
void advance_chunk(const StepJob&, ChunkJob&);
void advance_shared(const StepJob&, SharedJob&);

}  // namespace topple::fem::kernel
