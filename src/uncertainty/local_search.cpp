#include "uncertainty/local_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "uncertainty/linear.h"
#include "uncertainty/tangent.h"

namespace topple::uncertainty {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();
constexpr int beyond = std::numeric_limits<int>::min();  // outcome of what lies beyond a jump
constexpr int most_sections = 10;                        // that a jump is located by
constexpr int most_jumps = 6;
constexpr int most_approaches = 12;  // to another outcome, each half as far from it
constexpr double near_wall = 8;      // radii; what is farther does not stop a search
constexpr double much_steeper = 4;
constexpr double ways_back[] = {1e-3, 1e-5};  // away from one, by widths
constexpr double part_beyond = 0.3;  // of a jump, by which a place misses the model of this side that lies beyond

}  // namespace

Point pull_inside(const Region& region, const Point& from, Point to) {
  to = clip(region.box, std::move(to));
  if (!region.space->has_interaction() || region.contains(to)) return to;
  return bisect(from, std::move(to), [&region](const Point& x) { return region.contains(x); }).first;
}

Region make_region(const Space& space, double alpha) {
  Region r{&space, alpha, make_box(space, alpha), calc_scale(space), {}};
  for (int i = 0; i < space.size(); ++i)
    if (r.box.upper[i] > r.box.lower[i]) r.axes.push_back(i);
  return r;
}

ModelSearch::ModelSearch(Region region, Point start, const Told& at_start, const Options& options)
    : LocalSearch(std::move(start), at_start),
      region_(std::move(region)),
      options_(options),
      random_(options.seed),
      program_(*region_.space, region_.alpha, region_.scale, region_.axes),
      radius_(options.radius),
      trust_(4 * options.radius),
      boundary_(region_.scale, region_.axes, 0.05) {
  for (const int i : region_.axes) {
    Axis axis;
    axis.input = i;
    axes_.push_back(axis);
  }
  converged_ = axes_.empty();
  ask_star();
}

Point ModelSearch::moved(const std::vector<double>& step) const {
  Point x = best_;
  for (std::size_t k = 0; k < axes_.size(); ++k) x[axes_[k].input] += step[k];
  return clip(region_.box, std::move(x));
}

void ModelSearch::ask_star() {
  pending_.clear();
  pairs_.clear();
  stage_ = Stage::Star;
  wall_.reset();
  boundary_.review(best_, radius_, list_insides());
  next_ = best_, next_value_ = value_, next_outcome_ = outcome_;
  if (axes_.empty() || iteration_ >= options_.iterations) return;
  const auto add = [this](const Point& x) {
    pending_.push_back(x);
    return static_cast<int>(pending_.size()) - 1;
  };
  for (auto& axis : axes_) {
    const int i = axis.input;
    const double centre = best_[i], h = radius_ * region_.scale[i];
    // an end of the cut is a place of its own: a star point near it moves onto it
    const auto reach = [&](double offset) {
      for (int halving = 0; halving < 12; ++halving, offset *= 0.5) {
        Point x = best_;
        x[i] = std::clamp(centre + offset, region_.box.lower[i], region_.box.upper[i]);
        if (std::abs(x[i] - centre) < 0.2 * std::abs(offset)) return 0.0;
        if (!region_.space->has_interaction() || region_.contains(x)) return x[i] - centre;
      }
      return 0.0;
    };
    axis.a = reach(-h), axis.b = reach(h);
    if (axis.a == 0 && axis.b != 0) axis.a = 0.5 * axis.b;
    if (axis.b == 0 && axis.a != 0) axis.b = 0.5 * axis.a;
    axis.at_a = axis.at_b = -1;
    for (const bool first : {true, false}) {
      const double offset = first ? axis.a : axis.b;
      if (offset == 0) continue;
      Point x = best_;
      x[i] = std::clamp(centre + offset, region_.box.lower[i], region_.box.upper[i]);
      if (region_.space->has_interaction() && !region_.contains(x)) continue;
      (first ? axis.at_a : axis.at_b) = add(x);
    }
  }
  for (std::size_t i = 0; i < axes_.size(); ++i)
    for (std::size_t j = i + 1; j < axes_.size(); ++j) {
      const Axis &p = axes_[i], &q = axes_[j];
      if (!p.free || !q.free) continue;
      Pair pair;
      pair.i = static_cast<int>(i), pair.j = static_cast<int>(j);
      pair.at_i = p.at_b >= 0 ? p.at_b : p.at_a, pair.di = p.at_b >= 0 ? p.b : p.a;
      pair.at_j = q.at_b >= 0 ? q.at_b : q.at_a, pair.dj = q.at_b >= 0 ? q.b : q.a;
      if (pair.at_i < 0 || pair.at_j < 0) continue;
      Point x = pending_[pair.at_i];
      x[q.input] = pending_[pair.at_j][q.input];
      if (region_.space->has_interaction() && !region_.contains(x)) continue;
      pair.at = add(x);
      pairs_.push_back(pair);
    }
  ask_around_constraints();
  // a place that interaction closes on all sides
  if (pending_.empty()) radius_ = 0;
}

/// Where constraints stop both ways along an axis, places beside them tell its slope.
void ModelSearch::ask_around_constraints() {
  aside_.clear();
  if (!region_.space->has_interaction()) return;
  const std::vector<double> here(axes_.size(), 0.0);
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    if (axes_[k].at_a >= 0 || axes_[k].at_b >= 0) continue;
    for (const double sign : {-1.0, 1.0}) {
      std::vector<double> u = here;
      u[k] = sign * radius_;
      const auto distance_to = [&](const Point& y) {
        double square = 0;
        for (std::size_t j = 0; j < axes_.size(); ++j) {
          const int i = axes_[j].input;
          square += std::pow((y[i] - best_[i]) / region_.scale[i] - (j == k ? sign * radius_ : 0), 2);
        }
        return square;
      };
      Point x = slide(here, u, radius_), target = best_;
      target[axes_[k].input] += sign * radius_ * region_.scale[axes_[k].input];
      if (Point y = program_.project_from(best_, target, radius_); distance_to(y) < distance_to(x)) x = std::move(y);
      const double length = calc_offset(x, best_, region_.axes, region_.scale);
      if (length < 0.01 * radius_ || std::find(pending_.begin(), pending_.end(), x) != pending_.end()) continue;
      aside_.push_back(static_cast<int>(pending_.size()));
      pending_.push_back(std::move(x));
    }
  }
}

