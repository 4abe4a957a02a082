#include "farfield/mixture.h"

#include <gtest/gtest.h>

#include "nearfield/fibres.h"
#include "plans.h"

namespace topple::farfield {
namespace {

nearfield::ZoneInput make_zone(const product::Plan& plan, double length) {
  nearfield::ZoneInput in;
  in.section = plan.sections.front();
  in.concrete = plan.concretes.front();
  in.steel = plan.steels.front();
  in.length = length;
  return in;
}

TEST(Mixture, PullsWithTheBarsAndPushesWithBoth) {
  const product::Plan plan = read(portal());
  const nearfield::ZoneInput in = make_zone(plan, 0.4);
  const fem::ExplicitMaterial m = make_section_material(in, "column");
  const double area = in.section.area(), steel = in.section.steel_area(), fy = in.steel.fy;
  ASSERT_GE(m.yield.size(), 2u);
  // cracked: the bars at their yield stress, and what an open crack still passes on, below a quarter of fct
  EXPECT_GE(m.yield.front().tension, steel * fy / area * (1 - 1e-9));
  EXPECT_LE(m.yield.front().tension, steel * fy / area + 0.25 * in.concrete.fct);
  // the fibres' own peak, read every 0.1 per mille of strain
  const auto fibres = nearfield::make_fibres(in, nearfield::Axis::Y);
  EXPECT_NEAR(m.yield.front().compression, nearfield::find_crushing(fibres).force / area,
              0.002 * m.yield.front().compression);
  EXPECT_NEAR(m.E, in.concrete.Ec + steel / area * (in.steel.Es - in.concrete.Ec), 1);
}

TEST(Mixture, LosesItsConcreteAndKeepsSomeOfItsBars) {
  const nearfield::ZoneInput in = make_zone(read(portal()), 0.4);
  const fem::ExplicitMaterial m = make_section_material(in, "column");
  for (size_t i = 1; i < m.yield.size(); ++i) {
    EXPECT_GT(m.yield[i].strain, m.yield[i - 1].strain);
    EXPECT_LE(m.yield[i].compression, m.yield[i - 1].compression * (1 + 1e-12));
  }
  EXPECT_LT(m.yield.back().compression, 0.3 * m.yield.front().compression);
  EXPECT_GT(m.yield.back().compression, 0);
  EXPECT_EQ(m.tension_limit, in.steel.eps_u);
  EXPECT_GT(m.compression_limit, in.concrete.eps_c1);
}

TEST(Mixture, OfAPanelHoldsItsBarsOverTheThickness) {
  const product::Plan plan = read(house());
  const product::Panel& floor = plan.panels.front();
  const double bars = (floor.as_top + floor.as_bottom) / floor.thickness * plan.steels.front().fy;
  const fem::ExplicitMaterial m = make_panel_material(plan, floor, 0.4);
  EXPECT_GE(m.yield.front().tension, bars * (1 - 1e-9));
  EXPECT_LE(m.yield.front().tension, bars + 0.25 * plan.concretes.front().fct);
  EXPECT_GT(m.yield.front().compression, plan.concretes.front().fc);
}

TEST(Mixture, OfMasonryPullsAsItsJointsDo) {
  const product::Plan plan = read(portal());
  product::Panel brick;
  brick.name = "brick";
  brick.thickness = 0.24;
  brick.density = 1800;
  brick.strength = 5e6;
  brick.modulus = 3e9;
  const fem::ExplicitMaterial m = make_panel_material(plan, brick, 0.4);
  EXPECT_EQ(m.E, 3e9);
  EXPECT_EQ(m.yield.front().tension, 0.1e6);
  EXPECT_EQ(m.yield.front().compression, 5e6);
}

}  // namespace
}  // namespace topple::farfield
