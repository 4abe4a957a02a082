#include <algorithm>
#include <charconv>
#include <cmath>
#include <functional>
#include <set>
#include <tuple>

#include "product/reading.h"
#include "product/support.h"

namespace topple::product {

namespace {

constexpr size_t most_rules = 1000;

using Key = std::tuple<MemberKind, int, int, int, int, int>;  // kind, storey, row_a, frame_a, row_b, frame_b

struct Builder {
  Reading& reading;
  std::map<Key, Draft> drafts;
  bool is_too_many = false;
};

std::string rule_key(MemberKind kind) { return std::string(name_of(kind)) + "s"; }

std::string point_name(const Plan& plan, int row, int frame) {
  return plan.row_names[static_cast<size_t>(row)] + plan.frame_names[static_cast<size_t>(frame)];
}

/// "A1" for a column, "A1A2" for everything else.
std::string span_name(const Plan& plan, const Key& key) {
  const auto [kind, storey, row_a, frame_a, row_b, frame_b] = key;
  const std::string a = point_name(plan, row_a, frame_a);
  return kind == MemberKind::Column ? a : a + point_name(plan, row_b, frame_b);
}

/// The storey number in a word: -1 after a complaint.
int read_storey(const TableReader& table, const std::string& text, Place place, int count) {
  int storey = -1;
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), storey);
  if (failure == std::errc::invalid_argument || end != text.data() + text.size()) {
    table.error("E208", place, "storeys: " + quoted(text) + " does not name storeys",
                "write a number such as 0, a range such as \"1..6\", a list of these, or \"all\"");
    return -1;
  }
  if (failure != std::errc{} || storey < 0 || storey >= count) {
    table.error("E303", place, "storeys: there is no storey " + text,
                "storeys are counted from 0 to " + std::to_string(count - 1));
    return -1;
  }
  return storey;
}

/// Marks the storeys of one value: 0, "1..6", "all" or a list of these.
void mark_storeys(const TableReader& table, const Node& node, std::vector<bool>& marked, bool is_nested) {
  const int count = static_cast<int>(marked.size());
  if (node.kind == Node::Kind::Integer) {
    const int storey = read_storey(table, std::to_string(node.integer), node.place, count);
    if (storey >= 0) marked[static_cast<size_t>(storey)] = true;
  } else if (node.kind == Node::Kind::String) {
    const size_t dots = node.text.find("..");
    if (node.text == "all") {
      marked.assign(marked.size(), true);
    } else if (dots == std::string::npos) {
      const int storey = read_storey(table, node.text, node.place, count);
      if (storey >= 0) marked[static_cast<size_t>(storey)] = true;
    } else {
      const int from = read_storey(table, node.text.substr(0, dots), node.place, count);
      const int to = from < 0 ? -1 : read_storey(table, node.text.substr(dots + 2), node.place, count);
      if (to >= 0 && to < from)
        table.error("E208", node.place, "storeys: " + quoted(node.text) + " runs downwards", "the lower storey first");
      if (from >= 0)
        for (int s = from; s <= to; ++s) marked[static_cast<size_t>(s)] = true;
    }
  } else if (node.kind == Node::Kind::Array && !is_nested && !node.items.empty()) {
    for (const Node& item : node.items) mark_storeys(table, item, marked, true);
  } else if (node.kind == Node::Kind::Array && !is_nested) {
    table.error("E205", node.place, "storeys: is an empty list",
                "name at least one storey, or leave storeys out for all");
  } else {
    table.error("E202", node.place, "storeys: is " + name_of(node.kind) + "; storeys are wanted",
                "write a number such as 0, a range such as \"1..6\", a list of these, or \"all\"");
  }
}

