#pragma once
/// What a worker runs: a model that answers points, made from a text that lies in the store, so that any process on any
/// machine can make it.

#include <atomic>
#include <cstddef>
#include <functional>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "uncertainty/mapping.h"

namespace topple::study {

using uncertainty::Point;

/// What a model says of one point.
struct Answer {
  enum class Kind {
    Done,
    Failed,     // the model broke down there; the same would happen again
    Crashed,    // the program behind the model died or did not answer; it may be tried again
    Refused,    // the answer cannot be understood: the study cannot go on
    Cancelled,  // not run, on our own wish
  };
  Kind kind = Kind::Cancelled;
  std::vector<std::pair<std::string, double>> outputs;  // names and values; the same names at every point
  std::string outcome;                                  // class of what happened; may be empty
  std::vector<double> trajectory;                       // values over a grid common to all points; may be empty
  std::string text;                                     // why not Done
  double seconds = 0;                                   // it took
  std::string line{}, source{};                         // as an evaluator gave it, for complaints; not kept
};

/// What the answers to all points of a model have in common.
struct AnswerForm {
  std::vector<std::string> outputs;  // names, sorted
  std::size_t ordinates = 0;         // of each trajectory; 0: none was given so far
};

/// Answers points, in any order, each at most once; a point without an answer counts as cancelled. Called by one
/// thread.
///   points  coordinates of each: fuzzy inputs, then what follows from them
///   give    takes the answer to the point of an index
using Runner = std::function<void(std::span<const Point> points, const std::function<void(std::size_t, Answer)>& give,
                                  const std::atomic<bool>& cancel)>;

/// Makes a runner from a model's definition (JSON). May be called from several threads.
using RunnerFactory = std::function<Runner(const std::string& definition)>;
/// By the kind of model: "evaluator", "plan".
using RunnerFactories = std::map<std::string, RunnerFactory>;

}  // namespace topple::study
