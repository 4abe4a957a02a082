#pragma once
/// The arithmetic of points against faces, many at a time in SIMD lanes (docs/theory/explicit.md, "Contact").
/// Compiled for several instruction sets, chosen at run time; all give the same bits.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "base/aligned.h"
#include "fem/contact_search.h"

namespace topple::fem::lanes {

/// What faces must know of a point. The radius of a node is 0.
struct alignas(kCacheLine) Point {
  Vec3 p;                    // [m]
  double radius = 0;         // [m]
  Vec3 v;                    // [m/s]
  double inverse_mass = 0;   // [1/kg]
  double stiffness = 1e300;  // at most [N/m]
  double damping = 0;        // of critical
  double ball = 0;           // 1: debris
  double bears = 1e300;      // of debris [N]
  double unused[4]{};        // whole lines
};

/// Candidates side by side, in the order of points. C candidates.
struct Faces {
  AlignedVector<Point> points;
  std::vector<std::uint32_t> number, point;           // in the list that they come from, in points (C)
  std::array<std::vector<std::uint32_t>, 4> corners;  // rows (C)
  std::vector<std::uint32_t> passed;                  // room
};

/// A touch with the candidate it comes from.
struct Touch {
  std::uint32_t candidate = 0;  // of Faces
  double height = 0;            // of the point above the face, negative behind it [m]
  double depth = 0;             // [m]
  double weights[4]{};          // of the corners
  Vec3 normal_force, friction;  // on the point [N]
  double normal = 0;            // power at the present speeds [W]
  double rubbing = 0;           //
  double stored = 0;            // [J]
  double crushed = 0;           // of debris [m]
};

/// Constant.
struct Setup {
  const double* rows = nullptr;  // kNodeFields a node
  double h = 0;                  // step [s]
  double friction = 0;
  double rate = 0, grip = 0;  // penalty over mass and step squared; share of the mass stopped by friction in a step
};

/// Those of the candidates [first, last) that touch, in order. Some behind a face may be too deep, or nearer to another
/// one.
void press_faces(const Setup&, Faces&, size_t first, size_t last, std::vector<Touch>&);

/// Constant.
struct ParticleSetup {
  const Particle* particles = nullptr;
  const ParticleMake* makes = nullptr;
  double h = 0;                      // step [s]
  double friction = 0, damping = 0;  // damping: of critical
  double grip = 0;                   // share of the mass stopped by friction in a step
};

/// Pairs of particles whose middles are apart by less than their radii, though not in one place; appends touches, and
/// adds to the sums.
void press_particles(const ParticleSetup&, std::span<const ParticlePair>, std::vector<ParticleTouch>&, TouchSums&);

}  // namespace topple::fem::lanes
