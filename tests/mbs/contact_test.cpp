// Contact with the ground and between bodies.
#include <gtest/gtest.h>

#include "mbs/contact_law.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;

Options free_options(double duration, double step) {
  Options o;
  o.duration = duration;
  o.step = step;
  o.equilibrium = false;
  o.frame_interval = step;
  return o;
}

/// A flat box on a plane that slopes by 30° along x.
Model make_slope(double friction) {
  const double a = 3.14159265358979323846 / 6;
  Model m;
  m.contact.normal = {std::sin(a), 0, std::cos(a)};
  m.contact.friction = friction;
  Body b = make_box("box", 100, {1, 1, 0.05}, 0.05 * m.contact.normal);
  b.X_WB.q = exp_rotation({0, a, 0});
  add_body(m, b);
  return m;
}

TEST(GroundContact, BoxAtRestStaysAtRestOnASlopeItsFrictionHolds) {
  const Model m = make_slope(0.7);  // tan 30° = 0.577
  Vec3 early, late;
  Options o = free_options(3, 2e-4);
  o.on_frame = [&](const View& v) {
    if (v.time < 1) early = v.X_WB[0].p;
    late = v.X_WB[0].p;
  };
  (void)run(m, o);
  EXPECT_LT(norm(late - early), 1e-7);
}

TEST(GroundContact, FollowsTheRulesOfAPair) {
  // the first passes through, the second slides as on ice, the third sinks in by its own stiffness
  Model m;
  for (int i = 0; i < 3; ++i) add_body(m, make_box("b" + std::to_string(i), 100, {0.2, 0.2, 0.1}, {2.0 * i, 0, 0.1}));
  m.bodies[1].v_WB = {1, 0, 0};
  Contact::Pair p;
  p.a = {0};
  p.b = kGround;
  p.touches = false;
  m.contact.pairs.push_back(p);
  p.touches = true;
  p.a = {1};
  p.friction = 0;
  m.contact.pairs.push_back(p);
  p.a = {2};
  p.stiffness = 1e6;
  p.damping = 2e4;
  m.contact.pairs.push_back(p);
  Options o = free_options(1, 1e-4);
  View last;
  o.on_frame = [&](const View& v) { last = v; };
  (void)run(m, o);
  EXPECT_NEAR(last.X_WB[0].p.z, 0.1 - 0.5 * 9.81, 1e-3);  // first step's half
  EXPECT_NEAR(last.v_WB[1].x, 1, 1e-12);
  EXPECT_NEAR(last.X_WB[2].p.z, 0.1 - 100 * 9.81 / (4 * 1e6), 1e-8);
}

TEST(BodyContact, FollowsTheRulesOfAPair) {
  // two boxes fall onto a fixed slab: one passes through it, the other bounces without loss
  Model m;
  m.contact.ground = false;
  Body slab = make_box("slab", 1, {3, 3, 0.5}, {0, 0, -0.5});
  slab.fixed = true;
  add_body(m, slab);
  for (int i = 0; i < 2; ++i) add_body(m, make_box("b", 100, {0.2, 0.2, 0.2}, {2.0 * i - 1, 0, 1.2}));
  Contact::Pair p;
  p.a = {1};
  p.b = {0};
  p.touches = false;
  m.contact.pairs.push_back(p);
  p.touches = true;
  p.a = {0};
  p.b = {2};
  p.restitution = 1;
  m.contact.pairs.push_back(p);
  Options o = free_options(2 * std::sqrt(2 / 9.81), 2e-5);
  View last;
  o.on_frame = [&](const View& v) { last = v; };
  o.frame_interval = 0.01;
  (void)run(m, o);
  EXPECT_LT(last.X_WB[1].p.z, -2.7);
  EXPECT_NEAR(last.X_WB[2].p.z, 1.2, 2e-3);  // back where it began
}

