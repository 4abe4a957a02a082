#include "base/union_outline.h"

#include <gtest/gtest.h>

#include <cmath>

namespace topple {
namespace {

using Loop = std::vector<std::array<double, 2>>;

double calc_area(const Loop& loop) {
  double area = 0;
  for (size_t i = 0; i < loop.size(); ++i) {
    const auto &a = loop[i], &b = loop[(i + 1) % loop.size()];
    area += 0.5 * (a[0] * b[1] - b[0] * a[1]);
  }
  return area;
}

TEST(UnionOutline, OfAnLKeepsItsInnerCorner) {
  const auto loops = calc_union_outlines({{{0, 0}, {4, 2}}, {{0, 1}, {1, 5}}, {{0.5, 0.5}, {0.75, 3}}});
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(loops[0], (Loop{{0, 0}, {4, 0}, {4, 2}, {1, 2}, {1, 5}, {0, 5}}));
}

TEST(UnionOutline, LeavesOutHolesAndTellsApartWhatStandsApart) {
  // a frame around a yard, what stands in the yard, and another one that touches a corner
  const auto loops = calc_union_outlines(
      {{{0, 0}, {6, 1}}, {{0, 5}, {6, 6}}, {{0, 0}, {1, 6}}, {{5, 0}, {6, 6}}, {{2, 2}, {3, 3}}, {{6, 6}, {7, 8}}});
  ASSERT_EQ(loops.size(), 3u);
  EXPECT_EQ(loops[0], (Loop{{0, 0}, {6, 0}, {6, 6}, {0, 6}}));
  EXPECT_EQ(loops[1], (Loop{{2, 2}, {3, 2}, {3, 3}, {2, 3}}));
  EXPECT_EQ(loops[2], (Loop{{6, 6}, {7, 6}, {7, 8}, {6, 8}}));
}

TEST(UnionOutline, JoinsWhatRoundingParts) {
  const auto loops = calc_union_outlines({{{0, 0}, {1, 1}}, {{1.0004, 0.0003}, {2, 1.0002}}});
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(loops[0].size(), 4u);
}

TEST(UnionOutline, EnclosesTheAreaThatIsCovered) {
  // a chequered board of closed rings of squares: areas add up as counted, whatever touches
  std::vector<Rectangle> squares;
  int count = 0;
  for (int i = 0; i < 9; ++i)
    for (int j = 0; j < 9; ++j)
      if ((i + j) % 2 == 0) squares.push_back({{1.0 * i, 1.0 * j}, {i + 1.0, j + 1.0}}), ++count;
  double area = 0;
  const auto loops = calc_union_outlines(squares);
  for (const Loop& loop : loops) area += calc_area(loop);
  EXPECT_EQ(loops.size(), squares.size());
  EXPECT_DOUBLE_EQ(area, count);
}

TEST(UnionOutline, IsEmptyOfNothingAndOfTooMuch) {
  EXPECT_TRUE(calc_union_outlines({}).empty());
  EXPECT_TRUE(calc_union_outlines({{{0, 0}, {0, 4}}}).empty());
  EXPECT_TRUE(calc_union_outlines({{{0, 0}, {1, 1}}, {{2, 0}, {3, 1}}}, 1e-3, 3).empty());
}

}  // namespace
}  // namespace topple
