// Compiled once for each instruction set (Highway's foreach_target).
#include "mbs/kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mbs/kernel.cpp"
// one wide target for each family of machines keeps the build short
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

#include "mbs/flow_zone.inc"
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
  // in the body's frame
  const V3<D> turned = h * (R0 * mid_spin<D>(inverse_inertia, transpose_times(R0, spin), num<D>(0.5) * h));
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

/// The same of bodies that keep to y = const and turn about y alone: what stays zero is left out.
template <class D>
HWY_INLINE void advance_planar_block(const BodyJob& job, size_t block, Num<D>& sum) {
  const D d;
  const size_t W = hn::Lanes(d);
  double *p = job.p + 3 * W * block, *v = job.v + 3 * W * block, *L = job.L + 3 * W * block, *w = job.w + 3 * W * block,
         *q = job.q + 4 * W * block, *R = job.R + 9 * W * block;
  const double *c = job.constants + static_cast<size_t>(kBodyFields) * W * block, *force = job.force + 3 * W * block;
  const Num<D> kick = load<D>(job.kick, 0), h = load<D>(job.h, 0), zero = num<D>(0);
  const Num<D> push = kick * load<D>(c, kInverseMass), pull = kick * load<D>(c, kFree);
  const Num<D> vx = fma(push, load<D>(force, 0), fma(pull, load<D>(job.gx, 0), load<D>(v, 0)));
  const Num<D> vz = fma(push, load<D>(force, 2), fma(pull, load<D>(job.gz, 0), load<D>(v, 2)));
  const Num<D> spin = fma(kick, load<D>(job.torque + 3 * W * block, 1), load<D>(L, 1));
  store<D>(vx, v, 0);
  store<D>(vz, v, 2);
  store<D>(spin, L, 1);
  const auto drifts = hn::Gt(load<D>(c, kDrifts).v, hn::Zero(d));
  const Num<D> x = fma(h, vx, load<D>(p, 0)), z = fma(h, vz, load<D>(p, 2));
  const Num<D> rate = load<D>(c, kInverseInertia + 3) * spin, turned = h * rate;
  const Num<D> half2 = num<D>(0.25) * (turned * turned);
  const auto fast = hn::And(drifts, hn::Not(hn::Le(half2.v, hn::Set(d, kMostHalf2))));
  const Q4<D> q0{load<D>(q, 0), zero, load<D>(q, 2), zero}, by = exp_rotation(V3<D>{zero, turned, zero}, half2);
  const PlanarTurn<D> end = PlanarTurn<D>(by).then(PlanarTurn<D>(q0)).normalized();
  const auto here = hn::AndNot(fast, drifts);
  store_where<D>(here, x, p, 0), store_where<D>(here, z, p, 2);
  store_where<D>(here, end.w, q, 0), store_where<D>(here, end.y, q, 2);
  const Num<D> cosine = end.cosine(), sine = end.sine();
  store_where<D>(here, cosine, R, 0), store_where<D>(here, sine, R, 2);
  store_where<D>(here, zero - sine, R, 6), store_where<D>(here, cosine, R, 8);
  store_where<D>(here, rate, w, 1);
  if (HWY_UNLIKELY(!hn::AllFalse(d, fast))) report<D>(fast, block, *job.spins);
  sum = sum + ((x + z) + (vx + vz));
}

/// What angle / sin(angle) is above 1, over s², of the half turn with the sine s.
template <class D>
HWY_INLINE Num<D> excess_of(Num<D> s2) {
  const auto large = hn::Gt(s2.v, hn::Set(D(), 1e-3));
  // Taylor, exact to round-off below s² = 1e-3
  const Num<D> small = polynomial<D>({1.0 / 6, 3.0 / 40, 5.0 / 112, 35.0 / 1152, 63.0 / 2816}, s2);
  if (HWY_LIKELY(hn::AllFalse(D(), large))) return small;
  // fitted to 2e-17
  const Num<D> fitted =
      polynomial<D>({0.16666666666664942, 0.07500000000385201, 0.044642856805998936, 0.03038195969768514,
                     0.022371749733164054, 0.01735977964134998, 0.01388484282640208, 0.012170138592391726,
                     0.0065293020047365695, 0.019513468251252167, -0.016187392271599134, 0.03187962140081284},
                    s2);
  return select(large, fitted, small);
}

