#include "product/ifc_reinforcement.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "product/plan_limits.h"
#include "product/reading.h"

namespace topple::product {

namespace {

constexpr double kReach = 0.05;        // how far a bar may lie outside the element that it lies in [m]
constexpr double kUnder = 0.3;         // and below its foot, in a lap [m]
constexpr double kSameLine = 0.6;      // bars whose axes differ by less diameters lie in one line
constexpr double kFlat = 4;            // diameters: a tie that is less thick lies in a plane
constexpr double kMiddle = 0.25;       // of a beam's height from its middle: bars of no layer
constexpr double kEnd = 0.1;           // where a beam's section is looked at, over its length
constexpr double kLargestCover = 0.2;  // more is no cover [m]

using Component = double Vec3::*;

bool lies_in(const IfcBar& bar, const IfcElement& e) {
  return bar.has_place && bar.place.x > e.low.x - kReach && bar.place.x < e.high.x + kReach &&
         bar.place.y > e.low.y - kReach && bar.place.y < e.high.y + kReach && bar.place.z > e.low.z - kUnder &&
         bar.place.z < e.high.z;
}

void add(BarGroup& group, const IfcBar& bar) {
  group.has_diameters |= group.count > 0 && std::abs(group.diameter - bar.diameter) > 1e-4;
  const double area = group.count * group.diameter * group.diameter + bar.diameter * bar.diameter;
  group.diameter = std::sqrt(area / ++group.count);
}

/// The element's axis and the two directions of its section.
struct Axes {
  Component along, width, height;
};
Axes axes_of(const IfcElement& e) {
  if (e.type == "IFCCOLUMN") return {&Vec3::z, &Vec3::x, &Vec3::y};
  if (e.high.x - e.low.x > e.high.y - e.low.y) return {&Vec3::x, &Vec3::y, &Vec3::z};
  return {&Vec3::y, &Vec3::x, &Vec3::z};
}

/// Whether a tie may be one of this element: it lies in the plane of its section or winds along it. Ties of a beam that
/// reach into a column stand upright in it.
bool lies_across(const IfcBar& tie, const Axes& axes) {
  const auto is_flat = [&](Component c) { return tie.high.*c - tie.low.*c < kFlat * tie.diameter; };
  return !tie.has_axis || is_flat(axes.along) || (!is_flat(axes.width) && !is_flat(axes.height));
}

/// Bars that pass the section at `where` along the axis; those without an axis of their own pass everywhere.
std::vector<const IfcBar*> find_passing(const std::vector<const IfcBar*>& bars, Component along, double where) {
  std::vector<const IfcBar*> out;
  for (const IfcBar* bar : bars)
    if (!bar->has_axis || (bar->low.*along <= where && where <= bar->high.*along)) out.push_back(bar);
  return out;
}

/// How many bars lie at each of both faces, if as many do.
int count_at_faces(const std::vector<const IfcBar*>& bars, Component across) {
  double low = 1e30, high = -1e30;
  for (const IfcBar* bar : bars) {
    low = std::min(low, bar->place.*across);
    high = std::max(high, bar->place.*across);
  }
  int at_low = 0, at_high = 0;
  for (const IfcBar* bar : bars) {
    at_low += std::abs(bar->place.*across - low) < kSameLine * bar->diameter;
    at_high += std::abs(bar->place.*across - high) < kSameLine * bar->diameter;
  }
  return at_low == at_high ? at_low : 0;
}

void find_column_bars(const std::vector<const IfcBar*>& bars, MemberBars& out) {
  for (const IfcBar* bar : bars) add(out.all, *bar);
  if (std::any_of(bars.begin(), bars.end(), [](const IfcBar* bar) { return !bar->has_place; })) return;
  const int along_x = count_at_faces(bars, &Vec3::y), along_y = count_at_faces(bars, &Vec3::x);
  if (along_x < 2 || along_y < 2 || 2 * (along_x + along_y) - 4 != out.all.count) return;
  out.count_y = along_x;
  out.count_z = along_y;
}

void find_beam_bars(const std::vector<const IfcBar*>& bars, const IfcElement& e, MemberBars& out) {
  const double middle = 0.5 * (e.low.z + e.high.z), height = e.high.z - e.low.z;
  double highest = 0, lowest = 0;  // over the middle
  for (const IfcBar* bar : bars) {
    const double z = bar->place.z - middle;
    if (std::abs(z) < kMiddle * height) {
      ++out.middle;
      continue;
    }
    add(out.all, *bar);
    add(z > 0 ? out.top : out.bottom, *bar);
    (z > 0 ? highest : lowest) = z > 0 ? std::max(highest, z) : std::min(lowest, z);
  }
  for (const IfcBar* bar : bars) {
    const double z = bar->place.z - middle, off = z > 0 ? highest - z : z - lowest;
    if (std::abs(z) < kMiddle * height || off <= bar->diameter) continue;
    ++(z > 0 ? out.inner_top : out.inner_bottom);
    double& depth = z > 0 ? out.depth_top : out.depth_bottom;
    depth = std::max(depth, off);
  }
}

void find_spacing(const std::vector<const IfcBar*>& ties, Component along, MemberBars& out) {
  std::vector<double> places;
  for (const IfcBar* tie : ties)
    if (tie->has_place)
      places.push_back(tie->has_axis ? 0.5 * (tie->low.*along + tie->high.*along) : tie->place.*along);
  std::sort(places.begin(), places.end());
  std::vector<double> gaps;
  for (size_t i = 1; i < places.size(); ++i)  // ties side by side are one tie of more legs
    if (const double gap = places[i] - places[i - 1]; gap > 2 * out.ties.diameter) gaps.push_back(gap);
  if (gaps.size() < 2) return;
  std::sort(gaps.begin(), gaps.end());
  out.tie_spacing = gaps[gaps.size() / 2];
  out.least_tie_spacing = gaps.front();
  out.largest_tie_spacing = gaps.back();
}

/// From the outermost ties, else from the outermost bars and the ties around them.
void find_cover(const std::vector<const IfcBar*>& bars, const std::vector<const IfcBar*>& ties, const IfcElement& e,
                const Axes& axes, MemberBars& out) {
  const auto measure = [&](const std::vector<const IfcBar*>& list, double around) {
    std::array<double, 4> face{1e30, 1e30, 1e30, 1e30};
    for (const IfcBar* bar : list) {
      if (!bar->has_axis) continue;
      const double r = 0.5 * bar->diameter + around;
      const double gap[4] = {bar->low.*axes.width - e.low.*axes.width, e.high.*axes.width - bar->high.*axes.width,
                             bar->low.*axes.height - e.low.*axes.height, e.high.*axes.height - bar->high.*axes.height};
      for (size_t i = 0; i < 4; ++i) face[i] = std::min(face[i], gap[i] - r);
    }
    const auto [low, high] = std::minmax_element(face.begin(), face.end());
    if (*low < 0 || *high > kLargestCover) return;
    out.cover = *low;
    out.largest_cover = *high;
    out.has_cover = true;
  };
  measure(ties, 0);
  if (!out.has_cover && out.ties.diameter > 0) measure(bars, out.ties.diameter);
}

/// Room from the middle of a section to the axes of bars, as far as cover and ties are known.
double extent_of(double size, const MemberBars& bars, double diameter) {
  const double cover = bars.has_cover ? bars.cover : 0,
               tie = is_within(bars.ties.diameter, limits::tie_diameter) ? bars.ties.diameter : 0;
  constexpr double rounding = 1e-3;  // the sides are written in millimetres
  return 0.5 * (size - diameter - rounding) - cover - tie;
}
}  // namespace

MemberBars find_bars(const IfcElement& e, const std::vector<IfcBar>& all) {
  const Axes axes = axes_of(e);
  std::vector<const IfcBar*> bars, ties;
  for (const IfcBar& bar : all) {
    if (bar.host != 0 ? bar.host != e.id : !lies_in(bar, e)) continue;
    if (bar.is_main)
      bars.push_back(&bar);
    else if (bar.host != 0 || lies_across(bar, axes))
      ties.push_back(&bar);
  }
  MemberBars out;
  for (const IfcBar* tie : ties) add(out.ties, *tie);
  if (!bars.empty()) out.grade = bars.front()->grade;
  const double low = e.low.*axes.along, length = e.high.*axes.along - low;
  if (e.type == "IFCCOLUMN") {
    bars = find_passing(bars, axes.along, low + 0.5 * length);
    find_column_bars(bars, out);
  } else {
    std::vector<const IfcBar*> first = find_passing(bars, axes.along, low + kEnd * length);
    std::vector<const IfcBar*> last = find_passing(bars, axes.along, low + (1 - kEnd) * length);
    bars = first.size() >= last.size() ? std::move(first) : std::move(last);
    find_beam_bars(bars, e, out);
  }
  find_spacing(ties, axes.along, out);
  find_cover(bars, ties, e, axes, out);
  return out;
}

void drop_thick_cover(MemberBars& bars, double width, double height) {
  // room for two thin bars side by side, and for ties that are not known
  const double side = std::min(width, height) - 8e-3;
  if (2 * bars.ties.diameter >= side) bars.ties.diameter = 0;
  if (2 * (bars.cover + (bars.ties.diameter > 0 ? bars.ties.diameter : 4e-3)) >= side) bars.has_cover = false;
}

std::string find_misfit(const MemberBars& bars, double width, double height, bool is_column) {
  const double share = bars.all.count * std::acos(-1.0) / 4 * bars.all.diameter * bars.all.diameter / (width * height);
  if (share > most_steel - 1e-3) return fmt::format("its bars, which take {:.1f} % of it", 100 * share);
  const auto tell = [](const BarGroup& group, const char* where, const char* side) {
    return fmt::format("its {} x {:.1f} mm {}, which do not fit into its {} side by side", group.count,
                       1000 * group.diameter, where, side);
  };
  if (is_column) {
    const double d = bars.all.diameter;
    const int even = bars.all.count / 4 + 1;
    const int count_y = bars.count_y > 0 ? bars.count_y : even, count_z = bars.count_z > 0 ? bars.count_z : even;
    if (!have_room(count_y, d, extent_of(width, bars, d))) return tell(bars.all, "along the faces", "width");
    if (!have_room(count_z, d, extent_of(height, bars, d))) return tell(bars.all, "along the faces", "height");
    return {};
  }
  for (const auto& [group, where] : {std::pair{&bars.top, "above"}, std::pair{&bars.bottom, "below"}}) {
    const double d = group->diameter;
    if (!have_room(group->count, d, extent_of(width, bars, d))) return tell(*group, where, "width");
  }
  const double up = bars.top.diameter, down = bars.bottom.diameter;
  if (extent_of(height, bars, up) + extent_of(height, bars, down) < 0.5 * (up + down) ||
      std::min(extent_of(height, bars, up), extent_of(height, bars, down)) < 0)
    return "its bars above and below, which do not fit into its height";
  return {};
}

}  // namespace topple::product
