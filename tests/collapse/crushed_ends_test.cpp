// Ends of drawn boxes recede with those that the solver crushes. g = 9.81.
#include <gtest/gtest.h>

#include "collapse/recorder.h"
#include "mbs/solver.h"

namespace topple::collapse {
namespace {

constexpr double kMass = 4000, kBears = 2e5, kSpeed = 8;  // [kg, N, m/s]

/// A plate of 0.5 m on a post of 2 m, one body whose element holds the post's foot; it comes down at kSpeed.
mbs::Model make_post() {
  mbs::Model m;
  m.contact.restitution = 0;
  mbs::Body plate;
  plate.mass = kMass;
  plate.inertia = Mat3::identity();
  for (int i = 0; i < 3; ++i) plate.inertia(i, i) = 2000;
  plate.X_WB.p = {0, 0, 2.25};
  plate.v_WB = {0, 0, -kSpeed};
  plate.shapes.resize(2);
  plate.shapes[0].half = {1, 1, 0.25};
  plate.shapes[1].half = {0.15, 0.15, 1};
  plate.shapes[1].X_BS.p = {0, 0, -1.25};
  mbs::add_body(m, plate);
  mbs::ZoneLaw law;
  law.compression = {{0, 10}, {kBears, kBears}};
  law.crush_length = 0.3;
  const mbs::LawId id = mbs::add_law(m, law);
  const Quat upright = exp_rotation({0, -std::acos(0.0), 0});  // x of F along z of W
  mbs::ZoneElement e;
  e.a = mbs::kGround;
  e.b = {0};
  e.X_AF = {{0, 0, 1}, upright};
  e.X_BM = {{0, 0, -1.25}, upright};
  e.translational_stiffness = {1e9, 1e8, 1e8};
  e.rotational_stiffness = {1e8, 1e8, 1e8};
  e.damping_ratio = 0;
  e.stations = {{-1, id}, {1, id}};
  e.crush_through = 1.9;
  mbs::add_element(m, e);
  return m;
}

record::Record record_of(const mbs::Model& model) {
  record::Record r;
  const ModelMap map = describe_model(model);
  const RunCallbacks none;
  Recorder recorder(model, map, default_knowledge(), r, none);
  mbs::Options o;
  o.duration = 0.4;
  o.step = 1e-4;
  o.equilibrium = false;
  o.frame_interval = 0.01;
  o.on_frame = [&](const mbs::View& v) { recorder.add_frame(v); };
  (void)mbs::run(model, o);
  recorder.finish();
  return r;
}

/// Foot of the post as drawn [m].
double calc_foot(const record::Record& r, size_t frame) {
  const record::BoxShape post = record::shape_at(r, frame, 0, 1);
  return record::pose_at(r, frame, 0).p.z + post.X_BS.p.z - post.half.z;
}

double calc_way(double fall = 0) { return kMass * (0.5 * kSpeed * kSpeed + 9.81 * fall) / (kBears - kMass * 9.81); }

TEST(CrushedEndsPhysics, APostIsDrawnAsLongAsItsElementLeavesIt) {
  const record::Record r = record_of(make_post());
  for (size_t f = 0; f < r.time.size(); ++f) ASSERT_NEAR(calc_foot(r, f), 0, 2e-3) << r.time[f];
  const size_t last = r.time.size() - 1;
  EXPECT_NEAR(2 - 2 * record::shape_at(r, last, 0, 1).half.z, calc_way(), 0.01 * calc_way());
  EXPECT_EQ(record::shape_at(r, last, 0, 0).half.z, 0.25) << "the plate";
}

TEST(CrushedEndsPhysics, APostIsDrawnAsLongAsTheGroundLeavesIt) {
  mbs::Model m = make_post();
  m.bodies[0].X_WB.p.z += 0.05;
  m.elements[0].X_AF.p.z += 0.05;
  mbs::Event event;
  event.actions.push_back({});
  event.actions[0].kind = mbs::Action::Kind::RemoveElement;
  event.actions[0].element = mbs::ElementId{0};
  m.events.push_back(event);
  const record::Record r = record_of(m);
  const size_t last = r.time.size() - 1;
  // what is elastic of the contact stays below the ground
  EXPECT_NEAR(calc_foot(r, last), 0, 0.02);
  EXPECT_NEAR(2 - 2 * record::shape_at(r, last, 0, 1).half.z, calc_way(0.05), 0.02 * calc_way());
}

TEST(CrushedEndsPhysics, WhatIsNotCrushedHasNone) {
  mbs::Model m = make_post();
  m.elements[0].crush_through = 0;
  EXPECT_TRUE(record_of(m).crushed_ends.empty());
}

}  // namespace
}  // namespace topple::collapse
