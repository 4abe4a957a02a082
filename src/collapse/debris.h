#pragma once
/// Plane geometry of what lies about after a collapse.

#include <array>
#include <cstdint>
#include <vector>

#include "base/linalg.h"
#include "base/polygon.h"

namespace topple::collapse {

/// Distance between the areas of two simple polygons; 0 where they overlap.
double calc_distance(const Polygon&, const Polygon&);
/// Distance of a point from the area of a simple polygon; 0 within.
double calc_distance(const Point2&, const Polygon&);

/// A box as it lies in W.
struct PlacedBox {
  Pose X_WS;
  Vec3 half;
};
/// Hull of a box seen from above.
Polygon calc_outline(const PlacedBox&);

/// Height of the lowest point of a box over the area of a simple polygon; infinity if none of it is there.
double calc_lowest_over(const PlacedBox&, const Polygon&);

/// Heap of boxes above the ground: bulk volume under their upper surface, and its highest point.
struct Heap {
  double height = 0;  // [m]
  double volume = 0;  // [m³]
  /// A square of the ground under the heap: lower left corner in cells from the origin, height of the surface [m].
  struct Column {
    std::int64_t i = 0, j = 0;
    double height = 0;
  };
  std::vector<Column> columns;  // rising by i, then j
};
/// Heights are sampled on a grid of `cell` [m]; the volume's error is of the order of the outline times the cell.
Heap calc_heap(const std::vector<PlacedBox>&, double cell);
/// Its highest point alone, without a grid [m].
double calc_heap_height(const std::vector<PlacedBox>&);

}  // namespace topple::collapse
