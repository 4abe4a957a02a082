#include "product/edited_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <utility>

#include "base/utf8.h"
#include "product/document.h"

namespace topple::product {

namespace {

[[noreturn]] void refuse(const std::string& why) {
  throw InputError("E933", "the plan's text cannot take the change: " + why, "write it into the text");
}

/// Lines with their ends.
std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> lines;
  for (size_t at = 0; at < text.size();) {
    const size_t end = std::min(text.find('\n', at), text.size() - 1) + 1;
    lines.push_back(text.substr(at, end - at));
    at = end;
  }
  return lines;
}

std::string trim(const std::string& line) {
  const size_t from = line.find_first_not_of(" \t\r\n");
  return from == std::string::npos ? "" : line.substr(from, line.find_last_not_of(" \t\r\n") + 1 - from);
}

std::string literal(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    if (static_cast<unsigned char>(c) < 0x20)
      out += fmt::format("\\u{:04x}", static_cast<unsigned char>(c));
    else
      out += c;
  }
  return out + "\"";
}

std::string quantity(double value, const char* unit) { return fmt::format("\"{} {}\"", value, unit); }

/// Places of the tables of a stage's charges in the text, in their order.
std::vector<std::pair<int, int>> list_tables(const Stage& stage) {
  std::vector<std::pair<int, int>> places;
  for (const Charge& c : stage.charges)
    if (const std::pair place{c.where.line, c.where.column};
        std::find(places.begin(), places.end(), place) == places.end())
      places.push_back(place);
  return places;
}

class Editor {
 public:
  Editor(const Plan& plan, const PlanChanges& changes) : plan_(plan), changes_(changes) {
    text_ = without_mark(plan.text);
    root_ = parse_document(text_, plan.path);
    lines_ = split(text_);
    if (!lines_.empty() && !lines_.back().ends_with('\n')) lines_.back() += '\n';
    find_heads(root_);
    std::vector<Diagnostic> warnings;
    before_ = read_plan(plan.text, plan.path, warnings);
  }

  const Plan& before() const { return before_; }

  std::string run() {
    std::string behind;
    // from the end to the front, so that places stay what they are
    if (changes_.stages) replace_stages(behind);
    if (changes_.friction) set_friction(behind);
    for (const auto& [member, cut] : changes_.cuts)
      behind += fmt::format("\n[[preparation.weaken]]\nmembers = [{}]\nat = {}\ncut_bars = {}\ncut_concrete = {}\n",
                            name_of_member(member), quantity(cut.at, "m"), cut.cut_bars, cut.cut_concrete);
    for (const Cable& c : changes_.cables)
      behind += fmt::format(
          "\n[[cable]]\nname = {}\nmember = {}\nposition = {}\nanchor = [{}, {}, {}]\nstiffness = {}\npretension = {}\n"
          "strength = {}\n",
          literal(c.name), name_of_member(c.member), quantity(c.position, "m"), quantity(c.anchor.x, "m"),
          quantity(c.anchor.y, "m"), quantity(c.anchor.z, "m"), quantity(c.stiffness, "N/m"),
          quantity(c.pretension, "N"), quantity(c.strength, "N"));
    std::string out;
    for (const std::string& line : lines_) out += line;
    return out + behind;
  }

 private:
  std::string& line(int number) { return lines_[static_cast<size_t>(number - 1)]; }
  std::string name_of_member(int index) const { return literal(plan_.members[static_cast<size_t>(index)].name); }

  /// Lines that begin a table.
  void find_heads(const Node& node) {
    if (node.kind == Node::Kind::Table && &node != &root_ && is_head(node)) heads_.insert(node.place.line);
    for (const Node& n : node.items) find_heads(n);
    for (const Entry& e : node.entries) find_heads(e.value);
  }
  bool is_head(const Node& n) const {
    const auto number = static_cast<size_t>(n.place.line);
    if (number > lines_.size()) return false;
    const std::string& text = lines_[number - 1];
    const size_t at = text.find_first_not_of(" \t");
    const int column = static_cast<int>(at) + 1;
    return at != std::string::npos && text[at] == '[' && n.place.column >= column && n.place.column <= column + 2;
  }

