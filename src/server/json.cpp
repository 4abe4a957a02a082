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
