#include "product/step_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "base/error.h"
#include "base/utf8.h"

namespace topple::product {

namespace {

constexpr int deepest = 64;

/// \X2\00E4\X0\, \X4\...\X0\, \X\E4, \S\d. Old files hold bytes of ISO 8859-1.
std::string decode(std::string raw) {
  if (!is_utf8(raw)) raw = latin1_to_utf8(raw);
  std::string out;
  const auto hex = [&raw](size_t at, size_t digits) {
    return static_cast<std::uint32_t>(std::strtoul(raw.substr(at, digits).c_str(), nullptr, 16));
  };
  for (size_t i = 0; i < raw.size();) {
    const size_t width = raw.compare(i, 4, "\\X2\\") == 0 ? 4 : raw.compare(i, 4, "\\X4\\") == 0 ? 8 : 0;
    if (width > 0) {
      for (i += 4; i + width <= raw.size() && raw[i] != '\\'; i += width) {
        std::uint32_t c = hex(i, width);
        // two halves of UTF-16 are one character
        if (width == 4 && (c & 0xFC00) == 0xD800 && i + 8 <= raw.size() && (hex(i + 4, 4) & 0xFC00) == 0xDC00) {
          c = 0x10000 + ((c & 0x3FF) << 10 | (hex(i + 4, 4) & 0x3FF));
          i += 4;
        }
        append_utf8(out, c);
      }
      i = std::min(raw.size(), raw.compare(i, 4, "\\X0\\") == 0 ? i + 4 : i + 1);
    } else if (raw.compare(i, 3, "\\X\\") == 0 && i + 5 <= raw.size()) {
      append_utf8(out, hex(i + 3, 2));
      i += 5;
    } else if (raw.compare(i, 3, "\\S\\") == 0 && i + 4 <= raw.size()) {
      append_utf8(out, static_cast<unsigned char>(raw[i + 3]) + 128U);
      i += 4;
    } else {
      out += raw[i++];
    }
  }
  return out;
}

class Parser {
 public:
  Parser(const std::string& text, const std::string& name) : text_(text), name_(name) {}

  StepFile read() {
    StepFile file;
    at_ = text_.size() - without_mark(text_).size();
    skip();
    if (text_.compare(at_, 12, "ISO-10303-21") != 0)
      fail("is no STEP file: it does not begin with ISO-10303-21", "give an IFC file in STEP form (.ifc)");
    skip_statement();
    while (!read_header_statement(file)) {}
    do read_section(file);
    while (text_.compare(at_, 4, "DATA") == 0 && read_header_statement(file));
    return file;
  }

