#include "server/json.h"

#include <algorithm>
#include <cmath>

#include "collapse/plan_record.h"

namespace topple::server {

using collapse::Branch;

std::string dump(const Json& j) { return j.dump(-1, ' ', false, Json::error_handler_t::replace); }

Json number(double x) { return std::isfinite(x) ? Json(x) : Json(nullptr); }

Json numbers(const std::vector<double>& values) {
  Json list = Json::array();
  for (const double x : values) list.push_back(number(x));
  return list;
}

Json describe_diagnostics(const std::vector<Diagnostic>& diagnostics) {
  Json list = Json::array();
  for (const Diagnostic& d : diagnostics)
    list.push_back({{"severity", d.severity == Severity::Error ? "error" : "warning"},
                    {"code", d.code},
                    {"line", d.where.line},
                    {"column", d.where.column},
                    {"width", d.width},
                    {"message", d.message},
                    {"help", d.help}});
  return list;
}

Json make_ack(std::int64_t id, Json result) { return {{"type", "ack"}, {"id", id}, {"result", std::move(result)}}; }

Json make_error(Json id, Json error) { return {{"type", "error"}, {"id", std::move(id)}, {"error", std::move(error)}}; }

Json describe_error(const InputError& e) {
  const Diagnostic& d = e.first_error();
  return {{"code", d.code},
          {"message", d.message},
          {"help", d.help},
          {"diagnostics", describe_diagnostics(e.diagnostics())}};
}

Json describe_event(const record::Event& e) {
  return {{"time", number(e.time)}, {"kind", e.kind}, {"subject", e.subject}, {"text", e.text}};
}

Json describe_finding(const record::Finding& f) {
  return {{"id", f.id},
          {"heading", f.heading},
          {"title", f.title},
          {"text", f.text},
          {"value", number(f.value)},
          {"unit", f.unit},
          {"status", record::name_of(f.status)}};
}

Json describe_member(const product::Plan& plan, const product::Member& m) {
  Json j{{"name", m.name}, {"kind", product::name_of(m.kind)}, {"storey", m.storey}};
  j["length"] = number(norm(m.end - m.start));
  j["removed"] = m.removed;
  int concrete = -1, steel = -1;
  const product::Panel* masonry = nullptr;
  if (m.section >= 0) {
    const product::Section& s = plan.sections[static_cast<std::size_t>(m.section)];
    concrete = s.concrete, steel = s.steel;
    Json bars = Json::array();
    for (const product::Bar& b : s.bars) bars.push_back({{"y", b.y}, {"z", b.z}, {"diameter", b.diameter}});
    j["section"] = {{"name", s.name},          {"width", s.width}, {"height", s.height},
                    {"bars", std::move(bars)}, {"cover", s.cover}, {"steel_area", s.steel_area()},
                    {"ties", Json(nullptr)}};
    if (s.tie_diameter > 0)
      j["section"]["ties"] = {
          {"diameter", s.tie_diameter}, {"spacing", s.tie_spacing}, {"legs_y", s.tie_legs_y}, {"legs_z", s.tie_legs_z}};
  }
  if (m.panel >= 0) {
    const product::Panel& p = plan.panels[static_cast<std::size_t>(m.panel)];
    concrete = p.concrete, steel = p.steel;
    if (p.concrete < 0) masonry = &p;
    j["panel"] = {{"name", p.name},           {"thickness", p.thickness}, {"as_top", p.as_top},
                  {"as_bottom", p.as_bottom}, {"cover", p.cover},         {"openings", m.openings.size()}};
  }
  if (m.shaft >= 0) {
    const product::Shaft& s = plan.shafts[static_cast<std::size_t>(m.shaft)];
    concrete = s.concrete, steel = s.steel;
    j["shaft"] = {{"diameter_foot", s.diameter_foot},
                  {"diameter_top", s.diameter_top},
                  {"thickness_foot", s.thickness_foot},
                  {"thickness_top", s.thickness_top},
                  {"as_outer", s.as_outer},
                  {"as_inner", s.as_inner},
                  {"bar_diameter", s.bar_diameter},
                  {"hoop_diameter", s.hoop_diameter},
                  {"hoop_spacing", s.hoop_spacing},
                  {"cover", s.cover}};
  }
  j["concrete"] = j["steel"] = j["masonry"] = nullptr;
  if (concrete >= 0) {
    const product::Concrete& c = plan.concretes[static_cast<std::size_t>(concrete)];
    j["concrete"] = {{"name", c.name}, {"fc", c.fc}, {"fct", c.fct}, {"Ec", c.Ec}};
  }
  if (steel >= 0) {
    const product::Steel& s = plan.steels[static_cast<std::size_t>(steel)];
    j["steel"] = {{"name", s.name}, {"fy", s.fy}, {"fu", s.fu}};
  }
  if (masonry) j["masonry"] = {{"strength", masonry->strength}, {"density", masonry->density}};
  j["cuts"] = Json::array();
  for (const product::Weakening& w : m.weakenings)
    j["cuts"].push_back({{"at", w.at}, {"cut_bars", w.cut_bars}, {"cut_concrete", w.cut_concrete}});
  return j;
}

Json describe_branch(const collapse::Steering& s, const Branch& b, const std::string& plan_sha256) {
  const collapse::LiveRun& run = b.run();
  const collapse::LiveModel& live = run.model();
  const product::Plan& plan = live.plan();
  const double now = run.has_begun() ? run.time() : -1;
  Json j{{"id", b.id}, {"name", b.name}};
  j["parent"] = b.parent > 0 ? Json(b.parent) : Json(nullptr);
  j["time"] = b.time;
  j["frontier"] = run.time();
  j["frames"] = b.frames();
  j["first_frame"] = b.first_frame;
  j["starts"] = b.starts;
  j["duration"] = plan.analysis.duration;
  j["ending"] = nullptr;
  if (run.has_ended()) {
    record::Record words;
    collapse::fill_ending(run.summary(), "", words);
    j["ending"] = {{"kind", words.ending}, {"text", words.ending_text}};
  }
  Json& charges = j["charges"] = Json::array();
  for (std::size_t i = 0; i < live.charges().size(); ++i) {
    const collapse::LiveCharge& c = live.charges()[i];
    const product::Charge& p = live.charge(c);
    charges.push_back({{"index", i},
                       {"stage", c.stage},
                       {"member", live.member_of(c)},
                       {"position", p.position},
                       {"destroyed_length", p.destroyed_length},
                       {"residual_bars", p.residual_bars},
                       {"residual_concrete", p.residual_concrete},
                       {"time", c.time},
                       {"fired", collapse::LiveModel::has_fired(c, now)},
                       {"fails", c.fails},
                       {"removed", c.is_removed}});
  }
  Json& stages = j["stages"] = Json::array();
  for (std::size_t i = 0; i < plan.stages.size(); ++i)
    stages.push_back({{"index", i}, {"name", plan.stages[i].name}, {"time", plan.stages[i].time}});
  Json& cables = j["cables"] = Json::array();
  const std::vector<double>& force = run.cable_force();
  for (std::size_t i = 0; i < live.model().cables.size(); ++i) {
    const mbs::Cable& c = live.model().cables[i];
    cables.push_back({{"name", c.name},
                      {"body", c.a.index},
                      {"point", {c.p_A.x, c.p_A.y, c.p_A.z}},
                      {"anchor", {c.p_B.x, c.p_B.y, c.p_B.z}},
                      {"force", i < force.size() ? number(force[i]) : Json(nullptr)},
                      {"pretension", c.pretension},
                      {"let_go", live.lets_go(c.name)}});
  }
  j["friction"] = {{"ground", live.model().contact.friction}, {"bodies", live.model().contact.body_friction}};
  Json& edits = j["edits"] = Json::array();
  for (const collapse::EditEntry& e : b.edits)
    edits.push_back({{"kind", collapse::word_of(e.edit.kind)}, {"time", e.time}, {"text", e.text}});
  j["notes"] = live.map().note_texts();
  j["snapshots"] = numbers(s.moments(b));
  j["bodies"] = run.record().bodies.size();
  j["zones"] = run.record().zones.size();
  j["plan_sha256"] = plan_sha256;
  j["sample"] = b.sample.empty() ? Json(nullptr) : Json(b.sample);
  return j;
}

Json describe_scene(const record::Record& own, const record::Record& before, std::size_t bodies,
                    const std::vector<Pose>& others) {
  // everything but the other frames
  record::Record one;
  one.provenance = own.provenance;
  one.counts = own.counts;
  one.plan_values = own.plan_values;
  one.bodies = own.bodies;
  one.zones = own.zones;
  one.crushed_ends = own.crushed_ends;
  one.neighbours = own.neighbours;
  one.building_outline = own.building_outline;
  for (const record::Series& s : own.series) one.series.push_back({s.id, s.title, s.unit, s.group, {}});
  if (!before.time.empty()) {
    const auto keep = [](const auto& from, auto& to, std::size_t width) {
      to.assign(from.begin(), from.begin() + static_cast<std::ptrdiff_t>(width));
    };
    keep(before.time, one.time, 1);
    keep(before.position, one.position, 3 * bodies);
    keep(before.orientation, one.orientation, 4 * bodies);
    for (const Pose& X : others) {
      for (const double c : {X.p.x, X.p.y, X.p.z}) one.position.push_back(static_cast<float>(c));
      for (const double c : {X.q.w, X.q.x, X.q.y, X.q.z}) one.orientation.push_back(static_cast<float>(c));
    }
    keep(before.zone_state, one.zone_state, own.zones.size());
    keep(before.zone_utilisation, one.zone_utilisation, own.zones.size());
    one.crushed_length.resize(own.crushed_ends.size());  // none has receded at the start
    for (std::size_t i = 0; i < own.series.size(); ++i) one.series[i].value = {before.series[i].value[0]};
  }
  return Json::parse(record::to_report_json(one));
}

namespace {

Json describe_family(const mbs::MomentFamily& f) {
  const std::size_t J = f.plastic_rotation.size();
  const auto rows = [J](const std::vector<double>& values) {
    Json list = Json::array();
    for (std::size_t k = 0; J > 0 && k < values.size() / J; ++k)
      list.push_back(numbers({values.begin() + static_cast<std::ptrdiff_t>(k * J),
                              values.begin() + static_cast<std::ptrdiff_t>((k + 1) * J)}));
    return list;
  };
  return {{"normal_force", numbers(f.normal_force)},
          {"plastic_rotation", numbers(f.plastic_rotation)},
          {"positive", rows(f.positive)},
          {"negative", rows(f.negative)}};
}

}  // namespace

Json describe_law(const mbs::ZoneLaw& law) {
  return {{"name", law.name}, {"moment_y", describe_family(law.moment_y)}, {"moment_z", describe_family(law.moment_z)}};
}

}  // namespace topple::server
