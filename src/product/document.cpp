#include "product/document.h"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace {
/// A demand inside the parser that does not hold: hostile text reaches some of them.
struct ParserDoubt {};
[[noreturn]] void throw_doubt() { throw ParserDoubt{}; }
}  // namespace

// The parser is compiled here and not taken from Debian's shared library, which was built to take its demands for
// granted and to nest much deeper. With NDEBUG the demands would become assumptions of the compiler; here they stay and
// throw.
#undef TOML_SHARED_LIB
#undef TOML_HEADER_ONLY
#define TOML_HEADER_ONLY 1
#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_ASSERT(expression) ((expression) ? void(0) : throw_doubt())
// deeper nesting than any plan has; bounds the recursion of the parser and of the tree's destructor
#define TOML_MAX_NESTED_VALUES 16
#define TOML_ENABLE_FORMATTERS 0
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#include <toml++/toml.h>
#pragma GCC diagnostic pop
#pragma pop_macro("NDEBUG")

namespace topple::product {

namespace {

constexpr int deepest_key = 16;

[[noreturn]] void fail(const std::string& file, std::string code, Place place, std::string message, std::string help) {
  throw InputError(std::vector<Diagnostic>{{Severity::Error,
                                            std::move(code),
                                            {file, std::max(place.line, 1), std::max(place.column, 1)},
                                            std::max(place.width, 1),
                                            std::move(message),
                                            std::move(help)}});
}

/// The first byte of a character.
bool is_lead(char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }

/// Length of the well-formed UTF-8 sequence at the front of `text`, 0 if there is none.
size_t sequence_length(std::string_view text) {
  const auto byte = [&](size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u; };
  const auto follows = [&](size_t i, unsigned low, unsigned high) { return byte(i) >= low && byte(i) <= high; };
  const unsigned lead = byte(0);
  if (lead < 0x80) return 1;
  if (lead >= 0xC2 && lead <= 0xDF) return follows(1, 0x80, 0xBF) ? 2 : 0;
  if (lead >= 0xE0 && lead <= 0xEF) {
    const unsigned low = lead == 0xE0 ? 0xA0 : 0x80, high = lead == 0xED ? 0x9F : 0xBF;
    return follows(1, low, high) && follows(2, 0x80, 0xBF) ? 3 : 0;
  }
  if (lead >= 0xF0 && lead <= 0xF4) {
    const unsigned low = lead == 0xF0 ? 0x90 : 0x80, high = lead == 0xF4 ? 0x8F : 0xBF;
    return follows(1, low, high) && follows(2, 0x80, 0xBF) && follows(3, 0x80, 0xBF) ? 4 : 0;
  }
  return 0;
}

void check_encoding(const std::string& text, const std::string& file) {
  Place place;
  for (size_t i = 0; i < text.size();) {
    const size_t length = sequence_length(std::string_view(text).substr(i, 4));
    if (length == 0) fail(file, "E103", place, "the text is not UTF-8 here", "save the plan as UTF-8 text");
    if (text[i] == '\0') fail(file, "E103", place, "a zero byte: this is not a text file", "a plan is a TOML text");
    if (text[i] == '\n') {
      ++place.line, place.column = 1;
    } else {
      ++place.column;
    }
    i += length;
  }
}

/// Refuses keys with very many dots: the parser builds one table in another for each of them.
void check_key_depth(const std::string& text, const std::string& file) {
  Place place;
  int dots = 0;
  char quote = 0;      // the open string's delimiter
  bool block = false;  // the open string has three of them
  for (size_t i = 0; i < text.size(); ++i, ++place.column) {
    const char c = text[i];
    if (!is_lead(c)) --place.column;
    const auto three = [&](char q) { return text.compare(i, 3, std::string(3, q)) == 0; };
    if (c == '\n') {
      ++place.line, place.column = 0, dots = 0;
      if (!block) quote = 0;
    } else if (quote != 0) {
      if (c == '\\' && quote == '"') {
        if (i + 1 < text.size() && text[i + 1] != '\n') ++i, ++place.column;
      } else if (c == quote && (!block || three(quote))) {
        // up to two more quotes before a block's end belong to its text
        while (block && i + 3 < text.size() && text[i + 3] == c) ++i, ++place.column;
        if (block) i += 2, place.column += 2;
        quote = 0, block = false;
      }
    } else if (c == '"' || c == '\'') {
      quote = c, block = three(c);
      if (block) i += 2, place.column += 2;
    } else if (c == '#') {
      while (i + 1 < text.size() && text[i + 1] != '\n') ++i;
    } else if (c == '=' || c == ',' || c == '[' || c == ']' || c == '{' || c == '}') {
      dots = 0;
    } else if (c == '.' && ++dots > deepest_key) {
      fail(file, "E105", place, "nested deeper than " + std::to_string(deepest_key) + " levels", "");
    }
  }
}

/// "Error while parsing array: expected ..." without the parser's preface.
std::string plain_message(const std::string& message) {
  constexpr std::string_view preface = "Error while parsing ";
  if (!message.starts_with(preface)) return message;
  const size_t colon = message.find(": ");
  return colon == std::string::npos ? message : message.substr(colon + 2);
}

Place place_of(const toml::source_region& region) {
  Place place{static_cast<int>(region.begin.line), static_cast<int>(region.begin.column), 1};
  if (region.end.line == region.begin.line && region.end.column > region.begin.column)
    place.width = static_cast<int>(region.end.column - region.begin.column);
  place.line = std::max(place.line, 1);
  place.column = std::max(place.column, 1);
  return place;
}

Node make_node(const toml::node& from) {
  Node to;
  to.place = place_of(from.source());
  switch (from.type()) {
    case toml::node_type::string:
      to.kind = Node::Kind::String;
      to.text = from.as_string()->get();
      break;
    case toml::node_type::integer:
      to.kind = Node::Kind::Integer;
      to.integer = from.as_integer()->get();
      to.number = static_cast<double>(to.integer);
      break;
    case toml::node_type::floating_point:
      to.kind = Node::Kind::Float;
      to.number = from.as_floating_point()->get();
      break;
    case toml::node_type::boolean:
      to.kind = Node::Kind::Boolean;
      to.boolean = from.as_boolean()->get();
      break;
    case toml::node_type::array:
      to.kind = Node::Kind::Array;
      to.items.reserve(from.as_array()->size());
      for (const toml::node& item : *from.as_array()) to.items.push_back(make_node(item));
      break;
    case toml::node_type::table: {
      to.kind = Node::Kind::Table;
      to.entries.reserve(from.as_table()->size());
      for (auto&& [key, value] : *from.as_table())
        to.entries.push_back({std::string(key.str()), place_of(key.source()), make_node(value)});
      std::sort(to.entries.begin(), to.entries.end(), [](const Entry& a, const Entry& b) {
        return a.place.line != b.place.line ? a.place.line < b.place.line : a.place.column < b.place.column;
      });
      break;
    }
    default:
      to.kind = Node::Kind::Date;
      break;
  }
  return to;
}

/// Where the doubled key begins: the parser points behind the '='.
Place place_of_doubled_key(const std::string& text, Place at, const std::string& message) {
  const size_t close = message.rfind('\'');
  const size_t open = close == std::string::npos || close == 0 ? std::string::npos : message.rfind('\'', close - 1);
  if (open == std::string::npos) return at;
  const std::string key = message.substr(open + 1, close - open - 1);
  size_t begin = 0;
  for (int line = 1; line < at.line; ++line) {
    begin = text.find('\n', begin);
    if (begin == std::string::npos) return at;
    ++begin;
  }
  size_t end = begin;
  for (int column = 1; end < text.size() && text[end] != '\n'; ++end)
    if (is_lead(text[end]) && column++ == at.column) break;
  if (end < text.size() && text[end] == '[') {  // a table: its header
    const size_t close_bracket = text.rfind(']', std::min(text.find_first_of("#\n", end), text.size() - 1));
    if (close_bracket != std::string::npos && close_bracket > end)
      at.width =
          static_cast<int>(std::count_if(text.begin() + static_cast<std::ptrdiff_t>(end),
                                         text.begin() + static_cast<std::ptrdiff_t>(close_bracket) + 1, is_lead));
    return at;
  }
  const size_t found = std::string_view(text).substr(begin, end - begin).rfind(key);
  if (key.empty() || found == std::string_view::npos) return at;
  const auto count = [&](size_t from, size_t to) {
    return static_cast<int>(std::count_if(text.begin() + static_cast<std::ptrdiff_t>(from),
                                          text.begin() + static_cast<std::ptrdiff_t>(to), is_lead));
  };
  return {at.line, 1 + count(begin, begin + found), count(begin + found, begin + found + key.size())};
}

/// The line that gave the parser its doubt: the first line whose end makes the text up to there doubtful.
Place find_doubtful_line(std::string_view text) {
  std::vector<size_t> ends;  // behind each line
  for (size_t i = 0; i < text.size(); ++i)
    if (text[i] == '\n') ends.push_back(i + 1);
  ends.push_back(text.size());
  const auto is_clear = [&](size_t end) {
    try {
      static_cast<void>(toml::parse(text.substr(0, end)));
    } catch (const toml::parse_error&) {
    } catch (const ParserDoubt&) { return false; }
    return true;
  };
  const auto at = std::min(std::partition_point(ends.begin(), ends.end(), is_clear), ends.end() - 1);
  const size_t begin = at == ends.begin() ? 0 : *(at - 1);
  const std::string_view line = text.substr(begin, *at - begin);
  const size_t first = std::min(line.find_first_not_of(" \t"), line.size());
  return {static_cast<int>(at - ends.begin()) + 1, static_cast<int>(first == line.size() ? 0 : first) + 1, 1};
}

/// A place in the text: the parser counts one too many behind the text's end.
Place clamp_to_text(Place place, const std::string& text) {
  int line = 1, column = 1;
  for (size_t i = 0; i < text.size() && line < place.line; ++i) line += text[i] == '\n';
  place.line = line;
  size_t begin = 0;
  for (int i = 1; i < line; ++i) begin = text.find('\n', begin) + 1;
  for (size_t i = begin; i < text.size() && text[i] != '\n'; ++i) column += is_lead(text[i]);
  place.column = std::min(place.column, column);
  return place;
}

}  // namespace

const Entry* Node::find(const std::string& key) const {
  for (const Entry& entry : entries)
    if (entry.key == key) return &entry;
  return nullptr;
}

std::string name_of(Node::Kind kind) {
  switch (kind) {
    case Node::Kind::String:
      return "a string";
    case Node::Kind::Integer:
    case Node::Kind::Float:
      return "a number";
    case Node::Kind::Boolean:
      return "true or false";
    case Node::Kind::Date:
      return "a date or time";
    case Node::Kind::Array:
      return "a list";
    case Node::Kind::Table:
      return "a table";
  }
  return "a value";
}

Node parse_document(const std::string& text, const std::string& file) {
  if (text.find_first_not_of(" \t\r\n") == std::string::npos)
    fail(file, "E104", {}, "the plan is empty", "`topple new` writes a commented plan to begin with");
  check_encoding(text, file);
  check_key_depth(text, file);
  try {
    const toml::table root = toml::parse(std::string_view(text));
    Node node = make_node(root);
    node.place = {};
    return node;
  } catch (const toml::parse_error& error) {
    const std::string message = plain_message(std::string(error.description()));
    Place place = clamp_to_text(place_of(error.source()), text);
    place.width = 1;
    if (message.find("cannot redefine existing") != std::string::npos) {
      place = place_of_doubled_key(text, place, message);
      fail(file, "E102", place, "duplicate key: " + message, "each key and each table can be given once");
    }
    if (message.find("TOML_MAX_NESTED_VALUES") != std::string::npos)
      fail(file, "E105", place, "nested deeper than " + std::to_string(deepest_key) + " levels", "");
    const bool is_behind_value = message.starts_with("expected a comment or whitespace");
    fail(file, "E101", place, message,
         is_behind_value ? "a value with a unit is a string in quotes, such as \"3.14 m\"" : "");
  } catch (const ParserDoubt&) { fail(file, "E101", find_doubtful_line(text), "this line is not TOML", ""); }
}

}  // namespace topple::product