/// Of the half turn with the sine s: twice its angle over its sine, and κ of multibody.md, eq. 4.
template <class D>
HWY_INLINE void turning(Num<D> s2, Num<D>& angle_over_sine, Num<D>& coefficient) {
  const D d;
  angle_over_sine = num<D>(2) * fma(s2, excess_of<D>(s2), num<D>(1));
  const Num<D> angle2 = angle_over_sine * angle_over_sine * s2;
  // Taylor, exact to round-off below s² = 1e-3
  coefficient = polynomial<D>({1.0 / 12, 1.0 / 720, 1.0 / 30240, 1.0 / 1209600, 1.0 / 47900160}, angle2);
  const auto large = hn::Gt(s2.v, hn::Set(d, 1e-3));
  if (HWY_LIKELY(hn::AllFalse(d, large))) return;
  // fitted to 2e-17
  const Num<D> y =
      polynomial<D>({0.08333333333333333, 0.001388888888888962, 3.30687830673884e-05, 8.267195868407458e-07,
                     2.0876720971038434e-08, 5.284884495807743e-10, 1.3308714828735463e-11, 3.793809199423887e-13},
                    angle2);
  coefficient = select(large, y, coefficient);
}

/// The least rotation from x of an end of a member to its chord, a quaternion with x = 0.
template <class D>
struct Swing {
  Num<D> w, y, z;
  Num<D> s2, over_sine, coefficient;  // turning() of its half

  /// chord: along it, of length one, in the axes of the end.
  HWY_INLINE void lay(const V3<D>& chord) {
    const Num<D> half = num<D>(0.5), twice = maximum(chord.x + num<D>(1), num<D>(1e-30));
    w = Num<D>{hn::Sqrt((half * twice).v)};
    const Num<D> share = half / w;
    y = num<D>(0) - share * chord.z, z = share * chord.y;
    s2 = fma(y, y, z * z);
    turning<D>(s2, over_sine, coefficient);
  }
  /// The end's axes laid along the chord.
  HWY_INLINE Q4<D> apply(const Q4<D>& q) const {
    return {fnma(q.z, z, fnma(q.y, y, q.w * w)), fnma(q.z, y, fma(q.y, z, q.x * w)), fnma(q.x, z, fma(q.y, w, q.w * y)),
            fma(q.z, w, fma(q.x, y, q.w * z))};
  }
};

/// Rotation of an end of a member in space against its chord, in the axes of the chord, and the tangent of its half.
template <class D>
struct Leaning {
  Num<D> y, z, tangent_y, tangent_z;

  /// cosine, sine: of the turn about the chord from the axes that the swing is seen in to those of the chord.
  HWY_INLINE void set(const Swing<D>& swing, Num<D> cosine, Num<D> sine) {
    const Num<D> about_y = fma(sine, swing.z, cosine * swing.y), about_z = fnma(sine, swing.y, cosine * swing.z);
    const Num<D> per_w = num<D>(1) / swing.w;
    y = swing.over_sine * about_y, z = swing.over_sine * about_z;
    tangent_y = per_w * about_y, tangent_z = per_w * about_z;
  }
};

/// Places of the bodies of one block of elements, side by side.
template <class D>
struct Poses {
  V3<D> p;
  Q4<D> q;
};

/// Poses of the bodies of a block of elements.
///   slots   of bodies, W a block; null: batch
///   bodies  of blocks, of a batch
template <class D>
HWY_INLINE Poses<D> read_poses(const ElementJob& job, const std::uint32_t* slots, const std::uint32_t* bodies,
                               size_t block) {
  const size_t W = hn::Lanes(D());
  if (slots == nullptr) return {load3<D>(job.p + 3 * W * bodies[block], 0), load4<D>(job.q + 4 * W * bodies[block], 0)};
  Num<D> field[kPoseRow];
  read_rows<D, kPoseRow>(job.poses, slots + block * W, field);
  return {{field[0], field[1], field[2]}, {field[3], field[4], field[5], field[6]}};
}

