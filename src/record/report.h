#pragma once
/// What a report says beyond its record.

#include <string>
#include <vector>

#include "record/record.h"

namespace topple::record {

/// Another computation of the same building.
struct SecondOpinion {
  std::string engine, title;           // what moved the building there
  std::vector<std::string> sentences;  // how it differs; A is the record of the report, B the other one
};

struct ReportExtras {
  std::string study;  // results of a fuzzy study, JSON (docs/study.md); empty: none
  std::vector<SecondOpinion> others;
};

/// to_report_json of record/record.h with the keys `study` and `others` (docs/report-data.md).
std::string to_report_json(const Record&, const ReportExtras&);

}  // namespace topple::record
