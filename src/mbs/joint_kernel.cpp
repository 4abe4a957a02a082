// Compiled once for each instruction set (Highway's foreach_target).
#include "mbs/joint_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mbs/joint_kernel.cpp"
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

#include <algorithm>
#include <utility>

#include "mbs/lane_math.inc"

HWY_BEFORE_NAMESPACE();
namespace topple::mbs::kernel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kMostRounds = 8;

/// Symmetric matrix.
template <class D>
struct S33 {
  Num<D> xx, xy, xz, yy, yz, zz;
};
template <class D>
HWY_INLINE V3<D> operator*(const S33<D>& a, const V3<D>& v) {
  return {fma(a.xz, v.z, fma(a.xy, v.y, a.xx * v.x)), fma(a.yz, v.z, fma(a.yy, v.y, a.xy * v.x)),
          fma(a.zz, v.z, fma(a.yz, v.y, a.xz * v.x))};
}
template <class D>
HWY_INLINE S33<D> load6(const double* HWY_RESTRICT block, int field) {
  return {load<D>(block, field),     load<D>(block, field + 1), load<D>(block, field + 2),
          load<D>(block, field + 3), load<D>(block, field + 4), load<D>(block, field + 5)};
}
/// R S Rᵀ
template <class D>
HWY_INLINE S33<D> turn(const M33<D>& R, const S33<D>& S) {
  const V3<D> a = S * R.r0, b = S * R.r1, c = S * R.r2;
  return {dot(R.r0, a), dot(R.r0, b), dot(R.r0, c), dot(R.r1, b), dot(R.r1, c), dot(R.r2, c)};
}
template <class D>
HWY_INLINE V3<D> zero3() {
  return {num<D>(0), num<D>(0), num<D>(0)};
}

/// One body of each pair of a block.
template <class D>
struct Partner {
  V3<D> p, v, L;
  Q4<D> q;
};

/// A vector in the plane y = const.
template <class D>
struct V2 {
  Num<D> x, z;
};
template <class D>
HWY_INLINE V2<D> operator+(const V2<D>& a, const V2<D>& b) {
  return {a.x + b.x, a.z + b.z};
}
template <class D>
HWY_INLINE V2<D> operator-(const V2<D>& a, const V2<D>& b) {
  return {a.x - b.x, a.z - b.z};
}
/// s a + b
template <class D>
HWY_INLINE V2<D> fma(Num<D> s, const V2<D>& a, const V2<D>& b) {
  return {fma(s, a.x, b.x), fma(s, a.z, b.z)};
}
/// About y.
template <class D>
HWY_INLINE Num<D> cross(const V2<D>& a, const V2<D>& b) {
  return fms(a.z, b.x, a.x * b.z);
}
/// Of a spin about y.
template <class D>
HWY_INLINE V2<D> cross(Num<D> w, const V2<D>& r) {
  return {w * r.z, num<D>(0) - w * r.x};
}
template <class D>
HWY_INLINE V2<D> operator*(const PlanarTurn<D>& t, const V2<D>& r) {
  V2<D> out;
  t.apply(r.x, r.z, out.x, out.z);
  return out;
}
/// Where the bodies of a block lie: side by side, or each anywhere.
template <class D>
struct Places {
  const std::uint32_t* slots;
  bool straight;

