#include "uncertainty/fuzzy_number.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "uncertainty/mapping.h"

namespace topple::uncertainty {
namespace {

[[noreturn]] void refuse(const std::string& message, const std::string& help = {}) {
  throw InputError("E801", "fuzzy number: " + message, help);
}

/// a at t = 0 and b at t = 1, exactly.
double blend(double a, double b, double t) { return t <= 0 ? a : t >= 1 ? b : a == b ? a : a + t * (b - a); }

/// One branch of corners, alpha rising from 0 to 1: its x at alpha; at a step the first.
double find_on_branch(const std::vector<std::pair<double, double>>& branch, double alpha) {
  for (std::size_t k = 0; k < branch.size(); ++k) {
    if (branch[k].second == alpha) return branch[k].first;
    if (branch[k].second > alpha) {
      const auto& [x0, a0] = branch[k - 1];
      return blend(x0, branch[k].first, (alpha - a0) / (branch[k].second - a0));
    }
  }
  return branch.back().first;
}

/// The same, at a step the last.
double find_last_on_branch(const std::vector<std::pair<double, double>>& branch, double alpha) {
  for (std::size_t k = branch.size(); k-- > 0;)
    if (branch[k].second == alpha) return branch[k].first;
  return find_on_branch(branch, alpha);
}

}  // namespace

FuzzyNumber::FuzzyNumber(std::vector<AlphaCut> cuts) : cuts_(std::move(cuts)) {
  if (cuts_.size() < 2) refuse(fmt::format("{} cuts; at least two are needed", cuts_.size()));
  for (const auto& c : cuts_) {
    if (!std::isfinite(c.alpha) || !std::isfinite(c.left) || !std::isfinite(c.right)) refuse("a number is not finite");
    if (std::max(std::abs(c.left), std::abs(c.right)) > most_value)
      refuse(fmt::format("a number is larger than {:.3g}", most_value));
    if (c.left > c.right)
      refuse(fmt::format("at alpha {} the left end {} lies above the right end {}", c.alpha, c.left, c.right));
  }
  if (cuts_.front().alpha != 0 || cuts_.back().alpha != 1)
    refuse(fmt::format("alpha runs from {} to {}", cuts_.front().alpha, cuts_.back().alpha), "it must run from 0 to 1");
  for (std::size_t k = 1; k < cuts_.size(); ++k) {
    if (cuts_[k].alpha < cuts_[k - 1].alpha)
      refuse(fmt::format("alpha falls from {} to {}", cuts_[k - 1].alpha, cuts_[k].alpha));
    if (cuts_[k].left < cuts_[k - 1].left || cuts_[k].right > cuts_[k - 1].right)
      refuse(fmt::format("the cut [{}, {}] at alpha {} is not inside [{}, {}] at alpha {}", cuts_[k].left,
                         cuts_[k].right, cuts_[k].alpha, cuts_[k - 1].left, cuts_[k - 1].right, cuts_[k - 1].alpha));
  }
  // the support is the closure of what has a membership above 0: feet without any do not count
  const auto inner = std::find_if(cuts_.begin(), cuts_.end(), [](const AlphaCut& c) { return c.alpha > 0; }) - 1;
  cuts_.erase(cuts_.begin(), inner);
}

AlphaCut FuzzyNumber::cut(double alpha) const {
  if (!(alpha >= 0 && alpha <= 1)) throw InputError("E802", fmt::format("alpha is {}; it lies between 0 and 1", alpha));
  const auto upper = std::find_if(cuts_.begin(), cuts_.end(), [alpha](const AlphaCut& c) { return c.alpha >= alpha; });
  if (upper->alpha == alpha) return {alpha, upper->left, upper->right};
  const AlphaCut &a = *(upper - 1), &b = *upper;
  const double t = (alpha - a.alpha) / (b.alpha - a.alpha);
  return {alpha, blend(a.left, b.left, t), blend(a.right, b.right, t)};
}

double FuzzyNumber::membership(double x) const {
  if (!(x >= cuts_.front().left && x <= cuts_.front().right)) return 0;
  // the last cut that holds x, then along the branch that leaves it out next
  std::size_t k = cuts_.size() - 1;
  while (k > 0 && !(x >= cuts_[k].left && x <= cuts_[k].right)) --k;
  if (k + 1 == cuts_.size()) return 1;
  const AlphaCut &a = cuts_[k], &b = cuts_[k + 1];
  const double t = x < b.left ? (x - a.left) / (b.left - a.left) : (a.right - x) / (a.right - b.right);
  return blend(a.alpha, b.alpha, t);
}

FuzzyNumber make_triangular(double left, double core, double right) {
  return FuzzyNumber({{0, left, right}, {1, core, core}});
}

FuzzyNumber make_trapezoidal(double left, double core_left, double core_right, double right) {
  return FuzzyNumber({{0, left, right}, {1, core_left, core_right}});
}

FuzzyNumber make_polygonal(const std::vector<std::pair<double, double>>& corners) {
  if (corners.size() < 3) refuse(fmt::format("{} corners; at least three are needed", corners.size()));
  for (const auto& [x, mu] : corners) {
    if (!std::isfinite(x) || !std::isfinite(mu)) refuse("a number is not finite");
    if (mu < 0 || mu > 1) refuse(fmt::format("the membership {} at {} lies outside 0 to 1", mu, x));
  }
  for (std::size_t k = 1; k < corners.size(); ++k)
    if (corners[k].first < corners[k - 1].first)
      refuse(fmt::format("x falls from {} to {}", corners[k - 1].first, corners[k].first));
  if (corners.front().second != 0 || corners.back().second != 0)
    refuse("the membership does not start and end at 0", "begin and end the polygon with a corner (x, 0)");
  const auto is_top = [](const auto& c) { return c.second == 1; };
  const auto top = std::find_if(corners.begin(), corners.end(), is_top);
  if (top == corners.end()) refuse("the membership does not reach 1");
  const auto last_top = std::find_if(corners.rbegin(), corners.rend(), is_top).base();
  std::vector<std::pair<double, double>> left(corners.begin(), top + 1), right(last_top - 1, corners.end());
  std::reverse(right.begin(), right.end());
  for (auto k = top; k != last_top; ++k)
    if (!is_top(*k)) refuse(fmt::format("the membership falls to {} at {} and rises again", k->second, k->first));
  std::vector<double> alphas;
  for (const auto* branch : {&left, &right})
    for (std::size_t k = 0; k < branch->size(); ++k) {
      if (k > 0 && (*branch)[k].second < (*branch)[k - 1].second)
        refuse(fmt::format("the membership is not convex at {}", (*branch)[k].first),
               "it may rise once, to 1, and fall once");
      alphas.push_back((*branch)[k].second);
    }
  std::sort(alphas.begin(), alphas.end());
  alphas.erase(std::unique(alphas.begin(), alphas.end()), alphas.end());
  std::vector<AlphaCut> cuts;
  for (const double a : alphas) {
    const AlphaCut wide{a, find_on_branch(left, a), find_on_branch(right, a)};
    const AlphaCut narrow{a, find_last_on_branch(left, a), find_last_on_branch(right, a)};
    cuts.push_back(wide);
    if (!(narrow == wide)) cuts.push_back(narrow);
  }
  return FuzzyNumber(std::move(cuts));
}

}  // namespace topple::uncertainty
