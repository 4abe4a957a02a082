// Joints that repeat each other and positions where mechanisms branch: least-squares answers, energy, honest notes.
#include <gtest/gtest.h>

#include <algorithm>

#include "mechanisms.h"

namespace topple::mbs {
namespace {

using test::empty_model;
using test::make_box;

constexpr double kPi = 3.14159265358979323846;

Options options_of(double duration, double step) {
  Options o;
  o.equilibrium = false;
  o.duration = duration;
  o.step = step;
  o.frame_interval = 0.01;
  return o;
}

TEST(RedundantJoints, TwoWeldsShareTheLoadAndNotByTheirOrder) {
  // a block of 10 kg on the ground's wall by two welds above each other, 0.4 m apart, its centre 0.5 m out: each takes
  // half of the weight
  const auto hang = [](bool swapped) {
    Model m = empty_model();
    add_body(m, make_box("block", 10, {0.5, 0.3, 0.2}, {0.5, 0, 0}));
    for (const double z : {swapped ? -0.2 : 0.2, swapped ? 0.2 : -0.2})
      test::join(m, Joint::Kind::Fixed, kGround, {0}, {0, 0, z}, {}, z > 0 ? "upper" : "lower");
    std::vector<Vec3> r;
    Options o = options_of(0.1, 1e-3);
    o.on_frame = [&](const View& v) {
      r = {v.joint_force[0], v.joint_moment[0], v.joint_force[1], v.joint_moment[1]};
      EXPECT_NEAR(norm(v.X_WB[0].p - Vec3{0.5, 0, 0}), 0, 1e-13);
    };
    const Summary s = run(m, o);
    EXPECT_EQ(s.notes.size(), 1U);
    EXPECT_NE(s.notes.at(0).find("\"upper\""), std::string::npos);
    EXPECT_NE(s.notes.at(0).find("6 constraints of 12 repeat"), std::string::npos) << s.notes.at(0);
    if (swapped) std::swap(r[0], r[2]), std::swap(r[1], r[3]);
    return r;
  };
  const auto a = hang(false), b = hang(true);
  const double weight = 98.1;
  EXPECT_NEAR(a[0].z, weight / 2, 1e-9);
  EXPECT_NEAR(a[2].z, weight / 2, 1e-9);
  EXPECT_NEAR(a[0].x, -a[2].x, 1e-9);  // pulled above, pushed below
  EXPECT_LT(a[0].x, 0);
  // in all they carry the moment of the weight about the wall
  EXPECT_NEAR(0.2 * a[0].x - 0.2 * a[2].x + a[1].y + a[3].y, -weight * 0.5, 1e-9);
  EXPECT_NEAR(a[1].y, a[3].y, 1e-9);
  for (size_t i = 0; i < 4; ++i) EXPECT_LT(norm(a[i] - b[i]), 1e-9);
}

TEST(RedundantJoints, ThreeHingesOfADoorCarryAThirdEach) {
  // 30 kg, the hinges 0.8 m apart about z; turning, so that the forces of the turn are shared as well
  Model m = empty_model();
  add_body(m, make_box("door", 30, {0.5, 0.02, 1}, {0.5, 0, 0}));
  m.bodies[0].w_WB = {0, 0, 3};
  m.bodies[0].v_WB = {0, 1.5, 0};
  for (const double z : {-0.8, 0.0, 0.8}) test::join(m, Joint::Kind::Revolute, kGround, {0}, {0, 0, z}, {});
  double angle = 0, drift = 0;
  Options o = options_of(2, 1e-3);
  o.on_frame = [&](const View& v) {
    angle = v.joint_angle[1];
    Vec3 sum;
    for (size_t j = 0; j < 3; ++j) {
      EXPECT_NEAR(v.joint_force[j].z, 30 * 9.81 / 3, 1e-8);
      EXPECT_NEAR(v.joint_moment[j].z, 0, 1e-9);
      sum += v.joint_force[j];
    }
    // the centre is pulled inwards by m ω² r; the axes of F are W's
    const Vec3 wanted = -30 * 9 * 0.5 * Vec3{std::cos(angle), std::sin(angle), 0};
    EXPECT_LT(std::hypot(sum.x - wanted.x, sum.y - wanted.y), 1e-3);  // (ω h)² of 135 N
    drift = std::max(drift, std::abs(norm(v.X_WB[0].p) - 0.5));
  };
  const Summary s = run(m, o);
  EXPECT_NEAR(angle, 6, 1e-5);
  EXPECT_LT(drift, 1e-12);
  ASSERT_EQ(s.notes.size(), 1U);
  EXPECT_NE(s.notes[0].find("10 constraints of 15 repeat"), std::string::npos) << s.notes[0];
}

/// Five rods of 1 m and 1 kg along edges of a cube and the ground as the sixth, a hinge at each corner across both
/// rods: six hinges that hold one direction twice, so that the chain can move (IFToMM benchmark A04, rectangular
/// Bricard).
Model make_bricard() {
  Model m = empty_model();
  const Vec3 corner[6] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, -1}, {0, 1, -1}, {0, 0, -1}};
  for (int i = 0; i < 5; ++i) add_body(m, test::make_rod("rod " + std::to_string(i), 1, corner[i], corner[i + 1]));
  for (int i = 0; i < 6; ++i) {
    const Vec3 before = corner[i] - corner[(i + 5) % 6], after = corner[(i + 1) % 6] - corner[i];
    const BodyId parent = i == 0 ? kGround : BodyId{i - 1}, child = i == 5 ? kGround : BodyId{i};
    test::join(m, Joint::Kind::Revolute, parent, child, corner[i], test::along(cross(before, after)),
               "corner " + std::to_string(i));
  }
  return m;
}