std::vector<Opening> read_openings(TableReader& table, std::vector<Place>& places) {
  std::vector<Opening> list;
  const std::vector<const Node*> nodes = table.tables("opening");
  if (nodes.size() > 100) {
    table.error("E209", nodes[100]->place, "more than 100 openings in a wall");
    return list;
  }
  for (size_t i = 0; i < nodes.size(); ++i) {
    TableReader opening(*nodes[i], "opening[" + std::to_string(i) + "]", table.complaints());
    Opening o;
    o.left = opening.quantity("left", Dimension::Length, {0, 100});
    o.sill = opening.quantity("sill", Dimension::Length, {0, 50}, 0);
    o.width = opening.quantity("width", Dimension::Length, {0, 100, true});
    o.height = opening.quantity("height", Dimension::Length, {0, 50, true});
    opening.finish();
    list.push_back(o);
    places.push_back(nodes[i]->place);
  }
  return list;
}

/// Calls `visit` for each place of the grid where a member of this kind can stand, storey by storey.
void for_each_place(const Plan& plan, MemberKind kind, const std::vector<bool>& storeys,
                    const std::function<void(const Key&)>& visit) {
  const int rows = static_cast<int>(plan.row_names.size()), frames = static_cast<int>(plan.frame_names.size());
  for (int s = 0; s < static_cast<int>(storeys.size()); ++s) {
    if (!storeys[static_cast<size_t>(s)]) continue;
    for (int r = 0; r < rows; ++r)
      for (int f = 0; f < frames; ++f) {
        if (kind == MemberKind::Column) visit({kind, s, r, f, r, f});
        if (kind == MemberKind::Slab && r + 1 < rows && f + 1 < frames) visit({kind, s, r, f, r + 1, f + 1});
        if (kind == MemberKind::Beam || kind == MemberKind::Wall) {
          if (r + 1 < rows) visit({kind, s, r, f, r + 1, f});
          if (f + 1 < frames) visit({kind, s, r, f, r, f + 1});
        }
      }
  }
}

bool is_on_perimeter(const Plan& plan, const Key& key) {
  const auto [kind, storey, row_a, frame_a, row_b, frame_b] = key;
  if (row_a == row_b) return row_a == 0 || row_a + 1 == static_cast<int>(plan.row_names.size());
  return frame_a == 0 || frame_a + 1 == static_cast<int>(plan.frame_names.size());
}