TEST(BodyContact, OfNeighboursThatOverlapPushesOnlyWhatPenetratesFurther) {
  // a corner of a frame: two members that share it, nothing else
  Model m;
  m.gravity = {};
  add_body(m, make_box("column", 500, {0.2, 0.2, 1}, {0, 0, 0}));
  add_body(m, make_box("beam", 500, {1, 0.2, 0.2}, {1.15, 0.01, 0.9}));
  Options o = free_options(0.5, 1e-4);
  Energy e;
  Vec3 p;
  o.on_frame = [&](const View& v) {
    e = v.energy;
    p = v.X_WB[1].p;
  };
  (void)run(m, o);
  EXPECT_EQ(e.kinetic, 0);
  m.bodies[1].v_WB = {-0.5, 0, 0};  // and is driven in
  (void)run(m, o);
  EXPECT_LT(e.kinetic + e.contact, 0.5 * 500 * 0.25 + 1e-9);
  EXPECT_GT(p.x, 0.8 - 0.15);      // both go on with half the speed and the rest of the rebound
  m.bodies[1].v_WB = {0.5, 0, 0};  // or out
  (void)run(m, o);
  EXPECT_NEAR(e.kinetic, 0.5 * 500 * 0.25, 1e-9);
}

TEST(BodyContact, IsNotBetweenBodiesTiedToTheSameThird) {
  // tall and top are tied to one node, top and low to another; the search meets tall, then low, then tall and top.
  // Each is beside something at its foot, tall beside top at its head
  Model m;
  m.gravity = {};
  m.contact.ground = false;
  const BodyId tall = add_body(m, make_box("tall", 1000, {0.5, 5, 0.5}, {0.5, 5, 0}));
  const BodyId top = add_body(m, make_box("top", 1000, {0.45, 0.5, 0.5}, {0.5, 9.5, 1.02}));
  const BodyId low = add_body(m, make_box("low", 1000, {0.5, 0.5, 0.5}, {3.5, 0.5, 0}));
  add_body(m, make_box("beside tall", 1000, {0.45, 0.5, 0.5}, {0.5, 0.5, 1.02}));
  add_body(m, make_box("beside low", 1000, {0.45, 0.5, 0.5}, {3.5, 0.5, 1.02}));
  const BodyId node = add_body(m, make_box("node", 1000, {0.5, 0.5, 0.5}, {30, 0, 0}));
  const BodyId other = add_body(m, make_box("other node", 1000, {0.5, 0.5, 0.5}, {40, 0, 0}));
  m.bodies[static_cast<size_t>(top.index)].v_WB = {0, 0, -1};
  const auto tie = [&](BodyId a, BodyId b) {
    ZoneElement e;
    e.name = "tie" + std::to_string(m.elements.size());
    e.a = a, e.b = b;
    e.translational_stiffness = e.rotational_stiffness = {1, 1, 1};
    add_element(m, e);
  };
  tie(tall, node), tie(node, top), tie(top, other), tie(other, low);
  for (const bool are_tied : {true, false}) {
    if (!are_tied) m.elements.clear();
    int blows = 0;
    Options o = free_options(0.1, 1e-3);
    o.on_happening = [&](const Happening& h) {
      blows += h.kind == Happening::Kind::BodyContact && h.index == tall.index && h.other == top.index;
    };
    EXPECT_EQ(run(m, o).ending, Summary::Ending::TimeLimit);
    EXPECT_EQ(blows, are_tied ? 0 : 1);
  }
}

TEST(BodyContact, StackStaysAndLosesNoHeight) {
  Model m;
  for (int i = 0; i < 4; ++i)
    add_body(m, make_box("b" + std::to_string(i), 500, {0.5, 0.5, 0.25}, {0, 0, 0.25 + 0.5 * i}));
  Vec3 top;
  Options o = free_options(3, 2e-4);
  double fastest = 0;
  o.on_frame = [&](const View& v) {
    top = v.X_WB[3].p;
    fastest = 0;
    for (const Vec3& u : v.v_WB) fastest = std::max(fastest, norm(u));
  };
  const Summary s = run(m, o);
  const double rate = make_contact_law(0.1, 0).mean * 4 * 500 * 1500 * 1500;  // of all corners on the ground
  EXPECT_NEAR(top.z, 1.75 - 500 * 9.81 * (4 + 2 * 3 + 2 * 2 + 2 * 1) / rate, 1e-7);
  EXPECT_LT(fastest, 1e-5);
  EXPECT_LT(std::hypot(top.x, top.y), 1e-6);
  (void)s;
}

