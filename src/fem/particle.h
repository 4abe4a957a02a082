#pragma once
/// Debris: balls without rotation, and what they exert on each other.

#include <array>
#include <cstdint>

#include "base/aligned.h"
#include "base/linalg.h"

namespace topple::fem {

/// Largest penalty rate of a ball over its mass and the elements' step squared.
inline constexpr double kDebrisRate = 0.02;  // NOLINT(readability-identifier-naming)

using ParticlePair = std::array<std::uint32_t, 2>;  // the later one first

/// A ball of debris in three parts, so that steps pass over no more memory than they must. A line of the cache:
struct alignas(kCacheLine) Particle {
  Vec3 p, v;
  double radius = 0, mass = 0;
};
/// Of the step.
struct ParticlePush {
  Vec3 force;
  double crushed = -1;  // by how much, negative: nothing touches it [m]
  double growth = 0;    // of the radius since something touched it last [m/s]
};
/// What does not change.
struct ParticleMake {
  Vec3 start;  // where its potential counts from
  double full_radius = 0, stiffness = 0;
  double bears = 0;  // force at which it is crushed [N]
  int element = 0;
  std::uint32_t unused = 0;  // no gaps
  /// By how much a spring would press it beyond what it bears [m].
  double calc_crushed(double rate, double depth) const { return depth - bears / rate; }
};

/// Two of them that touch in a step; forces on the first one [N].
struct ParticleTouch {
  Vec3 normal_force, friction;
  std::array<double, 2> crushed{};
  ParticlePair pair{};
};

}  // namespace topple::fem
