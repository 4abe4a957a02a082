#include "base/union_outline.h"

#include <algorithm>
#include <cstddef>

#include "base/polygon.h"

namespace topple {
namespace {

/// Rising, each at least `rounding` behind the one before it.
std::vector<double> collect_edges(const std::vector<Rectangle>& rectangles, size_t axis, double rounding) {
  std::vector<double> all, edges;
  for (const Rectangle& r : rectangles) all.push_back(r.low[axis]), all.push_back(r.high[axis]);
  std::sort(all.begin(), all.end());
  for (const double x : all)
    if (edges.empty() || x > edges.back() + rounding) edges.push_back(x);
  return edges;
}

/// The edge that a coordinate has become.
int find_edge(const std::vector<double>& edges, double x) {
  return static_cast<int>(std::upper_bound(edges.begin(), edges.end(), x) - edges.begin()) - 1;
}

/// Cells between edges, and whether they are covered.
struct Cells {
  std::vector<double> x, y;
  std::vector<char> covered;

  bool at(int i, int j) const {
    const int columns = static_cast<int>(x.size()) - 1, rows = static_cast<int>(y.size()) - 1;
    return i >= 0 && j >= 0 && i < columns && j < rows &&
           covered[static_cast<size_t>(j) * static_cast<size_t>(columns) + static_cast<size_t>(i)] != 0;
  }
};

Cells cover(const std::vector<Rectangle>& rectangles, double rounding, int most_edges) {
  Cells cells{collect_edges(rectangles, 0, rounding), collect_edges(rectangles, 1, rounding), {}};
  const size_t nx = cells.x.size(), ny = cells.y.size(), most = static_cast<size_t>(most_edges);
  if (nx < 2 || ny < 2 || nx > most || ny > most) return {};
  // how many rectangles begin and end there; their sums are how many cover a cell
  std::vector<int> count(nx * ny, 0);
  for (const Rectangle& r : rectangles) {
    const auto i0 = static_cast<size_t>(find_edge(cells.x, r.low[0])),
               i1 = static_cast<size_t>(find_edge(cells.x, r.high[0])),
               j0 = static_cast<size_t>(find_edge(cells.y, r.low[1])),
               j1 = static_cast<size_t>(find_edge(cells.y, r.high[1]));
    ++count[j0 * nx + i0], --count[j0 * nx + i1], --count[j1 * nx + i0], ++count[j1 * nx + i1];
  }
  cells.covered.resize((nx - 1) * (ny - 1));
  for (size_t j = 0; j < ny; ++j)
    for (size_t i = 0; i < nx; ++i) {
      int& c = count[j * nx + i];
      if (i > 0) c += count[j * nx + i - 1];
      if (j > 0) c += count[(j - 1) * nx + i];
      if (i > 0 && j > 0) c -= count[(j - 1) * nx + i - 1];
      if (i + 1 < nx && j + 1 < ny) cells.covered[j * (nx - 1) + i] = c > 0;
    }
  return cells;
}

}  // namespace

std::vector<Polygon> calc_union_outlines(const std::vector<Rectangle>& rectangles, double rounding, int most_edges) {
  const Cells cells = cover(rectangles, rounding, most_edges);
  std::vector<Polygon> loops;
  if (cells.covered.empty()) return loops;
  // from each corner of cells, to which of the four directions (+x, +y, -x, -y) an edge goes that has what is covered
  // on its left
  const int nx = static_cast<int>(cells.x.size()), ny = static_cast<int>(cells.y.size());
  constexpr int step[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  const auto corner = [nx](int i, int j) {
    return static_cast<size_t>(j) * static_cast<size_t>(nx) + static_cast<size_t>(i);
  };
  std::vector<unsigned char> open(static_cast<size_t>(nx) * static_cast<size_t>(ny), 0);
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i) {
      // the cells around the corner, from that between +x and +y on
      const bool around[4] = {cells.at(i, j), cells.at(i - 1, j), cells.at(i - 1, j - 1), cells.at(i, j - 1)};
      for (unsigned k = 0; k < 4; ++k)
        if (around[k] && !around[(k + 3) % 4])
          open[corner(i, j)] = static_cast<unsigned char>(open[corner(i, j)] | (1U << k));
    }
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      for (unsigned first = 0; first < 4; ++first) {
        if ((open[corner(i, j)] >> first & 1U) == 0) continue;
        Polygon loop;
        int a = i, b = j;
        for (unsigned k = first, before = 4;;) {
          if (k != before) loop.push_back({cells.x[static_cast<size_t>(a)], cells.y[static_cast<size_t>(b)]});
          a += step[k][0], b += step[k][1];
          before = k;
          // where two areas touch in a corner, each keeps its own outline: the left turn first
          for (const unsigned turn : {3U, 0U, 1U})
            if ((open[corner(a, b)] >> ((before + turn) % 4) & 1U) != 0) k = (before + turn) % 4;
          if (a == i && b == j && k == first) break;
          open[corner(a, b)] = static_cast<unsigned char>(open[corner(a, b)] & ~(1U << k));
        }
        open[corner(i, j)] = static_cast<unsigned char>(open[corner(i, j)] & ~(1U << first));
        if (calc_signed_area(loop) > 0) loops.push_back(std::move(loop));
      }
  return loops;
}

}  // namespace topple
