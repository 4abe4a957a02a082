#include "uncertainty/boundary.h"

#include <algorithm>
#include <cmath>

namespace topple::uncertainty {
namespace {

constexpr double accuracy = 0.02;  // of the length over which a plane was found, or is continued

constexpr double edge_turn = 0.05;  // planes that are turned by more meet at an edge

/// 1 - cos of the angle between two normals.
double calc_turn(const HalfSpace& a, const HalfSpace& b) {
  double turn = 1;
  for (std::size_t k = 0; k < a.a.size(); ++k) turn -= a.a[k] * b.a[k];
  return turn;
}

}  // namespace

void Boundary::clear() {
  planes_.clear();
  latest_ = {};
  has_edges_ = is_turned_ = false;
}

double Boundary::calc_reach(const Plane& p, const Point& x) const {
  const double part = p.error < 0 ? 1 : std::max(p.error / accuracy, 1e-3);
  return part * std::max(p.reach, calc_offset(p.at, x));
}

/// Positive inside.
double Boundary::calc_distance(const Plane& p, const Point& x) const {
  double rest = p.side.b;
  for (std::size_t k = 0; k < axes_.size(); ++k) rest -= p.side.a[k] * x[axes_[k]] / scale_[axes_[k]];
  return rest;
}

bool Boundary::leaves_out(const Plane& p, const Point& from, double reach, const Places& inside) const {
  if (calc_distance(p, from) < -accuracy * calc_reach(p, from)) return true;
  return std::any_of(inside.begin(), inside.end(), [&](const Point* x) {
    return calc_offset(*x, from) < 2 * reach && calc_distance(p, *x) < -accuracy * calc_reach(p, *x);
  });
}

bool Boundary::keep(const WallProbe& wall, const Point& from, double reach, const Places& inside) {
  has_kept_ = false;
  if (!wall.found()) return false;
  Plane found{{wall.normal(), wall.calc_distance(from)}, from, wall.radius()};
  for (std::size_t k = 0; k < axes_.size(); ++k) found.side.b += found.side.a[k] * from[axes_[k]] / scale_[axes_[k]];
  is_turned_ = !latest_.side.a.empty() && std::max(latest_.reach, found.reach) <= edge_reach_ &&
               calc_turn(latest_.side, found.side) > edge_turn;
  const bool is_first = is_turned_ && !has_edges_;
  has_edges_ = has_edges_ || is_turned_;
  std::erase_if(planes_, [&](const Plane& p) {
    return calc_turn(p.side, found.side) < 0.001 || leaves_out(p, from, reach, inside);
  });
  has_kept_ = !leaves_out(found, from, reach, inside);
  if (has_kept_) planes_.push_back(found);
  latest_ = std::move(found);
  return is_first;
}

void Boundary::adopt(const std::vector<Plane>& planes, const Point& from, double reach, const Places& inside) {
  for (const Plane& p : planes) {
    const bool is_known =
        std::any_of(planes_.begin(), planes_.end(), [&](const Plane& q) { return calc_turn(p.side, q.side) < 0.001; });
    if (!is_known && calc_reach(p, from) <= 4 * reach && calc_distance(p, from) < 2 * reach &&
        !leaves_out(p, from, reach, inside))
      planes_.push_back(p);
  }
  for (const Plane& p : planes_) has_edges_ = has_edges_ || calc_turn(p.side, planes_.front().side) > edge_turn;
}

void Boundary::review(const Point& from, double reach, const Places& inside) {
  std::erase_if(planes_,
                [&](const Plane& p) { return calc_reach(p, from) > 4 * reach || leaves_out(p, from, reach, inside); });
}

bool Boundary::explains(const Point& x, double reach) const {
  return std::any_of(planes_.begin(), planes_.end(), [&](const Plane& p) {
    const double distance = calc_distance(p, x);
    const double over = calc_reach(p, x);
    return distance < -accuracy * over || (distance < 0.005 * over && over <= 4 * reach);
  });
}

HalfSpace Boundary::see(const Plane& p, const Point& from, double margin) const {
  return {p.side.a, calc_distance(p, from) - margin};
}

std::vector<HalfSpace> Boundary::see(const Point& from, double margin) const {
  std::vector<HalfSpace> sides;
  for (const Plane& p : planes_) sides.push_back(see(p, from, margin));
  return sides;
}

std::vector<HalfSpace> Boundary::see_latest(const Point& from, double margin) const {
  return {see(latest_, from, margin)};
}

std::pair<Point, double> Boundary::find_inner(const Point& from, double reach, const Places& inside,
                                              const Places& outside) const {
  Places near;
  std::copy_if(outside.begin(), outside.end(), std::back_inserter(near),
               [&](const Point* x) { return calc_offset(*x, from) < 3 * reach; });
  const auto calc_depth = [&](const Point& x) {
    double least = 9 * reach * reach;
    for (const Point* y : near) {
      double square = 0;
      for (const int i : axes_) square += std::pow((x[i] - (*y)[i]) / scale_[i], 2);
      least = std::min(least, square);
    }
    return least;
  };
  const Point* inner = &from;
  double most = calc_depth(from);
  for (const Point* x : inside) {
    if (calc_offset(*x, from) > reach) continue;
    if (const double depth = calc_depth(*x); depth > most) most = depth, inner = x;
  }
  return {*inner, std::sqrt(most)};
}

}  // namespace topple::uncertainty
