#include "fem/contact_skin.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
#include <cstring>
#include <random>
#include <set>

#include "fem/explicit_kernel.h"

namespace topple::fem::lanes {
namespace {

/// Squares of 2 m in random places and directions, of elements 1 m thick.
struct Squares {
  AlignedVector<double> rows;
  FaceCorners corners;
  Skin skin;
  std::vector<std::array<Vec3, 4>> axes;  // middle, two unit vectors in the plane, normal
  explicit Squares(std::uint32_t count) {
    std::mt19937 random(3);
    std::uniform_real_distribution<double> number(-1, 1);
    const auto vector = [&] { return Vec3{number(random), number(random), number(random)}; };
    for (std::uint32_t f = 0; f < count; ++f) {
      const Vec3 middle = 6 * vector(), first = vector(), n = cross(first, vector());
      const Vec3 a = (1 / norm(first)) * first, normal = (1 / norm(n)) * n, b = cross(normal, a);
      axes.push_back({middle, a, b, normal});
      for (std::uint32_t k = 0; k < 8; ++k) {
        const double xi = k % 4 == 1 || k % 4 == 2 ? 1 : -1, eta = k % 4 >= 2 ? 1 : -1;
        const Vec3 p = middle + xi * a + eta * b - (k < 4 ? 0.0 : 1.0) * normal;
        rows.insert(rows.end(), {p.x, p.y, p.z, 0, 0, 0, 1, 1});
        corners[k].push_back(8 * f + k);
      }
    }
    fill_runs(corners);
    make_skin(rows.data(), 0.4, corners, count, skin);
  }
};

TEST(ContactSkin, FindsTheFacesNearAPoint) {
  const Squares squares(61);  // no multiple of a run
  std::mt19937 random(5);
  std::uniform_real_distribution<double> number(-7, 7);
  constexpr double kNear = 0.3, kMargin = 0.2;
  size_t all = 0;
  std::vector<std::uint32_t> found;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 p{number(random), number(random), number(random)};
    find_faces(squares.skin, p, kNear, kMargin, found);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end()));
    const std::set<std::uint32_t> is_found(found.begin(), found.end());
    for (std::uint32_t f = 0; f < 61; ++f) {
      const auto& [middle, a, b, normal] = squares.axes[f];
      const Vec3 d = p - middle;
      const double height = dot(d, normal), beside = std::max(std::abs(dot(d, a)), std::abs(dot(d, b))) - 1;
      // a face counts as a hundredth larger than it is
      const bool is_far = height > kNear || height < -(0.4 + kMargin) || beside > kNear + 0.01 + 1e-9;
      const Vec3 away{std::max(0.0, std::abs(dot(d, a)) - 1), std::max(0.0, std::abs(dot(d, b)) - 1),
                      std::max({0.0, height, -(0.4 + kMargin - kNear) - height})};
      const bool is_near = norm(away) < kNear;
      if (is_near) { EXPECT_EQ(is_found.count(f), 1U); }
      if (is_far) { EXPECT_EQ(is_found.count(f), 0U); }
      all += is_near ? 1 : 0;
    }
  }
  EXPECT_GT(all, 200U);
}

TEST(ContactSkin, FindsTheFacesThatBallsMayTouch) {
  const Squares squares(61);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(-7, 7);
  std::vector<Particle> balls(400);
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t i = 0; i < balls.size(); ++i) {
    balls[i].p = {number(random), number(random), number(random)};
    balls[i].v = {number(random), number(random), number(random)};
    balls[i].radius = 0.4 + 0.05 * number(random);
    if (i % 3 > 0) numbers.push_back(i);
  }
  // faces that turn about z at 2 rad/s: half a metre along x beside the place they are 1 m/s faster along y
  const Ahead ahead{0.01, 0.02, {{1, 1, 0}, {3, -2, 1}, {0, 0, 2}, 0.5, 7, 20}};
  EXPECT_NEAR(ahead.calc_path({1.5, 1, 9}, {3, 3, 4}), 2 * 0.01 * (5 + 0.5) + 0.02, 1e-15);
  EXPECT_NEAR(ahead.calc_path(), 2 * 0.01 * 20 + 0.02, 1e-15);
  std::set<std::array<std::uint32_t, 2>> expected;
  for (const std::uint32_t i : numbers)
    for (std::uint32_t f = 0; f < 61; ++f)
      if (calc_gap(squares.skin.face(f), balls[i].p, balls[i].radius) < ahead.calc_path(balls[i].p, balls[i].v))
        expected.insert({i, f});
  EXPECT_GT(expected.size(), 40U);
  std::vector<std::array<std::uint32_t, 2>> found;
  for (size_t run = 0; run < squares.skin.runs(); ++run) {
    const size_t before = found.size();
    find_near_faces(squares.skin, run, balls.data(), numbers, ahead, found);
    for (size_t i = before; i < found.size(); ++i) EXPECT_EQ(found[i][1] / kFaceRun, run);
  }
  EXPECT_EQ(found.size(), expected.size());
  EXPECT_EQ((std::set<std::array<std::uint32_t, 2>>(found.begin(), found.end())), expected);
}