/// Slopes of the axes along which nothing could be run: the least ones that explain the places beside the constraints.
void ModelSearch::read_aside(std::span<const Told> told) {
  std::vector<std::size_t> open;
  for (std::size_t k = 0; k < axes_.size(); ++k)
    if (axes_[k].at_a < 0 && axes_[k].at_b < 0) open.push_back(k);
  if (open.empty() || aside_.empty()) return;
  std::vector<Point> A(open.size(), Point(open.size(), 0.0));
  Point slopes(open.size(), 0.0);
  double trace = 0;
  for (const int at : aside_) {
    if (told[at].outcome != outcome_ || !std::isfinite(told[at].value)) continue;
    const std::vector<double> step = find_step_to(pending_[at]), u = to_widths(step);
    const double rest = told[at].value - value_ - calc_model(step);  // the open slopes are 0 so far
    for (std::size_t i = 0; i < open.size(); ++i) {
      slopes[i] += u[open[i]] * rest;
      for (std::size_t j = 0; j < open.size(); ++j) A[i][j] += u[open[i]] * u[open[j]];
      trace += u[open[i]] * u[open[i]];
    }
  }
  if (!(trace > 0)) return;
  for (std::size_t i = 0; i < open.size(); ++i) A[i][i] += 1e-9 * trace;
  if (!solve(A, slopes)) return;
  for (std::size_t i = 0; i < open.size(); ++i) axes_[open[i]].slope = slopes[i] / region_.scale[axes_[open[i]].input];
}

/// About a place of this outcome that lies off its boundary: along axes of which the star saw another outcome alone.
void ModelSearch::ask_inner() {
  pending_.clear();
  stage_ = Stage::Inner;
  const auto [inner, depth] = boundary_.find_inner(best_, 2 * radius_, list_insides(), list_walls());
  const auto at =
      std::find_if(insides_.begin(), insides_.end(), [&inner = inner](const Place& p) { return p.x == inner; });
  if (at == insides_.end() || !std::isfinite(at->value)) return;
  inner_ = *at;
  const double h = 0.5 * std::min(depth, radius_);
  for (const Axis& axis : axes_) {
    if (axis.known || (axis.at_a < 0 && axis.at_b < 0)) continue;
    for (const double sign : {-1.0, 1.0}) {
      Point x = inner;
      x[axis.input] += sign * h * region_.scale[axis.input];
      x = clip(region_.box, std::move(x));
      if (x != inner && region_.contains(x)) pending_.push_back(std::move(x));
    }
  }
}

void ModelSearch::read_inner(std::span<const Told> told) {
  for (Axis& axis : axes_) {
    if (axis.known || (axis.at_a < 0 && axis.at_b < 0)) continue;
    // between the two places, or one and the middle
    std::vector<std::pair<double, double>> along;
    for (std::size_t k = 0; k < told.size(); ++k)
      if (told[k].outcome == outcome_ && std::isfinite(told[k].value) &&
          pending_[k][axis.input] != inner_.x[axis.input])
        along.emplace_back(pending_[k][axis.input], told[k].value);
    if (along.size() == 1) along.emplace_back(inner_.x[axis.input], inner_.value);
    if (along.size() < 2) continue;
    axis.slope = (along[1].second - along[0].second) / (along[1].first - along[0].first);
    axis.known = true;
  }
}

double ModelSearch::calc_model(const std::vector<double>& s) const {
  const std::size_t n = axes_.size();
  double m = 0;
  for (std::size_t i = 0; i < n; ++i) {
    double row = 0;
    for (std::size_t j = 0; j < n; ++j) row += hessian_[i * n + j] * s[j];
    m += s[i] * (axes_[i].slope + 0.5 * row);
  }
  return m;
}

/// Minimum of the model in the trust region and the cut, axis by axis until it rests; pushed away from the wall.
std::vector<double> ModelSearch::find_step(bool mixed, double push) const {
  const std::size_t n = axes_.size();
  std::vector<double> s(n, 0.0);
  for (int sweep = 0; sweep < 200; ++sweep) {
    double largest = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const int k = axes_[i].input;
      const double reach = trust_ * region_.scale[k];
      const double low = std::max(-reach, region_.box.lower[k] - best_[k]);
      const double high = std::min(reach, region_.box.upper[k] - best_[k]);
      double slope = axes_[i].slope;
      if (push > 0) slope += push * wall_->normal()[i] / region_.scale[k];
      if (mixed)
        for (std::size_t j = 0; j < n; ++j)
          if (j != i) slope += hessian_[i * n + j] * s[j];
      const double curvature = hessian_[i * n + i];
      const auto value = [&](double t) { return t * (slope + 0.5 * curvature * t); };
      double t = value(low) < value(high) ? low : high;
      if (curvature > 0) t = std::clamp(-slope / curvature, low, high);
      if (value(t) >= value(std::clamp(0.0, low, high))) t = std::clamp(0.0, low, high);
      if (value(t) < value(s[i])) {
        largest = std::max(largest, std::abs(t - s[i]) / region_.scale[k]);
        s[i] = t;
      }
    }
    if (largest < 1e-12) break;
  }
  return s;
}

/// A step in the order of the axes, by widths of the support.
std::vector<double> ModelSearch::to_widths(const std::vector<double>& step) const {
  std::vector<double> u(step.size());
  for (std::size_t k = 0; k < u.size(); ++k) u[k] = step[k] / region_.scale[axes_[k].input];
  return u;
}

/// The model by widths of the support.
Quadratic ModelSearch::calc_quadratic() const {
  const std::size_t n = axes_.size();
  Quadratic q{std::vector<double>(n), hessian_};
  for (std::size_t i = 0; i < n; ++i) {
    const double width = region_.scale[axes_[i].input];
    q.slope[i] = axes_[i].slope * width;
    for (std::size_t j = 0; j < n; ++j) q.hessian[i * n + j] *= width * region_.scale[axes_[j].input];
  }
  return q;
}

std::vector<double> ModelSearch::find_step_to(const Point& x) const {
  std::vector<double> step(axes_.size());
  for (std::size_t k = 0; k < step.size(); ++k) step[k] = x[axes_[k].input] - best_[axes_[k].input];
  return step;
}

/// The allowed point nearest to best + u to first order, as seen from `from`, which is allowed; then on the way to it.
Point ModelSearch::slide(const std::vector<double>& from, std::vector<double> u, double reach) const {
  std::vector<double> lower(u.size()), upper(u.size()), whole(u.size());
  for (std::size_t k = 0; k < u.size(); ++k) {
    const int i = axes_[k].input;
    lower[k] = std::max(-reach, (region_.box.lower[i] - best_[i]) / region_.scale[i]);
    upper[k] = std::min(reach, (region_.box.upper[i] - best_[i]) / region_.scale[i]);
  }
  const auto place = [&](const std::vector<double>& v) {
    for (std::size_t k = 0; k < v.size(); ++k) whole[k] = v[k] * region_.scale[axes_[k].input];
    return moved(whole);
  };
  std::vector<double> seen = from;
  // a hair inside: on the plane itself round-off decides, and a way along it would end anywhere
  double inside = 0;
  for (int k = 0; k < 5; ++k) {
    std::vector<HalfSpace> planes =
        find_tangents(*region_.space, region_.alpha, best_, region_.axes, region_.scale, seen);
    for (HalfSpace& h : planes) h.b -= inside;
    u = project(planes, lower, upper, u);
    if (region_.contains(place(u))) break;
    seen = u;  // the constraints bend
    inside = k == 0 ? 1e-13 : 10 * inside;
  }
  return pull_inside(region_, place(from), place(u));
}

