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

/// Two components of one corner of all lanes.
struct Pair {
  V first, second;
};
#if HWY_TARGET == HWY_SCALAR
HWY_INLINE Pair load_pair(const double* HWY_RESTRICT rows, const std::uint16_t* HWY_RESTRICT node) {
  const double* at = rows + node[0];
  return {num(at[0]), num(at[1])};
}
HWY_INLINE void add_corner(V x, V y, V z, double* HWY_RESTRICT rows, const std::uint16_t* HWY_RESTRICT node) {
  double* at = rows + node[0] / 2;
  at[0] += hn::GetLane(x), at[1] += hn::GetLane(y), at[2] += hn::GetLane(z);
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
HWY_INLINE Pair load_pair(const double* HWY_RESTRICT rows, const std::uint16_t* HWY_RESTRICT node) {
  const D d;
  const V even = load_pairs(d, rows, node), odd = load_pairs(d, rows, node + 1);
  return {hn::InterleaveLower(d, even, odd), hn::InterleaveUpper(d, even, odd)};
}

/// A node's force, of half as many numbers as its row: no arithmetic, four bytes for one of the offset.
HWY_INLINE double* force_at(double* HWY_RESTRICT forces, size_t node) {
  return reinterpret_cast<double*>(reinterpret_cast<char*>(forces) + 4 * node);
}

/// Adds vectors of x y and z 0 of every second lane, as load_pairs gives them, to rows of forces.
template <class D2>
HWY_INLINE void add_rows(D2 d, hn::Vec<D2> xy0, hn::Vec<D2> z0, hn::Vec<D2> xy1, hn::Vec<D2> z1,
                         double* HWY_RESTRICT rows, const std::uint16_t* HWY_RESTRICT node) {
  constexpr size_t kHere = hn::MaxLanes(D2());
  const auto add_to = [&](hn::Vec<D2> f, double* at) HWY_ATTR { hn::Store(hn::Add(hn::Load(d, at), f), d, at); };
  if constexpr (kHere == 2) {
    add_to(xy0, force_at(rows, node[0])), add_to(z0, force_at(rows, node[0]) + 2);
    add_to(xy1, force_at(rows, node[1])), add_to(z1, force_at(rows, node[1]) + 2);
  } else if constexpr (kHere == 4) {
    add_to(hn::ConcatLowerLower(d, z0, xy0), force_at(rows, node[0]));
    add_to(hn::ConcatLowerLower(d, z1, xy1), force_at(rows, node[1]));
    add_to(hn::ConcatUpperUpper(d, z0, xy0), force_at(rows, node[2]));
    add_to(hn::ConcatUpperUpper(d, z1, xy1), force_at(rows, node[3]));
  } else {
    const hn::Half<D2> half;
    add_rows(half, hn::LowerHalf(half, xy0), hn::LowerHalf(half, z0), hn::LowerHalf(half, xy1), hn::LowerHalf(half, z1),
             rows, node);
    add_rows(half, hn::UpperHalf(half, xy0), hn::UpperHalf(half, z0), hn::UpperHalf(half, xy1), hn::UpperHalf(half, z1),
             rows, node + kHere / 2);
  }
}
HWY_INLINE void add_corner(V x, V y, V z, double* HWY_RESTRICT rows, const std::uint16_t* HWY_RESTRICT node) {
  const D d;
  add_rows(d, hn::InterleaveLower(d, x, y), hn::InterleaveLower(d, z, hn::Zero(d)), hn::InterleaveUpper(d, x, y),
           hn::InterleaveUpper(d, z, hn::Zero(d)), rows, node);
}
#endif

/// Makes the compiler read again what a pointer points to: cheaper than addresses that wait in memory.
HWY_INLINE void reread(const std::uint16_t*& pointer) {
#if defined(__GNUC__)
  asm("" : "+r"(pointer));
#else
  (void)pointer;
#endif
}

/// Sums over the corners of a face ζ = const with the signs of 1 ξ η ξη.
struct Quad {
  V one, x, y, xy;
};
struct QuadPair {
  Quad first, second;
};
HWY_INLINE Quad transform(V n0, V n1, V n2, V n3) {
  const V s0 = add(n1, n0), d0 = sub(n1, n0), s1 = add(n2, n3), d1 = sub(n2, n3);
  return {add(s1, s0), add(d1, d0), sub(s1, s0), sub(d1, d0)};
}
HWY_INLINE QuadPair load_face(const double* HWY_RESTRICT rows, const std::uint16_t* HWY_RESTRICT corners) {
  const Pair n0 = load_pair(rows, corners), n1 = load_pair(rows, corners + kLanes);
  const Pair n3 = load_pair(rows, corners + 3 * kLanes), n2 = load_pair(rows, corners + 2 * kLanes);
  return {transform(n0.first, n1.first, n2.first, n3.first), transform(n0.second, n1.second, n2.second, n3.second)};
}

/// Sums over the corners with the signs of ξ η ζ ηζ ζξ ξη ξηζ: eight times the modal amplitudes (eq. 1).
struct Modes {
  V a, b, c, d, e, f, g;
};
HWY_INLINE Modes transform(const Quad& low, const Quad& high) {
  return {add(high.x, low.x), add(high.y, low.y),   sub(high.one, low.one), sub(high.y, low.y),
          sub(high.x, low.x), add(high.xy, low.xy), sub(high.xy, low.xy)};
}
struct Modes3 {
  V3 a, b, c, d, e, f, g;
};

/// Modes of places and speeds of a block, gathered while the block before it is worked on.
struct Gathered {
  // modes a to g of x y z, then of the speeds
  static constexpr size_t kSize = 42 * kLanes;
  double* HWY_RESTRICT at;

  HWY_INLINE void put(size_t number, const Modes& m) const {
    const D d;
    double* to = at + number * kLanes;
    const V all[7] = {m.a, m.b, m.c, m.d, m.e, m.f, m.g};
    for (size_t i = 0; i < 7; ++i) hn::Store(all[i], d, to + 6 * i * kLanes);
  }
  HWY_INLINE V3 place(size_t mode) const { return load(6 * mode); }
  HWY_INLINE V3 speed(size_t mode) const { return load(6 * mode + 3); }

 private:
  HWY_INLINE V3 load(size_t i) const {
    const D d;
    return {hn::Load(d, at + i * kLanes), hn::Load(d, at + (i + 1) * kLanes), hn::Load(d, at + (i + 2) * kLanes)};
  }
};
/// Sums over corners of the face between two blocks of a strip.
struct Face {
  static constexpr size_t kSize = 24 * kLanes;
  double* HWY_RESTRICT at;

  HWY_INLINE void put(size_t number, const Quad& q) const {
    const D d;
    double* to = at + 4 * number * kLanes;
    hn::Store(q.one, d, to), hn::Store(q.x, d, to + kLanes);
    hn::Store(q.y, d, to + 2 * kLanes), hn::Store(q.xy, d, to + 3 * kLanes);
  }
  HWY_INLINE Quad get(size_t number) const {
    const D d;
    const double* from = at + 4 * number * kLanes;
    return {hn::Load(d, from), hn::Load(d, from + kLanes), hn::Load(d, from + 2 * kLanes),
            hn::Load(d, from + 3 * kLanes)};
  }
};
/// Sums of places in the middle of the last step.
HWY_INLINE Quad take_back(const Quad& place, V half, const Quad& speed) {
  return {fnma(half, speed.one, place.one), fnma(half, speed.x, place.x), fnma(half, speed.y, place.y),
          fnma(half, speed.xy, place.xy)};
}
/// The face ζ = -1 of a strip's first block.
HWY_NOINLINE void gather_low(const double* HWY_RESTRICT rows, const std::uint16_t* corners, double half,
                             const Face& low) {
  for (size_t pair = 0; pair < 3; ++pair) {
    const QuadPair face = load_face(rows + 2 * pair, corners);
    low.put(2 * pair, face.first), low.put(2 * pair + 1, face.second);
  }
  for (size_t axis = 0; axis < 3; ++axis) low.put(axis, take_back(low.get(axis), num(half), low.get(3 + axis)));
}
/// A block's modes of a pair of numbers that lie side by side in the rows of nodes, in this order: 2 speeds along y z,
/// 1 z and speed along x, 0 x y. `face` is the one ζ = -1 before and ζ = +1 after.
///   half  of the last step
HWY_INLINE void gather(const double* HWY_RESTRICT rows, const std::uint16_t* corners, size_t pair, double half,
                       const Face& face, const Gathered& to) {
  reread(corners);
  QuadPair high = load_face(rows + 2 * pair, corners + 4 * kLanes);
  const auto put = [&](size_t number, const Quad& q) HWY_ATTR {
    to.put(number, transform(face.get(number), q));
    face.put(number, q);
  };
  if (pair == 0) {
    high.first = take_back(high.first, num(half), face.get(3));
    high.second = take_back(high.second, num(half), face.get(4));
  }
  if (pair == 1) high.first = take_back(high.first, num(half), face.get(5));
  put(2 * pair, high.first), put(2 * pair + 1, high.second);
}

/// Derivatives of the volume by the modes but for factors (eq. 3, 4).
struct Gradients {
  V3 a, b, c, d, e, f;
  V volume;  // 64 times
};
/// a×b + c×d
HWY_INLINE V3 cross_sum(const V3& a, const V3& b, const V3& c, const V3& d) {
  return {fnma(c.z, d.y, fma(c.y, d.z, fnma(a.z, b.y, mul(a.y, b.z)))),
          fnma(c.x, d.z, fma(c.z, d.x, fnma(a.x, b.z, mul(a.z, b.x)))),
          fnma(c.y, d.x, fma(c.x, d.y, fnma(a.y, b.x, mul(a.x, b.y))))};
}
HWY_INLINE Gradients differentiate(const Modes3& m) {
  const V third = num(1.0 / 3);
  const V3 d = scale(third, m.d), e = scale(third, m.e), f = scale(third, m.f);
  Gradients g;
  g.a = cross_sum(m.b, m.c, f, m.e);
  g.b = cross_sum(m.c, m.a, d, m.f);
  g.c = cross_sum(m.a, m.b, e, m.d);
  g.d = cross_sum(m.c, e, f, m.b);
  g.e = cross_sum(d, m.c, m.a, f);
  g.f = cross_sum(m.b, d, e, m.a);
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
    if (hn::AllFalse(D(), past)) break;
    t = hn::IfThenElse(past, num(law.tension[k]), t), ts = hn::IfThenElse(past, num(law.tension_slope[k]), ts);
    c = hn::IfThenElse(past, num(law.compression[k]), c);
    cs = hn::IfThenElse(past, num(law.compression_slope[k]), cs);
  }
  return {fma(ts, strain, t), ts, fma(cs, strain, c), cs};
}

