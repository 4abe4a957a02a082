// Compiled once for each instruction set (Highway's foreach_target).
#include "mbs/contact_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mbs/contact_kernel.cpp"
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

#include "mbs/contact_math.inc"
#include "mbs/lane_math.inc"

HWY_BEFORE_NAMESPACE();
namespace topple::mbs::kernel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr double kLeastShare = 0.05;  // of its stiffness that a pair keeps whatever it has earned
constexpr double kBegun = 0.1;        // of what its points hold, what a pair that has hardly begun measures lacks by

template <class D>
HWY_INLINE V3<D> zeros() {
  return {num<D>(0), num<D>(0), num<D>(0)};
}

/// Reads fields of scattered bodies, `stride` between them.
template <class D>
struct Reader {
  const double* HWY_RESTRICT from;
  hn::Vec<hn::RebindToSigned<D>> at;
  size_t stride;

  HWY_INLINE Reader(const double* start, const std::uint32_t* indices, size_t between) : from(start), stride(between) {
    const hn::RebindToSigned<D> di;
    const hn::Rebind<std::uint32_t, D> du;
    at = hn::BitCast(di, hn::PromoteTo(hn::RebindToUnsigned<D>(), hn::LoadU(du, indices)));
  }
  HWY_INLINE Num<D> operator()(int field) const {
    return {hn::GatherIndex(D(), from + static_cast<size_t>(field) * stride, at)};
  }
  HWY_INLINE V3<D> three(int field) const { return {(*this)(field), (*this)(field + 1), (*this)(field + 2)}; }
};

template <class D>
HWY_INLINE void find_all_lows(const LowJob& job) {
  const size_t W = hn::Lanes(D());
  const V3<D> n{load<D>(job.nx, 0), load<D>(job.ny, 0), load<D>(job.nz, 0)};
  const Num<D> offset = load<D>(job.offset, 0);
  for (size_t block = 0; block < job.blocks; ++block) {
    const double *R = job.R + 9 * W * block, *bounds = job.bounds + 6 * W * block;
    const V3<D> down = transpose_times(M33<D>{load3<D>(R, 0), load3<D>(R, 3), load3<D>(R, 6)}, n);
    const Num<D> reach =
        fma(abs(down.z), load<D>(bounds, 5), fma(abs(down.y), load<D>(bounds, 4), abs(down.x) * load<D>(bounds, 3)));
    const Num<D> centre = dot(n, load3<D>(job.p + 3 * W * block, 0)) + dot(down, load3<D>(bounds, 0));
    store<D>((centre - offset) - reach, job.low + W * block, 0);
  }
}

template <class D>
HWY_INLINE void find_all_ways(const WayJob& job) {
  const size_t W = hn::Lanes(D());
  const V3<D> frame{load<D>(job.x, 0), load<D>(job.y, 0), load<D>(job.z, 0)};
  const Num<D> h = load<D>(job.h, 0);
  const auto norm = [](const V3<D>& x) -> Num<D> { return {hn::Sqrt(dot(x, x).v)}; };
  for (size_t block = 0; block < job.blocks; ++block) {
    const V3<D> v = load3<D>(job.v + 3 * W * block, 0), w = load3<D>(job.w + 3 * W * block, 0);
    const V3<D> seen{v.x - frame.x, v.y - frame.y, v.z - frame.z};
    store<D>(h * fma(norm(w), load<D>(job.reach + W * block, 0), norm(seen)), job.way + W * block, 0);
  }
}

/// Symmetric matrix times vector; its six fields begin at `field`.
template <class D>
HWY_INLINE V3<D> times(const double* HWY_RESTRICT group, int field, const V3<D>& v) {
  const Num<D> xy = load<D>(group, field + 1), xz = load<D>(group, field + 2), yz = load<D>(group, field + 4);
  return {fma(xz, v.z, fma(xy, v.y, load<D>(group, field) * v.x)),
          fma(yz, v.z, fma(load<D>(group, field + 3), v.y, xy * v.x)),
          fma(load<D>(group, field + 5), v.z, fma(yz, v.y, xz * v.x))};
}

