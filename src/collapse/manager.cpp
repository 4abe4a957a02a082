#include "collapse/manager.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <tuple>

#include "base/disjoint_sets.h"
#include "base/error.h"
#include "base/unit.h"
#include "collapse/builder.h"
#include "collapse/frequency_limit.h"
#include "product/place_in_text.h"

namespace topple::collapse {

using product::Member;
using product::MemberKind;

constexpr double kMostInJoint = 1.0 / 3;  // of a short, deep beam, in each joint that has no column
constexpr double kUnderJoint = 0.02;      // a charge in a column is at least so far below its joint [m]

bool is_along_x(const Vec3& d) { return std::abs(d.x) >= std::abs(d.y) * (1 - 1e-9); }

Mat3 column_axes() { return Mat3::from_columns({0, 0, 1}, {1, 0, 0}, {0, 1, 0}); }
Mat3 x_beam_axes() { return Mat3::identity(); }
Mat3 y_beam_axes() { return Mat3::from_columns({0, 1, 0}, {-1, 0, 0}, {0, 0, 1}); }

double calc_standing_mass(const product::Plan& plan) {
  double mass = 0;
  for (const Member& m : plan.members) {
    if (m.removed) continue;
    mass += product::calc_mass(plan, m);
    if (m.kind == MemberKind::Slab)
      mass +=
          plan.storey_loads[static_cast<size_t>(m.storey)] * std::abs((m.end.x - m.start.x) * (m.end.y - m.start.y));
  }
  return mass;
}

void Builder::complain(int i, const std::string& what, const std::string& help) {
  complaints.push_back({Severity::Error, "E621", member(i).where, 1, member(i).name + ": " + what, help});
}

void Builder::complain_of_charge(int i, double position, const std::string& what, const std::string& help) {
  complain(i, what, help);
  for (const product::Stage& stage : plan.stages)
    for (const product::Charge& c : stage.charges)
      if (c.member == i && c.position == position) {
        const product::Place place = product::find_values(plan, {c.where}, "position").front();
        complaints.back().where = {c.where.file, place.line, place.column};
        complaints.back().width = place.width;
        return;
      }
}

int Builder::find_at(const std::map<GridPoint, int>& members, const GridPoint& at) const {
  const auto it = members.find(at);
  return it == members.end() ? -1 : it->second;
}

int Builder::node_at(const GridPoint& at) const { return find_at(node_body, at); }

int Builder::add_assembly(Assembly a) {
  assemblies.push_back(std::move(a));
  return static_cast<int>(assemblies.size()) - 1;
}

/// Ground columns of what a charge acts on, by the grid's lines that members join; of all where none acts on a frame.
static std::vector<int> find_charged_columns(const product::Plan& plan) {
  const int frames = static_cast<int>(plan.frame_offsets.size());
  DisjointSets linked(plan.row_offsets.size() * plan.frame_offsets.size());
  const auto place = [frames](int row, int frame) { return row * frames + frame; };
  for (const Member& m : plan.members) {
    if (m.removed || m.kind == MemberKind::Shaft) continue;
    for (const int row : {m.row_a, m.row_b})
      for (const int frame : {m.frame_a, m.frame_b})
        linked.join_under_lower(place(m.row_a, m.frame_a), place(row, frame));
  }
  std::set<int> charged;
  for (const product::Stage& s : plan.stages)
    for (const product::Charge& c : s.charges)
      if (const Member& m = plan.members[static_cast<size_t>(c.member)]; !c.fails && m.kind != MemberKind::Shaft)
        charged.insert(linked.find(place(m.row_a, m.frame_a)));
  std::vector<int> columns;
  for (size_t i = 0; i < plan.members.size(); ++i) {
    const Member& m = plan.members[i];
    if (m.kind != MemberKind::Column || m.storey != 0 || m.removed) continue;
    if (charged.empty() || charged.contains(linked.find(place(m.row_a, m.frame_a))))
      columns.push_back(static_cast<int>(i));
  }
  return columns;
}

void Builder::find_direction() {
  double azimuth = 3.14159265358979323846;
  if (plan.criteria.azimuth) {
    azimuth = *plan.criteria.azimuth;
    map.is_direction_planned = true;
  } else {
    // where the mouth opens that leaves least of its ring, of those alike the lowest of the first shaft
    std::optional<std::tuple<double, int, double>> weakest;
    for (const product::Stage& s : plan.stages)
      for (const product::Charge& c : s.charges) {
        if (member(c.member).kind != MemberKind::Shaft) continue;
        const std::optional<MouthLeft> left = find_mouth_left(plan, c.member, c.position);
        if (!left || !left->has_direction) continue;
        const std::tuple<double, int, double> rank{std::round(left->angle * 1e6), c.member, c.position};
        if (!weakest || rank < *weakest) weakest = rank, azimuth = left->azimuth;
      }
    // away from the ground columns that keep standing, along the grid
    Vec3 all, standing;
    int n_all = 0, n_standing = 0;
    for (const int i : find_charged_columns(plan)) {
      const Member& m = member(i);
      bool fired = false;
      for (const product::Stage& s : plan.stages)
        for (const product::Charge& c : s.charges) fired |= c.member == i && !c.fails;
      all += m.start, ++n_all;
      if (!fired) standing += m.start, ++n_standing;
    }
    if (n_standing > 0 && n_all > n_standing) {
      const Vec3 d = (1.0 / n_all) * all - (1.0 / n_standing) * standing;
      if (std::abs(d.x) > 1e-6 || std::abs(d.y) > 1e-6)
        azimuth = is_along_x(d) ? std::atan2(0.0, d.x) : std::atan2(d.y, 0.0);
    }
  }
  map.fall_direction = {std::cos(azimuth), std::sin(azimuth), 0};
  map.hinge_axis = cross({0, 0, 1}, map.fall_direction);
  hinge_about_y = is_along_x(map.fall_direction) == (heads == Heads::OfTheFall);
  map.hinge_about_y = hinge_about_y;
}

void Builder::index_members() {
  for (size_t i = 0; i < plan.members.size(); ++i) {
    const Member& m = plan.members[i];
    const int index = static_cast<int>(i);
    if (m.removed) continue;
    const GridPoint at{m.row_a, m.frame_a, m.storey};
    std::map<GridPoint, int>* into = nullptr;
    const int rows = m.row_b - m.row_a, frames = m.frame_b - m.frame_a;
    switch (m.kind) {
      case MemberKind::Column:
        into = &columns;
        break;
      case MemberKind::Slab:
        into = &slabs;
        break;
      case MemberKind::Beam:
        into = rows != 0 ? &x_beams : &y_beams;
        break;
      case MemberKind::Wall:
        into = rows != 0 ? &x_walls : &y_walls;
        break;
      case MemberKind::Shaft:
        continue;
    }
    const bool fits = m.kind == MemberKind::Column ? rows == 0 && frames == 0
                      : m.kind == MemberKind::Slab ? rows == 1 && frames == 1
                                                   : (rows == 1 && frames == 0) || (rows == 0 && frames == 1);
    if (!fits) {
      complain(index, "must go from one grid line to the next");
      continue;
    }
    if ((m.kind == MemberKind::Column || m.kind == MemberKind::Beam) &&
        (m.section < 0 || section_of(index).steel < 0)) {
      complain(index, "needs a section with reinforcement");
      continue;
    }
    if (const auto [it, is_new] = into->emplace(at, index); !is_new)
      complain(index, "stands in the same place as " + member(it->second).name);
  }
  for (const product::Stage& stage : plan.stages)
    for (const product::Charge& c : stage.charges) {
      const Member& m = member(c.member);
      if (m.removed) complain(c.member, "has a charge but was taken out before");
      if (m.kind != MemberKind::Column && m.kind != MemberKind::Beam && m.kind != MemberKind::Shaft)
        complain(c.member, "charges act on columns and beams only",
                 "walls and slabs can be taken out in [preparation]");
      if (m.kind != MemberKind::Column || c.fails) continue;
      const auto [it, is_new] = lowest_charge.emplace(c.member, c.position);
      if (!is_new) it->second = std::min(it->second, c.position);
    }
}

/// Half extents of a joint along x and y.
Vec3 Builder::half_of_node(const GridPoint& at) const {
  int column = find_at(columns, at);
  if (column < 0) column = find_at(columns, {at.row, at.frame, at.storey + 1});
  if (column >= 0) return {0.5 * section_of(column).width, 0.5 * section_of(column).height, 0};
  Vec3 half;
  for (int back : {0, 1}) {
    if (const int b = find_at(y_beams, {at.row, at.frame - back, at.storey}); b >= 0)
      half.x = std::max(half.x, 0.5 * section_of(b).width);
    if (const int b = find_at(x_beams, {at.row - back, at.frame, at.storey}); b >= 0)
      half.y = std::max(half.y, 0.5 * section_of(b).width);
  }
  return half;
}

void Builder::make_columns() {
  // charges too high for their columns: once for those of one table
  struct TooHigh {
    const product::Charge* charge = nullptr;
    double clear_height = 0;
    int more = 0;
  };
  std::vector<TooHigh> too_high;
  const auto note_too_high = [&](int index, double position, double clear_height) {
    for (const product::Stage& stage : plan.stages)
      for (const product::Charge& c : stage.charges) {
        if (c.member != index || c.position != position) continue;
        const auto same = std::find_if(too_high.begin(), too_high.end(), [&c](const TooHigh& t) {
          return t.charge->where.line == c.where.line && t.charge->where.column == c.where.column;
        });
        if (same != too_high.end()) {
          ++same->more;
        } else {
          too_high.push_back({&c, clear_height, 0});
        }
        return;
      }
  };
  std::map<int, double> highest_charge;  // column -> centre of the highest that fires [m]
  for (const product::Stage& stage : plan.stages)
    for (const product::Charge& c : stage.charges)
      if (!c.fails) highest_charge[c.member] = std::max(highest_charge[c.member], c.position);
  for (const auto& [at, index] : columns) {
    const Member& m = member(index);
    const product::Section& s = section_of(index);
    const double height = m.end.z - m.start.z;
    // the joint reaches down to the underside of the deepest beam
    double low = m.end.z;
    for (int back : {0, 1}) {
      for (const int b : {find_at(x_beams, {at.row - back, at.frame, at.storey}),
                          find_at(y_beams, {at.row, at.frame - back, at.storey})})
        if (b >= 0) low = std::min(low, member(b).start.z - 0.5 * section_of(b).height);
    }
    if (low >= m.end.z) low = m.end.z - std::min(std::max(s.width, s.height), 0.25 * height);
    if (low - m.start.z < 0.1) {
      complain(index, "no clear height is left below its beams");
      continue;
    }
    core_low[at] = low;
    const double mass = product::calc_mass(plan, m);
    const auto slice = [&, index = index](double from, double to) {
      const Vec3 half{0.5 * s.width, 0.5 * s.height, 0};
      Vec3 a = m.start - half, b = m.start + half;
      a.z = m.start.z + from, b.z = m.start.z + to;
      return make_part(a, b, mass * (to - from) / height, index);
    };
    const auto charged = lowest_charge.find(index);
    double split = charged == lowest_charge.end() ? 0 : charged->second;
    // the highest one of those that fire
    const double clear = low - m.start.z, highest = highest_charge[index];
    if (highest > clear - kUnderJoint + 1e-9) {
      note_too_high(index, highest, clear);
      continue;
    }
    if (split < 0.02) split = 0;
    const std::string point = m.name.size() > 2 ? m.name.substr(1) : "-" + m.name;
    if (at.storey == 0) {
      if (split > 0) stump_body[index] = add_assembly({m.name + "/stump", "stump", 0, true, {slice(0, split)}});
      own_body[index] = add_assembly({m.name, "column", 0, false, {slice(split, low - m.start.z)}});
      node_body[at] = add_assembly({"N" + point, "node", 0, false, {slice(low - m.start.z, height)}});
    } else {
      // what lies below a charge belongs to the body that it stands on
      const int below = node_at({at.row, at.frame, at.storey - 1});
      if (split > 0 && below >= 0) {
        assemblies[static_cast<size_t>(below)].parts.push_back(slice(0, split));
        stump_body[index] = below;
      } else {
        split = 0;
      }
      node_body[at] = add_assembly({m.name, "column", at.storey, false, {slice(split, height)}});
    }
  }
  std::vector<SourcePosition> tables;
  for (const TooHigh& t : too_high) tables.push_back(t.charge->where);
  const std::vector<product::Place> places = product::find_values(plan, tables, "position");
  for (size_t i = 0; i < too_high.size(); ++i) {
    const TooHigh& t = too_high[i];
    const product::Place& place = places[i];
    complaints.push_back({Severity::Error,
                          "E621",
                          {t.charge->where.file, place.line, place.column},
                          place.width,
                          fmt::format("{}{}: a charge lies in the joint above the clear height of {:.4g} m",
                                      member(t.charge->member).name,
                                      t.more > 0 ? fmt::format(" and {} more", t.more) : "", t.clear_height),
                          fmt::format("its position must be {:.4g} m or less, {:g} cm under the joint",
                                      t.clear_height - kUnderJoint, kUnderJoint / unit::cm)});
  }
}

/// Joints of beams where no column ends from below.
void Builder::make_loose_nodes() {
  const auto need = [&](const GridPoint& at) {
    if (node_at(at) >= 0) return;
    const std::string point =
        plan.row_names[static_cast<size_t>(at.row)] + plan.frame_names[static_cast<size_t>(at.frame)];
    node_body[at] = add_assembly({"N-" + point + "-" + std::to_string(at.storey), "node", at.storey, false, {}});
  };
  for (const auto& [at, index] : x_beams) need(at), need({at.row + 1, at.frame, at.storey});
  for (const auto& [at, index] : y_beams) need(at), need({at.row, at.frame + 1, at.storey});
}

/// Shares boxes between the bodies of two joints, each getting what lies on its side of the middle.
void Builder::put_on_nodes(const std::vector<Part>& parts, int axis, double middle, int node_a, int node_b) {
  for (const Part& p : parts) {
    const double low = p.centre[axis] - p.half[axis], high = p.centre[axis] + p.half[axis];
    for (const bool first : {true, false}) {
      const int node = first ? node_a : node_b;
      const double from = first ? low : std::max(low, middle), to = first ? std::min(high, middle) : high;
      if (!(to - from > 1e-9)) continue;
      Part piece = p;
      piece.centre[axis] = 0.5 * (from + to);
      piece.half[axis] = 0.5 * (to - from);
      piece.mass = p.mass * (to - from) / (high - low);
      assemblies[static_cast<size_t>(node)].parts.push_back(piece);
    }
  }
}

void Builder::complain_of_charges_in_joints() {
  std::vector<const product::Charge*> wrong;
  std::vector<SourcePosition> tables;
  for (const product::Stage& stage : plan.stages)
    for (const product::Charge& c : stage.charges) {
      if (member(c.member).kind != MemberKind::Beam || !zones.count(c.member)) continue;
      const MemberZones& z = zones.at(c.member);
      if (c.position >= z.clear_start && c.position <= z.clear_start + z.clear_length) continue;
      const auto is_same = [&c](const SourcePosition& p) {
        return p.line == c.where.line && p.column == c.where.column;
      };
      if (std::any_of(tables.begin(), tables.end(), is_same)) continue;  // once for those of one table
      wrong.push_back(&c), tables.push_back(c.where);
    }
  const std::vector<product::Place> places = product::find_values(plan, tables, "position");
  for (size_t i = 0; i < wrong.size(); ++i) {
    const MemberZones& z = zones.at(wrong[i]->member);
    complaints.push_back({Severity::Error,
                          "E621",
                          {tables[i].file, places[i].line, places[i].column},
                          places[i].width,
                          fmt::format("{}: a charge lies in the joint at its end", member(wrong[i]->member).name),
                          fmt::format("its position must be between {:.4g} m and {:.4g} m, the faces of the joints",
                                      z.clear_start, z.clear_start + z.clear_length)});
  }
}

void Builder::make_beams() {
  for (const auto* beams : {&x_beams, &y_beams})
    for (const auto& [at, index] : *beams) {
      const bool along_x = beams == &x_beams;
      const Member& m = member(index);
      const product::Section& s = section_of(index);
      const GridPoint other{at.row + along_x, at.frame + !along_x, at.storey};
      const int axis = along_x ? 0 : 1;
      MemberZones& z = zones[index];
      z.clear_start = half_of_node(at)[axis];
      const double end = half_of_node(other)[axis], length = norm(m.end - m.start);
      z.clear_length = length - z.clear_start - end;
      if (z.clear_length < 0.1) {
        complain(index, "no clear length is left between its columns");
        continue;
      }
      Vec3 half{0.5 * s.width, 0.5 * s.width, 0.5 * s.height};
      half[axis] = 0;
      Vec3 low = m.start - half, high = m.end + half;
      low[axis] += z.clear_start, high[axis] -= end;
      const double mass = product::calc_mass(plan, m);
      // a joint without a column is a piece of the beams that meet in it, each up to the point of the grid
      const std::array<int, 2> nodes{node_at(at), node_at(other)};
      const std::array<double, 2> crossing{z.clear_start, end};
      std::array<bool, 2> is_loose{};
      double concrete = z.clear_length;
      for (size_t side : {0, 1}) {
        const std::vector<Part>& parts = assemblies[static_cast<size_t>(nodes[side])].parts;
        is_loose[side] =
            parts.empty() || parts.front().member < 0 || member(parts.front().member).kind != MemberKind::Column;
        if (is_loose[side]) concrete += crossing[side];
      }
      const double inside = std::min(0.5 * s.height, kMostInJoint * z.clear_length), density = mass / concrete;
      double kept = mass;
      for (size_t side : {0, 1}) {
        if (!is_loose[side]) continue;
        const double edge = side == 0 ? low[axis] + inside : high[axis] - inside;
        Vec3 from = low, to = high;
        from[axis] = side == 0 ? m.start[axis] : edge;
        to[axis] = side == 0 ? edge : m.end[axis];
        (side == 0 ? low : high)[axis] = edge;
        const double piece = density * (inside + crossing[side]);
        assemblies[static_cast<size_t>(nodes[side])].parts.push_back(make_part(from, to, piece, index));
        kept -= piece;
      }
      // between them
      const Part rest = make_part(low, high, kept, index);
      if (along_x) {
        own_body[index] = add_assembly({m.name, "beam", at.storey, false, {rest}});
      } else {
        put_on_nodes({rest}, axis, 0.5 * (low[axis] + high[axis]), nodes[0], nodes[1]);
      }
    }
  complain_of_charges_in_joints();
}

double Builder::mass_of_slab(const GridPoint& at, int index) const {
  const Member& m = plan.members[static_cast<size_t>(index)];
  const double load = plan.storey_loads[static_cast<size_t>(at.storey)];
  return product::calc_mass(plan, m) + load * std::abs((m.end.x - m.start.x) * (m.end.y - m.start.y));
}

void Builder::make_slabs() {
  for (const auto& [at, index] : slabs) {
    const Member& m = member(index);
    const double thickness = panel_of(index).thickness;
    const double mass = mass_of_slab(at, index);
    // the strips keep clear of the joints and of the beams across
    const auto edge = [&, at = at](int row) {
      double half = 0;
      for (int f : {at.frame, at.frame + 1}) half = std::max(half, half_of_node({row, f, at.storey}).x);
      if (const int b = find_at(y_beams, {row, at.frame, at.storey}); b >= 0)
        half = std::max(half, 0.5 * section_of(b).width);
      return half;
    };
    const double x0 = m.start.x + edge(at.row), x1 = m.end.x - edge(at.row + 1), xm = 0.5 * (x0 + x1);
    const double z0 = m.start.z - 0.5 * thickness, z1 = m.start.z + 0.5 * thickness;
    const double ym = 0.5 * (m.start.y + m.end.y);
    bool carried = false;
    std::array<bool, 2> has{};
    for (int side : {0, 1}) {
      const GridPoint line{at.row, at.frame + side, at.storey};
      has[static_cast<size_t>(side)] =
          find_at(x_beams, line) >= 0 || (node_at(line) >= 0 && node_at({at.row + 1, at.frame + side, at.storey}) >= 0);
    }
    for (int side : {0, 1}) {
      if (!has[static_cast<size_t>(side)]) continue;
      const bool alone = !has[static_cast<size_t>(1 - side)];
      const GridPoint line{at.row, at.frame + side, at.storey};
      double y0 = side == 0 ? m.start.y : ym, y1 = side == 0 ? ym : m.end.y;
      if (alone) y0 = m.start.y, y1 = m.end.y;
      const double share = alone ? mass : 0.5 * mass;
      const int beam = find_at(x_beams, line);
      if (beam >= 0 && own_body.count(beam)) {
        assemblies[static_cast<size_t>(own_body[beam])].parts.push_back(
            make_part({x0, y0, z0}, {x1, y1, z1}, share, index, material_of(panel_of(index))));
      } else {
        put_on_nodes({make_part({x0, y0, z0}, {x1, y1, z1}, share, index, material_of(panel_of(index)))}, 0, xm,
                     node_at(line), node_at({at.row + 1, at.frame + side, at.storey}));
      }
      carried = true;
    }
    if (!carried) complain(index, "no beam and no columns carry it");
  }
}

void Builder::make_walls() {
  for (const auto* walls : {&x_walls, &y_walls})
    for (const auto& [at, index] : *walls) {
      const bool along_x = walls == &x_walls;
      const Member& m = member(index);
      const GridPoint other{at.row + along_x, at.frame + !along_x, at.storey};
      const int axis = along_x ? 0 : 1;
      const auto face = [&](const GridPoint& p) {
        const int column = find_at(columns, p);
        return column < 0 ? 0.0 : 0.5 * (along_x ? section_of(column).width : section_of(column).height);
      };
      const double clear_a = face(at), clear_b = face(other);
      const double from = m.start[axis] + clear_a, to = m.end[axis] - clear_b;
      const double mass = product::calc_mass(plan, m);
      if (to - from < 0.1 || m.height < 0.1 || !(mass > 0)) {
        complain(index, "nothing is left of the wall between its columns");
        continue;
      }
      std::vector<Part> parts = make_wall_parts(m, index, panel_of(index).thickness, mass, along_x, clear_a, clear_b,
                                                material_of(panel_of(index)));
      const GridPoint floor{at.row, at.frame, at.storey - 1};
      const bool on_beam = along_x && at.storey > 0 && own_body.count(find_at(x_beams, floor));
      if (on_beam && condensation) {
        const int body = own_body.at(find_at(x_beams, floor));
        own_body[index] = body;
        std::vector<Part>& all = assemblies[static_cast<size_t>(body)].parts;
        all.insert(all.end(), parts.begin(), parts.end());
        continue;
      }
      if (at.storey == 0 || on_beam) {
        own_body[index] = add_assembly({m.name, "wall", at.storey, false, std::move(parts)});
        continue;
      }
      int a = node_at(floor), b = node_at({other.row, other.frame, other.storey - 1});
      if (a < 0 && b < 0) {
        complain(index, "stands on no beam and on no column");
        continue;
      }
      if (a < 0) a = b;
      if (b < 0) b = a;
      put_on_nodes(parts, axis, 0.5 * (from + to), a, b);
    }
}

bool Builder::is_cast_on_beam(int index) const {
  const auto wall = own_body.find(index);
  if (wall == own_body.end()) return false;
  return assemblies[static_cast<size_t>(wall->second)].kind == "beam" && member(index).kind == MemberKind::Wall;
}

namespace {

/// Of a member's own material without openings, pieces that members share once [m³].
double calc_volume(const product::Plan& plan, const Member& m) {
  const double mass = product::calc_mass(plan, m);
  switch (m.kind) {
    case MemberKind::Column:
    case MemberKind::Beam: {
      const product::Section& s = plan.sections[static_cast<size_t>(m.section)];
      return mass / plan.concretes[static_cast<size_t>(s.concrete)].density;
    }
    case MemberKind::Slab:
    case MemberKind::Wall:
      return mass / plan.panels[static_cast<size_t>(m.panel)].density;
    case MemberKind::Shaft: {
      product::Shaft s = plan.shafts[static_cast<size_t>(m.shaft)];
      s.concrete = -1;
      s.density = s.lining_density = 1;  // [kg/m³]
      s.loads.clear();
      return product::calc_shaft_mass(plan, s, norm(m.end - m.start), 0, 1);
    }
  }
  return 0;
}

}  // namespace

double Builder::volume_of(const Part& p) const {
  const auto found = volume_per_mass.find(p.member);
  return found == volume_per_mass.end() || !p.is_solid ? 0 : p.mass * found->second;
}

double Builder::volume_of(const Assembly& a) const {
  double volume = 0;
  for (const Part& p : a.parts) volume += volume_of(p);
  return volume;
}

/// Of a joint without mass, at a beam that ends in it: what lies in the slab is the slab's.
void Builder::complain_of_joint(const Assembly& a) {
  int beam = -1;
  for (const auto& [at, body] : node_body)
    if (&assemblies[static_cast<size_t>(body)] == &a)
      for (const int index : {find_at(x_beams, at), find_at(x_beams, {at.row - 1, at.frame, at.storey}),
                              find_at(y_beams, at), find_at(y_beams, {at.row, at.frame - 1, at.storey})})
        if (beam < 0) beam = index;
  complaints.push_back({Severity::Error, "E622", beam < 0 ? SourcePosition{} : member(beam).where, 1,
                        a.name + ": a joint without mass: beams no deeper than their slab end there, and no column",
                        "give the beams more depth than the slab has, or put a column there"});
}

void Builder::finish_bodies() {
  // boxes overlap, of a ring's pieces and of slabs with the beams under them: volumes are those of members' masses
  for (const Assembly& a : assemblies)
    for (const Part& p : a.parts)
      if (p.member >= 0 && p.is_solid) volume_per_mass[p.member] += p.mass;
  for (auto& [index, mass] : volume_per_mass) mass = mass > 0 ? calc_volume(plan, member(index)) / mass : 0;
  for (const Assembly& a : assemblies) {
    if (!(a.mass() > 0)) {
      complain_of_joint(a);
      continue;
    }
    mbs::Body body = make_body(a, k);
    BodyEntry entry{a.name, a.kind, a.storey, false, make_shapes(a, body.X_WB.p, plan)};
    entry.is_upper = !a.fixed && !(a.storey == 0 && (a.kind == "column" || a.kind == "wall"));
    entry.volume = volume_of(a);
    map.mass += body.mass;
    if (!a.fixed) map.moving_mass += body.mass;
    map.bodies.push_back(std::move(entry));
    mbs::add_body(model, std::move(body));
  }
}

void Builder::build() {
  const auto stop_if_wrong = [this] {
    if (!complaints.empty()) throw InputError(complaints);
  };
  model.name = plan.title;
  model.gravity = {0, 0, -plan.analysis.gravity};
  model.contact.friction = plan.ground.friction;
  model.contact.restitution = plan.ground.restitution;
  model.contact.body_friction = k.contact_body_friction;
  model.contact.body_restitution = k.contact_body_restitution;
  model.contact.contact_frequency = k.contact_frequency;
  map.ground_storey_height = plan.storey_heights.empty() ? 0 : plan.storey_heights.front();
  find_direction();
  index_members();
  stop_if_wrong();
  make_columns();
  make_loose_nodes();
  stop_if_wrong();
  make_beams();
  stop_if_wrong();
  make_slabs();
  make_walls();
  for (size_t i = 0; i < plan.members.size(); ++i)
    if (plan.members[i].kind == MemberKind::Shaft && !plan.members[i].removed) make_shaft(static_cast<int>(i));
  stop_if_wrong();
  finish_bodies();
  stop_if_wrong();
  if (model.bodies.empty()) throw InputError("E623", "the plan has no members that stand");

  estimate_normal_forces();
  request_zones();
  library.compute(threads);
  if (made) library.collect(*made);
  for (const auto& [at, index] : columns)
    if (has_frame(at.frame)) at.storey == 0 ? connect_ground_column(at, index) : connect_column(at, index);
  for (const auto& [at, index] : x_beams)
    if (has_frame(at.frame)) connect_x_beam(at, index);
  for (const auto& [at, index] : y_beams)
    if (has_link(at.frame)) connect_y_beam(at, index);
  for (const auto& [at, index] : slabs)
    if (has_link(at.frame)) connect_slab(at, index);
  for (const auto& [at, index] : x_walls)
    if (has_frame(at.frame)) connect_wall(at, index, true);
  for (const auto& [at, index] : y_walls)
    if (has_link(at.frame)) connect_wall(at, index, false);
  for (auto& [index, shaft] : shafts) connect_shaft(index);
  connect_cables();
  stop_if_wrong();
  find_structures();
  if (!condensation) find_span_margins();
  for (size_t s = 0; s < plan.storey_loads.size(); ++s) {
    const bool has_slab = std::any_of(slabs.begin(), slabs.end(),
                                      [&](const auto& entry) { return entry.first.storey == static_cast<int>(s); });
    if (plan.storey_loads[s] > 0 && !has_slab)
      map.notes.push_back({"Floor load without a slab", "The floor load above storey " + std::to_string(s) +
                                                            " is left out: there is no slab to carry it."});
  }
  if (!hinge_about_y && !y_walls.empty())
    map.notes.push_back(
        {"Walls in the rows", "The fall is across the rows; walls in the rows count with their weight only."});
}

std::vector<std::string> ModelMap::note_texts() const {
  std::vector<std::string> out;
  out.reserve(notes.size());
  for (const ModelNote& note : notes) out.push_back(note.text);
  return out;
}

mbs::Model make_model(const product::Plan& plan, const Knowledge& knowledge, ModelMap& map, int threads, Heads heads) {
  map = {};
  Builder builder(plan, knowledge, map, threads);
  builder.heads = heads;
  builder.build();
  limit_frequency(builder.model, knowledge.body_highest_frequency);
  builder.add_events(make_schedule(plan, knowledge));
  limit_frequency_of_stubs(builder.model, knowledge.body_highest_frequency);
  return std::move(builder.model);
}

}  // namespace topple::collapse
