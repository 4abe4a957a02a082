#include "material/solid_concrete.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <type_traits>

#include "base/error.h"
#include "base/unit.h"

namespace topple::material {
namespace {

using unit::mm;
using unit::MPa;
using Voigt = std::array<double, 6>;

static_assert(std::is_trivially_copyable_v<SolidConcreteState>);

SolidConcreteInput make_input(double fc, double Ec, double l_eq, double fct = 2) {
  SolidConcreteInput in;
  in.uniaxial.fc = fc * MPa, in.uniaxial.Ec = Ec * MPa, in.uniaxial.l_eq = l_eq * mm;
  in.uniaxial.fct = fct * MPa, in.uniaxial.Gf = calc_fracture_energy(fc * MPa);
  return in;
}

/// One integration point with some strains given and the other stresses prescribed.
struct Point {
  const SolidConcrete& c;
  SolidConcreteState state{};
  Voigt strain{};
  SolidUpdate last{};

  /// Strain `direction` goes to `value`; the other five components bear `stress`. Newton's method on the tangent.
  void pull(int direction, double value, const Voigt& stress = {}) {
    strain[direction] = value;
    SolidConcreteState now;
    for (int iteration = 0; iteration < 60; ++iteration) {
      last = advance(c, state, strain, now);
      ASSERT_TRUE(last.converged);
      double K[5][6], worst = 0;
      int free[5], n = 0;
      for (int a = 0; a < 6; ++a)
        if (a != direction) free[n++] = a;
      for (int i = 0; i < 5; ++i) {
        K[i][5] = stress[free[i]] - last.response.stress[free[i]];
        worst = std::max(worst, std::abs(K[i][5]));
        for (int j = 0; j < 5; ++j) K[i][j] = last.response.tangent[6 * free[i] + free[j]];
        K[i][i] += 1e-12 * c.law.Ec;  // a crack that is open in all directions has no stiffness
      }
      if (worst < 1e-12 * c.law.fc) {
        state = now;
        return;
      }
      for (int k = 0; k < 5; ++k)
        for (int i = 0; i < 5; ++i) {
          if (i == k) continue;
          const double f = K[i][k] / K[k][k];
          for (int j = k; j < 6; ++j) K[i][j] -= f * K[k][j];
        }
      for (int i = 0; i < 5; ++i) strain[free[i]] += K[i][5] / K[i][i];
    }
    FAIL() << "stresses not met at strain " << value;
  }
  double stress(int i) const { return last.response.stress[i]; }
};

TEST(SolidConcrete, ReproducesTheUniaxialCurveInCompressionAndTension) {
  const SolidConcrete c = make_solid_concrete(make_input(25, 30e3, 100));
  for (double end : {-1e-2, 2e-3}) {
    Point p{c};
    for (int i = 1; i <= 100; ++i) {
      ASSERT_NO_FATAL_FAILURE(p.pull(0, end * i / 100));
      EXPECT_NEAR(p.stress(0), calc_envelope(c.law, end * i / 100).stress, 1e-10 * c.law.fc) << p.strain[0];
    }
  }
}

}  // namespace
}  // namespace topple::material
