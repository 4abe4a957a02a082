#pragma once
/// Numbers as bytes, and bytes as text.

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace topple {

/// RFC 4648, with padding.
std::string encode_base64(std::span<const std::uint8_t> bytes);

/// Appends a number's bytes, lowest first, whatever the machine does.
template <class Number>
void append_little_endian(std::vector<std::uint8_t>& bytes, Number value);

extern template void append_little_endian(std::vector<std::uint8_t>&, float);
extern template void append_little_endian(std::vector<std::uint8_t>&, double);
extern template void append_little_endian(std::vector<std::uint8_t>&, std::int32_t);
extern template void append_little_endian(std::vector<std::uint8_t>&, std::uint32_t);
extern template void append_little_endian(std::vector<std::uint8_t>&, std::uint16_t);
extern template void append_little_endian(std::vector<std::uint8_t>&, std::uint8_t);

/// The bytes of a row of numbers.
template <class Number>
std::vector<std::uint8_t> to_little_endian(std::span<const Number> values) {
  std::vector<std::uint8_t> bytes;
  bytes.reserve(values.size() * sizeof(Number));
  for (const Number value : values) append_little_endian(bytes, value);
  return bytes;
}

}  // namespace topple
