#pragma once
/// Touching points of convex polyhedra, of planes, and of both with spheres.

#include "mbs/boxes.h"
#include "mbs/hull.h"

namespace topple::mbs {

/// Two polyhedra (Solid::hull set). `axis` remembers what separated them last time: a face of the first, of the second,
/// or a pair of edges, counted in this order; it only saves time.
void hull_hull(const Solid& a, const Solid& b, int& axis, BoxContact& out);
/// A sphere and a polyhedron; `flipped`: the polyhedron is the first of the two.
void sphere_hull(const Solid& sphere, const Solid& hull, bool flipped, BoxContact& out);
/// A half-space z <= 0 of its frame and a box, sphere or polyhedron; `flipped`: the plane is the second of the two.
void plane_solid(const Solid& plane, const Solid& other, bool flipped, BoxContact& out);

}  // namespace topple::mbs
