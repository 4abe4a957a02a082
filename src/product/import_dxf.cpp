#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <set>
#include <sstream>
#include <string_view>

#include "base/error.h"
#include "base/utf8.h"
#include "product/footprint.h"
#include "product/foreign_text.h"
#include "product/import.h"
#include "product/layer_names.h"
#include "product/plan_limits.h"

namespace topple::product {

namespace {

/// A pair of lines of the file: group code and value.
struct Pair {
  int code = 0;
  std::string value;
  int line = 1;  // of the value
};

[[noreturn]] void fail(const std::string& name, int line, const std::string& why, const std::string& help) {
  throw InputError(std::vector<Diagnostic>{{Severity::Error, "E113", {name, line, line > 0 ? 1 : 0}, 1, why, help}});
}

/// A length in the drawing's unit. Throws InputError E113.
double read_length(const Pair& p, const std::string& name) {
  char* end = nullptr;
  const double x = std::strtod(p.value.c_str(), &end);
  if (p.value.empty() || *end != '\0' || !(std::abs(x) < 1e12))
    fail(name, p.line, "a coordinate is wanted, there is \"" + p.value.substr(0, 20) + "\"",
         "numbers below 1e12 in size");
  return x;
}

/// All pairs up to that of the end, `0 EOF`, which a file that was cut off does not have.
std::vector<Pair> read_pairs(const std::string& text, const std::string& name) {
  std::vector<Pair> out;
  std::istringstream in{to_line_feeds(std::string(without_mark(text)))};
  std::string code, value;
  int line = 1;
  const auto trimmed = [](const std::string& s) {
    const size_t from = s.find_first_not_of(" \t\r"), to = s.find_last_not_of(" \t\r");
    return from == std::string::npos ? std::string() : s.substr(from, to - from + 1);
  };
  for (; std::getline(in, code) && std::getline(in, value); line += 2) {
    char* end = nullptr;
    const std::string word = trimmed(code);
    const long number = std::strtol(word.c_str(), &end, 10);
    if (word.empty() || *end != '\0')
      fail(name, line, "is no DXF text: a group code is wanted, there is \"" + word.substr(0, 20) + "\"",
           "save the drawing as DXF in ASCII");
    out.push_back({static_cast<int>(number), trimmed(value), line + 1});
    if (number == 0 && out.back().value == "EOF") return out;
  }
  fail(name, out.empty() ? 1 : out.back().line, "ends before its EOF",
       "the drawing was cut off; save or copy it again");
}

/// Metres of a unit of $INSUNITS; 0: none of its codes.
double unit_of(const std::string& code) {
  constexpr double foot = 1200.0 / 3937;  // of the US survey
  static const std::map<std::string, double> units{{"1", 0.0254},
                                                   {"2", 0.3048},
                                                   {"3", 1609.344},
                                                   {"4", 1e-3},
                                                   {"5", 1e-2},
                                                   {"6", 1},
                                                   {"7", 1e3},
                                                   {"8", 0.0254e-6},
                                                   {"9", 0.0254e-3},
                                                   {"10", 0.9144},
                                                   {"11", 1e-10},
                                                   {"12", 1e-9},
                                                   {"13", 1e-6},
                                                   {"14", 0.1},
                                                   {"15", 10},
                                                   {"16", 100},
                                                   {"17", 1e9},
                                                   {"18", 149597870700.0},
                                                   {"19", 9460730472580800.0},
                                                   {"20", 3.0856775814913673e16},
                                                   {"21", foot},
                                                   {"22", foot / 12},
                                                   {"23", 3 * foot},
                                                   {"24", 5280 * foot}};
  const auto found = units.find(code);
  return found == units.end() ? 0 : found->second;
}

struct Outline {
  int line = 1;  // where it begins
  std::string layer;
  bool is_closed = false, is_on_paper = false, is_mesh = false, lacks_y = false;
  std::array<double, 3> extrusion{0, 0, 1};
  std::vector<std::array<double, 2>> corners;
  std::vector<double> bulges;   // of the edge behind each corner: tan of a quarter of its arc's angle; 0: straight
  std::vector<double> heights;  // of corners
};

constexpr double kFlat = 1e-3;                // largest difference of the heights of corners [m]
constexpr double kArcError = 0.01;            // of chords of an arc [m]
const double kFinest = std::acos(-1.0) / 36;  // angle of a chord where that would take more
const double kCoarsest = std::acos(-1.0) / 4;

bool has_arcs(const Outline& o) {
  return std::any_of(o.bulges.begin(), o.bulges.end(), [](double b) { return b != 0; });
}

/// Corners with chords for arcs, all of whose area they hold: arcs bent outwards lie within them, those bent inwards
/// are cut off. Chords of `finest` or more. Corners in metres.
std::vector<std::array<double, 2>> flatten(const Outline& o, double finest) {
  const size_t n = o.corners.size();
  double area = calc_signed_area(o.corners);
  const auto arc = [&](size_t i) {
    const auto &a = o.corners[i], &b = o.corners[(i + 1) % n];
    const double angle = 4 * std::atan(o.bulges[i]), chord = std::hypot(b[0] - a[0], b[1] - a[1]);
    return std::pair(angle, angle == 0 ? 0 : 0.5 * chord / std::abs(std::sin(0.5 * angle)));
  };
  for (size_t i = 0; i < n; ++i) {
    const auto [angle, radius] = arc(i);
    area += 0.5 * radius * radius * (angle - std::sin(angle));
  }
  std::vector<std::array<double, 2>> out;
  for (size_t i = 0; i < n; ++i) {
    const auto &a = o.corners[i], &b = o.corners[(i + 1) % n];
    out.push_back(a);
    const auto [angle, radius] = arc(i);
    if (!(radius > 1e-6)) continue;
    // as many as the error asks for
    const double least = 2 * std::acos(radius / (radius + kArcError));
    const int pieces =
        std::max(1, static_cast<int>(std::ceil(std::abs(angle) / std::clamp(least, finest, kCoarsest) - 1e-9)));
    const double step = angle / pieces, side = angle > 0 ? 1 : -1;
    // the centre lies to the left of an arc that runs counterclockwise
    const double chord = std::hypot(b[0] - a[0], b[1] - a[1]), off = side * radius * std::cos(0.5 * angle) / chord;
    const double x = 0.5 * (a[0] + b[0]) - off * (b[1] - a[1]), y = 0.5 * (a[1] + b[1]) + off * (b[0] - a[0]);
    const double from = std::atan2(a[1] - y, a[0] - x);
    const bool is_outward = (angle > 0) == (area > 0);
    for (int k = 0; k < pieces; ++k) {
      // corners of tangents, or points of the arc
      const double r = is_outward ? radius / std::cos(0.5 * step) : radius,
                   at = from + (k + (is_outward ? 0.5 : 1)) * step;
      if (is_outward || k + 1 < pieces) out.push_back({x + r * std::cos(at), y + r * std::sin(at)});
    }
  }
  return out;
}
/// The same with chords as fine as the corners of a footprint allow.
void flatten(Outline& o) {
  double finest = kFinest;
  std::vector<std::array<double, 2>> corners = flatten(o, finest);
  while (corners.size() > limits::corners && finest < kCoarsest)
    corners = flatten(o, finest = std::min(1.25 * finest, kCoarsest));
  o.corners = std::move(corners);
}

/// `others` counts the entities that are no polylines, by kind.
std::vector<Outline> find_outlines(const std::vector<Pair>& pairs, const std::string& name,
                                   std::map<std::string, int>& others) {
  std::vector<Outline> out;
  std::string section;
  bool in_polyline = false, in_vertex = false, has_y = true;
  bool is_frame = false;  // the vertex only guides a spline
  Outline now;
  std::array<double, 2> centre{};  // of a circle
  double radius = 0;
  std::string entity;
  const auto end_corner = [&] {
    now.lacks_y |= !has_y;
    has_y = true;
  };
  const auto drop_frame = [&] {
    if (is_frame && !now.corners.empty()) now.corners.pop_back(), now.bulges.pop_back(), now.heights.pop_back();
    is_frame = false;
  };
  const auto finish = [&] {
    end_corner();
    drop_frame();
    if (entity == "CIRCLE") {  // two halves
      now.is_closed = true;
      now.corners = {{centre[0] - radius, centre[1]}, {centre[0] + radius, centre[1]}};
      now.bulges = {1, 1};
      now.lacks_y = false;
    }
    if (entity == "LWPOLYLINE" || entity == "POLYLINE" || entity == "CIRCLE") {
      // drawn on a plane that is seen from below: its x axis is the other way round
      if (now.extrusion[2] < 0)
        for (size_t i = 0; i < now.corners.size(); ++i)
          now.corners[i][0] = -now.corners[i][0], now.bulges[i] = -now.bulges[i];
      out.push_back(now);
    } else if (!entity.empty() && entity != "ENDSEC" && entity != "EOF") {
      ++others[entity];
    }
    now = {};
    centre = {};
    radius = 0;
    entity.clear();
  };
  for (size_t i = 0; i < pairs.size(); ++i) {
    const Pair& p = pairs[i];
    if (p.code == 0) {
      if (p.value == "EOF" && section == "ENTITIES")
        fail(name, p.line, "its entities have no ENDSEC", "the drawing was cut off; save or copy it again");
      if (in_polyline && (p.value == "VERTEX" || p.value == "SEQEND")) {
        end_corner();
        drop_frame();
        in_vertex = p.value == "VERTEX";
        if (!in_vertex) {
          finish();
          in_polyline = false;
        }
        continue;
      }
      finish();
      in_polyline = in_vertex = false;
      if (section != "ENTITIES") {
        if (p.value == "SECTION" && i + 1 < pairs.size()) section = pairs[i + 1].value;
        continue;
      }
      if (p.value == "ENDSEC") section.clear();
      entity = p.value;
      now.line = p.line;
      in_polyline = p.value == "POLYLINE";
      continue;
    }
    if (entity.empty()) continue;
    const bool has_corner = entity == "LWPOLYLINE" || in_vertex;
    if (p.code == 8 && !in_vertex) now.layer = decode_dxf_text(p.value);
    if (p.code == 67 && !in_vertex) now.is_on_paper = p.value != "0";
    if (p.code == 70 && !in_vertex) {
      const int flags = std::atoi(p.value.c_str());
      now.is_closed = (flags & 1) != 0;
      now.is_mesh = entity == "POLYLINE" && (flags & (16 | 64)) != 0;
    }
    if (p.code == 70 && in_vertex) is_frame = (std::atoi(p.value.c_str()) & 16) != 0;
    if (p.code == 10 && has_corner) {
      end_corner();
      now.corners.push_back({read_length(p, name), 0});
      now.bulges.push_back(0), now.heights.push_back(0);
      has_y = false;
    }
    if (p.code == 20 && has_corner && !now.corners.empty()) {
      now.corners.back()[1] = read_length(p, name);
      has_y = true;
    }
    if (p.code == 30 && has_corner && !now.corners.empty()) now.heights.back() = read_length(p, name);
    if (p.code == 42 && has_corner && !now.corners.empty()) now.bulges.back() = read_length(p, name);
    if (entity == "CIRCLE" && (p.code == 10 || p.code == 20)) centre[p.code == 20] = read_length(p, name);
    if (entity == "CIRCLE" && p.code == 40) radius = std::abs(read_length(p, name));
    if ((p.code == 210 || p.code == 220 || p.code == 230) && !in_vertex)
      now.extrusion[static_cast<size_t>(p.code / 10 - 21)] = read_length(p, name);
  }
  return out;
}

}  // namespace

namespace {

bool is_level(const std::vector<double>& heights) {
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  return low == heights.end() || *high - *low < kFlat;
}

/// Why an outline is no footprint, as the kind that it is counted as; empty: it is one. Corners in metres.
std::string why_not(const Outline& o) {
  const auto& [x, y, z] = o.extrusion;
  if (o.is_on_paper) return "outlines in paper space";
  if (o.is_mesh) return "polygon meshes";
  if (!(std::hypot(x, y) < 1e-6 * std::abs(z)) || !is_level(o.heights)) return "outlines that do not lie flat";
  if (!o.is_closed) return "open polylines";
  if (o.lacks_y) return "outlines with a corner without y";
  if (o.corners.size() < 3) return "outlines of fewer than three corners";
  if (o.corners.size() > limits::corners) return fmt::format("outlines of more than {} corners", limits::corners);
  if (std::abs(calc_signed_area(o.corners)) < limits::footprint) return "outlines without area";
  if (crosses_itself(o.corners)) return "outlines whose edges cross";
  return {};
}

}  // namespace

Import make_site_text(const std::string& dxf, const std::string& file_name, double unit) {
  Import out;
  const bool is_latin = !is_utf8(dxf);
  if (is_latin)
    out.report.guessed.push_back("names are not UTF-8; they were read as those of Western Europe (ISO 8859-1)");
  const std::vector<Pair> pairs = read_pairs(is_latin ? latin1_to_utf8(dxf) : dxf, file_name);
  if (unit <= 0) {
    for (size_t i = 0; i + 1 < pairs.size(); ++i)
      if (pairs[i].code == 9 && pairs[i].value == "$INSUNITS" && pairs[i + 1].value != "0") {
        unit = unit_of(pairs[i + 1].value);
        if (!(unit > 0))
          fail(file_name, pairs[i + 1].line,
               "$INSUNITS is \"" + pairs[i + 1].value.substr(0, 20) + "\", which is no unit",
               "give the unit of the drawing, such as --unit \"1 mm\"");
      }
    if (unit > 0) {
      out.report.taken.push_back(fmt::format("the drawing's unit is {:g} m, from its header", unit));
    } else {
      unit = 1;
      out.report.guessed.push_back("the drawing's numbers are metres: its header does not say");
    }
  }
  std::map<std::string, int> count;
  std::string neighbours, utilities;
  std::map<std::string, int> others, left_out;
  std::set<std::string> utility_layers;
  size_t arcs = 0, taken = 0;
  for (Outline& o : find_outlines(pairs, file_name, others)) {
    double far = 0;
    const auto round_corners = [&] {
      far = 0;
      for (auto& corner : o.corners)
        for (double& x : corner) {
          x = std::round(x * 1000) / 1000;  // as it is written
          far = std::max(far, std::abs(x));
        }
    };
    for (auto& corner : o.corners)
      for (double& x : corner) x *= unit;
    for (double& z : o.heights) z *= unit;
    const bool is_arced = has_arcs(o);
    if (const auto near = [](double a, double b) { return std::abs(a - b) < 5e-4; };
        o.corners.size() > 1 && near(o.corners.front()[0], o.corners.back()[0]) &&
        near(o.corners.front()[1], o.corners.back()[1])) {
      o.is_closed = true;
      o.corners.pop_back(), o.bulges.pop_back();
    }
    if (is_arced && o.is_closed && o.corners.size() > 1) flatten(o);
    round_corners();
    if (const std::string why = why_not(o); !why.empty()) {
      ++left_out[why];
      continue;
    }
    if (far > limits::site.high)
      fail(file_name, o.line, fmt::format("an outline lies {:.0f} km from the origin", far / 1000),
           "a plan reaches 10 km: move the drawing so that its origin is row A, frame 1, or give its unit");
    arcs += is_arced;
    std::string layer = clean_text(o.layer);
    if (layer.empty()) layer = "outline";
    const bool is_utility = names_utility(layer);
    if (is_utility) utility_layers.insert(layer);
    std::string& to = is_utility ? utilities : neighbours;
    to += fmt::format("[[site.{}]]\nname = \"{} {}\"\nfootprint = [", is_utility ? "utility" : "neighbour", layer,
                      ++count[layer]);
    for (size_t i = 0; i < o.corners.size(); ++i)
      to += fmt::format("{}[\"{:.3f} m\", \"{:.3f} m\"]", i > 0 ? ", " : "", o.corners[i][0], o.corners[i][1]);
    to += "]\nclearance = \"?\"\n";
    ++taken;
  }
  std::string list;
  for (const auto& [kind, number] : left_out) list += fmt::format("; {} {} are left out", number, kind);
  if (taken == 0)
    fail(file_name, 0, "has no closed outlines",
         "neighbours are closed LWPOLYLINE or POLYLINE entities, or CIRCLE" + list);
  if (taken > limits::neighbours)
    fail(file_name, 0, fmt::format("has {} closed outlines", taken), "a plan holds 1000; leave out what is not near");
  out.report.taken.push_back(fmt::format("{} closed outlines", taken));
  if (!utilities.empty()) {
    list.clear();
    for (const std::string& layer : utility_layers) list += (list.empty() ? "" : ", ") + layer;
    out.report.guessed.push_back("outlines on layers named like pipes and cables are utilities: " + list);
  }
  for (const auto& [kind, number] : left_out)
    out.report.missing.push_back(fmt::format("{} {} are left out", number, kind));
  if (!others.empty()) {
    list.clear();
    for (const auto& [kind, number] : others) list += fmt::format("{}{} {}", list.empty() ? "" : ", ", number, kind);
    out.report.missing.push_back("entities that are neither polylines nor circles, blocks among them, are left out: " +
                                 list);
  }
  if (arcs > 0)
    out.report.guessed.push_back(
        fmt::format("arcs of {} outlines became chords; the outlines hold all that is within the arcs", arcs));
  out.report.guessed.push_back("x and y of the drawing are those of the plan: its origin is row A, frame 1");
  out.report.missing.push_back("the clearance that each of them asks for");
  out.text = "# From " + clean_text(file_name) + ". Every \"?\" is a gap to fill.\n" + neighbours + utilities;
  check_import(out.text, "E113", file_name);
  return out;
}

}  // namespace topple::product
