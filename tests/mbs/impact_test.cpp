// Impacts against closed forms and numbers from elsewhere.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <ostream>

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

Body make_ball(double mass, double radius, const Vec3& p) {
  Body b;
  b.name = "ball";
  b.mass = mass;
  b.inertia = 0.4 * mass * radius * radius * Mat3::identity();
  b.X_WB.p = p;
  Shape s;
  s.kind = Shape::Kind::Sphere;
  s.radius = radius;
  b.shapes = {s};
  return b;
}

// ------------------------------------------------------------------------------------------------------ spheres

// A spinning ball that sticks in its impact: the impulse across is |u| m / 3.5 of the sliding u of its lowest point
// (Routh), on the ground, a plane, a box and a polyhedron alike.
TEST(SphereContact, ABallWithFrictionLandsAlikeOnAllThatIsFlat) {
  for (const std::string on : {"ground", "plane", "box", "polyhedron"}) {
    SCOPED_TRACE(on);
    constexpr double radius = 0.15;
    Model m;
    m.gravity = {};
    m.contact.ground = on == "ground", m.contact.bodies = on != "ground";
    m.contact.restitution = m.contact.body_restitution = 0.3;
    m.contact.friction = m.contact.body_friction = 0.4;
    Body ball = make_ball(2, radius, {0, 0, radius + 0.05});
    ball.v_WB = {-1, 0, -4.08}, ball.w_WB = {3, 4, 1};
    add_body(m, ball);
    if (on != "ground") {
      Body floor = make_box("floor", 1, {2, 2, 1}, {0, 0, on == "plane" ? 0.0 : -1.0});
      Shape& s = floor.shapes[0];
      if (on == "plane") s.kind = Shape::Kind::Plane;
      if (on == "polyhedron") {
        s.kind = Shape::Kind::Hull;
        for (int i = 0; i < 8; ++i) s.vertices.push_back({i & 1 ? 2.0 : -2.0, i & 2 ? 2.0 : -2.0, i & 4 ? 1.0 : -1.0});
      }
      floor.fixed = true;
      add_body(m, floor);
    }
    View last;
    Options o = free_options(0.05, 1e-5);
    o.on_frame = [&](const View& v) { last = v; };
    (void)run(m, o);
    const double slides = -1 - 4 * radius, impulse = -slides / 3.5;  // over the mass
    EXPECT_NEAR(last.v_WB[0].x, -1 + impulse, 2e-5);
    EXPECT_NEAR(last.w_WB[0].y, 4 - impulse * radius / (0.4 * radius * radius), 2e-4);
  }
}

// What slides without spin rolls at last with 5/7 of its speed; contact points of a sphere do not turn with it.
TEST(SphereContact, ABallThatSlidesRollsAtLastInTheEnginesOwnSteps) {
  for (const bool on_box : {false, true}) {
    SCOPED_TRACE(on_box ? "on a box" : "on the ground");
    Model m;
    m.contact.ground = !on_box, m.contact.bodies = on_box;
    m.contact.restitution = m.contact.body_restitution = 0;
    m.contact.friction = m.contact.body_friction = 0.3;
    Body ball = make_ball(2, 0.1, {0, 0, 0.1});
    ball.v_WB = {3, 0, 0};
    add_body(m, ball);
    if (on_box) {
      Body floor = make_box("floor", 1e4, {20, 2, 1}, {0, 0, -1});
      floor.fixed = true;
      add_body(m, floor);
    }
    Options o = free_options(3, 0);
    o.frame_interval = 0.1;
    View last;
    o.on_frame = [&](const View& v) { last = v; };
    const Summary s = run(m, o);
    EXPECT_EQ(s.ending, Summary::Ending::TimeLimit) << s.message;
    EXPECT_LT(s.energy_error, 1e-6);
    // it sinks in by g / ω², 0.9e-4 of its radius
    EXPECT_NEAR(last.v_WB[0].x, 15.0 / 7, 15.0 / 7 * 1e-4);
    EXPECT_NEAR(last.w_WB[0].y, 150.0 / 7, 150.0 / 7 * 1e-4);
    EXPECT_NEAR(last.X_WB[0].p.z, 0.1, 2e-5);
  }
}

// ------------------------------------------------------------------------------------------------------ corners

