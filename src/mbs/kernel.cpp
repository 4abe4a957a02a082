// Compiled once for each instruction set (Highway's foreach_target).
#include "mbs/kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mbs/kernel.cpp"
// one wide target for each family of machines keeps the build short
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

#include "mbs/lane_math.inc"

HWY_BEFORE_NAMESPACE();
namespace topple::mbs::kernel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

/// Moves one block of bodies (docs/theory/multibody.md, eq. 1 to 3).
template <class D>
HWY_INLINE void advance_body_block(const BodyJob& job, size_t block, Num<D>& sum) {
  const D d;
  const size_t W = hn::Lanes(d);
  double *p = job.p + 3 * W * block, *v = job.v + 3 * W * block, *L = job.L + 3 * W * block, *w = job.w + 3 * W * block,
         *q = job.q + 4 * W * block, *R = job.R + 9 * W * block;
  const double* c = job.constants + static_cast<size_t>(kBodyFields) * W * block;
  const Num<D> kick = load<D>(job.kick, 0), h = load<D>(job.h, 0);
  const Num<D> push = kick * load<D>(c, kInverseMass), pull = kick * load<D>(c, kFree);
  const V3<D> gravity{load<D>(job.gx, 0), load<D>(job.gy, 0), load<D>(job.gz, 0)};
  const V3<D> speed = fma(push, load3<D>(job.force + 3 * W * block, 0), fma(pull, gravity, load3<D>(v, 0)));
  const V3<D> spin = fma(kick, load3<D>(job.torque + 3 * W * block, 0), load3<D>(L, 0));
  store3<D>(speed, v, 0);
  store3<D>(spin, L, 0);
  const auto drifts = hn::Gt(load<D>(c, kDrifts).v, hn::Zero(d));

  const V3<D> place = fma(h, speed, load3<D>(p, 0));
  const V3<D> i0{load<D>(c, kInverseInertia), load<D>(c, kInverseInertia + 1), load<D>(c, kInverseInertia + 2)};
  const M33<D> inverse_inertia{i0,
                               {i0.y, load<D>(c, kInverseInertia + 3), load<D>(c, kInverseInertia + 4)},
                               {i0.z, load<D>(c, kInverseInertia + 4), load<D>(c, kInverseInertia + 5)}};
  const M33<D> R0{load3<D>(R, 0), load3<D>(R, 3), load3<D>(R, 6)};
  // angular velocity in the middle of the step: the angular momentum is constant, the inertia turns with the body
  const V3<D> w0 = R0 * (inverse_inertia * transpose_times(R0, spin));
  const V3<D> bend = R0 * (inverse_inertia * transpose_times(R0, cross(w0, spin)));
  const V3<D> turned = h * fma(num<D>(-0.5) * h, bend, w0);
  const Num<D> half2 = num<D>(0.25) * dot(turned, turned);
  const auto fast = hn::And(drifts, hn::Not(hn::Le(half2.v, hn::Set(d, kMostHalf2))));
  const Q4<D> q1 = normalize(exp_rotation(turned, half2) * load4<D>(q, 0));
  const M33<D> R1 = to_matrix(q1);
  const V3<D> w1 = R1 * (inverse_inertia * transpose_times(R1, spin));

  const auto here = hn::AndNot(fast, drifts);
  store_where<D>(here, place.x, p, 0), store_where<D>(here, place.y, p, 1), store_where<D>(here, place.z, p, 2);
  store_where<D>(here, q1.w, q, 0), store_where<D>(here, q1.x, q, 1), store_where<D>(here, q1.y, q, 2),
      store_where<D>(here, q1.z, q, 3);
  const V3<D>* rows[3] = {&R1.r0, &R1.r1, &R1.r2};
  for (int i = 0; i < 3; ++i)
    store_where<D>(here, rows[i]->x, R, 3 * i), store_where<D>(here, rows[i]->y, R, 3 * i + 1),
        store_where<D>(here, rows[i]->z, R, 3 * i + 2);
  store_where<D>(here, w1.x, w, 0), store_where<D>(here, w1.y, w, 1), store_where<D>(here, w1.z, w, 2);
  if (HWY_UNLIKELY(!hn::AllFalse(d, fast))) report<D>(fast, block, *job.spins);
  sum = sum + (((place.x + place.y) + place.z) + ((speed.x + speed.y) + speed.z));
}

/// Rotation vector over the vector of its quaternion, 2 asin(s)/s, and the coefficient of eq. 4,
/// 1/θ² - (1 + cos θ) / (2 θ sin θ), up to θ of 60 degrees. Each lane takes the series for small or large angles after
/// its own s².
template <class D>
HWY_INLINE void turning(Num<D> s2, Num<D>& angle_over_sine, Num<D>& coefficient) {
  const D d;
  // Taylor, exact to round-off below s² = 1e-3
  angle_over_sine = polynomial<D>({2, 1.0 / 3, 3.0 / 20, 5.0 / 56, 35.0 / 576, 63.0 / 1408}, s2);
  coefficient = polynomial<D>({1.0 / 12, 1.0 / 720, 1.0 / 30240, 1.0 / 1209600, 1.0 / 47900160},
                              angle_over_sine * angle_over_sine * s2);
  const auto large = hn::Gt(s2.v, hn::Set(d, 1e-3));
  if (HWY_LIKELY(hn::AllFalse(d, large))) return;
  // fitted to 2e-17
  const Num<D> x = polynomial<D>(
      {2 * 1.0, 2 * 0.16666666666664942, 2 * 0.07500000000385201, 2 * 0.044642856805998936, 2 * 0.03038195969768514,
       2 * 0.022371749733164054, 2 * 0.01735977964134998, 2 * 0.01388484282640208, 2 * 0.012170138592391726,
       2 * 0.0065293020047365695, 2 * 0.019513468251252167, 2 * -0.016187392271599134, 2 * 0.03187962140081284},
      s2);
  const Num<D> y =
      polynomial<D>({0.08333333333333333, 0.001388888888888962, 3.30687830673884e-05, 8.267195868407458e-07,
                     2.0876720971038434e-08, 5.284884495807743e-10, 1.3308714828735463e-11, 3.793809199423887e-13},
                    x * x * s2);
  angle_over_sine = {hn::IfThenElse(large, x.v, angle_over_sine.v)};
  coefficient = {hn::IfThenElse(large, y.v, coefficient.v)};
}

