#include "farfield/whole.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "base/unit.h"
#include "collapse/law.h"
#include "farfield/mixture.h"

namespace topple::farfield {

namespace {

/// Losses of a section somewhere along a member.
struct Loss {
  double concrete = 0, cut_bars = 0, cut_concrete = 0;
  bool any() const { return concrete > 0 || cut_bars > 0 || cut_concrete > 0; }
  auto operator<=>(const Loss&) const = default;
};

/// Whose law goes its own way from a charge on: those taken away by it, or damaged beside that.
struct Fate {
  int charge = -1;
  bool is_taken = false;
  auto operator<=>(const Fate&) const = default;
};

/// Materials as they are asked for.
class Materials {
 public:
  Materials(const product::Plan& plan, std::vector<fem::ExplicitMaterial>& out) : plan_(plan), out_(out) {}

  ///   zone, element  lengths of the zone that a member's damage gathers in, and of an element [m]
  int of_section(int section, const Loss& loss, const Fate& fate, double zone, double element) {
    const int grade = grade_of(zone / element);
    const auto [it, is_new] =
        sections_.emplace(std::make_tuple(section, loss, fate, zone, grade), static_cast<int>(out_.size()));
    if (!is_new) return it->second;
    const product::Section& s = plan_.sections[static_cast<size_t>(section)];
    nearfield::ZoneInput in;
    in.section = s;
    in.concrete = plan_.concretes[static_cast<size_t>(s.concrete)];
    in.steel = plan_.steels[static_cast<size_t>(s.steel)];
    in.length = zone;
    in.concrete_loss = loss.concrete;
    in.cut_bars = loss.cut_bars;
    in.cut_concrete = loss.cut_concrete;
    std::string name = s.name + "/" + std::to_string(out_.size());
    if (loss.any()) name += "/weakened";
    if (fate.charge >= 0) name += fate.is_taken ? "/charge" : "/beside";
    out_.push_back(make_section_material(in, zone / ratio_of(grade), name));
    return it->second;
  }
  int of_panel(int panel, double zone, double element) {
    const int grade = grade_of(zone / element);
    const auto [it, is_new] = panels_.emplace(std::pair(panel, grade), static_cast<int>(out_.size()));
    if (is_new) {
      out_.push_back(
          make_panel_material(plan_, plan_.panels[static_cast<size_t>(panel)], zone, zone / ratio_of(grade)));
      out_.back().name += "/" + std::to_string(it->second);
    }
    return it->second;
  }

 private:
  // ratios within a seventh of each other share a law
  static constexpr double kGrade = 4.0 / 3;
  static int grade_of(double ratio) { return static_cast<int>(std::lround(std::log(ratio) / std::log(kGrade))); }
  static double ratio_of(int grade) { return std::pow(kGrade, grade); }

