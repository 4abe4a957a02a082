#include "fem/cut.h"

#include <algorithm>
#include <cmath>

namespace topple::fem {

namespace {

constexpr int edges[12][2] = {{0, 1}, {1, 2}, {2, 3}, {3, 0}, {4, 5}, {5, 6},
                              {6, 7}, {7, 4}, {0, 4}, {1, 5}, {2, 6}, {3, 7}};

/// Where a place lies in an element, by Newton's iterations on the trilinear map.
Vec3 find_natural(const std::array<Vec3, 8>& nodes, const Vec3& place) {
  Vec3 n;
  for (int iteration = 0; iteration < 20; ++iteration) {
    const std::array<double, 8> N = calc_shape_functions(n);
    Vec3 off = place;
    Mat3 J;
    for (size_t i = 0; i < 8; ++i) off -= N[i] * nodes[i];
    constexpr double h = 1e-6;
    for (int k = 0; k < 3; ++k) {
      Vec3 a = n, b = n;
      a[k] += h, b[k] -= h;  // the map is linear in each coordinate, so the difference is exact
      const auto Na = calc_shape_functions(a), Nb = calc_shape_functions(b);
      Vec3 column;
      for (size_t i = 0; i < 8; ++i) column += (0.5 / h * (Na[i] - Nb[i])) * nodes[i];
      for (int r = 0; r < 3; ++r) J(r, k) = column[r];
    }
    const Vec3 step = inverse(J) * off;
    n += step;
    if (norm(step) < 1e-12) break;
  }
  return n;
}

Voigt interpolate(const std::array<Voigt, kPoints>& at_points, const Vec3& natural) {
  // the integration points are the corners of a smaller cube
  const double s = std::sqrt(3.0);
  Voigt out{};
  for (int p = 0; p < kPoints; ++p) {
    const double w = 0.125 * (1 + (p & 1 ? s : -s) * natural.x) * (1 + (p & 2 ? s : -s) * natural.y) *
                     (1 + (p & 4 ? s : -s) * natural.z);
    for (size_t k = 0; k < 6; ++k) out[k] += w * at_points[static_cast<size_t>(p)][k];
  }
  return out;
}

Vec3 calc_traction(const Voigt& s, const Vec3& n) {
  return {s[0] * n.x + s[3] * n.y + s[5] * n.z, s[3] * n.x + s[1] * n.y + s[4] * n.z,
          s[5] * n.x + s[4] * n.y + s[2] * n.z};
}

}  // namespace

Cut make_cut(const System& system, const Response& response, const Plane& plane) {
  Cut out;
  const Mesh& mesh = system.model().mesh;
  const Vec3& n = plane.normal;
  const auto add = [&](const Vec3& at, const Vec3& force) {
    out.force += force;
    out.moment += cross(at - plane.point, force);
  };
  // two axes in the plane, for the order of corners
  const Vec3 helper = std::abs(n.x) < 0.7 ? Vec3{1, 0, 0} : Vec3{0, 1, 0};
  const Vec3 across = cross(n, helper), a1 = (1 / norm(across)) * across, a2 = cross(n, a1);

  for (size_t e = 0; e < mesh.hexes.size(); ++e) {
    std::array<Vec3, 8> nodes;
    double size = 0;
    std::array<double, 8> height;
    for (size_t i = 0; i < 8; ++i) {
      nodes[i] = mesh.nodes[static_cast<size_t>(mesh.hexes[e].node[i])];
      height[i] = dot(nodes[i] - plane.point, n);
      size = std::max(size, norm(nodes[i] - nodes[0]));
    }
    // Corners in the plane count as ahead of it.
    for (double& h : height)
      if (std::abs(h) < 1e-9 * size) h = 0;
    if (std::all_of(height.begin(), height.end(), [](double h) { return h >= 0; }) ||
        std::all_of(height.begin(), height.end(), [](double h) { return h < 0; }))
      continue;
    std::vector<Vec3> corners;
    for (const auto& edge : edges) {
      const double h0 = height[static_cast<size_t>(edge[0])], h1 = height[static_cast<size_t>(edge[1])];
      if ((h0 < 0) == (h1 < 0)) continue;
      const double s = h0 / (h0 - h1);
      const Vec3 c = (1 - s) * nodes[static_cast<size_t>(edge[0])] + s * nodes[static_cast<size_t>(edge[1])];
      if (std::none_of(corners.begin(), corners.end(), [&](const Vec3& b) { return norm(b - c) < 1e-9 * size; }))
        corners.push_back(c);
    }
    if (corners.size() < 3) continue;
    Vec3 centre;
    for (const Vec3& c : corners) centre += (1.0 / static_cast<double>(corners.size())) * c;
    std::sort(corners.begin(), corners.end(), [&](const Vec3& a, const Vec3& b) {
      return std::atan2(dot(a - centre, a2), dot(a - centre, a1)) <
             std::atan2(dot(b - centre, a2), dot(b - centre, a1));
    });
    // Triangles about the centre, each with the rule of its edges' middles (exact for quadratics).
    CutPoint piece;
    piece.hex = static_cast<int>(e);
    Vec3 first_moment;
    for (size_t i = 0; i < corners.size(); ++i) {
      const Vec3 &b = corners[i], &c = corners[(i + 1) % corners.size()];
      const double area = 0.5 * mesh.hexes[e].fill * norm(cross(b - centre, c - centre));
      if (!(area > 0)) continue;
      for (const Vec3& at : {0.5 * (centre + b), 0.5 * (b + c), 0.5 * (c + centre)}) {
        const Voigt stress = interpolate(response.stress[e], find_natural(nodes, at));
        add(at, area / 3 * calc_traction(stress, n));
        for (size_t k = 0; k < 6; ++k) piece.stress[k] += area / 3 * stress[k];
        first_moment += area / 3 * at;
      }
      piece.area += area;
    }
    if (!(piece.area > 0)) continue;
    piece.at = (1 / piece.area) * first_moment;
    for (double& s : piece.stress) s /= piece.area;
    out.area += piece.area;
    out.points.push_back(piece);
  }
  for (size_t t = 0; t < mesh.bars.size(); ++t) {
    const Truss& bar = mesh.bars[t];
    const Vec3 a = mesh.nodes[static_cast<size_t>(bar.node[0])], b = mesh.nodes[static_cast<size_t>(bar.node[1])];
    double ha = dot(a - plane.point, n), hb = dot(b - plane.point, n);
    const double length = system.bar_length(static_cast<int>(t));
    if (std::abs(ha) < 1e-9 * length) ha = 0;
    if (std::abs(hb) < 1e-9 * length) hb = 0;
    if ((ha < 0) == (hb < 0)) continue;
    const double s = ha / (ha - hb), stress = response.bar_stress[t];
    const Vec3 at = (1 - s) * a + s * b;
    const double sign = hb > ha ? 1 : -1;
    add(at, sign * bar.area * stress / length * (b - a));
    out.bars.push_back({at, stress, bar.area, static_cast<int>(t)});
  }
  return out;
}

}  // namespace topple::fem
