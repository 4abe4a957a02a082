// Compiled once for each instruction set (Highway's foreach_target).
#include "mbs/box_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mbs/box_kernel.cpp"
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

#include "mbs/lane_math.inc"

HWY_BEFORE_NAMESPACE();
namespace topple::mbs::kernel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr double kParallel = 1e-12;  // square of the sine below which edges count as parallel
constexpr double kAlong = 1e30;      // one over a difference that counts as none
constexpr double kWider = 1 + 1e-12, kNarrower = 1 - 1e-12;

template <class D>
using Mask = hn::Mask<D>;

template <class D>
HWY_INLINE Num<D> root(Num<D> a) {
  return {hn::Sqrt(a.v)};
}
template <class D>
HWY_INLINE Num<D> sign_of(Num<D> a) {
  return {hn::CopySign(hn::Set(D(), 1.0), a.v)};
}
template <class D>
HWY_INLINE V3<D> select(Mask<D> mask, const V3<D>& yes, const V3<D>& no) {
  return {select(mask, yes.x, no.x), select(mask, yes.y, no.y), select(mask, yes.z, no.z)};
}

/// Three things of which each lane takes its own, and those after it in turn.
template <class D>
struct Turn {
  Mask<D> first, second;  // the third otherwise

  HWY_INLINE explicit Turn(Num<D> x, Num<D> y, Num<D> z) {
    // the largest, the first of equal ones
    first = hn::And(hn::Ge(x.v, y.v), hn::Ge(x.v, z.v));
    second = hn::AndNot(first, hn::Ge(y.v, z.v));
  }
  template <class T>
  HWY_INLINE T operator()(const T& a, const T& b, const T& c) const {
    return select(first, a, select(second, b, c));
  }
  HWY_INLINE V3<D> operator()(const V3<D>& v) const {
    return {(*this)(v.x, v.y, v.z), (*this)(v.y, v.z, v.x), (*this)(v.z, v.x, v.y)};
  }
};

/// Part of the edge P + t D, 0 <= t <= 1, with |x| <= half_x and |y| <= half_y.
template <class D>
struct Part {
  Num<D> begin, end, length;       // length: the part of the edge that is left, 0 or more
  Mask<D> begins_at_x, ends_at_x;  // which limit decides
  Mask<D> is_left;
};
/// Where an edge comes in over the limits -half and half of a coordinate, and where it goes out. An edge along them is
/// in as a whole or not at all.
template <class D>
HWY_INLINE void cross_limits(Num<D> p, Num<D> per_step, Num<D> half, Num<D>& in, Num<D>& out) {
  const D d;
  const Num<D> zero = num<D>(0), two = num<D>(2), before = num<D>(-1);
  const Num<D> a = (zero - half - p) * per_step, b = (half - p) * per_step;
  const auto along = hn::Ge(hn::Abs(per_step.v), hn::Set(d, kAlong)), within = hn::Le(hn::Abs(p.v), half.v);
  in = select(along, select(within, before, two), minimum(a, b));
  out = select(along, select(within, two, before), maximum(a, b));
}

template <class D>
HWY_INLINE Part<D> cut(Num<D> px, Num<D> py, Num<D> per_x, Num<D> per_y, Num<D> half_x, Num<D> half_y) {
  const Num<D> zero = num<D>(0), one = num<D>(1);
  Num<D> in_x, out_x, in_y, out_y;
  cross_limits(px, per_x, half_x, in_x, out_x);
  cross_limits(py, per_y, half_y, in_y, out_y);
  Part<D> out;
  out.begins_at_x = hn::Ge(in_x.v, in_y.v);
  out.ends_at_x = hn::Le(out_x.v, out_y.v);
  out.begin = maximum(maximum(in_x, in_y), zero);
  out.end = minimum(minimum(out_x, out_y), one);
  out.is_left = hn::Gt(out.end.v, out.begin.v);
  out.length = select(out.is_left, out.end - out.begin, zero);
  return out;
}

/// One over a difference, large where it vanishes.
template <class D>
HWY_INLINE Num<D> inverse(Num<D> x) {
  const D d;
  const auto tiny = hn::Lt(hn::Abs(x.v), hn::Set(d, 1 / kAlong));
  return num<D>(1) / select(tiny, Num<D>{hn::CopySign(hn::Set(d, 1 / kAlong), x.v)}, x);
}