/// Motion in the plane x z: speeds of the mass centre and spin about y.
struct Planar {
  double vx = 0, vz = 0, w = 0;
};

/// Impact of a body's point at (rx, rz) from its centre with the ground below it: impulses with Coulomb's friction,
/// sliding or sticking at each moment (Routh), until the normal force has given back e² of the work that it took
/// (Stronge; Poisson's rule where the state of sliding does not change).
Planar calc_impact(double mass, double inertia, double rx, double rz, Planar v, double e, double mu) {
  const double nn = 1 / mass + rx * rx / inertia, tt = 1 / mass + rz * rz / inertia, nt = -rx * rz / inertia;
  double vn = v.vz - v.w * rx, vt = v.vx + v.w * rz;
  double normal = 0, tangential = 0, taken = 0, given = 0;
  for (int phase = 0; phase < 8; ++phase) {
    const bool slides = std::abs(vt) > 1e-12;
    double ratio = -nt / tt;  // tangential over normal impulse that lets a sticking point stick
    if (slides) ratio = vt > 0 ? -mu : mu;
    if (std::abs(ratio) > mu) ratio = ratio > 0 ? mu : -mu;
    const double n_rate = nn + nt * ratio, t_rate = nt + tt * ratio;
    double step = 1e300;  // normal impulse of this phase
    if (slides && vt * t_rate < 0) step = -vt / t_rate;
    bool ends = false;
    if (vn < 0) {
      step = std::min(step, -vn / n_rate);
    } else {
      // vn P + ½ n_rate P² = what is still to be given back
      const double left = e * e * taken - given;
      const double last = (-vn + std::sqrt(vn * vn + 2 * n_rate * left)) / n_rate;
      if (last <= step) step = last, ends = true;
    }
    const double work = vn * step + 0.5 * n_rate * step * step;
    (vn < 0 ? taken : given) += std::abs(work);
    const bool turns = vn < 0 && step == -vn / n_rate, stops = slides && step == -vt / t_rate;
    vn = turns ? 0 : vn + n_rate * step;
    vt = stops ? 0 : vt + t_rate * step;
    normal += step;
    tangential += ratio * step;
    if (ends) break;
  }
  return {v.vx + tangential / mass, v.vz + normal / mass, v.w + (rz * tangential - rx * normal) / inertia};
}

struct CornerCase {
  const char* name;
  double restitution, friction;
  Planar v;
};
void PrintTo(const CornerCase& c, std::ostream* os) { *os << c.name; }

/// Speeds after the lower edge of a leaning block of 0.8 x 0.6 x 0.3 m has hit the ground.
Planar run_corner(const CornerCase& c, double frequency, double angle_per_step, Planar* expected = nullptr) {
  Model m;
  m.gravity = {};
  m.contact.friction = c.friction;
  m.contact.restitution = c.restitution;
  m.contact.contact_frequency = frequency;
  Body b = make_box("block", 100, {0.4, 0.3, 0.15}, {});
  b.X_WB.q = exp_rotation({0, 0.5, 0});
  const Vec3 r = to_matrix(b.X_WB.q) * Vec3{0.4, 0, -0.15};
  b.X_WB.p.z = -r.z;
  b.v_WB = {c.v.vx, 0, c.v.vz};
  b.w_WB = {0, c.v.w, 0};
  add_body(m, b);
  if (expected) *expected = calc_impact(b.mass, b.inertia(1, 1), r.x, r.z, c.v, c.restitution, c.friction);
  Planar out;
  bool touched = false, parted = false;
  Options o = free_options(20 / frequency, angle_per_step / frequency);
  o.on_frame = [&](const View& v) {
    const bool touches = v.contact_force_ground.z > 0;
    touched = touched || touches;
    if (!parted) out = {v.v_WB[0].x, v.v_WB[0].z, v.w_WB[0].y};
    parted = parted || (touched && !touches);
  };
  (void)run(m, o);
  EXPECT_TRUE(touched);
  return out;
}

class CornerPhysics : public testing::TestWithParam<CornerCase> {};

