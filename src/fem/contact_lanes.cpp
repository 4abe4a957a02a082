// Compiled once for each instruction set (Highway's foreach_target).
#include "fem/contact_lanes.h"

#include <algorithm>

#include "fem/explicit_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fem/contact_lanes.cpp"
// one wide target for each family of machines keeps the build short
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace topple::fem::lanes {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, 4>;  // eight take longer, docs/decisions/0129
using V = hn::Vec<D>;
using M = hn::Mask<D>;
constexpr size_t kLanes = hn::MaxLanes(D());

#include "fem/contact_vectors.inc"

HWY_INLINE V length(const V3& a) { return hn::Sqrt(dot(a, a)); }
HWY_INLINE V clamp(V x, double most) { return hn::Min(hn::Max(x, num(-most)), num(most)); }
HWY_INLINE V3 choose(M mask, const V3& a, const V3& b) {
  return {hn::IfThenElse(mask, a.x, b.x), hn::IfThenElse(mask, a.y, b.y), hn::IfThenElse(mask, a.z, b.z)};
}

/// Candidates of a block, the last one again in lanes that are left over: where their points and nodes begin.
struct Block {
  const double *point[kLanes], *corner[4][kLanes];

  template <class Number>
  HWY_INLINE Block(const double* rows, const Faces& faces, const Number& number) {
    for (size_t l = 0; l < kLanes; ++l) {
      const size_t i = number(l);
      point[l] = reinterpret_cast<const double*>(&faces.points[faces.point[i]]);
      for (size_t k = 0; k < 4; ++k) corner[k][l] = rows + kernel::kNodeFields * size_t{faces.corners[k][i]};
    }
  }
};
HWY_INLINE Four load_four(const double* const (&from)[kLanes], size_t first) {
  return load_four([&](size_t l) HWY_ATTR { return from[l] + first; });
}
static_assert(kernel::kPlace == 0 && kernel::kSpeed == 3 && kernel::kInverseMass == 6);
static_assert(offsetof(Point, radius) == 24 && offsetof(Point, v) == 32 && offsetof(Point, stiffness) == 64);
static_assert(offsetof(Particle, radius) == 48 && offsetof(ParticleMake, stiffness) == 32);
HWY_INLINE void load_corners(const Block& block, V3 (&x)[4]) {
  for (size_t k = 0; k < 4; ++k) {
    const Four place = load_four(block.corner[k], 0);
    x[k] = {place.a, place.b, place.c};
  }
}

/// A face's middle, the product of its diagonals, and how far a point is above the middle, times the length of that.
struct Look {
  V3 middle, n;
  V size, above;
};
HWY_INLINE Look look(const V3& p, const V3 (&x)[4]) {
  Look out;
  out.middle = scale(num(0.25), add(add(add(x[0], x[1]), x[2]), x[3]));
  out.n = cross(sub(x[2], x[0]), sub(x[3], x[1]));
  out.size = length(out.n), out.above = dot(sub(p, out.middle), out.n);
  return out;
}

/// Numbers of the candidates that are not above their face by more than it is uneven.
HWY_NOINLINE size_t sift(const Setup& setup, const Faces& faces, size_t first, size_t last,
                         std::uint32_t* HWY_RESTRICT passed) {
  const D d;
  size_t kept = 0;
  constexpr size_t kAhead = 16;  // corners that lie all over memory
  for (size_t i = first; i < last; i += kLanes) {
    for (size_t l = i + kAhead; l < std::min(i + kAhead + kLanes, faces.point.size()); ++l)
      for (const auto& rows : faces.corners) hwy::Prefetch(setup.rows + kernel::kNodeFields * size_t{rows[l]});
    const Block block(setup.rows, faces, [&](size_t l) { return std::min(i + l, last - 1); });
    V3 x[4];
    load_corners(block, x);
    const Four point = load_four(block.point, 0);
    const Look at = look({point.a, point.b, point.c}, x);
    const V most = add(mul(point.d, at.size), hn::Abs(dot(sub(x[0], at.middle), at.n)));
    // written so that what is no number stays
    const M is_above = hn::Gt(at.above, most);
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, is_above, bits);
    for (size_t l = 0; l < kLanes; ++l) {
      passed[kept] = static_cast<std::uint32_t>(i + l);
      kept += (bits[0] >> l & 1U) == 0 && i + l < last ? 1 : 0;
    }
  }
  return kept;
}

