#pragma once
/// What a study found, as files: JSON for programs, CSV for spreadsheets (docs/study.md).

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "study/manager.h"

namespace topple::study {

inline constexpr const char* failed_name = "failed";

/// Name of an outcome class of a result; failed runs are one: "failed", or "failed run" where an outcome of the model
/// has that name.
std::string name_of_outcome(const StudyResult&, int outcome);
/// The same for readers: "(no name)" where a model gives none.
std::string words_of_outcome(const StudyResult&, int outcome);
/// Classes that the problem knows beforehand and no run has had.
std::vector<std::string> list_unmet_outcomes(const Problem&, const StudyResult&);
/// Whether a necessity is that of searches which ended, of all outcomes that there may be.
bool is_necessity_converged(const Problem&, const StudyResult&, int outcome);

/// Everything but the samples, in the units of the file that was read; outputs in those of Problem::outputs.
nlohmann::ordered_json make_results_json(const Problem&, const StudyResult&);
std::string write_results_json(const Problem&, const StudyResult&);
/// Bounds of all outputs: output, outcome (empty: any), alpha, lower, upper, and whether searches converged there. Of
/// each outcome by itself where there are several.
std::string write_membership_csv(const Problem&, const StudyResult&);
/// Outcome classes: runs, possibility, necessity.
std::string write_outcomes_csv(const Problem&, const StudyResult&);
/// The same of runs that keep the requirement, break it and fail; empty if none is asked for.
std::string write_requirement_csv(const Problem&, const StudyResult&);
/// Limits of a plan: how runs fare with each, and how possible it is that it is broken; empty if there are none.
std::string write_limits_csv(const Problem&, const StudyResult&);
/// All runs: inputs, what follows from them, membership, outcome, outputs, why it failed.
std::string write_samples_csv(const Problem&, const StudyResult&);
/// Curves of runs, one row each: sample and ordinates; empty if the model gives none.
std::string write_trajectories_csv(const Problem&, const StudyResult&);

/// Which input drives what: output or outcome, input, shares with their standard errors, places, and the outcome's
/// possibility with the input known. Empty if nothing is known of drivers.
std::string write_drivers_csv(const Problem&, const StudyResult&);
/// Permissible boxes, a row per box and input; empty if none were looked for.
std::string write_boxes_csv(const Problem&, const StudyResult&);
/// Envelopes of curves: curve, outcome (empty: any), alpha, place, lower, upper; empty without trajectories.
std::string write_fans_csv(const Problem&, const StudyResult&);
/// Outline of debris: outcome, alpha, corners in W; empty without one.
std::string write_debris_csv(const Problem&, const StudyResult&);

/// The largest possibility that is known of a class.
double possibility_of(const StudyResult&, const uncertainty::ClassBounds&);
/// Whether a search for it came to its end there.
bool is_possibility_converged(const StudyResult&, const uncertainty::ClassBounds&);
/// Entropies of all inputs over that of an output, each part of the size of its core value (theory, equation (12)); NaN
/// where one of them is 0 or the output has a level without value.
double calc_robustness_of(const Problem&, const StudyResult&, std::size_t output);
/// What whole runs say of a condensed study's bounds and outcomes, one row each; empty without such runs.
std::string write_confirmation_csv(const Problem&, const StudyResult&);

/// Removes a file of results that no longer holds, if there is one of that name that begins like it (`begin`, where N
/// stands for a number); others are not ours. Throws std::runtime_error.
void remove_result(const std::string& path, std::string_view begin);
/// Writes all of them into a folder, in the place of those of an earlier call: what there is no more is removed.
/// Returns the paths.
std::vector<std::string> write_results(const std::string& folder, const Problem&, const StudyResult&);

/// `digits`, and as many more as values between `low` and `high` need that vary little beside their size; 17 at most.
int calc_digits(double low, double high, int digits);

}  // namespace topple::study
