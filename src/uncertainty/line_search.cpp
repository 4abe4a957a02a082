#include "uncertainty/line_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace topple::uncertainty {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr int refinements = 3;      // of the valleys of a line
constexpr std::size_t valleys = 3;  // of a line, at most, that are refined

}  // namespace

LineSearch::LineSearch(Region region, Point start, const Told& at_start, const Options& options)
    : LocalSearch(std::move(start), at_start),
      region_(std::move(region)),
      options_(options),
      support_(make_box(*region_.space, 0)) {
  for (const int i : region_.axes) axes_.push_back({i, {}, 0, 0, {}});
  converged_ = axes_.empty();
  ask_line();
}

/// A place of an axis through the best point that constraints allow and that is not known.
void LineSearch::add(std::size_t axis, double at) {
  const int i = axes_[axis].input;
  Point x = best_;
  x[i] = at;
  if (region_.space->has_interaction() && !region_.contains(x)) return;
  const auto is_there = [&](const Place& p) { return p.at == x[i]; };
  if (x[i] == best_[i] || std::any_of(axes_[axis].line.begin(), axes_[axis].line.end(), is_there)) return;
  if (std::find(pending_.begin(), pending_.end(), x) != pending_.end()) return;
  asked_.push_back({static_cast<int>(axis), x[i]});
  pending_.push_back(std::move(x));
}

void LineSearch::ask_line() {
  pending_.clear(), asked_.clear();
  stage_ = Stage::Line;
  refined_ = 0;
  next_ = best_, next_value_ = value_, next_outcome_ = outcome_;
  if (iteration_++ >= options_.iterations) return;
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    Axis& axis = axes_[k];
    const int i = axis.input;
    axis.line = {{best_[i], value_}};
    axis.best = axis.line.front();
    const double low = region_.box.lower[i], high = region_.box.upper[i];
    for (const double end : {low, high}) {
      Point x = best_;
      x[i] = end;
      add(k, pull_inside(region_, best_, std::move(x))[i]);
    }
    const double step = region_.scale[i] / options_.places;
    std::vector<double> places;
    for (int j = 1; j < options_.places; ++j)
      if (const double at = support_.lower[i] + j * step; at > low + 0.2 * step && at < high - 0.2 * step)
        places.push_back(at);
    if (places.size() < 3)
      for (const double part : {0.25, 0.5, 0.75}) places.push_back(low + part * (high - low));
    if (k < options_.more.size()) places.insert(places.end(), options_.more[k].begin(), options_.more[k].end());
    for (const double at : places)
      if (std::abs(at - best_[i]) > 1e-3 * region_.scale[i]) add(k, std::clamp(at, low, high));
  }
  if (pending_.empty()) conclude();
}

void LineSearch::ask_vertices() {
  pending_.clear(), asked_.clear();
  stage_ = Stage::Vertex;
  if (refined_++ < refinements)
    for (std::size_t k = 0; k < axes_.size(); ++k) {
      const Axis& axis = axes_[k];
      const std::vector<Place>& line = axis.line;
      double most = -infinite;
      for (const Place& p : line)
        if (std::isfinite(p.value)) most = std::max(most, p.value);
      std::vector<std::pair<double, double>> vertices;  // foretold value, place
      for (std::size_t j = 1; j + 1 < line.size(); ++j) {
        const Place &a = line[j - 1], &b = line[j], &c = line[j + 1];
        if (!(b.value <= a.value && b.value <= c.value && std::isfinite(a.value) && std::isfinite(c.value))) continue;
        const double left = (b.value - a.value) / (b.at - a.at), right = (c.value - b.value) / (c.at - b.at);
        const double curvature = (right - left) / (c.at - a.at);  // half of it
        if (!(curvature > 0)) continue;
        const double slope = left + curvature * (b.at - a.at), to = -slope / (2 * curvature);
        const double foretold = b.value + 0.5 * slope * to;
        const double least = foretold - (b.value - foretold) - 0.02 * (most - axis.best.value);
        if (least < axis.best.value && std::abs(to) > 1e-3 * (c.at - a.at)) vertices.push_back({foretold, b.at + to});
      }
      std::sort(vertices.begin(), vertices.end());
      if (vertices.size() > valleys) vertices.resize(valleys);
      for (const auto& [foretold, at] : vertices) add(k, at);
    }
  if (pending_.empty()) ask_together();
}

/// The moves that improve alone: the best two, four, eight ... and all.
void LineSearch::ask_together() {
  pending_.clear(), asked_.clear();
  stage_ = Stage::Together;
  std::vector<std::pair<double, std::size_t>> gains;
  for (std::size_t k = 0; k < axes_.size(); ++k)
    if (axes_[k].best.value < value_) gains.push_back({axes_[k].best.value, k});
  std::sort(gains.begin(), gains.end());
  for (std::size_t count = 2; gains.size() > 1; count *= 2) {
    Point x = best_;
    for (std::size_t k = 0; k < std::min(count, gains.size()); ++k)
      x[axes_[gains[k].second].input] = axes_[gains[k].second].best.at;
    x = pull_inside(region_, best_, std::move(x));
    if (x != best_) pending_.push_back(std::move(x));
    if (count >= gains.size()) break;
  }
  if (pending_.empty()) conclude();
}

void LineSearch::conclude() {
  const double gained = value_ - next_value_;
  bool is_elsewhere = false;
  for (const Axis& axis : axes_)
    is_elsewhere = is_elsewhere || next_[axis.input] < axis.from || next_[axis.input] > axis.to;
  best_ = next_, value_ = next_value_, outcome_ = next_outcome_;
  if (is_elsewhere && gained > options_.least_gain) {
    ask_line();
    return;
  }
  converged_ = true;
  pending_.clear();
}

void LineSearch::tell(std::span<const Told> told) {
  for (std::size_t k = 0; k < told.size(); ++k)
    if (told[k].value < next_value_) next_ = pending_[k], next_value_ = told[k].value, next_outcome_ = told[k].outcome;
  if (stage_ == Stage::Together) {
    conclude();
    return;
  }
  for (std::size_t k = 0; k < told.size(); ++k) {
    Axis& axis = axes_[asked_[k].axis];
    const Place p{asked_[k].at, told[k].value};
    axis.line.insert(std::upper_bound(axis.line.begin(), axis.line.end(), p), p);
    if (p.value < axis.best.value) axis.best = p;
  }
  if (stage_ == Stage::Line)
    for (Axis& axis : axes_) {
      const auto here = std::lower_bound(axis.line.begin(), axis.line.end(), Place{best_[axis.input], 0});
      axis.from = here == axis.line.begin() ? here->at : std::prev(here)->at;
      axis.to = std::next(here) == axis.line.end() ? here->at : std::next(here)->at;
    }
  ask_vertices();
}

}  // namespace topple::uncertainty
