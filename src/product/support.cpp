#include "product/support.h"

#include <cmath>
#include <map>
#include <set>
#include <sstream>
#include <tuple>

namespace topple::product {

namespace {

using Node3 = std::tuple<int, int, int>;           // storey, row, frame
using Edge = std::tuple<int, int, int, int, int>;  // storey, row_a, frame_a, row_b, frame_b

struct Carriers {
  std::set<Node3> columns;         // storey in which they stand
  std::set<Node3> wall_ends;       // likewise
  std::map<Node3, int> beam_ends;  // beams below the upper floor of the storey that end at the point
  std::set<Edge> beams, walls, slabs;
  std::set<Node3> held;  // points that stand on something or hang on beams that do
};

Carriers collect(const std::vector<Draft>& drafts) {
  Carriers c;
  for (const Draft& draft : drafts) {
    const Member& m = draft.member;
    const Node3 a{m.storey, m.row_a, m.frame_a}, b{m.storey, m.row_b, m.frame_b};
    const Edge edge{m.storey, m.row_a, m.frame_a, m.row_b, m.frame_b};
    switch (m.kind) {
      case MemberKind::Column:
        c.columns.insert(a);
        break;
      case MemberKind::Beam:
        ++c.beam_ends[a], ++c.beam_ends[b], c.beams.insert(edge);
        break;
      case MemberKind::Wall:
        c.wall_ends.insert(a), c.wall_ends.insert(b), c.walls.insert(edge);
        break;
      case MemberKind::Slab:
        c.slabs.insert(edge);
        break;
      case MemberKind::Shaft:
        break;
    }
  }
  return c;
}

/// Follows the beams of each floor from the points where something stands below.
void find_held(Carriers& c) {
  std::map<Node3, std::vector<Node3>> beams_at;
  for (const auto& [s, row_a, frame_a, row_b, frame_b] : c.beams) {
    beams_at[{s, row_a, frame_a}].push_back({s, row_b, frame_b});
    beams_at[{s, row_b, frame_b}].push_back({s, row_a, frame_a});
  }
  std::vector<Node3> open(c.columns.begin(), c.columns.end());
  open.insert(open.end(), c.wall_ends.begin(), c.wall_ends.end());
  c.held.insert(open.begin(), open.end());
  while (!open.empty()) {
    const Node3 point = open.back();
    open.pop_back();
    for (const Node3& other : beams_at[point])
      if (c.held.insert(other).second) open.push_back(other);
  }
}

/// Something stands below the upper floor of the storey at this point.
bool stands_below(const Carriers& c, const Node3& point) { return c.columns.count(point) || c.wall_ends.count(point); }

int count_beams(const Carriers& c, const Node3& point) {
  const auto it = c.beam_ends.find(point);
  return it == c.beam_ends.end() ? 0 : it->second;
}

/// It ends on other beams that are carried.
bool ends_on_beams(const Carriers& c, const Node3& end) { return count_beams(c, end) > 1 && c.held.count(end); }

bool has_slab_beside(const Carriers& c, const Edge& edge) {
  const auto [s, row_a, frame_a, row_b, frame_b] = edge;
  if (row_a == row_b)
    return c.slabs.count({s, row_a, frame_a, row_a + 1, frame_b}) ||
           c.slabs.count({s, row_a - 1, frame_a, row_a, frame_b});
  return c.slabs.count({s, row_a, frame_a, row_b, frame_a + 1}) ||
         c.slabs.count({s, row_a, frame_a - 1, row_b, frame_a});
}

/// One complaint for all members of a rule that fail in the same way.
class Gathering {
 public:
  void add(const Draft& draft, const std::string& why, const std::string& help) {
    auto& found = groups_[{draft.rule.line, draft.rule.column, why}];
    found.place = draft.rule;
    found.help = help;
    found.names.push_back(draft.member.name);
  }
  struct Group {
    Place place;
    std::string help;
    std::vector<std::string> names;
  };
  const std::map<std::tuple<int, int, std::string>, Group>& groups() const { return groups_; }

