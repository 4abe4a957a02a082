// Compiled once for each instruction set (Highway's foreach_target).
#include "fem/explicit_kernel.h"

#include <algorithm>
#include <cstring>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fem/explicit_kernel.cpp"
// one wide target for each family of machines keeps the build short
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/cache_control.h>
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace topple::fem::kernel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::ScalableTag<double>;
using V = hn::Vec<D>;
constexpr size_t kLanes = hn::MaxLanes(D());
static_assert(kLanes <= 8);

struct V3 {
  V x, y, z;
};
HWY_INLINE V num(double x) { return hn::Set(D(), x); }
HWY_INLINE V add(V a, V b) { return hn::Add(a, b); }
HWY_INLINE V sub(V a, V b) { return hn::Sub(a, b); }
HWY_INLINE V mul(V a, V b) { return hn::Mul(a, b); }
/// a b + c, a b - c, c - a b
HWY_INLINE V fma(V a, V b, V c) { return hn::MulAdd(a, b, c); }
HWY_INLINE V fms(V a, V b, V c) { return hn::MulSub(a, b, c); }
HWY_INLINE V fnma(V a, V b, V c) { return hn::NegMulAdd(a, b, c); }
HWY_INLINE V dot(const V3& a, const V3& b) { return fma(a.z, b.z, fma(a.y, b.y, mul(a.x, b.x))); }
HWY_INLINE V3 cross(const V3& a, const V3& b) {
  return {fms(a.y, b.z, mul(a.z, b.y)), fms(a.z, b.x, mul(a.x, b.z)), fms(a.x, b.y, mul(a.y, b.x))};
}
HWY_INLINE V3 add(const V3& a, const V3& b) { return {add(a.x, b.x), add(a.y, b.y), add(a.z, b.z)}; }
HWY_INLINE V3 scale(V s, const V3& a) { return {mul(s, a.x), mul(s, a.y), mul(s, a.z)}; }
/// s a + b
HWY_INLINE V3 fma(V s, const V3& a, const V3& b) { return {fma(s, a.x, b.x), fma(s, a.y, b.y), fma(s, a.z, b.z)}; }

#if HWY_TARGET == HWY_SCALAR
HWY_INLINE V3 load_corner(const double* HWY_RESTRICT rows, const std::uint16_t* HWY_RESTRICT node) {
  const double* at = rows + node[0];
  return {num(at[0]), num(at[1]), num(at[2])};
}
HWY_INLINE void add_corner(const V3& f, double* HWY_RESTRICT rows, const std::uint16_t* HWY_RESTRICT node) {
  double* at = rows + node[0];
  at[0] += hn::GetLane(f.x), at[1] += hn::GetLane(f.y), at[2] += hn::GetLane(f.z);
}
#else
/// Pairs of doubles of every second lane's node, one a 128-bit block: lanes first, first + 2, ...
template <class D2>
HWY_INLINE hn::Vec<D2> load_pairs(D2 d, const double* HWY_RESTRICT at, const std::uint16_t* HWY_RESTRICT node) {
  constexpr size_t kHere = hn::MaxLanes(D2());
  if constexpr (kHere == 2) {
    return hn::Load(d, at + node[0]);
  } else {
    const hn::Half<D2> half;
    const auto high = load_pairs(half, at, node + kHere / 2);
    return hn::Combine(d, high, load_pairs(half, at, node));
  }
}

/// Component vectors of one corner of all lanes, from rows.
HWY_INLINE V3 load_corner(const double* HWY_RESTRICT rows, const std::uint16_t* HWY_RESTRICT node) {
  const D d;
  const V xy0 = load_pairs(d, rows, node), xy1 = load_pairs(d, rows, node + 1);
  const V z0 = load_pairs(d, rows + 2, node), z1 = load_pairs(d, rows + 2, node + 1);
  return {hn::InterleaveLower(d, xy0, xy1), hn::InterleaveUpper(d, xy0, xy1), hn::InterleaveLower(d, z0, z1)};
}

