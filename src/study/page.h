#pragma once
/// The page of a study: study.html, self-contained (docs/study.md).

#include <string>

#include "study/manager.h"

namespace topple::study {

struct PageOrigin {
  std::string program_version, created;  // created: ISO 8601, UTC
  std::string source, source_name;       // text of the file that was studied
};

/// Runs that a page holds; of more an even choice, with all that notable runs, and the page says so.
inline constexpr std::size_t most_page_runs = 20000;

/// Data of the page as JSON, in the units in which results are shown.
std::string to_page_json(const Problem&, const StudyResult&, const PageOrigin&, std::size_t most = most_page_runs);

}  // namespace topple::study
