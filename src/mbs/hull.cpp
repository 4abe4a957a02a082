#include "mbs/hull.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <string>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

#include "base/error.h"
#include "mbs/boxes.h"

namespace topple::mbs {

namespace {

/// Loops, edges and directions from the planes of the faces.
void complete(Hull& hull) {
  double size = 0;
  for (const Vec3& v : hull.vertices) size = std::max(size, norm(v));
  hull.reach = size;
  const double near = 1e-9 * size;
  for (Hull::Face& face : hull.faces) {
    Vec3 centre;
    for (size_t i = 0; i < hull.vertices.size(); ++i)
      if (std::abs(dot(face.normal, hull.vertices[i]) - face.offset) < near) {
        face.loop.push_back(static_cast<int>(i));
        centre += hull.vertices[i];
      }
    centre = (1.0 / static_cast<double>(face.loop.size())) * centre;
    const Vec3 first = hull.vertices[static_cast<size_t>(face.loop[0])] - centre;
    const Vec3 x = (1 / norm(first)) * first, y = cross(face.normal, x);
    const auto angle = [&](int i) {
      const Vec3 d = hull.vertices[static_cast<size_t>(i)] - centre;
      return std::atan2(dot(d, y), dot(d, x));
    };
    std::sort(face.loop.begin(), face.loop.end(), [&](int i, int j) { return angle(i) < angle(j); });
  }
  hull.thickness = 2 * size;
  for (const Hull::Face& face : hull.faces) {
    double width = 0;
    for (const Vec3& v : hull.vertices) width = std::max(width, face.offset - dot(face.normal, v));
    hull.thickness = std::min(hull.thickness, width);
  }
  // half of the edges that meet at a vertex over all of the face's, times 4: a face stands on 4 in all
  hull.weights.assign(hull.vertices.size(), 4);
  for (const Hull::Face& face : hull.faces) {
    const size_t n = face.loop.size();
    std::vector<double> length(n);
    double perimeter = 0;
    for (size_t i = 0; i < n; ++i)
      perimeter += length[i] = norm(hull.vertices[static_cast<size_t>(face.loop[(i + 1) % n])] -
                                    hull.vertices[static_cast<size_t>(face.loop[i])]);
    for (size_t i = 0; i < n; ++i) {
      double& weight = hull.weights[static_cast<size_t>(face.loop[i])];
      weight = std::min(weight, 2 * (length[(i + n - 1) % n] + length[i]) / perimeter);
    }
  }
  std::map<std::array<int, 2>, bool> known;
  for (const Hull::Face& face : hull.faces)
    for (size_t i = 0; i < face.loop.size(); ++i) {
      const int a = face.loop[i], b = face.loop[(i + 1) % face.loop.size()];
      if (!known.emplace(std::array<int, 2>{std::min(a, b), std::max(a, b)}, true).second) continue;
      const Vec3 along = hull.vertices[static_cast<size_t>(b)] - hull.vertices[static_cast<size_t>(a)];
      const Vec3 unit = (1 / norm(along)) * along;
      const auto same = std::find_if(hull.directions.begin(), hull.directions.end(),
                                     [&](const Vec3& d) { return norm(cross(d, unit)) < 1e-9; });
      hull.direction_of.push_back(static_cast<int>(same - hull.directions.begin()));
      if (same == hull.directions.end()) hull.directions.push_back(unit);
      hull.edges.push_back({a, b});
    }
}

}  // namespace

Hull make_hull(const std::vector<Vec3>& points) {
  if (points.size() < 4) throw InputError("E603", "a convex hull needs at least four vertices");
  std::vector<double> coordinates;
  double size = 0;
  for (const Vec3& p : points) {
    coordinates.insert(coordinates.end(), {p.x, p.y, p.z});
    size = std::max(size, norm(p));
  }
  // what it says about degenerate input goes nowhere; the caller's user gets our own message
  const std::unique_ptr<FILE, int (*)(FILE*)> silence(std::fopen("/dev/null", "w"), &std::fclose);
  const auto free_qhull = [](qhT* qh) {
    qh_freeqhull(qh, !qh_ALL);
    int left = 0, blocks = 0;
    qh_memfreeshort(qh, &left, &blocks);
    delete qh;
  };
  const std::unique_ptr<qhT, decltype(free_qhull)> qhull(new qhT, free_qhull);
  qhT* const qh = qhull.get();
  qh_zero(qh, silence.get());
  char command[] = "qhull";
  if (qh_new_qhull(qh, 3, static_cast<int>(points.size()), coordinates.data(), False, command, nullptr,
                   silence.get()) != 0)
    throw InputError("E603", "the vertices of a convex hull lie in a plane");
  Hull hull;
  std::vector<bool> used(points.size(), false);
  for (const facetT* facet = qh->facet_list; facet != nullptr && facet->next != nullptr; facet = facet->next) {
    const Vec3 normal{facet->normal[0], facet->normal[1], facet->normal[2]};
    const double offset = -facet->offset;
    for (void** at = &facet->vertices->e[0].p; *at != nullptr; ++at)
      used[static_cast<size_t>(qh_pointid(qh, static_cast<vertexT*>(*at)->point))] = true;
    const bool is_known = std::any_of(hull.faces.begin(), hull.faces.end(), [&](const Hull::Face& f) {
      return norm(f.normal - normal) < 1e-9 && std::abs(f.offset - offset) < 1e-9 * size;
    });
    if (!is_known) hull.faces.push_back({normal, offset, {}});
  }
  for (size_t i = 0; i < points.size(); ++i)
    if (used[i]) hull.vertices.push_back(points[i]);
  complete(hull);
  return hull;
}

Hull make_box_hull(const Vec3& half) {
  Hull hull;
  for (int i = 0; i < 8; ++i) hull.vertices.push_back(corner_of(half, i));
  for (int k = 0; k < 3; ++k)
    for (const double sign : {-1.0, 1.0}) {
      Vec3 n;
      n[k] = sign;
      hull.faces.push_back({n, half[k], {}});
    }
  complete(hull);
  return hull;
}

}  // namespace topple::mbs