template <class D>
HWY_INLINE void read_block(const TouchJob& job, size_t block) {
  const size_t W = hn::Lanes(D());
  double* to = job.touched + block * kTouchedFields * W;
  const auto vectors = [&](const double* from) {
    return Reader<D>(from, job.vectors + block * W, job.stride).three(0);
  };
  const Num<D> zero = num<D>(0);
  const V3<D> v = vectors(job.v), w = vectors(job.w);
  Num<D> row[kTouchedRow] = {v.x, v.y, v.z, w.x, w.y, w.z};
  const Reader<D> R(job.R, job.tensors + block * W, job.stride), c(job.constants, job.tensors + block * W, job.stride);
  static_assert(kBodyFields == 9, "constants lie as matrices do");
  const Num<D> m = row[kRowMass] = c(kInverseMass);
  // R I Rᵀ
  const Num<D> xx = c(kInverseInertia), xy = c(kInverseInertia + 1), xz = c(kInverseInertia + 2),
               yy = c(kInverseInertia + 3), yz = c(kInverseInertia + 4), zz = c(kInverseInertia + 5);
  const V3<D> r[3] = {R.three(0), R.three(3), R.three(6)};
  Num<D>* inertia = row + kRowInertia;
  int field = 0;
  for (int i = 0; i < 3; ++i) {
    const V3<D> x{fma(xz, r[i].z, fma(xy, r[i].y, xx * r[i].x)), fma(yz, r[i].z, fma(yy, r[i].y, xy * r[i].x)),
                  fma(zz, r[i].z, fma(yz, r[i].y, xz * r[i].x))};
    for (int j = i; j < 3; ++j) inertia[field++] = dot(r[j], x);
  }
  row[kRowGroups] = load<D>(job.groups + block * W, 0), row[kRowGroups + 1] = row[kRowGroups + 2] = zero;
  write_rows<D, kTouchedRow>(row, job.rows + block * W * kTouchedRow);
  store<D>(m, to, kTouchedMass);
  for (int i = 0; i < 6; ++i) store<D>(inertia[i], to, kTouchedInertia + i);
  const Num<D> h = num<D>(job.h);
  const V3<D> gravity{num<D>(job.gravity[0]), num<D>(job.gravity[1]), num<D>(job.gravity[2])};
  const V3<D> force = vectors(job.force) + vectors(job.joint_force);
  const V3<D> torque = vectors(job.torque) + vectors(job.joint_torque);
  // what does not move has no gravity
  const Num<D> free = select(hn::Gt(m.v, hn::Zero(D())), h, zero);
  store3<D>(fma(free, gravity, (h * m) * force), to, kChangeBefore);
  store3<D>(times<D>(to, kTouchedInertia, h * torque), to, kChangeBefore + 3);
  const hn::CappedTag<double, kWrenchRow> d;
  double* sums = job.sums + block * W * kWrenchRow;
  for (size_t i = 0; i < W * kWrenchRow; i += hn::Lanes(d)) hn::StoreU(hn::Zero(d), d, sums + i);
}

template <class D>
HWY_INLINE void update_block(const TouchJob& job, size_t block) {
  const size_t W = hn::Lanes(D());
  const double* t = job.touched + block * kTouchedFields * W;
  constexpr std::uint32_t in_turn[kMostLanes] = {0, 1, 2, 3, 4, 5, 6, 7};
  Num<D> s[kWrenchRow];
  read_rows<D, kWrenchRow>(job.sums + block * W * kWrenchRow, in_turn, s);
  const Num<D> h = num<D>(job.h), zero = num<D>(0);
  const V3<D> v = fma(h * load<D>(t, kTouchedMass), {s[0], s[1], s[2]}, load3<D>(t, kChangeBefore));
  const V3<D> w = times<D>(t, kTouchedInertia, h * V3<D>{s[3], s[4], s[5]}) + load3<D>(t, kChangeBefore + 3);
  const Num<D> change[kWrenchRow] = {v.x, v.y, v.z, w.x, w.y, w.z, zero, zero};
  write_rows<D, kWrenchRow>(change, job.changes + block * W * kWrenchRow);
}

/// Of a against b at a's centre.
template <class D>
struct Motion {
  V3<D> v, w;
};
template <class D>
HWY_INLINE Motion<D> calc_motion(const Num<D>* A, const Num<D>* B, const V3<D>& apart) {
  const V3<D> va{A[0], A[1], A[2]}, wa{A[3], A[4], A[5]}, vb{B[0], B[1], B[2]}, wb{B[3], B[4], B[5]};
  return {(va - vb) - cross(wb, apart), wa - wb};
}
/// By what the forces known so far change it within the step.
template <class D>
HWY_INLINE Motion<D> calc_change(const ContactJob& job, size_t block, const V3<D>& apart) {
  const size_t W = hn::Lanes(D());
  Num<D> A[kWrenchRow], B[kWrenchRow];
  read_rows<D, kWrenchRow>(job.changes, job.a + block * W, A);
  read_rows<D, kWrenchRow>(job.changes, job.b + block * W, B);
  return calc_motion<D>(A, B, apart);
}

/// A wrench on a about its centre, and what it takes from b about b's.
template <class D>
HWY_INLINE void write_wrench(const ContactJob& job, size_t block, const V3<D>& apart, const V3<D>& force,
                             const V3<D>& torque) {
  const size_t W = hn::Lanes(D());
  const Num<D> zero = num<D>(0);
  const V3<D> torque_b = torque + cross(apart, force);
  const Num<D> row[2 * kWrenchRow] = {force.x, force.y, force.z, torque.x,   torque.y,   torque.z,   zero, zero,
                                      force.x, force.y, force.z, torque_b.x, torque_b.y, torque_b.z, zero, zero};
  write_rows<D, 2 * kWrenchRow>(row, job.wrenches + block * W * 2 * kWrenchRow);
}

