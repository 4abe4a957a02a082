#include "uncertainty/cluster.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace topple::uncertainty {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

double calc_distance2(const Point& a, const Point& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += (a[i] - b[i]) * (a[i] - b[i]);
  return sum;
}
double calc_distance(const Point& a, const Point& b) { return std::sqrt(calc_distance2(a, b)); }

/// Distances of all pairs.
class Distances {
 public:
  explicit Distances(const std::vector<Point>& points) : size_(points.size()), d_(size_ * size_) {
    for (std::size_t i = 0; i < size_; ++i)
      for (std::size_t j = 0; j < i; ++j) d_[i * size_ + j] = d_[j * size_ + i] = calc_distance(points[i], points[j]);
  }
  double operator()(std::size_t i, std::size_t j) const { return d_[i * size_ + j]; }
  std::size_t size() const { return size_; }

 private:
  std::size_t size_;
  std::vector<double> d_;
};

/// PAM's greedy build: each medoid is the point that lowers the cost most.
std::vector<int> build(const Distances& d, int k) {
  std::vector<int> medoids;
  std::vector<double> nearest(d.size(), infinite);
  for (int m = 0; m < k; ++m) {
    int best = -1;
    double best_cost = infinite;
    for (std::size_t c = 0; c < d.size(); ++c) {
      if (std::find(medoids.begin(), medoids.end(), static_cast<int>(c)) != medoids.end()) continue;
      double cost = 0;
      for (std::size_t i = 0; i < d.size(); ++i) cost += std::min(nearest[i], d(i, c));
      if (cost < best_cost) best_cost = cost, best = static_cast<int>(c);
    }
    medoids.push_back(best);
    for (std::size_t i = 0; i < d.size(); ++i) nearest[i] = std::min(nearest[i], d(i, best));
  }
  return medoids;
}

double calc_silhouette(const Distances& d, const std::vector<int>& group, int k) {
  if (k < 2) return 0;
  std::vector<int> size(k, 0);
  for (const int g : group) ++size[g];
  double sum = 0;
  for (std::size_t i = 0; i < d.size(); ++i) {
    if (size[group[i]] < 2) continue;
    std::vector<double> total(k, 0.0);
    for (std::size_t j = 0; j < d.size(); ++j) total[group[j]] += d(i, j);
    const double a = total[group[i]] / (size[group[i]] - 1);
    double b = infinite;
    for (int g = 0; g < k; ++g)
      if (g != group[i] && size[g] > 0) b = std::min(b, total[g] / size[g]);
    if (const double larger = std::max(a, b); larger > 0 && larger < infinite) sum += (b - a) / larger;
  }
  return sum / static_cast<double>(d.size());
}

Medoids find_medoids(const Distances& d, int k) {
  Medoids r;
  r.medoids = build(d, k);
  const std::size_t n = d.size();
  std::vector<double> first(n), second(n);  // distances to the nearest and the next medoid
  std::vector<int> own(n);
  const auto assign = [&] {
    r.cost = 0;
    for (std::size_t i = 0; i < n; ++i) {
      first[i] = second[i] = infinite;
      for (int g = 0; g < k; ++g)
        if (const double x = d(i, r.medoids[g]); x < first[i]) {
          second[i] = first[i], first[i] = x, own[i] = g;
        } else {
          second[i] = std::min(second[i], x);
        }
      r.cost += first[i];
    }
  };
  assign();
  for (int sweep = 0; sweep < 200; ++sweep) {
    // the best swap of all medoids with all points
    double best = -1e-12 * r.cost;
    int out = -1, in = -1;
    for (std::size_t c = 0; c < n; ++c) {
      if (std::find(r.medoids.begin(), r.medoids.end(), static_cast<int>(c)) != r.medoids.end()) continue;
      double shared = 0;
      std::vector<double> change(k, 0.0);
      for (std::size_t i = 0; i < n; ++i) {
        const double x = d(i, c);
        if (x < first[i]) {
          shared += x - first[i];
          // when its medoid goes, the point moves to the candidate all the same
        } else {
          change[own[i]] += std::min(x, second[i]) - first[i];
        }
      }
      for (int g = 0; g < k; ++g)
        if (shared + change[g] < best) best = shared + change[g], out = g, in = static_cast<int>(c);
    }
    if (out < 0) break;
    r.medoids[out] = in;
    assign();
  }
  r.group = own;
  r.silhouette = calc_silhouette(d, r.group, k);
  return r;
}

}  // namespace

