#pragma once
/// Serves Options::samplings: each at the step nearest to each of its instants, k times its interval.

#include <utility>
#include <vector>

#include "mbs/solver.h"

namespace topple::mbs {

class Sampler {
 public:
  /// The list must outlive it.
  ///   next  as next_instants() has it, to go on; empty: from the start
  explicit Sampler(const std::vector<Sampling>& samplings, std::vector<double> next = {})
      : samplings_(&samplings), next_(std::move(next)) {
    next_.resize(samplings.size(), 0);
  }

  /// The earliest instant that is not served; infinite if there are no samplings [s].
  double next() const;
  /// Whether one is to be served now; `early` is half the step, or round-off where steps end on instants [s].
  bool is_due(double time, double early) const { return time >= next() - early; }
  /// Serves those due at the view's time.
  void take(const View&, double early);
  /// Whole numbers of the next instants, in units of the intervals.
  const std::vector<double>& next_instants() const { return next_; }

 private:
  double instant(size_t i) const { return next_[i] * (*samplings_)[i].interval; }

  const std::vector<Sampling>* samplings_;
  std::vector<double> next_;  // as next_instants()
};

}  // namespace topple::mbs
