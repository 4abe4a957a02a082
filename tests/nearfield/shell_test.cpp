#include "nearfield/shell.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/error.h"
#include "base/unit.h"

namespace topple::nearfield {
namespace {

using unit::MPa;

constexpr double pi = 3.14159265358979323846;

product::Concrete make_concrete() {
  product::Concrete c;
  c.fc = 25 * MPa, c.fct = 2 * MPa, c.Ec = 30e9, c.Gf = 130, c.Gcl = 15e3, c.eps_c1 = 2.2e-3;
  return c;
}
const product::Steel steel{"", 420 * MPa, 525 * MPa, 200e9, 0.08};
const product::Steel flat{"", 420 * MPa, 420.001 * MPa, 200e9, 0.08};  // no hardening

product::Panel make_slab() {
  product::Panel p;
  p.name = "slab", p.thickness = 0.16, p.as_bottom = 7e-4, p.as_top = 4e-4, p.cover = 0.025;
  return p;
}

double at(const MomentFamily& f, double N, size_t j) {
  size_t k = 1;
  while (k + 1 < f.normal_force.size() && f.normal_force[k] < N) ++k;
  const double s = (N - f.normal_force[k - 1]) / (f.normal_force[k] - f.normal_force[k - 1]);
  const size_t J = f.rotation.size();
  return (1 - s) * f.moment[(k - 1) * J + j] + s * f.moment[k * J + j];
}
size_t row_of(const MomentFamily& f, double N) {
  size_t best = 0;
  for (size_t k = 0; k < f.normal_force.size(); ++k)
    if (std::abs(f.normal_force[k] - N) < std::abs(f.normal_force[best] - N)) best = k;
  return best;
}
double peak_of(const MomentFamily& f, size_t k) {
  const auto row = f.moment.begin() + static_cast<std::ptrdiff_t>(k * f.rotation.size());
  return *std::max_element(row, row + static_cast<std::ptrdiff_t>(f.rotation.size()));
}
/// Moment on the plateau between yield and the loss of bars.
double moment_at(const MomentFamily& f, double N, double rotation) {
  size_t j = 1;
  while (j + 1 < f.rotation.size() && f.rotation[j] < rotation) ++j;
  const double s = (rotation - f.rotation[j - 1]) / (f.rotation[j] - f.rotation[j - 1]);
  return (1 - s) * at(f, N, j - 1) + s * at(f, N, j);
}

TEST(Shell, SlabYieldsAtTheHandMoments) {
  const product::Concrete c = make_concrete();
  for (const double as : {3e-4, 7e-4, 14e-4}) {
    product::Panel p = make_slab();
    p.as_bottom = as, p.as_top = 0;
    const ShellRcc r = make_shell_rcc(make_shell_input(p, &c, &flat));
    const double d = 0.135, block = as * 420 / (0.85 * 25), by_hand = as * 420e6 * (d - 0.5 * block);
    const double computed = moment_at(r.pos, 0, 0.02);
    std::printf("  %.0f mm2/m: m %.2f kNm/m, by hand %.2f\n", as * 1e6, computed / 1e3, by_hand / 1e3);
    // Some tension of the concrete is left; the block carries f_c instead of 0.85 f_c.
    EXPECT_NEAR(computed, by_hand, 0.04 * by_hand);
  }
}

TEST(Shell, AgreesWithTheScalarsOfThePanel) {
  const product::Panel p = make_slab();
  const product::Concrete c = make_concrete();
  const PanelRcc scalars = make_panel_rcc(p, &c, &steel);
  const ShellRcc r = make_shell_rcc(make_shell_input(p, &c, &steel));
  const size_t k = row_of(r.pos, 0);
  std::printf(
      "  bending %.2f / %.2f, tension %.0f / %.0f, compression %.0f / %.0f, EI %.0f / %.0f k, last %.3f / %.3f\n",
      peak_of(r.pos, k) / 1e3, scalars.moment_pos / 1e3, r.tension.force[1] / 1e3, scalars.tension / 1e3,
      -r.pos.normal_force.front() / 1e3, scalars.compression / 1e3, r.calc_EI_effective(0) / 1e3, scalars.EI / 1e3,
      r.pos.rotation.back(), scalars.ultimate_rotation);
  // Scalars are yield moments; the family hardens by up to f_u / f_y = 1.25.
  for (const auto& [family, scalar] : {std::pair{&r.pos, scalars.moment_pos}, {&r.neg, scalars.moment_neg}}) {
    EXPECT_GT(peak_of(*family, k), scalar);
    EXPECT_LT(peak_of(*family, k), 1.35 * scalar);
  }
  EXPECT_NEAR(*std::max_element(r.tension.force.begin(), r.tension.force.end()), scalars.tension, 1);
  EXPECT_NEAR(-r.pos.normal_force.front(), scalars.compression, 0.03 * scalars.compression);
  EXPECT_NEAR(r.EA, scalars.EA + (200e9 - 30e9) * 11e-4, 1);
  // The scalar takes the weaker face alone, cracked.
  EXPECT_GT(r.calc_EI_effective(0), scalars.EI);
  EXPECT_LT(r.calc_EI_effective(0), r.EI);
}

TEST(Shell, TurnsUntilBarsBreakOrTheEdgeHasCrushed) {
  const product::Concrete c = make_concrete();
  const auto find_end = [&](double as, double length) {
    product::Panel p = make_slab();
    p.as_bottom = as, p.as_top = 0;
    const ShellRcc r = make_shell_rcc(make_shell_input(p, &c, &steel, length));
    const size_t J = r.pos.rotation.size(), k = row_of(r.pos, 0);
    const double limit = 0.9 * peak_of(r.pos, k), *m = &r.pos.moment[k * J];
    size_t j = J - 1;
    while (m[j] < limit) --j;
    return r.pos.rotation[j] + (r.pos.rotation[j + 1] - r.pos.rotation[j]) * (m[j] - limit) / (m[j] - m[j + 1]);
  };
  // Few bars break at ε_u, as the scalar of the panel says.
  product::Panel light = make_slab();
  light.as_bottom = 2e-4, light.as_top = 0;
  const double scalar = make_panel_rcc(light, &c, &steel).ultimate_rotation;
  EXPECT_NEAR(find_end(2e-4, 0.16), scalar, 0.15 * scalar);  // steps of the grid are 18 %
  // More bars need a compression that the edge can give up to φ = (G_cl + what is given back) / T, whatever the length.
  for (const double length : {0.08, 0.16, 0.32}) {
    const double T = 7e-4 * 480e6, end = find_end(7e-4, length);
    std::printf("  zone of %.2f m: ends at %.4f, G_cl / T %.4f\n", length, end, 15e3 / T);
    EXPECT_GT(end, 0.8 * 15e3 / T);
    EXPECT_LT(end, 1.1 * (15e3 + 20e3 * length) / T + 0.006);
  }
}

TEST(Shell, IsABeamOfOneMetre) {
  const product::Panel p = make_slab();
  const product::Concrete c = make_concrete();
  const ShellRcc shell = make_shell_rcc(make_shell_input(p, &c, &steel));
  ZoneInput in;
  in.section.name = "strip", in.section.width = 1, in.section.height = 0.16;
  for (int i = 0; i < 10; ++i) {
    in.section.bars.push_back({-0.45 + 0.1 * i, 0.055, 7e-5, 1e-3});
    in.section.bars.push_back({-0.45 + 0.1 * i, -0.055, 4e-5, 1e-3});
  }
  // Held bars, as those of a panel: ties without confinement.
  in.section.tie_diameter = 1e-4, in.section.tie_spacing = 4e-3, in.section.cover = 0.5e-4, in.section.tie_legs_y = 2;
  in.concrete = c, in.steel = steel, in.length = 0.16;
  const Rcc beam = make_rcc(in);
  for (size_t k = 1; k + 1 < shell.pos.normal_force.size(); ++k) {
    const double N = shell.pos.normal_force[k];
    EXPECT_NEAR(beam.y_pos.normal_force[k], N, 2e-3 * -shell.pos.normal_force[0]);
    for (const auto& [a, b] : {std::pair{&shell.pos, &beam.y_pos}, {&shell.neg, &beam.y_neg}})
      EXPECT_NEAR(peak_of(*a, k), peak_of(*b, k), 0.01 * peak_of(*a, row_of(*a, 0))) << N;
  }
}

TEST(Shell, MeshTurnsAfterJohansen) {
  ShellInput in;
  in.name = "mesh", in.thickness = 0.2, in.length = 0.2, in.concrete = make_concrete(), in.steel = flat;
  in.concrete.fct = 0;
  const auto moment = [&](double angle, double along, double across) {
    in.mesh = {{0.075, along, angle, 0}, {0.075, across, angle + 0.5 * pi, 0}};
    return moment_at(make_shell_rcc(in).pos, 0, 0.04);
  };
  const double m_x = moment(0, 8e-4, 4e-4), m_y = moment(0.5 * pi, 8e-4, 4e-4), equal = moment(0, 6e-4, 6e-4);
  EXPECT_NEAR(m_y, 0.5 * m_x, 0.02 * m_x);
  for (const double angle : {0.3, pi / 4, 1.1}) {
    const double c = std::cos(angle), s = std::sin(angle);
    // Yield line: m_x cos² + m_y sin²; the lever arm differs a little between the directions.
    EXPECT_NEAR(moment(angle, 8e-4, 4e-4), m_x * c * c + m_y * s * s, 0.01 * m_x) << angle;
    EXPECT_NEAR(moment(angle, 6e-4, 6e-4), equal, 0.01 * equal) << angle;
  }
}

TEST(Shell, DepthsOfBothDirectionsCount) {
  ShellInput in;
  in.name = "two layers", in.thickness = 0.2, in.length = 0.2, in.concrete = make_concrete(), in.steel = flat;
  // Bars along at the outside, bars across inside of them.
  in.mesh = {{0.075, 6e-4, 0, 0}, {0.063, 6e-4, 0.5 * pi, 0}};
  const double along = moment_at(make_shell_rcc(in).pos, 0, 0.04);
  for (ShellInput::Mesh& m : in.mesh) m.angle += 0.5 * pi;
  const double across = moment_at(make_shell_rcc(in).pos, 0, 0.04);
  EXPECT_NEAR(along - across, 6e-4 * 420e6 * 0.012, 0.1 * 6e-4 * 420e6 * 0.012);
}

TEST(Shell, PlainWallLeansOnItsEdge) {
  product::Panel p;
  p.name = "wall", p.thickness = 0.25, p.strength = 4 * MPa, p.modulus = 3e9;
  const ShellRcc r = make_shell_rcc(make_shell_input(p, nullptr, nullptr));
  const double crushing = -r.pos.normal_force.front();
  EXPECT_NEAR(crushing, 4e6 * 0.25, 0.01 * crushing);
  for (const double share : {0.1, 0.2, 0.3}) {
    const double N = share * crushing, block = 0.5 * N * 0.25 * (1 - share);
    const size_t k = row_of(r.pos, -N);
    std::printf("  N %.1f: m %.2f kNm/m, block %.2f\n", share, peak_of(r.pos, k) / 1e3, block / 1e3);
    // A rectangular block of f is the upper bound; the parabola gives some less, the tensile strength some more.
    EXPECT_LT(peak_of(r.pos, k), 1.06 * block);
    EXPECT_GT(peak_of(r.pos, k), 0.90 * block);
  }
  // Without force: the tensile strength in bending, somewhat above f_ct t² / 6 as the crack softens.
  const double cracking = 0.16e6 * 0.25 * 0.25 / 6, m = peak_of(r.pos, row_of(r.pos, 0));
  EXPECT_GT(m, cracking);
  EXPECT_LT(m, 2 * cracking);
  EXPECT_NEAR(peak_of(r.pos, 5), peak_of(r.neg, 5), 1e-6 * peak_of(r.pos, 5));
}

TEST(Shell, PlainTensionOpensACrackWithItsEnergy) {
  product::Panel p;
  p.name = "plain", p.thickness = 0.2;
  const product::Concrete c = make_concrete();
  const ShellRcc r = make_shell_rcc(make_shell_input(p, &c, nullptr));
  double work = 0;
  for (size_t i = 1; i < r.tension.force.size(); ++i)
    work += 0.5 * (r.tension.force[i] + r.tension.force[i - 1]) *
            (r.tension.displacement[i] - r.tension.displacement[i - 1]);
  std::printf("  work %.1f J/m, G_f t %.1f\n", work, 130 * 0.2);
  EXPECT_NEAR(r.tension.force[0], 2e6 * 0.2, 1);
  EXPECT_NEAR(work, 130 * 0.2, 0.15 * 26);  // chords of a convex curve
}

TEST(Shell, RefusesNonsense) {
  ShellInput in;
  in.name = "x", in.thickness = 0.2, in.length = 0.2, in.concrete = make_concrete(), in.steel = steel;
  EXPECT_NO_THROW(make_shell_rcc(in));
  in.mesh = {{0.11, 1e-4, 0, 0}};
  EXPECT_THROW(make_shell_rcc(in), InputError);
  in.mesh = {{0.05, -1e-4, 0, 0}};
  EXPECT_THROW(make_shell_rcc(in), InputError);
  in.mesh.clear(), in.length = 0;
  EXPECT_THROW(make_shell_rcc(in), InputError);
  in.length = 5;
  EXPECT_THROW(make_shell_rcc(in), InputError);
  product::Panel p;
  EXPECT_THROW(make_shell_input(p, nullptr, nullptr), InputError);
}

}  // namespace
}  // namespace topple::nearfield