/// What joints take, of a block of groups; null: they hold none of its bodies.
HWY_INLINE const double* held_of(const ContactJob& job, size_t block, size_t W) {
  if (HWY_LIKELY(job.held == nullptr || job.held[block] < 0)) return nullptr;
  return job.held_fields + static_cast<size_t>(job.held[block]) * kHeldFields * W;
}

/// The motion that joints take from a body under a wrench.
template <class D>
HWY_INLINE Motion<D> calc_less(const double* less, const V3<D>& force, const V3<D>& torque) {
  const M33<D> turn{load3<D>(less, kHeldTurn), load3<D>(less, kHeldTurn + 3), load3<D>(less, kHeldTurn + 6)};
  return {times<D>(less, 0, force) + turn * torque, transpose_times(turn, force) + times<D>(less, kHeldSpin, torque)};
}
/// The power of the wrench on that motion.
template <class D>
HWY_INLINE Num<D> calc_less_power(const double* less, const V3<D>& force, const V3<D>& torque) {
  const Motion<D> m = calc_less<D>(less, force, torque);
  return dot(force, m.v) + dot(torque, m.w);
}

/// The force times the speed that it makes, the groups of a body sharing its mass.
template <class D>
HWY_INLINE Num<D> calc_mobility(const double* HWY_RESTRICT g, const double* held, const V3<D>& apart,
                                const V3<D>& force, const V3<D>& torque) {
  const size_t W = hn::Lanes(D());
  const V3<D> torque_b = torque + cross(apart, force);
  const Num<D> f2 = dot(force, force);
  Num<D> of_a = fma(load<D>(g, kMassA), f2, dot(torque, times<D>(g, kInertiaA, torque))),
         of_b = fma(load<D>(g, kMassB), f2, dot(torque_b, times<D>(g, kInertiaB, torque_b)));
  if (HWY_UNLIKELY(held != nullptr)) {
    of_a = maximum(of_a - calc_less_power<D>(held, force, torque), num<D>(0));
    of_b = maximum(of_b - calc_less_power<D>(held + kHeldBody * W, force, torque_b), num<D>(0));
  }
  return fma(load<D>(g, kGroupsA), of_a, load<D>(g, kGroupsB) * of_b);
}

/// Forces of the dashpots of a group's first points within their limits, along several directions where that is wanted
/// and there are no other points.
template <class D>
HWY_NOINLINE void damp_group(const ContactJob& job, size_t block, const Motion<D>& change, const Damper<D>& damper,
                             hn::Mask<D> wanted, Num<D>* force) {
  const D d;
  const size_t W = hn::Lanes(d);
  const double *g = job.groups + block * kGroupFields * W, *held = held_of(job, block, W);
  const V3<D> n = load3<D>(g, kNormal), apart = load3<D>(g, kApart);
  const Num<D> band = num<D>(0) - load<D>(g, kBand), most = load<D>(g, kMost), zero = num<D>(0);
  const size_t first = job.rows[block], all = job.rows[block + 1] - first, count = std::min(all, kMostDamped);
  V3<D> lever[kMostDamped];
  Num<D> rate[kMostDamped], speed[kMostDamped], low[kMostDamped], top[kMostDamped];
  const auto point = [&](size_t i) { return job.points + (first + i) * kPointFields * W; };
  for (size_t i = 0; i < count; ++i) {
    const double* p = point(i);
    const Num<D> full = load<D>(p, kFull);
    lever[i] = cross(load3<D>(p, kPlace), n), rate[i] = load<D>(p, kRate);
    speed[i] = fma(damper.at, dot(n, change.v) + dot(lever[i], change.w), load<D>(p, kApproach));
    force[i] = damper.share * rate[i] * speed[i];
    low[i] = band * full, top[i] = select(hn::Gt(full.v, zero.v), most * full, zero);
  }
  for (size_t i = count; i < all; ++i) wanted = hn::AndNot(hn::Gt(load<D>(point(i), kRate).v, zero.v), wanted);
  const auto slow = [&](Num<D> against, const V3<D>& torque) {
    const V3<D> push = against * n, torque_b = torque - cross(apart, push);  // on b, and against what acts on a
    V3<D> va = load<D>(g, kMassA) * push, wa = num<D>(-1) * times<D>(g, kInertiaA, torque);
    V3<D> vb = load<D>(g, kMassB) * push, wb = num<D>(-1) * times<D>(g, kInertiaB, torque_b);
    if (held != nullptr) {
      const Motion<D> a = calc_less<D>(held, push, num<D>(-1) * torque),
                      b = calc_less<D>(held + kHeldBody * W, push, num<D>(-1) * torque_b);
      va = va - a.v, wa = wa - a.w, vb = vb - b.v, wb = wb - b.w;
    }
    const Num<D> a = load<D>(g, kGroupsA), b = load<D>(g, kGroupsB);
    const V3<D> spin_b = b * wb;
    return Slowed<D>{dot(n, (a * va + b * vb) + cross(spin_b, apart)), a * wa + spin_b};
  };
  damp_all_motions<D>(
      count, n, [&](size_t i) { return lever[i]; }, [&](size_t i) { return rate[i]; }, slow, num<D>(job.h) * damper.at,
      speed, low, top, wanted, force);
}

