#pragma once
/// Laws of zones laid out for lookup: families of limit moments and curves along the axis (docs/theory/zones.md).

#include <initializer_list>
#include <memory>
#include <vector>

#include "mbs/laws.h"

namespace topple::mbs {

/// What a moment family says at a normal force and a rotation, for moments or rotations > 0 and < 0 each.
struct FamilyPoint {
  double positive, negative;            // limit [N·m]
  double lift_positive, lift_negative;  // plastic elongation per growth of rotation, behind it [m/rad]
};

/// A moment family laid out for lookup: K forces by J rotations.
struct CompiledFamily {
  int K = 0, J = 0;                 // K == 0: unlimited
  std::vector<double> force;        // (K)
  std::vector<double> rotation;     // (J)
  std::vector<FamilyPoint> points;  // (J x K)
  bool lifts = false;               // some point has an elongation
  std::vector<double> capacity;     // compression beyond which no moment is left, per rotation (J)

  /// Of force k and rotation j; the next force follows.
  const FamilyPoint* at(size_t k, size_t j) const { return &points[j * static_cast<size_t>(K) + k]; }
  FamilyPoint* at(size_t k, size_t j) { return &points[j * static_cast<size_t>(K) + k]; }
};

struct CompiledCurve {
  std::vector<double> x, f;  // empty: unlimited
};

struct CompiledLaw {
  CompiledFamily moment[2];  // about y, about z; both by rotations about y that strain the edges as much
  CompiledCurve compression, tension;
  double peak_compression = 0, peak_shortening = 0;  // of the compression curve [N, m]
  double end_begins = 0;   // of one that keeps its length: from where on the curve is of the end that is left [m]
  bool elongates = false;  // some family has an elongation
  bool buckles = false, keeps_length = false;
  double biaxial_exponent = 1.5, rotation_ratio = 1, damage_share = 0, crush_length = 0, rupture_elongation = 0;
  double rupture_rotation = 0, rupture_rotation_pressed = 0;  // the latter while N < 0, never the lesser one
  double shear[2] = {0, 0}, shear_friction = 0, slip_softening = 0, slip_rupture = 0, torsion = 0, twist_rupture = 0;
};

CompiledLaw compile_law(const ZoneLaw&);

/// Compiled laws by number, shared with the models that have them.
class CompiledLaws {
 public:
  CompiledLaws() = default;
  CompiledLaws(std::initializer_list<CompiledLaw> laws) {
    for (const CompiledLaw& law : laws) push_back(law);
  }
  size_t size() const { return laws_.size(); }
  const CompiledLaw& operator[](size_t i) const { return *laws_[i]; }
  void push_back(CompiledLaw law) { laws_.push_back(std::make_shared<const CompiledLaw>(std::move(law))); }
  void push_back(std::shared_ptr<const CompiledLaw> law) { laws_.push_back(std::move(law)); }

 private:
  std::vector<std::shared_ptr<const CompiledLaw>> laws_;
};

/// Value of a curve, constant beyond its ends; infinity for an empty one.
double calc_curve(const CompiledCurve&, double x);
/// Its mean from one place to a later one; its value where both are one.
double calc_mean(const CompiledCurve&, double from, double to);

/// Share of the section that is left after a shortening [m]: 1 until the peak of the compression curve.
double calc_integrity(const CompiledLaw&, double shortened);

/// Limit moments at a normal force and a plastic rotation. k and j are hints from the last call, updated.
struct MomentLimit {
  double positive, negative;
};
MomentLimit calc_moment_limit(const CompiledFamily&, double normal_force, double rotation, int& k, int& j);
/// Rise of the limit moments with the normal force [m]. k and j are hints.
MomentLimit calc_moment_slope(const CompiledFamily&, double normal_force, double rotation, int k, int j);
/// Plastic elongation per growth of the rotation reached, for positive and for negative rotations [m/rad].
struct Lift {
  double positive = 0, negative = 0;
};
Lift calc_lift(const CompiledFamily&, double normal_force, double rotation, int& k, int& j);
/// Compression that the zone can still carry at a plastic rotation [N], infinity if unlimited. j is a hint.
double calc_compression_capacity(const CompiledFamily&, double rotation, int j = 0);

/// Largest i with grid[i] <= x, within [0, n-2]; `hint` is where it was last time.
int find_interval(const std::vector<double>& grid, double x, int hint);

}  // namespace topple::mbs
