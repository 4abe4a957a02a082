#include "mbs/polyhedra.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace topple::mbs {

namespace {

constexpr int kFewCorners = 64;  // of two faces' overlap, for which no memory is asked for
constexpr int kMostPoints = BoxContact::kMostPoints;

/// Largest dot(n, vertex) of a polyhedron about its own centre; n in W.
double find_support(const Solid& s, const Vec3& n) {
  const Vec3 local = transpose_times(s.R, n);
  double most = -std::numeric_limits<double>::infinity();
  for (const Vec3& v : s.hull->vertices) most = std::max(most, dot(local, v));
  return most;
}

/// A direction along which two polyhedra may be apart.
struct Axis {
  Vec3 n;          // unit, from the first to the second
  double overlap;  // negative when apart [m]
  int number;
};

/// Overlap along the normal of a face of `own`; `sign` -1 if own is the second solid.
Axis look_along_face(const Solid& own, const Solid& other, size_t face, double sign, int number) {
  const Hull::Face& f = own.hull->faces[face];
  const Vec3 n = own.R * f.normal;
  const double overlap = f.offset + find_support(other, -n) - dot(n, other.p - own.p);
  return {sign * n, overlap, number};
}

/// Overlap along the product of two edges' directions; infinite where they are parallel.
Axis look_along_edges(const Solid& a, const Solid& b, size_t i, size_t j, int number) {
  const Vec3 product = cross(a.R * a.hull->directions[i], b.R * b.hull->directions[j]);
  const double length = norm(product);
  if (length < 1e-6) return {{}, std::numeric_limits<double>::infinity(), number};
  const Vec3 n = (1 / length) * product, d = b.p - a.p;
  const double one = find_support(a, n) + find_support(b, -n) - dot(n, d);
  const double two = find_support(a, -n) + find_support(b, n) + dot(n, d);
  return one <= two ? Axis{n, one, number} : Axis{-n, two, number};
}

/// Cuts a polygon by the half-space dot(n, p) <= offset.
int clip(const Vec3* in, int count, const Vec3& n, double offset, Vec3* out) {
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const Vec3 &p = in[i], &q = in[(i + 1) % count];
    const double dp = dot(n, p) - offset, dq = dot(n, q) - offset;
    if (dp <= 0) out[kept++] = p;
    if ((dp < 0 && dq > 0) || (dp > 0 && dq < 0)) out[kept++] = p + (dp / (dp - dq)) * (q - p);
  }
  return kept;
}

/// Of the faces with most of the outermost corners along n (in W), both of an edge that lies across it, the one that
/// looks most along n: another face may look more along it and lie further in.
const Hull::Face& find_face(const Solid& s, const Vec3& n) {
  const Vec3 local = transpose_times(s.R, n);
  const Hull& h = *s.hull;
  double outermost = -std::numeric_limits<double>::infinity();
  for (const Vec3& v : h.vertices) outermost = std::max(outermost, dot(v, local));
  outermost -= 1e-9 * h.reach;
  const Hull::Face* best = nullptr;
  int most = 0;
  for (const Hull::Face& f : h.faces) {
    int corners = 0;
    for (const int i : f.loop) corners += dot(h.vertices[static_cast<size_t>(i)], local) >= outermost ? 1 : 0;
    const bool is_better =
        best == nullptr || corners > most || (corners == most && dot(f.normal, local) > dot(best->normal, local));
    if (is_better) best = &f, most = corners;
  }
  return *best;
}

