#include "uncertainty/jump.h"

#include <gtest/gtest.h>

namespace topple::uncertainty {
namespace {

TEST(Jumps, ArePiecedTogetherFromPlanesOfTheSameInputs) {
  // at alpha = 1 some inputs have a core of one value, so that fewer vary
  Jumps jumps;
  jumps.add({{0, 1, 2}, {{{1, 0, 0}, 0.5}}, {1, 1, 1}});
  jumps.add({{1}, {{{1}, 0.3}}, {1}});
  jumps.add({{0, 1, 2}, {{{0, 0.6, 0.8}, 0.4}}, {1, -1, 1}});
  jumps.add({{1}, {{{-1}, -0.8}}, {-1}});
  std::vector<std::size_t> pieces(4, 0);
  for (const JumpSide& side : jumps.take_new()) {
    for (const HalfSpace& h : side.in) EXPECT_EQ(h.a.size(), side.axes.size());
    EXPECT_EQ(side.slope.size(), side.axes.size());
    if (side.in.size() > 1) ++pieces[side.axes.size()];
  }
  EXPECT_EQ(pieces, (std::vector<std::size_t>{0, 8, 0, 8})) << "four sides of two planes, with both signs of the slope";
}

}  // namespace
}  // namespace topple::uncertainty
