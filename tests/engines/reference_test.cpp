// Engines from elsewhere against numbers from elsewhere: outputs of MSC.ADAMS (tests/data/adams/README.md), the IFToMM
// benchmark library of multibody systems, closed forms.

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "cases.h"

namespace topple::engines {
namespace {

using test::make_options;
using Kind = mbs::Joint::Kind;

struct Adams {
  std::string name;
  mbs::Model model;
  double place = 2e-5;     // [m]; an independent integration reproduces Revolute_Case01 within 5e-6 m
  double relative = 0;     // further share of the distance from the origin: half of the sixth digit
  double reaction = 1e-4;  // over the largest; 0: the file has none
};

Adams adams_revolute() { return {"Revolute_Case01", test::make_bar(Kind::Revolute, test::z_along_y())}; }

/// These two files show the pendulum of Revolute_Case01 and differ from it by 9.1e-4 m: it is ADAMS that was less
/// accurate there (AdamsPendulumsAreOne).
constexpr double kLoose = 1e-3;

Adams adams_spherical() { return {"Spherical_Case01", test::make_bar(Kind::Spherical, {}), kLoose, 0, kLoose}; }

Adams adams_universal() {
  // the bar along y; F has its first axis along x, M its second along the bar
  mbs::Model m = test::make_empty({0, 0, -test::kAdamsGravity});
  mbs::add_body(m, test::make_body("bar", 1, {0.1, 0.04, 0.1}, {0, 2, 0}));
  mbs::add_joint(m, test::make_joint(m, Kind::Universal, mbs::kGround, {0}, {}));
  return {"Universal_Case01", m, kLoose, 0, kLoose};
}

Adams adams_prismatic() { return {"Prismatic_Case01", test::make_bar(Kind::Prismatic, {}), 2e-5, 5e-6, 0}; }

Adams adams_cylindrical() { return {"Cylindrical_Case01", test::make_bar(Kind::Cylindrical, {}), 2e-5, 5e-6, 0}; }

Adams adams_rotational_spring() {
  Adams a = {"RotSpring_Case01", test::make_bar(Kind::Revolute, test::z_along_y())};
  mbs::RotationalSpring s;
  s.joint = {0};
  s.spring.rate = 200;
  s.damper.rate = 10;
  a.model.rotational_springs.push_back(s);
  return a;
}

Adams adams_translational_spring() {
  mbs::Model m = test::make_empty({0, 0, -test::kAdamsGravity});
  mbs::add_body(m, test::make_body("mass", 1, {0.04, 0.1, 0.1}, {0, 2, 0}));
  mbs::SpringDamper s;
  s.a = mbs::kGround;
  s.b = {0};
  s.free_length = 2;
  s.spring.rate = 100;
  s.damper.rate = 5;
  m.springs.push_back(s);
  return {"TranSpring_Case02", m};
}

/// An engine and the step of these tests.
struct Subject {
  std::string engine;
  double step;      // [s]; 0: its own
  double loop;      // how near a chain closed by a loop comes [m]
  double singular;  // and one that passes singular positions
};

std::vector<Subject> subjects() {
  // Simbody: accuracy 1e-9 over some thousand steps. MuJoCo: fourth order with 1 ms, loops closed by soft welds.
  return {{"simbody", 0, 1e-6, 5e-3}, {"mujoco", 1e-3, 1e-3, 1e-3}};
}

class EnginesReference : public testing::TestWithParam<Subject> {
 protected:
  test::Course run(const mbs::Model& model, double duration, double interval, double part_of_step = 1) {
    const double step = part_of_step * GetParam().step;
    return test::run(*make_engine(GetParam().engine), model, make_options(duration, interval, step));
  }
  void check_adams(const Adams& a) {
    const auto place = test::read_adams(a.name + "_ADAMS_Pos.txt");
    const auto reaction = test::read_adams(a.name + "_ADAMS_Rforce.txt");
    ASSERT_EQ(place.size(), 501U);
    ASSERT_EQ(reaction.size(), place.size());
    const auto c = run(a.model, 5, 0.01);
    ASSERT_EQ(c.summary.ending, mbs::Summary::Ending::TimeLimit) << c.summary.message;
    ASSERT_EQ(c.frames.size(), place.size());
    double force_off = 0, largest = 0;
    for (size_t i = 0; i < place.size(); ++i) {
      const Vec3 p{place[i][1], place[i][2], place[i][3]}, f{reaction[i][1], reaction[i][2], reaction[i][3]};
      EXPECT_NEAR(c.frames[i].time, place[i][0], 1e-9);
      EXPECT_LT(norm(c.frames[i].X_WB[0].p - p), a.place + a.relative * norm(p)) << "at " << place[i][0] << " s";
      force_off = std::max(force_off, norm(c.frames[i].ground_force + f));
      largest = std::max(largest, norm(f));
    }
    if (a.reaction > 0) { EXPECT_LT(force_off, a.reaction * largest); }
    EXPECT_LT(c.summary.energy_error, 1e-7);  // of what was released; the damper's rotational spring has 3e-8
    EXPECT_LT(c.summary.joint_drift, 1e-12);  // relative coordinates cannot drift
  }
};

#define NEEDS_ENGINE() TOPPLE_NEEDS_ENGINE(GetParam().engine)

TEST_P(EnginesReference, AdamsRevolute) {
  NEEDS_ENGINE();
  check_adams(adams_revolute());
}
TEST_P(EnginesReference, AdamsSpherical) {
  NEEDS_ENGINE();
  check_adams(adams_spherical());
}
TEST_P(EnginesReference, AdamsUniversal) {
  NEEDS_ENGINE();
  check_adams(adams_universal());
}
TEST_P(EnginesReference, AdamsPrismatic) {
  NEEDS_ENGINE();
  check_adams(adams_prismatic());
}
TEST_P(EnginesReference, AdamsCylindrical) {
  NEEDS_ENGINE();
  check_adams(adams_cylindrical());
}
TEST_P(EnginesReference, AdamsRotationalSpring) {
  NEEDS_ENGINE();
  check_adams(adams_rotational_spring());
}
TEST_P(EnginesReference, AdamsTranslationalSpring) {
  NEEDS_ENGINE();
  check_adams(adams_translational_spring());
}

// The ball and the universal joint leave the bar in the hinge's plane: the accurate file holds for all three.
TEST_P(EnginesReference, AdamsPendulumsAreOne) {
  NEEDS_ENGINE();
  const auto place = test::read_adams("Revolute_Case01_ADAMS_Pos.txt");
  for (const Adams& a : {adams_spherical(), adams_universal()}) {
    const auto c = run(a.model, 5, 0.01);
    ASSERT_EQ(c.frames.size(), place.size());
    for (size_t i = 0; i < place.size(); ++i) {
      const Vec3 p = c.frames[i].X_WB[0].p;
      EXPECT_LT(std::hypot(p.x + p.y - place[i][1], p.z - place[i][3]), 2e-5)
          << a.name << " at " << place[i][0] << " s";
    }
  }
}

TEST_P(EnginesReference, PendulumOfTheBenchmark) {
  NEEDS_ENGINE();
  // IFToMM: a point of 1 kg on 1 m, from the horizontal. Bodies have inertia: hung at a ball joint of the mass point's
  // own orientation it would be a rod's; here the mass is guided by a distance, which leaves it its orientation.
  mbs::Model m = test::make_empty({0, 0, -9.81});
  mbs::add_body(m, test::make_body("mass", 1, {1, 1, 1}, {-1, 0, 0}));
  mbs::Joint j;
  j.kind = Kind::Distance;
  j.parent = mbs::kGround;
  j.child = {0};
  mbs::add_joint(m, j);
  const auto c = run(m, 10, 1);
  ASSERT_EQ(c.frames.size(), 11U) << c.summary.message;
  const auto off = [&](size_t i, double x, double z) {
    const Vec3 p = c.frames[i].X_WB[0].p;
    return std::hypot(p.x - x, p.z - z);
  };
  EXPECT_LT(off(1, 0.986291751, -0.165010853), GetParam().loop);
  EXPECT_LT(off(10, -0.275087463, -0.961419205), 3 * GetParam().loop);
  EXPECT_NEAR(norm(c.frames[1].joint_force[0]), 3 * 9.81 * 0.165010853, 1e-3 * 9.81);  // 3 m g cos of the angle
}

TEST_P(EnginesReference, TorqueFreeTop) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_empty({});
  mbs::Body b = test::make_body("top", 1, {1, 2, 3}, {});
  b.w_WB = {0.1, 1, 0.1};
  mbs::add_body(m, b);
  const auto c = run(m, 10, 10);
  ASSERT_EQ(c.frames.size(), 2U) << c.summary.message;
  const Vec3 w = transpose_times(to_matrix(c.frames[1].X_WB[0].q), c.frames[1].w_WB[0]);
  EXPECT_LT(norm(w - Vec3{-0.304543317, -0.957733454, 0.193861318}), 1e-6);
}

TEST_P(EnginesReference, SteadyPrecession) {
  NEEDS_ENGINE();
  // heavy symmetric top on a ball joint: (Jt + m l²) Ω² cos θ - Ja ω3 Ω + m g l = 0
  const double tilt = std::numbers::pi / 6, spin = 20, Jt = 0.3, Ja = 0.5, g = 9.81, A = (Jt + 1) * std::cos(tilt);
  for (const double sign : {-1.0, 1.0}) {
    const double precession = (Ja * spin + sign * std::sqrt(Ja * Ja * spin * spin - 4 * A * g)) / (2 * A);
    mbs::Model m = test::make_empty({0, 0, -g});
    mbs::Body b = test::make_body("top", 1, {Jt, Jt, Ja}, {});
    const Vec3 axis{std::sin(tilt), 0, std::cos(tilt)};
    b.X_WB = {axis, exp_rotation({0, tilt, 0})};
    b.w_WB = Vec3{0, 0, precession} + (spin - precession * std::cos(tilt)) * axis;
    b.v_WB = cross(b.w_WB, axis);
    mbs::add_body(m, b);
    mbs::add_joint(m, test::make_joint(m, Kind::Spherical, mbs::kGround, {0}, {}));
    const auto c = run(m, 3, 0.5, 0.25);
    ASSERT_EQ(c.frames.size(), 7U) << c.summary.message;
    for (const mbs::View& v : c.frames) {
      const double turned = precession * v.time;
      const Vec3 p{std::sin(tilt) * std::cos(turned), std::sin(tilt) * std::sin(turned), std::cos(tilt)};
      EXPECT_LT(norm(v.X_WB[0].p - p), 1e-5) << "at " << v.time << " s";
    }
  }
}

/// Two uniform rods of 1 m and 1 kg in a plane, from the horizontal, at rest.
TEST_P(EnginesReference, TwoRods) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_empty({0, 0, -9.81});
  const Vec3 rod{1e-6, 1.0 / 12, 1.0 / 12};
  mbs::add_body(m, test::make_body("upper", 1, rod, {0.5, 0, 0}));
  mbs::add_body(m, test::make_body("lower", 1, rod, {1.5, 0, 0}));
  mbs::add_joint(m, test::make_joint(m, Kind::Revolute, mbs::kGround, {0}, {{}, test::z_along_y()}));
  mbs::add_joint(m, test::make_joint(m, Kind::Revolute, {0}, {1}, {{1, 0, 0}, test::z_along_y()}));
  const auto c = run(m, 2, 1);
  ASSERT_EQ(c.frames.size(), 3U) << c.summary.message;
  // angles from the downward vertical, 90° at the start
  const auto angle = [&](size_t frame, size_t body) {
    const Vec3 x = to_matrix(c.frames[frame].X_WB[body].q).column(0);
    return std::atan2(x.x, -x.z);
  };
  EXPECT_NEAR(angle(1, 0), -1.207716238, 1e-5);
  EXPECT_NEAR(angle(1, 1), -0.814391023, 1e-5);
  EXPECT_NEAR(-c.frames[1].w_WB[0].y, -3.406517533, 1e-5);
  EXPECT_NEAR(-c.frames[1].w_WB[1].y, -0.516045472, 1e-5);
  EXPECT_NEAR(angle(2, 0), -0.082758307, 1e-4);  // chaotic: errors grow
  EXPECT_NEAR(angle(2, 1), 0.407362075, 1e-4);
}

