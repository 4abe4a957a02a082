#include "base/team.h"

#include <algorithm>
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

/// What is left of a thread's part of a loop, in one number: the loop's above, first and last below. Who takes some of
/// it knows by the loop's number that the body is still the same.
struct Part {
  static constexpr std::uint64_t kMost = 0xffff;  // to share out
  std::uint64_t number = 0;

  std::size_t first() const { return number >> 16 & kMost; }
  std::size_t last() const { return number & kMost; }
  std::uint64_t loop() const { return number >> 32; }
  bool is_empty() const { return first() == last(); }
  std::uint64_t without_first() const { return number + (1U << 16); }
  std::uint64_t without_last() const { return number - 1; }
  static std::uint64_t make(std::uint64_t loop, std::size_t first, std::size_t last) {
    return loop << 32 | first << 16 | last;
  }
};
/// Alone in its lines of the cache.
struct alignas(128) SharedPart {
  std::atomic<std::uint64_t> number = 0;
};

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
  std::vector<SharedPart> parts;  // of threads, the caller's first
  std::uint64_t loop = 0;
  std::atomic<std::size_t> count = 0, bundle = 1;  // of a loop; indices that are taken together
  std::atomic<const std::function<void(std::size_t)>*> body = nullptr;
  std::atomic<std::uint32_t> done = 0;   // bundles
  std::atomic<std::uint32_t> calls = 0;  // loops so far
  std::atomic<bool> ends = false;
  std::mutex failure_mutex;
  std::exception_ptr failure;
  std::size_t failed = 0;
  std::vector<std::thread> workers;

  std::size_t bundles() const {
    const std::size_t size = bundle.load(std::memory_order_acquire);
    return (count.load(std::memory_order_acquire) + size - 1) / size;
  }

  /// Takes of a part, its owner from the front, others from the back, until nothing is left. Others take of this loop
  /// alone: the next one begins with everybody's own.
  void work_on(std::size_t k, bool is_own, std::uint64_t joined) {
    std::atomic<std::uint64_t>& shared = parts[k].number;
    Part now{shared.load(std::memory_order_acquire)};
    while (!now.is_empty() && (is_own || now.loop() == joined)) {
      const auto* call = body.load(std::memory_order_acquire);
      const std::size_t size = bundle.load(std::memory_order_acquire), all = count.load(std::memory_order_acquire);
      const std::size_t number = is_own ? now.first() : now.last() - 1, bundles_in_all = bundles();
      if (!shared.compare_exchange_weak(now.number, is_own ? now.without_first() : now.without_last(),
                                        std::memory_order_acq_rel, std::memory_order_acquire))
        continue;
      for (std::size_t i = number * size; i < std::min(all, (number + 1) * size); ++i) {
        try {
          (*call)(i);
        } catch (...) {
          const std::lock_guard lock(failure_mutex);
          if (!failure || i < failed) failure = std::current_exception(), failed = i;
        }
      }
      if (done.fetch_add(1, std::memory_order_acq_rel) + 1 == bundles_in_all) done.notify_one();
      now.number = shared.load(std::memory_order_acquire);
    }
  }
  /// The part of thread `k`, which it had in the loops before and so has in its cache, then what others have left.
  void work(std::size_t k) {
    const std::uint64_t joined = Part{parts[k].number.load(std::memory_order_acquire)}.loop();
    work_on(k, true, joined);
    for (std::size_t i = 1; i < parts.size(); ++i) work_on((k + i) % parts.size(), false, joined);
  }

  void stand_by(std::size_t k) {
    std::uint32_t seen = 0;
    for (;;) {
      const auto is_called = [&] { return calls.load(std::memory_order_acquire) != seen; };
      if (!look(is_called)) calls.wait(seen, std::memory_order_acquire);
      if (ends.load(std::memory_order_acquire)) return;
      seen = calls.load(std::memory_order_acquire);
      work(k);
    }
  }
};

Team::Team(int threads) : inside_(std::make_unique<Inside>()) {
  if (threads <= 0) threads = hardware_threads();
  inside_->parts = std::vector<SharedPart>(static_cast<std::size_t>(threads));
  for (std::size_t t = 1; t < inside_->parts.size(); ++t)
    inside_->workers.emplace_back([this, t] { inside_->stand_by(t); });
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
  // nobody takes anything of the loop before: nothing is left of it
  in.done.store(0, std::memory_order_relaxed);
  in.body.store(&body, std::memory_order_release), in.count.store(count, std::memory_order_release);
  in.bundle.store((count + Part::kMost - 1) / Part::kMost, std::memory_order_release);
  const std::size_t bundles = in.bundles(), threads = in.parts.size();
  ++in.loop;
  for (std::size_t k = 0; k < threads; ++k)
    in.parts[k].number.store(Part::make(in.loop & 0xffffffffU, bundles * k / threads, bundles * (k + 1) / threads),
                             std::memory_order_release);
  in.calls.fetch_add(1, std::memory_order_release);
  in.calls.notify_all();
  in.work(0);
  const auto all = static_cast<std::uint32_t>(bundles);
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
