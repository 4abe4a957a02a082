#include "product/clip.h"

#include <algorithm>
#include <cmath>

namespace topple::product {

namespace {

constexpr double kOn = 1e-6;      // what lies nearer to a plane lies in it [m]
constexpr double kNoArea = 1e-8;  // twice the area of what is nothing [m2]

/// How far a point lies on the side that is cut off.
double side(const CutPlane& plane, const Vec3& p) {
  const double d = dot(plane.normal, p - plane.p);
  return std::abs(d) < kOn ? 0 : d;
}

/// Faces of a prism, those of holes turned inwards.
std::vector<Loop> faces_of(const Solid& solid) {
  std::vector<Loop> out;
  for (size_t i = 0; i < solid.loops.size(); ++i) {
    Loop foot = solid.loops[i];
    if ((dot(calc_normal(foot), solid.way) < 0) != (i > 0)) std::reverse(foot.begin(), foot.end());
    Loop head = foot;
    for (Vec3& p : head) p = p + solid.way;
    for (size_t k = 0; k < foot.size(); ++k) {
      const size_t next = (k + 1) % foot.size();
      out.push_back({foot[k], foot[next], head[next], head[k]});
    }
    std::reverse(foot.begin(), foot.end());
    out.push_back(std::move(foot));
    out.push_back(std::move(head));
  }
  return out;
}

bool clip_faces(std::vector<Loop>& faces, const CutPlane& plane) {
  const auto is_off = [&](const Vec3& p) { return side(plane, p) > 0; };
  if (std::none_of(faces.begin(), faces.end(), [&](const Loop& f) { return std::any_of(f.begin(), f.end(), is_off); }))
    return false;
  std::vector<Loop> kept;
  std::vector<std::pair<Vec3, Vec3>> rim;  // edges of what closes the cut
  for (const Loop& face : faces) {
    if (std::all_of(face.begin(), face.end(), [&](const Vec3& p) { return side(plane, p) == 0; })) continue;
    Loop left = clip(face, plane);
    if (left.size() < 3) continue;
    for (size_t i = 0; i < left.size(); ++i) {
      const Vec3 &a = left[i], &b = left[(i + 1) % left.size()];
      if (side(plane, a) == 0 && side(plane, b) == 0) rim.emplace_back(b, a);
    }
    kept.push_back(std::move(left));
  }
  for (const auto& [a, b] : rim) kept.push_back({rim.front().first, a, b});
  faces = std::move(kept);
  return true;
}

/// Whether anything was cut off; what is left goes to `out`.
bool clip_solid(const Solid& solid, const CutPlane& plane, Shape& out) {
  double low = 1e300, high = -1e300, foot_low = 1e300, foot_high = -1e300;
  const double rise = dot(plane.normal, solid.way);
  for (const Vec3& p : solid.loops.front()) {
    const double d = dot(plane.normal, p - plane.p);
    foot_low = std::min(foot_low, d), foot_high = std::max(foot_high, d);
    low = std::min({low, d, d + rise}), high = std::max({high, d, d + rise});
  }
  if (!(high > kOn)) {
    out.solids.push_back(solid);
    return false;
  }
  if (low > -kOn) return true;
  Solid left = solid;
  if (std::abs(rise) < kOn) {  // along its sides
    for (Loop& loop : left.loops) loop = clip(loop, plane);
    if (!(norm(calc_normal(left.loops.front())) > kNoArea)) return true;
    std::erase_if(left.loops, [](const Loop& loop) { return !(norm(calc_normal(loop)) > kNoArea); });
    out.solids.push_back(std::move(left));
  } else if (foot_high - foot_low < kOn) {  // along its foot
    const double t = -0.5 * (foot_low + foot_high) / rise;
    if (rise < 0)
      for (Loop& loop : left.loops)
        for (Vec3& p : loop) p = p + t * solid.way;
    left.way = (rise > 0 ? t : 1 - t) * solid.way;
    out.solids.push_back(std::move(left));
  } else {
    std::vector<Loop> faces = faces_of(solid);
    clip_faces(faces, plane);
    out.faces.insert(out.faces.end(), faces.begin(), faces.end());
  }
  return true;
}

}  // namespace

bool lies_within(const Loop& loop, double x, double y) {
  bool is_inside = false;
  for (size_t i = 0, j = loop.size() - 1; i < loop.size(); j = i++) {
    const Vec3 &a = loop[i], &b = loop[j];
    if ((a.y > y) != (b.y > y) && x < a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y)) is_inside = !is_inside;
  }
  return is_inside;
}

Vec3 calc_normal(const Loop& loop) {
  Vec3 sum;
  for (size_t i = 2; i < loop.size(); ++i) sum += cross(loop[i - 1] - loop[0], loop[i] - loop[0]);
  return sum;
}

double Solid::volume() const {
  double sum = 0;
  for (size_t i = 0; i < loops.size(); ++i) sum += (i == 0 ? 0.5 : -0.5) * std::abs(dot(calc_normal(loops[i]), way));
  return sum;
}

std::vector<Vec3> Solid::faces() const {
  const Loop& outline = loops.front();
  std::vector<Vec3> out{calc_normal(outline), calc_normal(outline)};
  for (size_t i = 0; i < outline.size(); ++i)
    out.push_back(2 * cross(outline[(i + 1) % outline.size()] - outline[i], way));
  return out;
}

Loop clip(const Loop& loop, const CutPlane& plane) {
  Loop out;
  for (size_t i = 0; i < loop.size(); ++i) {
    const Vec3 &a = loop[i], &b = loop[(i + 1) % loop.size()];
    const double da = side(plane, a), db = side(plane, b);
    if (da <= 0) out.push_back(a);
    if (da * db < 0) out.push_back(a + (da / (da - db)) * (b - a));
  }
  return out;
}

bool clip(Shape& shape, const CutPlane& plane) {
  Shape out;
  out.faces = std::move(shape.faces);
  bool is_cut = clip_faces(out.faces, plane);
  for (const Solid& solid : shape.solids) is_cut |= clip_solid(solid, plane, out);
  shape = std::move(out);
  return is_cut;
}

}  // namespace topple::product