template <class D>
HWY_INLINE void press_block(const ContactJob& job, size_t block) {
  const D d;
  const size_t W = hn::Lanes(d);
  double* g = job.groups + block * kGroupFields * W;
  Num<D> A[kTouchedRow], B[kTouchedRow];
  read_rows<D, kTouchedRow>(job.bodies, job.a + block * W, A);
  read_rows<D, kTouchedRow>(job.bodies, job.b + block * W, B);
  const V3<D> n = load3<D>(g, kNormal);
  V3<D> apart = load3<D>(g, kApart);
  const Num<D> h = num<D>(job.h);
  V3<D> turned = zeros<D>();  // of a in the step
  const Num<D> zero = num<D>(0), half = num<D>(0.5), one = num<D>(1);
  Num<D> along_between = zero;  // with the levers of the middle of the step, as the forces of both its ends work
  if (job.follows) {
    const V3<D> way = V3<D>{A[0], A[1], A[2]} - V3<D>{B[0], B[1], B[2]};
    along_between = dot(n, calc_motion<D>(A, B, fma(half * h, way, apart)).v);
    apart = fma(h, way, apart);
    store3<D>(apart, g, kApart);
    turned = h * V3<D>{A[3], A[4], A[5]};
  }
  const Motion<D> m = calc_motion<D>(A, B, apart);
  const Num<D> along = dot(n, m.v);
  if (job.follows) {
    const V3<D> v = load3<D>(g, kMotion) + m.v, w = load3<D>(g, kMotion + 3) + m.w;
    const Num<D> power = dot(load3<D>(g, kDamp), v) + dot(load3<D>(g, kDamp + 3), w);
    store<D>(fnma(half * h, power, load<D>(g, kSpent)), g, kSpent);
  }
  store3<D>(m.v, g, kMotion), store3<D>(m.w, g, kMotion + 3);
  store<D>(A[kRowMass], g, kMassA), store<D>(B[kRowMass], g, kMassB);
  store<D>(A[kRowGroups], g, kGroupsA), store<D>(B[kRowGroups], g, kGroupsB);
  for (int i = 0; i < 6; ++i) {
    store<D>(A[kRowInertia + i], g, kInertiaA + i);
    store<D>(B[kRowInertia + i], g, kInertiaB + i);
  }
  const Num<D> inverse_mass = load<D>(g, kMassA) + load<D>(g, kMassB), mean = load<D>(g, kMean),
               damping = load<D>(g, kDamping), twice_zeta = num<D>(2) * load<D>(g, kZeta);
  const V3<D> to_b = cross(apart, n);
  const double* less = held_of(job, block, W);
  const auto plain = hn::Ge(damping.v, hn::Zero(d));
  Num<D> energy = zero, impedance = zero, total = zero, held = zero, stores = zero, holds = zero;
  V3<D> torque = zeros<D>(), held_torque = torque;
  auto some_meet = hn::FirstN(d, 0);
  for (size_t row = job.rows[block]; row < job.rows[block + 1]; ++row) {
    double* p = job.points + row * kPointFields * W;
    V3<D> place = load3<D>(p, kPlace);
    Num<D> between = zero;
    if (job.follows) {
      const V3<D> by = cross(turned, place);
      between = along_between + dot(cross(fma(half, by, place), n), m.w);
      place = place + by;
      store3<D>(place, p, kPlace);
    }
    const V3<D> la = cross(place, n), lb = la + to_b;
    const Num<D> k = load<D>(p, kPointStiffness), speed = along + dot(la, m.w), way = h * abs(speed);
    Num<D> depth = load<D>(p, kDepth), unseen = load<D>(p, kMet);
    if (job.follows) {
      unseen = select(hn::Le(depth.v, hn::Zero(d)), num<D>(kSlowed), zero);
      depth = fma(h, between, depth);
      store<D>(depth, p, kDepth);
    }
    const auto here = hn::And(hn::Gt(k.v, hn::Zero(d)), hn::Gt(depth.v, hn::Zero(d)));
    depth = select(here, depth, zero);
    Num<D> w = (inverse_mass + dot(la, times<D>(g, kInertiaA, la))) + dot(lb, times<D>(g, kInertiaB, lb));
    if (HWY_UNLIKELY(less != nullptr))
      w = maximum(w - (calc_less_power<D>(less, n, la) + calc_less_power<D>(less + kHeldBody * W, n, lb)),
                  num<D>(kLeastMobility) * inverse_mass);
    const Num<D> z = select(here, Num<D>{hn::Sqrt((k / w).v)}, zero);
    impedance = impedance + z;
    Num<D> full = k * depth;
    energy = fma(full, depth, energy);
    const Num<D> plain_force = mean * full;
    held = held + plain_force;
    held_torque = fma(zero - plain_force, la, held_torque);
    // of a step in which the surfaces meet or part, only a share is in touch; they may have met before they were seen
    const Num<D> share = depth / select(hn::Gt(way.v, hn::Zero(d)), way, one);
    const auto meets = hn::And(hn::And(here, hn::Gt(speed.v, hn::Zero(d))), hn::Le(share.v, unseen.v));
    const auto parts = hn::And(hn::Lt(speed.v, hn::Zero(d)), hn::Gt(way.v, depth.v));
    some_meet = hn::Or(some_meet, meets);
    store<D>(select(meets, share, zero), p, kMet);
    // what has been met since has its energy from (4)
    stores = stores + select(meets, zero, half * plain_force * fnma(h, speed, depth));
    holds = holds + select(meets, zero, half * plain_force * depth);
    full = select(hn::Or(meets, parts), full * fma(half, share, half), full);
    Num<D> rate = twice_zeta * z;
    if (HWY_UNLIKELY(!hn::AllFalse(d, plain))) {
      // a plain dashpot begins with a jump: for half a step, and the share of the one before
      const Num<D> steady = select(meets, (half + share) * damping, damping);
      rate = select(hn::And(plain, here), steady, rate);
    }
    const Num<D> force = mean * full;
    total = total + force;
    torque = fma(zero - force, la, torque);
    store<D>(speed, p, kApproach), store<D>(full, p, kFull), store<D>(rate, p, kRate), store<D>(force, p, kNormalForce);
  }
  if (!job.follows) {
    // the points that are found store no more than those before have earned and dashpots give; what is more is lost
    const Num<D> earned = load<D>(g, kEarned);
    const auto is_known = hn::And(hn::Ge(earned.v, hn::Zero(d)), hn::Gt(stores.v, hn::Zero(d)));
    const Num<D> given = minimum(maximum(load<D>(g, kSpent), zero), maximum(stores - earned, zero));
    // where all but nothing was stored before this step, the turn of the normal within it is no small share of that
    const Num<D> least = num<D>(kBegun) * holds;
    const auto begins = hn::And(is_known, hn::Lt(stores.v, least.v));
    const Num<D> ratio = select(begins, one - (stores - earned - given) / select(begins, least, one),
                                (earned + given) / select(is_known, stores, one));
    const Num<D> kept = select(is_known, minimum(maximum(ratio, num<D>(kLeastShare)), one), one);
    store<D>(select(is_known, maximum(earned - stores, zero) - given, maximum(earned, zero)), g, kLost);
    store<D>(zero, g, kSpent);
    if (!hn::AllTrue(d, hn::Ge(kept.v, one.v))) {
      const Num<D> root = {hn::Sqrt(kept.v)};
      for (size_t row = job.rows[block]; row < job.rows[block + 1]; ++row) {
        double* p = job.points + row * kPointFields * W;
        for (const int field : {kPointStiffness, kFull, kNormalForce}) store<D>(kept * load<D>(p, field), p, field);
        const Num<D> rate = load<D>(p, kRate);
        store<D>(select(plain, rate, root * rate), p, kRate);
      }
      impedance = root * impedance;
      energy = kept * energy, total = kept * total, held = kept * held;
      torque = kept * torque, held_torque = kept * held_torque;
    }
  }
  store<D>(impedance, g, kImpedance);
  store<D>(select(some_meet, one, zero), g, kMeets);
  write_wrench<D>(job, block, apart, (zero - total) * n, torque);
  store<D>(half * mean * energy, g, kPressEnergy);
  store<D>(held, g, kHeldForce), store3<D>(held_torque, g, kHeldTorque);
}