  template <int N>
  HWY_INLINE void read(const double* HWY_RESTRICT from, Num<D>* out) const {
    const D d;
    const size_t W = hn::Lanes(d);
    if (straight) {
      const double* block = from + static_cast<size_t>(N) * slots[0];
      for (int c = 0; c < N; ++c) out[c] = load<D>(block, c);
      return;
    }
    alignas(64) double lanes[N][kMostLanes];
    for (size_t l = 0; l < W; ++l) {
      const size_t lane = slots[l] % W;
      const double* at = from + static_cast<size_t>(N) * (slots[l] - lane) + lane;
      for (int c = 0; c < N; ++c) lanes[c][l] = at[static_cast<size_t>(c) * W];
    }
    for (int c = 0; c < N; ++c) out[c] = {hn::Load(d, lanes[c])};
  }
  HWY_INLINE V3<D> read3(const double* HWY_RESTRICT from) const {
    Num<D> x[3];
    read<3>(from, x);
    return {x[0], x[1], x[2]};
  }
  HWY_INLINE Q4<D> read4(const double* HWY_RESTRICT from) const {
    Num<D> x[4];
    read<4>(from, x);
    return {x[0], x[1], x[2], x[3]};
  }
  template <int N, class M>
  HWY_INLINE void write(M mask, const bool* flags, const Num<D>* x, double* HWY_RESTRICT to) const {
    const D d;
    const size_t W = hn::Lanes(d);
    if (straight) {
      double* block = to + static_cast<size_t>(N) * slots[0];
      for (int c = 0; c < N; ++c) store_where<D>(mask, x[c], block, c);
      return;
    }
    alignas(64) double lanes[N][kMostLanes];
    for (int c = 0; c < N; ++c) hn::Store(x[c].v, d, lanes[c]);
    for (size_t l = 0; l < W; ++l) {
      if (!flags[l]) continue;
      const size_t lane = slots[l] % W;
      double* at = to + static_cast<size_t>(N) * (slots[l] - lane) + lane;
      for (int c = 0; c < N; ++c) at[static_cast<size_t>(c) * W] = lanes[c][l];
    }
  }
  /// Component c of N.
  HWY_INLINE Num<D> read_one(const double* HWY_RESTRICT from, size_t N, size_t c) const {
    const D d;
    const size_t W = hn::Lanes(d);
    if (straight) return load<D>(from + N * slots[0], static_cast<int>(c));
    alignas(64) double lanes[kMostLanes];
    for (size_t l = 0; l < W; ++l) {
      const size_t lane = slots[l] % W;
      lanes[l] = from[N * (slots[l] - lane) + lane + c * W];
    }
    return {hn::Load(d, lanes)};
  }
  HWY_INLINE V2<D> read_plane(const double* HWY_RESTRICT from) const {
    return {read_one(from, 3, 0), read_one(from, 3, 2)};
  }
  struct Component {
    Num<D> x;
    int c;
  };
  /// Some components of N.
  template <int Count, int N, class M>
  HWY_INLINE void write_plane(M mask, const bool* flags, const Component (&parts)[Count],
                              double* HWY_RESTRICT to) const {
    const D d;
    const size_t W = hn::Lanes(d);
    for (const Component& part : parts) {
      if (straight) {
        store_where<D>(mask, part.x, to + static_cast<size_t>(N) * slots[0], part.c);
        continue;
      }
      alignas(64) double lanes[kMostLanes];
      hn::Store(part.x.v, d, lanes);
      for (size_t l = 0; l < W; ++l) {
        if (!flags[l]) continue;
        const size_t lane = slots[l] % W;
        to[static_cast<size_t>(N) * (slots[l] - lane) + lane + static_cast<size_t>(part.c) * W] = lanes[l];
      }
    }
  }
  template <class M>
  HWY_INLINE void write3(M mask, const bool* flags, const V3<D>& x, double* HWY_RESTRICT to) const {
    const Num<D> c[3] = {x.x, x.y, x.z};
    write<3>(mask, flags, c, to);
  }
};

template <class D, class M>
HWY_INLINE void read_flags(M mask, bool* flags) {
  const D d;
  alignas(64) double x[kMostLanes];
  hn::Store(hn::IfThenElseZero(mask, hn::Set(d, 1.0)), d, x);
  for (size_t l = 0; l < hn::Lanes(d); ++l) flags[l] = x[l] != 0;
}

template <class D>
HWY_INLINE Partner<D> read_partner(const PairJob& job, const Places<D>& places) {
  return {places.read3(job.p), places.read3(job.v), places.read3(job.L), places.read4(job.q)};
}

/// What the step made of a body.
template <class D>
struct Moved {
  V3<D> p, v, L, w, force, torque;
  Q4<D> q;
  M33<D> R;
};

template <class D, class M>
HWY_INLINE void write_partner(const PairJob& job, const Places<D>& places, M mask, const Moved<D>& m) {
  bool flags[kMostLanes];
  read_flags<D>(mask, flags);
  places.write3(mask, flags, m.p, job.p);
  places.write3(mask, flags, m.v, job.v);
  places.write3(mask, flags, m.L, job.L);
  places.write3(mask, flags, m.w, job.w);
  places.write3(mask, flags, m.force, job.force);
  places.write3(mask, flags, m.torque, job.torque);
  const Num<D> q[4] = {m.q.w, m.q.x, m.q.y, m.q.z};
  places.template write<4>(mask, flags, q, job.q);
  const Num<D> R[9] = {m.R.r0.x, m.R.r0.y, m.R.r0.z, m.R.r1.x, m.R.r1.y, m.R.r1.z, m.R.r2.x, m.R.r2.y, m.R.r2.z};
  places.template write<9>(mask, flags, R, job.R);
}