/// One [[columns]], [[beams]], [[slabs]] or [[walls]]: puts its members into the drafts, over earlier ones.
void apply_rule(Builder& builder, MemberKind kind, const Node& node, const std::string& label) {
  Reading& reading = builder.reading;
  const Plan& plan = reading.plan;
  TableReader table(node, label, reading.complaints);
  const bool is_line = kind == MemberKind::Beam || kind == MemberKind::Wall;
  const bool is_bar = kind == MemberKind::Column || kind == MemberKind::Beam;

  Draft draft;
  draft.member.kind = kind;
  draft.member.where = reading.complaints.position(node.place);
  draft.rule = draft.shape = node.place;
  if (is_bar) {
    draft.member.section = find_named(reading.sections, table, "section", table.text("section"), "section");
  } else {
    const bool is_wall = kind == MemberKind::Wall;
    draft.member.panel = find_named(is_wall ? reading.walls : reading.slabs, table, "panel", table.text("panel"),
                                    is_wall ? "wall" : "slab");
  }
  const int errors_before = reading.complaints.error_count();
  std::vector<bool> storeys(plan.storey_heights.size(), true);
  if (const Node* marks = table.find("storeys"); marks && !storeys.empty()) {
    // how many there are is known from a grid that could be read
    storeys.assign(reading.has_grid ? storeys.size() : static_cast<size_t>(most_storeys), false);
    mark_storeys(table, *marks, storeys, false);
  }
  std::vector<Word> at = table.has("at") ? table.required_words("at", "\"*\"") : std::vector<Word>{},
                    except = table.words("except");
  if (!table.has("at")) {
    table.find("at");
    at.push_back({"*", node.place});
  }
  std::optional<std::string> along;
  bool perimeter = false;
  if (is_line) {
    along = table.find_choice("along", {"x", "y"});
    perimeter = table.find_flag("perimeter").value_or(false);
  }
  if (kind == MemberKind::Wall) draft.member.openings = read_openings(table, draft.opening_places);
  if (reading.complaints.error_count() != errors_before) reading.knows_members = false;
  table.finish();
  if (!reading.has_grid || reading.complaints.is_full()) return;

  std::vector<int> hits(at.size(), 0), except_hits(except.size(), 0);
  for_each_place(plan, kind, storeys, [&](const Key& key) {
    if (perimeter && !is_on_perimeter(plan, key)) return;
    if (along && (*along == "x") != (std::get<2>(key) != std::get<4>(key))) return;
    const std::string name = span_name(plan, key);
    bool is_in = false, is_out = false;
    for (size_t i = 0; i < at.size(); ++i)
      if (matches(at[i].text, name)) is_in = true, ++hits[i];
    for (size_t i = 0; i < except.size(); ++i)
      if (matches(except[i].text, name)) is_out = true, ++except_hits[i];
    if (!is_in || is_out || builder.is_too_many) return;
    if (builder.drafts.size() >= most_members && !builder.drafts.count(key)) {
      builder.is_too_many = true;
      reading.complaints.error("E209", node.place, label + ": more than " + std::to_string(most_members) + " members");
      return;
    }
    builder.drafts[key] = draft;
  });
  const bool has_storey = std::find(storeys.begin(), storeys.end(), true) != storeys.end();
  if (!has_storey) return;  // complained about
  std::vector<std::string> names;
  for_each_place(plan, kind, {true}, [&](const Key& key) { names.push_back(span_name(plan, key)); });
  const auto complain = [&](const char* key, const std::vector<Word>& words, const std::vector<int>& counts) {
    for (size_t i = 0; i < words.size(); ++i) {
      if (counts[i] > 0) continue;
      reading.knows_members = false;
      table.error("E302", words[i].place, std::string(key) + ": nothing on the grid matches " + quoted(words[i].text),
                  did_you_mean(words[i].text, names,
                               names.empty() ? "the grid is too small" : "names here look like " + names.front()));
    }
  };
  complain("at", at, hits);
  complain("except", except, except_hits);
}

/// Ends of the axis from the grid; beams need the depth of their section, slabs their thickness.
void place_axis(const Plan& plan, Member& m) {
  const auto size = [](int i) { return static_cast<size_t>(i); };
  const double top = plan.level(m.storey), floor = top - plan.storey_heights[size(m.storey)];
  m.start = {plan.row_offsets[size(m.row_a)], plan.frame_offsets[size(m.frame_a)], floor};
  m.end = {plan.row_offsets[size(m.row_b)], plan.frame_offsets[size(m.frame_b)], floor};
  if (m.kind == MemberKind::Column) m.end.z = top;
  if (m.kind == MemberKind::Beam && m.section >= 0)
    m.start.z = m.end.z = top - plan.sections[size(m.section)].height / 2;
  if (m.kind == MemberKind::Slab && m.panel >= 0) m.start.z = m.end.z = top - plan.panels[size(m.panel)].thickness / 2;
}

const Member* find_draft(const Builder& builder, const Key& key) {
  const auto it = builder.drafts.find(key);
  return it == builder.drafts.end() ? nullptr : &it->second.member;
}

/// What hangs below the upper floor over a wall: the beam on its line, else the thicker slab beside it [m].
double calc_depth_above(const Builder& builder, const Key& wall) {
  const Plan& plan = builder.reading.plan;
  auto [kind, s, row_a, frame_a, row_b, frame_b] = wall;
  const Member* beam = find_draft(builder, {MemberKind::Beam, s, row_a, frame_a, row_b, frame_b});
  if (beam && beam->section >= 0) return plan.sections[static_cast<size_t>(beam->section)].height;
  const bool is_along_x = row_a != row_b;
  double depth = 0;
  for (const int back : {0, 1}) {
    const int r = is_along_x ? row_a : row_a - back, f = is_along_x ? frame_a - back : frame_a;
    const Member* slab = find_draft(builder, {MemberKind::Slab, s, r, f, r + 1, f + 1});
    if (slab && slab->panel >= 0) depth = std::max(depth, plan.panels[static_cast<size_t>(slab->panel)].thickness);
  }
  return depth;
}