/// What a block may bear beside its mean stress, in stages that wait for roots and quotients.
struct Capacity {
  Yield yield;
  V mean, dx, dy, dz;  // of the mean stress, and its deviator
  V q2;                // its equivalent stress, squared
  V w, limit;          // eq. 12
  V per_bending;       // m / h (eq. 14)

  HWY_INLINE void begin(const Law& law, V strain, V sxx, V syy, V szz, V sxy, V syz, V szx) {
    yield = find_yield(law, strain);
    mean = mul(num(1.0 / 3), add(sxx, add(syy, szz)));
    dx = sub(sxx, mean), dy = sub(syy, mean), dz = sub(szz, mean);
    // short chains of sums: here all waits for one number
    const V shear2 = fma(sxy, sxy, fma(syz, syz, mul(szx, szx))), normal2 = fma(dx, dx, fma(dy, dy, mul(dz, dz)));
    q2 = fma(num(3), shear2, mul(num(1.5), normal2));
  }
  HWY_INLINE void take_root() {
    root_ = hn::Sqrt(q2);
    both_ = add(yield.tension, yield.compression);
    const V pressed = hn::Min(both_, hn::Max(hn::Zero(D()), fnma(num(3), mean, yield.tension)));  // w times both
    const V line = fma(sub(yield.compression, yield.tension), pressed, mul(yield.tension, both_));
    // one quotient for those by `both_` and by `line`, the limit times it
    const V per = hn::Div(num(1), mul(line, both_)), per_both = mul(per, line);
    per_ = mul(per, both_);
    w = mul(pressed, per_both);
    pressed_ = hn::Gt(pressed, yield.tension);
    own_ = hn::IfThenElse(pressed_, yield.compression, yield.tension);
    // at its ends the limit is a strength to the last digit
    const auto inside = hn::And(hn::Gt(pressed, hn::Zero(D())), hn::Lt(pressed, both_));
    limit = hn::IfThenElse(inside, mul(line, per_both), own_);
  }
  // m / h: what the mean stress may still grow towards its own side (margin over rise) and the other
  HWY_INLINE void divide() {
    const V t = yield.tension, c = yield.compression;
    // at its limit the mean stress is a trifle below it, where the quotient of both margins is still that of g
    const V mean_size = hn::Min(root_, mul(num(1 - 1e-10), limit));
    const V margin = sub(limit, mean_size);
    reached_ = add(limit, mean_size);
    other_ = hn::IfThenElse(pressed_, t, c);
    const V back = mul(mul(num(0.5), reached_), both_), least = mul(own_, add(other_, mean_size));
    opposite_ = hn::IfThenElse(pressed_, hn::Max(back, least), hn::Min(back, least));  // times own
    const V ahead = hn::Max(sub(own_, mean_size), mul(num(1e-15), limit));
    per_side_ = mul(margin, hn::Div(num(1), mul(ahead, opposite_)));
    share_ = mul(own_, ahead);
  }
  HWY_INLINE void end() {
    const V along_line = mul(add(other_, other_), mul(limit, per_)), alone = mul(opposite_, per_side_);
    const V rise = hn::IfThenElse(pressed_, hn::Max(along_line, hn::Min(alone, num(1))), hn::Min(along_line, alone));
    per_bending = mul(mul(num(1.0 / 3), mul(reached_, mul(both_, per_))), fma(share_, per_side_, rise));
  }

