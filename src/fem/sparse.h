#pragma once
/// Symmetric positive sparse matrices with a pattern that stays, factored by CHOLMOD.

#include <memory>
#include <vector>

namespace topple::fem {

/// Lower triangle in compressed columns; rows rise within a column and the diagonal comes first.
struct SparseMatrix {
  std::vector<int> start, row;  // (n + 1), (entries)
  std::vector<double> value;    // (entries)
  int size() const { return static_cast<int>(start.size()) - 1; }
};

/// Pattern of all pairs (i, j) that stand together in a group; every diagonal entry is there.
SparseMatrix make_pattern(int size, const std::vector<std::vector<int>>& groups);
/// Index into `value` of the entry (i, j) or (j, i), which must be in the pattern.
int find_entry(const SparseMatrix&, int i, int j);

/// A x with the full symmetric matrix.
std::vector<double> multiply(const SparseMatrix&, const std::vector<double>& x);

/// A factorisation; the ordering and the symbolic analysis are made once for a pattern.
class Cholesky {
 public:
  explicit Cholesky(const SparseMatrix& pattern);
  ~Cholesky();
  Cholesky(Cholesky&&) noexcept;
  Cholesky& operator=(Cholesky&&) noexcept;
  /// False: the matrix is not positive; nothing can be solved then.
  [[nodiscard]] bool factor(const SparseMatrix&);
  std::vector<double> solve(const std::vector<double>& b) const;
  double factor_entries() const;  // numbers in L
  double factor_flops() const;    // floating-point operations of one factorisation

 private:
  struct Data;
  std::unique_ptr<Data> data_;
};

}  // namespace topple::fem
