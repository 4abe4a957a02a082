// Acceleration of slow iterations, and the dead-load equilibria that need it.
#include "mbs/acceleration.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mbs/system.h"
#include "models.h"

namespace topple::mbs {
namespace {

using Vector = Acceleration::Vector;

/// r(x) = b - A x, stepped with K = 1: x comes nearer by the least part of A in a step.
struct Slow {
  Vector soft{{1, 0.5, 1e-2, 1e-4, 1e-5}}, b{{1, 2, 3, 4, 5}}, x = Vector::Zero(5);
  Vector residual() const { return b - soft.cwiseProduct(x); }
  double left() const { return residual().norm(); }
};

TEST(Acceleration, FindsInAFewStepsWhatTakesAHundredThousand) {
  Slow plain, quick;
  Acceleration a;
  for (int i = 0; i < 40; ++i) {
    plain.x += plain.residual();
    const Vector r = quick.residual();
    if (r.norm() < 1e-9) break;
    ASSERT_TRUE(a.accepts(r, r)) << i;
    quick.x += a.improve(r, r);
  }
  EXPECT_LT(quick.left(), 1e-9);
  EXPECT_GT(plain.left(), 1);
}

TEST(Acceleration, LetsOthersFollowTheSameCombinations) {
  // the sixth is a sum of the steps: where x is found it is what x is
  Slow s;
  Acceleration a;
  double other = 0;
  for (int i = 0; i < 40 && s.left() > 1e-9; ++i) {
    const Vector r = s.residual();
    Vector step(6);
    step << r, r[3];
    ASSERT_TRUE(a.accepts(step, r)) << i;
    const Vector way = a.improve(step, r);
    s.x += way.head(5), other += way[5];
  }
  EXPECT_LT(s.left(), 1e-9);
  EXPECT_NEAR(other, s.x[3], 1e-9 * s.x[3]);
}

TEST(Acceleration, GoesBackFromWhereItsStepsLedAway) {
  // a plateau that ends at a wall: what it has seen says go far, and there r is large
  const auto push = [](double x) { return x < 50 ? 1 - 1e-6 * x : 1 - 1e-6 * x - (x - 50) * (x - 50) * 40; };
  Acceleration a;
  double x = 0, begun = 0, begun_push = 0;
  int back = 0, rounds = 0;
  for (; rounds < 400 && std::abs(push(x)) > 1e-6; ++rounds) {
    Vector r(1);
    r[0] = push(x);
    if (a.accepts(r, r)) {
      begun = x, begun_push = r[0];
    } else {
      ++back, x = begun, r[0] = begun_push;
      EXPECT_EQ(a.improve(r, r)[0], r[0]);
      EXPECT_TRUE(a.is_plain());
      x += r[0];
      continue;
    }
    x += a.improve(r, r)[0];
  }
  EXPECT_GT(back, 0);
  EXPECT_LT(std::abs(push(x)), 1e-6) << x << " after " << rounds;
}

/// Floors in a row, each on a column that is crushed at 1 MN and an elastic one with a 10^4th of its stiffness.
Model make_crushed(int floors, double weight) {
  Model m;
  m.contact.ground = m.contact.bodies = false;
  ZoneLaw law;
  law.name = "crushed";
  law.compression = {{0, 5}, {1e6, 1e6}};
  law.crush_length = 9;
  const LawId id = add_law(m, law);
  BodyId before = kGround;
  for (int i = 0; i < floors; ++i) {
    Body b = test::make_box("floor " + std::to_string(i), weight / 9.81, {1, 1, 0.1}, {0, 0, 10.0 * (i + 1)});
    const BodyId body = add_body(m, b);
    for (const bool is_soft : {false, true}) {
      ZoneElement e;
      e.name = (is_soft ? "soft " : "column ") + std::to_string(i), e.a = before, e.b = body;
      e.X_AF = {{0, 0, i == 0 ? 10.0 : 10.0}, test::upright()};
      e.X_BM = {{0, 0, 0}, test::upright()};
      const double k = is_soft ? 1e6 : 1e10;
      e.translational_stiffness = {k, 1e10, 1e10};
      e.rotational_stiffness = {1e10, 1e10, 1e10};
      if (!is_soft) e.stations = {{0, id}};
      add_element(m, e);
    }
    before = body;
  }
  return m;
}

TEST(DeadLoad, IsFoundWhereHardlyAnyStiffnessIsLeft) {
  // 0.5 MN a floor: the lowest column has 1.5 MN to carry, the next one 1 MN and a bit less
  System s(make_crushed(3, 0.5e6), {}, 0);
  std::string message;
  ASSERT_TRUE(s.find_equilibrium(message)) << message;
  EXPECT_NEAR(Vec3(s.state.p[0]).z, 10 - 0.5, 1e-4) << "what is beyond 1 MN presses the soft column";
  EXPECT_LT(s.summary.equilibrium_iterations, 100);
  EXPECT_LT(s.summary.equilibrium_residual, 1e-8);
  EXPECT_TRUE(s.summary.overloads.empty()) << "it stands";
}

TEST(DeadLoad, SaysWhatIsLeftWhereThereIsNone) {
  Model m = make_crushed(2, 0.8e6);
  m.elements.erase(m.elements.begin() + 1);  // nothing beside the lowest column
  System s(m, {}, 0);
  std::string message;
  EXPECT_FALSE(s.find_equilibrium(message));
  EXPECT_NE(message.find("the largest unbalanced force"), std::string::npos) << message;
  EXPECT_NE(message.find("element \"column 0\" would be loaded to 160 % of its capacity"), std::string::npos)
      << message;
  EXPECT_NE(message.find("times the weight, of body \"floor 0\";"), std::string::npos) << message;
  ASSERT_EQ(s.summary.overloads.size(), 1u) << "column 1 carries 0.8 MN of 1 MN";
  EXPECT_EQ(s.summary.overloads[0].element, 0u);
  EXPECT_NEAR(s.summary.overloads[0].used, 1.6, 1e-3);
}

}  // namespace
}  // namespace topple::mbs