/// Keeps the reaction of the lanes in the mask and reports those that pass a limit.
template <class D, class M>
HWY_INLINE void finish_reaction(const PairJob& job, size_t block, M mask, const M33<D>& R, const V3<D>& force,
                                const V3<D>& moment, const double* c, double* s) {
  const D d;
  const Num<D> parts[6] = {force.x, force.y, force.z, moment.x, moment.y, moment.z};
  for (int i = 0; i < 6; ++i) store_where<D>(mask, parts[i], s, kForce + i);
  const Num<D> along = dot(R * load3<D>(c, kLimitAxis), force);
  const Num<D> across2 = fnma(along, along, dot(force, force)), moment2 = dot(moment, moment);
  const auto over =
      hn::Or(hn::Gt(hn::Neg(along.v), load<D>(c, kTensionLimit).v),
             hn::Or(hn::Gt(across2.v, load<D>(c, kShearLimit2).v), hn::Gt(moment2.v, load<D>(c, kMomentLimit2).v)));
  const auto here = hn::And(mask, over);
  if (HWY_UNLIKELY(!hn::AllFalse(d, here))) report<D>(here, block, *job.over);
}

/// What a block of pairs begins a step with.
template <class D>
struct PairBlock {
  const double* constants;  // kPairConstants
  double* states;           // kPairStates
  Places<D> parents, children;
  Num<D> h;
  hn::Mask<D> live;  // of pairs that hold, in samples that move

  HWY_INLINE PairBlock(const PairJob& job, size_t block) {
    const D d;
    const size_t first = hn::Lanes(d) * block;
    constants = job.constants + static_cast<size_t>(kPairConstants) * first;
    states = job.states + static_cast<size_t>(kPairStates) * first;
    parents = {job.parent + first, (job.straight[block] & 1) != 0};
    children = {job.child + first, (job.straight[block] & 2) != 0};
    h = load<D>(job.h, 0);
    live = hn::And(hn::Gt(load<D>(constants, kPairLive).v, hn::Zero(d)), hn::Gt(h.v, hn::Zero(d)));
  }
};

/// Two bodies that move as one (docs/theory/multibody.md, "Joints between two bodies").
template <class D>
HWY_INLINE void advance_weld(const PairJob& job, size_t block) {
  const D d;
  const PairBlock<D> pairs(job, block);
  const double* c = pairs.constants;
  double* s = pairs.states;
  const Num<D> h = pairs.h, half_h = num<D>(0.5) * h;
  const Partner<D> a = read_partner(job, pairs.parents);
  const V3<D> child_v = pairs.children.read3(job.v), child_L = pairs.children.read3(job.L);

  const M33<D> R0 = to_matrix(a.q);
  const V3<D> reach = load3<D>(c, kReach), r0 = R0 * reach, apart = child_v - a.v;
  const Num<D> share = load<D>(c, kChildShare), reduced = load<D>(c, kReducedMass);
  const V3<D> speed = fma(share, apart, a.v);
  const V3<D> H = (a.L + child_L) + reduced * cross(r0, apart);
  const S33<D> inverse = load6<D>(c, kInverseWhole);
  const V3<D> w = R0 * mid_spin<D>(inverse, transpose_times(R0, H), half_h);
  const V3<D> turned = h * w;
  const Num<D> half2 = num<D>(0.25) * dot(turned, turned);
  const auto slow = hn::Le(half2.v, hn::Set(d, kMostHalf2));
  const auto here = hn::And(pairs.live, slow);
  const auto unfit = hn::AndNot(slow, pairs.live);
  if (HWY_UNLIKELY(!hn::AllFalse(d, unfit))) report<D>(unfit, block, *job.unfit);

  const Q4<D> step = exp_rotation(turned, half2);
  Moved<D> A, B;
  A.q = normalize(step * a.q);
  A.R = to_matrix(A.q);
  // how far the child's centre turns about the parent's, without cancellation
  const V3<D> u{step.x, step.y, step.z}, once = cross(u, r0);
  const V3<D> half_way = fma(step.w, once, cross(u, once));
  const V3<D> rate = (num<D>(2) / h) * half_way;
  A.v = speed - share * rate;
  B.v = A.v + rate;
  A.p = fma(h, A.v, a.p);
  B.p = A.p + A.R * reach;
  B.q = A.q * load4<D>(c, kRelative);
  B.R = to_matrix(B.q);
  // the spins' momentum in the middle of the step; what is left of the whole goes by mass
  const V3<D> in_parent = transpose_times(R0, w);
  const V3<D> spin_a = R0 * (load6<D>(c, kInertiaParent) * in_parent);
  const V3<D> spin_b = R0 * (load6<D>(c, kInertiaChild) * in_parent);
  const V3<D> La = fma(half_h, cross(w, spin_a), spin_a), Lb = fma(half_h, cross(w, spin_b), spin_b);
  const V3<D> rest = (H - reduced * cross(r0, rate)) - (La + Lb);
  B.L = fma(share, rest, Lb);
  A.L = (La + rest) - share * rest;
  A.w = B.w = A.R * (inverse * transpose_times(A.R, H));

  const Num<D> per_time = num<D>(1) / load<D>(job.kick, 0);
  const V3<D> force = (per_time / load<D>(c, kInverseMassChild)) * (B.v - child_v);
  B.force = force;
  A.force = zero3<D>() - force;
  B.torque = per_time * (B.L - child_L);
  A.torque = per_time * (A.L - a.L);
  const V3<D> moment = B.torque - cross(R0 * load3<D>(c, kLeverChild), force);
  write_partner(job, pairs.parents, here, A);
  write_partner(job, pairs.children, here, B);
  finish_reaction<D>(job, block, here, A.R, force, moment, c, s);
}

