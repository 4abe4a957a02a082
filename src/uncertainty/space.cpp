#include "uncertainty/space.h"

#include <fmt/format.h>

#include <algorithm>
#include <boost/random/sobol.hpp>
#include <cmath>
#include <memory>

#include "base/error.h"
#include "uncertainty/random.h"

namespace topple::uncertainty {

void check_space(const Space& space) {
  if (space.inputs.empty()) throw InputError("E804", "there is no fuzzy input");
  const Point centre = calc_centre(space);
  for (std::size_t k = 0; k < space.constraints.size(); ++k)
    if (const double g = space.constraints[k](centre); !(g <= 0))
      throw InputError("E804", fmt::format("interaction: constraint {} is {} at the centre of the inputs", k + 1, g),
                       "at the most possible values every constraint must be 0 or less");
  if (space.joint)
    if (const double mu = space.joint(centre); !(mu >= 1))
      throw InputError("E804", fmt::format("interaction: the joint membership is {} at the centre of the inputs", mu),
                       "it must be 1 there");
}

Point calc_centre(const Space& space) {
  Point x;
  for (const auto& f : space.inputs) x.push_back(f.centre());
  return x;
}

std::vector<double> calc_scale(const Space& space) {
  std::vector<double> w;
  for (const auto& f : space.inputs) w.push_back(f.width());
  return w;
}

bool is_allowed(const Space& space, const Point& x) {
  return std::all_of(space.constraints.begin(), space.constraints.end(), [&x](const auto& g) { return g(x) <= 0; });
}

double calc_membership(const Space& space, const Point& x) {
  double mu = 1;
  for (int i = 0; i < space.size(); ++i) mu = std::min(mu, space.inputs[i].membership(x[i]));
  if (mu > 0 && !is_allowed(space, x)) return 0;
  return mu > 0 && space.joint ? std::min(mu, space.joint(x)) : mu;
}

bool Box::contains(const Point& x) const {
  for (std::size_t i = 0; i < x.size(); ++i)
    if (!(x[i] >= lower[i] && x[i] <= upper[i])) return false;
  return true;
}

double calc_volume(const Box& box) {
  double v = 1;
  for (std::size_t i = 0; i < box.lower.size(); ++i) v *= box.upper[i] - box.lower[i];
  return v;
}

Point clip(const Box& box, Point x) {
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = std::clamp(x[i], box.lower[i], box.upper[i]);
  return x;
}

Box make_box(const Space& space, double alpha) {
  Box box;
  for (const auto& f : space.inputs) {
    const AlphaCut c = f.cut(alpha);
    box.lower.push_back(c.left);
    box.upper.push_back(c.right);
  }
  return box;
}

double calc_offset(const Point& a, const Point& b, const std::vector<int>& axes, const std::vector<double>& scale) {
  double distance = 0;
  for (const int i : axes) distance = std::max(distance, std::abs(a[i] - b[i]) / scale[i]);
  return distance;
}

bool is_in_cut(const Space& space, const Box& box, double alpha, const Point& x) {
  if (!box.contains(x) || !is_allowed(space, x)) return false;
  if (!space.joint) return true;
  // the cut at 0 is the support: nothing that is impossible
  const double mu = space.joint(x);
  return mu > 0 && mu >= alpha;
}

std::pair<Point, Point> bisect(Point in, Point out, const std::function<bool(const Point&)>& counts, int halvings) {
  for (int k = 0; k < halvings; ++k) {
    Point middle(out.size());
    for (std::size_t i = 0; i < out.size(); ++i) middle[i] = 0.5 * (in[i] + out[i]);
    if (middle == in || middle == out) break;
    (counts(middle) ? in : out) = std::move(middle);
  }
  return {std::move(in), std::move(out)};
}

std::vector<Point> make_sobol_points(int n, int first, int count, std::uint64_t seed) {
  boost::random::sobol engine(static_cast<std::size_t>(n));
  engine.discard(static_cast<boost::uintmax_t>(first) * static_cast<boost::uintmax_t>(n));
  Random random(seed);
  Point shift(n);
  for (double& s : shift) s = random.next();
  std::vector<Point> points(count, Point(n));
  for (auto& x : points)
    for (int i = 0; i < n; ++i) {
      x[i] = std::ldexp(static_cast<double>(engine() >> 11), -53) + shift[i];
      if (x[i] >= 1) x[i] -= 1;
    }
  return points;
}

Point place_in(const Box& box, const Point& fractions) {
  Point x(fractions.size());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = box.lower[i] + fractions[i] * (box.upper[i] - box.lower[i]);
  return clip(box, std::move(x));
}

std::vector<Point> make_corners(const Box& box) {
  std::vector<std::size_t> axes;
  for (std::size_t i = 0; i < box.lower.size(); ++i)
    if (box.lower[i] < box.upper[i]) axes.push_back(i);
  std::vector<Point> corners(std::size_t{1} << axes.size(), box.lower);
  for (std::size_t k = 0; k < corners.size(); ++k)
    for (std::size_t i = 0; i < axes.size(); ++i)
      if (k >> i & 1) corners[k][axes[i]] = box.upper[axes[i]];
  return corners;
}

Evaluate with_derived(const Space& space, std::vector<std::function<double(const Point&)>> derived, Evaluate model) {
  check_space(space);
  std::vector<Point> places = {calc_centre(space)};
  if (space.size() <= 12)
    for (auto& x : make_corners(make_box(space, 0)))
      if (calc_membership(space, x) >= 0 && is_allowed(space, x)) places.push_back(std::move(x));
  for (const auto& x : places)
    for (std::size_t k = 0; k < derived.size(); ++k)
      if (const double v = derived[k](x); !std::isfinite(v))
        throw InputError("E806",
                         fmt::format("interaction: derived variable {} is {} at ({})", k + 1, v, fmt::join(x, ", ")),
                         "the support must stay inside the range of the formula");
  return [derived = std::move(derived), model = std::move(model)](std::span<const Point> batch, std::span<Result> out) {
    std::vector<Point> extended(batch.begin(), batch.end());
    for (std::size_t k = 0; k < batch.size(); ++k)
      for (const auto& f : derived) extended[k].push_back(f(batch[k]));
    model(extended, out);
  };
}

}  // namespace topple::uncertainty
