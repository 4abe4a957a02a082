// Compiled once for each instruction set (Highway's foreach_target).
#include "mbs/kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "mbs/kernel.cpp"
// one wide target for each family of machines keeps the build short
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

#include <limits>

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

/// Poses of the bodies of a block of elements; `bodies` one a lane.
template <class D>
HWY_INLINE Poses<D> read_poses(const double* HWY_RESTRICT poses, const std::uint32_t* HWY_RESTRICT bodies) {
  Num<D> field[kPoseRow];
  read_rows<D, kPoseRow>(poses, bodies, field);
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

constexpr int kMostSweeps = 12;   // of two stations that turn one after the other
constexpr double kStill = 1e-11;  // share of its rotation by which a station does not turn any more then
constexpr double kNearPlane = 0.9, kNear = 0.854;  // kNearBounds, and to the power of the biaxial bound

/// A bending plane of a zone: about y with shear along z (sign +1), or about z with shear along y (sign -1).
template <class D, int Hinges>
struct BendingPlane {
  Num<D> shear_stiffness, bending_stiffness;
  Num<D> stiffness[2], cross;  // of the stations against their own rotation and the other's
  Num<D> lever[2];             // sign times x
  Num<D> shift, rotation;      // deformations
  Num<D> phi[2], soft[2], crack[2], bow[2], m[2];

  HWY_INLINE Num<D> shear() const {
    Num<D> u = shift;
    for (int s = 0; s < Hinges; ++s) u = fnma(lever[s], phi[s], u);
    return shear_stiffness * u;
  }
  HWY_INLINE Num<D> moment() const {
    Num<D> u = rotation;
    for (int s = 0; s < Hinges; ++s) u = u - phi[s];
    return bending_stiffness * u;
  }
  HWY_INLINE void measure() {
    const Num<D> v = shear(), b = moment();
    for (int s = 0; s < Hinges; ++s) m[s] = fma(lever[s], v, b);
  }
};

/// Where a moment lets cracks grow.
///   positive, negative  one over the bounds of moments > 0 and < 0 [1/(N·m)]
template <class D>
HWY_INLINE auto find_growth(Num<D> moment, Num<D> positive, Num<D> negative) {
  return hn::Gt(maximum(moment * positive, (num<D>(0) - moment) * negative).v, num<D>(1).v);
}

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
  /// Rise of such values with the force.
  HWY_INLINE Num<D> slope(const double* HWY_RESTRICT flow, int cell, Num<D> low, Num<D> middle, Num<D> high) const {
    return select(upper, (high - middle) * load<D>(flow, cell + kCellForce + 2),
                  (middle - low) * load<D>(flow, cell + kCellForce + 1));
  }
  /// Between values at the cell's three forces.
  HWY_INLINE Num<D> mix(Num<D> low, Num<D> middle, Num<D> high) const {
    return fma(share, select(upper, high, low) - middle, middle);
  }
};

/// Normal force of a zone that may flow in compression or be slack, and how far it does (docs/theory/zones.md, eq. 5).
template <class D>
struct Pressing {
  Num<D> force;           // elastic, within the limit
  Num<D> shortening;      // plastic, of this step
  Num<D> unfolding;       // what has buckled becomes straight by, of this step
  Num<D> whole;           // section that is left, and over what was left when the cells were written
  Num<D> share;           //
  Num<D> per_share;       //
  hn::Mask<D> flows;      // shortens or unfolds
  hn::Mask<D> is_known;   // what the slot has of the limits holds here
  hn::Mask<D> is_within;  // then the numbers are the whole truth: it neither flows in tension nor breaks

  HWY_INLINE Pressing() {}
  /// k, d: stiffness and elongation; strained: the largest one of the stations.
  HWY_INLINE Pressing(const double* HWY_RESTRICT flow, Num<D> k, Num<D> d, Num<D> strained) {
    using N = Num<D>;
    const D tag;
    const N zero = num<D>(0);
    const N trial = k * (d - load<D>(flow, kAxial)), shortened = load<D>(flow, kShortened);
    N least = {hn::Set(tag, -std::numeric_limits<double>::infinity())};
    for (int q = 0; q < 2; ++q)
      least = maximum(least, fma(load<D>(flow, kTurnedSlope + q), strained - load<D>(flow, kTurnedFrom + q),
                                 load<D>(flow, kTurnedLeast + q)));
    const N capacity = zero - least, part = load<D>(flow, kTurnedPart);
    const auto calc_limit = [&](N at, N& left) {
      const N curve = fma(load<D>(flow, kCurveSlope), at - load<D>(flow, kCurveFrom), load<D>(flow, kCurveForce));
      left = fma(load<D>(flow, kWholePerForce), curve, load<D>(flow, kWhole));
      return minimum(minimum(curve, fma(part * capacity, left - num<D>(1), capacity)), load<D>(flow, kTurnedHinge));
    };
    const N limit = calc_limit(shortened, whole), over = (zero - trial) - limit;
    flows = hn::And(hn::Gt(over.v, zero.v), hn::Lt(trial.v, zero.v));
    is_known = hn::And(
        hn::Le(strained.v, load<D>(flow, kTurnedFar).v),
        hn::And(hn::Ge(shortened.v, load<D>(flow, kCurveFrom).v), hn::Le(shortened.v, load<D>(flow, kCurveFar).v)));
    force = trial, shortening = unfolding = zero;
    if (!hn::AllFalse(tag, flows)) {
      // the curve falls while the zone shortens: one more look at it after the first estimate
      N left;
      const N behind = shortened + over / k, then = calc_limit(behind, left);
      flows = hn::And(flows, hn::Le(behind.v, load<D>(flow, kCurveFar).v));
      shortening = select(flows, maximum(zero, ((zero - trial) - then) / k), zero);
      whole = select(flows, left, whole);
      force = select(flows, maximum(trial, zero - then), trial);
    }
    // slack as long as it is not straight
    auto slack = hn::And(hn::Gt(trial.v, zero.v), hn::Gt(load<D>(flow, kBuckles).v, zero.v));
    if (!hn::AllFalse(tag, slack)) {
      N left;
      const N by = trial / k, then = shortened - by;
      (void)calc_limit(then, left);
      slack = hn::And(slack, hn::And(hn::Gt(then.v, zero.v), hn::Ge(then.v, load<D>(flow, kCurveFrom).v)));
      unfolding = select(slack, by, zero);
      whole = select(slack, left, whole);
      force = select(slack, zero, force);
      flows = hn::Or(flows, slack);
    }
    const N written = load<D>(flow, kWrittenWhole);
    share = whole / written, per_share = written / whole;
    is_within = hn::And(
        hn::And(hn::Or(flows, hn::Le(over.v, zero.v)), hn::Or(slack, hn::Le(trial.v, load<D>(flow, kFlowMost).v))),
        hn::Lt((shortened + shortening).v, load<D>(flow, kCrushLength).v));
  }
  /// As the cells have it.
  HWY_INLINE Num<D> in_cells() const { return force * per_share; }
};