TEST(ContactSkin, TellsHowFarBallsAreFromAFace) {
  // a square of 2 m, its element 1 m thick: from above, behind, beside and off a corner
  SkinFace face;
  face.normal = {0, 0, 1}, face.along = {1, 0, 0}, face.across = {0, 1, 0};
  face.wide = face.high = 1, face.depth = 0.4;
  EXPECT_NEAR(calc_gap(face, {0.3, 0.2, 2}, 0.5), 1.5, 1e-14);
  EXPECT_NEAR(calc_gap(face, {0.3, 0.2, 0.2}, 0.1), 0.1, 1e-14);
  EXPECT_NEAR(calc_gap(face, {4, 5, 0}, 0.5), 3.5, 1e-14);
  EXPECT_NEAR(calc_gap(face, {4, 5, 3}, 0.5), 4.5, 1e-14);
  EXPECT_EQ(calc_gap(face, {0.3, 0.2, -0.3}, 0.5), 0);
  EXPECT_NEAR(calc_gap(face, {0.3, 0.2, -0.9}, 0.5), 0.5, 1e-14);
}

TEST(ContactSkin, FindsThePointsInABox) {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> number(-3, 3);
  Places places;
  std::vector<Vec3> points;
  for (int i = 0; i < 61; ++i) {  // no multiple of a run
    points.push_back({number(random), number(random), number(random)});
    places.add(points.back());
    EXPECT_EQ(norm(places[points.size() - 1] - points.back()), 0);
  }
  ContactBox box;
  box.add({-1, -2, 0}, 0), box.add({2, 1, 2}, 0);
  const std::int64_t supported = hwy::SupportedTargets();
  for (std::int64_t left = supported; left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    for (const double near : {0.0, 0.25, 9.0}) {
      std::vector<std::uint32_t> found, expected;
      for (std::uint32_t i = 0; i < 61; ++i)
        if (box.has(points[i], near)) expected.push_back(i);
      find_points(places, box, near, found);
      EXPECT_FALSE(found.empty());
      EXPECT_EQ(found, expected);
    }
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST(ContactSkin, MeasuresHowAGroupMoves) {
  // 45 nodes of a body that turns about a place far off, and one without mass
  std::mt19937 random(13);
  std::uniform_real_distribution<double> number(-1, 1);
  const Vec3 turning{0.3, -0.2, 0.5}, about{40, -30, 20}, middle{100, 200, 5};
  AlignedVector<double> rows;
  std::vector<Vec3> places;
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t i = 0; i < 46; ++i) {
    const Vec3 p = middle + Vec3{number(random), 2 * number(random), 0.3 * number(random)};
    const Vec3 v = i == 20 ? Vec3{500, 500, 500} : cross(turning, p - about);
    rows.insert(rows.end(), {p.x, p.y, p.z, v.x, v.y, v.z, i == 20 ? 0.0 : 1.0, i == 20 ? 0.0 : 1.0});
    nodes.push_back(i);
    if (i != 20) places.push_back(p);
  }
  Vec3 mean;
  for (const Vec3& p : places) mean += (1.0 / 45) * p;
  double reach = 0;
  for (const Vec3& p : places) reach = std::max(reach, norm(p - mean));
  const std::int64_t supported = hwy::SupportedTargets();
  std::vector<GroupMotion> measured;
  for (std::int64_t left = supported; left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    ContactBox box;
    const GroupMotion motion = measure_motion(rows.data(), nodes, box);
    EXPECT_LT(norm(motion.place - mean), 1e-12);
    EXPECT_LT(norm(motion.turning - turning), 1e-11);
    EXPECT_LT(norm(motion.speed - cross(turning, mean - about)), 1e-11);
    EXPECT_LT(motion.spread, 1e-11);
    EXPECT_NEAR(motion.reach, reach, 1e-12);
    for (const Vec3& p : places) {
      EXPECT_TRUE(box.has(p, 0));
      EXPECT_GE(motion.most, norm(cross(turning, p - about)) - 1e-11);
    }
    EXPECT_LT(motion.most, norm(cross(turning, mean - about)) + norm(turning) * reach);
    EXPECT_LT(norm(box.high - box.low), 6);
    measured.push_back(motion);
    EXPECT_EQ(std::memcmp(&motion, measured.data(), sizeof(motion)), 0);  // with every instruction set

    // what deviates is found whole: the mean takes a 45th of it, the turn less than a tenth
    AlignedVector<double> shaken = rows;
    shaken[8 * 7 + 5] += 0.7;
    const GroupMotion with = measure_motion(shaken.data(), nodes, box);
    EXPECT_GT(with.spread, 0.6);
    EXPECT_LT(with.spread, 0.7);
    // a single node, nodes on a line, none
    EXPECT_EQ(norm(measure_motion(rows.data(), std::span(nodes).first(1), box).turning), 0);
    EXPECT_GT(measure_motion(rows.data(), std::span(nodes).first(2), box).spread, 0);
    EXPECT_EQ(measure_motion(rows.data(), std::span(nodes).subspan(20, 1), box).most, 0);
    EXPECT_TRUE(box.is_empty());
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST(ContactSkin, IsTheSameWithEveryInstructionSet) {
  const std::int64_t supported = hwy::SupportedTargets();
  std::vector<Skin> skins;
  std::vector<std::uint32_t> first;
  for (std::int64_t left = supported; left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    skins.push_back(Squares(61).skin);
    EXPECT_EQ(skins.back().faces, skins.front().faces);
    EXPECT_EQ(skins.back().boxes, skins.front().boxes);
    std::vector<std::uint32_t> found;
    find_faces(skins.back(), {0, 0, 0}, 2, 0.2, found);
    if (first.empty()) first = found;
    EXPECT_FALSE(found.empty());
    EXPECT_EQ(found, first);
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

}  // namespace
}  // namespace topple::fem::lanes
