#include "fem/contact_balls.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <limits>
#include <random>

namespace topple::fem {
namespace {

/// Balls in a room, a few of which reach far or are far away.
struct Balls {
  std::vector<Particle> particles;
  std::vector<double> reach;
  explicit Balls(size_t count) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> at(-5, 5), size(0.2, 0.4);
    for (size_t i = 0; i < count; ++i) {
      Particle& q = particles.emplace_back();
      q.p = {at(random), at(random), 0.3 * at(random)};
      reach.push_back(size(random));
      if (i % 401 == 7) reach.back() = 3;
      if (i % 503 == 9) q.p.x = 400, q.p.z = -200 + 0.5 * at(random);
    }
  }
};

/// Calls body with every instruction set.
template <class Body>
void for_targets(const Body& body) {
  for (std::int64_t left = hwy::SupportedTargets(); left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    body();
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  }
}

TEST(BallCells, FindThePairsThatLookingAtAllFinds) {
  Team team(2);
  for (const size_t count : {0, 1, 2, 300, 3000}) {
    const Balls balls(count);
    std::vector<ParticlePair> expected;
    for (std::uint32_t a = 0; a < count; ++a)
      for (std::uint32_t b = 0; b < a; ++b)
        if (norm(balls.particles[a].p - balls.particles[b].p) < balls.reach[a] + balls.reach[b])
          expected.push_back({a, b});
    for_targets([&] {
      const BallCells cells(balls.particles, balls.reach, team);
      std::vector<std::vector<ParticlePair>> found(cells.tasks());
      for (size_t task = 0; task < found.size(); ++task) cells.find_pairs(task, found[task]);
      EXPECT_EQ(sort_pairs(found, count), expected) << count;
    });
    EXPECT_TRUE(count < 300 || expected.size() > count / 2);
  }
}

TEST(BallCells, FindPairsBesideABallThatIsNowhere) {
  Team team(1);
  Balls balls(2);
  for (const double place : {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    balls.particles.resize(3), balls.reach = {1, 1, 1};
    balls.particles[0].p = {0, 0, 0}, balls.particles[1].p = {1, 1, 0}, balls.particles[2].p = {place, place, 0};
    const BallCells cells(balls.particles, balls.reach, team);
    std::vector<std::vector<ParticlePair>> found(cells.tasks());
    for (size_t task = 0; task < found.size(); ++task) cells.find_pairs(task, found[task]);
    EXPECT_EQ(sort_pairs(found, 3), (std::vector<ParticlePair>{{1, 0}}));
  }
}

TEST(BallCells, FindThoseThatReachABox) {
  Team team(2);
  const Balls balls(3000);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> at(-6, 6);
  size_t all = 0;
  for (int i = 0; i < 100; ++i) {
    ContactBox box;
    const Vec3 p{at(random), at(random), at(random)};
    box.add(p, 0), box.add(p + 0.05 * Vec3{at(random), at(random), at(random)}, 0);
    if (i == 50) box.add({400, 0, -200}, 0);
    std::vector<std::uint32_t> expected, found;
    for (std::uint32_t k = 0; k < balls.particles.size(); ++k)
      if (box.has(balls.particles[k].p, balls.reach[k])) expected.push_back(k);
    for_targets([&] {
      const BallCells cells(balls.particles, balls.reach, team);
      cells.find_in_box(box, found);
      std::sort(found.begin(), found.end());
      EXPECT_EQ(found, expected);
      EXPECT_EQ(cells.has_in_box(box), !expected.empty());
    });
    all += expected.size();
  }
  EXPECT_GT(all, 100U);
  const BallCells cells(balls.particles, balls.reach, team);
  std::vector<std::uint32_t> found{1};
  cells.find_in_box({}, found);
  EXPECT_TRUE(found.empty());
  EXPECT_FALSE(cells.has_in_box({}));
}

}  // namespace
}  // namespace topple::fem
