#include "fem/sparse.h"

#include <cholmod.h>
#include <dlfcn.h>

#include <algorithm>
#include <cstring>
#include <mutex>
#include <string>

#include "base/error.h"

extern "C" {  // of OpenMP; its header belongs to one compiler
void omp_set_max_active_levels(int levels);
int omp_get_max_active_levels(void);
}

namespace topple::fem {

namespace {

/// Keeps the BLAS below CHOLMOD on the thread that calls, where it is OpenBLAS with threads of its own.
void take_one_thread_of_blas() {
  if (void* set = dlsym(RTLD_DEFAULT, "openblas_set_num_threads")) reinterpret_cast<void (*)(int)>(set)(1);
}

/// Keeps loops of OpenMP on the thread that meets them, as long as it lives. CHOLMOD asks for four threads whatever the
/// user allows, and they look for work without end: where others want the processors a factorisation takes fifty times
/// as long.
class OneThread {
 public:
  OneThread() : levels_(omp_get_max_active_levels()) { omp_set_max_active_levels(0); }
  ~OneThread() { omp_set_max_active_levels(levels_); }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  int levels_;
};

}  // namespace

SparseMatrix make_pattern(int size, const std::vector<std::vector<int>>& groups) {
  std::vector<std::vector<int>> columns(static_cast<size_t>(size));
  for (int i = 0; i < size; ++i) columns[static_cast<size_t>(i)].push_back(i);
  for (const std::vector<int>& group : groups)
    for (const int i : group)
      for (const int j : group)
        if (i > j) columns[static_cast<size_t>(j)].push_back(i);
  SparseMatrix out;
  out.start.push_back(0);
  for (std::vector<int>& column : columns) {
    std::sort(column.begin(), column.end());
    column.erase(std::unique(column.begin(), column.end()), column.end());
    out.row.insert(out.row.end(), column.begin(), column.end());
    out.start.push_back(static_cast<int>(out.row.size()));
  }
  out.value.assign(out.row.size(), 0.0);
  return out;
}

int find_entry(const SparseMatrix& A, int i, int j) {
  const auto column = static_cast<size_t>(std::min(i, j));
  const auto first = A.row.begin() + A.start[column], last = A.row.begin() + A.start[column + 1];
  return static_cast<int>(std::lower_bound(first, last, std::max(i, j)) - A.row.begin());
}

std::vector<double> multiply(const SparseMatrix& A, const std::vector<double>& x) {
  std::vector<double> y(x.size(), 0.0);
  for (size_t j = 0; j < x.size(); ++j) {
    const auto first = static_cast<size_t>(A.start[j]), last = static_cast<size_t>(A.start[j + 1]);
    y[j] += A.value[first] * x[j];
    for (size_t k = first + 1; k < last; ++k) {
      const auto i = static_cast<size_t>(A.row[k]);
      y[i] += A.value[k] * x[j];
      y[j] += A.value[k] * x[i];
    }
  }
  return y;
}

struct Cholesky::Data {
  cholmod_common common;
  cholmod_sparse matrix;
  cholmod_factor* factor = nullptr;
  SparseMatrix pattern;  // start and row alone
  mutable cholmod_dense *x = nullptr, *y = nullptr, *e = nullptr;

  Data() {
    static std::once_flag once;
    std::call_once(once, take_one_thread_of_blas);
    cholmod_start(&common);
    common.print = 0;
    common.error_handler = nullptr;
    common.supernodal = CHOLMOD_SUPERNODAL;
  }
  ~Data() {
    cholmod_free_dense(&x, &common), cholmod_free_dense(&y, &common), cholmod_free_dense(&e, &common);
    cholmod_free_factor(&factor, &common);
    cholmod_finish(&common);
  }
  Data(const Data&) = delete;
  Data& operator=(const Data&) = delete;
};

Cholesky::Cholesky(const SparseMatrix& pattern) : data_(std::make_unique<Data>()) {
  Data& d = *data_;
  d.pattern = pattern;
  cholmod_sparse& m = d.matrix;
  std::memset(&m, 0, sizeof m);
  m.nrow = m.ncol = static_cast<size_t>(pattern.size());
  m.nzmax = pattern.row.size();
  m.p = d.pattern.start.data(), m.i = d.pattern.row.data(), m.x = d.pattern.value.data();
  m.stype = -1, m.itype = CHOLMOD_INT, m.xtype = CHOLMOD_REAL, m.dtype = CHOLMOD_DOUBLE;
  m.sorted = m.packed = 1;
  const OneThread one_thread;
  d.factor = cholmod_analyze(&m, &d.common);
  if (d.factor == nullptr)
    throw InputError("E653", "the system of " + std::to_string(pattern.size()) + " equations is too large to factor");
}

Cholesky::~Cholesky() = default;
Cholesky::Cholesky(Cholesky&&) noexcept = default;
Cholesky& Cholesky::operator=(Cholesky&&) noexcept = default;

bool Cholesky::factor(const SparseMatrix& A) {
  Data& d = *data_;
  d.matrix.x = const_cast<double*>(A.value.data());  // read only
  const OneThread one_thread;
  cholmod_factorize(&d.matrix, d.factor, &d.common);
  d.matrix.x = d.pattern.value.data();
  return d.common.status == CHOLMOD_OK && d.factor->minor == d.factor->n;
}

std::vector<double> Cholesky::solve(const std::vector<double>& b) const {
  Data& d = *data_;
  cholmod_dense right;
  std::memset(&right, 0, sizeof right);
  right.nrow = right.nzmax = right.d = b.size();
  right.ncol = 1;
  right.x = const_cast<double*>(b.data());  // read only
  right.xtype = CHOLMOD_REAL, right.dtype = CHOLMOD_DOUBLE;
  const OneThread one_thread;
  cholmod_solve2(CHOLMOD_A, d.factor, &right, nullptr, &d.x, nullptr, &d.y, &d.e, &d.common);
  const double* x = static_cast<const double*>(d.x->x);
  return {x, x + b.size()};
}

double Cholesky::factor_entries() const { return data_->common.lnz; }
double Cholesky::factor_flops() const { return data_->common.fl; }

}  // namespace topple::fem
