// Sparse factors of small blocks against dense linear algebra.
#include "mbs/block_cholesky.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

namespace topple::mbs {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

/// A = B Bᵀ of blocks that meet in nodes, as joints meet in bodies; each node is an own set of columns of B.
struct Case {
  std::vector<int> sizes;
  std::vector<std::pair<int, int>> links;
  Matrix B;
  Matrix A() const { return B * B.transpose(); }
};

/// Blocks (rows) and which nodes each of them touches.
Case make_case(const std::vector<int>& sizes, const std::vector<std::vector<int>>& nodes, int node_count,
               int node_width) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Case c;
  c.sizes = sizes;
  int rows = 0;
  for (const int s : sizes) rows += s;
  c.B = Matrix::Zero(rows, node_count * node_width);
  int at = 0;
  for (size_t i = 0; i < sizes.size(); ++i) {
    for (const int n : nodes[i])
      for (int r = 0; r < sizes[i]; ++r)
        for (int k = 0; k < node_width; ++k) c.B(at + r, n * node_width + k) = uniform(random);
    at += sizes[i];
    for (size_t k = 0; k < i; ++k)
      for (const int n : nodes[i])
        if (std::find(nodes[k].begin(), nodes[k].end(), n) != nodes[k].end())
          c.links.push_back({static_cast<int>(k), static_cast<int>(i)});
  }
  return c;
}

BlockCholesky load(const Case& c) {
  BlockCholesky m;
  m.analyse(c.sizes, c.links);
  const Matrix A = c.A();
  const auto put = [&](int i, int j) {
    double* x = m.block(i, j);
    ASSERT_NE(x, nullptr);
    for (int r = 0; r < c.sizes[static_cast<size_t>(i)]; ++r)
      for (int k = 0; k < c.sizes[static_cast<size_t>(j)]; ++k)
        x[r * c.sizes[static_cast<size_t>(j)] + k] = A(m.first_row(i) + r, m.first_row(j) + k);
  };
  for (int i = 0; i < static_cast<int>(c.sizes.size()); ++i) put(i, i);
  for (const auto& [a, b] : c.links) put(b, a);
  return m;
}

Vector least_norm(const Matrix& A, const Vector& b) {
  Eigen::CompleteOrthogonalDecomposition<Matrix> full;
  full.setThreshold(1e-10);
  full.compute(A);
  return full.solve(b);
}

Vector some_vector(Eigen::Index n) {
  Vector b(n);
  for (Eigen::Index i = 0; i < n; ++i) b[i] = std::sin(1.7 * static_cast<double>(i) + 0.3);
  return b;
}

TEST(BlockCholesky, SolvesATreeAndARing) {
  // blocks of 1 to 6 rows on a tree of nodes, then closed to a ring
  for (const bool ring : {false, true}) {
    std::vector<std::vector<int>> nodes = {{0}, {0, 1}, {1, 2}, {1, 3}, {3, 4}, {4, 5}};
    if (ring) nodes.push_back({5, 0});
    std::vector<int> sizes = {5, 6, 3, 4, 2, 1};
    if (ring) sizes.push_back(2);
    const Case c = make_case(sizes, nodes, 6, 6);
    BlockCholesky m = load(c);
    ASSERT_TRUE(m.factorise(1e-10));
    Vector x = some_vector(m.rows());
    const Vector wanted = c.A().llt().solve(x);
    m.solve(x.data());
    EXPECT_LT((x - wanted).norm(), 1e-10 * wanted.norm());
  }
}

