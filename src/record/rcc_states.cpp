#include "record/rcc_states.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/unit.h"
#include "record/plot.h"

namespace topple::record {

namespace {

constexpr double row_height = 236, largest_depth = 172, largest_breadth = 280, head = 40, left = 44;

struct Condition {
  const char* name;
  Ink ink;
};
constexpr Condition concrete_conditions[] = {{"uncracked", Ink::Uncracked}, {"cracked", Ink::Cracked},
                                             {"open crack", Ink::Open},     {"compressed", Ink::Compressed},
                                             {"crushing", Ink::Crushing},   {"crushed", Ink::Crushed}};

Ink ink_of(const std::string& condition) {
  for (const Condition& c : concrete_conditions)
    if (condition == c.name) return c.ink;
  return Ink::Panel;
}

void draw_bar(Drawing& d, Dot at, double radius, const std::string& condition) {
  if (condition == "yields in tension") {
    d.circle(at, radius, Ink::BarTension, Ink::Text);
  } else if (condition == "yields in compression") {
    d.circle(at, radius, Ink::BarCompression, Ink::Text);
  } else {
    d.circle(at, radius, Ink::Panel, Ink::Text);
    if (condition == "has yielded") d.circle(at, 0.5 * radius, Ink::BarTension);
  }
  const double a = 0.7 * radius;
  if (condition == "torn" || condition == "buckled")
    d.line({{at.x - a, at.y - a}, {at.x + a, at.y + a}}, Ink::Text, 1.5);
  if (condition == "torn") d.line({{at.x - a, at.y + a}, {at.x + a, at.y - a}}, Ink::Text, 1.5);
}

/// A panel whose vertical axis is the section's depth.
struct Profile {
  double x = 0, width = 0, top = 0;
  double low = 0, high = 1;  // of the values shown
  double depth = 0;          // of the section [m]
  double picture = 0;        // its height in the picture
  double place_x(double v) const { return x + (v - low) / (high - low) * width; }
  double place_y(double a) const { return top + (0.5 - a / depth) * picture; }
};

Profile make_profile(Drawing& d, double x, double width, double top, double depth, double picture, double low,
                     double high, const std::string& title) {
  Profile p{x, width, top, low, high, depth, picture};
  const double air = 0.06 * (high - low);
  p.low = low - air, p.high = high + air;
  d.text({x + 0.5 * width, top - 8}, title, Ink::Quiet, 12, 0.5);
  const std::vector<double> ticks = find_ticks(p.low, p.high, 4);
  for (const double t : ticks) {
    d.line({{p.place_x(t), top}, {p.place_x(t), top + picture}}, Ink::Faint);
    d.text({p.place_x(t), top + picture + 15}, tick_text(t, ticks.size() > 1 ? ticks[1] - ticks[0] : 1), Ink::Quiet, 11,
           0.5);
  }
  d.line({{x, top}, {x + width, top}, {x + width, top + picture}, {x, top + picture}, {x, top}}, Ink::Line);
  if (p.low < 0 && p.high > 0) d.line({{p.place_x(0), top}, {p.place_x(0), top + picture}}, Ink::Line, 1.5);
  return p;
}

/// Breadth of the section at a layer, where a flange may lie beside the web [m].
double breadth_of(const RccState::Layer& l, double web) { return std::max(web, l.core_breadth + l.cover_breadth); }

void draw_section(Drawing& d, const RccReport& r, const RccState& s, double x, double top, double depth, double scale) {
  const bool about_y = s.axis == 'y';
  const double breadth = about_y ? r.width : r.height, picture = depth * scale;
  const double middle = x;
  const auto y_of = [&](double a) { return top + (0.5 - a / depth) * picture; };
  const auto fill = [&](double from, double to, double y1, double y2, const std::string& condition) {
    d.area({{from, y1}, {to, y1}, {to, y2}, {from, y2}}, ink_of(condition));
    if (condition != "open crack" && condition != "cracked") return;
    const bool is_open = condition == "open crack";
    for (double y = y1 + 3; y < y2 - 1; y += 5) d.line({{from, y}, {to, y}}, Ink::Quiet, is_open ? 1 : 0.5);
  };
  // neighbours in the same condition as one area
  for (size_t i = 0, next; i < s.layers.size(); i = next) {
    const RccState::Layer& l = s.layers[i];
    for (next = i + 1; next < s.layers.size(); ++next) {
      const RccState::Layer& n = s.layers[next];
      if (n.core != l.core || n.cover != l.cover || n.core_breadth != l.core_breadth ||
          std::abs(n.cover_breadth - l.cover_breadth) > 1e-9)
        break;
    }
    const double half = 0.5 * breadth_of(l, breadth) * scale;
    const double core = 0.5 * l.core_breadth * scale, y1 = y_of(s.layers[next - 1].to), y2 = y_of(l.from);
    if (l.cover_breadth > 0 && !(l.core_breadth > 0)) fill(middle - half, middle + half, y1, y2, l.cover);
    if (l.cover_breadth > 0 && l.core_breadth > 0) {
      fill(middle - half, middle - core, y1, y2, l.cover);
      fill(middle + core, middle + half, y1, y2, l.cover);
    }
    if (l.core_breadth > 0) fill(middle - core, middle + core, y1, y2, l.core);
  }
  std::vector<Dot> right{{middle + 0.5 * breadth * scale, top + picture}};
  for (const RccState::Layer& l : s.layers)
    if (const double edge = middle + 0.5 * breadth_of(l, breadth) * scale; std::abs(edge - right.back().x) > 0.5)
      right.push_back({right.back().x, y_of(l.from)}), right.push_back({edge, y_of(l.from)});
  right.push_back({right.back().x, top});
  std::vector<Dot> outline = right;
  for (auto p = right.rbegin(); p != right.rend(); ++p) outline.push_back({2 * middle - p->x, p->y});
  outline.push_back(right.front());
  d.line(outline, Ink::Text);
  // the edge of the core
  double low = depth, high = -depth, core = 0;
  for (const RccState::Layer& l : s.layers)
    if (l.core_breadth > 0)
      low = std::min(low, l.from), high = std::max(high, l.to), core = 0.5 * l.core_breadth * scale;
  if (low < high)
    d.line({{middle - core, y_of(low)},
            {middle + core, y_of(low)},
            {middle + core, y_of(high)},
            {middle - core, y_of(high)},
            {middle - core, y_of(low)}},
           Ink::Text, 0.8, {3, 2});
  for (const RccState::Bar& b : s.bars) {
    const double across = about_y ? b.y : -b.z, along = about_y ? b.z : b.y;
    draw_bar(d, {middle + across * scale, y_of(along)}, std::max(3.5, 0.5 * b.diameter * scale), b.condition);
  }
}

struct Limits {
  double low = 0, high = 0;
  void add(double v) { low = std::min(low, v), high = std::max(high, v); }
};

}  // namespace

Drawing draw_states(const RccReport& r, const std::vector<const RccState*>& states) {
  Drawing d;
  const RccState& first = *states.front();
  d.width = 960;
  d.height = head + row_height * static_cast<double>(states.size()) + 52;
  const char along = first.axis == 'y' ? 'z' : 'y';
  d.title = fmt::format("Section bent about {}{}, N = {} MN: conditions, strains and stresses",
                        first.direction < 0 ? '-' : '+', first.axis, shown(first.normal_force, unit::MN));
  d.text({left, 22}, d.title, Ink::Text, 15, 0, true);
  const double depth = first.axis == 'y' ? r.height : r.width;
  double breadth = first.axis == 'y' ? r.width : r.height;
  for (const RccState* s : states)
    for (const RccState::Layer& l : s->layers) breadth = breadth_of(l, breadth);
  const double scale = std::min(largest_depth / depth, largest_breadth / breadth);
  const double picture = depth * scale, section_width = breadth * scale;

  double y = head;
  for (const RccState* s : states) {
    d.text({left, y + 16},
           fmt::format("{}: φ = {} mrad, M = {} kNm, mean strain {} ‰", s->point, shown(s->rotation, 1e-3),
                       shown(s->moment, unit::kNm), shown(s->eps_0, 1e-3, 3)),
           Ink::Text, 13, 0, true);
    const double top = y + 42;
    draw_section(d, r, *s, left + 0.5 * section_width, top, depth, scale);
    d.text({left - 8, top + 5}, fmt::format("+{}", along), Ink::Quiet, 11, 1);
    d.text({left - 8, top + picture}, fmt::format("-{}", along), Ink::Quiet, 11, 1);
    Limits strain, concrete, steel;
    for (const RccState::Layer& l : s->layers) {
      strain.add(l.strain / 1e-3);
      if (l.core_breadth > 0) concrete.add(l.core_stress / unit::MPa);
      if (l.cover_breadth > 0) concrete.add(l.cover_stress / unit::MPa);
    }
    for (const RccState::Bar& b : s->bars) strain.add(b.strain / 1e-3), steel.add(b.stress / unit::MPa);
    const double x0 = left + section_width + 36, gap = 26, width = (d.width - 18 - x0 - 2 * gap) / 3;
    const Profile ps = make_profile(d, x0, width, top, depth, picture, strain.low, strain.high, "strain [‰]");
    const Profile pc = make_profile(d, x0 + width + gap, width, top, depth, picture, concrete.low, concrete.high,
                                    "stress of concrete [N/mm²]");
    const Profile pb = make_profile(d, x0 + 2 * (width + gap), width, top, depth, picture, steel.low, steel.high,
                                    "stress of bars [N/mm²]");
    std::vector<Dot> line, core, cover;
    for (const RccState::Layer& l : s->layers) {
      const double a = 0.5 * (l.from + l.to);
      line.push_back({ps.place_x(l.strain / 1e-3), ps.place_y(a)});
      if (l.core_breadth > 0) core.push_back({pc.place_x(l.core_stress / unit::MPa), pc.place_y(a)});
      if (l.cover_breadth > 0) cover.push_back({pc.place_x(l.cover_stress / unit::MPa), pc.place_y(a)});
    }
    d.line(line, Ink::Series0, 2);
    d.line(cover, Ink::Series1, 1.5, {5, 3});
    d.line(core, Ink::Series0, 2);
    for (const RccState::Bar& b : s->bars) {
      const double a = s->axis == 'y' ? b.z : b.y;
      const Dot at{pb.place_x(b.stress / unit::MPa), pb.place_y(a)};
      d.line({{pb.place_x(0), at.y}, at}, Ink::Series0, 2);
      draw_bar(d, at, 4, b.condition);
    }
    y += row_height;
  }
  // what the signs mean
  double x = left;
  y += 14;
  d.text({x, y + 4}, "Concrete", Ink::Quiet, 12, 0, true);
  x += 66;
  for (const Condition& c : concrete_conditions) {
    d.area({{x, y - 7}, {x + 18, y - 7}, {x + 18, y + 6}, {x, y + 6}}, c.ink, 1, Ink::Line);
    if (c.ink == Ink::Open || c.ink == Ink::Cracked)
      d.line({{x, y - 0.5}, {x + 18, y - 0.5}}, Ink::Quiet, c.ink == Ink::Open ? 1 : 0.5);
    d.text({x + 23, y + 4}, c.name, Ink::Text, 12);
    x += 36 + 7.2 * static_cast<double>(std::char_traits<char>::length(c.name));
  }
  d.line({{x, y}, {x + 20, y}}, Ink::Series0, 2);
  d.text({x + 24, y + 4}, "core", Ink::Text, 12);
  d.line({{x + 60, y}, {x + 80, y}}, Ink::Series1, 1.5, {5, 3});
  d.text({x + 84, y + 4}, "cover", Ink::Text, 12);
  x = left, y += 24;
  d.text({x, y + 4}, "Bars", Ink::Quiet, 12, 0, true);
  x += 66;
  for (const char* name : {"elastic", "yields in tension", "yields in compression", "has yielded", "buckled", "torn"}) {
    draw_bar(d, {x + 6, y}, 5, name);
    d.text({x + 17, y + 4}, name, Ink::Text, 12);
    x += 34 + 6.6 * static_cast<double>(std::char_traits<char>::length(name));
  }
  return d;
}

FigureTable make_state_table(const std::vector<const RccState*>& states) {
  FigureTable t;
  t.heads = {"point", "part", "from [cm]", "to [cm]", "y [cm]", "z [cm]", "strain [‰]", "stress [N/mm²]", "condition"};
  for (const RccState* s : states) {
    for (const RccState::Layer& l : s->layers) {
      const auto add = [&](const char* part, double stress, const std::string& condition) {
        t.rows.push_back({s->point, part, shown(l.from, unit::cm), shown(l.to, unit::cm), "", "", shown(l.strain, 1e-3),
                          shown(stress, unit::MPa), condition});
      };
      if (l.core_breadth > 0) add("core", l.core_stress, l.core);
      if (l.cover_breadth > 0) add("cover", l.cover_stress, l.cover);
    }
    for (const RccState::Bar& b : s->bars)
      t.rows.push_back({s->point, "bar", "", "", shown(b.y, unit::cm), shown(b.z, unit::cm), shown(b.strain, 1e-3),
                        shown(b.stress, unit::MPa), b.condition});
  }
  return t;
}

}  // namespace topple::record