/// Improves an allowed step on the model by its slopes, along the constraints where they stop it.
void ModelSearch::descend(std::vector<double>& step) const {
  const std::size_t n = axes_.size();
  std::vector<double> slope(n);
  double value = calc_model(step), rate = 0;
  for (int round = 0; round < 100; ++round) {
    double largest = 0;
    for (std::size_t i = 0; i < n; ++i) {
      slope[i] = axes_[i].slope;
      for (std::size_t j = 0; j < n; ++j) slope[i] += hessian_[i * n + j] * step[j];
      slope[i] *= region_.scale[axes_[i].input];
      largest = std::max(largest, std::abs(slope[i]));
    }
    if (!(largest > 0)) return;
    rate = round == 0 ? trust_ / largest : 4 * rate;
    const std::vector<double> from = to_widths(step);
    bool is_better = false;
    for (int halving = 0; halving < 20 && !is_better; ++halving, rate *= 0.25) {
      std::vector<double> u = from;
      for (std::size_t i = 0; i < n; ++i) u[i] -= rate * slope[i];
      const std::vector<double> next = find_step_to(slide(from, std::move(u), trust_));
      const double v = calc_model(next);
      if (!(v < value - 1e-12 * std::abs(value))) continue;
      is_better = true;
      value = v, step = next;
    }
    if (!is_better) return;
    rate *= 4;
  }
}

/// Improves a step on the model under the true constraints, which cost no runs: along the constraints, then by a (1+1)
/// evolution.
void ModelSearch::find_allowed_step(std::vector<double>& step) {
  std::vector<double> best(axes_.size(), 0.0);
  const Point pulled = pull_inside(region_, best_, moved(step));
  for (std::size_t k = 0; k < axes_.size(); ++k) best[k] = pulled[axes_[k].input] - best_[axes_[k].input];
  double value = calc_model(best), width = trust_;
  if (value > 0) std::fill(best.begin(), best.end(), 0.0), value = 0;
  std::vector<double> other(axes_.size(), 0.0);
  descend(best), descend(other);
  if (calc_model(other) < calc_model(best)) best = other;
  other = find_step_to(program_.minimise_from(best_, calc_quadratic(), trust_));
  if (calc_model(other) < calc_model(best)) best = other;
  value = calc_model(best);
  for (int trial = 0; trial < 4000 && width > 1e-9; ++trial) {
    std::vector<double> s = best;
    for (std::size_t k = 0; k < s.size(); ++k) {
      const double reach = trust_ * region_.scale[axes_[k].input];
      s[k] = std::clamp(s[k] + width * region_.scale[axes_[k].input] * random_.next(-1, 1), -reach, reach);
    }
    const Point x = moved(s);
    for (std::size_t k = 0; k < s.size(); ++k) s[k] = x[axes_[k].input] - best_[axes_[k].input];
    if (const double m = calc_model(s); m < value && region_.contains(x)) {
      best = s, value = m, width *= 1.5;
    } else {
      width *= 0.93;
    }
    if (width < 1e-9 && trial < 3000) width = 0.1 * trust_;
  }
  step = best;
}

/// Keeps the best point of this iteration, and places of other outcomes that are worse.
void ModelSearch::note(std::span<const Told> told) {
  for (std::size_t k = 0; k < told.size(); ++k) {
    if (told[k].value < next_value_)
      next_ = pending_[k], next_value_ = told[k].value, next_outcome_ = told[k].outcome;
    else if (told[k].outcome != outcome_ && told[k].value >= value_)
      has_met_walls_ = true;
    remember(pending_[k], told[k]);
  }
}

Boundary::Places ModelSearch::list_walls() const {
  Boundary::Places places;
  for (const Point& x : walls_) places.push_back(&x);
  return places;
}

Boundary::Places ModelSearch::list_insides() const {
  Boundary::Places places;
  for (const Place& p : insides_) places.push_back(&p.x);
  return places;
}

void ModelSearch::remember(const Point& x, const Told& told) {
  constexpr std::size_t most = 200;
  if (told.outcome == outcome_) {
    insides_.push_back({x, told.value});
    if (insides_.size() > most) insides_.erase(insides_.begin());
  } else if (told.value >= value_) {
    walls_.push_back(x);
    if (walls_.size() > most) walls_.erase(walls_.begin());
  }
}

/// Slopes and curvatures of this side of any wall.
void ModelSearch::read_star(std::span<const Told> told) {
  const std::size_t n = axes_.size();
  const auto value_at = [&](int k) { return k >= 0 && told[k].outcome == outcome_ ? told[k].value : infinite; };
  hessian_.assign(n * n, 0.0);
  together_.assign(n, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    Axis& axis = axes_[i];
    axis.before = axis.curvature, axis.reach_before = axis.reach;
    axis.slope = axis.curvature = axis.reach = 0;
    const double fa = value_at(axis.at_a), fb = value_at(axis.at_b);
    const bool has_a = std::isfinite(fa), has_b = std::isfinite(fb);
    axis.known = has_a || has_b;
    if (has_a && has_b) {
      axis.curvature = 2 * ((fb - value_) / axis.b - (fa - value_) / axis.a) / (axis.b - axis.a);
      axis.slope = (fb - value_) / axis.b - 0.5 * axis.curvature * axis.b;
      axis.reach = std::max(std::abs(axis.a), std::abs(axis.b));
    } else if (has_a || has_b) {
      axis.slope = has_a ? (fa - value_) / axis.a : (fb - value_) / axis.b;
    }
    hessian_[i * n + i] = axis.curvature;
    if (fa < value_ || fb < value_) together_[i] = fa < fb ? axis.a : axis.b;
    const int k = axis.input;
    axis.free =
        !((best_[k] == region_.box.lower[k] && axis.slope > 0) || (best_[k] == region_.box.upper[k] && axis.slope < 0));
  }
  for (const auto& p : pairs_) {
    const double mixed = value_at(p.at) - value_at(p.at_i) - value_at(p.at_j) + value_;
    if (std::isfinite(mixed)) hessian_[p.i * n + p.j] = hessian_[p.j * n + p.i] = mixed / (p.di * p.dj);
  }
  read_aside(told);
}

/// Whether all places of the star along an axis belong to another outcome: its slope is not known.
bool ModelSearch::is_blind() const {
  return std::any_of(axes_.begin(), axes_.end(),
                     [](const Axis& axis) { return !axis.known && (axis.at_a >= 0 || axis.at_b >= 0); });
}

/// Whether there is a kink in the valley along an axis: the curvature that a nearer star saw is much larger.
bool ModelSearch::is_bent() const {
  return std::any_of(axes_.begin(), axes_.end(), [this](const Axis& axis) {
    return axis.free && axis.reach > 0 && axis.reach < 0.6 * axis.reach_before &&
           axis.curvature > 1.5 * std::abs(axis.before) &&
           axis.curvature * axis.reach * axis.reach > 100 * options_.tolerance;
  });
}