TEST(BodyContact, BoxSticksOnATiltedBoxThatFrictionHolds) {
  // the lower box is fixed and leans by 25°, tan = 0.466 against a friction of 0.6
  const double a = 25 * 3.14159265358979323846 / 180;
  Model m;
  m.contact.ground = false;
  Body base = make_box("base", 1, {2, 2, 0.5}, {});
  base.fixed = true;
  base.X_WB.q = exp_rotation({0, a, 0});
  Body box = make_box("box", 500, {0.3, 0.3, 0.2}, 0.7 * Vec3{std::sin(a), 0, std::cos(a)});
  box.X_WB.q = base.X_WB.q;
  add_body(m, base);
  add_body(m, box);
  Vec3 early, late;
  Options o = free_options(4, 2e-4);
  o.on_frame = [&](const View& v) {
    if (v.time < 1) early = v.X_WB[1].p;
    late = v.X_WB[1].p;
  };
  (void)run(m, o);
  EXPECT_LT(norm(late - early), 1e-4);
  m.contact.body_friction = 0.3;  // and this one slides: a = g (sin - μ cos)
  o.duration = 0.5;
  Vec3 start;
  o.on_frame = [&](const View& v) {
    if (v.time == 0) start = v.X_WB[1].p;
    late = v.X_WB[1].p;
  };
  (void)run(m, o);
  const double expected = 0.5 * 9.81 * (std::sin(a) - 0.3 * std::cos(a)) * 0.25;
  EXPECT_NEAR(norm(late - start), expected, 0.02 * expected);  // the contact settles within a few ms first
}

TEST(BodyContact, ImpactKeepsMomentum) {
  Model m;
  m.gravity = {};
  m.contact.ground = false;
  m.contact.body_restitution = 0.4;
  Body a = make_box("a", 3, {0.5, 0.5, 0.5}, {0, 0, 0}), b = make_box("b", 1, {0.5, 0.5, 0.5}, {1.2, 0.3, 0.2});
  a.v_WB = {2, 0, 0};
  add_body(m, a);
  add_body(m, b);
  Vec3 p, spin;
  double closing = 0;
  Options o = free_options(1, 1e-4);
  o.on_frame = [&](const View& v) {
    p = 3 * v.v_WB[0] + v.v_WB[1];
    spin = {};
    for (size_t i = 0; i < 2; ++i) {
      const Mat3 R = to_matrix(v.X_WB[i].q);
      spin += cross(v.X_WB[i].p, v.mass[i] * v.v_WB[i]) + R * (m.bodies[i].inertia * transpose_times(R, v.w_WB[i]));
    }
    closing = v.v_WB[1].x - v.v_WB[0].x;
  };
  const Summary s = run(m, o);
  EXPECT_NEAR(p.x, 6, 1e-9);
  EXPECT_NEAR(p.y, 0, 1e-9);
  EXPECT_NEAR(spin.z, 0, 1e-9);
  EXPECT_GT(closing, 0);  // they part
  (void)s;
}

TEST(BodyContact, ABlowOnAPairLeftAloneGivesNoEnergyAway) {
  // b rests 2 cm from a, so the pair is left alone for a while; c drives b into a within that time
  Model m;
  m.gravity = {};
  m.contact.ground = false;
  Body a = make_box("a", 50, {0.5, 0.5, 0.5}, {0, 0, 0}), b = make_box("b", 5, {0.2, 0.2, 0.2}, {0.72, 0, 0});
  Body c = make_box("c", 50, {0.5, 0.5, 0.5}, {1.43, 0, 0});
  c.v_WB = {-20, 0, 0};
  add_body(m, a);
  add_body(m, b);
  add_body(m, c);
  Energy e;
  double momentum = 0, overlap = 0;
  Options o = free_options(0.1, 1e-4);
  o.on_frame = [&](const View& v) {
    e = v.energy;
    momentum = 0;
    for (size_t i = 0; i < 3; ++i) momentum += v.mass[i] * v.v_WB[i].x;
    overlap = std::max(overlap, 0.7 - (v.X_WB[1].p.x - v.X_WB[0].p.x));
    EXPECT_LE(e.kinetic + e.contact, 0.5 * 50 * 400 * (1 + 1e-6)) << v.time;
    EXPECT_GE(e.contact_loss, -1e-6 * 0.5 * 50 * 400) << v.time;
  };
  (void)run(m, o);
  EXPECT_GT(overlap, 0.001);  // they did meet
  EXPECT_NEAR(momentum, -1000, 1e-6);
}