/// Factor L D Lᵀ of a small symmetric matrix.
template <class D, int N>
struct Factor {
  Num<D> l[N][N], inverse[N];
  HWY_INLINE void make(const Num<D> (&a)[N][N]) {
    Num<D> t[N][N];  // L D
    for (int j = 0; j < N; ++j) {
      Num<D> pivot = a[j][j];
      for (int k = 0; k < j; ++k) pivot = fnma(l[j][k], t[j][k], pivot);
      inverse[j] = num<D>(1) / pivot;
      for (int i = j + 1; i < N; ++i) {
        Num<D> x = a[i][j];
        for (int k = 0; k < j; ++k) x = fnma(t[i][k], l[j][k], x);
        t[i][j] = x;
        l[i][j] = x * inverse[j];
      }
    }
  }
  HWY_INLINE void solve(Num<D> (&x)[N]) const {
    for (int i = 1; i < N; ++i)
      for (int k = 0; k < i; ++k) x[i] = fnma(l[i][k], x[k], x[i]);
    for (int i = 0; i < N; ++i) x[i] = x[i] * inverse[i];
    for (int i = N - 1; i-- > 0;)
      for (int k = i + 1; k < N; ++k) x[i] = fnma(l[k][i], x[k], x[i]);
  }
};

/// A body of a pair at the beginning of the step, and what makes it move.
template <class D>
struct Mover {
  V3<D> p, v, L, lever;
  Q4<D> q;
  S33<D> W;  // inverse inertia in W
  Num<D> inverse_mass;
};

/// Adds the matrix that gives the acceleration of a point at the lever by a force there.
template <class D>
HWY_INLINE void add_mobility(const Mover<D>& m, Num<D> (&a)[3][3]) {
  const V3<D>& l = m.lever;
  const Num<D> zero = num<D>(0);
  const V3<D> turn[3] = {{zero, l.z, zero - l.y}, {zero - l.z, zero, l.x}, {l.y, zero - l.x, zero}};  // l x e_k
  for (int k = 0; k < 3; ++k) {
    const V3<D> y = cross(m.W * turn[k], l);
    const Num<D> part[3] = {y.x, y.y, y.z};
    for (int i = k; i < 3; ++i) a[i][k] = a[i][k] + part[i];
    a[k][k] = a[k][k] + m.inverse_mass;
  }
}