  const product::Plan& plan_;
  std::vector<fem::ExplicitMaterial>& out_;
  std::map<std::tuple<int, Loss, Fate, double, int>, int> sections_;
  std::map<std::pair<int, int>, int> panels_;
};

template <class T>
void add_once(std::vector<T>& list, const T& x) {
  if (std::find(list.begin(), list.end(), x) == list.end()) list.push_back(x);
}

/// Length of a cell along its member; of a slab or wall, which cracks in any direction, the edge of a square of its
/// area in plane [m].
double calc_cell_length(const Grid& grid, const Cell& cell, const product::Plan& plan, double volume) {
  const product::Member& m = plan.members[static_cast<size_t>(cell.member)];
  const bool is_panel = m.section < 0;
  const int across = m.kind == product::MemberKind::Slab ? 2 : axis_of(m) == 0 ? 1 : 0;
  const int axis = is_panel ? across : axis_of(m);
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (const int n : cell.node) {
    const double at = grid.nodes[static_cast<size_t>(n)][axis];
    low = std::min(low, at), high = std::max(high, at);
  }
  return is_panel ? std::sqrt(volume / (high - low)) : high - low;
}

/// Lengths of the zones in which damage of each member gathers: those of the manager's (members) [m].
std::vector<double> calc_zone_lengths(const product::Plan& plan, const collapse::Knowledge& k,
                                      const collapse::ModelMap& map) {
  std::vector<double> out;
  const auto section_of = [&](const product::Member& m) -> const product::Section& {
    return plan.sections[static_cast<size_t>(m.section)];
  };
  for (const product::Member& m : plan.members) {
    if (m.section < 0) {
      out.push_back(k.slab_elongation_lengths * plan.panels[static_cast<size_t>(m.panel)].thickness);
      continue;
    }
    // between the faces of what it meets
    const product::Section& s = section_of(m);
    const bool is_column = m.kind == product::MemberKind::Column;
    double ends[2] = {0, 0};
    for (const product::Member& other : plan.members) {
      if (other.removed || other.section < 0 || other.storey != m.storey) continue;
      const product::Section& o = section_of(other);
      const auto meets = [](const product::Member& beam, int row, int frame) {
        return (beam.row_a == row && beam.frame_a == frame) || (beam.row_b == row && beam.frame_b == frame);
      };
      if (is_column && other.kind == product::MemberKind::Beam && meets(other, m.row_a, m.frame_a))
        ends[1] = std::max(ends[1], o.height);
      if (!is_column && other.kind == product::MemberKind::Column)
        for (int e = 0; e < 2; ++e)
          if (other.row_a == (e == 0 ? m.row_a : m.row_b) && other.frame_a == (e == 0 ? m.frame_a : m.frame_b))
            ends[e] = std::max(ends[e], 0.5 * (axis_of(m) == 0 ? o.width : o.height));
    }
    const double clear = std::max(norm(m.end - m.start) - ends[0] - ends[1], 0.1);
    const bool bends_about_y = std::abs(map.hinge_axis.y) >= std::abs(map.hinge_axis.x);
    out.push_back(collapse::calc_zone_length(s, plan.concretes[static_cast<size_t>(s.concrete)],
                                             plan.steels[static_cast<size_t>(s.steel)],
                                             is_column && bends_about_y ? s.width : s.height, clear, k));
  }
  return out;
}

/// Distances from two bodies that differ by less are the same but for round-off [m].
constexpr double kSamePlace = 1e-6;

/// Distance from a box along W's axes as it stands at the start; negative inside.
double calc_distance(const Vec3& p, const Vec3& centre, const Vec3& half) {
  double outside = 0, inside = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < 3; ++i) {
    const double d = std::abs(p[i] - centre[i]) - half[i];
    inside = std::max(inside, d);
    if (d > 0) outside += d * d;
  }
  return inside > 0 ? std::sqrt(outside) : inside;
}

}  // namespace

std::vector<std::vector<int>> find_bodies(const product::Plan& plan, const Grid& grid, const mbs::Model& model,
                                          const collapse::ModelMap& map) {
  std::vector<std::vector<int>> bodies(grid.cells.size());
  std::vector<double> away(map.bodies.size());
  for (size_t c = 0; c < grid.cells.size(); ++c) {
    double least = std::numeric_limits<double>::infinity();
    const bool is_wall = plan.members[static_cast<size_t>(grid.cells[c].member)].kind == product::MemberKind::Wall;
    for (size_t b = 0; b < map.bodies.size(); ++b) {
      away[b] = std::numeric_limits<double>::infinity();
      for (const record::BoxShape& s : map.bodies[b].shapes) {
        // what a charge takes of a column lies in no shape, and nearer to a wall beside it
        if (s.part == "wall" && !is_wall) continue;
        const Vec3 centre = model.bodies[b].X_WB * s.X_BS.p;
        away[b] = std::min(away[b], calc_distance(grid.cells[c].centre, centre, s.half));
      }
      least = std::min(least, away[b]);
    }
    for (size_t b = 0; b < away.size(); ++b)
      if (away[b] < least + kSamePlace) bodies[c].push_back(static_cast<int>(b));
  }
  return bodies;
}

