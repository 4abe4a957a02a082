#include "study/problem.h"

#include <algorithm>
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

std::vector<std::string> make_short_names(const std::vector<Quantity>& list) {
  const auto shorten = [](const std::string& name, int parts) {
    std::size_t at = name.size();
    for (int k = 0; k < parts && at != std::string::npos; ++k)
      at = at == 0 ? std::string::npos : name.rfind('.', at - 1);
    return at == std::string::npos ? name : name.substr(at + 1);
  };
  std::vector<std::string> names;
  for (const Quantity& q : list) {
    int parts = 1;
    const auto is_taken = [&](const Quantity& other) {
      return other.name != q.name && shorten(other.name, parts) == shorten(q.name, parts);
    };
    // a number alone is a place in a list
    const auto is_number = [&] { return shorten(q.name, parts).find_first_not_of("0123456789") == std::string::npos; };
    while (shorten(q.name, parts) != q.name && (is_number() || std::any_of(list.begin(), list.end(), is_taken)))
      ++parts;
    names.push_back(shorten(q.name, parts));
  }
  return names;
}

std::string calc_model_hash(const Problem& p) { return calc_sha256(make_identity(p).dump()); }

std::string make_model_definition(const Problem& p) {
  json definition = make_identity(p);
  definition["settings"] = json::parse(p.settings);
  return definition.dump();
}

}  // namespace topple::study
