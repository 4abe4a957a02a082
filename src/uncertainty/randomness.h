#pragma once
/// Fuzzy randomness: random variables whose distributions have fuzzy parameters (docs/theory/uncertainty.md, section
/// 8). Outside an alpha-level optimisation over the parameters, inside a Monte Carlo simulation with the same random
/// numbers for every parameter set, so that the outer mapping is a function.

#include <cstdint>
#include <functional>
#include <span>
#include <string>
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
/// Parameters: scale > 0 and shape > 0; P(x > t) = exp(-(t / scale)^shape).
Quantile make_weibull();
/// Value of the standard normal distribution at the probability u in (0, 1); to round-off.
double calc_normal_quantile(double u);

struct RandomVariable {
  Quantile quantile;
  std::vector<int> parameters;  // indices of the outer (fuzzy) coordinates
  /// Why these parameters give no distribution; empty: they do. May be left out.
  std::function<std::string(std::span<const double> parameters)> find_fault = {};
};

/// A number from the runs of one parameter set; failed runs are among them.
using Statistic = std::function<double(std::span<const Result> runs)>;
/// Share of an outcome class (failed_outcome included) in all runs.
Statistic make_probability(int outcome);
enum class Side { Above, AtLeast, Below, AtMost };
/// Share of all runs whose output lies there; a failed run lies nowhere.
Statistic make_share(int output, Side, double limit);
/// Of an output over the runs that did not fail; not a number if there is none.
Statistic make_mean(int output);
Statistic make_deviation(int output);
/// Of N of these runs in the order of the output the k-th one is the quantile (k - 1/2)/N; straight between. That of
/// the first or last one beyond them.
Statistic make_quantile(int output, double q);

/// `count` points in (0, 1)^n, one in the middle of each of `count` equal strata of every coordinate, in the order of
/// Sobol points that are shifted by the seed, re-ordered until the coordinates' normal scores are hardly correlated
/// (Iman and Conover, 1982). Means of what is linear in quantiles of symmetric distributions are
/// exact.
std::vector<Point> make_strata(int n, int count, std::uint64_t seed);

struct MonteCarloOptions {
  int samples = 1000;  // runs for each parameter set
  int batch = 4096;    // inner points given to the model at once, at most, rounded up to whole parameter sets
  std::uint64_t seed = 1;
  bool spread = true;      // strata instead of independent points: far less scatter for smooth statistics
  double most_failed = 0;  // share of inner runs that may fail; beyond it the outer run fails
};

/// The outer mapping: for each outer point (n fuzzy coordinates: parameters and other fuzzy inputs) the model is run at
/// `samples` inner points, which hold the n outer coordinates and then one value per random variable. Outputs: the
/// statistics, then the share of inner runs that failed. An outer run fails if more inner ones do than may or all of
/// them do, if a distribution's parameters are none, or a statistic is no number. Throws InputError E810: no samples,
/// unknown parameters.
Evaluate with_monte_carlo(int outer_size, std::vector<RandomVariable>, Evaluate model, std::vector<Statistic>,
                          const MonteCarloOptions&);

}  // namespace topple::uncertainty
