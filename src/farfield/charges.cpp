#include "farfield/charges.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>
#include <set>

#include "nearfield/rcc.h"

namespace topple::farfield {

namespace {

/// Where bars of a destroyed length end: the outer faces of its last layer of cells.
class EndOfBars {
 public:
  EndOfBars(const product::Plan& plan, const Grid& grid, const DestroyedLength& length, const std::vector<int>& taken,
            const std::vector<int>& uses, bool is_upper)
      : grid_(grid), axis_(length.axis), is_upper_(is_upper) {
    std::map<int, int> taken_uses;
    double last = is_upper ? -std::numeric_limits<double>::infinity() : std::numeric_limits<double>::infinity();
    for (const int e : taken) {
      const Cell& cell = grid.cells[static_cast<size_t>(e)];
      last = is_upper ? std::max(last, cell.centre[axis_]) : std::min(last, cell.centre[axis_]);
      for (const int n : cell.node) ++taken_uses[n];
    }
    for (const int e : taken)
      if (const double at = grid.cells[static_cast<size_t>(e)].centre[axis_]; std::abs(at - last) < 1e-6)
        layer_.push_back(e);
    for (const auto& [node, count] : taken_uses)
      if (uses[static_cast<size_t>(node)] > count) anchors_.insert(node);
    const product::Member& m = plan.members[static_cast<size_t>(length.member)];
    stands_ = !is_upper && m.storey == 0 && m.kind == product::MemberKind::Column;
    foot_ = m.start[axis_];
  }

  /// Of a bar through p; nothing where nothing is left to hold it.
  std::optional<fem::ExplicitBar::End> find(const Vec3& p) const {
    const int u = (axis_ + 1) % 3, v = (axis_ + 2) % 3;
    fem::ExplicitBar::End best;
    double nearest = std::numeric_limits<double>::infinity();
    for (const int e : layer_) {
      const Cell& cell = grid_.cells[static_cast<size_t>(e)];
      std::array<int, 4> face{};
      size_t count = 0;
      double low[2], high[2];
      low[0] = low[1] = std::numeric_limits<double>::infinity(), high[0] = high[1] = -low[0];
      for (const int n : cell.node) {
        const Vec3& x = grid_.nodes[static_cast<size_t>(n)];
        if ((x[axis_] > cell.centre[axis_]) != is_upper_ || count == 4) continue;
        face[count++] = n;
        low[0] = std::min(low[0], x[u]), high[0] = std::max(high[0], x[u]);
        low[1] = std::min(low[1], x[v]), high[1] = std::max(high[1], x[v]);
      }
      if (count < 4) continue;
      const double outside =
          std::hypot(std::max({0.0, low[0] - p[u], p[u] - high[0]}), std::max({0.0, low[1] - p[v], p[v] - high[1]}));
      if (!(outside < nearest)) continue;
      nearest = outside;
      const double a = std::clamp((p[u] - low[0]) / (high[0] - low[0]), 0.0, 1.0);
      const double b = std::clamp((p[v] - low[1]) / (high[1] - low[1]), 0.0, 1.0);
      for (size_t k = 0; k < 4; ++k) {
        const Vec3& x = grid_.nodes[static_cast<size_t>(face[k])];
        best.node[k] = face[k];
        best.weight[k] = (x[u] > 0.5 * (low[0] + high[0]) ? a : 1 - a) * (x[v] > 0.5 * (low[1] + high[1]) ? b : 1 - b);
      }
    }
    if (best.node[0] < 0) return std::nullopt;
    if (std::all_of(best.node.begin(), best.node.end(), [&](int n) { return anchors_.count(n) != 0; })) return best;
    Vec3 place = p;
    place[axis_] = grid_.nodes[static_cast<size_t>(best.node[0])][axis_];
    if (!stands_ || std::abs(place[axis_] - foot_) > 1e-6) return std::nullopt;
    // in the ground, which stays where the column went from its foot on
    fem::ExplicitBar::End held;
    held.place = place;
    return held;
  }

