#pragma once
/// What is studied: fuzzy inputs, what follows from them, and which model answers. Made from a file of inputs
/// (inputs_file.h) or from a plan with fuzzy values.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "study/model.h"
#include "uncertainty/space.h"

namespace topple::study {

/// Name and unit of a coordinate, for people and programs. Points hold values in `unit_value` (1: as they are shown).
struct Quantity {
  std::string name, unit;
  double unit_value = 1;  // of one unit, in what points hold
};

struct Problem {
  std::string title;
  std::vector<Quantity> inputs;   // fuzzy; as many as space.inputs
  std::vector<Quantity> derived;  // follow from them
  uncertainty::Space space;
  /// Values of `derived` for a point; may be empty. A value that is not finite makes a failed run.
  std::function<std::vector<double>(const Point&)> calc_derived;
  std::string kind = "evaluator";  // names the factory of the model
  /// JSON object: everything on which answers depend (a command, a plan). Other text: another model, no run is shared.
  std::string identity = "{}";
  /// JSON object: what answers do not depend on (time-out).
  std::string settings = "{}";
  std::vector<double> levels;  // empty: the program's choice
  int limit = 0;               // runs at most; 0: the program's choice
  std::uint64_t seed = 1;
};

/// Name of the model in a store.
std::string calc_model_hash(const Problem&);
/// What a RunnerFactory gets: {"kind", "inputs": [names, derived behind], "identity": {...}, "settings": {...}}.
std::string make_model_definition(const Problem&);

}  // namespace topple::study