/// The place of points on quadrilaterals: x(ξ, η) + height n = p with the normal n of the middle (eq. 22).
struct Projection {
  V weights[4];
  V3 normal;  // from the face to the point
  V height;
  M inside, may_touch;
};
HWY_INLINE Projection project(const V3& p, const V3 (&x)[4], V radius, M is_ball) {
  constexpr double kEdge = 1.001;  // faces that meet at an edge leave no gap
  const V zero = num(0), one = num(1), quarter = num(0.25);
  Projection out;
  const V3 c = scale(quarter, add(add(add(x[0], x[1]), x[2]), x[3]));
  const V3 a = scale(quarter, sub(sub(add(x[1], x[2]), x[0]), x[3]));
  const V3 b = scale(quarter, sub(sub(add(x[2], x[3]), x[0]), x[1]));
  const V3 e = scale(quarter, sub(sub(add(x[0], x[2]), x[1]), x[3]));
  const V3 n = cross(a, b);
  out.normal = scale(hn::Div(one, hn::Max(length(n), num(1e-300))), n);
  // in the plane of the middle, with one axis along a
  const V3 along = scale(hn::Div(one, hn::Max(length(a), num(1e-300))), a), across = cross(out.normal, along);
  const V a1 = dot(a, along), b1 = dot(b, along), b2 = dot(b, across), e1 = dot(e, along), e2 = dot(e, across);
  const V p1 = dot(sub(p, c), along), p2 = dot(sub(p, c), across);
  // beside the rectangle around the face a ball, clamped to the face, cannot touch
  const V wider = num(kEdge * kEdge);
  const V beside1 = sub(hn::Abs(p1), mul(wider, add(add(hn::Abs(a1), hn::Abs(b1)), hn::Abs(e1))));
  const V beside2 = sub(hn::Abs(p2), mul(wider, add(hn::Abs(b2), hn::Abs(e2))));
  const V far1 = hn::Max(zero, beside1), far2 = hn::Max(zero, beside2);
  out.may_touch = hn::Le(add(mul(far1, far1), mul(far2, far2)), mul(radius, radius));
  V xi = zero, eta = zero;
  M goes_on = out.may_touch;
  for (int i = 0; i < 4; ++i) {
    const V t1 = add(a1, mul(eta, e1)), t2 = mul(eta, e2), u1 = add(b1, mul(xi, e1)), u2 = add(b2, mul(xi, e2));
    const V r1 = sub(p1, add(mul(xi, t1), mul(eta, b1))), r2 = sub(p2, add(mul(xi, t2), mul(eta, b2)));
    goes_on = hn::AndNot(hn::Lt(add(hn::Abs(r1), hn::Abs(r2)), mul(num(1e-14), a1)), goes_on);
    const V area = sub(mul(t1, u2), mul(t2, u1));
    goes_on = hn::And(goes_on, hn::Gt(hn::Abs(area), num(1e-300)));
    if (hn::AllFalse(D(), goes_on)) break;
    const V dx = hn::Div(sub(mul(r1, u2), mul(r2, u1)), area), dy = hn::Div(sub(mul(t1, r2), mul(t2, r1)), area);
    xi = hn::IfThenElse(goes_on, clamp(add(xi, dx), 3), xi), eta = hn::IfThenElse(goes_on, clamp(add(eta, dy), 3), eta);
    goes_on = hn::AndNot(hn::Lt(add(hn::Abs(dx), hn::Abs(dy)), num(1e-12)), goes_on);
  }
  out.inside = hn::And(hn::Le(hn::Abs(xi), num(kEdge)), hn::Le(hn::Abs(eta), num(kEdge)));
  xi = hn::IfThenElse(is_ball, clamp(xi, 1), xi), eta = hn::IfThenElse(is_ball, clamp(eta, 1), eta);
  const V low_xi = mul(quarter, sub(one, xi)), high_xi = mul(quarter, add(one, xi));
  out.weights[0] = mul(low_xi, sub(one, eta)), out.weights[1] = mul(high_xi, sub(one, eta));
  out.weights[2] = mul(high_xi, add(one, eta)), out.weights[3] = mul(low_xi, add(one, eta));
  const V3 r = sub(p, add(add(add(c, scale(xi, a)), scale(eta, b)), scale(mul(xi, eta), e)));
  out.height = dot(r, out.normal);
  const M is_beside = hn::AndNot(out.inside, is_ball);
  const V distance = length(r);
  out.normal = choose(hn::And(is_beside, hn::Gt(distance, zero)), scale(hn::Div(one, distance), r), out.normal);
  out.height = hn::IfThenElse(is_beside, distance, out.height);
  return out;
}

