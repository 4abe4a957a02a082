#include "record/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>

namespace topple::record {

namespace {

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  void add(double v) {
    if (!std::isfinite(v)) return;
    low = std::min(low, v), high = std::max(high, v);
  }
};

/// With zero inside and a little air, unless both ends are given.
Range widen(Range r, double given_low, double given_high) {
  if (given_low < given_high) return {given_low, given_high};
  if (!(r.low <= r.high)) return {0, 1};
  r.add(0);
  if (r.low == r.high) r.high = r.low + 1;
  const double air = 0.05 * (r.high - r.low);
  return {r.low < 0 ? r.low - air : 0, r.high > 0 ? r.high + air : 0};
}

double cross(const Dot& a, const Dot& b, double at, bool is_x) {
  const double from = is_x ? a.x : a.y, to = is_x ? b.x : b.y;
  return (at - from) / (to - from);
}

Dot between(const Dot& a, const Dot& b, double s) { return {a.x + s * (b.x - a.x), a.y + s * (b.y - a.y)}; }

}  // namespace

std::vector<double> find_ticks(double low, double high, int most) {
  const double rough = (high - low) / std::max(1, most);
  const double power = std::pow(10.0, std::floor(std::log10(rough)));
  double step = 10 * power;
  for (const double m : {5.0, 2.5, 2.0, 1.0})
    if (m * power >= rough * (1 - 1e-9)) step = m * power;
  if ((high - low) / step < 1) step = 0.5 * (high - low);
  std::vector<double> out;
  for (double k = std::ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; ++k) out.push_back(k * step);
  return out;
}

std::string tick_text(double value, double step) {
  if (std::abs(value) < 1e-9 * step) return "0";
  int decimals = 0;
  for (double s = step; decimals < 9 && std::abs(s - std::round(s)) > 1e-6 * s; s *= 10) ++decimals;
  return fmt::format("{:.{}f}", value, decimals);
}

std::vector<std::vector<Dot>> clip_line(const std::vector<Dot>& dots, Dot low, Dot high) {
  std::vector<std::vector<Dot>> out;
  bool is_open = false;
  for (size_t i = 1; i < dots.size(); ++i) {
    const Dot a = dots[i - 1], b = dots[i];
    double from = 0, to = 1;  // Liang and Barsky
    bool inside = true;
    for (const auto& [p, q] : {std::pair{a.x - b.x, a.x - low.x},
                               {b.x - a.x, high.x - a.x},
                               {a.y - b.y, a.y - low.y},
                               {b.y - a.y, high.y - a.y}}) {
      if (p == 0) {
        inside = inside && q >= 0;
      } else if (p < 0) {
        from = std::max(from, q / p);
      } else {
        to = std::min(to, q / p);
      }
    }
    if (!inside || from > to) {
      is_open = false;
      continue;
    }
    if (!is_open || from > 0) out.push_back({between(a, b, from)});
    out.back().push_back(between(a, b, to));
    is_open = to == 1;
  }
  return out;
}

std::vector<Dot> clip_area(std::vector<Dot> dots, Dot low, Dot high) {
  // Sutherland and Hodgman: one side of the box after the other
  const auto cut = [&dots](bool is_x, double at, bool keeps_above) {
    std::vector<Dot> out;
    const auto inside = [&](const Dot& d) { return keeps_above ? (is_x ? d.x : d.y) >= at : (is_x ? d.x : d.y) <= at; };
    for (size_t i = 0; i < dots.size(); ++i) {
      const Dot &a = dots[i], &b = dots[(i + 1) % dots.size()];
      if (inside(a)) out.push_back(a);
      if (inside(a) != inside(b)) out.push_back(between(a, b, cross(a, b, at, is_x)));
    }
    dots = std::move(out);
  };
  cut(true, low.x, true);
  cut(true, high.x, false);
  cut(false, low.y, true);
  cut(false, high.y, false);
  return dots;
}

void draw_mark(Drawing& d, Mark mark, Dot at, Ink ink, double size) {
  switch (mark) {
    case Mark::Circle:
      d.circle(at, 0.85 * size, ink, Ink::Panel);
      break;
    case Mark::Square: {
      const double a = 0.8 * size;
      d.area({{at.x - a, at.y - a}, {at.x + a, at.y - a}, {at.x + a, at.y + a}, {at.x - a, at.y + a}}, ink, 1,
             Ink::Panel);
      break;
    }
    case Mark::Triangle:
      d.area({{at.x, at.y - 1.1 * size}, {at.x + size, at.y + 0.8 * size}, {at.x - size, at.y + 0.8 * size}}, ink, 1,
             Ink::Panel);
      break;
    case Mark::Cross: {
      const double a = 0.8 * size;
      d.line({{at.x - a, at.y - a}, {at.x + a, at.y + a}}, ink, 2);
      d.line({{at.x - a, at.y + a}, {at.x + a, at.y - a}}, ink, 2);
      break;
    }
  }
}

