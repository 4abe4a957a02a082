#include "mbs/block_cholesky.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace topple::mbs {

std::vector<int> find_elimination_order(int n, const std::vector<std::pair<int, int>>& links) {
  std::vector<std::set<int>> near(static_cast<size_t>(n));
  for (const auto& [a, b] : links) {
    if (a == b) continue;
    near[static_cast<size_t>(a)].insert(b);
    near[static_cast<size_t>(b)].insert(a);
  }
  std::set<std::pair<size_t, int>> queue;
  for (int i = 0; i < n; ++i) queue.insert({near[static_cast<size_t>(i)].size(), i});
  std::vector<int> order;
  while (!queue.empty()) {
    const int next = queue.begin()->second;
    queue.erase(queue.begin());
    order.push_back(next);
    const std::set<int> around = std::move(near[static_cast<size_t>(next)]);
    for (const int a : around) {
      std::set<int>& of = near[static_cast<size_t>(a)];
      queue.erase({of.size(), a});
      of.erase(next);
      of.insert(around.begin(), around.end());
      of.erase(a);
      queue.insert({of.size(), a});
    }
  }
  return order;
}

void BlockCholesky::analyse(const std::vector<int>& sizes, const std::vector<std::pair<int, int>>& links) {
  const size_t n = sizes.size();
  sizes_ = sizes;
  first_.assign(1, 0);
  for (const int s : sizes) first_.push_back(first_.back() + s);
  std::vector<std::set<int>> below(n);
  for (const auto& [a, b] : links)
    if (a != b) below[static_cast<size_t>(std::min(a, b))].insert(std::max(a, b));
  column_.clear();
  entries_.clear();
  size_t value = 0;
  for (size_t j = 0; j < n; ++j) {
    // what is coupled to j gets coupled among itself: enough to tell the first of them
    if (!below[j].empty()) {
      const size_t parent = static_cast<size_t>(*below[j].begin());
      below[parent].insert(std::next(below[j].begin()), below[j].end());
    }
    column_.push_back(entries_.size());
    const auto add = [&](int row) {
      entries_.push_back({row, value});
      value += static_cast<size_t>(sizes[static_cast<size_t>(row)]) * static_cast<size_t>(sizes[j]);
    };
    add(static_cast<int>(j));
    for (const int row : below[j]) add(row);
  }
  column_.push_back(entries_.size());
  values_.assign(value, 0);
  diagonal_.assign(static_cast<size_t>(first_.back()), 0);
  dependent_.clear();
  null_space_.clear();
}

void BlockCholesky::clear() { std::fill(values_.begin(), values_.end(), 0.0); }

double* BlockCholesky::block(int i, int j) {
  for (size_t e = column_[static_cast<size_t>(j)]; e < column_[static_cast<size_t>(j) + 1]; ++e)
    if (entries_[e].row == i) return &values_[entries_[e].value];
  return nullptr;
}

template <class Depends>
void BlockCholesky::factorise_rows(Depends depends) {
  const size_t blocks = sizes_.size();
  for (size_t j = 0; j < blocks; ++j) {
    const double* d = &values_[entries_[column_[j]].value];
    const int s = sizes_[j];
    for (int r = 0; r < s; ++r) diagonal_[static_cast<size_t>(first_[j] + r)] = d[r * s + r];
  }
  for (size_t j = 0; j < blocks; ++j) {
    const int s = sizes_[j];
    const size_t begin = column_[j], end = column_[j + 1];
    double* D = &values_[entries_[begin].value];
    double inverse[6];  // of the roots of the pivots; 0: the row depends on those before
    for (int k = 0; k < s; ++k) {
      double pivot = D[k * s + k];
      for (int i = 0; i < k; ++i) pivot -= D[k * s + i] * D[k * s + i];
      const bool dependent = depends(first_[j] + k, pivot);
      const double root = dependent ? 0 : std::sqrt(pivot);
      inverse[k] = dependent ? 0 : 1 / root;
      D[k * s + k] = root;
      for (int r = k + 1; r < s; ++r) {
        double sum = D[r * s + k];
        for (int i = 0; i < k; ++i) sum -= D[r * s + i] * D[k * s + i];
        D[r * s + k] = sum * inverse[k];
      }
    }
    for (size_t e = begin + 1; e < end; ++e) {
      double* X = &values_[entries_[e].value];
      for (int r = 0; r < sizes_[static_cast<size_t>(entries_[e].row)]; ++r, X += s)
        for (int k = 0; k < s; ++k) {
          double sum = X[k];
          for (int i = 0; i < k; ++i) sum -= X[i] * D[k * s + i];
          X[k] = sum * inverse[k];
        }
    }
    for (size_t c = begin + 1; c < end; ++c) {
      const size_t column = static_cast<size_t>(entries_[c].row);
      const double* C = &values_[entries_[c].value];
      const int width = sizes_[column];
      size_t target = column_[column];
      for (size_t e = c; e < end; ++e) {
        while (entries_[target].row != entries_[e].row) ++target;
        double* T = &values_[entries_[target].value];
        const double* X = &values_[entries_[e].value];
        const int height = sizes_[static_cast<size_t>(entries_[e].row)];
        for (int r = 0; r < height; ++r)
          for (int k = 0; k < width; ++k) {
            double sum = 0;
            for (int i = 0; i < s; ++i) sum += X[r * s + i] * C[k * s + i];
            T[r * width + k] -= sum;
          }
      }
    }
  }
}

