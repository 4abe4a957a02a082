#include "engines/verification.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace topple::engines {

namespace {

double length_of(const std::vector<double>& v) {
  double sum = 0;
  for (const double x : v) sum += x * x;
  return std::sqrt(sum);
}

double distance_between(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return NAN;
  std::vector<double> d(a);
  for (size_t i = 0; i < d.size(); ++i) d[i] -= b[i];
  return length_of(d);
}

std::string order_text(double order) { return order == 0 ? "-" : fmt::format("{:.2f}", order); }

}  // namespace

bool Bench::run(const mbs::Model& model, mbs::Options options) {
  if (!unsupported_.empty() || !failure_.empty()) return false;
  unsupported_ = engine_.find_unsupported(model, options);
  if (!unsupported_.empty()) return false;
  options.progress = progress_;
  summary_ = engine_.run(model, options);
  using Ending = mbs::Summary::Ending;
  if (summary_.ending == Ending::TimeLimit || summary_.ending == Ending::AtRest) return true;
  failure_ = summary_.message.empty() ? "the run did not reach its end" : summary_.message;
  return false;
}

bool VerificationResult::passes() const {
  return failure.empty() && std::all_of(rows.begin(), rows.end(), [](const VerifiedRow& r) { return r.is_within; });
}

bool is_round_off(double error, const std::vector<double>& exact) {
  return error < 1e-10 * std::max(1.0, length_of(exact));
}

VerificationResult verify(const VerificationCase& c, const Engine& engine, const Progress& progress) {
  Bench bench(engine, progress);
  VerificationResult result;
  std::vector<VerifiedRow> rows(c.quantities.size());
  for (const double step : c.steps) {
    const Values values = c.measure(bench, step);
    result.unsupported = bench.unsupported();
    result.failure = bench.failure();
    if (!result.unsupported.empty() || !result.failure.empty()) return result;
    for (size_t q = 0; q < rows.size(); ++q) {
      rows[q].value = q < values.size() ? values[q] : std::vector<double>{};
      rows[q].error.push_back(distance_between(rows[q].value, c.quantities[q].exact));
    }
  }
  for (size_t q = 0; q < rows.size(); ++q) {
    const std::vector<double>& e = rows[q].error;
    rows[q].is_within = e.back() <= c.quantities[q].tolerance;
    if (e.size() > 1 && !is_round_off(e.back(), c.quantities[q].exact))
      rows[q].order = std::log2(e[e.size() - 2] / e.back());
  }
  result.rows = std::move(rows);
  return result;
}

std::string error_text(double error, const std::vector<double>& exact) {
  if (!std::isfinite(error)) return "not found";
  return is_round_off(error, exact) ? "round-off" : fmt::format("{:.1e}", error);
}

std::string value_text(const std::vector<double>& v) {
  std::string text;
  for (const double x : v) text += fmt::format("{}{:.10g}", text.empty() ? "" : ", ", x);
  return v.size() > 1 ? "(" + text + ")" : text;
}

std::string to_markdown(const Engine& engine, const std::vector<VerificationCase>& cases,
                        const std::vector<VerificationResult>& results) {
  std::string page = fmt::format(
      R"(# Verification of the multibody engine

Small models whose answers are known, run on the engine `{}` {}. Written by

```sh
topple mbs verify --markdown docs/verification.md
```

`--json FILE` writes the same for programs, `--engine NAME` asks another engine. Each case is compared with a closed form, with an integral evaluated apart from the engine, or with a published number;
the case says with which. It is run with three steps, each half of the one before. An error is the
distance from the exact value, for several components the length of the difference. The order is log2 of the ratio of the
errors at the two finest steps: 2 where halving the step quarters the error. A tolerance is that of the error at the finest
step; the tests fail if an error passes it, or if an order that is claimed is missed by more than 0.25. Errors are given to two
digits and as "round-off" below 1e-10 of the value; the last digit may differ on another processor. Values are SI, g = 9.81 m/s²
unless stated. The cases are in
`src/engines/verification_cases.cpp` and `verification_forces.cpp`. Tolerances are those of the native engine: other engines
(`--engine`) have other errors of the step and other contact, and start from the native engine's equilibrium.

IFToMM: benchmark problems of the IFToMM Technical Committee for Multibody Dynamics. "Computed apart": to 1e-11 or
better by programs that share nothing with topple.
)",
      engine.name(), engine.version());
  for (size_t i = 0; i < cases.size() && i < results.size(); ++i) {
    const VerificationCase& c = cases[i];
    const VerificationResult& r = results[i];
    page += fmt::format("\n## {}\n\n{}\n\nExact: {}\n\n", c.name, c.model, c.source);
    if (!r.unsupported.empty()) {
      page += fmt::format("Not expressible: {}: {}.\n", r.unsupported[0].place, r.unsupported[0].what);
      continue;
    }
    if (!r.failure.empty()) {
      page += fmt::format("Failed: {}.\n", r.failure);
      continue;
    }
    const bool refines = c.steps.size() > 1;
    std::string head = "| measured | exact |", line = "|---|---|";
    for (const double s : c.steps) {
      head += refines ? fmt::format(" error at {:.4g} |", s) : " error |";
      line += "---|";
    }
    head += refines ? " order | expected | tolerance | |\n" : " tolerance | |\n";
    line += refines ? "---|---|---|---|\n" : "---|---|\n";
    if (refines) page += fmt::format("Halved: {}.\n\n", c.parameter);
    page += head + line;
    for (size_t q = 0; q < r.rows.size(); ++q) {
      const VerifiedQuantity& quantity = c.quantities[q];
      const VerifiedRow& row = r.rows[q];
      page += fmt::format("| {}{} | {} |", quantity.what, quantity.unit.empty() ? "" : " [" + quantity.unit + "]",
                          value_text(quantity.exact));
      for (const double e : row.error) page += fmt::format(" {} |", error_text(e, quantity.exact));
      if (refines)
        page += fmt::format(" {} | {} |", order_text(row.order),
                            quantity.order == 0 ? "-" : fmt::format("{:.4g}", quantity.order));
      page += fmt::format(" {:.1e} | {} |\n", quantity.tolerance, row.is_within ? "within" : "**outside**");
    }
    if (!c.remark.empty()) page += "\n" + c.remark + "\n";
  }
  return page;
}

}  // namespace topple::engines
