#include "collapse/debris.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "collapse/debris_tables.h"
#include "collapse/outcome.h"

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

/// Three parts of 1, 1 and 2 t on a footprint of 4 m x 4 m: one inside, one 1 m and one 5 m beyond it towards +x.
record::Record make_three() {
  record::Record r;
  r.building_outline = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  const double x[] = {2, 4.5, 8.5};
  for (int b = 0; b < 3; ++b) {
    record::BodyInfo body;
    body.name = std::to_string(b);
    body.mass = b == 0 ? 2000 : 1000;
    body.shapes = {{{}, {0.5, 0.5, 1}, "concrete"}};
    r.bodies.push_back(body);
    for (const double p : {x[b], 2.0, 1.0}) r.position.push_back(static_cast<float>(p));
    for (const double q : {1.0, 0.0, 0.0, 0.0}) r.orientation.push_back(static_cast<float>(q));
  }
  r.time = {0};
  return r;
}

TEST(Reach, CountsTheMassTowardsEachSide) {
  const record::Record r = make_three();
  const Reach reach = calc_reach(r, 0);
  EXPECT_NEAR(reach.largest, 5, 1e-6);
  EXPECT_NEAR(reach.side[1], 5, 1e-6);
  EXPECT_EQ(reach.side[0], 0);
  EXPECT_NEAR(reach.side_most[1], 5, 1e-6);  // the last quarter of the mass is more than 5 %
  EXPECT_EQ(reach.side_most[2], 0);
  EXPECT_EQ(reach.farthest, 2);
  // outlines from the nearest part on: 1 m2, then from x = 1.5 to 5 m
  EXPECT_NEAR(calc_area(calc_share_outline(r, 0, 0.5)), 1, 1e-6);
  EXPECT_NEAR(calc_area(calc_share_outline(r, 0, 0.7)), 3.5, 1e-6);
  EXPECT_NEAR(calc_area(calc_share_outline(r, 0, 1)), 7.5, 1e-6);
}

TEST(DebrisTables, HoldEverySquareAndEveryCorner) {
  const std::string heights = make_height_table(make_three(), 0.5);
  // three boxes of 1 m x 1 m, each over four squares, 2 m high
  EXPECT_EQ(std::count(heights.begin(), heights.end(), '\n'), 1 + 3 * 4);
  EXPECT_NE(heights.find("1.75,1.75,2\r\n"), std::string::npos) << heights;
  const std::string outlines = make_outline_table(make_three());
  EXPECT_EQ(std::count(outlines.begin(), outlines.end(), '\n'), 1 + 4 * 4);  // four rectangles
  EXPECT_EQ(make_height_table({}, 0.5), "x [m],y [m],height [m]\r\n");
}

}  // namespace
}  // namespace topple::collapse