/// Three lines and N rotations between two bodies (docs/theory/multibody.md, eq. 5 and 6).
template <class D, int N>
HWY_INLINE void close_points(const PairJob& job, size_t block) {
  const D d;
  const PairBlock<D> pairs(job, block);
  const double* c = pairs.constants;
  double* s = pairs.states;
  const Num<D> h = pairs.h, half_h = num<D>(0.5) * h, per_h = num<D>(1) / h;

  const auto make_mover = [&](const Partner<D>& x, int lever, int inverse_mass, int inertia) -> Mover<D> {
    const M33<D> R = to_matrix(x.q);
    return {x.p, x.v, x.L, R * load3<D>(c, lever), x.q, turn(R, load6<D>(c, inertia)), load<D>(c, inverse_mass)};
  };
  const Mover<D> a =
      make_mover(read_partner(job, pairs.parents), kLeverParent, kInverseMassParent, kInverseInertiaParent);
  const Mover<D> b =
      make_mover(read_partner(job, pairs.children), kLeverChild, kInverseMassChild, kInverseInertiaChild);

  // matrix
  constexpr int n = 3 + N;
  Num<D> A[n][n];
  {
    Num<D> lines[3][3];
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k < 3; ++k) lines[i][k] = num<D>(0);
    add_mobility(a, lines);
    add_mobility(b, lines);
    for (int i = 0; i < 3; ++i)
      for (int k = 0; k <= i; ++k) A[i][k] = lines[i][k];
  }
  const V3<D> gap = (b.p + b.lever) - (a.p + a.lever);
  const V3<D> wa = mid_spin<D>(a.W, a.L, half_h), wb = mid_spin<D>(b.W, b.L, half_h);
  Num<D> x[n];
  {
    const V3<D> ra = cross(wa, a.lever), rb = cross(wb, b.lever);
    const V3<D> bias = cross(wb, rb) - cross(wa, ra);
    const V3<D> rate = fma(half_h, bias, ((b.v + rb) - (a.v + ra)) + per_h * gap);
    x[0] = rate.x, x[1] = rate.y, x[2] = rate.z;
  }
  V3<D> axis[std::max(N, 1)];
  if constexpr (N > 0) {
    const M33<D> Ra = to_matrix(a.q), Rb = to_matrix(b.q);
    const V3<D> w = wb - wa;
    V3<D> Wa[N];
    for (int i = 0; i < N; ++i) {
      const V3<D> f = Ra * load3<D>(c, kParentAxes + 3 * i), m = Rb * load3<D>(c, kChildAxes + 3 * i);
      axis[i] = cross(m, f);
      const V3<D> swing = cross(cross(wb, m), f) + cross(m, cross(wa, f));
      x[3 + i] = fma(half_h, dot(swing, w), fma(per_h, dot(m, f), dot(axis[i], w)));
      const V3<D> ua = a.W * axis[i], ub = b.W * axis[i];
      const V3<D> point = cross(ub, b.lever) + cross(ua, a.lever);
      A[3 + i][0] = point.x, A[3 + i][1] = point.y, A[3 + i][2] = point.z;
      Wa[i] = ua + ub;
      for (int k = 0; k <= i; ++k) A[3 + i][3 + k] = dot(axis[i], Wa[k]);
    }
  }
  Factor<D, n> factor;
  factor.make(A);
  for (int i = 0; i < n; ++i) x[i] = num<D>(0) - x[i];
  factor.solve(x);

  Num<D> total[n], linear[n];
  for (int i = 0; i < n; ++i) {
    linear[i] = x[i];
    x[i] = total[i] = x[i] + load<D>(s, kCurvature + i);
  }
  const Num<D> gap_tolerance = load<D>(c, kGapTolerance), turn_tolerance = load<D>(c, kTurnTolerance);
  Moved<D> MA, MB;
  MA.v = a.v, MA.L = a.L, MB.v = b.v, MB.L = b.L;
  auto slow = pairs.live, open = pairs.live;
  Num<D> widest = num<D>(0), cosine = num<D>(1), sine = num<D>(0);
  const auto move = [&](const Mover<D>& m, const V3<D>& v, const V3<D>& L, Moved<D>& out) {
    out.p = fma(h, v, m.p);
    const V3<D> turned = h * mid_spin<D>(m.W, L, half_h);
    const Num<D> half2 = num<D>(0.25) * dot(turned, turned);
    slow = hn::And(slow, hn::Le(half2.v, hn::Set(d, kMostHalf2)));
    out.q = normalize(exp_rotation(turned, half2) * m.q);
    out.R = to_matrix(out.q);
  };
  for (int round = 0;; ++round) {
    const V3<D> line{x[0], x[1], x[2]};
    V3<D> turned = zero3<D>();
    if constexpr (N > 0)
      for (int i = 0; i < N; ++i) turned = fma(x[3 + i], axis[i], turned);
    MA.v = MA.v - a.inverse_mass * line;
    MB.v = fma(b.inverse_mass, line, MB.v);
    MA.L = (MA.L - cross(a.lever, line)) - turned;
    MB.L = (MB.L + cross(b.lever, line)) + turned;
    move(a, MA.v, MA.L, MA);
    move(b, MB.v, MB.L, MB);
    const V3<D> left = (MB.p + MB.R * load3<D>(c, kLeverChild)) - (MA.p + MA.R * load3<D>(c, kLeverParent));
    x[0] = left.x, x[1] = left.y, x[2] = left.z;
    Num<D> far = {hn::Max(abs(left.x).v, hn::Max(abs(left.y).v, abs(left.z).v))};
    auto closed = hn::Lt(far.v, gap_tolerance.v);
    if constexpr (N > 0) {
      Num<D> bent = num<D>(0);
      for (int i = 0; i < N; ++i) {
        x[3 + i] = dot(MB.R * load3<D>(c, kChildAxes + 3 * i), MA.R * load3<D>(c, kParentAxes + 3 * i));
        bent = {hn::Max(bent.v, abs(x[3 + i]).v)};
      }
      closed = hn::And(closed, hn::Lt(bent.v, turn_tolerance.v));
      far = {hn::Max(far.v, bent.v)};
    }
    // a lane that is closed stays as it is
    widest = select(open, far, widest);
    open = hn::And(slow, hn::AndNot(closed, open));
    if (HWY_LIKELY(hn::AllFalse(d, open)) || round == kMostRounds) break;
    for (int i = 0; i < n; ++i) x[i] = {hn::IfThenElseZero(open, (num<D>(0) - per_h * x[i]).v)};
    factor.solve(x);
    for (int i = 0; i < n; ++i) total[i] = total[i] + x[i];
  }
  const auto here = hn::And(slow, hn::AndNot(open, pairs.live));
  const auto unfit = hn::AndNot(here, pairs.live);
  if (HWY_UNLIKELY(!hn::AllFalse(d, unfit))) report<D>(unfit, block, *job.unfit);

  const auto end_spin = [&](const Moved<D>& m, int inertia) {
    return m.R * (load6<D>(c, inertia) * transpose_times(m.R, m.L));
  };
  MA.w = end_spin(MA, kInverseInertiaParent);
  MB.w = end_spin(MB, kInverseInertiaChild);
  const Num<D> per_time = num<D>(1) / load<D>(job.kick, 0);
  const V3<D> force = per_time * V3<D>{total[0], total[1], total[2]};
  V3<D> moment = zero3<D>();
  if constexpr (N > 0) {
    for (int i = 0; i < N; ++i) moment = fma(total[3 + i], axis[i], moment);
    moment = per_time * moment;
  }
  MB.force = force;
  MA.force = zero3<D>() - force;
  MB.torque = cross(b.lever, force) + moment;
  MA.torque = (zero3<D>() - cross(a.lever, force)) - moment;
  write_partner(job, pairs.parents, hn::And(here, hn::Gt(a.inverse_mass.v, hn::Zero(d))), MA);
  write_partner(job, pairs.children, hn::And(here, hn::Gt(b.inverse_mass.v, hn::Zero(d))), MB);
  for (int i = 0; i < n; ++i) store_where<D>(here, total[i] - linear[i], s, kCurvature + i);
  store_where<D>(here, widest, s, kOpen);
  if constexpr (N == 2) {
    const V3<D> along = MB.R * load3<D>(c, kChildX);
    cosine = dot(along, MA.R * load3<D>(c, kParentAxes));
    sine = dot(along, MA.R * load3<D>(c, kParentAxes + 3));
    store_where<D>(here, cosine, s, kCosine);
    store_where<D>(here, sine, s, kSine);
  }
  finish_reaction<D>(job, block, here, MA.R, force, moment, c, s);
}