TEST(RedundantJoints, BricardsChainMovesAndKeepsItsEnergy) {
  const auto fall = [](double h, double duration, Vec3& p, double& moved, double& residual) {
    Options o = options_of(duration, h);
    const Model m = make_bricard();
    o.on_frame = [&](const View& v) {
      p = v.X_WB[2].p;
      moved = std::max(moved, norm(p - m.bodies[2].X_WB.p));
      residual = std::max(residual, std::abs(v.energy.residual));
    };
    const Summary s = run(m, o);
    EXPECT_LT(s.joint_drift, 1e-8);
    EXPECT_EQ(s.notes.size(), 1U) << s.notes.at(1);
    EXPECT_NE(s.notes.at(0).find("1 constraint of 30 repeats"), std::string::npos) << s.notes.at(0);
    EXPECT_NE(s.notes.at(0).find("\"corner 0\""), std::string::npos);
  };
  Vec3 p;
  double moved = 0, residual = 0;
  fall(1e-3, 10, p, moved, residual);
  EXPECT_GT(moved, 1);
  EXPECT_LT(residual, 1e-2);
  Vec3 a, b, c;
  double r[3] = {0, 0, 0};
  fall(2e-3, 2, a, moved, r[0]);
  fall(1e-3, 2, b, moved, r[1]);
  fall(5e-4, 2, c, moved, r[2]);
  EXPECT_NEAR(std::log2(norm(a - b) / norm(b - c)), 2, 0.1);
  EXPECT_NEAR(std::log2(r[1] / r[2]), 2, 0.2);
}

TEST(RedundantJoints, ReactionsOfAFourBarDoNotDependOnTheOrderOfJoints) {
  const auto at = [](bool reversed) {
    Model m = test::make_four_bars(2);
    if (reversed) std::reverse(m.joints.begin(), m.joints.end());
    Options o = options_of(0.5, 1e-3);
    std::vector<Vec3> r;
    o.on_frame = [&](const View& v) {
      r = v.joint_force;
      r.insert(r.end(), v.joint_moment.begin(), v.joint_moment.end());
    };
    (void)run(m, o);
    if (reversed) std::reverse(r.begin(), r.begin() + 7), std::reverse(r.begin() + 7, r.end());
    return r;
  };
  const auto a = at(false), b = at(true);
  for (size_t i = 0; i < a.size(); ++i) EXPECT_LT(norm(a[i] - b[i]), 1e-7) << i;
  for (size_t i = 0; i < 7; ++i) {
    EXPECT_NEAR(a[i].z, 0, 1e-9);  // nothing pulls out of the plane, and the least answer puts nothing there
    EXPECT_NEAR(norm(a[7 + i]), 0, 1e-9);
  }
}

// --------------------------------------------------------------------------------------------------- singular
// positions

