#pragma once
/// The fuzzy values of a plan, [fuzzy] in docs/plan.md: which of its values are fuzzy numbers, which follow from others
/// by a formula. What the numbers mean for an analysis is the caller's; plan_sampler.h gives the plan of a sample.

#include <span>
#include <string>
#include <vector>

#include "product/fuzzy_values.h"
#include "product/interaction.h"
#include "product/random_values.h"

namespace topple::product {

/// A value of the plan's document: key of a table or place in a list, from the root.
struct DocumentStep {
  std::string key;
  int item = -1;  // from 0; then `key` is empty
};
using DocumentPath = std::vector<DocumentStep>;

/// What a formula counts with.
struct FuzzyOperand {
  int input = -1;    // index into the inputs, -1: a value of the plan
  double value = 0;  // of the plan [SI]
  double unit = 1;   // SI value of one unit in formulas
};

struct FuzzyPlan {
  std::vector<FuzzyValue> inputs;  // fuzzy values, parameters of random ones (without a place), random values
  std::vector<DerivedValue> derived;
  FuzzySearch search;
  std::vector<std::vector<DocumentPath>> places;    // of the inputs, then of the derived values; patterns have many
  std::vector<std::string> si;                      // name of the SI unit in files, the same order
  std::vector<std::vector<FuzzyOperand>> operands;  // of each derived value's formula
  std::vector<double> input_unit, derived_unit;     // SI value of one unit of each value in formulas
  Interaction interaction;                          // sees inputs, then derived values, in these units
  std::vector<RandomValue> random;                  // the last of the inputs, whose corners are one value
  RandomSettings randomness;

  bool is_empty() const { return inputs.empty() && derived.empty(); }
  /// Inputs that are not random.
  std::size_t fuzzy_count() const { return inputs.size() - random.size(); }
};

/// The derived values of a point in SI; NaN or infinite outside a formula's range.
std::vector<double> calc_derived(const FuzzyPlan&, std::span<const double> point);
/// Whether a derived value follows from a random one.
bool follows_from_random(const FuzzyPlan&, std::size_t derived);
/// What the formulas of the interaction see of a point.
std::vector<double> calc_interacting(const FuzzyPlan&, std::span<const double> point);
/// Whether the interaction leaves the point possible: every constraint holds and the joint membership is above 0.
bool is_possible(const FuzzyPlan&, std::span<const double> point);
/// The middle of all fuzzy values.
std::vector<double> calc_centre(const FuzzyPlan&);

}  // namespace topple::product
