// What zones in lanes make of their law, against the full law at each step; shares of the engine's step.

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "models.h"
#include "views.h"

namespace topple::mbs {
namespace {

/// A cantilever that gravity bends beyond what its hinges hold.
Model make_drooping_cantilever() {
  test::Cantilever c = test::make_cantilever(8, 4, 0.3, 0.3, 30e9, 2500);
  c.model.gravity = {0, -9.81, 0};
  ZoneLaw law = test::plastic_hinge(12e3);
  law.damage_share = 0.3;
  c.model.laws.push_back(law);
  for (ZoneElement& e : c.model.elements) {
    Station s;
    s.law = LawId{0};
    e.stations.push_back(s);
    e.damping_ratio = 0.02;
  }
  return c.model;
}

TEST(FullLawPhysics, GivesWhatLanesGive) {
  const Model m = make_drooping_cantilever();
  std::vector<View> lanes, full;
  Options o = test::look(0.3, lanes);
  const Summary a = run(m, o);
  o = test::look(0.3, full);
  o.full_law = true;
  const Summary b = run(m, o);
  ASSERT_EQ(a.ending, Summary::Ending::TimeLimit);
  ASSERT_EQ(a.steps, b.steps);
  ASSERT_EQ(lanes.size(), full.size());
  EXPECT_GT(lanes.back().energy.plastic, 100) << "hinges turn";
  const size_t tip = m.bodies.size() - 1;
  EXPECT_LT(lanes.back().X_WB[tip].p.y, -0.01);
  // one evaluation agrees within 1e-8 (KernelLaw.FollowsTheFullLaw); nothing here meets anything that would enlarge it
  for (size_t i = 0; i < lanes.size(); ++i)
    EXPECT_LT(norm(lanes[i].X_WB[tip].p - full[i].X_WB[tip].p), 1e-8) << lanes[i].time;
}

TEST(FullLawPhysics, HalfOfTheStepIsNearerToTheLimit) {
  const Model m = make_drooping_cantilever();
  const auto tip_at = [&m](double share, double& step) {
    std::vector<View> views;
    Options o = test::look(0.1, views);
    o.step_share = share;
    step = run(m, o).step;
    return views.back().X_WB.back().p.y;
  };
  double h1 = 0, h2 = 0, h4 = 0;
  const double one = tip_at(1, h1), half = tip_at(0.5, h2), quarter = tip_at(0.25, h4);
  EXPECT_DOUBLE_EQ(h2, 0.5 * h1);
  EXPECT_DOUBLE_EQ(h4, 0.25 * h1);
  EXPECT_NE(one, half);
  EXPECT_LT(std::abs(half - quarter), std::abs(one - half));
}

}  // namespace
}  // namespace topple::mbs
