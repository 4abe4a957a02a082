#pragma once
/// Handed into long work: it reports where it is and asks whether to go on.

#include <atomic>
#include <functional>

namespace topple {

struct Progress {
  /// Called now and then from the working thread with the done and the whole amount of work (same unit).
  std::function<void(double done, double whole)> report;
  /// Set from any thread or a signal handler to stop the work at its next step boundary.
  const std::atomic<bool>* cancel = nullptr;

  bool is_cancelled() const { return cancel != nullptr && cancel->load(std::memory_order_relaxed); }
};

}  // namespace topple