TEST(BodyContact, CentralImpactHasItsRestitution) {
  Model m;
  m.gravity = {};
  m.contact.ground = false;
  m.contact.body_restitution = 0.4;
  Body a = make_box("a", 3, {0.5, 0.5, 0.5}, {0, 0, 0}), b = make_box("b", 1, {0.4, 0.4, 0.4}, {1.2, 0, 0});
  a.v_WB = {2, 0, 0};
  add_body(m, a);
  add_body(m, b);
  double parting = 0;
  Energy e;
  Options o = free_options(1, 1e-5);
  o.frame_interval = 0.1;
  o.on_frame = [&](const View& v) {
    parting = v.v_WB[1].x - v.v_WB[0].x;
    e = v.energy;
  };
  (void)run(m, o);
  EXPECT_NEAR(parting, 0.4 * 2, 0.005 * 2);
  // lost: half the reduced mass times (1 - e²) v²
  EXPECT_NEAR(e.contact_loss, 0.5 * 0.75 * (1 - 0.16) * 4, 0.01 * 1.26);
  EXPECT_NEAR(e.residual, 0, 0.01 * 1.26);
}

TEST(BodyContact, WhatLandsOnAFixedBodyGainsNothingWhileTheirOverlapChangesItsShape) {
  // a panel lands on a stump, turns on it and slides off: corners of the overlap come and go
  Model m;
  m.contact.ground = false;
  m.contact.contact_frequency = 250;
  Body stump = make_box("stump", 1000, {0.075, 1.2, 0.2}, {0, 0, 0});
  stump.fixed = true;
  Body panel = make_box("panel", 8000, {0.075, 1.2, 1.25}, {0.05, 0.3, 1.46});
  panel.X_WB.q = exp_rotation({0.02, 0.01, 0.1});
  panel.v_WB = {0.3, 0.2, -3};
  panel.w_WB = {0.1, 0.2, 2};
  add_body(m, stump);
  add_body(m, panel);
  Options o = free_options(0.6, 2e-4);
  double largest = 0;
  o.on_frame = [&](const View& v) { largest = std::max(largest, v.energy.contact); };
  const Summary s = run(m, o);
  EXPECT_GT(largest, 1e4) << "they did meet";
  EXPECT_LT(s.energy_error, 0.01);  // 0.23 without (7) of contact.md
}

TEST(BodyContact, DebrisComesToRest) {
  Model m;
  int n = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) {
        Body b = make_box("d" + std::to_string(n), 300, {0.3, 0.2, 0.15},
                          {0.5 * i + 0.07 * k, 0.5 * j - 0.05 * k, 0.6 + 0.7 * k});
        b.X_WB.q = exp_rotation({0.3 * i, 0.2 * j, 0.5 * k});
        add_body(m, b);
        ++n;
      }
  Options o = free_options(20, 2e-4);
  o.frame_interval = 0.1;
  o.rest_speed = 0.05;
  double lowest = 1e9;
  o.on_frame = [&](const View& v) {
    for (const Pose& X : v.X_WB) lowest = std::min(lowest, X.p.z);
  };
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::AtRest) << s.message;
  EXPECT_GT(lowest, 0.10);  // nobody sinks through: the thinnest half edge is 0.15 m
  EXPECT_LT(s.energy_error, 0.01);
}

TEST(BodyContact, BeginsWhenTheLinkBetweenThemEnds) {
  // two boxes meet while an element joins them and overlap by 0.1 m when it is taken away: from then on they touch
  Model m;
  m.gravity = {};
  m.contact.ground = false;
  add_body(m, make_box("a", 1000, {0.5, 0.5, 0.5}, {0, 0, 0}));
  add_body(m, make_box("b", 1000, {0.5, 0.5, 0.5}, {0, 0, 1.3}));
  m.bodies[1].v_WB.z = -2;
  ZoneElement e;
  e.a = {0};
  e.b = {1};
  e.X_AF.p = {0, 0, 0.65};
  e.X_BM.p = {0, 0, -0.65};
  e.translational_stiffness = {1, 1, 1};
  add_element(m, e);
  m.events.push_back(test::make_event(0.2, Action::Kind::RemoveElement, 0));
  double least = 1e9;
  Options o = free_options(0.3, 2e-4);
  o.on_frame = [&](const View& v) { least = std::min(least, norm(v.X_WB[1].p - v.X_WB[0].p)); };
  (void)run(m, o);
  EXPECT_NEAR(least, 0.9, 0.003);  // at 1500 rad/s they press each other by 1.3 mm
}

