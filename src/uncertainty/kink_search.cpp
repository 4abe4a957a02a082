#include "uncertainty/kink_search.h"

#include <algorithm>
#include <cmath>

namespace topple::uncertainty {

/// The dual linear programme by the simplex method: weights λ of the planes and multipliers μ of the upper limits,
///   Σ λ_j at_j(lower) - Σ w_i μ_i -> max,  Σ λ_j = 1,  Σ λ_j slope_ji + μ_i - s_i = 0,  λ, μ, s >= 0,
/// begun at the highest plane alone. The reduced costs of s are the place.
std::vector<double> find_lowest(const std::vector<double>& at, const std::vector<std::vector<double>>& slopes,
                                const std::vector<double>& lower, const std::vector<double>& upper) {
  const std::size_t n = lower.size(), m = at.size(), columns = m + 2 * n, last = columns;
  std::vector<double> height(m);
  double unit = 1e-300;
  for (std::size_t j = 0; j < m; ++j) {
    height[j] = at[j];
    for (std::size_t i = 0; i < n; ++i) {
      height[j] += slopes[j][i] * lower[i];
      unit = std::max(unit, std::abs(slopes[j][i]) * (upper[i] - lower[i]));
    }
    unit = std::max(unit, std::abs(height[j]));
  }
  // rows of the multipliers, of Σ λ, of the reduced costs; all in units of the largest value, and d in widths
  std::vector<std::vector<double>> T(n + 2, std::vector<double>(columns + 1, 0.0));
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < m; ++j) T[i][j] = slopes[j][i] * (upper[i] - lower[i]) / unit;
    T[i][m + i] = 1, T[i][m + n + i] = -1;
  }
  for (std::size_t j = 0; j < m; ++j) T[n][j] = 1, T[n + 1][j] = height[j] / unit;
  for (std::size_t i = 0; i < n; ++i) T[n + 1][m + i] = -1;
  T[n][last] = 1;
  std::vector<std::size_t> basis(n + 1);
  const auto pivot = [&](std::size_t row, std::size_t column) {
    const double by = T[row][column];
    for (double& v : T[row]) v /= by;
    for (std::size_t r = 0; r < n + 2; ++r) {
      const double factor = r == row ? 0 : T[r][column];
      if (factor != 0)
        for (std::size_t k = 0; k <= columns; ++k) T[r][k] -= factor * T[row][k];
    }
    basis[row] = column;
  };
  pivot(n, static_cast<std::size_t>(std::max_element(height.begin(), height.end()) - height.begin()));
  for (std::size_t i = 0; i < n; ++i) pivot(i, T[i][last] < 0 ? m + n + i : m + i);
  constexpr double small = 1e-12;
  for (int step = 0; step < 500; ++step) {
    // the steepest column; after many steps the first, which cannot go round in circles
    std::size_t column = columns;
    for (std::size_t k = 0; k < columns; ++k)
      if (T[n + 1][k] > small && (column == columns || (step < 200 && T[n + 1][k] > T[n + 1][column]))) column = k;
    if (column == columns) break;
    std::size_t row = n + 1;
    for (std::size_t r = 0; r <= n; ++r) {
      if (T[r][column] <= small) continue;
      if (row > n) {
        row = r;
        continue;
      }
      const double mine = T[r][last] / T[r][column], least = T[row][last] / T[row][column];
      if (mine < least || (mine == least && basis[r] < basis[row])) row = r;
    }
    if (row > n) break;
    pivot(row, column);
  }
  std::vector<double> d(n);
  for (std::size_t i = 0; i < n; ++i)
    d[i] = lower[i] + std::clamp(-T[n + 1][m + n + i], 0.0, 1.0) * (upper[i] - lower[i]);
  return d;
}

bool is_off_constraints(const Region& region, const Point& at) {
  constexpr double off = 2e-3;  // of the support's width
  if (!region.space->has_interaction()) return true;
  return std::all_of(region.axes.begin(), region.axes.end(), [&](int i) {
    Point low = at, high = at;
    low[i] -= off * region.scale[i], high[i] += off * region.scale[i];
    return region.contains(clip(region.box, std::move(low))) && region.contains(clip(region.box, std::move(high)));
  });
}

KinkSearch::KinkSearch(Region region, Point start, const Told& at_start, const Options& options)
    : LocalSearch(std::move(start), at_start),
      region_(std::move(region)),
      options_(options),
      random_(options.seed),
      radius_(options.radius) {
  converged_ = region_.axes.empty();
  if (!converged_) ask(best_);
}

/// A place, one a little off it, and from there one along every axis.
void KinkSearch::ask(const Point& x) {
  const double off = 1e-3 * radius_, h = 1e-4 * radius_;
  // along constraints perhaps not at once
  constexpr int most = 16;
  for (int attempt = 0; attempt < most; ++attempt) {
    Point near = x;
    for (const int i : region_.axes) {
      const double reach = random_.next(-off, off) * region_.scale[i];
      const bool is_inside = x[i] + reach >= region_.box.lower[i] && x[i] + reach <= region_.box.upper[i];
      near[i] += is_inside ? reach : -reach;
    }
    pending_ = {x, clip(region_.box, near)};
    for (const int i : region_.axes) {
      Point beside = pending_[1];
      beside[i] += (beside[i] + h * region_.scale[i] <= region_.box.upper[i] ? h : -h) * region_.scale[i];
      pending_.push_back(clip(region_.box, std::move(beside)));
    }
    if (!region_.space->has_interaction() ||
        std::all_of(pending_.begin(), pending_.end(), [this](const Point& p) { return region_.contains(p); }))
      return;
  }
}

