#pragma once
/// Alpha-level optimisation: fuzzy numbers in, a model that answers batches of points, fuzzy numbers out
/// (docs/theory/uncertainty.md, sections 2 and 3).
///
///   Space space{{make_triangular(10, 25, 45), make_triangular(33.6, 64, 88)}, {}, {}};
///   const Evaluate model = [](std::span<const Point> batch, std::span<Result> out) { ... lanes and threads ... };
///   const AlphaResult r = optimise(space, model, {}, {});
///   r.outputs[0].levels[0].lower.value;              // least value of output 0 at alpha 0
///   const FuzzyNumber y = make_number(r, 0);         // output 0 as a fuzzy number
///   r.archive.samples();                             // every run: point, outputs, outcome class, trajectory
///
/// A curve of one parameter set is one run: give its ordinates as `trajectory` and take envelopes with
/// `calc_fan` (uncertainty/fan.h), or give chosen ordinates as outputs and have them optimised.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "base/progress.h"
#include "uncertainty/archive.h"
#include "uncertainty/boundary.h"
#include "uncertainty/space.h"

namespace topple::uncertainty {

/// One end of an output's cut.
struct Bound {
  double value = 0;  // NaN if no run counts
  int sample = -1;   // in the archive, where it was found
  /// A local search ended there because nothing better is near, and lines along the axes led to nothing better; with
  /// more than `corner_inputs` inputs, searches over the faces instead of lines, from other places too.
  bool converged = false;
};

struct LevelBounds {
  double alpha = 0;
  Bound lower, upper;
};

/// Bounds of one output over the levels, alpha rising; nested, because a bound is the archive's least or largest value
/// inside the cut of the inputs.
struct OutputBounds {
  std::vector<LevelBounds> levels;
};

/// What is known of one outcome class.
struct ClassBounds {
  int outcome = 0;                    // failed_outcome for failed runs
  int count = 0;                      // runs
  double possibility = 0;             // largest μ of its runs: an inner estimate; see possibility.h
  int sample = -1;                    // the run that has it
  std::vector<OutputBounds> outputs;  // among its runs only; empty for failed runs; NaN where a cut holds none
};

/// How much was looked at inside the cut of one level.
struct Coverage {
  double alpha = 0;
  int samples = 0;       // runs in the cut
  int space_points = 0;  // of them spread over the cut irrespective of results
};
/// Probability that the spread points of a level all miss an island of the volume fraction v: (1-v)^N.
double calc_miss_probability(const Coverage&, double v);

/// NotConverged: nothing more is found to be tried, and yet not all searches have converged.
enum class Ending { Complete, LimitReached, Cancelled, NotConverged };
std::string to_text(Ending);

struct AlphaResult {
  std::vector<OutputBounds> outputs;
  std::vector<ClassBounds> classes;  // by outcome, rising
  std::vector<Coverage> coverage;    // one per level
  Archive archive;
  Ending ending = Ending::Complete;
  bool can_go_on = false;  // the limit cut searches off, even if all bounds have converged
  int run = 0;             // points sent to the model; the archive's others came from the earlier one
  int failed = 0;          // runs that failed
  int batches = 0;         // calls of the model
  int searches = 0;        // local searches
  int rounds = 0;          // of spread points and dispersed searches
  int rechecks = 0;        // of best samples at which no search had ended
  int restarts = 0;        // searches over the faces from other places, where there are more than `corner_inputs`
};

struct AlphaOptions {
  /// Levels; sorted, 0 and 1 are added.
  std::vector<double> levels = {0, 0.25, 0.5, 0.75, 1};
  /// Different points at most, those of `earlier` included, so that a repetition ends at the same point.
  int limit = 10000;
  /// Runs that there are for it where others follow in the same asker (0: its limit). Then searches come first, wide
  /// levels before narrow ones, and spread points last; ends of axes, corners and these take a sixth or a third each.
  int budget = 0;
  /// Sobol points in the support and added in each inner cut. 0: 80 and 20 per input that has a width (measured on nine
  /// problems, docs/decisions/0018-fuzzy-analysis.md). At most a third of the limit; the same for corners.
  int space_points = 0, inner_points = 0;
  /// Largest number of fuzzy inputs for which all corners of every cut are run.
  int corner_inputs = 8;
  /// With more of them, searches over the faces start from other places, per bound at least so many times in a row
  /// without gain, and until they have found the same bound again as often as `again` says or runs are used up.
  int restarts = 4, again = 3;
  /// Dispersed starts of model searches per bound and round.
  int starts = 2;
  /// Evolution searches per bound, in the first round.
  int evolutions = 1;
  /// Further rounds of spread points and searches from other places go on until so many in a row gained less than 1e-4
  /// of an output's width; twice as many where searches ended at places of different values.
  int patience = 3;
  /// Steps over the support of lines along the axes, through the middle of the inputs (twice as many) and through the
  /// best samples: a bound has converged only when none of them leads to a better one. 0: no lines.
  int lines = 12;
  /// Own searches for the bounds of each outcome class, for which as many runs a bound are kept; without them these
  /// bounds are read off the archive.
  bool search_classes = true;
  /// Called once, when the bounds of all runs are searched and before those of each class where there are several:
  /// others may use the asker and set its limit.
  std::function<Facets()> before_classes;
  /// A search has converged when less than this part of the output's width is left to gain.
  double tolerance = 1e-8;
  /// Bounds of outputs that are not looked for by searches, but still reported from the archive (by index).
  std::vector<int> passive_outputs;
  std::uint64_t seed = 1;
  /// Samples of an interrupted or earlier analysis: a point found there is not run again. Outlives the call.
  const Archive* earlier = nullptr;
  /// Called between batches, whenever a tenth more is known, and at the end, with what is known so far; `archive` is
  /// the one being filled, the result's own is empty.
  std::function<void(const AlphaResult& so_far, const Archive& archive)> watch;
};

/// For models whose runs are dear: about a third of the runs of the default, at a larger risk of missing a remote
/// basin.
AlphaOptions make_thrifty_options();

/// Bounds of every output at every level. The same bits for the same seed, whatever the number of threads of the model,
/// and with or without `earlier`. Cancellation (`progress.cancel`) ends it between batches with the bounds so far.
/// Throws InputError E804 (space), E807 (levels outside 0 to 1), E803 (outputs that change in number).
AlphaResult optimise(const Space&, const Evaluate&, const AlphaOptions&, const Progress&);
/// The same for inputs without interaction.
AlphaResult optimise(const std::vector<FuzzyNumber>&, const Evaluate&, const AlphaOptions&, const Progress&);
/// The same with an asker that others use too: the result's archive stays empty, see `asker.archive()`.
AlphaResult optimise(const Space&, Asker&, const AlphaOptions&);

/// A search of bounds that can go on: what others of the same asker left of its limit may be given to it. Space, asker
/// and options outlive it.
class AlphaSearch {
 public:
  AlphaSearch(const Space&, Asker&, const AlphaOptions&);
  ~AlphaSearch();
  AlphaSearch(const AlphaSearch&) = delete;
  AlphaSearch& operator=(const AlphaSearch&) = delete;

  /// To its end, or to the asker's limit.
  AlphaResult run();
  /// After `run`, with a higher limit: from the best samples that are there by now, whoever asked for them.
  AlphaResult go_on();
  /// After `run`: at least so many further spread points, as far as there are runs, and searches from what stands out
  /// among them.
  AlphaResult spread_on(int count);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Bounds, classes and coverage of the samples that are there, without a run. `space_points`: see Coverage; may be
/// empty.
AlphaResult read_archive(const Space&, const Archive&, const std::vector<double>& levels,
                         const std::vector<int>& space_points = {});

/// The fuzzy number through the cuts of one output. Throws InputError E805 if a level has no value (all runs failed).
FuzzyNumber make_number(const OutputBounds&);
FuzzyNumber make_number(const AlphaResult&, int output);

}  // namespace topple::uncertainty
