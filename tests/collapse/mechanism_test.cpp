#include "collapse/mechanism.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "collapse/outcome.h"

namespace topple::collapse {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A block of 12 m x 19 m that hinges at its rear edge and at last lies before it; falls towards -x.
MechanismInput synthetic(double tilt_at_touchdown, double drop_of_rear, double moved) {
  MechanismInput in;
  in.touchdown = 1;
  in.outline = {{-6, -9.5}, {6, -9.5}, {6, 9.5}, {-6, 9.5}};
  in.storey_height = 3;
  in.fall_direction = {-1, 0, 0};
  for (int i = 0; i <= 2; ++i) {
    BlockFrame f;
    f.time = i;
    const double a = tilt_at_touchdown * i;
    f.rotation = exp_rotation({0, -a, 0});
    // the rear edge 6 m behind the mass centre comes down by drop_of_rear
    f.displacement = {-6 * (1 - std::cos(a)), 0, -6 * std::sin(a) - drop_of_rear * i};
    f.moved = f.down = moved * i / 2;
    f.height = 12 - 4 * i;
    f.centre = {6 - 3.0 * i * (tilt_at_touchdown != 0), 0, f.height};
    in.frames.push_back(f);
  }
  return in;
}

std::string name_of(const MechanismInput& in) { return judge_mechanism(in, default_knowledge()).name; }

TEST(Mechanism, TurningOverTheRearEdgeIsToppling) {
  const Mechanism m = judge_mechanism(synthetic(0.2, 0, 1), default_knowledge());
  EXPECT_EQ(m.name, "topple");
  EXPECT_NEAR(m.tilt, 0.2, 1e-12);
  EXPECT_NEAR(m.rear_share, 0, 1e-12);
  EXPECT_NEAR(m.azimuth, std::acos(-1.0), 1e-12);
}

TEST(Mechanism, ComingDownWithoutTurningIsVertical) {
  const Mechanism m = judge_mechanism(synthetic(0, 2.4, 1), default_knowledge());
  EXPECT_EQ(m.name, "vertical");
  EXPECT_NEAR(m.rear_share, 1, 1e-12);
  EXPECT_TRUE(std::isnan(m.azimuth));
}

/// Its largest part holds so much of the upper mass; all of it moves as the block does.
void take_apart(BlockFrame& f, double connected) {
  f.connected = connected;
  f.pieces = {f.rotation, f.displacement, f.above};
}

TEST(Mechanism, WhatIsInPiecesIsJudgedByAllOfThem) {
  MechanismInput in = synthetic(0.2, 0, 1);
  EXPECT_THAT(judge_mechanism(in, default_knowledge()).text, testing::Not(testing::HasSubstr("in pieces")));
  // the largest one comes straight down, and all together lean
  const MechanismInput drops = synthetic(0, 2.4, 1);
  for (size_t i = 0; i < in.frames.size(); ++i) {
    BlockFrame& f = in.frames[i];
    take_apart(f, 0.3);
    f.moved = 1;
    f.rotation = drops.frames[i].rotation, f.displacement = drops.frames[i].displacement;
  }
  const Mechanism m = judge_mechanism(in, default_knowledge());
  EXPECT_EQ(m.name, "topple");
  EXPECT_NEAR(m.tilt, 0.2, 1e-12);
  EXPECT_THAT(m.text, testing::HasSubstr("in pieces then, the largest of 30 % of the upper mass"));
  for (BlockFrame& f : in.frames) f.connected = 0.6;
  EXPECT_EQ(name_of(in), "vertical");
}

TEST(Mechanism, ABlockThatHoldsTogetherByLittleIsNearWhatAllOfItDoes) {
  // its largest part has 52 %, and a bound of 55 % would have all of it judged, which leans alike
  MechanismInput in = synthetic(0.2, 0, 1);
  for (BlockFrame& f : in.frames) take_apart(f, 0.52), f.moved = 1;
  EXPECT_EQ(name_of(in), "topple");
  for (const NearVerdict& near : find_near_verdicts(in, default_knowledge()))
    EXPECT_NE(near.rule, "mechanism.coherent_share") << near.as.name;
}

TEST(Mechanism, WhatBreaksOnTheGroundIsJudgedAsItCameDown) {
  // between frames of 1/60 s the block touches the ground, and then has another part as its largest one
  const auto coming_down = [](double time) {
    BlockFrame f;
    f.time = time;
    f.rotation = exp_rotation({0, -0.2 * time, 0});
    f.displacement = {-0.5 * time, 0, -2 * time};
    f.height = 12 - f.displacement.z;
    take_apart(f, 0.95);
    return f;
  };
  MechanismInput in = synthetic(0.2, 0, 1);
  in.frames = {coming_down(0), coming_down(1 - 1.0 / 60), coming_down(1)};
  in.touchdown = 1 - 0.9 / 60;
  BlockFrame& after = in.frames.back();
  after.connected = 0.51, after.moved = after.down = 1;
  after.rotation = exp_rotation({0, -0.6, 0});
  after.displacement = {-2, 0, -4};
  after.forward = after.backward = 0.5;  // parts turn either way
  const Mechanism m = judge_mechanism(in, default_knowledge());
  EXPECT_EQ(m.name, "topple");
  EXPECT_NEAR(m.connected, 0.95, 1e-12);
  EXPECT_NEAR(m.tilt, 0.2 * in.touchdown, 1e-9);
  EXPECT_NEAR(m.drop, 2 * in.touchdown, 1e-9);
}

TEST(Mechanism, WhatFallsOffABuildingThatStandsDoesNotDecide) {
  // it stands for a second, in which an annex lands, and then turns over towards -x
  MechanismInput in = synthetic(0.2, 0, 1);
  const BlockFrame start = in.frames.front();
  for (BlockFrame& f : in.frames) f.time += 1;
  in.frames.insert(in.frames.begin(), start);
  const auto find = [&in](std::vector<double> of_block, std::vector<double> all) {
    in.touchdowns = std::move(of_block), in.all_touchdowns = std::move(all);
    find_deciding_touchdown(in, default_knowledge());
    return in.touchdown;
  };
  EXPECT_EQ(find({2.0, 2.1}, {0.5, 0.9, 1.9, 2.0, 2.1}), 2.0);
  EXPECT_TRUE(in.is_later_touchdown);
  EXPECT_EQ(find({}, {0.5, 0.9, 2.2}), 2.2) << "it comes down on its own rubble";
  EXPECT_TRUE(std::isnan(find({}, {0.5, 0.9})));
  EXPECT_TRUE(std::isnan(find({}, {})));
  in.touchdown = 2, in.is_later_touchdown = true;
  EXPECT_THAT(judge_mechanism(in, default_knowledge()).text,
              testing::HasSubstr("when the upper block has come down and touches the ground, at 2.00 s"));
  // at the annex the lean is none, and so no direction of a fall
  in.touchdown = 0.5;
  EXPECT_FALSE(judge_mechanism(in, default_knowledge()).is_azimuth_of_lean);
  // in pieces all of it counts
  for (BlockFrame& f : in.frames) take_apart(f, 0.4);
  in.frames[0].pieces.displacement = in.frames[1].pieces.displacement = {0, 0, -1};
  EXPECT_EQ(find({0.5}, {0.5, 0.9}), 0.5);
}

TEST(Mechanism, FoldsAboutEitherAxis) {
  MechanismInput in = synthetic(0.1, 1, 1);
  EXPECT_NE(name_of(in), "fold");
  for (BlockFrame& f : in.frames) f.left = 0.3, f.right = 0.1;
  EXPECT_NE(name_of(in), "fold");
  for (BlockFrame& f : in.frames) f.right = 0.25;
  const Mechanism m = judge_mechanism(in, default_knowledge());
  EXPECT_EQ(m.name, "fold");
  EXPECT_THAT(m.text, testing::HasSubstr("30 % of the upper mass turns to one side of the fall, 25 % to the other"));
}

TEST(Mechanism, AToleranceOfZeroIsOne) {
  MechanismInput in = synthetic(0.2, 0, 1);
  in.is_direction_planned = true;
  in.fall_direction = {-std::cos(0.03), std::sin(0.03), 0};  // 1.7 degrees off
  EXPECT_EQ(name_of(in), "topple");
  in.direction_tolerance = 0;
  EXPECT_EQ(name_of(in), "wrong direction");
}

TEST(Mechanism, TheRearEdgeDecidesBetweenBoth) {
  // front edge: 12 sin 0.2 = 2.38 m more than the rear one
  EXPECT_EQ(name_of(synthetic(0.2, 2.3, 1)), "topple");
  EXPECT_EQ(name_of(synthetic(0.2, 2.5, 1)), "vertical");
}

TEST(Mechanism, IsJudgedAtTheTouchdownBetweenFrames) {
  MechanismInput in = synthetic(0.2, 0.3, 1);
  in.touchdown = 0.75;
  const Mechanism m = judge_mechanism(in, default_knowledge());
  EXPECT_EQ(m.time, 0.75);
  EXPECT_NEAR(m.tilt, 0.75 * 0.2, 1e-12);
  EXPECT_NEAR(m.drop, 0.75 * (6 * std::sin(0.2) + 0.3), 1e-12);
  EXPECT_NEAR(m.rear_share, 0.75 * 0.3 / (0.75 * 0.3 + 12 * std::sin(0.15)), 0.01);
}

TEST(Mechanism, LittleMassDownMeansStandingOrPartial) {
  EXPECT_EQ(name_of(synthetic(0, 0, 0.01)), "stands");
  EXPECT_EQ(name_of(synthetic(0.2, 0, 0.3)), "partial");
}

/// A shaft of 40 m on a mouth, at one instant of its swing.
MechanismInput swaying(double aside, double down) {
  MechanismInput in = synthetic(0, 0, 0);
  in.touchdown = kNaN;
  for (BlockFrame& f : in.frames) f.height = f.centre.z = 21.5;
  in.frames.back().displacement = {-aside, 0, -down};
  return in;
}

TEST(Mechanism, WhatSwaysStandsInWhicheverPartOfItsSwing) {
  for (const double aside : {0.001, 0.09, 0.11, 0.185, 0.42}) {
    const Mechanism m = judge_mechanism(swaying(aside, 0.075 * aside), default_knowledge());
    EXPECT_EQ(m.name, "stands") << aside;
    EXPECT_FALSE(m.is_final);
  }
}

TEST(Mechanism, TellsWhichOtherVerdictIsNear) {
  const Knowledge& k = default_knowledge();
  MechanismInput in = synthetic(0.2, 0, 1);
  EXPECT_TRUE(find_near_verdicts(in, k).empty());

  // it breaks up behind its touchdown
  BlockFrame f = in.frames[1];
  f.time = 1.05, f.moved = 0.3;
  take_apart(f, 0.4);
  in.frames.insert(in.frames.begin() + 2, f);
  std::vector<NearVerdict> near = find_near_verdicts(in, k);
  ASSERT_EQ(near.size(), 1U);
  EXPECT_EQ(near[0].as.name, "progressive");
  EXPECT_NEAR(near[0].later, 0.05, 1e-12);
  EXPECT_EQ(near[0].as.connected, 0.4);
  in.frames[2].time = 1.2;
  EXPECT_TRUE(find_near_verdicts(in, k).empty());

  // front edge: 12 sin 0.2 = 2.38 m more than the rear one, whose share is 0.47 and 0.42
  near = find_near_verdicts(synthetic(0.2, 2.1, 1), k);
  ASSERT_EQ(near.size(), 1U);
  EXPECT_EQ(near[0].as.name, "vertical");
  EXPECT_EQ(near[0].rule, "mechanism.topple_rear_share");
  EXPECT_EQ(near[0].times, 0.9);
  EXPECT_TRUE(find_near_verdicts(synthetic(0.2, 1.7, 1), k).empty());

  // a tolerance of the plan takes the place of the rule's
  in = synthetic(0.2, 0, 1);
  in.is_direction_planned = true;
  in.direction_tolerance = 0.032;
  in.fall_direction = {-std::cos(0.03), std::sin(0.03), 0};
  near = find_near_verdicts(in, k);
  ASSERT_EQ(near.size(), 1U);
  EXPECT_EQ(near[0].as.name, "wrong direction");
  in.is_under_way = true;
  EXPECT_TRUE(find_near_verdicts(in, k).empty());
}

/// Mass centre of a shaft that swings about `lean` with e^(-decay t) cos(2 π t / 4 s), from the charge at 1 s to `end`.
MechanismInput swinging(double lean, double decay, double end, double size = 0.1) {
  MechanismInput in = swaying(0, 0);
  in.last_charge = 1;
  const BlockFrame start = in.frames.front();
  in.frames.clear();
  for (double t = 0; t <= end; t += 0.05) {
    BlockFrame f = start;
    f.time = t;
    if (t > 1)
      f.displacement.x = lean * (t - 1) - size * (1 - std::exp(-decay * (t - 1)) * std::cos(std::acos(0.0) * (t - 1)));
    in.frames.push_back(f);
  }
  return in;
}

TEST(Mechanism, WhatSwaysLessAndLessStands) {
  const auto is_final = [](const MechanismInput& in) {
    const Mechanism m = judge_mechanism(in, default_knowledge());
    EXPECT_EQ(m.name, "stands");
    return m.is_final;
  };
  EXPECT_TRUE(is_final(swinging(0, 0.05, 12)));
  EXPECT_TRUE(is_final(swinging(0, 0, 12)));
  EXPECT_FALSE(is_final(swinging(0, 0.05, 5)));         // not yet turned often enough
  EXPECT_FALSE(is_final(swinging(0, -0.05, 10)));       // more and more
  EXPECT_FALSE(is_final(swinging(-0.02, 0.05, 10.5)));  // leans farther from swing to swing
  // in pieces, the largest of which sways less, while all that is in its place leans farther
  MechanismInput apart = swinging(0, 0.05, 10.5);
  const MechanismInput leaning = swinging(-0.02, 0.05, 10.5);
  for (size_t i = 0; i < apart.frames.size(); ++i) {
    apart.frames[i].connected = 0.4;
    apart.frames[i].standing = leaning.frames[i].displacement;
  }
  EXPECT_FALSE(is_final(apart));
  for (BlockFrame& f : apart.frames) f.standing = f.displacement;
  EXPECT_TRUE(is_final(apart));
  // the last turning points are at 7 and 9 s: 0.1 (e^(-0.3) + e^(-0.4)) m
  EXPECT_THAT(judge_mechanism(swinging(0, 0.05, 10.5), default_knowledge()).text,
              testing::EndsWith("its upper block went 14.1 cm from side to side in the last swing."));
}

TEST(Mechanism, WhatLeansIsNotSaidToSink) {
  const Mechanism leans = judge_mechanism(swaying(0.44, 0.033), default_knowledge());
  EXPECT_EQ(leans.name, "partial");
  EXPECT_THAT(leans.text,
              testing::StartsWith("It leans: the mass centre of the upper block has moved to a side by 0.44 m."));
  EXPECT_TRUE(leans.may_swing_back);
  const Mechanism sinks = judge_mechanism(swaying(0.2, 0.11), default_knowledge());
  EXPECT_THAT(sinks.text, testing::StartsWith("It has begun to sink: the upper block has come down by 0.11 m."));
  EXPECT_FALSE(sinks.may_swing_back);
  MechanismInput at_rest = swaying(0.44, 0.033);
  at_rest.came_to_rest = true;
  const Mechanism aborted = judge_mechanism(at_rest, default_knowledge());
  EXPECT_EQ(aborted.name, "aborted");
  EXPECT_THAT(aborted.text,
              testing::StartsWith("Aborted collapse: the upper block has moved to a side by 0.44 m and stands"));
}

TEST(Mechanism, HowFarABlockIsFromItsPlaceIsAShareOfWhatItMay) {
  const Knowledge& k = default_knowledge();
  BlockFrame f;
  f.height = 4;  // lower than 5 m: to a side as down
  f.displacement = {0.03, 0.04, -0.02};
  EXPECT_NEAR(calc_away(f, k), 0.5, 1e-12);
  f.height = 20;
  EXPECT_NEAR(calc_away(f, k), 0.2, 1e-12);
  f.displacement.z = kNaN;
  EXPECT_TRUE(std::isnan(calc_away(f, k)));
}

TEST(Mechanism, AtRestWhileLeaningIsAborted) {
  MechanismInput in = synthetic(0.1, 0, 1);
  in.came_to_rest = true;
  in.frames.back().height = 10;
  const Mechanism m = judge_mechanism(in, default_knowledge());
  EXPECT_EQ(m.name, "aborted");
  EXPECT_THAT(m.text, testing::StartsWith("Aborted collapse"));
}

TEST(Mechanism, TurningToTheOtherSideIsTheWrongDirection) {
  MechanismInput in = synthetic(0.2, 0, 1);
  in.is_direction_planned = true;
  EXPECT_EQ(name_of(in), "topple");
  in.fall_direction = {0, 1, 0};  // planned to the side
  EXPECT_EQ(name_of(in), "wrong direction");
  in.direction_tolerance = 3;
  EXPECT_EQ(name_of(in), "topple");
  in.is_direction_planned = false;
  EXPECT_EQ(name_of(in), "topple");
}

TEST(Mechanism, ThePlannedWayDoesNotChangeHowFarTheEdgesComeDown) {
  MechanismInput in = synthetic(0.2, 2.3, 1);
  const Mechanism planned = judge_mechanism(in, default_knowledge());
  for (const double azimuth : {0.0, 0.8, 1.6, 2.4, 4.0, 5.5}) {
    in.fall_direction = {std::cos(azimuth), std::sin(azimuth), 0};
    const Mechanism m = judge_mechanism(in, default_knowledge());
    EXPECT_EQ(m.name, "topple");
    EXPECT_NEAR(m.rear_share, planned.rear_share, 1e-12) << azimuth;
  }
}

TEST(Mechanism, EdgesAreWhereItsLeanLeavesTheOutline) {
  // it turns about a diagonal of a square of 10 m, its mass centre a third nearer to the corner that goes down
  MechanismInput in = synthetic(0, 0, 1);
  in.outline = {{-6, -6}, {4, -6}, {4, 4}, {-6, 4}};
  const Vec3 down = (1 / std::sqrt(2.0)) * Vec3{1, 1, 0};
  for (BlockFrame& f : in.frames) {
    f.rotation = exp_rotation(0.1 * f.time * cross({0, 0, 1}, down));
    f.displacement = {0, 0, -1.0 * f.time};
  }
  const double front = 1 + 4 * std::sqrt(2.0) * std::sin(0.1), rear = 1 - 6 * std::sqrt(2.0) * std::sin(0.1);
  EXPECT_NEAR(judge_mechanism(in, default_knowledge()).rear_share, rear / front, 1e-12);
}

TEST(Mechanism, PiecesThatHaveSunkDoNotStand) {
  MechanismInput in = synthetic(0, 0, 0);
  in.touchdown = kNaN;
  BlockFrame& last = in.frames.back();
  last.height = in.frames.front().height;
  // the largest third is in its place, all together have sunk
  last.displacement = {};
  take_apart(last, 0.35);
  last.pieces.displacement = last.standing = {0, 0, -0.41};
  EXPECT_NEAR(calc_away(last, default_knowledge()), 4.1, 1e-12);
  EXPECT_THAT(judge_mechanism(in, default_knowledge()).text,
              testing::StartsWith("It has begun to sink: the upper block has come down by 0.41 m."));
  in.came_to_rest = true;
  const Mechanism m = judge_mechanism(in, default_knowledge());
  EXPECT_EQ(m.name, "aborted");
  EXPECT_THAT(m.text, testing::StartsWith("Aborted collapse: the upper block has sunk by 0.41 m and stands"));
  EXPECT_THAT(m.text, testing::HasSubstr("It is in pieces, the largest of 35 % of the upper mass"));
  // where most of it is in its place the building stands, but not all of it
  last.connected = 0.68;
  last.in_place = 0.68;
  const Mechanism most = judge_mechanism(in, default_knowledge());
  EXPECT_EQ(most.name, "stands");
  EXPECT_THAT(most.text, testing::HasSubstr("32 % of its upper mass has left its place."));
  last.pieces.displacement = last.standing = {0, 0, -0.01};
  last.in_place = 0.995;
  EXPECT_LT(calc_away(last, default_knowledge()), 1);
  EXPECT_THAT(judge_mechanism(in, default_knowledge()).text, testing::Not(testing::HasSubstr("left its place")));
  last.connected = 0.35;
  EXPECT_EQ(name_of(in), "stands");
}

TEST(Mechanism, PiecesThatGoApartDoNotStand) {
  MechanismInput in = synthetic(0, 0, 0);
  in.touchdown = kNaN;
  BlockFrame& last = in.frames.back();
  take_apart(last, 0.45);
  last.pieces.displacement = last.standing = {};  // one to either side
  last.in_place = 0.1;
  EXPECT_GE(calc_away(last, default_knowledge()), 1);
  EXPECT_NE(name_of(in), "stands");
}

TEST(Mechanism, ATwistIsNoPartOfTheLean) {
  constexpr double tilt = 0.1, twist = 0.5, towards = 0.3;
  const Vec3 lean = {std::cos(towards), std::sin(towards), 0};
  const auto judge = [&](const Quat& rotation) {
    MechanismInput in = synthetic(0, 0, 1);
    in.fall_direction = lean;
    in.is_direction_planned = true;
    in.direction_tolerance = 0.01;
    for (BlockFrame& f : in.frames) f.rotation = rotation, f.displacement = {0, 0, -1.0 * f.time};
    return judge_mechanism(in, default_knowledge());
  };
  const Quat turn = exp_rotation(tilt * cross({0, 0, 1}, lean)), about_itself = exp_rotation({0, 0, twist});
  const Mechanism plain = judge(turn), twisted = judge(turn * about_itself);
  EXPECT_EQ(plain.name, "topple");
  EXPECT_EQ(twisted.name, "topple");
  for (const Mechanism* m : {&plain, &twisted}) {
    EXPECT_NEAR(m->azimuth, towards, 1e-12);
    EXPECT_NEAR(m->tilt, tilt, 1e-12);
  }
  // the edge that comes down most has turned with it
  const double front = 6 / std::cos(towards - twist);
  EXPECT_NEAR(twisted.rear_share, (1 - front * std::sin(tilt)) / (1 + front * std::sin(tilt)), 1e-12);
  // about the vertical, after it has leant: it leans where that has turned its top
  const Mechanism turned = judge(about_itself * turn);
  EXPECT_NEAR(turned.azimuth, towards + twist, 1e-12);
  EXPECT_NEAR(turned.tilt, tilt, 1e-12);
  EXPECT_EQ(turned.name, "wrong direction");
  EXPECT_NEAR(turned.rear_share, plain.rear_share, 1e-12);
}

TEST(Mechanism, AtRestItLeansByWhatIsNoTwist) {
  MechanismInput in = synthetic(0, 0, 1);
  in.came_to_rest = true;
  in.frames.back().rotation = exp_rotation({0, 0.1, 0}) * exp_rotation({0, 0, 0.3});
  in.frames.back().displacement = {0, 0, -1};
  in.frames.back().height = 10;
  EXPECT_THAT(judge_mechanism(in, default_knowledge()).text, testing::HasSubstr("leaning by 5.7 deg"));
}

TEST(Mechanism, WhatTopplesFallsTheWayItLeans) {
  MechanismInput in = synthetic(0.2, 0, 1);
  in.frames.back().centre = {6 + 0.5, 0.5, 4};  // its debris slides back and aside
  const Mechanism m = judge_mechanism(in, default_knowledge());
  EXPECT_TRUE(m.is_azimuth_of_lean);
  EXPECT_NEAR(m.azimuth, std::acos(-1.0), 1e-12);
  EXPECT_NEAR(norm(m.run - Vec3{0.5, 0.5, 0}), 0, 1e-12);
}

TEST(Mechanism, WhatDropsFallsTheWayItsMassGoes) {
  MechanismInput in = synthetic(0.01, 2.4, 1);
  ASSERT_EQ(name_of(in), "vertical");
  in.frames.back().centre = in.frames.front().centre + Vec3{0, 0.6, -4};
  EXPECT_NEAR(judge_mechanism(in, default_knowledge()).azimuth, std::acos(0.0), 1e-12);
  in.frames.back().centre.y = 0.4;
  EXPECT_TRUE(std::isnan(judge_mechanism(in, default_knowledge()).azimuth));
}

/// A rod that turns about its foot, 20 m below its mass centre and 1.4 m behind its axis, then comes down by `drop`.
MechanismInput turning_rod(double tilt, double drop) {
  MechanismInput in = synthetic(0, 0, 1);
  in.outline = {{-2, -2}, {2, -2}, {2, 2}, {-2, 2}};
  in.foot = 1;
  for (BlockFrame& f : in.frames) {
    const double a = tilt * f.time, c = std::cos(a), s = std::sin(a);
    f.rotation = exp_rotation({0, -a, 0});
    f.above = 21;
    f.displacement = {1.4 * (1 - c) - 20 * s, 0, -20 * (1 - c) - 1.4 * s - drop * f.time};
  }
  return in;
}

TEST(Mechanism, ASlenderBlockThatTurnsAboutItsFootTopples) {
  const Mechanism m = judge_mechanism(turning_rod(0.7, 0), default_knowledge());
  EXPECT_GT(m.rear_share, 0.5) << "its mass centre comes down with both edges";
  EXPECT_EQ(m.foot_share, 0);
  EXPECT_EQ(m.name, "topple");
  EXPECT_THAT(m.text, testing::HasSubstr("it turns about its foot"));
  // the same lean while it drops through its foot
  EXPECT_EQ(judge_mechanism(turning_rod(0.7, 6), default_knowledge()).name, "vertical");
  EXPECT_EQ(judge_mechanism(turning_rod(0.02, 3), default_knowledge()).name, "vertical");
}

TEST(Mechanism, WhatSwaysFarHasNotComeDown) {
  MechanismInput in = swaying(1.5, 0.02);
  for (BlockFrame& f : in.frames) f.height = f.centre.z = 100, f.moved = 0.3;
  EXPECT_EQ(name_of(in), "stands");
}

TEST(Mechanism, TwoPartsTurningAgainstEachOtherFold) {
  MechanismInput in = synthetic(0.02, 2, 1);
  for (BlockFrame& f : in.frames) f.forward = 0.4, f.backward = 0.35;
  EXPECT_EQ(name_of(in), "fold");
}

TEST(Mechanism, ABlockInPiecesIsProgressive) {
  MechanismInput in = synthetic(0.2, 0, 1);
  for (BlockFrame& f : in.frames) take_apart(f, 0.3);
  EXPECT_EQ(name_of(in), "progressive");
}

TEST(Mechanism, WithoutTouchdownTheLastFrameCounts) {
  MechanismInput in = synthetic(0.2, 0, 1);
  in.touchdown = kNaN;
  const Mechanism m = judge_mechanism(in, default_knowledge());
  EXPECT_EQ(m.time, 2);
  EXPECT_NEAR(m.tilt, 0.4, 1e-12);
  EXPECT_THAT(m.text, testing::HasSubstr("still moving"));
}

TEST(Mechanism, TiltIsSignedTowardsTheDirection) {
  EXPECT_NEAR(calc_tilt(exp_rotation({0, -0.3, 0}), {-1, 0, 0}), 0.3, 1e-12);
  EXPECT_NEAR(calc_tilt(exp_rotation({0, -0.3, 0}), {1, 0, 0}), -0.3, 1e-12);
  EXPECT_NEAR(calc_tilt(exp_rotation({-0.3, 0, 0}), {0, 1, 0}), 0.3, 1e-12);
}

TEST(Mechanism, StructuresThatStandApartHaveOneVerdictIfTheyAgree) {
  const auto verdict = [](const std::string& name, double tilt, double moved) {
    Mechanism m;
    m.name = name, m.text = "It is " + name + ".", m.tilt = tilt, m.moved = moved;
    return m;
  };
  const Mechanism topple = verdict("topple", 1, 1), stands = verdict("stands", 0, 0),
                  wrong = verdict("wrong direction", 2, 1);
  const auto join = [](const std::vector<Mechanism>& all) { return join_mechanisms({"K", "L"}, all, {3, 1}); };
  EXPECT_EQ(join_mechanisms({""}, {topple}, {1}).text, "It is topple.");
  EXPECT_EQ(join({topple, topple}).name, "topple");
  EXPECT_EQ(join({topple, topple}).text,
            "Separate structures are judged one by one. Verdict on K: topple. Verdict on L: topple. In detail, of K: "
            "It is topple.");
  EXPECT_EQ(join({topple, stands}).name, "partial");
  EXPECT_EQ(join({topple, stands}).moved, 0.75);
  EXPECT_EQ(join({topple, wrong}).name, "wrong direction");
  EXPECT_EQ(join({topple, wrong}).tilt, 2);
}

TEST(Mechanism, StructuresThatStandApartFallEachToItsSide) {
  Mechanism stands, falls;
  stands.name = "stands", stands.azimuth = kNaN;
  falls.name = "topple", falls.azimuth = 3.1, falls.is_azimuth_of_lean = true, falls.run = {-8, 0, 0};
  const Mechanism both = join_mechanisms({"K", "L"}, {stands, falls}, {3, 1});
  EXPECT_EQ(both.run.x, -2);
  EXPECT_EQ(both.azimuth, 3.1);  // of the one that fell
  ASSERT_EQ(both.falls.size(), 2u);
  EXPECT_EQ(both.falls[1].structure, "L");
  Mechanism other = falls;
  other.azimuth = 0.2;
  const Mechanism apart = join_mechanisms({"K", "L"}, {falls, other}, {3, 1});
  EXPECT_EQ(apart.azimuth, 3.1);
  EXPECT_NEAR(calc_deviation(apart, 3.1), 2.9, 1e-12);  // of the one that is farthest off
  EXPECT_NEAR(calc_deviation(apart, 0.2), 2.9, 1e-12);
  EXPECT_NEAR(calc_deviation(both, 3.0), 0.1, 1e-12);
}

TEST(Mechanism, RoundOffIsNoSway) {
  EXPECT_TRUE(judge_mechanism(swinging(0, 0, 1.5, 1e-15), default_knowledge()).is_final);
  EXPECT_FALSE(judge_mechanism(swinging(0, 0, 1.5), default_knowledge()).is_final);
}

}  // namespace
}  // namespace topple::collapse
