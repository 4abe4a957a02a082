#pragma once
/// Reading of fuzzy values, shared by plans and section files.

#include <functional>
#include <optional>
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
/// Why a point of fuzzy values gives no plan or section; empty: it gives one.
using FuzzyRefusal = std::function<std::string(const std::vector<double>& point)>;
/// The middle of each core.
std::vector<double> centre_of(const std::vector<FuzzyValue>&);
/// Complains of each value one of whose ends alone is refused.
///   prefix    of the complaint
///   place_of  where the value stands
void try_ends(const std::vector<FuzzyValue>&, const FuzzyRefusal&, const std::string& prefix,
              const std::function<Place(const FuzzyValue&)>& place_of, Complaints&);
/// Corners of the support that are refused: "2 of 8 corners", and the first of them with its reason; empty: none.
struct RefusedCorners {
  std::string count, first;
};
RefusedCorners try_corners(const std::vector<FuzzyValue>&, const FuzzyRefusal&);
/// The table [search].
///   is_of_plan  runs of a plan: `after` may say when they end
FuzzySearch read_search(TableReader& parent, bool is_of_plan = false);
/// Parses `count` characters of the text at `node` from `first` on as a formula; a fault becomes a complaint at its
/// character.
std::optional<Expression> parse_formula(const Node& node, size_t first, size_t count, const std::string& label,
                                        const std::vector<std::string>& names, Complaints&);
/// The whole text at `node`; 0 after a complaint.
Expression read_formula(const Node& node, const std::string& path, const std::vector<std::string>& names, Complaints&);

}  // namespace topple::product