Drawing draw(const Plot& p) {
  Drawing d;
  d.width = p.width, d.height = p.height, d.title = p.title;
  Range x_shown, y_shown;
  for (const PlotLine& l : p.lines) {
    for (const double v : l.x) x_shown.add(v);
    for (const double v : l.y) y_shown.add(v);
  }
  for (const PlotBand& b : p.bands) {
    for (const double v : b.x) x_shown.add(v);
    for (const auto* side : {&b.low, &b.high})
      for (const double v : *side) y_shown.add(v);
  }
  const Range xr = widen(x_shown, p.x_low, p.x_high), yr = widen(y_shown, p.y_low, p.y_high);

  // the legend stands on the right; nothing of it, no room for it
  struct Entry {
    std::string name;
    std::function<void(Dot)> sign;
  };
  std::vector<Entry> entries;
  for (const PlotBand& b : p.bands)
    if (!b.name.empty())
      entries.push_back({b.name, [&d, &b](Dot at) {
                           d.area({{at.x, at.y - 6}, {at.x + 26, at.y - 6}, {at.x + 26, at.y + 6}, {at.x, at.y + 6}},
                                  b.ink, b.legend_opacity > 0 ? b.legend_opacity : b.opacity, Ink::Quiet);
                         }});
  for (const PlotLine& l : p.lines)
    if (!l.name.empty())
      entries.push_back({l.name, [&d, &l](Dot at) {
                           d.line({at, {at.x + 26, at.y}}, l.ink, l.width, l.dash, std::max(l.opacity, 0.5));
                         }});
  std::vector<std::string> mark_names;
  const auto is_shown = [&](const PlotMark& m) {
    return m.x >= xr.low && m.x <= xr.high && m.y >= yr.low && m.y <= yr.high;
  };
  for (const PlotMark& m : p.marks) {
    if (m.name.empty() || !is_shown(m) || std::find(mark_names.begin(), mark_names.end(), m.name) != mark_names.end())
      continue;
    mark_names.push_back(m.name);
    const bool is_one_ink = std::all_of(p.marks.begin(), p.marks.end(), [&m](const PlotMark& other) {
      return other.name != m.name || other.ink == m.ink;
    });
    const Ink ink = is_one_ink ? m.ink : Ink::Text;
    entries.push_back({m.name, [&d, &m, ink](Dot at) { draw_mark(d, m.mark, {at.x + 13, at.y}, ink); }});
  }
  size_t longest = p.legend_title.size();
  for (const Entry& e : entries) longest = std::max(longest, e.name.size() + 5);
  const double legend = entries.empty() ? 12 : std::min(0.4 * p.width, 34 + 6.6 * static_cast<double>(longest));
  const double left = 66, right = p.width - legend - 12, top = p.title.empty() ? 14 : 40, bottom = p.height - 50;
  const auto place = [&](double x, double y) {
    return Dot{left + (x - xr.low) / (xr.high - xr.low) * (right - left),
               bottom - (y - yr.low) / (yr.high - yr.low) * (bottom - top)};
  };

  if (!p.title.empty()) d.text({left, 22}, p.title, Ink::Text, 15, 0, true);
  const std::vector<double> x_ticks = find_ticks(xr.low, xr.high, static_cast<int>((right - left) / 80));
  const std::vector<double> y_ticks = find_ticks(yr.low, yr.high, static_cast<int>((bottom - top) / 45));
  const auto step_of = [](const std::vector<double>& t) { return t.size() > 1 ? t[1] - t[0] : 1.0; };
  for (const double t : x_ticks) {
    d.line({place(t, yr.low), place(t, yr.high)}, Ink::Faint);
    const Dot at = place(t, yr.low);
    d.text({at.x, bottom + 17}, tick_text(t, step_of(x_ticks)), Ink::Quiet, 12, 0.5);
  }
  for (const double t : y_ticks) {
    d.line({place(xr.low, t), place(xr.high, t)}, Ink::Faint);
    const Dot at = place(xr.low, t);
    d.text({left - 7, at.y + 4}, tick_text(t, step_of(y_ticks)), Ink::Quiet, 12, 1);
  }
  if (xr.low < 0 && xr.high > 0) d.line({place(0, yr.low), place(0, yr.high)}, Ink::Line);
  if (yr.low < 0 && yr.high > 0) d.line({place(xr.low, 0), place(xr.high, 0)}, Ink::Line);

  const Dot low{left, top}, high{right, bottom};
  for (const PlotBand& b : p.bands) {
    std::vector<Dot> around;
    for (size_t i = 0; i < b.x.size(); ++i) around.push_back(place(b.x[i], b.high[i]));
    for (size_t i = b.x.size(); i-- > 0;) around.push_back(place(b.x[i], b.low[i]));
    d.area(clip_area(std::move(around), low, high), b.ink, b.opacity);
  }
  for (const PlotLine& l : p.lines) {
    std::vector<Dot> dots;
    for (size_t i = 0; i < l.x.size(); ++i) dots.push_back(place(l.x[i], l.y[i]));
    for (auto& part : clip_line(dots, low, high)) d.line(std::move(part), l.ink, l.width, l.dash, l.opacity);
  }
  d.line({low, {right, top}, high, {left, bottom}, low}, Ink::Line);
  for (const PlotMark& m : p.marks)
    if (is_shown(m)) draw_mark(d, m.mark, place(m.x, m.y), m.ink);
  d.text({0.5 * (left + right), p.height - 12}, p.x_title, Ink::Text, 13, 0.5);
  d.text({18, 0.5 * (top + bottom)}, p.y_title, Ink::Text, 13, 0.5);
  d.shapes.back().turn = -90;

  double y = top + 8;
  if (!entries.empty() && !p.legend_title.empty()) {
    d.text({right + 16, y + 4}, p.legend_title, Ink::Quiet, 12, 0, true);
    y += 22;
  }
  for (const Entry& e : entries) {
    e.sign({right + 16, y});
    d.text({right + 50, y + 4}, e.name, Ink::Text, 12);
    y += 20;
  }
  return d;
}

}  // namespace topple::record