template <class D>
HWY_INLINE void damp_block(const ContactJob& job, size_t block) {
  const D d;
  const size_t W = hn::Lanes(d);
  double* g = job.groups + block * kGroupFields * W;
  const V3<D> n = load3<D>(g, kNormal), apart = load3<D>(g, kApart);
  const Motion<D> change = calc_change<D>(job, block, apart);
  const Num<D> zero = num<D>(0), h = num<D>(job.h), along = dot(n, change.v);
  const size_t first = job.rows[block], last = job.rows[block + 1];
  const auto point = [&](size_t row) { return job.points + row * kPointFields * W; };

  Num<D> power = zero, sum = zero;
  V3<D> torque = zeros<D>();
  for (size_t row = first; row < last; ++row) {
    const double* p = point(row);
    const V3<D> la = cross(load3<D>(p, kPlace), n);
    const Num<D> v = load<D>(p, kApproach) + (along + dot(la, change.w)), f = load<D>(p, kRate) * v;
    power = fma(f, v, power);
    sum = sum + f;
    torque = fma(zero - f, la, torque);
  }
  const Num<D> together = load<D>(g, kTogether);
  const Num<D> mobility = select(hn::Ge(together.v, hn::Zero(d)), together * power,
                                 calc_mobility<D>(g, held_of(job, block, W), apart, (zero - sum) * n, torque));
  const Damper<D> damper(h, mobility, power);
  const Num<D> band = zero - load<D>(g, kBand), most = load<D>(g, kMost);
  Num<D> several[kMostDamped];
  // of a body that shares its mass with no other group, on what is fixed, and no plain dashpots
  const auto is_alone_on = [&](int groups, int mass) {
    return hn::And(hn::Eq(load<D>(g, groups).v, hn::Set(d, 1)), hn::Eq(load<D>(g, mass).v, hn::Zero(d)));
  };
  const auto is_alone = hn::Or(is_alone_on(kGroupsA, kMassB), is_alone_on(kGroupsB, kMassA));
  const auto along_several =
      hn::AndNot(hn::Or(hn::Ge(together.v, hn::Zero(d)), hn::Ge(load<D>(g, kDamping).v, hn::Zero(d))), is_alone);
  const size_t found = last - first > 1 && !hn::AllFalse(d, along_several) ? std::min(last - first, kMostDamped) : 0;
  if (found > 0) damp_group<D>(job, block, change, damper, along_several, several);
  Num<D> total = zero;
  sum = zero, torque = zeros<D>();
  for (size_t row = first; row < last; ++row) {
    double* p = point(row);
    const V3<D> la = cross(load3<D>(p, kPlace), n);
    const Num<D> v = fma(damper.at, along + dot(la, change.w), load<D>(p, kApproach)), full = load<D>(p, kFull);
    const Num<D> free = damper.share * load<D>(p, kRate) * v;
    // the upper end may be infinite, where nothing is pressed too
    const Num<D> top = select(hn::Gt(full.v, hn::Zero(d)), most * full, zero);
    Num<D> f = {hn::Min(hn::Max(free.v, (band * full).v), top.v)};
    if (row - first < found) f = several[row - first];
    const Num<D> force = load<D>(p, kNormalForce) + f;
    store<D>(force, p, kNormalForce);
    total = total + force;
    sum = sum + f;
    torque = fma(zero - f, la, torque);
  }
  store<D>(total, g, kTotal);
  const V3<D> damping = (zero - sum) * n, damping_torque = torque;
  store3<D>(damping, g, kDamp), store3<D>(torque, g, kDamp + 3);

  // friction springs share the load as the normal forces do
  const V3<D> v = load3<D>(g, kMotion), w = load3<D>(g, kMotion + 3);
  const auto loaded = hn::Gt(total.v, hn::Zero(d));
  const Num<D> stiffness = load<D>(g, kStick), one = num<D>(1);
  const Num<D> longest = load<D>(g, kFriction) * total / select(hn::Gt(stiffness.v, hn::Zero(d)), stiffness, one);
  const Num<D> rate = select(loaded, stiffness / select(loaded, total, one), zero);
  V3<D> rub = zeros<D>(), rub_torque = rub;
  Num<D> energy = zero;
  for (size_t row = first; row < last; ++row) {
    double* p = point(row);
    const V3<D> r = load3<D>(p, kPlace), slide = across(n, v + cross(w, r));
    store3<D>(slide, p, kSlide);
    V3<D> slip = across(n, fma(h * (one - load<D>(p, kFresh)), slide, load3<D>(p, kSpringSlip)));
    const Num<D> size2 = limit(slip, longest);  // it follows where friction can hold no more
    store3<D>(slip, p, kSpringSlip);
    store<D>(zero, p, kFresh);
    const Num<D> normal = load<D>(p, kNormalForce);
    const V3<D> held = (zero - rate * normal) * slip;
    energy = fma(normal, size2, energy);
    rub = rub + held;
    rub_torque = rub_torque + cross(r, held);
  }
  store3<D>(rub, g, kRub), store3<D>(rub_torque, g, kRub + 3);
  store<D>(num<D>(0.5) * rate * energy, g, kStickEnergy);
  write_wrench<D>(job, block, apart, damping + rub, damping_torque + rub_torque);
}

