#include "product/foreign_text.h"

#include <algorithm>
#include <map>
#include <string_view>

#include "base/error.h"
#include "base/utf8.h"
#include "product/plan.h"
#include "product/reading.h"

namespace topple::product {

std::string clean_text(const std::string& text) {
  constexpr size_t longest = 80;
  const std::string known = is_utf8(text) ? text : latin1_to_utf8(text);
  std::string out;
  for (std::string_view rest = known; !rest.empty();) {
    const std::string_view c = rest.substr(0, utf8_length(rest));
    rest.remove_prefix(c.size());
    if (out.size() + c.size() > longest) break;
    if (c == "\"" || c == "\\" || c == "\x7F" || static_cast<unsigned char>(c[0]) < 32) continue;
    out += c;
  }
  return out;
}

std::string to_line_feeds(std::string text) {
  const size_t first = std::min(text.find_first_of("\r\n"), text.size()),
               next = std::min(text.find_first_not_of('\r', first), text.size());
  if (next > first && (next == text.size() || text[next] != '\n')) std::replace(text.begin(), text.end(), '\r', '\n');
  return text;
}

namespace {

[[noreturn]] void fail(const Diagnostic& d, const char* code, const std::string& file) {
  throw InputError(std::vector<Diagnostic>{{Severity::Error,
                                            code,
                                            {file, 0, 0},
                                            1,
                                            "would give a plan that cannot be read: " + d.message,
                                            "report this file: every import is to give a plan with gaps"}});
}

/// Puts values into gaps, by their keys: small ones where they have to find room.
void fill_gaps(Node& node, const std::string& key) {
  static const std::map<std::string, const char*> values{
      {"fc", "25 N/mm2"},      {"fct", "0.4 N/mm2"},  {"Ec", "60 GPa"},         {"density", "2400 kg/m3"},
      {"strength", "5 N/mm2"}, {"modulus", "3 GPa"},  {"fy", "500 N/mm2"},      {"fu", "1000 N/mm2"},
      {"eps_u", "5 %"},        {"as_top", "0 cm2/m"}, {"as_bottom", "0 cm2/m"}, {"as_faces", "0 cm2/m"},
      {"cover", "0 mm"},       {"diameter", "4 mm"},  {"spacing", "20 cm"},     {"top", "1 x 4 mm"},
      {"bottom", "1 x 4 mm"},  {"load", "0 kN/m2"}};
  if (node.kind == Node::Kind::String && node.text == "?") {
    if (key == "count_y" || key == "count_z") {
      node.kind = Node::Kind::Integer;
      node.number = 2, node.integer = 2;
    } else if (const auto value = values.find(key); value != values.end()) {
      node.text = value->second;
    }
  }
  for (Node& item : node.items) fill_gaps(item, key);
  for (Entry& e : node.entries) fill_gaps(e.value, e.key);
}

}  // namespace

void check_import(const std::string& text, const char* code, const std::string& file) {
  try {
    std::vector<Diagnostic> warnings;
    (void)read_plan(text, file, warnings);
  } catch (const InputError& e) {
    for (const Diagnostic& d : e.diagnostics())
      if (d.code != "E211" && d.severity == Severity::Error) fail(d, code, file);
  }
}

std::vector<std::string> check_filled_import(const std::string& text, const char* code, const std::string& file) {
  check_import(text, code, file);
  Node document = parse_document(text, file);
  fill_gaps(document, "");
  Complaints complaints(file);
  (void)read_plan_document(document, file, complaints, false);
  complaints.sort();
  std::vector<std::string> out;
  for (const Diagnostic& d : complaints.all()) {
    if (d.severity != Severity::Error) continue;
    if (d.code < "E302") fail(d, code, file);
    out.push_back(d.message);
  }
  return out;
}

}  // namespace topple::product