  /// One table for charges that differ in their members only.
  struct Table {
    Charge charge;
    std::vector<int> members;
  };
  static bool is_alike(const Charge& a, const Charge& b) {
    return a.position == b.position && a.destroyed_length == b.destroyed_length && a.residual_bars == b.residual_bars &&
           a.residual_concrete == b.residual_concrete && a.transition_damage == b.transition_damage &&
           a.delay == b.delay && a.scatter == b.scatter && a.fails == b.fails && a.azimuth == b.azimuth &&
           a.opening == b.opening;
  }
  bool is_as_it_was(const std::pair<int, int>& place, const Charge& now) const {
    for (const Stage& s : before_.stages)
      for (const Charge& c : s.charges)
        if (c.where.line == place.first && c.where.column == place.second) return is_alike(c, now);
    return false;
  }
  std::vector<Table> lay_out(const Stage& stage) const {
    // groups of one place in the text, in their order; each split into tables
    std::vector<std::pair<std::pair<int, int>, std::vector<Table>>> groups;
    for (const Charge& c : stage.charges) {
      const std::pair place{c.where.line, c.where.column};
      auto group = std::find_if(groups.begin(), groups.end(),
                                [&](const auto& g) { return place.first > 0 && g.first == place; });
      if (group == groups.end()) group = groups.insert(groups.end(), {place, {}});
      auto& tables = group->second;
      const auto same =
          std::find_if(tables.begin(), tables.end(), [&](const Table& t) { return is_alike(t.charge, c); });
      if (same == tables.end())
        tables.push_back({c, {c.member}});
      else
        same->members.push_back(c.member);
    }
    std::vector<Table> first, later;
    for (auto& group : groups) {
      const std::pair<int, int> place = group.first;
      std::vector<Table>& tables = group.second;
      // what is as it was keeps the place, else the largest
      auto keeps =
          std::find_if(tables.begin(), tables.end(), [&](const Table& t) { return is_as_it_was(place, t.charge); });
      if (keeps == tables.end())
        keeps = std::max_element(tables.begin(), tables.end(),
                                 [](const Table& a, const Table& b) { return a.members.size() < b.members.size(); });
      for (auto t = tables.begin(); t != tables.end(); ++t)
        (t == keeps && place.first > 0 ? first : later).push_back(*t);
    }
    first.insert(first.end(), later.begin(), later.end());
    return first;
  }

  std::string write_stage(const Stage& stage) const {
    std::string out = fmt::format("[[stage]]\nname = {}\ntime = {}\n", literal(stage.name), quantity(stage.time, "s"));
    for (const Table& t : lay_out(stage)) {
      std::string members;
      for (const int m : t.members) members += (members.empty() ? "" : ", ") + name_of_member(m);
      const Charge& c = t.charge;
      out +=
          fmt::format("\n[[stage.charge]]\nmembers = [{}]\nposition = {}\ndestroyed_length = {}\nresidual_bars = {}\n",
                      members, quantity(c.position, "m"), quantity(c.destroyed_length, "m"), c.residual_bars);
      if (c.residual_concrete > 0) out += fmt::format("residual_concrete = {}\n", c.residual_concrete);
      if (c.transition_damage > 0) out += fmt::format("transition_damage = {}\n", c.transition_damage);
      if (c.delay > 0) out += fmt::format("delay = {}\n", quantity(c.delay, "s"));
      if (c.scatter > 0) out += fmt::format("scatter = {}\n", quantity(c.scatter, "s"));
      if (c.fails) out += "fails = true\n";
      if (c.opening > 0 && c.opening < 2 * std::numbers::pi * (1 - 1e-12))
        out += fmt::format("azimuth = {}\nopening = {}\n", quantity(c.azimuth, "rad"), quantity(c.opening, "rad"));
    }
    return out + "\n";
  }

  /// Fuzzy paths count stages and their charges: their numbers must stay.
  void check_numbers() const {
    const std::vector<Stage>& stages = *changes_.stages;
    bool stay = stages.size() >= plan_.stages.size();
    for (size_t s = 0; stay && s < plan_.stages.size(); ++s) stay = stages[s].where.line == plan_.stages[s].where.line;
    for (const auto& places : plan_.fuzzy.places)
      for (const DocumentPath& p : places) {
        if (p.size() < 2 || p.front().key != "stage") continue;
        if (!stay) refuse("a stage would come before others, and [fuzzy] names stages by their numbers");
        if (p.size() >= 4 && p[2].key == "charge" && !keeps_charge(static_cast<size_t>(p[1].item), p[3].item))
          refuse("a charge would come before others, or be gone, and [fuzzy] names charges by their numbers");
      }
  }
  /// Whether a table of charges keeps its number in its stage; of stages that do.
  bool keeps_charge(size_t stage, int number) const {
    const std::vector<std::pair<int, int>> places = list_tables(before_.stages[stage]);
    const std::vector<Table> tables = lay_out((*changes_.stages)[stage]);
    const auto n = static_cast<size_t>(number);
    return n < places.size() && n < tables.size() &&
           std::pair{tables[n].charge.where.line, tables[n].charge.where.column} == places[n];
  }

  void replace_stages(std::string& behind) {
    check_numbers();
    std::string stages;
    for (const Stage& s : *changes_.stages) stages += write_stage(s);
    const Entry* entry = root_.find("stage");
    if (entry == nullptr) {
      behind += "\n" + stages;
      return;
    }
    // stretches of lines from a head of a stage or of one of its charges to the next head
    std::vector<int> begins;
    for (const Node& stage : entry->value.items) {
      if (!is_head(stage)) refuse("its stages stand in one line");
      begins.push_back(stage.place.line);
      if (const Entry* charges = stage.find("charge"))
        for (const Node& c : charges->value.items) {
          if (is_head(c))
            begins.push_back(c.place.line);
          else if (c.place.line < stage.place.line)
            refuse("its charges stand elsewhere");
        }
    }
    if (begins.empty()) refuse("its list of stages is empty");
    std::sort(begins.begin(), begins.end());
    for (const int begin : begins) {
      const auto next = heads_.upper_bound(begin);
      int end = next == heads_.end() ? static_cast<int>(lines_.size()) + 1 : *next;
      // comments above the next table are its own
      const bool is_stage = next != heads_.end() && std::binary_search(begins.begin(), begins.end(), *next);
      while (!is_stage && end > begin + 1 && next != heads_.end()) {
        const std::string above = trim(line(end - 1));
        if (!above.empty() && !above.starts_with('#')) break;
        --end;
      }
      for (int i = begin; i < end; ++i) line(i).clear();
    }
    line(begins.front()) = stages;
  }

