// Ideal joints of every kind: what they hold, what they leave free, their reactions, energy and momentum.
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <optional>

#include "mbs/quantity.h"
#include "mechanisms.h"

namespace topple::mbs {
namespace {

using test::empty_model;

constexpr double kPi = 3.14159265358979323846;

std::string name_of(Joint::Kind k) {
  const char* const names[] = {"Fixed", "Revolute", "Spherical", "Universal", "Prismatic", "Cylindrical", "Distance"};
  return names[static_cast<size_t>(k)];
}

bool slides(Joint::Kind k) { return k == Joint::Kind::Prismatic || k == Joint::Kind::Cylindrical; }

/// A kind of joint, between an arm on a hinge and its end (a cluster of two), or between two bodies in space (a pair).
struct Case {
  Joint::Kind kind;
  bool in_space;
};
void PrintTo(const Case& c, std::ostream* out) { *out << name_of(c.kind) << (c.in_space ? "InSpace" : "OnTheGround"); }

/// An arm on a hinge in space, and a second body on it by the kind of joint; where that lets the bodies part, a spring
/// keeps them together. Nothing is along an axis.
Model make_arm(Joint::Kind kind) {
  Model m = empty_model();
  Body arm = test::make_rod("arm", 2, {0, 0, 0}, {1, 0.2, 0.1}),
       end = test::make_rod("end", 1, {1, 0.2, 0.1}, {1.3, 0.9, 0.4});
  arm.inertia = Mat3::diagonal({0.05, 0.2, 0.22});
  end.inertia = Mat3::diagonal({0.03, 0.06, 0.07});
  add_body(m, arm);
  add_body(m, end);
  test::join(m, Joint::Kind::Revolute, kGround, {0}, {0, 0, 0}, test::along({0.3, 1, 0.2}), "shoulder");
  if (kind == Joint::Kind::Distance) {
    Joint j;
    j.kind = kind;
    j.name = "elbow";
    j.parent = {0};
    j.child = {1};
    j.X_PF.p = {0.6, 0, 0};
    j.X_CM.p = {-0.1, 0.05, 0};
    add_joint(m, j);
  } else {
    test::join(m, kind, {0}, {1}, {1, 0.2, 0.1}, test::along({0.5, 0.3, 0.8}), "elbow");
  }
  if (slides(kind) || kind == Joint::Kind::Distance) {
    SpringDamper s;
    s.a = {0};
    s.b = {1};
    s.p_A = {0.1, 0.1, 0};
    s.free_length = 0.2;
    s.spring.rate = 60;
    m.springs.push_back(s);
  }
  return m;
}

/// The two without the hinge, thrown and turning.
Model make_pair(Joint::Kind kind) {
  Model m = make_arm(kind);
  m.joints.erase(m.joints.begin());
  m.bodies[0].v_WB = {0.3, -0.2, 0.5};
  m.bodies[0].w_WB = m.bodies[1].w_WB = {1, -2, 0.5};
  m.bodies[1].v_WB = m.bodies[0].v_WB + cross(m.bodies[0].w_WB, m.bodies[1].X_WB.p - m.bodies[0].X_WB.p);
  return m;
}

Model make_model(const Case& c) { return c.in_space ? make_pair(c.kind) : make_arm(c.kind); }

Options options_of(double duration, double step) {
  Options o;
  o.equilibrium = false;
  o.duration = duration;
  o.step = step;
  o.frame_interval = 0.01;
  return o;
}

class EveryJoint : public testing::TestWithParam<Case> {};
class EveryJointPhysics : public EveryJoint {};

std::vector<Case> every_case() {
  std::vector<Case> out;
  for (const bool in_space : {false, true})
    for (int kind = 0; kind < 7; ++kind) out.push_back({static_cast<Joint::Kind>(kind), in_space});
  return out;
}
std::string case_name(const testing::TestParamInfo<Case>& i) { return testing::PrintToString(i.param); }
INSTANTIATE_TEST_SUITE_P(Kinds, EveryJoint, testing::ValuesIn(every_case()), case_name);
INSTANTIATE_TEST_SUITE_P(Kinds, EveryJointPhysics, testing::ValuesIn(every_case()), case_name);

/// What the kind must hold and may leave free, straight from the poses; lengths and sines of angles.
void expect_held(const Joint& j, const View& v, double start_length, double tolerance) {
  const Joint::Kind kind = j.kind;
  const auto pose = [&](BodyId b) { return b == kGround ? Pose{} : v.X_WB[static_cast<size_t>(b.index)]; };
  const Pose F = pose(j.parent) * j.X_PF, M = pose(j.child) * j.X_CM;
  const Mat3 RF = to_matrix(F.q), RM = to_matrix(M.q);
  const Vec3 gap = transpose_times(RF, M.p - F.p);
  if (kind == Joint::Kind::Distance) {
    EXPECT_NEAR(norm(gap), start_length, tolerance);
    return;
  }
  EXPECT_NEAR(gap.x, 0, tolerance);
  EXPECT_NEAR(gap.y, 0, tolerance);
  if (!slides(kind)) { EXPECT_NEAR(gap.z, 0, tolerance); }
  if (kind == Joint::Kind::Universal) { EXPECT_NEAR(dot(RF.column(0), RM.column(1)), 0, tolerance); }
  if (kind == Joint::Kind::Revolute || kind == Joint::Kind::Cylindrical) {
    EXPECT_NEAR(norm(RF.column(2) - RM.column(2)), 0, tolerance);
  }
  if (kind == Joint::Kind::Fixed || kind == Joint::Kind::Prismatic) {
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(norm(RF.column(i) - RM.column(i)), 0, tolerance);
  }
}

TEST_P(EveryJoint, HoldsToRoundOffForTenSeconds) {
  const Model m = make_model(GetParam());
  Options o = options_of(10, 1e-3);
  double start_length = 0, moved = 0;
  Vec3 first;
  const Joint& elbow = m.joints.back();
  o.on_frame = [&](const View& v) {
    const Pose F = v.X_WB[0] * elbow.X_PF, M = v.X_WB[1] * elbow.X_CM;
    if (v.time == 0) start_length = norm(M.p - F.p), first = v.X_WB[1].p;
    moved = std::max(moved, norm(v.X_WB[1].p - first));
    // places far from the origin are rounded: 500 m after ten seconds of free fall
    const double tolerance = 1e-11 + 1e-15 * norm(v.X_WB[1].p);
    expect_held(elbow, v, start_length, tolerance);
    if (m.joints.size() == 2) expect_held(m.joints[0], v, 0, tolerance);
    ASSERT_FALSE(testing::Test::HasFailure()) << "at " << v.time;
  };
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::TimeLimit);
  EXPECT_LT(s.joint_drift, 1e-11);
  EXPECT_GT(moved, 1);
  EXPECT_TRUE(s.notes.empty()) << s.notes[0];
}

TEST_P(EveryJointPhysics, KeepsEnergyWithTheSquareOfTheStep) {
  const auto residual = [](double h, double duration) {
    double worst = 0;
    Options o = options_of(duration, h);
    o.on_frame = [&](const View& v) { worst = std::max(worst, std::abs(v.energy.residual)); };
    (void)run(make_model(GetParam()), o);
    return worst;
  };
  // of some 20 J in motion; over ten seconds the motions of most of these arms part from each other
  EXPECT_LT(residual(1e-3, 10), 1e-2);
  const double a = residual(1e-3, 2), b = residual(5e-4, 2);
  EXPECT_NEAR(std::log2(a / b), 2, 0.15);
}

TEST_P(EveryJointPhysics, ReactionsAreOfSecondOrder) {
  const auto at = [](double h) {
    std::array<Vec3, 4> r;
    Options o = options_of(0.5, h);
    o.frame_interval = 0.5;
    o.on_frame = [&](const View& v) {
      r = {v.joint_force.front(), v.joint_moment.front(), v.joint_force.back(), v.joint_moment.back()};
    };
    (void)run(make_model(GetParam()), o);
    return r;
  };
  const auto a = at(4e-3), b = at(2e-3), c = at(1e-3);
  for (size_t i = 0; i < 4; ++i) {
    if (norm(c[i]) < 1e-9) continue;  // a kind without this reaction
    EXPECT_NEAR(std::log2(norm(a[i] - b[i]) / norm(b[i] - c[i])), 2, 0.25) << i;
  }
}

TEST_P(EveryJointPhysics, ReactionsMoveTheBodiesAsTheyDo) {
  // Newton and Euler for both bodies, accelerations from three places and orientations
  const Model m = make_model(GetParam());
  const double h = 1e-4;
  std::vector<View> views;
  Options o = options_of(0.4, h);
  o.frame_interval = h;
  o.on_frame = [&](const View& v) {
    if (v.time > 0.4 - 2.5 * h) views.push_back(v);
  };
  (void)run(m, o);
  ASSERT_EQ(views.size(), 3U);
  const View& v = views[1];
  for (size_t b = 0; b < 2; ++b) {
    const Body& body = m.bodies[b];
    Vec3 f = body.mass * m.gravity, t;
    for (size_t j = 0; j < m.joints.size(); ++j) {
      const Joint& joint = m.joints[j];
      const Pose X_WP = joint.parent == kGround ? Pose{} : v.X_WB[static_cast<size_t>(joint.parent.index)];
      const Mat3 F = to_matrix((X_WP * joint.X_PF).q);
      const Vec3 p_M = v.X_WB[static_cast<size_t>(joint.child.index)] * joint.X_CM.p;
      const double sign = joint.child.index == static_cast<int>(b)    ? 1
                          : joint.parent.index == static_cast<int>(b) ? -1
                                                                      : 0;
      const Vec3 force = sign * (F * v.joint_force[j]), moment = sign * (F * v.joint_moment[j]);
      f += force;
      t += moment + cross(p_M - v.X_WB[b].p, force);
    }
    if (!m.springs.empty()) {
      const SpringDamper& s = m.springs[0];
      const Vec3 p_A = v.X_WB[0] * s.p_A, p_B = v.X_WB[1] * s.p_B, d = p_B - p_A;
      const Vec3 pull = (v.spring_force[0] / norm(d)) * d;
      f += b == 0 ? pull : -pull;
      t += b == 0 ? cross(p_A - v.X_WB[0].p, pull) : cross(p_B - v.X_WB[1].p, -pull);
    }
    const Vec3 a = (1 / (h * h)) * (views[2].X_WB[b].p - 2 * v.X_WB[b].p + views[0].X_WB[b].p);
    const auto L = [&](const View& view) {
      const Mat3 R = to_matrix(view.X_WB[b].q);
      return R * (body.inertia * transpose_times(R, view.w_WB[b]));
    };
    const Vec3 dL = (1 / (2 * h)) * (L(views[2]) - L(views[0]));
    // second order in 0.1 ms at some 10 rad/s, 1e-6 of forces up to 100 N
    EXPECT_LT(norm(body.mass * a - f), 1e-3) << m.bodies[b].name;
    EXPECT_LT(norm(dL - t), 1e-3) << m.bodies[b].name;
  }
}

TEST_P(EveryJointPhysics, KeepsMomentumToRoundOff) {
  // two bodies, or a third on the arm's shoulder, in space; the spring of the sliding kinds acts within
  Model m = make_pair(GetParam().kind);
  m.gravity = {};
  if (!GetParam().in_space) {
    Body shoulder = m.bodies[0];
    shoulder.name = "shoulder";
    shoulder.X_WB.p = {-0.5, 0, 0};
    shoulder.v_WB = m.bodies[0].v_WB + cross(m.bodies[0].w_WB, shoulder.X_WB.p - m.bodies[0].X_WB.p);
    add_body(m, shoulder);
    test::join(m, Joint::Kind::Revolute, {2}, {0}, {0, 0, 0}, test::along({0.3, 1, 0.2}), "shoulder");
  }
  Vec3 P0, H0, P, H;
  Options o = options_of(5, 1e-3);
  o.on_frame = [&](const View& v) {
    P = H = {};
    for (size_t b = 0; b < m.bodies.size(); ++b) {
      const Mat3 R = to_matrix(v.X_WB[b].q);
      const Vec3 p = m.bodies[b].mass * v.v_WB[b];
      P += p;
      H += cross(v.X_WB[b].p, p) + R * (m.bodies[b].inertia * transpose_times(R, v.w_WB[b]));
    }
    if (v.time == 0) P0 = P, H0 = H;
  };
  const Summary s = run(m, o);
  EXPECT_TRUE(s.notes.empty());  // the start agrees with every kind
  EXPECT_LT(norm(P - P0), 1e-11);
  EXPECT_LT(norm(H - H0), 1e-10);  // the joints' gaps of 1e-12 m are levers of their forces
}

TEST_P(EveryJoint, GivesTheSameBitsFromASnapshot) {
  const Model m = make_model(GetParam());
  Options o;
  o.equilibrium = false;
  o.step = 1e-3;
  Simulation whole(m, o), other(m, o);
  std::vector<std::byte> kept;
  for (int i = 0; i < 1500; ++i) {
    if (i == 0 || i == 700) kept = whole.snapshot();
    if (i == 700 || i == 0) {
      other.restore(kept);
      (void)other.calc_view();  // looking changes nothing
    }
    ASSERT_TRUE(whole.advance_step());
    ASSERT_TRUE(other.advance_step());
  }
  EXPECT_EQ(whole.snapshot(), other.snapshot());
  const View &a = whole.calc_view(), &b = other.calc_view();
  for (size_t j = 0; j < m.joints.size(); ++j) {
    EXPECT_EQ(a.joint_force[j], b.joint_force[j]);
    EXPECT_EQ(a.joint_moment[j], b.joint_moment[j]);
    EXPECT_EQ(a.joint_angle[j], b.joint_angle[j]);
    EXPECT_EQ(a.joint_displacement[j], b.joint_displacement[j]);
  }
}

TEST_P(EveryJoint, ReactionsKeepOutOfWhatIsFree) {
  const Model m = make_model(GetParam());
  Options o = options_of(1, 1e-3);
  o.on_frame = [&](const View& v) {
    const Vec3 f = v.joint_force.back(), t = v.joint_moment.back();
    const double tiny = 1e-9;
    const Joint& j = m.joints.back();
    const Mat3 F = to_matrix((v.X_WB[0] * j.X_PF).q), M = to_matrix((v.X_WB[1] * j.X_CM).q);
    switch (GetParam().kind) {
      case Joint::Kind::Fixed:
        break;
      case Joint::Kind::Revolute:
        EXPECT_NEAR(t.z, 0, tiny);
        break;
      case Joint::Kind::Spherical:
        EXPECT_NEAR(norm(t), 0, tiny);
        break;
      case Joint::Kind::Universal:
        // the moment is at right angles to both axes
        EXPECT_NEAR(t.x, 0, tiny);
        EXPECT_NEAR(dot(F * t, M.column(1)), 0, tiny);
        break;
      case Joint::Kind::Prismatic:
        EXPECT_NEAR(f.z, 0, tiny);
        break;
      case Joint::Kind::Cylindrical:
        EXPECT_NEAR(f.z, 0, tiny);
        EXPECT_NEAR(t.z, 0, tiny);
        break;
      case Joint::Kind::Distance: {
        const Vec3 d = transpose_times(F, v.X_WB[1] * j.X_CM.p - v.X_WB[0] * j.X_PF.p);
        EXPECT_NEAR(norm(cross(f, (1 / norm(d)) * d)), 0, tiny);
        EXPECT_NEAR(norm(t), 0, tiny);
        break;
      }
    }
  };
  (void)run(m, o);
}

// ------------------------------------------------------------------------------------- closed forms and starts

TEST(JointReactions, OfAFallingRodAreThoseOfTheClosedForm) {
  // a rod of 1 kg and 1 m on a hinge about y: at the angle θ from the upright, released at 0.3 rad at rest,
  // ω² = 3 g (cos 0.3 - cos θ), along the rod m g cos θ - m ω² / 2 towards it, across it m g sin θ / 4
  Model m = empty_model();
  const double start = 0.3;
  add_body(m, test::make_rod("rod", 1, {0, 0, 0}, {std::sin(start), 0, std::cos(start)}));
  test::pin(m, kGround, {0}, {});
  double worst[2];
  size_t k = 0;
  for (const double h : {1e-3, 5e-4}) {
    double& off = worst[k++] = 0;
    Options o = options_of(1, h);
    o.on_frame = [&](const View& v) {
      const Vec3 along = to_matrix(v.X_WB[0].q).column(0), across{along.z, 0, -along.x};
      const double cosine = along.z, sine = along.x, w2 = 3 * 9.81 * (std::cos(start) - cosine);
      const Vec3 wanted = (9.81 * cosine - 0.5 * w2) * along - (9.81 * sine / 4) * across;
      off = std::max(off, norm(v.ground_force - wanted));
      if (v.time == 0) { EXPECT_LT(norm(v.ground_force - wanted), 1e-10); }  // the first frame too
    };
    (void)run(m, o);
  }
  EXPECT_LT(worst[0], 1.5e-3);  // (ω h)² of 25 N at the bottom, 7.6 rad/s
  EXPECT_NEAR(std::log2(worst[0] / worst[1]), 2, 0.1);
}

TEST(JointAngle, CountsTurnsAndFollowsTheChild) {
  // a wheel driven only by its spin: 50 rad/s about the hinge for 2 s are 15.9 turns, one way and the other
  for (const double spin : {50.0, -50.0}) {
    Model m = empty_model();
    m.gravity = {};
    Body wheel;
    wheel.name = "wheel";
    wheel.w_WB = {0, spin, 0};
    add_body(m, wheel);
    test::pin(m, kGround, {0}, {});
    Options o = options_of(2, 1e-3);
    o.frame_interval = 2;
    double angle = 0;
    o.on_frame = [&](const View& v) { angle = v.joint_angle[0]; };
    (void)run(m, o);
    EXPECT_NEAR(angle, 2 * spin, 1e-9);
  }
}

TEST(JointDisplacement, IsThatOfTheChildAlongTheAxis) {
  // a block on a slide of 30 degrees falls along it by g sin 30 t² / 2
  for (const Joint::Kind kind : {Joint::Kind::Prismatic, Joint::Kind::Cylindrical}) {
    Model m = empty_model();
    Body block;
    block.name = "block";
    add_body(m, block);
    const Vec3 down{std::cos(kPi / 6), 0, -std::sin(kPi / 6)};
    test::join(m, kind, kGround, {0}, {}, test::along(down));
    Options o = options_of(1, 1e-3);
    double displacement = 0;
    Vec3 force;
    o.on_frame = [&](const View& v) { displacement = v.joint_displacement[0], force = v.joint_force[0]; };
    (void)run(m, o);
    EXPECT_NEAR(displacement, 0.5 * 9.81 * 0.5, 1e-10);
    EXPECT_NEAR(norm(force), 9.81 * std::cos(kPi / 6), 1e-9);
  }
}

TEST(JointStart, VelocitiesAreMadeToAgree) {
  // a point of 1 kg on a rod of 1 m is thrown at 45 degrees to it: the part along the rod goes into the joint
  Model m = empty_model();
  m.gravity = {};
  Body b;
  b.name = "bob";
  b.X_WB.p = {1, 0, 0};
  b.v_WB = {1, 0, 1};
  add_body(m, b);
  Joint j;
  j.kind = Joint::Kind::Distance;
  j.name = "string";
  j.parent = kGround;
  j.child = {0};
  add_joint(m, j);
  Options o = options_of(1, 1e-3);
  Vec3 first, last;
  double residual = 1;
  o.on_frame = [&](const View& v) {
    if (v.time == 0) first = v.v_WB[0];
    last = v.v_WB[0];
    residual = v.energy.residual;
  };
  const Summary s = run(m, o);
  EXPECT_NEAR(norm(first - Vec3{0, 0, 1}), 0, 1e-12);
  EXPECT_NEAR(norm(last), 1, 1e-6);
  EXPECT_NEAR(residual, 0, 1e-6);
  ASSERT_EQ(s.notes.size(), 1U);
  EXPECT_NE(s.notes[0].find("\"string\""), std::string::npos);
  EXPECT_NE(s.notes[0].find("by up to 1 m/s"), std::string::npos) << s.notes[0];
}

TEST(FixedJoints, InARowMoveAsOneBody) {
  // boxes in a row, thrown and turning, against one box of their mass and inertia
  const auto fly = [](int pieces) {
    Model m = empty_model();
    const Vec3 w{0.3, 1, -0.7};
    for (int i = 0; i < pieces; ++i) {
      const double length = 5.0 / pieces, x = length * (i + 0.5) - 2.5;
      Body b = test::make_box("b" + std::to_string(i), 10.0 / pieces, {length / 2, 0.2, 0.3}, {x, 0, 0});
      b.w_WB = w;
      b.v_WB = Vec3{1, 0, 3} + cross(w, b.X_WB.p);
      add_body(m, b);
      if (i > 0) test::join(m, Joint::Kind::Fixed, {i - 1}, {i}, {x - length / 2, 0, 0}, {});
    }
    Pose end;
    Options o = options_of(2, 2e-3);
    o.on_frame = [&](const View& v) {
      end = v.X_WB[0];
      end.p += to_matrix(end.q) * (Vec3{-2.5, 0, 0} - m.bodies[0].X_WB.p);  // the end of the row
    };
    (void)run(m, o);
    return end;
  };
  const Pose one = fly(1), two = fly(2), five = fly(5);
  // a pair is solved as one body
  EXPECT_LT(norm(one.p - two.p), 1e-11);
  EXPECT_LT(norm(log_rotation(conjugate(one.q) * two.q)), 1e-11);
  // a longer row by its joints: both of second order
  EXPECT_LT(norm(one.p - five.p), 1e-4);
  EXPECT_LT(norm(log_rotation(conjugate(one.q) * five.q)), 1e-4);
}

TEST(Joints, OfAChainOfAHundredLinksHangTogether) {
  // released from the horizontal; work grows with the number of joints, not with its cube
  Model m = empty_model();
  const int n = 100;
  for (int i = 0; i < n; ++i) {
    add_body(m, test::make_rod("link", 1, {0.1 * i, 0, 0}, {0.1 * i + 0.1, 0, 0}));
    test::join(m, Joint::Kind::Spherical, i == 0 ? kGround : BodyId{i - 1}, {i}, {0.1 * i, 0, 0}, {});
  }
  Options o = options_of(1, 5e-4);
  double residual = 0, kinetic = 0;
  o.on_frame = [&](const View& v) {
    residual = std::max(residual, std::abs(v.energy.residual));
    kinetic = std::max(kinetic, v.energy.kinetic);
  };
  const Summary s = run(m, o);
  EXPECT_LT(s.joint_drift, 1e-10);
  EXPECT_GT(kinetic, 1000);
  EXPECT_LT(residual, 1e-3 * kinetic);
}

/// First component of a quantity in the dead-load equilibrium, NaN where there is none.
double measure_at_rest(const Model& m, const Quantity& quantity) {
  Options o = options_of(1e-3, 1e-3);
  o.equilibrium = true;
  double found = std::numeric_limits<double>::quiet_NaN();
  o.on_frame = [&](const View& v) {
    if (v.time == 0) found = calc_quantity(quantity, v)[0];
  };
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
  return found;
}

/// A spring of 2 m under the point (2, 0, 0) of body 0, whose centre is 1 m beside it.
void add_prop(Model& m, double stiffness) {
  SpringDamper prop;
  prop.name = "prop";
  prop.a = kGround, prop.b = {0};
  prop.p_A = {2, 0, -2}, prop.p_B = {1, 0, 0};
  prop.free_length = 2;
  prop.spring.rate = stiffness;
  m.springs.push_back(prop);
}

TEST(JointPhysics, AnArmOnASoftSpringFindsItsEquilibrium) {
  // gravity turns it back by more than twice what the spring does: c a = m g L cos a
  for (const double stiffness : {8.0, 12.0, 30.0}) {
    Model m = empty_model();
    m.gravity = {0, 0, -9.81};
    Body b = test::make_rod("arm", 2, {0, 0, 0}, {2, 0, 0});
    add_body(m, b);
    test::join(m, Joint::Kind::Revolute, kGround, {0}, {0, 0, 0}, test::along({0, 1, 0}), "hinge");
    RotationalSpring spring;
    spring.joint = {0};
    spring.spring.rate = stiffness;
    m.rotational_springs.push_back(spring);
    const double angle = measure_at_rest(m, {Quantity::Kind::JointAngle, 0});
    EXPECT_NEAR(stiffness * angle, 2 * 9.81 * std::cos(angle), 1e-6) << stiffness;
  }
}

TEST(JointPhysics, AnEquilibriumHasItsJointsClosed) {
  // an arm on a hinge, held by a rod on a lever of 0.1 m; a weight hangs from its tip, and a prop stands under it
  for (const double stiffness : {1e6, 1e8}) {
    Model m = empty_model();
    m.gravity = {0, 0, -9.81};
    add_body(m, test::make_rod("arm", 100, {0, 0, 0}, {2, 0, 0}));
    add_body(m, test::make_box("weight", 50, {0.1, 0.1, 0.1}, {2, 0, -1}));
    test::join(m, Joint::Kind::Revolute, kGround, {0}, {0, 0, 0}, test::along({0, 1, 0}), "hinge");
    Joint rod;
    rod.kind = Joint::Kind::Distance;
    rod.name = "rod";
    rod.parent = kGround;
    rod.child = {0};
    rod.X_PF.p = {-1, 0, 0.1};
    rod.X_CM.p = {-0.5, 0, 0.1};
    add_joint(m, rod);
    Bushing hanger;
    hanger.a = {0}, hanger.b = {1};
    hanger.X_AF.p = {1, 0, -1};
    for (int k = 0; k < 6; ++k) hanger.spring[k].rate = k < 3 ? stiffness : 1e3;
    m.bushings.push_back(hanger);
    add_prop(m, stiffness);
    const double pull = std::abs(measure_at_rest(m, {Quantity::Kind::JointForce, 1}));
    EXPECT_NEAR(pull, (100 * 1 + 50 * 2) * 9.81 / 0.1, 1) << stiffness;
  }
}

TEST(JointPhysics, RepeatedConstraintsNeedNotMeetToTheLastDigit) {
  Model m = empty_model();
  m.gravity = {0, 0, -9.81};
  add_body(m, test::make_box("b", 1000, {1, 0.1, 0.1}, {0, 0, 1}));
  test::join(m, Joint::Kind::Revolute, kGround, {0}, {-1, 0, 1}, test::along({0, 1, 0}), "left");
  test::join(m, Joint::Kind::Spherical, kGround, {0}, {1, 0, 1}, {}, "right");
  m.joints[1].X_PF.p.x += 1e-10;
  Options o = options_of(1e-3, 1e-3);
  o.equilibrium = true;
  const Summary s = run(m, o);
  EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
  EXPECT_LT(s.equilibrium_iterations, 50);
}

TEST(JointPhysics, AxesThatAlmostRepeatEachOtherHaveAnEquilibrium) {
  // a flap on two hinges whose axes differ in the seventh digit, and a prop: what one of them adds is let go of
  for (const double off : {4e-7, 1e-6}) {
    Model m = empty_model();
    m.gravity = {0, 0, -9.81};
    add_body(m, test::make_box("flap", 1000, {1, 1, 0.1}, {1, 0, 0}));
    test::join(m, Joint::Kind::Revolute, kGround, {0}, {0, -1, 0}, test::along({0, 1, 0}), "one");
    test::join(m, Joint::Kind::Revolute, kGround, {0}, {0, 1, 0}, test::along({off, 1, 0}), "other");
    add_prop(m, 1e5);
    const double force = measure_at_rest(m, {Quantity::Kind::SpringForce, 0});
    EXPECT_NEAR(std::abs(force), 1000 * 9.81 / 2, 100) << off;
  }
}

TEST(JointPhysics, EquilibriumHangsOnNoOrderOfBodies) {
  // the arm alone goes astray and is found on shorter ways; no body beside it may hide that
  double angle[2] = {0, 0};
  for (const bool is_first : {false, true}) {
    Model m = empty_model();
    m.gravity = {0, 0, -9.81};
    const auto add_arm = [&] { return add_body(m, test::make_rod("arm", 5, {0, 0, 0}, {1, 0, 0})); };
    const auto add_block = [&] { return add_body(m, test::make_box("block", 5, {0.5, 0.5, 0.5}, {0, 5, 0})); };
    const BodyId first = is_first ? add_arm() : add_block(), second = is_first ? add_block() : add_arm();
    const BodyId arm = is_first ? first : second, block = is_first ? second : first;
    test::join(m, Joint::Kind::Revolute, kGround, arm, {0, 0, 0}, test::along({0, 1, 0}), "hinge");
    RotationalSpring spring;
    spring.joint = {0};
    spring.spring.rate = 20;
    m.rotational_springs.push_back(spring);
    Bushing pad;
    pad.a = kGround, pad.b = block;
    pad.X_AF.p = {0, 5, 0};
    for (int k = 0; k < 6; ++k) pad.spring[k].rate = 2e4;
    m.bushings.push_back(pad);
    angle[is_first ? 1 : 0] = measure_at_rest(m, {Quantity::Kind::JointAngle, 0});
  }
  EXPECT_NEAR(20 * angle[0], 5 * 9.81 * 0.5 * std::cos(angle[0]), 1e-6);
  EXPECT_NEAR(angle[1], angle[0], 1e-9);
}

TEST(JointPhysics, AWeldedBodyKeepsTheSignOfItsOrientation) {
  // of both quaternions of an orientation; from a parent at 2 rad the other one is found for a child at -2 rad
  Model m = empty_model();
  m.gravity = {};
  for (const double turn : {2.0, -2.0}) {
    Body b = test::make_rod("rod", 1, {0, 0, 0}, {1, 0, 0});
    b.inertia = Mat3::diagonal({0.1, 0.2, 0.2});
    b.X_WB.q = exp_rotation({0, 0, turn});
    b.w_WB = {0.1, 0.2, 0.3};
    add_body(m, b);
  }
  test::join(m, Joint::Kind::Fixed, {0}, {1}, {0.3, 0, 0}, {}, "weld");
  Options o = options_of(0.05, 1e-3);
  o.frame_interval = 1e-3;
  double largest = 0;
  std::optional<Quat> before;
  o.on_frame = [&](const View& v) {
    const Quat& q = v.X_WB[1].q;
    if (before) largest = std::max(largest, std::hypot(q.w - before->w, q.x - before->x, q.z - before->z));
    before = q;
  };
  (void)run(m, o);
  EXPECT_GT(largest, 0);
  EXPECT_LT(largest, 1e-2);
}

TEST(JointPhysics, AHingeCountsAllTurnsOfWhatSpinsFast) {
  // beyond 0.4 rad a step the lanes leave a pair to its cluster
  for (const double rate : {30.0, 41.0, 170.0}) {
    Model m = empty_model();
    m.gravity = {};
    Body b = test::make_rod("rotor", 1, {0, 0, 0}, {1, 0, 0});
    b.X_WB.p = {};
    b.inertia = Mat3::diagonal({1, 2, 3});
    b.w_WB = {0, rate, 0};
    add_body(m, b);
    test::join(m, Joint::Kind::Revolute, kGround, {0}, {0, 0, 0}, test::along({0, 1, 0}), "hinge");
    Options o = options_of(2, 1e-2);
    double angle = 0;
    o.samplings = {{2, [&](const View& v) { angle = calc_quantity({Quantity::Kind::JointAngle, 0}, v)[0]; }}};
    const Summary s = run(m, o);
    EXPECT_NEAR(angle, 2 * rate, 1e-9) << s.message;
  }
}

}  // namespace
}  // namespace topple::mbs
