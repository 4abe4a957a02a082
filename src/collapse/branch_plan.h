#pragma once
/// The plan of a branch as a text: the plan it began from with what a plan can say of its edits.

#include <string>
#include <vector>

#include "collapse/live_model.h"

namespace topple::collapse {

struct BranchPlan {
  std::string text;
  std::vector<std::string> taken;     // edits that are in the text, in words
  std::vector<std::string> left_out;  // and those that are not, with the reason
};

/// Times of charges, charges more and less are always in the text; pre-cuts, cables and friction if they were made at
/// the very beginning: a plan knows no later moment for them. A charge that was taken out fails. An edit with which the
/// text would be no plan is left out, with the first error as the reason; edits of charges are taken or left out
/// together. Firing times scatter anew.
///   sample  of a study that the branch plays, in words: the text has the plan's own values instead
BranchPlan write_branch_plan(const LiveModel&, const std::string& sample = {});

}  // namespace topple::collapse
