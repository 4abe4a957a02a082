#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <set>

#include "base/error.h"
#include "base/unit.h"
#include "base/words.h"
#include "product/clip.h"
#include "product/foreign_text.h"
#include "product/ifc_names.h"
#include "product/ifc_reinforcement.h"
#include "product/import.h"
#include "product/plan_limits.h"
#include "product/reading.h"
#include "product/support.h"

namespace topple::product {

namespace {

constexpr const char* kNoMaterial = "unknown";            // the key of concrete that has no name in the file
constexpr double kSpacing = limits::line_spacing + 1e-3;  // of grid lines, which are rounded [m]
const double kRound = std::sqrt(std::acos(-1.0) / 4);     // side of a square over the diameter of a circle of its area
constexpr double kOverlap = 0.1;                          // of heights in which two elements stand side by side [m]
constexpr double kLack = 0.1;                             // of a bay or a storey, which is told when completed [m]
constexpr double kOff = 0.6;                              // how far an element may lie off its place [m]
constexpr double kLeast = 1 - 4e-4;                       // height of a storey, which is rounded to millimetres [m]

/// Middles of groups of values that lie closer together than the spacing of grid lines.
std::vector<double> find_lines(std::vector<double> values) {
  struct Group {
    double first = 0, sum = 0;
    int count = 0;
    double middle() const { return sum / count; }
  };
  std::sort(values.begin(), values.end());
  std::vector<Group> groups;
  for (const double v : values) {
    if (groups.empty() || v - groups.back().first >= kSpacing) groups.push_back({v, 0, 0});
    groups.back().sum += v, ++groups.back().count;
  }
  std::vector<Group> apart;
  for (const Group& g : groups) {
    apart.push_back(g);
    for (size_t n = apart.size(); n > 1 && apart[n - 1].middle() - apart[n - 2].middle() < kSpacing; --n) {
      apart[n - 2].sum += apart[n - 1].sum, apart[n - 2].count += apart[n - 1].count;
      apart.pop_back();
    }
  }
  std::vector<double> lines;
  for (const Group& g : apart) lines.push_back(g.middle());
  return lines;
}
int nearest(const std::vector<double>& lines, double value) {
  int best = 0;
  for (size_t i = 1; i < lines.size(); ++i)
    if (std::abs(lines[i] - value) < std::abs(lines[static_cast<size_t>(best)] - value)) best = static_cast<int>(i);
  return best;
}

std::string letters(int i) {
  std::string out;
  for (int n = i; n >= 0; n = n / 26 - 1) out.insert(out.begin(), static_cast<char>('A' + n % 26));
  return out;
}
/// Rows and frames of the points of a place, "A1" or "A1B2".
std::vector<std::array<int, 2>> points_of(const std::string& place) {
  std::vector<std::array<int, 2>> out;
  for (size_t at = 0; at < place.size();) {
    int row = 0, frame = 0;
    for (; at < place.size() && place[at] >= 'A'; ++at) row = 26 * row + (place[at] - 'A') + 1;
    for (; at < place.size() && place[at] < 'A'; ++at) frame = 10 * frame + (place[at] - '0');
    out.push_back({row - 1, frame - 1});
  }
  return out;
}
std::string metres(double x) { return fmt::format("\"{:.3f} m\"", std::abs(x) < 5e-4 ? 0.0 : x); }
std::string centimetres(double x) { return fmt::format("\"{:g} cm\"", std::round(x * 1000) / 10); }
std::string millimetres(double x) { return fmt::format("\"{:g} mm\"", std::round(x * 1e4) / 10); }

class Planner {
 public:
  Planner(const IfcBuilding& b, const std::string& file) : b_(b), file_(file) {}

  Import make() {
    if (b_.has_unit) {
      taken(fmt::format("the file's unit is {:g} m", b_.length_unit));
    } else {
      guessed("the file's numbers are metres: it names no unit of length");
    }
    gather();
    find_grid();
    const Claims columns = place_columns();
    const Claims walls = claim_walls();
    place_beams(walls);
    place_slabs();
    tell_short_columns(columns);
    place_walls(walls);
    count_rest();
    if (const auto meshes = std::count_if(b_.elements.begin(), b_.elements.end(),
                                          [](const IfcElement& e) { return e.is_mesh && e.has_box; });
        meshes > 0)
      guessed(fmt::format(
          "{} elements are meshes of faces, or cut obliquely: their boxes were taken, as they fill them", meshes));
    if (const auto cut = std::count_if(b_.elements.begin(), b_.elements.end(),
                                       [](const IfcElement& e) { return e.is_cut && e.has_box; });
        cut > 0)
      taken(fmt::format("{} elements are cut along planes: what is left of them was taken", cut));
    if (const auto whole = std::count_if(b_.elements.begin(), b_.elements.end(),
                                         [](const IfcElement& e) { return e.is_whole && e.has_box; });
        whole > 0)
      missing(fmt::format("{} elements are cut by bodies that are not read: they are taken whole", whole));
    write();
    tell_faults();
    return {std::move(text_), std::move(report_)};
  }
  /// What a plan of this building is refused for when its gaps are filled, as slabs that hang in the air.
  void tell_faults() {
    const std::vector<std::string> faults = check_filled_import(text_, "E112", file_);
    constexpr size_t most_named = 10;
    for (size_t i = 0; i < std::min(faults.size(), most_named); ++i)
      missing("when its gaps are filled, the plan is still refused: " + faults[i]);
    if (faults.size() > most_named) missing(fmt::format("the same for {} more reasons", faults.size() - most_named));
  }

 private:
  struct Group {
    std::string concrete;
    double width = 0, height = 0;  // or thickness
    bool is_round = false;
    std::vector<const IfcElement*> elements;
    std::map<int, std::vector<std::string>> places;  // by storey
  };

  void taken(std::string s) { report_.taken.push_back(std::move(s)); }
  void guessed(std::string s) { report_.guessed.push_back(std::move(s)); }
  void missing(std::string s) { report_.missing.push_back(std::move(s)); }
  void left_out(const IfcElement& e, const std::string& why) { ++left_out_[kind_of(e.type) + ": " + why]; }
  static std::string kind_of(const std::string& type) { return type.starts_with("IFC") ? type.substr(3) : type; }

  [[noreturn]] void fail(const std::string& what, std::string help) const {
    if (!b_.has_unit) help += "; it names none of length, and was taken in metres";
    throw InputError(std::vector<Diagnostic>{{Severity::Error, "E112", {file_, 0, 0}, 1, what, help}});
  }

