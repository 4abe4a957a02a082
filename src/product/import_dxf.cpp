#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <string_view>

#include "base/error.h"
#include "base/utf8.h"
#include "product/dxf_drawing.h"
#include "product/footprint.h"
#include "product/foreign_text.h"
#include "product/import.h"
#include "product/layer_names.h"
#include "product/plan_limits.h"

namespace topple::product {

namespace {

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

constexpr double kFlat = 1e-3;                // largest difference of the heights of corners [m]
constexpr double kArcError = 0.01;            // of chords of an arc [m]
const double kFinest = std::acos(-1.0) / 36;  // angle of a chord where that would take more
const double kCoarsest = std::acos(-1.0) / 4;

bool has_arcs(const DxfOutline& o) {
  return std::any_of(o.bulges.begin(), o.bulges.end(), [](double b) { return b != 0; });
}

/// Corners with chords for arcs, all of whose area they hold: arcs bent outwards lie within them, those bent inwards
/// are cut off. Chords of `finest` or more. Corners in metres.
std::vector<std::array<double, 2>> flatten(const DxfOutline& o, double finest) {
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
void flatten(DxfOutline& o) {
  double finest = kFinest;
  std::vector<std::array<double, 2>> corners = flatten(o, finest);
  while (corners.size() > limits::corners && finest < kCoarsest)
    corners = flatten(o, finest = std::min(1.25 * finest, kCoarsest));
  o.corners = std::move(corners);
}

bool is_level(const std::vector<double>& heights) {
  const auto [low, high] = std::minmax_element(heights.begin(), heights.end());
  return low == heights.end() || *high - *low < kFlat;
}

/// Puts corners that are `stretch` times as large as in their block, in metres, where the block is inserted.
void place(DxfOutline& o, double unit, double stretch) {
  if (!(stretch > 0)) return;
  const PlaneMap& p = o.place;
  const PlaneMap map{p.a / stretch, p.b / stretch, p.c / stretch, p.d / stretch, unit * p.x, unit * p.y};
  for (auto& corner : o.corners) corner = map(corner);
}

/// Why an outline is no footprint, as the kind that it is counted as; empty: it is one. Corners in metres.
std::string why_not(const DxfOutline& o) {
  if (o.is_on_paper) return "outlines in paper space";
  if (o.is_mesh) return "polygon meshes";
  if (o.is_tilted || !is_level(o.heights)) return "outlines that do not lie flat";
  if (!o.is_closed) return "open polylines";
  if (o.lacks_y) return "outlines with a corner without y";
  if (o.corners.size() < 3) return "outlines of fewer than three corners";
  if (o.corners.size() > limits::corners) return fmt::format("outlines of more than {} corners", limits::corners);
  if (std::abs(calc_signed_area(o.corners)) < limits::footprint) return "outlines without area";
  if (crosses_itself(o.corners)) return "outlines whose edges cross";
  return {};
}

/// "3 A, 1 B"
std::string list_numbers(const std::map<std::string, int>& numbers) {
  std::string out;
  for (const auto& [name, number] : numbers)
    out += fmt::format("{}{} {}", out.empty() ? "" : ", ", number, clean_text(name));
  return out;
}

}  // namespace

Import make_site_text(const std::string& dxf, const std::string& file_name, double unit) {
  Import out;
  const bool is_latin = !is_utf8(dxf);
  if (is_latin)
    out.report.guessed.push_back("names are not UTF-8; they were read as those of Western Europe (ISO 8859-1)");
  const std::vector<DxfPair> pairs = read_dxf_pairs(is_latin ? latin1_to_utf8(dxf) : dxf, file_name);
  if (unit <= 0) {
    for (size_t i = 0; i + 1 < pairs.size(); ++i)
      if (pairs[i].code == 9 && pairs[i].value == "$INSUNITS" && pairs[i + 1].value != "0") {
        unit = unit_of(pairs[i + 1].value);
        if (!(unit > 0))
          fail_dxf(file_name, pairs[i + 1].line,
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
  std::map<std::string, int> left_out, of_blocks;
  std::set<std::string> utility_layers;
  size_t arcs = 0, taken = 0;
  DxfDrawing drawing = read_dxf_drawing(pairs, file_name);
  for (DxfOutline& o : drawing.outlines) {
    double far = 0;
    const auto round_corners = [&] {
      far = 0;
      for (auto& corner : o.corners)
        for (double& x : corner) {
          x = std::round(x * 1000) / 1000;  // as it is written
          far = std::max(far, std::abs(x));
        }
    };
    // in metres as large as they are anywhere in the drawing, so that an arc is one until it has its chords
    const double stretch = o.place.stretch();
    for (auto& corner : o.corners)
      for (double& x : corner) x *= unit * stretch;
    for (double& z : o.heights) z *= unit;
    const bool is_arced = has_arcs(o);
    if (const auto near = [](double a, double b) { return std::abs(a - b) < 5e-4; };
        o.corners.size() > 1 && near(o.corners.front()[0], o.corners.back()[0]) &&
        near(o.corners.front()[1], o.corners.back()[1])) {
      o.is_closed = true;
      o.corners.pop_back(), o.bulges.pop_back();
    }
    if (is_arced && o.is_closed && o.corners.size() > 1) flatten(o);
    place(o, unit, stretch);
    round_corners();
    if (const std::string why = why_not(o); !why.empty()) {
      ++left_out[why];
      continue;
    }
    if (far > limits::site.high)
      fail_dxf(file_name, o.line, fmt::format("an outline lies {:.0f} km from the origin", far / 1000),
               "a plan reaches 10 km: move the drawing so that its origin is row A, frame 1, or give its unit");
    arcs += is_arced;
    if (!o.block.empty()) ++of_blocks[o.block];
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
    fail_dxf(file_name, 0, "has no closed outlines",
             "neighbours are closed LWPOLYLINE or POLYLINE entities, or CIRCLE" + list);
  if (taken > limits::neighbours)
    fail_dxf(file_name, 0, fmt::format("has {} closed outlines", taken),
             "a plan holds 1000; leave out what is not near" +
                 (of_blocks.empty() ? std::string() : ", and symbols; of blocks there are " + list_numbers(of_blocks)));
  out.report.taken.push_back(fmt::format("{} closed outlines", taken));
  if (!utilities.empty()) {
    list.clear();
    for (const std::string& layer : utility_layers) list += (list.empty() ? "" : ", ") + layer;
    out.report.guessed.push_back("outlines on layers named like pipes and cables are utilities: " + list);
  }
  for (const auto& [kind, number] : left_out)
    out.report.missing.push_back(fmt::format("{} {} are left out", number, kind));
  if (!of_blocks.empty())
    out.report.guessed.push_back("outlines of blocks that are inserted are taken; delete what is a symbol only: " +
                                 list_numbers(of_blocks));
  if (!drawing.lacking.empty())
    out.report.missing.push_back("blocks that have nothing in this file, of other drawings perhaps, are left out: " +
                                 list_numbers(drawing.lacking));
  if (!drawing.others.empty())
    out.report.missing.push_back("entities that are neither polylines nor circles are left out: " +
                                 list_numbers(drawing.others));
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