double KinkSearch::distance_to(const Point& x) const { return calc_offset(x, best_, region_.axes, region_.scale); }

/// Nothing where values are missing or belong to another outcome.
std::optional<KinkSearch::Plane> KinkSearch::read(std::span<const Told> told) const {
  Plane p;
  p.x = pending_[1], p.value = told[1].value;
  for (std::size_t k = 0; k < told.size(); ++k) {
    if (!std::isfinite(told[k].value) || told[k].outcome != outcome_) return {};
    if (k < 2) continue;
    const int i = region_.axes[k - 2];
    const double h = (pending_[k][i] - p.x[i]) / region_.scale[i];
    if (h == 0) return {};
    p.slope.push_back((told[k].value - p.value) / h);
  }
  return p;
}

void KinkSearch::ask_next() {
  pending_.clear();
  const std::size_t n = region_.axes.size();
  for (;;) {
    if (radius_ < options_.smallest || iteration_ >= options_.iterations) return;
    std::erase_if(planes_, [this](const Plane& p) { return distance_to(p.x) > 4 * radius_; });
    if (planes_.size() > 6 * (n + 1)) planes_.erase(planes_.begin(), planes_.end() - static_cast<long>(6 * (n + 1)));
    std::vector<double> at, lower(n), upper(n);
    std::vector<std::vector<double>> slopes;
    for (const Plane& p : planes_) {
      double height = p.value - value_;
      for (std::size_t k = 0; k < n; ++k) {
        const int i = region_.axes[k];
        height += p.slope[k] * (best_[i] - p.x[i]) / region_.scale[i];
      }
      // a plane above the best value is not below the mapping everywhere
      at.push_back(-std::abs(height));
      slopes.push_back(p.slope);
    }
    if (planes_.empty()) return;
    for (std::size_t k = 0; k < n; ++k) {
      const int i = region_.axes[k];
      lower[k] = std::max(-radius_, (region_.box.lower[i] - best_[i]) / region_.scale[i]);
      upper[k] = std::min(radius_, (region_.box.upper[i] - best_[i]) / region_.scale[i]);
    }
    const std::vector<double> step = find_lowest(at, slopes, lower, upper);
    double model = at[0];
    for (std::size_t j = 0; j < at.size(); ++j) {
      double height = at[j];
      for (std::size_t k = 0; k < n; ++k) height += slopes[j][k] * step[k];
      model = j == 0 ? height : std::max(model, height);
    }
    promised_ = -model;
    if (promised_ <= options_.tolerance) {
      // once more by the planes that are near
      if (checks_++ >= 2) {
        converged_ = true;
        return;
      }
      radius_ *= 0.1;
      continue;
    }
    Point x = best_;
    for (std::size_t k = 0; k < n; ++k) {
      const int i = region_.axes[k];
      x[i] = step[k] == lower[k] && lower[k] > -radius_  ? region_.box.lower[i]
             : step[k] == upper[k] && upper[k] < radius_ ? region_.box.upper[i]
                                                         : best_[i] + step[k] * region_.scale[i];
    }
    x = pull_inside(region_, best_, clip(region_.box, std::move(x)));
    if (x == best_) {
      radius_ *= 0.1;
      continue;
    }
    ++iteration_;
    ask(x);
    return;
  }
}

void KinkSearch::tell(std::span<const Told> told) {
  const auto plane = read(told);
  if (is_first_) {
    is_first_ = false;
    if (plane) planes_.push_back(*plane);
    ask_next();
    return;
  }
  const double gained = value_ - told[0].value;
  bool is_bent = !plane;
  if (plane) {
    double height = plane->value - value_, rise = 0;
    for (std::size_t k = 0; k < region_.axes.size(); ++k) {
      const int i = region_.axes[k];
      height += plane->slope[k] * (best_[i] - plane->x[i]) / region_.scale[i];
      rise += plane->slope[k] * (pending_[0][i] - best_[i]) / region_.scale[i];
    }
    // a plane that leaves the model there as it was teaches nothing
    is_bent = rise - std::abs(height) < -0.7 * promised_;
    planes_.push_back(*plane);
  }
  if (plane && gained > 0.1 * promised_) {
    const double length = distance_to(pending_[0]);
    best_ = pending_[0], value_ = told[0].value, outcome_ = told[0].outcome;
    in_vain_ = 0;
    if (gained > 10 * options_.tolerance) checks_ = 0;
    if (gained > 0.5 * promised_ && length >= 0.99 * radius_) radius_ = std::min(2 * radius_, 0.2);
  } else {
    if (gained > 0 && plane) best_ = pending_[0], value_ = told[0].value, outcome_ = told[0].outcome;
    if (is_bent || ++in_vain_ > 2 * static_cast<int>(region_.axes.size())) radius_ *= is_bent ? 0.5 : 0.3, in_vain_ = 0;
  }
  ask_next();
}

}  // namespace topple::uncertainty
