#include "material/concrete.h"

#include <gtest/gtest.h>

#include "base/error.h"
#include "base/unit.h"
#include "product/plan_limits.h"

namespace topple::material {
namespace {

using unit::mm;
using unit::MPa;

ConcreteInput make_input(double fc, double Ec, double l_eq) {
  ConcreteInput in;
  in.fc = fc * MPa, in.Ec = Ec * MPa, in.l_eq = l_eq * mm;
  in.eps_c1 = 2.2e-3, in.Gcl = 15e3;
  return in;
}

struct Check {
  double fc, Ec, Eci, l_eq, gamma, at_1, at_5, at_10, largest;
};

// Plans are refused where no curve could be made of them, and nowhere else.
TEST(KraetzigPoellingLimits, ThePeakStrainsOfPlansAreThoseThatCurvesTake) {
  ConcreteInput in = make_input(30, 30e3, 100);
  const double least = product::limits::least_peak_strain * in.fc / in.Ec;
  in.eps_c1 = least * (1 + 1e-9);
  EXPECT_NO_THROW(make_concrete(in));
  in.eps_c1 = least * (1 - 1e-9);
  EXPECT_THROW(make_concrete(in), InputError);
}

class KraetzigPoelling : public testing::TestWithParam<Check> {};

// Values of an independent evaluation of equations (1) to (9), given to the digits written here.
TEST_P(KraetzigPoelling, AgreesWithTheCheckValues) {
  const Check v = GetParam();
  const ConcreteInput in = make_input(v.fc, v.Ec, v.l_eq);
  const Concrete c = make_concrete(in);
  EXPECT_NEAR(calc_parabola_modulus(c) / MPa, v.Eci, 0.06);
  EXPECT_NEAR(c.gamma * MPa, v.gamma, 0.6e-4);
  EXPECT_NEAR(calc_compression(c, 1e-3).stress / MPa, v.at_1, 0.6e-4);
  EXPECT_NEAR(calc_compression(c, 5e-3).stress / MPa, v.at_5, 0.6e-4);
  EXPECT_NEAR(calc_compression(c, 1e-2).stress / MPa, v.at_10, 0.6e-4);
  EXPECT_NEAR(calc_largest_l_eq(in) / mm, v.largest, 0.6);
}

INSTANTIATE_TEST_SUITE_P(CheckValues, KraetzigPoelling,
                         testing::Values(Check{10, 15e3, 18643.3, 100, 5.2091, 8.4783, 9.1507, 5.8130, 2663},
                                         Check{25, 30e3, 35788.6, 50, 3.3542, 20.1144, 21.7502, 11.5767, 965},
                                         Check{25, 30e3, 35788.6, 100, 15.0126, 20.1144, 14.9813, 4.0390, 965},
                                         Check{25, 30e3, 35788.6, 200, 76.7727, 20.1144, 5.6563, 0.9078, 965},
                                         Check{45, 52e3, 61568.4, 100, 33.0832, 35.8242, 12.3197, 2.0848, 527}));

TEST(Concrete, IsContinuousWithItsTangent) {
  const Concrete c = make_concrete([] {
    ConcreteInput in = make_input(25, 30e3, 100);
    in.fct = 2 * MPa, in.Gf = 130;
    return in;
  }());
  for (double e = -9e-3; e < 3e-3; e += 1.37e-5) {
    const double h = 1e-8;
    const double numeric = (calc_envelope(c, e + h).stress - calc_envelope(c, e - h).stress) / (2 * h);
    // Central differences: curvature times h² is below 1e-6 of the modulus; the two kinks are stepped over.
    if (std::abs(e + c.eps_linear) < 2e-8 || std::abs(e - c.eps_ct) < 2e-8) continue;
    EXPECT_NEAR(calc_envelope(c, e).tangent, numeric, 1e-5 * c.Ec) << "strain " << e;
  }
  for (double kink : {-c.eps_linear, -c.eps_c1, c.eps_ct, c.eps_ct + c.eps_tu})
    EXPECT_NEAR(calc_envelope(c, kink - 1e-12).stress, calc_envelope(c, kink + 1e-12).stress, 1e-5 * c.fc);
}

// Simpson's rule on graded steps; the tail beyond is integrated in closed form.
double integrate(double from, double to, int n, const auto& f) {
  double sum = 0;
  const double h = (to - from) / n;
  for (int i = 0; i < n; ++i) sum += h / 6 * (f(from + i * h) + 4 * f(from + (i + 0.5) * h) + f(from + (i + 1) * h));
  return sum;
}

TEST(Concrete, DissipatesTheCrushingEnergyWhateverTheLength) {
  for (double l_eq : {50.0, 150.0, 450.0}) {
    const Concrete c = make_concrete(make_input(25, 30e3, l_eq));
    // Substitution x = tan t turns the infinite tail into a finite interval.
    const double scale = std::sqrt(c.inverse_fc / c.tail);
    const double after = integrate(0, 1.5707963, 4000, [&](double t) {
      const double x = scale * std::tan(t);
      return calc_compression(c, c.eps_c1 + x).stress * scale / (std::cos(t) * std::cos(t));
    });
    const double plastic = c.b_c * (c.eps_c1 - c.fc / c.Ec);
    const double given_back = 0.5 * c.fc * (c.eps_c1 - plastic);
    EXPECT_NEAR((after + given_back) * l_eq * mm, 15e3, 1e-4 * 15e3) << l_eq;  // quadrature
  }
}

TEST(Concrete, DissipatesTheFractureEnergyWhateverTheLength) {
  for (double l_eq : {20.0, 150.0, 500.0}) {
    ConcreteInput in = make_input(25, 30e3, l_eq);
    in.fct = 1.994 * MPa, in.Gf = calc_fracture_energy(25 * MPa);
    const Concrete c = make_concrete(in);
    const auto stress = [&](double e) { return calc_tension(c, e).stress; };
    const double energy = integrate(0, c.eps_ct, 10, stress) + integrate(c.eps_ct, c.eps_ct + c.eps_tu, 2000, stress);
    // Hordijk's curve encloses 0.1947 f_ct w_c, so that 5.14 is the rounded factor.
    EXPECT_NEAR(energy * l_eq * mm, in.Gf, 2e-3 * in.Gf) << l_eq;
  }
}

TEST(Concrete, ModelCodeValues) {
  EXPECT_NEAR(calc_fracture_energy(38 * MPa), 140.5, 0.1);  // 73 · 38^0.18
  EXPECT_NEAR(calc_initial_modulus(10 * MPa) / MPa, 21500, 1e-6);
  EXPECT_NEAR(calc_initial_modulus(80 * MPa) / MPa, 43000, 1e-6);
}

TEST(Concrete, RefusesWhatCannotSoften) {
  EXPECT_THROW(make_concrete(make_input(25, 30e3, 970)), InputError);
  EXPECT_NO_THROW(make_concrete(make_input(25, 30e3, 960)));
  EXPECT_THROW(make_concrete(make_input(-1, 30e3, 100)), InputError);
  EXPECT_THROW(make_concrete(make_input(25, 10e3, 100)), InputError);  // peak below the elastic strain
  EXPECT_THROW(make_concrete(make_input(25, 30e3, 0)), InputError);
  EXPECT_THROW(make_concrete(make_input(25, std::nan(""), 100)), InputError);
}

TEST(Concrete, UnloadsToThePlasticStrainAndComesBack) {
  const Concrete c = make_concrete(make_input(25, 30e3, 100));
  ConcreteState state;
  const double deep = -4e-3;
  const double stress = advance(c, state, deep).stress;
  const double plastic = 0.7 * (4e-3 - -stress / c.Ec);
  EXPECT_NEAR(calc_plastic_strain(c, state), plastic, 1e-15);
  EXPECT_NEAR(advance(c, state, -plastic).stress, 0, 1e-6 * c.fc);
  // Halfway on the line whose slope is the damaged modulus.
  const double half = 0.5 * (deep - plastic);
  EXPECT_NEAR(advance(c, state, half).stress, 0.5 * stress, 1e-9 * c.fc);
  EXPECT_NEAR(advance(c, state, half).tangent, (1 - calc_damage(c, state)) * c.Ec, 1e-9 * c.Ec);
  EXPECT_NEAR(advance(c, state, deep).stress, stress, 1e-9 * c.fc);
  EXPECT_NEAR(advance(c, state, -5e-3).stress, calc_envelope(c, -5e-3).stress, 1e-9 * c.fc);
}

TEST(Concrete, CracksAfterCompressionFromTheShiftedOrigin) {
  ConcreteInput in = make_input(25, 30e3, 100);
  in.fct = 2 * MPa, in.Gf = 130;
  const Concrete c = make_concrete(in);
  ConcreteState state;
  advance(c, state, -3e-3);
  const double plastic = calc_plastic_strain(c, state), integrity = 1 - calc_damage(c, state);
  EXPECT_LT(integrity, 1);
  EXPECT_NEAR(advance(c, state, -plastic + c.eps_ct).stress, integrity * c.fct, 1e-6 * c.fct);
  // Opened, the crack closes along its own line, carries nothing while its faces come together, then compression.
  const double open = advance(c, state, -plastic + 4 * c.eps_ct).stress;
  EXPECT_GT(open, 0);
  EXPECT_NEAR(advance(c, state, -plastic + 0.1 * c.eps_ct).stress, 0, 1e-12);
  EXPECT_LT(advance(c, state, -plastic - 1e-4).stress, 0);
  EXPECT_NEAR(advance(c, state, -plastic + 4 * c.eps_ct).stress, open, 1e-9 * c.fct);
}

TEST(Concrete, NeverGivesBackEnergyInCycles) {
  ConcreteInput in = make_input(25, 30e3, 100);
  in.fct = 2 * MPa, in.Gf = 130;
  const Concrete c = make_concrete(in);
  ConcreteState state;
  double work = 0, strain = 0, stress = 0, least = 0;
  for (int i = 0; i < 200000; ++i) {
    const double next = 1e-8 * i * std::sin(i * 2e-4) - 5e-9 * i;
    const double s = advance(c, state, next).stress;
    work += 0.5 * (s + stress) * (next - strain);
    strain = next, stress = s;
    least = std::min(least, work);
  }
  EXPECT_GE(least, -1e-9 * c.fc);  // trapezoidal rule
  EXPECT_GT(work, 0);
}

TEST(Concrete, TiesConfineTheCore) {
  const ConcreteInput in = make_input(25, 30e3, 300);
  EXPECT_NEAR(confine(in, {0.05 * 25 * MPa}).fc / MPa, 25 * 1.25, 1e-9);
  EXPECT_NEAR(confine(in, {0.10 * 25 * MPa}).fc / MPa, 25 * 1.375, 1e-9);
  EXPECT_NEAR(confine(in, {0.05 * 25 * MPa}).eps_c1, 2.2e-3 * 1.25 * 1.25, 1e-12);
  EXPECT_EQ(confine(in, {0}).Gcl, in.Gcl);
  // The strain with a fifth of the strength lost moves by 0.2 σ2 / f_c.
  const Concrete plain = make_concrete(in);
  double lost = plain.eps_c1;
  while (calc_compression(plain, lost).stress > 0.8 * plain.fc) lost += 1e-7;
  const Concrete core = make_concrete(confine(in, {0.05 * 25 * MPa}));
  EXPECT_NEAR(calc_compression(core, lost + 0.2 * 0.05).stress, 0.8 * core.fc, 1e-4 * core.fc);
}

}  // namespace
}  // namespace topple::material
