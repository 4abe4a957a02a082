#pragma once
/// Reading of fuzzy values, shared by plans and section files.

#include <string>
#include <vector>

#include "product/fuzzy_values.h"
#include "product/table_reader.h"

namespace topple::product {

inline constexpr int most_fuzzy_inputs = 20, most_corner_inputs = 10;

/// The keys of which exactly one says how a value is fuzzy or follows from others.
inline constexpr const char* fuzzy_ways[] = {"triangular", "trapezoidal", "polygonal", "tabulated", "formula"};
/// Help for who wrote none of them.
inline constexpr const char* fuzzy_help =
    "{ triangular = [left, core, right] }, trapezoidal, polygonal, tabulated, or { formula = \"...\" }";

/// The only one of `fuzzy_ways` in the table; empty after a complaint at `where`.
std::string find_fuzzy_way(const TableReader&, Place where);
/// Corners out of any way but a formula; complains about values that are none.
void read_corners(TableReader&, Dimension, FuzzyValue&);
/// The table [search].
FuzzySearch read_search(TableReader& parent);
/// Parses a formula at `node`; a fault becomes a complaint at its character.
Expression read_formula(const Node& node, const std::string& path, const std::vector<std::string>& names, Complaints&);

}  // namespace topple::product
