// Piles: many boxes dropped into a pit come to rest without gaining energy or sinking through each other or the ground.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "mbs/boxes.h"
#include "models.h"

namespace topple::mbs {
namespace {

/// n boxes of different sizes, turned at random, in layers above a pit of `width` between four walls; numbered as
/// `order` says, the walls last.
Model make_pile(int n, double width, const std::vector<int>& order) {
  Model m;
  m.contact.friction = m.contact.body_friction = 0.5;
  m.contact.restitution = m.contact.body_restitution = 0.1;
  m.contact.contact_frequency = 500;
  std::mt19937 random(20);
  std::uniform_real_distribution<double> unit(-1, 1);
  const int across = static_cast<int>(width / 0.9);
  std::vector<Body> bodies;
  for (int i = 0; i < n; ++i) {
    const int layer = i / (across * across), cell = i % (across * across);
    const Vec3 half{0.2 + 0.05 * unit(random), 0.2 + 0.05 * unit(random), 0.2 + 0.05 * unit(random)};
    const Vec3 p{0.9 * (cell % across - 0.5 * (across - 1)), 0.9 * (cell / across - 0.5 * (across - 1)),
                 0.6 + 0.9 * layer};
    Body b = test::make_box("b" + std::to_string(i), 2400 * 8 * half.x * half.y * half.z, half, p);
    b.X_WB.q = exp_rotation({unit(random), unit(random), unit(random)});
    bodies.push_back(b);
  }
  for (const int i : order) add_body(m, bodies[static_cast<size_t>(i)]);
  for (const double side : {-1.0, 1.0})
    for (const bool along_x : {false, true}) {
      const double at = side * (0.5 * width + 0.55);
      Body wall = test::make_box("wall", 1, along_x ? Vec3{0.5, 0.5 * width + 1, 3} : Vec3{0.5 * width + 1, 0.5, 3},
                                 along_x ? Vec3{at, 0, 3} : Vec3{0, at, 3});
      wall.fixed = true;
      add_body(m, wall);
    }
  return m;
}

struct Pile {
  Summary summary;
  double released = 0, residual = 0;             // [J]
  double kinetic = 0, before = 0;                // at the end, and largest gain of mechanical energy between frames [J]
  double lowest = 1e9, height = 0, deepest = 0;  // of a corner; of the mass centre; of two boxes in each other [m]
  double reach = 0;                              // root mean square of the places across [m]
};

Pile drop(const Model& m, double duration, double step = 0) {
  Pile pile;
  Options o;
  o.duration = duration;
  o.step = step;
  o.equilibrium = false;
  o.frame_interval = 0.05;
  double last = 1e300;
  View end;
  o.on_frame = [&](const View& v) {
    // nothing adds to what the boxes have and store
    const double mechanical = v.energy.kinetic + v.energy.gravity + v.energy.contact;
    if (last < 1e299) pile.before = std::max(pile.before, mechanical - last);
    last = mechanical;
    pile.residual = std::max(pile.residual, std::abs(v.energy.residual));
    pile.released = v.energy.released;
    pile.kinetic = v.energy.kinetic;
    end = v;
  };
  pile.summary = run(m, o);
  double mass = 0;
  std::vector<Solid> solids;
  for (size_t b = 0; b < m.bodies.size() && !m.bodies[b].fixed; ++b) {
    const Mat3 R = to_matrix(end.X_WB[b].q);
    const Vec3 p = end.X_WB[b].p, h = m.bodies[b].shapes[0].half;
    pile.lowest =
        std::min(pile.lowest, p.z - std::abs(R(2, 0)) * h.x - std::abs(R(2, 1)) * h.y - std::abs(R(2, 2)) * h.z);
    pile.height += end.mass[b] * p.z;
    pile.reach += end.mass[b] * (p.x * p.x + p.y * p.y);
    mass += end.mass[b];
    Solid s;
    s.p = p;
    s.R = R;
    s.half = h;
    s.reach = norm(h);
    solids.push_back(s);
  }
  pile.height /= mass;
  pile.reach = std::sqrt(pile.reach / mass);
  for (size_t i = 0; i < solids.size(); ++i)
    for (size_t k = 0; k < i; ++k) {
      if (norm(solids[i].p - solids[k].p) > solids[i].reach + solids[k].reach) continue;
      int axis = 0;
      BoxContact points;
      find_contact(solids[i], solids[k], axis, points);
      for (int c = 0; c < points.count; ++c) pile.deepest = std::max(pile.deepest, points.depth[c]);
    }
  return pile;
}

std::vector<int> in_order(int n) {
  std::vector<int> order(static_cast<size_t>(n));
  std::iota(order.begin(), order.end(), 0);
  return order;
}

void check_pile(const Pile& pile, double mass, double drop_height) {
  ASSERT_EQ(pile.summary.ending, Summary::Ending::TimeLimit) << pile.summary.message;
  EXPECT_LT(pile.residual, 0.01 * pile.released);
  // between two frames the residual alone could add something
  EXPECT_LT(pile.before, 0.01 * pile.released);
  // at rest: a mean speed of 5 cm/s
  EXPECT_LT(pile.kinetic, 0.5 * mass * 0.05 * 0.05);
  // penetrations are those of the springs under the weight of the boxes above, g/ω² for each
  EXPECT_GT(pile.lowest, -0.02);
  EXPECT_LT(pile.deepest, 0.03);
  EXPECT_GT(pile.released, 0.3 * mass * 9.81 * drop_height);
}

double mass_of(const Model& m) {
  double mass = 0;
  for (const Body& b : m.bodies)
    if (!b.fixed) mass += b.mass;
  return mass;
}

TEST(PilePhysics, HundredBoxesComeToRest) {
  const Model m = make_pile(100, 2.8, in_order(100));
  const Pile pile = drop(m, 6);
  check_pile(pile, mass_of(m), 4);
}

TEST(PilePhysics, DoesNotDependOnTheOrderOfTheBodies) {
  // a blow in free space: the same to round-off
  std::vector<Vec3> speeds;
  for (const bool swapped : {false, true}) {
    Model m = make_pile(2, 0.9, swapped ? std::vector<int>{1, 0} : std::vector<int>{0, 1});
    m.bodies.resize(2);
    m.gravity = {};
    m.contact.ground = false;
    Body &low = m.bodies[swapped ? 1 : 0], &high = m.bodies[swapped ? 0 : 1];
    low.X_WB.p = {0, 0, 2};
    high.X_WB.p = {0.1, 0.05, 2.8};
    high.v_WB = {0, 0, -3};
    Options o;
    o.duration = 0.3;
    o.equilibrium = false;
    o.step = 2e-4;
    Vec3 v;
    o.on_frame = [&](const View& view) { v = view.v_WB[swapped ? 1 : 0]; };
    (void)run(m, o);
    speeds.push_back(v);
  }
  EXPECT_GT(norm(speeds[0]), 0.5);
  EXPECT_LT(norm(speeds[0] - speeds[1]), 1e-12);
  // one box falls on another and both on the ground: the contacts of a step see each other's forces in an order
  std::vector<double> heights;
  for (const std::vector<int>& order : {std::vector<int>{0, 1}, std::vector<int>{1, 0}}) {
    Model m = make_pile(2, 0.9, order);
    for (size_t b = 0; b < 2; ++b) m.bodies[b].X_WB.p.x = m.bodies[b].X_WB.p.y = 0;
    heights.push_back(drop(m, 0.6, 1e-4).height);
  }
  EXPECT_NEAR(heights[0], heights[1], 1e-9);
  // a pile is chaotic: its mass centre and spread, in three orders, scatter no more than with the step
  std::vector<int> turned = in_order(60), mixed = turned;
  std::reverse(turned.begin(), turned.end());
  std::shuffle(mixed.begin(), mixed.end(), std::mt19937(5));
  const auto scatter_of = [](const std::vector<Pile>& piles, double Pile::*what) {
    double least = 1e9, most = 0;
    for (const Pile& p : piles) least = std::min(least, p.*what), most = std::max(most, p.*what);
    return most - least;
  };
  std::vector<Pile> orders, steps;
  for (const std::vector<int>& order : {in_order(60), turned, mixed})
    orders.push_back(drop(make_pile(60, 1.9, order), 4));
  for (const double step : {0.0, 3e-4, 2e-4, 1.5e-4}) steps.push_back(drop(make_pile(60, 1.9, in_order(60)), 4, step));
  for (double Pile::*what : {&Pile::height, &Pile::reach}) {
    const double mean = orders[0].*what;
    EXPECT_LT(scatter_of(orders, what), 2 * scatter_of(steps, what) + 0.02 * mean);
    EXPECT_LT(scatter_of(orders, what), 0.15 * mean);
  }
}

TEST(PilePhysicsSlow, ThousandBoxesComeToRest) {
  const Model m = make_pile(1000, 7.5, in_order(1000));
  const Pile pile = drop(m, 8);
  check_pile(pile, mass_of(m), 7);
}

}  // namespace
}  // namespace topple::mbs
