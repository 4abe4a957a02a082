#pragma once
/// The text of a plan with changes in it; what is not changed stays to the letter, comments too.

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "product/plan.h"

namespace topple::product {

struct PlanChanges {
  /// Instead of the plan's. Charges of one `where` are written as one table as far as they are alike; those that are as
  /// they were keep the table's place (else the most), the others stand behind the stage's last one. Comments between
  /// stages are lost.
  std::optional<std::vector<Stage>> stages;
  std::vector<Cable> cables;                    // beside the plan's
  std::vector<std::pair<int, Weakening>> cuts;  // of members, beside the plan's
  std::optional<double> friction;               // of the site
};

/// Reads the plan's own text, changes it, and reads it again. Throws InputError: E933 where the text is written in a
/// way that cannot be changed (stages in one line, [fuzzy] paths to stages whose numbers would change), or what the
/// changed plan is refused for.
std::string write_changes(const Plan&, const PlanChanges&);

}  // namespace topple::product