/// Forces of springs with dashpots and friction.
struct Pressed {
  V3 force, friction;
  V stored;
};
HWY_INLINE Pressed press_along(V depth, const V3& normal, const V3& v, V rate, V inverse, V damping,
                               double friction_share, double grip_share, double h) {
  const V zero = num(0);
  const V closing = hn::Neg(dot(normal, v));
  const V dashpot = mul(mul(mul(num(2), damping), hn::Sqrt(hn::Div(rate, inverse))), closing);
  const V push = hn::Max(zero, add(mul(rate, depth), dashpot));
  const V3 along = add(v, scale(closing, normal));
  const V slide = length(along);
  const V grip = hn::Min(mul(num(friction_share), push), hn::Div(mul(num(grip_share), slide), mul(inverse, num(h))));
  const V pull = hn::IfThenElseZero(hn::Gt(slide, zero), hn::Div(hn::Neg(grip), slide));
  return {scale(push, normal), scale(pull, along), mul(mul(mul(num(0.5), rate), depth), depth)};
}
/// What presses a ball beyond what it bears.
HWY_INLINE V calc_crushed(const Pressed& on, V depth, V bears) {
  const V spring = hn::Div(mul(num(2), on.stored), mul(depth, depth));
  return hn::IfThenElseZero(hn::Gt(spring, num(0)), sub(depth, hn::Div(bears, spring)));
}

HWY_NOINLINE void press(const Setup& setup, const Faces& faces, size_t count, std::vector<Touch>& touches) {
  const D d;
  const V zero = num(0);
  const std::uint32_t* HWY_RESTRICT passed = faces.passed.data();
  for (size_t i = 0; i < count; i += kLanes) {
    const Block block(setup.rows, faces, [&](size_t l) { return passed[std::min(i + l, count - 1)]; });
    V3 x[4];
    load_corners(block, x);
    const Four place = load_four(block.point, 0), make = load_four(block.point, 8);
    const V3 p{place.a, place.b, place.c};
    const V radius = place.d;
    const M is_ball = hn::Gt(make.c, zero);
    const V above = look(p, x).above;
    const Projection on = project(p, x, radius, is_ball);
    const V depth = sub(radius, on.height);
    // beside it only balls that are not below
    const M beside = hn::AndNot(on.inside, hn::AndNot(hn::Lt(above, zero), is_ball));
    const M touch = hn::And(on.may_touch, hn::And(hn::Or(on.inside, beside), hn::Gt(depth, zero)));
    if (hn::AllFalse(d, touch)) continue;

    const Four motion = load_four(block.point, 4);
    V inverse = motion.d;
    V3 v{motion.a, motion.b, motion.c};
    for (size_t k = 0; k < 4; ++k) {
      const Four of = load_four(block.corner[k], kernel::kSpeed);  // with the inverse mass
      inverse = add(inverse, mul(mul(on.weights[k], on.weights[k]), of.d));
      v = sub(v, scale(on.weights[k], V3{of.a, of.b, of.c}));
    }
    V rate = hn::Div(num(setup.rate), mul(num(setup.h * setup.h), inverse));
    rate = hn::Min(rate, make.a);
    rate = mul(hn::IfThenElse(on.inside, num(1), num(0.5)), rate);  // two faces have an edge
    const Pressed pressed =
        press_along(depth, on.normal, v, rate, inverse, make.b, setup.friction, setup.grip, setup.h);
    const V3 &force = pressed.force, &friction = pressed.friction;
    const V stored = pressed.stored;
    const V crushed = calc_crushed(pressed, depth, make.d);

    const V fields[] = {on.height,     depth,   on.weights[0], on.weights[1],   on.weights[2], on.weights[3],
                        force.x,       force.y, force.z,       friction.x,      friction.y,    friction.z,
                        dot(force, v), stored,  crushed,       dot(friction, v)};
    constexpr size_t kFields = sizeof(fields) / sizeof(V);
    HWY_ALIGN double out[kFields][kLanes];
    for (size_t f = 0; f < kFields; ++f) hn::Store(fields[f], d, out[f]);
    std::uint8_t bits[8] = {};
    hn::StoreMaskBits(d, touch, bits);
    for (size_t l = 0; l < kLanes && i + l < count; ++l) {
      if ((bits[0] >> l & 1U) == 0) continue;
      Touch& t = touches.emplace_back();
      t.candidate = passed[i + l], t.height = out[0][l], t.depth = out[1][l];
      for (size_t k = 0; k < 4; ++k) t.weights[k] = out[2 + k][l];
      t.normal_force = {out[6][l], out[7][l], out[8][l]}, t.friction = {out[9][l], out[10][l], out[11][l]};
      t.normal = out[12][l], t.stored = out[13][l], t.crushed = out[14][l], t.rubbing = out[15][l];
    }
  }
}

