#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

#include "base/file.h"
#include "record/csv_text.h"
#include "record/export.h"
#include "record/record.h"

namespace topple::record {

std::string quote_csv(std::string_view text) {
  if (text.find_first_of("\",\r\n") == std::string_view::npos) return std::string(text);
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + '"';
}

namespace {

/// The shortest digits that give the same number back, without -0; not a number is an empty field.
template <class Number>
std::string digits(Number value) {
  return std::isnan(value) ? std::string() : fmt::format("{}", value + Number{0});
}

std::string with_unit(const std::string& name, const std::string& unit) {
  return unit.empty() ? name : name + " [" + unit + "]";
}

/// Lines of fields, ended as RFC 4180 asks.
class Table {
 public:
  Table& text(std::string_view value) { return field(quote_csv(value)); }
  template <class Number>
  Table& number(Number value) {
    return field(digits(value));
  }
  Table& whole(int value) { return field(std::to_string(value)); }
  void end_line() {
    text_ += "\r\n";
    starts_line_ = true;
  }
  const std::string& str() const { return text_; }

 private:
  Table& field(const std::string& value) {
    if (!starts_line_) text_ += ',';
    starts_line_ = false;
    text_ += value;
    return *this;
  }

  std::string text_;
  bool starts_line_ = true;
};

std::string make_series(const Record& r) {
  Table table;
  table.text("time [s]");
  for (const Series& series : r.series) {
    if (series.value.size() != r.time.size()) throw std::logic_error("record: series " + series.id + " does not fit");
    table.text(with_unit(series.id, series.unit));
  }
  table.end_line();
  for (std::size_t s = 0; s < r.time.size(); ++s) {
    table.number(r.time[s]);
    for (const Series& series : r.series) table.number(series.value[s]);
    table.end_line();
  }
  return table.str();
}

std::string make_events(const Record& r) {
  Table table;
  for (const auto* name : {"time [s]", "kind", "subject", "text"}) table.text(name);
  table.end_line();
  for (const Event& event : r.events)
    table.number(event.time).text(event.kind).text(event.subject).text(event.text).end_line();
  return table.str();
}

/// Each body with its place in the first and in the last frame.
std::string make_bodies(const Record& r) {
  const std::size_t frames = r.time.size(), bodies = r.bodies.size();
  if (r.position.size() != frames * bodies * 3) throw std::logic_error("record: positions do not fit the bodies");
  Table table;
  for (const auto* name : {"name", "kind", "storey", "mass [kg]", "fixed", "start x [m]", "start y [m]", "start z [m]",
                           "end x [m]", "end y [m]", "end z [m]"})
    table.text(name);
  table.end_line();
  for (std::size_t b = 0; b < bodies; ++b) {
    const BodyInfo& body = r.bodies[b];
    table.text(body.name).text(body.kind).whole(body.storey).number(body.mass).whole(body.fixed ? 1 : 0);
    for (const std::size_t frame : {std::size_t{0}, frames - 1})
      for (std::size_t k = 0; k < 3; ++k)
        table.number(frames == 0 ? std::nanf("") : r.position[(frame * bodies + b) * 3 + k]);
    table.end_line();
  }
  return table.str();
}

std::string make_findings(const Record& r) {
  Table table;
  for (const auto* name : {"id", "heading", "title", "text", "value", "unit", "status"}) table.text(name);
  table.end_line();
  for (const Finding& finding : r.findings) {
    table.text(finding.id).text(finding.heading).text(finding.title).text(finding.text);
    table.number(finding.value).text(finding.unit).text(name_of(finding.status)).end_line();
  }
  return table.str();
}

std::string make_poses(const Record& r) {
  const std::size_t bodies = r.bodies.size();
  Table table;
  for (const auto* name : {"time [s]", "body", "x [m]", "y [m]", "z [m]", "qw", "qx", "qy", "qz"}) table.text(name);
  table.end_line();
  for (std::size_t s = 0; s < r.time.size(); ++s)
    for (std::size_t b = 0; b < bodies; ++b) {
      table.number(r.time[s]).text(r.bodies[b].name);
      for (std::size_t k = 0; k < 3; ++k) table.number(r.position[(s * bodies + b) * 3 + k]);
      for (std::size_t k = 0; k < 4; ++k) table.number(r.orientation[(s * bodies + b) * 4 + k]);
      table.end_line();
    }
  return table.str();
}

/// The zones at the first frame, then each whenever its state changes.
std::string make_zones(const Record& r) {
  static constexpr std::array<const char*, 6> words{"elastic", "yielded", "softening", "broken", "fired", "crushed"};
  const std::size_t zones = r.zones.size();
  Table table;
  for (const auto* name : {"time [s]", "zone", "member", "subsystem", "state", "utilisation"}) table.text(name);
  table.end_line();
  for (std::size_t s = 0; s < r.time.size(); ++s)
    for (std::size_t z = 0; z < zones; ++z) {
      const std::uint8_t state = r.zone_state[s * zones + z];
      if (s > 0 && state == r.zone_state[(s - 1) * zones + z]) continue;
      table.number(r.time[s]).text(r.zones[z].name).text(r.zones[z].member).text(r.zones[z].subsystem);
      table.text(words.at(state)).number(r.zone_utilisation[s * zones + z]).end_line();
    }
  return table.str();
}

std::string make_output(const Output& o) {
  const std::size_t columns = o.columns.size();
  if (o.value.size() != o.time.size() * columns) throw std::logic_error("record: output " + o.name + " does not fit");
  Table table;
  table.text("time [s]");
  for (const std::string& column : o.columns) table.text(with_unit(column, o.unit));
  table.end_line();
  for (std::size_t t = 0; t < o.time.size(); ++t) {
    table.number(o.time[t]);
    for (std::size_t c = 0; c < columns; ++c) table.number(o.value[t * columns + c]);
    table.end_line();
  }
  return table.str();
}

}  // namespace

void write_output_csv(const Record& record, const std::string& folder) {
  for (const Output& o : record.outputs)
    replace_file(std::filesystem::path(folder) / "outputs" / (o.name + ".csv"), make_output(o));
}

void write_csv(const Record& record, const std::string& folder) {
  const std::filesystem::path where(folder);
  replace_file(where / "series.csv", make_series(record));
  replace_file(where / "events.csv", make_events(record));
  replace_file(where / "bodies.csv", make_bodies(record));
  replace_file(where / "findings.csv", make_findings(record));
}

std::vector<std::string> export_csv(const Record& record, const std::string& folder) {
  write_csv(record, folder);
  write_output_csv(record, folder);
  const std::filesystem::path where(folder);
  replace_file(where / "poses.csv", make_poses(record));
  replace_file(where / "zones.csv", make_zones(record));
  std::vector<std::string> paths;
  for (const auto* name : {"series.csv", "events.csv", "bodies.csv", "findings.csv", "poses.csv", "zones.csv"})
    paths.push_back((where / name).string());
  for (const Output& o : record.outputs) paths.push_back((where / "outputs" / (o.name + ".csv")).string());
  return paths;
}

}  // namespace topple::record
