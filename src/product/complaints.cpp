#include "product/complaints.h"

#include <algorithm>

namespace topple::product {

void Complaints::error(const char* code, Place place, std::string message, std::string help) {
  if (is_full()) return;
  ++errors_;
  add(Severity::Error, code, place, std::move(message), std::move(help));
}

void Complaints::warn(const char* code, Place place, std::string message, std::string help) {
  if (warnings_ >= most) return;
  ++warnings_;
  add(Severity::Warning, code, place, std::move(message), std::move(help));
}

void Complaints::take_back(Place place, const std::string& message) {
  const auto it = std::find_if(all_.begin(), all_.end(), [&](const Diagnostic& d) {
    return d.severity == Severity::Error && d.where.line == place.line && d.where.column == place.column &&
           d.message == message;
  });
  if (it == all_.end()) return;
  all_.erase(it);
  --errors_;
}

void Complaints::add(Severity severity, const char* code, Place place, std::string message, std::string help) {
  all_.push_back({severity, code, position(place), std::max(place.width, 1), std::move(message), std::move(help)});
}

void Complaints::sort() {
  std::stable_sort(all_.begin(), all_.end(), [](const Diagnostic& a, const Diagnostic& b) {
    return a.where.line != b.where.line ? a.where.line < b.where.line : a.where.column < b.where.column;
  });
}

std::string did_you_mean(const std::string& word, const std::vector<std::string>& known, std::string otherwise) {
  if (word.size() > 60) return otherwise;
  const std::string near = nearest_name(word, known);
  return near.empty() ? otherwise : "did you mean " + quoted(near) + "?";
}

std::string list_of(const std::vector<std::string>& names) {
  constexpr size_t most = 12;
  std::string list;
  for (size_t i = 0; i < names.size() && i < most; ++i) list += (i ? ", " : "") + names[i];
  if (names.size() > most) list += ", and " + std::to_string(names.size() - most) + " more";
  return list;
}

std::string quoted(const std::string& word) {
  constexpr size_t longest = 60;
  std::string text = word;
  if (text.size() > longest) {
    size_t end = longest;
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xC0) == 0x80) --end;
    text = text.substr(0, end) + "...";
  }
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
  return '"' + text + '"';
}

}  // namespace topple::product
