#include "record/record_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/bytes.h"
#include "record/building_plan.h"

namespace topple::record {
namespace {

using json = nlohmann::ordered_json;

/// JSON has no NaN and no infinity.
json number(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }

json numbers(const std::vector<double>& values) {
  json list = json::array();
  for (const double value : values) list.push_back(number(value));
  return list;
}

json to_json(const Vec3& v) { return json::array({number(v.x), number(v.y), number(v.z)}); }

json to_json(const std::vector<std::array<double, 2>>& polygon) {
  json list = json::array();
  for (const auto& p : polygon) list.push_back(json::array({number(p[0]), number(p[1])}));
  return list;
}

json to_json(const BodyInfo& body) {
  json shapes = json::array();
  for (const BoxShape& shape : body.shapes) {
    const Quat& q = shape.X_BS.q;
    shapes.push_back({{"centre", to_json(shape.X_BS.p)},
                      {"orientation", {number(q.w), number(q.x), number(q.y), number(q.z)}},
                      {"half", to_json(shape.half)},
                      {"material", shape.material},
                      {"part", shape.part}});
  }
  return {{"name", body.name},         {"kind", body.kind},   {"storey", body.storey},
          {"mass", number(body.mass)}, {"fixed", body.fixed}, {"shapes", std::move(shapes)}};
}

json to_json(const Provenance& p) {
  return {{"title", p.title},
          {"plan_path", p.plan_path},
          {"plan_text", p.plan_text},
          {"plan_sha256", p.plan_sha256},
          {"program_version", p.program_version},
          {"engine", p.engine},
          {"machine", p.machine},
          {"created", p.created},
          {"seed", std::to_string(p.seed)},
          {"step", number(p.step)},
          {"wall_time", number(p.wall_time)},
          {"threads", p.threads}};
}

void check_size(const char* what, std::size_t size, std::size_t expected) {
  if (size != expected)
    throw std::logic_error("record: " + std::string(what) + " holds " + std::to_string(size) + " values instead of " +
                           std::to_string(expected));
}

/// The number with the shortest digits that give the float back.
json number(float value) {
  return std::isfinite(value) ? json(std::strtod(fmt::format("{}", value).c_str(), nullptr)) : json(nullptr);
}
json number(std::uint8_t value) { return value; }

/// Rows of rows ... of numbers; the last entry of `shape` runs fastest.
template <class Number>
json lists(std::span<const Number> values, std::span<const std::size_t> shape) {
  json list = json::array();
  const std::size_t step = shape.front() == 0 ? 0 : values.size() / shape.front();
  for (std::size_t i = 0; i < shape.front(); ++i)
    list.push_back(shape.size() == 1 ? number(values[i]) : lists(values.subspan(i * step, step), shape.subspan(1)));
  return list;
}

template <class Number>
json pack(const std::vector<Number>& values, const std::vector<std::size_t>& shape, Packing packing) {
  const std::span<const Number> all(values);
  if (packing == Packing::Lists) return lists(all, std::span<const std::size_t>(shape));
  return encode_base64(to_little_endian(all));
}

}  // namespace

json make_json(const Record& record, Packing packing) {
  const std::size_t S = record.time.size(), B = record.bodies.size(), Z = record.zones.size();
  check_size("position", record.position.size(), S * B * 3);
  check_size("orientation", record.orientation.size(), S * B * 4);
  check_size("zone_state", record.zone_state.size(), S * Z);
  check_size("zone_utilisation", record.zone_utilisation.size(), S * Z);
  check_size("crushed_length", record.crushed_length.size(), S * record.crushed_ends.size());
  for (const Series& series : record.series) check_size(series.id.c_str(), series.value.size(), S);

  json j;
  j["format"] = packing == Packing::Lists ? "topple-record-json" : "topple-report";
  j["version"] = 1;
  j["provenance"] = to_json(record.provenance);
  j["ending"] = {{"kind", record.ending}, {"text", record.ending_text}};
  j["counts"] = {{"bodies", record.counts.bodies},
                 {"revolute_joints", record.counts.revolute_joints},
                 {"rigid_joints", record.counts.rigid_joints},
                 {"force_elements", record.counts.force_elements},
                 {"cables", record.counts.cables},
                 {"mass", number(record.counts.mass)}};
  json& findings = j["findings"] = json::array();
  for (const Finding& f : record.findings)
    findings.push_back({{"id", f.id},
                        {"heading", f.heading},
                        {"title", f.title},
                        {"text", f.text},
                        {"value", number(f.value)},
                        {"unit", f.unit},
                        {"status", name_of(f.status)}});
  j["not_modelled"] = record.not_modelled;
  json& plan_values = j["plan_values"] = json::array();
  for (const KeyValue& v : record.plan_values)
    plan_values.push_back({{"group", v.group}, {"key", v.key}, {"value", v.value}});
  json& events = j["events"] = json::array();
  for (const Event& e : record.events)
    events.push_back({{"time", number(e.time)}, {"kind", e.kind}, {"subject", e.subject}, {"text", e.text}});
  json& neighbours = j["neighbours"] = json::array();
  for (const Neighbour& n : record.neighbours)
    neighbours.push_back({{"name", n.name}, {"footprint", to_json(n.footprint)}, {"is_utility", n.is_utility}});
  j["building_outline"] = to_json(record.building_outline);
  json& plan = j["building_plan"] = json::array();
  for (const auto& outline : calc_building_plan(record)) plan.push_back(to_json(outline));
  json& bodies = j["bodies"] = json::array();
  for (const BodyInfo& body : record.bodies) bodies.push_back(to_json(body));
  json& zones = j["zones"] = json::array();
  for (const ZoneInfo& z : record.zones)
    zones.push_back({{"name", z.name},
                     {"member", z.member},
                     {"subsystem", z.subsystem},
                     {"body_a", z.body_a},
                     {"body_b", z.body_b},
                     {"place", to_json(z.p_W)}});
  json& ends = j["crushed_ends"] = json::array();
  const std::size_t C = record.crushed_ends.size();
  for (std::size_t c = 0; c < C; ++c) {
    const CrushedEnd& e = record.crushed_ends[c];
    std::vector<float> length(S);
    for (std::size_t s = 0; s < S; ++s) length[s] = record.crushed_length[s * C + c];
    // most ends never recede
    if (std::ranges::none_of(length, [](float x) { return x != 0; })) continue;
    ends.push_back({{"body", e.body},
                    {"shape", e.shape},
                    {"axis", e.axis},
                    {"side", e.side},
                    {"length", pack(length, {S}, packing)}});
  }
  j["time"] = numbers(record.time);
  json& series = j["series"] = json::array();
  for (const Series& s : record.series)
    series.push_back(
        {{"id", s.id}, {"title", s.title}, {"unit", s.unit}, {"group", s.group}, {"value", numbers(s.value)}});
  j["position"] = pack(record.position, {S, B, 3}, packing);
  j["orientation"] = pack(record.orientation, {S, B, 4}, packing);
  j["zone_state"] = pack(record.zone_state, {S, Z}, packing);
  j["zone_utilisation"] = pack(record.zone_utilisation, {S, Z}, packing);
  return j;
}

}  // namespace topple::record
