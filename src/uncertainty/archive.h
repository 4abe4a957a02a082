#pragma once
/// Every evaluated point, kept; and the one who asks the model for more (docs/theory/uncertainty.md, section 2).

#include <algorithm>
#include <cstddef>
#include <unordered_map>
#include <vector>

#include "base/progress.h"
#include "uncertainty/mapping.h"

namespace topple::uncertainty {

struct Sample {
  Point x;
  Result result;
};

/// Samples in the order in which they were asked for, each point once.
class Archive {
 public:
  const std::vector<Sample>& samples() const { return samples_; }
  std::size_t size() const { return samples_.size(); }
  const Sample& operator[](int i) const { return samples_[i]; }
  /// Index of exactly this point (same bits), or -1.
  int find(const Point&) const;
  /// Adds a sample, or gives the index of the point that is there already.
  int add(Sample);
  /// Runs that failed.
  int count_failed() const { return failed_; }

 private:
  std::vector<Sample> samples_;
  std::unordered_multimap<std::size_t, int> index_;  // by hash of the bits
  int failed_ = 0;
};

/// Asks the model, remembers the answers, and counts. One analysis after another may use the same asker, so that all of
/// them see all points.
class Asker {
 public:
  /// `earlier`, if given, outlives the asker: a point found there is taken from it instead of being run, so that an
  /// analysis that was interrupted repeats its decisions and goes on with the same bits.
  Asker(Evaluate evaluate, const Progress& progress, const Archive* earlier = nullptr, int limit = 10000);

  /// Makes sure that all points are in the archive; returns their indices in the order of `points`. Points beyond the
  /// limit or after a cancellation are not run; their index is -1. Throws InputError E803 if the model gives different
  /// numbers of outputs.
  std::vector<int> ask(const std::vector<Point>& points);

  const Archive& archive() const { return archive_; }
  const Progress& progress() const { return *progress_; }
  int asked() const { return static_cast<int>(archive_.size()); }  // different points
  int run() const { return run_; }                                 // of them sent to the model, not found in `earlier`
  int batches() const { return batches_; }                         // calls of the model
  int limit() const { return limit_; }
  /// Progress is told of the largest one so far: a part may be kept for later.
  void set_limit(int limit) { limit_ = limit, told_limit_ = std::max(told_limit_, limit); }
  int rest() const { return limit_ > asked() ? limit_ - asked() : 0; }
  bool is_cancelled() const { return cancelled_ || progress_->is_cancelled(); }
  /// Neither cancelled nor out of evaluations.
  bool can_go_on() const { return rest() > 0 && !is_cancelled(); }
  /// Outputs of the model; 0 before the first run that did not fail.
  int outputs() const { return outputs_; }

 private:
  Evaluate evaluate_;
  const Progress* progress_;
  const Archive* earlier_;
  Archive archive_;
  int limit_, told_limit_;
  int run_ = 0, batches_ = 0, outputs_ = 0;
  bool cancelled_ = false;
};

}  // namespace topple::uncertainty
