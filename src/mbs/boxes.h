#pragma once
/// Where two convex solids touch.

#include <algorithm>
#include <iterator>

#include "mbs/box_kernel.h"
#include "mbs/model.h"

namespace topple::mbs {

struct Hull;

/// A contact shape in W.
struct Solid {
  Shape::Kind kind = Shape::Kind::Box;
  Vec3 p;     // origin of its frame: centre of a box or sphere, on the surface of a plane
  Mat3 R;     // axes of its frame
  Vec3 half;  // half edges [m]
  double radius = 0;
  double reach = 0;            // radius of the sphere around p that holds it [m]
  const Hull* hull = nullptr;  // of a polyhedron, and of boxes in models that have polyhedra
};

/// Touching points of two solids, all with the same normal; of two boxes at most eight.
struct BoxContact {
  static constexpr int kMostPoints = 32;
  int count = 0;
  Vec3 normal;                // unit, from the first to the second
  Vec3 p[kMostPoints];        // in W, halfway between the surfaces [m]
  double depth[kMostPoints];  // > 0 [m]
  /// Share of each point in the stiffness: half of the length of the edges that meet there over that of all edges of
  /// the polygon in which the faces overlap, times 4, so that a corner of a box has 1 and no point is lost or won by a
  /// jump.
  double weight[kMostPoints];
  double gap = 0;  // without points: the solids are at least this far apart [m]
};

/// Finds the touching points of two overlapping solids; none when they are apart. `axis` remembers the axis that
/// separated two polyhedra at the last call and only saves time.
void find_contact(const Solid& a, const Solid& b, int& axis, BoxContact& out);

/// A box for the kernel of boxes, kernel::kBoxFields numbers.
inline void write_box(const Solid& box, double* row) {
  const Mat3& R = box.R;
  const double fields[] = {box.p.x, box.p.y, box.p.z, R(0, 0), R(1, 0),    R(2, 0),    R(0, 1),    R(1, 1),
                           R(2, 1), R(0, 2), R(1, 2), R(2, 2), box.half.x, box.half.y, box.half.z, box.reach};
  static_assert(std::size(fields) == kernel::kBoxFields);
  std::copy(std::begin(fields), std::end(fields), row);
}
/// What it found, in a slot of blocks of W lanes.
void read_box_contact(const double* slot, size_t W, BoxContact& out);

}  // namespace topple::mbs
