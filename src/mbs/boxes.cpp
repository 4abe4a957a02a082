#include "mbs/boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "mbs/polyhedra.h"

namespace topple::mbs {

namespace {

/// Overlaps of two boxes along the fifteen axes that can separate them: 0-2 faces of a, 3-5 faces of b, 6-14 products
/// of edges (Gottschalk, Lin and Manocha 1996). Negative when apart; infinite along a product of parallel edges.
class Overlaps {
 public:
  Overlaps(const Solid& a, const Solid& b) : a_(a.half), b_(b.half) {
    const Vec3 d = b.p - a.p;
    for (int i = 0; i < 3; ++i) {
      const Vec3 ai = a.R.column(i);
      t_[i] = dot(ai, d);
      for (int j = 0; j < 3; ++j) {
        c_[i][j] = dot(ai, b.R.column(j));
        m_[i][j] = std::abs(c_[i][j]);
      }
    }
  }
  /// Length of the product of edges whose overlap, when there is none, is not scaled by it; of faces 1.
  double length(int axis) const {
    if (axis < 6) return 1;
    const double c = c_[(axis - 6) / 3][(axis - 6) % 3];
    return std::sqrt(1 - c * c);
  }
  double operator()(int axis) const {
    if (axis < 3) return a_[axis] + b_.x * m_[axis][0] + b_.y * m_[axis][1] + b_.z * m_[axis][2] - std::abs(t_[axis]);
    if (axis < 6) {
      const int j = axis - 3;
      return b_[j] + a_.x * m_[0][j] + a_.y * m_[1][j] + a_.z * m_[2][j] - std::abs(along_b(j));
    }
    const int i = (axis - 6) / 3, j = (axis - 6) % 3;
    const double length2 = 1 - c_[i][j] * c_[i][j];
    if (length2 < 1e-12) return std::numeric_limits<double>::infinity();
    const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
    const double reach = a_[i1] * m_[i2][j] + a_[i2] * m_[i1][j] + b_[j1] * m_[i][j2] + b_[j2] * m_[i][j1];
    const double overlap = reach - std::abs(t_[i2] * c_[i1][j] - t_[i1] * c_[i2][j]);
    // only a penetration needs its true length
    return overlap <= 0 ? overlap : overlap / std::sqrt(length2);
  }

