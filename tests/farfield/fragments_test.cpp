#include "farfield/fragments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "farfield/run.h"
#include "plans.h"

namespace topple::farfield {
namespace {

class PortalWithoutALength : public testing::Test {
 protected:
  PortalWithoutALength() {
    GridOptions options;
    options.size = 0.5;
    whole = make_whole(plan, collapse::default_knowledge(), options, 1);
  }
  product::Plan plan = read(portal(charge("C-A1-0")));
  Whole whole;
};

TEST_F(PortalWithoutALength, FallsIntoTheStumpAndTheRest) {
  fem::ExplicitSystem system(whole.fe, {});
  const Fragments one = find_fragments(plan, whole, system, {}, 0.5);
  ASSERT_EQ(one.fragments.size(), 1u);
  EXPECT_NEAR(one.fragments[0].mass, collapse::calc_standing_mass(plan), 1e-6 * one.fragments[0].mass);
  system.remove(whole.charges.at(0).elements);
  const Fragments two = find_fragments(plan, whole, system, {}, 0.5);
  EXPECT_TRUE(two.zones.empty());  // what a charge takes is no zone of damage
  ASSERT_EQ(two.fragments.size(), 2u);
  // 0.5 m of the column stand below the destroyed length, 1 m is gone
  const double per_metre = 0.3 * 0.4 * plan.concretes.front().density;
  EXPECT_NEAR(two.fragments[1].mass, 0.5 * per_metre, 1e-6 * per_metre);
  EXPECT_NEAR(one.fragments[0].mass - two.fragments[0].mass, 1.5 * per_metre, 1e-6 * per_metre);
}

TEST_F(PortalWithoutALength, WhoseBeamIsCrushedHasAZoneThere) {
  // a middle piece of the beam so weak that its own weight crushes it
  fem::ExplicitModel fe = whole.fe;
  fem::ExplicitMaterial weak = fe.materials.front();
  weak.yield = {{0, 1e3, 1e3}};
  fe.materials.push_back(weak);
  int pieces = 0;
  for (size_t e = 0; e < fe.elements.size(); ++e)
    if (std::abs(whole.grid.cells[e].centre.x - 2.5) < 0.3 && whole.grid.cells[e].centre.z > 2.5) {
      fe.elements[e].material = static_cast<int>(fe.materials.size()) - 1;
      ++pieces;
    }
  ASSERT_GT(pieces, 0);
  fem::ExplicitSystem system(fe, {});
  ASSERT_EQ(system.advance(0.2), fem::ExplicitEnding::ReachedTime);
  record::ZoneInfo near{"B-A1B1-0/middle", "B-A1B1-0", "", -1, -1, {2.5, 0, 2.75}};
  record::ZoneInfo far = near;
  far.p_W.x = 0.2;
  const Fragments found = find_fragments(plan, whole, system, {far, near}, 0.5);
  ASSERT_EQ(found.zones.size(), 1u);
  EXPECT_EQ(found.zones[0].member, plan.find_member("B-A1B1-0"));
  EXPECT_EQ(found.zones[0].zone, 1);
  EXPECT_NEAR(found.zones[0].at, 2.5, 0.3);
  EXPECT_NEAR(found.zones[0].share, 1, 1e-12);
  record::Record r;
  r.zones = {far, near};
  add_fragment_findings(plan, found, 0.2, r);
  EXPECT_THAT(r.findings.at(1).text, testing::HasSubstr("Zone expected at B-A1B1-0/middle, found"));
  add_fragment_findings(plan, find_fragments(plan, whole, system, {far}, 0.5), 0.2, r);
  EXPECT_THAT(r.findings.back().text, testing::HasSubstr("sound parts"));
  EXPECT_THAT(r.findings.at(r.findings.size() - 2).text, testing::HasSubstr("a cut here would follow the damage"));
}

}  // namespace
}  // namespace topple::farfield
