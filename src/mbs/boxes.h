#pragma once
/// Where two convex solids touch.

#include "mbs/box_kernel.h"
#include "mbs/model.h"

namespace topple::mbs {

struct Hull;

/// Of a box, in its frame; corner 0 to 7, a bit for each axis [m].
inline Vec3 corner_of(const Vec3& half, int corner) {
  return {corner & 1 ? half.x : -half.x, corner & 2 ? half.y : -half.y, corner & 4 ? half.z : -half.z};
}

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
  Vec3 normal;  // unit, from the first to the second
  // in W: halfway between the surfaces of two boxes, polyhedra or spheres, else on the surface of the sphere, or of
  // what lies on a plane [m]
  Vec3 p[kMostPoints];
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

/// A box for the kernel of boxes, kernel::kBoxFields numbers: centre, axes, half edges and the sphere that holds it.
inline void write_box(const Vec3& p, const Mat3& R, const Vec3& half, double reach, double* row) {
  for (int i = 0; i < 3; ++i) {
    row[kernel::kBoxPlace + i] = p[i], row[kernel::kBoxHalf + i] = half[i];
    for (int j = 0; j < 3; ++j) row[kernel::kBoxAxes + 3 * j + i] = R(i, j);
  }
  row[kernel::kBoxReach] = reach;
}
inline void write_box(const Solid& box, double* row) { write_box(box.p, box.R, box.half, box.reach, row); }
/// What it found, in a slot of blocks of W lanes.
void read_box_contact(const double* slot, size_t W, BoxContact& out);

}  // namespace topple::mbs
