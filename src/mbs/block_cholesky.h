#pragma once
/// Symmetric positive semidefinite matrices of small blocks, as joints that share bodies make them: sparse Cholesky
/// factors, and the least-squares solution of least norm where rows depend on others (docs/theory/multibody.md, eq.
/// 7a).

#include <cstddef>
#include <utility>
#include <vector>

namespace topple::mbs {

/// Order in which n blocks are eliminated: the one with the fewest neighbours first, lower numbers first among equals.
/// A tree fills nothing in.
std::vector<int> find_elimination_order(int n, const std::vector<std::pair<int, int>>& links);

/// n rows in blocks; blocks are numbered in the order of elimination.
class BlockCholesky {
 public:
  /// Lays out the lower triangle: rows of each block, and which blocks are coupled. Values are zero.
  void analyse(const std::vector<int>& sizes, const std::vector<std::pair<int, int>>& links);
  int rows() const { return static_cast<int>(diagonal_.size()); }
  int first_row(int block) const { return first_[static_cast<size_t>(block)]; }
  void clear();
  /// Values of a coupled pair, i >= j, row-major rows(i) x rows(j); of a diagonal block only the lower triangle counts.
  double* block(int i, int j);
  /// Replaces the values by the factor; false if a pivot is not above `tolerance` of its diagonal, and then there is
  /// none.
  bool factorise(double tolerance);
  /// The same where rows may depend on others: those in `known` (rising) do, and one whose pivot is not above the
  /// tolerance. Returns how many.
  int factorise_dependent(double tolerance, const std::vector<int>& known = {});
  /// The same where `other`, factorised already, knows which rows depend on others: both have the same null space.
  void factorise_like(const BlockCholesky& other);
  /// Rows found to depend on others, rising.
  const std::vector<int>& dependent() const { return dependent_; }
  /// Rows that would stand for the dependence better: as dependent() where no null vector that is ±1 at its own row and
  /// 0 at the other dependent ones exceeds 4 anywhere, else swapped until none does.
  std::vector<int> choose_dependent() const;
  /// x = A⁺ b in place: the solution, or where rows depend on others the least-squares one of least Euclidean norm.
  void solve(double* x) const;
  /// Takes away what no x can reach: the part of b in the null space.
  void project(double* b) const;
  /// Orthonormal basis of the null space, one vector of n after the other.
  const std::vector<double>& null_space() const { return null_space_; }

 private:
  template <class Depends>
  void factorise_rows(Depends depends);
  void find_null_space();
  /// With the factor and its transpose; dependent rows get 0 from the first and keep their value in the second.
  void substitute(double* x) const;
  void substitute_back(double* x) const;

  struct Entry {
    int row = 0;       // block
    size_t value = 0;  // where its values begin
  };
  std::vector<int> sizes_, first_;
  std::vector<size_t> column_;  // first entry of each block column, which is the diagonal block; one more at the end
  std::vector<Entry> entries_;
  std::vector<double> values_, before_, diagonal_;  // the factor, what it was made of, and its diagonal
  std::vector<int> dependent_;
  std::vector<double> null_space_, raw_null_space_;
};

/// Rows of a dense row-major matrix that depend on the rest within the tolerance (distance from the span of the rest
/// over the row's length), rising: Gram and Schmidt, the row farthest from the span first. Destroys the matrix.
std::vector<int> find_dependent_rows(int rows, int columns, std::vector<double>& matrix, double tolerance);

}  // namespace topple::mbs