TEST(BlockCholesky, GivesTheLeastSquaresAnswerOfLeastNorm) {
  // more rows than the nodes have columns: 4 blocks of 5 rows on two nodes of 6 columns, 8 rows too many
  const Case c = make_case({5, 5, 5, 5}, {{0}, {0, 1}, {0, 1}, {1}}, 2, 6);
  BlockCholesky m = load(c);
  EXPECT_FALSE(BlockCholesky(m).factorise(1e-10));
  ASSERT_EQ(m.factorise_dependent(1e-10), 8);
  const Matrix A = c.A();
  const Vector b = some_vector(20);  // not in the range of A
  Vector x = b;
  m.solve(x.data());
  const Vector wanted = least_norm(A, b);
  EXPECT_LT((x - wanted).norm(), 1e-8 * wanted.norm());
  // the null space is orthonormal and null
  const Eigen::Map<const Matrix> N(m.null_space().data(), 20, 8);
  EXPECT_LT((N.transpose() * N - Matrix::Identity(8, 8)).norm(), 1e-12);
  EXPECT_LT((c.B.transpose() * N).norm(), 1e-9);
}

TEST(BlockCholesky, AnyChoiceOfDependentRowsGivesTheSameAnswer) {
  const Case c = make_case({5, 5, 5, 5}, {{0}, {0, 1}, {0, 1}, {1}}, 2, 6);
  std::vector<double> dense(20 * 12);
  Eigen::Map<Eigen::Matrix<double, 20, 12, Eigen::RowMajor>>(dense.data()) = c.B;
  const std::vector<int> chosen = find_dependent_rows(20, 12, dense, 1e-6);
  ASSERT_EQ(chosen.size(), 8U);
  EXPECT_TRUE(std::is_sorted(chosen.begin(), chosen.end()));
  BlockCholesky a = load(c), b = load(c);
  ASSERT_EQ(a.factorise_dependent(1e-10), 8);
  ASSERT_EQ(b.factorise_dependent(1e-10, chosen), 8);
  EXPECT_EQ(b.dependent(), chosen);
  Vector x = some_vector(20), y = x, z = x;
  a.solve(x.data());
  b.solve(y.data());
  EXPECT_LT((x - y).norm(), 1e-8 * x.norm());
  // another matrix with the same null space: D weighs the columns
  Case weighted = c;
  for (Eigen::Index k = 0; k < 12; ++k) weighted.B.col(k) *= 1 + 0.3 * static_cast<double>(k);
  BlockCholesky d = load(weighted);
  d.factorise_like(b);
  d.solve(z.data());
  const Vector wanted = least_norm(weighted.A(), some_vector(20));
  EXPECT_LT((z - wanted).norm(), 1e-8 * wanted.norm());
}

TEST(BlockCholesky, ChoosesRowsThatRepeatClearly) {
  // row 1 repeats row 0 with a hundredth: row 0 stands for the dependence, not row 1, whose null vector is 100 at row 0
  Case c;
  c.sizes = {1, 1, 1};
  c.links = {{0, 1}, {0, 2}, {1, 2}};
  c.B = Matrix(3, 3);
  c.B << 0.01, 0, 0, 1, 0, 0, 0.5, 1, 0;
  BlockCholesky m = load(c);
  ASSERT_EQ(m.factorise_dependent(1e-10), 1);
  EXPECT_EQ(m.dependent(), std::vector<int>{1});
  EXPECT_EQ(m.choose_dependent(), std::vector<int>{0});
}

TEST(EliminationOrder, OfATreeFillsNothingIn) {
  // a star with arms: every eliminated block has one neighbour left
  const std::vector<std::pair<int, int>> links = {{0, 1}, {0, 2}, {0, 3}, {1, 4}, {2, 5}, {3, 6}, {6, 7}};
  const std::vector<int> order = find_elimination_order(8, links);
  ASSERT_EQ(order.size(), 8U);
  std::vector<int> at(8);
  for (int i = 0; i < 8; ++i) at[static_cast<size_t>(order[static_cast<size_t>(i)])] = i;
  for (int i = 0; i < 8; ++i) {
    int later = 0;
    for (const auto& [a, b] : links)
      if ((a == i && at[static_cast<size_t>(b)] > at[static_cast<size_t>(i)]) ||
          (b == i && at[static_cast<size_t>(a)] > at[static_cast<size_t>(i)]))
        ++later;
    EXPECT_LE(later, 1) << i;
  }
}

}  // namespace
}  // namespace topple::mbs
