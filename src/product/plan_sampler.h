#pragma once
/// Plans with the values of samples.

#include <span>

#include "product/document.h"
#include "product/plan.h"

namespace topple::product {

/// A plan with [fuzzy], ready to be sampled; constant, so that several threads may sample it.
struct PlanSampler {
  FuzzyPlan fuzzy;
  std::string path, text;  // of the plan
  Node document;           // without [fuzzy]
};

/// The plan has been read without an error.
PlanSampler make_sampler(const Plan&);

/// The plan with the values of one point, one for each input in SI; what follows by a formula is computed. The values
/// are put into the plan's document, which is read again, so that every rule and every default of a plan holds. Path
/// and text are those of the plan; `fuzzy` is empty. Throws InputError.
Plan make_sample(const PlanSampler&, std::span<const double> point);

}  // namespace topple::product
