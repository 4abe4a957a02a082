// Polyhedra and planes in motion.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "mbs/contact_law.h"
#include "mbs/polyhedra.h"
#include "models.h"

namespace topple::mbs {
namespace {

constexpr double kPi = 3.14159265358979323846;

Shape make_shape(Shape::Kind kind) {
  Shape s;
  s.kind = kind;
  return s;
}

/// The corners of a box as a polyhedron.
Shape make_hull_box(const Vec3& half) {
  Shape s = make_shape(Shape::Kind::Hull);
  for (int i = 0; i < 8; ++i)
    s.vertices.push_back({i & 1 ? half.x : -half.x, i & 2 ? half.y : -half.y, i & 4 ? half.z : -half.z});
  return s;
}

Options options_for(double duration) {
  Options o;
  o.duration = duration;
  o.equilibrium = false;
  o.frame_interval = 0.01;
  return o;
}

TEST(HullPhysics, SlidesDownAPlaneAsABoxDoes) {
  // a plane shape of 30 degrees, friction 0.3: a = g (sin 30 - 0.3 cos 30)
  const double slope = kPi / 6, expected = 9.81 * (std::sin(slope) - 0.3 * std::cos(slope));
  for (const bool hull : {false, true}) {
    Model m;
    m.contact.ground = false;
    m.contact.body_friction = 0.3;
    m.contact.contact_frequency = 2000;
    Body plane;
    plane.name = "slope";
    plane.fixed = true;
    plane.X_WB.q = exp_rotation({0, slope, 0});
    plane.shapes = {make_shape(Shape::Kind::Plane)};
    add_body(m, plane);
    const Vec3 half{0.5, 0.5, 0.1};
    Body b = test::make_box("block", 100, half, to_matrix(plane.X_WB.q) * Vec3{0, 0, 0.1});
    b.X_WB.q = plane.X_WB.q;
    if (hull) b.shapes = {make_hull_box(half)};
    add_body(m, b);
    Vec3 v;
    Options o = options_for(1);
    o.on_frame = [&](const View& view) { v = view.v_WB[1]; };
    const Summary s = run(m, o);
    EXPECT_NEAR(norm(v), expected * s.time, 1e-2 * expected) << hull;  // it settles within the first centimetre
    EXPECT_LT(v.z, 0);
    EXPECT_LT(s.energy_error, 1e-3);
  }
}

TEST(HullPhysics, HoldsAStackOfWedgesAndBoxes) {
  // roof-shaped pieces upside down in each other, a box below, a tetrahedron on top
  Model m;
  m.contact.friction = m.contact.body_friction = 0.8;
  m.contact.contact_frequency = 600;
  add_body(m, test::make_box("box", 1000, {1, 1, 0.25}, {0, 0, 0.25}));
  const auto make_prism = [](const std::string& name, bool upright, double z) {
    Body b = test::make_box(name, 500, {1, 1, 0.25}, {0, 0, z});
    Shape s = make_shape(Shape::Kind::Hull);
    for (const double y : {-1.0, 1.0})
      for (const double x : {-1.0, 1.0}) {
        s.vertices.push_back({upright ? x : 0.6 * x, y, -0.25});
        s.vertices.push_back({upright ? 0.6 * x : x, y, 0.25});
      }
    b.shapes = {s};
    return b;
  };
  add_body(m, make_prism("foot", true, 0.75));
  add_body(m, make_prism("head", false, 1.25));
  std::vector<Vec3> start, end;
  double fastest = 0;
  Options o = options_for(5);
  o.on_frame = [&](const View& view) {
    end.clear();
    fastest = 0;
    for (size_t b = 0; b < view.X_WB.size(); ++b) {
      end.push_back(view.X_WB[b].p);
      fastest = std::max(fastest, norm(view.v_WB[b]));
    }
    if (start.empty()) start = end;
  };
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::TimeLimit);
  // it sinks by the contacts' own springs alone: 2000 kg on four corners of 1000 kg (600 rad/s)²
  for (size_t b = 0; b < end.size(); ++b) EXPECT_LT(norm(end[b] - start[b]), 2e-3) << b;
  EXPECT_LT(fastest, 1e-3);
}

TEST(HullPhysics, BouncesLikeABoxAndLandsOnItsCorners) {
  // the same drop with a box and with the polyhedron of its corners, on the ground and on a plane shape
  std::vector<double> heights;
  for (const int variant : {0, 1, 2}) {
    Model m;
    m.contact.restitution = m.contact.body_restitution = 0.5;
    m.contact.friction = m.contact.body_friction = 0.4;
    m.contact.contact_frequency = 1000;
    if (variant == 2) {
      m.contact.ground = false;
      Body plane;
      plane.name = "floor";
      plane.fixed = true;
      plane.shapes = {make_shape(Shape::Kind::Plane)};
      add_body(m, plane);
    }
    const Vec3 half{0.4, 0.3, 0.2};
    Body b = test::make_box("block", 100, half, {0, 0, 2});
    b.X_WB.q = exp_rotation({0.3, 0.2, 0.1});
    if (variant > 0) b.shapes = {make_hull_box(half)};
    add_body(m, b);
    Options o = options_for(0.75);
    double z = 0;
    o.on_frame = [&](const View& view) { z = view.X_WB.back().p.z; };
    const Summary s = run(m, o);
    EXPECT_LT(s.energy_error, 1e-2);
    heights.push_back(z);
  }
  EXPECT_NEAR(heights[1], heights[0], 1e-6);
  // a plane shape is stiffer by nothing, but its contacts are those of bodies
  EXPECT_NEAR(heights[2], heights[0], 2e-2);
}

TEST(HullPhysics, StandsOnAFaceOfManyCornersAsABoxOnFour) {
  // a drum of 20 corners sinks in by g / (4 mean ω²), and so does it on a plane shape and on a box
  const double mean = make_contact_law(0.1, 0).mean;
  Shape drum = make_shape(Shape::Kind::Hull);
  for (int i = 0; i < 20; ++i)
    for (const double z : {-0.3, 0.3})
      drum.vertices.push_back({0.5 * std::cos(kPi * i / 10), 0.5 * std::sin(kPi * i / 10), z});
  for (const int variant : {0, 1, 2}) {
    Model m;
    m.contact.ground = variant == 0;
    Body floor = test::make_box("floor", 1, {2, 2, 0.5}, {0, 0, -0.5});
    floor.fixed = true;
    if (variant == 1) {
      floor.X_WB.p = {};
      floor.shapes = {make_shape(Shape::Kind::Plane)};
    }
    if (variant > 0) add_body(m, floor);
    Body b = test::make_box("drum", 200, {0.45, 0.45, 0.3}, {0, 0, 0.3});
    b.shapes = {drum};
    add_body(m, b);
    double z = 0;
    Options o = options_for(1);
    o.on_frame = [&](const View& view) { z = view.X_WB.back().p.z; };
    (void)run(m, o);
    EXPECT_NEAR(z, 0.3 - 9.81 / (4 * mean * 1500 * 1500), 1e-9) << variant;
  }
}

TEST(HullPhysics, WhatOverlapsTouches) {
  // irregular bodies, pushed together until some axis says that they overlap by a millimetre: all have points
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  const auto direction = [&] {
    const Vec3 d{normal(random), normal(random), normal(random)};
    return (1 / norm(d)) * d;
  };
  int pairs = 0;
  for (const int corners : {4, 6, 8, 12, 20})
    for (int pair = 0; pair < 60; ++pair) {
      Shape shape[2];
      for (Shape& s : shape) {
        s = make_shape(Shape::Kind::Hull);
        for (int i = 0; i < corners; ++i) {
          const Vec3 d = direction();
          s.vertices.push_back({0.3 * d.x, 0.25 * d.y, 0.2 * d.z});
        }
      }
      const Hull hulls[2] = {make_hull(shape[0].vertices), make_hull(shape[1].vertices)};
      const Vec3 way = direction();
      const Mat3 R_a = to_matrix(exp_rotation(normal(random) * direction())),
                 R_b = to_matrix(exp_rotation(normal(random) * direction()));
      const auto find_points = [&](double apart, double& gap) {
        Solid a, b;
        a.kind = b.kind = Shape::Kind::Hull;
        a.R = R_a, b.R = R_b, b.p = apart * way;
        a.hull = &hulls[0], b.hull = &hulls[1];
        int remembered = -1;
        BoxContact out;
        hull_hull(a, b, remembered, out);
        gap = out.gap;
        return out.count;
      };
      double near = 0, far = 1, gap = 0;
      while (far - near > 1e-6) {
        const double middle = 0.5 * (near + far);
        find_points(middle, gap);
        (gap > 0 ? far : near) = middle;
      }
      const int count = find_points(near - 1e-3, gap);
      if (gap > 0) continue;  // the bodies do not hold their origins
      ++pairs;
      EXPECT_GT(count, 0) << corners << " " << pair;
    }
  EXPECT_GT(pairs, 250);
}

TEST(HullPhysics, AColumnOfStonesRoundedToMillimetresStands) {
  // boxes of 0.4 m whose corners are off by up to half a millimetre
  std::mt19937 random(3);
  std::uniform_real_distribution<double> off(-5e-4, 5e-4);
  Model m;
  for (int i = 0; i < 3; ++i) {
    Body b = test::make_box("stone " + std::to_string(i), 100, {0.2, 0.2, 0.2}, {0, 0, 0.2 + 0.4015 * i});
    Shape s = make_hull_box({0.2, 0.2, 0.2});
    for (Vec3& v : s.vertices) v += {off(random), off(random), off(random)};
    b.shapes = {s};
    add_body(m, b);
  }
  Options o = options_for(3);
  Vec3 top;
  o.on_frame = [&](const View& view) { top = view.X_WB[2].p; };
  const Summary s = run(m, o);
  EXPECT_NEAR(top.z, 1.0, 4e-3);
  EXPECT_LT(std::hypot(top.x, top.y), 4e-3);
  EXPECT_LT(s.energy_error, 1e-2);
}

TEST(PlanePhysics, ADrumOfManyCornersStandsOnAllOfThem) {
  // an upright drum of 64 corners that spins about its axis on a plane shape: friction turns it about that axis alone
  Model m;
  m.contact.ground = false;
  m.contact.body_friction = 0.4;
  Body plane;
  plane.name = "floor";
  plane.fixed = true;
  plane.shapes = {make_shape(Shape::Kind::Plane)};
  add_body(m, plane);
  Body drum = test::make_box("drum", 100, {0.2, 0.2, 0.1}, {0, 0, 0.1});
  Shape s = make_shape(Shape::Kind::Hull);
  for (int i = 0; i < 64; ++i)
    for (const double z : {-0.1, 0.1})
      s.vertices.push_back({0.2 * std::cos(2 * kPi * i / 64), 0.2 * std::sin(2 * kPi * i / 64), z});
  drum.shapes = {s};
  drum.w_WB = {0, 0, 5};
  add_body(m, drum);
  Options o = options_for(0.3);
  Vec3 w, v;
  o.on_frame = [&](const View& view) { w = view.w_WB[1], v = view.v_WB[1]; };
  run(m, o);
  EXPECT_LT(w.z, 5);
  EXPECT_LT(std::hypot(w.x, w.y), 1e-6);
  EXPECT_LT(norm(v), 1e-6);
}

}  // namespace
}  // namespace topple::mbs