/// Places of the bodies of one block of elements, side by side.
template <class D>
struct Poses {
  V3<D> p;
  Q4<D> q;
};

#if HWY_TARGET != HWY_SCALAR
/// Two numbers of the rows of every second body, from the first on.
template <class D>
HWY_INLINE hn::Vec<D> read_pairs(const double* HWY_RESTRICT poses, const std::uint32_t* HWY_RESTRICT bodies) {
  if constexpr (hn::MaxLanes(D()) == 2) {
    return hn::LoadU(D(), poses + kPoseRow * bodies[0]);
  } else {
    using Half = hn::Half<D>;
    return hn::Combine(D(), read_pairs<Half>(poses, bodies + hn::MaxLanes(Half())), read_pairs<Half>(poses, bodies));
  }
}

/// Writes them.
template <class D>
HWY_INLINE void write_pairs(hn::Vec<D> pairs, double* HWY_RESTRICT rows) {
  if constexpr (hn::MaxLanes(D()) == 2) {
    hn::StoreU(pairs, D(), rows);
  } else {
    using Half = hn::Half<D>;
    write_pairs<Half>(hn::LowerHalf(Half(), pairs), rows);
    write_pairs<Half>(hn::UpperHalf(Half(), pairs), rows + kPoseRow * hn::MaxLanes(Half()));
  }
}
#endif

/// Poses of the bodies of a block of elements; `bodies` one a lane.
template <class D>
HWY_INLINE Poses<D> read_poses(const double* HWY_RESTRICT poses, const std::uint32_t* HWY_RESTRICT bodies) {
  Num<D> field[kPoseRow];
#if HWY_TARGET != HWY_SCALAR
  if constexpr (hn::MaxLanes(D()) > 1) {
    const D d;
    for (size_t i = 0; i < kPoseRow; i += 2) {
      const auto even = read_pairs<D>(poses + i, bodies), odd = read_pairs<D>(poses + i, bodies + 1);
      field[i] = {hn::InterleaveLower(d, even, odd)}, field[i + 1] = {hn::InterleaveUpper(d, even, odd)};
    }
  }
#endif
  if constexpr (hn::MaxLanes(D()) == 1)
    for (size_t i = 0; i < kPoseRow; ++i) field[i] = num<D>(poses[kPoseRow * bodies[0] + i]);
  return {{field[0], field[1], field[2]}, {field[3], field[4], field[5], field[6]}};
}

template <class D>
HWY_INLINE void lay_pose_block(const PoseJob& job, size_t block) {
  const D d;
  const size_t W = hn::Lanes(d);
  const double *p = job.p + 3 * W * block, *q = job.q + 4 * W * block;
  const Num<D> field[kPoseRow] = {load<D>(p, 0), load<D>(p, 1), load<D>(p, 2), load<D>(q, 0),
                                  load<D>(q, 1), load<D>(q, 2), load<D>(q, 3), num<D>(0)};
  double* rows = job.poses + kPoseRow * W * block;
#if HWY_TARGET != HWY_SCALAR
  if constexpr (hn::MaxLanes(D()) > 1)
    for (size_t i = 0; i < kPoseRow; i += 2) {
      write_pairs<D>(hn::InterleaveLower(d, field[i].v, field[i + 1].v), rows + i);
      write_pairs<D>(hn::InterleaveUpper(d, field[i].v, field[i + 1].v), rows + i + kPoseRow);
    }
#endif
  if constexpr (hn::MaxLanes(D()) == 1)
    for (size_t i = 0; i < kPoseRow; ++i) hn::Store(field[i].v, d, rows + i);
}

/// a^(-2/3) of 1 <= a <= kMostOver by Newton's method on a² y³ = 1, powers of 8 taken out.
constexpr double kMostOver = 0x1p93;
template <class D>
HWY_INLINE Num<D> inverse_root(Num<D> a) {
  const D d;
  const Num<D> third = num<D>(1.0 / 3), four_thirds = num<D>(4.0 / 3);
  Num<D> scale = num<D>(1);
  if (HWY_UNLIKELY(!hn::AllFalse(d, hn::Ge(a.v, hn::Set(d, 8.0))))) {
    constexpr double powers[5][2] = {
        {0x1p48, 0x1p-32}, {0x1p24, 0x1p-16}, {0x1p12, 0x1p-8}, {0x1p6, 0x1p-4}, {0x1p3, 0x1p-2}};
    for (const auto& power : powers) {
      const auto above = hn::Ge(a.v, hn::Set(d, power[0]));
      a = select(above, num<D>(1 / power[0]) * a, a);
      scale = select(above, num<D>(power[1]) * scale, scale);
    }
  }
  const Num<D> a2 = a * a;
  Num<D> y = num<D>(1) / fma(num<D>(2.0 / 3), a, third);
  for (int i = 0; i < 6; ++i) {
    const Num<D> y2 = y * y;
    y = y * fnma(third * a2, y2 * y, four_thirds);
  }
  return scale * y;
}

