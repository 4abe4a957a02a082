#pragma once
/// Polygons in a plane.

#include <array>
#include <vector>

namespace topple {

using Point2 = std::array<double, 2>;
using Polygon = std::vector<Point2>;

/// Convex hull, counter-clockwise, without points between its corners; fewer than three points as they are, once each.
Polygon calc_hull(std::vector<Point2> points);
/// Positive counter-clockwise.
double calc_signed_area(const Polygon&);
double calc_area(const Polygon&);

}  // namespace topple