TEST_P(CornerPhysics, FollowsTheTheoryOfImpulses) {
  const CornerCase& c = GetParam();
  Planar expected;
  // stiff, so that the block turns little during the impact
  const Planar v = run_corner(c, 5e4, 0.01, &expected);
  // of the speed at which the corner arrives, about 2 m/s; what is left is the dashpot's, whose rate suits one corner
  // without friction, and friction's, which needs some steps to stop a corner
  const double close = 1.5e-3 * 2, lever = 0.42;
  EXPECT_NEAR(v.vx, expected.vx, close);
  EXPECT_NEAR(v.vz, expected.vz, close);
  EXPECT_NEAR(v.w * lever, expected.w * lever, close);
  // the coarsest step that the engine would take by itself
  const Planar coarse = run_corner(c, 5e4, 0.18);
  EXPECT_NEAR(coarse.vx, expected.vx, 16 * close);
  EXPECT_NEAR(coarse.vz, expected.vz, 16 * close);
  EXPECT_NEAR(coarse.w * lever, expected.w * lever, 16 * close);
}

INSTANTIATE_TEST_SUITE_P(Cases, CornerPhysics,
                         testing::Values(CornerCase{"frictionless", 0.5, 0, {3, -2, 0.5}},
                                         CornerCase{"frictionless_plastic", 0.02, 0, {3, -2, 0.5}},
                                         CornerCase{"frictionless_elastic", 1, 0, {3, -2, 0.5}},
                                         CornerCase{"sliding", 0.5, 0.1, {3, -2, 0.5}},
                                         CornerCase{"sliding_back", 0.5, 0.1, {-3, -2, 0.5}},
                                         CornerCase{"sliding_plastic", 0.1, 0.1, {1, -2, 2}},
                                         CornerCase{"sticking_from_the_start", 0.5, 0.8, {0.86, -1, 0}},
                                         CornerCase{"sticking_later", 0.5, 0.8, {3, -2, 0.5}},
                                         CornerCase{"sticking_plastic", 0.1, 0.8, {1, -2, 2}}),
                         [](const auto& test) { return std::string(test.param.name); });

// ------------------------------------------------------------------------------------------------------ bounces

TEST(BounceReference, BallComesDownWhenItShould) {
  // dropped by 10 m, e = 0.5: times computed independently to 1e-11
  Model m;
  add_body(m, make_ball(10, 0.1, {0, 0, 10.1}));
  m.contact.restitution = 0.5;
  m.contact.contact_frequency = 5e4;  // each impact lasts about 0.1 ms
  Options o = free_options(4.4, 1e-6);
  o.frame_interval = 1e-4;
  std::vector<double> impacts;
  double rest = 0;
  double due = 0;  // when the flight seen last ends
  o.on_frame = [&](const View& v) {
    if (v.contact_force_ground.z > 0) return;
    rest = v.time;
    const double z = v.X_WB[0].p.z - 0.1, vz = v.v_WB[0].z;
    const double lands = v.time + (vz + std::sqrt(vz * vz + 2 * 9.81 * z)) / 9.81;
    if (lands > due + 0.05 && impacts.size() < 3) impacts.push_back(lands);
    due = lands;
  };
  const Summary s = run(m, o);
  ASSERT_EQ(impacts.size(), 3u);
  EXPECT_NEAR(impacts[0], 1.427843123, 1e-6);  // free flight
  EXPECT_NEAR(impacts[1], 2.855686246, 1e-3);
  EXPECT_NEAR(impacts[2], 3.569607807, 1e-3);
  EXPECT_NEAR(rest, 4.283529369, 1e-3);
  EXPECT_LT(s.energy_error, 1e-3);
}

TEST(BouncePhysics, RestitutionConvergesWithTheStep) {
  // share of the speed kept by a ball, over steps and where in a step the impact falls
  double worst[2] = {0, 0};
  for (int fine = 0; fine < 2; ++fine)
    for (const double e : {0.1, 0.5, 0.9})
      for (int phase = 0; phase < 7; ++phase) {
        Model m;
        m.gravity = {};
        m.contact.restitution = e;
        const double h = (fine ? 0.05 : 0.2) / m.contact.contact_frequency;
        Body ball = make_ball(10, 0.1, {0, 0, 0.1 + (2 + phase / 7.0) * h * 3});
        ball.v_WB = {0, 0, -3};
        add_body(m, ball);
        double v = 0;
        Options o = free_options(80 / m.contact.contact_frequency, h);
        o.on_frame = [&](const View& view) { v = view.v_WB[0].z; };
        (void)run(m, o);
        worst[fine] = std::max(worst[fine], std::abs(v / 3 - e));
      }
  EXPECT_LT(worst[0], 5e-3);
  EXPECT_LT(worst[1], 5e-4);  // second order would give a sixteenth, first a quarter
}

