#pragma once
/// What the analysis sees of a model: points go in, results come out, many at a time.

#include <functional>
#include <limits>
#include <span>
#include <string>
#include <vector>

namespace topple::uncertainty {

/// One value per input.
using Point = std::vector<double>;

/// What the model gives for one point.
struct Result {
  /// Failed: the model broke down there; a class of its own, never a number. NotRun: the work was cancelled before it.
  enum class State { Done, Failed, NotRun };
  State state = State::NotRun;
  std::vector<double> values;      // one per output, the same outputs at every point; empty when failed
  int outcome = 0;                 // class of what happened, 0 and up; outputs may jump between classes
  std::vector<double> trajectory;  // values of a function over a grid common to all points; may be empty
  std::string text;                // why it failed
};

/// Largest size of a value: widths, and sums of two, are numbers too.
inline constexpr double most_value = std::numeric_limits<double>::max() / 4;

/// The mapping model y = f(x). Fills out[i] for batch[i]; may use threads and vector lanes, and must give for a point
/// what it gives for it alone. A result with values that are not finite, or larger than
/// `most_value`, counts as failed.
using Evaluate = std::function<void(std::span<const Point> batch, std::span<Result> out)>;

/// Outcome class of a failed run.
inline constexpr int failed_outcome = -1;

inline int outcome_of(const Result& r) { return r.state == Result::State::Done ? r.outcome : failed_outcome; }

/// A mapping from a function of one point, for tests and quick models.
Evaluate make_evaluate(std::function<Result(const Point&)> model);
/// The same for a function that gives the outputs only; outcome 0.
Evaluate make_evaluate_values(std::function<std::vector<double>(const Point&)> model);

}  // namespace topple::uncertainty
