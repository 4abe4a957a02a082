#pragma once
/// Fields of tables as RFC 4180 asks for them.

#include <string>
#include <string_view>

namespace topple::record {

/// A text in quotes if it needs them, quotes inside doubled.
std::string quote_csv(std::string_view text);

}  // namespace topple::record
