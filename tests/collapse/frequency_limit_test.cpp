#include "collapse/frequency_limit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "collapse/condense.h"
#include "mbs/solver.h"
#include "plans.h"

namespace topple::collapse {
namespace {

product::Plan weida() {
  std::vector<Diagnostic> warnings;
  std::string text;
  return product::read_plan_file(TOPPLE_SOURCE_DIR "/examples/weida/plan.toml", warnings, text);
}

constexpr double kHighest = 1000, kMassA = 300, kMassB = 600;  // [rad/s], [kg]

/// Two free bodies side by side, b 1 m behind a along x; the element's marker is at a's centre, its axes are those of
/// W.
mbs::Model pair_of_bodies(const Vec3& translational, const Vec3& rotational) {
  mbs::Model m;
  for (const double mass : {kMassA, kMassB}) {
    mbs::Body b;
    b.mass = mass;
    for (int i = 0; i < 3; ++i) b.inertia(i, i) = 20 + i;
    b.X_WB.p = {m.bodies.empty() ? 0.0 : 1.0, 0, 0};
    mbs::add_body(m, b);
  }
  mbs::ZoneElement e;
  e.a = mbs::BodyId{0}, e.b = mbs::BodyId{1};
  e.X_BM.p = {-1, 0, 0};
  e.translational_stiffness = translational, e.rotational_stiffness = rotational;
  e.damping_ratio = 0;
  m.elements.push_back(e);
  return m;
}

TEST(FrequencyLimitPhysics, StiffSpringsSwingTheirBodiesAtTheLimit) {
  const double reduced = kMassA * kMassB / (kMassA + kMassB), most = kHighest * kHighest * reduced;
  mbs::Model m = pair_of_bodies({3 * most, 0.9 * most, 5 * most}, {1, 1, 1});
  limit_frequency(m, kHighest);
  const Vec3& k = m.elements[0].translational_stiffness;
  EXPECT_NEAR(std::sqrt(k.x / reduced), kHighest, 1e-12 * kHighest);
  EXPECT_EQ(k.y, 0.9 * most) << "slower than the limit";
  EXPECT_EQ(k.z, 5 * most) << "what bears loads";
}

TEST(FrequencyLimitPhysics, TheGroundHoldsOneSide) {
  mbs::Model m = pair_of_bodies({1e12, 1e12, 1e12}, {1, 1, 1});
  m.bodies[0].fixed = true;
  limit_frequency(m, kHighest);
  EXPECT_NEAR(std::sqrt(m.elements[0].translational_stiffness.x / kMassB), kHighest, 1e-12 * kHighest);
  EXPECT_EQ(m.bodies[0].inertia(1, 1), 21);
}

TEST(FrequencyLimitPhysics, ADamperCountsWithItsSpring) {
  // the explicit step sees k (1 + 4 ζ / (1 - 2 ζ))
  mbs::Model m = pair_of_bodies({1e12, 1, 1}, {1, 1, 1});
  m.elements[0].damping_ratio = 0.05;
  limit_frequency(m, kHighest);
  const double reduced = kMassA * kMassB / (kMassA + kMassB);
  EXPECT_NEAR(m.elements[0].translational_stiffness.x, kHighest * kHighest * reduced / (1 + 0.2 / 0.9), 1e-3);
}

TEST(FrequencyLimitPhysics, BodiesTurnAtTheLimit) {
  // b hangs on a lever of 1 m: vertical springs turn it about y, horizontal ones about z
  const Vec3 k{1, 4e6, 9e7}, r{1e7, 1e6, 2e6};
  mbs::Model m = pair_of_bodies(k, r);
  limit_frequency(m, kHighest);
  const Mat3 &A = m.bodies[0].inertia, &B = m.bodies[1].inertia;
  const double square = kHighest * kHighest;
  EXPECT_EQ(A(0, 0), 20) << "10 kg m2 would do";
  EXPECT_EQ(A(1, 1), 21);
  EXPECT_EQ(A(2, 2), 22);
  EXPECT_NEAR(B(1, 1), (r.y + k.z) / square, 1e-9);
  // 20 and 22 would do about the others, but no body has more about one axis than about both others together
  EXPECT_NEAR(B(0, 0), 20 + (91 - 42) / 2.0, 1e-9);
  EXPECT_NEAR(B(2, 2), 22 + (91 - 42) / 2.0, 1e-9);
}

TEST(FrequencyLimitPhysics, TheStorehouseHasNoFasterModes) {
  const product::Plan plan = weida();
  const product::Plan* const plans[] = {&plan};
  const Condensation like = find_like_frames(plans, default_knowledge());
  for (const bool condensed : {false, true}) {
    const auto frequency = [&](double highest) {
      Knowledge k = default_knowledge();
      k.body_highest_frequency = highest;
      ModelMap map;
      mbs::Options o;
      o.duration = 0.03;  // the first charges fire at once and leave stubs
      return mbs::run(condensed ? make_condensed_model(plan, k, like, nullptr, map) : make_model(plan, k, map), o)
          .highest_frequency;
    };
    EXPECT_GT(frequency(1e5), 5000) << condensed;
    // a row of springs that have 1400 rad/s each by themselves, and vertical ones, which stay
    EXPECT_LT(frequency(1400), 2.4 * 1400) << condensed;
  }
}

TEST(FrequencyLimitPhysics, LoadsOfColumnsStayAsTheyAre) {
  const product::Plan plan = weida();
  const auto forces = [&plan](double highest) {
    Knowledge k = default_knowledge();
    k.body_highest_frequency = highest;
    ModelMap map;
    mbs::Simulation s(make_model(plan, k, map), {});
    std::string message;
    EXPECT_TRUE(s.find_equilibrium(message)) << message;
    const mbs::View& v = s.calc_view();
    std::vector<double> out;
    for (size_t i = 0; i < map.elements.size(); ++i)
      if (map.elements[i].name.ends_with("-0/foot")) out.push_back(-v.element_force[i].x);
    return out;
  };
  const std::vector<double> as_they_are = forces(1e5), limited = forces(1400);
  ASSERT_EQ(as_they_are.size(), 20u);
  double mean = 0;
  for (const double f : as_they_are) mean += std::abs(f) / 20;
  for (size_t i = 0; i < limited.size(); ++i) EXPECT_NEAR(limited[i], as_they_are[i], 1.1e-3 * mean) << i;
}

}  // namespace
}  // namespace topple::collapse
