#pragma once
/// What ties fuzzy values together: constraints and a joint membership. One syntax for plans ([fuzzy] in docs/plan.md)
/// and files of fuzzy inputs (docs/study.md).

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "product/expression.h"
#include "product/table_reader.h"

namespace topple::product {

/// left <= right, or left >= right.
struct Constraint {
  Expression left, right;
  bool is_at_least = false;
  Place place;
  std::string text;
};

struct Interaction {
  std::vector<Constraint> constraints;
  std::optional<Expression> joint;
  Place joint_place;
  std::string joint_text;
  /// Round-off of formulas and units, in parts of the sides: an equation as two constraints has places.
  static constexpr double slack = 1e-12;

  bool is_empty() const { return constraints.empty() && !joint; }
};

/// Above 0 where the constraint is broken; infinite where a side has no value.
///   values  of the names that the formulas may use, in their order
double calc_excess(const Interaction&, size_t constraint, std::span<const double> values);
/// The joint membership, in [0, 1]: 0 where its formula has no value, 1 without a formula.
double calc_joint(const Interaction&, std::span<const double> values);

/// Whether a sample with these values counts: every constraint is kept and the joint membership is above 0.
bool is_possible(const Interaction&, std::span<const double> values);

/// The table [interaction], whose formulas may use `names`.
Interaction read_interaction(TableReader& parent, const std::vector<std::string>& names);
/// Complains of what the middle of the fuzzy values breaks.
///   values  in the middle
///   middle  of what: "the inputs"
void check_interaction(const Interaction&, std::span<const double> values, const std::string& label,
                       const std::string& middle, Complaints&);

}  // namespace topple::product