constexpr double kNear = 0.854;  // kNearBounds to the power of the biaxial bound

/// A bending plane of a zone: about y with shear along z (sign +1), or about z with shear along y (sign -1).
template <class D>
struct BendingPlane {
  Num<D> shear_stiffness, bending_stiffness;
  Num<D> stiffness[2], cross;  // of the stations against their own rotation and the other's
  Num<D> lever[2];             // sign times x
  Num<D> shift, rotation;      // deformations
  Num<D> phi[2], soft[2], m[2];

  HWY_INLINE Num<D> shear() const { return shear_stiffness * fnma(lever[1], phi[1], fnma(lever[0], phi[0], shift)); }
  HWY_INLINE Num<D> moment() const { return bending_stiffness * ((rotation - phi[0]) - phi[1]); }
  HWY_INLINE void measure() {
    const Num<D> v = shear(), b = moment();
    m[0] = fma(lever[0], v, b);
    m[1] = fma(lever[1], v, b);
  }
};

/// Where a normal force stands in a cell: how far from its middle force, and on which side.
template <class D>
struct CellForce {
  Num<D> share;
  hn::Mask<D> upper;

  HWY_INLINE CellForce(const double* HWY_RESTRICT flow, int cell, Num<D> force) {
    const Num<D> above = force - load<D>(flow, cell + kCellForce);
    upper = hn::Ge(above.v, hn::Zero(D()));
    share = abs(above * select(upper, load<D>(flow, cell + kCellForce + 2), load<D>(flow, cell + kCellForce + 1)));
  }
  /// Between values at the cell's three forces.
  HWY_INLINE Num<D> mix(Num<D> low, Num<D> middle, Num<D> high) const {
    return fma(share, select(upper, high, low) - middle, middle);
  }
};

