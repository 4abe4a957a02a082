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

/// A bar along x from 0 to 6 m.
IfcBar bar(double diameter, double y, double z) {
  IfcBar out = tie(diameter, {0, y, z}, {6, y, z});
  out.is_main = true;
  return out;
}

/// A beam of 25 cm x 50 cm with cover of 3 cm and ties of 8 mm.
MemberBars find_beam(std::vector<IfcBar> bars) {
  IfcElement beam;
  beam.type = "IFCBEAM", beam.low = {0, -0.125, 0}, beam.high = {6, 0.125, 0.5};
  for (const double x : {0.1, 0.3, 0.5, 0.7}) bars.push_back(tie(0.008, {x, -0.091, 0.034}, {x, 0.091, 0.466}));
  for (const double y : {-0.07, 0.07}) bars.push_back(bar(0.016, y, 0.45));
  return find_bars(beam, bars);
}

TEST(IfcReinforcement, CountsBarsOfFurtherLayers) {
  std::vector<IfcBar> bars;
  for (const double z : {0.05, 0.1})
    for (const double y : {-0.07, 0.0, 0.07}) bars.push_back(bar(0.02, y, z));
  bars.push_back(bar(0.012, 0.035, 0.046));  // of the first layer, as thin as it is
  const MemberBars two = find_beam(bars);
  EXPECT_EQ(two.bottom.count, 7);
  EXPECT_EQ(two.inner_bottom, 3);
  EXPECT_NEAR(two.depth_bottom, 0.054, 1e-12);
  EXPECT_EQ(two.inner_top, 0);
  EXPECT_EQ(find_misfit(two, 0.25, 0.5, false), "");
}

TEST(IfcReinforcement, SaysWhatDoesNotFit) {
  // between the ties 174 mm: 8 x 25 mm are 200 mm, 6 x 25 mm are 150 mm
  const auto row = [](int count) {
    std::vector<IfcBar> bars;
    for (int i = 0; i < count; ++i) bars.push_back(bar(0.025, 0.01 * i - 0.04, i % 2 == 0 ? 0.0505 : 0.1005));
    return find_beam(bars);
  };
  EXPECT_EQ(find_misfit(row(8), 0.25, 0.5, false),
            "its 8 x 25.0 mm below, which do not fit into its width side by side");
  EXPECT_EQ(find_misfit(row(6), 0.25, 0.5, false), "");
  EXPECT_EQ(find_misfit(row(6), 0.25, 0.085, false), "its bars, which take 15.8 % of it");
  MemberBars column;
  column.all.count = 12, column.all.diameter = 0.032;
  column.count_y = 4, column.count_z = 4;
  column.has_cover = true, column.cover = 0.04, column.ties.diameter = 0.01;
  EXPECT_EQ(find_misfit(column, 0.35, 0.35, true), "");
  EXPECT_EQ(find_misfit(column, 0.22, 0.35, true),
            "its 12 x 32.0 mm along the faces, which do not fit into its width side by side");
  // as if the cover were not known
  drop_thick_cover(column, 0.1, 0.35);
  EXPECT_FALSE(column.has_cover);
  EXPECT_EQ(column.ties.diameter, 0.01);
}

}  // namespace
}  // namespace topple::product
