#pragma once
/// Verification of an engine: small models whose answers are known, run at three steps, with the order of convergence.
/// `topple mbs verify` shows the table; docs/verification.md is written by it.

#include <functional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "engines/engine.h"

namespace topple::engines {

/// One engine as the cases see it: runs models, remembers what could not be run.
class Bench {
 public:
  explicit Bench(const Engine& engine, Progress progress = {}) : engine_(engine), progress_(std::move(progress)) {}

  /// Runs to the end from the poses of the model (or its equilibrium, if asked for) and calls on_frame. False if the
  /// engine cannot express the model or the run does not reach its end; after that nothing is run any more.
  bool run(const mbs::Model&, mbs::Options);

  const std::vector<Unsupported>& unsupported() const { return unsupported_; }
  const std::string& failure() const { return failure_; }  // why a run did not reach its end
  bool is_cancelled() const { return progress_.is_cancelled(); }
  const mbs::Summary& summary() const { return summary_; }  // of the last run

 private:
  const Engine& engine_;
  Progress progress_;
  std::vector<Unsupported> unsupported_;
  std::string failure_;
  mbs::Summary summary_;
};

/// Something that is measured in a case.
struct VerifiedQuantity {
  std::string what;
  std::string unit;
  std::vector<double> exact;  // several components: the error is the length of the difference
  double tolerance = 0;       // of the error at the finest step [unit]
  double order = 0;           // of convergence, expected; 0: none is claimed
};

using Values = std::vector<std::vector<double>>;  // as the quantities of the case, each with its components

struct VerificationCase {
  std::string name;
  std::string model;          // what is modelled, in one sentence
  std::string source;         // of the exact values
  std::string remark;         // about the order or the size of the errors; may be empty
  std::string parameter;      // what is halved, with its unit: "step [s]"
  std::vector<double> steps;  // h, h/2, h/4; one zero: nothing to refine
  std::vector<VerifiedQuantity> quantities;
  std::function<Values(Bench&, double step)> measure;
};

/// Q quantities, S steps.
struct VerifiedRow {
  std::vector<double> value;  // at the finest step
  std::vector<double> error;  // (S) [unit]
  double order = 0;           // between the two finest steps; 0: none, as where errors are round-off
  bool is_within = false;     // the error at the finest step is below the tolerance
};

struct VerificationResult {
  std::vector<Unsupported> unsupported;  // not empty: the engine cannot express the case
  std::string failure;                   // not empty: a run did not reach its end
  std::vector<VerifiedRow> rows;         // (Q); empty if there was nothing to measure
  bool passes() const;
};

/// Every case, in the order of the page.
std::vector<VerificationCase> make_verification_cases();

VerificationResult verify(const VerificationCase&, const Engine&, const Progress& = {});

/// Whether an error is no more than what arithmetic leaves of numbers of this size.
bool is_round_off(double error, const std::vector<double>& exact);

/// Errors and values as the page shows them.
std::string error_text(double error, const std::vector<double>& exact);
std::string value_text(const std::vector<double>&);

/// The whole page. Reproducible: no times, no names of machines.
std::string to_markdown(const Engine&, const std::vector<VerificationCase>&, const std::vector<VerificationResult>&);

}  // namespace topple::engines