/// What the summary notes of bodies that contact did not keep apart.
std::vector<std::string> note_lost_contacts(const Model& m, double duration, double step) {
  Options o = free_options(duration, step);
  o.tells_lost_contact = true;
  return run(m, o).notes;
}

TEST(GroundContact, NotesASetStepThatIsTooLongForIt) {
  Model m;
  add_body(m, make_box("b", 1000, {0.5, 0.5, 0.5}, {0, 0, 0.6}));
  m.contact.contact_frequency = 2000;
  const std::vector<std::string> notes = note_lost_contacts(m, 0.5, 1e-3);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_EQ(
      notes[0],
      "contact swings at up to 1421 rad/s, by 1.4 rad in the set step of 0.001 s: impacts may not keep their energy. "
      "A step below 0.00013 s is short enough; where none is set one is chosen");
  EXPECT_TRUE(note_lost_contacts(m, 0.5, 2e-4).empty());
  EXPECT_TRUE(note_lost_contacts(m, 0.1, 1e-3).empty()) << "it has not come down yet";
  EXPECT_TRUE(note_lost_contacts(m, 0.5, 0).empty()) << "the engine's own step";
}

TEST(BodyContact, NotesWhatOverlapsAtTheStart) {
  Model m;
  add_body(m, make_box("low", 1000, {0.5, 0.5, 0.5}, {0, 0, 0.5}));
  add_body(m, make_box("high", 1000, {0.5, 0.5, 0.5}, {0, 0, 1.3}));
  add_body(m, make_box("highest", 1000, {0.5, 0.5, 0.5}, {0, 0, 2.3}));
  std::vector<std::string> notes = note_lost_contacts(m, 0.01, 2e-4);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_EQ(notes[0],
            "two shapes overlap at the start, those of bodies \"low\" and \"high\" by 0.2 m: contact lets them keep "
            "that until they have parted");
  m.bodies[2].X_WB.p.z = 1.9;
  notes = note_lost_contacts(m, 0.01, 2e-4);
  EXPECT_TRUE(
      notes[0].starts_with("2 pairs of shapes overlap at the start, deepest those of bodies \"high\" and "
                           "\"highest\" by 0.4 m"))
      << notes[0];
  // what touches does not overlap; a corner of what leans reaches below the ground
  m.bodies[1].X_WB.p.z = 1.499, m.bodies[2].X_WB.p.z = 2.5;
  EXPECT_TRUE(note_lost_contacts(m, 0.01, 2e-4).empty());
  m.bodies.resize(1);
  m.bodies[0].X_WB.q = exp_rotation({0, 0.2, 0});
  notes = note_lost_contacts(m, 0.01, 2e-4);
  ASSERT_EQ(notes.size(), 1u);
  const double below = 0.5 * (std::cos(0.2) + std::sin(0.2)) - 0.5;
  EXPECT_TRUE(notes[0].starts_with("a shape reaches below the ground at the start, that of body \"low\" by "))
      << notes[0];
  EXPECT_NEAR(std::stod(notes[0].substr(notes[0].find(" by ") + 4)), below, 1e-3);
}

