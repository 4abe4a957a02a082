#include "collapse/debris.h"

#include <gtest/gtest.h>

#include <cmath>

namespace topple::collapse {
namespace {

const Polygon kSquare{{0, 0}, {1, 0}, {1, 1}, {0, 1}};

TEST(Debris, HullLeavesOutInnerPointsAndPointsOnEdges) {
  const Polygon hull = calc_hull({{0, 0}, {2, 0}, {1, 0}, {1, 1}, {2, 2}, {0, 2}, {0, 1}, {2, 0}});
  ASSERT_EQ(hull.size(), 4u);
  EXPECT_NEAR(calc_area(hull), 4, 1e-15);
  EXPECT_LE(calc_hull({{1, 1}, {1, 1}}).size(), 1u);
}

TEST(Debris, DistanceOfPolygons) {
  const Polygon right{{3, 0}, {4, 0}, {4, 1}};
  EXPECT_NEAR(calc_distance(kSquare, right), 2, 1e-15);
  const Polygon corner{{2, 3}, {3, 3}, {3, 4}};
  EXPECT_NEAR(calc_distance(kSquare, corner), std::hypot(1, 2), 1e-15);
  EXPECT_EQ(calc_distance(kSquare, {{0.4, 0.4}, {0.6, 0.4}, {0.5, 0.6}}), 0);        // one inside the other
  EXPECT_EQ(calc_distance(kSquare, {{0.5, -1}, {0.6, -1}, {0.6, 2}, {0.5, 2}}), 0);  // crossing without corners inside
}

TEST(Debris, OutlineOfATurnedBox) {
  const double eighth = std::acos(-1.0) / 4;
  const Polygon p = calc_outline({{{0, 0, 1}, exp_rotation({0, 0, eighth})}, {1, 1, 1}});
  EXPECT_NEAR(calc_area(p), 4, 1e-12);
  EXPECT_NEAR(calc_distance(p, {{2, -1}, {3, -1}, {3, 1}, {2, 1}}), 2 - std::sqrt(2.0), 1e-12);
}

TEST(Debris, HeapCountsWhatLiesUnderItsSurface) {
  // a slab on two blocks: the space under it counts as bulk
  const std::vector<PlacedBox> boxes{
      {{{0.5, 1, 0.5}, {}}, {0.5, 1, 0.5}}, {{{3.5, 1, 0.5}, {}}, {0.5, 1, 0.5}}, {{{2, 1, 1.1}, {}}, {2, 1, 0.1}}};
  const Heap heap = calc_heap(boxes, 0.25);
  EXPECT_NEAR(heap.height, 1.2, 1e-12);
  EXPECT_NEAR(heap.volume, 4 * 2 * 1.2, 1e-9);  // edges lie on the grid
  // a cube on its edge: a roof of slope 1, sampled in the middle of cells, within a cell of its outline
  const double eighth = std::acos(-1.0) / 4, half = std::sqrt(2.0);
  const Heap roof = calc_heap({{{{0, 0, half}, exp_rotation({0, eighth, 0})}, {1, 1, 1}}}, 0.05);
  EXPECT_NEAR(roof.volume, 2 * (2 * half * half + half * half), 0.05 * 2 * 2 * half);
}

}  // namespace
}  // namespace topple::collapse
