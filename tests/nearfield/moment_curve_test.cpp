#include "nearfield/moment_curve.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/unit.h"

namespace topple::nearfield {
namespace {

/// The ground column of the storehouse.
ZoneInput make_zone() {
  ZoneInput in;
  in.section.width = in.section.height = 0.5;
  in.section.cover = 0.03, in.section.tie_diameter = 0.01, in.section.tie_spacing = 0.2;
  for (const double y : {-0.444 / 2, 0.0, 0.444 / 2})
    for (const double z : {-0.444 / 2, 0.0, 0.444 / 2})
      if (y != 0 || z != 0) in.section.bars.push_back({y, z, 8e-4, 0.032});
  in.concrete = {"c", 25e6, 1.994e6, 30e9, 2.2e-3, 130, 15e3, 2500};
  in.steel = {"s", 420e6, 500e6, 200e9, 0.1};
  in.length = 0.5;
  return in;
}

TEST(MomentCurve, PassesThroughThePointsOfTheFamily) {
  const ZoneInput in = make_zone();
  const Rcc rcc = make_rcc(in);
  const Fibres f = make_fibres(in, Axis::Y);
  const std::vector<double> rotation = refine_rotations(rcc.y_pos, 4);
  const size_t J = rcc.y_pos.rotation.size();
  for (size_t k = 1; k + 1 < rcc.y_pos.normal_force.size(); ++k) {
    const MomentCurve c = make_moment_curve(f, Axis::Y, rcc.y_pos.normal_force[k], 1, in.length, rotation);
    double worst = 0, peak = 0;
    for (size_t j = 0; j + 1 < J && 4 * j < c.rotation.size(); ++j) {
      ASSERT_NEAR(rotation[4 * j], rcc.y_pos.rotation[j], 1e-15);
      // from where the cover spalls the section leaps between branches, somewhere between two points of the family
      if (c.rotation[4 * j] != rotation[4 * j] || c.rotation[4 * j] > 0.03) break;
      worst = std::max(worst, std::abs(c.moment[4 * j] - rcc.y_pos.moment[k * J + j]));
      peak = std::max(peak, c.moment[4 * j]);
    }
    EXPECT_GT(peak, 30e3);
    EXPECT_LT(worst, 0.01 * peak) << "bars remember the points in between; level " << k;
  }
}

TEST(MomentCurve, EveryPointIsInEquilibrium) {
  const ZoneInput in = make_zone();
  const Rcc rcc = make_rcc(in);
  const Fibres f = make_fibres(in, Axis::Y);
  const MomentCurve c = make_moment_curve(f, Axis::Y, -2.9e6, 1, in.length, refine_rotations(rcc.y_pos, 4));
  ASSERT_GT(c.rotation.size(), 20u);
  for (size_t j = 0; j < c.rotation.size(); ++j) {
    const Resultants r = calc_resultants(f, c.eps_0[j], c.kappa[j], c.bars[j]);
    EXPECT_NEAR(r.N, c.N, 2e-7 * 10e6);
    EXPECT_NEAR(std::max(0.0, r.M), c.moment[j], 1e-9 * 1e6);
    EXPECT_NEAR(c.kappa[j], c.rotation[j] / in.length, 1e-15);
  }
}

TEST(MomentCurve, LosesItsForceOnceTheConcreteIsCrushed) {
  const ZoneInput in = make_zone();
  const Rcc rcc = make_rcc(in);
  const Fibres f = make_fibres(in, Axis::Y);
  const auto rotation = refine_rotations(rcc.y_pos, 4);
  const MomentCurve c = make_moment_curve(f, Axis::Y, -2.9e6, 1, in.length, rotation);
  EXPECT_TRUE(c.loses_force);
  // held at the last rotation, lost a thousandth beyond
  double e = c.eps_0.back();
  EXPECT_TRUE(find_equilibrium(f, c.N, c.kappa.back(), e, c.bars.back()));
  EXPECT_EQ(c.moment.back(), 0) << "bent so far, it pushes instead of resisting";
  EXPECT_GT(c.carried_to, c.rotation.back());
  EXPECT_LT(c.carried_to, 0.1);
  const MomentCurve more = make_moment_curve(f, Axis::Y, -3.7e6, 1, in.length, rotation);
  EXPECT_LT(more.carried_to, c.carried_to) << "the more force, the earlier it is lost";
  EXPECT_FALSE(make_moment_curve(f, Axis::Y, 0, 1, in.length, rotation).loses_force);
  const MomentCurve none = make_moment_curve(f, Axis::Y, -9.5e6, 1, in.length, rotation);
  EXPECT_TRUE(none.loses_force);
  EXPECT_TRUE(none.rotation.empty());
}

TEST(MomentCurve, BothDirectionsOfASymmetricSectionAreEqual) {
  const ZoneInput in = make_zone();
  const Rcc rcc = make_rcc(in);
  const auto rotation = refine_rotations(rcc.y_pos, 2);
  for (const Axis axis : {Axis::Y, Axis::Z}) {
    const Fibres f = make_fibres(in, axis);
    const MomentCurve a = make_moment_curve(f, axis, -1e6, 1, in.length, rotation);
    const MomentCurve b = make_moment_curve(f, axis, -1e6, -1, in.length, rotation);
    ASSERT_EQ(a.moment.size(), b.moment.size());
    for (size_t j = 0; j < a.moment.size(); ++j) EXPECT_NEAR(a.moment[j], b.moment[j], 1e-6 * 700e3);
  }
}

TEST(MomentCurve, PointsAreThoseOfAPolygon) {
  const std::vector<double> rotation{0, 1, 2, 3, 4, 6, 10}, moment{0, 8, 10, 9, 7, 5, 1};
  const CurvePoints p = find_points(rotation, moment, {1, 8});
  EXPECT_EQ(p.yield.rotation, 1);
  EXPECT_EQ(p.peak.rotation, 2);
  EXPECT_EQ(p.peak.moment, 10);
  EXPECT_DOUBLE_EQ(p.ultimate.rotation, 3.5) << "0.8 of the peak between 3 and 4";
  EXPECT_DOUBLE_EQ(p.ultimate.moment, 8);
  EXPECT_DOUBLE_EQ(p.residual.rotation, 7) << "twice the ultimate rotation";
  EXPECT_DOUBLE_EQ(p.residual.moment, 4);
  const CurvePoints torn = find_points(rotation, moment, {1, 8}, {2.5, 9.5});
  EXPECT_DOUBLE_EQ(torn.ultimate.rotation, 2.5) << "a bar tears before";
  EXPECT_DOUBLE_EQ(torn.ultimate.moment, 9.5);
  // the line from 3 to 4 passes 0.8 of the peak at 3.5, but the moment drops at once when the bar tears
  const CurvePoints dropped = find_points(rotation, moment, {1, 8}, {3.8, 8.5});
  EXPECT_DOUBLE_EQ(dropped.ultimate.rotation, 3.8);
  EXPECT_DOUBLE_EQ(dropped.ultimate.moment, 8.5);
  const CurvePoints crushed = find_points(rotation, moment, {1, 8}, {3.8, 7});
  EXPECT_DOUBLE_EQ(crushed.ultimate.rotation, 3.4) << "fallen to 0.8 before it tears";
  EXPECT_DOUBLE_EQ(crushed.ultimate.moment, 8);
  // the moment rises until the bar tears, between two points of the curve
  const CurvePoints risen = find_points({0, 1, 2, 3, 4}, {0, 8, 10, 7, 6}, {1, 8}, {2.4, 10.5});
  EXPECT_EQ(risen.peak.rotation, 2.4);
  EXPECT_EQ(risen.peak.moment, 10.5);
  EXPECT_EQ(risen.ultimate.rotation, 2.4) << "it tears at the peak";
  EXPECT_EQ(risen.ultimate.moment, 10.5);
  const CurvePoints rising = find_points({0, 1, 2}, {0, 1, 2}, {1, 1});
  EXPECT_EQ(rising.ultimate.rotation, 2) << "the curve ends";
  EXPECT_TRUE(std::isnan(find_points({}, {}, {}).peak.moment));
  EXPECT_TRUE(std::isnan(find_points({0}, {0}, {}).peak.moment));
}

TEST(MomentCurve, InteractionEndsAtCrushingAndRupture) {
  const ZoneInput in = make_zone();
  const Rcc rcc = make_rcc(in);
  const Interaction i = make_interaction(make_fibres(in, Axis::Y), Axis::Y, 1, rcc.y_pos, in.length, 41);
  ASSERT_EQ(i.normal_force.size(), 41u);
  EXPECT_DOUBLE_EQ(i.normal_force.front(), rcc.y_pos.normal_force.front());
  EXPECT_DOUBLE_EQ(i.normal_force.back(), rcc.y_pos.normal_force.back());
  EXPECT_EQ(i.peak_moment.front(), 0);
  EXPECT_EQ(i.peak_moment.back(), 0);
  const size_t balanced =
      static_cast<size_t>(std::max_element(i.peak_moment.begin(), i.peak_moment.end()) - i.peak_moment.begin());
  EXPECT_GT(i.normal_force[balanced], 0.5 * rcc.y_pos.normal_force.front());
  EXPECT_LT(i.normal_force[balanced], 0) << "some compression raises the resistance";
  for (size_t k = 0; k < i.normal_force.size(); ++k) EXPECT_FALSE(i.yield_moment[k] > i.peak_moment[k] * (1 + 1e-12));
}

TEST(MomentCurve, InteractionIsThePeaksOfCurves) {
  const ZoneInput in = make_zone();
  const Rcc rcc = make_rcc(in);
  const Fibres f = make_fibres(in, Axis::Y);
  constexpr int count = 61;
  const Interaction all = make_interaction(f, Axis::Y, 1, rcc.y_pos, in.length, count);
  const std::vector<double> rotation = refine_rotations(rcc.y_pos, 4);
  int yielding = 0, refined = 0;
  for (size_t k = 1; k + 1 < count; ++k) {
    const MomentCurve c = make_moment_curve(f, Axis::Y, all.normal_force[k], 1, in.length, rotation);
    const CurvePoints p = find_points(c);
    EXPECT_DOUBLE_EQ(all.peak_moment[k], p.peak.moment) << all.normal_force[k];
    if (!std::binary_search(rotation.begin(), rotation.end(), p.peak.rotation)) ++refined;
    if (!(p.yield.rotation > 1e-6 * p.peak.rotation)) {
      ++yielding;
      EXPECT_TRUE(std::isnan(all.yield_moment[k])) << all.normal_force[k];
    } else {
      EXPECT_DOUBLE_EQ(all.yield_moment[k], c.yield_moment) << all.normal_force[k];
    }
  }
  EXPECT_EQ(all.yield_moment.front(), 0) << "crushed evenly";
  EXPECT_TRUE(std::isnan(all.yield_moment.back())) << "torn evenly, behind yield";
  EXPECT_GT(yielding, 0) << "near rupture the force alone makes the bars yield";
  EXPECT_GT(refined, 0) << "near rupture the moment rises until the force is lost";
}

TEST(MomentCurve, InteractionOfAnUnsymmetricSectionIsOneLoop) {
  ZoneInput in = make_zone();
  for (product::Bar& bar : in.section.bars)
    if (bar.z > 0) bar.area *= 0.2;
  const Rcc rcc = make_rcc(in);
  const Fibres f = make_fibres(in, Axis::Y);
  const Interaction up = make_interaction(f, Axis::Y, 1, rcc.y_pos, in.length, 61);
  const Interaction down = make_interaction(f, Axis::Y, -1, rcc.y_neg, in.length, 61);
  const double scale = *std::max_element(down.peak_moment.begin(), down.peak_moment.end());
  for (const size_t end : {size_t{0}, size_t{60}}) {
    EXPECT_GT(std::abs(up.peak_moment[end]), 0.05 * scale) << "strained evenly it bears a moment";
    EXPECT_NEAR(up.peak_moment[end], -down.peak_moment[end], 1e-3 * scale) << "both sides meet at one point";
    EXPECT_TRUE(std::isnan(up.yield_moment[end]));
  }
  int one_sided = 0;
  for (size_t k = 0; k < 61; ++k) {
    EXPECT_GE(up.peak_moment[k], -down.peak_moment[k] - 1e-3 * scale) << "the right side is on the right";
    if (up.peak_moment[k] < 0 || down.peak_moment[k] < 0) {
      ++one_sided;
      EXPECT_TRUE(std::isnan(up.yield_moment[k])) << k;
    }
    if (k == 0 || k == 60) continue;
    const auto leap = [&](const Interaction& i) { return std::abs(i.peak_moment[k] - i.peak_moment[k - 1]); };
    EXPECT_LT(leap(up), 0.3 * scale) << k;
    EXPECT_LT(leap(down), 0.3 * scale) << k;
  }
  EXPECT_GT(one_sided, 4);
}

TEST(SectionState, ItsStressesIntegrateToTheResultants) {
  const ZoneInput in = make_zone();
  const Rcc rcc = make_rcc(in);
  const Fibres f = make_fibres(in, Axis::Y);
  const MomentCurve c = make_moment_curve(f, Axis::Y, -2e6, 1, in.length, refine_rotations(rcc.y_pos, 4));
  const size_t j = static_cast<size_t>(std::max_element(c.moment.begin(), c.moment.end()) - c.moment.begin());
  const SectionState s = make_section_state(in, f, Axis::Y, c.eps_0[j], c.kappa[j], c.bars[j]);
  EXPECT_NEAR(s.layers.front().from, -0.25, 1e-12);
  EXPECT_NEAR(s.layers.back().to, 0.25, 1e-12);
  double N = 0, M = 0;
  for (const auto& l : s.layers) {
    const double a = 0.5 * (l.from + l.to);
    const double force = (l.to - l.from) * (l.core_breadth * l.core_stress + l.cover_breadth * l.cover_stress);
    N += force, M += force * a;
  }
  for (const auto& b : s.bars) {  // the concrete that a bar displaces
    const double force = 8e-4 * (b.stress - material::calc_envelope(f.core, b.strain).stress);
    N += force, M += force * b.z;
  }
  EXPECT_NEAR(N, c.N, 1e-6 * 10e6);
  EXPECT_NEAR(M, c.moment[j], 1e-6 * c.moment[j]);
}

TEST(SectionState, HasEachBarAsItsOwnDiameterIs) {
  // a thin and a thick bar side by side: the thin one buckles
  ZoneInput in = make_zone();
  in.section.bars = {
      {0, -0.2, 50e-6, 8e-3}, {0.05, -0.2, 616e-6, 28e-3}, {0, 0.2, 50e-6, 8e-3}, {0.05, 0.2, 616e-6, 28e-3}};
  const Fibres f = make_fibres(in, Axis::Y);
  const SectionState s = make_section_state(in, f, Axis::Y, -6e-3, 0);
  for (size_t i = 0; i < s.bars.size(); ++i)
    EXPECT_EQ(s.bars[i].stress,
              material::calc_response(make_bar(in, in.section.bars[i].diameter), material::SteelState{}, -6e-3).stress)
        << i;
  EXPECT_NE(s.bars[0].stress, s.bars[1].stress);
}

TEST(MomentCurve, HasTheSectionBeforeTheFirstBarTears) {
  const ZoneInput in = make_zone();
  const Rcc rcc = make_rcc(in);
  const Fibres f = make_fibres(in, Axis::Y);
  for (const double N : {0.0, 0.5e6, 1e6}) {
    const MomentCurve c = make_moment_curve(f, Axis::Y, N, 1, in.length, refine_rotations(rcc.y_pos, 4));
    ASSERT_TRUE(std::isfinite(c.first_torn.rotation)) << N;
    const Resultants r = calc_resultants(f, c.torn.eps_0, c.torn.kappa, c.bars[c.torn.after]);
    EXPECT_NEAR(r.M, c.first_torn.moment, 1e-9 * c.first_torn.moment) << N;
    EXPECT_NEAR(r.N, N, 1e-4 * 10e6) << N;
    for (const auto& b : make_section_state(in, f, Axis::Y, c.torn.eps_0, c.torn.kappa, c.bars[c.torn.after]).bars)
      EXPECT_NE(b.condition, BarCondition::Torn) << N;
  }
}

TEST(SectionState, NamesWhatHappensAtTheEdges) {
  const ZoneInput in = make_zone();
  const Rcc rcc = make_rcc(in);
  const Fibres f = make_fibres(in, Axis::Y);
  const MomentCurve c = make_moment_curve(f, Axis::Y, -2e6, 1, in.length, refine_rotations(rcc.y_pos, 4));
  size_t j = 0;
  while (j + 1 < c.rotation.size() && c.rotation[j] < 0.03) ++j;  // beyond twice its ultimate rotation
  const SectionState s = make_section_state(in, f, Axis::Y, c.eps_0[j], c.kappa[j], c.bars[j]);
  EXPECT_EQ(s.layers.front().cover, ConcreteCondition::Crushed) << "compressed at -z";
  EXPECT_EQ(s.layers.back().cover, ConcreteCondition::Open) << "pulled at +z";
  const MomentCurve free = make_moment_curve(f, Axis::Y, 0, 1, in.length, refine_rotations(rcc.y_pos, 4));
  while (j > 0 && free.rotation[j] > 0.02) --j;
  for (const auto& b : make_section_state(in, f, Axis::Y, free.eps_0[j], free.kappa[j], free.bars[j]).bars)
    if (b.z > 0.1) { EXPECT_EQ(b.condition, BarCondition::YieldsInTension); }
  const SectionState begin = make_section_state(in, f, Axis::Y, 0, 0);
  EXPECT_EQ(begin.layers.front().core, ConcreteCondition::Uncracked);
  EXPECT_EQ(begin.bars.front().condition, BarCondition::Elastic);
  EXPECT_EQ(make_section_state(in, f, Axis::Y, -1e-3, 0).layers[10].core, ConcreteCondition::Compressed);
  EXPECT_EQ(make_section_state(in, f, Axis::Y, 0.2, 0).bars.front().condition, BarCondition::Torn);
  EXPECT_EQ(make_section_state(in, f, Axis::Y, 2 * f.cover.eps_ct, 0).layers[10].core, ConcreteCondition::Cracked);
}

}  // namespace
}  // namespace topple::nearfield
