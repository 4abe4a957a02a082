#include "mbs/stiffness_factor.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <Eigen/SparseCholesky>
#include <random>

namespace topple::mbs {
namespace {

using Sparse = StiffnessFactor::Sparse;
using Vector = StiffnessFactor::Vector;

/// Bodies with blocks of unknowns, some of them linked; numbers of any sign.
Sparse make_matrix(int bodies, int each, double links, std::mt19937& random) {
  std::uniform_real_distribution<double> number(-1, 1);
  std::uniform_int_distribution<int> body(0, bodies - 1);
  std::vector<Eigen::Triplet<double>> t;
  const auto add = [&](int a, int b) {
    for (int m = 0; m < each; ++m)
      for (int n = 0; n < each; ++n) {
        const double x = number(random);
        t.emplace_back(each * a + m, each * b + n, x);
        t.emplace_back(each * b + n, each * a + m, x);
      }
  };
  for (int a = 0; a < bodies; ++a) {
    add(a, a);
    for (int m = 0; m < each; ++m) t.emplace_back(each * a + m, each * a + m, 20 * number(random));
  }
  for (int l = 0; l < links * bodies; ++l) add(body(random), body(random));
  const Eigen::Index n = Eigen::Index{each} * bodies;
  Sparse K(n, n);
  K.setFromTriplets(t.begin(), t.end());
  return K;
}

void expect_bits_of_eigen(StiffnessFactor& factor, const Sparse& K) {
  const Eigen::SimplicialLDLT<Sparse> reference(K);
  ASSERT_EQ(reference.info(), Eigen::Success);
  ASSERT_TRUE(factor.factorise(K));
  EXPECT_TRUE(factor.diagonal() == reference.vectorD());
  const Vector b = Vector::LinSpaced(K.rows(), -1, 2);
  EXPECT_TRUE(factor.solve(b) == reference.solve(b));
  for (Eigen::Index i = 0; i < K.rows(); ++i) EXPECT_EQ(factor.unknown_of(i), reference.permutationPinv().indices()[i]);
}

TEST(StiffnessFactor, HasTheBitsOfEigen) {
  std::mt19937 random(7);
  for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
    hwy::SetSupportedTargetsForTest(target);
    for (const int each : {1, 3, 6, 8, 11})
      for (const int bodies : {1, 2, 9, 60})
        for (const double links : {0.0, 0.7, 2.5}) {
          SCOPED_TRACE(std::string(hwy::TargetName(target)) + ", " + std::to_string(bodies) + " bodies of " +
                       std::to_string(each) + " unknowns");
          StiffnessFactor factor;
          expect_bits_of_eigen(factor, make_matrix(bodies, each, links, random));
        }
  }
  hwy::SetSupportedTargetsForTest(0);
}

TEST(StiffnessFactor, KeepsTheOrderForOtherNumbersAndFindsAnewForAnotherPattern) {
  std::mt19937 random(8);
  StiffnessFactor factor;
  Sparse K = make_matrix(40, 6, 1.5, random);
  expect_bits_of_eigen(factor, K);
  K *= 3;
  K.diagonal().array() += 2;
  expect_bits_of_eigen(factor, K);
  expect_bits_of_eigen(factor, make_matrix(40, 6, 1.5, random));
  expect_bits_of_eigen(factor, make_matrix(4, 3, 1.5, random));
}

TEST(StiffnessFactor, TellsOfAPivotOfZeroAndGoesOn) {
  std::mt19937 random(9);
  StiffnessFactor factor;
  const Sparse K = make_matrix(20, 6, 1, random);
  Sparse singular = K;
  for (Eigen::Index i = 0; i < singular.nonZeros(); ++i) singular.valuePtr()[i] = 1;
  EXPECT_FALSE(factor.factorise(singular));
  EXPECT_NE(Eigen::SimplicialLDLT<Sparse>(singular).info(), Eigen::Success);
  expect_bits_of_eigen(factor, K);
}

}  // namespace
}  // namespace topple::mbs