  static double whole_thickness(const IfcElement& e) {
    const Vec3 size = e.high - e.low;
    return e.type == "IFCSLAB" ? size.z : std::min(size.x, size.y);
  }
  /// Whether the layers of a wall's or slab's material are those of its body.
  static bool has_layers(const IfcElement& e) {
    const double whole = whole_thickness(e);
    return e.layers > 0 && std::abs(e.layers - whole) < 0.01 + 0.02 * whole;
  }
  /// That of the layers that carry.
  static double thickness_of(const IfcElement& e) {
    const double whole = whole_thickness(e);
    return has_layers(e) && e.layers - e.carrying > 1e-3 ? std::min(e.carrying, whole) : whole;
  }
  /// How many elements have less than `enough` of something, and the one that has least.
  static std::pair<int, const IfcElement*> find_least(const std::vector<Group>& groups, double IfcElement::*share,
                                                      double enough) {
    std::pair<int, const IfcElement*> out{0, nullptr};
    for (const Group& g : groups)
      for (const IfcElement* e : g.elements) {
        if (e->*share >= enough) continue;
        ++out.first;
        if (out.second == nullptr || e->*share < out.second->*share) out.second = e;
      }
    return out;
  }
  void tell_layers(const std::vector<Group>& groups, const char* kind) {
    struct Kind {
      int layered = 0, whole = 0;
    };
    std::map<std::array<std::string, 3>, Kind> kinds;  // by their thicknesses and material
    const auto in_mm = [](double x) { return fmt::format("{:.0f} mm", 1000 * x); };
    for (const Group& g : groups)
      for (const IfcElement* e : g.elements) {
        const double whole = whole_thickness(*e);
        if (!(e->layers - e->carrying > 1e-3) || std::abs(whole - e->carrying) < 1e-3) continue;
        Kind& kind_of_it = kinds[{in_mm(whole), in_mm(e->carrying), clean_text(e->material)}];
        ++(has_layers(*e) ? kind_of_it.layered : kind_of_it.whole);
      }
    for (const auto& [what, n] : kinds) {
      const auto& [whole, carrying, material] = what;
      const std::string of = material.empty() ? "a material without a name" : material;
      if (n.layered > 0)
        guessed(
            fmt::format("{} of several layers, {} in all: {} of {} carry and were taken, the other layers are left "
                        "out (their weight is a load)",
                        count_words(n.layered, kind), whole, carrying, of));
      if (n.whole > 0)
        guessed(
            fmt::format("{} of several layers, which do not add up to the thickness of the body, {}: all of it was "
                        "taken as {}",
                        count_words(n.whole, kind), whole, of));
    }
  }

  /// Elements with a body of a size that a plan can hold, by type.
  void gather() {
    const auto fits = [](double low, double high, const Range& range) {
      return low > range.low - 1e-6 && high < range.high + 1e-6;
    };
    for (const IfcElement& e : b_.elements) {
      const bool is_column = e.type == "IFCCOLUMN", is_slab = e.type == "IFCSLAB";
      if (!is_column && !is_slab && e.type != "IFCBEAM" && e.type != "IFCWALL") continue;
      const Vec3 size = e.high - e.low;
      const double across = std::min(size.x, size.y), thickness = thickness_of(e);
      const double low = e.is_round ? kRound * e.diameter : is_column ? across : std::min(across, size.z);
      const double high = is_column ? std::max(size.x, size.y) : std::max(across, size.z);
      if (!e.has_box) {
        left_out(e, e.why.empty() ? "its body is no extruded profile" : e.why);
      } else if (is_slab || e.type == "IFCWALL") {
        if (fits(thickness, thickness, limits::panel_thickness)) {
          fit_[e.type].push_back(&e);
        } else {
          left_out(e, "its thickness is not between 3 cm and 3 m");
        }
      } else if (fits(low, high, limits::section_size)) {
        fit_[e.type].push_back(&e);
      } else {
        left_out(e, "the sides of its section are not between 5 cm and 10 m");
      }
    }
    if (fit_["IFCCOLUMN"].empty())
      fail("it has no column of 5 cm to 10 m in section",
           "a plan's grid is made from its columns; look at the unit of the file");
  }

  void find_grid() {
    std::vector<double> xs, ys, tops;
    double bottom = 1e30, top = -1e30;
    for (const IfcElement* e : fit_["IFCCOLUMN"]) {
      xs.push_back(0.5 * (e->low.x + e->high.x));
      ys.push_back(0.5 * (e->low.y + e->high.y));
      bottom = std::min(bottom, e->low.z);
      top = std::max(top, e->high.z);
      tops.push_back(e->high.z);
    }
    rows_ = find_lines(xs);
    frames_ = find_lines(ys);
    // the last floor: the storey nearest to the tops of columns, which may end below its slab or in a parapet
    double roof = top, off = 1;
    for (const auto& [name, z] : b_.storeys)
      if (z >= bottom + kLeast && z < top + kOff && std::abs(z - top) < off) roof = z, off = std::abs(z - top);
    // the others: the storeys between it and the feet of columns
    levels_.push_back(bottom);
    int close = 0;
    for (const auto& [name, z] : b_.storeys) {
      if (z >= levels_.back() + kLeast && z <= roof - kLeast) {
        levels_.push_back(z);
      } else if (z > levels_.back() + 0.05 && z < roof - 0.05) {
        ++close;
      }
    }
    if (close > 0)
      guessed(fmt::format("{} storeys of the file lie less than 1 m from a floor and are left out", close));
    if (levels_.size() == 1) {
      for (const double z : find_lines(tops))
        if (z >= levels_.back() + kLeast && z <= roof - kLeast) levels_.push_back(z);
      if (levels_.size() > 1) guessed("the file has no storeys where its columns stand: floors are where columns end");
    }
    levels_.push_back(roof);
    check_grid();
    taken(fmt::format("{} by {} and {}, from the places of {} and {} of the file",
                      count_words(std::ssize(rows_), "row"), count_words(std::ssize(frames_), "frame"),
                      count_words(std::ssize(levels_) - 1, "storey"), count_words(std::ssize(xs), "column"),
                      count_words(std::ssize(b_.storeys), "storey")));
    if (std::abs(b_.angle) > 1e-4)
      guessed(fmt::format("the building's own axes, turned by {:.1f} deg against the file's x, are those of the plan",
                          b_.angle / unit::deg));
    guessed("the ground lies at the feet of the lowest columns; check it against the terrain");
  }
  /// Refuses a grid that no plan can hold.
  void check_grid() {
    for (const bool is_x : {true, false}) {
      const std::vector<double>& lines = is_x ? rows_ : frames_;
      const double reach = lines.back() - lines.front();
      if (reach > limits::line_offset.high) {
        const double middle = lines[lines.size() / 2];
        const auto distance = [&](const IfcElement* e) {
          return std::abs(0.5 * (is_x ? e->low.x + e->high.x : e->low.y + e->high.y) - middle);
        };
        const auto& columns = fit_["IFCCOLUMN"];
        const IfcElement* far = *std::max_element(
            columns.begin(), columns.end(), [&](const auto* a, const auto* b) { return distance(a) < distance(b); });
        fail(fmt::format("its columns stand over {:.0f} m; the grid of a plan reaches over 1000 m", reach),
             fmt::format("#{} stands far from the others; look at it and at the unit of the file", far->id));
      }
    }
    if (rows_.size() > limits::lines || frames_.size() > limits::lines || storeys() > most_storeys ||
        rows_.size() * frames_.size() * static_cast<size_t>(storeys()) > most_members)
      fail(fmt::format("its columns give {} rows by {} frames and {} storeys, too many for a plan", rows_.size(),
                       frames_.size(), storeys()),
           "give a file of one building, and look at its unit");
    for (size_t s = 0; s + 1 < levels_.size(); ++s)
      if (const double h = levels_[s + 1] - levels_[s]; !(h > kLeast - 1e-9 && h < 50.0004))
        fail(fmt::format("storey {} would be {:.3f} m high; those of a plan are 1 m to 50 m", s, h),
             "look at the unit of the file, at its storeys and at the heights of its columns");
  }
  int storeys() const { return static_cast<int>(levels_.size()) - 1; }
  std::string point(int row, int frame) const { return letters(row) + std::to_string(frame + 1); }

  static size_t group_of(std::vector<Group>& groups, const IfcElement& e, double width, double height) {
    const std::string concrete = e.material.empty() ? kNoMaterial : e.material;
    for (size_t i = 0; i < groups.size(); ++i)
      if (groups[i].concrete == concrete && std::abs(groups[i].width - width) < 2e-3 &&
          std::abs(groups[i].height - height) < 2e-3)
        return i;
    groups.push_back({concrete, width, height, false, {}, {}});
    return groups.size() - 1;
  }