template <class D>
HWY_INLINE M33<D> to_matrix(const PlanarTurn<D>& t) {
  const Num<D> zero = num<D>(0), c = t.cosine(), s = t.sine();
  return {{c, zero, s}, {zero, num<D>(1), zero}, {zero - s, zero, c}};
}

/// A body of a hinge in the plane at the beginning of the step.
template <class D>
struct PlanarMover {
  V2<D> p, v, arm;  // arm: to the hinge, in its axes
  Num<D> L, inverse_inertia, inverse_mass;
  PlanarTurn<D> q;

  HWY_INLINE PlanarMover(const PairJob& job, const Places<D>& at, const double* c, int lever, int mass, int inertia)
      : p(at.read_plane(job.p)),
        v(at.read_plane(job.v)),
        arm{load<D>(c, lever), load<D>(c, lever + 2)},
        L(at.read_one(job.L, 3, 1)),
        inverse_inertia(load<D>(c, inertia + 3)),
        inverse_mass(load<D>(c, mass)),
        q(at.read_one(job.q, 4, 0), at.read_one(job.q, 4, 2)) {}
};

/// As close_points() of a hinge about y between bodies that keep to y = const: two lines, and nothing turns them out of
/// the plane.
template <class D>
HWY_INLINE void close_in_plane(const PairJob& job, size_t block) {
  const D d;
  const PairBlock<D> pairs(job, block);
  const double* c = pairs.constants;
  double* s = pairs.states;
  const Num<D> zero = num<D>(0), h = pairs.h, half_h = num<D>(0.5) * h, per_h = num<D>(1) / h;
  const PlanarMover<D> a(job, pairs.parents, c, kLeverParent, kInverseMassParent, kInverseInertiaParent);
  const PlanarMover<D> b(job, pairs.children, c, kLeverChild, kInverseMassChild, kInverseInertiaChild);
  const V2<D> ra = a.q * a.arm, rb = b.q * b.arm;

  Num<D> A[2][2] = {{zero, zero}, {zero, zero}};
  for (const auto& [m, l] : {std::pair<const PlanarMover<D>&, const V2<D>&>{a, ra}, {b, rb}}) {
    A[0][0] = A[0][0] + fma(m.inverse_inertia * l.z, l.z, m.inverse_mass);
    A[1][0] = A[1][0] - m.inverse_inertia * l.z * l.x;
    A[1][1] = A[1][1] + fma(m.inverse_inertia * l.x, l.x, m.inverse_mass);
  }
  Factor<D, 2> factor;
  factor.make(A);
  const V2<D> gap = (b.p + rb) - (a.p + ra);
  const Num<D> wa = a.inverse_inertia * a.L, wb = b.inverse_inertia * b.L;
  const V2<D> va = cross(wa, ra), vb = cross(wb, rb);
  const V2<D> rate = fma(half_h, cross(wb, vb) - cross(wa, va), fma(per_h, gap, (b.v + vb) - (a.v + va)));
  Num<D> x[2] = {zero - rate.x, zero - rate.z}, total[2], linear[2];
  factor.solve(x);
  for (int i = 0; i < 2; ++i) {
    linear[i] = x[i];
    x[i] = total[i] = x[i] + load<D>(s, kCurvature + 2 * i);
  }
  const Num<D> gap_tolerance = load<D>(c, kGapTolerance);
  struct Moved {
    V2<D> p, v;
    Num<D> L;
    PlanarTurn<D> q;
  };
  Moved MA{a.p, a.v, a.L, a.q}, MB{b.p, b.v, b.L, b.q};
  auto slow = pairs.live, open = pairs.live;
  Num<D> widest = zero;
  const auto move = [&](const PlanarMover<D>& m, Moved& out) {
    out.p = fma(h, out.v, m.p);
    const Num<D> turned = h * (m.inverse_inertia * out.L), half2 = num<D>(0.25) * (turned * turned);
    slow = hn::And(slow, hn::Le(half2.v, hn::Set(d, kMostHalf2)));
    out.q = PlanarTurn<D>(exp_rotation(V3<D>{zero, turned, zero}, half2)).then(m.q).normalized();
  };
  for (int round = 0;; ++round) {
    const V2<D> line{x[0], x[1]};
    MA.v = fma(zero - a.inverse_mass, line, MA.v);
    MB.v = fma(b.inverse_mass, line, MB.v);
    MA.L = MA.L - cross(ra, line);
    MB.L = MB.L + cross(rb, line);
    move(a, MA);
    move(b, MB);
    const V2<D> left = (MB.p + MB.q * b.arm) - (MA.p + MA.q * a.arm);
    x[0] = left.x, x[1] = left.z;
    const Num<D> far = {hn::Max(abs(left.x).v, abs(left.z).v)};
    // a lane that is closed stays as it is
    widest = select(open, far, widest);
    open = hn::And(slow, hn::AndNot(hn::Lt(far.v, gap_tolerance.v), open));
    if (HWY_LIKELY(hn::AllFalse(d, open)) || round == kMostRounds) break;
    for (int i = 0; i < 2; ++i) x[i] = {hn::IfThenElseZero(open, (zero - per_h * x[i]).v)};
    factor.solve(x);
    for (int i = 0; i < 2; ++i) total[i] = total[i] + x[i];
  }
  const auto here = hn::And(slow, hn::AndNot(open, pairs.live));
  const auto unfit = hn::AndNot(here, pairs.live);
  if (HWY_UNLIKELY(!hn::AllFalse(d, unfit))) report<D>(unfit, block, *job.unfit);

  const Num<D> per_time = num<D>(1) / load<D>(job.kick, 0);
  const V2<D> force{per_time * total[0], per_time * total[1]};
  const auto write = [&](const Places<D>& at, const PlanarMover<D>& m, const Moved& to, const V2<D>& f, Num<D> torque) {
    const auto mask = hn::And(here, hn::Gt(m.inverse_mass.v, hn::Zero(d)));
    bool flags[kMostLanes];
    read_flags<D>(mask, flags);
    const Num<D> cosine = to.q.cosine(), sine = to.q.sine();
    at.template write_plane<2, 3>(mask, flags, {{to.p.x, 0}, {to.p.z, 2}}, job.p);
    at.template write_plane<2, 3>(mask, flags, {{to.v.x, 0}, {to.v.z, 2}}, job.v);
    at.template write_plane<1, 3>(mask, flags, {{to.L, 1}}, job.L);
    at.template write_plane<1, 3>(mask, flags, {{m.inverse_inertia * to.L, 1}}, job.w);
    at.template write_plane<2, 3>(mask, flags, {{f.x, 0}, {f.z, 2}}, job.force);
    at.template write_plane<1, 3>(mask, flags, {{torque, 1}}, job.torque);
    at.template write_plane<2, 4>(mask, flags, {{to.q.w, 0}, {to.q.y, 2}}, job.q);
    at.template write_plane<4, 9>(mask, flags, {{cosine, 0}, {sine, 2}, {zero - sine, 6}, {cosine, 8}}, job.R);
  };
  write(pairs.parents, a, MA, {zero - force.x, zero - force.z}, zero - cross(ra, force));
  write(pairs.children, b, MB, force, cross(rb, force));
  for (int i = 0; i < 2; ++i) store_where<D>(here, total[i] - linear[i], s, kCurvature + 2 * i);
  store_where<D>(here, widest, s, kOpen);
  const M33<D> RA = to_matrix(MA.q);
  const V3<D> along = to_matrix(MB.q) * load3<D>(c, kChildX);
  store_where<D>(here, dot(along, RA * load3<D>(c, kParentAxes)), s, kCosine);
  store_where<D>(here, dot(along, RA * load3<D>(c, kParentAxes + 3)), s, kSine);
  finish_reaction<D>(job, block, here, RA, V3<D>{force.x, zero, force.z}, zero3<D>(), c, s);
}

