#include "nearfield/section_kernel.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <cstring>
#include <random>

#include "base/unit.h"

namespace topple::nearfield {
namespace {

using unit::MPa;

/// Sections of all kinds: with and without ties, tensile strength, concrete; bars that buckle and bars that are held.
std::vector<Fibres> make_sections() {
  std::mt19937_64 random(11);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  std::vector<Fibres> out;
  for (int i = 0; i < 40; ++i) {
    ZoneInput in;
    product::Section& s = in.section;
    s.name = "section", s.width = uniform(0.2, 0.8), s.height = uniform(0.2, 0.8), s.cover = uniform(0, 0.04);
    s.tie_diameter = i % 3 == 0 ? 0 : 0.01, s.tie_spacing = uniform(0.05, 0.3);
    const int bars = i % 20;
    for (int b = 0; b < bars; ++b) {
      const double d = uniform(0.01, 0.03);
      s.bars.push_back({uniform(-0.4, 0.4) * s.width, uniform(-0.4, 0.4) * s.height, 0.785 * d * d, d});
    }
    in.concrete.fc = uniform(8, 60) * MPa, in.concrete.Ec = 35e9, in.concrete.eps_c1 = 2.2e-3;
    in.concrete.fct = i % 5 == 0 ? 0 : 0.08 * in.concrete.fc, in.concrete.Gf = 120, in.concrete.Gcl = 15e3;
    in.steel = {"", 450 * MPa, 540 * MPa, 200e9, 0.05};
    in.length = 0.2;
    in.concrete_loss = i % 7 == 6 ? 1 : 0;
    out.push_back(make_fibres(in, i % 2 == 0 ? Axis::Y : Axis::Z));
  }
  return out;
}

struct Plane {
  double eps_0, kappa;
};
std::vector<Plane> make_planes() {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> exponent(-6, -0.5), sign(-1, 1);
  std::vector<Plane> out{{0, 0}, {1e-4, 0}, {-2.2e-3, 0}};
  for (int i = 0; i < 300; ++i)
    out.push_back({std::copysign(std::pow(10, exponent(random)), sign(random)),
                   std::copysign(std::pow(10, exponent(random) + 0.6), sign(random))});
  return out;
}

TEST(SectionKernel, GivesThePlainLawsResultants) {
  for (const Fibres& f : make_sections()) {
    const PackedSection packed = pack_section(f);
    double area = 1e-12, steel = 0;
    for (size_t i = 0; i < f.at.size(); ++i) area += f.core_area[i] + f.cover_area[i];
    for (double a : f.bar_area) steel += a;
    const double N = area * f.core.fc + steel * 540 * MPa, EA = area * f.core.Ec + steel * 200e9, h = f.half_depth;
    for (const Plane& p : make_planes()) {
      const Resultants a = calc_resultants(f, p.eps_0, p.kappa), b = calc_resultants(packed, p.eps_0, p.kappa);
      // round-off of the sums and of the exponential function
      EXPECT_NEAR(a.N, b.N, 1e-13 * N);
      EXPECT_NEAR(a.M, b.M, 1e-13 * N * h);
      EXPECT_NEAR(a.dN, b.dN, 1e-12 * EA);
      EXPECT_NEAR(a.dM, b.dM, 1e-12 * EA * h);
      EXPECT_NEAR(a.dM_kappa, b.dM_kappa, 1e-12 * EA * h * h);
    }
  }
}

TEST(SectionKernelReplay, GivesTheSameBitsOnEveryInstructionSet) {
  const auto same = [](const Resultants& a, const Resultants& b) { return std::memcmp(&a, &b, sizeof a) == 0; };
  const std::int64_t supported = hwy::SupportedTargets();
  int sets = 0;
  std::vector<Resultants> first;
  for (std::int64_t left = supported; left != 0; left &= left - 1) {
    hwy::SetSupportedTargetsForTest(left & -left);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
    std::vector<Resultants> here;
    for (const Fibres& f : make_sections()) {
      const PackedSection packed = pack_section(f);
      for (const Plane& p : make_planes()) {
        here.push_back(calc_resultants(packed, p.eps_0, p.kappa));
        ASSERT_TRUE(same(here.back(), calc_resultants_singly(packed, p.eps_0, p.kappa))) << section_kernel_target();
      }
    }
    if (first.empty()) first = here;
    for (size_t i = 0; i < here.size(); ++i) ASSERT_TRUE(same(here[i], first[i])) << section_kernel_target();
    ++sets;
  }
  hwy::SetSupportedTargetsForTest(0);
  hwy::GetChosenTarget().Update(hwy::SupportedTargets());
  EXPECT_GE(sets, 1);
}

}  // namespace
}  // namespace topple::nearfield
