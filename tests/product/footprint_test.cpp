#include "product/footprint.h"

#include <gtest/gtest.h>

namespace topple::product {
namespace {

using Outline = std::vector<std::array<double, 2>>;

const Outline square = {{0, 0}, {10, 0}, {10, 10}, {0, 10}};

TEST(Footprint, OverlapIsTheAreaInCommon) {
  EXPECT_DOUBLE_EQ(calc_overlap(square, square), 100);
  EXPECT_DOUBLE_EQ(calc_overlap({{2, 2}, {4, 2}, {4, 5}, {2, 5}}, square), 6);            // within
  EXPECT_DOUBLE_EQ(calc_overlap({{-5, -5}, {20, -5}, {20, 20}, {-5, 20}}, square), 100);  // around
  EXPECT_DOUBLE_EQ(calc_overlap({{-5, 3}, {20, 3}, {20, 4}, {-5, 4}}, square), 10);       // across
  EXPECT_DOUBLE_EQ(calc_overlap({{10, 0}, {15, 0}, {15, 10}, {10, 10}}, square), 0);      // wall to wall
  EXPECT_DOUBLE_EQ(calc_overlap({{20, 0}, {25, 0}, {25, 10}}, square), 0);                // beside
  EXPECT_DOUBLE_EQ(calc_overlap({{8, -1}, {12, -1}, {12, 11}, {8, 11}, {8, 8}, {11, 8}, {11, 2}, {8, 2}}, square), 8);
}

TEST(Footprint, CrossesItselfInEdgesAndCorners) {
  EXPECT_FALSE(crosses_itself(square));
  EXPECT_FALSE(crosses_itself({{0, 0}, {5, 0}, {10, 0}, {10, 10}}));                    // straight on
  EXPECT_FALSE(crosses_itself({{0, 0}, {0, 0}, {10, 0}, {10, 10}, {10, 10}, {0, 0}}));  // corners given twice
  EXPECT_FALSE(crosses_itself({{0, 0}, {10, 0}, {10, 10}, {5, 0}, {0, 10}}));           // touches an edge
  EXPECT_FALSE(crosses_itself({{0, 0}, {5, 5}, {10, 0}, {10, 9}, {5, 5}, {0, 9}}));     // touches a corner
  EXPECT_FALSE(crosses_itself(
      {{0, 0}, {9, 0}, {9, 9}, {0, 9}, {0, 0}, {1, 1}, {1, 8}, {8, 8}, {8, 1}, {1, 1}}));  // a ring with a slit
  EXPECT_TRUE(crosses_itself({{0, 0}, {10, 10}, {10, 0}, {0, 10}}));
  EXPECT_TRUE(crosses_itself({{0, 0}, {4, 0}, {4, 4}, {2, 0}, {2, -4}, {0, -4}}));  // through an edge in a corner
  EXPECT_TRUE(crosses_itself({{0, 0}, {5, 5}, {10, 9}, {10, 0}, {5, 5}, {0, 9}}));  // through a corner
  EXPECT_TRUE(crosses_itself({{0, 0}, {10, 0}, {10, 20}, {10, 10}, {0, 10}}));      // back on itself
}

}  // namespace
}  // namespace topple::product