/// The law of a zone that flows in bending, shear or torsion (docs/theory/zones.md, eq. 1 to 9). Sets the elastic
/// resultants f; gives the lanes among `wanted` for which that is the whole truth and moves their history; the others
/// keep theirs.
template <class D, class M>
HWY_INLINE M flow_zone(M wanted, double* HWY_RESTRICT flow, const Num<D> x[2], const Num<D> k[6], const Num<D> d[6],
                       const Num<D> e_before[6], Num<D> f[6]) {
  using N = Num<D>;
  const D tag;
  const N zero = num<D>(0), one = num<D>(1), half = num<D>(0.5), tiny = num<D>(1e-290);
  M good = wanted;
  const auto demand = [&](M condition) { good = hn::And(good, condition); };

  const N slip[2] = {load<D>(flow, kSlip), load<D>(flow, kSlip + 1)}, twist = load<D>(flow, kTwist);
  f[0] = k[0] * (d[0] - load<D>(flow, kAxial));
  f[3] = k[3] * (d[3] - twist);
  demand(hn::Ge(f[0].v, load<D>(flow, kFlowLeast).v));
  demand(hn::Le(f[0].v, load<D>(flow, kFlowMost).v));

  BendingPlane<D> plane[2];
  for (int q = 0; q < 2; ++q) {
    BendingPlane<D>& P = plane[q];
    const int shear = q == 0 ? 2 : 1, bend = q == 0 ? 4 : 5;
    P.shear_stiffness = k[shear], P.bending_stiffness = k[bend];
    P.shift = d[shear] - slip[shear - 1];
    P.rotation = d[bend];
    for (int s = 0; s < 2; ++s) {
      P.lever[s] = q == 0 ? x[s] : zero - x[s];
      P.stiffness[s] = fma(x[s] * x[s], k[shear], k[bend]);
      P.phi[s] = load<D>(flow, kStations + s * kStationFields + kPhi + q);
      P.soft[s] = load<D>(flow, kStations + s * kStationFields + kSoftness + q);
    }
    P.cross = fma(x[0] * x[1], k[shear], k[bend]);
    // damage adds flexibility at the stations: (1 + S C) m = m0
    P.measure();
    const N s11 = fma(P.stiffness[0], P.soft[0], one), s22 = fma(P.stiffness[1], P.soft[1], one);
    const N s12 = P.cross * P.soft[1], s21 = P.cross * P.soft[0];
    const N scale = one / fms(s11, s22, s12 * s21);
    const N m0 = fms(P.m[0], s22, P.m[1] * s12) * scale, m1 = fms(P.m[1], s11, P.m[0] * s21) * scale;
    P.phi[0] = fma(P.soft[0], m0, P.phi[0]);
    P.phi[1] = fma(P.soft[1], m1, P.phi[1]);
    P.m[0] = m0, P.m[1] = m1;
  }

  // (|My|/Ly)^1.5 + (|Mz|/Lz)^1.5 of a station; an axis without any limit left stands apart
  struct Demand {
    N sum;
    M out, none[2];
  };
  const auto calc_demand = [&](int s) {
    Demand to{zero, hn::FirstN(tag, 0), {hn::FirstN(tag, 0), hn::FirstN(tag, 0)}};
    M moves = to.out;
    for (int q = 0; q < 2; ++q) {
      const int cell = kStations + s * kStationFields + kCell + q * kCellFields;
      const CellForce<D> at(flow, cell, f[0]);
      const N r = (load<D>(flow, kStations + s * kStationFields + kReached) - load<D>(flow, cell + kCellRotation)) *
                  load<D>(flow, cell + kCellRotation + 1);
      demand(hn::And(hn::Le(at.share.v, one.v), hn::And(hn::Ge(r.v, zero.v), hn::Le(r.v, one.v))));
      const auto positive = hn::Ge(plane[q].m[s].v, zero.v);
      const auto corner = [&](int force, int rotation) {
        const int value = cell + 2 * force + rotation;
        return select(positive, load<D>(flow, value + kCellPositive), load<D>(flow, value + kCellNegative));
      };
      const N low = at.mix(corner(0, 0), corner(1, 0), corner(2, 0));
      const N high = at.mix(corner(0, 1), corner(1, 1), corner(2, 1));
      const N limit = fma(r, high - low, low), size = abs(plane[q].m[s]);
      to.none[q] = hn::Le(limit.v, zero.v);
      const N ratio = select(to.none[q], zero, size / N{hn::Max(limit.v, tiny.v)});
      to.sum = to.sum + ratio * N{hn::Sqrt(ratio.v)};
      moves = hn::Or(moves, hn::And(to.none[q], hn::Gt(size.v, zero.v)));
    }
    to.out = hn::Or(moves, hn::Gt(to.sum.v, one.v));
    return to;
  };
  const auto calc_scale = [&](const Demand& at, N scale[2]) {
    demand(hn::Or(hn::Not(at.out), hn::Le(at.sum.v, hn::Set(tag, kMostOver))));
    const N common = select(hn::Gt(at.sum.v, one.v), inverse_root<D>(at.sum), one);
    for (int q = 0; q < 2; ++q) scale[q] = select(at.none[q], zero, common);
  };
  const Demand at[2] = {calc_demand(0), calc_demand(1)};
  N by[2][2] = {{zero, zero}, {zero, zero}};  // further inelastic rotation [plane][station]
  const M bends = hn::And(good, hn::Or(at[0].out, at[1].out));
  if (!hn::AllFalse(tag, bends)) {
    N scale[2][2], target[2][2], trial[2][2];
    for (int s = 0; s < 2; ++s) calc_scale(at[s], scale[s]);
    // one station alone
    const M alone[2] = {hn::AndNot(at[1].out, at[0].out), hn::AndNot(at[0].out, at[1].out)};
    for (int q = 0; q < 2; ++q) {
      BendingPlane<D>& P = plane[q];
      for (int s = 0; s < 2; ++s) {
        trial[q][s] = P.m[s];
        target[q][s] = P.m[s] * scale[s][q];
        const N turn = (P.m[s] - target[q][s]) / P.stiffness[s];
        by[q][s] = select(hn::And(alone[s], hn::Gt(P.stiffness[s].v, zero.v)), turn, zero);
      }
      const N m0 = P.m[0], m1 = P.m[1];
      P.m[0] = fnma(P.cross, by[q][1], select(alone[0], target[q][0], m0));
      P.m[1] = fnma(P.cross, by[q][0], select(alone[1], target[q][1], m1));
    }
    // which may push the other one out
    M both = hn::And(at[0].out, at[1].out);
    for (int s = 0; s < 2; ++s) {
      const Demand again = calc_demand(s);
      const M pushed = hn::And(alone[1 - s], again.out);
      if (HWY_LIKELY(hn::AllFalse(tag, pushed))) continue;
      N back[2];
      const M so_far = good;
      calc_scale(again, back);
      good = hn::Or(good, hn::AndNot(pushed, so_far));
      for (int q = 0; q < 2; ++q) target[q][s] = select(pushed, plane[q].m[s] * back[q], target[q][s]);
      both = hn::Or(both, pushed);
    }
    if (!hn::AllFalse(tag, both)) {
      N work[2] = {zero, zero};
      for (int q = 0; q < 2; ++q) {
        const BendingPlane<D>& P = plane[q];
        const N determinant = fms(P.stiffness[0], P.stiffness[1], P.cross * P.cross);
        demand(hn::Or(hn::Not(both), hn::Gt(determinant.v, (num<D>(1e-9) * P.stiffness[0] * P.stiffness[1]).v)));
        const N over0 = trial[q][0] - target[q][0], over1 = trial[q][1] - target[q][1];
        const N by0 = fms(P.stiffness[1], over0, P.cross * over1) / determinant;
        const N by1 = fms(P.stiffness[0], over1, P.cross * over0) / determinant;
        work[0] = fma(target[q][0], by0, work[0]);
        work[1] = fma(target[q][1], by1, work[1]);
        by[q][0] = select(both, by0, by[q][0]);
        by[q][1] = select(both, by1, by[q][1]);
      }
      demand(hn::Or(hn::Not(both), hn::And(hn::Ge(work[0].v, zero.v), hn::Ge(work[1].v, zero.v))));
    }
  }
  for (int q = 0; q < 2; ++q) {
    BendingPlane<D>& P = plane[q];
    for (int s = 0; s < 2; ++s) P.phi[s] = P.phi[s] + by[q][s];
    P.measure();
    f[q == 0 ? 2 : 1] = P.shear();
    f[q == 0 ? 4 : 5] = P.moment();
  }
  N reached[2];
  for (int s = 0; s < 2; ++s) {
    const N turned = fma(plane[0].phi[s], plane[0].phi[s], plane[1].phi[s] * plane[1].phi[s]);
    const N so_far = load<D>(flow, kStations + s * kStationFields + kReached);
    const M moves = hn::Or(hn::Ne(by[0][s].v, zero.v), hn::Ne(by[1][s].v, zero.v));
    reached[s] = select(moves, N{hn::Max(so_far.v, hn::Sqrt(turned.v))}, so_far);
    demand(hn::Lt(reached[s].v, load<D>(flow, kStations + s * kStationFields + kRupture).v));
  }
  // what is new of the inelastic rotation: a plastic part and added flexibility
  N plastic[2][2], soft[2][2];  // [plane][station]
  for (int q = 0; q < 2; ++q)
    for (int s = 0; s < 2; ++s) {
      const BendingPlane<D>& P = plane[q];
      const int station = kStations + s * kStationFields;
      const N m = P.m[s], share = load<D>(flow, station + kShare);
      const N added = fnma(P.soft[s], m, P.phi[s] - load<D>(flow, station + kPhi + q));
      const M damages = hn::And(bends, hn::And(hn::Gt(share.v, zero.v), hn::Gt((added * m).v, zero.v)));
      const N top = {hn::Min((share * abs(P.phi[s]) / abs(m)).v, (num<D>(kMostDamage) / P.stiffness[s]).v)};
      const N grown = fma(share, added / m, P.soft[s]);
      soft[q][s] = select(damages, N{hn::Max(P.soft[s].v, hn::Min(top.v, grown.v))}, P.soft[s]);
      plastic[q][s] = fnma(soft[q][s], m, P.phi[s]);
    }

  // what turns further lengthens or shortens
  N elongation = zero;
  for (int s = 0; s < 2; ++s) {
    const N so_far = load<D>(flow, kStations + s * kStationFields + kReached);
    M grows = hn::And(good, hn::Gt(reached[s].v, so_far.v));
    if (hn::AllFalse(tag, grows)) continue;
    N squares = zero, along = zero, bending = zero;
    for (int q = 0; q < 2; ++q) {
      const int cell = kStations + s * kStationFields + kCell + q * kCellFields;
      const auto positive = hn::Ge(plane[q].phi[s].v, zero.v);
      const auto lift_at = [&](int force) {
        return select(positive, load<D>(flow, cell + kCellLiftPositive + force),
                      load<D>(flow, cell + kCellLiftNegative + force));
      };
      const N lift = CellForce<D>(flow, cell, f[0]).mix(lift_at(0), lift_at(1), lift_at(2));
      const N square = plane[q].phi[s] * plane[q].phi[s];
      squares = squares + square;
      along = fma(square, lift, along);
      bending = fma(plane[q].m[s], by[q][s], bending);
    }
    grows = hn::And(grows, hn::Ne(along.v, zero.v));
    if (hn::AllFalse(tag, grows)) continue;
    const N unbound = (reached[s] - so_far) * along / squares;
    // the axial spring takes no more than bending brings
    const N brought =
        fnma(half, load<D>(flow, kStations + s * kStationFields + kShare), one) * N{hn::Max(zero.v, bending.v)};
    const N pull = N{hn::CopySign(one.v, unbound.v)} * fnma(k[0], elongation, f[0]);
    const N root = {hn::Sqrt(fma(num<D>(2) * k[0], brought, pull * pull).v)};
    const N most =
        select(hn::Lt(pull.v, zero.v), num<D>(2) * brought / (root - pull), (pull + root) / N{hn::Max(k[0].v, tiny.v)});
    const N bound = {hn::CopySign(hn::Min(abs(unbound).v, most.v), unbound.v)};
    elongation = elongation + select(grows, bound, zero);
  }
  f[0] = fnma(k[0], elongation, f[0]);

  // shear
  const N pressed = load<D>(flow, kShearFriction) * N{hn::Max(zero.v, (zero - f[0]).v)};
  N slipped = load<D>(flow, kSlipped);
  const N left = {hn::Max(zero.v, fnma(slipped, load<D>(flow, kSlipSoftening), one).v)};
  const N vy = f[1] / N{hn::Max(fma(load<D>(flow, kShearOwn), left, pressed).v, tiny.v)};
  const N vz = f[2] / N{hn::Max(fma(load<D>(flow, kShearOwn + 1), left, pressed).v, tiny.v)};
  const N over2 = fma(vy, vy, vz * vz);
  const M slides = hn::And(good, hn::Gt(over2.v, one.v));
  N slid[2] = {zero, zero};
  if (!hn::AllFalse(tag, slides)) {
    const N holds = select(slides, one / N{hn::Sqrt(over2.v)}, one);
    for (int a = 0; a < 2; ++a) {
      const N held = f[1 + a] * holds;
      slid[a] = select(slides, (f[1 + a] - held) * load<D>(flow, kFlexibility + 1 + a), zero);
      f[1 + a] = held;
    }
    slipped = select(slides, slipped + N{hn::Sqrt(fma(slid[0], slid[0], slid[1] * slid[1]).v)}, slipped);
    demand(hn::Lt(slipped.v, load<D>(flow, kSlipRupture).v));
    for (int q = 0; q < 2; ++q)
      for (int s = 0; s < 2; ++s)
        plane[q].m[s] = select(slides, fma(plane[q].lever[s], f[q == 0 ? 2 : 1], f[q == 0 ? 4 : 5]), plane[q].m[s]);
  }
  // torsion
  const N torsion = load<D>(flow, kTorsion);
  const M twists = hn::And(good, hn::Gt(abs(f[3]).v, torsion.v));
  N twisted = load<D>(flow, kTwisted), over = zero;
  if (!hn::AllFalse(tag, twists)) {
    const N held = {hn::CopySign(torsion.v, f[3].v)};
    over = select(twists, (f[3] - held) * load<D>(flow, kFlexibility + 3), zero);
    f[3] = select(twists, held, f[3]);
    twisted = twisted + abs(over);
    demand(hn::Lt(twisted.v, load<D>(flow, kTwistRupture).v));
  }

  M flowed = hn::Or(bends, hn::Or(slides, twists));
  // near its limits a zone would be sent back at once
  const M near = hn::Or(hn::Ge(at[0].sum.v, hn::Set(tag, kNear)), hn::Ge(at[1].sum.v, hn::Set(tag, kNear)));
  const N idle = select(hn::Or(flowed, near), zero, load<D>(flow, kIdle) + one);
  demand(hn::Lt(idle.v, hn::Set(tag, kLongestIdle)));
  flowed = hn::And(good, flowed);
  const M turned = hn::And(good, bends);
  N stored = zero;
  for (int i = 0; i < 6; ++i) stored = fma(f[i] * load<D>(flow, kFlexibility + i), f[i], stored);
  for (int q = 0; q < 2; ++q)
    for (int s = 0; s < 2; ++s) {
      const int station = kStations + s * kStationFields;
      store_where<D>(turned, soft[q][s], flow, station + kSoftness + q);
      store_where<D>(turned, plastic[q][s], flow, station + kPhi + q);
      stored = fma(soft[q][s] * plane[q].m[s], plane[q].m[s], stored);
    }
  stored = half * stored;
  N work = zero;
  for (int i = 0; i < 6; ++i) {
    work = fma(fma(k[i], e_before[i], f[i]), d[i] - load<D>(flow, kBefore + i), work);
    store_where<D>(good, d[i], flow, kBefore + i);
  }
  const N lost = fms(half, work, stored - load<D>(flow, kStored));
  // nothing in an elastic step, unless the zone was lengthened from outside before it
  store_where<D>(good, load<D>(flow, kPlastic) + lost, flow, kPlastic);
  store_where<D>(flowed, load<D>(flow, kAxial) + elongation, flow, kAxial);
  store_where<D>(flowed, slip[0] + slid[0], flow, kSlip);
  store_where<D>(flowed, slip[1] + slid[1], flow, kSlip + 1);
  store_where<D>(flowed, slipped, flow, kSlipped);
  store_where<D>(flowed, twist + over, flow, kTwist);
  store_where<D>(flowed, twisted, flow, kTwisted);
  store_where<D>(good, stored, flow, kStored);
  store_where<D>(good, idle, flow, kIdle);
  for (int s = 0; s < 2; ++s) store_where<D>(good, reached[s], flow, kStations + s * kStationFields + kReached);
  return good;
}

