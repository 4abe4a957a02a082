#include "farfield/grid.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "base/error.h"
#include "fem/explicit_model.h"

namespace topple::farfield {

namespace {

constexpr double kSame = 1e-6;  // places that are one [m]

/// A face that wants a line.
struct Face {
  double at = 0;
  int rank = 0;      // as of boxes; destroyed lengths come last
  int member = 0;    // of the plan
  int box = 0;       // faces of one box never share a line
  double reach = 0;  // how far it may lie from others on its line [m]
};

/// Faces on one line of the grid.
struct Line {
  double at = 0;
  std::vector<Face> faces;  // empty: between two others
};

/// Faces nearer to each other than the reach of both in one line, but never both of one box.
std::vector<Line> gather(std::vector<Face> faces) {
  std::stable_sort(faces.begin(), faces.end(), [](const Face& a, const Face& b) { return a.at < b.at; });
  std::vector<Line> lines;
  std::set<int> boxes;
  for (size_t i = 0; i < faces.size();) {
    size_t end = i;  // of the faces in one place
    while (end < faces.size() && faces[end].at - faces[i].at < kSame) ++end;
    bool joins = !lines.empty();
    for (size_t f = i; f < end && joins; ++f) {
      joins = boxes.count(faces[f].box) == 0;
      for (const Face& other : lines.back().faces)
        joins = joins && faces[f].at - other.at <= std::min(faces[f].reach, other.reach) + kSame;
    }
    if (!joins) lines.emplace_back(), boxes.clear();
    for (; i < end; ++i) lines.back().faces.push_back(faces[i]), boxes.insert(faces[i].box);
  }
  for (Line& line : lines) {
    // the place of those who come first; of the place with most faces among them
    int rank = 99;
    for (const Face& f : line.faces) rank = std::min(rank, f.rank);
    std::map<double, int> count;
    for (const Face& f : line.faces)
      if (f.rank == rank) ++count[f.at];
    int most = 0;
    for (const auto& [at, n] : count)
      if (n > most) most = n, line.at = at;
  }
  return lines;
}

double count_parts(double gap, double size) { return std::max(1.0, std::ceil(gap / size - 0.25 - 1e-9)); }

void check_size(const std::array<std::vector<Line>, 3>& lines, double size) {
  double cells = 1;
  for (const std::vector<Line>& axis : lines) {
    double parts = 0;
    for (size_t i = 0; i + 1 < axis.size(); ++i) parts += count_parts(axis[i + 1].at - axis[i].at, size);
    cells *= parts;
  }
  if (!(cells <= kMostCells))
    throw InputError("E676",
                     fmt::format("elements of {:g} m make a grid of {:.2g} cells, at most {:g} are allowed", size,
                                 cells, kMostCells),
                     "choose a larger size");
}

/// Divides gaps so that edges are near the size, and so many cells lie between the bounds of each pair as are asked
/// for.
std::vector<Line> divide(const std::vector<Line>& lines, const GridOptions& o,
                         const std::vector<std::pair<double, double>>& to_divide) {
  const auto gap_behind = [&](size_t i) { return lines[i + 1].at - lines[i].at; };
  std::vector<int> parts(lines.size(), 1);
  for (size_t i = 0; i + 1 < lines.size(); ++i) parts[i] = static_cast<int>(count_parts(gap_behind(i), o.size));
  for (const auto& [low, high] : to_divide) {
    const auto place = [&](double at) {
      return static_cast<size_t>(
          std::lower_bound(lines.begin(), lines.end(), at - kSame, [](const Line& l, double x) { return l.at < x; }) -
          lines.begin());
    };
    const size_t first = place(low), last = place(high);
    for (int count = std::accumulate(&parts[first], &parts[last], 0); count < o.least_across; ++count) {
      size_t widest = first;
      for (size_t i = first; i < last; ++i)
        if (gap_behind(i) / parts[i] > gap_behind(widest) / parts[widest] + kSame) widest = i;
      ++parts[widest];
    }
  }
  std::vector<Line> out;
  for (size_t i = 0; i < lines.size(); ++i) {
    out.push_back(lines[i]);
    for (int k = 1; k < parts[i] && i + 1 < lines.size(); ++k)
      out.push_back({lines[i].at + gap_behind(i) * k / parts[i], {}});
  }
  return out;
}

const Line& line_of(const std::vector<Line>& lines, int box, double at, double reach) {
  const Line* best = nullptr;
  for (const Line& l : lines) {
    if (std::abs(l.at - at) > 2 * reach + kSame) continue;
    for (const Face& f : l.faces)
      if (f.box == box && std::abs(f.at - at) < kSame) best = &l;
  }
  return *best;
}

/// One complaint for all members of a line of the plan.
class Gathering {
 public:
  explicit Gathering(const product::Plan& plan) : plan_(plan) {}
  void add(const char* code, int member, const std::string& why, const std::string& help) {
    const product::Member& m = plan_.members[static_cast<size_t>(member)];
    Group& g = groups_[{code, m.where.line, why}];
    g.help = help;
    if (g.names.empty() || g.names.back() != m.name) g.names.push_back(m.name);
    g.where = m.where;
  }
  void throw_if_any() const {
    if (groups_.empty()) return;
    std::vector<Diagnostic> list;
    for (const auto& [key, g] : groups_) {
      std::string names = g.names.front();
      for (size_t i = 1; i < g.names.size() && i < 3; ++i) names += ", " + g.names[i];
      if (g.names.size() > 3) names += fmt::format(" and {} more", g.names.size() - 3);
      list.push_back({Severity::Error, std::get<0>(key), g.where, 1, names + ": " + std::get<2>(key), g.help});
    }
    throw InputError(list);
  }