/// Adds vectors of x y and z 0 of every second lane, as load_pairs gives them, to rows of forces.
template <class D2>
HWY_INLINE void add_rows(D2 d, hn::Vec<D2> xy0, hn::Vec<D2> z0, hn::Vec<D2> xy1, hn::Vec<D2> z1,
                         double* HWY_RESTRICT rows, const std::uint16_t* HWY_RESTRICT node) {
  constexpr size_t kHere = hn::MaxLanes(D2());
  const auto add_to = [&](hn::Vec<D2> f, double* at) HWY_ATTR { hn::Store(hn::Add(hn::Load(d, at), f), d, at); };
  if constexpr (kHere == 2) {
    add_to(xy0, rows + node[0]), add_to(z0, rows + node[0] + 2);
    add_to(xy1, rows + node[1]), add_to(z1, rows + node[1] + 2);
  } else if constexpr (kHere == 4) {
    add_to(hn::ConcatLowerLower(d, z0, xy0), rows + node[0]);
    add_to(hn::ConcatLowerLower(d, z1, xy1), rows + node[1]);
    add_to(hn::ConcatUpperUpper(d, z0, xy0), rows + node[2]);
    add_to(hn::ConcatUpperUpper(d, z1, xy1), rows + node[3]);
  } else {
    const hn::Half<D2> half;
    add_rows(half, hn::LowerHalf(half, xy0), hn::LowerHalf(half, z0), hn::LowerHalf(half, xy1), hn::LowerHalf(half, z1),
             rows, node);
    add_rows(half, hn::UpperHalf(half, xy0), hn::UpperHalf(half, z0), hn::UpperHalf(half, xy1), hn::UpperHalf(half, z1),
             rows, node + kHere / 2);
  }
}
HWY_INLINE void add_corner(const V3& f, double* HWY_RESTRICT rows, const std::uint16_t* HWY_RESTRICT node) {
  const D d;
  add_rows(d, hn::InterleaveLower(d, f.x, f.y), hn::InterleaveLower(d, f.z, hn::Zero(d)),
           hn::InterleaveUpper(d, f.x, f.y), hn::InterleaveUpper(d, f.z, hn::Zero(d)), rows, node);
}
#endif

/// Sums over the corners with the signs of ξ η ζ ηζ ζξ ξη ξηζ: eight times the modal amplitudes (eq. 1).
struct Modes {
  V a, b, c, d, e, f, g;
};
HWY_INLINE Modes transform(V n0, V n1, V n2, V n3, V n4, V n5, V n6, V n7) {
  const V s0 = add(n1, n0), d0 = sub(n1, n0), s1 = add(n2, n3), d1 = sub(n2, n3);
  const V s2 = add(n5, n4), d2 = sub(n5, n4), s3 = add(n6, n7), d3 = sub(n6, n7);
  const V ss0 = add(s1, s0), sd0 = sub(s1, s0), ds0 = add(d1, d0), dd0 = sub(d1, d0);
  const V ss1 = add(s3, s2), sd1 = sub(s3, s2), ds1 = add(d3, d2), dd1 = sub(d3, d2);
  return {add(ds1, ds0), add(sd1, sd0), sub(ss1, ss0), sub(sd1, sd0), sub(ds1, ds0), add(dd1, dd0), sub(dd1, dd0)};
}
/// The transposed: values at the corners.
HWY_INLINE void spread(const Modes& m, V* HWY_RESTRICT n) {
  // along ζ: parts at ζ = -1 (0) and +1 (1) of 1, ξ, η, ξη
  const V one1 = m.c, one0 = hn::Neg(m.c);
  const V x0 = sub(m.a, m.e), x1 = add(m.a, m.e), y0 = sub(m.b, m.d), y1 = add(m.b, m.d);
  const V xy0 = sub(m.f, m.g), xy1 = add(m.f, m.g);
  const V l0 = sub(one0, y0), u0 = add(one0, y0), lx0 = sub(x0, xy0), ux0 = add(x0, xy0);
  const V l1 = sub(one1, y1), u1 = add(one1, y1), lx1 = sub(x1, xy1), ux1 = add(x1, xy1);
  n[0] = sub(l0, lx0), n[1] = add(l0, lx0), n[2] = add(u0, ux0), n[3] = sub(u0, ux0);
  n[4] = sub(l1, lx1), n[5] = add(l1, lx1), n[6] = add(u1, ux1), n[7] = sub(u1, ux1);
}
struct Modes3 {
  V3 a, b, c, d, e, f, g;
};
HWY_INLINE Modes3 transform(const V3* HWY_RESTRICT n) {
  const Modes x = transform(n[0].x, n[1].x, n[2].x, n[3].x, n[4].x, n[5].x, n[6].x, n[7].x);
  const Modes y = transform(n[0].y, n[1].y, n[2].y, n[3].y, n[4].y, n[5].y, n[6].y, n[7].y);
  const Modes z = transform(n[0].z, n[1].z, n[2].z, n[3].z, n[4].z, n[5].z, n[6].z, n[7].z);
  return {{x.a, y.a, z.a}, {x.b, y.b, z.b}, {x.c, y.c, z.c}, {x.d, y.d, z.d},
          {x.e, y.e, z.e}, {x.f, y.f, z.f}, {x.g, y.g, z.g}};
}

