#include "base/team.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <ctime>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace topple {
namespace {

TEST(Team, DoesEveryIndexOnceInLoopAfterLoop) {
  for (const int threads : {0, 1, 2, 4, 7}) {
    Team team(threads);
    std::vector<int> calls(100, 0);
    for (std::size_t loop = 0; loop < 3000; ++loop) team.run(loop % 100, [&](std::size_t i) { ++calls[i]; });
    for (std::size_t i = 0; i < calls.size(); ++i) EXPECT_EQ(calls[i], 30 * (99 - static_cast<int>(i)));
  }
}

TEST(Team, UsesTheThreadsItIsGiven) {
  // two bodies that wait for each other end only if they run at the same time
  Team team(2);
  EXPECT_EQ(team.threads(), 2);
  std::atomic<int> here = 0;
  team.run(2, [&](std::size_t) {
    ++here;
    while (here < 2) std::this_thread::yield();
  });
  EXPECT_EQ(here, 2);
}

TEST(Team, GivesAThreadTheSamePartInEveryLoop) {
  Team team(2);
  for (int loop = 0; loop < 1000; ++loop) {
    std::atomic<int> here = 0;
    std::vector<std::thread::id> by(2);
    team.run(2, [&](std::size_t i) {
      by[i] = std::this_thread::get_id();
      ++here;
      while (here < 2) std::this_thread::yield();
    });
    ASSERT_EQ(by[0], std::this_thread::get_id());
  }
}

TEST(Team, DoesMoreIndicesThanItCountsOneByOne) {
  Team team(3);
  std::vector<unsigned char> calls(200001, 0);
  team.run(calls.size(), [&](std::size_t i) { ++calls[i]; });
  for (std::size_t i = 0; i < calls.size(); ++i) ASSERT_EQ(calls[i], 1) << i;
}

TEST(Team, WaitsAsleep) {
  Team team(4);
  team.run(8, [](std::size_t) {});
  const std::clock_t before = std::clock();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  // three threads that went on looking would use up to 900 ms
  EXPECT_LT(static_cast<double>(std::clock() - before) / CLOCKS_PER_SEC, 0.05);
  // and they wake up again, also while the caller waits long for one of them
  std::atomic<int> here = 0;
  team.run(2, [&](std::size_t i) {
    ++here;
    while (here < 2) std::this_thread::yield();
    if (i == 1) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  });
  EXPECT_EQ(here, 2);
}

TEST(Team, ThrowsWhatTheLowestIndexThrewAndGoesOn) {
  for (const int threads : {1, 2, 4}) {
    Team team(threads);
    std::vector<int> calls(50, 0);
    try {
      team.run(50, [&](std::size_t i) {
        if (i == 20 || i == 30) throw std::runtime_error(std::to_string(i));
        ++calls[i];
      });
      ADD_FAILURE() << "must throw";
    } catch (const std::runtime_error& error) { EXPECT_STREQ(error.what(), "20"); }
    for (std::size_t i = 0; i < 20; ++i) EXPECT_EQ(calls[i], 1);
    int again = 0;
    team.run(1, [&](std::size_t) { ++again; });
    EXPECT_EQ(again, 1);
  }
}

}  // namespace
}  // namespace topple