TEST(SingularPosition, FourBarStartsInIt) {
  // all rods on one line, at rest: they fall as the parallelograms they are nearest to
  for (const double h : {1e-3, 2e-4}) {
    Model m = empty_model();
    for (int i = 0; i < 2; ++i)
      add_body(m, test::make_rod("crank " + std::to_string(i), 1, {1.0 * i, 0, 0}, {1.0 * i + 1, 0, 0}));
    add_body(m, test::make_rod("coupler", 1, {1, 0, 0}, {2, 0, 0}));
    for (int i = 0; i < 2; ++i) test::pin(m, kGround, {i}, {1.0 * i, 0, 0});
    for (int i = 0; i < 2; ++i) test::pin(m, {i}, {2}, {1.0 * i + 1, 0, 0});
    double residual = 0, apart = 0, angle = 0;
    Options o = options_of(3, h);
    o.on_frame = [&](const View& v) {
      residual = std::max(residual, std::abs(v.energy.residual));
      apart = std::max(apart, std::abs(v.joint_angle[0] - v.joint_angle[1]));
      angle = std::max(angle, v.joint_angle[0]);
    };
    const Summary s = run(m, o);
    EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
    EXPECT_NEAR(angle, kPi, 1e-3);     // to the other side
    EXPECT_LT(apart, 1e-4);            // as a parallelogram
    EXPECT_LT(residual, 4e3 * h * h);  // of 20 J
    EXPECT_LT(s.joint_drift, 1e-8);
    ASSERT_GE(s.notes.size(), 1U);
    EXPECT_NE(s.notes[0].find("4 constraints of 20 repeat"), std::string::npos) << s.notes[0];
  }
}

/// Crank and rod of the given lengths in the plane, a slide along x through the crank's centre; the crank at an angle
/// from x.
Model make_slider_crank(double crank, double rod, double angle, double spin) {
  Model m = empty_model();
  const Vec3 knee{crank * std::cos(angle), 0, crank * std::sin(angle)};
  const Vec3 end{knee.x + std::sqrt(rod * rod - knee.z * knee.z), 0, 0};
  add_body(m, test::make_rod("crank", 1, {}, knee));
  add_body(m, test::make_rod("rod", 1, knee, end));
  Body block = make_box("slider", 1, {0.1, 0.1, 0.1}, end);
  block.shapes.clear();
  add_body(m, block);
  m.bodies[0].w_WB = {0, -spin, 0};
  m.bodies[0].v_WB = cross(m.bodies[0].w_WB, 0.5 * knee);
  const Vec3 v_knee = cross(m.bodies[0].w_WB, knee);
  const double w_rod = v_knee.z / (end.x - knee.x);  // so that the end has no speed along z
  m.bodies[1].w_WB = {0, w_rod, 0};
  m.bodies[1].v_WB = v_knee + cross(m.bodies[1].w_WB, 0.5 * (end - knee));
  m.bodies[2].v_WB = v_knee + cross(m.bodies[1].w_WB, end - knee);
  test::pin(m, kGround, {0}, {}, "main");
  test::pin(m, {0}, {1}, knee, "knee");
  test::pin(m, {1}, {2}, end, "wrist");
  test::join(m, Joint::Kind::Prismatic, kGround, {2}, end, test::along({1, 0, 0}), "slide");
  return m;
}

TEST(SingularPosition, SliderCrankTurnsThroughItsDeadCentres) {
  // without weight, twice round and more; the dead centres are not singular, rows that repeat are those of a plane
  double last = 0;
  for (const double h : {1e-3, 5e-4}) {
    Model m = make_slider_crank(1, 2, 0.5, 5);
    m.gravity = {};
    double residual = 0, angle = 0;
    Options o = options_of(10, h);
    o.on_frame = [&](const View& v) {
      residual = std::max(residual, std::abs(v.energy.residual));
      angle = v.joint_angle[0];
    };
    const Summary s = run(m, o);
    EXPECT_LT(s.joint_drift, 1e-11);
    EXPECT_GT(std::abs(angle), 12 * kPi);
    ASSERT_EQ(s.notes.size(), 1U);
    EXPECT_NE(s.notes[0].find("3 constraints of 20 repeat"), std::string::npos) << s.notes[0];
    if (last > 0) { EXPECT_NEAR(std::log2(last / residual), 2, 0.1); }
    last = residual;
  }
}

TEST(SingularPosition, SliderCrankOfEqualRodsGoesOnAlongItsBranch) {
  // crank and rod of 1 m: with the crank upright the slider is at its centre and could stay there while both rods turn
  // as one. Passing at speed it goes through, and energy is kept.
  for (const double h : {1e-3, 2e-4}) {
    Model m = make_slider_crank(1, 1, 0.5, 5);
    m.gravity = {};
    double residual = 0, least = 2;
    Options o = options_of(10, h);
    o.on_frame = [&](const View& v) {
      residual = std::max(residual, std::abs(v.energy.residual));
      least = std::min(least, v.X_WB[2].p.x);
    };
    const Summary s = run(m, o);
    EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
    EXPECT_LT(least, -1.99);  // the other side
    EXPECT_LT(residual, 4e4 * h * h);
    EXPECT_LT(s.joint_drift, 1e-6);
  }
}