  /// Widths and heights, or thicknesses, as the plan has them, by storey and place.
  using Sizes = std::map<std::pair<int, std::string>, std::pair<double, double>>;

  /// Who stands where in which storey: of several the larger one.
  struct Claim {
    const IfcElement* element = nullptr;
    size_t group = 0;
    double size = 0;
  };
  struct Claims {
    std::vector<Claim> all;
    std::map<std::pair<int, std::string>, Claim> at;
    std::set<std::pair<int, std::string>> contested;
    std::multimap<std::pair<int, std::string>, Claim> parts;  // go on where another one of their group ends

    void add(const Claim& claim, int storey, const std::string& place) {
      const auto [known, is_new] = at.try_emplace({storey, place}, claim);
      if (is_new) return;
      Claim& held = known->second;
      const IfcElement &a = *held.element, &b = *claim.element;
      if (held.group == claim.group && (a.type == "IFCCOLUMN" || a.type == "IFCWALL") &&
          std::min(a.high.z, b.high.z) - std::max(a.low.z, b.low.z) < kOverlap) {
        parts.emplace(known->first, claim);
        return;
      }
      contested.insert(known->first);
      if (claim.size > held.size + 1e-9) held = claim;
    }
  };
  /// Gives the groups their elements and places; says how many there are and who is left out.
  int settle(std::vector<Group>& groups, const Claims& claims, const char* kind, const char* which,
             Sizes* sizes = nullptr) {
    std::set<const IfcElement*> standing;
    for (const auto& [where, claim] : claims.at) {
      if (sizes != nullptr) (*sizes)[where] = {groups[claim.group].width, groups[claim.group].height};
      groups[claim.group].places[where.first].push_back(where.second);
      standing.insert(claim.element);
    }
    for (const auto& [where, part] : claims.parts)
      if (claims.at.at(where).group == part.group) standing.insert(part.element);
    int placed = 0;
    for (const Claim& claim : claims.all)
      if (standing.count(claim.element) > 0) {
        Group& g = groups[claim.group];
        g.elements.push_back(claim.element);
        g.is_round |= claim.element->is_round;
        ++placed;
      } else {
        left_out(*claim.element, "another one stands in its place");
      }
    std::erase_if(groups, [](const Group& g) { return g.elements.empty(); });
    if (!claims.contested.empty())
      guessed(fmt::format(
          "{} several {}: the {} one was taken",
          claims.contested.size() == 1 ? "1 place has" : fmt::format("{} places have", claims.contested.size()), kind,
          which));
    return placed;
  }

  void tell_placed(int placed, const char* kind, size_t groups, const char* group) {
    taken(fmt::format("{} in {}", count_words(placed, kind), count_words(static_cast<long long>(groups), group)));
  }

  Claims place_columns() {
    Claims claims;
    double most = 0;  // that one is moved to its place
    const IfcElement* farthest = nullptr;
    for (const IfcElement* e : fit_["IFCCOLUMN"]) {
      double w = e->high.x - e->low.x, h = e->high.y - e->low.y;
      if (e->is_round) w = h = kRound * e->diameter;
      const Claim claim{e, group_of(columns_, *e, w, h), w * h};
      const Vec3 middle = 0.5 * (e->low + e->high);
      const int row = nearest(rows_, middle.x), frame = nearest(frames_, middle.y);
      const std::string place = point(row, frame);
      bool any = false;
      for (int s = 0; s < storeys(); ++s) {
        if (!reaches_over(*e, s)) continue;
        claims.add(claim, s, place);
        any = true;
      }
      if (any) {
        claims.all.push_back(claim);
        const double moved =
            std::hypot(rows_[static_cast<size_t>(row)] - middle.x, frames_[static_cast<size_t>(frame)] - middle.y);
        if (moved > most) most = moved, farthest = e;
      } else {
        left_out(*e, "reaches over less than half of every storey");
      }
    }
    const int placed = settle(columns_, claims, "columns", "larger", &column_at_);
    tell_placed(placed, "column", columns_.size(), "section");
    if (most > 1e-3)
      guessed(
          fmt::format("rows and frames lie at the mean of the columns that stand beside each other: columns were "
                      "moved by up to {:.1f} cm (#{})",
                      100 * most, farthest->id));
    tell_round(columns_, "columns");
    tell_opened(columns_, "column");
    return claims;
  }
  void tell_opened(const std::vector<Group>& groups, const char* kind) {
    int opened = 0;
    for (const Group& g : groups)
      for (const IfcElement* e : g.elements) opened += e->has_opening;
    if (opened > 0)
      missing(fmt::format("openings of {}: they are not read, the {}{} taken whole", count_words(opened, kind), kind,
                          opened == 1 ? " is" : "s are"));
  }
  void tell_round(const std::vector<Group>& groups, const char* what) {
    for (const Group& g : groups)
      if (g.is_round)
        guessed(fmt::format("round {} became square ones of the same area, {:.0f} cm wide", what, 100 * g.width));
  }
  /// Whether an upright element takes half of a storey's height.
  bool reaches_over(const IfcElement& e, int s) const {
    const double low = levels_[static_cast<size_t>(s)], high = levels_[static_cast<size_t>(s) + 1];
    return std::min(e.high.z, high) - std::max(e.low.z, low) >= 0.5 * (high - low);
  }

  /// Storey whose upper floor is nearest to a height; -1 if none is near.
  int storey_below(double z) const {
    int best = -1;
    double off = kOff;
    for (int s = 0; s < storeys(); ++s)
      if (const double d = std::abs(levels_[static_cast<size_t>(s) + 1] - z); d < off) best = s, off = d;
    return best;
  }

  double storey_height(int s) const { return levels_[static_cast<size_t>(s) + 1] - levels_[static_cast<size_t>(s)]; }

  /// Edges of the grid that an element runs along.
  struct Edges {
    std::vector<std::string> places;
    bool has_loose_end = false;  // a part of a beam ends off the grid points: a cantilever
  };
  Edges edges_of(const IfcElement& e, std::optional<int> storey_of_beam = {}) const {
    Edges out;
    const double dx = e.high.x - e.low.x, dy = e.high.y - e.low.y;
    const bool along_x = dx >= dy;
    const std::vector<double>&lines = along_x ? rows_ : frames_, &across = along_x ? frames_ : rows_;
    const int low_axis = along_x ? 0 : 1, mid_axis = 1 - low_axis;
    const double middle = 0.5 * (e.low[mid_axis] + e.high[mid_axis]);
    const int line = nearest(across, middle);
    if (std::abs(across[static_cast<size_t>(line)] - middle) > kOff) return out;
    const auto point_at = [&](size_t i) {
      const int a = static_cast<int>(i);
      return along_x ? point(a, line) : point(line, a);
    };
    // how far from a grid point a beam may end: at the face of its column, or near it
    const auto reach = [&](size_t i) {
      const double half = std::max(half_column(*storey_of_beam, point_at(i), along_x),
                                   half_column(*storey_of_beam + 1, point_at(i), along_x));
      return std::max(kOff, half + 0.2 + limits::line_spacing);  // a column may have been moved to its line
    };
    std::optional<size_t> first, last;
    for (size_t i = 0; i + 1 < lines.size(); ++i) {
      const double covered = std::min(e.high[low_axis], lines[i + 1]) - std::max(e.low[low_axis], lines[i]);
      if (covered < 0.6 * (lines[i + 1] - lines[i])) continue;
      if (storey_of_beam && (e.low[low_axis] > lines[i] + reach(i) || e.high[low_axis] < lines[i + 1] - reach(i + 1))) {
        out.has_loose_end = true;
        continue;
      }
      if (!first) first = i;
      last = i + 1;
      out.places.push_back(point_at(i) + point_at(i + 1));
    }
    if (storey_of_beam && first)
      out.has_loose_end |=
          e.low[low_axis] < lines[*first] - reach(*first) || e.high[low_axis] > lines[*last] + reach(*last);
    return out;
  }

