#include "engines/articulation.h"

#include <gtest/gtest.h>

#include "cases.h"

namespace topple::engines {
namespace {

using Kind = mbs::Joint::Kind;

/// Bodies at the places 0, 1, 2, ... along x.
mbs::Model make_row(int bodies) {
  mbs::Model m = test::make_empty({});
  for (int i = 0; i < bodies; ++i) mbs::add_body(m, test::make_body("b", 1, {1, 1, 1}, {1.0 * i, 0, 0}));
  return m;
}

void join(mbs::Model& m, int parent, int child, Kind kind = Kind::Revolute) {
  mbs::Joint j;
  j.kind = kind;
  j.parent = {parent};
  j.child = {child};
  mbs::add_joint(m, j);
}

Articulation articulate(const mbs::Model& m) {
  return make_articulation(m, std::vector<unsigned char>(m.joints.size(), 1));
}

TEST(Articulation, FreeBodiesHangOnNothing) {
  const Articulation a = articulate(make_row(2));
  ASSERT_EQ(a.branches.size(), 2U);
  EXPECT_EQ(a.branches[1].body, 1);
  EXPECT_EQ(a.branches[1].joint, -1);
  EXPECT_EQ(a.branches[1].inboard, -1);
}

TEST(Articulation, AChainStartsAtTheGroundWhereverItsJointsPoint) {
  mbs::Model m = make_row(3);
  join(m, 0, 1);
  join(m, 2, 1);
  join(m, 2, -1);
  const Articulation a = articulate(m);
  ASSERT_EQ(a.branches.size(), 3U);
  EXPECT_EQ(a.branches[0].body, 2);
  EXPECT_TRUE(a.branches[0].reversed) << "the ground is the child";
  EXPECT_EQ(a.branches[1].body, 1);
  EXPECT_EQ(a.branches[1].inboard, 2);
  EXPECT_FALSE(a.branches[1].reversed);
  EXPECT_EQ(a.branches[2].body, 0);
  EXPECT_TRUE(a.branches[2].reversed);
  EXPECT_TRUE(a.loops.empty());
}

TEST(Articulation, LoopsAndDistancesAreNoBranches) {
  mbs::Model m = make_row(3);
  join(m, -1, 0);
  join(m, 0, 1);
  join(m, 1, -1);
  join(m, 1, 2, Kind::Distance);
  const Articulation a = articulate(m);
  ASSERT_EQ(a.branches.size(), 3U);
  EXPECT_EQ(a.branches[2].body, 2);
  EXPECT_EQ(a.branches[2].joint, -1) << "held by a distance only";
  EXPECT_EQ(a.loops, (std::vector<int>{1, 3})) << "both ends of joint 1 hang on the ground";
}

TEST(Articulation, FixedBodiesAreTheGround) {
  mbs::Model m = make_row(3);
  m.bodies[1].fixed = true;
  join(m, 0, 1);
  join(m, 1, 2);
  join(m, 1, -1);
  const Articulation a = articulate(m);
  ASSERT_EQ(a.branches.size(), 2U);
  EXPECT_EQ(a.branches[0].inboard, -1);
  EXPECT_TRUE(a.branches[0].reversed);
  EXPECT_EQ(a.branches[1].inboard, -1);
  EXPECT_TRUE(a.loops.empty()) << "a joint between bodies that never move is none";
}

TEST(Articulation, ReleasedJointsAreNotThere) {
  mbs::Model m = make_row(2);
  join(m, -1, 0);
  join(m, 0, 1);
  const Articulation a = make_articulation(m, {1, 0});
  EXPECT_EQ(a.branches[1].joint, -1);
}

}  // namespace
}  // namespace topple::engines
