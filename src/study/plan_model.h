#pragma once
/// A plan with [fuzzy] as a problem of the study, and the model that workers make of it: the kind "plan".

#include <string>

#include "product/plan.h"
#include "study/plan_mapping.h"
#include "study/problem.h"

namespace topple::study {

/// Points hold SI values of the fuzzy inputs; answers hold the outputs of PlanMapping in SI, the outcome class, and the
/// tilt over the trajectory's times. A condensed one has the problem of whole runs beside it.
///   rules  text of a file of rules; empty: those built in
/// Throws InputError as PlanMapping does.
Problem make_plan_problem(const product::Plan&, const PlanMappingOptions&, const std::string& rules = {});

/// Whole runs that confirm a condensed study, unless another number is asked for.
inline constexpr int default_confirm = 60;

/// Puts another identity into a problem of a plan, and what belongs to it into the problem of its whole model.
void set_plan_identity(Problem&, const std::string& identity);

/// The same problem again from what make_model_definition wrote of it.
Problem read_plan_problem(const std::string& definition);

/// Factory of the kind "plan". Of the definition: identity as make_plan_problem wrote it. Runs one point after the
/// other in the calling thread.
Runner make_plan_runner(const std::string& definition);

}  // namespace topple::study
