#pragma once
/// Fuzzy randomness: random variables whose distributions have fuzzy parameters (docs/theory/uncertainty.md, section
/// 8). Outside an alpha-level optimisation over the parameters, inside a Monte Carlo simulation with the same random
/// numbers for every parameter set, so that the outer mapping is a function.

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "uncertainty/mapping.h"

namespace topple::uncertainty {

/// Value at the probability u in (0, 1), for the parameters.
using Quantile = std::function<double(double u, std::span<const double> parameters)>;

/// Parameters: mean, standard deviation >= 0.
Quantile make_normal();
/// Parameters: mean > 0 and standard deviation >= 0 of the variable itself, not of its logarithm.
Quantile make_lognormal();
/// Parameters: lower and upper end.
Quantile make_uniform();
/// Largest values. Parameters: mean, standard deviation >= 0.
Quantile make_gumbel();
/// Value of the standard normal distribution at the probability u in (0, 1); to round-off.
double calc_normal_quantile(double u);

struct RandomVariable {
  Quantile quantile;
  std::vector<int> parameters;  // indices of the outer (fuzzy) coordinates
};

/// A number from the runs of one parameter set; failed runs are among them.
using Statistic = std::function<double(std::span<const Result> runs)>;
/// Share of an outcome class (failed_outcome included) in all runs.
Statistic make_probability(int outcome);
/// Share of runs, of those that did not fail, whose output exceeds a limit.
Statistic make_exceedance(int output, double limit);
/// Of an output over the runs that did not fail; not a number if there is none.
Statistic make_mean(int output);
Statistic make_deviation(int output);
/// The smallest value that at least the share q of these runs does not exceed.
Statistic make_empirical_quantile(int output, double q);

struct MonteCarloOptions {
  int samples = 1000;  // runs for each parameter set
  int batch = 4096;    // inner points given to the model at once, at most, rounded up to whole parameter sets
  std::uint64_t seed = 1;
  bool spread = true;  // Sobol points instead of independent ones: far less scatter for smooth statistics
};

/// The outer mapping: for each outer point (n fuzzy coordinates: parameters and other fuzzy inputs) the model is run at
/// `samples` inner points, which hold the n outer coordinates and then one value per random variable. Outputs: the
/// statistics, then the share of inner runs that failed. An outer run fails if all inner ones do, or a statistic is no
/// number. Throws InputError E810: no samples, unknown parameters.
Evaluate with_monte_carlo(int outer_size, std::vector<RandomVariable>, Evaluate model, std::vector<Statistic>,
                          const MonteCarloOptions&);

}  // namespace topple::uncertainty
