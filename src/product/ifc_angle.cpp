#include "product/ifc_angle.h"

#include <algorithm>
#include <cmath>

#include "base/unit.h"

namespace topple::product {

namespace {

constexpr double kRight = 90 * unit::deg;
constexpr double kLine = 0.3;  // columns less far apart stand in one line [m]

struct Edge {
  double angle = 0, length = 0;  // angle from 0 to kRight
  bool operator<(const Edge& o) const { return angle < o.angle; }
};

/// The median of the degree that holds the longest edges; they are taken out. Edges are sorted.
double take_direction(std::vector<Edge>& edges) {
  constexpr double width = 1 * unit::deg;
  const size_t n = edges.size();
  const auto at = [&](size_t i) { return edges[i % n].angle + (i < n ? 0 : kRight); };
  size_t from = 0, to = 0;
  double most = 0, held = 0;
  for (size_t i = 0, end = 0; i < n; held -= edges[i++].length) {
    for (; end < i + n && at(end) <= at(i) + width; ++end) held += edges[end % n].length;
    if (held > most * (1 + 1e-9)) most = held, from = i, to = end;
  }
  double passed = 0, median = 0;
  for (size_t k = from; k < to && passed < 0.5 * most; ++k) passed += edges[k % n].length, median = at(k);
  std::erase_if(edges, [median](const Edge& e) {
    const double off = e.angle - median;
    return std::abs(off - kRight * std::round(off / kRight)) <= width;
  });
  return median - kRight * std::round(median / kRight);
}

/// Rows and frames of columns along a direction, and how far they stand off them.
struct Alignment {
  int lines = 0;
  double spread = 0;  // [m]
  bool is_better_than(const Alignment& o) const {
    return lines < o.lines || (lines == o.lines && spread <= o.spread - 1e-3);
  }
};

Alignment align(const std::vector<Vec3>& columns, double angle) {
  Alignment out;
  const double c = std::cos(angle), s = std::sin(angle);
  for (const bool is_x : {true, false}) {
    std::vector<double> places;
    for (const Vec3& p : columns) places.push_back(is_x ? c * p.x + s * p.y : c * p.y - s * p.x);
    std::sort(places.begin(), places.end());
    for (size_t i = 0, first = 0; i < places.size(); ++i) {
      if (i == 0 || places[i] - places[first] >= kLine) first = i, ++out.lines;
      out.spread += places[i] - places[first];
    }
  }
  return out;
}

}  // namespace

double find_grid_angle(const std::vector<Vec3>& all, const std::vector<Vec3>& columns) {
  std::vector<Edge> edges;
  for (const Vec3& d : all) {
    const double a = std::atan2(d.y, d.x);
    edges.push_back({a - kRight * std::floor(a / kRight), std::hypot(d.x, d.y)});
  }
  std::sort(edges.begin(), edges.end());
  Alignment best;
  double angle = 0;
  for (int i = 0; i < 12 && !edges.empty(); ++i) {
    const double tried = take_direction(edges);
    const Alignment found = align(columns, tried);
    if (i > 0 && !found.is_better_than(best)) continue;
    best = found;
    angle = std::abs(tried) < 1e-4 ? 0 : tried;
  }
  return align(columns, 0).is_better_than(best) ? 0 : angle;
}

}  // namespace topple::product
