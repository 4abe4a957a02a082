#pragma once
/// What carries what: complains about members that hang in the air.

#include <vector>

#include "product/complaints.h"
#include "product/plan.h"

namespace topple::product {

/// A member with the places of the plan that made it.
struct Draft {
  Member member;
  std::vector<Place> opening_places;
  Place rule;   // that put it there
  Place shape;  // that gave it its section, panel and openings: the rule or an override
};

/// Indices of the beams of which an end hangs in the air: neither a column nor a wall stands below it, nor do other
/// beams that are carried end there.
std::vector<size_t> find_hanging_beams(const std::vector<Draft>&);

/// Columns and walls above the ground storey need something below, beams something at both ends, slabs at their
/// corners. Members taken out in the preparation count: the check is about the building as it was built.
void check_support(const Plan&, const std::vector<Draft>&, Complaints&);

}  // namespace topple::product
