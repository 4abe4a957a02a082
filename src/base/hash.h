#pragma once

#include <string>
#include <string_view>

namespace topple {

/// SHA-256 of the bytes as 64 lower-case hexadecimal digits (FIPS 180-4).
std::string calc_sha256(std::string_view bytes);

}  // namespace topple