/// A marker of a block in the plane: its body's place and the marker's lever from there in x and z of W, its turn.
template <class D>
struct PlanarMarker {
  Num<D> px, pz, lever_x, lever_z;
  PlanarTurn<D> turn;

  /// c: the marker's fields of the slot, p_x p_y p_z and the turn's w x y z.
  template <class Constant>
  HWY_INLINE PlanarMarker(const Poses<D>& body, const Constant& constant, int c) : px(body.p.x), pz(body.p.z) {
    const PlanarTurn<D> at(body.q);
    at.apply(constant(c), constant(c + 2), lever_x, lever_z);
    turn = at.then({constant(c + 3), constant(c + 5)});
  }
};

template <class D>
HWY_INLINE void lay_pose_block(const PoseJob& job, size_t block) {
  const size_t W = hn::Lanes(D());
  const double *p = job.p + 3 * W * block, *q = job.q + 4 * W * block;
  const Num<D> field[kPoseRow] = {load<D>(p, 0), load<D>(p, 1), load<D>(p, 2), load<D>(q, 0),
                                  load<D>(q, 1), load<D>(q, 2), load<D>(q, 3), num<D>(0)};
  write_rows<D, kPoseRow>(field, job.poses + kPoseRow * W * block);
}

/// A block some lanes of which pass their bounds or crack. What seldom happens is kept out of the way of springs:
/// inlined there it costs them a third of their time, by what the compiler keeps in memory for its sake.
template <class D>
struct Yielding {
  Num<D> x[2], k[6], d[6], was[6];              // stations, stiffness, deformation, stretch before
  Num<D> u[6], e[6], f[6], before[6], slid[6];  // stretch, its elastic part, force; that part before; the rest
  Num<D> torn;                                  // twice what cracks that grow lose
  hn::Mask<D> outside;                          // of the lanes that the full law must look at
};

/// Lets zones flow.
template <class D, Plane In, int Hinges>
HWY_NOINLINE void let_flow(const ElementJob& job, size_t block, hn::Mask<D> flows, Yielding<D>& z) {
  using N = Num<D>;
  constexpr ActiveComponents active = components_of(In);
  const D tag;
  Pressing<D> pressing;
  flows = enter_cells<D, In, Hinges>(job, block, flows, z.k[0], z.d[0], pressing);
  if (hn::AllFalse(tag, flows)) return;
  const double* flow = job.flows + static_cast<size_t>(kFlowFields) * hn::Lanes(tag) * block;
  N f_flow[6], d_before[6];
  for (int c = 0; c < active.count; ++c) d_before[active.at[c]] = load<D>(flow, kBefore + active.at[c]);
  auto flowed = flows;
  const auto good = flow_zone<D, In, Hinges>(job, block, flows, pressing, z.x, z.k, z.d, z.was, f_flow, flowed);
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    z.f[i] = select(good, f_flow[i], z.f[i]);
    const N stretch = f_flow[i] * load<D>(flow, kFlexibility + i);
    z.e[i] = select(good, stretch, z.e[i]);
    z.u[i] = select(good, stretch, z.u[i]);
    const N way = z.d[i] - d_before[i], stretched = stretch - z.was[i];
    const N driven = select(flowed, drive_damper(stretched, way), stretched);
    z.before[i] = select(good, select(flowed, stretch - driven, z.was[i]), z.before[i]);
    z.slid[i] = select(good, way - driven, z.slid[i]);
  }
  z.outside = hn::AndNot(good, z.outside);
}