/// Half the column's extent along a line that ends at this grid point [m].
double calc_half_column(const Builder& builder, int storey, int row, int frame, bool is_along_x) {
  const Member* column = find_draft(builder, {MemberKind::Column, storey, row, frame, row, frame});
  if (!column || column->section < 0) return 0;
  const Section& s = builder.reading.plan.sections[static_cast<size_t>(column->section)];
  return (is_along_x ? s.width : s.height) / 2;
}

void check_openings(const Builder& builder, const Key& key, const Draft& draft, std::set<int>& complained) {
  const auto [kind, s, row_a, frame_a, row_b, frame_b] = key;
  const Member& m = draft.member;
  const bool is_along_x = row_a != row_b;
  const double left = calc_half_column(builder, s, row_a, frame_a, is_along_x);
  const double right = calc_length(m) - calc_half_column(builder, s, row_b, frame_b, is_along_x);
  Complaints& complaints = builder.reading.complaints;
  for (size_t i = 0; i < m.openings.size(); ++i) {
    const Opening& o = m.openings[i];
    const Place place = draft.opening_places[i];
    if (complained.count(place.line * 4096 + place.column)) continue;
    const int errors_before = complaints.error_count();
    char room[120];
    std::snprintf(room, sizeof room, "between its columns from %.3g m to %.3g m, up to %.3g m above the floor", left,
                  right, m.height);
    if (o.left < left - round_off || o.left + o.width > right + round_off || o.sill + o.height > m.height + round_off)
      complaints.error("E306", place, "opening[" + std::to_string(i) + "]: reaches out of " + m.name,
                       std::string("the wall stands ") + room);
    for (size_t j = 0; j < i; ++j) {
      const Opening& p = m.openings[j];
      if (o.left < p.left + p.width - round_off && p.left < o.left + o.width - round_off &&
          o.sill < p.sill + p.height - round_off && p.sill < o.sill + o.height - round_off)
        complaints.error("E306", place,
                         "opening[" + std::to_string(i) + "]: overlaps opening[" + std::to_string(j) + "]");
    }
    if (complaints.error_count() != errors_before) complained.insert(place.line * 4096 + place.column);
  }
}

void finish_geometry(Builder& builder) {
  const Plan& plan = builder.reading.plan;
  Complaints& complaints = builder.reading.complaints;
  std::set<int> complained_openings, complained_rules;
  const auto complain = [&](const Draft& draft, const std::string& message) {
    if (complained_rules.insert(draft.shape.line).second) complaints.error("E305", draft.shape, message);
  };
  for (auto& [key, draft] : builder.drafts) {
    Member& m = draft.member;
    const double storey_height = plan.storey_heights[static_cast<size_t>(m.storey)];
    place_axis(plan, m);
    const bool is_beam = m.kind == MemberKind::Beam && m.section >= 0;
    const bool is_slab = m.kind == MemberKind::Slab && m.panel >= 0;
    if ((is_beam && plan.sections[static_cast<size_t>(m.section)].height >= storey_height) ||
        (is_slab && plan.panels[static_cast<size_t>(m.panel)].thickness >= storey_height))
      complain(draft, m.name + ": is as deep as the storey is high");
    if (m.kind != MemberKind::Wall) continue;
    m.height = storey_height - calc_depth_above(builder, key);
    if (m.height > 0 && m.height < 0.1)
      complain(draft, m.name + ": no height is left for the wall below the beam or slab above");
    if (m.height >= 0.1) check_openings(builder, key, draft, complained_openings);
  }
}

