#pragma once
/// Where something stands in the text of a plan that was read before.

#include <string>
#include <vector>

#include "product/document.h"
#include "product/plan.h"

namespace topple::product {

/// Places of a key's values in the tables that start at `tables`; a table's own where the plan's text has no such key.
std::vector<Place> find_values(const Plan&, const std::vector<SourcePosition>& tables, const std::string& key);

}  // namespace topple::product