/// What points that have just been met lack to the force of (4), once it is known what the step leaves of their speed.
/// The lack itself slows them further: a few turns.
template <class D>
HWY_NOINLINE Wrench<D> calc_lack(const ContactJob& job, size_t block, const Motion<D>& change) {
  const size_t W = hn::Lanes(D());
  const double* g = job.groups + block * kGroupFields * W;
  const V3<D> n = load3<D>(g, kNormal), apart = load3<D>(g, kApart);
  const Num<D> zero = num<D>(0), h = num<D>(job.h), mean = load<D>(g, kMean);
  const double* held = held_of(job, block, W);
  Wrench<D> lack{zeros<D>(), zeros<D>()};
  // as if the other groups of both bodies did alike
  const Num<D> h_a = h * load<D>(g, kGroupsA), h_b = h * load<D>(g, kGroupsB);
  for (int turn = 0; turn < kLackTurns; ++turn) {
    const V3<D> torque_b = lack.torque + cross(apart, lack.force);
    V3<D> turn_a = times<D>(g, kInertiaA, h_a * lack.torque), turn_b = times<D>(g, kInertiaB, h_b * torque_b);
    V3<D> by = fma(h_a, load<D>(g, kMassA), h_b * load<D>(g, kMassB)) * lack.force;
    if (held != nullptr) {
      const Motion<D> a = calc_less<D>(held, h_a * lack.force, h_a * lack.torque),
                      b = calc_less<D>(held + kHeldBody * W, h_b * lack.force, h_b * torque_b);
      by = by - (a.v + b.v), turn_a = turn_a - a.w, turn_b = turn_b - b.w;
    }
    const V3<D> dv = change.v + by + cross(turn_b, apart), dw = change.w + (turn_a + turn_b);
    const Num<D> along = dot(n, dv);
    lack = {zeros<D>(), zeros<D>()};
    for (size_t row = job.rows[block]; row < job.rows[block + 1]; ++row) {
      const double* p = job.points + row * kPointFields * W;
      const V3<D> la = cross(load3<D>(p, kPlace), n);
      const Num<D> lacking = calc_lacking_share<D>(load<D>(p, kMet), load<D>(p, kApproach), along + dot(la, dw));
      const Num<D> f = mean * load<D>(p, kFull) * lacking;
      lack.force = lack.force - f * n;
      lack.torque = fma(zero - f, la, lack.torque);
    }
  }
  return lack;
}