 private:
  double along_b(int j) const { return t_.x * c_[0][j] + t_.y * c_[1][j] + t_.z * c_[2][j]; }
  Vec3 a_, b_, t_;
  double c_[3][3], m_[3][3];
};

/// Unit vector of an axis.
Vec3 axis_of(const Solid& a, const Solid& b, int i) {
  if (i < 3) return a.R.column(i);
  if (i < 6) return b.R.column(i - 3);
  const Vec3 n = cross(a.R.column((i - 6) / 3), b.R.column((i - 6) % 3));
  return (1 / norm(n)) * n;
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

/// Number of the face pair of a box that looks most along n.
int find_side(const Solid& box, const Vec3& n, double& along) {
  int side = 0;
  along = 0;
  for (int i = 0; i < 3; ++i) {
    const double d = dot(box.R.column(i), n);
    if (std::abs(d) > std::abs(along)) along = d, side = i;
  }
  return side;
}

/// The corners of the area, seen along n, in which the faces of both boxes that look at each other overlap.
void overlap_points(const Solid& a, const Solid& b, const Vec3& n, BoxContact& out) {
  double along_a, along_b;
  const int side_a = find_side(a, n, along_a), side_b = find_side(b, n, along_b);
  const Vec3 n_a = std::copysign(1.0, along_a) * a.R.column(side_a);
  const Vec3 p_a = a.p + a.half[side_a] * n_a;
  const Vec3 p_b = b.p - std::copysign(b.half[side_b], along_b) * b.R.column(side_b);
  const int u = (side_b + 1) % 3, v = (side_b + 2) % 3;
  const Vec3 du = b.half[u] * b.R.column(u), dv = b.half[v] * b.R.column(v);
  Vec3 polygon[16] = {p_b + du + dv, p_b - du + dv, p_b - du - dv, p_b + du - dv}, cut[16];
  int count = 4;
  for (int k = 1; k <= 2; ++k) {
    const int along = (side_a + k) % 3, across = (side_a + 3 - k) % 3;
    const Vec3 t = cross(n, a.R.column(along));
    const double at = dot(t, p_a), half = std::abs(a.half[across] * dot(t, a.R.column(across)));
    count = clip(polygon, count, t, at + half, cut);
    count = clip(cut, count, -t, -at + half, polygon);
  }
  double length[8], perimeter = 0;  // of the edges that begin at each corner
  for (int i = 0; i < count; ++i) perimeter += length[i] = norm(cross(n, polygon[(i + 1) % count] - polygon[i]));
  out.normal = n;
  for (int i = 0; i < count; ++i) {
    const double depth = dot(n_a, p_a - polygon[i]) / std::abs(along_a);
    if (depth <= 0) continue;
    out.p[out.count] = polygon[i] + (0.5 * depth) * n;
    out.weight[out.count] = perimeter > 0 ? 2 * (length[(i + count - 1) % count] + length[i]) / perimeter : 1;
    out.depth[out.count++] = depth;
  }
}

constexpr double kSameDirection = 0.97;  // cosine; 14 degrees

/// Gap along the face that separated two boxes last time, negative if it does no more or was no face.
double find_face_gap(const Solid& a, const Solid& b, int axis) {
  if (axis >= 6) return -1;
  const bool of_a = axis < 3;
  const Solid &own = of_a ? a : b, &other = of_a ? b : a;
  const int i = of_a ? axis : axis - 3;
  const Vec3 n = own.R.column(i);
  const double reach = std::abs(dot(other.R.column(0), n)) * other.half.x +
                       std::abs(dot(other.R.column(1), n)) * other.half.y +
                       std::abs(dot(other.R.column(2), n)) * other.half.z;
  return std::abs(dot(b.p - a.p, n)) - own.half[i] - reach;
}

void box_box(const Solid& a, const Solid& b, int& axis, BoxContact& out) {
  if (const double gap = find_face_gap(a, b, axis); gap >= 0) {
    out.gap = gap;
    return;
  }
  const Overlaps overlap_along(a, b);
  if (axis >= 6) {
    if (const double overlap = overlap_along(axis); overlap <= 0) {
      out.gap = -overlap / overlap_along.length(axis);
      return;
    }
  }
  double overlaps[15], least = std::numeric_limits<double>::infinity();
  int best = -1;
  for (int i = 0; i < 15; ++i) {
    const double overlap = overlaps[i] = overlap_along(i);
    if (overlap <= 0) {
      axis = i;
      out.gap = -overlap / overlap_along.length(i);
      return;
    }
    // faces are preferred to edges, and the first to the second, unless clearly deeper: the choice stays steady
    if (overlap < (i < 3 ? 1.0 : i < 6 ? 0.98 : 0.95) * least - (i < 3 ? 0 : 1e-9)) {
      least = overlap;
      best = i;
    }
  }
  if (best < 0) return;
  Vec3 normal = axis_of(a, b, best);
  if (dot(normal, b.p - a.p) < 0) normal = -normal;
  overlap_points(a, b, normal, out);
  axis = best;
  if (best >= 6) return;
  // axes near the normal find the same points
  double other = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 15; ++i)
    if (overlaps[i] < other && std::abs(dot(axis_of(a, b, i), normal)) < kSameDirection) other = overlaps[i];
  out.spare = std::max(0.0, 0.5 * (other - least));
}

void sphere_box(const Solid& sphere, const Solid& box, bool flipped, BoxContact& out) {
  const Vec3 local = transpose_times(box.R, sphere.p - box.p);
  Vec3 nearest = local;
  bool inside = true;
  for (int k = 0; k < 3; ++k) {
    nearest[k] = std::clamp(local[k], -box.half[k], box.half[k]);
    inside = inside && nearest[k] == local[k];
  }
  Vec3 n;  // from the sphere to the box, in the box's axes
  double depth;
  if (inside) {
    int k = 0;
    for (int i = 1; i < 3; ++i)
      if (box.half[i] - std::abs(local[i]) < box.half[k] - std::abs(local[k])) k = i;
    n[k] = local[k] >= 0 ? -1 : 1;
    depth = box.half[k] - std::abs(local[k]) + sphere.radius;
    nearest[k] = std::copysign(box.half[k], local[k]);
  } else {
    const Vec3 d = nearest - local;
    const double distance = norm(d);
    depth = sphere.radius - distance;
    if (depth <= 0) {
      out.gap = -depth;
      return;
    }
    n = (1 / distance) * d;
  }
  const Vec3 n_W = box.R * n;
  out.normal = flipped ? -n_W : n_W;
  out.p[0] = box.p + box.R * nearest;
  out.depth[0] = depth;
  out.weight[0] = 1;
  out.count = 1;
}

}  // namespace

bool find_contact_along(const Solid& a, const Solid& b, int axis, BoxContact& out) {
  out.count = 0;
  if (a.kind != Shape::Kind::Box || b.kind != Shape::Kind::Box || axis >= 6) return false;
  Vec3 normal = axis_of(a, b, axis);
  if (dot(normal, b.p - a.p) < 0) normal = -normal;
  overlap_points(a, b, normal, out);
  return out.count > 0;
}

void find_contact(const Solid& a, const Solid& b, int& axis, BoxContact& out) {
  out.count = 0;
  out.gap = out.spare = 0;
  const auto is = [](const Solid& s, Shape::Kind kind) { return s.kind == kind; };
  if (is(a, Shape::Kind::Plane)) return plane_solid(a, b, false, out);
  if (is(b, Shape::Kind::Plane)) return plane_solid(b, a, true, out);
  if (is(a, Shape::Kind::Hull) || is(b, Shape::Kind::Hull)) {
    if (is(a, Shape::Kind::Sphere)) return sphere_hull(a, b, false, out);
    if (is(b, Shape::Kind::Sphere)) return sphere_hull(b, a, true, out);
    return hull_hull(a, b, axis, out);
  }
  const bool box_a = is(a, Shape::Kind::Box), box_b = is(b, Shape::Kind::Box);
  if (box_a && box_b) return box_box(a, b, axis, out);
  if (box_b) return sphere_box(a, b, false, out);
  if (box_a) return sphere_box(b, a, true, out);
  const Vec3 d = b.p - a.p;
  const double distance = norm(d), depth = a.radius + b.radius - distance;
  if (depth <= 0) {
    out.gap = -depth;
    return;
  }
  out.normal = distance > 0 ? (1 / distance) * d : Vec3{0, 0, 1};
  out.p[0] = a.p + (a.radius - 0.5 * depth) * out.normal;
  out.depth[0] = depth;
  out.weight[0] = 1;
  out.count = 1;
}

}  // namespace topple::mbs
