#include "collapse/member_zone.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/unit.h"
#include "collapse/manager.h"
#include "plans.h"

namespace topple::collapse {
namespace {

TEST(MemberZone, GroundColumnsCarryTheWholeWeight) {
  const product::Plan plan = read(house());
  double sum = 0;
  for (const char* name : {"C-A1-0", "C-A2-0", "C-A3-0", "C-B1-0", "C-B2-0", "C-B3-0"}) {
    const MemberZone z = find_member_zone(plan, default_knowledge(), plan.find_member(name), false);
    EXPECT_FALSE(z.is_estimate) << z.message;
    EXPECT_LT(z.normal_force, 0) << "compression is negative";
    EXPECT_EQ(z.name, std::string(name) + ", foot");
    sum -= z.normal_force;
  }
  // the equilibrium leaves 1e-6 of the weight unbalanced at most
  const double weight = unit::gravity * calc_standing_mass(plan);
  EXPECT_NEAR(sum, weight, 1e-3 * weight);
}

TEST(MemberZone, APortalCarriesHalfOnEachSide) {
  const product::Plan plan = read(portal());
  const auto force = [&](const char* name, bool at_end) {
    return find_member_zone(plan, default_knowledge(), plan.find_member(name), at_end).normal_force;
  };
  const double weight = unit::gravity * calc_standing_mass(plan);
  EXPECT_NEAR(force("C-A1-0", false), -0.5 * weight, 1e-3 * weight);
  EXPECT_NEAR(force("C-B1-0", true), -0.5 * weight, 1e-3 * weight) << "of the top: that of the foot";
  EXPECT_LT(std::abs(force("B-A1B1-0", false)), 0.2 * weight) << "a beam has the thrust of the frame alone";
}

TEST(MemberZone, HasTheSectionAndThePreparationOfItsEnd) {
  const product::Plan plan =
      read(portal("[[preparation.weaken]]\nmembers = [\"C-A1-0\"]\nat = \"0.2 m\"\ncut_bars = 0.5\n"));
  const int column = plan.find_member("C-A1-0");
  const MemberZone foot = find_member_zone(plan, default_knowledge(), column, false);
  const MemberZone top = find_member_zone(plan, default_knowledge(), column, true);
  EXPECT_EQ(foot.input.section.name, "column");
  EXPECT_EQ(foot.input.cut_bars, 0.5);
  EXPECT_EQ(top.input.cut_bars, 0);
  EXPECT_EQ(top.name, "C-A1-0, top");
  EXPECT_GT(foot.input.length, 0.1);
}

// EN 1992-1-1, 5.3.2.1, as of an inner span: 0.2 b + 0.1 l0 on each side, l0 = 0.7 l.
TEST(MemberZone, SlabsAreFlangesOfBeamsAlongX) {
  const product::Plan plan = read(house());
  const auto flange = [](const product::Plan& p, const char* name, const Knowledge& k = default_knowledge()) {
    return find_member_zone(p, k, p.find_member(name), false).input.flange;
  };
  const double gap = 4 - 0.3, l0 = 0.7 * (5 - 0.3);  // between webs, between columns
  const double side = std::min(0.2 * 0.5 * gap + 0.1 * l0, 0.2 * l0);
  const nearfield::Flange middle = flange(plan, "B-A2B2-0");
  EXPECT_NEAR(middle.breadth, 2 * side, 1e-12);
  EXPECT_EQ(middle.thickness, 0.15);
  EXPECT_NEAR(middle.top.area, 0.2 * 2 * side * 4e-4, 1e-12) << "distribution bars";
  EXPECT_NEAR(flange(plan, "B-A1B1-0").breadth, side, 1e-12) << "at the edge";
  EXPECT_EQ(flange(plan, "B-A1A2-0").breadth, 0) << "the slab is an element of its own there";
  EXPECT_EQ(flange(read(house("[preparation]\nremoved = [\"S-*-0\"]\n")), "B-A2B2-0").breadth, 0);
  Knowledge none = default_knowledge();
  none.slab_flange_share = 0;
  EXPECT_EQ(flange(plan, "B-A2B2-0", none).breadth, 0);
  // a weaker slab counts by less breadth
  std::string text = house();
  const std::string panel = "[slab.floor]\nthickness = \"15 cm\"\nconcrete = \"C25\"";
  text.replace(text.find(panel), panel.size(),
               "[concrete.light]\nfc = \"10 N/mm2\"\nEc = \"12 GPa\"\n[slab.floor]\nthickness = \"15 cm\"\nconcrete = "
               "\"light\"");
  EXPECT_NEAR(flange(read(text), "B-A2B2-0").breadth, 0.4 * 2 * side, 1e-12);
}

TEST(MemberZone, RefusesWhatHasNoZone) {
  const product::Plan plan = read(house("[preparation]\nremoved = [\"B-A2B2-0\"]\n"));
  for (const char* name : {"S-A1B2-0", "W-A1B1-1", "B-A2B2-0"})
    EXPECT_THROW(find_member_zone(plan, default_knowledge(), plan.find_member(name), false), InputError) << name;
}

}  // namespace
}  // namespace topple::collapse