/// The corners of the area, seen along n, in which the faces of both solids that look at each other overlap; those with
/// the shortest edges go first where there are too many.
void overlap_points(const Solid& a, const Solid& b, const Vec3& n, BoxContact& out) {
  const Hull::Face &face_a = find_face(a, n), &face_b = find_face(b, -n);
  const Vec3 n_a = a.R * face_a.normal;
  const double along = dot(n_a, n);
  if (along < 1e-6) return;
  const size_t most = face_a.loop.size() + face_b.loop.size();
  Vec3 few[2 * kFewCorners];
  double few_lengths[kFewCorners];
  std::vector<Vec3> many;
  std::vector<double> many_lengths;
  if (most > kFewCorners) {
    many.resize(2 * most);
    many_lengths.resize(most);
  }
  Vec3* const polygon = most > kFewCorners ? many.data() : few;
  Vec3* const cut = polygon + (most > kFewCorners ? most : kFewCorners);
  double* const length =
      most > kFewCorners ? many_lengths.data() : few_lengths;  // of the edges that begin at each corner
  int count = 0;
  for (const int i : face_b.loop) polygon[count++] = b.p + b.R * b.hull->vertices[static_cast<size_t>(i)];
  const int corners = static_cast<int>(face_a.loop.size());
  for (int i = 0; i < corners && count > 0; ++i) {
    const Vec3 p = a.p + a.R * a.hull->vertices[static_cast<size_t>(face_a.loop[static_cast<size_t>(i)])];
    const Vec3 q =
        a.p + a.R * a.hull->vertices[static_cast<size_t>(face_a.loop[static_cast<size_t>((i + 1) % corners)])];
    const Vec3 outward = cross(q - p, n);
    count = clip(polygon, count, outward, dot(outward, p), cut);
    std::copy(cut, cut + count, polygon);
  }
  const auto measure = [&](int i) { length[i] = norm(cross(n, polygon[(i + 1) % count] - polygon[i])); };
  for (int i = 0; i < count; ++i) measure(i);
  while (count > kMostPoints) {
    int least = 0;
    for (int i = 1; i < count; ++i)
      if (length[i] + length[(i + count - 1) % count] < length[least] + length[(least + count - 1) % count]) least = i;
    std::copy(polygon + least + 1, polygon + count, polygon + least);
    std::copy(length + least + 1, length + count, length + least);
    --count;
    measure((least + count - 1) % count);
  }
  double perimeter = 0;
  for (int i = 0; i < count; ++i) perimeter += length[i];
  const double surface = face_a.offset + dot(n_a, a.p);
  for (int i = 0; i < count; ++i) {
    const double depth = (surface - dot(n_a, polygon[i])) / along;
    if (depth <= 0) continue;
    out.p[out.count] = polygon[i] + (0.5 * depth) * n;
    out.weight[out.count] = perimeter > 0 ? 2 * (length[(i + count - 1) % count] + length[i]) / perimeter : 1;
    out.depth[out.count++] = depth;
  }
}

}  // namespace

void hull_hull(const Solid& a, const Solid& b, int& remembered, BoxContact& out) {
  out.count = 0;
  out.gap = 0;
  const size_t faces_a = a.hull->faces.size(), faces_b = b.hull->faces.size(), edges_b = b.hull->directions.size();
  const size_t edges = a.hull->directions.size() * edges_b;
  const size_t axes = faces_a + faces_b + edges;
  const auto look = [&](size_t i) {
    const int number = static_cast<int>(i);
    if (i < faces_a) return look_along_face(a, b, i, 1, number);
    if (i < faces_a + faces_b) return look_along_face(b, a, i - faces_a, -1, number);
    const size_t e = i - faces_a - faces_b;
    return look_along_edges(a, b, e / edges_b, e % edges_b, number);
  };
  const auto is_apart = [&](const Axis& axis) {
    if (axis.overlap > 0) return false;
    remembered = axis.number;
    out.gap = -axis.overlap;
    return true;
  };
  if (remembered >= 0 && static_cast<size_t>(remembered) < axes && is_apart(look(static_cast<size_t>(remembered))))
    return;
  const Axis none{{}, std::numeric_limits<double>::infinity(), -1};
  Axis least_of[3] = {none, none, none};  // faces of a, of b, pairs of edges
  for (size_t i = 0; i < axes; ++i) {
    const Axis axis = look(i);
    if (is_apart(axis)) return;
    Axis& least = least_of[i < faces_a ? 0 : i < faces_a + faces_b ? 1 : 2];
    if (axis.overlap < least.overlap) least = axis;
  }
  // faces are preferred to edges, and those of the first, unless clearly deeper: the choice stays steady
  Axis best = least_of[0], least = best;
  for (const int i : {1, 2}) {
    const Axis& other = least_of[i];
    if (other.overlap < (i == 1 ? 0.98 : 0.95) * best.overlap - 1e-9) best = other;
    if (other.overlap < least.overlap) least = other;
  }
  if (best.number < 0) return;
  out.normal = best.n;
  // edges that cross are corners of the overlap of the faces beside them
  overlap_points(a, b, best.n, out);
  if (out.count > 0 || least.number == best.number) return;
  // along an axis that is not the least one the outermost corner may lie beside the face
  out.normal = least.n;
  overlap_points(a, b, least.n, out);
}

