#include "uncertainty/jump.h"

#include <algorithm>
#include <cmath>

#include "uncertainty/cut_program.h"
#include "uncertainty/linear.h"
#include "uncertainty/local_search.h"

namespace topple::uncertainty {
namespace {

constexpr double accuracy = 0.01;             // of planes and slopes, by widths
constexpr long most_sides = 100;              // that are kept
constexpr std::size_t most_crossing = 5;      // planes whose pieces are looked into
constexpr double known_to[] = {0.02, 0.005};  // planes, from which places keep off

HalfSpace turn_round(HalfSpace h) {
  for (double& a : h.a) a = -a;
  h.b = -h.b;
  return h;
}

bool is_near(double x, double y) { return std::abs(x - y) <= accuracy; }

/// The same plane and side, but for what is not known of it.
bool is_alike(const HalfSpace& a, const HalfSpace& b) {
  return is_near(a.b, b.b) && std::equal(a.a.begin(), a.a.end(), b.a.begin(), b.a.end(), is_near);
}

bool is_alike(const JumpSide& a, const JumpSide& b) {
  const double slope = std::sqrt(dot(a.slope, a.slope));
  return a.axes == b.axes &&
         std::equal(a.in.begin(), a.in.end(), b.in.begin(), b.in.end(),
                    [](const HalfSpace& g, const HalfSpace& h) { return is_alike(g, h); }) &&
         std::equal(a.slope.begin(), a.slope.end(), b.slope.begin(), b.slope.end(),
                    [slope](double x, double y) { return std::abs(x - y) <= accuracy * slope; });
}

}  // namespace

std::vector<Point> find_places(const Region& region, const JumpSide& side) {
  return find_places(region, side, known_to);
}

std::vector<Point> find_places(const Region& region, const JumpSide& side, std::span<const double> margins) {
  const Space& space = *region.space;
  const std::vector<double>& scale = region.scale;
  const std::vector<int>& axes = region.axes;
  if (axes != side.axes || side.in.empty()) return {};
  const std::size_t n = axes.size();
  const Point centre = calc_centre(space);
  const auto to_widths = [&](const Point& x) {
    std::vector<double> v;
    for (const int i : axes) v.push_back(x[i] / scale[i]);
    return v;
  };
  const auto see = [&](const Point& from, double margin) {
    std::vector<HalfSpace> seen = side.in;
    for (HalfSpace& h : seen) h.b -= dot(h.a, to_widths(from)) + margin;
    return seen;
  };
  const std::vector<double> none(n * n, 0.0);
  if (space.has_interaction()) {
    CutProgram cut(space, region.alpha, scale, axes);
    std::vector<double> out(n, 0.0);
    for (const HalfSpace& h : side.in)
      for (std::size_t k = 0; k < n; ++k) out[k] += h.a[k];
    const Point deepest = cut.minimise_from(centre, {out, none}, 1);
    std::vector<Point> places = {deepest};
    for (const double margin : margins)
      places.push_back(cut.minimise_from(deepest, {side.slope, none}, 1, see(deepest, margin)));
    return places;
  }
  const auto to_place = [&](const std::vector<double>& v) {
    Point x = centre;
    for (std::size_t k = 0; k < n; ++k) x[axes[k]] = v[k] * scale[axes[k]];
    return clip(region.box, std::move(x));
  };
  // the least excess over all planes
  std::vector<double> lower = to_widths(region.box.lower), upper = to_widths(region.box.upper),
                      start = to_widths(centre);
  std::vector<HalfSpace> planes = side.in;
  double excess = 0;
  for (HalfSpace& h : planes) {
    excess = std::max(excess, dot(h.a, start) - h.b);
    h.a.push_back(-1);
  }
  Quadratic q{std::vector<double>(n + 1, 0.0), std::vector<double>((n + 1) * (n + 1), 0.0)};
  q.slope[n] = 1;
  lower.push_back(-2 * static_cast<double>(n)), upper.push_back(excess + 1), start.push_back(excess);
  std::vector<double> deepest = minimise(q, planes, lower, upper, std::move(start));
  excess = deepest.back();
  deepest.pop_back(), lower.pop_back(), upper.pop_back();
  if (excess > margins[0]) return {};
  std::vector<Point> places = {to_place(deepest)};
  for (const double margin : margins)
    if (excess < -margin)
      places.push_back(
          to_place(minimise({side.slope, none}, see(Point(centre.size(), 0.0), margin), lower, upper, deepest)));
  return places;
}

void Jumps::add(JumpSide side) {
  const auto is_same = [&side](const JumpSide& s) { return is_alike(s, side); };
  if (side.in.empty() || std::ssize(sides_) >= most_sides || std::any_of(sides_.begin(), sides_.end(), is_same)) return;
  sides_.push_back(std::move(side));
}

std::vector<JumpSide> Jumps::take_new() {
  std::vector<JumpSide> all;
  for (; taken_ < sides_.size(); ++taken_) {
    const JumpSide& side = sides_[taken_];
    all.push_back(side);
    if (side.in.size() == 1) all.push_back({side.axes, {turn_round(side.in[0])}, side.slope});
    std::vector<HalfSpace>& planes = planes_[side.axes];
    for (const HalfSpace& h : side.in) {
      const auto is_known = [&h](const HalfSpace& p) { return is_alike(p, h) || is_alike(p, turn_round(h)); };
      if (std::any_of(planes.begin(), planes.end(), is_known)) continue;
      planes.push_back(h);
      const std::size_t count = std::min(planes.size(), most_crossing), first = planes.size() - count;
      for (std::size_t turned = 0; count > 1 && turned < std::size_t{1} << count; ++turned) {
        JumpSide piece{side.axes, {}, side.slope};
        for (std::size_t k = 0; k < count; ++k)
          piece.in.push_back(turned >> k & 1 ? turn_round(planes[first + k]) : planes[first + k]);
        all.push_back(piece);
        for (double& s : piece.slope) s = -s;
        all.push_back(std::move(piece));
      }
    }
  }
  return all;
}

}  // namespace topple::uncertainty