void apply_overrides(Builder& builder, TableReader& root) {
  Reading& reading = builder.reading;
  const std::vector<const Node*> nodes = root.tables("override");
  if (nodes.size() > most_rules) {
    root.error("E209", nodes[most_rules]->place, "more than " + std::to_string(most_rules) + " overrides");
    return;
  }
  for (size_t i = 0; i < nodes.size(); ++i) {
    TableReader table(*nodes[i], "override[" + std::to_string(i) + "]", reading.complaints);
    const std::vector<Word> words = table.required_words("members", "\"C-A1-0\"");
    const std::string section_name = table.text("section", {}), panel_name = table.text("panel", {});
    const int section = find_named(reading.sections, table, "section", section_name, "section");
    std::vector<Place> opening_places;
    const bool has_openings = table.has("opening");
    const std::vector<Opening> openings = read_openings(table, opening_places);
    table.finish();
    if (table.is_table() && !table.has("section") && !table.has("panel") && !has_openings)
      table.missing("section", "say what is different: section, panel or opening");
    if (!reading.has_grid) continue;
    for (const int index : find_members(reading, table, "members", words)) {
      const Member& m = reading.plan.members[static_cast<size_t>(index)];
      Draft& draft = builder.drafts[{m.kind, m.storey, m.row_a, m.frame_a, m.row_b, m.frame_b}];
      const bool is_bar = m.kind == MemberKind::Column || m.kind == MemberKind::Beam;
      const char* misplaced = is_bar                                       ? (table.has("panel") ? "panel"
                                                                              : has_openings     ? "opening"
                                                                                                 : nullptr)
                              : table.has("section")                       ? "section"
                              : has_openings && m.kind == MemberKind::Slab ? "opening"
                                                                           : nullptr;
      if (misplaced) {
        table.error("E307", table.place_of(misplaced), std::string(misplaced) + ": is nothing that " + m.name + " has",
                    "columns and beams have a section, slabs and walls a panel, walls openings");
        break;
      }
      if (section >= 0) draft.member.section = section;
      if (!panel_name.empty()) {
        const bool is_wall = m.kind == MemberKind::Wall;
        const int panel =
            find_named(is_wall ? reading.walls : reading.slabs, table, "panel", panel_name, is_wall ? "wall" : "slab");
        if (panel < 0) break;
        draft.member.panel = panel;
      }
      if (has_openings) draft.member.openings = openings, draft.opening_places = opening_places;
      draft.shape = nodes[i]->place;
    }
  }
}

/// Loads of floors without a slab have nothing that carries them.
void warn_of_lost_loads(Reading& reading) {
  const Plan& plan = reading.plan;
  std::set<size_t> with_slab;
  for (const Member& m : plan.members)
    if (m.kind == MemberKind::Slab) with_slab.insert(static_cast<size_t>(m.storey));
  std::vector<std::string> without;
  for (size_t s = 0; s < plan.storey_loads.size(); ++s)
    if (plan.storey_loads[s] > 0 && !with_slab.count(s)) without.push_back(std::to_string(s));
  if (!without.empty())
    reading.complaints.warn(
        "W514", reading.load_place,
        "load: is left out above storey " + list_of(without) + ", where there is no slab to carry it",
        "add slabs, or give a list with 0 there");
}

void warn_of_unused(Reading& reading) {
  Plan& plan = reading.plan;
  for (const Member& m : plan.members) {
    if (m.section >= 0) reading.section_is_used[static_cast<size_t>(m.section)] = true;
    if (m.panel >= 0) reading.panel_is_used[static_cast<size_t>(m.panel)] = true;
  }
  for (size_t i = 0; i < plan.sections.size(); ++i)
    if (!reading.section_is_used[i])
      reading.complaints.warn("W503", reading.section_places[i],
                              "section." + plan.sections[i].name + ": no member has this section");
  for (size_t i = 0; i < plan.panels.size(); ++i)
    if (!reading.panel_is_used[i])
      reading.complaints.warn("W503", reading.panel_places[i], plan.panels[i].name + ": no member has this panel");
}

}  // namespace

