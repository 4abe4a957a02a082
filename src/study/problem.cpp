#include "study/problem.h"

#include <nlohmann/json.hpp>

#include "base/hash.h"

namespace topple::study {
namespace {

using json = nlohmann::ordered_json;

json make_identity(const Problem& p) {
  json names = json::array();
  for (const auto* list : {&p.inputs, &p.derived})
    for (const Quantity& q : *list) names.push_back(q.name);
  return {{"kind", p.kind}, {"inputs", names}, {"identity", json::parse(p.identity)}};
}

}  // namespace

Quantity find_output(const Problem& p, const std::string& name) {
  for (const Quantity& q : p.outputs)
    if (q.name == name) return q;
  return {name, "", 1};
}

std::string calc_model_hash(const Problem& p) { return calc_sha256(make_identity(p).dump()); }

std::string make_model_definition(const Problem& p) {
  json definition = make_identity(p);
  definition["settings"] = json::parse(p.settings);
  return definition.dump();
}

}  // namespace topple::study
