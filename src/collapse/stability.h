#pragma once
/// How far a standing building is from its resistance, member by member.

#include <string>
#include <vector>

#include "record/record.h"

namespace topple::collapse {

struct MemberMargin {
  std::string member;
  std::string zone;   // its most used one
  double margin = 0;  // capacity over demand
  record::ZoneState state = record::ZoneState::Elastic;
};
/// Of every member at a frame, lowest first: the zones that are neither broken nor fired and carry something.
std::vector<MemberMargin> find_margins(const record::Record&, size_t frame);

}  // namespace topple::collapse