TEST(SingularPosition, StepsThatTurnTooFarAreNone) {
  // a crank that turns by half a radian in a step: nothing is singular, and nothing may be left out to get on
  for (const double h : {0.01, 0.1, 0.2}) {
    Model m = make_slider_crank(1, 1.7, 0.5, 5);
    m.gravity = {};
    const Summary s = run(m, options_of(10, h));
    const auto tells = [&s](const char* what) {
      return std::any_of(s.notes.begin(), s.notes.end(),
                         [what](const std::string& note) { return note.find(what) != std::string::npos; });
    };
    EXPECT_FALSE(tells("singular position")) << h;
    EXPECT_EQ(tells("a body turns by"), h > 0.05) << h;
    EXPECT_EQ(s.ending, h > 0.05 ? Summary::Ending::Diverged : Summary::Ending::TimeLimit) << h;
  }
}

TEST(SingularPosition, BarsStretchedStraightStand) {
  // between two fixed hinges: rigid, though to second order only; nothing of the first order holds their weight, or a
  // load of a thousand times as much
  for (const int n : {2, 3, 6})
    for (const Joint::Kind kind : {Joint::Kind::Revolute, Joint::Kind::Spherical})
      for (const auto& [h, load] : {std::pair{1e-3, 0.0}, {1e-4, 0.0}, {2e-4, 1e4}}) {
        Model m = empty_model();
        for (int i = 0; i < n; ++i)
          add_body(m, test::make_rod("bar " + std::to_string(i), 1, {1.0 * i, 0, 0}, {1.0 * i + 1, 0, 0}));
        for (int i = 0; i <= n; ++i) {
          const BodyId parent = i == 0 ? kGround : BodyId{i - 1}, child = i == n ? kGround : BodyId{i};
          test::join(m, kind, parent, child, {1.0 * i, 0, 0}, test::along({0, 1, 0}));
        }
        if (load > 0) m.loads.push_back({"pull", BodyId{n / 2}, {}, {0, 0, -load}, {}, false, {}, {}});
        double lowest = 0;
        Options o = options_of(0.3, h);
        o.on_frame = [&](const View& v) {
          for (const Pose& X : v.X_WB) lowest = std::max(lowest, std::abs(X.p.z));
        };
        const Summary s = run(m, o);
        EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << n << " bars: " << s.message;
        EXPECT_LT(lowest, 2e-5) << n << " bars in steps of " << h;
        EXPECT_LT(s.joint_drift, 1e-6) << n << " bars in steps of " << h;
        EXPECT_GE(s.notes.size(), 1U);
      }
}

TEST(SingularPosition, BarsThatSagALittlePullAsStaticsSays) {
  // two bars of length l over a span of 2 m that sag by s pull with m g l / (2 s) along each other; down to a hundred
  // thousandth the answer is not cut off
  for (const double sag : {1e-2, 1e-4, 1e-5})
    for (const double h : {1e-3, 1e-4}) {
      Model m = empty_model();
      const Vec3 end[] = {{0, 0, 0}, {1, 0, -sag}, {2, 0, 0}};
      for (int i = 0; i < 2; ++i) add_body(m, test::make_rod("bar " + std::to_string(i), 1, end[i], end[i + 1]));
      for (int i = 0; i < 3; ++i)
        test::join(m, Joint::Kind::Revolute, i == 0 ? kGround : BodyId{i - 1}, i == 2 ? kGround : BodyId{i}, end[i],
                   test::along({0, 1, 0}));
      const double pull = 0.5 * 9.81 / sag;
      double lowest = 1e300, largest = 0;
      Options o = options_of(0.1, h);
      o.on_frame = [&](const View& v) {
        lowest = std::min(lowest, std::abs(v.joint_force[0].x)),
        largest = std::max(largest, std::abs(v.joint_force[0].x));
      };
      const Summary s = run(m, o);
      EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
      EXPECT_NEAR(lowest / pull, 1, 1e-5) << "sag " << sag << " in steps of " << h;
      EXPECT_NEAR(largest / pull, 1, 1e-5) << "sag " << sag << " in steps of " << h;
      EXPECT_LT(s.energy_error, 1e-3) << "sag " << sag << " in steps of " << h;
    }
}

}  // namespace
}  // namespace topple::mbs
