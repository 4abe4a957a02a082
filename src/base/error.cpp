#include "base/error.h"

#include <algorithm>

namespace topple {

namespace {

std::string summary_of(const std::vector<Diagnostic>& diagnostics) {
  std::string text;
  for (const auto& d : diagnostics) {
    if (!text.empty()) text += '\n';
    text += render(d, {}, false);
    if (!text.empty() && text.back() == '\n') text.pop_back();
  }
  return text;
}

/// Line number `line` (from 1) of a text, without its end.
std::string line_of(const std::string& text, int line) {
  size_t begin = 0;
  for (int i = 1; i < line; ++i) {
    begin = text.find('\n', begin);
    if (begin == std::string::npos) return {};
    ++begin;
  }
  size_t end = text.find('\n', begin);
  if (end == std::string::npos) end = text.size();
  if (end > begin && text[end - 1] == '\r') --end;
  return text.substr(begin, end - begin);
}

}  // namespace

InputError::InputError(std::vector<Diagnostic> diagnostics)
    : std::runtime_error(summary_of(diagnostics)), diagnostics_(std::move(diagnostics)) {}

InputError::InputError(std::string code, std::string message, std::string help)
    : InputError({Diagnostic{Severity::Error, std::move(code), {}, 1, std::move(message), std::move(help)}}) {}

const Diagnostic& InputError::first_error() const {
  const auto error = std::find_if(diagnostics_.begin(), diagnostics_.end(),
                                  [](const Diagnostic& d) { return d.severity == Severity::Error; });
  return error == diagnostics_.end() ? diagnostics_.front() : *error;
}

std::string render(const Diagnostic& d, const std::string& text, bool colour) {
  const bool error = d.severity == Severity::Error;
  const char* bold = colour ? "\x1b[1m" : "";
  const char* tint = colour ? (error ? "\x1b[1;31m" : "\x1b[1;33m") : "";
  const char* off = colour ? "\x1b[0m" : "";
  std::string out = bold;
  if (!d.where.file.empty()) {
    out += d.where.file;
    if (d.where.line > 0) out += ":" + std::to_string(d.where.line) + ":" + std::to_string(d.where.column);
    out += ": ";
  }
  out += std::string(off) + tint + (error ? "error " : "warning ") + d.code + off + ": " + d.message + "\n";
  if (d.where.line > 0 && d.width > 0 && !text.empty()) {
    // a line of minified or hostile input can be huge: show a window of it around the place
    constexpr size_t window = 160;
    std::string line = line_of(text, d.where.line);
    size_t column = static_cast<size_t>(std::max(d.where.column, 1)) - 1;
    // byte offset of the column (columns count code points)
    size_t offset = 0;
    for (size_t seen = 0; offset < line.size() && seen < column; ++offset)
      if ((static_cast<unsigned char>(line[offset]) & 0xC0) != 0x80) ++seen;
    while (offset < line.size() && (static_cast<unsigned char>(line[offset]) & 0xC0) == 0x80) ++offset;
    if (line.size() > window) {
      size_t from = offset > window / 2 ? offset - window / 2 : 0;
      while (from > 0 && (static_cast<unsigned char>(line[from]) & 0xC0) == 0x80) --from;
      size_t to = std::min(line.size(), from + window);
      while (to < line.size() && (static_cast<unsigned char>(line[to]) & 0xC0) == 0x80) ++to;
      line = line.substr(from, to - from);
      offset -= from;
    }
    size_t characters_before = 0;
    for (size_t i = 0; i < offset; ++i)
      if ((static_cast<unsigned char>(line[i]) & 0xC0) != 0x80) ++characters_before;
    for (char& c : line)
      if (static_cast<unsigned char>(c) < 0x20 || c == 0x7F) c = ' ';
    const std::string number = " " + std::to_string(d.where.line) + " | ";
    out += number + line + "\n";
    out += std::string(number.size() - 2, ' ') + "| " + std::string(characters_before, ' ') + tint +
           std::string(static_cast<size_t>(std::clamp(d.width, 1, 80)), '^') + off + "\n";
    if (!d.help.empty()) out += std::string(number.size() - 2, ' ') + "= help: " + d.help + "\n";
  } else if (!d.help.empty()) {
    out += "    = help: " + d.help + "\n";
  }
  return out;
}

std::string nearest_name(const std::string& word, const std::vector<std::string>& known) {
  std::string best;
  const auto small = [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; };
  const auto cost = [&](char a, char b) -> size_t { return a == b ? 0 : small(a) == small(b) ? 1 : 2; };
  // in halves
  size_t best_distance = 2 * std::max<size_t>(1, word.size() / 3) + 1;
  for (const auto& name : known) {
    if (name.size() > word.size() + best_distance / 2 || word.size() > name.size() + best_distance / 2) continue;
    // optimal string alignment: a swap of neighbours counts once
    const size_t n = word.size(), m = name.size();
    std::vector<std::vector<size_t>> d(n + 1, std::vector<size_t>(m + 1));
    for (size_t i = 0; i <= n; ++i) d[i][0] = 2 * i;
    for (size_t j = 0; j <= m; ++j) d[0][j] = 2 * j;
    for (size_t i = 1; i <= n; ++i)
      for (size_t j = 1; j <= m; ++j) {
        d[i][j] = std::min({d[i - 1][j] + 2, d[i][j - 1] + 2, d[i - 1][j - 1] + cost(word[i - 1], name[j - 1])});
        if (i > 1 && j > 1 && word[i - 1] == name[j - 2] && word[i - 2] == name[j - 1])
          d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 2);
      }
    if (d[n][m] < best_distance) {
      best_distance = d[n][m];
      best = name;
    }
  }
  return best;
}

}  // namespace topple
