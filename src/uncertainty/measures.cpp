#include "uncertainty/measures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "base/error.h"

namespace topple::uncertainty {
namespace {

/// Integral over μ from 0 of -μ ln μ - (1-μ) ln(1-μ).
double calc_entropy_integral(double mu) {
  const double rest = 1 - mu;
  const double a = mu > 0 ? 0.25 * mu * mu - 0.5 * mu * mu * std::log(mu) : 0;
  const double b = rest > 0 ? 0.25 * rest * rest - 0.5 * rest * rest * std::log(rest) : 0;
  return a + 0.25 - b;
}

double calc_shannon(double mu) { return mu <= 0 || mu >= 1 ? 0 : -mu * std::log(mu) - (1 - mu) * std::log1p(-mu); }

/// Degree at which a branch, going out from the core, meets a set that rises from 0 at `zero` to 1 at `one`.
double find_meeting(const FuzzyNumber& f, double zero, double one, bool right) {
  if (one == zero) return 1;
  const auto& cuts = f.cuts();
  const auto set = [&](const AlphaCut& c) { return ((right ? c.right : c.left) - zero) / (one - zero); };
  for (std::size_t k = cuts.size(); k-- > 0;) {
    // the set lies below the branch at the core and above it outside
    if (set(cuts[k]) < cuts[k].alpha) continue;
    if (k + 1 == cuts.size()) return 1;
    const double outer = set(cuts[k]) - cuts[k].alpha, inner = set(cuts[k + 1]) - cuts[k + 1].alpha;
    const double t = outer / (outer - inner);
    return cuts[k].alpha + t * (cuts[k + 1].alpha - cuts[k].alpha);
  }
  return 0;
}

}  // namespace

double calc_centroid(const FuzzyNumber& f) {
  // slices of the area between two cuts: width and moment are linear and quadratic in alpha. Seen from the left end, by
  // the width: squares of large numbers would leave nothing of a small one
  const AlphaCut support = f.support();
  const double width = f.width();
  if (!(width > 0)) return 0.5 * (support.left + support.right);
  const auto place = [&](double x) { return (x - support.left) / width; };
  double area = 0, moment = 0;
  const auto& cuts = f.cuts();
  for (std::size_t k = 1; k < cuts.size(); ++k) {
    const double d = cuts[k].alpha - cuts[k - 1].alpha;
    const double l = place(cuts[k - 1].left), r = place(cuts[k - 1].right);
    const double m = place(cuts[k].left), s = place(cuts[k].right);
    area += d * 0.5 * (r - l + s - m);
    moment += d / 6 * (r * r + r * s + s * s - l * l - l * m - m * m);
  }
  return area > 0 ? support.left + width * std::clamp(moment / area, 0.0, 1.0) : 0.5 * (support.left + support.right);
}

double calc_mean_of_midpoints(const FuzzyNumber& f) {
  double sum = 0;
  const auto& cuts = f.cuts();
  for (std::size_t k = 1; k < cuts.size(); ++k)
    sum += (cuts[k].alpha - cuts[k - 1].alpha) * 0.25 *
           (cuts[k].left + cuts[k].right + cuts[k - 1].left + cuts[k - 1].right);
  return sum;
}

double calc_jain(const FuzzyNumber& f) {
  const AlphaCut s = f.support();
  return s.left + (s.right - s.left) * find_meeting(f, s.left, s.right, true);
}

double calc_chen(const FuzzyNumber& f) {
  const AlphaCut s = f.support();
  const double most = find_meeting(f, s.left, s.right, true), least = find_meeting(f, s.right, s.left, false);
  return s.left + (s.right - s.left) * 0.5 * (most + 1 - least);
}

double calc_entropy(const FuzzyNumber& f, double reference, double k) {
  if (!(reference > 0))
    throw InputError("E808", fmt::format("entropy: the reference width is {}; it is positive", reference));
  double sum = 0;
  const auto& cuts = f.cuts();
  for (std::size_t i = 1; i < cuts.size(); ++i) {
    const AlphaCut &a = cuts[i - 1], &b = cuts[i];
    const double width = (b.left - a.left) + (a.right - b.right), d = b.alpha - a.alpha;
    // mean of the entropy of μ over the segment; a level step has one μ
    const double mean =
        d > 0 ? (calc_entropy_integral(b.alpha) - calc_entropy_integral(a.alpha)) / d : calc_shannon(a.alpha);
    sum += width * mean;
  }
  return k * sum / reference;
}

double calc_robustness(const std::vector<double>& input_entropies, double result_entropy) {
  const double sum = std::accumulate(input_entropies.begin(), input_entropies.end(), 0.0);
  return result_entropy > 0 ? sum / result_entropy : std::numeric_limits<double>::infinity();
}

}  // namespace topple::uncertainty