TEST(ImpactPhysics, OfAPairWithADashpotIsThatOfALinearOscillator) {
  // x = v/ω_d e^(-ζωt) sin ω_d t until the force k x + c x' would pull
  for (const double zeta : {0.1, 0.4}) {
    Model m;
    m.gravity = {};
    Body a = make_ball(3, 0.1, {0, 0, 0}), b = make_ball(6, 0.1, {0.2 + 1e-6, 0, 0});
    a.v_WB = {2, 0, 0};
    add_body(m, a);
    add_body(m, b);
    Contact::Pair p;
    p.a = {0}, p.b = {1};
    p.stiffness = 2e6;
    const double reduced = 2, omega = std::sqrt(p.stiffness / reduced), damped = omega * std::sqrt(1 - zeta * zeta);
    p.damping = 2 * zeta * omega * reduced;
    m.contact.pairs.push_back(p);
    // force is zero where tan(ω_d t) = 2 ζ sqrt(1-ζ²) / (2ζ²-1)
    const double end = std::atan2(2 * zeta * std::sqrt(1 - zeta * zeta), 2 * zeta * zeta - 1) / damped;
    const double speed =
        std::exp(-zeta * omega * end) * (std::cos(damped * end) - zeta * omega / damped * std::sin(damped * end));
    double parting = 0;
    Energy e;
    Options o = free_options(20 / omega, 0.02 / omega);
    o.on_frame = [&](const View& v) {
      parting = v.v_WB[1].x - v.v_WB[0].x;
      e = v.energy;
    };
    (void)run(m, o);
    EXPECT_NEAR(parting, -speed * 2, 1e-4 * 2) << zeta;
    EXPECT_NEAR(e.contact_loss, 0.5 * reduced * 4 * (1 - speed * speed), 2e-4 * 4);
    EXPECT_NEAR(e.residual, 0, 2e-4 * 4);
  }
}

// Where the first touch falls on a step, next to nothing is stored in it, and what the normal turns by within a step
// must not count for it.
TEST(ImpactPhysics, RestitutionDoesNotDependOnWhereInAStepBallsMeet) {
  const double step = 1e-4, speed = 4, e = 0.6;
  for (const double share : {0.0, 1e-10, 1e-6, 1e-4, 0.01, 0.3}) {
    Model m;
    m.gravity = {};
    m.contact.ground = false;
    m.contact.body_restitution = e;
    m.contact.body_friction = 0;
    const Vec3 n{std::sqrt(0.09), 0.15, 0.1};  // from one centre to the other as they meet
    Body a = make_ball(3, 0.2, {0, 0, 0}), b = make_ball(1, norm(n) - 0.2, n);
    a.v_WB = {speed, 0, 0};
    b.X_WB.p.x += (1000 - share) * step * speed;
    add_body(m, a);
    add_body(m, b);
    Vec3 apart;
    Options o = free_options(0.2, step);
    o.on_frame = [&](const View& v) { apart = v.v_WB[1] - v.v_WB[0]; };
    (void)run(m, o);
    EXPECT_NEAR(dot(apart, n) / (speed * n.x), e, 0.01) << share;
  }
}

