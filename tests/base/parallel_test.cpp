#include "base/parallel.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace topple {
namespace {

TEST(ParallelFor, DoesEveryIndexOnce) {
  for (const int threads : {0, 1, 2, 4, 7}) {
    for (const std::size_t count : {0, 1, 3, 1000}) {
      std::vector<std::atomic<int>> calls(count);
      EXPECT_TRUE(parallel_for(count, threads, [&](std::size_t i) { ++calls[i]; }));
      for (const auto& c : calls) EXPECT_EQ(c, 1);
    }
  }
}

TEST(ParallelForReplay, GivesTheSameBitsAtOneTwoAndFourThreads) {
  const auto run = [](int threads) {
    std::vector<double> terms(5000);
    EXPECT_TRUE(parallel_for(terms.size(), threads, [&](std::size_t i) { terms[i] = std::sin(1.0 + double(i)) / 3; }));
    double sum = 0;
    for (const double t : terms) sum += t;
    return std::pair{terms, sum};
  };
  const auto alone = run(1);
  EXPECT_EQ(run(2), alone);
  EXPECT_EQ(run(4), alone);
}

TEST(ParallelFor, UsesTheThreadsItIsGiven) {
  // Two bodies that wait for each other end only if they run at the same time.
  std::atomic<int> arrived = 0;
  std::atomic<int> met = 0;
  EXPECT_TRUE(parallel_for(2, 2, [&](std::size_t) {
    ++arrived;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (arrived < 2 && std::chrono::steady_clock::now() < end) std::this_thread::yield();
    if (arrived == 2) ++met;
  }));
  EXPECT_EQ(met, 2);
}

TEST(ParallelFor, OneThreadIsTheCallersInOrder) {
  std::vector<std::size_t> order;
  std::set<std::thread::id> threads;
  EXPECT_TRUE(parallel_for(5, 1, [&](std::size_t i) {
    order.push_back(i);
    threads.insert(std::this_thread::get_id());
  }));
  EXPECT_EQ(order, (std::vector<std::size_t>{0, 1, 2, 3, 4}));
  EXPECT_EQ(threads, std::set{std::this_thread::get_id()});
}

TEST(ParallelFor, ThrowsTheLowestFailureAtAnyNumberOfThreads) {
  for (const int threads : {1, 2, 4}) {
    for (int repeat = 0; repeat < 50; ++repeat) {
      std::vector<std::atomic<int>> calls(400);
      try {
        (void)parallel_for(calls.size(), threads, [&](std::size_t i) {
          ++calls[i];
          if (i % 100 == 57) throw std::runtime_error(std::to_string(i));
        });
        FAIL() << "nothing was thrown";
      } catch (const std::runtime_error& error) { EXPECT_STREQ(error.what(), "57"); }
      for (std::size_t i = 0; i <= 57; ++i) EXPECT_EQ(calls[i], 1) << i;
    }
  }
}

TEST(ParallelFor, StopsWhenCancelled) {
  for (const int threads : {1, 3}) {
    std::atomic<bool> cancel = false;
    std::atomic<int> calls = 0;
    EXPECT_FALSE(parallel_for(
        100000, threads,
        [&](std::size_t) {
          if (++calls == 10) cancel = true;
        },
        &cancel));
    // the indices that were under way when the flag rose
    EXPECT_LE(calls, 10 + threads - 1);
    EXPECT_GE(calls, 10);
  }
}

TEST(ParallelFor, NestsWithoutLoss) {
  std::vector<std::atomic<int>> calls(64);
  EXPECT_TRUE(parallel_for(
      8, 4, [&](std::size_t i) { EXPECT_TRUE(parallel_for(8, 2, [&](std::size_t j) { ++calls[8 * i + j]; })); }));
  for (const auto& c : calls) EXPECT_EQ(c, 1);
}

}  // namespace
}  // namespace topple