void sphere_hull(const Solid& sphere, const Solid& solid, bool flipped, BoxContact& out) {
  out.count = 0;
  out.gap = 0;
  const Hull& hull = *solid.hull;
  const Vec3 c = transpose_times(solid.R, sphere.p - solid.p);
  const Hull::Face* outermost = nullptr;
  double height = -std::numeric_limits<double>::infinity();
  for (const Hull::Face& f : hull.faces)
    if (const double s = dot(f.normal, c) - f.offset; s > height) height = s, outermost = &f;
  if (height >= sphere.radius) {
    out.gap = height - sphere.radius;
    return;
  }
  Vec3 nearest = c - height * outermost->normal, n = outermost->normal;  // n from the hull to the sphere
  double distance = height;
  if (height > 0) {
    // nearest point of the surface: inside a face seen from outside, or on an edge
    double least = std::numeric_limits<double>::infinity();
    const auto take = [&](const Vec3& p) {
      if (const double d = norm(c - p); d < least) least = d, nearest = p;
    };
    for (const Hull::Face& f : hull.faces) {
      const double s = dot(f.normal, c) - f.offset;
      if (s <= 0) continue;
      const Vec3 p = c - s * f.normal;
      bool inside = true;
      for (size_t i = 0; i < f.loop.size(); ++i) {
        const Vec3 &v = hull.vertices[static_cast<size_t>(f.loop[i])],
                   &w = hull.vertices[static_cast<size_t>(f.loop[(i + 1) % f.loop.size()])];
        if (dot(cross(w - v, f.normal), p - v) <= 0) continue;
        inside = false;
        take(v + std::clamp(dot(p - v, w - v) / dot(w - v, w - v), 0.0, 1.0) * (w - v));
      }
      if (inside) take(p);
    }
    distance = least;
    if (distance >= sphere.radius) {
      out.gap = distance - sphere.radius;
      return;
    }
    n = (1 / distance) * (c - nearest);
  }
  const Vec3 n_W = solid.R * n;
  out.normal = flipped ? n_W : -n_W;
  out.depth[0] = sphere.radius - distance;
  out.p[0] = sphere.p - sphere.radius * n_W;
  out.weight[0] = 1;
  out.count = 1;
}

void plane_solid(const Solid& plane, const Solid& other, bool flipped, BoxContact& out) {
  out.count = 0;
  const Vec3 n = plane.R.column(2);
  out.normal = flipped ? -n : n;
  double lowest = std::numeric_limits<double>::infinity(), all = 0;
  size_t below = 0;
  const auto take = [&](const Vec3& p, double weight) {
    const double height = dot(n, p - plane.p);
    lowest = std::min(lowest, height);
    if (height >= 0) return;
    ++below, all += weight;
    if (out.count == kMostPoints) return;
    const int at = out.count++;
    out.p[at] = p;
    out.depth[at] = -height;
    out.weight[at] = weight;
  };
  if (other.kind == Shape::Kind::Sphere) {
    take(other.p - other.radius * n, 1);
  } else if (other.kind == Shape::Kind::Box) {
    for (int i = 0; i < 8; ++i) take(other.p + other.R * corner_of(other.half, i), 1);
  } else {
    const Hull& hull = *other.hull;
    const auto place = [&](size_t i) { return other.p + other.R * hull.vertices[i]; };
    for (size_t i = 0; i < hull.vertices.size(); ++i) take(place(i), hull.weights[i]);
    if (const size_t most = kMostPoints, count = below; count > most) {
      // spread over all of them, with the weight of those left out
      const double whole = all;
      size_t seen = 0;
      out.count = 0, all = 0;
      for (size_t i = 0; i < hull.vertices.size(); ++i) {
        const Vec3 p = place(i);
        if (!(dot(n, p - plane.p) < 0)) continue;
        const size_t before = seen * most / count, after = ++seen * most / count;
        if (after > before) take(p, hull.weights[i]);
      }
      for (int i = 0; i < out.count; ++i) out.weight[i] *= whole / all;
    }
  }
  out.gap = std::max(0.0, lowest);
}

}  // namespace topple::mbs
