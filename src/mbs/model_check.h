#pragma once
/// What is wrong with a model, each complaint with its path as in the JSON file.

#include <string>
#include <vector>

#include "mbs/model.h"

namespace topple::mbs {

struct Complaint {
  std::string path;  // "joints[3].X_PF"
  std::string name;  // of the item; may be empty
  std::string what;
  std::string message() const { return path + (name.empty() ? "" : " \"" + name + "\"") + ": " + what; }
};

/// Empty if the model can be run.
std::vector<Complaint> find_complaints(const Model&);

/// Throws InputError E606 for a set step (> 0) that is longer than the run, or with which it would take more than
/// kMostSteps [s].
void check_step(double step, double duration);

}  // namespace topple::mbs