  /// Columns, walls and these beams by their places, for what carries what.
  std::vector<Draft> make_drafts(const Claims& walls, const std::set<std::pair<int, std::string>>& beams) const {
    std::vector<Draft> drafts;
    const auto add = [&drafts](MemberKind kind, int storey, const std::string& place) {
      const auto points = points_of(place);
      Member m;
      m.kind = kind, m.storey = storey;
      m.row_a = points.front()[0], m.frame_a = points.front()[1];
      m.row_b = points.back()[0], m.frame_b = points.back()[1];
      drafts.push_back({m, {}, {}, {}});
    };
    for (const auto& [s, place] : beams) add(MemberKind::Beam, s, place);  // first: their indices are those of the set
    for (const Group& g : columns_)
      for (const auto& [s, places] : g.places)
        for (const std::string& place : places) add(MemberKind::Column, s, place);
    for (const auto& [where, claim] : walls.at) add(MemberKind::Wall, where.first, where.second);
    return drafts;
  }
  /// Takes those away that hang in the air, and what they carried.
  void keep_carried(std::set<std::pair<int, std::string>>& beams, const Claims& walls) const {
    for (;;) {
      const std::vector<size_t> hanging = find_hanging_beams(make_drafts(walls, beams));
      if (hanging.empty()) return;
      const std::vector<std::pair<int, std::string>> list(beams.begin(), beams.end());
      for (const size_t i : hanging) beams.erase(list[i]);
    }
  }

  void place_beams(const Claims& walls) {
    struct Run {
      const IfcElement* element = nullptr;
      int storey = 0;
      std::vector<std::string> edges;
    };
    std::vector<Run> runs;
    std::set<std::pair<int, std::string>> carried;
    for (const IfcElement* e : fit_["IFCBEAM"]) {
      const int s = storey_below(e->high.z);
      const Edges edges = s < 0 ? Edges{} : edges_of(*e, s);
      if (s < 0) {
        left_out(*e, "its top is not level with a floor");
      } else if (e->high.z - e->low.z >= storey_height(s)) {
        left_out(*e, "is as deep as its storey is high");
      } else if (edges.places.empty()) {
        left_out(*e, edges.has_loose_end ? "one end of it is far from the grid's points, as of a cantilever"
                                         : "does not run between columns of the grid");
      } else {
        if (edges.has_loose_end) left_out(*e, "a part of it stands out beyond the last grid point, as a cantilever");
        runs.push_back({e, s, edges.places});
        for (const std::string& edge : edges.places) carried.emplace(s, edge);
      }
    }
    keep_carried(carried, walls);
    Claims claims;
    for (Run& run : runs) {
      const IfcElement& e = *run.element;
      const auto hanging = std::erase_if(run.edges, [&](const std::string& edge) {
        return carried.count({run.storey, edge}) == 0;
      });
      const char* why = "hangs in the air: no column or wall stands below its end";
      if (hanging > 0) left_out(e, run.edges.empty() ? why : std::string("a span of it ") + why);
      if (run.edges.empty()) continue;
      double width = std::min(e.high.x - e.low.x, e.high.y - e.low.y), height = e.high.z - e.low.z;
      if (e.is_round) width = height = kRound * e.diameter;
      claims.all.push_back({&e, group_of(beams_, e, width, height), width * height});
      for (const std::string& edge : run.edges) claims.add(claims.all.back(), run.storey, edge);
    }
    const int placed = settle(beams_, claims, "beams", "larger", &beam_at_);
    if (placed > 0) tell_placed(placed, "beam", beams_.size(), "section");
    tell_round(beams_, "beams");
    tell_opened(beams_, "beam");
    tell_floors(claims, "beams");
    tell_edges(claims, "beam", false);
  }

  static bool covers(const IfcElement& slab, double x, double y) {
    if (slab.outlines.empty()) return x >= slab.low.x && x <= slab.high.x && y >= slab.low.y && y <= slab.high.y;
    return std::any_of(slab.outlines.begin(), slab.outlines.end(), [&](const auto& part) {
      bool is_inside = false;
      for (const Loop& loop : part) is_inside ^= lies_within(loop, x, y);
      return is_inside;
    });
  }

  void place_slabs() {
    Claims claims;
    for (const IfcElement* e : fit_["IFCSLAB"]) {
      const int s = storey_below(e->high.z);
      const double thickness = thickness_of(*e);
      if (s < 0) {
        left_out(*e, "is not level with a floor above a storey (a base slab lies on the ground)");
        continue;
      }
      if (thickness >= storey_height(s)) {
        left_out(*e, "is as thick as its storey is high");
        continue;
      }
      const Claim claim{e, group_of(slabs_, *e, thickness, 0), thickness};
      bool any = false;
      for (size_t i = 0; i + 1 < rows_.size(); ++i)
        for (size_t k = 0; k + 1 < frames_.size(); ++k) {
          const double x = 0.5 * (rows_[i] + rows_[i + 1]), y = 0.5 * (frames_[k] + frames_[k + 1]);
          if (!covers(*e, x, y)) continue;
          claims.add(claim, s,
                     point(static_cast<int>(i), static_cast<int>(k)) +
                         point(static_cast<int>(i) + 1, static_cast<int>(k) + 1));
          any = true;
        }
      if (any) {
        claims.all.push_back(claim);
      } else {
        left_out(*e, "covers no cell of the grid");
      }
    }
    const int placed = settle(slabs_, claims, "slabs", "thicker", &slab_at_);
    if (placed > 0) {
      tell_placed(placed, "slab", slabs_.size(), "thickness");
      tell_floors(claims, "slabs");
      tell_layers(slabs_, "slab");
      if (const auto [number, least] = find_least(slabs_, &IfcElement::plate, 1 - 1e-6); number > 0)
        guessed(
            fmt::format("{} of several parts: the plate was taken, {:.0f} % of the volume at least (#{}), without "
                        "ribs, kerbs and drop panels",
                        count_words(number, "slab"), 100 * least->plate, least->id));
      int opened = 0;
      for (const Group& g : slabs_)
        for (const IfcElement* e : g.elements) opened += e->has_opening;
      if (opened > 0) missing(fmt::format("openings of {}: they are not read", count_words(opened, "slab")));
      guessed(
          "a slab covers every cell of the grid whose middle lies in its outline, or in the box of a mesh: smaller "
          "holes and cut corners are not seen");
    }
  }

