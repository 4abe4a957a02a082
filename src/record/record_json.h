#pragma once
/// A record as JSON (docs/report-data.md).

#include <nlohmann/json.hpp>

#include "record/record.h"

namespace topple::record {

/// How the numbers of every frame are written.
enum class Packing {
  Base64,  // of little-endian float32 and uint8
  Lists    // nested lists: frame, body or zone, component
};

/// Throws std::logic_error for a record whose parts do not fit each other.
nlohmann::ordered_json make_json(const Record&, Packing);

}  // namespace topple::record
