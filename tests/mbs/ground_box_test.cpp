// Boxes on the ground in the kernel of their own: as the contacts of any shapes, and the same bits in any lane.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>
#include <vector>

#include "mbs/batch.h"
#include "mbs/system.h"
#include "models.h"

namespace topple::mbs {
namespace {

constexpr int kBoxes = 21;

/// Boxes of all shapes, some off their centres and askew in their bodies, thrown at the ground far from each other; one
/// lies in it when its tie is cut. Bodies that may touch each other go through the contacts of any shapes.
Model make_boxes(bool any_shapes) {
  Model m;
  m.contact.bodies = any_shapes;
  m.contact.contact_frequency = 600;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < kBoxes; ++i) {
    const Vec3 half{0.6 + 0.3 * unit(random), 0.5 + 0.3 * unit(random), 0.25 + 0.1 * unit(random)};
    Body b = test::make_box("b" + std::to_string(i), 300 + 100 * unit(random), half, {20.0 * i, 3, 1.2});
    b.X_WB.q = normalized(Quat{1, unit(random), unit(random), unit(random)});
    b.v_WB = {3 * unit(random), 2 * unit(random), -3 + unit(random)};
    b.w_WB = {2 * unit(random), 2 * unit(random), unit(random)};
    if (i % 3 == 1) b.shapes[0].X_BS = {{0.1, -0.05, 0.03}, normalized(Quat{1, 0.1, 0.2, -0.3})};
    if (i == 5) {
      b.X_WB = {{100, 3, 0.1}, {}};
      b.v_WB = b.w_WB = {};
    }
    add_body(m, b);
  }
  for (int i = 0; i < 3; ++i) {
    Contact::Pair p;
    p.a = {2 * i + 6};
    p.b = kGround;
    p.friction = 0.1 + 0.4 * i;
    p.restitution = 0.5;
    if (i == 1) p.damping = 800, p.stiffness = 3e7;
    if (i == 2) p.touches = false;
    m.contact.pairs.push_back(p);
  }
  ZoneElement tie;
  tie.name = "tie";
  tie.a = kGround;
  tie.b = {5};
  tie.X_AF.p = {100, 3, 0.1};
  tie.translational_stiffness = tie.rotational_stiffness = {1e6, 1e6, 1e6};
  add_element(m, tie);
  m.events.push_back(test::make_event(0.2, Action::Kind::RemoveElement, 0, "cut"));
  return m;
}

Options make_options() {
  Options o;
  o.duration = 0.6;
  o.step = 2e-4;
  o.equilibrium = false;
  o.contact_interval = 1;
  o.frame_interval = 0.05;
  return o;
}

TEST(GroundBox, MovesAsByTheContactsOfAnyShapes) {
  std::vector<View> frames[2];
  std::vector<std::pair<int, double>> landed[2];
  for (const bool any_shapes : {false, true}) {
    Options o = make_options();
    o.on_frame = [&](const View& v) { frames[any_shapes].push_back(v); };
    o.on_happening = [&](const Happening& h) {
      if (h.kind == Happening::Kind::GroundContact) landed[any_shapes].emplace_back(h.index, h.speed);
    };
    const Model m = make_boxes(any_shapes);
    System s(m, o);
    EXPECT_EQ(s.is_ground_box(0), !any_shapes);
    EXPECT_EQ(run(m, o).ending, Summary::Ending::TimeLimit);
  }
  ASSERT_EQ(frames[0].size(), frames[1].size());
  ASSERT_EQ(landed[0].size(), landed[1].size());
  EXPECT_GT(landed[0].size(), 10U);
  for (size_t i = 0; i < landed[0].size(); ++i) {
    EXPECT_EQ(landed[0][i].first, landed[1][i].first);
    EXPECT_NEAR(landed[0][i].second, landed[1][i].second, 1e-9);
  }
  for (size_t f = 0; f < frames[0].size(); ++f) {
    const View &a = frames[0][f], &b = frames[1][f];
    // the same sums in another order; some 1e-14 m/s more at the start move one of them by up to 1e-7 m
    for (size_t i = 0; i < kBoxes; ++i) {
      EXPECT_LT(norm(a.X_WB[i].p - b.X_WB[i].p), 1e-7) << i << " at " << a.time;
      EXPECT_LT(norm(a.w_WB[i] - b.w_WB[i]), 1e-4) << i << " at " << a.time;
    }
    const double scale = 1e-8 * 21 * 300 * 9.81;
    EXPECT_NEAR(a.energy.contact, b.energy.contact, scale);
    EXPECT_NEAR(a.energy.contact_loss, b.energy.contact_loss, scale);
    EXPECT_NEAR(a.energy.friction, b.energy.friction, scale);
    EXPECT_NEAR(a.energy.residual, b.energy.residual, scale);
    // what a box that is 1e-7 m elsewhere makes at four corners
    EXPECT_LT(norm(a.contact_force_ground - b.contact_force_ground), 4 * 400 * 600 * 600 * 1e-7);
  }
  EXPECT_GT(frames[0].back().energy.friction, 100);
  EXPECT_GT(frames[0].back().energy.contact_loss, 100);
  // the box that lay in the ground is let go without a push; the one that the ground does not touch has fallen through
  EXPECT_NEAR(frames[0].back().X_WB[5].p.z, 0.1, 0.05);
  EXPECT_LT(frames[0].back().X_WB[10].p.z, -1.5);
}

TEST(GroundBox, HasTheSameBitsInAnyLanes) {
  std::vector<std::uint64_t> wide, single;
  const Model m = make_boxes(false);
  for (const size_t width : {size_t{0}, size_t{1}}) {
    System s(m, make_options(), width);
    s.start();
    for (int i = 0; i < 3000; ++i) {
      ASSERT_TRUE(s.advance_step());
      if (i % 100 == 99) (width == 0 ? wide : single).push_back(test::hash_of(s.calc_view()));
    }
  }
  EXPECT_EQ(wide, single);
}

TEST(GroundBox, SampleHasTheBitsOfItsRunAlone) {
  const Model base = make_boxes(false);
  std::vector<Variation> variations;
  for (int i = 0; i < 11; ++i)
    variations.push_back([i](Model& m) {
      for (Body& b : m.bodies) b.v_WB.z -= 0.1 * i, b.X_WB.p.z += 0.02 * i;
      m.contact.friction = 0.3 + 0.05 * i;
      m.contact.offset = 0.01 * i;
      m.events[0].time += 0.01 * i;
      if (i == 4) m.contact.ground = false;
      if (i == 6) m.contact.bodies = true;
    });
  Options run_options = make_options();
  run_options.step = 0;  // each its own
  std::map<size_t, std::vector<std::uint64_t>> alone, together;
  for (size_t i = 0; i < variations.size(); ++i) {
    Model m = base;
    variations[i](m);
    Options o = run_options;
    o.on_frame = [&](const View& v) { alone[i].push_back(test::hash_of(v)); };
    EXPECT_EQ(run(m, o).ending, Summary::Ending::TimeLimit);
  }
  BatchOptions o;
  o.run = run_options;
  o.on_frame = [&](size_t i, const View& v) { together[i].push_back(test::hash_of(v)); };
  (void)run_batch(base, variations, o);
  EXPECT_EQ(together, alone);
  EXPECT_NE(alone[0], alone[1]);
}

TEST(GroundBox, GoesOnFromASnapshotWithTheSameBits) {
  const Model m = make_boxes(false);
  Simulation a(m, make_options()), b(m, make_options());
  for (int i = 0; i < 1700; ++i) ASSERT_TRUE(a.advance_step());
  b.restore(a.snapshot());
  for (int i = 0; i < 600; ++i) {
    ASSERT_TRUE(a.advance_step());
    ASSERT_TRUE(b.advance_step());
  }
  EXPECT_EQ(test::hash_of(a.calc_view()), test::hash_of(b.calc_view()));
}

TEST(GroundBox, LeavesTheKernelWhenItBecomesSomethingElse) {
  // the ledger goes on over the change of a box for two
  Model m = make_boxes(false);
  Event change;
  change.name = "change";
  change.time = 0.45;
  for (int i = 0; i < 4; ++i) {
    Action a;
    a.kind = Action::Kind::ReplaceBody;
    a.body = {i};
    a.replacement = m.bodies[static_cast<size_t>(i)];
    a.replacement.X_WB = {};
    if (i % 2 == 0) a.replacement.shapes.push_back(a.replacement.shapes[0]);
    change.actions.push_back(a);
  }
  m.events.push_back(change);
  Options o = make_options();
  double residual = 0, released = 0;
  o.on_frame = [&](const View& v) {
    residual = std::max(residual, std::abs(v.energy.residual));
    released = std::max(released, v.energy.released + v.energy.kinetic);
  };
  EXPECT_EQ(run(m, o).ending, Summary::Ending::TimeLimit);
  EXPECT_LT(residual, 0.01 * released);  // error of the step
}

TEST(ContactPhysics, WhatAReplacedBodyHasPressedIsBooked) {
  // when it has nearly stopped on the ground, or on a body of half its mass, contact has all of its energy
  enum class Floor { Ground, GroundAmongBodies, Plane, Body };
  for (const Floor floor : {Floor::Ground, Floor::GroundAmongBodies, Floor::Plane, Floor::Body})
    for (const bool is_sphere : {false, true})
      for (const int times : {1, 2}) {
        Model m;
        m.contact.ground = floor == Floor::Ground || floor == Floor::GroundAmongBodies;
        m.contact.bodies = floor != Floor::Ground;
        m.contact.restitution = m.contact.body_restitution = 0.9;
        m.contact.contact_frequency = 250;
        Body b = test::make_box("b", 2, {0.25, 0.25, 0.25}, {0, 0, 1.25});
        if (is_sphere) b.shapes[0].kind = Shape::Kind::Sphere, b.shapes[0].radius = 0.25;
        add_body(m, b);
        if (floor == Floor::Plane) {
          Body plane;
          plane.fixed = true;
          plane.shapes.resize(1);
          plane.shapes[0].kind = Shape::Kind::Plane;
          add_body(m, plane);
        }
        if (floor == Floor::Body) add_body(m, test::make_box("floor", 1, {0.25, 0.25, 0.25}, {0, 0, -2}));
        if (floor == Floor::Body) m.gravity = {}, m.bodies[0].v_WB.z = -4.5;
        Event replace;
        replace.time = 0.2;
        // of the body against the other one, which is thrown to 2/3 of its speed
        replace.triggers = {{{Quantity::Kind::Velocity, 0}, 2, floor == Floor::Body ? -3.1 : -0.1, true}};
        for (int i = 0; i < times; ++i) {
          Action a;
          a.kind = Action::Kind::ReplaceBody;
          a.body = {0};
          a.replacement = b;
          a.replacement.X_WB = {};
          replace.actions.push_back(a);
        }
        m.events = {replace};
        Options o;
        o.duration = 0.8, o.equilibrium = false, o.frame_interval = 1e-3;
        Energy e;
        double most = 0;
        o.on_frame = [&](const View& v) {
          e = v.energy;
          most = std::max(most, e.removed);
        };
        const Summary s = run(m, o);
        EXPECT_GT(most, 4) << s.message;
        EXPECT_LT(std::abs(e.residual), 0.01 * most) << static_cast<int>(floor) << is_sphere << times;
      }
}

TEST(GroundBox, TellsWhatABodyBringsToTheGround) {
  for (const bool any_shapes : {false, true}) {
    Model m;
    m.contact.bodies = any_shapes;
    const double fall[] = {1, 2};
    for (int i = 0; i < 2; ++i) {
      Body b = test::make_box("b", 100.0 + 50 * i, {0.5, 0.4, 0.3}, {20.0 * i, 3, 0.3 + fall[i]});
      b.v_WB = {2, 0, 0};
      b.w_WB = {0, 0, 3};
      add_body(m, b);
    }
    Options o = make_options();
    o.duration = 1;
    std::vector<Happening> landed;
    o.on_happening = [&](const Happening& h) {
      if (h.kind == Happening::Kind::GroundContact) landed.push_back(h);
    };
    EXPECT_EQ(run(m, o).ending, Summary::Ending::TimeLimit);
    ASSERT_EQ(landed.size(), 2U);
    const Landing& first = landed[0].landing;
    EXPECT_EQ(landed[0].index, 0);
    const double g = norm(m.gravity), t = std::sqrt(2 * fall[0] / g), thrown[] = {0.5 * 100 * 4, 0.5 * 150 * 4};
    const auto turning = [&](size_t i) { return 0.5 * m.bodies[i].inertia.m[2][2] * 9; };
    const double own = 100 * g * fall[0] + thrown[0] + turning(0);
    EXPECT_NEAR(landed[0].time, t, 2 * o.step);
    EXPECT_NEAR(first.p_WB.x, 2 * t, 4 * o.step);
    EXPECT_NEAR(first.momentum, 100 * g * t, 100 * g * o.step);
    EXPECT_NEAR(first.energy, own, 100 * g * g * t * o.step);
    EXPECT_NEAR(first.kinetic, own + 150 * g * fall[0] + thrown[1] + turning(1), 250 * g * g * t * o.step);
    // the other one has come to lie meanwhile, or slides
    EXPECT_NEAR(landed[1].landing.momentum, 150 * std::sqrt(2 * g * fall[1]), 150 * g * o.step);
    EXPECT_LT(landed[1].landing.kinetic - landed[1].landing.energy, own);
  }
}

}  // namespace
}  // namespace topple::mbs
