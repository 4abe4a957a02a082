#include "mbs/stiffness_factor.h"

#include <Eigen/OrderingMethods>
#include <algorithm>

namespace topple::mbs {

bool StiffnessFactor::factorise(const Sparse& K) {
  const int *first = K.outerIndexPtr(), *row = K.innerIndexPtr();
  const auto columns = K.outerSize(), values = K.nonZeros();
  const auto is_same = [](const std::vector<int>& known, const int* begin, Eigen::Index count) {
    return std::equal(known.begin(), known.end(), begin, begin + count);
  };
  if (!is_same(first_, first, columns + 1) || !is_same(row_, row, values)) {
    analyse(K);
    first_.assign(first, first + columns + 1);
    row_.assign(row, row + values);
  }
  std::fill(work_.begin(), work_.end(), 0.0);
  return kernel::calc_factor({first_row_.size() - 1, first_row_.data(), first_run_.data(), runs_.data(),
                              factor_column_.data(), factor_row_.data(), factor_.data(), diagonal_.data(), work_.data(),
                              entry_.data(), entry_column_.data(), source_.data(), K.valuePtr()});
}

void StiffnessFactor::analyse(const Sparse& K) {
  const int n = static_cast<int>(K.rows());
  const Sparse whole = K.selfadjointView<Eigen::Lower>();
  Eigen::AMDOrdering<int>()(whole, inverse_order_);
  order_ = inverse_order_.inverse();
  // the places of its numbers, in the order in which Eigen sums them
  Sparse places = K, permuted(n, n);
  for (Eigen::Index i = 0; i < places.nonZeros(); ++i) places.valuePtr()[i] = static_cast<double>(i);
  permuted.selfadjointView<Eigen::Upper>() = places.selfadjointView<Eigen::Lower>().twistedBy(order_);
  entry_.assign(permuted.outerIndexPtr(), permuted.outerIndexPtr() + n + 1);
  entry_column_.assign(permuted.innerIndexPtr(), permuted.innerIndexPtr() + permuted.nonZeros());
  source_.clear();
  for (Eigen::Index i = 0; i < permuted.nonZeros(); ++i)
    source_.push_back(static_cast<std::uint32_t>(permuted.valuePtr()[i]));
  // of each row what the elimination tree leads to from its numbers
  std::vector<int> parent(static_cast<size_t>(n), -1), seen(static_cast<size_t>(n), -1), path;
  std::vector<std::vector<int>> pattern(static_cast<size_t>(n));
  factor_column_.assign(static_cast<size_t>(n) + 1, 0);
  for (int k = 0; k < n; ++k) {
    seen[static_cast<size_t>(k)] = k;
    std::vector<int>& backwards = pattern[static_cast<size_t>(k)];
    for (int e = entry_[static_cast<size_t>(k)]; e < entry_[static_cast<size_t>(k) + 1]; ++e) {
      path.clear();
      for (int i = entry_column_[static_cast<size_t>(e)]; seen[static_cast<size_t>(i)] != k;
           i = parent[static_cast<size_t>(i)]) {
        if (parent[static_cast<size_t>(i)] < 0) parent[static_cast<size_t>(i)] = k;
        path.push_back(i);
        seen[static_cast<size_t>(i)] = k;
        ++factor_column_[static_cast<size_t>(i) + 1];
      }
      backwards.insert(backwards.end(), path.rbegin(), path.rend());
    }
    std::reverse(backwards.begin(), backwards.end());
  }
  for (size_t i = 0; i < static_cast<size_t>(n); ++i) factor_column_[i + 1] += factor_column_[i];
  lay_out(pattern, parent);
  diagonal_.setZero(n);
  work_.assign(static_cast<size_t>(n) * kernel::kMostFactorRows, 0.0);
  factor_.assign(factor_row_.size(), 0.0);
}

void StiffnessFactor::lay_out(const std::vector<std::vector<int>>& pattern, const std::vector<int>& parent) {
  const size_t n = pattern.size();
  const auto count = [&](size_t column) { return factor_column_[column + 1] - factor_column_[column]; };
  factor_row_.assign(static_cast<size_t>(factor_column_.back()), 0);
  std::vector<int> filled(n, 0);
  first_row_.clear();
  first_run_.clear();
  runs_.clear();
  for (size_t begin = 0, end; begin < n; begin = end) {
    first_row_.push_back(static_cast<std::uint32_t>(begin));
    first_run_.push_back(static_cast<std::uint32_t>(runs_.size()));
    const std::vector<int>& of = pattern[begin];
    const auto is_alike = [&](size_t k) {
      const std::vector<int>& other = pattern[k];
      if (other.size() != of.size() + (k - begin) || !std::equal(of.begin(), of.end(), other.begin())) return false;
      for (size_t u = begin; u < k; ++u)
        if (other[of.size() + (u - begin)] != static_cast<int>(u)) return false;
      return true;
    };
    for (end = begin + 1; end < n && end < begin + kernel::kMostFactorRows && is_alike(end);) ++end;
    for (size_t p = 0; p < of.size();) {
      const size_t first = static_cast<size_t>(of[p]);
      size_t last = first;
      for (++p; p < of.size() && last + 1 < first + kernel::kMostFactorColumns; ++p, ++last)
        if (of[p] != static_cast<int>(last + 1) || parent[last] != of[p] || count(last) != count(last + 1) + 1) break;
      runs_.push_back({static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last),
                       static_cast<std::uint32_t>(filled[last])});
    }
    for (size_t k = begin; k < end; ++k)
      for (const int i : pattern[k])
        factor_row_[static_cast<size_t>(factor_column_[static_cast<size_t>(i)] + filled[static_cast<size_t>(i)]++)] =
            static_cast<int>(k);
  }
  first_row_.push_back(static_cast<std::uint32_t>(n));
  first_run_.push_back(static_cast<std::uint32_t>(runs_.size()));
}

StiffnessFactor::Vector StiffnessFactor::solve(const Vector& b) const {
  const Eigen::Map<const Sparse> L(diagonal_.size(), diagonal_.size(), static_cast<Eigen::Index>(factor_.size()),
                                   factor_column_.data(), factor_row_.data(), factor_.data());
  Vector x = order_ * b;
  L.triangularView<Eigen::UnitLower>().solveInPlace(x);
  x = diagonal_.asDiagonal().inverse() * x;
  L.transpose().triangularView<Eigen::UnitUpper>().solveInPlace(x);
  return inverse_order_ * x;
}

}  // namespace topple::mbs