 private:
  std::map<std::tuple<int, int, std::string>, Group> groups_;
};

std::string names_of(const std::vector<std::string>& names) {
  std::string text = names[0];
  for (size_t i = 1; i < names.size() && i < 3; ++i) text += ", " + names[i];
  if (names.size() > 3) text += " and " + std::to_string(names.size() - 3) + " more";
  return text;
}

/// Slabs on beams along x span along y. Where all slabs are such and span the long way, the plan may be meant the other
/// way round.
void check_spans(const Plan& plan, const Carriers& carriers, const std::vector<Draft>& drafts, Complaints& complaints) {
  constexpr double kLongWay = 1.5;
  Gathering long_way;
  for (const Draft& draft : drafts) {
    const Member& m = draft.member;
    if (m.kind != MemberKind::Slab) continue;
    const auto gap = [](const std::vector<double>& offsets, int a, int b) {
      return std::abs(offsets[static_cast<size_t>(b)] - offsets[static_cast<size_t>(a)]);
    };
    const double along = gap(plan.frame_offsets, m.frame_a, m.frame_b),
                 across = gap(plan.row_offsets, m.row_a, m.row_b);
    const auto lies_on = [&](int frame) {
      return carriers.beams.count({m.storey, m.row_a, frame, m.row_b, frame}) > 0;
    };
    if (!(along > kLongWay * across) || !(lies_on(m.frame_a) || lies_on(m.frame_b))) return;
    std::ostringstream words;
    words << "spans along y, " << along << " m between beams along x, though its beams along y are " << across
          << " m apart";
    long_way.add(draft, words.str(), "slabs bear along y; exchange rows and frames if they bear the other way");
  }
  for (const auto& [key, group] : long_way.groups())
    complaints.warn("W512", group.place, names_of(group.names) + ": " + std::get<2>(key), group.help);
}

}  // namespace

std::vector<size_t> find_hanging_beams(const std::vector<Draft>& drafts) {
  Carriers carriers = collect(drafts);
  find_held(carriers);
  std::vector<size_t> out;
  for (size_t i = 0; i < drafts.size(); ++i) {
    const Member& m = drafts[i].member;
    if (m.kind != MemberKind::Beam) continue;
    for (const Node3& end : {Node3{m.storey, m.row_a, m.frame_a}, Node3{m.storey, m.row_b, m.frame_b}})
      if (!stands_below(carriers, end) && !ends_on_beams(carriers, end)) {
        out.push_back(i);
        break;
      }
  }
  return out;
}

void check_support(const Plan& plan, const std::vector<Draft>& drafts, Complaints& complaints) {
  Carriers carriers = collect(drafts);
  find_held(carriers);
  Gathering hanging, carried, idle;
  const auto point_name = [&](const Node3& n) {
    return plan.row_names[static_cast<size_t>(std::get<1>(n))] + plan.frame_names[static_cast<size_t>(std::get<2>(n))];
  };
  for (const Draft& draft : drafts) {
    const Member& m = draft.member;
    const Node3 a{m.storey, m.row_a, m.frame_a}, b{m.storey, m.row_b, m.frame_b};
    const Node3 below_a{m.storey - 1, m.row_a, m.frame_a}, below_b{m.storey - 1, m.row_b, m.frame_b};
    const Edge edge_below{m.storey - 1, m.row_a, m.frame_a, m.row_b, m.frame_b};
    switch (m.kind) {
      case MemberKind::Column:
        if (m.storey == 0 || stands_below(carriers, below_a)) break;
        if (count_beams(carriers, below_a) > 0) {
          carried.add(draft, "stands on a beam, with no column below", "");
        } else {
          hanging.add(draft, "hangs in the air: no column, wall or beam below",
                      "add a column below, or limit its storeys");
        }
        break;
      case MemberKind::Beam:
        for (const Node3& end : {a, b}) {
          if (stands_below(carriers, end)) continue;
          if (ends_on_beams(carriers, end)) {
            carried.add(draft, "ends at " + point_name(end) + " on other beams, with no column below", "");
          } else {
            hanging.add(draft, "hangs in the air at " + point_name(end) + ": no column or wall below its end",
                        "add a column in this storey at " + point_name(end) + ", or leave the beam out with except");
          }
        }
        break;
      case MemberKind::Slab:
        for (const int r : {m.row_a, m.row_b})
          for (const int f : {m.frame_a, m.frame_b}) {
            const Node3 corner{m.storey, r, f};
            if (!stands_below(carriers, corner) && count_beams(carriers, corner) == 0)
              hanging.add(draft,
                          "hangs in the air at " + point_name(corner) + ": no column, beam or wall at its corner",
                          "add what carries it, or leave the slab out with except");
          }
        break;
      case MemberKind::Wall:
        if (m.storey > 0 && !carriers.beams.count(edge_below) && !carriers.walls.count(edge_below) &&
            !has_slab_beside(carriers, edge_below) &&
            !(stands_below(carriers, below_a) && stands_below(carriers, below_b)))
          hanging.add(draft, "hangs in the air: no beam, slab or wall below",
                      "add what carries it, or leave the wall out with except");
        if (m.row_a != m.row_b && !carriers.beams.count({m.storey, m.row_a, m.frame_a, m.row_b, m.frame_b}))
          idle.add(draft, "bears and stiffens nothing: no beam lies on it",
                   "a wall along x takes shear from the beam above it; add one, or let columns carry what is above");
        break;
      case MemberKind::Shaft:
        break;
    }
  }
  for (const auto& [key, group] : hanging.groups())
    complaints.error("E304", group.place, names_of(group.names) + ": " + std::get<2>(key), group.help);
  for (const auto& [key, group] : carried.groups())
    complaints.warn("W502", group.place, names_of(group.names) + ": " + std::get<2>(key), group.help);
  for (const auto& [key, group] : idle.groups())
    complaints.warn("W511", group.place, names_of(group.names) + ": " + std::get<2>(key), group.help);
  check_spans(plan, carriers, drafts, complaints);
}

}  // namespace topple::product
