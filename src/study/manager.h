#pragma once
/// The fuzzy analysis of a problem over a store: it asks for points, workers answer them, nothing is asked twice. The
/// analysis is deterministic, so one that was interrupted is repeated from its start with the answers that are there,
/// and ends with the same bits.

#include <functional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "study/confirmation.h"
#include "study/insights.h"
#include "study/pool.h"
#include "study/problem.h"
#include "uncertainty/alpha.h"
#include "uncertainty/possibility.h"

namespace topple::study {

struct StudyOptions {
  std::string store;          // file or server
  std::string name = "main";  // of the study in the store
  std::string source;         // text of the file that the problem was read from, kept with the study
  std::string source_name;
  PoolOptions pool;  // own workers; no jobs: only those of other processes
  bool rerun_failed = false;
  std::string directory;           // where a command is looked for; empty: the model is none
  bool is_new = false;             // a study of this name in the store must be the same one
  std::function<void()> accepted;  // called once the store holds the study, before anything is run; may be empty
};

/// Where a study is.
struct StudyState {
  long done = 0, failed = 0;                   // points answered, of those asked for so far; done includes failed
  long running = 0, open = 0;                  // asked for, not answered; of them under way
  long run_here = 0;                           // answers since this start, or that of the whole runs
  long answers = 0;                            // since this start
  double seconds = 0;                          // in which those of `run_here` came
  int limit = 0;                               // of points
  bool is_confirming = false;                  // whole runs are under way
  const struct StudyResult* so_far = nullptr;  // names and bounds; nullptr before the first
};

struct StudyResult {
  std::vector<std::string> outputs;   // names
  std::vector<std::string> outcomes;  // names of the classes 0, 1, ...
  uncertainty::AlphaResult alpha;     // with all samples
  uncertainty::PossibilityResult possibilities;
  std::vector<uncertainty::Possibility> requirement;  // of keeping and breaking Problem::permissible, see requirement.h
  std::vector<uncertainty::Possibility> limits;       // of breaking Problem::limits[outcome], see limits.h
  uncertainty::Ending ending = uncertainty::Ending::Cancelled;
  Confirmation confirmation;  // of a condensed model
  std::vector<int> spread;    // samples that lie over the support irrespective of results
  Insights insights;
  std::vector<std::string> failures;  // why runs failed, each reason once, most frequent first
  bool is_finished = false;
};

/// Runs the study, or goes on with it. Ends early when `progress.cancel` is set; the same call goes on later.
///   watch  called from this thread a few times a second
/// Throws InputError: E804, E807 (inputs), E822 (the store holds a study of another model under this name), E823 (other
/// outputs or a trajectory of another length at another point), E824 (an answer that cannot be understood);
/// ConnectionLost.
StudyResult run_study(const Problem&, const RunnerFactories&, const StudyOptions&, const Progress&,
                      const std::function<void(const StudyState&)>& watch);

/// What the store knows of a study, without a run. Bounds of a study that is under way are those so far.
StudyResult read_study(const Problem&, Store&, const StudyRow&);

/// Outcome classes that have numbers: all but that of failed runs.
int count_outcomes(const uncertainty::AlphaResult&);

/// Options of the analysis that follow from a problem.
uncertainty::AlphaOptions make_alpha_options(const Problem&);

}  // namespace topple::study
