#pragma once
/// The debris of a finished run as tables (docs/exports.md).

#include <string>

#include "record/record.h"

namespace topple::collapse {

/// "x [m],y [m],height [m]": the hill's upper surface over squares of `cell` [m], at their middles. A record without
/// frames gives the header alone.
std::string make_height_table(const record::Record&, double cell);
/// "share,x [m],y [m]": corners of the outlines of 50, 90, 95 and 100 % of the mass, counter-clockwise.
std::string make_outline_table(const record::Record&);

}  // namespace topple::collapse