/// Where boundaries meet there are more to be located.
int ModelSearch::most_probes() const {
  return options_.probes + (boundary_.has_edges() ? static_cast<int>(axes_.size()) : 0);
}

/// Whether trials met another outcome that is worse, and what the model promised did not come.
bool ModelSearch::is_blocked(std::span<const Told> told) const {
  if (probes_ >= most_probes() || next_outcome_ != outcome_ || value_ - next_value_ >= 0.5 * promised_) return false;
  if (wall_ && !boundary_.has_edges()) return false;
  // where one plane is known, by what it does not explain
  const bool is_first = !wall_ && boundary_.planes().empty();
  for (std::size_t k = 0; k < told.size(); ++k)
    if (told[k].outcome != outcome_ && told[k].value >= value_ &&
        (is_first || !boundary_.explains(pending_[k], radius_)))
      return true;
  return false;
}

/// Starts to locate the boundary of the other outcome at its nearest place.
bool ModelSearch::ask_probe() {
  const Point* nearest = nullptr;
  double least = infinite;
  bool is_explained = true;
  for (const auto& w : walls_) {
    if (std::find(tried_.begin(), tried_.end(), w) != tried_.end()) continue;
    const double distance = boundary_.calc_offset(w, best_);
    const bool lies_beyond = boundary_.explains(w, radius_);
    if (lies_beyond == is_explained ? distance < least : is_explained)
      least = distance, nearest = &w, is_explained = lies_beyond;
  }
  if (nearest == nullptr || axes_.size() < 2) return false;
  ++probes_;
  tried_.push_back(*nearest);
  const bool has_edges = boundary_.has_edges();
  const Point inside = has_edges ? boundary_.find_inner(best_, radius_, list_insides(), list_walls()).first : best_;
  WallProbe::Allow allow;
  if (region_.space->has_interaction()) allow = [region = region_](const Point& x) { return region.contains(x); };
  WallProbe::Project project;
  if (region_.space->has_interaction())
    project = [this](const Point& from, const Point& to) { return program_.project_from(from, to, 10 * radius_); };
  wall_.emplace(region_.box, region_.scale, region_.axes, inside, *nearest, radius_, std::move(allow),
                std::move(project), has_edges ? 2 : 0);
  pending_ = wall_->pending();
  stage_ = Stage::Probe;
  return !pending_.empty();
}

/// Minimum of the model that keeps a distance from the wall: the push that just does it, between the two steps that it
/// jumps between.
std::vector<double> ModelSearch::find_walled_step(double distance) const {
  const auto distance_of = [&](const std::vector<double>& s) {
    Point x = best_;
    for (std::size_t k = 0; k < axes_.size(); ++k) x[axes_[k].input] += s[k];
    return wall_->calc_distance(x);
  };
  std::vector<double> near = find_step(true), far = near;
  if (distance_of(near) >= distance) return near;
  double low = 0, high = 0;
  for (const auto& axis : axes_) high = std::max(high, std::abs(axis.slope) * region_.scale[axis.input]);
  high = std::max(high, options_.tolerance);
  int doubling = 0;
  for (; doubling < 60 && distance_of(far) < distance; ++doubling)
    low = doubling > 0 ? high : 0, high *= 2, far = find_step(true, high);
  if (distance_of(far) < distance) return std::vector<double>(axes_.size(), 0.0);
  for (int k = 0; k < 50; ++k) {
    const double middle = 0.5 * (low + high);
    const auto s = find_step(true, middle);
    if (distance_of(s) < distance)
      low = middle, near = s;
    else
      high = middle, far = s;
  }
  const double a = distance_of(near), b = distance_of(far);
  const double t = b > a ? (distance - a) / (b - a) : 1;
  for (std::size_t k = 0; k < far.size(); ++k) far[k] = near[k] + t * (far[k] - near[k]);
  return far;
}

/// Minimum of the model in the trust region, the box and half spaces that are seen from the best point, which may lie
/// outside of them.
std::vector<double> ModelSearch::find_sided_step(const std::vector<HalfSpace>& sides) {
  const std::size_t n = axes_.size();
  const Quadratic q = calc_quadratic();
  std::vector<double> lower(n), upper(n), best(n, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    const int i = axes_[k].input;
    lower[k] = std::max(-trust_, (region_.box.lower[i] - best_[i]) / region_.scale[i]);
    upper[k] = std::min(trust_, (region_.box.upper[i] - best_[i]) / region_.scale[i]);
  }
  double least = infinite;
  for (std::size_t turn = 0; turn <= 2 * n; ++turn) {
    std::vector<double> start(n, 0.0);
    if (turn > 0)
      for (double& c : start) c = trust_ * random_.next(-1, 1);
    start = project(sides, lower, upper, start);
    const bool is_inside = std::all_of(sides.begin(), sides.end(), [&start](const HalfSpace& h) {
      double at = -h.b;
      for (std::size_t k = 0; k < start.size(); ++k) at += h.a[k] * start[k];
      return at < 1e-9;
    });
    if (!is_inside) continue;
    std::vector<double> v = minimise(q, sides, lower, upper, std::move(start));
    if (const double value = q(v); value < least) least = value, best = std::move(v);
  }
  for (std::size_t k = 0; k < n; ++k) best[k] *= region_.scale[axes_[k].input];
  return best;
}

void ModelSearch::ask_trials() {
  stage_ = Stage::Trial;
  pending_.clear();
  std::vector<double> whole = find_step(true);
  std::vector<std::vector<double>> steps;
  const bool is_walled = wall_ && wall_->found(), is_sided = boundary_.planes().size() > (is_walled ? 1 : 0);
  if (is_walled || is_sided) {
    // within the constraints, and where planes meet within all of them
    const auto add_programmed = [&](double part) {
      const double margin = part * radius_;
      const std::vector<HalfSpace> sides =
          is_sided ? boundary_.see(best_, margin) : boundary_.see_latest(best_, margin);
      steps.push_back(region_.space->has_interaction()
                          ? find_step_to(program_.minimise_from(best_, calc_quadratic(), trust_, sides))
                          : find_sided_step(sides));
    };
    // as near to the wall as its curvature lets
    for (const double part : {0.3, 0.1, 0.03, 0.01, 0.0}) {
      if (is_walled) steps.push_back(find_walled_step(part * radius_));
      if (region_.space->has_interaction() || is_sided) add_programmed(part);
    }
    promised_ = -calc_model(steps.back());
    if (is_walled) last_along_ = promised_ / std::max(-calc_model(whole), options_.tolerance);
    along_ = std::min(along_, last_along_);
    // beyond planes that may be wrong
    if (is_sided)
      for (const double part : {-0.02, -0.1}) add_programmed(part);
  } else if (region_.space->has_interaction()) {
    std::vector<double> allowed = whole;
    find_allowed_step(allowed);
    promised_ = -calc_model(allowed);
    steps.push_back(allowed);
  } else {
    promised_ = -calc_model(whole);
  }
  is_bound_ = (is_walled || is_sided) && promised_ < -0.99 * calc_model(whole);
  steps.push_back(whole);
  const bool settled = promised_ <= options_.tolerance && next_value_ >= value_ - options_.tolerance;
  if (!settled) {
    steps.push_back(find_step(false));
    steps.push_back(together_);
    for (const double part : {0.5, 0.25, 0.0625}) {
      steps.push_back(region_.space->has_interaction() ? steps.front() : whole);
      for (double& s : steps.back()) s *= part;
    }
  }
  for (const auto& s : steps) {
    Point x = pull_inside(region_, best_, moved(s));
    if (x != best_ && std::find(pending_.begin(), pending_.end(), x) == pending_.end())
      pending_.push_back(std::move(x));
  }
  if (settled && promised_ <= 0) pending_.clear();
  if (pending_.empty()) finish_iteration();
}

