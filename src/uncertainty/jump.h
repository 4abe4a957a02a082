#pragma once
/// Jumps of a value between runs of one outcome (docs/theory/uncertainty.md, section 3): where else they may bound it.

#include <map>
#include <span>
#include <vector>

#include "uncertainty/space.h"
#include "uncertainty/tangent.h"

namespace topple::uncertainty {

struct Region;

/// The side of a jump on which a search ended.
struct JumpSide {
  std::vector<int> axes;      // inputs that vary
  std::vector<HalfSpace> in;  // that it lies in, from the zero point by widths of the supports
  std::vector<double> slope;  // of what is minimised there, by widths
};

/// Places of a cut that tell whether it reaches such a side, and what there is best: the deepest one, and the best one
/// if planes and slopes go on as they are, so far off the planes. None where the cut ends before, or other inputs vary.
/// They cost no runs.
std::vector<Point> find_places(const Region&, const JumpSide&, std::span<const double> margins);
std::vector<Point> find_places(const Region&, const JumpSide&);

/// What is known of the jumps of one output.
class Jumps {
 public:
  void add(JumpSide);
  /// Sides that were not taken before: those that were added, what lies beyond a single plane, and the pieces between
  /// planes that were found by different searches.
  std::vector<JumpSide> take_new();

 private:
  std::vector<JumpSide> sides_;
  std::size_t taken_ = 0;
  std::map<std::vector<int>, std::vector<HalfSpace>> planes_;  // by the inputs that vary
};

}  // namespace topple::uncertainty
