#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <string_view>

#include "base/file.h"
#include "record/record.h"

namespace topple::record {
namespace {

using json = nlohmann::ordered_json;

constexpr std::string_view marker = "<!--TOPPLE-DATA-->";

std::string encode_base64(std::span<const std::uint8_t> bytes) {
  static constexpr char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < n ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= n ? digit[word >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

std::string encode_base64(std::span<const float> values) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(values.size() * 4);
  for (const float value : values) {
    const auto bits = std::bit_cast<std::uint32_t>(value);
    for (int shift = 0; shift < 32; shift += 8) bytes.push_back(static_cast<std::uint8_t>(bits >> shift & 255U));
  }
  return encode_base64(bytes);
}

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
                      {"material", shape.material}});
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

json to_json(const Record& record) {
  const std::size_t S = record.time.size(), B = record.bodies.size(), Z = record.zones.size();
  check_size("position", record.position.size(), S * B * 3);
  check_size("orientation", record.orientation.size(), S * B * 4);
  check_size("zone_state", record.zone_state.size(), S * Z);
  check_size("zone_utilisation", record.zone_utilisation.size(), S * Z);
  for (const Series& series : record.series) check_size(series.id.c_str(), series.value.size(), S);

  json j;
  j["format"] = "topple-report";
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
  j["time"] = numbers(record.time);
  json& series = j["series"] = json::array();
  for (const Series& s : record.series)
    series.push_back(
        {{"id", s.id}, {"title", s.title}, {"unit", s.unit}, {"group", s.group}, {"value", numbers(s.value)}});
  j["position"] = encode_base64(std::span<const float>(record.position));
  j["orientation"] = encode_base64(std::span<const float>(record.orientation));
  j["zone_state"] = encode_base64(std::span<const std::uint8_t>(record.zone_state));
  j["zone_utilisation"] = encode_base64(std::span<const float>(record.zone_utilisation));
  return j;
}

/// A "<" can only stand inside a JSON string; written as an escape, no text of a plan can close or open a tag.
std::string escape_for_html(const std::string& text) {
  std::string safe;
  safe.reserve(text.size() + 64);
  for (const char c : text)
    if (c == '<')
      safe += "\\u003c";
    else
      safe += c;
  return safe;
}

}  // namespace

std::string to_report_json(const Record& record) {
  // Bytes that are not UTF-8 become U+FFFD rather than an exception: names and plan texts come from outside.
  return to_json(record).dump(-1, ' ', false, json::error_handler_t::replace);
}

void write_report(const Record& record, const std::string& bundle, const std::string& path) {
  const std::size_t at = bundle.find(marker);
  if (at == std::string::npos || bundle.find(marker, at + 1) != std::string::npos)
    throw std::runtime_error(path + ": the report page to fill must hold the marker " + std::string(marker) + " once");
  const std::string_view page = bundle;
  std::string filled(page.substr(0, at));
  filled += R"(<script type="application/json" id="topple-data">)";
  filled += escape_for_html(to_report_json(record));
  filled += "</script>";
  filled += page.substr(at + marker.size());
  replace_file(path, filled);
}

}  // namespace topple::record
