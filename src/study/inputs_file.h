#pragma once
/// A file of fuzzy inputs for a model that is not ours: names, numbers, formulas, interaction (docs/study.md).

#include <string>
#include <vector>

#include "base/error.h"
#include "study/problem.h"

namespace topple::study {

/// Reads everything of a problem but its model. Every complaint is collected; formulas and constraints are tried at the
/// middle of the inputs. Throws InputError.
Problem read_inputs_text(const std::string& text, const std::string& name);

/// Makes "command" the model of a problem, or the one that its random inputs run.
void set_evaluator(Problem&, const std::string& command, double timeout, bool is_one_shot);

}  // namespace topple::study
