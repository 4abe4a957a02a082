#include "base/team.h"

#include <atomic>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "base/parallel.h"

namespace topple {

namespace {

constexpr std::uint64_t kClosed = 0xffffffffU;  // an index that no loop has

/// Tells the processor that a thread only looks.
void pause() {
#if defined(__x86_64__) || defined(__i386__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  asm volatile("yield");
#endif
}

/// Looks until is_done() for about a millisecond, after a tenth of it only while no other thread wants the processor.
/// Who slept at once would be woken on the processor of who calls where all others are taken, and get none.
template <class Done>
bool look(const Done& is_done) {
  for (int i = 0; i < 2500; ++i) {
    if (is_done()) return true;
    pause();
  }
  for (int i = 0; i < 2500; ++i) {
    if (is_done()) return true;
    std::this_thread::yield();
  }
  return false;
}

}  // namespace

struct Team::Inside {
  // number of the loop above, next index below: who takes an index knows by it that loop and body are still the same
  std::atomic<std::uint64_t> ticket = 0;
  std::atomic<std::size_t> count = 0;
  std::atomic<const std::function<void(std::size_t)>*> body = nullptr;
  std::atomic<std::uint32_t> done = 0;   // indices
  std::atomic<std::uint32_t> calls = 0;  // loops so far
  std::atomic<bool> ends = false;
  std::mutex failure_mutex;
  std::exception_ptr failure;
  std::size_t failed = 0;
  std::vector<std::thread> workers;

  /// Takes indices of the present loop until none is left.
  void work() {
    std::uint64_t now = ticket.load(std::memory_order_acquire);
    for (;;) {
      const std::size_t i = now & kClosed, all = count.load(std::memory_order_acquire);
      const auto* call = body.load(std::memory_order_acquire);
      if (i >= all) return;
      if (!ticket.compare_exchange_weak(now, now + 1, std::memory_order_acq_rel, std::memory_order_acquire)) continue;
      try {
        (*call)(i);
      } catch (...) {
        const std::lock_guard lock(failure_mutex);
        if (!failure || i < failed) failure = std::current_exception(), failed = i;
      }
      if (done.fetch_add(1, std::memory_order_acq_rel) + 1 == all) done.notify_one();
      now = ticket.load(std::memory_order_acquire);
    }
  }

  void stand_by() {
    std::uint32_t seen = 0;
    for (;;) {
      const auto is_called = [&] { return calls.load(std::memory_order_acquire) != seen; };
      if (!look(is_called)) calls.wait(seen, std::memory_order_acquire);
      if (ends.load(std::memory_order_acquire)) return;
      seen = calls.load(std::memory_order_acquire);
      work();
    }
  }
};

Team::Team(int threads) : inside_(std::make_unique<Inside>()) {
  if (threads <= 0) threads = hardware_threads();
  for (int t = 1; t < threads; ++t) inside_->workers.emplace_back([this] { inside_->stand_by(); });
}

Team::~Team() {
  inside_->ends.store(true, std::memory_order_release);
  ++inside_->calls;
  inside_->calls.notify_all();
  for (std::thread& worker : inside_->workers) worker.join();
}

int Team::threads() const { return static_cast<int>(inside_->workers.size()) + 1; }

void Team::run(std::size_t count, const std::function<void(std::size_t)>& body) {
  Inside& in = *inside_;
  if (in.workers.empty() || count <= 1) {
    for (std::size_t i = 0; i < count; ++i) body(i);
    return;
  }
  const std::uint64_t loop = (in.ticket.load(std::memory_order_relaxed) >> 32) + 1;
  // closed while they change: who sees a new count sees that the ticket of the loop before holds no more
  in.ticket.store(loop << 32 | kClosed, std::memory_order_relaxed);
  in.done.store(0, std::memory_order_relaxed);
  in.body.store(&body, std::memory_order_release), in.count.store(count, std::memory_order_release);
  in.ticket.store(loop << 32, std::memory_order_release);
  in.calls.fetch_add(1, std::memory_order_release);
  in.calls.notify_all();
  in.work();
  const auto all = static_cast<std::uint32_t>(count);
  if (!look([&] { return in.done.load(std::memory_order_acquire) == all; }))
    for (std::uint32_t done = in.done.load(std::memory_order_acquire); done != all;
         done = in.done.load(std::memory_order_acquire))
      in.done.wait(done, std::memory_order_acquire);
  if (in.failure) {
    const std::exception_ptr failure = std::exchange(in.failure, nullptr);
    std::rethrow_exception(failure);
  }
}

}  // namespace topple