Whole make_whole(const product::Plan& plan, const collapse::Knowledge& k, const GridOptions& options,
                 const mbs::Model& model, const collapse::ModelMap& map) {
  Whole whole;
  whole.grid = make_grid(plan, options);
  const Grid& grid = whole.grid;
  fem::ExplicitModel& fe = whole.fe;
  fe.nodes = grid.nodes;
  fe.gravity = {0, 0, -plan.analysis.gravity};

  ChargePlan charges = plan_charges(plan, k, grid);
  std::vector<Loss> loss(grid.cells.size());
  std::multimap<int, size_t> cells_of;
  for (size_t c = 0; c < grid.cells.size(); ++c) cells_of.emplace(grid.cells[c].member, c);
  for (size_t i = 0; i < plan.members.size(); ++i) {
    const product::Member& m = plan.members[i];
    for (const product::Weakening& w : m.weakenings) {
      const int axis = axis_of(m);
      // the layer of cells nearest to the cut
      double least = std::numeric_limits<double>::infinity();
      const auto [first, last] = cells_of.equal_range(static_cast<int>(i));
      const auto away = [&](size_t c) { return std::abs(grid.cells[c].centre[axis] - m.start[axis] - w.at); };
      for (auto it = first; it != last; ++it) least = std::min(least, away(it->second));
      for (auto it = first; it != last; ++it)
        if (away(it->second) < least + 1e-6) {
          Loss& l = loss[it->second];
          l.cut_bars = std::max(l.cut_bars, w.cut_bars);
          l.cut_concrete = std::max(l.cut_concrete, w.cut_concrete);
        }
    }
  }

  for (size_t c = 0; c < charges.charges.size(); ++c) {
    fem::ExplicitRelease release;
    release.duration = k.charge_release_time;
    release.elements = charges.charges[c].elements;
    release.bars = charges.bars_of[c];
    fe.releases.push_back(std::move(release));
  }

  Materials materials(plan, fe.materials);
  const std::vector<double> zone_lengths = calc_zone_lengths(plan, k, map);
  whole.bodies = find_bodies(plan, grid, model, map);
  for (size_t c = 0; c < grid.cells.size(); ++c) {
    const Cell& cell = grid.cells[c];
    const product::Member& m = plan.members[static_cast<size_t>(cell.member)];
    fem::ExplicitElement e;
    e.node = cell.node;
    std::array<Vec3, 8> corners;
    for (size_t i = 0; i < 8; ++i) corners[i] = grid.nodes[static_cast<size_t>(cell.node[i])];
    const double length = calc_cell_length(grid, cell, plan, fem::calc_hex_volume(corners));
    const double zone = zone_lengths[static_cast<size_t>(cell.member)];
    if (m.section < 0) {
      e.material = materials.of_panel(m.panel, zone, length);
    } else if (const int charge = std::max(charges.taken_by[c], charges.damaged_by[c]); charge < 0) {
      e.material = materials.of_section(m.section, loss[c], {}, zone, length);
    } else {
      const bool is_taken = charges.taken_by[c] >= 0;
      e.material = materials.of_section(m.section, loss[c], {charge, is_taken}, zone, length);
      fem::ExplicitRelease& release = fe.releases[static_cast<size_t>(charge)];
      if (is_taken) {
        add_once(release.materials, e.material);
      } else {
        Loss damaged = loss[c];
        damaged.concrete = charges.transition[c];
        add_once(release.weakened, std::pair(e.material, materials.of_section(m.section, damaged, {}, zone, length)));
      }
    }
    e.part = whole.bodies[c].front();
    whole.is_stump.push_back(model.bodies[static_cast<size_t>(e.part)].fixed ? 1 : 0);
    const MemberFit& fit = grid.fits[static_cast<size_t>(cell.member)];
    e.mass_factor = calc_loaded_mass(plan, m) / (fit.volume * fe.materials[static_cast<size_t>(e.material)].density);
    fe.elements.push_back(e);
  }

  // what stands on the ground is held there
  std::map<int, Foot> feet;
  std::vector<bool> is_held(fe.nodes.size(), false);
  for (size_t c = 0; c < grid.cells.size(); ++c) {
    const product::Member& m = plan.members[static_cast<size_t>(grid.cells[c].member)];
    const bool stands = m.storey == 0 && (m.kind == product::MemberKind::Column || m.kind == product::MemberKind::Wall);
    if (!stands) continue;
    bool touches = false;
    for (size_t i = 0; i < 4; ++i) {
      const int n = grid.cells[c].node[i];
      if (std::abs(fe.nodes[static_cast<size_t>(n)].z - m.start.z) > 1e-6) continue;
      touches = true;
      Foot& foot = feet[grid.cells[c].member];
      if (std::find(foot.nodes.begin(), foot.nodes.end(), n) == foot.nodes.end()) foot.nodes.push_back(n);
      if (!is_held[static_cast<size_t>(n)]) fe.supports.push_back({n, true, true, true});
      is_held[static_cast<size_t>(n)] = true;
    }
    if (touches) feet[grid.cells[c].member].elements.push_back(static_cast<int>(c));
  }
  std::map<int, int> feet_on;  // a node
  for (const auto& [member, foot] : feet)
    for (const int n : foot.nodes) ++feet_on[n];
  for (size_t c = 0; c < charges.charges.size(); ++c) {
    const ChargeElements& of = charges.charges[c];
    const auto foot =
        feet.find(plan.stages[static_cast<size_t>(of.stage)].charges[static_cast<size_t>(of.charge)].member);
    for (const int i : charges.bars_of[c]) {
      const fem::ExplicitBar& bar = charges.bars[static_cast<size_t>(i)];
      if (foot != feet.end() && (bar.a.node[0] < 0 || bar.b.node[0] < 0)) foot->second.bars.push_back(i);
    }
  }
  for (auto& [member, foot] : feet) {
    foot.member = member;
    for (const int n : foot.nodes) foot.shares.push_back(1.0 / feet_on[n]);
    for (const int n : foot.nodes)
      foot.p_W += (1.0 / static_cast<double>(foot.nodes.size())) * fe.nodes[static_cast<size_t>(n)];
    whole.feet.push_back(std::move(foot));
  }
  if (whole.feet.empty()) throw InputError("E673", "nothing stands on the ground", "columns or walls of storey 0 do");
  fe.grounds.push_back({{0, 0, 0}, {0, 0, 1}, plan.ground.friction});

  for (const product::Cable& cable : plan.cables)
    whole.notes.push_back("Cable " + cable.name + " is left out: the finite elements have no cables.");
  whole.notes.insert(whole.notes.end(), charges.notes.begin(), charges.notes.end());
  fe.bars = std::move(charges.bars);
  whole.charges = std::move(charges.charges);
  return whole;
}

