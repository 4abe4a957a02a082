#pragma once
/// Random inputs of a study: distributions whose parameters are crisp or fuzzy. A point of the fuzzy inputs stands for
/// many runs of the model, at the same probabilities for every point, and its outputs are statistics of these runs
/// (docs/study.md, "Random inputs"; theory, section 8).

#include <array>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "product/random_values.h"
#include "study/model.h"
#include "study/problem.h"

namespace topple::study {

/// Kind of models with random inputs.
inline constexpr const char* random_kind = "random";

struct RandomInput {
  struct Parameter {
    int place = -1;    // among the coordinates of a point, with what follows from it; -1: a number
    double value = 0;  // of the number, in what points hold
  };
  Quantity quantity;
  const product::Distribution* distribution = nullptr;
  std::array<Parameter, 2> parameters;
};

/// A number made of the runs at a point.
struct RandomStatistic {
  enum class Kind { Mean, Deviation, Quantile, Outcome, Failed, Above, AtLeast, Below, AtMost };
  Kind kind = Kind::Mean;
  Quantity quantity;  // "q95(tilt)", with the output's unit
  std::string of;     // output or outcome
  double value = 0;   // probability of the quantile; limit, in what outputs hold
};

/// What follows from inputs of which some are random; the model sees it.
struct RandomFormula {
  std::string name, text;
};

struct Randomness {
  std::string of = "evaluator";  // kind of the model that is run
  std::vector<RandomInput> inputs;
  std::vector<RandomFormula> formulas;  // of an evaluator, all of them; they see fuzzy inputs, then random ones
  std::vector<RandomStatistic> statistics;
  int runs = 0;  // at each point
  std::uint64_t seed = 1;
  double most_failed = 0;  // share of them that may fail
};

/// Understands "mean(tilt)", "sd(tilt)", "q95(tilt)", "p(topple)", "p(failed)", "p(tilt > 3)"; limits are in the units
/// in which outputs are shown. Fills `fault` with what is wrong, at a character of the text.
///   model  outputs and outcomes as far as they are known beforehand
struct StatisticFault {
  std::size_t offset = 0;
  std::string message, help;
};
RandomStatistic read_statistic(const std::string& text, const Problem& model, int runs, StatisticFault& fault);
/// All statistics of the settings; complaints stand at their words.
std::vector<RandomStatistic> read_statistics(const product::RandomSettings&, const Problem& model,
                                             product::Complaints&);

/// Least and largest value of a random input among the runs of all points whose parameters lie between these ends.
std::array<double, 2> find_extremes(const product::Distribution&, const std::array<std::array<double, 2>, 2>& ends,
                                    int runs);

/// Gives the problem its outputs, its kind and its identity: {..., "random": {...}}. Its inputs and what follows are
/// those of the points, outputs and outcomes those of the model.
void set_random(Problem&, Randomness);

/// Factory of the kind "random": asks a model of the kind `of` for all runs of a point in one batch. A point fails when
/// more of its runs fail than may. Of the definition: inputs, identity.random, and what the model's factory takes.
Runner make_random_runner(const std::string& definition, const RunnerFactories& models);

/// What runs and outputs are, and how each random input is distributed.
std::string tell_randomness(const Problem&);
/// How many runs of the model the study takes at most.
std::string tell_random_cost(const Problem&);
/// Inputs with their distributions, runs, seed; for results.
nlohmann::ordered_json make_random_json(const Problem&);

}  // namespace topple::study