template <class D>
HWY_INLINE void close_all(const PairJob& job) {
  for (size_t block = 0; block < job.blocks; ++block) {
    switch (job.kind[block]) {
      case PairKind::None:
        break;
      case PairKind::Weld:
        advance_weld<D>(job, block);
        break;
      case PairKind::Ball:
        close_points<D, 0>(job, block);
        break;
      case PairKind::Universal:
        close_points<D, 1>(job, block);
        break;
      case PairKind::Hinge:
        close_points<D, 2>(job, block);
        break;
      case PairKind::PlanarHinge:
        close_in_plane<D>(job, block);
        break;
    }
  }
}

void close_pairs_here(const PairJob& job) { close_all<hn::ScalableTag<double>>(job); }
void close_pairs_singly_here(const PairJob& job) { close_all<hn::CappedTag<double, 1>>(job); }

}  // namespace HWY_NAMESPACE
}  // namespace topple::mbs::kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace topple::mbs::kernel {

HWY_EXPORT(close_pairs_here);
HWY_EXPORT(close_pairs_singly_here);

void close_pairs(const PairJob& job) { HWY_DYNAMIC_DISPATCH(close_pairs_here)(job); }
void close_pairs_singly(const PairJob& job) { HWY_DYNAMIC_DISPATCH(close_pairs_singly_here)(job); }

}  // namespace topple::mbs::kernel
#endif