 private:
  /// Up to behind its end.
  void read_section(StepFile& file) {
    for (skip(); at_ < text_.size() && text_[at_] == '#'; skip()) {
      StepEntity e;
      for (; counted_ < at_; ++counted_) {
        if (text_[counted_] == '\n') {
          ++line_, column_ = 1;
        } else if ((static_cast<unsigned char>(text_[counted_]) & 0xC0) != 0x80) {
          ++column_;
        }
      }
      e.line = line_, e.column = column_;
      e.id = read_id();
      if (const StepEntity* first = file.find(e.id)) {
        at_ = counted_;
        fail("#" + std::to_string(e.id) + " is given twice, first in line " + std::to_string(first->line),
             "every entity has an id of its own");
      }
      skip();
      expect('=');
      skip();
      e.type = read_name();
      skip();
      e.arguments = read_list(0);
      skip();
      expect(';');
      const int id = e.id;
      file.entities[id] = std::move(e);
    }
    if (text_.compare(at_, 6, "ENDSEC") != 0)
      fail("an entity such as #12=IFCCOLUMN(...); is wanted",
           "the data end with ENDSEC; the file may have been cut off");
    at_ += 6;
    skip();
    if (at_ < text_.size() && peek() == ';') ++at_;
    skip();
  }
  /// One statement in front of the data: what it says of the schema; true if the data begin behind it.
  bool read_header_statement(StepFile& file) {
    skip();
    if (at_ >= text_.size())
      fail("has no DATA section", "the file was cut off, or is no IFC file in STEP form (.ifc); export it again");
    const std::string name = std::isalpha(static_cast<unsigned char>(peek())) != 0 ? read_name() : std::string();
    skip();
    if (name == "FILE_SCHEMA") {
      const std::vector<StepValue> schemas = read_list(0);
      if (!schemas.empty() && !schemas[0].items.empty()) file.schema = schemas[0].items[0].text;
    } else if (name == "DATA") {
      if (peek() == '(') read_list(0);
      skip();
      expect(';');
      return true;
    }
    skip_statement();
    return false;
  }
  /// To behind the next semicolon outside of texts and remarks.
  void skip_statement() {
    for (skip(); at_ < text_.size(); skip()) {
      const char c = text_[at_++];
      if (c == ';') return;
      if (c == '\'') at_ = std::min(text_.find('\'', at_), text_.size() - 1) + 1;
    }
  }
  [[noreturn]] void fail(const std::string& what,
                         const std::string& help = "the file is damaged here, or was edited; export it again") const {
    const int line =
        1 + static_cast<int>(std::count(
                text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, text_.size())), '\n'));
    throw InputError(std::vector<Diagnostic>{{Severity::Error, "E111", {name_, line, find_column()}, 1, what, help}});
  }
  /// Of the place, in characters.
  int find_column() const {
    const size_t at = std::min(at_, text_.size());
    size_t from = at == 0 ? std::string::npos : text_.rfind('\n', at - 1);
    from = from == std::string::npos ? 0 : from + 1;
    return 1 + static_cast<int>(count_characters(text_.substr(from, at - from)));
  }
  void skip() {
    while (at_ < text_.size()) {
      if (std::isspace(static_cast<unsigned char>(text_[at_])) != 0) {
        ++at_;
      } else if (text_.compare(at_, 2, "/*") == 0) {
        const size_t end = text_.find("*/", at_ + 2);
        at_ = end == std::string::npos ? text_.size() : end + 2;
      } else {
        break;
      }
    }
  }
  char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
  void expect(char c) {
    if (peek() != c) fail(std::string("\"") + c + "\" is wanted here");
    ++at_;
  }
  int read_id() {
    expect('#');
    const size_t from = at_;
    while (std::isdigit(static_cast<unsigned char>(peek())) != 0) ++at_;
    if (at_ == from || at_ - from > 9) fail("a number is wanted behind #");
    return std::atoi(text_.substr(from, at_ - from).c_str());
  }
  std::string read_name() {
    std::string out;
    while (std::isalnum(static_cast<unsigned char>(peek())) != 0 || peek() == '_')
      out += static_cast<char>(std::toupper(static_cast<unsigned char>(text_[at_++])));
    if (out.empty()) fail("the name of a type is wanted");
    return out;
  }
  std::vector<StepValue> read_list(int depth) {
    if (depth > deepest) fail("is nested too deeply");
    expect('(');
    std::vector<StepValue> items;
    for (skip(); peek() != ')'; skip()) {
      if (!items.empty()) expect(',');
      items.push_back(read_value(depth));
    }
    ++at_;
    return items;
  }
  StepValue read_value(int depth) {
    StepValue v;
    skip();
    const char c = peek();
    if (c == '$' || c == '*') {
      ++at_;
    } else if (c == '#') {
      v.kind = StepValue::Kind::Reference;
      v.number = read_id();
    } else if (c == '\'') {
      v.kind = StepValue::Kind::Text;
      std::string raw;
      for (++at_;; ++at_) {
        if (at_ >= text_.size()) fail("a text has no end", "close it with '; the file may have been cut off");
        if (text_[at_] == '\'') {
          if (at_ + 1 < text_.size() && text_[at_ + 1] == '\'') {
            ++at_;
          } else {
            break;
          }
        }
        raw += text_[at_];
      }
      ++at_;
      v.text = decode(raw);
    } else if (c == '.' &&
               std::isalpha(static_cast<unsigned char>(at_ + 1 < text_.size() ? text_[at_ + 1] : ' ')) != 0) {
      ++at_;
      v.kind = StepValue::Kind::Word;
      v.text = read_name();
      expect('.');
    } else if (c == '"') {  // bits
      const size_t end = text_.find('"', at_ + 1);
      if (end == std::string::npos) fail("bits have no end");
      at_ = end + 1;
    } else if (c == '(') {
      v.kind = StepValue::Kind::List;
      v.items = read_list(depth + 1);
    } else if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
      std::string type = read_name();
      skip();
      std::vector<StepValue> inner = read_list(depth + 1);
      if (inner.size() == 1) {
        if (inner[0].kind == StepValue::Kind::List) inner[0].text = std::move(type);
        return std::move(inner[0]);
      }
      v.kind = StepValue::Kind::List;
      v.items = std::move(inner);
    } else {
      const char* from = text_.c_str() + at_;
      char* end = nullptr;
      v.kind = StepValue::Kind::Number;
      v.number = std::strtod(from, &end);
      if (end == from) fail("a value is wanted here");
      if (!std::isfinite(v.number)) fail("a number is out of range", "numbers below 1.8e308 in size");
      at_ += static_cast<size_t>(end - from);
    }
    return v;
  }

  const std::string& text_;
  const std::string& name_;
  size_t at_ = 0;
  size_t counted_ = 0;  // up to there lines and columns are
  int line_ = 1, column_ = 1;
};

}  // namespace

const StepValue& StepEntity::at(size_t i) const {
  static const StepValue null;
  return i < arguments.size() ? arguments[i] : null;
}

const StepEntity* StepFile::find(int id) const {
  const auto at = entities.find(id);
  return at == entities.end() ? nullptr : &at->second;
}

std::vector<const StepEntity*> StepFile::of_type(const std::string& type) const {
  std::vector<const StepEntity*> out;
  for (const auto& [id, e] : entities)
    if (e.type == type) out.push_back(&e);
  return out;
}

StepFile read_step(const std::string& text, const std::string& name) { return Parser(text, name).read(); }

}  // namespace topple::product
