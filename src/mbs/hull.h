#pragma once
/// Convex polyhedra as contact shapes.

#include <array>
#include <vector>

#include "base/linalg.h"

namespace topple::mbs {

/// A convex polyhedron in the frame S of its shape.
struct Hull {
  struct Face {
    Vec3 normal;            // outward, unit
    double offset = 0;      // dot(normal, p) on the face [m]
    std::vector<int> loop;  // vertices, counter-clockwise seen from outside
  };
  std::vector<Vec3> vertices;   // [m]
  std::vector<double> weights;  // share of each vertex in the stiffness on a plane: of its faces the least, as of a box
  std::vector<Face> faces;
  std::vector<std::array<int, 2>> edges;  // vertices
  std::vector<Vec3> directions;           // of the edges, unit, parallel ones once
  std::vector<int> direction_of;          // of each edge
  double reach = 0;                       // largest distance of a vertex from the origin of S [m]
  double thickness = 0;                   // least width between a face and the vertex farthest behind it [m]
};

/// Most corners of one face in a model: looking for contact takes longer with the square of them.
inline constexpr int kMostFaceCorners = 64;

/// The convex hull of points; coplanar triangles are one face. Throws InputError if they lie in a plane or are fewer
/// than four.
Hull make_hull(const std::vector<Vec3>& points);
Hull make_box_hull(const Vec3& half);

}  // namespace topple::mbs
