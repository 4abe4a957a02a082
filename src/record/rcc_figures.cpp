#include "record/rcc_figures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/unit.h"
#include "record/plot.h"
#include "record/rcc_states.h"

namespace topple::record {

namespace {

constexpr double mrad = 1e-3;

const std::vector<std::vector<double>> dashes{{},           {9, 4},        {2, 3},  {12, 3, 2, 3},      {5, 2},
                                              {1, 2, 6, 2}, {16, 4, 6, 4}, {18, 5}, {12, 3, 2, 3, 2, 3}};
constexpr size_t inks = 6;

/// Routes share the ink of their force; 24 forces on two routes differ.
const std::vector<double>& dash_of_route(size_t k, size_t route, size_t routes) {
  return routes > 1 ? dashes[(route + routes * (k / inks)) % dashes.size()] : dash_of(k);
}

std::string force_text(double N) { return fmt::format("{} MN", shown(N, unit::MN)); }

/// Different values in the order of their first appearance.
template <class T, class Value>
auto collect(const std::vector<T>& list, Value value) {
  std::vector<decltype(value(list.front()))> out;
  for (const T& item : list)
    if (std::find(out.begin(), out.end(), value(item)) == out.end()) out.push_back(value(item));
  return out;
}

std::vector<double> forces_of(const RccReport& r) {
  return collect(r.curves, [](const RccCurve& c) { return c.normal_force; });
}
std::vector<std::string> routes_of(const RccReport& r) {
  return collect(r.curves, [](const RccCurve& c) { return c.route; });
}

const RccCurve* find_curve(const RccReport& r, const std::string& route, char axis, int direction, double N) {
  for (const RccCurve& c : r.curves)
    if (c.route == route && c.axis == axis && c.direction == direction && c.normal_force == N) return &c;
  return nullptr;
}

double at(const RccCurve& c, double rotation) {
  if (c.rotation.empty() || rotation > c.rotation.back()) return std::numeric_limits<double>::quiet_NaN();
  const auto above = std::lower_bound(c.rotation.begin(), c.rotation.end(), rotation);
  const size_t j = static_cast<size_t>(above - c.rotation.begin());
  if (j == 0) return c.moment.front();
  const double s = (rotation - c.rotation[j - 1]) / (c.rotation[j] - c.rotation[j - 1]);
  return c.moment[j - 1] + s * (c.moment[j] - c.moment[j - 1]);
}

std::string name_of_line(const RccReport& r, const RccCurve& c) {
  return routes_of(r).size() > 1 ? fmt::format("{}, {}", force_text(c.normal_force), c.route)
                                 : force_text(c.normal_force);
}

/// Moments over rotations up to `last`, both directions or the positive one alone.
Plot make_moment_plot(const RccReport& r, char axis, double last, bool both) {
  Plot p;
  p.title = fmt::format("Bending about {}: moment over rotation", axis);
  p.x_title = "rotation φ of the zone [mrad]";
  p.y_title = fmt::format("moment M about {} [kNm]", axis);
  p.legend_title = "normal force N";
  p.x_low = both ? -last / mrad : 0, p.x_high = last / mrad;
  const std::vector<double> forces = forces_of(r);
  const std::vector<std::string> routes = routes_of(r);
  for (size_t k = 0; k < forces.size(); ++k)
    for (size_t route = 0; route < routes.size(); ++route) {
      PlotLine line;
      line.ink = series_ink(k);
      line.dash = dash_of_route(k, route, routes.size());
      for (const int direction : {-1, 1}) {
        const RccCurve* c = find_curve(r, routes[route], axis, direction, forces[k]);
        if (!c || c->rotation.empty() || (direction < 0 && !both)) continue;
        line.name = name_of_line(r, *c);
        std::vector<double> x, y;
        for (size_t j = 0; j < c->rotation.size(); ++j) {
          x.push_back(direction * c->rotation[j] / mrad);
          y.push_back(direction * c->moment[j] / unit::kNm);
          if (c->rotation[j] > last) break;
        }
        if (direction < 0) std::reverse(x.begin(), x.end()), std::reverse(y.begin(), y.end());
        line.x.insert(line.x.end(), x.begin(), x.end());
        line.y.insert(line.y.end(), y.begin(), y.end());
        const auto mark = [&](const char* name, const RccPoint& point, Mark sign) {
          if (std::isfinite(point.rotation))
            p.marks.push_back(
                {name, direction * point.rotation / mrad, direction * point.moment / unit::kNm, sign, line.ink});
        };
        mark("yield", c->yield, Mark::Circle);
        mark("peak", c->peak, Mark::Triangle);
        mark("ultimate", c->ultimate, Mark::Square);
        mark("end of the curve", c->end, Mark::Cross);
      }
      if (!line.x.empty()) p.lines.push_back(std::move(line));
    }
  return p;
}

/// Common rotations for people to read: yield and peak lie on rising steps of one fifth.
FigureTable make_moment_table(const RccReport& r, char axis, double last) {
  FigureTable t;
  t.heads.push_back("φ [mrad]");
  std::vector<const RccCurve*> curves;
  for (const double N : forces_of(r))
    for (const std::string& route : routes_of(r))
      for (const int direction : {1, -1})
        if (const RccCurve* c = find_curve(r, route, axis, direction, N); c && !c->rotation.empty()) {
          curves.push_back(c);
          t.heads.push_back(fmt::format("M{} [kNm], N = {}{}", direction < 0 ? "-" : "+", force_text(N),
                                        routes_of(r).size() > 1 ? ", " + route : ""));
        }
  std::vector<double> rotation{0};
  for (double phi = 0.1 * mrad; phi < last; phi *= 1.2) rotation.push_back(phi);
  rotation.push_back(last);
  for (const double phi : rotation) {
    std::vector<std::string> row{fmt::format("{:.4g}", phi / mrad)};
    for (const RccCurve* c : curves) row.push_back(shown(at(*c, phi), unit::kNm));
    t.rows.push_back(std::move(row));
  }
  return t;
}

void add_moments(const RccReport& r, char axis, std::vector<Figure>& out) {
  double whole = 0, beginning = 0;
  for (const RccCurve& c : r.curves) {
    if (c.axis != axis || c.rotation.empty()) continue;
    const double last = std::isfinite(c.residual.rotation) ? 1.05 * c.residual.rotation : c.end.rotation;
    whole = std::max(whole, std::min(c.end.rotation, last));
    if (std::isfinite(c.peak.rotation)) beginning = std::max(beginning, 1.3 * c.peak.rotation);
  }
  if (!(whole > 0)) return;
  const std::string heading = fmt::format("Bending about {}", axis);
  const std::string sides = axis == 'y' ? "Positive rotations pull at +z, negative ones at -z."
                                        : "Positive rotations pull at -y, negative ones at +y.";
  Figure f;
  f.id = fmt::format("moment_{}", axis);
  f.heading = heading;
  f.caption = "Moment over rotation at constant normal force, compression positive. " + sides +
              " A cross is where the section loses the normal force or its last moment.";
  f.drawing = draw(make_moment_plot(r, axis, whole, true));
  f.table = make_moment_table(r, axis, whole);
  out.push_back(std::move(f));
  if (!(beginning > 0 && beginning < 0.8 * whole)) return;
  Figure g;
  g.id = fmt::format("moment_{}_beginning", axis);
  g.heading = heading;
  g.caption = "The beginning of the same curves, positive direction.";
  Plot p = make_moment_plot(r, axis, beginning, false);
  p.title += ", beginning";
  g.drawing = draw(p);
  g.table = make_moment_table(r, axis, beginning);
  out.push_back(std::move(g));
}

void add_interaction(const RccReport& r, char axis, std::vector<Figure>& out) {
  Plot p;
  p.title = fmt::format("Bending about {}: resistance over normal force", axis);
  p.x_title = fmt::format("moment M about {} [kNm]", axis);
  p.y_title = "normal force N [MN], compression positive";
  const auto routes = collect(r.interactions, [](const RccInteraction& i) { return i.route; });
  Figure f;
  f.table.heads.push_back("N [MN]");
  size_t rows = 0;
  bool is_one_sided = false, lacks_yield = false;
  for (size_t k = 0; k < routes.size(); ++k) {
    PlotLine yield, peak;
    for (const RccInteraction& i : r.interactions) {
      if (i.axis != axis || i.route != routes[k]) continue;
      const std::string where = routes.size() > 1 ? ", " + i.route : "";
      std::vector<std::string> names{fmt::format("yield M{} [kNm]{}", i.direction < 0 ? "-" : "+", where),
                                     fmt::format("largest M{} [kNm]{}", i.direction < 0 ? "-" : "+", where)};
      f.table.heads.insert(f.table.heads.end(), names.begin(), names.end());
      rows = std::max(rows, i.normal_force.size());
      f.table.rows.resize(rows);
      std::vector<double> N, My, Mp;
      for (size_t j = 0; j < i.normal_force.size(); ++j) {
        N.push_back(i.normal_force[j] / unit::MN);
        lacks_yield = lacks_yield || !std::isfinite(i.yield_moment[j]);
        is_one_sided = is_one_sided || i.peak_moment[j] < -1e-6 * r.crushing_force;
        My.push_back(i.direction * i.yield_moment[j] / unit::kNm);
        Mp.push_back(i.direction * i.peak_moment[j] / unit::kNm);
        std::vector<std::string>& row = f.table.rows[j];
        if (row.empty()) row.push_back(shown(i.normal_force[j], unit::MN));
        row.push_back(shown(i.yield_moment[j], unit::kNm));
        row.push_back(shown(i.peak_moment[j], unit::kNm));
      }
      if (i.direction < 0)
        for (auto* list : {&N, &My, &Mp}) std::reverse(list->begin(), list->end());
      // up on the right side, down on the left one
      for (size_t j = 0; j < N.size(); ++j)
        if (std::isfinite(My[j])) yield.x.push_back(My[j]), yield.y.push_back(N[j]);
      peak.x.insert(peak.x.end(), Mp.begin(), Mp.end());
      peak.y.insert(peak.y.end(), N.begin(), N.end());
    }
    const std::string where = routes.size() > 1 ? ", " + routes[k] : "";
    yield.name = "at first yield" + where, peak.name = "largest moment (peak)" + where;
    yield.ink = Ink::Series2, peak.ink = Ink::Series0;
    yield.dash = k == 0 ? std::vector<double>{7, 4} : std::vector<double>{2, 3};
    if (k > 0) peak.dash = {12, 3, 2, 3};
    if (!peak.x.empty()) p.lines.push_back(std::move(peak)), p.lines.push_back(std::move(yield));
  }
  if (p.lines.empty()) return;
  for (const RccCurve& c : r.curves)
    if (c.axis == axis && std::isfinite(c.peak.moment)) {
      const std::string of = c.route == "layered" ? "" : ", " + c.route;
      p.marks.push_back({"peak of a curve" + of, c.direction * c.peak.moment / unit::kNm, c.normal_force / unit::MN,
                         of.empty() ? Mark::Triangle : Mark::Square, Ink::Series1});
    }
  f.id = fmt::format("interaction_{}", axis);
  f.heading = fmt::format("Bending about {}", axis);
  f.caption = fmt::format(
      "Strained evenly the section crushes at {} and tears at {} of tension. Between, a moment inside the dashed line "
      "leaves it elastic, one outside the full line is not resisted.",
      force_text(r.crushing_force), force_text(r.rupture_force));
  if (is_one_sided)
    f.caption +=
        " Near both ends, where the dashed line is missing, the section is not symmetric enough to carry N without a "
        "moment: it needs one between both sides of the full line.";
  else if (lacks_yield)
    f.caption += " Where the dashed line is missing, N alone makes the bars yield.";
  f.drawing = draw(p);
  out.push_back(std::move(f));
}

void add_biaxial(const RccReport& r, std::vector<Figure>& out) {
  Plot p;
  p.title = "Bending about both axes: largest moments";
  p.x_title = "moment about y [kNm]", p.y_title = "moment about z [kNm]";
  p.legend_title = "normal force N";
  p.width = 720, p.height = 560;
  Figure f;
  f.table.heads = {"N [MN]", "My [kNm]", "Mz [kNm]"};
  for (size_t k = 0; k < r.biaxial.size(); ++k) {
    const RccBiaxial& b = r.biaxial[k];
    PlotLine line;
    line.name = force_text(b.normal_force), line.ink = series_ink(k), line.dash = dash_of(k);
    for (size_t j = 0; j < b.moment_y.size(); ++j) {
      line.x.push_back(b.moment_y[j] / unit::kNm), line.y.push_back(b.moment_z[j] / unit::kNm);
      f.table.rows.push_back(
          {shown(b.normal_force, unit::MN), shown(b.moment_y[j], unit::kNm), shown(b.moment_z[j], unit::kNm)});
    }
    if (!line.x.empty()) p.lines.push_back(std::move(line));
  }
  if (p.lines.empty()) return;
  f.id = "biaxial";
  f.heading = "Bending about both axes";
  f.caption = fmt::format(
      "Largest moments while the zone turns about an oblique axis, positive directions, from a moment about y alone to "
      "one about z alone. (My/My,end)^p + (Mz/Mz,end)^p = 1 with the ends of each curve meets these points best with "
      "p = {}. A building's model joins both axes in this way, with the exponent of its rules.",
      shown(r.biaxial_exponent, 1, 3));
  f.drawing = draw(p);
  out.push_back(std::move(f));
}

void add_axial(const RccReport& r, std::vector<Figure>& out) {
  double crush = 0;
  for (const RccAxial& a : r.axial)
    for (size_t j = 0; j < a.normal_force.size(); ++j)
      if (a.normal_force[j] >= *std::max_element(a.normal_force.begin(), a.normal_force.end()))
        crush = std::max(crush, a.shortening[j]);
  for (const bool whole : {false, true}) {
    Plot p;
    p.title = whole ? "Normal force without bending, whole" : "Normal force without bending";
    p.x_title = "shortening of the zone [mm]";
    p.y_title = "normal force N [MN], compression positive";
    if (!whole) p.x_low = -4 * crush / unit::mm, p.x_high = 12 * crush / unit::mm;
    Figure f;
    for (size_t k = 0; k < r.axial.size(); ++k) {
      PlotLine line;
      line.name = r.axial[k].route, line.ink = series_ink(k), line.dash = dash_of(k);
      if (r.axial.size() == 1) line.name.clear();
      for (size_t j = 0; j < r.axial[k].shortening.size(); ++j) {
        line.x.push_back(r.axial[k].shortening[j] / unit::mm);
        line.y.push_back(r.axial[k].normal_force[j] / unit::MN);
        if (whole) {
          if (k == 0) f.table.heads = {"route", "shortening [mm]", "N [MN]"};
          f.table.rows.push_back({r.axial[k].route, shown(r.axial[k].shortening[j], unit::mm),
                                  shown(r.axial[k].normal_force[j], unit::MN)});
        }
      }
      p.lines.push_back(std::move(line));
    }
    if (p.lines.empty()) return;
    f.id = whole ? "axial_whole" : "axial";
    f.heading = "Axial law";
    f.caption = whole ? "The same as far as it is computed: bars tear in tension, buckled bars are left in compression."
                      : "Force that the zone resists while it is shortened or pulled without bending.";
    f.drawing = draw(p);
    out.push_back(std::move(f));
  }
}

/// One picture for each normal force of an axis and direction.
void add_states(const RccReport& r, char axis, int direction, std::vector<Figure>& out) {
  const std::vector<double> forces = forces_of(r);
  for (size_t k = 0; k < forces.size(); ++k) {
    std::vector<const RccState*> states;
    for (const RccState& s : r.states)
      if (s.axis == axis && s.direction == direction && s.normal_force == forces[k]) states.push_back(&s);
    if (states.empty()) continue;
    Figure f;
    f.id = fmt::format("section_{}_{}_{}", axis, direction < 0 ? "neg" : "pos", k + 1);
    f.heading = fmt::format("The section, bent about {}, {} direction", axis, direction < 0 ? "negative" : "positive");
    f.caption =
        fmt::format("N = {}: conditions, strains and stresses at yield, peak and ultimate.", force_text(forces[k]));
    f.drawing = draw_states(r, states);
    f.table = make_state_table(states);
    f.is_detail = axis != 'y' || direction < 0;
    out.push_back(std::move(f));
  }
}

void add_solid_states(const RccReport& r, std::vector<Figure>& out) {
  const std::vector<double> forces = collect(r.solid_states, [](const RccSolidState& s) { return s.normal_force; });
  for (size_t k = 0; k < forces.size(); ++k) {
    std::vector<const RccSolidState*> states;
    for (const RccSolidState& s : r.solid_states)
      if (s.normal_force == forces[k]) states.push_back(&s);
    Figure f;
    f.id = fmt::format("solid_{}", k + 1);
    f.heading = "The zone on the solid route";
    f.caption = fmt::format(
        "N = {}: stresses of the concrete in a cut and cracks and crushing seen from the side (the worst across the "
        "breadth), at the rotations of yield, peak and ultimate of the layered route.",
        force_text(forces[k]));
    f.drawing = draw_solid_states(r, states);
    f.table = make_solid_table(states);
    out.push_back(std::move(f));
  }
}

bool has_other_direction(const RccReport& r, char axis) {
  for (const RccCurve& a : r.curves)
    for (const RccCurve& b : r.curves) {
      if (a.axis != axis || b.axis != axis || a.route != b.route || a.normal_force != b.normal_force) continue;
      if (a.direction == b.direction || a.moment.empty() || b.moment.empty()) continue;
      if (std::abs(a.peak.moment - b.peak.moment) > 1e-5 * a.peak.moment) return true;
    }
  return false;
}

}  // namespace

const std::vector<double>& dash_of(size_t k) { return dashes[(k + k / inks) % dashes.size()]; }

std::string shown(double value, double unit, int digits) {
  if (!std::isfinite(value)) return "-";
  const double v = value / unit;
  if (std::abs(v) < 1e-9) return "0";
  const int decimals = std::max(0, digits - 1 - static_cast<int>(std::floor(std::log10(std::abs(v)))));
  std::string text = fmt::format("{:.{}f}", v, std::min(decimals, 6));
  if (text.find('.') != std::string::npos) {
    while (text.back() == '0') text.pop_back();
    if (text.back() == '.') text.pop_back();
  }
  return text;
}

std::vector<Figure> make_figures(const RccReport& r) {
  std::vector<Figure> out;
  for (const char axis : {'y', 'z'}) {
    add_moments(r, axis, out);
    add_interaction(r, axis, out);
  }
  add_biaxial(r, out);
  add_axial(r, out);
  add_solid_states(r, out);
  for (const char axis : {'y', 'z'}) {
    add_states(r, axis, 1, out);
    if (has_other_direction(r, axis)) add_states(r, axis, -1, out);
  }
  return out;
}

}  // namespace topple::record
