#include "fem/contact_skin.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <algorithm>
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
      const bool is_near = height < kNear && height > -(0.4 + kMargin) && beside<kNear, is_far = height> kNear ||
                           height < -(0.4 + kMargin) || beside > kNear + 0.01 + 1e-9;
      if (is_near) { EXPECT_EQ(is_found.count(f), 1U); }
      if (is_far) { EXPECT_EQ(is_found.count(f), 0U); }
      all += is_near ? 1 : 0;
    }
  }
  EXPECT_GT(all, 200U);
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
