#include "farfield/lsdyna.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <tuple>

namespace topple::farfield {

namespace {

/// A number in a field of `width` characters, with as many digits as fit.
std::string field(double value, int width = 10) {
  for (int digits = 15; digits > 0; --digits) {
    std::string text = fmt::format("{:.{}g}", value, digits);
    // 1e+10 is 1e10 for a reader of keyword files, and one digit shorter
    if (const size_t at = text.find("e+"); at != std::string::npos) text.erase(at + 1, 1);
    if (static_cast<int>(text.size()) < width) return fmt::format("{:>{}}", text, width);
  }
  return std::string(static_cast<size_t>(width), ' ');
}

std::string whole_number(long value, int width = 10) { return fmt::format("{:>{}}", value, width); }

/// Cards under a keyword.
class Deck {
 public:
  void keyword(const std::string& name) { text += "*" + name + "\n"; }
  void comment(const std::string& words) { text += "$ " + words + "\n"; }
  void line(const std::string& words) { text += words + "\n"; }
  /// Fields of ten characters; empty ones are left to their defaults.
  template <class... Fields>
  void card(const Fields&... fields) {
    (add(fields), ...);
    text.erase(text.find_last_not_of(' ') + 1);
    text += '\n';
  }
  std::string text;

 private:
  void add(double value) { text += field(value); }
  void add(int value) { text += whole_number(value); }
  void add(const char*) { text += std::string(10, ' '); }
};

/// Elements that are one part of the file.
struct PartKey {
  int member = 0, material = 0, charge = -1;
  auto operator<=>(const PartKey&) const = default;
};

}  // namespace

std::string to_lsdyna(const product::Plan& plan, const Whole& whole, const collapse::ModelMap& map, double duration,
                      double body_friction) {
  const fem::ExplicitModel& fe = whole.fe;
  std::vector<int> charge_of(fe.elements.size(), -1);
  std::vector<double> fires(whole.charges.size(), -1);
  for (size_t c = 0; c < whole.charges.size(); ++c)
    for (const collapse::Firing& f : map.schedule) {
      if (f.fails || f.stage != whole.charges[c].stage || f.charge != whole.charges[c].charge) continue;
      fires[c] = f.time;
      for (const int e : whole.charges[c].elements) charge_of[static_cast<size_t>(e)] = static_cast<int>(c);
    }
  std::map<PartKey, std::vector<int>> parts;
  for (size_t e = 0; e < fe.elements.size(); ++e)
    parts[{whole.grid.cells[e].member, fe.elements[e].material, charge_of[e]}].push_back(static_cast<int>(e));

  Deck d;
  d.keyword("KEYWORD");
  d.keyword("TITLE");
  // 80 bytes, whole characters; what begins as a keyword or a comment is none behind a blank
  std::string title = plan.title;
  if (title.starts_with('*') || title.starts_with('$')) title.insert(0, " ");
  size_t end = std::min<size_t>(title.size(), 80);
  while (end < title.size() && end > 0 && (static_cast<unsigned char>(title[end]) & 0xC0) == 0x80) --end;
  title.resize(end);
  std::replace_if(
      title.begin(), title.end(), [](char c) { return c == '\n' || c == '\r'; }, ' ');
  d.line(title);
  d.comment("written by topple; units kg, m, s, N, Pa, J");
  d.comment("LS-DYNA puts on the dead load by dynamic relaxation; charges fire at their times after that.");
  for (const std::string& note : whole.notes) d.comment(note);
  d.comment("Charges take effect at once and leave no bars; beside them concrete is damaged from the start.");
  d.comment("Bulk concrete and bars are one material. Elements fail at the plastic strain at which the bars tear;");
  d.comment("crushed ones stay, so that their volume does.");
  d.keyword("CONTROL_TERMINATION");
  d.card(duration);
  d.keyword("CONTROL_TIMESTEP");
  d.card(0.0, 0.8);
  d.keyword("CONTROL_HOURGLASS");
  d.card(6, 0.1);
  d.keyword("CONTROL_BULK_VISCOSITY");
  d.card(1.2, 0.06, 1);
  d.keyword("CONTROL_ENERGY");
  d.card(2, 2, 2, 2);
  d.keyword("CONTROL_DYNAMIC_RELAXATION");
  d.card(250, 1e-3, 0.995, "", "", 0, 0.04, 1);
  d.keyword("DATABASE_BINARY_D3PLOT");
  d.card(1.0 / 60);
  d.keyword("DATABASE_GLSTAT");
  d.card(1e-3);
  d.keyword("DATABASE_SPCFORC");
  d.card(1e-3);
  d.comment("gravity, in the relaxation and after it");
  d.keyword("LOAD_BODY_Z");
  d.card(1, -fe.gravity.z, 2);
  for (const int curve : {1, 2}) {
    d.keyword("DEFINE_CURVE");
    d.card(curve, curve - 1);
    const double rise = curve == 2 ? 0.05 : 0.0;
    if (rise > 0) d.line(field(0, 20) + field(0, 20));
    d.line(field(rise, 20) + field(1, 20));
    d.line(field(duration + 1000, 20) + field(1, 20));
  }
  d.keyword("CONTACT_ERODING_SINGLE_SURFACE");
  d.card(0, 0, 5, 0);
  d.card(body_friction, body_friction, 0.0, 0.0, 20.0);
  d.card(1.0, 1.0);
  d.card(1, 1, 1);
  for (const fem::ExplicitGround& g : fe.grounds) {
    d.keyword("RIGIDWALL_PLANAR");
    d.card(0);
    const Vec3 head = g.point + g.normal;
    d.card(g.point.x, g.point.y, g.point.z, head.x, head.y, head.z, g.friction);
  }

  // curves of yield stresses, compression and tension of each material
  d.keyword("SECTION_SOLID");
  d.card(1, 1);
  for (size_t m = 0; m < fe.materials.size(); ++m)
    for (const int side : {0, 1}) {
      if (fe.materials[m].yield.empty()) continue;
      d.keyword("DEFINE_CURVE");
      d.comment(fe.materials[m].name + (side == 0 ? ", compression" : ", tension"));
      d.card(static_cast<int>(10 + 2 * m) + side, 0);
      for (const fem::YieldPoint& y : fe.materials[m].yield)
        d.line(field(y.strain, 20) + field(side == 0 ? y.compression : y.tension, 20));
    }
  std::vector<int> law_of(fe.materials.size());
  std::iota(law_of.begin(), law_of.end(), 0);
  for (const fem::ExplicitRelease& release : fe.releases)
    for (const auto& [from, to] : release.weakened) law_of[static_cast<size_t>(from)] = to;
  int number = 0;
  std::vector<int> part_of(fe.elements.size());
  for (const auto& [key, elements] : parts) {
    ++number;
    for (const int e : elements) part_of[static_cast<size_t>(e)] = number;
    const int law = law_of[static_cast<size_t>(key.material)];
    const fem::ExplicitMaterial& m = fe.materials[static_cast<size_t>(law)];
    const double factor = fe.elements[static_cast<size_t>(elements.front())].mass_factor;
    std::string name = plan.members[static_cast<size_t>(key.member)].name;
    if (key.charge >= 0) name += "/charge";
    d.keyword("PART");
    d.line(name.substr(0, 70));
    d.card(number, 1, number);
    if (m.yield.empty()) {
      d.keyword("MAT_ELASTIC");
      d.card(number, m.density * factor, m.E, m.nu);
    } else {
      const fem::YieldPoint& y = m.yield.front();
      d.keyword("MAT_PLASTICITY_COMPRESSION_TENSION");
      d.card(number, m.density * factor, m.E, m.nu, 0.0, 0.0, std::isfinite(m.tension_limit) ? m.tension_limit : 1e20);
      const int curve = 10 + 2 * law;
      d.card(curve, curve + 1, 0, 0);
      d.card(y.compression / 3, y.tension / 3);
      d.card(0.0);
    }
    if (key.charge < 0) continue;
    d.keyword("MAT_ADD_EROSION");
    d.card(number);
    d.card("", "", "", "", "", "", "", std::max(1e-6, fires[static_cast<size_t>(key.charge)]));
  }

  d.keyword("NODE");
  for (size_t n = 0; n < fe.nodes.size(); ++n) {
    const Vec3& p = fe.nodes[n];
    d.line(whole_number(static_cast<long>(n) + 1, 8) + field(p.x, 16) + field(p.y, 16) + field(p.z, 16));
  }
  d.keyword("ELEMENT_SOLID");
  for (size_t e = 0; e < fe.elements.size(); ++e) {
    std::string line = whole_number(static_cast<long>(e) + 1, 8) + whole_number(part_of[e], 8);
    for (const int n : fe.elements[e].node) line += whole_number(n + 1, 8);
    d.line(line);
  }
  d.keyword("BOUNDARY_SPC_NODE");
  for (const fem::ExplicitSupport& s : fe.supports)
    d.card(s.node + 1, 0, static_cast<int>(s.x), static_cast<int>(s.y), static_cast<int>(s.z), 0, 0, 0);
  d.keyword("END");
  return d.text;
}

}  // namespace topple::farfield
