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

/// The idle loops among joints of a row of bodies whose frames meet at places in W.
std::vector<int> find_idle(const mbs::Model& m) {
  std::vector<double> distance;
  for (const mbs::Joint& j : m.joints) {
    const auto place = [&](mbs::BodyId b, const Vec3& p) {
      return b == mbs::kGround ? p : m.bodies[static_cast<size_t>(b.index)].X_WB * p;
    };
    distance.push_back(norm(place(j.child, j.X_CM.p) - place(j.parent, j.X_PF.p)));
  }
  return find_idle_loops(m, articulate(m), distance);
}

void join_at(mbs::Model& m, int parent, int child, Kind kind, const Pose& X_WF) {
  mbs::add_joint(m, test::make_joint(m, kind, {parent}, {child}, X_WF));
}

TEST(Articulation, JointsOnTheLineOfAHingeAreIdle) {
  for (const bool reversed : {false, true}) {
    mbs::Model m = make_row(2);
    const int a = reversed ? 1 : 0, b = reversed ? 0 : 1;
    const Quat turned = exp_rotation({0, 0, 1});
    join_at(m, a, b, Kind::Revolute, {{0.5, 0, 0}, {}});
    join_at(m, a, b, Kind::Revolute, {{0.5, 0, 2}, turned});
    join_at(m, b, a, Kind::Cylindrical, {{0.5, 0, 1}, {}});
    join_at(m, a, b, Kind::Spherical, {{0.5, 0, -1}, {}});
    join_at(m, a, b, Kind::Distance, {{0.5, 0, -1}, {}});  // idle: one end on the line
    m.joints[4].X_CM.p += Vec3{0.3, 0.2, 0.1};
    join_at(m, a, b, Kind::Fixed, {{0.5, 0, 1}, {}});                             // locks
    join_at(m, a, b, Kind::Revolute, {{0.5, 1e-3, 1}, {}});                       // beside the line
    join_at(m, a, b, Kind::Revolute, {{0.5, 0, 1}, exp_rotation({1e-3, 0, 0})});  // across it
    join_at(m, a, b, Kind::Prismatic, {{0.5, 0, 1}, {}});                         // locks
    EXPECT_EQ(find_idle(m), (std::vector<int>{1, 2, 3, 4})) << reversed;
  }
}

TEST(Articulation, LoopsOfALinkageAreNotIdleWhereverTheyStand) {
  mbs::Model m = make_row(3);
  join_at(m, -1, 0, Kind::Revolute, {{-0.5, 0, 0}, {}});
  join_at(m, 0, 1, Kind::Revolute, {{0.5, 0, 0}, {}});
  join_at(m, 1, 2, Kind::Revolute, {{1.5, 0, 0}, {}});
  join_at(m, -1, 2, Kind::Revolute, {{2.5, 0, 0}, {}});  // a line, which is singular
  join_at(m, 0, 2, Kind::Distance, {{0, 0, 0}, {}});
  m.joints[4].X_CM.p = {0.2, 0, 0};
  EXPECT_TRUE(find_idle(m).empty());
}

TEST(Articulation, SmallLoopsFarAwayOfTheOriginAreNotIdle) {
  mbs::Model m = make_row(2);
  m.bodies[0].X_WB.p = {4e6, 0, 0};
  m.bodies[1].X_WB.p = {0, 1000, 0};  // a large body elsewhere
  join_at(m, -1, 0, Kind::Revolute, {{4e6, 1e-3, 0}, {}});
  join_at(m, -1, 0, Kind::Spherical, {{4e6, -1e-3, 0}, {}});
  join_at(m, -1, 1, Kind::Revolute, {{0, 0, 0}, {}});
  join_at(m, -1, 1, Kind::Revolute, {{0, 0, 50}, {}});
  EXPECT_EQ(find_idle(m), (std::vector<int>{3}));
}

}  // namespace
}  // namespace topple::engines
