#include <algorithm>
#include <bit>
#include <cmath>
#include <nlohmann/json.hpp>
#include <span>
#include <stdexcept>
#include <string_view>

#include "base/file.h"
#include "record/record.h"
#include "record/record_json.h"

namespace topple::record {
namespace {

using json = nlohmann::ordered_json;

constexpr std::string_view marker = "<!--TOPPLE-DATA-->";

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
  return make_json(record, Packing::Base64).dump(-1, ' ', false, json::error_handler_t::replace);
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
