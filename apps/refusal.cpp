#include "refusal.h"

#include <iostream>

#include "arguments.h"

namespace topple::apps {

using json = nlohmann::ordered_json;

std::string dump(const json& j) { return j.dump(2, ' ', false, json::error_handler_t::replace); }

json to_json(const Diagnostic& d) {
  return {{"severity", d.severity == Severity::Error ? "error" : "warning"},
          {"code", d.code},
          {"file", d.where.file},
          {"line", d.where.line},
          {"column", d.where.column},
          {"message", d.message},
          {"help", d.help}};
}

namespace {

void print(int exit_code, const std::vector<Diagnostic>& list) {
  json out{{"exit_code", exit_code}, {"diagnostics", json::array()}};
  for (const Diagnostic& d : list) out["diagnostics"].push_back(to_json(d));
  std::cout << dump(out) << std::endl;
}

}  // namespace

void print_refusal(const std::vector<Diagnostic>& list) { print(kBadInput, list); }

void print_failure(const std::string& why) { print(kRunFailed, {{Severity::Error, "E830", {}, 1, why, {}}}); }

}  // namespace topple::apps
