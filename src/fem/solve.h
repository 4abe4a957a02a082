#pragma once
/// Equilibrium of a system, step by step: Newton's iterations with a line search or with remembered secants, steps that
/// shrink and grow by themselves. docs/theory/fem.md (11) to (15).

#include <functional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "fem/system.h"

namespace topple::fem {

/// How one control is driven: its displacement is prescribed, or the force on it.
struct Drive {
  bool prescribed = true;
  double value = 0;  // [m, rad] or [N, N·m]
};

/// Load of a step: all controls, and the factor of Model::load.
struct Loading {
  std::vector<Drive> controls;
  double load_factor = 0;
};

struct SolveOptions {
  double tolerance = 1e-5;  // of the residual over Response::scale
  int iterations = 60;      // at most, in one step
  double secant_share = 0;  // stiffness to begin with, see StiffnessChoice; more if the matrix is not positive
  int refresh = 1;          // iterations between two factorisations
  int memory = 0;           // secants remembered (Anderson's mixing); 0: plain Newton with line search
  bool extrapolate = true;  // begin a step with the last increment
  double largest_lag =
      0.02;         // of laws that extrapolate: error of their forces over Response::scale that a step may have
  int threads = 1;  // of the loop over elements, 0: all of the machine
};

/// How a step ended.
struct StepSummary {
  bool converged = false;
  int iterations = 0, factorisations = 0;
  double residual = 0;                                       // last, over Response::scale
  double lag = 0;                                            // error of extrapolation, over Response::scale
  double element_time = 0, factor_time = 0, solve_time = 0;  // [s]
};

class Solver {
 public:
  /// The system must outlive the solver.
  explicit Solver(const System&);

  /// Searches equilibrium under `loading`, from the accepted state; accepts it if found, else nothing changes.
  StepSummary step(const Loading&, const SolveOptions&);

  const System& system() const { return *system_; }
  const State& state() const { return state_; }
  const Response& response() const { return response_; }
  const Loading& loading() const { return last_; }
  /// Says what holds the accepted state up now, such as a force where a displacement was prescribed.
  void restart(const Loading& same) { last_ = same, increment_.clear(); }
  double control(int c) const;                        // displacement of a control [m, rad]
  double control_force(int c) const;                  // what the elements take from it [N, N·m]
  double external_work() const { return external_; }  // of controls and loads, trapezoids [J]
  double internal_work() const { return internal_; }  // ∫ σ dε dV of all elements, trapezoids [J]

 private:
  const System* system_;
  State state_;
  Response response_;
  Loading last_;
  Cholesky cholesky_;
  SparseMatrix K_;
  std::vector<double> increment_;  // of the last accepted step
  std::vector<double> increment_drive_;
  double external_ = 0, internal_ = 0;
};

struct MarchOptions {
  SolveOptions solve;
  double first = 0.05, smallest = 1e-4, largest = 0.1;  // parts of the way
  double jump_lag =
      0.1;  // lag allowed where steps got shortest: the structure jumps, as when a cover or a bar gives way
};
struct MarchSummary {
  bool complete = false, cancelled = false;
  double reached = 0;      // part of the way
  double residual = 0;     // last
  double largest_lag = 0;  // of an accepted step
  int steps = 0, iterations = 0, failed = 0, factorisations = 0;
  double element_time = 0, factor_time = 0, solve_time = 0;  // [s]
  std::string ending;  // "complete", "cancelled at ...", "did not converge at ..., last residual ..."
};
/// Goes from the solver's last loading to `target` in a straight line. Whether a control is prescribed follows
/// `target`; a control that changes its kind goes on from where it is. `accepted` is called after each step with the
/// part of the way; it returns false to end the march. `describe` names a part of the way for the ending ("φ = 0.02").
MarchSummary march(Solver&, const Loading& target, const MarchOptions&, const std::function<bool(double)>& accepted,
                   const Progress&, const std::function<std::string(double)>& describe);

}  // namespace topple::fem