/// Two bodies that meet without friction and part without loss: how much energy they keep, in a run of some steps.
double run_elastic(const Body& a, const Body& b, double step) {
  Model m;
  m.gravity = {};
  m.contact.ground = false;
  m.contact.body_restitution = 1;
  m.contact.body_friction = 0;
  add_body(m, a);
  add_body(m, b);
  Vec3 p, p0, spin, spin0;
  Energy e;
  double start = -1;
  int hits = 0;
  Options o = free_options(0.5, step);
  o.frame_interval = 0.01;
  o.on_happening = [&](const Happening& h) { hits += h.kind == Happening::Kind::BodyContact; };
  o.on_frame = [&](const View& v) {
    p = spin = {};
    for (size_t i = 0; i < 2; ++i) {
      const Mat3 R = to_matrix(v.X_WB[i].q);
      p += v.mass[i] * v.v_WB[i];
      spin += cross(v.X_WB[i].p, v.mass[i] * v.v_WB[i]) + R * (m.bodies[i].inertia * transpose_times(R, v.w_WB[i]));
    }
    e = v.energy;
    if (start < 0) p0 = p, spin0 = spin, start = e.kinetic;
  };
  (void)run(m, o);
  EXPECT_EQ(hits, 1);
  EXPECT_LT(norm(p - p0), 1e-12 * norm(p0));
  EXPECT_LT(norm(spin - spin0), 1e-9);  // the midpoint rule's error in free flight
  EXPECT_EQ(e.contact, 0);
  // the ledger sees what is wrong
  EXPECT_NEAR(e.residual, e.kinetic + e.contact_loss - start, 1e-9 * std::max(1.0, start));
  return e.kinetic / start - 1;
}

TEST(ImpactPhysics, ElasticCollisionsKeepMomentumAndEnergy) {
  Body ball = make_ball(2, 0.3, {-0.3, 1.2, 0.1}), other = make_ball(1, 0.2, {-0.1, 0.5, 0});
  ball.v_WB = {0.5, -3, 0};
  Body box = make_box("box", 1, {0.3, 0.4, 0.5}, {0, 0, 0});
  box.X_WB.q = exp_rotation({0.3, 0.5, 0.2});
  box.w_WB = {0.4, -0.3, 1};
  for (const Body& b : {other, box}) {
    // the error falls with the square of the step, and with where in a step they meet
    EXPECT_NEAR(run_elastic(ball, b, 4e-5), 0, 1e-3);
    EXPECT_NEAR(run_elastic(ball, b, 1e-5), 0, 6e-5);
  }
  // corners on a face: their share of the stiffness changes a little while they slide
  Body cube = make_box("cube", 3, {0.5, 0.5, 0.5}, {-1.2, -0.3, -0.25});
  cube.v_WB = {2, 0, 0};
  EXPECT_NEAR(run_elastic(cube, box, 1e-5), 0, 3e-3);
}

TEST(ImpactPhysics, PanelsWhoseLongEdgesCrossMakeNoEnergy) {
  // the corner of the common area where edges that are all but parallel cross runs along them
  const double tilt = std::numbers::pi / 12;
  const Vec3 half{1.2, 0.075, 1.4};
  const Body lower = make_box("lower", 2000, half, {0, 0, -half.z});
  for (const double slide : {0.03, 0.05, 0.07, 0.1, 0.2})
    for (const double turn : {0.001, 0.002, 0.003, 0.004, 0.006}) {
      Body upper = make_box("upper", 2000, half, {});
      upper.X_WB.q = exp_rotation({0, 0, turn}) * exp_rotation({0, tilt, 0});
      const Vec3 lowest = to_matrix(upper.X_WB.q) * Vec3{half.x, 0, -half.z};
      upper.X_WB.p = Vec3{0.3, 0, 0.001} - lowest;
      upper.v_WB = {0, slide, -5};
      const double change = run_elastic(lower, upper, 1e-4);
      EXPECT_LT(change, 1e-4) << slide << " " << turn;
      // where they hardly slide, the new corners can store less
      EXPECT_GT(change, slide > 15 * turn ? -1e-4 : -0.3) << slide << " " << turn;
    }
}

// ------------------------------------------------------------------------------------------------------ slopes

/// Ground that slopes by 30° along x, and where a body of the given height above it has its centre.
Model make_slope(double friction) {
  const double a = std::numbers::pi / 6;
  Model m;
  m.contact.normal = {std::sin(a), 0, std::cos(a)};
  m.contact.friction = friction;
  return m;
}

/// A flat box on a slope, sunk in as it is at rest.
Body make_slider(const Model& m, double speed_uphill) {
  const double a = std::numbers::pi / 6, frequency = m.contact.contact_frequency;
  const double sunk = 9.81 * std::cos(a) / (4 * 0.504 * frequency * frequency);
  Body b = make_box("box", 100, {1, 1, 0.05}, (0.05 - sunk) * m.contact.normal);
  b.X_WB.q = exp_rotation({0, a, 0});
  b.v_WB = -speed_uphill * Vec3{std::cos(a), 0, -std::sin(a)};
  return b;
}

