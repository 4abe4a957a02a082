#include "record/page.h"

#include <stdexcept>
#include <string_view>

#include "base/file.h"

namespace topple::record {

namespace {

constexpr std::string_view marker = "<!--TOPPLE-DATA-->";
constexpr std::string_view language_mark = "<html lang=\"en\">";  // the page chooses its words by it

/// A "<" can only stand inside a JSON string; written as an escape, no text of a plan can close or open a tag.
std::string escape_for_html(const std::string& text) {
  std::string safe;
  safe.reserve(text.size() + 64);
  for (const char c : text)
    if (c == '<')
      safe += "\\u003c";
    else
      safe += c;
  return safe;
}

}  // namespace

std::string make_page(const std::string& data, const std::string& bundle, const std::string& language) {
  const std::size_t at = bundle.find(marker);
  if (at == std::string::npos || bundle.find(marker, at + 1) != std::string::npos)
    throw std::runtime_error("the page to fill must hold the marker " + std::string(marker) + " once");
  const std::string_view page = bundle;
  std::string filled(page.substr(0, at));
  filled += R"(<script type="application/json" id="topple-data">)";
  filled += escape_for_html(data);
  filled += "</script>";
  filled += page.substr(at + marker.size());
  if (const std::size_t tag = filled.find(language_mark); tag < at && language != "en")
    filled.replace(tag, language_mark.size(), "<html lang=\"" + language + "\">");
  return filled;
}

void write_page(const std::string& data, const std::string& bundle, const std::string& path,
                const std::string& language) {
  replace_file(path, make_page(data, bundle, language));
}

}  // namespace topple::record
