// Compiled once for each instruction set (Highway's foreach_target).
#include "mbs/sparse_kernel.h"

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mbs/sparse_kernel.cpp"
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace topple::mbs::kernel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, kMostFactorRows>;
constexpr size_t kLanes = hn::MaxLanes(D());

/// Lanes of a vector for the first of so many numbers; more than these where one that is partly used takes them all.
constexpr size_t find_lanes(size_t numbers) {
  if (kLanes >= 8 && numbers > 4) return 8;
  size_t lanes = 1;
  while (2 * lanes <= kLanes && 2 * lanes <= numbers) lanes *= 2;
  return lanes;
}

/// y += A x, A by columns with Columns numbers from x.
template <size_t Rows, size_t Columns>
HWY_INLINE void add_block(const double* A, size_t stride, const double* x, double* y) {
  constexpr size_t lanes = find_lanes(Rows);
  constexpr hn::FixedTag<double, lanes> tag;
  if constexpr (lanes > Rows) {
    const auto wanted = hn::FirstN(tag, Rows);
    auto sum = hn::MaskedLoad(wanted, tag, y);
    for (size_t n = 0; n < Columns; ++n)
      sum = hn::Add(sum, hn::Mul(hn::MaskedLoad(wanted, tag, A + n * stride), hn::Set(tag, x[n])));
    hn::BlendedStore(sum, wanted, tag, y);
  } else {
    auto sum = hn::LoadU(tag, y);
    for (size_t n = 0; n < Columns; ++n)
      sum = hn::Add(sum, hn::Mul(hn::LoadU(tag, A + n * stride), hn::Set(tag, x[n])));
    hn::StoreU(sum, tag, y);
    if constexpr (lanes < Rows) add_block<Rows - lanes, Columns>(A + lanes, stride, x, y + lanes);
  }
}

template <size_t Each>
HWY_INLINE void add_blocks(const BlockJob& job) {
  const double* block = job.value;
  for (size_t j = 0; j < job.bodies; ++j) {
    const size_t rows = job.first[j + 1] - job.first[j], stride = Each * rows;
    for (size_t i = 0; i < rows; ++i)
      add_block<Each, Each>(block + Each * i, stride, job.x + Each * j,
                            job.y + Each * static_cast<size_t>(job.row[job.first[j] + i]));
    block += Each * stride;
  }
}
void add_product_here(const BlockJob& job) { job.each == 6 ? add_blocks<6>(job) : add_blocks<3>(job); }

/// Rows [Begin, 12) of the sum.
///   scaled  k x
template <size_t Begin>
HWY_INLINE void add_outer(const double* x, const double* scaled, size_t count, double* sum) {
  constexpr size_t lanes = std::min<size_t>(find_lanes(12 - Begin), Begin == 8 ? 4 : 8);
  constexpr hn::FixedTag<double, lanes> tag;
  for (size_t j = 0; j < 12; ++j) {
    double* const to = sum + 12 * j + Begin;
    auto column = hn::LoadU(tag, to);
    for (size_t r = 0; r < count; ++r)
      column = hn::Add(column, hn::Mul(hn::LoadU(tag, scaled + 12 * r + Begin), hn::Set(tag, x[12 * r + j])));
    hn::StoreU(column, tag, to);
  }
  if constexpr (Begin + lanes < 12) add_outer<Begin + lanes>(x, scaled, count, sum);
}
void add_outer_products_here(const double* x, const double* k, size_t count, double* sum) {
  double scaled[12 * kMostOuterProducts];
  for (size_t r = 0; r < count; ++r)
    for (size_t i = 0; i < 12; ++i) scaled[12 * r + i] = k[r] * x[12 * r + i];
  add_outer<0>(x, scaled, count, sum);
}

using Numbers = hn::Vec<D>;
constexpr size_t kRows = kMostFactorRows;

/// Rows of a group that are computed side by side.
struct Part {
  size_t lane, lanes;  // the first one in the group, and how many there are
  double* work;        // of the first one, kRows from unknown to unknown
};