/// Those lanes among `wanted` whose normal force and rotations are in their cells, which are written anew where they
/// have left them, and that do not flow in tension.
template <class D, Plane In, int Hinges, class M>
HWY_INLINE M enter_cells(const ElementJob& job, size_t block, M wanted, Num<D> k, Num<D> d, Pressing<D>& pressing) {
  using N = Num<D>;
  const D tag;
  const size_t W = hn::Lanes(tag);
  const double* flow = job.flows + static_cast<size_t>(kFlowFields) * W * block;
  const N one = num<D>(1), zero = num<D>(0), on_edge = num<D>(1 + 1e-10);
  struct Place {
    M is_in_cells, is_known, is_within;
  };
  const auto find = [&] {
    Place at{wanted, wanted, wanted};
    N most = zero;
    for (int s = 0; s < Hinges; ++s) most = maximum(most, load<D>(flow, kStations + s * kStationFields + kStrained));
    pressing = Pressing<D>(flow, k, d, most);
    const N force = pressing.in_cells();
    for (int s = 0; s < Hinges; ++s) {
      const N strained = load<D>(flow, kStations + s * kStationFields + kStrained);
      for (int q = first_bending(In); q <= last_bending(In); ++q) {
        const int cell = kStations + s * kStationFields + kCell + q * kCellFields;
        const N r = (strained - load<D>(flow, cell + kCellRotation)) * load<D>(flow, cell + kCellRotation + 1);
        at.is_in_cells = hn::And(at.is_in_cells, hn::And(hn::Le(CellForce<D>(flow, cell, force).share.v, on_edge.v),
                                                         hn::And(hn::Ge(r.v, zero.v), hn::Le(r.v, one.v))));
      }
    }
    at.is_known = pressing.is_known;
    at.is_within = pressing.is_within;
    return at;
  };
  Place at = find();
  const M left = hn::AndNot(hn::And(at.is_in_cells, at.is_known), wanted);
  const M stale = hn::And(left, hn::Or(at.is_within, hn::Not(at.is_known)));
  if (HWY_UNLIKELY(!hn::AllFalse(tag, stale))) {
    alignas(64) double forces[kMostLanes], is_stale[kMostLanes];
    hn::Store((pressing.force / pressing.whole).v, tag, forces);
    hn::Store(hn::IfThenElseZero(stale, one.v), tag, is_stale);
    for (size_t l = 0; l < W; ++l)
      if (is_stale[l] != 0) job.writer.write_cells(job.writer.owner, block * W + l, forces[l]);
    at = find();
  }
  return hn::And(hn::And(wanted, at.is_within), hn::And(at.is_in_cells, at.is_known));
}