void ModelSearch::finish_iteration() {
  ++iteration_;
  const double gained = value_ - next_value_;
  earlier_gain_ = last_gain_, last_gain_ = gained;
  const double length = calc_offset(next_, best_, region_.axes, region_.scale);
  if (next_outcome_ != outcome_) walls_.clear(), insides_.clear(), boundary_.clear();
  if (length > 0) tried_.clear();
  best_ = next_, value_ = next_value_;
  if (next_outcome_ == beyond)
    jump_ = 0, radius_ = std::max(radius_, 0.5 * options_.radius);
  else
    outcome_ = next_outcome_;
  // a way along the boundary may be long
  if (wall_ && (gained > 1e4 * options_.tolerance || gained > std::max(10 * options_.tolerance, 0.1 * promised_)))
    --probes_;
  if (gained > 1e4 * options_.tolerance) along_ = last_along_ = 1;
  const bool any_free = std::any_of(axes_.begin(), axes_.end(), [](const Axis& a) { return a.free; });
  // a plane is no more than the boundary's tangent
  const double tolerance = is_bound_ || (wall_ && wall_->found()) ? 1000 * options_.tolerance : options_.tolerance;
  // along a boundary that is round steps are short, and yet the way may be long
  const double farther = is_bound_ ? std::max(1.0, 0.01 / trust_) : 1;
  const bool small = farther * promised_ <= tolerance && farther * gained <= tolerance;
  const bool settled = small && !is_blind() &&
                       radius_ <= (is_bound_  ? (boundary_.has_edges() ? 3e-4 : 0.003)
                                   : any_free ? 0.01
                                              : 0.03);
  // a valley that is narrower than the stars before looks like a kink
  if (options_.doubts_edges && settled && is_bent() && !is_bend_checked_) {
    is_bend_checked_ = true;
    radius_ *= 0.25;
    ask_star();
    return;
  }
  const bool good = gained > 0 && gained >= 0.5 * promised_;
  if (options_.doubts_edges && !settled && good && !has_met_walls_ && radius_ < options_.edge && !is_edge_checked_) {
    is_edge_checked_ = true;
    radius_ = options_.edge, trust_ = std::max(2 * length, 2 * radius_);
    ask_star();
    return;
  }
  if (settled || radius_ < (has_met_walls_ ? options_.smallest : std::max(options_.smallest, options_.edge))) {
    // where a boundary stops it that is not located any more, the way along it may lead on
    converged_ = settled || wall_ || probes_ < most_probes() || promised_ <= tolerance ||
                 (along_ < 0.05 && !boundary_.has_edges());
    is_doubtful_ = !settled && farther * promised_ > tolerance && !(!is_bound_ && (wall_ || probes_ < most_probes())) &&
                   !(last_along_ < 0.012 && !boundary_.has_edges());
    at_edge_ = !settled || is_bent();
    pending_.clear();
    if (!look_steep()) look_for_jump((settled ? 1e5 : 100) * options_.tolerance);
    return;
  }
  if (good && length >= 0.99 * trust_) {
    trust_ *= 2;
  } else {
    radius_ = gained <= tolerance ? 0.25 * radius_ : std::min(radius_, std::max(length, 0.25 * radius_));
    trust_ = good ? std::max(2 * length, 2 * radius_) : std::max(0.5 * length, 2 * radius_);
  }
  ask_star();
}

double ModelSearch::calc_outlook() const {
  return iteration_ >= 2 && last_gain_ <= 0.5 * earlier_gain_ ? value_ - 3 * last_gain_ : -infinite;
}

/// Begins to look at slopes on the line to the nearest place of another outcome: first away from it, then to it.
bool ModelSearch::look_steep() {
  if (!options_.looks_steep || !converged_ || walls_.empty()) return false;
  const auto nearest = std::min_element(walls_.begin(), walls_.end(), [this](const Point& a, const Point& b) {
    return boundary_.calc_offset(a, best_) < boundary_.calc_offset(b, best_);
  });
  const double distance = boundary_.calc_offset(*nearest, best_);
  if (distance > near_wall * radius_ || !options_.looks_steep(*nearest)) return false;
  beside_ = *nearest;
  near_ = {best_, value_}, far_ = {*nearest, infinite};
  for (const double back : ways_back) {
    Point x = best_;
    for (const Axis& axis : axes_) x[axis.input] += back / distance * (best_[axis.input] - far_.x[axis.input]);
    if (region_.contains(x)) pending_.push_back(std::move(x));
  }
  stage_ = Stage::Back;
  if (pending_.size() < std::size(ways_back)) look_back({});
  return true;
}

void ModelSearch::look_back(std::span<const Told> told) {
  double slopes[2] = {0, 0};
  for (std::size_t k = 0; k < told.size(); ++k)
    if (told[k].outcome == outcome_) slopes[k] = (told[k].value - near_.value) / ways_back[k];
  is_steep_ =
      slopes[0] > 0 && slopes[1] > much_steeper * slopes[0] && slopes[1] * ways_back[1] > 100 * options_.tolerance;
  converged_ = !is_steep_;
  section_ = 0, first_slope_ = 0;
  stage_ = Stage::Approach;
  pending_.clear();
  if (!is_steep_) ask_middle();
}

void ModelSearch::approach(const Told& told) {
  const Point x = pending_.front();
  pending_.clear();
  if (told.outcome == outcome_ && std::isfinite(told.value)) {
    const double slope = (near_.value - told.value) / boundary_.calc_offset(x, near_.x);
    if (first_slope_ == 0) first_slope_ = std::max(slope, options_.tolerance);
    is_steep_ = slope > much_steeper * first_slope_ && near_.value - told.value > 100 * options_.tolerance;
    near_ = {x, told.value};
    if (told.value < value_) best_ = x, value_ = told.value;
  } else {
    far_.x = x;
  }
  if (is_steep_) converged_ = false;
  if (!is_steep_ && ++section_ < most_approaches) ask_middle();
}

