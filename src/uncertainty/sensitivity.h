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

/// Sobol's indices by the estimators of Saltelli and Jansen: rows * (n + 2) runs, kept in the archive. The space must
/// have no interaction: throws InputError E811 if it has, or for fewer than 16 rows. Rows that could not be run are
/// left out.
Sensitivity find_drivers(const Space&, Asker&, const SensitivityOptions&);

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

}  // namespace topple::uncertainty