/// The law of a zone that flows in bending, shear, torsion or compression (docs/theory/zones.md, eq. 1 to 9), in its
/// cells. Sets the elastic resultants f; gives the lanes among `wanted` for which that is the whole truth and moves
/// their history; the others keep theirs. `flowed` are those of them that have passed a limit in this step.
template <class D, Plane In, int Hinges, class M>
HWY_INLINE M flow_zone(const ElementJob& job, size_t block, M wanted, const Pressing<D>& pressing, const Num<D> x[2],
                       const Num<D> k[6], const Num<D> d[6], const Num<D> e_before[6], Num<D> f[6], M& flowed) {
  using N = Num<D>;
  constexpr int first = first_bending(In), last = last_bending(In);
  constexpr bool is_plane = In != Plane::Space;
  constexpr ActiveComponents active = components_of(In);
  const D tag;
  const size_t W = hn::Lanes(tag);
  double* flow = job.flows + static_cast<size_t>(kFlowFields) * W * block;
  const N zero = num<D>(0), one = num<D>(1), half = num<D>(0.5), tiny = num<D>(1e-290);
  M good = wanted;
  const auto demand = [&](M condition) { good = hn::And(good, condition); };

  const N slip[2] = {load<D>(flow, kSlip), load<D>(flow, kSlip + 1)}, twist = load<D>(flow, kTwist);
  for (int i = 0; i < 6; ++i) f[i] = zero;
  f[0] = pressing.force;
  const N in_cells = pressing.in_cells();
  if constexpr (!is_plane) f[3] = k[3] * (d[3] - twist);

  BendingPlane<D, Hinges> plane[2];
  const auto find_trial = [&]() -> M {
    M grows = hn::FirstN(tag, 0);  // cracks
    for (int q = first; q <= last; ++q) {
      BendingPlane<D, Hinges>& P = plane[q];
      const int shear = q == 0 ? 2 : 1, bend = q == 0 ? 4 : 5;
      P.shear_stiffness = k[shear], P.bending_stiffness = k[bend];
      P.shift = d[shear] - slip[shear - 1];
      P.rotation = d[bend];
      for (int s = 0; s < Hinges; ++s) {
        const int station = kStations + s * kStationFields;
        P.lever[s] = q == 0 ? x[s] : zero - x[s];
        P.stiffness[s] = fma(x[s] * x[s], k[shear], k[bend]);
        P.phi[s] = load<D>(flow, station + kPhi + q);
        P.soft[s] = load<D>(flow, station + kSoftness + q);
        P.crack[s] = load<D>(flow, station + kCracked + q);
        P.bow[s] = load<D>(flow, station + kBow + q);
      }
      // damage adds flexibility at the stations: (1 + S C) m = m0
      P.measure();
      if constexpr (Hinges == 1) {
        const N s11 = fma(P.stiffness[0], P.soft[0], one);
        P.m[0] = is_plane ? P.m[0] / s11 : P.m[0] * (one / s11);
      } else {
        P.cross = fma(x[0] * x[1], k[shear], k[bend]);
        const N s11 = fma(P.stiffness[0], P.soft[0], one), s22 = fma(P.stiffness[1], P.soft[1], one);
        const N s12 = P.cross * P.soft[1], s21 = P.cross * P.soft[0];
        const N scale = one / fms(s11, s22, s12 * s21);
        const N m0 = fms(P.m[0], s22, P.m[1] * s12) * scale, m1 = fms(P.m[1], s11, P.m[0] * s21) * scale;
        P.m[0] = m0, P.m[1] = m1;
      }
      for (int s = 0; s < Hinges; ++s) {
        const int growth = kStations + s * kStationFields + kGrowth + 2 * q;
        P.phi[s] = fma(P.soft[s], P.m[s], P.phi[s]);
        grows = hn::Or(grows, find_growth<D>(P.m[s], load<D>(flow, growth), load<D>(flow, growth + 1)));
      }
    }
    return hn::And(wanted, grows);
  };
  M cracks = find_trial();
  if (HWY_UNLIKELY(!hn::AllFalse(tag, cracks))) {
    alignas(64) double at[6 * kMostLanes] = {}, is_cracking[kMostLanes];
    for (int c = 0; c < active.count; ++c)
      hn::Store(d[active.at[c]].v, tag, at + static_cast<size_t>(active.at[c]) * W);
    hn::Store(hn::IfThenElseZero(cracks, one.v), tag, is_cracking);
    for (size_t l = 0; l < W; ++l)
      if (is_cracking[l] != 0 && !job.writer.grow_cracks(job.writer.owner, block * W + l, at + l, W))
        is_cracking[l] = 0;
    cracks = hn::Gt(hn::Load(tag, is_cracking), zero.v);
    (void)find_trial();
  }

  // (|My|/Ly)^1.5 + (|Mz|/Lz)^1.5 of a station, in a plane |M|/L; an axis without any limit left stands apart
  struct Demand {
    N sum;
    M out, lost, none[2];
  };
  const auto calc_demand = [&](int s) {
    const M no = hn::FirstN(tag, 0);
    Demand to{zero, no, no, {no, no}};
    for (int q = first; q <= last; ++q) {
      const int cell = kStations + s * kStationFields + kCell + q * kCellFields;
      const CellForce<D> at(flow, cell, in_cells);
      const N r = (load<D>(flow, kStations + s * kStationFields + kStrained) - load<D>(flow, cell + kCellRotation)) *
                  load<D>(flow, cell + kCellRotation + 1);
      const auto positive = hn::Ge(plane[q].m[s].v, zero.v);
      const auto corner = [&](int force, int rotation) {
        const int value = cell + 2 * force + rotation;
        return select(positive, load<D>(flow, value + kCellPositive), load<D>(flow, value + kCellNegative));
      };
      const N low = at.mix(corner(0, 0), corner(1, 0), corner(2, 0));
      const N high = at.mix(corner(0, 1), corner(1, 1), corner(2, 1));
      const N limit = pressing.share * fma(r, high - low, low), size = abs(plane[q].m[s]);
      to.none[q] = hn::Le(limit.v, zero.v);
      const N ratio = select(to.none[q], zero, size / N{hn::Max(limit.v, tiny.v)});
      to.sum = is_plane ? ratio : to.sum + ratio * N{hn::Sqrt(ratio.v)};
      to.lost = hn::Or(to.lost, hn::And(to.none[q], hn::Gt(size.v, zero.v)));
    }
    to.out = hn::Or(to.lost, hn::Gt(to.sum.v, one.v));
    return to;
  };
  const auto calc_scale = [&](const Demand& at, N scale[2]) {
    const auto beyond = hn::Gt(at.sum.v, one.v);
    N common;
    if constexpr (is_plane) {
      common = select(beyond, one / select(beyond, at.sum, one), one);
    } else {
      demand(hn::Or(hn::Not(at.out), hn::Le(at.sum.v, hn::Set(tag, kMostOver))));
      common = select(beyond, inverse_root<D>(at.sum), one);
    }
    for (int q = first; q <= last; ++q) scale[q] = select(at.none[q], zero, common);
  };
  const Demand at_first = calc_demand(0), at[2] = {at_first, Hinges == 1 ? at_first : calc_demand(1)};
  N by[2][2] = {{zero, zero}, {zero, zero}};  // further inelastic rotation [plane][station]
  N phi_trial[2][2], m_trial[2][2];           // [plane][station], [station][plane]
  for (int q = first; q <= last; ++q)
    for (int s = 0; s < Hinges; ++s) phi_trial[q][s] = plane[q].phi[s], m_trial[s][q] = plane[q].m[s];
  const M bends = hn::And(good, hn::Or(at[0].out, at[1].out));
  const auto apply_turns = [&] {
    for (int q = first; q <= last; ++q) {
      for (int s = 0; s < Hinges; ++s) plane[q].phi[s] = phi_trial[q][s] + by[q][s];
      plane[q].measure();
    }
  };
  // where both stations at once would bring work
  const auto turn_in_turns = [&](M these) {
    for (int sweep = 0; sweep < kMostSweeps && !hn::AllFalse(tag, these); ++sweep) {
      M changed = hn::FirstN(tag, 0);
      for (int s = 0; s < Hinges; ++s) {
        apply_turns();
        const Demand now = calc_demand(s);
        const M out = hn::And(these, now.out), so_far = good;
        N scale[2];
        calc_scale(now, scale);
        good = hn::Or(good, hn::AndNot(out, so_far));
        for (int q = first; q <= last; ++q) {
          const BendingPlane<D, Hinges>& P = plane[q];
          const M turns = hn::And(out, hn::Gt(P.stiffness[s].v, zero.v));
          const N more = select(turns, (P.m[s] - P.m[s] * scale[q]) / P.stiffness[s], zero);
          by[q][s] = by[q][s] + more;
          changed = hn::Or(changed, hn::Gt(abs(more).v, (num<D>(kStill) * abs(P.phi[s] + more)).v));
        }
      }
      these = hn::And(these, changed);
    }
  };
  if (Hinges == 1 && !hn::AllFalse(tag, bends)) {
    N scale[2];
    calc_scale(at[0], scale);
    for (int q = first; q <= last; ++q) {
      const BendingPlane<D, Hinges>& P = plane[q];
      const N turn = (P.m[0] - P.m[0] * scale[q]) / P.stiffness[0];
      by[q][0] = select(hn::And(at[0].out, hn::Gt(P.stiffness[0].v, zero.v)), turn, zero);
    }
  }
  if (Hinges == 2 && !hn::AllFalse(tag, bends)) {
    N scale[2][2], target[2][2], trial[2][2];
    for (int s = 0; s < Hinges; ++s) calc_scale(at[s], scale[s]);
    // one station alone
    const M alone[2] = {hn::AndNot(at[1].out, at[0].out), hn::AndNot(at[0].out, at[1].out)};
    for (int q = first; q <= last; ++q) {
      BendingPlane<D, Hinges>& P = plane[q];
      for (int s = 0; s < Hinges; ++s) {
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
    for (int s = 0; s < Hinges; ++s) {
      const Demand again = calc_demand(s);
      const M pushed = hn::And(alone[1 - s], again.out);
      if (HWY_LIKELY(hn::AllFalse(tag, pushed))) continue;
      N back[2];
      const M so_far = good;
      calc_scale(again, back);
      good = hn::Or(good, hn::AndNot(pushed, so_far));
      for (int q = first; q <= last; ++q) target[q][s] = select(pushed, plane[q].m[s] * back[q], target[q][s]);
      both = hn::Or(both, pushed);
    }
    if (!hn::AllFalse(tag, both)) {
      N work[2] = {zero, zero}, together[2][2];
      M at_once = both;
      for (int q = first; q <= last; ++q) {
        const BendingPlane<D, Hinges>& P = plane[q];
        const N determinant = fms(P.stiffness[0], P.stiffness[1], P.cross * P.cross);
        at_once = hn::And(at_once, hn::Gt(determinant.v, (num<D>(1e-9) * P.stiffness[0] * P.stiffness[1]).v));
        const N over0 = trial[q][0] - target[q][0], over1 = trial[q][1] - target[q][1];
        together[q][0] = fms(P.stiffness[1], over0, P.cross * over1) / determinant;
        together[q][1] = fms(P.stiffness[0], over1, P.cross * over0) / determinant;
        work[0] = fma(target[q][0], together[q][0], work[0]);
        work[1] = fma(target[q][1], together[q][1], work[1]);
      }
      at_once = hn::And(at_once, hn::And(hn::Ge(work[0].v, zero.v), hn::Ge(work[1].v, zero.v)));
      for (int q = first; q <= last; ++q)
        for (int s = 0; s < Hinges; ++s) by[q][s] = select(at_once, together[q][s], by[q][s]);
      turn_in_turns(hn::AndNot(at_once, both));
    }
  }
  apply_turns();

  // what turns further lengthens or shortens
  const auto length_of = [&](const auto& about) {
    if constexpr (is_plane)
      return abs(about(first));
    else
      return N{hn::Sqrt(fma(about(0), about(0), about(1) * about(1)).v)};
  };
  const auto beyond_cracks = [&](int q, int s) {
    return fnma(plane[q].crack[s], plane[q].m[s], plane[q].phi[s] - plane[q].bow[s]);
  };
  // as the families count it
  const auto strain_of = [&](int q, int s, N by_turn) {
    return q == 0 ? by_turn : by_turn * load<D>(flow, kStations + s * kStationFields + kRotationRatio);
  };
  const auto strained_by = [&](int s) {
    return length_of([&](int q) { return strain_of(q, s, beyond_cracks(q, s)); });
  };
  N elongation = zero, so_far[2];
  M turns[2] = {hn::FirstN(tag, 0), hn::FirstN(tag, 0)};
  const auto calc_elongation = [&] {
    N sum = zero;
    for (int s = 0; s < Hinges; ++s) {
      const N length = strained_by(s);
      M grows = hn::And(turns[s], hn::Gt(length.v, so_far[s].v));
      if (hn::AllFalse(tag, grows)) continue;
      N squares = zero, along = zero, bending = zero;
      for (int q = first; q <= last; ++q) {
        const int cell = kStations + s * kStationFields + kCell + q * kCellFields;
        const N turned = strain_of(q, s, beyond_cracks(q, s));
        const auto positive = hn::Ge(turned.v, zero.v);
        const auto lift_at = [&](int force) {
          return select(positive, load<D>(flow, cell + kCellLiftPositive + force),
                        load<D>(flow, cell + kCellLiftNegative + force));
        };
        const N lift = CellForce<D>(flow, cell, in_cells).mix(lift_at(0), lift_at(1), lift_at(2));
        const N square = turned * turned;
        squares = squares + square;
        along = fma(square, lift, along);
        bending = fma(plane[q].m[s], by[q][s], bending);
      }
      grows = hn::And(grows, hn::Ne(along.v, zero.v));
      if (hn::AllFalse(tag, grows)) continue;
      const N unbound = (length - so_far[s]) * along / squares;
      // the axial spring takes no more than bending brings
      const N brought =
          fnma(half, load<D>(flow, kStations + s * kStationFields + kShare), one) * N{hn::Max(zero.v, bending.v)};
      const N pull = N{hn::CopySign(one.v, unbound.v)} * fnma(k[0], sum, f[0]);
      const N root = {hn::Sqrt(fma(num<D>(2) * k[0], brought, pull * pull).v)};
      const N most = select(hn::Lt(pull.v, zero.v), num<D>(2) * brought / (root - pull),
                            (pull + root) / N{hn::Max(k[0].v, tiny.v)});
      const N bound = {hn::CopySign(hn::Min(abs(unbound).v, most.v), unbound.v)};
      sum = sum + select(grows, bound, zero);
    }
    return sum;
  };
  // share of the turn of a station that brings it to the limit under the force that is left
  const auto calc_share = [&](int s, M changes) {
    const N length = strained_by(s);
    M grows = hn::And(hn::And(changes, turns[s]), hn::Gt(length.v, so_far[s].v));
    grows = hn::And(grows, hn::AndNot(at[s].lost, hn::Gt(at[s].sum.v, one.v)));
    if (hn::AllFalse(tag, grows)) return one;
    const N sum = select(grows, at[s].sum, one);
    N slope = zero;  // of what the limit leaves of the moments with the force
    for (int q = first; q <= last; ++q) {
      const int cell = kStations + s * kStationFields + kCell + q * kCellFields;
      const CellForce<D> force(flow, cell, in_cells);
      const N r = (load<D>(flow, kStations + s * kStationFields + kStrained) - load<D>(flow, cell + kCellRotation)) *
                  load<D>(flow, cell + kCellRotation + 1);
      const auto positive = hn::Ge(m_trial[s][q].v, zero.v);
      N limit[3];  // at the cell's forces
      for (int i = 0; i < 3; ++i) {
        const int value = cell + 2 * i;
        const N low = select(positive, load<D>(flow, value + kCellPositive), load<D>(flow, value + kCellNegative));
        const N high =
            select(positive, load<D>(flow, value + 1 + kCellPositive), load<D>(flow, value + 1 + kCellNegative));
        limit[i] = fma(r, high - low, low);
      }
      const N here = force.mix(limit[0], limit[1], limit[2]) * pressing.share;
      const N ratio = abs(m_trial[s][q]) / N{hn::Max(here.v, tiny.v)};
      const N part = (is_plane ? ratio : ratio * N{hn::Sqrt(ratio.v)}) *
                     force.slope(flow, cell, limit[0], limit[1], limit[2]) / here;
      slope = slope + select(hn::Gt(here.v, zero.v), part, zero);
    }
    N left;
    if constexpr (is_plane)
      left = one / sum;
    else
      left = inverse_root<D>(sum);
    const N rise = zero - (left * k[0]) * (slope * elongation) / sum;
    grows = hn::And(grows, hn::Gt(rise.v, zero.v));
    const N trial = {
        hn::Max(so_far[s].v, length_of([&](int q) {
                               return strain_of(
                                   q, s, fnma(plane[q].crack[s], m_trial[s][q], phi_trial[q][s] - plane[q].bow[s]));
                             }).v)};
    const N ahead = (trial - so_far[s]) / (length - so_far[s]);  // by damage, before it turns
    const N over = one - left;
    const N part = fnma(rise, ahead, over) / fma(rise, one - ahead, over);
    return select(grows, N{hn::Max(zero.v, part.v)}, one);
  };
  if (!hn::AllFalse(tag, bends)) {
    for (int s = 0; s < Hinges; ++s) {
      // rotation up to which a station had gone in the step before, by plastic flow or on the flexibility of its damage
      const int station = kStations + s * kStationFields;
      const N before = length_of([&](int q) {
        const int shear = q == 0 ? 2 : 1, bend = q == 0 ? 4 : 5;
        const N m = fma(plane[q].lever[s], k[shear] * e_before[shear], k[bend] * e_before[bend]);
        return strain_of(
            q, s, fma(plane[q].soft[s] - plane[q].crack[s], m, load<D>(flow, station + kPhi + q) - plane[q].bow[s]));
      });
      so_far[s] = {hn::Max(load<D>(flow, station + kStrained).v, before.v)};
      turns[s] = hn::Ne(by[first][s].v, zero.v);
      if constexpr (!is_plane) turns[s] = hn::Or(turns[s], hn::Ne(by[1][s].v, zero.v));
      turns[s] = hn::And(good, turns[s]);
    }
    elongation = calc_elongation();
    const M changes = hn::Ne(elongation.v, zero.v);
    if (!hn::AllFalse(tag, changes)) {
      // that changes the normal force and with it the limits
      N share = calc_share(0, changes);
      if constexpr (Hinges == 2) share = {hn::Min(share.v, calc_share(1, changes).v)};
      for (int q = first; q <= last; ++q)
        for (int s = 0; s < Hinges; ++s) by[q][s] = share * by[q][s];
      apply_turns();
      elongation = calc_elongation();
    }
  }
  for (int q = first; q <= last; ++q) {
    f[q == 0 ? 2 : 1] = plane[q].shear();
    f[q == 0 ? 4 : 5] = plane[q].moment();
  }
  N reached[2], strained[2];
  for (int s = 0; s < Hinges; ++s) {
    reached[s] = load<D>(flow, kStations + s * kStationFields + kReached);
    strained[s] = load<D>(flow, kStations + s * kStationFields + kStrained);
    if (!hn::AllFalse(tag, turns[s])) {
      const N gone = length_of([&](int q) { return beyond_cracks(q, s); });
      reached[s] = select(turns[s], N{hn::Max(reached[s].v, gone.v)}, reached[s]);
      strained[s] = select(turns[s], N{hn::Max(strained[s].v, strained_by(s).v)}, strained[s]);
    }
    demand(hn::Lt(reached[s].v, load<D>(flow, kStations + s * kStationFields + kRupture).v));
  }
  // what is new of the inelastic rotation: a plastic part and added flexibility
  N plastic[2][2], soft[2][2];  // [plane][station]
  for (int q = first; q <= last; ++q)
    for (int s = 0; s < Hinges; ++s) {
      const BendingPlane<D, Hinges>& P = plane[q];
      const int station = kStations + s * kStationFields;
      const N m = P.m[s], share = load<D>(flow, station + kShare);
      const N added = fnma(P.soft[s], m, P.phi[s] - load<D>(flow, station + kPhi + q));
      const M damages = hn::And(bends, hn::And(hn::Gt(share.v, zero.v), hn::Gt((added * m).v, zero.v)));
      const N most = P.crack[s] + share * abs(beyond_cracks(q, s)) / abs(m);
      const N top = {hn::Min(most.v, (num<D>(kMostDamage) / P.stiffness[s]).v)};
      const N grown = fma(share, added / m, P.soft[s]);
      soft[q][s] = select(damages, N{hn::Max(P.soft[s].v, hn::Min(top.v, grown.v))}, P.soft[s]);
      plastic[q][s] = fnma(soft[q][s], m, P.phi[s]);
    }

  // what it shortens by turning need not be crushed
  const N back = minimum(pressing.shortening, maximum(zero, zero - elongation)), longer = elongation + back;
  f[0] = fnma(k[0], longer, f[0]);

  // shear
  const N pressed = load<D>(flow, kShearFriction) * N{hn::Max(zero.v, (zero - f[0]).v)};
  N slipped = load<D>(flow, kSlipped);
  const N left = {hn::Max(zero.v, fnma(slipped, load<D>(flow, kSlipSoftening), one).v)};
  N over2 = zero;
  for (int q = first; q <= last; ++q) {
    const N v = f[2 - q] / N{hn::Max(fma(load<D>(flow, kShearOwn + 1 - q), left, pressed).v, tiny.v)};
    over2 = fma(v, v, over2);
  }
  const M slides = hn::And(good, hn::Gt(over2.v, one.v));
  N slid[2] = {zero, zero};
  if (!hn::AllFalse(tag, slides)) {
    const N holds = select(slides, one / N{hn::Sqrt(over2.v)}, one);
    N way2 = zero;
    for (int q = first; q <= last; ++q) {
      const int a = 1 - q;
      const N held = f[1 + a] * holds;
      slid[a] = select(slides, (f[1 + a] - held) * load<D>(flow, kFlexibility + 1 + a), zero);
      f[1 + a] = held;
      way2 = fma(slid[a], slid[a], way2);
    }
    slipped = select(slides, slipped + N{hn::Sqrt(way2.v)}, slipped);
    demand(hn::Lt(slipped.v, load<D>(flow, kSlipRupture).v));
    for (int q = first; q <= last; ++q)
      for (int s = 0; s < Hinges; ++s)
        plane[q].m[s] = select(slides, fma(plane[q].lever[s], f[q == 0 ? 2 : 1], f[q == 0 ? 4 : 5]), plane[q].m[s]);
  }
  // torsion
  N twisted = zero, over = zero;
  flowed = hn::Or(hn::Or(bends, slides), hn::Or(pressing.flows, cracks));
  if constexpr (!is_plane) {
    const N torsion = load<D>(flow, kTorsion);
    const M twists = hn::And(good, hn::Gt(abs(f[3]).v, torsion.v));
    twisted = load<D>(flow, kTwisted);
    if (!hn::AllFalse(tag, twists)) {
      const N held = {hn::CopySign(torsion.v, f[3].v)};
      over = select(twists, (f[3] - held) * load<D>(flow, kFlexibility + 3), zero);
      f[3] = select(twists, held, f[3]);
      twisted = twisted + abs(over);
      demand(hn::Lt(twisted.v, load<D>(flow, kTwistRupture).v));
    }
    flowed = hn::Or(flowed, twists);
  }

  // near its limits a zone would be sent back at once
  const N near_from = num<D>(is_plane ? kNearPlane : kNear);
  const M near = hn::Or(hn::Ge(at[0].sum.v, near_from.v), hn::Ge(at[1].sum.v, near_from.v));
  const N idle = select(hn::Or(flowed, near), zero, load<D>(flow, kIdle) + one);
  demand(hn::Lt(idle.v, hn::Set(tag, kLongestIdle)));
  flowed = hn::And(good, flowed);
  const M turned = hn::And(good, bends);
  N stored = zero;
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    stored = fma(f[i] * load<D>(flow, kFlexibility + i), f[i], stored);
  }
  for (int q = first; q <= last; ++q)
    for (int s = 0; s < Hinges; ++s) {
      const int station = kStations + s * kStationFields;
      store_where<D>(turned, soft[q][s], flow, station + kSoftness + q);
      store_where<D>(turned, plastic[q][s], flow, station + kPhi + q);
      stored = fma(soft[q][s] * plane[q].m[s], plane[q].m[s], stored);
    }
  stored = half * stored;
  N work = zero;
  for (int c = 0; c < active.count; ++c) {
    const int i = active.at[c];
    work = fma(fma(k[i], e_before[i], f[i]), d[i] - load<D>(flow, kBefore + i), work);
    store_where<D>(good, d[i], flow, kBefore + i);
  }
  const N lost = fms(half, work, stored - load<D>(flow, kStored));
  // nothing in an elastic step, unless the zone was lengthened from outside before it
  store_where<D>(good, load<D>(flow, kPlastic) + lost, flow, kPlastic);
  const N crushed = pressing.shortening - back;
  store_where<D>(flowed, load<D>(flow, kAxial) + (longer - pressing.shortening + pressing.unfolding), flow, kAxial);
  store_where<D>(flowed, load<D>(flow, kLifted) + elongation, flow, kLifted);
  store_where<D>(flowed, load<D>(flow, kShortened) + (crushed - pressing.unfolding), flow, kShortened);
  store_where<D>(good, crushed, flow, kCrushed);
  for (int a = 1 - last; a <= 1 - first; ++a) store_where<D>(flowed, slip[a] + slid[a], flow, kSlip + a);
  store_where<D>(flowed, slipped, flow, kSlipped);
  if constexpr (!is_plane) {
    store_where<D>(flowed, twist + over, flow, kTwist);
    store_where<D>(flowed, twisted, flow, kTwisted);
  }
  store_where<D>(good, stored, flow, kStored);
  store_where<D>(good, idle, flow, kIdle);
  for (int s = 0; s < Hinges; ++s) {
    const int station = kStations + s * kStationFields;
    store_where<D>(good, reached[s], flow, station + kReached);
    store_where<D>(good, strained[s], flow, station + kStrained);
  }
  return good;
}

/// What the damper of a zone that flows sees of a change of its elastic deformation: not more than the deformation
/// itself changes, and nothing the other way (zones.md, eq. 11a).
template <class D>
HWY_INLINE Num<D> drive_damper(Num<D> stretched, Num<D> way) {
  const Num<D> zero = num<D>(0);
  return minimum(maximum(stretched, minimum(way, zero)), maximum(way, zero));
}

/// Forces of one block of elements (docs/theory/zones.md, eq. 1 to 12, and multibody.md, eq. 4).
template <class D, Plane In, int Hinges>
HWY_INLINE void evaluate_element_block(const ElementJob& job, size_t block, const Poses<D>& A, const Poses<D>& B) {
  using N = Num<D>;
  constexpr bool is_plane = In != Plane::Space;
  constexpr ActiveComponents active = components_of(In);
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

  const N one = num<D>(1), zero = num<D>(0), half = num<D>(0.5);
  constexpr bool is_member = Hinges == 2;
  const N x[2] = {constant(kStation), constant(kStation + 1)};
  N d[6];
  V3<D> lever_a, lever_b, r;
  M33<D> axes;     // F, of a member those of its chord
  N sine, cosine;  // of their turn in the plane
  N s2, over_sine, coefficient;
  // a member: x of the stations on a and on b, the chord in the axes of a, the turn from there to the chord
  N x_a, x_b, over_length, chord_x, chord_y, chord_z, swing_w, swing_y, swing_z, s2_a, over_sine_a, coefficient_a;
  const auto measure_chord = [&](V3<D> chord) {
    x_a = minimum(x[0], x[1]), x_b = maximum(x[0], x[1]);
    // an empty lane has none
    over_length = one / N{hn::Sqrt(maximum(dot(chord, chord), num<D>(1e-60)).v)};
    chord_x = over_length * chord.x, chord_y = over_length * chord.y, chord_z = over_length * chord.z;
    const N twice = maximum(chord_x + one, num<D>(1e-30)), w = N{hn::Sqrt((half * twice).v)};
    const N share = half / w;
    swing_w = w, swing_y = zero - share * chord_z, swing_z = share * chord_y;
    s2_a = fma(swing_y, swing_y, swing_z * swing_z);
    turning<D>(s2_a, over_sine_a, coefficient_a);
    d[0] = fms(over_length, dot(chord, chord), x_b - x_a);
  };
  if constexpr (is_plane) {
    const PlanarMarker<D> at_a(A, constant, kMarkerA), at_b(B, constant, kMarkerB);
    PlanarTurn<D> turned = at_a.turn;
    const N apart_x = at_b.px - at_a.px, apart_z = at_b.pz - at_a.pz;
    const N along_x = (apart_x - at_a.lever_x) + at_b.lever_x, along_z = (apart_z - at_a.lever_z) + at_b.lever_z;
    lever_a = {at_a.lever_x, zero, at_a.lever_z};
    lever_b = {at_b.lever_x, zero, at_b.lever_z};
    sine = turned.sine(), cosine = turned.cosine();
    const N along = fms(cosine, along_x, sine * along_z), across = fma(cosine, along_z, sine * along_x);
    if constexpr (is_member) {
      measure_chord({along, zero, across});
      turned = turned.then({swing_w, swing_y});
      sine = turned.sine(), cosine = turned.cosine();
    } else {
      lever_a = {apart_x + at_b.lever_x, zero, apart_z + at_b.lever_z};
    }
    const PlanarTurn<D> apart_by = turned.back().then(at_b.turn);
    const N v = {hn::CopySign(apart_by.y.v, hn::Xor(apart_by.y.v, apart_by.w.v))};
    s2 = v * v;
    turning<D>(s2, over_sine, coefficient);
    N moved = across, rotation = over_sine * v;
    if constexpr (is_member) {
      const N turn_a = over_sine_a * swing_y;
      moved = fma(x_a, turn_a, x_b * rotation);
      rotation = turn_a + rotation;
    } else {
      d[0] = along;
    }
    d[active.at[1]] = In == Plane::AboutY ? moved : zero - moved;
    d[active.at[2]] = rotation;
  } else {
    lever_a = turn(A.q, constant3(kMarkerA));
    lever_b = turn(B.q, constant3(kMarkerB));
    Q4<D> qF = A.q * constant4(kMarkerA + 3);
    const Q4<D> qM = B.q * constant4(kMarkerB + 3);
    const V3<D> apart = B.p - A.p, between = (apart - lever_a) + lever_b;
    if constexpr (is_member) {
      measure_chord(turn(Q4<D>{qF.w, zero - qF.x, zero - qF.y, zero - qF.z}, between));
      qF = qF * Q4<D>{swing_w, zero, swing_y, swing_z};
    } else {
      lever_a = apart + lever_b;
    }
    axes = to_matrix(qF);
    const Q4<D> q = conj_times(qF, qM);
    const V3<D> v{{hn::CopySign(q.x.v, hn::Xor(q.x.v, q.w.v))},
                  {hn::CopySign(q.y.v, hn::Xor(q.y.v, q.w.v))},
                  {hn::CopySign(q.z.v, hn::Xor(q.z.v, q.w.v))}};
    s2 = dot(v, v);
    turning<D>(s2, over_sine, coefficient);
    r = over_sine * v;
    if constexpr (is_member) {
      const N turn_y = over_sine_a * swing_y, turn_z = over_sine_a * swing_z;
      d[1] = zero - fma(x_a, turn_z, x_b * r.z), d[2] = fma(x_a, turn_y, x_b * r.y);
      d[3] = r.x, d[4] = turn_y + r.y, d[5] = turn_z + r.z;
    } else {
      const V3<D> t = transpose_times(axes, between);
      d[0] = t.x, d[1] = t.y, d[2] = t.z, d[3] = r.x, d[4] = r.y, d[5] = r.z;
    }
  }
  auto too_far = hn::Gt(s2.v, constant(kMostTurn).v);
  if constexpr (is_member) too_far = hn::Or(too_far, hn::Gt(s2_a.v, constant(kMostTurn).v));
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
  const auto cracks_grow = [&](int station, int axis, N moment) {
    const int scale = kCrackScale + 4 * station + 2 * axis;
    return find_growth<D>(moment, constant(scale), constant(scale + 1));
  };
  // is every resultant inside the bounds for sure?
  outside = hn::Or(outside,
                   hn::Not(hn::And(hn::Ge(f[0].v, constant(kLeastForce).v), hn::Le(f[0].v, constant(kMostForce).v))));
  if constexpr (is_plane) {
    constexpr int q = first_bending(In), shear = active.at[1], bend = active.at[2];
    outside = hn::Or(outside, hn::Gt((abs(f[shear]) * constant(kShearScale + shear - 1)).v, one.v));
    const N scale = constant(kMomentScale + q);
    for (int station = 0; station < Hinges; ++station) {
      const N m = q == 0 ? fma(x[station], f[shear], f[bend]) : fnma(x[station], f[shear], f[bend]);
      outside = hn::Or(outside, hn::Or(hn::Gt((abs(m) * scale).v, one.v), cracks_grow(station, q, m)));
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
      outside = hn::Or(outside, hn::Or(cracks_grow(station, 0, about_y), cracks_grow(station, 1, about_z)));
      const N my = abs(about_y) * scale_y, mz = abs(about_z) * scale_z;
      const auto linear = hn::Gt((my + mz).v, one.v);
      if (HWY_LIKELY(hn::AllFalse(tag, linear))) continue;
      const auto is_square = hn::Ge(exponent.v, hn::Set(tag, 2.0)),
                 is_three_halves = hn::Ge(exponent.v, hn::Set(tag, 1.5));
      const auto raised = [&](N m) -> N {
        return select(is_square, m * m, select(is_three_halves, m * N{hn::Sqrt(m.v)}, m));
      };
      outside = hn::Or(outside, hn::Gt((raised(my) + raised(mz)).v, one.v));
    }
  }
  // what the damper does on the part of the deformation that is not elastic
  N slid[6] = {zero, zero, zero, zero, zero, zero};
  const auto slide = [&] {
    for (int c = 0; c < active.count; ++c) {
      const int i = active.at[c];
      slid[i] = (u[i] - was[i]) - (e[i] - before[i]);
    }
  };
  bool books_slid = softened;
  if (HWY_UNLIKELY(!hn::AllFalse(tag, outside))) {
    auto flows = hn::AndNot(too_far, hn::And(outside, hn::Gt(constant(kFlows).v, zero.v)));
    if (softened) slide();
    Pressing<D> pressing;
    if (!hn::AllFalse(tag, flows)) flows = enter_cells<D, In, Hinges>(job, block, flows, k[0], d[0], pressing);
    if (!hn::AllFalse(tag, flows)) {
      const double* flow = job.flows + static_cast<size_t>(kFlowFields) * W * block;
      N f_flow[6], d_before[6];
      for (int c = 0; c < active.count; ++c) d_before[active.at[c]] = load<D>(flow, kBefore + active.at[c]);
      auto flowed = flows;
      const auto good = flow_zone<D, In, Hinges>(job, block, flows, pressing, x, k, d, was, f_flow, flowed);
      for (int c = 0; c < active.count; ++c) {
        const int i = active.at[c];
        f[i] = select(good, f_flow[i], f[i]);
        const N stretch = f_flow[i] * load<D>(flow, kFlexibility + i);
        e[i] = select(good, stretch, e[i]);
        u[i] = select(good, stretch, u[i]);
        const N way = d[i] - d_before[i], stretched = stretch - was[i];
        const N driven = select(flowed, drive_damper(stretched, way), stretched);
        before[i] = select(good, select(flowed, stretch - driven, was[i]), before[i]);
        slid[i] = select(good, way - driven, slid[i]);
      }
      books_slid = true;
      outside = hn::AndNot(good, outside);
    }
  } else if (softened) {
    slide();
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
  if (books_slid) store_where<D>(inside, fma(half, lost, load<D>(state, kBled)), state, kBled);

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
    V3<D> m{g[3], g[4], g[5]}, shear{g[0], g[1], g[2]}, torque_a;
    if constexpr (is_member) m.y = fma(x_b, g[2], m.y), m.z = fnma(x_b, g[1], m.z);
    const V3<D> rm = cross(r, m);
    V3<D> torque_b = fma(coefficient, cross(r, rm), fma(half, rm, m));
    if constexpr (is_member) {
      const N turn_y = over_sine_a * swing_y, turn_z = over_sine_a * swing_z;
      const N m_y = fma(x_a, g[2], g[4]), m_z = fnma(x_a, g[1], g[5]);
      const N twist = fms(turn_y, m_z, turn_z * m_y), bent = coefficient_a * twist;
      const V3<D> seen{zero - half * twist, fma(bent, turn_z, m_y), fnma(bent, turn_y, m_z)};
      const N handed = (seen.x - torque_b.x) / maximum(one + chord_x, num<D>(1e-30));
      torque_a = {torque_b.x, fma(handed, chord_y, seen.y), fma(handed, chord_z, seen.z)};
      shear.y = over_length * (torque_a.z - torque_b.z), shear.z = over_length * (torque_b.y - torque_a.y);
      torque_a = axes * torque_a, torque_b = axes * torque_b;
    } else {
      torque_a = torque_b = axes * torque_b;
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
HWY_INLINE void evaluate_block_of(const ElementJob& job, size_t block, const Poses<D>& a, const Poses<D>& b) {
  const bool is_single = job.single[block] != 0;
  switch (job.planes[block]) {
    case Plane::Space:
      return is_single ? evaluate_element_block<D, Plane::Space, 1>(job, block, a, b)
                       : evaluate_element_block<D, Plane::Space, 2>(job, block, a, b);
    case Plane::AboutY:
      return is_single ? evaluate_element_block<D, Plane::AboutY, 1>(job, block, a, b)
                       : evaluate_element_block<D, Plane::AboutY, 2>(job, block, a, b);
    case Plane::AboutZ:
      return is_single ? evaluate_element_block<D, Plane::AboutZ, 1>(job, block, a, b)
                       : evaluate_element_block<D, Plane::AboutZ, 2>(job, block, a, b);
  }
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
      evaluate_block_of<D>(job, next, read_poses<D>(job.poses, job.a + next * W),
                           read_poses<D>(job.poses, job.b + next * W));
  } else {
    for (; next < job.last; next = find_next(next + 1)) {
      const size_t a = job.body_a[next], b = job.body_b[next];
      evaluate_block_of<D>(job, next, {load3<D>(job.p + 3 * W * a, 0), load4<D>(job.q + 4 * W * a, 0)},
                           {load3<D>(job.p + 3 * W * b, 0), load4<D>(job.q + 4 * W * b, 0)});
    }
  }
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