bool matches(const std::string& pattern, const std::string& name) {
  size_t p = 0, n = 0, star = std::string::npos, mark = 0;
  while (n < name.size()) {
    if (p < pattern.size() && pattern[p] == '*') {
      star = p++, mark = n;
    } else if (p < pattern.size() && (pattern[p] == '?' || pattern[p] == name[n])) {
      ++p, ++n;
    } else if (star != std::string::npos) {
      p = star + 1, n = ++mark;
    } else {
      return false;
    }
  }
  while (p < pattern.size() && pattern[p] == '*') ++p;
  return p == pattern.size();
}

Sector read_sector(TableReader& table) {
  constexpr double whole = 360 * unit::deg;
  Sector s;
  s.azimuth = table.quantity("azimuth", Dimension::Angle, {-whole, whole}, 0);
  s.opening = table.quantity("opening", Dimension::Angle, {1 * unit::deg, whole}, whole);
  return s;
}

bool check_sector(const TableReader& table, const Member& m) {
  const bool is_shaft = m.kind == MemberKind::Shaft;
  for (const char* key : {"azimuth", "opening", "height"})
    if (!is_shaft && table.has(key)) {
      table.error("E307", table.place_of(key), std::string(key) + ": " + m.name + " is no shaft",
                  "only shafts have sectors");
      return false;
    }
  if (is_shaft && table.has("opening") != table.has("azimuth")) {
    table.missing(table.has("opening") ? "azimuth" : "opening",
                  "a sector of a shaft has azimuth = \"180 deg\" and opening = \"200 deg\"; neither: all around");
    return false;
  }
  return true;
}

double calc_length(const Member& m) { return norm(m.end - m.start); }

std::vector<int> find_members(const Reading& reading, const TableReader& table, const std::string& key,
                              const std::vector<Word>& words) {
  const std::vector<Member>& members = reading.plan.members;
  std::vector<bool> found(members.size(), false);
  for (const Word& word : words) {
    if (reading.complaints.is_full()) break;
    bool has_match = false;
    for (size_t i = 0; i < members.size(); ++i)
      if (matches(word.text, members[i].name)) found[i] = has_match = true;
    if (has_match || !reading.knows_members) continue;
    std::vector<std::string> names;
    for (const Member& m : members) names.push_back(m.name);
    const bool is_pattern = word.text.find_first_of("*?") != std::string::npos;
    table.error("E302", word.place,
                key + (is_pattern ? ": no member matches " : ": there is no member ") + quoted(word.text),
                did_you_mean(word.text, names,
                             names.empty() ? "the plan has no members" : "names look like " + members.front().name));
  }
  std::vector<int> indices;
  for (size_t i = 0; i < found.size(); ++i)
    if (found[i]) indices.push_back(static_cast<int>(i));
  return indices;
}

