#include <nlohmann/json.hpp>

#include "record/page.h"
#include "record/record.h"
#include "record/record_json.h"

namespace topple::record {

using json = nlohmann::ordered_json;

std::string to_report_json(const Record& record) {
  // Bytes that are not UTF-8 become U+FFFD rather than an exception: names and plan texts come from outside.
  return make_json(record, Packing::Base64).dump(-1, ' ', false, json::error_handler_t::replace);
}

void write_report(const Record& record, const std::string& bundle, const std::string& path) {
  write_page(to_report_json(record), bundle, path);
}

}  // namespace topple::record