  Claims claim_walls() {
    Claims claims;
    for (const IfcElement* e : fit_["IFCWALL"]) {
      const double thickness = thickness_of(*e);
      const std::vector<std::string> edges = edges_of(*e).places;
      const Claim claim{e, group_of(walls_, *e, thickness, 0), thickness};
      bool any = false;
      for (int s = 0; s < storeys() && !edges.empty(); ++s) {
        if (!reaches_over(*e, s)) continue;
        for (const std::string& edge : edges) claims.add(claim, s, edge);
        any = true;
      }
      if (any) {
        claims.all.push_back(claim);
      } else {
        left_out(*e, edges.empty() ? "does not stand between columns of the grid"
                                   : "reaches over less than half of every storey");
      }
    }
    return claims;
  }
  void place_walls(const Claims& claims) {
    const int placed = settle(walls_, claims, "walls", "thicker");
    if (placed > 0) {
      tell_placed(placed, "wall", walls_.size(), "thickness");
      tell_edges(claims, "wall", true);
      tell_layers(walls_, "wall");
      if (const auto [number, least] = find_least(walls_, &IfcElement::filled, 0.9); number > 0)
        guessed(
            fmt::format("{} {} only a part of the box around, {:.0f} % at least (#{}): openings and recesses in an "
                        "outline are not seen, the box was taken",
                        count_words(number, "wall"), number == 1 ? "fills" : "fill", 100 * least->filled, least->id));
      place_openings(claims);
    }
  }

  /// Half of what a column takes of the length of a wall or beam, and what lies on a wall or at the top of a column, as
  /// the plan has them; 0: nothing.
  double half_column(int s, const std::string& place, bool along_x) const {
    const auto column = column_at_.find({s, place});
    return column == column_at_.end() ? 0 : 0.5 * (along_x ? column->second.first : column->second.second);
  }
  double depth_of_beam(int s, int row, int frame, bool along_x) const {
    const auto beam = beam_at_.find({s, point(row, frame) + (along_x ? point(row + 1, frame) : point(row, frame + 1))});
    return beam == beam_at_.end() ? 0 : beam->second.second;
  }
  double depth_of_slab(int s, int row, int frame) const {
    const auto slab = slab_at_.find({s, point(row, frame) + point(row + 1, frame + 1)});
    return slab == slab_at_.end() ? 0 : slab->second.first;
  }
  double depth_above(int s, int row, int frame, bool along_x) const {
    double depth = depth_of_beam(s, row, frame, along_x);
    for (const int side : {-1, 0})
      depth = std::max(depth, depth_of_slab(s, row + (along_x ? 0 : side), frame + (along_x ? side : 0)));
    return depth;
  }
  double depth_at(int s, int row, int frame) const {
    double depth = 0;
    for (const int side : {-1, 0}) {
      depth = std::max({depth, depth_of_beam(s, row + side, frame, true), depth_of_beam(s, row, frame + side, false)});
      for (const int other : {-1, 0}) depth = std::max(depth, depth_of_slab(s, row + side, frame + other));
    }
    return depth;
  }

  /// The largest of some values and whose it is.
  struct Largest {
    double value = 0;
    const IfcElement* of = nullptr;
    void note(double v, const IfcElement& e) {
      if (v > value) value = v, of = &e;
    }
  };
  void tell_moved(const Largest& moved, const char* kinds, const char* where) {
    if (moved.value > 1e-3)
      guessed(fmt::format("{} were moved to their {} by up to {:.1f} cm (#{})", kinds, where, 100 * moved.value,
                          moved.of->id));
  }
  void tell_floors(const Claims& claims, const char* kinds) {
    Largest moved;
    for (const auto& [where, claim] : claims.at)
      moved.note(std::abs(levels_[static_cast<size_t>(where.first) + 1] - claim.element->high.z), *claim.element);
    tell_moved(moved, kinds, "floors");
  }

  /// Elements that fill only a part of what they take in the plan.
  struct Partial {
    std::set<const IfcElement*> elements;
    Largest lacking;  // share
    void note(double covered, double whole, const IfcElement& e) {
      if (whole - covered < kLack) return;
      elements.insert(&e);
      lacking.note(1 - std::max(0.0, covered) / whole, e);
    }
  };
  void tell_partial(const Partial& partial, const char* kind, const char* of) {
    const auto n = std::ssize(partial.elements);
    if (n > 0)
      guessed(fmt::format("{} only a part of {} {}, {:.0f} % at least (#{}): {} completed",
                          count_words(n, kind) + (n == 1 ? " fills" : " fill"), n == 1 ? "its" : "their",
                          of + std::string(n == 1 ? "" : "s"), 100 * (1 - partial.lacking.value),
                          partial.lacking.of->id, n == 1 ? "it was" : "they were"));
  }
  /// Those that stand in one place: the one that holds it, and those that go on where it ends.
  static std::vector<const IfcElement*> all_at(const Claims& claims, const std::pair<int, std::string>& where,
                                               const Claim& holder) {
    std::vector<const IfcElement*> out{holder.element};
    const auto [from, to] = claims.parts.equal_range(where);
    for (auto part = from; part != to; ++part)
      if (part->second.group == holder.group) out.push_back(part->second.element);
    return out;
  }
  /// Notes by how much of a storey's height, below what lies above, elements stand.
  void note_heights(Partial& partial, const std::vector<const IfcElement*>& elements, int s, double depth) const {
    const double low = levels_[static_cast<size_t>(s)], high = levels_[static_cast<size_t>(s) + 1] - depth;
    double covered = 0;
    for (const IfcElement* e : elements) covered += std::max(0.0, std::min(e->high.z, high) - std::max(e->low.z, low));
    partial.note(covered, high - low, *elements.front());
  }
  void tell_short_columns(const Claims& claims) {
    Partial partial;
    for (const auto& [where, claim] : claims.at) {
      const auto p = points_of(where.second).front();
      note_heights(partial, all_at(claims, where, claim), where.first, depth_at(where.first, p[0], p[1]));
    }
    tell_partial(partial, "column", "storey");
  }
  /// How far what stands along the grid was moved to its line, and what it fills of its bays between their columns.
  void tell_edges(const Claims& claims, const char* kind, bool is_wall) {
    Largest moved;
    Partial of_bay, of_height;
    for (const auto& [where, claim] : claims.at) {
      const auto [s, place] = where;
      const auto points = points_of(place);
      const auto [row, frame] = points.front();
      const bool along_x = points.back()[0] != row;
      const int axis = along_x ? 0 : 1;
      const std::vector<double>& lines = along_x ? rows_ : frames_;
      const size_t i = static_cast<size_t>(along_x ? row : frame);
      const double line = along_x ? frames_[static_cast<size_t>(frame)] : rows_[static_cast<size_t>(row)];
      const double low = lines[i] + half_column(s, point(row, frame), along_x),
                   high = lines[i + 1] - half_column(s, point(points.back()[0], points.back()[1]), along_x);
      const auto elements = all_at(claims, where, claim);
      for (const IfcElement* e : elements) {
        moved.note(std::abs(0.5 * (e->low[1 - axis] + e->high[1 - axis]) - line), *e);
        if (high > low) of_bay.note(std::min(e->high[axis], high) - std::max(e->low[axis], low), high - low, *e);
      }
      if (is_wall) note_heights(of_height, elements, s, depth_above(s, row, frame, along_x));
    }
    tell_moved(moved, fmt::format("{}s", kind).c_str(), "lines");
    tell_partial(of_bay, kind, "bay");
    if (is_wall) tell_partial(of_height, kind, "storey");
  }
  static bool holds(const Group& g, int s, const std::string& place) {
    const auto list = g.places.find(s);
    return list != g.places.end() && std::find(list->second.begin(), list->second.end(), place) != list->second.end();
  }

  struct Hole {
    double left, sill, right, top;  // from the grid point and the floor [m]
  };