void press_faces(const Setup& setup, Faces& faces, size_t first, size_t last, std::vector<Touch>& touches) {
  if (faces.passed.size() < last - first + kLanes) faces.passed.resize(last - first + kLanes);
  press(setup, faces, sift(setup, faces, first, last, faces.passed.data()), touches);
}

void press_particles(const ParticleSetup& setup, std::span<const ParticlePair> pairs,
                     std::vector<ParticleTouch>& touches, TouchSums& sums) {
  const D d;
  const V one = num(1);
  const auto* particles = reinterpret_cast<const double*>(setup.particles);
  const auto* makes = reinterpret_cast<const double*>(setup.makes);
  for (size_t i = 0; i < pairs.size(); i += kLanes) {
    V3 p[2], v[2];
    V radius[2], per_mass[2], stiffness[2], bears[2];
    for (size_t side = 0; side < 2; ++side) {
      const double *particle[kLanes], *make[kLanes];
      for (size_t l = 0; l < kLanes; ++l) {
        const size_t number = pairs[std::min(i + l, pairs.size() - 1)][side];
        particle[l] = particles + sizeof(Particle) / sizeof(double) * number;
        make[l] = makes + sizeof(ParticleMake) / sizeof(double) * number;
      }
      const Four first = load_four(particle, 0), second = load_four(particle, 4);
      p[side] = {first.a, first.b, first.c}, v[side] = {first.d, second.a, second.b};
      radius[side] = second.c, per_mass[side] = hn::Div(one, second.d);
      const Four of = load_four(make, 2);
      stiffness[side] = of.c, bears[side] = of.d;
    }
    const V3 apart = sub(p[0], p[1]), along_v = sub(v[0], v[1]);
    const V distance = length(apart), depth = sub(add(radius[0], radius[1]), distance);
    const V3 normal = scale(hn::Div(one, distance), apart);
    const V rate = hn::Min(stiffness[0], stiffness[1]), inverse = add(per_mass[0], per_mass[1]);
    const Pressed on =
        press_along(depth, normal, along_v, rate, inverse, num(setup.damping), setup.friction, setup.grip, setup.h);
    const V fields[] = {on.force.x,
                        on.force.y,
                        on.force.z,
                        on.friction.x,
                        on.friction.y,
                        on.friction.z,
                        dot(on.force, along_v),
                        dot(on.friction, along_v),
                        on.stored,
                        calc_crushed(on, depth, bears[0]),
                        calc_crushed(on, depth, bears[1])};
    constexpr size_t kFields = sizeof(fields) / sizeof(V);
    HWY_ALIGN double out[kFields][kLanes];
    for (size_t f = 0; f < kFields; ++f) hn::Store(fields[f], d, out[f]);
    for (size_t l = 0; l < kLanes && i + l < pairs.size(); ++l) {
      ParticleTouch& t = touches.emplace_back();
      t.normal_force = {out[0][l], out[1][l], out[2][l]}, t.friction = {out[3][l], out[4][l], out[5][l]};
      t.crushed = {out[9][l], out[10][l]}, t.pair = pairs[i + l];
      sums.normal += out[6][l], sums.friction += out[7][l], sums.stored += out[8][l];
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace topple::fem::lanes
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace topple::fem::lanes {

HWY_EXPORT(press_faces);
HWY_EXPORT(press_particles);

void press_faces(const Setup& setup, Faces& faces, size_t first, size_t last, std::vector<Touch>& touches) {
  touches.clear();
  if (first < last) HWY_DYNAMIC_DISPATCH(press_faces)(setup, faces, first, last, touches);
}

void press_particles(const ParticleSetup& setup, std::span<const ParticlePair> pairs,
                     std::vector<ParticleTouch>& touches, TouchSums& sums) {
  HWY_DYNAMIC_DISPATCH(press_particles)(setup, pairs, touches, sums);
}

}  // namespace topple::fem::lanes
#endif