/// Forces of one block of elements (docs/theory/zones.md, eq. 1 to 12, and multibody.md, eq. 4).
template <class D>
HWY_INLINE void evaluate_element_block(const ElementJob& job, size_t block, const Poses<D>& A, const Poses<D>& B) {
  using N = Num<D>;
  const D tag;
  const size_t W = hn::Lanes(tag);
  double* HWY_RESTRICT state = job.states + static_cast<size_t>(kStateFields) * W * block;
  const std::uint32_t* HWY_RESTRICT constants = job.constants + static_cast<size_t>(kConstants) * block;
  const auto constant = [&](int field) -> N {
    return {hn::Load(tag, job.pool + size_t{constants[field - kStateFields]} * W)};
  };
  const auto constant3 = [&](int field) -> V3<D> {
    return {constant(field), constant(field + 1), constant(field + 2)};
  };
  const auto constant4 = [&](int field) -> Q4<D> {
    return {constant(field), constant(field + 1), constant(field + 2), constant(field + 3)};
  };
  double* HWY_RESTRICT out = job.forces + static_cast<size_t>(kForceFields) * W * block;

  const V3<D> lever_a = turn(A.q, constant3(kMarkerA));
  const V3<D> lever_b = turn(B.q, constant3(kMarkerB));
  const Q4<D> qF = A.q * constant4(kMarkerA + 3), qM = B.q * constant4(kMarkerB + 3);
  const M33<D> F = to_matrix(qF);
  const V3<D> apart = B.p - A.p;
  const V3<D> t = transpose_times(F, (apart - lever_a) + lever_b);
  const Q4<D> q = conj_times(qF, qM);
  const V3<D> v{{hn::CopySign(q.x.v, hn::Xor(q.x.v, q.w.v))},
                {hn::CopySign(q.y.v, hn::Xor(q.y.v, q.w.v))},
                {hn::CopySign(q.z.v, hn::Xor(q.z.v, q.w.v))}};
  const N s2 = dot(v, v);
  N over_sine, coefficient;
  turning<D>(s2, over_sine, coefficient);
  const V3<D> r = over_sine * v;
  const auto too_far = hn::Gt(s2.v, constant(kMostTurn).v);
  auto outside = too_far;

  const N d[6] = {t.x, t.y, t.z, r.x, r.y, r.z};
  N u[6], e[6], f[6], k[6], was[6], before[6];
  for (int i = 0; i < 6; ++i) {
    u[i] = d[i] - constant(kOffset + i);
    was[i] = load<D>(state, kStretch + i);
    e[i] = u[i], before[i] = was[i];
  }
  const bool softened = job.softened[block] != 0;
  if (softened) {
    for (int plane = 0; plane < 2; ++plane) {
      const int shear = plane == 0 ? 2 : 1, bend = plane == 0 ? 4 : 5, at = kSoft + 4 * plane;
      const N c00 = constant(at), c01 = constant(at + 1), c10 = constant(at + 2), c11 = constant(at + 3);
      e[shear] = fma(c00, u[shear], c01 * u[bend]);
      e[bend] = fma(c10, u[shear], c11 * u[bend]);
      before[shear] = fma(c00, was[shear], c01 * was[bend]);
      before[bend] = fma(c10, was[shear], c11 * was[bend]);
    }
  }
  for (int i = 0; i < 6; ++i) {
    k[i] = constant(kStiffness + i);
    f[i] = k[i] * e[i];
  }
  // is every resultant inside the bounds for sure?
  const N one = num<D>(1), zero = num<D>(0);
  outside = hn::Or(outside,
                   hn::Not(hn::And(hn::Ge(f[0].v, constant(kLeastForce).v), hn::Le(f[0].v, constant(kMostForce).v))));
  const N vy = f[1] * constant(kShearScale), vz = f[2] * constant(kShearScale + 1);
  outside = hn::Or(outside, hn::Gt(fma(vy, vy, vz * vz).v, one.v));
  const N torsion_scale = constant(kTorsionScale);
  outside = hn::Or(outside, hn::Gt((abs(f[3]) * torsion_scale).v, one.v));
  const N exponent = constant(kExponent);
  const N scale_y = constant(kMomentScale), scale_z = constant(kMomentScale + 1);
  const N x[2] = {constant(kStation), constant(kStation + 1)};
  for (int station = 0; station < 2; ++station) {
    const N my = abs(fma(x[station], f[2], f[4])) * scale_y, mz = abs(fnma(x[station], f[1], f[5])) * scale_z;
    const auto linear = hn::Gt((my + mz).v, one.v);
    if (HWY_LIKELY(hn::AllFalse(tag, linear))) continue;
    const auto is_square = hn::Ge(exponent.v, hn::Set(tag, 2.0)),
               is_three_halves = hn::Ge(exponent.v, hn::Set(tag, 1.5));
    const auto raised = [&](N m) -> N {
      return select(is_square, m * m, select(is_three_halves, m * N{hn::Sqrt(m.v)}, m));
    };
    outside = hn::Or(outside, hn::Gt((raised(my) + raised(mz)).v, one.v));
  }
  // what the damper does on the part of the deformation that is not elastic
  N slid[6] = {zero, zero, zero, zero, zero, zero};
  bool books_slid = softened;
  if (HWY_UNLIKELY(!hn::AllFalse(tag, outside))) {
    const auto flows = hn::AndNot(too_far, hn::And(outside, hn::Gt(constant(kFlows).v, zero.v)));
    if (softened)
      for (int i = 0; i < 6; ++i) slid[i] = (u[i] - was[i]) - (e[i] - before[i]);
    if (!hn::AllFalse(tag, flows)) {
      double* HWY_RESTRICT flow = job.flows + static_cast<size_t>(kFlowFields) * W * block;
      N f_flow[6], d_before[6];
      for (int i = 0; i < 6; ++i) d_before[i] = load<D>(flow, kBefore + i);
      const auto good = flow_zone<D>(flows, flow, x, k, d, was, f_flow);
      for (int i = 0; i < 6; ++i) {
        f[i] = select(good, f_flow[i], f[i]);
        const N stretch = f_flow[i] * load<D>(flow, kFlexibility + i);
        e[i] = select(good, stretch, e[i]);
        u[i] = select(good, stretch, u[i]);
        before[i] = select(good, was[i], before[i]);
        slid[i] = select(good, (d[i] - d_before[i]) - (stretch - was[i]), slid[i]);
      }
      books_slid = true;
      outside = hn::AndNot(good, outside);
    }
  } else if (softened) {
    for (int i = 0; i < 6; ++i) slid[i] = (u[i] - was[i]) - (e[i] - before[i]);
  }

  // standard linear solid: the damper follows the mean of the step
  const N viscous = constant(kViscous), half = num<D>(0.5), keep = one - constant(kRelaxation);
  const N taken = fma(half, keep, half);
  const auto inside = hn::Not(outside);
  N g[6], work = zero, lost = zero;
  for (int i = 0; i < 6; ++i) {
    const N old = load<D>(state, kBehind + i), stretched = e[i] - before[i];
    const N behind = fma(taken, stretched, keep * old), rate = viscous * k[i];
    const N twice_mean = rate * (behind + old);
    work = fma(twice_mean, stretched, work);
    if (books_slid) lost = fma(twice_mean, slid[i], lost);
    g[i] = fma(rate, behind, f[i]);
    store_where<D>(inside, behind, state, kBehind + i);
    store_where<D>(inside, u[i], state, kStretch + i);
  }
  store_where<D>(inside, fma(half, work, load<D>(state, kDamped)), state, kDamped);
  if (books_slid) store_where<D>(inside, fma(half, lost, load<D>(state, kBled)), state, kBled);

  // torque conjugate to the rate of the rotation vector
  const V3<D> m{g[3], g[4], g[5]};
  const V3<D> rm = cross(r, m);
  const V3<D> turned = fma(coefficient, cross(r, rm), fma(half, rm, m));
  const V3<D> force = F * V3<D>{g[0], g[1], g[2]}, torque = F * turned;
  store3<D>(force, out, 0);
  // M seen from both centres
  store3<D>(cross(apart + lever_b, force) + torque, out, 3);
  store3<D>(cross(lever_b, force) + torque, out, 6);
  if (HWY_UNLIKELY(!hn::AllFalse(tag, outside))) report<D>(outside, block, *job.outside);
}