Medoids find_medoids(const std::vector<Point>& points, int k) { return find_medoids(Distances(points), k); }

double calc_silhouette(const std::vector<Point>& points, const std::vector<int>& group, int k) {
  return calc_silhouette(Distances(points), group, k);
}

FuzzyMeans find_fuzzy_means(const std::vector<Point>& points, int k) {
  const std::size_t n = points.size(), dim = points[0].size();
  FuzzyMeans r;
  for (const int m : build(Distances(points), k)) r.centres.push_back(points[m]);
  r.share.assign(n, std::vector<double>(k, 0.0));
  std::vector<double> d2(k);
  for (r.iterations = 0; r.iterations < 500 && !r.converged;) {
    ++r.iterations;
    double largest = 0;
    for (std::size_t i = 0; i < n; ++i) {
      int at = -1;  // a centre that coincides with the point
      for (int g = 0; g < k; ++g)
        if (d2[g] = calc_distance2(points[i], r.centres[g]); d2[g] == 0) at = g;
      double sum = 0;
      for (int g = 0; g < k; ++g) sum += at < 0 ? 1 / d2[g] : 0;
      for (int g = 0; g < k; ++g) {
        const double u = at < 0 ? 1 / d2[g] / sum : g == at ? 1 : 0;
        largest = std::max(largest, std::abs(u - r.share[i][g]));
        r.share[i][g] = u;
      }
    }
    for (int g = 0; g < k; ++g) {
      Point sum(dim, 0.0);
      double weight = 0;
      for (std::size_t i = 0; i < n; ++i) {
        const double w = r.share[i][g] * r.share[i][g];
        weight += w;
        for (std::size_t c = 0; c < dim; ++c) sum[c] += w * points[i][c];
      }
      if (weight > 0)
        for (std::size_t c = 0; c < dim; ++c) r.centres[g][c] = sum[c] / weight;
    }
    r.converged = largest < 1e-9;
  }
  double squares = 0, compact = 0, apart = infinite;
  for (std::size_t i = 0; i < n; ++i)
    for (int g = 0; g < k; ++g) {
      const double w = r.share[i][g] * r.share[i][g];
      squares += w;
      compact += w * calc_distance2(points[i], r.centres[g]);
    }
  for (int g = 0; g < k; ++g)
    for (int h = 0; h < g; ++h) apart = std::min(apart, calc_distance2(r.centres[g], r.centres[h]));
  r.partition_coefficient = squares / static_cast<double>(n);
  r.xie_beni = k < 2 ? infinite : compact / (static_cast<double>(n) * apart);
  return r;
}

Grouping find_groups(const std::vector<Point>& points, Clustering kind, int k_max) {
  Grouping best;
  best.group.assign(points.size(), 0);
  const int count = static_cast<int>(points.size());
  if (count == 0) return best;
  const Distances d(points);
  best.centre = build(d, 1);
  best.quality = -infinite;
  double best_partition = 0;
  for (int k = 2; k <= std::min(k_max, count - 1); ++k) {
    Grouping g;
    g.k = k;
    if (kind == Clustering::Medoids) {
      const Medoids m = find_medoids(d, k);
      g.centre = m.medoids, g.group = m.group, g.quality = m.silhouette;
      best.tried.push_back(g.quality);
      if (g.quality <= best.quality) continue;
    } else {
      const FuzzyMeans m = find_fuzzy_means(points, k);
      g.quality = -m.xie_beni;
      best.tried.push_back(g.quality);
      const bool near = best.k > 1 && std::abs(g.quality - best.quality) <= 0.05 * std::abs(best.quality);
      if (near ? m.partition_coefficient <= best_partition : g.quality <= best.quality) continue;
      best_partition = m.partition_coefficient;
      for (int c = 0; c < k; ++c) {
        int nearest = 0;
        for (int i = 1; i < count; ++i)
          if (calc_distance2(points[i], m.centres[c]) < calc_distance2(points[nearest], m.centres[c])) nearest = i;
        g.centre.push_back(nearest);
      }
      for (const auto& share : m.share)
        g.group.push_back(static_cast<int>(std::max_element(share.begin(), share.end()) - share.begin()));
    }
    g.tried = std::move(best.tried);
    best = std::move(g);
  }
  if (best.k == 1) best.quality = 0;
  return best;
}

}  // namespace topple::uncertainty
