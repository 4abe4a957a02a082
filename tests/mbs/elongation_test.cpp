// What a member loses in length as its zones turn, in the multibody system.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "mbs/solver.h"

namespace topple::mbs {
namespace {

constexpr double kLift = -0.2, kStiffness = 2e9, kLength = 3, kMass = 1e5;

/// Hinges of 60 kNm at any compression that shorten by 0.2 m/rad.
ZoneLaw make_law(double lift) {
  ZoneLaw law;
  law.name = "hinge";
  for (MomentFamily* m : {&law.moment_y, &law.moment_z}) {
    m->normal_force = {-8e6, 0, 4e6};
    m->plastic_rotation = {0, 0.3, 0.6};
    m->positive = m->negative = std::vector<double>(9, 60e3);
    for (int k = 0; k < 3; ++k)
      for (const double phi : m->plastic_rotation) m->elongation_positive.push_back(lift * phi);
    m->elongation_negative = m->elongation_positive;
  }
  law.rupture_rotation = 0.6;
  return law;
}

/// A head that does not turn, on a column with a zone at its foot and a revolute joint at its top; pushed sideways.
Model make_column(double lift) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  Body shaft;
  shaft.name = "shaft", shaft.mass = 2000;
  shaft.inertia = Mat3::diagonal({1500, 1500, 100});
  shaft.X_WB.p = {0, 0, 0.5 * kLength};
  Body head;
  head.name = "head", head.mass = kMass;
  head.inertia = Mat3::diagonal({1e10, 1e10, 1e10});
  head.X_WB.p = {0, 0, kLength};
  const BodyId s = add_body(m, shaft), h = add_body(m, head);
  const LawId law = add_law(m, make_law(lift));
  // x upwards, z the hinge axis W's y
  const Quat axes = to_quat(Mat3::from_columns({0, 0, 1}, {1, 0, 0}, {0, 1, 0}));
  ZoneElement foot;
  foot.name = "foot", foot.a = kGround, foot.b = s;
  foot.X_AF = {{}, axes}, foot.X_BM = {{0, 0, -0.5 * kLength}, axes};
  foot.translational_stiffness = {kStiffness, 1e9, 1e9};
  foot.rotational_stiffness = {1e7, 5e7, 5e7};
  foot.stations = {{0, law}};
  const ElementId element = add_element(m, foot);
  Joint top;
  top.kind = Joint::Kind::Revolute, top.name = "top", top.parent = s, top.child = h;
  top.X_PF = {{0, 0, 0.5 * kLength}, axes}, top.X_CM = {{}, axes};
  RotationalElement hinge;
  hinge.name = "top", hinge.joint = add_joint(m, top), hinge.stiffness = 5e7, hinge.law = law;
  hinge.axial_element = element;
  m.rotational_elements.push_back(hinge);
  Load push;
  push.body = h, push.force = {1.2e5, 0, 0};
  push.time = {0, 0.3, 0.6}, push.factor = {0, 1, 0};
  m.loads.push_back(push);
  return m;
}

struct Pushed {
  double rotation[2] = {0, 0}, shortened = 0, height = 0, x = 0;
  Summary summary;
};

Pushed push(double lift, double step) {
  Pushed out;
  Options o;
  o.duration = 0.8, o.step = step, o.frame_interval = 0.01;
  o.on_frame = [&](const View& v) {
    out.rotation[0] = v.rotation[0], out.rotation[1] = v.rotation[1];
    out.shortened = v.element_translation[0].x + v.element_force[0].x / kStiffness;
    out.height = v.X_WB[1].p.z, out.x = v.X_WB[1].p.x;
  };
  out.summary = run(make_column(lift), o);
  return out;
}

TEST(ElongationPhysics, AColumnShortensByBothOfItsHinges) {
  const Pushed p = push(kLift, 2e-4);
  ASSERT_EQ(p.summary.ending, Summary::Ending::TimeLimit) << p.summary.message;
  ASSERT_GT(p.rotation[0], 0.03);
  ASSERT_GT(p.rotation[1], 0.03);
  // the damper's share of the force is not elastic: 0.2 of what the force changes by in its time
  EXPECT_NEAR(p.shortened, kLift * (p.rotation[0] + p.rotation[1]), 0.02 * std::abs(p.shortened));
  // the head stands on the shaft
  const double length = kLength + p.shortened, lean = std::asin(p.x / length);
  EXPECT_NEAR(p.height, length * std::cos(lean), 1e-3);
  EXPECT_LT(p.summary.energy_error, 1e-3);
}

TEST(ElongationPhysics, AFallOfTheHeadIsWorkOfTheHinges) {
  // what the head loses in height beyond the lean is dissipated beside the moments
  const Pushed with = push(kLift, 1e-4), without = push(0, 1e-4);
  EXPECT_EQ(push(0, 1e-4).shortened, without.shortened);
  EXPECT_NEAR(without.shortened, 0, 2e-4);
  EXPECT_LT(with.height, without.height - 0.01);
  EXPECT_LT(with.summary.energy_error, 1e-3);
}

/// Hinges that bear 4 MN until they have turned by 10 mrad, 2 MN at 20 mrad, 0.4 MN from 30 mrad on.
ZoneLaw make_failing_law() {
  ZoneLaw law = make_law(0);
  for (MomentFamily* m : {&law.moment_y, &law.moment_z}) {
    m->normal_force = {-4e6, -2e6, -0.4e6, 0, 4e6};
    m->plastic_rotation = {0, 0.01, 0.02, 0.03, 0.6};
    const double M = 60e3;
    m->positive = {M, 0, 0, 0, 0,  //
                   M, M, 0, 0, 0,  //
                   M, M, M, 0, 0,  //
                   M, M, M, M, M,  //
                   M, M, M, M, M};
    m->negative = m->positive;
    m->elongation_positive = m->elongation_negative = std::vector<double>(25, 0);
  }
  // about the other axis, about which a joint does not turn, they would bear nothing much sooner
  for (double& rotation : law.moment_y.plastic_rotation) rotation *= 0.1;
  return law;
}

TEST(ElongationPhysics, AJointThatHasTurnedTooFarIsCrushed) {
  for (const bool full_law : {false, true}) {
    Model m = make_column(0);
    m.rotational_elements[0].law = add_law(m, make_failing_law());  // the foot's bears
    Options o;
    o.duration = 0.8, o.step = 1e-4, o.frame_interval = 0.002, o.full_law = full_law;
    double most_turned = 0, fallen = 0, began = -1, speed = 0;
    int crushed = 0;
    o.on_frame = [&](const View& v) {
      const double turned = v.rotation[1], N = -v.element_force[0].x;
      most_turned = std::max(most_turned, turned);
      fallen = kLength - v.X_WB[1].p.z;
      if (turned < 0.01) { EXPECT_LT(N, -0.8 * 9.81 * kMass) << v.time; }
      // its column bears what it bears, within what it turns by and the damper adds
      if (turned < 0.035 || fallen > 0.3) return;
      ++crushed;
      EXPECT_NEAR(N, -0.4e6, 0.02e6) << v.time;
      if (began < 0)
        began = v.time, speed = v.v_WB[1].z;
      else
        EXPECT_NEAR(v.v_WB[1].z - speed, -(9.81 - 0.4e6 / (kMass + 1000)) * (v.time - began), 0.05) << v.time;
    };
    const Summary summary = run(m, o);
    ASSERT_NE(summary.ending, Summary::Ending::Diverged) << summary.message;
    EXPECT_GT(most_turned, 0.035);
    EXPECT_GT(crushed, 5);
    EXPECT_LT(summary.energy_error, 1e-3);
  }
}

TEST(ElongationPhysics, DeadLoadYieldsAHingeWithoutLengtheningIt) {
  // A part on two columns 2 m apart, turned by 170 kNm: the hinge under one side yields, hardens and would push up
  // against the other, whose force raises what it bears.
  Model m;
  m.contact.ground = m.contact.bodies = false;
  m.gravity = {};
  ZoneLaw law;
  law.name = "hinge";
  law.moment_y.normal_force = {-4e6, 0, 2e6};
  law.moment_y.plastic_rotation = {0, 0.02};
  law.moment_y.positive = law.moment_y.negative = {900e3, 940e3, 100e3, 140e3, 50e3, 90e3};
  law.moment_y.elongation_positive = law.moment_y.elongation_negative = {0, 6e-3, 0, 6e-3, 0, 6e-3};
  const LawId hinge = add_law(m, law);
  Body part;
  part.name = "part", part.mass = 1e4, part.inertia = Mat3::diagonal({1e4, 1e4, 1e4});
  const BodyId body = add_body(m, part);
  for (const double y : {-1.0, 1.0}) {
    ZoneElement e;
    e.name = y < 0 ? "yields" : "holds", e.a = kGround, e.b = body;
    const Quat up = to_quat(Mat3::from_columns({0, 0, 1}, {0, 1, 0}, {-1, 0, 0}));
    e.X_AF = e.X_BM = {{0, y, 0}, up};
    e.translational_stiffness = {5e9, 1e9, 1e9};
    e.rotational_stiffness = {1e7, y < 0 ? 5e7 : 1e7, 1e7};
    if (y < 0) e.stations = {{0, hinge}};
    add_element(m, e);
  }
  Load load;
  load.name = "torque", load.body = body, load.torque = {0, 170e3, 0};
  m.loads.push_back(load);
  Simulation s(m, {});
  std::string message;
  ASSERT_TRUE(s.find_equilibrium(message)) << message;
  const View& v = s.calc_view();
  // it bears 100 kNm and 2 MNm times what it turns, and the other one 10 MNm times all of the rotation
  const double bears = 100e3 + 2e6 * v.rotation[0];
  EXPECT_NEAR(bears + 1e7 * (v.rotation[0] + bears / 5e7), 170e3, 1);
  EXPECT_NEAR(v.element_force[0].x, 0, 1e3);
  EXPECT_NEAR(v.X_WB[0].p.z, 0, 1e-7);
}

TEST(ElongationPhysics, ConvergesWithTheStep) {
  const Pushed fine = push(kLift, 2.5e-5), middle = push(kLift, 1e-4), coarse = push(kLift, 2e-4);
  const double near = std::abs(middle.shortened - fine.shortened), far = std::abs(coarse.shortened - fine.shortened);
  // first order: (2 - 1/4) / (1 - 1/4) = 2.3
  EXPECT_LT(near, 0.7 * far);
  EXPECT_LT(near, 0.005 * std::abs(fine.shortened));
  EXPECT_LT(fine.summary.energy_error, middle.summary.energy_error + 1e-9);
}

}  // namespace
}  // namespace topple::mbs
