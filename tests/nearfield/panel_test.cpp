#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "base/unit.h"
#include "nearfield/rcc.h"

namespace topple::nearfield {
namespace {

using unit::MPa;

product::Concrete make_concrete() {
  product::Concrete c;
  c.fc = 25 * MPa, c.fct = 2 * MPa, c.Ec = 30e9, c.Gf = 130, c.Gcl = 15e3, c.eps_c1 = 2.2e-3;
  return c;
}
const product::Steel steel{"", 420 * MPa, 525 * MPa, 200e9, 0.08};

TEST(PanelRcc, SlabYieldsLikeABeamOfOneMetre) {
  product::Panel p;
  p.thickness = 0.15, p.as_bottom = 5e-4, p.as_top = 3e-4, p.cover = 0.02;
  const product::Concrete c = make_concrete();
  const PanelRcc r = make_panel_rcc(p, &c, &steel);
  const double block = 5e-4 * 420 / (0.85 * 25);
  EXPECT_NEAR(r.moment_pos, 5e-4 * 420e6 * (0.13 - block / 2), 1e-6);
  EXPECT_LT(r.moment_neg, r.moment_pos);
  EXPECT_GT(r.ultimate_rotation, 0.05);
  EXPECT_NEAR(r.tension, 8e-4 * 525e6, 1e-6);
  EXPECT_NEAR(r.EA, 30e9 * 0.15, 1);
  EXPECT_LT(r.EI, 30e9 * std::pow(0.15, 3) / 12);
  EXPECT_GT(r.EI, 0.03 * 30e9 * std::pow(0.15, 3) / 12);
}

TEST(PanelRcc, BarsTooFewToBearTheCrackingMomentLeaveItUncracked) {
  product::Panel p;
  p.thickness = 0.15, p.cover = 0.02;
  const product::Concrete c = make_concrete();
  const double whole = 30e9 * std::pow(0.15, 3) / 12, cracking = 2e6 * 0.15 * 0.15 / 6;
  for (const double top : {1e-300, 1e-5, 5e-5}) {
    p.as_bottom = 5e-4, p.as_top = top;
    const PanelRcc r = make_panel_rcc(p, &c, &steel);
    EXPECT_NEAR(r.moment_neg, cracking, 1e-9 * cracking) << top;
    EXPECT_NEAR(r.EI, whole, 1e-9 * whole) << top;
  }
  p.as_top = 3e-4;
  EXPECT_LT(make_panel_rcc(p, &c, &steel).EI, 0.5 * whole);
}

TEST(PanelRcc, PlainConcreteAndMasonryAreBrittle) {
  product::Panel p;
  p.thickness = 0.25;
  const product::Concrete c = make_concrete();
  const PanelRcc plain = make_panel_rcc(p, &c, nullptr);
  EXPECT_NEAR(plain.moment_pos, 2e6 * 0.25 * 0.25 / 6, 1e-6);
  EXPECT_NEAR(plain.tension, 2e6 * 0.25, 1e-6);
  EXPECT_LT(plain.ultimate_rotation, 5e-3);

  p.strength = 4 * MPa, p.modulus = 3e9;
  const PanelRcc masonry = make_panel_rcc(p, nullptr, nullptr);
  EXPECT_LT(masonry.moment_pos, 0.2 * plain.moment_pos);
  EXPECT_NEAR(masonry.compression, 4e6 * 0.25, 1e-6);
  EXPECT_GT(masonry.shear_in_plane, 0);
  EXPECT_GT(masonry.elongation_at_rupture, 0);
}

TEST(PanelRcc, RefusesNonsense) {
  product::Panel p;
  EXPECT_THROW(make_panel_rcc(p, nullptr, nullptr), InputError);
  p.thickness = 0.2;
  EXPECT_THROW(make_panel_rcc(p, nullptr, nullptr), InputError);
  p.strength = 4 * MPa, p.modulus = 3e9, p.as_top = 1e-4, p.cover = 0.15;
  EXPECT_THROW(make_panel_rcc(p, nullptr, &steel), InputError);
}

}  // namespace
}  // namespace topple::nearfield
