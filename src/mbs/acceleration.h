#pragma once
/// Acceleration of an iteration that comes nearer only slowly (docs/theory/multibody.md, eq. 9a). Includes Eigen.

#include <Eigen/Core>
#include <limits>
#include <vector>

namespace topple::mbs {

/// Anderson's method for steps s = K⁻¹ r of one and the same K > 0, in whose inner product it works: earlier steps have
/// shown how r changes, and what follows them is left out of the next one. Where that led away the caller goes back.
class Acceleration {
 public:
  using Vector = Eigen::VectorXd;

  /// Whether to go on from here. False: the last step was longer than s and led away; go back to where it began, and
  /// improve the step from there anew.
  bool accepts(const Vector& step, const Vector& pushed);
  /// The step to take.
  ///   step    s, and behind it what else follows the same combinations  (n + others)
  ///   pushed  r  (n)
  Vector improve(const Vector& step, const Vector& pushed);
  /// Whether the last step was s itself.
  bool is_plain() const { return added_ == 0; }

 private:
  /// What changed from one step to the next: s, r, and with the way between both the place s leads to, and K of that.
  struct Change {
    Vector step, pushed, way, way_pushed;
    Change& operator-=(const Change&);
    Change& operator*=(double);
    Change times(double) const;
  };
  static double dot(const Vector& step, const Vector& pushed) { return step.head(pushed.size()).dot(pushed); }

  std::vector<Change> changes_;                             // orthonormal in K, the oldest first
  Change last_;                                             // the step before, and what was taken for it
  double least_ = std::numeric_limits<double>::infinity();  // of the norms of s so far
  double longest_ = 100;                                    // of what is added to a step, over its own length
  double added_ = 0;                                        // of that, to the last one
};

}  // namespace topple::mbs