template <class D>
HWY_INLINE void evaluate_all(const ElementJob& job) {
  const D d;
  const size_t W = hn::Lanes(d);
  const auto find_next = [&](size_t from) {
    while (from < job.last && job.live[from] == 0) ++from;
    return from;
  };
  size_t next = find_next(job.first);
  if (job.a != nullptr) {
    for (; next < job.last; next = find_next(next + 1))
      evaluate_element_block<D>(job, next, read_poses<D>(job.poses, job.a + next * W),
                                read_poses<D>(job.poses, job.b + next * W));
  } else {
    for (; next < job.last; next = find_next(next + 1)) {
      const size_t a = job.body_a[next], b = job.body_b[next];
      evaluate_element_block<D>(job, next, {load3<D>(job.p + 3 * W * a, 0), load4<D>(job.q + 4 * W * a, 0)},
                                {load3<D>(job.p + 3 * W * b, 0), load4<D>(job.q + 4 * W * b, 0)});
    }
  }
}

template <class D>
HWY_INLINE void advance_all(const BodyJob& job) {
  Num<D> sum = num<D>(0);
  for (size_t block = 0; block < job.blocks; ++block) advance_body_block<D>(job, block, sum);
  store<D>(sum, job.sum, 0);
}

template <class D>
HWY_INLINE void lay_all(const PoseJob& job) {
  for (size_t block = 0; block < job.blocks; ++block) lay_pose_block<D>(job, block);
}

