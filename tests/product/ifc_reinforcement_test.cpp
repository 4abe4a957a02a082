#include "product/ifc_reinforcement.h"

#include <gtest/gtest.h>

namespace topple::product {
namespace {

/// A closed tie by the box of its axis.
IfcBar tie(double diameter, const Vec3& low, const Vec3& high) {
  IfcBar bar;
  bar.diameter = diameter;
  bar.is_main = false;
  bar.has_place = bar.has_axis = true;
  bar.place = 0.5 * (low + high);
  bar.low = low, bar.high = high;
  return bar;
}

TEST(IfcReinforcement, TiesOfAMemberThatReachesIntoAnotherAreItsOwn) {
  IfcElement column, beam;
  column.type = "IFCCOLUMN", column.low = {-0.2, -0.2, 0}, column.high = {0.2, 0.2, 3};
  beam.type = "IFCBEAM", beam.low = {-0.2, -0.15, 2.5}, beam.high = {5, 0.15, 3};
  std::vector<IfcBar> bars;
  for (int i = 0; i < 14; ++i) {
    const double z = 0.1 + 0.2 * i;
    bars.push_back(tie(0.010, {-0.16, -0.16, z}, {0.16, 0.16, z}));
  }
  for (int i = 0; i < 30; ++i) {
    const double x = -0.15 + 0.15 * i;
    bars.push_back(tie(0.008, {x, -0.11, 2.54}, {x, 0.11, 2.96}));
  }
  // a helix around the column
  bars.push_back(tie(0.010, {-0.16, -0.16, 0.1}, {0.16, 0.16, 2.9}));
  const MemberBars of_column = find_bars(column, bars), of_beam = find_bars(beam, bars);
  EXPECT_EQ(of_column.ties.count, 15);
  EXPECT_NEAR(of_column.ties.diameter, 0.010, 1e-12);
  EXPECT_EQ(of_beam.ties.count, 30);
  EXPECT_NEAR(of_beam.ties.diameter, 0.008, 1e-12);
  EXPECT_NEAR(of_beam.tie_spacing, 0.15, 1e-12);
}

}  // namespace
}  // namespace topple::product
