// Compiled once for each instruction set (Highway's foreach_target).
#include "mbs/ground_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mbs/ground_kernel.cpp"
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

#include <limits>

#include "mbs/contact_math.inc"
#include "mbs/lane_math.inc"

HWY_BEFORE_NAMESPACE();
namespace topple::mbs::kernel {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

constexpr int kCorners = 8;

/// A symmetric matrix: xx xy xz yy yz zz.
template <class D>
struct Symmetric {
  Num<D> xx, xy, xz, yy, yz, zz;
  HWY_INLINE V3<D> operator*(const V3<D>& v) const {
    return {fma(xz, v.z, fma(xy, v.y, xx * v.x)), fma(yz, v.z, fma(yy, v.y, xy * v.x)),
            fma(zz, v.z, fma(yz, v.y, xz * v.x))};
  }
};

/// R I Rᵀ
template <class D>
HWY_INLINE Symmetric<D> turn_tensor(const M33<D>& R, const Symmetric<D>& I) {
  const V3<D> x = I * R.r0, y = I * R.r1, z = I * R.r2;
  return {dot(R.r0, x), dot(R.r1, x), dot(R.r2, x), dot(R.r1, y), dot(R.r2, y), dot(R.r2, z)};
}

/// The power of a wrench on a motion.
template <class D>
HWY_INLINE Num<D> power_of(const Wrench<D>& on, const V3<D>& v, const V3<D>& w) {
  return dot(on.force, v) + dot(on.torque, w);
}

/// A corner that touches in some lane.
template <class D>
struct Corner {
  V3<D> place;  // from the centre of mass
  V3<D> slip, slide;
  Num<D> depth, approach, full, rate, normal;
  Num<D> met;  // the share of (4) where it has just been met, else 0
  hn::Mask<D> touches, is_new, is_fresh;
};

/// Displacements of the friction springs that corners take over from the step before: their own, or that of the nearest
/// corner which touched then.
template <class D, class Place>
HWY_INLINE void take_over_slips(const double* HWY_RESTRICT state, const Place& place_of, const int* number, int count,
                                Corner<D>* corner) {
  const D d;
  const auto none = hn::Set(d, std::numeric_limits<double>::infinity());
  for (int i = 0; i < count; ++i) {
    Corner<D>& c = corner[i];
    const V3<D> own = load3<D>(state, kCornerSlip + 3 * number[i]);
    const auto is_new = hn::Eq(own.x.v, none);
    c.is_new = c.is_fresh = is_new;
    c.slip = {select(is_new, num<D>(0), own.x), select(is_new, num<D>(0), own.y), select(is_new, num<D>(0), own.z)};
    if (HWY_LIKELY(hn::AllFalse(d, hn::And(is_new, c.touches)))) continue;
    Num<D> least = {none};
    for (int j = 0; j < kCorners; ++j) {
      const V3<D> other = load3<D>(state, kCornerSlip + 3 * j), apart = place_of(j) - c.place;
      const Num<D> distance2 = dot(apart, apart);
      const auto nearer = hn::And(is_new, hn::And(hn::Lt(other.x.v, none), hn::Lt(distance2.v, least.v)));
      least = select(nearer, distance2, least);
      c.slip = {select(nearer, other.x, c.slip.x), select(nearer, other.y, c.slip.y),
                select(nearer, other.z, c.slip.z)};
      c.is_fresh = hn::AndNot(nearer, c.is_fresh);
    }
  }
}

template <class D>
HWY_INLINE void press_ground_block(const GroundJob& job, size_t block) {
  using N = Num<D>;
  using M = hn::Mask<D>;
  const D d;
  const size_t W = hn::Lanes(d);
  const N watch = load<D>(job.watch + W * block, 0), zero = num<D>(0), half = num<D>(0.5), one = num<D>(1);
  const M always = hn::Gt(watch.v, hn::Set(d, kLookWhenLow));
  const V3<D> up{load<D>(job.nx, 0), load<D>(job.ny, 0), load<D>(job.nz, 0)}, n{zero - up.x, zero - up.y, zero - up.z};
  // how far the plane lies above the centre of mass
  const N above = load<D>(job.offset, 0) - dot(up, load3<D>(job.p + 3 * W * block, 0));
  const auto is_low = [&](N plane, N reach) {
    return hn::Or(always, hn::And(hn::Gt(watch.v, zero.v), hn::Ge((plane + reach).v, zero.v)));
  };
  if (HWY_LIKELY(hn::AllFalse(d, is_low(above, load<D>(job.reach + W * block, 0))))) return;
  double* HWY_RESTRICT state = job.states + static_cast<size_t>(kGroundFields) * W * block;
  const double* HWY_RESTRICT constants = job.constants + static_cast<size_t>(kGroundConstants) * W * block;
  const double* HWY_RESTRICT rotation = job.R + 9 * W * block;
  const M33<D> R{load3<D>(rotation, 0), load3<D>(rotation, 3), load3<D>(rotation, 6)};
  const N h = load<D>(job.h, 0);

  // corners in the ground
  const V3<D> centre = R * load3<D>(constants, kBoxCentre);
  const V3<D> x = R * load3<D>(constants, kBoxEdges), y = R * load3<D>(constants, kBoxEdges + 3),
              z = R * load3<D>(constants, kBoxEdges + 6);
  const N below = above - dot(up, centre), along_x = dot(up, x), along_y = dot(up, y), along_z = dot(up, z);
  const M active = is_low(below, (abs(along_x) + abs(along_y)) + abs(along_z));
  if (hn::AllFalse(d, active)) return;
  const M possible = hn::Gt(load<D>(constants, kPossible).v, zero.v);
  const auto end = [](int corner, int axis, const N& from, const N& by) {
    return corner & axis ? from + by : from - by;
  };
  const auto place_of = [&](int i) -> V3<D> {
    return {end(i, 4, end(i, 2, end(i, 1, centre.x, x.x), y.x), z.x),
            end(i, 4, end(i, 2, end(i, 1, centre.y, x.y), y.y), z.y),
            end(i, 4, end(i, 2, end(i, 1, centre.z, x.z), y.z), z.z)};
  };
  // `below` is how far the plane lies above the box's centre
  N edge[4];
  for (int i = 0; i < 4; ++i) edge[i] = end(~i, 2, end(~i, 1, below, along_x), along_y);
  Corner<D> corner[kCorners];
  int number[kCorners], count = 0;
  M busy = hn::FirstN(d, 0), touching = busy;
  const M may_touch = hn::And(active, possible);
  const auto none = hn::Set(d, std::numeric_limits<double>::infinity());
  for (int i = 0; i < kCorners; ++i) {
    const N penetration = end(~i, 4, edge[i & 3], along_z), before = load<D>(state, kBorn + i);
    const N born = maximum(zero, minimum(select(hn::Ge(before.v, zero.v), before, penetration), penetration));
    const N depth = penetration - born;
    const M touches = hn::And(may_touch, hn::Gt(depth.v, zero.v));
    store_where<D>(active, select(possible, born, num<D>(-1)), state, kBorn + i);
    busy = hn::Or(busy, hn::Gt(born.v, zero.v));
    if (hn::AllFalse(d, touches)) continue;
    touching = hn::Or(touching, touches);
    corner[count].place = place_of(i);
    corner[count].touches = touches;
    corner[count].depth = select(touches, depth, zero);
    number[count++] = i;
  }
  const N look = select(touching, num<D>(kTouches),
                        select(possible, select(busy, num<D>(kAlwaysLook), num<D>(kLookWhenLow)), num<D>(kNeverLook)));
  store_where<D>(active, look, job.watch + W * block, 0);
  const M lands = hn::AndNot(hn::Ge(watch.v, hn::Set(d, kTouches)), touching);
  if (HWY_UNLIKELY(!hn::AllFalse(d, lands))) report<D>(lands, block, *job.landed);
  const auto book = [&](N now, N after, int work, int power) {
    store_where<D>(active, fma(half * h, load<D>(state, power) + now, load<D>(state, work)), state, work);
    store_where<D>(active, after, state, power);
  };
  if (count == 0) {
    book(zero, zero, kLoss, kLossPower);
    book(zero, zero, kRubWork, kRubPower);
    for (int field = kPressed; field < kGroundFields; ++field) store_where<D>(active, zero, state, field);
    for (int i = 0; i < kCorners; ++i) store_where<D>(active, N{none}, state, kCornerSlip + 3 * i);
    return;
  }
  take_over_slips<D>(state, place_of, number, count, corner);

  // springs
  const double* HWY_RESTRICT body = job.body_constants + static_cast<size_t>(kBodyFields) * W * block;
  const V3<D> v = load3<D>(job.v + 3 * W * block, 0), w = load3<D>(job.w + 3 * W * block, 0);
  const N mass = load<D>(body, kInverseMass);
  const Symmetric<D> inertia = turn_tensor<D>(
      R, {load<D>(body, kInverseInertia), load<D>(body, kInverseInertia + 1), load<D>(body, kInverseInertia + 2),
          load<D>(body, kInverseInertia + 3), load<D>(body, kInverseInertia + 4), load<D>(body, kInverseInertia + 5)});
  const N mean = load<D>(constants, kGroundMean), damping = load<D>(constants, kGroundDamping),
          twice_zeta = num<D>(2) * load<D>(constants, kGroundZeta), stiffness = load<D>(constants, kCornerStiffness);
  const M plain = hn::Ge(damping.v, zero.v);
  N along = dot(n, v), energy = zero, impedance = zero, total = zero;
  const V3<D> nothing{zero, zero, zero};
  Wrench<D> press{nothing, nothing}, damp = press, rub = press;
  M some_meet = hn::FirstN(d, 0);
  for (int i = 0; i < count; ++i) {
    Corner<D>& c = corner[i];
    const V3<D> lever = cross(c.place, n);
    const N k = select(c.touches, stiffness, zero), speed = along + dot(lever, w), way = h * abs(speed);
    const N root = {hn::Sqrt((k / (mass + dot(lever, inertia * lever))).v)};
    impedance = impedance + root;
    N full = k * c.depth;
    energy = fma(full, c.depth, energy);
    // of a step in which the surfaces meet or part, only a share is in touch
    const N share = c.depth / select(hn::Gt(way.v, zero.v), way, one);
    const M meets =
        hn::And(hn::And(c.touches, c.is_new), hn::And(hn::Gt(speed.v, zero.v), hn::Le(share.v, hn::Set(d, kSlowed))));
    const M parts = hn::And(c.touches, hn::And(hn::Lt(speed.v, zero.v), hn::Gt(way.v, c.depth.v)));
    some_meet = hn::Or(some_meet, meets);
    c.met = select(meets, share, zero);
    full = select(hn::Or(meets, parts), full * fma(half, share, half), full);
    N rate = twice_zeta * root;
    if (HWY_UNLIKELY(!hn::AllFalse(d, plain))) {
      // a plain dashpot begins with a jump: for half a step, and the share of the one before
      const N steady = select(meets, (half + share) * damping, damping);
      rate = select(hn::And(plain, c.touches), steady, rate);
    }
    const N force = mean * full;
    total = total + force;
    press.torque = fma(zero - force, lever, press.torque);
    c.approach = speed, c.full = full, c.rate = rate, c.normal = force;
  }
  press.force = (zero - total) * n;

  // what all forces known so far add to the speeds within the step
  const V3<D> gravity{load<D>(job.gx, 0), load<D>(job.gy, 0), load<D>(job.gz, 0)};
  double *on_force = job.force + 3 * W * block, *on_torque = job.torque + 3 * W * block;
  const Wrench<D> applied{load3<D>(on_force, 0), load3<D>(on_torque, 0)};
  const Wrench<D> others =
      applied + Wrench<D>{load3<D>(job.joint_force + 3 * W * block, 0), load3<D>(job.joint_torque + 3 * W * block, 0)};
  V3<D> dv, dw;
  const auto update = [&] {
    const Wrench<D> all = others + ((press + damp) + rub);
    dv = fma(h, gravity, (h * mass) * all.force);
    dw = inertia * (h * all.torque);
  };
  // the force times the speed that it makes
  const auto mobility_of = [&](const Wrench<D>& on) {
    return fma(mass, dot(on.force, on.force), dot(on.torque, inertia * on.torque));
  };

  // dashpots
  update();
  along = dot(n, dv);
  {
    N power = zero, sum = zero;
    V3<D> torque = nothing;
    for (int i = 0; i < count; ++i) {
      const Corner<D>& c = corner[i];
      const V3<D> lever = cross(c.place, n);
      const N speed = c.approach + (along + dot(lever, dw)), f = c.rate * speed;
      power = fma(f, speed, power);
      sum = sum + f;
      torque = fma(zero - f, lever, torque);
    }
    const Damper<D> damper(h, mobility_of({(zero - sum) * n, torque}), power);
    const N band = zero - load<D>(constants, kGroundBand), most = load<D>(constants, kGroundMost);
    N forces[kCorners], speed[kCorners], low[kCorners], top[kCorners];
    V3<D> levers[kCorners];
    for (int i = 0; i < count; ++i) {
      const Corner<D>& c = corner[i];
      levers[i] = cross(c.place, n);
      speed[i] = fma(damper.at, along + dot(levers[i], dw), c.approach);
      forces[i] = damper.share * c.rate * speed[i];
      low[i] = band * c.full;
      // the upper end may be infinite, where nothing is pressed too
      top[i] = select(hn::Gt(c.full.v, zero.v), most * c.full, zero);
    }
    if (count > 1)
      damp_all_motions<D>(
          static_cast<size_t>(count), n, [&](size_t i) { return levers[i]; }, [&](size_t i) { return corner[i].rate; },
          [&](N against, const V3<D>& turning) {
            return Slowed<D>{mass * against, num<D>(-1) * (inertia * turning)};
          },
          h * damper.at, speed, low, top, hn::Not(plain), forces);
    else
      forces[0] = minimum(maximum(forces[0], low[0]), top[0]);
    total = sum = zero;
    for (int i = 0; i < count; ++i) {
      Corner<D>& c = corner[i];
      const N f = forces[i];
      c.normal = c.normal + f;
      total = total + c.normal;
      sum = sum + f;
      damp.torque = fma(zero - f, levers[i], damp.torque);
    }
    damp.force = (zero - sum) * n;
  }

  // friction springs share the load as the normal forces do
  const M loaded = hn::Gt(total.v, zero.v);
  const N friction = load<D>(constants, kGroundFriction), stick = (num<D>(kStickStiffness) * mean) * stiffness;
  const N longest = friction * total / select(hn::Gt(stick.v, zero.v), stick, one);
  const N per_total = select(loaded, one / select(loaded, total, one), zero), held_rate = stick * per_total;
  N stuck = zero;
  for (int i = 0; i < count; ++i) {
    Corner<D>& c = corner[i];
    c.slide = across(n, v + cross(w, c.place));
    c.slip = across(n, fma(select(c.is_fresh, zero, h), c.slide, c.slip));
    const N size2 = limit(c.slip, longest);  // it follows where friction can hold no more
    const V3<D> held = (zero - held_rate * c.normal) * c.slip;
    stuck = fma(c.normal, size2, stuck);
    rub.force = rub.force + held;
    rub.torque = rub.torque + cross(c.place, held);
  }

  // friction, shared out as the normal forces are, so that all corners pass their limits together
  update();
  {
    const N rate = num<D>(2 * kSlideZeta) * impedance * per_total;
    N power = zero;
    Wrench<D> free{nothing, nothing};
    for (int i = 0; i < count; ++i) {
      const Corner<D>& c = corner[i];
      const V3<D> speed = c.slide + across(n, dv + cross(dw, c.place)), f = (zero - rate * c.normal) * speed;
      power = power - dot(f, speed);
      free = {free.force + f, free.torque + cross(c.place, f)};
    }
    const Damper<D> damper(h, mobility_of(free), power);
    const N slowed = damper.share * rate;
    rub = {nothing, nothing};
    for (int i = 0; i < count; ++i) {
      const Corner<D>& c = corner[i];
      const V3<D> speed = fma(damper.at, across(n, dv + cross(dw, c.place)), c.slide);
      V3<D> f = fma(zero - slowed * c.normal, speed, (zero - held_rate * c.normal) * c.slip);
      limit(f, friction * c.normal);
      rub = {rub.force + f, rub.torque + cross(c.place, f)};
    }
  }

  // what corners that have just been met lack to the force of (4), once it is known what the step leaves of their speed
  if (HWY_UNLIKELY(!hn::AllFalse(d, some_meet))) {
    Wrench<D> lack{nothing, nothing};
    for (int turn = 0; turn < kLackTurns; ++turn) {
      along = dot(n, fma(h * mass, lack.force, dv));
      const V3<D> turned = dw + inertia * (h * lack.torque);
      lack = {nothing, nothing};
      for (int i = 0; i < count; ++i) {
        const Corner<D>& c = corner[i];
        const V3<D> lever = cross(c.place, n);
        const N f = mean * c.full * calc_lacking_share<D>(c.met, c.approach, along + dot(lever, turned));
        lack.force = lack.force - f * n;
        lack.torque = fma(zero - f, lever, lack.torque);
      }
    }
    press = press + lack;
  }

  // forces do their work over the half steps before and after
  update();
  const auto where_touching = [&](N value) { return select(touching, value, zero); };
  const V3<D> v1 = v + dv, w1 = w + dw;
  book(zero - power_of(damp, v, w), where_touching(zero - power_of(damp, v1, w1)), kLoss, kLossPower);
  book(power_of(rub, v, w), where_touching(power_of(rub, v1, w1)), kRubWork, kRubPower);
  store_where<D>(active, where_touching(half * mean * energy), state, kPressed);
  store_where<D>(active, where_touching(half * held_rate * stuck), state, kStuck);
  const Wrench<D> push = (press + damp) + rub, sum = applied + push;
  const auto put3 = [&](M where, const V3<D>& value, double* to, int field) {
    store_where<D>(where, value.x, to, field), store_where<D>(where, value.y, to, field + 1),
        store_where<D>(where, value.z, to, field + 2);
  };
  put3(active, {where_touching(push.force.x), where_touching(push.force.y), where_touching(push.force.z)}, state,
       kPush);
  put3(touching, sum.force, on_force, 0);
  put3(touching, sum.torque, on_torque, 0);
  for (int i = 0, next = 0; i < kCorners; ++i) {
    const bool is_listed = next < count && number[next] == i;
    const M here = is_listed ? corner[next].touches : hn::FirstN(d, 0);
    store_where<D>(hn::AndNot(here, active), N{none}, state, kCornerSlip + 3 * i);
    if (is_listed) put3(here, corner[next++].slip, state, kCornerSlip + 3 * i);
  }
}

template <class D>
HWY_INLINE void press_all(const GroundJob& job) {
  for (size_t block = 0; block < job.blocks; ++block) press_ground_block<D>(job, block);
}

void press_ground_here(const GroundJob& job) { press_all<hn::ScalableTag<double>>(job); }
void press_ground_singly_here(const GroundJob& job) { press_all<hn::CappedTag<double, 1>>(job); }

}  // namespace HWY_NAMESPACE
}  // namespace topple::mbs::kernel
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace topple::mbs::kernel {

HWY_EXPORT(press_ground_here);
HWY_EXPORT(press_ground_singly_here);

void press_ground(const GroundJob& job) { HWY_DYNAMIC_DISPATCH(press_ground_here)(job); }
void press_ground_singly(const GroundJob& job) { HWY_DYNAMIC_DISPATCH(press_ground_singly_here)(job); }

}  // namespace topple::mbs::kernel
#endif
