#pragma once
/// A run from its start to its end as an object that is told of every step: frames, samples, rest, progress, the
/// summary.

#include <chrono>
#include <vector>

#include "mbs/sampler.h"
#include "mbs/system.h"

namespace topple::mbs {

class Course {
 public:
  explicit Course(System&);
  /// The equilibrium if asked for, the forces at the start, and the first frame. False if the run ends here.
  bool begin();
  /// After a step of the system. False if the run has ended.
  bool follow();
  Summary finish();

 private:
  void show();
  bool is_at_rest();
  /// Looks at a frame for whether nothing happens any more.
  void watch(const View&);
  /// Goes on to the next event if nothing happens until then.
  void pass_quiet();

  System& s_;
  Sampler sampler_;
  std::vector<bool> softened_;
  double last_event_ = 0, interval_ = 0, shown_ = -1;
  long frame_ = 0;
  double quiet_since_ = 0;   // of the frames [s]
  double plastic_then_ = 0;  // dissipated until then [J]
  bool is_quiet_ = false;
  std::chrono::steady_clock::time_point begin_;
};

}  // namespace topple::mbs