  /// Openings of walls as each edge of the grid and storey has its part of them, within columns and below what lies on
  /// the wall.
  void place_openings(const Claims& claims) {
    std::map<const IfcElement*, std::set<size_t>> used;
    int clipped = 0, placed = 0;
    const auto take = [&](const std::pair<int, std::string>& where, const Claim& claim) {
      const IfcElement& e = *claim.element;
      if (e.openings.empty()) return;
      const int s = where.first;
      const bool along_x = e.high.x - e.low.x >= e.high.y - e.low.y;
      const int axis = along_x ? 0 : 1;
      const std::vector<double>&lines = along_x ? rows_ : frames_, &across = along_x ? frames_ : rows_;
      const size_t line = static_cast<size_t>(nearest(across, 0.5 * (e.low[1 - axis] + e.high[1 - axis])));
      for (size_t i = 0; i + 1 < lines.size(); ++i) {
        const int a = static_cast<int>(i), l = static_cast<int>(line);
        const std::string from = along_x ? point(a, l) : point(l, a), to = along_x ? point(a + 1, l) : point(l, a + 1);
        if (from + to != where.second) continue;
        constexpr double slack = 1e-3;  // a plan has millimetres
        const double length = lines[i + 1] - lines[i], first = half_column(s, from, along_x) + slack,
                     last = length - half_column(s, to, along_x) - slack,
                     room = storey_height(s) - depth_above(s, along_x ? a : l, along_x ? l : a, along_x) - slack;
        std::vector<Hole>& holes = holes_[where];
        for (size_t k = 0; k < e.openings.size(); ++k) {
          const auto& [low, high] = e.openings[k];
          const double thickness = e.high[1 - axis] - e.low[1 - axis];
          const double through = std::min(high[1 - axis], e.high[1 - axis]) - std::max(low[1 - axis], e.low[1 - axis]);
          const double floor = levels_[static_cast<size_t>(s)];
          const Hole whole{low[axis] - lines[i], low.z - floor, high[axis] - lines[i], high.z - floor};
          const Hole h{std::max(whole.left, first), std::max(whole.sill, 0.0), std::min(whole.right, last),
                       std::min(whole.top, room)};
          constexpr double least = 0.05;  // [m]
          if (through < 0.9 * thickness || h.right - h.left < least || h.top - h.sill < least) continue;
          const bool overlaps = std::any_of(holes.begin(), holes.end(), [&h](const Hole& o) {
            return h.left < o.right && o.left < h.right && h.sill < o.top && o.sill < h.top;
          });
          if (overlaps || holes.size() == 100) continue;
          const double lost =
              std::max({h.left - whole.left, whole.right - h.right, h.sill - whole.sill, whole.top - h.top});
          clipped += lost > 0.02;
          holes.push_back(h);
          used[&e].insert(k);
          ++placed;
        }
        if (holes.empty()) holes_.erase(where);
      }
    };
    for (const auto& [where, claim] : claims.at) take(where, claim);
    for (const auto& [where, part] : claims.parts)
      if (claims.at.at(where).group == part.group) take(where, part);
    if (placed > 0) taken(fmt::format("{} of walls", count_words(placed, "opening")));
    if (clipped > 0)
      guessed(fmt::format("{} openings of walls reach into columns, floors or beams: the part between them was taken",
                          clipped));
    std::set<const IfcElement*> seen;
    int walls = 0;
    constexpr int most_named = 20;
    for (const Group& g : walls_)
      for (const IfcElement* e : g.elements) {
        const size_t all = e->openings.size() + static_cast<size_t>(e->openings_not_read);
        const size_t left = all - used[e].size();
        if (left == 0 || !seen.insert(e).second || ++walls > most_named) continue;
        missing(fmt::format("wall {}: {} of its {} openings {} left out",
                            clean_text(e->name.empty() ? fmt::format("#{}", e->id) : e->name), left, all,
                            left == 1 ? "is" : "are"));
      }
    if (walls > most_named) missing(fmt::format("openings of {} more walls are left out", walls - most_named));
  }

  /// A rule for all places with the same openings: a plan holds a thousand.
  void write_openings() {
    std::map<std::pair<std::string, std::string>, std::map<int, std::vector<std::string>>> places;
    for (const auto& [where, holes] : holes_)
      for (const Group& g : walls_) {
        if (!holds(g, where.first, where.second)) continue;
        std::string list;
        for (const Hole& h : holes)
          list += fmt::format("  {{ left = {}, sill = {}, width = {}, height = {} }},\n", metres(h.left),
                              metres(h.sill), metres(h.right - h.left), metres(h.top - h.sill));
        places[{name_of("wall", g, true), list}][where.first].push_back(where.second);
      }
    const size_t most = 1000 - std::min<size_t>(1000, rules_of_walls_);
    size_t rules = 0;
    for (const auto& [what, by_storey] : places) {
      std::map<std::vector<std::string>, std::vector<int>> alike;
      for (const auto& [s, list] : by_storey) alike[list].push_back(s);
      for (const auto& [list, in] : alike) {
        if (++rules > most) continue;
        text_ += fmt::format("[[walls]]\npanel = \"{}\"\nstoreys = [{}]\nat = [\"{}\"]\nopening = [\n{}]\n", what.first,
                             fmt::join(in, ", "), fmt::join(list, "\", \""), what.second);
      }
    }
    if (rules > most)
      missing(fmt::format("openings of walls: {} kinds of them, {} more than a plan holds", rules, rules - most));
  }
  std::string name_of(const char* kind, const Group& g, bool panel) {
    return panel ? fmt::format("{}_{:.0f}_{}", kind, 1000 * g.width, keys_.of(g.concrete))
                 : fmt::format("{}_{:.0f}x{:.0f}_{}", kind, 1000 * g.width, 1000 * g.height, keys_.of(g.concrete));
  }

  void count_rest() {
    for (const IfcElement& e : b_.elements)
      if (e.type != "IFCCOLUMN" && e.type != "IFCBEAM" && e.type != "IFCSLAB" && e.type != "IFCWALL")
        left_out(e,
                 e.type == "IFCFOOTING" || e.type == "IFCPILE" ? "foundations belong to the ground" : "is not taken");
    for (const auto& [type, n] : b_.others) left_out_[kind_of(type) + ": is not taken"] += n;
    if (b_.bars_left_out > 0)
      left_out_["REINFORCINGBAR: its body is part of itself, or has more than 10,000 items"] += b_.bars_left_out;
    for (const auto& [what, n] : left_out_) missing(fmt::format("{} x {}", n, what));
  }

  std::string concrete_key(const std::string& name) {
    concretes_[keys_.of(name)] = name;
    return keys_.of(name);
  }

  /// `0`, `"1..6"` or a list of these.
  static std::string describe_storeys(const std::vector<int>& storeys) {
    std::vector<std::string> parts;
    for (size_t from = 0, to = 0; from < storeys.size(); from = ++to) {
      while (to + 1 < storeys.size() && storeys[to + 1] == storeys[to] + 1) ++to;
      parts.push_back(to == from ? std::to_string(storeys[from])
                                 : fmt::format("\"{}..{}\"", storeys[from], storeys[to]));
    }
    return parts.size() == 1 ? parts.front() : fmt::format("[{}]", fmt::join(parts, ", "));
  }
  /// One rule for all storeys with the same places: a plan holds a thousand.
  void write_list(const std::map<int, std::vector<std::string>>& places, const char* rule, const char* what,
                  const std::string& name) {
    std::map<std::set<std::string>, std::vector<int>> alike;
    for (const auto& [s, list] : places) alike[{list.begin(), list.end()}].push_back(s);
    std::vector<std::pair<std::vector<int>, const std::set<std::string>*>> rules;
    for (const auto& [list, storeys] : alike) rules.emplace_back(storeys, &list);
    std::sort(rules.begin(), rules.end(), [](const auto& x, const auto& y) { return x.first < y.first; });
    for (const auto& [storeys, list] : rules)
      text_ += fmt::format("[[{}]]\n{} = \"{}\"\nstoreys = {}\nat = [\"{}\"]\n", rule, what, name,
                           describe_storeys(storeys), fmt::join(*list, "\", \""));
    rules_of_walls_ += std::string(rule) == "walls" ? rules.size() : 0;
  }