template <class D>
HWY_INLINE void find_block(const BoxJob& job, size_t block) {
  using N = Num<D>;
  using V = V3<D>;
  const D d;
  const size_t W = hn::Lanes(d);
  N A[kBoxFields], B[kBoxFields];
  read_rows<D, kBoxFields>(job.boxes, job.a + block * W, A);
  read_rows<D, kBoxFields>(job.boxes, job.b + block * W, B);
  const auto three = [](const N* box, int field) -> V { return {box[field], box[field + 1], box[field + 2]}; };
  double* out = job.answers + block * kBoxAnswerFields * W;
  const N zero = num<D>(0), one = num<D>(1), half = num<D>(0.5);
  const V place_a = three(A, kBoxPlace), apart = three(B, kBoxPlace) - place_a;
  const V axes_a[3] = {three(A, kBoxAxes), three(A, kBoxAxes + 3), three(A, kBoxAxes + 6)};
  const V ha = three(A, kBoxHalf), hb = three(B, kBoxHalf);
  const N a[3] = {ha.x, ha.y, ha.z}, b[3] = {hb.x, hb.y, hb.z};
  // b's axes and place in a's
  V axes_b[3];
  for (int j = 0; j < 3; ++j) {
    const V x = three(B, kBoxAxes + 3 * j);
    axes_b[j] = {dot(axes_a[0], x), dot(axes_a[1], x), dot(axes_a[2], x)};
  }
  const V place_b{dot(axes_a[0], apart), dot(axes_a[1], apart), dot(axes_a[2], apart)};
  const N t[3] = {place_b.x, place_b.y, place_b.z};
  const N c[3][3] = {{axes_b[0].x, axes_b[1].x, axes_b[2].x},
                     {axes_b[0].y, axes_b[1].y, axes_b[2].y},
                     {axes_b[0].z, axes_b[1].z, axes_b[2].z}};
  N m[3][3];
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) m[i][j] = abs(c[i][j]);

  // the sphere around both, then the axes that can separate them (Gottschalk, Lin and Manocha 1996)
  N gap = root(dot(apart, apart)) - (A[kBoxReach] + B[kBoxReach]);
  N least = num<D>(1e300);
  V normal{zero, zero, zero};
  for (int i = 0; i < 3; ++i) {
    const N overlap = fma(b[2], m[i][2], fma(b[1], m[i][1], fma(b[0], m[i][0], a[i]))) - abs(t[i]);
    gap = maximum(gap, zero - overlap);
    const auto less = hn::Lt(overlap.v, least.v);
    least = select(less, overlap, least);
    const V n{i == 0 ? sign_of(t[0]) : zero, i == 1 ? sign_of(t[1]) : zero, i == 2 ? sign_of(t[2]) : zero};
    normal = select(less, n, normal);
  }
  // faces are preferred to edges, and the first to the second, unless clearly deeper: the choice stays steady
  for (int j = 0; j < 3; ++j) {
    const N along = dot(axes_b[j], place_b);
    const N overlap = fma(a[2], m[2][j], fma(a[1], m[1][j], fma(a[0], m[0][j], b[j]))) - abs(along);
    gap = maximum(gap, zero - overlap);
    const auto less = hn::Lt(overlap.v, fms(num<D>(0.98), least, num<D>(1e-9)).v);
    least = select(less, overlap, least);
    normal = select(less, sign_of(along) * axes_b[j], normal);
  }
  if (hn::AllTrue(d, hn::Ge(gap.v, hn::Zero(d)))) {
    store<D>(gap, out, kGap);
    return;
  }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) {
      const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
      const N length2 = one - c[i][j] * c[i][j];
      const auto counts = hn::Ge(length2.v, hn::Set(d, kParallel));
      const N reach = fma(b[j2], m[i][j1], fma(b[j1], m[i][j2], fma(a[i2], m[i1][j], a[i1] * m[i2][j])));
      const N along = t[i2] * c[i1][j] - t[i1] * c[i2][j], overlap = reach - abs(along);
      // the product is at most 1 long, so the gap is at least this
      gap = select(counts, maximum(gap, zero - overlap), gap);
      const N bound = fms(num<D>(0.95), least, num<D>(1e-9));
      const auto less = hn::And(hn::And(counts, hn::Gt(bound.v, hn::Zero(d))),
                                hn::Lt((overlap * overlap).v, (bound * bound * length2).v));
      if (hn::AllFalse(d, less)) continue;
      const N per_length = one / root(select(counts, length2, one));
      least = select(less, overlap * per_length, least);
      // product of the i-th axis and b's j-th, towards b
      const N s = sign_of(along) * per_length;
      const V n{i == 0   ? zero
                : i == 1 ? s * c[2][j]
                         : zero - s * c[1][j],
                i == 0   ? zero - s * c[2][j]
                : i == 1 ? zero
                         : s * c[0][j],
                i == 0   ? s * c[1][j]
                : i == 1 ? zero - s * c[0][j]
                         : zero};
      normal = select(less, n, normal);
    }
  store<D>(gap, out, kGap);
  const auto overlaps = hn::Lt(gap.v, hn::Zero(d));
  if (hn::AllFalse(d, overlaps)) return;

  // the faces that look at each other, in coordinates of a's: out of it, and along its edges
  const Turn<D> side_a(abs(normal.x), abs(normal.y), abs(normal.z));
  const V n = side_a(normal), h = side_a(ha), at = side_a(place_b);
  const V bx = side_a(axes_b[0]), by = side_a(axes_b[1]), bz = side_a(axes_b[2]);
  const N nb[3] = {dot(n, bx), dot(n, by), dot(n, bz)};
  const Turn<D> side_b(abs(nb[0]), abs(nb[1]), abs(nb[2]));
  const N depth_b = side_b(hb.x, hb.y, hb.z), along_b = side_b(nb[0], nb[1], nb[2]);
  const V face_b = fma(zero - sign_of(along_b) * depth_b, side_b(bx, by, bz), at);
  const V du = side_b(hb.y, hb.z, hb.x) * side_b(by, bz, bx), dv = side_b(hb.z, hb.x, hb.y) * side_b(bz, bx, by);
  // a point is: (surface of a, x, y) - depth n
  const N surface = sign_of(n.x) * h.x, per_along = one / n.x, r1 = n.y * per_along, r2 = n.z * per_along;
  const auto measure = [&](const V& v) -> V {
    return {fnma(r1, v.x, v.y), fnma(r2, v.x, v.z), zero - v.x * per_along};
  };
  const V middle = measure({face_b.x - surface, face_b.y, face_b.z}), U = measure(du), T = measure(dv);
  const V corner[4] = {(middle + U) + T, (middle - U) + T, (middle - U) - T, (middle + U) - T};
  const N two = num<D>(2), hx = h.y, hy = h.z;
  const V step_u = two * U, step_t = two * T, none{zero, zero, zero};
  const V step[4] = {none - step_u, none - step_t, step_u, step_t};  // from each corner to the next

  // what of b's edges lies in a's face, and of a's in b's
  const N ux = inverse(step_u.x), uy = inverse(step_u.y), tx = inverse(step_t.x), ty = inverse(step_t.y);
  const N per_x[4] = {zero - ux, zero - tx, ux, tx}, per_y[4] = {zero - uy, zero - ty, uy, ty};
  const N wide_x = num<D>(kWider) * hx, wide_y = num<D>(kWider) * hy;
  Part<D> part_b[4], part_a[4];
  for (int k = 0; k < 4; ++k) part_b[k] = cut(corner[k].x, corner[k].y, per_x[k], per_y[k], wide_x, wide_y);
  const N per_det = inverse(U.x * T.y - U.y * T.x);
  const N alpha_x = T.y * per_det, alpha_y = zero - T.x * per_det, beta_x = zero - U.y * per_det,
          beta_y = U.x * per_det;
  const N x_of[4] = {hx, zero - hx, zero - hx, hx}, y_of[4] = {hy, hy, zero - hy, zero - hy};
  N alpha[4], beta[4];  // a's corners in b's face, from -1 to 1
  for (int k = 0; k < 4; ++k) {
    const N x = x_of[k] - middle.x, y = y_of[k] - middle.y;
    alpha[k] = fma(alpha_y, y, alpha_x * x), beta[k] = fma(beta_y, y, beta_x * x);
  }
  const N jx = inverse(two * hx * alpha_x), kx = inverse(two * hx * beta_x), jy = inverse(two * hy * alpha_y),
          ky = inverse(two * hy * beta_y);
  const N per_alpha[4] = {zero - jx, zero - jy, jx, jy}, per_beta[4] = {zero - kx, zero - ky, kx, ky};
  for (int k = 0; k < 4; ++k)
    part_a[k] = cut(alpha[k], beta[k], per_alpha[k], per_beta[k], num<D>(kNarrower), num<D>(kNarrower));

  // lengths seen along n
  const N g11 = one - n.y * n.y, g22 = one - n.z * n.z, g12 = (zero - two) * (n.y * n.z);
  const auto length = [&](const V& v) {
    return root(maximum(fma(v.x, fma(g11, v.x, g12 * v.y), g22 * (v.y * v.y)), zero));
  };
  const N edge_b[2] = {length(step_u), length(step_t)};
  const N edge_a[2] = {two * hx * root(maximum(g11, zero)), two * hy * root(maximum(g22, zero))};
  N of_b[4], of_a[4], perimeter = zero;
  for (int k = 0; k < 4; ++k) {
    of_b[k] = part_b[k].length * edge_b[k % 2], of_a[k] = part_a[k].length * edge_a[k % 2];
    perimeter = perimeter + (of_b[k] + of_a[k]);
  }
  const auto is_area = hn::Gt(perimeter.v, hn::Zero(d));
  const N per_perimeter = two / select(is_area, perimeter, one);

  const V e0 = side_a(axes_a[0], axes_a[1], axes_a[2]), e1 = side_a(axes_a[1], axes_a[2], axes_a[0]),
          e2 = side_a(axes_a[2], axes_a[0], axes_a[1]);
  const V direction = fma(n.z, e2, fma(n.y, e1, n.x * e0)), origin = fma(surface, e0, place_a);
  store3<D>(direction, out, kBoxNormal);
  N places = zero;
  const auto write = [&](int place, Mask<D> valid, const V& x, N both) {
    const auto is_point = hn::And(valid, hn::And(overlaps, hn::Gt(x.z.v, hn::Zero(d))));
    const N depth = select(is_point, x.z, zero);
    places = places + select(is_point, num<D>(1 << place), zero);
    const V p = fma(zero - half * depth, direction, fma(x.y, e2, fma(x.x, e1, origin)));
    const int field = kBoxPoints + place * kBoxPointFields;
    store3<D>(p, out, field);
    store<D>(depth, out, field + 3);
    store<D>(select(is_area, per_perimeter * both, one), out, field + 4);
  };
  Mask<D> is_in[4];
  for (int k = 0; k < 4; ++k)
    is_in[k] = hn::And(hn::Le(hn::Abs(corner[k].x.v), wide_x.v), hn::Le(hn::Abs(corner[k].y.v), wide_y.v));
  for (int k = 0; k < 4; ++k) {
    const Part<D>& part = part_b[k];
    const auto to_right = hn::Gt(step[k].x.v, hn::Zero(d)), upward = hn::Gt(step[k].y.v, hn::Zero(d));
    // an edge of b begins at its corner, or where it comes in over an edge of a
    const N entered = select(part.begins_at_x, select(to_right, of_a[1], of_a[3]), select(upward, of_a[2], of_a[0]));
    const V in = fma(part.begin, step[k], corner[k]);
    write(k, hn::Or(is_in[k], part.is_left), select(is_in[k], corner[k], in),
          of_b[k] + select(is_in[k], of_b[(k + 3) % 4], entered));
    const N left = select(part.ends_at_x, select(to_right, of_a[3], of_a[1]), select(upward, of_a[0], of_a[2]));
    write(4 + k, hn::AndNot(is_in[(k + 1) % 4], part.is_left), fma(part.end, step[k], corner[k]), of_b[k] + left);
    const auto within =
        hn::And(hn::Le(hn::Abs(alpha[k].v), hn::Set(d, kNarrower)), hn::Le(hn::Abs(beta[k].v), hn::Set(d, kNarrower)));
    write(8 + k, within, {x_of[k], y_of[k], fma(beta[k], T.z, fma(alpha[k], U.z, middle.z))},
          of_a[k] + of_a[(k + 3) % 4]);
  }
  store<D>(places, out, kBoxPlaces);
}

template <class D>
HWY_INLINE void find_all(const BoxJob& job) {
  for (size_t block = 0; block < job.blocks; ++block) find_block<D>(job, block);
}
void find_box_contacts_here(const BoxJob& job) { find_all<hn::ScalableTag<double>>(job); }
void find_box_contacts_singly_here(const BoxJob& job) { find_all<hn::CappedTag<double, 1>>(job); }

}  // namespace HWY_NAMESPACE
}  // namespace topple::mbs::kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace topple::mbs::kernel {

HWY_EXPORT(find_box_contacts_here);
HWY_EXPORT(find_box_contacts_singly_here);

void find_box_contacts(const BoxJob& job) { HWY_DYNAMIC_DISPATCH(find_box_contacts_here)(job); }
void find_box_contacts_singly(const BoxJob& job) { HWY_DYNAMIC_DISPATCH(find_box_contacts_singly_here)(job); }

}  // namespace topple::mbs::kernel
#endif