/// Derivatives of the volume by the modes but for factors (eq. 3, 4).
struct Gradients {
  V3 a, b, c, d, e, f;
  V volume;  // 64 times
};
HWY_INLINE Gradients differentiate(const Modes3& m) {
  const V third = num(1.0 / 3);
  Gradients g;
  g.a = fma(third, cross(m.f, m.e), cross(m.b, m.c));
  g.b = fma(third, cross(m.d, m.f), cross(m.c, m.a));
  g.c = fma(third, cross(m.e, m.d), cross(m.a, m.b));
  g.d = scale(third, add(cross(m.c, m.e), cross(m.f, m.b)));
  g.e = scale(third, add(cross(m.d, m.c), cross(m.a, m.f)));
  g.f = scale(third, add(cross(m.b, m.d), cross(m.e, m.a)));
  g.volume = add(dot(m.a, g.a), dot(m.d, g.d));
  return g;
}

struct Matrix {
  V3 x, y, z;  // rows
};
HWY_INLINE V3 times(const Matrix& m, const V3& v) { return {dot(m.x, v), dot(m.y, v), dot(m.z, v)}; }

HWY_INLINE V load_field(const double* HWY_RESTRICT block, int field) {
  return hn::Load(D(), block + static_cast<size_t>(field) * kLanes);
}
HWY_INLINE void store_field(V x, double* HWY_RESTRICT block, int field) {
  hn::Store(x, D(), block + static_cast<size_t>(field) * kLanes);
}

/// Yield stresses in tension and compression at a plastic strain, and their slopes.
struct Yield {
  V tension, tension_slope, compression, compression_slope;
};
HWY_INLINE Yield find_yield(const Law& law, V strain) {
  V t = num(law.tension[0]), ts = num(law.tension_slope[0]);
  V c = num(law.compression[0]), cs = num(law.compression_slope[0]);
  for (int k = 1; k < law.points; ++k) {
    const auto past = hn::Ge(strain, num(law.at[k]));
    t = hn::IfThenElse(past, num(law.tension[k]), t), ts = hn::IfThenElse(past, num(law.tension_slope[k]), ts);
    c = hn::IfThenElse(past, num(law.compression[k]), c);
    cs = hn::IfThenElse(past, num(law.compression_slope[k]), cs);
  }
  return {fma(ts, strain, t), ts, fma(cs, strain, c), cs};
}

struct Sums {
  V mean, varying, corner, viscous;
};

/// Stabilising stresses of a block.
struct Amplitudes {
  V bending[6], twist[3], corner[3];
};

