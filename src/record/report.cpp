#include "record/report.h"

#include <nlohmann/json.hpp>

#include "record/page.h"
#include "record/record.h"
#include "record/record_json.h"

namespace topple::record {

using json = nlohmann::ordered_json;

std::string to_report_json(const Record& record, const ReportExtras& extras) {
  json out = make_json(record, Packing::Base64);
  if (!extras.study.empty()) out["study"] = json::parse(extras.study);
  for (const SecondOpinion& o : extras.others)
    out["others"].push_back({{"engine", o.engine}, {"title", o.title}, {"sentences", o.sentences}});
  // Bytes that are not UTF-8 become U+FFFD rather than an exception: names and plan texts come from outside.
  return out.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string to_report_json(const Record& record) { return to_report_json(record, ReportExtras()); }

void write_report(const Record& record, const std::string& bundle, const std::string& path) {
  write_page(to_report_json(record), bundle, path);
}

}  // namespace topple::record
