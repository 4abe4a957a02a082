#pragma once
/// Sparse symmetric matrices of bodies: products, sums, and factors. Each number is summed in an order of its own, so
/// its bits depend on no instruction set.

#include <cstddef>
#include <cstdint>

namespace topple::mbs::kernel {

/// A matrix of blocks, column by column of bodies: all rows of its first unknown, of its second one ...
struct BlockJob {
  size_t each;  // unknowns of a body, 3 or 6
  size_t bodies;
  const std::uint32_t* first;  // of a body's rows (bodies + 1)
  const int* row;              // bodies
  const double *value, *x;
  double* y;  // their product is added to it
};
void add_product(const BlockJob&);

constexpr size_t kMostOuterProducts = 6;

/// Adds k x xᵀ, as (k xᵢ) xⱼ, for one x after the other.
///   x    count x 12, at most kMostOuterProducts
///   k    count
///   sum  12 x 12, by columns
void add_outer_products(const double* x, const double* k, size_t count, double* sum);

constexpr size_t kMostFactorRows = 8;     // side by side
constexpr size_t kMostFactorColumns = 6;  // of a run

/// Columns that follow each other, each of which has the rows of the next one and the next one itself.
struct FactorRun {
  std::uint32_t first, last;
  std::uint32_t above;  // rows of the last one above those that are computed
};

/// A factor LDLᵀ, row by row, up to eight rows of the same pattern side by side in the SIMD lanes (up-looking; Davis,
/// Direct Methods for Sparse Linear Systems, 2006, ch. 4).
struct FactorJob {
  // groups of rows and, for each, its columns in the order of elimination
  size_t groups;
  const std::uint32_t *first_row, *first_run;  // groups + 1
  const FactorRun* runs;
  // L without its diagonal, by columns
  const int *column, *row;
  double* value;
  double* pivot;
  double* work;  // rows times kMostFactorRows, zeros
  // the matrix: of each row what is left of its diagonal and on it, and where its numbers are
  const int *entry, *entry_column;
  const std::uint32_t* source;
  const double* matrix;
};

/// False: a pivot is zero; then `work` and the factor are of no use.
bool calc_factor(const FactorJob&);

}  // namespace topple::mbs::kernel