/// Everything of a block of elements between the nodes' motion and their forces.
HWY_INLINE void advance_block(const StepJob& step, const ChunkJob& job, size_t block, double* HWY_RESTRICT forces,
                              Sums& sums) {
  const D d;
  const Law& law = job.laws[job.law_of_block[block]];
  const std::uint16_t* HWY_RESTRICT corners = job.corners + block * 8 * kLanes;
  double* HWY_RESTRICT element = job.elements + block * static_cast<size_t>(kElementFields) * kLanes;
  const V zero = hn::Zero(d);

  // the next block's state on its way
  for (size_t i = 0; i < kElementFields * kLanes; i += 8) hwy::Prefetch(element + kElementFields * kLanes + i);
  V3 places[8], speeds[8];
  for (size_t i = 0; i < 8; ++i) {
    places[i] = load_corner(job.room, corners + i * kLanes);
    speeds[i] = load_corner(job.room + kSpeed, corners + i * kLanes);
  }
  const Modes3 x = transform(places), v = transform(speeds);
  const Gradients g = differentiate(x);
  const V inverse = hn::Div(num(1), g.volume);

  // velocity gradient times the step (eq. 5)
  const V rate = mul(inverse, num(step.past));
  const auto row = [&](V va, V vb, V vc, V vd, V ve, V vf) HWY_ATTR {
    const V3 r = fma(vf, g.f, fma(ve, g.e, fma(vd, g.d, fma(vc, g.c, fma(vb, g.b, scale(va, g.a))))));
    return scale(rate, r);
  };
  const Matrix L{row(v.a.x, v.b.x, v.c.x, v.d.x, v.e.x, v.f.x), row(v.a.y, v.b.y, v.c.y, v.d.y, v.e.y, v.f.y),
                 row(v.a.z, v.b.z, v.c.z, v.d.z, v.e.z, v.f.z)};
  const V trace = add(add(L.x.x, L.y.y), L.z.z);

  // mean stress: turned with the element (Jaumann), then elastic (eq. 7)
  V sxx = load_field(element, kStress), syy = load_field(element, kStress + 1), szz = load_field(element, kStress + 2);
  V sxy = load_field(element, kStress + 3), syz = load_field(element, kStress + 4),
    szx = load_field(element, kStress + 5);
  {
    const V half = num(0.5);
    const V wxy = mul(half, sub(L.x.y, L.y.x)), wyz = mul(half, sub(L.y.z, L.z.y)), wxz = mul(half, sub(L.x.z, L.z.x));
    const V a = mul(wxy, sxy), b = mul(wxz, szx), c = mul(wyz, syz);
    const V txy = fma(wxy, sub(syy, sxx), fma(wxz, syz, mul(wyz, szx)));
    const V txz = fma(wxz, sub(szz, sxx), fms(wxy, syz, mul(wyz, sxy)));
    const V tyz = fnma(wxz, sxy, fnma(wxy, szx, mul(wyz, sub(szz, syy))));
    const V ab = add(a, b), ca = sub(c, a), bc = add(b, c);
    const V pressure = mul(num(law.lambda), trace), mu2 = num(2 * law.mu), mu = num(law.mu);
    sxx = add(sxx, fma(mu2, L.x.x, add(pressure, add(ab, ab))));
    syy = add(syy, fma(mu2, L.y.y, add(pressure, add(ca, ca))));
    szz = add(szz, fma(mu2, L.z.z, sub(pressure, add(bc, bc))));
    sxy = add(sxy, fma(mu, add(L.x.y, L.y.x), txy));
    syz = add(syz, fma(mu, add(L.y.z, L.z.y), tyz));
    szx = add(szx, fma(mu, add(L.x.z, L.z.x), txz));
  }

  // what varies over the element (eq. 8 to 11)
  const V length_a = dot(x.a, x.a), length_b = dot(x.b, x.b), length_c = dot(x.c, x.c);
  const V all = hn::Div(num(1), mul(length_a, mul(length_b, length_c)));
  const V ia = mul(all, mul(length_b, length_c)), ib = mul(all, mul(length_c, length_a)),
          ic = mul(all, mul(length_a, length_b));
  Amplitudes s;
  {
    const V h = num(step.past);
    const auto beyond = [&](const V3& vm, const V3& xm) HWY_ATTR {
      const V3 linear = times(L, xm);
      return V3{fms(h, vm.x, linear.x), fms(h, vm.y, linear.y), fms(h, vm.z, linear.z)};
    };
    const V3 q1 = beyond(v.d, x.d), q2 = beyond(v.e, x.e), q3 = beyond(v.f, x.f), q4 = beyond(v.g, x.g);
    const V3 A = scale(ia, x.a), B = scale(ib, x.b), C = scale(ic, x.c);
    const V e = num(law.bending), enu = num(law.bending * law.nu), mu = num(law.mu), E = num(law.E);
    const V x2 = dot(A, q2), x3 = dot(A, q3), y1 = dot(B, q1), y3 = dot(B, q3), z1 = dot(C, q1), z2 = dot(C, q2);
    s.bending[0] = fma(e, x2, fma(enu, y1, load_field(element, kBending)));
    s.bending[1] = fma(e, y1, fma(enu, x2, load_field(element, kBending + 1)));
    s.bending[2] = fma(e, x3, fma(enu, z1, load_field(element, kBending + 2)));
    s.bending[3] = fma(e, z1, fma(enu, x3, load_field(element, kBending + 3)));
    s.bending[4] = fma(e, y3, fma(enu, z2, load_field(element, kBending + 4)));
    s.bending[5] = fma(e, z2, fma(enu, y3, load_field(element, kBending + 5)));
    const V x1 = dot(x.a, q1), y2 = dot(x.b, q2), z3 = dot(x.c, q3);
    s.twist[0] = fma(mu, add(x1, y2), load_field(element, kTwist));
    s.twist[1] = fma(mu, add(x1, z3), load_field(element, kTwist + 1));
    s.twist[2] = fma(mu, add(y2, z3), load_field(element, kTwist + 2));
    s.corner[0] = fma(E, dot(A, q4), load_field(element, kCorner));
    s.corner[1] = fma(E, dot(B, q4), load_field(element, kCorner + 1));
    s.corner[2] = fma(E, dot(C, q4), load_field(element, kCorner + 2));
  }
  const V iab = mul(ia, ib), iac = mul(ia, ic), ibc = mul(ib, ic);
  const V mass = load_field(element, kMass);
  const V volume = mul(num(1.0 / 64), g.volume);
  const auto live = hn::Gt(mass, zero);

  if (law.points > 0) {
    V strain = load_field(element, kStrain);
    Yield y;
    V pure;  // bending that a section without normal force bears, over 1.5 elastic stresses (eq. 14)
    if (hn::AllTrue(d, hn::Eq(strain, zero))) {
      const double t = law.tension[0], c = law.compression[0];
      y = {num(t), num(law.tension_slope[0]), num(c), num(law.compression_slope[0])};
      pure = num(2 / 1.5 * t * c / (t + c));
    } else {
      y = find_yield(law, strain);
      pure = hn::Div(mul(num(2 / 1.5), mul(y.tension, y.compression)), add(y.tension, y.compression));
    }
    V mean = mul(num(1.0 / 3), add(sxx, add(syy, szz)));
    const V dx = sub(sxx, mean), dy = sub(syy, mean), dz = sub(szz, mean);
    const V q2 =
        mul(num(1.5), fma(dx, dx, fma(dy, dy, fma(dz, dz, mul(num(2), fma(sxy, sxy, fma(syz, syz, mul(szx, szx))))))));
    // share of compression (eq. 12)
    const V w = hn::Min(num(1), hn::Max(zero, mul(num(law.per_pressure), sub(num(-law.least_pressure), mean))));
    const V limit = fma(sub(y.compression, y.tension), w, y.tension);
    V h2 = zero;
    for (int k = 0; k < 6; k += 2) {
      const V a = s.bending[k], b = s.bending[k + 1];
      h2 = add(h2, fma(a, sub(a, b), mul(b, b)));
    }
    const V t2 = fma(mul(s.twist[0], s.twist[0]), iab,
                     fma(mul(s.twist[1], s.twist[1]), iac, mul(mul(s.twist[2], s.twist[2]), ibc)));
    const V corner2 = fma(s.corner[0], s.corner[0], fma(s.corner[1], s.corner[1], mul(s.corner[2], s.corner[2])));
    h2 = fma(num(3), t2, fma(num(1.0 / 3), corner2, h2));
    const V top = mul(num(law.cutoff), y.tension), limit2 = mul(limit, limit);
    // a bound of what eq. 14 says, without roots
    const V bent2_limit2 = mul(h2, mul(pure, pure));
    const auto may_flow = hn::Gt(mul(num(1.2886751345948130), fma(q2, limit2, bent2_limit2)), mul(limit2, limit2));
    const auto tears = hn::Gt(mean, top);
    if (HWY_UNLIKELY(!hn::AllFalse(d, hn::And(live, hn::Or(may_flow, tears))))) {
      const V bent2 = hn::Div(bent2_limit2, limit2);
      // mean stress and what varies come back together, the more so the more they are of one kind (eq. 13, 14)
      const auto along = [&](const V3& u) HWY_ATTR {
        return V3{fma(dx, u.x, fma(sxy, u.y, mul(szx, u.z))), fma(sxy, u.x, fma(dy, u.y, mul(syz, u.z))),
                  fma(szx, u.x, fma(syz, u.y, mul(dz, u.z)))};
      };
      const V3 da = along(x.a), db = along(x.b), dc = along(x.c);
      const V daa = mul(ia, dot(x.a, da)), dbb = mul(ib, dot(x.b, db)), dcc = mul(ic, dot(x.c, dc));
      const V two = num(2);
      const V k1 = fma(daa, s.bending[0], fma(dbb, s.bending[1], mul(two, mul(mul(iab, dot(x.a, db)), s.twist[0]))));
      const V k2 = fma(daa, s.bending[2], fma(dcc, s.bending[3], mul(two, mul(mul(iac, dot(x.a, dc)), s.twist[1]))));
      const V k3 = fma(dbb, s.bending[4], fma(dcc, s.bending[5], mul(two, mul(mul(ibc, dot(x.b, dc)), s.twist[2]))));
      const V alike = mul(num(1.5), hn::Sqrt(fma(k1, k1, fma(k2, k2, mul(k3, k3)))));
      const V common = hn::Div(mul(alike, pure), limit);
      const V q = hn::Sqrt(hn::Max(fma(num(0.57735026918962576), common, add(q2, bent2)), num(1e-300)));
      const V slope = fma(sub(y.compression_slope, y.tension_slope), w, y.tension_slope);
      const V mu3 = num(3 * law.mu);
      const V flow = hn::Max(zero, hn::Div(sub(q, limit), add(mu3, slope)));
      const V keep = fnma(mu3, hn::Div(flow, hn::Max(q, num(1e-300))), num(1));
      const V part = mul(keep, sub(num(1), keep));
      const V opening = hn::Max(zero, hn::Div(sub(mean, top), num(law.bulk)));
      mean = hn::Min(mean, top);
      sxx = fma(dx, keep, mean), syy = fma(dy, keep, mean), szz = fma(dz, keep, mean);
      sxy = mul(sxy, keep), syz = mul(syz, keep), szx = mul(szx, keep);
      // an infinite cutoff leaves no opening, but infinity times nothing
      const V torn = hn::IfThenElseZero(tears, mul(hn::Min(top, num(1e300)), opening));
      const V spent = fma(mul(part, q2), num(1 / (3 * law.mu)), torn);
      sums.mean = add(sums.mean, hn::IfThenElseZero(live, mul(volume, spent)));
      V stored = zero;  // three times twice the energy over the volume
      for (int k = 0; k < 6; k += 2) {
        const V a = s.bending[k], b = s.bending[k + 1];
        stored = add(stored, fnma(mul(num(2 * law.nu), a), b, fma(a, a, mul(b, b))));
      }
      const V corner_energy = mul(num(1.0 / (9 * law.E)), corner2);
      stored = fma(num(1.0 / (3 * law.E)), stored, fma(num(1.0 / (3 * law.mu)), t2, corner_energy));
      const V weight = mul(volume, part);
      sums.varying = add(sums.varying, hn::IfThenElseZero(live, mul(weight, stored)));
      sums.corner = add(sums.corner, hn::IfThenElseZero(live, mul(weight, corner_energy)));
      for (V& a : s.bending) a = mul(a, keep);
      for (V& a : s.twist) a = mul(a, keep);
      for (V& a : s.corner) a = mul(a, keep);
      const V more = add(flow, opening);
      strain = add(strain, more);
      const V wear = fma(num(law.compression_rate - law.tension_rate), w, num(law.tension_rate));
      const V damage = fma(more, wear, load_field(element, kDamage));
      store_field(strain, element, kStrain);
      store_field(damage, element, kDamage);
      const auto gone = hn::And(live, hn::Ge(damage, num(1)));
      if (HWY_UNLIKELY(step.removes && !hn::AllFalse(d, gone))) {
        HWY_ALIGN double pressed[kLanes], lane_damage[kLanes], lane_mass[kLanes];
        hn::Store(mean, d, pressed), hn::Store(damage, d, lane_damage), hn::Store(mass, d, lane_mass);
        for (size_t l = 0; l < kLanes; ++l)
          if (lane_mass[l] > 0 && lane_damage[l] >= 1)
            job.failed->push_back(static_cast<std::uint32_t>(4 * (block * kLanes + l) + (pressed[l] > 0 ? 1 : 2)));
      }
    }
  }

  // too short for the step (eq. 16), or turned inside out
  {
    const V aa = dot(g.a, g.a), bb = dot(g.b, g.b), cc = dot(g.c, g.c);
    const V stiff = fma(num(law.lambda), add(aa, add(bb, cc)), mul(num(2 * law.mu), hn::Max(aa, hn::Max(bb, cc))));
    const auto lost = hn::And(live, hn::Gt(mul(num(step.h * step.h), stiff), mul(num(4), mul(mass, g.volume))));
    if (HWY_UNLIKELY(step.removes && !hn::AllFalse(d, lost))) {
      HWY_ALIGN double bits[kLanes];
      hn::Store(hn::IfThenElseZero(lost, num(1)), d, bits);
      for (size_t l = 0; l < kLanes; ++l)
        if (bits[l] > 0) job.failed->push_back(static_cast<std::uint32_t>(4 * (block * kLanes + l) + 3));
    }
  }

  store_field(sxx, element, kStress), store_field(syy, element, kStress + 1), store_field(szz, element, kStress + 2);
  store_field(sxy, element, kStress + 3), store_field(syz, element, kStress + 4);
  store_field(szx, element, kStress + 5);
  for (int k = 0; k < 6; ++k) store_field(s.bending[k], element, kBending + k);
  for (int k = 0; k < 3; ++k) store_field(s.twist[k], element, kTwist + k);
  for (int k = 0; k < 3; ++k) store_field(s.corner[k], element, kCorner + k);

  // bulk viscosity of a closing element (eq. 15)
  {
    const V closing = hn::Max(zero, mul(num(-1 / step.h), trace));
    const V length = load_field(element, kLength);
    const V pressure =
        mul(mul(mul(num(64), mul(mass, inverse)), mul(length, closing)),
            fma(num(step.quadratic * step.quadratic), mul(length, closing), num(step.linear * law.speed)));
    const V both = mul(num(-0.5), add(pressure, load_field(element, kViscous)));
    store_field(pressure, element, kViscous);
    sums.viscous = fma(mul(both, trace), volume, sums.viscous);
    sxx = sub(sxx, pressure), syy = sub(syy, pressure), szz = sub(szz, pressure);
  }

  // forces of the modes (eq. 6, 9): 64 times
  V third_volume = mul(num(-1.0 / 3), g.volume);
  if (HWY_UNLIKELY(job.live[block] != (1U << kLanes) - 1)) {
    third_volume = hn::IfThenElseZero(live, third_volume);
    sxx = hn::IfThenElseZero(live, sxx), syy = hn::IfThenElseZero(live, syy), szz = hn::IfThenElseZero(live, szz);
    sxy = hn::IfThenElseZero(live, sxy), syz = hn::IfThenElseZero(live, syz), szx = hn::IfThenElseZero(live, szx);
  }
  const V n1x = fma(s.twist[0], iab, mul(s.twist[1], iac)), n2y = fma(s.twist[0], iab, mul(s.twist[2], ibc)),
          n3z = fma(s.twist[1], iac, mul(s.twist[2], ibc));
  const V3 A = scale(third_volume, x.a), B = scale(third_volume, x.b), C = scale(third_volume, x.c);
  const auto combine = [&](V a, V b, V c) HWY_ATTR { return fma(c, C, fma(b, B, scale(a, A))); };
  V3 p1 = combine(n1x, mul(s.bending[1], ib), mul(s.bending[3], ic));
  V3 p2 = combine(mul(s.bending[0], ia), n2y, mul(s.bending[5], ic));
  V3 p3 = combine(mul(s.bending[2], ia), mul(s.bending[4], ib), n3z);
  const V third = num(1.0 / 3);
  const V3 p4 =
      combine(mul(third, mul(s.corner[0], ia)), mul(third, mul(s.corner[1], ib)), mul(third, mul(s.corner[2], ic)));
  // forces are against the stress; the linear part of the modes goes to the mean one
  const auto effective = [&](V sx, V sy, V sz, V a, V b, V c, V e) HWY_ATTR {
    const V3 moved = fma(e, x.g, fma(c, x.f, fma(b, x.e, scale(a, x.d))));
    const V3 back = scale(inverse, moved);
    return V3{hn::Neg(add(sx, back.x)), hn::Neg(add(sy, back.y)), hn::Neg(add(sz, back.z))};
  };
  const Matrix t{effective(sxx, sxy, szx, p1.x, p2.x, p3.x, p4.x), effective(sxy, syy, syz, p1.y, p2.y, p3.y, p4.y),
                 effective(szx, syz, szz, p1.z, p2.z, p3.z, p4.z)};
  const V3 fa = times(t, g.a), fb = times(t, g.b), fc = times(t, g.c);
  p1 = add(p1, times(t, g.d)), p2 = add(p2, times(t, g.e)), p3 = add(p3, times(t, g.f));
  const V share = num(1.0 / 64);
  V nx[8], ny[8], nz[8];
  const auto modes = [&](V a, V b, V c, V dd, V e, V f, V gg) HWY_ATTR {
    return Modes{mul(share, a), mul(share, b), mul(share, c), mul(share, dd),
                 mul(share, e), mul(share, f), mul(share, gg)};
  };
  spread(modes(fa.x, fb.x, fc.x, p1.x, p2.x, p3.x, p4.x), nx);
  spread(modes(fa.y, fb.y, fc.y, p1.y, p2.y, p3.y, p4.y), ny);
  spread(modes(fa.z, fb.z, fc.z, p1.z, p2.z, p3.z, p4.z), nz);
  for (size_t i = 0; i < 8; ++i) add_corner({nx[i], ny[i], nz[i]}, forces, corners + i * kLanes);
}