 private:
  V root_, both_, per_, own_, reached_, other_, opposite_, per_side_, share_;
  hn::Mask<D> pressed_;
};

struct Sums {
  V mean, varying, corner, viscous;
};

/// Stabilising stresses of a block.
struct Amplitudes {
  V bending[6], twist[3], corner[3];
};

/// Axes ξ η ζ of a block's elements, one over their squares, mean stress.
struct CrackedBlock {
  V3 axis[3];
  V per_square[3];
  V xx, yy, zz, xy, yz, zx;
};

/// Cracks close and open on the line to the stress at which they opened, one axis after the other (eq. 12a).
///   strain  plastic; cracks of elements where it is 0 or beyond the law's stay as they are
/// Returns the work done on them over the volume, negative as they close.
HWY_NOINLINE V adapt_cracks(const Law& law, V strain, CrackedBlock& block, double* HWY_RESTRICT cracks) {
  const D d;
  const V zero = hn::Zero(d), stiffness = num(law.lambda + 2 * law.mu);
  const auto adapts = hn::And(hn::Gt(strain, zero), hn::Lt(strain, num(law.crack_strain)));
  const V per = hn::Div(strain, fma(stiffness, strain, find_yield(law, strain).tension));
  V stress[3], along[3], all = zero, work = zero;
  for (int i = 0; i < 3; ++i) {
    const V3& n = block.axis[i];
    const V3 on{fma(block.xx, n.x, fma(block.xy, n.y, mul(block.zx, n.z))),
                fma(block.xy, n.x, fma(block.yy, n.y, mul(block.yz, n.z))),
                fma(block.zx, n.x, fma(block.yz, n.y, mul(block.zz, n.z)))};
    stress[i] = mul(block.per_square[i], dot(n, on));
  }
  for (int i = 0; i < 3; ++i) {
    const V was = load_field(cracks, i), loaded = fma(num(law.lambda), all, stress[i]);
    const V open = hn::Min(strain, hn::Max(zero, mul(per, fma(stiffness, was, loaded))));
    const V closed = hn::IfThenElseZero(adapts, sub(was, open));
    store_field(sub(was, closed), cracks, i);
    all = add(all, closed);
    work = fnma(closed, fma(stiffness, closed, loaded), work);
    along[i] = mul(block.per_square[i], mul(num(2 * law.mu), closed));
  }
  const V even = mul(num(law.lambda), all);
  block.xx = add(block.xx, even), block.yy = add(block.yy, even), block.zz = add(block.zz, even);
  for (int i = 0; i < 3; ++i) {
    const V3& n = block.axis[i];
    const V3 a = scale(along[i], n);
    block.xx = fma(a.x, n.x, block.xx), block.yy = fma(a.y, n.y, block.yy), block.zz = fma(a.z, n.z, block.zz);
    block.xy = fma(a.x, n.y, block.xy), block.yz = fma(a.y, n.z, block.yz), block.zx = fma(a.z, n.x, block.zx);
  }
  return work;
}

/// What is pulled apart as a block flows opens its cracks.
///   deviator  along ξ η ζ before it flowed, of which `keep` is left
///   swelling  plastic, of the volume; w of (eq. 12)
HWY_NOINLINE void open_cracks(const Law& law, const V* deviator, V keep, V mean, V swelling, V w,
                              double* HWY_RESTRICT cracks) {
  const V zero = hn::Zero(D()), tensile = sub(num(1), w);
  const V sheared = mul(mul(tensile, sub(num(1), keep)), num(0.5 / law.mu));
  const V swollen = mul(tensile, mul(num(1.0 / 3), swelling));
  for (int i = 0; i < 3; ++i) {
    const auto pulled = hn::Gt(fma(deviator[i], keep, mean), zero);
    const V opening = hn::IfThenElseZero(pulled, hn::Max(zero, fma(deviator[i], sheared, swollen)));
    store_field(add(load_field(cracks, i), opening), cracks, i);
  }
}

/// Values at the corners of a face of which parts with 1 ξ η ξη are given.
HWY_INLINE void spread(const Quad& m, V* HWY_RESTRICT n) {
  const V l = sub(m.one, m.y), u = add(m.one, m.y), lx = sub(m.x, m.xy), ux = add(m.x, m.xy);
  n[0] = sub(l, lx), n[1] = add(l, lx), n[2] = add(u, ux), n[3] = sub(u, ux);
}
HWY_INLINE void add_face(const Quad& x, const Quad& y, const Quad& z, double* HWY_RESTRICT rows,
                         const std::uint16_t* HWY_RESTRICT corners) {
  V nx[4], ny[4], nz[4];
  spread(x, nx), spread(y, ny), spread(z, nz);
  for (size_t i = 0; i < 4; ++i) add_corner(nx[i], ny[i], nz[i], rows, corners + i * kLanes);
}

/// Forces on the upper face of a strip's last block.
HWY_NOINLINE void end_strip(const Face& carry, double* HWY_RESTRICT rows, const std::uint16_t* HWY_RESTRICT corners) {
  add_face(carry.get(0), carry.get(1), carry.get(2), rows, corners);
  for (size_t i = 0; i < 12; ++i) hn::Store(hn::Zero(D()), D(), carry.at + i * kLanes);
}

/// Adds the outer product v ⊗ g.
HWY_INLINE void add_product(const V3& v, const V3& g, Matrix& m) {
  m.x = fma(v.x, g, m.x), m.y = fma(v.y, g, m.y), m.z = fma(v.z, g, m.z);
}