template <class D>
HWY_INLINE void sum_all(const SumJob& job) {
  const size_t W = hn::Lanes(D());
  for (size_t b = 0; b < job.bodies; ++b) {
    V3<D> f{num<D>(0), num<D>(0), num<D>(0)}, t = f;
    for (std::uint32_t i = job.first[b]; i < job.first[b + 1]; ++i) {
      const double* from = job.forces + static_cast<size_t>(kForceFields) * W * (job.entries[i] / 2);
      if (job.entries[i] % 2 == 0) {
        f = f + load3<D>(from, 0);
        t = t + load3<D>(from, 3);
      } else {
        f = f - load3<D>(from, 0);
        t = t - load3<D>(from, 6);
      }
    }
    store3<D>(f, job.force + 3 * W * b, 0);
    store3<D>(t, job.torque + 3 * W * b, 0);
  }
}

using Wide = hn::ScalableTag<double>;
using One = hn::CappedTag<double, 1>;

size_t lanes_here() { return hn::Lanes(Wide()); }
const char* name_here() { return hwy::TargetName(HWY_TARGET); }
void advance_bodies_here(const BodyJob& job) { advance_all<Wide>(job); }
void lay_poses_here(const PoseJob& job) { lay_all<Wide>(job); }
void evaluate_elements_here(const ElementJob& job) { evaluate_all<Wide>(job); }
void advance_bodies_singly_here(const BodyJob& job) { advance_all<One>(job); }
void lay_poses_singly_here(const PoseJob& job) { lay_all<One>(job); }
void evaluate_elements_singly_here(const ElementJob& job) { evaluate_all<One>(job); }
void sum_forces_here(const SumJob& job) { sum_all<Wide>(job); }
void sum_forces_singly_here(const SumJob& job) { sum_all<One>(job); }

}  // namespace HWY_NAMESPACE
}  // namespace topple::mbs::kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace topple::mbs::kernel {

