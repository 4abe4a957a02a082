#include "mbs/boxes.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "base/aligned.h"
#include "mbs/box_kernel.h"
#include "mbs/polyhedra.h"

namespace topple::mbs {

namespace {

void box_box(const Solid& a, const Solid& b, BoxContact& out) {
  const size_t W = kernel::lanes();
  alignas(kCacheLine) double boxes[2 * kernel::kBoxFields], answers[kernel::kBoxAnswerFields * kernel::kMostLanes];
  constexpr std::uint32_t first[kernel::kMostLanes] = {}, second[kernel::kMostLanes] = {1, 1, 1, 1, 1, 1, 1, 1};
  static_assert(kernel::kMostLanes == 8);
  write_box(a, boxes);
  write_box(b, boxes + kernel::kBoxFields);
  kernel::find_box_contacts({1, boxes, first, second, answers});
  read_box_contact(answers, W, out);
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
  out.p[0] = sphere.p + sphere.radius * n_W;
  out.depth[0] = depth;
  out.weight[0] = 1;
  out.count = 1;
}

}  // namespace

void read_box_contact(const double* slot, size_t W, BoxContact& out) {
  const auto field = [&](int f) { return slot[static_cast<size_t>(f) * W]; };
  out.count = 0;
  out.gap = field(kernel::kGap);
  if (out.gap >= 0) return;
  out.gap = 0;
  out.normal = {field(kernel::kBoxNormal), field(kernel::kBoxNormal + 1), field(kernel::kBoxNormal + 2)};
  for (unsigned places = static_cast<unsigned>(field(kernel::kBoxPlaces)); places != 0; places &= places - 1) {
    const int at = kernel::kBoxPoints + std::countr_zero(places) * kernel::kBoxPointFields;
    out.p[out.count] = {field(at), field(at + 1), field(at + 2)};
    out.depth[out.count] = field(at + 3);
    out.weight[out.count++] = field(at + 4);
  }
}

void find_contact(const Solid& a, const Solid& b, int& axis, BoxContact& out) {
  out.count = 0;
  out.gap = 0;
  const auto is = [](const Solid& s, Shape::Kind kind) { return s.kind == kind; };
  if (is(a, Shape::Kind::Plane)) return plane_solid(a, b, false, out);
  if (is(b, Shape::Kind::Plane)) return plane_solid(b, a, true, out);
  if (is(a, Shape::Kind::Hull) || is(b, Shape::Kind::Hull)) {
    if (is(a, Shape::Kind::Sphere)) return sphere_hull(a, b, false, out);
    if (is(b, Shape::Kind::Sphere)) return sphere_hull(b, a, true, out);
    return hull_hull(a, b, axis, out);
  }
  const bool box_a = is(a, Shape::Kind::Box), box_b = is(b, Shape::Kind::Box);
  if (box_a && box_b) return box_box(a, b, out);
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
