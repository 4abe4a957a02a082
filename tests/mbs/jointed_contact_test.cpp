// Bodies that joints hold, in contact: what touches has the mass that moves with it.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "mbs/snapshot.h"
#include "mbs/system.h"
#include "models.h"

namespace topple::mbs {
namespace {

using test::make_box;

Body make_ball(const std::string& name, double mass, double radius, const Vec3& p) {
  Body b;
  b.name = name;
  b.mass = mass;
  b.inertia = 0.4 * mass * radius * radius * Mat3::identity();
  b.X_WB.p = p;
  Shape s;
  s.kind = Shape::Kind::Sphere;
  s.radius = radius;
  b.shapes = {s};
  return b;
}

/// Ties two bodies at a point of W; axes are those of W, turned.
void join(Model& m, Joint::Kind kind, int parent, int child, const Vec3& at, const Quat& axes = {}) {
  Joint j;
  j.kind = kind;
  j.parent = {parent}, j.child = {child};
  const auto place = [&](int b) { return b < 0 ? at : at - m.bodies[static_cast<size_t>(b)].X_WB.p; };
  j.X_PF = {place(parent), axes}, j.X_CM = {place(child), axes};
  add_joint(m, j);
}

struct Outcome {
  Summary summary;
  View last;
};
/// In the steps that the engine chooses for a file, or in given ones [s].
Outcome let_go(const Model& m, double duration, double step = 0) {
  Options o;
  o.equilibrium = false;
  o.duration = duration;
  o.step = step;
  o.step_safety = 0.1, o.least_steps = 200;
  Outcome out;
  o.on_frame = [&](const View& v) { out.last = v; };
  out.summary = run(m, o);
  return out;
}

constexpr double kSpeed = 2;

/// A block of 100 kg over a foot that is welded to it, both coming down; no gravity.
Model make_block_on_foot(double foot_mass, bool is_ball, double restitution) {
  Model m;
  m.gravity = {};
  m.contact.restitution = restitution;
  m.contact.friction = 0;
  add_body(m, make_box("block", 100, {0.5, 0.5, 0.5}, {0, 0, 1}));
  add_body(m, is_ball ? make_ball("foot", foot_mass, 0.1, {0, 0, 0.2})
                      : make_box("foot", foot_mass, {0.2, 0.2, 0.1}, {0, 0, 0.2}));
  for (Body& b : m.bodies) b.v_WB = {0, 0, -kSpeed};
  join(m, Joint::Kind::Fixed, 0, 1, {0, 0, 0.3});
  return m;
}

TEST(JointedContact, AWeldedFootReturnsTheGivenShareWhateverItsMass) {
  for (const bool is_ball : {true, false})
    for (const double restitution : {0.0, 0.1, 0.5, 1.0})
      for (const double mass : {100.0, 10.0, 1.0, 0.1, 0.01}) {
        SCOPED_TRACE(std::string(is_ball ? "ball " : "box ") + std::to_string(restitution) + " " +
                     std::to_string(mass));
        const Outcome out = let_go(make_block_on_foot(mass, is_ball, restitution), 0.3);
        // points on one normal share it: 3e-3 by the theory for four times the mass
        EXPECT_NEAR(out.last.v_WB[0].z, restitution * kSpeed, (is_ball ? 0.002 : 0.01) * kSpeed);
        EXPECT_LT(std::abs(out.last.energy.residual), 1e-4 * 0.5 * (100 + mass) * kSpeed * kSpeed);
      }
}

TEST(JointedContact, AWeldIsAsOneBody) {
  // off the middle, so that it turns: the block, its foot and their sum as one body
  Model two;
  two.gravity = {};
  two.contact.friction = 0.3;
  two.contact.restitution = 0.3;
  add_body(two, make_box("block", 100, {0.5, 0.4, 0.5}, {0, 0, 1}));
  add_body(two, make_ball("foot", 4, 0.1, {0.4, 0.3, 0.2}));
  two.bodies[0].shapes.clear();
  join(two, Joint::Kind::Fixed, 0, 1, {0.4, 0.3, 0.3});
  Model one = two;
  one.joints.clear();
  one.bodies.resize(1);
  const Vec3 centre = (1 / 104.0) * (100 * two.bodies[0].X_WB.p + 4 * two.bodies[1].X_WB.p);
  Mat3 inertia;
  for (const Body& b : two.bodies) {
    const Vec3 r = b.X_WB.p - centre;
    const Mat3 outer = Mat3::from_columns(r.x * r, r.y * r, r.z * r);
    inertia = inertia + b.inertia + b.mass * (dot(r, r) * Mat3::identity() + (-1) * outer);
  }
  one.bodies[0].mass = 104, one.bodies[0].inertia = inertia;
  Shape foot = two.bodies[1].shapes[0];
  foot.X_BS.p = two.bodies[1].X_WB.p - centre;
  one.bodies[0].shapes = {foot};
  one.bodies[0].X_WB.p = centre;
  for (Model* m : {&one, &two})
    for (Body& b : m->bodies) b.v_WB = {1, 0, -kSpeed};
  const Outcome a = let_go(one, 0.08, 2e-5), b = let_go(two, 0.08, 2e-5);
  EXPECT_NEAR(norm(a.last.w_WB[0] - b.last.w_WB[0]), 0, 2e-3 * norm(a.last.w_WB[0]));
  const Vec3 v = b.last.v_WB[0] + cross(b.last.w_WB[0], a.last.centre[0] - b.last.centre[0]);
  EXPECT_NEAR(norm(a.last.v_WB[0] - v), 0, 2e-3 * kSpeed);
}

/// A rod of 10 kg hinged at one end to the ground; its other end carries a small ball, welded, that meets a plane.
TEST(JointedContact, ARodOnAHingeReturnsTheGivenShareAtItsTip) {
  for (const double mass : {1.0, 0.01, 0.001}) {
    SCOPED_TRACE(mass);
    Model m;
    m.gravity = {};
    m.contact.ground = false, m.contact.bodies = true;
    m.contact.body_restitution = 0.5, m.contact.body_friction = 0;
    Body rod = make_box("rod", 10, {0.5, 0.02, 0.02}, {0.5, 0, 1});
    rod.shapes.clear();
    add_body(m, rod);
    add_body(m, make_ball("tip", mass, 0.05, {1, 0, 1}));
    Body floor = make_box("floor", 1, {0.5, 0.5, 0.1}, {1, 0, 0.8});
    floor.fixed = true;
    add_body(m, floor);
    join(m, Joint::Kind::Revolute, -1, 0, {0, 0, 1}, exp_rotation({-std::acos(0.0), 0, 0}));
    join(m, Joint::Kind::Fixed, 0, 1, {1, 0, 1});
    m.bodies[0].v_WB = {0, 0, -1}, m.bodies[1].v_WB = {0, 0, -2};
    m.bodies[0].w_WB = m.bodies[1].w_WB = {0, 2, 0};
    const Outcome out = let_go(m, 0.1);
    EXPECT_NEAR(out.last.w_WB[0].y, -0.5 * 2, 0.01);
  }
}

// Four legs welded to a table: each other's contacts are felt through the top.
TEST(JointedContact, ATableOnFourWeldedLegsLandsAndRests) {
  Model m;
  m.contact.restitution = 0.1;
  add_body(m, make_box("top", 20, {0.6, 0.4, 0.02}, {0, 0, 0.9}));
  for (const double x : {-0.5, 0.5})
    for (const double y : {-0.3, 0.3}) {
      const int leg = static_cast<int>(m.bodies.size());
      add_body(m, make_box("leg" + std::to_string(leg), 0.1, {0.02, 0.02, 0.3}, {x, y, 0.58}));
      join(m, Joint::Kind::Fixed, 0, leg, {x, y, 0.88});
    }
  Outcome out = let_go(m, 1.0);
  EXPECT_LT(out.summary.energy_error, 2e-3);
  EXPECT_NEAR(out.last.centre[0].z, 0.62, 1e-4);
  EXPECT_LT(norm(out.last.v_WB[0]), 1e-6);
  EXPECT_GT(out.summary.shortest_step, 3e-5);
  // the first bounce is that of the whole
  m.gravity = {};
  for (Body& b : m.bodies) b.v_WB = {0, 0, -kSpeed};
  EXPECT_NEAR(let_go(m, 0.3).last.v_WB[0].z, 0.1 * kSpeed, 0.01 * kSpeed);
}

// A hundred kilograms on a foot of a tenth: they stand and hold on a slope.
TEST(JointedContact, AHeavyBodyStandsOnItsLightFoot) {
  Model m = make_block_on_foot(0.1, false, 0.1);
  for (Body& b : m.bodies) b.v_WB = {};
  m.bodies[0].X_WB.p.z -= 0.1, m.bodies[1].X_WB.p.z -= 0.1;
  m.bodies[0].shapes.clear();
  m.contact.friction = 0.6;
  const double slope = 0.2;  // of which its weight stays over the foot
  m.gravity = 9.81 * Vec3{std::sin(slope), 0, -std::cos(slope)};
  const Outcome out = let_go(m, 0.5);
  EXPECT_NEAR(out.last.centre[1].z, 0.1, 1e-4);
  EXPECT_NEAR(out.last.centre[1].x, 0, 1e-4);
  EXPECT_LT(norm(out.last.v_WB[0]), 1e-3);
}

// A post on a stiff foot that swings by a radian in a step, under a block that falls on it: joints' forces are others
// in each step, and dashpots feel those of their own.
TEST(JointedContact, AWeldOnAStiffFootIsAsOneBody) {
  const auto make = [](bool is_welded) {
    Model m;
    m.contact.ground = false, m.contact.bodies = true;
    m.contact.body_restitution = 0.1;
    Body node = make_box("node", 500, {0.2, 0.2, 0.25}, {0, 0, 2.65});
    if (is_welded) {
      add_body(m, node);
      Body post = make_box("post", 500, {0.2, 0.2, 1.2}, {0, 0, 1.2});
      post.shapes.clear();
      add_body(m, post);
      join(m, Joint::Kind::Fixed, 1, 0, {0, 0, 2.4});
    } else {
      // both at their common mass centre
      const Vec3 r{0, 0, 0.5 * (2.65 - 1.2)};
      node.inertia = node.inertia + make_box("post", 500, {0.2, 0.2, 1.2}, {}).inertia;
      node.inertia(0, 0) += 1000 * r.z * r.z, node.inertia(1, 1) += 1000 * r.z * r.z;
      node.mass = 1000;
      node.X_WB.p -= r;
      node.shapes[0].X_BS.p = r;
      add_body(m, node);
    }
    add_body(m, make_box("block", 20000, {1, 1, 1}, {0, 0, 4.2}));
    Bushing foot;
    foot.name = "foot";
    foot.a = kGround, foot.b = {is_welded ? 1 : 0};
    foot.X_BM.p = -m.bodies[static_cast<size_t>(foot.b.index)].X_WB.p;
    const double stiffness[6] = {1e8, 1e8, 9e9, 2e9, 2e9, 1e8};
    for (int i = 0; i < 6; ++i) foot.spring[i].rate = stiffness[i];
    m.bushings.push_back(foot);
    return m;
  };
  for (const double step : {4e-4, 2e-4, 1e-4}) {
    const Outcome one = let_go(make(false), 2, step), weld = let_go(make(true), 2, step);
    EXPECT_LT(one.summary.energy_error, 2e-2 * std::pow(step / 4e-4, 2)) << step;
    EXPECT_LT(weld.summary.energy_error, 1.1 * one.summary.energy_error) << step;
    EXPECT_LT(norm(weld.last.centre.back() - one.last.centre.back()), 1e-4) << step;
  }
}

TEST(JointedContact, ASnapshotInAnImpactGoesOnWithTheSameBits) {
  Model m = make_block_on_foot(1, false, 0.3);
  m.bodies[0].X_WB.p.x = 0.1;
  m.joints[0].X_PF.p.x -= 0.1;
  m.contact.friction = 0.3;
  Options o;
  o.equilibrium = false;
  o.duration = 1;
  o.step = 1e-4;
  o.contact_interval = 2;
  for (const int steps : {3, 4}) {  // before a look and behind one
    System a(m, o), b(m, o);
    a.start();
    b.start();
    while (a.state.touching.group.empty() && a.state.time < 0.2) ASSERT_TRUE(a.advance_step());
    for (int i = 0; i < steps; ++i) ASSERT_TRUE(a.advance_step());
    ASSERT_FALSE(a.state.touching.jointed_pairs.empty());
    read_snapshot(write_snapshot(a), b);
    for (int i = 0; i < 50; ++i) {
      ASSERT_TRUE(a.advance_step());
      ASSERT_TRUE(b.advance_step());
      EXPECT_EQ(Vec3(a.state.v[1]).z, Vec3(b.state.v[1]).z) << i;
      EXPECT_EQ(Vec3(a.state.w[1]).y, Vec3(b.state.w[1]).y) << i;
    }
  }
}

// What a joint held until it was released is felt no more.
TEST(JointedContact, AFootThatIsReleasedIsABodyOfItsOwn) {
  Model m = make_block_on_foot(1, true, 0.5);
  m.bodies[0].v_WB = m.bodies[1].v_WB = {0, 0, -kSpeed};
  m.events.push_back(test::make_event(0.01, Action::Kind::ReleaseJoint, 0));
  const Outcome out = let_go(m, 0.08);
  EXPECT_NEAR(out.last.v_WB[1].z, 0.5 * kSpeed, 0.01);
  EXPECT_NEAR(out.last.v_WB[0].z, -kSpeed, 1e-9);
}

/// A body of 10 kg whose tip, 1 m from its centre of mass, moves `ratio` times as easily as that; it comes down on it.
Model make_hammer(double ratio) {
  Model m;
  m.gravity = {};
  m.contact.restitution = 0.5, m.contact.friction = 0;
  Body b = make_ball("hammer", 10, 0.05, {-1, 0, 0.06});
  b.inertia = 10 / (ratio - 1) * Mat3::identity();
  b.shapes[0].X_BS.p = {1, 0, 0};
  b.v_WB = {0, 0, -kSpeed};
  add_body(m, b);
  return m;
}

TEST(FreeContact, AFarPointReturnsItsRestitution) {
  // in steps for the whole mass a point that moves 3000 times as easily returned 4.3 of its speed
  for (const double ratio : {3.0, 12.0, 14.0, 100.0, 3000.0}) {
    const Outcome out = let_go(make_hammer(ratio), 0.05);
    const Vec3 tip = out.last.v_WB[0] + cross(out.last.w_WB[0], to_matrix(out.last.X_WB[0].q) * Vec3{1, 0, 0});
    EXPECT_NEAR(tip.z / kSpeed, 0.5, ratio > 13 ? 0.02 : 0.05) << ratio;
    EXPECT_LT(out.summary.energy_error, 1e-4) << ratio;
  }
}

TEST(FreeContact, TheLedgerOfATopOnAPlaneIsThatOfATopOnTheGround) {
  // its spin turns with its inertia within a step; taken where the step ends, the ledger of pairs erred by 3.5e-3
  double error[2];
  for (const bool is_plane : {false, true}) {
    Model m;
    m.contact.ground = !is_plane;
    m.contact.restitution = m.contact.body_restitution = 0.1;
    m.contact.friction = m.contact.body_friction = 5;
    Body top;
    top.name = "top";
    top.mass = 1;
    top.inertia.m[0][0] = top.inertia.m[1][1] = 0.0015, top.inertia.m[2][2] = 0.0025;
    top.X_WB = {{0, 0, 0.11973792922037504}, exp_rotation({0, 0.4, 0})};
    top.w_WB = {58.4, 0, 138.2};
    Shape hull;
    hull.kind = Shape::Kind::Hull;
    hull.vertices = {{0, 0, -0.13}, {0.03, 0, -0.07}, {-0.02, 0.03, -0.07}, {-0.02, -0.03, -0.07}};
    top.shapes = {hull};
    add_body(m, top);
    if (is_plane) {
      Body plane;
      plane.name = "plane";
      plane.fixed = true;
      Shape shape;
      shape.kind = Shape::Kind::Plane;
      plane.shapes = {shape};
      add_body(m, plane);
    }
    error[is_plane] = let_go(m, 1, 2e-4).summary.energy_error;
  }
  EXPECT_LT(error[0], 1e-5);
  EXPECT_LT(error[1], 2e-5);
}

TEST(JointedContact, DoesNotHangOnTheUnitOfLength) {
  // a block on four balls in ball joints, e = 0: at a tenth of its size it returned 60 times as much of its speed
  const auto returned = [](double size) {
    Model m;
    m.gravity = {};
    m.contact.restitution = 0, m.contact.friction = 0.3;
    Body top = make_ball("top", 100, 0.1, {0, 0, 0.9 * size});
    top.inertia = 16.7 * size * size * Mat3::identity();
    top.shapes.clear();
    top.v_WB = {0, 0, -kSpeed * size};
    add_body(m, top);
    for (int i = 0; i < 4; ++i) {
      Body foot = make_ball("foot" + std::to_string(i), 5, 0.1 * size,
                            {(i % 2 ? 0.4 : -0.4) * size, (i / 2 ? 0.4 : -0.4) * size, 0.3 * size});
      foot.inertia = 0.02 * size * size * Mat3::identity();
      foot.v_WB = top.v_WB;
      add_body(m, foot);
      join(m, Joint::Kind::Spherical, 0, i + 1, foot.X_WB.p);
    }
    return let_go(m, 0.3).last.v_WB[0].z / (kSpeed * size);
  };
  const double one = returned(1);
  for (const double size : {0.1, 0.01}) EXPECT_NEAR(returned(size), one, 1e-4) << size;
}

}  // namespace
}  // namespace topple::mbs
