#include "uncertainty/boundary.h"

#include <algorithm>
#include <cmath>

namespace topple::uncertainty {
namespace {

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
  has_edges_ = false;
}

/// Positive inside.
double Boundary::calc_distance(const Plane& p, const Point& x) const {
  double rest = p.side.b;
  for (std::size_t k = 0; k < axes_.size(); ++k) rest -= p.side.a[k] * x[axes_[k]] / scale_[axes_[k]];
  return rest;
}

double Boundary::calc_offset(const Point& a, const Point& b) const {
  double distance = 0;
  for (const int i : axes_) distance = std::max(distance, std::abs(a[i] - b[i]) / scale_[i]);
  return distance;
}

bool Boundary::leaves_out(const Plane& p, const Point& from, double reach, const Places& inside) const {
  constexpr double accuracy = 0.02;  // of the length over which a plane was found, or is continued
  if (calc_distance(p, from) < -accuracy * p.reach) return true;
  return std::any_of(inside.begin(), inside.end(), [&](const Point* x) {
    const double offset = calc_offset(*x, from);
    return offset < 2 * reach && calc_distance(p, *x) < -accuracy * std::max(p.reach, offset);
  });
}

bool Boundary::keep(const WallProbe& wall, const Point& from, double reach, const Places& inside) {
  if (!wall.found()) return false;
  Plane found{{wall.normal(), wall.calc_distance(from)}, wall.radius()};
  for (std::size_t k = 0; k < axes_.size(); ++k) found.side.b += found.side.a[k] * from[axes_[k]] / scale_[axes_[k]];
  const bool is_turned = !latest_.side.a.empty() && calc_turn(latest_.side, found.side) > 0.05;
  const bool is_first = is_turned && !has_edges_;
  has_edges_ = has_edges_ || is_turned;
  std::erase_if(planes_, [&](const Plane& p) {
    return calc_turn(p.side, found.side) < 0.001 || leaves_out(p, from, reach, inside);
  });
  if (!leaves_out(found, from, reach, inside)) planes_.push_back(found);
  latest_ = std::move(found);
  return is_first;
}

bool Boundary::explains(const Point& x) const {
  return std::any_of(planes_.begin(), planes_.end(),
                     [&](const Plane& p) { return calc_distance(p, x) < 0.005 * p.reach; });
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

Point Boundary::find_inner(const Point& from, double reach, const Places& inside, const Places& outside) const {
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
  return *inner;
}

}  // namespace topple::uncertainty