template <class D>
HWY_INLINE void rub_block(const ContactJob& job, size_t block) {
  const D d;
  const size_t W = hn::Lanes(d);
  double* g = job.groups + block * kGroupFields * W;
  const V3<D> n = load3<D>(g, kNormal), apart = load3<D>(g, kApart);
  const Motion<D> change = calc_change<D>(job, block, apart);
  const Num<D> zero = num<D>(0), one = num<D>(1), h = num<D>(job.h), total = load<D>(g, kTotal);
  const size_t first = job.rows[block], last = job.rows[block + 1];
  const auto point = [&](size_t row) { return job.points + row * kPointFields * W; };
  // shared out as the normal forces are, so that all points pass their limits together
  const auto loaded = hn::Gt(total.v, hn::Zero(d));
  const Num<D> per_total = select(loaded, one / select(loaded, total, one), zero);
  const Num<D> rate = num<D>(2 * kSlideZeta) * load<D>(g, kImpedance) * per_total;
  const Num<D> stick = load<D>(g, kStick) * per_total;

  Num<D> power = zero;
  V3<D> force = zeros<D>(), torque = force;
  for (size_t row = first; row < last; ++row) {
    const double* p = point(row);
    const V3<D> r = load3<D>(p, kPlace);
    const V3<D> v = load3<D>(p, kSlide) + across(n, change.v + cross(change.w, r));
    const V3<D> f = (zero - rate * load<D>(p, kNormalForce)) * v;
    power = power - dot(f, v);
    force = force + f;
    torque = torque + cross(r, f);
  }
  const Damper<D> damper(h, calc_mobility<D>(g, held_of(job, block, W), apart, force, torque), power);
  const Num<D> friction = load<D>(g, kFriction), slowed = damper.share * rate;
  force = zeros<D>(), torque = force;
  for (size_t row = first; row < last; ++row) {
    const double* p = point(row);
    const V3<D> r = load3<D>(p, kPlace);
    const V3<D> v = fma(damper.at, across(n, change.v + cross(change.w, r)), load3<D>(p, kSlide));
    const Num<D> normal = load<D>(p, kNormalForce);
    const V3<D> held = (zero - stick * normal) * load3<D>(p, kSpringSlip);
    V3<D> f = fma(zero - slowed * normal, v, held);
    limit(f, friction * normal);
    force = force + f;
    torque = torque + cross(r, f);
  }
  Wrench<D> more{force - load3<D>(g, kRub), torque - load3<D>(g, kRub + 3)};
  if (HWY_UNLIKELY(!hn::AllFalse(d, hn::Gt(load<D>(g, kMeets).v, hn::Zero(d)))))
    more = more + calc_lack<D>(job, block, change);
  write_wrench<D>(job, block, apart, more.force, more.torque);
  store3<D>(force, g, kRub), store3<D>(torque, g, kRub + 3);
}

