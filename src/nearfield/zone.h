#pragma once
/// Checks shared by the makers of curves.

#include "nearfield/rcc.h"

namespace topple::nearfield {

/// Throws InputError: a section or a zone that cannot be computed.
void check_zone(const ZoneInput&);

}  // namespace topple::nearfield
