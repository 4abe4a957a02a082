#pragma once
/// Complaints as JSON (docs/run.md).

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/error.h"

namespace topple::apps {

/// For people to read, too; what is no UTF-8 becomes U+FFFD.
std::string dump(const nlohmann::ordered_json&);

nlohmann::ordered_json to_json(const Diagnostic&);

/// The JSON object of bad input, on standard output.
void print_refusal(const std::vector<Diagnostic>&);
/// That of what ended without a result (exit code 1), E830: a file that could not be written, say.
void print_failure(const std::string& why);

}  // namespace topple::apps