template <class D>
HWY_INLINE void book_block(const ContactJob& job, size_t block) {
  const size_t W = hn::Lanes(D());
  double* g = job.groups + block * kGroupFields * W;
  const Motion<D> change = calc_change<D>(job, block, load3<D>(g, kApart));
  const V3<D> v = load3<D>(g, kMotion), w = load3<D>(g, kMotion + 3), v1 = v + change.v, w1 = w + change.w;
  const V3<D> damp = load3<D>(g, kDamp), damp_turn = load3<D>(g, kDamp + 3), rub = load3<D>(g, kRub),
              rub_turn = load3<D>(g, kRub + 3);
  const Num<D> zero = num<D>(0);
  store<D>(zero - (dot(damp, v) + dot(damp_turn, w)), g, kGroupLoss);
  store<D>(zero - (dot(damp, v1) + dot(damp_turn, w1)), g, kGroupLoss + 1);
  store<D>(dot(rub, v) + dot(rub_turn, w), g, kGroupRubPower);
  store<D>(dot(rub, v1) + dot(rub_turn, w1), g, kGroupRubPower + 1);
}

/// The same in all lanes, whatever their number: no two groups at once.
HWY_INLINE void sum_all_wrenches(const ContactJob& job) {
  const hn::CappedTag<double, kWrenchRow> d;
  for (size_t slot = 0; slot < job.count; ++slot) {
    const double* wrench = job.wrenches + slot * 2 * kWrenchRow;
    double *a = job.sums + size_t{job.a[slot]} * kWrenchRow, *b = job.sums + size_t{job.b[slot]} * kWrenchRow;
    for (size_t i = 0; i < kWrenchRow; i += hn::Lanes(d))
      hn::StoreU(hn::Add(hn::LoadU(d, a + i), hn::LoadU(d, wrench + i)), d, a + i);
    for (size_t i = 0; i < kWrenchRow; i += hn::Lanes(d))
      hn::StoreU(hn::Sub(hn::LoadU(d, b + i), hn::LoadU(d, wrench + kWrenchRow + i)), d, b + i);
  }
}

using Wide = hn::ScalableTag<double>;
using One = hn::CappedTag<double, 1>;

/// Wide lanes, block after block.
template <class Job, class Work>
HWY_INLINE void each_block(const Job& job, Work work) {
  for (size_t block = 0; block < job.blocks; ++block) work(job, block);
}
void find_lows_here(const LowJob& job) { find_all_lows<Wide>(job); }
void find_lows_singly_here(const LowJob& job) { find_all_lows<One>(job); }
void find_ways_here(const WayJob& job) { find_all_ways<Wide>(job); }
void find_ways_singly_here(const WayJob& job) { find_all_ways<One>(job); }
void read_touched_here(const TouchJob& job) { each_block(job, read_block<Wide>); }
void update_touched_here(const TouchJob& job) { each_block(job, update_block<Wide>); }
void press_contacts_here(const ContactJob& job) { each_block(job, press_block<Wide>); }
void damp_contacts_here(const ContactJob& job) { each_block(job, damp_block<Wide>); }
void rub_contacts_here(const ContactJob& job) { each_block(job, rub_block<Wide>); }
void sum_wrenches_here(const ContactJob& job) { sum_all_wrenches(job); }
void book_contacts_here(const ContactJob& job) { each_block(job, book_block<Wide>); }

}  // namespace HWY_NAMESPACE
}  // namespace topple::mbs::kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace topple::mbs::kernel {

HWY_EXPORT(find_lows_here);
HWY_EXPORT(find_lows_singly_here);
HWY_EXPORT(find_ways_here);
HWY_EXPORT(find_ways_singly_here);
HWY_EXPORT(read_touched_here);
HWY_EXPORT(update_touched_here);
HWY_EXPORT(press_contacts_here);
HWY_EXPORT(damp_contacts_here);
HWY_EXPORT(rub_contacts_here);
HWY_EXPORT(sum_wrenches_here);
HWY_EXPORT(book_contacts_here);

void find_lows(const LowJob& job) { HWY_DYNAMIC_DISPATCH(find_lows_here)(job); }
void find_lows_singly(const LowJob& job) { HWY_DYNAMIC_DISPATCH(find_lows_singly_here)(job); }
void find_ways(const WayJob& job) { HWY_DYNAMIC_DISPATCH(find_ways_here)(job); }
void find_ways_singly(const WayJob& job) { HWY_DYNAMIC_DISPATCH(find_ways_singly_here)(job); }
void read_touched(const TouchJob& job) { HWY_DYNAMIC_DISPATCH(read_touched_here)(job); }
void update_touched(const TouchJob& job) { HWY_DYNAMIC_DISPATCH(update_touched_here)(job); }
void press_contacts(const ContactJob& job) { HWY_DYNAMIC_DISPATCH(press_contacts_here)(job); }
void damp_contacts(const ContactJob& job) { HWY_DYNAMIC_DISPATCH(damp_contacts_here)(job); }
void rub_contacts(const ContactJob& job) { HWY_DYNAMIC_DISPATCH(rub_contacts_here)(job); }
void sum_wrenches(const ContactJob& job) { HWY_DYNAMIC_DISPATCH(sum_wrenches_here)(job); }
void book_contacts(const ContactJob& job) { HWY_DYNAMIC_DISPATCH(book_contacts_here)(job); }

}  // namespace topple::mbs::kernel
#endif