TEST(BodyContact, NotesABodyThatSinksThroughALightOne) {
  Model m;
  add_body(m, make_box("light", 1, {0.5, 0.5, 0.25}, {0, 0, 0.25}));
  add_body(m, make_box("heavy", 1e5, {0.5, 0.5, 0.5}, {0, 0, 1.0}));
  const std::vector<std::string> notes = note_lost_contacts(m, 0.4, 5e-5);
  // the light one sinks into the ground as well, which is looked at first
  ASSERT_EQ(notes.size(), 2u);
  EXPECT_TRUE(notes[0].starts_with("body \"light\": it has sunk 0.25")) << notes[0];
  // it falls by half of the light one's half metre, hardly held: sqrt(2 * 0.25 / 9.81) = 0.226 s at the least
  EXPECT_TRUE(notes[1].starts_with("bodies \"light\" and \"heavy\": one has sunk 0.25")) << notes[1];
  const double time = std::stod(notes[1].substr(notes[1].find(" at ") + 4));
  EXPECT_GT(time, 0.226);
  EXPECT_LT(time, 0.4);

  m.contact.pairs.push_back({});
  m.contact.pairs[0].a = {0}, m.contact.pairs[0].b = {1}, m.contact.pairs[0].stiffness = 1e8;
  m.contact.pairs.push_back(m.contact.pairs[0]);
  m.contact.pairs[1].b = kGround;
  EXPECT_TRUE(note_lost_contacts(m, 0.4, 2e-6).empty());
  // and nothing is said unless it is asked for
  m.contact.pairs.clear();
  EXPECT_TRUE(run(m, free_options(0.4, 5e-5)).notes.empty());
}

// As between bodies: in the kernel of boxes, and of balls.
TEST(GroundContact, NotesABodyThatSinksIntoTheGround) {
  for (const bool is_ball : {false, true})
    for (const bool is_alone : {false, true}) {
      SCOPED_TRACE(std::string(is_ball ? "ball" : "box") + (is_alone ? ", no contact of bodies" : ""));
      Model m;
      m.gravity = {};
      m.contact.bodies = !is_alone;
      add_body(m, make_box("thing", 10, {0.1, 0.1, 0.1}, {0, 0, 0.3}));
      if (is_ball) m.bodies[0].shapes[0].kind = Shape::Kind::Sphere, m.bodies[0].shapes[0].radius = 0.1;
      // half of 0.2 m is passed where speed / (1500 rad/s), by the points that touch, is more
      m.bodies[0].v_WB.z = -100;
      EXPECT_TRUE(note_lost_contacts(m, 0.02, 1e-5).empty());
      m.bodies[0].v_WB.z = -600;
      const std::vector<std::string> notes = note_lost_contacts(m, 0.02, 1e-5);
      ASSERT_EQ(notes.size(), 1u);
      EXPECT_TRUE(notes[0].starts_with("body \"thing\": it has sunk 0.1")) << notes[0];
      EXPECT_NE(notes[0].find(" into the ground at "), std::string::npos) << notes[0];
      EXPECT_TRUE(run(m, free_options(0.02, 1e-5)).notes.empty());
    }
}

TEST(BodyContact, NotesBodiesThatMayPassBetweenTwoLooks) {
  Model m;
  m.gravity = {};
  m.contact.ground = false;
  Body plate = make_box("plate", 1, {0.02, 2, 2}, {0.5, 0, 5});
  plate.fixed = true;
  add_body(m, plate);
  Body bullet = make_box("bullet", 1, {0.01, 0.01, 0.01}, {-0.025, 0, 5});
  bullet.v_WB = {1000, 0, 0};
  add_body(m, bullet);
  const std::vector<std::string> notes = note_lost_contacts(m, 0.002, 5e-5);
  ASSERT_EQ(notes.size(), 1u);
  EXPECT_TRUE(notes[0].starts_with("bodies \"plate\" and \"bullet\": they move 0.05 m against each other")) << notes[0];
  // that flies by at a distance of more than it moves
  m.bodies[1].X_WB.p.y = 2.2;
  EXPECT_TRUE(note_lost_contacts(m, 0.002, 5e-5).empty());
}

TEST(OverlapNotes, AHullThatLiesAboveItsOriginReachesNotDownToIt) {
  Model m;
  m.gravity = {};
  Body b = make_box("b", 1, {0.1, 0.1, 0.1}, {0, 0, -1});
  Shape hull;
  hull.kind = Shape::Kind::Hull;
  hull.vertices = {{0.1, 0, 1.02}, {-0.1, 0.1, 1.02}, {-0.1, -0.1, 1.02}, {0, 0, 1.2}};
  b.shapes = {hull};
  add_body(m, b);
  Options o;
  o.equilibrium = false;
  o.duration = 0.01;
  o.tells_lost_contact = true;
  EXPECT_TRUE(run(m, o).notes.empty());
  m.bodies[0].X_WB.p.z = -1.15;
  EXPECT_FALSE(run(m, o).notes.empty());
}

}  // namespace
}  // namespace topple::mbs