/// A plate of n corners at 2 m from its middle, 0.2 m thick; a box of 4 x 4 m for four.
Shape make_plate(int corners) {
  if (corners == 4) return make_box("", 1, {2, 2, 0.1}, {}).shapes[0];
  Shape s;
  s.kind = Shape::Kind::Hull;
  for (int i = 0; i < corners; ++i)
    for (const double z : {-0.1, 0.1})
      s.vertices.push_back(
          {2 * std::cos(2 * std::numbers::pi * i / corners), 2 * std::sin(2 * std::numbers::pi * i / corners), z});
  return s;
}

enum class On { Ground, Box, GroundBesideADrum };
struct Hop {
  double height = 0;  // [m]
  bool gives_back = false;
  Vec3 end;
};

/// How high a plate of 2.4 t rises that falls by 3 m, one edge 8 cm lower than the other, on 250 rad/s, and whether its
/// dashpots ever give back what they have lost.
Hop find_hop(double restitution, double step, On on, int corners = 4) {
  Model m;
  m.contact.contact_frequency = 250;
  m.contact.restitution = m.contact.body_restitution = restitution;
  m.contact.ground = on != On::Box, m.contact.bodies = on != On::Ground;
  Body slab = make_box("slab", 2400, {2, 2, 0.1}, {0, 0, 3.1});
  slab.shapes = {make_plate(corners)};
  slab.X_WB.q = exp_rotation({0.02, 0, 0});
  add_body(m, slab);
  if (on == On::Box) {
    Body floor = make_box("floor", 1, {10, 10, 1}, {0, 0, -1});
    floor.fixed = true;
    add_body(m, floor);
  } else if (on == On::GroundBesideADrum) {
    Body drum = make_box("drum", 2400, {2, 2, 0.1}, {50, 0, 0.1});
    drum.shapes = {make_plate(20)};
    add_body(m, drum);
  }
  Options o = free_options(1.2, step);
  o.frame_interval = 2e-3;
  Hop out;
  bool has_landed = false;
  double lost = 0, most = 0;
  o.on_frame = [&](const View& v) {
    has_landed = has_landed || v.centre[0].z < 0.1;
    if (has_landed) out.height = std::max(out.height, v.centre[0].z - 0.1);
    lost = std::max(lost, v.energy.contact_loss), most = std::max(most, lost - v.energy.contact_loss);
    out.end = v.centre[0];
  };
  (void)run(m, o);
  out.gives_back = most > 1e-3 * lost;
  return out;
}

// Dashpots that stop all within a step stop its heave and both of its turns, as they do in steps that resolve them.
TEST(ImpactPhysics, ASlabThatLandsOnAnEdgeHopsAsItDoesInFineSteps) {
  for (const On on : {On::Ground, On::Box})
    for (const double restitution : {0.0, 0.05, 0.1, 0.2}) {
      const double fine = find_hop(restitution, 2e-5, on).height;
      for (const double step : {1e-3, 5e-4})
        EXPECT_NEAR(find_hop(restitution, step, on).height, fine, 0.15 * fine + 1e-3)
            << restitution << " " << step << " " << (on == On::Box);
    }
}

// Where the limits cut what several directions ask for, one of them may be better.
TEST(ImpactPhysics, PlatesOfManyCornersHopAsTheyDoInFineSteps) {
  for (const int corners : {6, 8, 14})
    for (const double restitution : {0.0, 0.1}) {
      const double fine = find_hop(restitution, 2e-5, On::Ground, corners).height;
      for (const double step : {1e-3, 3e-4}) {  // the latter is the engine's own
        const Hop hop = find_hop(restitution, step, On::Ground, corners);
        EXPECT_NEAR(hop.height, fine, 0.25 * fine + 3e-3) << corners << " " << restitution << " " << step;
        if (step < 5e-4) { EXPECT_FALSE(hop.gives_back) << corners << " " << restitution; }
      }
    }
}

// In one block of the kernel there are groups of twenty points, too.
TEST(ImpactPhysics, ASlabLandsAsItDoesBesideADrumOfManyCorners) {
  for (const double restitution : {0.0, 0.1})
    EXPECT_NEAR(find_hop(restitution, 1e-3, On::GroundBesideADrum).height,
                find_hop(restitution, 1e-3, On::Ground).height, 2e-3);
}