// ---- jumps of the value

/// Whether a place of the same outcome lies on the other side of the jump, as the model of this side tells.
bool ModelSearch::is_beyond(const Point& x, double value) const {
  const std::size_t n = axes_.size();
  double foretold = side_.at.value;
  for (std::size_t i = 0; i < n; ++i) {
    const auto offset = [&](std::size_t k) { return x[axes_[k].input] - side_.at.x[axes_[k].input]; };
    double row = 0;
    for (std::size_t j = 0; j < n; ++j) row += side_.hessian[i * n + j] * offset(j);
    foretold += offset(i) * (side_.slope[i] + 0.5 * row);
  }
  return std::abs(value - foretold) > part_beyond * jump_;
}

/// What is told, with what lies beyond the jump as another outcome.
std::vector<Told> ModelSearch::split_at_jump(std::span<const Told> told) const {
  std::vector<Told> split(told.begin(), told.end());
  for (std::size_t k = 0; k < split.size() && jump_ > 0; ++k)
    if (split[k].outcome == outcome_ && std::isfinite(split[k].value) && is_beyond(pending_[k], split[k].value))
      split[k].outcome = beyond;
  return split;
}

/// Looks for a jump, or another one, between the best point and the worst place near it, if that is worse by `least`.
void ModelSearch::look_for_jump(double least) {
  if (jumps_ >= most_jumps || axes_.size() < 2) return;
  const Place* worst = nullptr;
  for (const Place& p : insides_)
    if (boundary_.calc_offset(p.x, best_) <= 2 * radius_ && std::isfinite(p.value) &&
        (worst == nullptr || p.value > worst->value))
      worst = &p;
  if (worst == nullptr || worst->value - value_ < least) return;
  near_ = {best_, value_}, far_ = *worst;
  rise_ = far_.value - near_.value, section_ = 0;
  stage_ = Stage::Section;
  ask_middle();
}

/// Of the way between two places of different outcomes or values, unless they are next to each other.
void ModelSearch::ask_middle() {
  Point x = near_.x;
  for (const Axis& axis : axes_) x[axis.input] += 0.5 * (far_.x[axis.input] - x[axis.input]);
  if (x != near_.x && x != far_.x) pending_ = {std::move(x)};
}

/// A jump stays as high, however near its places are; a slope does not.
void ModelSearch::read_section(const Told& told) {
  const Point x = pending_.front();
  pending_.clear();
  if (told.outcome != outcome_ || !std::isfinite(told.value)) return;
  if (told.value < value_) best_ = x, value_ = told.value, converged_ = false;
  const bool is_low = std::abs(told.value - near_.value) < std::abs(far_.value - told.value);
  (is_low ? near_ : far_) = {x, told.value};
  if (std::abs(far_.value - near_.value) < 0.5 * rise_) return;
  if (++section_ == most_sections) {
    stay_before_jump();
    return;
  }
  ask_middle();
}

/// From now on what lies beyond counts as another outcome.
void ModelSearch::stay_before_jump() {
  ++jumps_;
  const double rise = std::abs(far_.value - near_.value);
  jump_ = jump_ > 0 ? std::min(jump_, rise) : rise;
  has_met_walls_ = true;
  side_ = {
      {best_, value_}, std::vector<double>(axes_.size(), 0.0), std::vector<double>(axes_.size() * axes_.size(), 0.0)};
  std::vector<Place> places;
  std::swap(places, insides_);
  walls_.clear(), tried_.clear(), boundary_.clear();
  for (Place& p : places) {
    if (boundary_.calc_offset(p.x, best_) > 2 * radius_ || !std::isfinite(p.value)) continue;
    if (is_beyond(p.x, p.value))
      walls_.push_back(std::move(p.x));
    else
      insides_.push_back(std::move(p));
  }
  insides_.push_back(near_), walls_.push_back(far_.x);
  is_wide_ = false;
  converged_ = at_edge_ = false;
  probes_ = 0, along_ = last_along_ = 1;
  ask_star();
}

JumpSide ModelSearch::get_side() const {
  JumpSide s{region_.axes, {}, {}};
  for (const Boundary::Plane& p : boundary_.planes()) s.in.push_back(p.side);
  for (const Axis& axis : axes_) s.slope.push_back(axis.slope * region_.scale[axis.input]);
  return s;
}

/// As wide a star as the slopes let tell what lies beyond.
bool ModelSearch::widen_star() {
  if (jump_ == 0 || is_wide_) return false;
  double rise = 0;
  for (const Axis& axis : axes_) rise += std::abs(axis.slope) * region_.scale[axis.input];
  const double widest = 0.05, radius = rise > 0 ? std::min(widest, 0.5 * part_beyond * jump_ / rise) : widest;
  // slopes of a narrow star are those of the model's noise, too
  is_wide_ = radius < 1.5 * radius_;
  if (is_wide_) return false;
  radius_ = radius, trust_ = 4 * radius;
  return true;
}

/// Behind the star.
void ModelSearch::conclude_star() {
  if (jump_ > 0) {
    side_.at = {best_, value_}, side_.hessian = hessian_;
    // where the star saw nothing of this side slopes stay as they were
    for (std::size_t k = 0; k < axes_.size(); ++k) {
      Axis& axis = axes_[k];
      if (!axis.known && axis.slope == 0) axis.slope = side_.slope[k];
      side_.slope[k] = axis.slope;
    }
  }
  if (widen_star())
    ask_star();
  else
    ask_trials();
}

void ModelSearch::tell(std::span<const Told> given) {
  if (stage_ == Stage::Section) {
    read_section(given.front());
    return;
  }
  if (stage_ == Stage::Back) {
    look_back(given);
    return;
  }
  if (stage_ == Stage::Approach) {
    approach(given.front());
    return;
  }
  const std::vector<Told> told = split_at_jump(given);
  note(told);
  switch (stage_) {
    case Stage::Star:
      read_star(told);
      if (is_blind()) ask_inner();
      if (stage_ != Stage::Inner || pending_.empty()) conclude_star();
      break;
    case Stage::Inner:
      read_inner(told);
      conclude_star();
      break;
    case Stage::Section:
    case Stage::Back:
    case Stage::Approach:
      break;
    case Stage::Probe: {
      std::vector<bool> inside;
      for (const auto& t : told) inside.push_back(t.outcome == outcome_);
      wall_->tell(inside);
      pending_ = wall_->pending();
      if (!pending_.empty()) break;
      boundary_.keep(*wall_, best_, radius_, list_insides());
      // places near would lead to the same mixture of planes
      if ((jump_ > 0 || boundary_.has_edges()) && !boundary_.has_kept())
        std::copy_if(
            walls_.begin(), walls_.end(), std::back_inserter(tried_),
            [this, from = tried_.back()](const Point& x) { return boundary_.calc_offset(x, from) < 0.25 * radius_; });
      ask_trials();
      break;
    }
    case Stage::Trial:
      if (!is_blocked(told) || !ask_probe()) finish_iteration();
      break;
  }
}

