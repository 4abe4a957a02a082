// topple mbs verify: small models with known answers on one engine, as a table.

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "commands.h"
#include "engines/engine.h"
#include "engines/verification.h"
#include "results.h"
#include "terminal.h"

namespace topple::apps {

using json = nlohmann::ordered_json;
using engines::VerificationCase;
using engines::VerificationResult;

namespace {

json number(double x) { return std::isfinite(x) ? json(x) : json(nullptr); }

json numbers(const std::vector<double>& list) {
  json j = json::array();
  for (const double x : list) j.push_back(number(x));
  return j;
}

json to_json(const engines::Engine& engine, const std::vector<VerificationCase>& cases,
             const std::vector<VerificationResult>& results, int exit_code) {
  json out{
      {"exit_code", exit_code}, {"engine", engine.name()}, {"version", engine.version()}, {"cases", json::array()}};
  for (size_t i = 0; i < results.size(); ++i) {
    const VerificationCase& c = cases[i];
    const VerificationResult& r = results[i];
    json j{{"name", c.name}, {"source", c.source}, {"passes", r.passes()}};
    if (!r.unsupported.empty()) {
      j["unsupported"] = json::array();
      for (const auto& u : r.unsupported) j["unsupported"].push_back({{"place", u.place}, {"what", u.what}});
    }
    if (!r.failure.empty()) j["failure"] = r.failure;
    if (c.steps.size() > 1) {
      j["parameter"] = c.parameter;
      j["steps"] = numbers(c.steps);
    }
    j["quantities"] = json::array();
    for (size_t q = 0; q < r.rows.size(); ++q) {
      const auto& quantity = c.quantities[q];
      const auto& row = r.rows[q];
      j["quantities"].push_back({{"what", quantity.what},
                                 {"unit", quantity.unit},
                                 {"exact", numbers(quantity.exact)},
                                 {"value", numbers(row.value)},
                                 {"errors", numbers(row.error)},
                                 {"order", row.order == 0 ? json(nullptr) : number(row.order)},
                                 {"expected_order", quantity.order == 0 ? json(nullptr) : number(quantity.order)},
                                 {"tolerance", quantity.tolerance},
                                 {"within", row.is_within}});
    }
    out["cases"].push_back(std::move(j));
  }
  return out;
}

void print_case(const VerificationCase& c, const VerificationResult& r) {
  if (!r.unsupported.empty()) {
    std::printf("%s: not expressible, %s: %s\n", c.name.c_str(), r.unsupported[0].place.c_str(),
                r.unsupported[0].what.c_str());
    return;
  }
  if (!r.failure.empty()) {
    std::printf("%s: failed, %s\n", c.name.c_str(), r.failure.c_str());
    return;
  }
  std::printf("%s\n", c.name.c_str());
  for (size_t q = 0; q < r.rows.size(); ++q) {
    const auto& quantity = c.quantities[q];
    std::string line = "  " + quantity.what + (quantity.unit.empty() ? "" : " [" + quantity.unit + "]") + ":";
    for (const double e : r.rows[q].error) line += "  " + engines::error_text(e, quantity.exact);
    if (r.rows[q].order != 0) line += fmt::format("  order {:.2f}", r.rows[q].order);
    std::printf("%s%s\n", line.c_str(),
                r.rows[q].is_within ? "" : fmt::format("  outside {:.1e}", quantity.tolerance).c_str());
  }
}

}  // namespace

int verify_engine(const Arguments& a, const std::atomic<bool>& cancel) {
  const auto engine = engines::make_engine(a.engine);
  const std::vector<VerificationCase> cases = engines::make_verification_cases();
  std::vector<VerificationResult> results;
  Progress progress;
  progress.cancel = &cancel;
  const bool shows = has_colour(stderr);
  bool passes = true;
  for (const VerificationCase& c : cases) {
    if (shows) std::fprintf(stderr, "\r\x1b[2K%zu of %zu: %s ...", results.size() + 1, cases.size(), c.name.c_str());
    results.push_back(engines::verify(c, *engine, progress));
    passes = passes && results.back().passes();
    if (shows) std::fprintf(stderr, "\r\x1b[2K");
    if (progress.is_cancelled()) {
      std::fprintf(stderr, "Cancelled. Nothing was written.\n");
      return kRunFailed;
    }
    print_case(c, results.back());
    std::fflush(stdout);
  }
  const int code = passes ? kOk : kRunFailed;
  const auto write = [](const std::string& path, const std::string& text) {
    if (path.empty()) return;
    replace_file(path, text);
    std::printf("Wrote %s\n", path.c_str());
  };
  write(a.markdown, engines::to_markdown(*engine, cases, results));
  write(a.json_file, dump(to_json(*engine, cases, results, code)) + "\n");
  return code;
}

}  // namespace topple::apps