TEST(SlopeReference, BoxSlidesDownAtItsAcceleration) {
  Model m = make_slope(0.3);
  add_body(m, make_slider(m, 0));
  Vec3 start, at;
  Energy e;
  Options o = free_options(1, 1e-4);
  o.on_frame = [&](const View& v) {
    if (v.time == 0) start = v.X_WB[0].p;
    at = v.X_WB[0].p;
    e = v.energy;
  };
  const Summary s = run(m, o);
  const double way = norm(at - start);
  EXPECT_NEAR(2 * way, 2.356287237, 1e-3 * 2.356287237);
  EXPECT_NEAR(e.friction, 0.3 * 100 * 9.81 * std::cos(std::numbers::pi / 6) * way, 1e-3 * e.friction);
  EXPECT_LT(s.energy_error, 1e-4);
}

TEST(SlopeReference, BoxThrownUphillStopsWhereItShould) {
  Model m = make_slope(0.3);
  add_body(m, make_slider(m, 5));
  double highest = 0, when = 0;
  Vec3 start;
  Options o = free_options(1, 1e-4);
  o.on_frame = [&](const View& v) {
    if (v.time == 0) start = v.X_WB[0].p;
    const double d = -(v.X_WB[0].p - start).x / std::cos(std::numbers::pi / 6);
    if (d > highest) highest = d, when = v.time;
  };
  (void)run(m, o);
  EXPECT_NEAR(highest, 1.677016595, 1e-3);
  EXPECT_NEAR(when, 0.670806638, 1e-3);
}

TEST(SlopePhysics, BallRollsWithFiveSeventhsOfItsFreeAcceleration) {
  Model m = make_slope(0.3);  // tan 30° · 2/7 = 0.165 suffices
  const double a = std::numbers::pi / 6, frequency = m.contact.contact_frequency;
  const double radius = 0.2, sunk = 9.81 * std::cos(a) / (0.504 * frequency * frequency);
  add_body(m, make_ball(50, radius, (radius - sunk) * m.contact.normal));
  Vec3 start, at, w;
  Energy e;
  Options o = free_options(1, 1e-4);
  o.on_frame = [&](const View& v) {
    if (v.time == 0) start = v.X_WB[0].p;
    at = v.X_WB[0].p;
    w = v.w_WB[0];
    e = v.energy;
  };
  (void)run(m, o);
  const double expected = 5.0 / 7 * 9.81 * 0.5;
  EXPECT_NEAR(2 * norm(at - start), expected, 1e-3 * expected);
  EXPECT_NEAR(w.y, expected / radius, 1e-3 * expected / radius);
  EXPECT_NEAR(e.friction, 0, 1e-3 * e.released);
}

TEST(SlopePhysics, TurningBoxIsStoppedByTheFrictionOfItsCorners) {
  // a square box spins on the floor: four corners at the same distance r slide with μ m g / 4 each, so that
  // ω' = -μ m g r / J
  Model m;
  m.contact.friction = 0.4;
  const double sunk = 9.81 / (4 * 0.504 * 1500 * 1500);
  Body b = make_box("box", 200, {0.5, 0.5, 0.1}, {0, 0, 0.1 - sunk});
  b.w_WB = {0, 0, 3};
  add_body(m, b);
  const double slows = 0.4 * 200 * 9.81 * std::hypot(0.5, 0.5) / b.inertia(2, 2);
  Options o = free_options(0.2, 1e-4);
  double at_tenth = 0, at_end = 1, turned = 0;
  o.on_frame = [&](const View& v) {
    if (v.time < 0.1) at_tenth = v.w_WB[0].z - slows * (0.1 - v.time);
    at_end = v.w_WB[0].z;
    turned = log_rotation(v.X_WB[0].q).z;
  };
  (void)run(m, o);
  EXPECT_NEAR(at_tenth, 3 - 0.1 * slows, 1e-3 * 3);
  EXPECT_NEAR(at_end, 0, 1e-3);
  EXPECT_NEAR(turned, 0.5 * 9 / slows, 2e-3 * 0.5 * 9 / slows);
}

// ------------------------------------------------------------------------------------------------------ rocking