EvolutionSearch::EvolutionSearch(Region region, Point start, const Told& at_start, const Options& options)
    : LocalSearch(std::move(start), at_start),
      region_(std::move(region)),
      options_(options),
      random_(options.seed),
      width_(options.width) {
  ask();
}

void EvolutionSearch::ask() {
  pending_.clear();
  if (width_ < options_.smallest || region_.axes.empty() || generation_++ >= options_.generations) return;
  const double share = std::max(0.5, 1.0 / static_cast<double>(region_.axes.size()));
  for (int k = 0; k < options_.children; ++k) {
    Point x = best_;
    for (const int i : region_.axes) {
      const double step = width_ * (region_.box.upper[i] - region_.box.lower[i]) * random_.next(-1, 1);
      if (random_.next() < share) x[i] += step;
    }
    x = pull_inside(region_, best_, std::move(x));
    if (x != best_) pending_.push_back(std::move(x));
  }
}

void EvolutionSearch::tell(std::span<const Told> told) {
  const auto least =
      std::min_element(told.begin(), told.end(), [](const Told& a, const Told& b) { return a.value < b.value; });
  if (least != told.end() && least->value < value_) {
    value_ = least->value;
    outcome_ = least->outcome;
    best_ = pending_[least - told.begin()];
    width_ = std::min(1.2 * width_, options_.width);
  } else {
    width_ *= 0.6;
  }
  ask();
}

FaceSearch::FaceSearch(Region region, Point start, const Told& at_start, const Options& options)
    : LocalSearch(std::move(start), at_start), region_(std::move(region)), options_(options) {
  for (const int i : region_.axes) axes_.push_back({i, {}, {}});
  ask_star(false);
}

bool FaceSearch::add(const Point& x) {
  if (x == best_ || (region_.space->has_interaction() && !region_.contains(x))) return false;
  pending_.push_back(x);
  return true;
}

void FaceSearch::ask_star(bool wide) {
  pending_.clear(), asked_.clear();
  stage_ = wide ? Stage::Wide : Stage::Star;
  is_wide_ = wide;
  if (!wide) {
    next_ = best_, next_value_ = value_, next_outcome_ = outcome_;
    for (Axis& axis : axes_) axis.places.clear();
    if (iteration_++ >= options_.iterations) return;
  }
  const std::vector<double> parts = wide ? std::vector<double>{0.25, 0.5, 0.75} : std::vector<double>{0, 1};
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    const int i = axes_[k].input;
    const double low = region_.box.lower[i], high = region_.box.upper[i];
    if (wide && std::count(options_.wide_axes.begin(), options_.wide_axes.end(), i) == 0) continue;
    for (const double part : parts) {
      Point x = best_;
      x[i] = part == 0 ? low : part == 1 ? high : low + part * (high - low);
      if (wide && std::abs(x[i] - best_[i]) < 0.05 * (high - low)) continue;
      if (add(x)) asked_.push_back({static_cast<int>(k), x[i]});
    }
  }
  if (pending_.empty()) wide ? ask_pairs() : conclude();
}

/// Along axes whose best place has one on either side: the vertex of the parabola through the three.
void FaceSearch::ask_vertices() {
  pending_.clear(), asked_.clear();
  stage_ = Stage::Vertex;
  for (std::size_t k = 0; k < axes_.size(); ++k) {
    const int i = axes_[k].input;
    std::vector<Place> all = axes_[k].places;
    all.push_back({best_[i], value_});
    std::sort(all.begin(), all.end(), [](const Place& a, const Place& b) { return a.at < b.at; });
    const std::size_t least =
        std::min_element(all.begin(), all.end(), [](const Place& a, const Place& b) { return a.value < b.value; }) -
        all.begin();
    if (least == 0 || least + 1 >= all.size()) continue;
    const Place &a = all[least - 1], &b = all[least], &c = all[least + 1];
    if (!std::isfinite(a.value) || !std::isfinite(c.value)) continue;
    const double left = (a.value - b.value) / (a.at - b.at), right = (c.value - b.value) / (c.at - b.at);
    const double curvature = (right - left) / (c.at - a.at);
    if (!(curvature > 0)) continue;
    Point x = best_;
    x[i] = std::clamp(0.5 * (a.at + b.at - left / curvature), a.at, c.at);
    if (std::abs(x[i] - b.at) < 0.02 * (region_.box.upper[i] - region_.box.lower[i])) continue;
    if (add(x)) asked_.push_back({static_cast<int>(k), x[i]});
  }
  if (pending_.empty()) ask_together();
}

/// Moves that improve alone, the two, four ... best ones and all of them at once.
void FaceSearch::ask_together() {
  pending_.clear();
  stage_ = Stage::Together;
  std::vector<std::pair<Place, int>> gains;
  for (const Axis& axis : axes_) {
    const auto best = std::min_element(axis.places.begin(), axis.places.end(),
                                       [](const Place& a, const Place& b) { return a.value < b.value; });
    if (best != axis.places.end() && best->value < value_ - options_.least_gain) gains.push_back({*best, axis.input});
  }
  std::stable_sort(gains.begin(), gains.end(),
                   [](const auto& a, const auto& b) { return a.first.value < b.first.value; });
  Point x = best_;
  for (std::size_t k = 0; k < gains.size(); ++k) {
    x[gains[k].second] = gains[k].first.at;
    const std::size_t count = k + 1;
    if (count > 1 && (count == gains.size() || (count & (count - 1)) == 0)) add(x);
  }
  if (pending_.empty()) conclude();
}

/// Moves of an axis for pairs: to other valleys of what is known along it, two at most, or else to the better end.
void FaceSearch::choose_moves(Axis& axis) const {
  const int i = axis.input;
  const double width = region_.box.upper[i] - region_.box.lower[i];
  const auto is_less = [](const Place& a, const Place& b) { return a.value < b.value; };
  axis.moves.clear();
  std::vector<Place> all = axis.places, ends;
  all.push_back({best_[i], value_});
  std::sort(all.begin(), all.end(), [](const Place& a, const Place& b) { return a.at < b.at; });
  for (std::size_t k = 0; k < all.size(); ++k) {
    const bool is_first = k == 0, is_last = k + 1 == all.size();
    if (!std::isfinite(all[k].value) || std::abs(all[k].at - best_[i]) < 0.2 * width) continue;
    if (is_first || is_last) ends.push_back(all[k]);
    if ((is_first || all[k].value <= all[k - 1].value) && (is_last || all[k].value <= all[k + 1].value))
      axis.moves.push_back(all[k]);
  }
  std::stable_sort(axis.moves.begin(), axis.moves.end(), is_less);
  if (axis.moves.size() > 2) axis.moves.resize(2);
  if (axis.moves.empty() && !ends.empty()) axis.moves.push_back(*std::min_element(ends.begin(), ends.end(), is_less));
}

