#include "collapse/assembly.h"

#include <gtest/gtest.h>

namespace topple::collapse {
namespace {

TEST(Assembly, BodyOfTwoBoxesHasTheirMassCentreAndInertia) {
  Assembly a{"a", "column", 0, false, {}};
  a.parts.push_back(make_part({0, 0, 0}, {1, 2, 3}, 6, 0));
  a.parts.push_back(make_part({1, 0, 0}, {3, 2, 3}, 12, 0));  // of the same density: one box of 3 x 2 x 3
  const mbs::Body b = make_body(a, default_knowledge());
  EXPECT_DOUBLE_EQ(b.mass, 18);
  EXPECT_NEAR(norm(b.X_WB.p - Vec3{1.5, 1, 1.5}), 0, 1e-15);
  // m/12 (b² + c²); round-off of sums of squares
  EXPECT_NEAR(b.inertia(0, 0), 18.0 / 12 * (4 + 9), 1e-12);
  EXPECT_NEAR(b.inertia(1, 1), 18.0 / 12 * (9 + 9), 1e-12);
  EXPECT_NEAR(b.inertia(2, 2), 18.0 / 12 * (9 + 4), 1e-12);
  EXPECT_NEAR(b.inertia(0, 1), 0, 1e-12);
}

TEST(Assembly, InertiaHasProductsOfUnsymmetricParts) {
  Assembly a{"a", "column", 0, false, {}};
  a.parts.push_back(make_part({-1.1, -1.1, -0.1}, {-0.9, -0.9, 0.1}, 5, 0));
  a.parts.push_back(make_part({0.9, 0.9, -0.1}, {1.1, 1.1, 0.1}, 5, 0));
  const mbs::Body b = make_body(a, default_knowledge());
  EXPECT_NEAR(b.inertia(0, 1), -10, 1e-12);  // -Σ m x y
  EXPECT_EQ(b.inertia(0, 1), b.inertia(1, 0));
}

TEST(Assembly, CutTakesTheLengthAndItsMassOut) {
  Assembly a{"a", "column", 0, false, {}};
  a.parts.push_back(make_part({0, 0, 0}, {0.5, 0.5, 4}, 2400, 7));
  a.parts.push_back(make_part({1, 0, 0}, {2, 1, 4}, 100, 8));
  const std::vector<Part> removed = cut_member(a, 7, 2, 1, 2);
  ASSERT_EQ(removed.size(), 1u);
  EXPECT_NEAR(removed[0].mass, 600, 1e-9);
  EXPECT_NEAR(a.mass(), 1900, 1e-9);
  ASSERT_EQ(a.parts.size(), 3u);
  EXPECT_NEAR(a.parts[0].half.z, 0.5, 1e-12);
  EXPECT_NEAR(a.parts[1].centre.z, 3, 1e-12);
}

TEST(Assembly, CutLeavesASliverOfABodyThatWouldVanish) {
  Assembly a{"a", "stump", 0, true, {make_part({0, 0, 0}, {0.5, 0.5, 1}, 600, 7)}};
  const std::vector<Part> removed = cut_member(a, 7, 2, -0.2, 1.5);
  EXPECT_NEAR(a.mass(), 6, 1e-9);
  EXPECT_NEAR(removed[0].mass, 594, 1e-9);
  EXPECT_NEAR(a.parts[0].centre.z, 0.005, 1e-12);  // at the foot
}

TEST(Assembly, WallPartsGoAroundOpenings) {
  product::Member m;
  m.start = {0, 0, 3}, m.end = {5, 0, 3}, m.height = 2.5;
  m.openings = {{1, 0.9, 1, 1.2}, {3, 0, 0.8, 2.1}};
  const std::vector<Part> parts = make_wall_parts(m, 0, 0.1, 1000, true, 0.2, 0.2, "concrete");
  double volume = 0, mass = 0;
  for (const Part& p : parts) {
    volume += 8 * p.half.x * p.half.y * p.half.z;
    mass += p.mass;
    for (const product::Opening& o : m.openings)
      EXPECT_FALSE(std::abs(p.centre.x - o.left - o.width / 2) < p.half.x + o.width / 2 - 1e-9 &&
                   std::abs(p.centre.z - 3 - o.sill - o.height / 2) < p.half.z + o.height / 2 - 1e-9);
  }
  EXPECT_NEAR(volume, 0.1 * (4.6 * 2.5 - 1 * 1.2 - 0.8 * 2.1), 1e-12);
  EXPECT_NEAR(mass, 1000, 1e-9);
}

}  // namespace
}  // namespace topple::collapse
