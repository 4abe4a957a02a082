#pragma once
/// LDLᵀ of a sparse symmetric matrix: the bits of Eigen's SimplicialLDLT, in a fraction of its time where rows come in
/// blocks with the same pattern, as those of a body do. The order of elimination is looked for where the pattern is not
/// that of before.

#include <Eigen/Sparse>
#include <vector>

#include "base/aligned.h"
#include "mbs/sparse_kernel.h"

namespace topple::mbs {

class StiffnessFactor {
 public:
  using Sparse = Eigen::SparseMatrix<double>;
  using Vector = Eigen::VectorXd;

  /// False: a pivot is zero.
  ///   K  both triangles, n x n, compressed
  bool factorise(const Sparse& K);
  /// Of K x = b, after a factor without a pivot of zero.
  Vector solve(const Vector& b) const;
  /// In the order of elimination.
  const Vector& diagonal() const { return diagonal_; }
  /// Whose pivot stands at a place of the diagonal.
  Eigen::Index unknown_of(Eigen::Index pivot) const { return inverse_order_.indices()[pivot]; }

 private:
  void analyse(const Sparse& K);
  /// Lays out groups of rows, and for each the runs of columns that are eliminated from it.
  void lay_out(const std::vector<std::vector<int>>& pattern, const std::vector<int>& parent);

  std::vector<int> first_, row_;  // of the matrix by columns
  Eigen::PermutationMatrix<Eigen::Dynamic, Eigen::Dynamic, int> order_, inverse_order_;
  std::vector<int> entry_, entry_column_;  // of the matrix in that order, row by row up to the diagonal
  std::vector<std::uint32_t> source_;      // where its numbers are in the matrix
  std::vector<std::uint32_t> first_row_, first_run_;
  std::vector<kernel::FactorRun> runs_;
  std::vector<int> factor_column_, factor_row_;
  std::vector<double> factor_;
  AlignedVector<double> work_;
  Vector diagonal_;
};

}  // namespace topple::mbs
