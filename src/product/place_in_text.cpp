#include "product/place_in_text.h"

namespace topple::product {

namespace {

const Entry* find_entry(const Node& node, const SourcePosition& table, const std::string& key) {
  if (node.kind == Node::Kind::Table && node.place.line == table.line && node.place.column == table.column)
    if (const Entry* entry = node.find(key)) return entry;
  for (const Node& item : node.items)
    if (const Entry* entry = find_entry(item, table, key)) return entry;
  for (const Entry& e : node.entries)
    if (const Entry* entry = find_entry(e.value, table, key)) return entry;
  return nullptr;
}

}  // namespace

std::vector<Place> find_values(const Plan& plan, const std::vector<SourcePosition>& tables, const std::string& key) {
  std::vector<Place> places;
  if (tables.empty()) return places;
  const Node document = plan.text.empty() ? Node{} : parse_document(plan.text, plan.path);
  for (const SourcePosition& table : tables) {
    const Entry* entry = table.line > 0 ? find_entry(document, table, key) : nullptr;
    places.push_back(entry ? entry->value.place : Place{table.line, table.column, 1});
  }
  return places;
}

}  // namespace topple::product