/// Block of half width b and half height h that leans on its right lower edge (y axis) by an angle.
Body make_leaning(double half_width, double half_height, double angle) {
  Body block = make_box("block", 500, {half_width, 0.5, half_height}, {});
  block.X_WB.q = exp_rotation({0, angle, 0});
  const Mat3 R = to_matrix(block.X_WB.q);
  block.X_WB.p = Vec3{half_width, 0, 0} - R * Vec3{half_width, 0, -half_height};
  return block;
}

double lean_of(const Pose& X) { return std::atan2(to_matrix(X.q)(0, 2), to_matrix(X.q)(2, 2)); }

TEST(CornerReference, BlockThatFallsFromOneEdgeOntoTheOtherKeepsItsShareOfSpin) {
  // 12 x 19: ω after / before = 0.572277228 (references/README). The spin is read from how high the block rises.
  const double b = 0.6, h = 0.95, start = 0.1, radius = std::hypot(b, h), lean = std::atan2(b, h);
  const auto lift = [&](double angle) { return radius * (std::cos(lean - angle) - std::cos(lean)); };
  std::vector<double> error;
  for (const double frequency : {3000.0, 12000.0}) {
    Model m;
    m.contact.friction = 2;
    m.contact.restitution = 0;
    m.contact.contact_frequency = frequency;
    add_body(m, make_leaning(b, h, start));
    double most = 0;
    Options o = free_options(0.7, 0.1 / frequency);
    o.frame_interval = 1e-3;
    o.on_frame = [&](const View& v) { most = std::max(most, -lean_of(v.X_WB[0])); };
    (void)run(m, o);
    error.push_back(std::sqrt(lift(most) / lift(start)) - 0.572277228);
  }
  EXPECT_NEAR(error[1], 0, 1e-3);
  EXPECT_LT(std::abs(error[1]), std::abs(error[0]));
}

TEST(CornerPhysics, RockingBlockKeepsHousnersTimes) {
  // θ'' = -p² sin(α - θ), p² = 3 g / (4 R), from rest at θ0 to 0; each impact keeps 1 - 1.5 sin²α of the spin
  const double b = 0.12, h = 0.6, start = 0.08, radius = std::hypot(b, h), lean = std::atan2(b, h);
  const double p2 = 3 * 9.81 / (4 * radius);
  const auto calc_quarter = [&](double amplitude) {
    // time from 0 to the amplitude, with θ = A (1 - s²) against the singularity at rest
    double t = 0;
    constexpr int n = 4000;
    for (int i = 0; i < n; ++i) {
      const double s = (i + 0.5) / n, angle = amplitude * (1 - s * s);
      const double speed2 = 2 * p2 * (std::cos(lean - amplitude) - std::cos(lean - angle));
      t += 2 * amplitude * s / n / std::sqrt(speed2);
    }
    return t;
  };
  const double kept = 1 - 1.5 * std::pow(std::sin(lean), 2);
  std::vector<double> expected{calc_quarter(start)};
  double amplitude = start;
  for (int i = 0; i < 3; ++i) {
    // cos(α - A') - cos α = kept² (cos(α - A) - cos α)
    amplitude = lean - std::acos(std::cos(lean) + kept * kept * (std::cos(lean - amplitude) - std::cos(lean)));
    expected.push_back(expected.back() + 2 * calc_quarter(amplitude));
  }
  Model m;
  m.contact.friction = 2;
  m.contact.restitution = 0;
  m.contact.contact_frequency = 1.2e4;
  add_body(m, make_leaning(b, h, start));
  std::vector<double> crossings;
  double before = start, t_before = 0;
  Options o = free_options(expected.back() + 0.05, 1e-5);
  o.frame_interval = 1e-4;
  o.on_frame = [&](const View& v) {
    const double now = lean_of(v.X_WB[0]);
    if (now * before < 0) crossings.push_back(t_before + (v.time - t_before) * before / (before - now));
    before = now, t_before = v.time;
  };
  (void)run(m, o);
  ASSERT_GE(crossings.size(), expected.size());
  for (size_t i = 0; i < expected.size(); ++i) EXPECT_NEAR(crossings[i], expected[i], 3e-3 * expected[i]) << i;
}

}  // namespace
}  // namespace topple::mbs
