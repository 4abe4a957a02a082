#pragma once
/// Groups of points (docs/theory/uncertainty.md, section 7): k-medoids (Kaufman & Rousseeuw, PAM) and fuzzy c-means
/// (Bezdek), and how good a number of groups is. N points of n coordinates, to be normalised by the caller.

#include <cstdint>
#include <vector>

#include "uncertainty/mapping.h"

namespace topple::uncertainty {

struct Medoids {
  std::vector<int> medoids;  // indices of points  (k)
  std::vector<int> group;    // of each point, 0 to k-1  (N)
  double cost = 0;           // sum of the distances to the own medoid
  double silhouette = 0;     // mean over all points, -1 to 1; the larger the better; 0 for one group
};
/// Greedy build, then swaps while the cost falls. Needs 1 <= k <= N.
Medoids find_medoids(const std::vector<Point>&, int k);

struct FuzzyMeans {
  std::vector<Point> centres;              // (k)
  std::vector<std::vector<double>> share;  // of each point in each group, sums to 1  (N x k)
  double partition_coefficient = 0;        // 1/k to 1; the larger the crisper
  double xie_beni = 0;                     // compactness over separation; the smaller the better
  int iterations = 0;
  bool converged = false;
};
/// Fuzzy exponent m = 2; starts from the medoids of a greedy build. Needs 1 <= k <= N.
FuzzyMeans find_fuzzy_means(const std::vector<Point>&, int k);

/// Mean silhouette of a grouping: (b - a) / max(a, b), a the mean distance inside the own group, b to the nearest
/// other.
double calc_silhouette(const std::vector<Point>&, const std::vector<int>& group, int k);

enum class Clustering { Medoids, FuzzyMeans };

struct Grouping {
  int k = 1;
  std::vector<int> centre;    // the point nearest to the middle of each group  (k)
  std::vector<int> group;     // (N)
  double quality = 0;         // silhouette, or minus Xie-Beni
  std::vector<double> tried;  // quality of k = 2, 3, ...
};
/// The best of k = 2 to k_max: by silhouette, or by Xie-Beni and, where that is within 5 % of the best, by partition
/// coefficient. One group if there are fewer than three points.
Grouping find_groups(const std::vector<Point>&, Clustering, int k_max);

}  // namespace topple::uncertainty
