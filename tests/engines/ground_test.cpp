#include "engines/ground.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "cases.h"

namespace topple::engines {
namespace {

using test::add_box;
using test::make_ball;
using test::make_options;

TEST(Ground, DampingRatioGivesTheRestitutionItIsFor) {
  // a mass hits a spring and damper that can only push, in small steps
  for (const double wanted : {0.05, 0.135, 0.3, 0.5, 0.9}) {
    const double ratio = find_damping_ratio(wanted), h = 1e-5;
    double x = 0, v = 1;
    double force = 0;
    do {  // frequency 1
      force = x + 2 * ratio * v;
      v -= h * force;
      x += h * v;
    } while (force > 0);
    EXPECT_NEAR(-v, wanted, 1e-4 * (1 + ratio)) << wanted;
  }
  EXPECT_NEAR(find_damping_ratio(std::exp(-2)), 1, 1e-6);
  EXPECT_LT(find_damping_ratio(1), 1e-12);
  EXPECT_EQ(find_damping_ratio(0), 50);
}

TEST(GroundReference, ABallBouncesAsTheBenchmarkSays) {
  TOPPLE_NEEDS_ENGINE("simbody");
  // IFToMM: from 10 m with e = 0.5, impacts at 1.427843123, 2.855686246 and 3.569607807 s
  const auto c = test::run(*make_engine("simbody"), make_ball(10, 0.5), make_options(3.9, 1e-3));
  ASSERT_EQ(c.summary.ending, mbs::Summary::Ending::TimeLimit) << c.summary.message;
  std::vector<double> up;  // when the ball turns up
  for (size_t i = 1; i < c.frames.size(); ++i)
    if (c.frames[i - 1].v_WB[0].z < 0 && c.frames[i].v_WB[0].z >= 0) up.push_back(c.frames[i].time);
  ASSERT_EQ(up.size(), 3U);
  // a contact lasts about 2 ms with ω = 1500 1/s, and frames are 1 ms apart
  EXPECT_NEAR(up[0], 1.427843123, 3e-3);
  EXPECT_NEAR(up[1], 2.855686246, 6e-3);
  EXPECT_NEAR(up[2], 3.569607807, 8e-3);
  EXPECT_LT(c.summary.energy_error, 1e-6);  // the work of the contact is integrated with the motion
}

TEST(GroundReference, WhatGivesNothingBackStaysDownWithAnyStep) {
  TOPPLE_NEEDS_ENGINE("simbody");
  for (const double step : {0.0, 1e-4, 2e-5}) {
    mbs::Options o = test::make_options(1.5, 1e-3);
    o.step = step;
    const auto c = test::run(*make_engine("simbody"), make_ball(1, 0), o);
    ASSERT_EQ(c.summary.ending, mbs::Summary::Ending::TimeLimit) << c.summary.message;
    double highest = 0;  // after the landing at 0.452 s
    for (const auto& f : c.frames)
      if (f.time > 0.46) highest = std::max(highest, f.X_WB[0].p.z - 0.1);
    EXPECT_LT(highest, 0.02) << step;
    EXPECT_LT(c.summary.energy_error, 0.01) << step;
  }
}

TEST(GroundReference, ABoxSlidesDownASlope) {
  TOPPLE_NEEDS_ENGINE("simbody");
  mbs::Model m = test::make_empty({9.81 * 0.5, 0, -9.81 * std::sqrt(0.75)});  // 30°
  add_box(m, "box", 10, {0.3, 0.3, 0.1}, {0, 0, 0.1});
  m.contact.ground = true;
  m.contact.friction = 0.3;
  const auto c = test::run(*make_engine("simbody"), m, make_options(1, 0.1));
  ASSERT_EQ(c.frames.size(), 11U) << c.summary.message;
  EXPECT_NEAR(c.frames[10].v_WB[0].x, 2.356287237, 0.005 * 2.356);  // g (sin - μ cos); the box sinks in at first
  EXPECT_NEAR(c.frames[10].contact_force_ground.z, 10 * 9.81 * std::sqrt(0.75), 0.02 * 85);
}

TEST(GroundReference, ABoxStands) {
  TOPPLE_NEEDS_ENGINE("simbody");
  mbs::Model m = test::make_empty({0, 0, -9.81});
  add_box(m, "box", 10, {0.5, 0.5, 0.5}, {0, 0, 0.52});
  m.contact.ground = true;
  m.contact.restitution = 0.1;
  const auto c = test::run(*make_engine("simbody"), m, make_options(1, 1));
  ASSERT_EQ(c.frames.size(), 2U) << c.summary.message;
  EXPECT_NEAR(c.frames[1].X_WB[0].p.z, 0.5, 1e-5);  // each corner feels m/4 or less, g/ω² is 4e-6 m
  EXPECT_NEAR(c.frames[1].contact_force_ground.z, 98.1, 1e-3);
}

TEST(GroundReference, WhatIsHeldDoesNotTouchUntilItIsLetGo) {
  TOPPLE_NEEDS_ENGINE("simbody");
  // a block whose lower half is in the ground, on a spring element that is cut
  mbs::Model m = test::make_empty({0, 0, -9.81});
  const auto block = add_box(m, "block", 10, {0.5, 0.5, 0.5}, {0, 0, 0});
  m.contact.ground = true;
  mbs::ZoneElement e;
  e.a = mbs::kGround;
  e.b = block;
  e.translational_stiffness = {1e6, 1e6, 1e6};
  e.rotational_stiffness = {1e5, 1e5, 1e5};
  mbs::add_element(m, e);
  mbs::Event cut;
  cut.time = 0.2;
  mbs::Action a;
  a.kind = mbs::Action::Kind::RemoveElement;
  a.element = {0};
  cut.actions = {a};
  m.events.push_back(cut);
  const auto c = test::run(*make_engine("simbody"), m, make_options(0.6, 0.1));
  ASSERT_EQ(c.frames.size(), 7U) << c.summary.message;
  EXPECT_EQ(norm(c.frames[1].contact_force_ground), 0);
  EXPECT_NEAR(c.frames[6].contact_force_ground.z, 98.1, 2);
  EXPECT_NEAR(c.frames[6].X_WB[0].p.z, c.frames[2].X_WB[0].p.z, 1e-3);  // the overlap is forgiven, not pushed out
}

}  // namespace
}  // namespace topple::engines