 private:
  const Grid& grid_;
  const int axis_;
  const bool is_upper_;
  bool stands_ = false;
  double foot_ = 0;
  std::vector<int> layer_;
  std::set<int> anchors_;  // nodes that something else holds
};

/// A bar of a section where a charge has left so much of it.
fem::ExplicitBar make_bar(const product::Plan& plan, const product::Section& section, const product::Bar& bar,
                          double length, double share) {
  nearfield::ZoneInput alone;
  alone.section = section;
  alone.section.bars = {bar};
  alone.concrete = plan.concretes[static_cast<size_t>(section.concrete)];
  alone.steel = plan.steels[static_cast<size_t>(section.steel)];
  alone.length = std::min(length, 0.9 * nearfield::calc_largest_zone_length(alone.concrete));
  const nearfield::ResidualCage cage = make_residual_cage(alone, length, share);
  fem::ExplicitBar out;
  out.stiffness = cage.EA / length;
  out.yield = cage.tension.force[0], out.rupture = cage.tension.force[1];
  out.tears_at = cage.tension.displacement[1];
  out.shortening = cage.compression.displacement, out.buckling = cage.compression.force;
  return out;
}

/// Share of a member's bars that weakenings within a length have cut.
double find_cut_bars(const product::Member& m, const DestroyedLength& length) {
  double cut = 0;
  for (const product::Weakening& w : m.weakenings) {
    const double at = m.start[length.axis] + w.at;
    if (at > length.from && at < length.to) cut = std::max(cut, w.cut_bars);
  }
  return cut;
}

}  // namespace

ChargePlan plan_charges(const product::Plan& plan, const collapse::Knowledge& k, const Grid& grid) {
  ChargePlan out;
  out.taken_by.assign(grid.cells.size(), -1), out.damaged_by = out.taken_by;
  out.transition.assign(grid.cells.size(), 0);
  std::vector<int> uses(grid.nodes.size(), 0);
  std::multimap<int, size_t> cells_of;
  for (size_t c = 0; c < grid.cells.size(); ++c) {
    cells_of.emplace(grid.cells[c].member, c);
    for (const int n : grid.cells[c].node) ++uses[static_cast<size_t>(n)];
  }
  int loose = 0;
  for (const DestroyedLength& d : find_destroyed_lengths(plan)) {
    const product::Member& m = plan.members[static_cast<size_t>(d.member)];
    const product::Charge& charge = plan.stages[static_cast<size_t>(d.stage)].charges[static_cast<size_t>(d.charge)];
    const product::Section& s = plan.sections[static_cast<size_t>(m.section)];
    const double reach = k.charge_transition_reach * std::max(s.width, s.height);
    const int number = static_cast<int>(out.charges.size());
    ChargeElements taken{d.stage, d.charge, {}};
    out.bars_of.emplace_back();
    const auto [first, last] = cells_of.equal_range(d.member);
    // beside what goes the layer nearest to it is damaged at least
    double below = std::numeric_limits<double>::infinity(), above = below;
    for (auto it = first; it != last; ++it) {
      const double at = grid.cells[it->second].centre[d.axis];
      if (at <= d.from) below = std::min(below, d.from - at);
      if (at >= d.to) above = std::min(above, at - d.to);
    }
    const double reach_below = reach > 0 ? std::max(reach, below + 1e-6) : 0;
    const double reach_above = reach > 0 ? std::max(reach, above + 1e-6) : 0;
    for (auto it = first; it != last; ++it) {
      const size_t c = it->second;
      const double at = grid.cells[c].centre[d.axis];
      if (at > d.from && at < d.to) {
        taken.elements.push_back(static_cast<int>(c));
        if (out.taken_by[c] < 0 && !charge.fails) out.taken_by[c] = number;
      } else if (!charge.fails && at > d.from - reach_below && at < d.to + reach_above &&
                 charge.transition_damage > out.transition[c]) {
        out.damaged_by[c] = number, out.transition[c] = charge.transition_damage;
      }
    }
    const double share = charge.residual_bars * (1 - find_cut_bars(m, d));
    if (!charge.fails && share > 0) {
      const EndOfBars low(plan, grid, d, taken.elements, uses, false), high(plan, grid, d, taken.elements, uses, true);
      for (const product::Bar& bar : s.bars) {
        Vec3 p = m.start;
        const bool is_column = m.kind == product::MemberKind::Column;
        p[d.axis == 0 ? 1 : 0] += bar.y, p[is_column ? 1 : 2] += bar.z;
        const auto a = low.find(p), b = high.find(p);
        if (!a || !b) {
          ++loose;
          continue;
        }
        out.bars.push_back(make_bar(plan, s, bar, d.to - d.from, share));
        out.bars.back().a = *a, out.bars.back().b = *b;
        out.bars_of.back().push_back(static_cast<int>(out.bars.size()) - 1);
      }
    }
    out.charges.push_back(std::move(taken));
  }
  // what is taken away by one charge has no strength left to lose to another
  for (size_t c = 0; c < grid.cells.size(); ++c)
    if (out.taken_by[c] >= 0) out.damaged_by[c] = -1, out.transition[c] = 0;
  if (loose > 0)
    out.notes.push_back(
        fmt::format("{} bars that charges leave end where nothing is left to hold them, and are left out.", loose));
  return out;
}

}  // namespace topple::farfield
