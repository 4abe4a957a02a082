#include "mbs/contact_law.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace topple::mbs {
namespace {

/// Speed that a body of the given mass keeps after meeting a point of rate 1 at speed 1, by the midpoint rule. The
/// dashpot is that of mass 1.
double calc_rebound(const ContactLaw& law, double mass = 1) {
  constexpr double h = 1e-5;
  double x = 0, v = 1;
  const auto accelerate = [&](double depth, double speed) {
    return -(law.mean * depth + std::clamp(2 * law.zeta * speed, -law.band * depth, law.most * depth)) / mass;
  };
  for (int i = 0; i < 100'000'000; ++i) {
    const double x_mid = x + 0.5 * h * v, v_mid = v + 0.5 * h * accelerate(x, v);
    x += h * v_mid;
    v += h * accelerate(x_mid, v_mid);
    if (x <= 0 || (v < 0 && accelerate(x, v) == 0)) break;
  }
  return -v;
}

TEST(ContactLaw, ReturnsItsRestitution) {
  for (const double e : {0.03, 0.1, 0.3, 0.5, 0.8, 0.97, 1.0})
    EXPECT_NEAR(calc_rebound(make_contact_law(e, 0)), e, 1e-5) << e;  // first and last step
}

TEST(ContactLaw, ReturnsAlmostNothingWhereNothingIsWanted) { EXPECT_LT(calc_rebound(make_contact_law(0, 0)), 0.003); }

TEST(ContactLaw, KnowsTheRestitutionOfWeakDashpotsToo) {
  for (const double zeta : {0.05, 0.25, 0.6, 2.0})
    for (const double lower : {0.0, 0.2, 0.7}) {
      ContactLaw law;
      law.mean = (1 + lower) / 2;
      law.band = law.most = (1 - lower) / 2;
      law.zeta = zeta;
      EXPECT_NEAR(calc_rebound(law), calc_restitution(lower, zeta), 1e-5) << lower << " " << zeta;
    }
}

TEST(ContactLaw, HardlyDependsOnTheMassThatItWasNotMadeFor) {
  // points that share an impact, and friction, change the mass that a point feels
  for (const double e : {0.1, 0.5, 0.8})
    for (const double mass : {0.5, 2.0}) EXPECT_NEAR(calc_rebound(make_contact_law(e, 0), mass), e, 3e-3) << e;
}

TEST(ContactLaw, OfAPairWithADashpotIsPlain) {
  Contact::Pair p;
  p.damping = 7;
  p.stiffness = 50;
  p.friction = 0.2;
  const ContactLaw law = make_contact_law(p);
  EXPECT_EQ(law.mean, 1);
  EXPECT_EQ(law.damping, 7);
  EXPECT_EQ(law.stiffness, 50);
  EXPECT_EQ(law.friction, 0.2);
}

}  // namespace
}  // namespace topple::mbs
