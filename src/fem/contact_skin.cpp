// Compiled once for each instruction set (Highway's foreach_target).
#include "fem/contact_skin.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "fem/explicit_kernel.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "fem/contact_skin.cpp"
// one wide target for each family of machines keeps the build short
#define HWY_DISABLED_TARGETS (HWY_SSSE3 | HWY_SSE4 | HWY_AVX3_DL)
#include <hwy/foreach_target.h>
// after foreach_target
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace topple::fem::lanes {
namespace HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;
using D = hn::CappedTag<double, kFaceRun>;
using V = hn::Vec<D>;
constexpr size_t kLanes = hn::MaxLanes(D());

/// Fields of a face, see SkinFace.
enum Field : size_t { kCentre = 0, kNormal = 3, kAlong = 6, kAcross = 9, kWide = 12, kHigh, kDepth, kUneven, kFields };
static_assert(kFields == kSkinFields);

#include "fem/contact_vectors.inc"

HWY_INLINE V per_length(const V3& a) { return hn::Div(num(1), hn::Max(hn::Sqrt(dot(a, a)), num(1e-300))); }
HWY_INLINE V3 smaller(const V3& a, const V3& b) { return {hn::Min(a.x, b.x), hn::Min(a.y, b.y), hn::Min(a.z, b.z)}; }
HWY_INLINE V3 larger(const V3& a, const V3& b) { return {hn::Max(a.x, b.x), hn::Max(a.y, b.y), hn::Max(a.z, b.z)}; }
HWY_INLINE Vec3 least_of(const V3& a) {
  const D d;
  return {hn::GetLane(hn::MinOfLanes(d, a.x)), hn::GetLane(hn::MinOfLanes(d, a.y)),
          hn::GetLane(hn::MinOfLanes(d, a.z))};
}
HWY_INLINE Vec3 most_of(const V3& a) {
  const D d;
  return {hn::GetLane(hn::MaxOfLanes(d, a.x)), hn::GetLane(hn::MaxOfLanes(d, a.y)),
          hn::GetLane(hn::MaxOfLanes(d, a.z))};
}

HWY_INLINE V3 load_corner(const double* HWY_RESTRICT rows, const std::uint32_t* HWY_RESTRICT row) {
  const Four place = load_four([&](size_t l) HWY_ATTR { return rows + kernel::kNodeFields * size_t{row[l]}; });
  return {place.a, place.b, place.c};
}

void make_skin(const double* HWY_RESTRICT rows, double depth_share, const FaceCorners& corners, size_t count,
               Skin& skin) {
  constexpr double kEdge = 1.01;  // what counts as on a face, and what it stretches until the next look
  const D d;
  const size_t runs = (count + kFaceRun - 1) / kFaceRun;
  skin.count = count;
  skin.faces.resize(runs * kFields * kFaceRun);
  skin.boxes.assign((runs + 7) / 8 * 6 * 8, 1e300);  // nothing is in the boxes of no run
  const V quarter = num(0.25);
  V3 all_low{num(1e300), num(1e300), num(1e300)}, all_high{num(-1e300), num(-1e300), num(-1e300)};
  for (size_t run = 0; run < runs; ++run) {
    V3 low{num(1e300), num(1e300), num(1e300)}, high{num(-1e300), num(-1e300), num(-1e300)};
    for (size_t l = 0; l < kFaceRun; l += kLanes) {
      V3 x[8];
      for (size_t k = 0; k < 8; ++k) x[k] = load_corner(rows, corners[k].data() + run * kFaceRun + l);
      const V3 centre = scale(quarter, add(add(add(x[0], x[1]), x[2]), x[3]));
      const V3 far = scale(quarter, add(add(add(x[4], x[5]), x[6]), x[7]));
      const V3 n = cross(sub(x[2], x[0]), sub(x[3], x[1]));
      const V3 normal = scale(per_length(n), n);
      const V3 a = scale(quarter, sub(sub(add(x[1], x[2]), x[0]), x[3]));
      const V3 b = scale(quarter, sub(sub(add(x[2], x[3]), x[0]), x[1]));
      const V3 c = scale(quarter, sub(sub(add(x[0], x[2]), x[1]), x[3]));
      // normal to the other edge of the parallelogram of the middle, which is as wide as a reaches along it
      const V3 to_xi = cross(b, normal), to_eta = cross(normal, a);
      const V3 along = scale(per_length(to_xi), to_xi), across = scale(per_length(to_eta), to_eta);
      const V wide = add(mul(num(kEdge), hn::Abs(dot(a, along))), hn::Abs(dot(c, along)));
      const V tall = add(mul(num(kEdge), hn::Abs(dot(b, across))), hn::Abs(dot(c, across)));
      const V depth = mul(num(depth_share), hn::Max(num(0), dot(normal, sub(centre, far))));
      const V uneven = hn::Abs(dot(normal, sub(x[0], centre)));
      const V3 behind = scale(depth, normal);
      for (size_t k = 0; k < 4; ++k) {
        const V3 inside = sub(x[k], behind);
        all_low = smaller(all_low, x[k]), all_high = larger(all_high, x[k]);
        low = smaller(low, smaller(x[k], inside)), high = larger(high, larger(x[k], inside));
      }
      double* HWY_RESTRICT to = skin.faces.data() + run * kFields * kFaceRun + l;
      const V fields[kFields] = {centre.x, centre.y, centre.z, normal.x, normal.y, normal.z, along.x, along.y,
                                 along.z,  across.x, across.y, across.z, wide,     tall,     depth,   uneven};
      for (size_t f = 0; f < kFields; ++f) hn::Store(fields[f], d, to + f * kFaceRun);
    }
    const Vec3 from = least_of(low), until = most_of(high);
    double* box = skin.boxes.data() + run / 8 * 6 * 8 + run % 8;
    for (size_t i = 0; i < 3; ++i)
      box[8 * i] = from[static_cast<int>(i)], box[8 * (3 + i)] = until[static_cast<int>(i)];
  }
  if (runs > 0) skin.box.low = least_of(all_low), skin.box.high = most_of(all_high);
}

/// Sums of a run's lanes, in the order of its numbers with every instruction set.
template <size_t N>
struct RunSums {
  static constexpr size_t kParts = kFaceRun / kLanes;
  V sums[N][kParts];
  HWY_INLINE RunSums() {
    for (auto& parts : sums)
      for (V& part : parts) part = num(0);
  }
  HWY_INLINE void add_to(size_t n, size_t l, V x) { sums[n][l / kLanes] = add(sums[n][l / kLanes], x); }
  HWY_INLINE double total(size_t n) const {
    HWY_ALIGN double all[kFaceRun];
    for (size_t i = 0; i < kParts; ++i) hn::Store(sums[n][i], D(), all + i * kLanes);
    double sum = 0;
    for (const double x : all) sum += x;
    return sum;
  }
  HWY_INLINE Vec3 vector(size_t n) const { return {total(n), total(n + 1), total(n + 2)}; }
};

GroupMotion measure_motion(const double* HWY_RESTRICT rows, std::span<const std::uint32_t> nodes, ContactBox& box) {
  const D d;
  const auto row_of = [&](size_t i) HWY_ATTR { return rows + kernel::kNodeFields * size_t{nodes[i]}; };
  size_t first = 0;
  while (first < nodes.size() && !(row_of(first)[kernel::kNodeMass] > 0)) ++first;
  box = {};
  GroupMotion motion;
  if (first == nodes.size()) return motion;
  const auto vector_of = [](const double* at) { return Vec3{at[0], at[1], at[2]}; };
  const Vec3 from = vector_of(row_of(first)), speed_from = vector_of(row_of(first) + kernel::kSpeed);
  const V3 p0{num(from.x), num(from.y), num(from.z)}, v0{num(speed_from.x), num(speed_from.y), num(speed_from.z)};
  // calls body(l, p, v, 1) for lanes l, l + 1, ... of all runs; in place of what has no mass the first node, and 0
  const auto for_nodes = [&](const auto& body) HWY_ATTR {
    for (size_t run = first; run < nodes.size(); run += kFaceRun)
      for (size_t l = 0; l < kFaceRun; l += kLanes) {
        const auto at = [&](size_t lane) HWY_ATTR { return row_of(std::min(run + l + lane, nodes.size() - 1)); };
        const Four place = load_four(at), rest = load_four([&](size_t lane) HWY_ATTR { return at(lane) + 4; });
        const V number = hn::Iota(d, static_cast<double>(run + l));
        const auto counts = hn::And(hn::Gt(rest.d, num(0)), hn::Lt(number, num(static_cast<double>(nodes.size()))));
        const V3 p{hn::IfThenElse(counts, place.a, p0.x), hn::IfThenElse(counts, place.b, p0.y),
                   hn::IfThenElse(counts, place.c, p0.z)};
        const V3 v{hn::IfThenElse(counts, place.d, v0.x), hn::IfThenElse(counts, rest.a, v0.y),
                   hn::IfThenElse(counts, rest.b, v0.z)};
        body(l, p, v, hn::IfThenElseZero(counts, num(1)));
      }
  };
  // against the first node, which adds nothing to sums
  RunSums<16> sums;
  V3 low = p0, high = p0;
  for_nodes([&](size_t l, const V3& p, const V3& v, V count) HWY_ATTR {
    low = smaller(low, p), high = larger(high, p);
    const V3 r = sub(p, p0), u = sub(v, v0), spin = cross(r, u);
    const V terms[] = {r.x,           r.y,           r.z,           u.x,           u.y,           u.z,
                       spin.x,        spin.y,        spin.z,        mul(r.x, r.x), mul(r.y, r.y), mul(r.z, r.z),
                       mul(r.x, r.y), mul(r.y, r.z), mul(r.z, r.x), count};
    for (size_t n = 0; n < 16; ++n) sums.add_to(n, l, terms[n]);
  });
  box.low = least_of(low), box.high = most_of(high);
  const double count = sums.total(15);
  const Vec3 r = (1 / count) * sums.vector(0), u = (1 / count) * sums.vector(3);
  motion.place = from + r, motion.speed = speed_from + u;
  // about the mean
  const Vec3 spin = sums.vector(6) - count * cross(r, u);
  const double xx = sums.total(9) - count * r.x * r.x, yy = sums.total(10) - count * r.y * r.y,
               zz = sums.total(11) - count * r.z * r.z, xy = sums.total(12) - count * r.x * r.y,
               yz = sums.total(13) - count * r.y * r.z, zx = sums.total(14) - count * r.z * r.x;
  const Mat3 inertia{{{yy + zz, -xy, -zx}, {-xy, zz + xx, -yz}, {-zx, -yz, xx + yy}}};
  const double size = xx + yy + zz;
  // nodes on a line may turn about it as they like
  if (determinant(inertia) > 1e-6 * size * size * size) motion.turning = inverse(inertia) * spin;
  const auto wide = [](const Vec3& a) HWY_ATTR { return V3{num(a.x), num(a.y), num(a.z)}; };
  const V3 middle = wide(motion.place), speed = wide(motion.speed), turning = wide(motion.turning);
  V spread = num(0), reach = num(0), most = num(0);
  for_nodes([&](size_t /*l*/, const V3& p, const V3& v, V /*count*/) HWY_ATTR {
    const V3 arm = sub(p, middle), off = sub(sub(v, speed), cross(turning, arm));
    spread = hn::Max(spread, dot(off, off)), reach = hn::Max(reach, dot(arm, arm)), most = hn::Max(most, dot(v, v));
  });
  motion.spread = std::sqrt(hn::GetLane(hn::MaxOfLanes(d, spread)));
  motion.reach = std::sqrt(hn::GetLane(hn::MaxOfLanes(d, reach)));
  motion.most = std::sqrt(hn::GetLane(hn::MaxOfLanes(d, most)));
  return motion;
}

template <class Mask>
HWY_INLINE unsigned bits_of(Mask mask) {
  std::uint8_t bits[8] = {};
  hn::StoreMaskBits(D(), mask, bits);
  return bits[0];
}
/// The lowest of some bits.
HWY_INLINE std::uint32_t first_of(unsigned bits) { return static_cast<std::uint32_t>(std::countr_zero(bits)); }
/// Bits of numbers in lanes of a whole run.
template <class Test>
HWY_INLINE unsigned test_run(const Test& test) {
  unsigned bits = 0;
  for (size_t l = 0; l < kFaceRun; l += kLanes) bits |= bits_of(test(l)) << l;
  return bits;
}

void find_points(const Places& places, const ContactBox& box, double near, std::vector<std::uint32_t>& found) {
  const D d;
  V low[3], high[3];
  for (int c = 0; c < 3; ++c) low[c] = num(box.low[c] - near), high[c] = num(box.high[c] + near);
  for (size_t run = 0; run < places.runs.size() / (3 * kFaceRun); ++run) {
    const double* HWY_RESTRICT from = places.runs.data() + run * 3 * kFaceRun;
    unsigned inside = test_run([&](size_t l) HWY_ATTR {
      const auto is_in = [&](size_t c) HWY_ATTR {
        const V x = hn::Load(d, from + c * kFaceRun + l);
        return hn::And(hn::Ge(x, low[c]), hn::Le(x, high[c]));
      };
      return hn::And(hn::And(is_in(0), is_in(1)), is_in(2));
    });
    for (; inside != 0; inside &= inside - 1)
      found.push_back(static_cast<std::uint32_t>(run * kFaceRun) + first_of(inside));
  }
}

/// Bits of a run's faces for which the test holds, of heights and distances beside them.
template <class Test>
HWY_INLINE unsigned test_faces(const Skin& skin, size_t run, const V3& at, const Test& test) {
  const D d;
  const double* HWY_RESTRICT from = skin.faces.data() + run * kFields * kFaceRun;
  unsigned faces = test_run([&](size_t l) HWY_ATTR {
    const auto field = [&](size_t f) HWY_ATTR { return hn::Load(d, from + f * kFaceRun + l); };
    const auto vector = [&](size_t f) HWY_ATTR { return V3{field(f), field(f + 1), field(f + 2)}; };
    const V3 r = sub(at, vector(kCentre));
    const V beside = hn::Max(sub(hn::Abs(dot(r, vector(kAlong))), field(kWide)),
                             sub(hn::Abs(dot(r, vector(kAcross))), field(kHigh)));
    return test(dot(r, vector(kNormal)), beside, field(kDepth), field(kUneven));
  });
  if (run == skin.count / kFaceRun) faces &= (1U << skin.count % kFaceRun) - 1;  // the last one, filled up
  return faces;
}

void find_faces(const Skin& skin, const Vec3& p, double near_by, double margin, std::vector<std::uint32_t>& found) {
  const D d;
  const V near = num(near_by), behind = num(-margin);
  const V3 at{num(p.x), num(p.y), num(p.z)};
  const V3 low = add(at, V3{near, near, near}), high = sub(at, V3{near, near, near});
  for (size_t eight = 0; eight < skin.boxes.size() / (size_t{6} * 8); ++eight) {
    const double* HWY_RESTRICT box = skin.boxes.data() + eight * 6 * 8;
    unsigned runs = test_run([&](size_t l) HWY_ATTR {
      const auto is_in = [&](size_t i, V above, V below) HWY_ATTR {
        return hn::And(hn::Le(hn::Load(d, box + 8 * i + l), above), hn::Ge(hn::Load(d, box + 8 * (3 + i) + l), below));
      };
      return hn::And(hn::And(is_in(0, low.x, high.x), is_in(1, low.y, high.y)), is_in(2, low.z, high.z));
    });
    for (; runs != 0; runs &= runs - 1) {
      const size_t run = 8 * eight + first_of(runs);
      unsigned faces = test_faces(skin, run, at, [&](V height, V beside, V depth, V /*uneven*/) HWY_ATTR {
        return hn::And(hn::And(hn::Le(height, near), hn::Ge(height, sub(behind, depth))), hn::Le(beside, near));
      });
      const auto first = static_cast<std::uint32_t>(run * kFaceRun);
      for (; faces != 0; faces &= faces - 1) found.push_back(first + first_of(faces));
    }
  }
}

void find_near_faces(const Skin& skin, size_t run, const Particle* particles, std::span<const std::uint32_t> balls,
                     const Ahead& ahead, std::vector<std::array<std::uint32_t, 2>>& found) {
  for (const std::uint32_t number : balls) {
    const Particle& ball = particles[number];
    const V zero = num(0), radius = num(ball.radius), path = num(ahead.calc_path(ball.p, ball.v));
    // as calc_gap
    unsigned faces = test_faces(
        skin, run, {num(ball.p.x), num(ball.p.y), num(ball.p.z)}, [&](V height, V side, V depth, V uneven) HWY_ATTR {
          const V beside = hn::Max(zero, side), above = hn::Max(zero, sub(height, uneven));
          const V lower = hn::Neg(add(height, uneven));
          const V gap = hn::Max(lower, sub(hn::Sqrt(add(mul(above, above), mul(beside, beside))), radius));
          const V below = hn::Max(beside, sub(lower, depth));
          const auto is_below = hn::And(hn::Gt(lower, zero), hn::Lt(below, lower));
          return hn::Lt(hn::IfThenElse(is_below, below, gap), path);
        });
    for (; faces != 0; faces &= faces - 1)
      found.push_back({number, static_cast<std::uint32_t>(run * kFaceRun) + first_of(faces)});
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace topple::fem::lanes
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace topple::fem::lanes {

HWY_EXPORT(make_skin);
HWY_EXPORT(measure_motion);
HWY_EXPORT(find_faces);
HWY_EXPORT(find_near_faces);
HWY_EXPORT(find_points);

void fill_runs(FaceCorners& corners) {
  for (auto& rows : corners)
    while (rows.size() % kFaceRun != 0) rows.push_back(rows.back());
}
void make_skin(const double* rows, double depth, const FaceCorners& corners, size_t count, Skin& skin) {
  skin.box = {};
  HWY_DYNAMIC_DISPATCH(make_skin)(rows, depth, corners, count, skin);
}
GroupMotion measure_motion(const double* rows, std::span<const std::uint32_t> nodes, ContactBox& box) {
  return HWY_DYNAMIC_DISPATCH(measure_motion)(rows, nodes, box);
}
void find_faces(const Skin& skin, const Vec3& p, double near, double margin, std::vector<std::uint32_t>& found) {
  found.clear();
  HWY_DYNAMIC_DISPATCH(find_faces)(skin, p, near, margin, found);
}
void find_near_faces(const Skin& skin, size_t run, const Particle* particles, std::span<const std::uint32_t> balls,
                     const Ahead& ahead, std::vector<std::array<std::uint32_t, 2>>& found) {
  if (!balls.empty()) HWY_DYNAMIC_DISPATCH(find_near_faces)(skin, run, particles, balls, ahead, found);
}
double calc_gap(const SkinFace& face, const Vec3& p, double radius) {
  const Vec3 d = p - face.centre;
  const double height = dot(d, face.normal);
  const double beside =
      std::max({0.0, std::abs(dot(d, face.along)) - face.wide, std::abs(dot(d, face.across)) - face.high});
  const double above = std::max(0.0, height - face.uneven), lower = -(height + face.uneven);
  if (lower > 0) {
    // a ball at the height of the face's edge may touch it from beside, one below it does not
    const double below = std::max(beside, lower - face.depth);
    if (below < lower) return below;
  }
  return std::max(lower, std::sqrt(above * above + beside * beside) - radius);
}
void find_points(const Places& places, const ContactBox& box, double near, std::vector<std::uint32_t>& found) {
  found.clear();
  HWY_DYNAMIC_DISPATCH(find_points)(places, box, near, found);
}

}  // namespace topple::fem::lanes
#endif