 private:
  struct Group {
    std::vector<std::string> names;
    std::string help;
    SourcePosition where;
  };
  const product::Plan& plan_;
  std::map<std::tuple<std::string, int, std::string>, Group> groups_;
};

double density_of(const product::Plan& plan, const product::Member& m) {
  if (m.section >= 0)
    return plan.concretes[static_cast<size_t>(plan.sections[static_cast<size_t>(m.section)].concrete)].density;
  return plan.panels[static_cast<size_t>(m.panel)].density;
}

}  // namespace

double calc_loaded_mass(const product::Plan& plan, const product::Member& m) {
  double mass = product::calc_mass(plan, m);
  if (m.kind == product::MemberKind::Slab)
    mass += plan.storey_loads[static_cast<size_t>(m.storey)] * std::abs((m.end.x - m.start.x) * (m.end.y - m.start.y));
  return mass;
}

Grid make_grid(const product::Plan& plan, const GridOptions& o) {
  const std::vector<Box> boxes = make_boxes(plan);
  if (boxes.empty()) throw InputError("E670", "the plan has no members that stand");
  const double reach = std::min(o.snap_share * o.size, o.snap_most);
  std::array<std::vector<Face>, 3> faces;
  for (size_t b = 0; b < boxes.size(); ++b)
    for (size_t axis = 0; axis < 3; ++axis)
      for (int side = 0; side < 2; ++side) {
        const Box& box = boxes[b];
        if (box.is_soft[axis][side]) continue;
        const double at = side == 0 ? box.low[static_cast<int>(axis)] : box.high[static_cast<int>(axis)];
        // a quarter of its own thickness at most
        const double thickness = box.high[static_cast<int>(axis)] - box.low[static_cast<int>(axis)];
        faces[axis].push_back({at, box.rank, box.member, static_cast<int>(b), std::min(reach, 0.25 * thickness)});
      }
  const std::vector<DestroyedLength> destroyed = find_destroyed_lengths(plan);
  for (size_t d = 0; d < destroyed.size(); ++d)
    for (const double at : {destroyed[d].from, destroyed[d].to})
      faces[static_cast<size_t>(destroyed[d].axis)].push_back(
          {at, 4, destroyed[d].member, static_cast<int>(boxes.size() + d),
           std::min(reach, 0.25 * (destroyed[d].to - destroyed[d].from))});

  std::array<std::vector<Line>, 3> lines;
  std::array<std::vector<std::pair<double, double>>, 3> to_divide;
  for (size_t axis = 0; axis < 3; ++axis) {
    lines[axis] = gather(faces[axis]);
    for (size_t b = 0; b < boxes.size(); ++b) {
      const Box& box = boxes[b];
      const bool wanted = (box.rank == 0 && axis < 2) || (box.rank == 1 && axis == 2);
      if (!wanted) continue;
      const int a = static_cast<int>(axis);
      to_divide[axis].emplace_back(line_of(lines[axis], static_cast<int>(b), box.low[a], reach).at,
                                   line_of(lines[axis], static_cast<int>(b), box.high[a], reach).at);
    }
    std::sort(to_divide[axis].begin(), to_divide[axis].end());
    to_divide[axis].erase(std::unique(to_divide[axis].begin(), to_divide[axis].end()), to_divide[axis].end());
  }
  // which lines bound a box is settled before they are divided
  std::vector<std::array<std::pair<double, double>, 3>> extent(boxes.size());
  for (size_t b = 0; b < boxes.size(); ++b)
    for (size_t axis = 0; axis < 3; ++axis) {
      const int a = static_cast<int>(axis), box = static_cast<int>(b);
      const Box& x = boxes[b];
      extent[b][axis] = {x.is_soft[axis][0] ? x.low[a] : line_of(lines[axis], box, x.low[a], reach).at,
                         x.is_soft[axis][1] ? x.high[a] : line_of(lines[axis], box, x.high[a], reach).at};
    }
  check_size(lines, o.size);
  for (size_t axis = 0; axis < 3; ++axis) lines[axis] = divide(lines[axis], o, to_divide[axis]);

  Grid grid;
  grid.fits.resize(plan.members.size());
  for (size_t axis = 0; axis < 3; ++axis)
    for (const Line& l : lines[axis]) grid.lines[axis].push_back(l.at);
  const auto count = [&](size_t axis) { return lines[axis].size(); };
  const size_t nx = count(0) - 1, ny = count(1) - 1, nz = count(2) - 1;
  const auto cell_at = [&](size_t i, size_t j, size_t k) { return i + nx * (j + ny * k); };
  std::vector<int> owner(nx * ny * nz, -1);
  for (int rank = 3; rank >= 0; --rank)
    for (size_t b = 0; b < boxes.size(); ++b) {
      if (boxes[b].rank != rank) continue;
      std::array<std::pair<size_t, size_t>, 3> range;
      for (size_t axis = 0; axis < 3; ++axis) {
        size_t first = count(axis), last = 0;
        for (size_t i = 0; i + 1 < count(axis); ++i) {
          const double middle = 0.5 * (lines[axis][i].at + lines[axis][i + 1].at);
          if (middle < extent[b][axis].first - kSame || middle > extent[b][axis].second + kSame) continue;
          first = std::min(first, i), last = std::max(last, i + 1);
        }
        range[axis] = {first, last};
      }
      for (size_t k = range[2].first; k < range[2].second; ++k)
        for (size_t j = range[1].first; j < range[1].second; ++j)
          for (size_t i = range[0].first; i < range[0].second; ++i) owner[cell_at(i, j, k)] = static_cast<int>(b);
    }

  // nodes of the cells that belong to someone, each where the first of its members wants it
  Gathering complaints(plan);
  std::vector<int> node_number((nx + 1) * (ny + 1) * (nz + 1), -1);
  const auto node_at = [&](size_t i, size_t j, size_t k) { return i + (nx + 1) * (j + (ny + 1) * k); };
  for (size_t k = 0; k <= nz; ++k)
    for (size_t j = 0; j <= ny; ++j)
      for (size_t i = 0; i <= nx; ++i) {
        std::set<int> members;
        for (size_t c = 0; c < 8; ++c) {
          const size_t di = c & 1, dj = (c >> 1) & 1, dk = c >> 2;
          if (i < di || j < dj || k < dk || i - di >= nx || j - dj >= ny || k - dk >= nz) continue;
          const int b = owner[cell_at(i - di, j - dj, k - dk)];
          if (b >= 0) members.insert(boxes[static_cast<size_t>(b)].member);
        }
        if (members.empty()) continue;
        const size_t at[3] = {i, j, k};
        Vec3 p;
        for (size_t axis = 0; axis < 3; ++axis) {
          const Line& line = lines[axis][at[axis]];
          const Face* first = nullptr;
          const auto storey = [&](const Face& f) { return plan.members[static_cast<size_t>(f.member)].storey; };
          for (const Face& f : line.faces) {
            if (members.count(f.member) == 0) continue;
            if (!first || f.rank < first->rank || (f.rank == first->rank && storey(f) > storey(*first))) first = &f;
          }
          p[static_cast<int>(axis)] = first ? first->at : line.at;
          for (const Face& f : line.faces)
            if (members.count(f.member) != 0) {
              double& shift = grid.fits[static_cast<size_t>(f.member)].shift;
              shift = std::max(shift, std::abs(f.at - p[static_cast<int>(axis)]));
            }
        }
        node_number[node_at(i, j, k)] = static_cast<int>(grid.nodes.size());
        grid.nodes.push_back(p);
      }
  for (size_t k = 0; k < nz; ++k)
    for (size_t j = 0; j < ny; ++j)
      for (size_t i = 0; i < nx; ++i) {
        const int b = owner[cell_at(i, j, k)];
        if (b < 0) continue;
        Cell cell;
        cell.member = boxes[static_cast<size_t>(b)].member;
        constexpr size_t corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                         {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
        std::array<Vec3, 8> p;
        for (size_t c = 0; c < 8; ++c) {
          cell.node[c] = node_number[node_at(i + corner[c][0], j + corner[c][1], k + corner[c][2])];
          p[c] = grid.nodes[static_cast<size_t>(cell.node[c])];
          cell.centre += 0.125 * p[c];
        }
        const double volume = fem::calc_hex_volume(p);
        if (!(volume > 0))
          complaints.add("E672", cell.member, "the faces of members that meet here cross each other on the grid",
                         "choose a smaller size, or make their faces meet");
        MemberFit& fit = grid.fits[static_cast<size_t>(cell.member)];
        ++fit.cells;
        fit.volume += volume;
        grid.cells.push_back(cell);
      }

  for (const Box& box : boxes) {
    const product::Member& m = plan.members[static_cast<size_t>(box.member)];
    MemberFit& fit = grid.fits[static_cast<size_t>(box.member)];
    fit.plan_volume = product::calc_mass(plan, m) / density_of(plan, m);
    if (fit.cells == 0)
      complaints.add("E670", box.member, "no cell of the grid is left for it between the members around it",
                     "take the member out of the plan, or make it larger than those");
    else if ((box.rank == 0 || box.rank == 3) && std::abs(fit.volume / fit.plan_volume - 1) > 0.5)
      complaints.add("E671", box.member,
                     fmt::format("its cells do not fit: a face had to move by up to {:.0f} mm", 1e3 * fit.shift),
                     "choose a smaller size");
  }
  complaints.throw_if_any();
  return grid;
}

}  // namespace topple::farfield
