#include "base/parallel.h"

#include <algorithm>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#if !defined(__SANITIZE_THREAD__)
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>
#endif

namespace topple {

namespace {

#if defined(__SANITIZE_THREAD__)
// Debian's TBB is not instrumented, so that its own hand-over looks like a race: plain threads show the bodies' races
// alone.
void run_all(std::size_t count, int threads, const std::function<void(std::size_t)>& run_one) {
  std::atomic<std::size_t> next = 0;
  std::vector<std::thread> team;
  for (int t = 0; t < threads; ++t)
    team.emplace_back([&] {
      for (std::size_t i = next++; i < count; i = next++) run_one(i);
    });
  for (std::thread& thread : team) thread.join();
}
#else
void run_all(std::size_t count, int threads, const std::function<void(std::size_t)>& run_one) {
  // TBB makes no more threads than processors unless it is told to
  std::optional<tbb::global_control> more_threads;
  if (threads > hardware_threads())
    more_threads.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(threads));
  tbb::task_arena arena(threads);
  arena.execute([&] {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, count), [&](const tbb::blocked_range<std::size_t>& range) {
      for (std::size_t i = range.begin(); i != range.end(); ++i) run_one(i);
    });
  });
}
#endif

}  // namespace

int hardware_threads() { return std::max(1, static_cast<int>(std::thread::hardware_concurrency())); }

bool parallel_for(std::size_t count, int threads, const std::function<void(std::size_t)>& body,
                  const std::atomic<bool>* cancel) {
  const auto is_cancelled = [cancel] { return cancel != nullptr && cancel->load(std::memory_order_relaxed); };
  if (threads <= 0) threads = hardware_threads();
  threads = static_cast<int>(std::min(static_cast<std::size_t>(threads), std::max<std::size_t>(count, 1)));
  if (threads == 1) {
    for (std::size_t i = 0; i < count; ++i) {
      if (is_cancelled()) return false;
      body(i);
    }
    return true;
  }

  std::atomic<bool> seen_cancel = false;
  std::atomic<std::size_t> first_failed = count;
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto run_one = [&](std::size_t i) {
    if (seen_cancel.load(std::memory_order_relaxed) || i > first_failed.load(std::memory_order_relaxed)) return;
    if (is_cancelled()) {
      seen_cancel.store(true, std::memory_order_relaxed);
      return;
    }
    try {
      body(i);
    } catch (...) {
      const std::lock_guard lock(failure_mutex);
      if (i < first_failed.load(std::memory_order_relaxed)) {
        first_failed.store(i, std::memory_order_relaxed);
        failure = std::current_exception();
      }
    }
  };

  run_all(count, threads, run_one);
  if (failure) std::rethrow_exception(failure);
  return !seen_cancel;
}

}  // namespace topple