  void set_friction(std::string& behind) {
    const std::string value = fmt::format("{}", *changes_.friction);
    const Entry* site = root_.find("site");
    const Entry* friction = site != nullptr ? site->value.find("friction") : nullptr;
    if (friction != nullptr) {
      // columns count characters
      std::string& text = line(friction->value.place.line);
      const auto byte = [&text](int column) {
        size_t at = 0;
        for (int c = 1; c < column && at < text.size(); ++c) do
            ++at;
          while (at < text.size() && (static_cast<unsigned char>(text[at]) & 0xC0) == 0x80);
        return at;
      };
      const Place& p = friction->value.place;
      const size_t from = byte(p.column), to = byte(p.column + p.width);
      text.replace(from, to - from, value);
    } else if (site == nullptr) {
      behind += "\n[site]\nfriction = " + value + "\n";
    } else if (trim(line(site->value.place.line)) == "[site]") {
      line(site->value.place.line) += "friction = " + value + "\n";
    } else {
      refuse("[site] has no line of its own");
    }
  }

  const Plan& plan_;
  const PlanChanges& changes_;
  std::string text_;
  Plan before_;  // as the text says it
  Node root_;
  std::vector<std::string> lines_;
  std::set<int> heads_;
};

/// A charge and where its table stands in the plan's document.
struct NumberedCharge {
  const Charge* charge = nullptr;
  int stage = 0, table = 0;  // from 0
};
std::vector<NumberedCharge> number_charges(const Plan& plan) {
  std::vector<NumberedCharge> out;
  for (size_t s = 0; s < plan.stages.size(); ++s) {
    const std::vector<std::pair<int, int>> tables = list_tables(plan.stages[s]);
    for (const Charge& c : plan.stages[s].charges) {
      const auto table = std::find(tables.begin(), tables.end(), std::pair{c.where.line, c.where.column});
      out.push_back({&c, static_cast<int>(s), static_cast<int>(table - tables.begin())});
    }
  }
  return out;
}

bool is_same_place(const Charge& a, const Charge& b) {
  const auto is_near = [](double x, double y) { return std::abs(x - y) <= 1e-9; };
  return a.member == b.member && is_near(a.position, b.position) && is_near(a.azimuth, b.azimuth) &&
         is_near(a.opening, b.opening);
}

/// What fuzzy values vary of charges they go on varying: one that has got a table of its own has a number of its own.
void check_fuzzy_charges(const Plan& before, const Plan& after) {
  const auto is_of_charge = [](const DocumentPath& p) {
    return p.size() > 4 && p[0].key == "stage" && p[2].key == "charge";
  };
  // the path of the same value of another charge
  const auto text_of = [](DocumentPath p, const NumberedCharge& c) {
    p[1].item = c.stage, p[3].item = c.table;
    std::string text;
    for (const DocumentStep& step : p) text += fmt::format("{} {}.", step.key, step.item);
    return text;
  };
  const std::vector<NumberedCharge> old = number_charges(before), now = number_charges(after);
  for (size_t i = 0; i < before.fuzzy.places.size(); ++i) {
    std::set<std::string> varied;
    for (const DocumentPath& p : after.fuzzy.places[i])
      if (is_of_charge(p)) varied.insert(text_of(p, {nullptr, p[1].item, p[3].item}));
    const auto check = [&](const DocumentPath& p, const Charge& was) {
      for (const NumberedCharge& c : now) {
        if (c.charge->fails || !is_same_place(*c.charge, was)) continue;
        // a delay that has been set is meant
        if (p.back().key == "delay" && c.charge->delay != was.delay) continue;
        if (!varied.contains(text_of(p, c)))
          refuse(
              fmt::format("[fuzzy] varies the charge on {} together with others by their number; a path with \"*\" "
                          "would go on doing so",
                          before.members[static_cast<size_t>(was.member)].name));
      }
    };
    for (const DocumentPath& p : before.fuzzy.places[i])
      for (const NumberedCharge& c : old)
        if (is_of_charge(p) && p[1].item == c.stage && p[3].item == c.table) check(p, *c.charge);
  }
}

}  // namespace

std::string write_changes(const Plan& plan, const PlanChanges& changes) {
  Editor editor(plan, changes);
  std::string text = editor.run();
  std::vector<Diagnostic> warnings;
  check_fuzzy_charges(editor.before(), read_plan(text, plan.path, warnings));
  return text;
}

}  // namespace topple::product