  /// Bars of the first element of a group that has some.
  MemberBars find_bars_of(const Group& g) const {
    for (const IfcElement* e : g.elements)
      if (MemberBars bars = find_bars(*e, b_.bars); bars.all.count > 0 || bars.ties.count > 0) return bars;
    return {};
  }

  /// "4 x 20 mm"
  std::string describe(const BarGroup& bars, const std::string& name, const char* where) {
    if (bars.has_diameters)
      guessed(fmt::format("section {}: its {} bars {} have several diameters; {:.1f} mm gives the same area", name,
                          bars.count, where, 1000 * bars.diameter));
    return fmt::format("{} x {:g} mm", bars.count, std::round(1e4 * bars.diameter) / 10);
  }

  void write_cover_and_ties(const std::string& name, const MemberBars& bars) {
    std::string gaps;
    const auto add_gap = [&gaps](const char* what) { gaps += (gaps.empty() ? "" : ", ") + std::string(what); };
    text_ += "cover = " + (bars.has_cover ? millimetres(bars.cover) : "\"?\"") + "\n";
    if (!bars.has_cover) add_gap("cover");
    if (bars.has_cover && bars.largest_cover - bars.cover > 5e-3)
      guessed(fmt::format("section {}: its cover is {:.0f} to {:.0f} mm; the least one was taken", name,
                          1000 * bars.cover, 1000 * bars.largest_cover));
    // what a plan cannot hold is a gap
    const double diameter = is_within(bars.ties.diameter, limits::tie_diameter) ? bars.ties.diameter : 0;
    const double spacing = is_within(bars.tie_spacing, limits::tie_spacing) ? bars.tie_spacing : 0;
    text_ += fmt::format("ties = {{ diameter = {}, spacing = {} }}\n", diameter > 0 ? millimetres(diameter) : "\"?\"",
                         spacing > 0 ? millimetres(spacing) : "\"?\"");
    if (!(diameter > 0)) add_gap("diameter of ties");
    if (!(spacing > 0)) add_gap("spacing of ties");
    if (diameter > 0 && spacing > 0)
      taken(fmt::format("section {}: ties of {:.0f} mm every {:.0f} mm", name, 1000 * diameter, 1000 * spacing));
    if (bars.largest_tie_spacing > 1.2 * bars.least_tie_spacing)
      guessed(fmt::format("section {}: its ties lie {:.0f} to {:.0f} mm apart; the median was taken", name,
                          1000 * bars.least_tie_spacing, 1000 * bars.largest_tie_spacing));
    if (!gaps.empty()) missing(fmt::format("section {}: {}", name, gaps));
  }

  static bool fits(const BarGroup& bars) {
    return bars.count <= limits::bars && is_within(bars.diameter, limits::bar_diameter);
  }

  void write_column_bars(const std::string& name, const MemberBars& bars, const Group& g) {
    const int count = bars.all.count;
    if (count > 0 && !fits(bars.all)) {
      text_ += "bars = { count_y = \"?\", count_z = \"?\", diameter = \"?\" }\n";
      missing(fmt::format("section {}: its {} bars of {:g} mm, which a plan cannot hold", name, count,
                          1000 * bars.all.diameter));
      return;
    }
    if (bars.count_y == 0 && (count < 4 || count % 4 != 0)) {
      text_ += "bars = { count_y = \"?\", count_z = \"?\", diameter = \"?\" }\n";
      missing(fmt::format("section {}: {}", name,
                          count > 0 ? fmt::format("how its {} bars lie", count) : std::string("its bars")));
      return;
    }
    if (const std::string misfit = find_misfit(bars, g.width, g.height, true); !misfit.empty()) {
      text_ += "bars = { count_y = \"?\", count_z = \"?\", diameter = \"?\" }\n";
      missing(fmt::format("section {}: {}", name, misfit));
      return;
    }
    const int even = count / 4 + 1;
    text_ +=
        fmt::format("bars = {{ count_y = {}, count_z = {}, diameter = {} }}\n", bars.count_y > 0 ? bars.count_y : even,
                    bars.count_z > 0 ? bars.count_z : even, millimetres(bars.all.diameter));
    taken(fmt::format("section {}: {} bars", name, describe(bars.all, name, "along the faces")));
    if (bars.count_y == 0) guessed(fmt::format("section {}: its bars lie evenly on the four sides", name));
  }

  void write_beam_bars(const std::string& name, const MemberBars& bars, const Group& g) {
    if (bars.middle > 0)
      missing(fmt::format("section {}: {} bars at the middle of its height are left out", name, bars.middle));
    if (bars.top.count == 0 || bars.bottom.count == 0 || !fits(bars.top) || !fits(bars.bottom)) {
      text_ += "top = \"?\"\nbottom = \"?\"\n";
      missing(fmt::format("section {}: its bars", name));
      return;
    }
    if (const std::string misfit = find_misfit(bars, g.width, g.height, false); !misfit.empty()) {
      text_ += "top = \"?\"\nbottom = \"?\"\n";
      const int inner = bars.inner_top + bars.inner_bottom;
      missing(fmt::format("section {}: {}{}", name, misfit,
                          inner > 0 ? fmt::format(" ({} of them in further layers)", inner) : ""));
      return;
    }
    const auto tell_inner = [&](int inner, int count, double depth, const char* where) {
      if (inner > 0)
        guessed(
            fmt::format("section {}: {} of its {} bars {} lie in further layers, up to {:.0f} mm behind the "
                        "outermost one; all of them were taken in it",
                        name, inner, count, where, 1000 * depth));
    };
    tell_inner(bars.inner_top, bars.top.count, bars.depth_top, "above");
    tell_inner(bars.inner_bottom, bars.bottom.count, bars.depth_bottom, "below");
    const std::string top = describe(bars.top, name, "above"), bottom = describe(bars.bottom, name, "below");
    text_ += fmt::format("top = \"{}\"\nbottom = \"{}\"\n", top, bottom);
    taken(fmt::format("section {}: {} above, {} below", name, top, bottom));
  }

  void write_section(const std::string& name, const Group& g, bool is_column) {
    MemberBars bars = find_bars_of(g);
    drop_thick_cover(bars, g.width, g.height);
    text_ += fmt::format("[section.{}]\nwidth = {}\nheight = {}\nconcrete = \"{}\"\nsteel = \"{}\"\n", name,
                         centimetres(g.width), centimetres(g.height), concrete_key(g.concrete), steel_key(bars.grade));
    write_cover_and_ties(name, bars);
    if (is_column) {
      write_column_bars(name, bars, g);
    } else {
      write_beam_bars(name, bars, g);
    }
  }

