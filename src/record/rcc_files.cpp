#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "record/rcc_numbers.h"
#include "record/rcc_report.h"

namespace topple::record {

namespace {

using json = nlohmann::ordered_json;

std::string quoted(const std::string& text) {
  if (text.find_first_of("\",\r\n") == std::string::npos) return text;
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + '"';
}

json to_json(const RccPoint& p) { return {{"rotation", number(p.rotation)}, {"moment", number(p.moment)}}; }

json head_of(const std::string& route, char axis, int direction) {
  return {{"route", route}, {"axis", std::string(1, axis)}, {"direction", sign_of(direction)}};
}

json to_json(const RccCurve& c) {
  json j = head_of(c.route, c.axis, c.direction);
  j["normal_force"] = number(c.normal_force);
  j["stiffness_uncracked"] = number(c.stiffness_uncracked);
  j["stiffness_effective"] = number(c.stiffness_effective);
  j["yield"] = to_json(c.yield);
  j["peak"] = to_json(c.peak);
  j["ultimate"] = to_json(c.ultimate);
  j["residual"] = to_json(c.residual);
  j["end"] = to_json(c.end);
  j["ending"] = c.ending;
  j["rotation"] = numbers(c.rotation);
  j["moment"] = numbers(c.moment);
  return j;
}

json to_json(const RccState& s) {
  json j = head_of("layered", s.axis, s.direction);
  j["point"] = s.point;
  j["normal_force"] = number(s.normal_force);
  j["rotation"] = number(s.rotation);
  j["moment"] = number(s.moment);
  j["mean_strain"] = number(s.eps_0);
  j["curvature"] = number(s.curvature);
  j["layers"] = json::array();
  for (const RccState::Layer& l : s.layers) {
    json layer{{"from", number(l.from)}, {"to", number(l.to)}, {"strain", number(l.strain)}};
    if (l.core_breadth > 0) layer["core"] = {{"stress", number(l.core_stress)}, {"condition", l.core}};
    if (l.cover_breadth > 0) layer["cover"] = {{"stress", number(l.cover_stress)}, {"condition", l.cover}};
    j["layers"].push_back(std::move(layer));
  }
  j["bars"] = json::array();
  for (const RccState::Bar& b : s.bars)
    j["bars"].push_back({{"y", number(b.y)},
                         {"z", number(b.z)},
                         {"diameter", number(b.diameter)},
                         {"strain", number(b.strain)},
                         {"stress", number(b.stress)},
                         {"condition", b.condition}});
  return j;
}

bool is_same(const RccCurve& a, const RccCurve& b) {
  if (a.route != b.route || a.normal_force != b.normal_force || a.rotation.size() != b.rotation.size()) return false;
  const double scale = a.moment.empty() ? 0 : *std::max_element(a.moment.begin(), a.moment.end());
  for (size_t j = 0; j < a.rotation.size(); ++j)
    if (std::abs(a.rotation[j] - b.rotation[j]) > 1e-6 * std::abs(a.rotation[j]) ||
        std::abs(a.moment[j] - b.moment[j]) > 1e-6 * scale)
      return false;
  return true;
}

}  // namespace

std::vector<RccGroup> group_curves(const RccReport& r) {
  std::vector<RccGroup> out;
  std::vector<bool> done(r.curves.size(), false);
  for (size_t i = 0; i < r.curves.size(); ++i) {
    if (done[i]) continue;
    const RccCurve& c = r.curves[i];
    out.push_back({&c, {}});
    for (size_t k = i; k < r.curves.size(); ++k) {
      const RccCurve& other = r.curves[k];
      const bool is_twin = k > i && other.axis == c.axis && other.direction == c.direction;
      if (is_twin || done[k] || !is_same(c, other)) continue;
      done[k] = true;
      out.back().about +=
          fmt::format("{}{}{}", out.back().about.empty() ? "" : " ", sign_of(other.direction), other.axis);
    }
  }
  return out;
}

std::string to_json(const RccReport& r) {
  json j;
  j["format"] = "topple-rcc";
  j["version"] = 1;
  j["title"] = r.title;
  j["provenance"] = {{"source", r.source}, {"sha256", r.sha256}, {"program_version", r.program_version}};
  j["zone"] = {
      {"text", r.zone}, {"width", number(r.width)}, {"height", number(r.height)}, {"length", number(r.length)}};
  j["inputs"] = json::array();
  for (const KeyValue& v : r.inputs) j["inputs"].push_back({{"group", v.group}, {"key", v.key}, {"value", v.value}});
  j["stiffness"] = {{"EA", number(r.EA)},
                    {"EI_y", number(r.EI_y)},
                    {"EI_z", number(r.EI_z)},
                    {"GA", number(r.GA)},
                    {"GJ", number(r.GJ)}};
  j["capacity"] = {{"crushing", number(r.crushing_force)},
                   {"tension", number(r.rupture_force)},
                   {"shear_y", number(r.shear_y)},
                   {"shear_z", number(r.shear_z)},
                   {"shear_friction", number(r.shear_friction)},
                   {"torsion", number(r.torsion)}};
  j["curves"] = json::array();
  for (const RccCurve& c : r.curves) j["curves"].push_back(to_json(c));
  j["interaction"] = json::array();
  for (const RccInteraction& i : r.interactions) {
    json one = head_of(i.route, i.axis, i.direction);
    one["normal_force"] = numbers(i.normal_force);
    one["yield_moment"] = numbers(i.yield_moment);
    one["peak_moment"] = numbers(i.peak_moment);
    j["interaction"].push_back(std::move(one));
  }
  j["biaxial"] = json::array();
  for (const RccBiaxial& b : r.biaxial)
    j["biaxial"].push_back({{"normal_force", number(b.normal_force)},
                            {"moment_y", numbers(b.moment_y)},
                            {"moment_z", numbers(b.moment_z)}});
  j["biaxial_exponent"] = number(r.biaxial_exponent);
  j["axial"] = json::array();
  for (const RccAxial& a : r.axial)
    j["axial"].push_back(
        {{"route", a.route}, {"shortening", numbers(a.shortening)}, {"normal_force", numbers(a.normal_force)}});
  j["states"] = json::array();
  for (const RccState& s : r.states) j["states"].push_back(to_json(s));
  j["solid_states"] = json::array();
  for (const RccSolidState& s : r.solid_states) {
    json one = head_of("solid", s.axis, s.direction);
    one["normal_force"] = number(s.normal_force);
    one["rotation"] = number(s.rotation);
    one["moment"] = number(s.moment);
    one["cut_at"] = number(s.cut_at);
    one["cut_normal_force"] = number(s.cut_normal_force);
    j["solid_states"].push_back(std::move(one));
  }
  j["solid_notes"] = r.solid_notes;
  j["families"] = json::array();
  for (const RccFamily& f : r.families)
    j["families"].push_back({{"axis", std::string(1, f.axis)},
                             {"direction", sign_of(f.direction)},
                             {"normal_force", numbers(f.normal_force)},
                             {"rotation", numbers(f.rotation)},
                             {"moment", numbers(f.moment)}});
  j["notes"] = r.notes;
  j["not_modelled"] = r.not_modelled;
  return j.dump(1, ' ', false, json::error_handler_t::replace);
}

std::string points_csv(const RccReport& r) {
  std::string out =
      "route,axis,direction,normal force [N],stiffness uncracked [N·m2],stiffness effective [N·m2],"
      "yield rotation [rad],yield moment [N·m],peak rotation [rad],peak moment [N·m],ultimate rotation [rad],"
      "ultimate moment [N·m],residual rotation [rad],residual moment [N·m],end rotation [rad],end moment [N·m],ending";
  out += line_end;
  for (const RccCurve& c : r.curves) {
    out += fmt::format("{},{},{},{},{},{}", c.route, c.axis, sign_of(c.direction), digits(c.normal_force),
                       digits(c.stiffness_uncracked), digits(c.stiffness_effective));
    for (const RccPoint& p : {c.yield, c.peak, c.ultimate, c.residual, c.end})
      out += fmt::format(",{},{}", digits(p.rotation), digits(p.moment));
    out += "," + quoted(c.ending) + line_end;
  }
  return out;
}

std::string curves_csv(const RccReport& r) {
  std::string out = "route,axis,direction,normal force [N],rotation [rad],moment [N·m]";
  out += line_end;
  for (const RccCurve& c : r.curves)
    for (size_t j = 0; j < c.rotation.size(); ++j)
      out += fmt::format("{},{},{},{},{},{}{}", c.route, c.axis, sign_of(c.direction), digits(c.normal_force),
                         digits(c.rotation[j]), digits(c.moment[j]), line_end);
  return out;
}

std::string interaction_csv(const RccReport& r) {
  std::string out = "route,axis,direction,normal force [N],yield moment [N·m],peak moment [N·m]";
  out += line_end;
  for (const RccInteraction& i : r.interactions)
    for (size_t k = 0; k < i.normal_force.size(); ++k)
      out += fmt::format("{},{},{},{},{},{}{}", i.route, i.axis, sign_of(i.direction), digits(i.normal_force[k]),
                         digits(i.yield_moment[k]), digits(i.peak_moment[k]), line_end);
  return out;
}

std::string biaxial_csv(const RccReport& r) {
  std::string out = "normal force [N],largest moment about y [N·m],largest moment about z [N·m]";
  out += line_end;
  for (const RccBiaxial& b : r.biaxial)
    for (size_t k = 0; k < b.moment_y.size(); ++k)
      out += fmt::format("{},{},{}{}", digits(b.normal_force), digits(b.moment_y[k]), digits(b.moment_z[k]), line_end);
  return out;
}

std::string axial_csv(const RccReport& r) {
  std::string out = "route,shortening [m],normal force [N]";
  out += line_end;
  for (const RccAxial& a : r.axial)
    for (size_t k = 0; k < a.shortening.size(); ++k)
      out += fmt::format("{},{},{}{}", a.route, digits(a.shortening[k]), digits(a.normal_force[k]), line_end);
  return out;
}

std::string states_csv(const RccReport& r) {
  std::string out =
      "axis,direction,normal force [N],point,part,from [m],to [m],y [m],z [m],strain [-],stress [N/m2],condition";
  out += line_end;
  for (const RccState& s : r.states) {
    const std::string head = fmt::format("{},{},{},{}", s.axis, sign_of(s.direction), digits(s.normal_force), s.point);
    for (const RccState::Layer& l : s.layers) {
      const auto add = [&](const char* part, double stress, const std::string& condition) {
        out += fmt::format("{},{},{},{},,,{},{},{}{}", head, part, digits(l.from), digits(l.to), digits(l.strain),
                           digits(stress), condition, line_end);
      };
      if (l.core_breadth > 0) add("core", l.core_stress, l.core);
      if (l.cover_breadth > 0) add("cover", l.cover_stress, l.cover);
    }
    for (const RccState::Bar& b : s.bars)
      out += fmt::format("{},bar,,,{},{},{},{},{}{}", head, digits(b.y), digits(b.z), digits(b.strain),
                         digits(b.stress), b.condition, line_end);
  }
  return out;
}

std::string solid_states_csv(const RccReport& r) {
  std::string out =
      "axis,direction,normal force [N],rotation [rad],part,x from [m],x to [m],y from [m],y to [m],z from [m],z to "
      "[m],stress [N/m2],strain [-],crack width [m],strength lost [-]";
  out += line_end;
  for (const RccSolidState& s : r.solid_states) {
    const std::string head =
        fmt::format("{},{},{},{}", s.axis, sign_of(s.direction), digits(s.normal_force), digits(s.rotation));
    for (const RccSolidState::CutCell& c : s.cut)
      out += fmt::format("{},cut,{},{},{},{},{},{},{},,,{}", head, digits(s.cut_at), digits(s.cut_at), digits(c.y_from),
                         digits(c.y_to), digits(c.z_from), digits(c.z_to), digits(c.stress), line_end);
    for (const RccSolidState::Bar& b : s.bars)
      out += fmt::format("{},bar,{},{},{},{},{},{},{},{},,{}", head, digits(s.cut_at), digits(s.cut_at), digits(b.y),
                         digits(b.y), digits(b.z), digits(b.z), digits(b.stress), digits(b.strain), line_end);
    for (const RccSolidState::SideCell& c : s.side) {
      const std::string place = s.axis == 'y' ? fmt::format(",,{},{}", digits(c.a_from), digits(c.a_to))
                                              : fmt::format("{},{},,", digits(c.a_from), digits(c.a_to));
      out += fmt::format("{},side,{},{},{},,,{},{}{}", head, digits(c.x_from), digits(c.x_to), place,
                         digits(c.crack_width), digits(c.crushing), line_end);
    }
  }
  return out;
}

}  // namespace topple::record