HWY_EXPORT(lanes_here);
HWY_EXPORT(name_here);
HWY_EXPORT(advance_bodies_here);
HWY_EXPORT(lay_poses_here);
HWY_EXPORT(evaluate_elements_here);
HWY_EXPORT(advance_bodies_singly_here);
HWY_EXPORT(lay_poses_singly_here);
HWY_EXPORT(evaluate_elements_singly_here);
HWY_EXPORT(sum_forces_here);
HWY_EXPORT(sum_forces_singly_here);

size_t lanes() { return HWY_DYNAMIC_DISPATCH(lanes_here)(); }
std::string target_name() { return HWY_DYNAMIC_DISPATCH(name_here)(); }
void advance_bodies(const BodyJob& job) { HWY_DYNAMIC_DISPATCH(advance_bodies_here)(job); }
void lay_poses(const PoseJob& job) { HWY_DYNAMIC_DISPATCH(lay_poses_here)(job); }
void evaluate_elements(const ElementJob& job) { HWY_DYNAMIC_DISPATCH(evaluate_elements_here)(job); }
void advance_bodies_singly(const BodyJob& job) { HWY_DYNAMIC_DISPATCH(advance_bodies_singly_here)(job); }
void lay_poses_singly(const PoseJob& job) { HWY_DYNAMIC_DISPATCH(lay_poses_singly_here)(job); }
void evaluate_elements_singly(const ElementJob& job) { HWY_DYNAMIC_DISPATCH(evaluate_elements_singly_here)(job); }
void sum_forces(const SumJob& job) { HWY_DYNAMIC_DISPATCH(sum_forces_here)(job); }
void sum_forces_singly(const SumJob& job) { HWY_DYNAMIC_DISPATCH(sum_forces_singly_here)(job); }

}  // namespace topple::mbs::kernel
#endif