/// Eliminates the columns of a run.
///   d  the rows' pivots, less what the columns take
template <size_t Columns>
HWY_INLINE void eliminate(const FactorJob& job, const FactorRun& run, const Part& part, Numbers& d) {
  constexpr D tag;
  double* const work = part.work;
  const hn::Mask<D> wanted = hn::FirstN(tag, part.lanes);
  Numbers y[Columns];
  for (size_t t = 0; t < Columns; ++t) y[t] = hn::Load(tag, work + (run.first + t) * kRows);
  double* column[Columns];  // from the row behind the run
  for (size_t t = 0; t < Columns; ++t) {
    double* const value = job.value + job.column[run.first + t];
    for (size_t r = t + 1; r < Columns; ++r) y[r] = hn::Sub(y[r], hn::Mul(hn::Set(tag, value[r - t - 1]), y[t]));
    column[t] = value + (Columns - 1 - t);
    const Numbers l = hn::Div(y[t], hn::Set(tag, job.pivot[run.first + t]));
    d = hn::Sub(d, hn::Mul(l, y[t]));
    hn::BlendedStore(l, wanted, tag, column[t] + run.above + part.lane);
    hn::Store(hn::Zero(tag), tag, work + (run.first + t) * kRows);
  }
  // rows of the group too; of a row on and right of its diagonal that is of no use, and cleared in the end
  const int* const row = job.row + job.column[run.last];
  for (size_t q = 0; q < run.above + part.lane + part.lanes; ++q) {
    double* const at = work + static_cast<size_t>(row[q]) * kRows;
    Numbers sum = hn::Load(tag, at);
    for (size_t t = 0; t < Columns; ++t) sum = hn::Sub(sum, hn::Mul(hn::Set(tag, column[t][q]), y[t]));
    hn::Store(sum, tag, at);
  }
}

HWY_INLINE void eliminate_run(const FactorJob& job, const FactorRun& run, const Part& part, Numbers& d) {
  static_assert(kMostFactorColumns == 6);
  switch (run.last - run.first) {
    case 0:
      return eliminate<1>(job, run, part, d);
    case 1:
      return eliminate<2>(job, run, part, d);
    case 2:
      return eliminate<3>(job, run, part, d);
    case 3:
      return eliminate<4>(job, run, part, d);
    case 4:
      return eliminate<5>(job, run, part, d);
    default:
      return eliminate<6>(job, run, part, d);
  }
}

bool calc_factor_here(const FactorJob& job) {
  constexpr D tag;
  const size_t lanes = hn::Lanes(tag);
  for (size_t group = 0; group < job.groups; ++group) {
    const size_t begin = job.first_row[group], rows = job.first_row[group + 1] - begin;
    alignas(64) double d[kRows] = {};
    for (size_t v = 0; v < rows; ++v) {
      for (int e = job.entry[begin + v]; e < job.entry[begin + v + 1]; ++e)
        job.work[static_cast<size_t>(job.entry_column[e]) * kRows + v] += job.matrix[job.source[e]];
      double& own = job.work[(begin + v) * kRows + v];
      d[v] = own;
      own = 0;
    }
    for (size_t lane = 0; lane < rows; lane += lanes) {
      const Part part{lane, std::min(lanes, rows - lane), job.work + lane};
      Numbers pivots = hn::Load(tag, d + lane);
      for (size_t r = job.first_run[group]; r < job.first_run[group + 1]; ++r)
        eliminate_run(job, job.runs[r], part, pivots);
      hn::Store(pivots, tag, d + lane);
    }
    // what the rows of the group take from each other
    for (size_t v = 0; v < rows; ++v) {
      double* const work = job.work + v;
      for (size_t u = 0; u < v; ++u) {
        const double y = work[(begin + u) * kRows];
        double* const value = job.value + job.column[begin + u];
        for (size_t w = u + 1; w < v; ++w) work[(begin + w) * kRows] -= value[w - u - 1] * y;
        const double l = y / job.pivot[begin + u];
        d[v] -= l * y;
        value[v - u - 1] = l;
      }
      job.pivot[begin + v] = d[v];
      if (d[v] == 0) return false;
    }
    std::fill_n(job.work + begin * kRows, rows * kRows, 0.0);
  }
  return true;
}

}  // namespace HWY_NAMESPACE
}  // namespace topple::mbs::kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace topple::mbs::kernel {

HWY_EXPORT(add_product_here);
HWY_EXPORT(add_outer_products_here);
HWY_EXPORT(calc_factor_here);

void add_product(const BlockJob& job) { HWY_DYNAMIC_DISPATCH(add_product_here)(job); }
void add_outer_products(const double* x, const double* k, size_t count, double* sum) {
  HWY_DYNAMIC_DISPATCH(add_outer_products_here)(x, k, count, sum);
}
bool calc_factor(const FactorJob& job) { return HWY_DYNAMIC_DISPATCH(calc_factor_here)(job); }

}  // namespace topple::mbs::kernel
#endif
