#pragma once
/// Bodies of an IFC file and their cuts along planes.

#include <vector>

#include "base/linalg.h"

namespace topple::product {

using Loop = std::vector<Vec3>;

/// Whether a place lies within a loop that is seen along z.
bool lies_within(const Loop&, double x, double y);

/// Normal of a flat loop, as long as twice its area.
Vec3 calc_normal(const Loop& loop);

/// An extruded profile. Points in world axes [m].
struct Solid {
  std::vector<Loop> loops;  // its outline and its holes, at the foot
  Vec3 way;                 // from foot to head

  double volume() const;
  /// Normals of all its faces but those of holes, as long as twice their areas.
  std::vector<Vec3> faces() const;
};

/// Solids, and faces of meshes that are closed together.
struct Shape {
  std::vector<Solid> solids;
  std::vector<Loop> faces;  // counterclockwise seen from outside; a face may be made of several, as signed areas
};

/// What lies on the side of its normal is cut off.
struct CutPlane {
  Vec3 p, normal;  // [m]; of length 1
};

/// What is left of a loop; of bent-in ones the parts hang together along the plane.
Loop clip(const Loop&, const CutPlane&);

/// Cuts along the plane: what stays a prism stays a solid, the rest become meshes. Whether anything was cut off.
bool clip(Shape&, const CutPlane&);

}  // namespace topple::product
