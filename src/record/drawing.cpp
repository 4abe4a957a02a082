#include "record/drawing.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "record/inks.h"

namespace topple::record {

namespace {

/// Hundredths of a point are finer than any screen; whole numbers stay short.
std::string number(double v) {
  std::string text = fmt::format("{:.2f}", v);
  while (text.back() == '0') text.pop_back();
  if (text.back() == '.') text.pop_back();
  return text == "-0" ? "0" : text;
}

std::string path_of(const std::vector<Dot>& dots, bool closed) {
  std::string d;
  for (size_t i = 0; i < dots.size(); ++i)
    d += fmt::format("{}{} {}", i == 0 ? "M" : "L", number(dots[i].x), number(dots[i].y));
  return closed ? d + "Z" : d;
}

std::string classes_of(const Shape& s) {
  std::string names;
  if (s.fill != Ink::None) names += fmt::format("f-{}", colours_of(s.fill).name);
  if (s.stroke != Ink::None) names += fmt::format("{}s-{}", names.empty() ? "" : " ", colours_of(s.stroke).name);
  return names;
}

}  // namespace

const InkColours& colours_of(Ink ink) {
  static constexpr std::array<InkColours, 20> table{{{"none", 0, 0},
                                                     {"text", 0x1b232b, 0xe6eaee},
                                                     {"quiet", 0x55616d, 0x9aa7b4},
                                                     {"line", 0x9aa5b0, 0x5a6672},
                                                     {"faint", 0xe4e8ec, 0x272f37},
                                                     {"panel", 0xffffff, 0x181d23},
                                                     {"0", 0x0072b2, 0x56b4e9},
                                                     {"1", 0xd55e00, 0xf07f3c},
                                                     {"2", 0x00805c, 0x3fc79a},
                                                     {"3", 0xb85c93, 0xe09bc4},
                                                     {"4", 0x9a6b00, 0xf0c04a},
                                                     {"5", 0x4a4a4a, 0xc9d1d9},
                                                     {"uncracked", 0xd9dee3, 0x4a545e},
                                                     {"cracked", 0xf6e3a1, 0x8a7633},
                                                     {"open", 0xffffff, 0x181d23},
                                                     {"compressed", 0x9cc7e6, 0x2f6f9c},
                                                     {"crushing", 0xe8833a, 0xc9621d},
                                                     {"crushed", 0x8c1f3f, 0xe0567f},
                                                     {"tension", 0x0072b2, 0x56b4e9},
                                                     {"compression", 0xd55e00, 0xf07f3c}}};
  return table[static_cast<size_t>(ink)];
}

Ink series_ink(std::size_t i) { return static_cast<Ink>(static_cast<size_t>(Ink::Series0) + i % 6); }

void Drawing::line(std::vector<Dot> dots, Ink ink, double stroke, std::vector<double> dash, double opacity) {
  if (dots.size() < 2) return;
  Shape s;
  s.kind = Shape::Kind::Line;
  s.dots = std::move(dots), s.stroke = ink, s.width = stroke, s.dash = std::move(dash), s.opacity = opacity;
  shapes.push_back(std::move(s));
}

void Drawing::area(std::vector<Dot> dots, Ink fill, double opacity, Ink stroke) {
  if (dots.size() < 3) return;
  Shape s;
  s.kind = Shape::Kind::Area;
  s.dots = std::move(dots), s.fill = fill, s.stroke = stroke, s.opacity = opacity;
  shapes.push_back(std::move(s));
}

void Drawing::circle(Dot centre, double radius, Ink fill, Ink stroke) {
  Shape s;
  s.kind = Shape::Kind::Circle;
  s.dots = {centre}, s.radius = radius, s.fill = fill, s.stroke = stroke;
  shapes.push_back(std::move(s));
}

void Drawing::text(Dot at, const std::string& words, Ink ink, double size, double anchor, bool bold) {
  Shape s;
  s.kind = Shape::Kind::Text;
  s.dots = {at}, s.text = words, s.fill = ink, s.size = size, s.anchor = anchor, s.bold = bold;
  shapes.push_back(std::move(s));
}

std::string escape_html(const std::string& text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string to_svg(const Drawing& d) {
  const std::string title = escape_html(d.title);
  std::string out = fmt::format(R"(<svg class="drawing" viewBox="0 0 {} {}" role="img" aria-label="{}">)",
                                number(d.width), number(d.height), title);
  for (const Shape& s : d.shapes) {
    std::string more;
    if (s.opacity != 1) more += fmt::format(R"( opacity="{}")", number(s.opacity));
    if (s.stroke != Ink::None && s.width != 1) more += fmt::format(R"( stroke-width="{}")", number(s.width));
    if (!s.dash.empty()) {
      std::string list;
      for (const double v : s.dash) list += (list.empty() ? "" : " ") + number(v);
      more += fmt::format(R"( stroke-dasharray="{}")", list);
    }
    const Dot at = s.dots.front();
    switch (s.kind) {
      case Shape::Kind::Line:
      case Shape::Kind::Area:
        out += fmt::format(R"(<path class="{}" d="{}"{}/>)", classes_of(s),
                           path_of(s.dots, s.kind == Shape::Kind::Area), more);
        break;
      case Shape::Kind::Circle:
        out += fmt::format(R"(<circle class="{}" cx="{}" cy="{}" r="{}"{}/>)", classes_of(s), number(at.x),
                           number(at.y), number(s.radius), more);
        break;
      case Shape::Kind::Text:
        if (s.anchor != 0) more += fmt::format(R"( text-anchor="{}")", s.anchor == 1 ? "end" : "middle");
        if (s.turn != 0)
          more += fmt::format(R"-( transform="rotate({} {} {})")-", number(s.turn), number(at.x), number(at.y));
        if (s.bold) more += R"( font-weight="650")";
        out += fmt::format(R"(<text class="{}" x="{}" y="{}" font-size="{}"{}>{}</text>)", classes_of(s), number(at.x),
                           number(at.y), number(s.size), more, escape_html(s.text));
        break;
    }
    out += '\n';
  }
  return out + "</svg>";
}

std::string drawing_css() {
  std::string light, dark, rules;
  for (size_t i = 1; i < ink_count; ++i) {
    const InkColours& c = colours_of(static_cast<Ink>(i));
    light += fmt::format("--ink-{}:#{:06x};", c.name, c.light);
    dark += fmt::format("--ink-{}:#{:06x};", c.name, c.dark);
    rules += fmt::format(".drawing .f-{0}{{fill:var(--ink-{0})}}\n.drawing .s-{0}{{stroke:var(--ink-{0})}}\n", c.name);
  }
  return ":root{" + light + "color-scheme:light}\n@media screen and (prefers-color-scheme:dark){:root{" + dark +
         "color-scheme:dark}}\n.drawing{display:block;width:100%;height:auto}\n"
         ".drawing path{fill:none;stroke-linejoin:round}\n" +
         rules;
}

}  // namespace topple::record
