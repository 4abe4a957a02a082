#include "collapse/assembly.h"

#include <algorithm>
#include <cmath>

namespace topple::collapse {

Part make_part(const Vec3& low, const Vec3& high, double mass, int member, const std::string& material) {
  return {0.5 * (low + high), 0.5 * (high - low), mass, member, material, 0, true};
}

Quat turn_of(const Part& p) { return exp_rotation({0, 0, p.turn}); }

mbs::Body make_body(const Assembly& assembly, const Knowledge& k) {
  mbs::Body body;
  body.name = assembly.name;
  body.fixed = assembly.fixed;
  body.mass = 0;
  Vec3 moment;
  for (const Part& p : assembly.parts) {
    body.mass += p.mass;
    moment += p.mass * p.centre;
  }
  body.X_WB.p = (1 / body.mass) * moment;
  Mat3 I;
  for (const Part& p : assembly.parts) {
    const Vec3 h = p.half, d = p.centre - body.X_WB.p;
    double xx = h.x * h.x, yy = h.y * h.y, xy = 0;  // three times the mean squares about the box's middle
    if (p.turn != 0) {
      const double c = std::cos(p.turn), s = std::sin(p.turn);
      xy = (xx - yy) * c * s;
      const double turned = xx * c * c + yy * s * s;
      yy = xx * s * s + yy * c * c, xx = turned;
    }
    I = I + Mat3::diagonal({p.mass * ((yy + h.z * h.z) / 3 + d.y * d.y + d.z * d.z),
                            p.mass * ((h.z * h.z + xx) / 3 + d.z * d.z + d.x * d.x),
                            p.mass * ((xx + yy) / 3 + d.x * d.x + d.y * d.y)});
    I(0, 1) -= p.mass * (xy / 3 + d.x * d.y), I(1, 2) -= p.mass * d.y * d.z, I(0, 2) -= p.mass * d.x * d.z;
  }
  I(1, 0) = I(0, 1), I(2, 1) = I(1, 2), I(2, 0) = I(0, 2);
  const double least = body.mass * k.body_least_radius_of_gyration * k.body_least_radius_of_gyration;
  for (int i = 0; i < 3; ++i) I(i, i) = std::max(I(i, i), least);
  body.inertia = I;
  for (const Part& p : assembly.parts) {
    if (!p.is_solid) continue;
    mbs::Shape shape;
    shape.X_BS = {p.centre - body.X_WB.p, turn_of(p)};
    for (int i = 0; i < 3; ++i) shape.half[i] = p.half[i] - std::min(k.contact_gap, 0.4 * p.half[i]);
    body.shapes.push_back(shape);
  }
  return body;
}

std::vector<record::BoxShape> make_shapes(const Assembly& assembly, const Vec3& p_WB, const product::Plan& plan) {
  std::vector<record::BoxShape> shapes;
  for (const Part& p : assembly.parts) {
    if (!p.is_solid) continue;
    record::BoxShape s;
    s.X_BS = {p.centre - p_WB, turn_of(p)};
    s.half = p.half;
    s.material = p.material;
    s.part = assembly.kind;
    if (p.member >= 0) {
      const product::MemberKind kind = plan.members[static_cast<size_t>(p.member)].kind;
      if (kind == product::MemberKind::Slab || kind == product::MemberKind::Wall) s.part = product::name_of(kind);
    }
    shapes.push_back(s);
  }
  return shapes;
}

std::vector<Part> cut_member(Assembly& assembly, int member, int axis, double from, double to,
                             const std::function<bool(const Part&)>& applies) {
  std::vector<Part> kept, removed;
  const auto piece_of = [axis](const Part& p, double low, double high) {
    Part piece = p;
    piece.centre[axis] = 0.5 * (low + high);
    piece.half[axis] = 0.5 * (high - low);
    piece.mass = p.mass * piece.half[axis] / p.half[axis];
    return piece;
  };
  for (const Part& p : assembly.parts) {
    const double low = p.centre[axis] - p.half[axis], high = p.centre[axis] + p.half[axis];
    double a = std::max(low, from), b = std::min(high, to);
    if (p.member != member || !(b > a) || (applies && !applies(p))) {
      kept.push_back(p);
      continue;
    }
    if (a - low < kSliver) a = low;
    if (high - b < kSliver) b = high;
    if (a > low) kept.push_back(piece_of(p, low, a));
    if (b < high) kept.push_back(piece_of(p, b, high));
    removed.push_back(piece_of(p, a, b));
  }
  if (kept.empty() && !removed.empty()) {
    // a thin piece at the end away from the middle of the cut stays
    Part& last = removed.back();
    const double low = last.centre[axis] - last.half[axis], high = last.centre[axis] + last.half[axis];
    const double keep = std::min(kSliver, 0.5 * (high - low));
    const bool at_low = last.centre[axis] < 0.5 * (from + to);
    kept.push_back(at_low ? piece_of(last, low, low + keep) : piece_of(last, high - keep, high));
    last = at_low ? piece_of(last, low + keep, high) : piece_of(last, low, high - keep);
  }
  assembly.parts = std::move(kept);
  return removed;
}

std::vector<Part> make_wall_parts(const product::Member& m, int index, double thickness, double mass, bool along_x,
                                  double clear_a, double clear_b, const std::string& material) {
  const int axis = along_x ? 0 : 1, across = 1 - axis;
  const double start = m.start[axis], from = start + clear_a, to = m.end[axis] - clear_b;
  const double floor = m.start.z, top = floor + m.height;
  // columns of boxes between the edges of openings; openings that overlap in length are kept apart by their edges
  std::vector<double> edges{from, to};
  for (const product::Opening& o : m.openings)
    for (double e : {start + o.left, start + o.left + o.width})
      if (e > from + 1e-6 && e < to - 1e-6) edges.push_back(e);
  std::sort(edges.begin(), edges.end());
  std::vector<Part> parts;
  double volume = 0;
  const auto add = [&](double a, double b, double low, double high) {
    if (b - a < 1e-3 || high - low < 1e-3) return;
    Vec3 p, q;
    p[axis] = a, q[axis] = b;
    p[across] = m.start[across] - 0.5 * thickness, q[across] = m.start[across] + 0.5 * thickness;
    p.z = low, q.z = high;
    parts.push_back(make_part(p, q, (b - a) * (high - low), index, material));
    volume += parts.back().mass;
  };
  for (size_t i = 0; i + 1 < edges.size(); ++i) {
    const double a = edges[i], b = edges[i + 1], middle = 0.5 * (a + b);
    std::vector<std::pair<double, double>> holes;
    for (const product::Opening& o : m.openings)
      if (start + o.left < middle && middle < start + o.left + o.width)
        holes.emplace_back(std::max(floor, floor + o.sill), std::min(top, floor + o.sill + o.height));
    std::sort(holes.begin(), holes.end());
    double z = floor;
    for (const auto& [low, high] : holes) {
      add(a, b, z, low);
      z = std::max(z, high);
    }
    add(a, b, z, top);
  }
  for (Part& p : parts) p.mass *= mass / volume;
  return parts;
}

}  // namespace topple::collapse
