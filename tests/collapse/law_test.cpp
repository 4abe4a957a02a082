#include "collapse/law.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "plans.h"

namespace topple::collapse {
namespace {

nearfield::ZoneInput column_zone() {
  const product::Plan plan = read(portal());
  nearfield::ZoneInput in;
  in.section = plan.sections[0];
  in.concrete = plan.concretes[0];
  in.steel = plan.steels[0];
  in.length = 0.3;
  return in;
}

double interpolate(const std::vector<double>& x, const double* y, double at) {
  if (at <= x.front()) return y[0];
  if (at >= x.back()) return y[x.size() - 1];
  const size_t i = static_cast<size_t>(std::upper_bound(x.begin(), x.end(), at) - x.begin());
  return y[i - 1] + (y[i] - y[i - 1]) * (at - x[i - 1]) / (x[i] - x[i - 1]);
}

mbs::ZoneLaw make_effective_law(const nearfield::Rcc& rcc, const Knowledge& k) {
  return make_zone_law(rcc, rcc.calc_EI_effective_y(0), rcc.calc_EI_effective_z(0), "zone", k);
}

TEST(ZoneLaw, ElasticAndPlasticRotationTogetherAreTheFamilys) {
  const nearfield::Rcc rcc = nearfield::make_rcc(column_zone());
  const double N = -600e3, EI_y = rcc.calc_EI_effective_y(N), EI_z = rcc.calc_EI_effective_z(N);
  const mbs::ZoneLaw law = make_zone_law(rcc, EI_y, EI_z, "z", default_knowledge());
  // at a force of the table, so that only the rotations are interpolated
  const nearfield::MomentFamily& f = rcc.z_pos;
  const size_t J = f.rotation.size(), Jp = law.moment_z.plastic_rotation.size();
  int compared = 0;
  for (size_t k = 0; k < f.normal_force.size(); ++k) {
    if (f.normal_force[k] > 0 || f.yield_moment[k] <= 0) continue;
    const auto at = std::find_if(law.moment_z.normal_force.begin(), law.moment_z.normal_force.end(),
                                 [&](double n) { return std::abs(n - f.normal_force[k]) < 1; });
    ASSERT_NE(at, law.moment_z.normal_force.end());
    const double* limit = &law.moment_z.positive[static_cast<size_t>(at - law.moment_z.normal_force.begin()) * Jp];
    const double flexibility = rcc.length / std::min(EI_z, f.yield_moment[k] / f.yield_rotation[k] * rcc.length);
    for (double plastic : {0.004, 0.01, 0.02}) {
      if (plastic > law.rupture_rotation) continue;
      const double M = interpolate(law.moment_z.plastic_rotation, limit, plastic);
      const double total = plastic + M * flexibility;
      // 33 points of rotation: the curve between them bends by a few per cent of the yield moment
      EXPECT_NEAR(interpolate(f.rotation, &f.moment[k * J], total), M, 0.06 * f.yield_moment[k])
          << "N " << f.normal_force[k] << " plastic " << plastic;
      ++compared;
    }
  }
  EXPECT_GT(compared, 12);
}

TEST(ZoneLaw, PlasticRotationBeginsAtFirstYieldOrLater) {
  const nearfield::Rcc rcc = nearfield::make_rcc(column_zone());
  const mbs::ZoneLaw law = make_effective_law(rcc, default_knowledge());
  const size_t J = law.moment_y.plastic_rotation.size();
  for (size_t k = 0; k < rcc.y_pos.normal_force.size(); ++k) {
    const auto at = std::find_if(law.moment_y.normal_force.begin(), law.moment_y.normal_force.end(),
                                 [&](double n) { return std::abs(n - rcc.y_pos.normal_force[k]) < 1; });
    ASSERT_NE(at, law.moment_y.normal_force.end());
    const size_t row = static_cast<size_t>(at - law.moment_y.normal_force.begin());
    EXPECT_GE(law.moment_y.positive[row * J], rcc.y_pos.yield_moment[k] * (1 - 1e-9));
  }
}

TEST(ZoneLaw, LengthensByTheShareThatTheRuleGives) {
  const nearfield::Rcc rcc = nearfield::make_rcc(column_zone());
  const auto elongation = [&](double share) {
    Knowledge k = default_knowledge();
    k.zone_elongation_share = share;
    return make_effective_law(rcc, k);
  };
  const mbs::ZoneLaw none = elongation(0), half = elongation(0.5), all = elongation(1);
  EXPECT_TRUE(none.moment_y.elongation_positive.empty() && none.moment_z.elongation_negative.empty());
  ASSERT_EQ(all.moment_y.elongation_positive.size(), all.moment_y.positive.size());
  ASSERT_EQ(all.moment_y.elongation_negative.size(), all.moment_y.positive.size());
  const size_t J = all.moment_y.plastic_rotation.size();
  for (size_t i = 0; i < all.moment_y.positive.size(); ++i) {
    EXPECT_EQ(half.moment_y.elongation_positive[i], 0.5 * all.moment_y.elongation_positive[i]);
    if (i % J == 0) { EXPECT_EQ(all.moment_y.elongation_positive[i], 0); }
  }
  EXPECT_EQ(none.moment_y.positive, all.moment_y.positive);
}

TEST(ZoneLaw, TurnsFurtherUnderPressureIfTheRuleSaysSo) {
  const nearfield::Rcc rcc = nearfield::make_rcc(column_zone());
  const auto pressed = [&](double rotation) {
    Knowledge k = default_knowledge();
    k.zone_rupture_rotation_pressed = rotation;
    return make_effective_law(rcc, k);
  };
  const double first = default_knowledge().zone_rupture_rotation;
  EXPECT_EQ(pressed(2 * first).rupture_rotation_pressed, 2 * first);
  EXPECT_EQ(pressed(2 * first).rupture_rotation, pressed(first).rupture_rotation);
  // not more than the other one: none, also where a family ends before
  for (const double share : {0.5, 1.0}) EXPECT_EQ(pressed(share * first).rupture_rotation_pressed, 0);
}

TEST(ZoneLaw, GoesOnWithTheMeanForceOfCrushing) {
  const nearfield::Rcc rcc = nearfield::make_rcc(column_zone());
  const mbs::Curve& c = make_effective_law(rcc, default_knowledge()).compression;
  EXPECT_EQ(make_effective_law(rcc, default_knowledge()).crush_length, rcc.length);
  ASSERT_GT(c.x.back(), rcc.length);
  // the work of one zone on its length
  const size_t last = c.x.size() - 2;
  double work = 0;
  for (size_t i = 0; i < last; ++i) work += 0.5 * (c.f[i] + c.f[i + 1]) * (c.x[i + 1] - c.x[i]);
  EXPECT_NEAR(c.f.back() * rcc.length, work, 1e-3 * work);
  EXPECT_GT(c.f.back(), c.f[last]);
  EXPECT_LT(c.f.back(), 0.5 * *std::max_element(c.f.begin(), c.f.end()));
}

TEST(ZoneLaw, PassesTheModelsCheck) {
  mbs::Model model;
  const nearfield::ZoneInput in = column_zone();
  const nearfield::Rcc rcc = nearfield::make_rcc(in);
  mbs::add_law(model, make_zone_law(rcc, rcc.EI_y, rcc.EI_z, "uncracked", default_knowledge()));
  mbs::add_law(model, make_cage_law(make_residual_cage(in, 1.2, 0.1), 1.2, "cage", default_knowledge()));
  mbs::add_law(model, make_cage_law(make_residual_cage(in, 1.2, 0), 1.2, "nothing", default_knowledge()));
  EXPECT_NO_THROW(mbs::check_model(model));
}

TEST(ZoneLaw, AChargeThatLeavesNoBarsLeavesNoResistance) {
  const mbs::ZoneLaw law =
      make_cage_law(make_residual_cage(column_zone(), 1.2, 0), 1.2, "nothing", default_knowledge());
  for (double f : law.compression.f) EXPECT_EQ(f, 0);
  for (double f : law.tension.f) EXPECT_EQ(f, 0);
  for (double m : law.moment_y.positive) EXPECT_EQ(m, 0);
  EXPECT_EQ(law.shear_y, 0);
  EXPECT_EQ(law.crush_length, 1.2);
}

TEST(ZoneLength, FollowsItsRule) {
  const nearfield::ZoneInput in = column_zone();
  const Knowledge& k = default_knowledge();
  // 0.08 x 1.25 m + 0.022 x 420 x 0.020 m = 0.2848 m, more than half of the depth of 0.3 m
  EXPECT_NEAR(calc_zone_length(in.section, in.concrete, in.steel, 0.3, 2.5, k), 0.2848, 1e-12);
  // half of a depth of 0.8 m
  EXPECT_NEAR(calc_zone_length(in.section, in.concrete, in.steel, 0.8, 2.5, k), 0.4, 1e-12);
  // a quarter of a stub of 0.6 m
  EXPECT_NEAR(calc_zone_length(in.section, in.concrete, in.steel, 0.8, 0.6, k), 0.15, 1e-12);
}

TEST(ZoneLibraryReplay, ComputesEachZoneOnceWhateverTheThreads) {
  nearfield::ZoneInput a = column_zone(), b = a;
  b.cut_bars = 0.5;
  ZoneLibrary one, four;
  for (ZoneLibrary* l : {&one, &four}) {
    EXPECT_EQ(l->request(a), 0);
    EXPECT_EQ(l->request(b), 1);
    EXPECT_EQ(l->request(a), 0);
    EXPECT_EQ(l->size(), 2u);
  }
  one.compute(1);
  four.compute(4);
  EXPECT_EQ(one.rcc(1).z_pos.moment, four.rcc(1).z_pos.moment);
  EXPECT_LT(one.rcc(1).tension.force.front(), one.rcc(0).tension.force.front());
}

}  // namespace
}  // namespace topple::collapse
