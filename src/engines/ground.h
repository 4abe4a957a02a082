#pragma once
/// Contact with the ground for engines that have none of their own: springs and dampers at the corners of boxes, the
/// vertices of hulls and the lowest points of spheres, friction as a damper below Coulomb's limit. Not the native
/// engine's law, which belongs to its steps; the restitution of a point is the same. docs/engines.md.

#include <vector>

#include "engines/forces.h"

namespace topple::engines {

struct BodyNow;

class Ground {
 public:
  /// The model must outlive it.
  ///   step  of the engine if it is fixed, 0 otherwise [s]: dampers take no more in it than an explicit method bears
  Ground(const mbs::Model&, const std::vector<BodyNow>&, double step);

  bool is_there() const { return is_there_; }
  /// Takes over the shapes of bodies that have been replaced.
  void update_shapes(const std::vector<BodyNow>&);
  /// Adds the forces at a trial state and their power on the bodies [W]; returns the force of the ground on them [N].
  Vec3 calc(const Motion&, const std::vector<BodyNow>&, std::vector<Wrench>& on_body, double& power) const;
  /// Accepts a state. Overlap that a point has when its body is let go, or at the start, is allowed for as long as it
  /// lasts and only shrinks.
  ///   is_held  bodies that something holds to the ground: they do not touch it (B)
  void advance(const Motion&, const std::vector<unsigned char>& is_held);

 private:
  struct Point {
    Vec3 p;             // in B [m]
    double radius = 0;  // of a sphere about it [m]
    bool is_active = false;
    double born = 0;  // overlap that is allowed [m]
  };
  struct Body {
    std::vector<Point> points;
    double reach = 0;  // of them from the origin of B [m]
    int replaced = -1;
  };
  double calc_overlap(const Point&, const Pose& X_WB) const;
  /// Damping over critical damping of the points of body b where it is now, as far as the step bears it.
  double find_bearable_ratio(size_t b, const Pose& X_WB) const;

  const mbs::Model& model_;
  std::vector<Body> body_;  // (B)
  bool is_there_ = false;
  double damping_ratio_ = 0, step_ = 0;
};

/// Damping over critical damping of a spring that gives back the share e of the speed with which it was hit, if it
/// cannot pull: e = exp(-2 ζ acos ζ / √(1 - ζ²)), and its continuation above 1. For e in [0, 1]; at most 50, which
/// gives back 1e-4.
double find_damping_ratio(double restitution);

}  // namespace topple::engines
