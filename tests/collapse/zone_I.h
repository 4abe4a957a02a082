#pragma once
/// The storehouse's ground column as tests of zones and of elements take it.

#include <string>
#include <vector>

#include "base/error.h"
#include "nearfield/rcc.h"
#include "product/section_file.h"

namespace topple::collapse {

/// 50 x 50 cm, 64 cm², zone of 39 cm.
inline nearfield::ZoneInput make_zone_I() {
  std::vector<Diagnostic> warnings;
  std::string text;
  const product::SectionFile file =
      product::read_section_file(TOPPLE_SOURCE_DIR "/examples/rcc/zone_I.toml", warnings, text);
  nearfield::ZoneInput in;
  in.section = file.section, in.concrete = file.concrete, in.steel = file.steel, in.length = file.length;
  return in;
}

}  // namespace topple::collapse