MeshReport calc_mesh_report(const product::Plan& plan, const Whole& whole) {
  MeshReport r;
  r.mesh = fem::calc_mesh_summary(whole.fe);
  const auto member_of = [&](int element) {
    if (element < 0) return std::string();
    return plan.members[static_cast<size_t>(whole.grid.cells[static_cast<size_t>(element)].member)].name;
  };
  r.smallest_edge_member = member_of(r.mesh.smallest_edge_element);
  r.critical_member = member_of(r.mesh.critical_element);
  const auto note = [&r](double share, const std::string& name) {
    if (share < r.smallest_fit) r.smallest_fit = share, r.smallest_member = name;
    if (share > r.largest_fit) r.largest_fit = share, r.largest_member = name;
  };
  // beams and slabs take room from each other
  std::map<int, MemberFit> floors;
  for (size_t i = 0; i < plan.members.size(); ++i) {
    const MemberFit& fit = whole.grid.fits[i];
    if (fit.cells == 0) continue;
    const product::Member& m = plan.members[i];
    if (fit.shift > r.largest_shift) r.largest_shift = fit.shift, r.shifted_member = m.name;
    if (m.kind == product::MemberKind::Beam || m.kind == product::MemberKind::Slab) {
      floors[m.storey].volume += fit.volume;
      floors[m.storey].plan_volume += fit.plan_volume;
    } else {
      note(fit.volume / fit.plan_volume, m.name);
    }
  }
  for (const auto& [storey, fit] : floors)
    note(fit.volume / fit.plan_volume, fmt::format("beams and slabs of storey {}", storey));
  return r;
}

std::vector<std::string> describe(const MeshReport& r) {
  std::vector<std::string> lines;
  lines.push_back(
      fmt::format("{} elements, {} nodes, {:.1f} t.", r.mesh.elements, r.mesh.nodes, r.mesh.mass / unit::t));
  lines.push_back(
      fmt::format("Smallest edge {:.0f} mm ({}), largest aspect ratio {:.1f}, critical step {:.4f} ms ({}).",
                  1e3 * r.mesh.smallest_edge, r.smallest_edge_member, r.mesh.largest_aspect, 1e3 * r.mesh.critical_step,
                  r.critical_member));
  const auto share = [](double fit, const std::string& member) {
    return std::abs(fit - 1) < 5e-4 ? std::string("100.0 %") : fmt::format("{:.1f} % ({})", 100 * fit, member);
  };
  lines.push_back(fmt::format("Volumes: {} to {} of the plan's; their masses are the plan's.",
                              share(std::min(1.0, r.smallest_fit), r.smallest_member),
                              share(std::max(1.0, r.largest_fit), r.largest_member)));
  lines.push_back(r.largest_shift > 1e-6 ? fmt::format("Faces were moved by at most {:.0f} mm ({}).",
                                                       1e3 * r.largest_shift, r.shifted_member)
                                         : std::string("No face was moved."));
  return lines;
}

}  // namespace topple::farfield