bool BlockCholesky::factorise(double tolerance) {
  dependent_.clear();
  null_space_.clear();
  bool good = true;
  factorise_rows([&](int row, double pivot) {
    if (pivot > tolerance * diagonal_[static_cast<size_t>(row)]) return false;
    good = false;
    return true;
  });
  return good;
}

int BlockCholesky::factorise_dependent(double tolerance, const std::vector<int>& known) {
  dependent_.clear();
  null_space_.clear();
  before_ = values_;
  size_t next = 0;
  factorise_rows([&](int row, double pivot) {
    const bool is_known = next < known.size() && known[next] == row;
    if (is_known) ++next;
    if (!is_known && pivot > tolerance * diagonal_[static_cast<size_t>(row)]) return false;
    dependent_.push_back(row);
    return true;
  });
  if (!dependent_.empty()) find_null_space();
  return static_cast<int>(dependent_.size());
}

void BlockCholesky::factorise_like(const BlockCholesky& other) {
  dependent_ = other.dependent_;
  null_space_ = other.null_space_;
  size_t next = 0;
  factorise_rows([&](int row, double) {
    if (next == dependent_.size() || dependent_[next] != row) return false;
    ++next;
    return true;
  });
}

std::vector<int> BlockCholesky::choose_dependent() const {
  const size_t n = diagonal_.size(), k = dependent_.size();
  std::vector<int> chosen = dependent_;
  std::vector<double> null = raw_null_space_;
  for (size_t swaps = 0; swaps < 4 * k + 4; ++swaps) {
    size_t row = 0, vector = 0;
    double most = 4;
    for (size_t v = 0; v < k; ++v)
      for (size_t r = 0; r < n; ++r)
        if (std::abs(null[n * v + r]) > most) most = std::abs(null[n * v + r]), row = r, vector = v;
    if (most == 4) break;
    // the row takes the place of the vector's own: 1 there, 0 in the other vectors
    double* z = &null[n * vector];
    const double scale = 1 / z[row];
    for (size_t r = 0; r < n; ++r) z[r] *= scale;
    for (size_t v = 0; v < k; ++v) {
      if (v == vector) continue;
      const double share = null[n * v + row];
      for (size_t r = 0; r < n; ++r) null[n * v + r] -= share * z[r];
    }
    chosen[vector] = static_cast<int>(row);
  }
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

void BlockCholesky::substitute_back(double* x) const {
  for (size_t j = sizes_.size(); j-- > 0;) {
    const int s = sizes_[j];
    double* xj = x + first_[j];
    for (size_t e = column_[j] + 1; e < column_[j + 1]; ++e) {
      const double* X = &values_[entries_[e].value];
      const double* xi = x + first_[static_cast<size_t>(entries_[e].row)];
      for (int r = 0; r < sizes_[static_cast<size_t>(entries_[e].row)]; ++r)
        for (int k = 0; k < s; ++k) xj[k] -= X[r * s + k] * xi[r];
    }
    const double* D = &values_[entries_[column_[j]].value];
    for (int k = s; k-- > 0;) {
      // the value of a dependent row is given
      if (D[k * s + k] > 0) xj[k] /= D[k * s + k];
      for (int i = 0; i < k; ++i) xj[i] -= D[k * s + i] * xj[k];
    }
  }
}

void BlockCholesky::find_null_space() {
  const size_t n = diagonal_.size();
  null_space_.assign(n * dependent_.size(), 0);
  for (size_t v = 0; v < dependent_.size(); ++v) {
    // z is -1 there, and elsewhere what the other rows make the same with
    double* z = &null_space_[n * v];
    const size_t block =
        static_cast<size_t>(std::upper_bound(first_.begin(), first_.end(), dependent_[v]) - first_.begin() - 1);
    const int k = dependent_[v] - first_[block];
    for (size_t j = 0; j < sizes_.size(); ++j)
      for (size_t e = column_[j]; e < column_[j + 1]; ++e) {
        const size_t row = static_cast<size_t>(entries_[e].row);
        const double* X = &before_[entries_[e].value];
        if (row == block)
          for (int i = 0; i < sizes_[j]; ++i)
            z[first_[j] + i] = X[row == j && i > k ? i * sizes_[j] + k : k * sizes_[j] + i];
        else if (j == block)
          for (int i = 0; i < sizes_[row]; ++i) z[first_[row] + i] = X[i * sizes_[j] + k];
      }
    for (const int d : dependent_) z[d] = 0;
    substitute(z);
    substitute_back(z);
    for (const int d : dependent_) z[d] = 0;
    z[dependent_[v]] = -1;
  }
  raw_null_space_ = null_space_;
  for (size_t v = 0; v < dependent_.size(); ++v) {
    double* z = &null_space_[n * v];
    // Gram and Schmidt, twice for round-off
    for (int round = 0; round < 2; ++round) {
      for (size_t u = 0; u < v; ++u) {
        const double* other = &null_space_[n * u];
        double along = 0;
        for (size_t i = 0; i < n; ++i) along += other[i] * z[i];
        for (size_t i = 0; i < n; ++i) z[i] -= along * other[i];
      }
      double length2 = 0;
      for (size_t i = 0; i < n; ++i) length2 += z[i] * z[i];
      const double scale = 1 / std::sqrt(length2);
      for (size_t i = 0; i < n; ++i) z[i] *= scale;
    }
  }
}

void BlockCholesky::project(double* b) const {
  const size_t n = diagonal_.size();
  for (size_t v = 0; v < null_space_.size(); v += n) {
    double along = 0;
    for (size_t i = 0; i < n; ++i) along += null_space_[v + i] * b[i];
    for (size_t i = 0; i < n; ++i) b[i] -= along * null_space_[v + i];
  }
}

void BlockCholesky::substitute(double* x) const {
  for (size_t j = 0; j < sizes_.size(); ++j) {
    const int s = sizes_[j];
    double* xj = x + first_[j];
    const double* D = &values_[entries_[column_[j]].value];
    for (int k = 0; k < s; ++k) {
      double sum = xj[k];
      for (int i = 0; i < k; ++i) sum -= D[k * s + i] * xj[i];
      xj[k] = D[k * s + k] > 0 ? sum / D[k * s + k] : 0;
    }
    for (size_t e = column_[j] + 1; e < column_[j + 1]; ++e) {
      const double* X = &values_[entries_[e].value];
      double* xi = x + first_[static_cast<size_t>(entries_[e].row)];
      for (int r = 0; r < sizes_[static_cast<size_t>(entries_[e].row)]; ++r) {
        double sum = 0;
        for (int k = 0; k < s; ++k) sum += X[r * s + k] * xj[k];
        xi[r] -= sum;
      }
    }
  }
}

void BlockCholesky::solve(double* x) const {
  project(x);
  substitute(x);
  substitute_back(x);
  project(x);
}

std::vector<int> find_dependent_rows(int rows, int columns, std::vector<double>& matrix, double tolerance) {
  const size_t n = static_cast<size_t>(rows), m = static_cast<size_t>(columns);
  const auto dot_of = [&](size_t a, size_t b) {
    double sum = 0;
    for (size_t c = 0; c < m; ++c) sum += matrix[a * m + c] * matrix[b * m + c];
    return sum;
  };
  std::vector<double> length(n);
  for (size_t r = 0; r < n; ++r) length[r] = std::sqrt(dot_of(r, r));
  std::vector<unsigned char> taken(n, 0);
  std::vector<int> out;
  for (size_t step = 0; step < n; ++step) {
    size_t next = n;
    double farthest = tolerance;
    for (size_t r = 0; r < n; ++r) {
      if (taken[r]) continue;
      const double distance = std::sqrt(dot_of(r, r)) / length[r];
      if (distance > farthest) farthest = distance, next = r;
    }
    if (next == n) break;
    taken[next] = 1;
    const double scale = 1 / std::sqrt(dot_of(next, next));
    for (size_t c = 0; c < m; ++c) matrix[next * m + c] *= scale;
    for (size_t r = 0; r < n; ++r) {
      if (taken[r]) continue;
      for (int round = 0; round < 2; ++round) {
        const double along = dot_of(r, next);
        for (size_t c = 0; c < m; ++c) matrix[r * m + c] -= along * matrix[next * m + c];
      }
    }
  }
  for (size_t r = 0; r < n; ++r)
    if (!taken[r]) out.push_back(static_cast<int>(r));
  return out;
}

}  // namespace topple::mbs