/// Lets springs crack.
template <class D, Plane In>
HWY_NOINLINE void let_crack(const ElementJob& job, size_t block, hn::Mask<D> cracks, Yielding<D>& z) {
  using N = Num<D>;
  constexpr ActiveComponents active = components_of(In);
  N u_now[6], e_now[6], torn = num<D>(0);
  auto beyond = cracks;
  const auto done = crack_springs<D, In>(job, block, cracks, z.d, u_now, e_now, beyond);
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    const N way = z.u[i] - z.was[i], held = z.k[i] * z.before[i], holds = z.k[i] * e_now[i];
    torn = torn + (fma(held + holds, way, held * z.was[i]) - holds * u_now[i]);
    const N driven = drive_damper(e_now[i] - z.before[i], way);
    z.before[i] = select(done, e_now[i] - driven, z.before[i]);
    z.slid[i] = select(done, way - driven, z.slid[i]);
    z.u[i] = select(done, u_now[i], z.u[i]), z.e[i] = select(done, e_now[i], z.e[i]);
    z.f[i] = select(done, holds, z.f[i]);
  }
  z.torn = select(done, torn, num<D>(0));
  z.outside = hn::Or(z.outside, beyond);
}

/// Forces of one block of elements (docs/theory/zones.md, eq. 1 to 12, and multibody.md, eq. 4).
template <class D, Plane In, int Hinges>
HWY_INLINE void evaluate_element_block(const ElementJob& job, size_t block) {
  using N = Num<D>;
  constexpr bool is_plane = In != Plane::Space;
  constexpr ActiveComponents active = components_of(In);
  const D tag;
  const size_t W = hn::Lanes(tag);
  const Poses<D> A = read_poses<D>(job, job.a, job.body_a, block), B = read_poses<D>(job, job.b, job.body_b, block);
  double* HWY_RESTRICT state = job.states + static_cast<size_t>(kStateFields) * W * block;
  const std::uint32_t* HWY_RESTRICT constants = job.constants + static_cast<size_t>(kConstants) * block;
  const auto constant = [&](int field) TOPPLE_INLINED -> N {
    return {hn::Load(tag, job.pool + size_t{constants[field - kStateFields]} * W)};
  };
  const auto constant3 = [&](int field) TOPPLE_INLINED -> V3<D> {
    return {constant(field), constant(field + 1), constant(field + 2)};
  };
  const auto constant4 = [&](int field) TOPPLE_INLINED -> Q4<D> {
    return {constant(field), constant(field + 1), constant(field + 2), constant(field + 3)};
  };
  double* HWY_RESTRICT out = job.forces + static_cast<size_t>(kForceFields) * W * block;

  const N one = num<D>(1), zero = num<D>(0), half = num<D>(0.5);
  constexpr bool is_member = Hinges == 2;
  const N x[2] = {constant(kStation), constant(kStation + 1)};
  N d[6];
  V3<D> lever_a, lever_b;
  M33<D> axes;     // halfway between F and M, of a member between both laid along its chord
  N sine, cosine;  // of their turn in the plane
  N s2, over_sine;
  // the way from F to M without a member; the vector of the quaternion of the turn, of a member its twist; twice the
  // inverse of the squared length of the sum of both quaternions, which lies halfway
  V3<D> way, v;
  N excess, per_sum;
  const auto halve = [&](N w) TOPPLE_INLINED {
    per_sum = one / (one + abs(w));
    excess = excess_of<D>(s2);
    over_sine = num<D>(2) * fma(s2, excess, one);
  };
  // a member: x of the stations on a and on b, the turns from both ends to the chord
  N x_a, x_b, over_length;
  Swing<D> swing_a, swing_b;
  const auto measure_chord = [&](const V3<D>& chord) TOPPLE_INLINED {
    x_a = minimum(x[0], x[1]), x_b = maximum(x[0], x[1]);
    // an empty lane has none
    over_length = one / N{hn::Sqrt(maximum(dot(chord, chord), num<D>(1e-60)).v)};
    d[0] = fms(over_length, dot(chord, chord), x_b - x_a);
    return V3<D>{over_length * chord.x, over_length * chord.y, over_length * chord.z};
  };
  Leaning<D> to_chord, from_b;  // of a member in space: of its chord against a, and against b
  if constexpr (is_plane) {
    const PlanarMarker<D> at_a(A, constant, kMarkerA), at_b(B, constant, kMarkerB);
    PlanarTurn<D> turned = at_a.turn;
    const N apart_x = at_b.px - at_a.px, apart_z = at_b.pz - at_a.pz;
    const N along_x = (apart_x - at_a.lever_x) + at_b.lever_x, along_z = (apart_z - at_a.lever_z) + at_b.lever_z;
    lever_a = {at_a.lever_x, zero, at_a.lever_z};
    lever_b = {at_b.lever_x, zero, at_b.lever_z};
    const auto across_of = [&]() TOPPLE_INLINED { return fma(cosine, along_z, sine * along_x); };
    const auto along_of = [&]() TOPPLE_INLINED { return fms(cosine, along_x, sine * along_z); };
    sine = turned.sine(), cosine = turned.cosine();
    if constexpr (is_member) {
      swing_a.lay(measure_chord({along_of(), zero, across_of()}));
      turned = turned.then({swing_a.w, swing_a.y});
    }
    const PlanarTurn<D> apart_by = turned.back().then(at_b.turn);
    v.y = {hn::CopySign(apart_by.y.v, hn::Xor(apart_by.y.v, apart_by.w.v))};
    s2 = v.y * v.y;
    halve(apart_by.w);
    if constexpr (!is_member) {
      const auto sign = hn::CopySign(zero.v, apart_by.w.v);
      const N sum_w = turned.w + N{hn::Xor(at_b.turn.w.v, sign)}, sum_y = turned.y + N{hn::Xor(at_b.turn.y.v, sign)};
      lever_a.x = fma(half, along_x, lever_a.x), lever_a.z = fma(half, along_z, lever_a.z);
      lever_b.x = fnma(half, along_x, lever_b.x), lever_b.z = fnma(half, along_z, lever_b.z);
      const N share = per_sum * sum_y;
      sine = share * sum_w, cosine = fnma(share, sum_y, one);
    }
    if constexpr (is_member) sine = turned.sine(), cosine = turned.cosine();
    N moved = across_of(), rotation = over_sine * v.y;
    if constexpr (is_member) {
      const N turn_a = swing_a.over_sine * swing_a.y;
      moved = fma(x_a, turn_a, x_b * rotation);
      rotation = turn_a + rotation;
    } else {
      d[0] = along_of();
    }
    d[active.at[1]] = In == Plane::AboutY ? moved : zero - moved;
    d[active.at[2]] = rotation;
  } else {
    lever_a = turn(A.q, constant3(kMarkerA));
    lever_b = turn(B.q, constant3(kMarkerB));
    Q4<D> qF = A.q * constant4(kMarkerA + 3), qM = B.q * constant4(kMarkerB + 3);
    const V3<D> apart = B.p - A.p, between = (apart - lever_a) + lever_b;
    const auto back = [&](const Q4<D>& q) TOPPLE_INLINED { return Q4<D>{q.w, zero - q.x, zero - q.y, zero - q.z}; };
    if constexpr (is_member) {
      const V3<D> chord = measure_chord(between);
      swing_a.lay(turn(back(qF), chord)), swing_b.lay(turn(back(qM), chord));
      qF = swing_a.apply(qF), qM = swing_b.apply(qM);
    }
    Q4<D> q;
    if constexpr (is_member) {
      q.w = fma(qF.z, qM.z, fma(qF.y, qM.y, fma(qF.x, qM.x, qF.w * qM.w)));
      q.x = fma(qF.z, qM.y, fnma(qF.y, qM.z, fms(qF.w, qM.x, qF.x * qM.w)));
    } else {
      q = conj_times(qF, qM);
    }
    v.x = {hn::CopySign(q.x.v, hn::Xor(q.x.v, q.w.v))};
    if constexpr (is_member) {
      s2 = v.x * v.x;
    } else {
      v.y = {hn::CopySign(q.y.v, hn::Xor(q.y.v, q.w.v))};
      v.z = {hn::CopySign(q.z.v, hn::Xor(q.z.v, q.w.v))};
      s2 = dot(v, v);
    }
    halve(q.w);
    const auto sign = hn::CopySign(zero.v, q.w.v);
    const auto add = [&](N a, N b) TOPPLE_INLINED { return a + N{hn::Xor(b.v, sign)}; };
    axes = to_matrix({add(qF.w, qM.w), add(qF.x, qM.x), add(qF.y, qM.y), add(qF.z, qM.z)}, per_sum);
    if constexpr (is_member) {
      to_chord.set(swing_a, abs(q.w), v.x), from_b.set(swing_b, abs(q.w), zero - v.x);
      d[1] = fms(x_b, from_b.z, x_a * to_chord.z), d[2] = fms(x_a, to_chord.y, x_b * from_b.y);
      d[3] = over_sine * v.x, d[4] = to_chord.y - from_b.y, d[5] = to_chord.z - from_b.z;
    } else {
      const V3<D> to_middle = half * between;
      lever_a = lever_a + to_middle, lever_b = lever_b - to_middle;
      const V3<D> r = over_sine * v;
      way = transpose_times(axes, between);
      d[0] = way.x, d[1] = way.y, d[2] = way.z, d[3] = r.x, d[4] = r.y, d[5] = r.z;
    }
  }
  auto too_far = hn::Gt(s2.v, constant(kMostTurn).v);
  if constexpr (is_member) too_far = hn::Or(too_far, hn::Gt(swing_a.s2.v, constant(kMostTurn).v));
  if constexpr (is_member && !is_plane) too_far = hn::Or(too_far, hn::Gt(swing_b.s2.v, constant(kMostTurn).v));
  auto outside = too_far;

  N u[6], e[6], f[6], k[6], was[6], before[6];
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    u[i] = d[i] - constant(kOffset + i);
    was[i] = load<D>(state, kStretch + i);
    e[i] = u[i], before[i] = was[i];
  }
  const bool softened = job.softened[block] != 0;
  if (softened) {
    for (int plane = first_bending(In); plane <= last_bending(In); ++plane) {
      const int shear = plane == 0 ? 2 : 1, bend = plane == 0 ? 4 : 5, at = kSoft + 4 * plane;
      const N c00 = constant(at), c01 = constant(at + 1), c10 = constant(at + 2), c11 = constant(at + 3);
      e[shear] = fma(c00, u[shear], c01 * u[bend]);
      e[bend] = fma(c10, u[shear], c11 * u[bend]);
      before[shear] = fma(c00, was[shear], c01 * was[bend]);
      before[bend] = fma(c10, was[shear], c11 * was[bend]);
    }
  }
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    k[i] = constant(kStiffness + i);
    f[i] = k[i] * e[i];
  }
  const auto cracks_grow = [&](int station, int axis, N moment) TOPPLE_INLINED {
    const int scale = kCrackScale + 4 * station + 2 * axis;
    return find_growth<D>(moment, constant(scale), constant(scale + 1));
  };
  // is every resultant inside the bounds for sure?
  auto cracks = hn::FirstN(tag, 0);
  outside = hn::Or(outside,
                   hn::Not(hn::And(hn::Ge(f[0].v, constant(kLeastForce).v), hn::Le(f[0].v, constant(kMostForce).v))));
  if constexpr (is_plane) {
    constexpr int q = first_bending(In), shear = active.at[1], bend = active.at[2];
    outside = hn::Or(outside, hn::Gt((abs(f[shear]) * constant(kShearScale + shear - 1)).v, one.v));
    const N scale = constant(kMomentScale + q);
    for (int station = 0; station < Hinges; ++station) {
      const N m = q == 0 ? fma(x[station], f[shear], f[bend]) : fnma(x[station], f[shear], f[bend]);
      outside = hn::Or(outside, hn::Gt((abs(m) * scale).v, one.v));
      cracks = hn::Or(cracks, cracks_grow(station, q, m));
    }
  } else {
    const N vy = f[1] * constant(kShearScale), vz = f[2] * constant(kShearScale + 1);
    outside = hn::Or(outside, hn::Gt(fma(vy, vy, vz * vz).v, one.v));
    const N torsion_scale = constant(kTorsionScale);
    outside = hn::Or(outside, hn::Gt((abs(f[3]) * torsion_scale).v, one.v));
    const N exponent = constant(kExponent);
    const N scale_y = constant(kMomentScale), scale_z = constant(kMomentScale + 1);
    for (int station = 0; station < Hinges; ++station) {
      const N about_y = fma(x[station], f[2], f[4]), about_z = fnma(x[station], f[1], f[5]);
      cracks = hn::Or(cracks, hn::Or(cracks_grow(station, 0, about_y), cracks_grow(station, 1, about_z)));
      const N my = abs(about_y) * scale_y, mz = abs(about_z) * scale_z;
      const auto linear = hn::Gt((my + mz).v, one.v);
      if (HWY_LIKELY(hn::AllFalse(tag, linear))) continue;
      const auto is_square = hn::Ge(exponent.v, hn::Set(tag, 2.0)),
                 is_three_halves = hn::Ge(exponent.v, hn::Set(tag, 1.5));
      const auto raised = [&](N m) TOPPLE_INLINED -> N {
        return select(is_square, m * m, select(is_three_halves, m * N{hn::Sqrt(m.v)}, m));
      };
      outside = hn::Or(outside, hn::Gt((raised(my) + raised(mz)).v, one.v));
    }
  }
  cracks = hn::AndNot(outside, cracks);
  // what the damper does on the part of the deformation that is not elastic
  N slid[6] = {zero, zero, zero, zero, zero, zero};
  if (softened)
    for (int c = 0; c < active.count; ++c) {
      const int i = active.at[c];
      slid[i] = (u[i] - was[i]) - (e[i] - before[i]);
    }
  bool books_slid = softened;
  N torn = zero;
  const auto flows = hn::AndNot(too_far, hn::And(outside, hn::Gt(constant(kFlows).v, zero.v)));
  const bool is_flowing = !hn::AllFalse(tag, flows), is_cracking = !hn::AllFalse(tag, cracks);
  if (HWY_UNLIKELY(is_flowing || is_cracking)) {
    Yielding<D> z;
    z.x[0] = x[0], z.x[1] = x[1], z.torn = zero, z.outside = outside;
    for (int c = 0; c < active.count; ++c) {
      const int i = active.at[c];
      z.k[i] = k[i], z.d[i] = d[i], z.was[i] = was[i];
      z.u[i] = u[i], z.e[i] = e[i], z.f[i] = f[i], z.before[i] = before[i], z.slid[i] = slid[i];
    }
    if (is_flowing) let_flow<D, In, Hinges>(job, block, flows, z);
    if (is_cracking) let_crack<D, In>(job, block, cracks, z);
    for (int c = 0; c < active.count; ++c) {
      const int i = active.at[c];
      u[i] = z.u[i], e[i] = z.e[i], f[i] = z.f[i], before[i] = z.before[i], slid[i] = z.slid[i];
    }
    torn = z.torn, outside = z.outside, books_slid = true;
  }

  // standard linear solid: the damper follows the mean of the step
  const N viscous = constant(kViscous), keep = one - constant(kRelaxation);
  const N taken = fma(half, keep, half);
  const auto inside = hn::Not(outside);
  N g[6], work = zero, lost = zero;
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
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
  if (books_slid) store_where<D>(inside, fma(half, lost + torn, load<D>(state, kBled)), state, kBled);

  if constexpr (is_plane) {
    N across = In == Plane::AboutY ? g[2] : zero - g[1], torque_a = g[active.at[2]], torque_b = torque_a;
    if constexpr (is_member) {
      torque_a = fma(x_a, across, torque_a), torque_b = fma(x_b, across, torque_b);
      across = over_length * (torque_b - torque_a);
    }
    const N fx = fma(cosine, g[0], sine * across), fz = fms(cosine, across, sine * g[0]);
    store<D>(fx, out, 0);
    store<D>(fz, out, 2);
    // seen from both centres
    store<D>(fms(lever_a.z, fx, lever_a.x * fz) + torque_a, out, 4);
    store<D>(fms(lever_b.z, fx, lever_b.x * fz) + torque_b, out, 7);
  } else {
    // torques conjugate to the rates of the rotation vectors
    V3<D> shear{g[0], g[1], g[2]}, torque_a, torque_b;
    if constexpr (is_member) {
      const N a_y = fma(x_a, g[2], g[4]), a_z = fnma(x_a, g[1], g[5]);
      const N b_y = fma(x_b, g[2], g[4]), b_z = fnma(x_b, g[1], g[5]);
      const N twist_a = fms(to_chord.y, a_z, to_chord.z * a_y), twist_b = fms(from_b.y, b_z, from_b.z * b_y);
      const N bent_a = swing_a.coefficient * twist_a, bent_b = swing_b.coefficient * twist_b;
      const N given_a = fnma(half, twist_b, g[3]), given_b = fnma(half, twist_a, g[3]);
      const N torsion = fnma(half, twist_a, given_a);
      torque_a = {torsion, fnma(given_a, to_chord.tangent_z, fma(bent_a, to_chord.z, a_y)),
                  fma(given_a, to_chord.tangent_y, fnma(bent_a, to_chord.y, a_z))};
      torque_b = {torsion, fnma(given_b, from_b.tangent_z, fma(bent_b, from_b.z, b_y)),
                  fma(given_b, from_b.tangent_y, fnma(bent_b, from_b.y, b_z))};
      shear.y = over_length * (torque_a.z - torque_b.z), shear.z = over_length * (torque_b.y - torque_a.y);
      torque_a = axes * torque_a, torque_b = axes * torque_b;
    } else {
      const V3<D> m{g[3], g[4], g[5]}, conjugate = m - excess * cross(v, cross(v, m));
      torque_a = torque_b = axes * (conjugate + cross(cross(way, shear), (half * per_sum) * v));
    }
    const V3<D> force = axes * shear;
    store3<D>(force, out, 0);
    // seen from both centres
    store3<D>(cross(lever_a, force) + torque_a, out, 3);
    store3<D>(cross(lever_b, force) + torque_b, out, 6);
  }
  if (HWY_UNLIKELY(!hn::AllFalse(tag, outside))) report<D>(outside, block, *job.outside);
}