/// Everything of a block of elements between the motion of its nodes' modes and their forces. Long chains of arithmetic
/// alternate with gathering the next block, which depends on none of them.
///   next   the block to gather, on the upper face of this one if `joined`
///   face   sums over corners of this block's upper face
///   carry  forces on the lower face from the block before, zero if it is not joined to this one; on the upper one
///   after
HWY_INLINE void advance_block(const StepJob& step, const ChunkJob& job, size_t block, const Gathered& modes,
                              size_t next, bool joined, const Gathered& ahead, const Face& face, const Face& carry,
                              Sums& sums) {
  const D d;
  const Law& law = job.laws[job.law_of_block[block]];
  const std::uint16_t* corners = job.corners + block * 8 * kLanes;
  const std::uint16_t* next_corners = job.corners + next * 8 * kLanes;
  const double* HWY_RESTRICT rows = job.own_nodes;
  double* HWY_RESTRICT cracks = job.cracks + block * 3 * kLanes;
  double* HWY_RESTRICT element = job.elements + block * static_cast<size_t>(kElementFields) * kLanes;
  const V zero = hn::Zero(d);

  // a later block's state on its way
  constexpr size_t kSize = size_t{kElementFields} * kLanes;
  for (size_t i = 0; i < kSize; i += 8) hwy::Prefetch(element + 4 * kSize + i);

  const double half = 0.5 * step.past;
  const Modes3 x{modes.place(0), modes.place(1), modes.place(2), modes.place(3),
                 modes.place(4), modes.place(5), modes.place(6)};
  const V length_a = dot(x.a, x.a), length_b = dot(x.b, x.b), length_c = dot(x.c, x.c);
  const V bc = mul(length_b, length_c);
  const V all = hn::Div(num(1), mul(length_a, bc));
  const V ia = mul(all, bc), ib = mul(all, mul(length_c, length_a)), ic = mul(all, mul(length_a, length_b));
  if (HWY_UNLIKELY(!joined)) gather_low(rows, next_corners, half, face);
  const Gradients g = differentiate(x);
  const V inverse = hn::Div(num(1), g.volume);

  // velocity gradient (eq. 5)
  const V3 va = modes.speed(0);
  Matrix L{scale(va.x, g.a), scale(va.y, g.a), scale(va.z, g.a)};
  add_product(modes.speed(1), g.b, L), add_product(modes.speed(2), g.c, L), add_product(modes.speed(3), g.d, L);
  add_product(modes.speed(4), g.e, L), add_product(modes.speed(5), g.f, L);
  gather(rows, next_corners, 2, half, face, ahead);
  L = {scale(inverse, L.x), scale(inverse, L.y), scale(inverse, L.z)};
  const V trace = add(add(L.x.x, L.y.y), L.z.z);

  // mean stress: turned with the element (Jaumann), then elastic (eq. 7)
  V sxx = load_field(element, kStress), syy = load_field(element, kStress + 1), szz = load_field(element, kStress + 2);
  V sxy = load_field(element, kStress + 3), syz = load_field(element, kStress + 4),
    szx = load_field(element, kStress + 5);
  {
    const V wxy = mul(num(half), sub(L.x.y, L.y.x)), wyz = mul(num(half), sub(L.y.z, L.z.y)),
            wxz = mul(num(half), sub(L.x.z, L.z.x));
    const V a = mul(wxy, sxy), b = mul(wxz, szx), c = mul(wyz, syz);
    const V txy = fma(wxy, sub(syy, sxx), fma(wxz, syz, mul(wyz, szx)));
    const V txz = fma(wxz, sub(szz, sxx), fms(wxy, syz, mul(wyz, sxy)));
    const V tyz = fnma(wxz, sxy, fnma(wxy, szx, mul(wyz, sub(szz, syy))));
    const V ab = add(a, b), ca = sub(c, a), bc2 = add(b, c);
    const V pressure = mul(num(law.step_lambda), trace), mu2 = num(2 * law.step_mu), mu = num(law.step_mu),
            two = num(2);
    sxx = add(sxx, fma(mu2, L.x.x, fma(two, ab, pressure)));
    syy = add(syy, fma(mu2, L.y.y, fma(two, ca, pressure)));
    szz = add(szz, fma(mu2, L.z.z, fnma(two, bc2, pressure)));
    sxy = add(sxy, fma(mu, add(L.x.y, L.y.x), txy));
    syz = add(syz, fma(mu, add(L.y.z, L.z.y), tyz));
    szx = add(szx, fma(mu, add(L.x.z, L.z.x), txz));
  }
  const V mass = load_field(element, kMass);
  const auto live = hn::Gt(mass, zero);

  // what varies over the element (eq. 8 to 11), and between it what else takes its time
  Amplitudes s;
  Capacity cap;
  const bool yields = law.points > 0;
  if (law.crack_strain > 0) {
    const V strain = load_field(element, kStrain);
    if (HWY_UNLIKELY(!hn::AllFalse(d, hn::And(hn::Gt(strain, zero), hn::Lt(strain, num(law.crack_strain)))))) {
      // copies, so that what is called here keeps nothing of the block in memory
      CrackedBlock cracked{{x.a, x.b, x.c}, {ia, ib, ic}, sxx, syy, szz, sxy, syz, szx};
      const V work = adapt_cracks(law, hn::IfThenElseZero(live, strain), cracked, cracks);
      sxx = cracked.xx, syy = cracked.yy, szz = cracked.zz, sxy = cracked.xy, syz = cracked.yz, szx = cracked.zx;
      sums.mean = fma(mul(num(1.0 / 64), g.volume), work, sums.mean);
    }
  }
  {
    const auto beyond = [&](const V3& vm, const V3& xm) HWY_ATTR {
      const auto component = [&](V motion, const V3& l)
                                 HWY_ATTR { return fnma(l.z, xm.z, fnma(l.y, xm.y, fnma(l.x, xm.x, motion))); };
      return V3{component(vm.x, L.x), component(vm.y, L.y), component(vm.z, L.z)};
    };
    const V e = num(law.step_bending), enu = num(law.step_bending_nu), mu = num(law.step_mu), E = num(law.step_E);
    const V3 q1 = beyond(modes.speed(3), x.d);
    const V x1 = dot(x.a, q1), y1 = mul(ib, dot(x.b, q1)), z1 = mul(ic, dot(x.c, q1));
    if (yields) cap.begin(law, load_field(element, kStrain), sxx, syy, szz, sxy, syz, szx);
    if (yields) cap.take_root();
    gather(rows, next_corners, 1, half, face, ahead);
    const V3 q2 = beyond(modes.speed(4), x.e);
    const V x2 = mul(ia, dot(x.a, q2)), y2 = dot(x.b, q2), z2 = mul(ic, dot(x.c, q2));
    s.bending[0] = fma(e, x2, fma(enu, y1, load_field(element, kBending)));
    s.bending[1] = fma(e, y1, fma(enu, x2, load_field(element, kBending + 1)));
    s.twist[0] = fma(mu, add(x1, y2), load_field(element, kTwist));
    if (yields) cap.divide();
    const V3 q3 = beyond(modes.speed(5), x.f);
    const V x3 = mul(ia, dot(x.a, q3)), y3 = mul(ib, dot(x.b, q3)), z3 = dot(x.c, q3);
    s.bending[2] = fma(e, x3, fma(enu, z1, load_field(element, kBending + 2)));
    s.bending[3] = fma(e, z1, fma(enu, x3, load_field(element, kBending + 3)));
    s.twist[1] = fma(mu, add(x1, z3), load_field(element, kTwist + 1));
    s.bending[4] = fma(e, y3, fma(enu, z2, load_field(element, kBending + 4)));
    s.bending[5] = fma(e, z2, fma(enu, y3, load_field(element, kBending + 5)));
    s.twist[2] = fma(mu, add(y2, z3), load_field(element, kTwist + 2));
    gather(rows, next_corners, 0, half, face, ahead);
    if (yields) cap.end();
    const V3 q4 = beyond(modes.speed(6), x.g);
    s.corner[0] = fma(mul(E, ia), dot(x.a, q4), load_field(element, kCorner));
    s.corner[1] = fma(mul(E, ib), dot(x.b, q4), load_field(element, kCorner + 1));
    s.corner[2] = fma(mul(E, ic), dot(x.c, q4), load_field(element, kCorner + 2));
  }

  // too short for the step (eq. 16), or turned inside out
  const V aa = dot(g.a, g.a), bb = dot(g.b, g.b), cc = dot(g.c, g.c);
  const V stiff = fma(num(law.lambda), add(aa, add(bb, cc)), mul(num(2 * law.mu), hn::Max(aa, hn::Max(bb, cc))));
  const auto lost = hn::And(live, hn::Gt(mul(num(step.h * step.h), stiff), mul(num(4), mul(mass, g.volume))));

  if (law.points > 0) {
    const Yield& y = cap.yield;
    const V dx = cap.dx, dy = cap.dy, dz = cap.dz, q2 = cap.q2, w = cap.w, limit = cap.limit;
    const V per_bending = cap.per_bending;
    // what is held sideways cracks and is crushed all the same
    const V top = mul(num(law.tension_cutoff), y.tension), bottom = mul(num(-law.compression_cutoff), y.compression);
    const V mean = hn::Max(hn::Min(cap.mean, top), bottom);
    const auto exceeds = hn::Ne(mean, cap.mean);
    const V iab = mul(ia, ib), iac = mul(ia, ic), ibc = mul(ib, ic);
    const auto bend2 = [&](const V* bent)
                           HWY_ATTR { return fma(bent[0], sub(bent[0], bent[1]), mul(bent[1], bent[1])); };
    const V t2 = fma(mul(s.twist[0], s.twist[0]), iab,
                     fma(mul(s.twist[1], s.twist[1]), iac, mul(mul(s.twist[2], s.twist[2]), ibc)));
    const V corner2 = fma(s.corner[0], s.corner[0], fma(s.corner[1], s.corner[1], mul(s.corner[2], s.corner[2])));
    const V h2 = fma(
        num(3), t2, fma(num(1.0 / 3), corner2, add(bend2(s.bending), add(bend2(s.bending + 2), bend2(s.bending + 4)))));
    // k is at most 4/√3 q m, in an element of any shape
    const V m2 = mul(mul(h2, per_bending), per_bending), left = sub(mul(limit, limit), add(q2, m2));
    const auto may_flow = hn::Or(hn::Lt(left, zero), hn::Lt(mul(left, left), mul(num(16.0 / 9), mul(q2, m2))));
    if (HWY_UNLIKELY(!hn::AllFalse(d, hn::And(live, hn::Or(may_flow, exceeds))))) {
      // mean stress and what varies come back together, the more so the more they are of one kind (eq. 13, 14)
      const V slope = fma(sub(y.compression_slope, y.tension_slope), w, y.tension_slope);
      const V mu3 = num(3 * law.mu), per_rate = hn::Div(num(1), add(mu3, slope));
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
      const V alike = hn::Sqrt(fma(k1, k1, fma(k2, k2, mul(k3, k3))));
      // 1.5 over the root of 3
      const V common = mul(num(0.86602540378443865), mul(alike, per_bending));
      const V q = hn::Sqrt(hn::Max(add(m2, add(q2, common)), num(1e-300)));
      if (HWY_UNLIKELY(!hn::AllFalse(d, hn::And(live, hn::Or(hn::Gt(q, limit), exceeds))))) {
        const V flow = hn::Max(zero, mul(sub(q, limit), per_rate));
        const V keep = fnma(mu3, hn::Div(flow, q), num(1));
        const V part = mul(keep, sub(num(1), keep));
        const V swelling = mul(num(1 / law.bulk), sub(cap.mean, mean));  // plastic, of the volume
        sxx = fma(dx, keep, mean), syy = fma(dy, keep, mean), szz = fma(dz, keep, mean);
        sxy = mul(sxy, keep), syz = mul(syz, keep), szx = mul(szx, keep);
        const V spent = fma(mul(part, q2), num(1 / (3 * law.mu)), mul(mean, swelling));
        const V volume = hn::IfThenElseZero(live, mul(num(1.0 / 64), g.volume)), weight = mul(volume, part);
        sums.mean = fma(volume, spent, sums.mean);
        const auto store = [&](const V* bent) HWY_ATTR {  // three times twice the energy over the volume
          return fma(bent[0], fnma(num(2 * law.nu), bent[1], bent[0]), mul(bent[1], bent[1]));
        };
        V stored = add(store(s.bending), add(store(s.bending + 2), store(s.bending + 4)));
        const V corner_energy = mul(num(1.0 / (9 * law.E)), corner2);
        stored = fma(num(1.0 / (3 * law.E)), stored, fma(num(1.0 / (3 * law.mu)), t2, corner_energy));
        sums.varying = fma(weight, stored, sums.varying);
        sums.corner = fma(weight, corner_energy, sums.corner);
        for (V& a : s.bending) a = mul(a, keep);
        for (V& a : s.twist) a = mul(a, keep);
        for (V& a : s.corner) a = mul(a, keep);
        const V more = hn::IfThenElseZero(live, fma(num(1.0 / 3), hn::Abs(swelling), flow));
        const V strain = add(load_field(element, kStrain), more);
        const V wear = fma(num(law.compression_rate - law.tension_rate), w, num(law.tension_rate));
        const V damage = fma(more, wear, load_field(element, kDamage));
        store_field(strain, element, kStrain);
        store_field(damage, element, kDamage);
        if (law.crack_strain > 0) {
          const V deviator[3] = {daa, dbb, dcc};
          open_cracks(law, deviator, keep, mean, swelling, w, cracks);
        }
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
  }

  if (HWY_UNLIKELY(step.removes && !hn::AllFalse(d, lost))) {
    HWY_ALIGN double bits[kLanes];
    hn::Store(hn::IfThenElseZero(lost, num(1)), d, bits);
    for (size_t l = 0; l < kLanes; ++l)
      if (bits[l] > 0) job.failed->push_back(static_cast<std::uint32_t>(4 * (block * kLanes + l) + 3));
  }
  if (HWY_UNLIKELY(job.live[block] != (1U << kLanes) - 1)) {
    const auto keep_live = [&](V& x1) HWY_ATTR { x1 = hn::IfThenElseZero(live, x1); };
    keep_live(sxx), keep_live(syy), keep_live(szz), keep_live(sxy), keep_live(syz), keep_live(szx);
    for (V& a : s.bending) keep_live(a);
    for (V& a : s.twist) keep_live(a);
    for (V& a : s.corner) keep_live(a);
  }
  store_field(sxx, element, kStress), store_field(syy, element, kStress + 1), store_field(szz, element, kStress + 2);
  store_field(sxy, element, kStress + 3), store_field(syz, element, kStress + 4);
  store_field(szx, element, kStress + 5);
  for (int k = 0; k < 6; ++k) store_field(s.bending[k], element, kBending + k);
  for (int k = 0; k < 3; ++k) store_field(s.twist[k], element, kTwist + k);
  for (int k = 0; k < 3; ++k) store_field(s.corner[k], element, kCorner + k);

  // bulk viscosity of a closing element (eq. 15)
  {
    const V closing = mul(load_field(element, kLength), hn::Max(zero, mul(num(step.past > 0 ? -1 : 0), trace)));
    const V pressure = mul(mul(mul(num(64), mul(mass, inverse)), closing),
                           fma(num(step.quadratic * step.quadratic), closing, num(step.linear * law.speed)));
    const V both = mul(add(pressure, load_field(element, kViscous)), mul(trace, g.volume));
    store_field(pressure, element, kViscous);
    sums.viscous = fma(num(-0.5 / 64 * step.past), both, sums.viscous);
    sxx = sub(sxx, pressure), syy = sub(syy, pressure), szz = sub(szz, pressure);
  }

  // forces of the modes (eq. 6, 9), against the stress; the linear part of the modes goes to the mean one
  const V part_volume = mul(num(-1.0 / 192), g.volume), share = num(-1.0 / 64);
  const V3 A = scale(mul(part_volume, ia), x.a), B = scale(mul(part_volume, ib), x.b),
           C = scale(mul(part_volume, ic), x.c);
  const auto combine = [&](V a, V b, V c) HWY_ATTR { return fma(c, C, fma(b, B, scale(a, A))); };
  V3 p1 = combine(fma(s.twist[0], ib, mul(s.twist[1], ic)), s.bending[1], s.bending[3]);
  V3 p2 = combine(s.bending[0], fma(s.twist[0], ia, mul(s.twist[2], ic)), s.bending[5]);
  V3 p3 = combine(s.bending[2], s.bending[4], fma(s.twist[1], ia, mul(s.twist[2], ib)));
  const V third = num(1.0 / 3);
  const V3 p4 = combine(mul(third, s.corner[0]), mul(third, s.corner[1]), mul(third, s.corner[2]));
  Matrix t{scale(p1.x, x.d), scale(p1.y, x.d), scale(p1.z, x.d)};
  add_product(p2, x.e, t), add_product(p3, x.f, t), add_product(p4, x.g, t);
  {
    const V txx = mul(share, sxx), tyy = mul(share, syy), tzz = mul(share, szz);
    const V txy = mul(share, sxy), tyz = mul(share, syz), tzx = mul(share, szx);
    t.x = {fnma(inverse, t.x.x, txx), fnma(inverse, t.x.y, txy), fnma(inverse, t.x.z, tzx)};
    t.y = {fnma(inverse, t.y.x, txy), fnma(inverse, t.y.y, tyy), fnma(inverse, t.y.z, tyz)};
    t.z = {fnma(inverse, t.z.x, tzx), fnma(inverse, t.z.y, tyz), fnma(inverse, t.z.z, tzz)};
  }
  const V3 fa = times(t, g.a), fb = times(t, g.b), fc = times(t, g.c);
  const auto times_add = [&](const V3& u, const V3& to) HWY_ATTR {
    const auto row = [&](const V3& r, V start) HWY_ATTR { return fma(r.z, u.z, fma(r.y, u.y, fma(r.x, u.x, start))); };
    return V3{row(t.x, to.x), row(t.y, to.y), row(t.z, to.z)};
  };
  p1 = times_add(g.d, p1), p2 = times_add(g.e, p2), p3 = times_add(g.f, p3);
  double* HWY_RESTRICT forces = job.forces;
  // faces ζ = -1, then +1: parts of 1 ξ η ξη there
  {
    const auto parts = [&](size_t axis, V c, V b, V d1, V a, V e, V f, V g4) HWY_ATTR {
      const Quad before = carry.get(axis);
      return Quad{sub(before.one, c), add(before.x, sub(a, e)), add(before.y, sub(b, d1)), add(before.xy, sub(f, g4))};
    };
    add_face(parts(0, fc.x, fb.x, p1.x, fa.x, p2.x, p3.x, p4.x), parts(1, fc.y, fb.y, p1.y, fa.y, p2.y, p3.y, p4.y),
             parts(2, fc.z, fb.z, p1.z, fa.z, p2.z, p3.z, p4.z), forces, corners);
  }
  const auto parts = [&](V c, V b, V d1, V a, V e, V f, V g4) HWY_ATTR {
    return Quad{c, add(a, e), add(b, d1), add(f, g4)};
  };
  carry.put(0, parts(fc.x, fb.x, p1.x, fa.x, p2.x, p3.x, p4.x));
  carry.put(1, parts(fc.y, fb.y, p1.y, fa.y, p2.y, p3.y, p4.y));
  carry.put(2, parts(fc.z, fb.z, p1.z, fa.z, p2.z, p3.z, p4.z));
  if (HWY_UNLIKELY(!joined)) end_strip(carry, forces, corners + 4 * kLanes);
}

/// Rows are read in vectors of up to four.
using Row = hn::CappedTag<double, 4>;
constexpr size_t kRowLanes = hn::MaxLanes(Row());

/// Factors of a step for the entries of a row.
struct Motion {
  HWY_ALIGN double keep[4];  // of speeds
  HWY_ALIGN double fall[4];  // added to speeds
  HWY_ALIGN double drift[4];
  HWY_ALIGN double weight[4];  // force of a mass
  double kick = 0;
  bool weighs = false;
};
HWY_INLINE Motion make_motion(const StepJob& step) {
  Motion m{};
  for (int c = 0; c < 3; ++c)
    m.keep[c] = step.keep, m.fall[c] = step.fall[c], m.drift[c] = step.h, m.weight[c] = step.weight[c];
  m.keep[3] = 1, m.kick = step.kick, m.weighs = step.weighs;
  return m;
}

/// Bounds of places, to look at a ground's planes once for many nodes.
class Box {
 public:
  HWY_INLINE Box() {
    for (size_t k = 0; k < kVectors; ++k) low_[k] = hn::Set(Row(), 1e300), high_[k] = hn::Set(Row(), -1e300);
  }
  /// Part k of a place, what is behind it aside.
  HWY_INLINE void add(size_t k, hn::Vec<Row> place) {
    low_[k] = hn::Min(low_[k], place), high_[k] = hn::Max(high_[k], place);
  }
  HWY_INLINE void add(size_t k, hn::Vec<Row> low, hn::Vec<Row> high) {
    low_[k] = hn::Min(low_[k], low), high_[k] = hn::Max(high_[k], high);
  }
  /// A place of which the numbers have just been written one by one, and cannot be read as a vector without waiting.
  HWY_INLINE void add(const double* place) {
    for (int c = 0; c < 3; ++c) {
      single_low_[c] = std::min(single_low_[c], place[c]);
      single_high_[c] = std::max(single_high_[c], place[c]);
    }
  }
  HWY_INLINE bool reaches_ground(const StepJob& step) const {
    const Row d;
    HWY_ALIGN double low[4], high[4];
    for (size_t k = 0; k < kVectors; ++k)
      hn::Store(low_[k], d, low + k * kRowLanes), hn::Store(high_[k], d, high + k * kRowLanes);
    for (int c = 0; c < 3; ++c) low[c] = std::min(low[c], single_low_[c]), high[c] = std::max(high[c], single_high_[c]);
    for (int i = 0; i < step.grounds; ++i) {
      const double* n = step.ground[i];
      double nearest = 0;
      for (int c = 0; c < 3; ++c) nearest += n[c] * (n[c] > 0 ? low[c] : high[c]);
      if (nearest < n[3]) return true;
    }
    return false;
  }

 private:
  static constexpr size_t kVectors = 4 / kRowLanes;
  hn::Vec<Row> low_[kVectors], high_[kVectors];
  double single_low_[3] = {1e300, 1e300, 1e300}, single_high_[3] = {-1e300, -1e300, -1e300};
};

#if HWY_TARGET != HWY_SCALAR
/// New place of one node that nothing holds. The force comes as vectors of a row, its fourth entry 0.
HWY_INLINE void move_free(const Motion& motion, double* HWY_RESTRICT node, const hn::Vec<Row>* force,
                          hn::Vec<Row>* speed, hn::Vec<Row>* place) {
  // the fourth of the speeds is the inverse mass, which stays; the fourth of the places is a speed, written after it
  const Row d;
  const auto kick = hn::Set(d, motion.kick * node[kInverseMass]);
  for (size_t c = 0; c < 4; c += kRowLanes)
    speed[c / kRowLanes] = hn::MulAdd(
        kick, force[c / kRowLanes],
        hn::MulAdd(hn::Load(d, motion.keep + c), hn::LoadU(d, node + kSpeed + c), hn::Load(d, motion.fall + c)));
  for (size_t c = 0; c < 4; c += kRowLanes) {
    place[c / kRowLanes] = hn::MulAdd(hn::Load(d, motion.drift + c), speed[c / kRowLanes], hn::Load(d, node + c));
    hn::Store(place[c / kRowLanes], d, node + c);
  }
  for (size_t c = 0; c < 4; c += kRowLanes) hn::StoreU(speed[c / kRowLanes], d, node + kSpeed + c);
}
HWY_INLINE void move_free(const Motion& motion, double* HWY_RESTRICT node, const hn::Vec<Row>* force,
                          hn::Vec<Row>* speed, Box& box) {
  hn::Vec<Row> place[4 / kRowLanes];
  move_free(motion, node, force, speed, place);
  for (size_t k = 0; k < 4 / kRowLanes; ++k) box.add(k, place[k]);
}
/// The same of neighbours; takes their forces away.
template <size_t Nodes>
HWY_INLINE void move_free(const Motion& motion, double* HWY_RESTRICT nodes, double* HWY_RESTRICT forces, Box& box) {
  const Row d;
  hn::Vec<Row> place[Nodes][4 / kRowLanes];
  for (size_t i = 0; i < Nodes; ++i) {
    hn::Vec<Row> f[4 / kRowLanes], v[4 / kRowLanes];
    for (size_t c = 0; c < 4; c += kRowLanes) f[c / kRowLanes] = hn::Load(d, forces + 4 * i + c);
    for (size_t c = 0; c < 4; c += kRowLanes) hn::Store(hn::Zero(d), d, forces + 4 * i + c);
    move_free(motion, nodes + 8 * i, f, v, place[i]);
  }
  for (size_t k = 0; k < 4 / kRowLanes; ++k) {
    auto low = place[0][k], high = low;
    for (size_t i = 1; i < Nodes; ++i) low = hn::Min(low, place[i][k]), high = hn::Max(high, place[i][k]);
    box.add(k, low, high);
  }
}
/// The same of a node that is pushed, or in a relaxation.
HWY_INLINE void move_pushed(const Motion& motion, double* HWY_RESTRICT node, const double* HWY_RESTRICT force,
                            bool is_pushed, const double* HWY_RESTRICT push, Balance& balance, Box& box) {
  const Row d;
  hn::Vec<Row> f[4 / kRowLanes], v[4 / kRowLanes];
  const auto mass = hn::Set(d, motion.weighs ? node[kNodeMass] : 0);
  for (size_t c = 0; c < 4; c += kRowLanes) {
    auto& sum = f[c / kRowLanes];
    sum = hn::Load(d, force + c);
    if (is_pushed) sum = hn::Add(sum, hn::Load(d, push + c));
    sum = hn::MulAdd(mass, hn::Load(d, motion.weight + c), sum);
  }
  move_free(motion, node, f, v, box);
  if (!motion.weighs) return;
  HWY_ALIGN double force2[4], speed2[4];
  for (size_t c = 0; c < 4; c += kRowLanes) {
    hn::Store(hn::Mul(f[c / kRowLanes], f[c / kRowLanes]), d, force2 + c);
    hn::Store(hn::Mul(v[c / kRowLanes], v[c / kRowLanes]), d, speed2 + c);
  }
  balance.force2 += force2[0] + force2[1] + force2[2];
  const double square = speed2[0] + speed2[1] + speed2[2];
  if (square > 0) balance.kinetic += square / node[kInverseMass];
}
#endif
/// Any node, number by number.
HWY_INLINE void move_flagged(const StepJob& step, double* HWY_RESTRICT node, const double* HWY_RESTRICT force,
                             std::uint8_t flags, const double* HWY_RESTRICT push, Balance& balance, Box& box) {
  const bool pushed = (flags & kPushed) != 0;
  double* v = node + kSpeed;
  double force2 = 0, speed2 = 0;
  for (int c = 0; c < 3; ++c) {
    double f = pushed ? force[c] + push[c] : force[c];
    if (step.weighs) f += node[kNodeMass] * step.weight[c];
    const bool held = (flags & (1 << c)) != 0;
    v[c] = held ? 0 : step.keep * v[c] + step.kick * node[kInverseMass] * f + step.fall[c];
    node[c] += step.h * v[c];
    if (!held) force2 += f * f, speed2 += v[c] * v[c];
  }
  box.add(node);
  if (step.weighs && speed2 > 0) balance.kinetic += speed2 / node[kInverseMass];
  balance.force2 += force2;
}
HWY_INLINE void move_node(const StepJob& step, [[maybe_unused]] const Motion& motion, double* HWY_RESTRICT node,
                          const double* HWY_RESTRICT force, std::uint8_t flags, const double* HWY_RESTRICT push,
                          Balance& balance, Box& box) {
  constexpr std::uint8_t kHeld = kHoldX | kHoldY | kHoldZ;
  // what is held stands where it did
  if ((flags & kHeld) == kHeld) return box.add(node);
#if HWY_TARGET != HWY_SCALAR
  if (HWY_LIKELY(flags == 0 && !motion.weighs)) {
    const Row d;
    hn::Vec<Row> f[4 / kRowLanes], v[4 / kRowLanes];
    for (size_t c = 0; c < 4; c += kRowLanes) f[c / kRowLanes] = hn::Load(d, force + c);
    return move_free(motion, node, f, v, box);
  }
  if ((flags & kHeld) == 0) return move_pushed(motion, node, force, (flags & kPushed) != 0, push, balance, box);
#endif
  move_flagged(step, node, force, flags, push, balance, box);
}

HWY_INLINE bool is_below(const StepJob& step, const double* HWY_RESTRICT node) {
  bool below = false;
  for (int i = 0; i < step.grounds; ++i) {
    const double* n = step.ground[i];
    below = below || (n[0] * node[0] + n[1] * node[1] + n[2] * node[2] < n[3]);
  }
  return below && node[kInverseMass] > 0;
}

/// Rows of shared nodes behind the chunk's own, without mass.
HWY_NOINLINE void copy_shared_nodes(const ChunkJob& job) {
  constexpr size_t kAhead = 12;  // rows all over memory
  const size_t shared = job.shared;
  const std::uint32_t* HWY_RESTRICT list = job.shared_nodes;
  const auto row = [&](size_t i) { return job.nodes + 8 * static_cast<size_t>(list[i]); };
  for (size_t i = 0; i < std::min(kAhead, shared); ++i) hwy::Prefetch(row(i));
  double* to = job.own_nodes + 8 * job.own;
  for (size_t i = 0; i < shared; ++i, to += 8) {
    if (i + kAhead < shared) hwy::Prefetch(row(i + kAhead));
    std::memcpy(to, row(i), 6 * sizeof(double));
  }
}

HWY_NOINLINE void move_own_nodes(const StepJob& step, ChunkJob& job) {
  const size_t own = job.own;
  if (own == 0) return;
  const Motion motion = make_motion(step);
  double* HWY_RESTRICT nodes = job.own_nodes;
  double* HWY_RESTRICT force = job.forces;
  const std::uint8_t* HWY_RESTRICT flags = job.own_flags;
  const double* HWY_RESTRICT pushes = job.own_pushes;
  Balance balance;
  constexpr size_t kRun = 32;  // neighbours, which a ground is looked for together
  for (size_t begin = 0; begin < own; begin += kRun) {
    const size_t end = std::min(own, begin + kRun);
    Box box;
    for (size_t i = begin; i < end; ++i, force += 4) {
#if HWY_TARGET != HWY_SCALAR
      constexpr size_t kFree = 4;
      std::uint32_t some = 0;
      if (i + kFree <= end) std::memcpy(&some, flags + i, kFree);
      if (HWY_LIKELY(i + kFree <= end && some == 0 && !motion.weighs)) {
        move_free<kFree>(motion, nodes + 8 * i, force, box);
        i += kFree - 1, force += 4 * (kFree - 1);
        continue;
      }
#endif
      move_node(step, motion, nodes + 8 * i, force, flags[i], pushes + 4 * i, balance, box);
      for (size_t c = 0; c < 4; c += kRowLanes) hn::Store(hn::Zero(Row()), Row(), force + c);
    }
    if (!box.reaches_ground(step)) continue;
    for (size_t i = begin; i < end; ++i)
      if (is_below(step, nodes + 8 * i)) job.grounded->push_back(static_cast<std::uint32_t>(i));
  }
  job.balance = balance;
}

void advance_chunk(const StepJob& step, ChunkJob& job) {
  copy_shared_nodes(job);
  const D d;
  Sums sums{hn::Zero(d), hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  const double* ahead =
      job.own_nodes + 8 * (job.own + job.shared);  // the next chunk's rows on their way, as many as here
  const size_t blocks = job.blocks, rows_a_block = job.own / std::max<size_t>(1, blocks) + 1;
  const unsigned char* HWY_RESTRICT live = job.live;
  HWY_ALIGN double room[2 * Gathered::kSize + Face::kSize];
  HWY_ALIGN double forces_between[12 * kLanes] = {};
  Gathered now{room}, then{room + Gathered::kSize};
  const Face face{room + 2 * Gathered::kSize}, carry{forces_between};
  size_t first = 0;
  while (first < blocks && live[first] == 0) ++first;
  if (first < blocks) {
    const std::uint16_t* corners = job.corners + first * 8 * kLanes;
    const double half = 0.5 * step.past;
    gather_low(job.own_nodes, corners, half, face);
    for (const size_t pair : {2, 1, 0}) gather(job.own_nodes, corners, pair, half, face, now);
  }
  for (size_t block = 0; block < blocks; ++block) {
    for (const double* end = ahead + 8 * rows_a_block; ahead != end; ahead += 8) hwy::Prefetch(ahead);
    if (live[block] == 0) continue;
    size_t next = block + 1;
    while (next < blocks && live[next] == 0) ++next;
    const bool joined = next == block + 1 && next < blocks && job.joined[next] != 0;
    advance_block(step, job, block, now, std::min(next, blocks - 1), joined, then, face, carry, sums);
    std::swap(now.at, then.at);
  }
  const V* vectors[4] = {&sums.mean, &sums.varying, &sums.corner, &sums.viscous};
  for (int i = 0; i < 4; ++i) job.sums[i] += hn::GetLane(hn::SumOfLanes(d, *vectors[i]));
  move_own_nodes(step, job);
  if (job.shared == 0) return;
  double* HWY_RESTRICT shared = job.forces + 4 * job.own;
  std::memcpy(job.shared_forces, shared, 4 * job.shared * sizeof(double));
  std::memset(shared, 0, 4 * job.shared * sizeof(double));
}

void advance_shared(const StepJob& step, SharedJob& job) {
  const Motion motion = make_motion(step);
  const Row d;
  Balance balance;
  Box box;
  constexpr std::uint32_t kAhead = 16;  // forces of other chunks, all over memory
  const std::uint32_t end = job.starts[job.last];
  for (size_t i = job.first; i < job.last; ++i) {
    HWY_ALIGN double f[4];
    for (size_t c = 0; c < 4; c += kRowLanes) {
      auto sum = hn::Zero(d);
      for (std::uint32_t k = job.starts[i]; k < job.starts[i + 1]; ++k) {
        if (c == 0 && k + kAhead < end) hwy::Prefetch(job.forces + 4 * static_cast<size_t>(job.entries[k + kAhead]));
        sum = hn::Add(sum, hn::Load(d, job.forces + 4 * static_cast<size_t>(job.entries[k]) + c));
      }
      hn::Store(sum, d, f + c);
    }
    const size_t row = job.first_row + i;
    double* node = job.nodes + 8 * row;
    move_node(step, motion, node, f, job.flags[row], job.pushes + 4 * row, balance, box);
    if (is_below(step, node)) job.grounded->push_back(static_cast<std::uint32_t>(row));
  }
  job.balance = balance;
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

void set_step(Law& law, double past) {
  law.step_lambda = past * law.lambda, law.step_mu = past * law.mu, law.step_E = past * law.E;
  law.step_bending = past * law.bending, law.step_bending_nu = past * (law.bending * law.nu);
}

size_t lanes() { return HWY_DYNAMIC_DISPATCH(count_lanes)(); }
std::string target_name() { return HWY_DYNAMIC_DISPATCH(name_target)(); }
void advance_chunk(const StepJob& step, ChunkJob& job) { HWY_DYNAMIC_DISPATCH(advance_chunk)(step, job); }
void advance_shared(const StepJob& step, SharedJob& job) { HWY_DYNAMIC_DISPATCH(advance_shared)(step, job); }

}  // namespace topple::fem::kernel
#endif