  void write_concretes(std::string& out) {
    for (const auto& [key, name] : concretes_) {
      out += name == kNoMaterial ? fmt::format("[concrete.{}]  # the file names no material\n", key)
                                 : fmt::format("[concrete.{}]  # \"{}\" in the file\n", key, clean_text(name));
      if (const auto found = find_class(name)) {
        const int fck = found->fck;
        out += fmt::format(
            "# characteristic value of the class: the real strength is mostly higher, and a higher strength can be "
            "the\n"
            "# unsafe side (a column that was to crush holds); measure it, or make it fuzzy\nfc = \"{} N/mm2\"\n",
            fck);
        taken(fmt::format("concrete {}: class {}, fc = {} N/mm2, its characteristic value", key, found->name, fck));
        guessed(
            fmt::format("concrete {}: fc is the characteristic value of a class; the real strength is mostly higher, "
                        "and that can be the unsafe side",
                        key));
        const double modulus = 22 * std::pow((fck + 8) / 10.0, 0.3);
        if (found->is_light) {
          const double tension = fck <= 50 ? 0.3 * std::pow(fck, 2.0 / 3) : 2.12 * std::log(1 + (fck + 8) / 10.0);
          out += fmt::format(
              "# lightweight: Ec = {:.1f} GPa (density / 2200 kg/m3)^2, fct = {:.1f} N/mm2 (0.4 + 0.6 density / 2200 "
              "kg/m3)\n"
              "Ec = \"?\"\nfct = \"?\"\ndensity = \"?\"\n",
              modulus, tension);
          missing(fmt::format("concrete {}: density, Ec and fct of lightweight concrete", key));
          continue;
        }
        out += fmt::format("Ec = \"{:.1f} GPa\"  # 22 GPa ((fck + 8) / 10)^0.3\n", modulus);
        guessed(fmt::format("concrete {}: Ec from the class", key));
        // a plan's own strain at the peak, 0.0022, would be too small
        if (limits::least_peak_strain * fck > 2.2e-3 * 1000 * modulus) {
          out += "eps_c1 = 0.0028  # as of C90/105\n";
          guessed(fmt::format("concrete {}: eps_c1 = 0.0028, that of C90/105", key));
        }
        if (fck == 8) {  // no formula gives it
          out += "fct = \"?\"\n";
          missing(fmt::format("concrete {}: fct", key));
        }
      } else {
        out += "fc = \"?\"\nEc = \"?\"\n";
        missing(
            fmt::format("concrete {}: fc and Ec{}", key, name == kNoMaterial ? " (the file names no material)" : ""));
      }
    }
  }

  /// One steel of each grade; what has none goes with the first.
  std::string steel_key(const std::string& grade) {
    if (grade.empty()) return "bars";
    auto it = std::find(grades_.begin(), grades_.end(), grade);
    if (it == grades_.end()) it = grades_.insert(grades_.end(), grade);
    return it == grades_.begin() ? "bars" : fmt::format("bars_{}", it - grades_.begin() + 1);
  }

  void write_steel(std::string& out) {
    std::vector<std::string> grades = grades_;
    if (grades.empty()) grades.emplace_back();
    for (const std::string& grade : grades) {
      const std::string key = steel_key(grade), yield = find_yield(grade),
                        steel = grades.size() > 1 ? "steel " + key : "steel";
      out += fmt::format("[steel.{}]\n", key);
      if (!yield.empty()) {
        out += fmt::format("fy = \"{} N/mm2\"  # characteristic value of {}\n", yield, clean_text(grade));
        taken(fmt::format("{}: fy = {} N/mm2 from the grade {}", steel, yield, clean_text(grade)));
        missing(steel + ": fu and eps_u");
      } else {
        out += "fy = \"?\"" + (grade.empty() ? std::string() : "  # of the grade " + clean_text(grade)) + "\n";
        missing(steel + ": fy, fu and eps_u");
      }
      out += "fu = \"?\"\neps_u = \"?\"\n";
    }
  }

  void write() {
    text_.clear();
    std::string rules;
    std::string sections;
    for (const Group& g : columns_) write_section(name_of("column", g, false), g, true);
    for (const Group& g : beams_) write_section(name_of("beam", g, false), g, false);
    for (const Group& g : slabs_) {
      const std::string name = name_of("slab", g, true);
      text_ += fmt::format(
          "[slab.{}]\nthickness = {}\nconcrete = \"{}\"\nsteel = \"bars\"\nas_top = \"?\"\nas_bottom = \"?\"\n", name,
          centimetres(g.width), concrete_key(g.concrete));
      missing("slab " + name + ": its reinforcement");
    }
    for (const Group& g : walls_) {
      const std::string name = name_of("wall", g, true);
      text_ += fmt::format("[wall.{}]\nthickness = {}\n", name, centimetres(g.width));
      if (is_masonry(g.concrete)) {
        text_ += "density = \"?\"\nstrength = \"?\"\nmodulus = \"?\"\n";
        missing("wall " + name + ": density, strength and modulus of the masonry");
      } else {
        text_ += fmt::format("concrete = \"{}\"\nsteel = \"bars\"\nas_faces = \"?\"\n", concrete_key(g.concrete));
        missing("wall " + name + ": its reinforcement");
      }
    }
    sections.swap(text_);
    for (const Group& g : columns_) write_list(g.places, "columns", "section", name_of("column", g, false));
    for (const Group& g : beams_) write_list(g.places, "beams", "section", name_of("beam", g, false));
    for (const Group& g : slabs_) write_list(g.places, "slabs", "panel", name_of("slab", g, true));
    for (const Group& g : walls_) write_list(g.places, "walls", "panel", name_of("wall", g, true));
    write_openings();
    rules.swap(text_);

    std::string title = clean_text(b_.name);
    if (title.empty()) title = clean_text(file_);
    if (title.empty()) title = "building";
    std::string out = fmt::format(
        "# From {} ({}). Every \"?\" is a gap: `topple check` names it, nothing runs before it is filled.\n"
        "title = \"{}\"\n",
        clean_text(file_), clean_text(b_.schema), title);
    write_concretes(out);
    write_steel(out);
    out += sections + "[grid]\nrows = { ";
    for (size_t i = 0; i < rows_.size(); ++i)
      out += fmt::format("{}{} = {}", i > 0 ? ", " : "", letters(static_cast<int>(i)), metres(rows_[i] - rows_[0]));
    out += " }\nframes = { ";
    for (size_t i = 0; i < frames_.size(); ++i)
      out += fmt::format("{}{} = {}", i > 0 ? ", " : "", i + 1, metres(frames_[i] - frames_[0]));
    out += " }\n[storeys]\nheights = [";
    for (int s = 0; s < storeys(); ++s)
      out += (s > 0 ? ", " : "") + metres(levels_[static_cast<size_t>(s) + 1] - levels_[static_cast<size_t>(s)]);
    out += "]\nload = \"?\"  # what lies on the floors beside their own weight\n";
    missing("storeys: the load on the floors");
    out += rules + "[analysis]\nduration = \"10 s\"\n";
    guessed("analysis: 10 s");
    missing("charges: a plan without [[stage]] only asks whether the building stands");
    text_ = std::move(out);
  }

  const IfcBuilding& b_;
  std::string file_, text_;
  std::vector<std::string> grades_;  // of the bars, as they are met
  ImportReport report_;
  std::vector<double> rows_, frames_, levels_;
  std::vector<Group> columns_, beams_, slabs_, walls_;
  std::map<std::string, std::vector<const IfcElement*>> fit_;
  std::map<std::string, int> left_out_;
  size_t rules_of_walls_ = 0;
  Sizes column_at_, beam_at_, slab_at_;
  std::map<std::pair<int, std::string>, std::vector<Hole>> holes_;  // of walls, by storey and edge
  std::map<std::string, std::string> concretes_;                    // names by their keys
  Keys keys_;
};

}  // namespace

Import make_plan_text(const IfcBuilding& building, const std::string& file_name) {
  return Planner(building, file_name).make();
}

}  // namespace topple::product