template <class D>
HWY_INLINE void evaluate_block_of(const ElementJob& job, size_t block) {
  const bool is_single = job.single[block] != 0;
  switch (job.planes[block]) {
    case Plane::Space:
      return is_single ? evaluate_element_block<D, Plane::Space, 1>(job, block)
                       : evaluate_element_block<D, Plane::Space, 2>(job, block);
    case Plane::AboutY:
      return is_single ? evaluate_element_block<D, Plane::AboutY, 1>(job, block)
                       : evaluate_element_block<D, Plane::AboutY, 2>(job, block);
    case Plane::AboutZ:
      return is_single ? evaluate_element_block<D, Plane::AboutZ, 1>(job, block)
                       : evaluate_element_block<D, Plane::AboutZ, 2>(job, block);
  }
}

template <class D>
HWY_INLINE void evaluate_all(const ElementJob& job) {
  for (size_t block = job.first; block < job.last; ++block)
    if (job.live[block] != 0) evaluate_block_of<D>(job, block);
}

template <class D>
HWY_INLINE void advance_all(const BodyJob& job) {
  Num<D> sum = num<D>(0);
  for (size_t block = 0; block < job.blocks; ++block)
    job.is_planar ? advance_planar_block<D>(job, block, sum) : advance_body_block<D>(job, block, sum);
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
    if (job.is_planar) f.y = t.x = t.z = num<D>(0);
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
