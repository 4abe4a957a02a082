#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "base/unit.h"
#include "record/rcc_states.h"

namespace topple::record {

namespace {

constexpr double row_height = 290, picture = 220, head = 40, left = 48;

/// Bins of crack widths and of lost strength, each with its colour.
struct Bin {
  double from;
  Ink ink;
  double opacity;
  const char* name;
};
constexpr Bin cracks[] = {{0.05e-3, Ink::Cracked, 0.6, "from 0.05 mm"},
                          {0.2e-3, Ink::Cracked, 1, "from 0.2 mm"},
                          {1e-3, Ink::Series4, 0.9, "from 1 mm"},
                          {5e-3, Ink::Text, 0.8, "from 5 mm"}};
constexpr Bin crushes[] = {{0.05, Ink::Crushing, 0.4, "5 % of strength lost"},
                           {0.3, Ink::Crushing, 1, "30 %"},
                           {0.8, Ink::Crushed, 1, "80 %"}};

const Bin* find_bin(std::span<const Bin> bins, double value) {
  const Bin* found = nullptr;
  for (const Bin& b : bins)
    if (value >= b.from) found = &b;
  return found;
}

void draw_box(Drawing& d, double x0, double y0, double x1, double y1, Ink ink, double opacity) {
  d.area({{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}}, ink, opacity);
}

void draw_frame(Drawing& d, double x0, double y0, double x1, double y1) {
  d.line({{x0, y0}, {x1, y0}, {x1, y1}, {x0, y1}, {x0, y0}}, Ink::Text);
}

/// Compression in blue over the strength, tension in orange over the tensile strength.
void draw_cut(Drawing& d, const RccReport& r, const RccSolidState& s, double x, double top, double scale) {
  const bool about_y = s.axis == 'y';
  const double depth = about_y ? r.height : r.width, breadth = about_y ? r.width : r.height;
  const auto px = [&](double across) { return x + (0.5 + across / breadth) * breadth * scale; };
  const auto py = [&](double along) { return top + (0.5 - along / depth) * depth * scale; };
  for (const RccSolidState::CutCell& c : s.cut) {
    const double a0 = about_y ? c.y_from : -c.z_to, a1 = about_y ? c.y_to : -c.z_from;
    const double b0 = about_y ? c.z_from : c.y_from, b1 = about_y ? c.z_to : c.y_to;
    const bool pulls = c.stress > 0;
    const double share = pulls ? c.stress / std::max(r.fct, 1.0) : -c.stress / std::max(r.fc, 1.0);
    draw_box(d, px(a0), py(b1), px(a1), py(b0), pulls ? Ink::Series1 : Ink::Series0, std::clamp(share, 0.0, 1.0));
  }
  draw_frame(d, px(-0.5 * breadth), py(0.5 * depth), px(0.5 * breadth), py(-0.5 * depth));
  for (const RccSolidState::Bar& b : s.bars) {
    const Dot at{px(about_y ? b.y : -b.z), py(about_y ? b.z : b.y)};
    d.circle(at, 5, Ink::Panel, Ink::Text);
    const std::string stress = shown(b.stress, unit::MPa, 3);
    const double half = 3.4 * static_cast<double>(stress.size());
    draw_box(d, at.x - half, at.y - 18, at.x + half, at.y - 6, Ink::Panel, 0.8);
    d.text({at.x, at.y - 8}, stress, Ink::Text, 10.5, 0.5);
  }
}

void draw_side(Drawing& d, const RccReport& r, const RccSolidState& s, double x, double top, double scale,
               bool is_crushing) {
  const double depth = s.axis == 'y' ? r.height : r.width;
  double length = 0;
  for (const RccSolidState::SideCell& c : s.side) length = std::max(length, c.x_to);
  const auto px = [&](double at) { return x + at * scale; };
  const auto py = [&](double a) { return top + (0.5 - a / depth) * depth * scale; };
  for (const RccSolidState::SideCell& c : s.side) {
    const Bin* bin = is_crushing ? find_bin(crushes, c.crushing) : find_bin(cracks, c.crack_width);
    if (bin) draw_box(d, px(c.x_from), py(c.a_to), px(c.x_to), py(c.a_from), bin->ink, bin->opacity);
  }
  draw_frame(d, px(0), py(0.5 * depth), px(length), py(-0.5 * depth));
}

}  // namespace

Drawing draw_solid_states(const RccReport& r, const std::vector<const RccSolidState*>& states) {
  Drawing d;
  const RccSolidState& first = *states.front();
  d.width = 960;
  d.height = head + row_height * static_cast<double>(states.size()) + 60;
  d.title = fmt::format("Solid route, bent about {}{}, N = {} MN", first.direction < 0 ? '-' : '+', first.axis,
                        shown(first.normal_force, unit::MN));
  d.text({left, 22}, d.title, Ink::Text, 15, 0, true);
  const double depth = first.axis == 'y' ? r.height : r.width, breadth = first.axis == 'y' ? r.width : r.height;
  constexpr double gap = 40;
  const double room = d.width - left - 20 - 2 * gap;
  const double scale = std::min(picture / depth, room / (breadth + 2 * std::max(r.length, 1e-6)));
  const char along = first.axis == 'y' ? 'z' : 'y';
  double y = head;
  for (const RccSolidState* s : states) {
    d.text({left, y + 16},
           fmt::format("φ = {} mrad, M = {} kNm; N over the cut {} MN", shown(s->rotation, 1e-3),
                       shown(s->moment, unit::kNm), shown(s->cut_normal_force, unit::MN)),
           Ink::Text, 13, 0, true);
    const double top = y + 44, x1 = left + breadth * scale + gap, x2 = x1 + r.length * scale + gap;
    d.text({left, top - 8}, fmt::format("cut at x = {} m", shown(s->cut_at, 1, 3)), Ink::Quiet, 12);
    d.text({x1, top - 8}, "cracks, from the side", Ink::Quiet, 12);
    d.text({x2, top - 8}, "crushing, from the side", Ink::Quiet, 12);
    d.text({left - 8, top + 6}, fmt::format("+{}", along), Ink::Quiet, 11, 1);
    d.text({left - 8, top + depth * scale}, fmt::format("-{}", along), Ink::Quiet, 11, 1);
    draw_cut(d, r, *s, left, top, scale);
    draw_side(d, r, *s, x1, top, scale, false);
    draw_side(d, r, *s, x2, top, scale, true);
    y += row_height;
  }
  y += 12;
  double x = left;
  const auto entry = [&](Ink ink, double opacity, const std::string& name) {
    draw_box(d, x, y - 7, x + 18, y + 6, ink, opacity);
    d.line({{x, y - 7}, {x + 18, y - 7}, {x + 18, y + 6}, {x, y + 6}, {x, y - 7}}, Ink::Line);
    d.text({x + 23, y + 4}, name, Ink::Text, 12);
    x += 42 + 6.8 * static_cast<double>(name.size());
  };
  entry(Ink::Series0, 1, fmt::format("compression of fc = {} N/mm2", shown(r.fc, unit::MPa, 3)));
  entry(Ink::Series0, 0.5, "half of it");
  entry(Ink::Series1, 1, fmt::format("tension of fct = {} N/mm2", shown(r.fct, unit::MPa, 3)));
  d.text({x, y + 4}, "numbers: bars [N/mm2]", Ink::Text, 12);
  x = left, y += 26;
  d.text({x, y + 4}, "Cracks", Ink::Quiet, 12, 0, true);
  x += 56;
  for (const Bin& b : cracks) entry(b.ink, b.opacity, b.name);
  d.text({x, y + 4}, "Crushing", Ink::Quiet, 12, 0, true);
  x += 68;
  for (const Bin& b : crushes) entry(b.ink, b.opacity, b.name);
  return d;
}

FigureTable make_solid_table(const std::vector<const RccSolidState*>& states) {
  FigureTable t;
  t.heads = {"φ [mrad]", "part", "y [cm]", "z [cm]", "stress [N/mm²]"};
  for (const RccSolidState* s : states) {
    const std::string phi = shown(s->rotation, 1e-3);
    for (const RccSolidState::CutCell& c : s->cut)
      t.rows.push_back({phi, "concrete", shown(0.5 * (c.y_from + c.y_to), unit::cm),
                        shown(0.5 * (c.z_from + c.z_to), unit::cm), shown(c.stress, unit::MPa)});
    for (const RccSolidState::Bar& b : s->bars)
      t.rows.push_back({phi, "bar", shown(b.y, unit::cm), shown(b.z, unit::cm), shown(b.stress, unit::MPa)});
  }
  return t;
}

}  // namespace topple::record