/// Three upright links of 1 m and 1 kg and two couplers: one degree of freedom, seven hinges, and positions in which
/// all links lie in one line.
TEST_P(EnginesReference, FourBarOfTwoLoops) {
  NEEDS_ENGINE();
  mbs::Model m = test::make_empty({0, 0, -9.81});
  for (int i = 0; i < 3; ++i) {
    mbs::Body link = test::make_body("link", 1, {1.0 / 12, 1.0 / 12, 1e-6}, {1.0 * i, 0, 0.5});
    link.v_WB = {0.5, 0, 0};
    link.w_WB = {0, 1, 0};
    mbs::add_body(m, link);
  }
  for (int i = 0; i < 2; ++i) {
    mbs::Body coupler = test::make_body("coupler", 1, {1e-6, 1.0 / 12, 1.0 / 12}, {i + 0.5, 0, 1});
    coupler.v_WB = {1, 0, 0};
    mbs::add_body(m, coupler);
  }
  const auto hinge = [&](mbs::BodyId a, mbs::BodyId b, const Vec3& p) {
    mbs::add_joint(m, test::make_joint(m, Kind::Revolute, a, b, {p, test::z_along_y()}));
  };
  for (int i = 0; i < 3; ++i) hinge(mbs::kGround, {i}, {1.0 * i, 0, 0});
  for (int i = 0; i < 2; ++i) {
    hinge({i}, {3 + i}, {1.0 * i, 0, 1});
    hinge({3 + i}, {i + 1}, {i + 1.0, 0, 1});
  }
  const auto B0 = [&](const mbs::View& v) { return v.X_WB[0] * Vec3{0, 0, 0.5}; };
  // up to the first position in which all links lie in one line, at 0.714355529 s: 3 θ'' = 3.5 g sin θ
  double angle = 0, rate = 1, time = 0;
  const auto fall = run(m, 0.7, 0.1);
  ASSERT_EQ(fall.frames.size(), 8U) << fall.summary.message;
  for (const mbs::View& v : fall.frames) {
    constexpr double h = 1e-5;  // leapfrog: 1e-9 over this time
    for (; time < v.time - 0.5 * h; time += h) {
      rate += 0.5 * h * 3.5 * 9.81 / 3 * std::sin(angle);
      angle += h * rate;
      rate += 0.5 * h * 3.5 * 9.81 / 3 * std::sin(angle);
    }
    EXPECT_LT(norm(B0(v) - Vec3{std::sin(angle), 0, std::cos(angle)}), GetParam().loop) << "at " << v.time << " s";
  }
  EXPECT_LT(fall.summary.energy_error, 1e-5);
  const auto c = run(m, 10, 10);
  if (GetParam().engine == "simbody" && c.summary.ending == mbs::Summary::Ending::Diverged) {
    // Whether Simbody finds its way through that position hangs on the last digits of the LAPACK that is installed;
    // where it does not, it says when and why, and that is all that can be asked of it.
    EXPECT_GT(c.summary.time, 0.714);
    EXPECT_NE(c.summary.message.find("diverged at"), std::string::npos) << c.summary.message;
    return;
  }
  ASSERT_EQ(c.frames.size(), 2U) << c.summary.message;
  // eight times through that position, where the loops do not say how the links go on: Simbody's energy changes by
  // 7e-4 there, MuJoCo's by 6e-5
  EXPECT_LT(norm(B0(c.frames[1]) - Vec3{0.328458112, 0, 0.944518538}), GetParam().singular);
  EXPECT_LT(c.summary.joint_drift, GetParam().loop);
}

INSTANTIATE_TEST_SUITE_P(Each, EnginesReference, testing::ValuesIn(subjects()),
                         [](const testing::TestParamInfo<Subject>& subject) { return subject.param.engine; });

}  // namespace
}  // namespace topple::engines
