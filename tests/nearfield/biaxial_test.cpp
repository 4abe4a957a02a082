#include "nearfield/biaxial.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/unit.h"
#include "nearfield/fibres.h"

namespace topple::nearfield {
namespace {

using unit::MPa;

constexpr double pi = 3.14159265358979323846;

ZoneInput make_column(double width, double height, int bars_y, int bars_z, double diameter, double fc) {
  ZoneInput in;
  product::Section& s = in.section;
  s.name = "column", s.width = width, s.height = height;
  s.cover = 0.03, s.tie_diameter = 0.01, s.tie_spacing = 0.2;
  const double a = 0.5 * width - s.cover - s.tie_diameter - 0.5 * diameter,
               b = 0.5 * height - s.cover - s.tie_diameter - 0.5 * diameter;
  for (int i = 0; i < bars_y; ++i)
    for (int j = 0; j < bars_z; ++j)
      if (i == 0 || j == 0 || i == bars_y - 1 || j == bars_z - 1)
        s.bars.push_back({a * (2.0 * i / (bars_y - 1) - 1), b * (2.0 * j / (bars_z - 1) - 1),
                          0.25 * pi * diameter * diameter, diameter});
  in.concrete.fc = fc * MPa, in.concrete.fct = 0.08 * fc * MPa, in.concrete.Ec = 30e9;
  in.concrete.eps_c1 = 2.2e-3, in.concrete.Gf = 73 * std::pow(fc, 0.18), in.concrete.Gcl = 15e3;
  in.steel = {"", 420 * MPa, 525 * MPa, 200e9, 0.08};
  in.length = 0.4;
  return in;
}

double peak_of(const MomentFamily& f, size_t k) {
  const auto row = f.moment.begin() + static_cast<std::ptrdiff_t>(k * f.rotation.size());
  return *std::max_element(row, row + static_cast<std::ptrdiff_t>(f.rotation.size()));
}

TEST(Oblique, RightAnglesGiveTheFamiliesOfTheAxes) {
  ZoneInput in = make_column(0.4, 0.6, 3, 4, 0.022, 25);
  in.section.bars[0].area *= 2;  // nothing is symmetric any more
  const Rcc r = make_rcc(in);
  const struct {
    double angle;
    const MomentFamily& family;
  } cases[] = {{0, r.y_pos}, {0.5 * pi, r.z_pos}, {pi, r.y_neg}, {1.5 * pi, r.z_neg}};
  for (const auto& c : cases) {
    const MomentFamily f = make_oblique_family(in, c.angle);
    for (size_t k = 1; k + 1 < f.normal_force.size(); ++k)
      EXPECT_NEAR(peak_of(f, k), peak_of(c.family, k), 1e-3 * peak_of(c.family, k)) << c.angle << " row " << k;
  }
}

TEST(Oblique, StripsKeepAreaCentroidAndInertia) {
  const ZoneInput in = make_column(0.3, 0.5, 2, 3, 0.02, 25);
  for (const double angle : {0.0, 0.3, 0.7, 1.2, 0.5 * pi, 2.5}) {
    const Fibres f = make_fibres(in, angle);
    double area = 0, inertia = 0, product = 0, core = 0;
    for (size_t i = 0; i < f.at.size(); ++i) {
      area += f.core_area[i] + f.cover_area[i], core += f.core_area[i];
      inertia += (f.core_area[i] + f.cover_area[i]) * f.at[i] * f.at[i];
      product += (f.core_area[i] * f.core_across[i] + f.cover_area[i] * f.cover_across[i]) * f.at[i];
    }
    EXPECT_NEAR(area, 0.15, 1e-12);
    EXPECT_NEAR(core, 0.23 * 0.43, 1e-12);
    const double Iy = 0.3 * std::pow(0.5, 3) / 12, Iz = 0.5 * std::pow(0.3, 3) / 12, c = std::cos(angle),
                 s = std::sin(angle);
    // midpoint rule of 40 strips: 1 / 32²
    EXPECT_NEAR(inertia, Iy * c * c + Iz * s * s, 2e-3 * Iy) << angle;
    EXPECT_NEAR(product, (Iz - Iy) * c * s, 2e-3 * Iy) << angle;
  }
}

TEST(Oblique, ElasticMomentsFollowTheAxes) {
  ZoneInput in = make_column(0.3, 0.5, 2, 3, 0.02, 25);
  const double angle = 0.6, kappa = 1e-5;
  const Fibres f = make_fibres(in, angle), y = make_fibres(in, Axis::Y), z = make_fibres(in, Axis::Z);
  const double M = calc_resultants(f, 0, kappa).M, across = calc_cross_moment(f, 0, kappa);
  const double EI_y = calc_resultants(y, 0, kappa).M / kappa, EI_z = calc_resultants(z, 0, kappa).M / kappa;
  const double c = std::cos(angle), s = std::sin(angle);
  EXPECT_NEAR(M * c - across * s, EI_y * kappa * c, 3e-3 * EI_y * kappa);  // strips
  EXPECT_NEAR(M * s + across * c, EI_z * kappa * s, 3e-3 * EI_y * kappa);
}

TEST(Biaxial, PowerLawFitsTheFibres) {
  const std::vector<double> skew{pi / 8, pi / 4, 3 * pi / 8};
  const struct {
    const char* name;
    ZoneInput in;
  } cases[] = {{"square, 8 bars, C25", make_column(0.5, 0.5, 3, 3, 0.032, 25)},
               {"square, 8 bars, C10", make_column(0.5, 0.5, 3, 3, 0.022, 10)},
               {"square, 4 bars", make_column(0.3, 0.3, 2, 2, 0.02, 30)},
               {"square, 16 bars", make_column(0.5, 0.5, 5, 5, 0.02, 30)},
               {"30 x 60, 10 bars", make_column(0.3, 0.6, 2, 5, 0.02, 30)}};
  for (const auto& c : cases) {
    std::printf("  %-20s", c.name);
    double least = 2, greatest = 0;
    for (const double share : {0.0, 0.2, 0.4, 0.6}) {
      const auto points = calc_biaxial_points(c.in, skew, {share});
      ASSERT_EQ(points.size(), 3u);
      const BiaxialFit fit = fit_biaxial(points);
      std::printf("  N %.1f: p %.2f (%.2f..%.2f)", share, fit.exponent, fit.least, fit.greatest);
      // At one force the power law is the shape of the surface, to the grid of rotations.
      EXPECT_GT(fit.least, 0.95) << c.name;
      EXPECT_LT(fit.greatest, 1.05) << c.name;
      for (const BiaxialPoint& q : points) {
        const double e = std::pow(std::pow(q.y, 1.5) + std::pow(q.z, 1.5), 1 / 1.5);
        least = std::min(least, e), greatest = std::max(greatest, e);
      }
    }
    const BiaxialFit all = fit_biaxial(calc_biaxial_points(c.in, skew, {0.0, 0.2, 0.4, 0.6}));
    const double p = make_rcc(c.in).biaxial_exponent;
    std::printf("  all: p %.2f (%.2f..%.2f), make_rcc %.2f, with 1.5 %.2f..%.2f\n", all.exponent, all.least,
                all.greatest, p, least, greatest);
    EXPECT_NEAR(p, all.exponent, 0.1) << c.name;
    // Bresler's surface for rectangular columns: exponents of 1.15 to 2.
    EXPECT_GT(all.exponent, 1.15) << c.name;
    EXPECT_LT(all.exponent, 2) << c.name;
  }
}

ZoneInput make_beam() {
  // four bars of 25 mm below, two of 12 mm above
  ZoneInput in = make_column(0.3, 0.6, 4, 2, 0.025, 30);
  std::erase_if(in.section.bars, [](const product::Bar& b) { return b.z > 0 && std::abs(b.y) < 0.05; });
  for (product::Bar& bar : in.section.bars)
    if (bar.z > 0) bar.diameter = 0.012, bar.area = 0.25 * pi * 0.012 * 0.012;
  in.length = 0.3;
  return in;
}

TEST(BiaxialLine, EndsWhereOneMomentVanishes) {
  const ZoneInput in = make_beam();
  const BiaxialLine line = make_biaxial_line(in, 0, 12);
  ASSERT_TRUE(line.ends_at_z);
  EXPECT_EQ(line.z.front(), 0);
  EXPECT_EQ(line.y.back(), 0);
  for (size_t i = 1; i < line.y.size(); ++i) EXPECT_LT(line.y[i], 1.03 * line.y[i - 1]);
  for (size_t i = 0; i < line.y.size(); ++i) EXPECT_GE(line.y[i], 0);
  // turned about z alone it resists more, but with a moment about y
  const CrossedPeak alone = find_crossed_peak(in, Axis::Z, 1, 0);
  EXPECT_LT(alone.across, -0.5 * alone.moment);
  EXPECT_LT(line.z.back(), 0.95 * alone.moment);
  // the points next to the end lie on a straight way to it
  const size_t n = line.y.size();
  const double slope = (line.z[n - 2] - line.z[n - 3]) / (line.y[n - 2] - line.y[n - 3]);
  EXPECT_NEAR(line.z[n - 2] - slope * line.y[n - 2], line.z.back(), 0.1 * line.z.back());
  for (const BiaxialPoint& q : line.inside) {
    EXPECT_LT(q.y, 1.005);
    EXPECT_LT(q.z, 1.005);
  }
}

TEST(BiaxialLine, ForcesCarriedToOneSideHaveNoOtherEnd) {
  const ZoneInput in = make_beam();
  const double crushing = find_crushing(make_fibres(in, Axis::Y)).force;
  const BiaxialLine line = make_biaxial_line(in, -0.93 * crushing, 12);
  EXPECT_FALSE(line.ends_at_z);
  EXPECT_TRUE(line.inside.empty());
  for (const double y : line.y) EXPECT_GT(y, 0);
}

TEST(BiaxialLine, ShareTheGridOfTheirEnds) {
  // a square column at 45 degrees: on the coarse grid the corner's peak was missed by 2 %
  const ZoneInput in = make_column(0.5, 0.5, 3, 3, 0.032, 25);
  const BiaxialLine line = make_biaxial_line(in, -3.7e6, 12);
  ASSERT_EQ(line.y.size(), 13u);
  EXPECT_NEAR(line.y[6], line.z[6], 1e-6 * line.y[6]);
  const Fibres f = make_fibres(in, 0.25 * pi);
  const double last = 0.03;
  std::vector<double> kappa;
  for (int i = 0; i <= 2000; ++i) kappa.push_back(last / in.length * i / 2000);
  const March fine = march_curvature(f, -3.7e6, 1, kappa);
  const double peak = *std::max_element(fine.moment.begin(), fine.moment.end());
  EXPECT_NEAR(std::hypot(line.y[6], line.z[6]), peak, 2e-3 * peak);
  for (int i = 0; i <= 12; ++i)
    EXPECT_NEAR(line.y[static_cast<size_t>(i)], line.z[static_cast<size_t>(12 - i)], 2e-3 * peak);
}

/// Rotation at which a family has no moment left under a normal force, a force of its grid [rad].
double find_loss(const MomentFamily& f, size_t k) {
  const size_t J = f.rotation.size();
  size_t j = J - 1;
  while (j > 0 && !(f.moment[k * J + j] > 0)) --j;
  return f.rotation[j];
}

TEST(Oblique, RotationsAreLostAsTheyStrainTheEdges) {
  const struct {
    const char* name;
    ZoneInput in;
  } cases[] = {{"square", make_column(0.5, 0.5, 3, 3, 0.022, 30)},
               {"30 x 60", make_column(0.3, 0.6, 2, 5, 0.02, 30)},
               {"60 x 15", make_column(0.6, 0.15, 5, 2, 0.012, 30)},
               {"240 x 15", make_column(2.4, 0.15, 12, 2, 0.008, 30)}};
  for (const auto& c : cases) {
    const Rcc r = make_rcc(c.in);
    const double ratio = std::sqrt(r.EI_z / r.EI_y);
    const MomentFamily about_y = make_oblique_family(c.in, 0);
    for (const double skew : {0.2, 0.25 * pi, 1.3, 0.5 * pi}) {
      const double angle = std::atan2(c.in.section.height * std::sin(skew), c.in.section.width * std::cos(skew));
      const MomentFamily f = make_oblique_family(c.in, angle);
      for (size_t k = 1; k + 1 < f.normal_force.size(); ++k) {
        const double share = f.normal_force[k] / f.normal_force[0];
        if (share < 0.3 || share > 0.85) continue;
        const double strained = std::hypot(std::cos(angle), ratio * std::sin(angle)) * find_loss(f, k);
        // to the grid of rotations, 22 % from one to the next; a corner alone is crushed somewhat later
        const double over = strained / find_loss(about_y, k);
        EXPECT_GT(over, 0.78) << c.name << ", " << skew << ", " << share;
        EXPECT_LT(over, 1.45) << c.name << ", " << skew << ", " << share;
      }
    }
  }
}

}  // namespace
}  // namespace topple::nearfield
