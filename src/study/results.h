#pragma once
/// What a study found, as files: JSON for programs, CSV for spreadsheets (docs/study.md).

#include <string>
#include <vector>

#include "study/manager.h"

namespace topple::study {

inline constexpr const char* failed_name = "failed";

/// Name of an outcome class of a result; failed runs are one.
std::string name_of_outcome(const StudyResult&, int outcome);

/// Everything but the samples, in the units of the file that was read.
std::string write_results_json(const Problem&, const StudyResult&);
/// Bounds of all outputs: output, outcome (empty: any), alpha, lower, upper, and whether searches converged there.
std::string write_membership_csv(const StudyResult&);
/// Outcome classes: runs, possibility, necessity.
std::string write_outcomes_csv(const StudyResult&);
/// All runs: inputs, what follows from them, membership, outcome, outputs, why it failed.
std::string write_samples_csv(const Problem&, const StudyResult&);
/// Curves of runs, one row each: sample and ordinates; empty if the model gives none.
std::string write_trajectories_csv(const StudyResult&);

/// Writes all of them into a folder; returns the paths.
std::vector<std::string> write_results(const std::string& folder, const Problem&, const StudyResult&);

}  // namespace topple::study