void read_members(Reading& reading, TableReader& root) {
  Builder builder{reading, {}, false};
  bool has_rules = false;
  for (const MemberKind kind : {MemberKind::Column, MemberKind::Beam, MemberKind::Slab, MemberKind::Wall}) {
    const std::string key = rule_key(kind);
    const int errors_before = reading.complaints.error_count();
    const std::vector<const Node*> nodes = root.tables(key);
    if (reading.complaints.error_count() != errors_before) reading.knows_members = false;
    has_rules = has_rules || root.has(key);
    if (nodes.size() > most_rules) {
      root.error("E209", nodes[most_rules]->place, key + ": more than " + std::to_string(most_rules) + " rules");
      continue;
    }
    for (size_t i = 0; i < nodes.size(); ++i) apply_rule(builder, kind, *nodes[i], key + "[" + std::to_string(i) + "]");
  }
  // a misspelt table: not all members are known
  for (const Entry& e : root.entries())
    if (!nearest_name(e.key, {"columns", "beams", "slabs", "walls"}).empty() && !root.has_read(e.key))
      reading.knows_members = false;
  if (!has_rules && !root.has("shafts")) root.missing("columns", "add [[columns]] with a section");

  Plan& plan = reading.plan;
  const auto publish = [&] {
    plan.members.clear();
    for (auto& [key, draft] : builder.drafts) plan.members.push_back(draft.member);
  };
  for (auto& [key, draft] : builder.drafts) {
    Member& m = draft.member;
    std::tie(m.kind, m.storey, m.row_a, m.frame_a, m.row_b, m.frame_b) = key;
    constexpr const char* letters[] = {"C-", "B-", "S-", "W-"};
    m.name = letters[static_cast<size_t>(m.kind)] + span_name(plan, key) + "-" + std::to_string(m.storey);
  }
  publish();
  apply_overrides(builder, root);
  finish_geometry(builder);
  publish();
  std::vector<Draft> drafts;
  for (auto& [key, draft] : builder.drafts) drafts.push_back(draft);
  // without them others hang in the air
  if (!reading.knows_members) return;
  check_support(plan, drafts, reading.complaints);
  if (reading.complaints.error_count() > 0) return;
  warn_of_lost_loads(reading);
  warn_of_unused(reading);
}

void read_preparation(Reading& reading, TableReader& root) {
  const Node* node = root.table("preparation");
  if (!node) return;
  TableReader table(*node, "preparation", reading.complaints);
  Plan& plan = reading.plan;
  const std::vector<Word> removed = table.words("removed");
  if (reading.has_grid && !removed.empty())
    for (const int i : find_members(reading, table, "removed", removed))
      plan.members[static_cast<size_t>(i)].removed = true;
  const std::vector<const Node*> nodes = table.tables("weaken");
  for (size_t i = 0; i < nodes.size() && !reading.complaints.is_full(); ++i) {
    TableReader weaken(*nodes[i], "weaken[" + std::to_string(i) + "]", reading.complaints);
    const std::vector<Word> words = weaken.required_words("members", "\"C-A1-0\"");
    Weakening w;
    w.at = weaken.quantity("at", Dimension::Length, {0, 1000});
    w.cut_bars = weaken.quantity("cut_bars", Dimension::Number, fraction, 0);
    w.cut_concrete = weaken.quantity("cut_concrete", Dimension::Number, fraction, 0);
    const Sector sector = read_sector(weaken);
    w.azimuth = sector.azimuth, w.opening = sector.opening;
    w.height = weaken.quantity("height", Dimension::Length, {0, 100, true}, 0.2);
    weaken.finish();
    if (!reading.has_grid) continue;
    for (const int index : find_members(reading, weaken, "members", words)) {
      Member& m = plan.members[static_cast<size_t>(index)];
      if (m.kind != MemberKind::Column && m.kind != MemberKind::Beam && m.kind != MemberKind::Shaft) {
        weaken.error("E307", weaken.place_of("members"), m.name + " is neither a column nor a beam nor a shaft",
                     "slabs and walls can be taken out under removed");
        break;
      }
      if (!check_sector(weaken, m)) break;
      if (m.kind != MemberKind::Shaft && w.cut_concrete > 0.95) {
        weaken.error("E205", weaken.place_of("cut_concrete"), "cut_concrete: at most 0.95 of " + m.name,
                     "what is taken out whole stands under removed");
        break;
      }
      if (m.removed) {
        weaken.error("E403", weaken.place_of("members"), m.name + " is taken out in the preparation");
        break;
      }
      if (w.at > calc_length(m) + round_off) {
        char length[32];
        std::snprintf(length, sizeof length, "%.4g m", calc_length(m));
        weaken.error("E306", weaken.place_of("at"), "at: lies beyond the end of " + m.name,
                     std::string("it is ") + length + " long");
        break;
      }
      m.weakenings.push_back(w);
    }
  }
  table.finish();
}

}  // namespace topple::product
