#pragma once
/// A plan with [fuzzy] as a problem of the study, and the model that workers make of it: the kind "plan".

#include <string>

#include "product/plan.h"
#include "study/plan_mapping.h"
#include "study/problem.h"

namespace topple::study {

/// Points hold SI values of the fuzzy inputs; answers hold the outputs of PlanMapping in SI, the outcome class, and the
/// tilt over the trajectory's times.
///   rules  text of a file of rules; empty: those built in
/// Throws InputError as PlanMapping does.
Problem make_plan_problem(const product::Plan&, const PlanMappingOptions&, const std::string& rules = {});

/// The same problem again from what make_model_definition wrote of it.
Problem read_plan_problem(const std::string& definition);

/// Factory of the kind "plan". Of the definition: identity as make_plan_problem wrote it. Runs one point after the
/// other in the calling thread.
Runner make_plan_runner(const std::string& definition);

}  // namespace topple::study