void FaceSearch::ask_pairs() {
  pending_.clear(), pairs_.clear(), first_.clear();
  stage_ = Stage::Pairs;
  if (!options_.pairs || paired_ || pairings_ >= 3) {
    converged_ = true;
    return;
  }
  ++pairings_;
  int count = 0;
  for (Axis& axis : axes_) {
    choose_moves(axis);
    first_.push_back(count);
    count += static_cast<int>(axis.moves.size());
  }
  first_.push_back(count);
  mixed_.assign(static_cast<std::size_t>(count) * count, infinite);
  for (std::size_t a = 0; a < axes_.size(); ++a)
    for (std::size_t b = a + 1; b < axes_.size(); ++b)
      for (int p = first_[a]; p < first_[a + 1]; ++p)
        for (int q = first_[b]; q < first_[b + 1]; ++q) {
          Point x = best_;
          x[axes_[a].input] = axes_[a].moves[p - first_[a]].at, x[axes_[b].input] = axes_[b].moves[q - first_[b]].at;
          if (add(x)) pairs_.push_back({p, q});
        }
  if (pending_.empty()) converged_ = true;
}

/// Minima of the model of moves and pairs by steepest descents from random combinations, best first.
std::vector<FaceSearch::Combination> FaceSearch::minimise_pairs() const {
  const std::size_t n = axes_.size(), count = static_cast<std::size_t>(first_.back());
  std::vector<double> alone(count);
  for (std::size_t a = 0; a < n; ++a)
    for (int p = first_[a]; p < first_[a + 1]; ++p) alone[p] = axes_[a].moves[p - first_[a]].value - value_;
  Random random(options_.seed);
  std::vector<Combination> found;
  for (std::size_t start = 0; start < 30 * n; ++start) {
    Combination c;
    for (const Axis& axis : axes_)
      c.moves.push_back(static_cast<int>(random.next() * static_cast<double>(axis.moves.size() + 1)));
    const auto calc_change = [&](std::size_t a, int move) {
      if (move == 0) return 0.0;
      const std::size_t p = first_[a] + move - 1;
      double sum = alone[p];
      for (std::size_t b = 0; b < n; ++b)
        if (b != a && c.moves[b] > 0) sum += mixed_[p * count + first_[b] + c.moves[b] - 1];
      return sum;
    };
    for (std::size_t step = 0; step < 10 * n; ++step) {
      double most = 0;
      std::size_t axis = n;
      int move = 0;
      for (std::size_t a = 0; a < n; ++a) {
        const double now = calc_change(a, c.moves[a]);
        for (int m = 0; m <= static_cast<int>(axes_[a].moves.size()); ++m) {
          const double then = m == c.moves[a] ? infinite : calc_change(a, m);
          if (std::isfinite(then) && now - then > most) most = now - then, axis = a, move = m;
        }
      }
      if (axis == n) break;
      c.moves[axis] = move;
    }
    c.value = value_;
    for (std::size_t a = 0; a < n; ++a) {
      if (c.moves[a] == 0) continue;
      const std::size_t p = first_[a] + c.moves[a] - 1;
      c.value += alone[p];
      for (std::size_t b = 0; b < a; ++b)
        if (c.moves[b] > 0) c.value += mixed_[p * count + first_[b] + c.moves[b] - 1];
    }
    if (std::isfinite(c.value)) found.push_back(std::move(c));
  }
  // the same combination by another way differs in the last digits
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.moves < b.moves; });
  found.erase(std::unique(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.moves == b.moves; }),
              found.end());
  std::sort(found.begin(), found.end());
  return found;
}

void FaceSearch::ask_foretold() {
  pending_.clear(), foretold_.clear();
  stage_ = Stage::Foretold;
  for (const Combination& c : minimise_pairs()) {
    if (static_cast<int>(pending_.size()) >= options_.trials) break;
    if (c.moves.size() - std::count(c.moves.begin(), c.moves.end(), 0) < 3) continue;
    Point x = best_;
    for (std::size_t k = 0; k < axes_.size(); ++k)
      if (c.moves[k] > 0) x[axes_[k].input] = axes_[k].moves[c.moves[k] - 1].at;
    if (add(x)) foretold_.push_back(c.value);
  }
  if (pending_.empty()) conclude();
}

/// Goes to the best point of this stage, or on to the next stage where nothing improved.
void FaceSearch::conclude() {
  if (next_value_ < value_ - options_.least_gain) {
    best_ = next_, value_ = next_value_, outcome_ = next_outcome_;
    if (stage_ != Stage::Foretold) paired_ = foretells_ = false;
    ask_star(false);
  } else if (stage_ == Stage::Pairs || stage_ == Stage::Foretold) {
    pending_.clear();
    converged_ = paired_ = true;
  } else if (!options_.wide_axes.empty() && !is_wide_) {
    ask_star(true);
  } else {
    ask_pairs();
  }
}

void FaceSearch::tell(std::span<const Told> told) {
  for (std::size_t k = 0; k < told.size(); ++k)
    if (told[k].value < next_value_) next_ = pending_[k], next_value_ = told[k].value, next_outcome_ = told[k].outcome;
  switch (stage_) {
    case Stage::Star:
    case Stage::Wide:
    case Stage::Vertex: {
      for (std::size_t k = 0; k < told.size(); ++k)
        axes_[asked_[k].axis].places.push_back({asked_[k].at, told[k].value});
      stage_ == Stage::Vertex ? ask_together() : ask_vertices();
      break;
    }
    case Stage::Together:
      conclude();
      break;
    case Stage::Pairs: {
      std::vector<double> alone;
      for (const Axis& axis : axes_)
        for (const Place& p : axis.moves) alone.push_back(p.value);
      const std::size_t count = alone.size();
      for (std::size_t k = 0; k < told.size(); ++k) {
        const auto [p, q] = pairs_[k];
        const double mixed = told[k].value - alone[p] - alone[q] + value_;
        if (std::isfinite(mixed)) mixed_[p * count + q] = mixed_[q * count + p] = mixed;
      }
      ask_foretold();
      break;
    }
    case Stage::Foretold: {
      // a model that foretells values needs no second set of pairs
      double off = 0;
      for (std::size_t k = 0; k < told.size(); ++k) off = std::max(off, std::abs(told[k].value - foretold_[k]));
      paired_ = off <= 10 * options_.least_gain;
      foretells_ =
          paired_ && std::all_of(axes_.begin(), axes_.end(), [this](const Axis& axis) {
            const int i = axis.input;
            const auto is_end = [&](double at) { return at == region_.box.lower[i] || at == region_.box.upper[i]; };
            return is_end(best_[i]) && axis.moves.size() == 1 && is_end(axis.moves[0].at);
          });
      conclude();
      break;
    }
  }
}

}  // namespace topple::uncertainty
