#include "base/bytes.h"

#include <algorithm>
#include <bit>
#include <type_traits>

namespace topple {

std::string encode_base64(std::span<const std::uint8_t> bytes) {
  static constexpr char digit[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < 3; ++k) word = word << 8 | (k < n ? bytes[i + k] : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= n ? digit[word >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

template <class Number>
void append_little_endian(std::vector<std::uint8_t>& bytes, Number value) {
  using Bits =
      std::conditional_t<sizeof(Number) == 8, std::uint64_t,
                         std::conditional_t<sizeof(Number) == 4, std::uint32_t,
                                            std::conditional_t<sizeof(Number) == 2, std::uint16_t, std::uint8_t>>>;
  const auto bits = std::bit_cast<Bits>(value);
  for (std::size_t k = 0; k < sizeof(Number); ++k) bytes.push_back(static_cast<std::uint8_t>(bits >> (8 * k) & 255U));
}

template void append_little_endian(std::vector<std::uint8_t>&, float);
template void append_little_endian(std::vector<std::uint8_t>&, double);
template void append_little_endian(std::vector<std::uint8_t>&, std::int32_t);
template void append_little_endian(std::vector<std::uint8_t>&, std::uint32_t);
template void append_little_endian(std::vector<std::uint8_t>&, std::uint16_t);
template void append_little_endian(std::vector<std::uint8_t>&, std::uint8_t);

}  // namespace topple
