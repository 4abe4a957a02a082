#include "collapse/member_zone.h"

#include <gtest/gtest.h>

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

TEST(MemberZone, RefusesWhatHasNoZone) {
  const product::Plan plan = read(house("[preparation]\nremoved = [\"B-A2B2-0\"]\n"));
  for (const char* name : {"S-A1B2-0", "W-A1B1-1", "B-A2B2-0"})
    EXPECT_THROW(find_member_zone(plan, default_knowledge(), plan.find_member(name), false), InputError) << name;
}

}  // namespace
}  // namespace topple::collapse
