#pragma once
/// Which input drives which output and which outcome (docs/theory/uncertainty.md, section 9).

#include <cstdint>
#include <vector>

#include "uncertainty/alpha.h"
#include "uncertainty/possibility.h"

namespace topple::uncertainty {

/// Part of a variance that one input explains, inputs taken as independent and uniform over a cut.
struct Driver {
  double first = 0;        // alone
  double total = 0;        // alone and together with others; what would vanish with it as a ratio
  double first_error = 0;  // standard errors, from blocks of rows
  double total_error = 0;
};

struct OutcomeDrivers {
  int outcome = 0;
  double share = 0;            // of the volume of the cut
  std::vector<Driver> inputs;  // of the class's indicator (1 in the class, 0 outside)
};

struct Sensitivity {
  std::vector<std::vector<Driver>> outputs;  // output x input; all 0 for an output that does not vary
  std::vector<OutcomeDrivers> outcomes;      // by outcome, rising; failed runs included
  int rows = 0;                              // of the design; each takes n + 2 runs
  int rows_used = 0;                         // in which nothing failed: those count for outputs
};

struct SensitivityOptions {
  double alpha = 0;  // the cut
  int rows = 512;
  std::uint64_t seed = 1;
};

/// The design: points of each row are A, B, and A with one input after the other from B; n + 2 in all.
std::vector<Point> make_driver_points(const Space&, const SensitivityOptions&);

/// Sobol's indices by the estimators of Saltelli and Jansen: rows * (n + 2) runs, kept in the archive. The space must
/// have no interaction: throws InputError E811 if it has, or for fewer than 16 rows. Rows that could not be run are
/// left out.
Sensitivity find_drivers(const Space&, Asker&, const SensitivityOptions&);

/// Shares of runs that are there, at independent or spread points of a box: from the order of one input's values, after
/// Gamboa et al. (2022), section 9 of the theory. `first` only; `total` and its error are NaN, because they would need
/// rows.
///   samples  of the archive; those that failed count for outcomes alone
Sensitivity read_drivers(const Space&, const Archive&, const std::vector<int>& samples);

/// Where an input belongs among the others by its first share: places (from 1) that its error leaves open.
struct Rank {
  int best = 1, worst = 1;
};
/// Two inputs count as apart when their shares differ by more than two standard errors of the difference.
std::vector<Rank> calc_ranks(const std::vector<Driver>&);

/// What becomes of the results when one input is known: fixed at the middle of its core.
struct Fixed {
  int input = 0;
  std::vector<double> width;    // of each output's support, as part of what it is with all inputs fuzzy
  std::vector<double> entropy;  // likewise
  std::vector<Possibility> classes;
};

/// One fuzzy analysis per input on the others, with `limit` further points each at most. `all` is the result with every
/// input fuzzy.
std::vector<Fixed> find_effects_of_knowing(const Space&, Asker&, const AlphaResult& all, const AlphaOptions&,
                                           int limit);

/// How possible each outcome is when one input is known (fixed at the middle of its core), without bounds of outputs:
/// samples of each class are moved to that value, places farther out along the rays of its most possible ones are run,
/// and the search of possibility.h goes on from there. At most `limit` further points per input; possibilities are
/// inner estimates. A class of which no run was found there has the possibility 0 and has not converged.
///   earlier  of a call before: what has converged there and still holds is not searched again
///   facets   of outcomes, with all inputs fuzzy: within them the most possible place with an input known is run
std::vector<Fixed> find_outcomes_of_knowing(const Space&, Asker&, const PossibilityOptions&, int limit,
                                            const std::vector<Fixed>& earlier = {}, const Facets& facets = {});

}  // namespace topple::uncertainty
