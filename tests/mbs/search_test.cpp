// Which shapes are near each other.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <utility>

#include "mbs/snapshot.h"
#include "mbs/system.h"
#include "models.h"

namespace topple::mbs {
namespace {

/// A wall of 5 x 4 blocks, linked to their neighbours by brittle elements, that falls on a step which carries one half
/// of it: links break one by one while bodies that they held together are pressed against each other.
Model make_wall() {
  constexpr int columns = 5, rows = 4;
  Model m;
  ZoneLaw law;
  law.shear_y = law.shear_z = 3e4;
  law.tension = {{0, 1}, {3e4, 3e4}};
  law.slip_rupture = law.rupture_elongation = 1e-3;
  law.torsion = 1e6;
  const LawId brittle = add_law(m, law);
  const Vec3 half{0.25, 0.2, 0.25};
  const auto place = [&](int i, int k) { return Vec3{0.5 * i, 0, 1.5 + 0.5 * k}; };
  for (int k = 0; k < rows; ++k)
    for (int i = 0; i < columns; ++i) add_body(m, test::make_box("", 240, half, place(i, k)));
  const auto link = [&](int a, int b, const Vec3& from_a) {
    ZoneElement e;
    e.a = {a};
    e.b = {b};
    e.X_AF.p = from_a;
    e.X_BM.p = -from_a;
    if (from_a.z > 0) e.X_AF.q = e.X_BM.q = test::upright();
    e.translational_stiffness = {2e8, 1e8, 1e8};
    e.rotational_stiffness = {1e6, 1e6, 1e6};
    e.stations = {{0, brittle}};
    add_element(m, e);
  };
  for (int k = 0; k < rows; ++k)
    for (int i = 0; i < columns; ++i) {
      if (i + 1 < columns) link(k * columns + i, k * columns + i + 1, {0.25, 0, 0});
      if (k + 1 < rows) link(k * columns + i, (k + 1) * columns + i, {0, 0, 0.25});
    }
  Body step = test::make_box("step", 1, {1, 1, 0.5}, {-0.6, 0, 0.5});
  step.fixed = true;
  add_body(m, step);
  return m;
}

using ShapePair = std::pair<int, int>;

/// Pairs that overlap by more than `depth` and whose bodies nothing joins, found by looking at all of them.
std::set<ShapePair> find_overlaps(const System& s, double depth) {
  std::vector<std::set<int>> links(s.B);
  for (size_t e = 0; e < s.elements.size(); ++e)
    if (s.state.element[e].live) {
      links[static_cast<size_t>(s.elements[e].a)].insert(s.elements[e].b);
      links[static_cast<size_t>(s.elements[e].b)].insert(s.elements[e].a);
    }
  const auto are_joined = [&](size_t a, size_t b) {
    return links[a].contains(static_cast<int>(b)) ||
           std::any_of(links[a].begin(), links[a].end(), [&](int c) { return links[b].contains(c); });
  };
  const auto solid_of = [&](size_t b) {
    const CompiledShape& shape = s.state.shapes[b];  // each body has one, in its own axes
    Solid solid;
    solid.p = s.state.p[b];
    solid.R = s.state.R[b];
    solid.half = shape.half;
    solid.reach = shape.reach;
    return solid;
  };
  std::set<ShapePair> out;
  for (size_t a = 0; a < s.B; ++a)
    for (size_t b = a + 1; b < s.B; ++b) {
      if (are_joined(a, b)) continue;
      BoxContact points;
      int axis = 0;
      find_contact(solid_of(a), solid_of(b), axis, points);
      if (points.count > 0 && *std::max_element(points.depth, points.depth + points.count) > depth)
        out.emplace(static_cast<int>(a), static_cast<int>(b));
    }
  return out;
}

TEST(Search, MissesNoPairWhereLinksEnd) {
  Options o;
  o.equilibrium = false;
  o.step = 2e-4;
  System s(make_wall(), o);
  s.start();
  int overlaps = 0, releases = 0, searches = 0;
  for (int i = 0; i < 5000; ++i) {
    const size_t held = s.state.held_pairs.size(), pairs = s.state.pairs.size();
    s.contact.search.found.assign(1, 0);  // a search overwrites it
    ASSERT_TRUE(s.advance_step());
    const bool searched = s.contact.search.found != std::vector<std::uint64_t>{0};
    searches += searched ? 1 : 0;
    if (!searched && s.state.held_pairs.size() < held) {
      ++releases;
      EXPECT_EQ(s.state.pairs.size() - pairs, held - s.state.held_pairs.size());
    }
    std::set<ShapePair> known;
    for (const PairDue& p : s.state.pair_due) known.insert(std::minmax(p.shape_a, p.shape_b));
    EXPECT_EQ(known.size(), s.state.pair_due.size()) << "a pair counts twice at " << i;
    const std::set<ShapePair> touching = find_overlaps(s, 1e-9);
    overlaps += static_cast<int>(touching.size());
    for (const ShapePair& p : touching)
      ASSERT_TRUE(known.contains(p)) << p.first << " and " << p.second << " at step " << i;
  }
  EXPECT_GT(overlaps, 5000);
  EXPECT_GT(releases, 5);
  EXPECT_LT(searches, 200);  // breaks alone ask for none
}

TEST(Search, WhatHangsOnAFixedBodyMeetsAsOnTheGround) {
  // two balls of one mass on rods of 1 m, side by side: one falls against the other
  const auto swing_of = [](bool on_beam) {
    Model m;
    m.contact.ground = false;
    m.contact.body_restitution = 1;
    m.contact.body_friction = 0;
    Shape ball;
    ball.kind = Shape::Kind::Sphere;
    ball.radius = 0.1;
    Body beam;
    beam.name = "beam";
    beam.X_WB.p = {0, 0, 2};
    beam.fixed = true;
    const BodyId held = on_beam ? add_body(m, beam) : kGround;
    for (const double angle : {0.5, 0.0}) {
      Body b;
      b.inertia = Mat3::diagonal({0.004, 0.004, 0.004});
      const double x = angle > 0 ? 0 : -0.2;  // of the hinge
      b.X_WB.p = {x + std::sin(angle), 0, 2 - std::cos(angle)};
      b.shapes.push_back(ball);
      const BodyId id = add_body(m, b);
      Joint j;
      j.kind = Joint::Kind::Distance;
      j.parent = held;
      j.child = id;
      j.X_PF.p = on_beam ? Vec3{x, 0, 0} : Vec3{x, 0, 2};
      add_joint(m, j);
    }
    double farthest = 0;
    Options o;
    o.duration = 1.2;
    o.equilibrium = false;
    o.on_frame = [&](const View& v) { farthest = std::min(farthest, v.X_WB.back().p.x + 0.2); };
    (void)run(m, o);
    return -farthest;
  };
  EXPECT_NEAR(swing_of(true), std::sin(0.5), 0.02);
  EXPECT_NEAR(swing_of(true), swing_of(false), 1e-9);
}

TEST(Search, EndsWhereABodyIsNowhere) {
  for (const double nowhere : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    Options o;
    o.equilibrium = false;
    System s(make_wall(), o);
    s.start();
    for (const size_t b : {3, 7, 11}) s.state.p[b] = Vec3{1.5, nowhere, 0};
    s.find_pairs();
    for (const size_t b : {3, 7, 11}) s.state.p[b] = Vec3{nowhere, 0, 0};
    s.find_pairs();
    EXPECT_FALSE(s.advance_step());
  }
}

TEST(SearchReplay, GoesOnWithTheSameBitsWherePairsAreHeld) {
  Options o;
  o.equilibrium = false;
  o.step = 2e-4;
  constexpr int first = 1000, every = 20, last = 2000;
  const Model m = make_wall();
  System whole(m, o), other(m, o);
  whole.start();
  std::vector<std::vector<std::byte>> kept;
  const size_t live = whole.state.live_elements;
  for (int i = 0; i < last; ++i) {
    if (i >= first && i % every == 0) kept.push_back(write_snapshot(whole));
    ASSERT_TRUE(whole.advance_step());
  }
  ASSERT_LT(whole.state.live_elements, live);
  for (size_t k = 0; k < kept.size(); ++k) {
    read_snapshot(kept[k], other);
    for (int i = first + every * static_cast<int>(k); i < last; ++i) ASSERT_TRUE(other.advance_step());
    EXPECT_EQ(test::hash_of(whole.calc_view()), test::hash_of(other.calc_view())) << k;
  }
}

}  // namespace
}  // namespace topple::mbs
