#include "product/foreign_text.h"

#include <algorithm>
#include <string_view>

#include "base/error.h"
#include "base/utf8.h"
#include "product/plan.h"

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

void check_import(const std::string& text, const char* code, const std::string& file) {
  try {
    std::vector<Diagnostic> warnings;
    (void)read_plan(text, file, warnings);
  } catch (const InputError& e) {
    for (const Diagnostic& d : e.diagnostics())
      if (d.code != "E211" && d.severity == Severity::Error)
        throw InputError(std::vector<Diagnostic>{{Severity::Error,
                                                  code,
                                                  {file, 0, 0},
                                                  1,
                                                  "would give a plan that cannot be read: " + d.message,
                                                  "report this file: every import is to give a plan with gaps"}});
  }
}

}  // namespace topple::product