/// Rows are read in vectors of up to four.
using Row = hn::CappedTag<double, 4>;
constexpr size_t kRowLanes = hn::MaxLanes(Row());

/// Factors of a step for the entries of a row.
struct Motion {
  HWY_ALIGN double keep[4];  // of speeds
  HWY_ALIGN double fall[4];  // added to speeds
  HWY_ALIGN double drift[4];
  double kick = 0;
};
HWY_INLINE Motion make_motion(const StepJob& step) {
  Motion m{};
  for (int c = 0; c < 3; ++c) m.keep[c] = step.keep, m.fall[c] = step.fall[c], m.drift[c] = step.h;
  m.keep[3] = 1, m.kick = step.kick;
  return m;
}

/// Motion of one node; `force` has 4 entries, the last 0. Returns whether it is below a ground.
HWY_INLINE bool move_node(const StepJob& step, const Motion& motion, double* HWY_RESTRICT node,
                          const double* HWY_RESTRICT force, std::uint8_t flags, const double* HWY_RESTRICT push) {
  const Row d;
  const double inverse = node[kInverseMass];
  if (HWY_UNLIKELY(!(inverse > 0))) return false;
  const auto kick = hn::Set(d, motion.kick * inverse);
  double* v = node + kSpeed;
  if (HWY_LIKELY(flags == 0)) {
    for (size_t c = 0; c < 4; c += kRowLanes) {
      const auto speed =
          hn::MulAdd(kick, hn::Load(d, force + c),
                     hn::MulAdd(hn::Load(d, motion.keep + c), hn::Load(d, v + c), hn::Load(d, motion.fall + c)));
      hn::Store(speed, d, v + c);
      hn::Store(hn::MulAdd(hn::Load(d, motion.drift + c), speed, hn::Load(d, node + c)), d, node + c);
    }
  } else {
    const bool pushed = (flags & kPushed) != 0;
    for (int c = 0; c < 3; ++c) {
      const double f = pushed ? force[c] + push[c] : force[c];
      v[c] = (flags & (1 << c)) != 0 ? 0 : motion.keep[c] * v[c] + motion.kick * inverse * f + motion.fall[c];
      node[c] += step.h * v[c];
    }
  }
  bool below = false;
  for (int i = 0; i < step.grounds; ++i) {
    const double* n = step.ground[i];
    below = below || (n[0] * node[0] + n[1] * node[1] + n[2] * node[2] < n[3]);
  }
  return below;
}

