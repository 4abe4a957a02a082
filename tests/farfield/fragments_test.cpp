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

TEST_F(PortalWithoutALength, TellsDamageBehindTheFirstLandingApart) {
  fem::ExplicitSystem system(whole.fe, {});
  EarlyDamage early;
  early.note(system, whole.fe.elements.size());
  system.set_velocity({2, 0, -25});  // into its feet
  ASSERT_EQ(system.advance(0.1), fem::ExplicitEnding::ReachedTime);
  const auto damage_of_column = [&](const EarlyDamage& noted) {
    record::ZoneInfo far{"C-B1-0/far", "C-B1-0", "", -1, -1, {5, 0, 300}};
    const Fragments found = find_fragments(plan, whole, system, {far}, 0.5, noted);
    record::Record r;
    r.zones = {far};
    add_fragment_findings(plan, found, 0.1, r);
    for (const record::Finding& f : r.findings)
      if (f.title == "C-B1-0") return f;
    ADD_FAILURE() << "no zone";
    return record::Finding{};
  };
  early.landing = 1;  // all of it went before
  EXPECT_THAT(damage_of_column(early).text, testing::HasSubstr("a cut here would follow"));
  EXPECT_EQ(damage_of_column(early).status, record::Status::Warning);
  early.landing = 0;
  EXPECT_THAT(damage_of_column(early).text, testing::HasSubstr("it broke once parts had landed"));
  EXPECT_EQ(damage_of_column(early).status, record::Status::Info);
}

/// Four columns under a floor. What charges leave above comes down on what they leave below before the floor lands.
TEST(Fragments, AdviseNoCutWhereAStubLanded) {
  const std::string text =
      collapse::materials() + grid("A = \"0 m\", B = \"4 m\"", "1 = \"0 m\", 2 = \"4 m\"", 1, "8 kN/m2") +
      "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = \"floor\"\n" +
      "[[stage]]\nname = \"Front\"\ntime = \"50 ms\"\n[[stage.charge]]\nmembers = [\"C-A*\"]\n" +
      "position = \"1.2 m\"\ndestroyed_length = \"1.2 m\"\nresidual_bars = 0.1\n" + analysis("800 ms");
  FeOptions fe;
  fe.grid.size = 0.3;
  const record::Record r = run_plan(read(text), collapse::default_knowledge(), {}, fe, {}, {});
  double touchdown = 0;
  for (const record::Event& e : r.events)
    if (e.kind == "touchdown" && e.subject == "C-A1-0") touchdown = e.time;
  ASSERT_GT(touchdown, 0.1);
  int landed = 0;
  for (const record::Finding& f : r.findings) {
    if (f.title != "C-A1-0" && f.title != "C-A2-0") continue;
    EXPECT_THAT(f.text, testing::Not(testing::HasSubstr("a cut here would follow"))) << f.title;
    landed += f.text.find("it lies in a stump, which bears nothing") != std::string::npos;
  }
  EXPECT_GT(landed, 0);
}

}  // namespace
}  // namespace topple::farfield
