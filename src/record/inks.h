#pragma once
/// The one table of colours, for the writers of drawings.

#include <cstddef>
#include <cstdint>

#include "record/drawing.h"

namespace topple::record {

struct InkColours {
  const char* name;           // in classes and variables of the page
  std::uint32_t light, dark;  // 0xRRGGBB
};

inline constexpr std::size_t ink_count = static_cast<std::size_t>(Ink::BarCompression) + 1;

const InkColours& colours_of(Ink);

}  // namespace topple::record
