#pragma once
/// What a record says about where and when it was made.

#include <string>

namespace topple::record {

/// The time by the system's clock: ISO 8601, UTC, whole seconds.
std::string now_utc();

/// System and processor: "Linux x86_64".
std::string machine_words();

}  // namespace topple::record