void advance_chunk(const StepJob& step, ChunkJob& job) {
  double* HWY_RESTRICT rows = job.room;
  double* HWY_RESTRICT forces = job.room + 8;
  // places in the middle of the last step
  const Row row;
  HWY_ALIGN double back[4] = {-0.5 * step.past, -0.5 * step.past, -0.5 * step.past, 0};
  const auto copy = [&](const double* HWY_RESTRICT from, double* HWY_RESTRICT to) HWY_ATTR {
    for (size_t c = 0; c < 4; c += kRowLanes) {
      const auto speed = hn::Load(row, from + kSpeed + c);
      hn::Store(hn::MulAdd(hn::Load(row, back + c), speed, hn::Load(row, from + c)), row, to + c);
      hn::Store(speed, row, to + kSpeed + c);
      hn::Store(hn::Zero(row), row, to + 8 + c);
    }
  };
  constexpr size_t kAhead = 12;  // rows of other chunks, all over memory
  for (size_t i = 0; i < std::min(kAhead, job.shared); ++i)
    hwy::Prefetch(job.nodes + 8 * static_cast<size_t>(job.shared_nodes[i]));
  for (size_t i = 0; i < job.own; ++i) copy(job.own_nodes + 8 * i, rows + kRoomFields * i);
  for (size_t i = 0; i < job.shared; ++i) {
    if (i + kAhead < job.shared) hwy::Prefetch(job.nodes + 8 * static_cast<size_t>(job.shared_nodes[i + kAhead]));
    copy(job.nodes + 8 * static_cast<size_t>(job.shared_nodes[i]), rows + kRoomFields * (job.own + i));
  }

  const D d;
  Sums sums{hn::Zero(d), hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  for (size_t block = 0; block < job.blocks; ++block)
    if (job.live[block] != 0) advance_block(step, job, block, forces, sums);
  const V* vectors[4] = {&sums.mean, &sums.varying, &sums.corner, &sums.viscous};
  for (int i = 0; i < 4; ++i) job.sums[i] += hn::GetLane(hn::SumOfLanes(d, *vectors[i]));

  const Motion motion = make_motion(step);
  for (size_t i = 0; i < job.own; ++i)
    if (move_node(step, motion, job.own_nodes + 8 * i, forces + kRoomFields * i, job.own_flags[i],
                  job.own_pushes + 4 * i))
      job.grounded->push_back(static_cast<std::uint32_t>(i));
  for (size_t i = 0; i < job.shared; ++i)
    std::memcpy(job.shared_forces + 4 * i, forces + kRoomFields * (job.own + i), 4 * sizeof(double));
}

void advance_shared(const StepJob& step, const SharedJob& job) {
  const Motion motion = make_motion(step);
  for (size_t i = job.first; i < job.last; ++i) {
    HWY_ALIGN double f[4] = {0, 0, 0, 0};
    for (std::uint32_t k = job.starts[i]; k < job.starts[i + 1]; ++k) {
      const double* HWY_RESTRICT from = job.forces + 4 * static_cast<size_t>(job.entries[k]);
      for (int c = 0; c < 4; ++c) f[c] += from[c];
    }
    const size_t row = job.first_row + i;
    if (move_node(step, motion, job.nodes + 8 * row, f, job.flags[row], job.pushes + 4 * row))
      job.grounded->push_back(static_cast<std::uint32_t>(row));
  }
}

size_t count_lanes() { return kLanes; }
const char* name_target() { return hwy::TargetName(HWY_TARGET); }

}  // namespace HWY_NAMESPACE
}  // namespace topple::fem::kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace topple::fem::kernel {

HWY_EXPORT(count_lanes);
HWY_EXPORT(name_target);
HWY_EXPORT(advance_chunk);
HWY_EXPORT(advance_shared);

size_t lanes() { return HWY_DYNAMIC_DISPATCH(count_lanes)(); }
std::string target_name() { return HWY_DYNAMIC_DISPATCH(name_target)(); }
void advance_chunk(const StepJob& step, ChunkJob& job) { HWY_DYNAMIC_DISPATCH(advance_chunk)(step, job); }
void advance_shared(const StepJob& step, const SharedJob& job) { HWY_DYNAMIC_DISPATCH(advance_shared)(step, job); }

}  // namespace topple::fem::kernel
#endif
