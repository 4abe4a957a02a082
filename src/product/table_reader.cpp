#include "product/table_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "base/utf8.h"

namespace topple::product {

namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr size_t longest_text = 200;
constexpr size_t most_words = 1000;

/// The unit in which people think of the dimension, and its size in SI.
std::pair<const char*, double> usual_unit(Dimension dimension) {
  switch (dimension) {
    case Dimension::Number:
      return {"", 1};
    case Dimension::Length:
      return {"m", 1};
    case Dimension::Area:
      return {"cm2", unit::cm2};
    case Dimension::AreaPerLength:
      return {"cm2/m", unit::cm2};
    case Dimension::Time:
      return {"s", 1};
    case Dimension::Mass:
      return {"kg", 1};
    case Dimension::Force:
      return {"kN", unit::kN};
    case Dimension::AreaLoad:
      return {"kN/m2", unit::kPa};
    case Dimension::Stress:
      return {"N/mm2", unit::MPa};
    case Dimension::Density:
      return {"kg/m3", 1};
    case Dimension::Energy:
      return {"J", 1};
    case Dimension::EnergyPerArea:
      return {"N/m", 1};
    case Dimension::Velocity:
      return {"mm/s", unit::mm};
    case Dimension::Acceleration:
      return {"m/s2", 1};
    case Dimension::Angle:
      return {"deg", unit::deg};
    case Dimension::Frequency:
      return {"Hz", 1};
    case Dimension::StiffnessPerLength:
      return {"kN/m", unit::kN};
    case Dimension::Moment:
      return {"kNm", unit::kNm};
  }
  return {"", 1};
}

std::string number_text(double value) {
  char buffer[40];
  std::snprintf(buffer, sizeof buffer, "%.6g", value);
  return buffer;
}

std::string example_of(Dimension dimension) {
  switch (dimension) {
    case Dimension::Number:
      return "0.5";
    case Dimension::Length:
      return "\"3 m\"";
    case Dimension::Area:
      return "\"64 cm2\"";
    case Dimension::AreaPerLength:
      return "\"5 cm2/m\"";
    case Dimension::Time:
      return "\"250 ms\"";
    case Dimension::Stress:
      return "\"25 N/mm2\"";
    default:
      return "\"1 " + std::string(usual_unit(dimension).first) + "\"";
  }
}

std::string unit_help(Dimension dimension) {
  if (dimension == Dimension::Number) return "write a plain number, or a percentage such as \"50 %\"";
  return "write it as a string with a unit, such as " + example_of(dimension) + "; units: " + units_of(dimension);
}

}  // namespace

bool is_within(double value, const Range& range) {
  return (range.above_low ? value > range.low : value >= range.low) && value <= range.high;
}

std::string describe(const Range& range, Dimension dimension, const std::string& written) {
  auto [name, size] = usual_unit(dimension);
  // where the usual one gives fractions, that which stands behind the number
  const size_t at = std::min(written.find_first_not_of("+-.0123456789eE \t"), written.size());
  const std::string own = written.substr(at);
  if (const Quantity one = parse_quantity("1 " + own, dimension); !own.empty() && one.value && range.high < size)
    name = own.c_str(), size = *one.value;
  const std::string tail = *name ? std::string(" ") + name : "";
  const std::string high = number_text(range.high / size) + tail;
  if (range.above_low) return "above " + number_text(range.low / size) + ", at most " + high;
  return "between " + number_text(range.low / size) + " and " + high;
}

namespace {

/// The usual example, or where that is not allowed one with a single digit from within what is.
std::string example_of(Dimension dimension, const Range& range) {
  std::string usual = example_of(dimension);
  const auto value =
      dimension == Dimension::Number ? 0.5 : parse_quantity(usual.substr(1, usual.size() - 2), dimension).value;
  if (value && is_within(*value, range)) return usual;
  const auto [name, size] = usual_unit(dimension);
  const double middle = (range.low > 0 ? std::sqrt(range.low * range.high) : 0.05 * range.high) / size;
  const double digit = std::pow(10, std::floor(std::log10(middle)));
  const std::string text = number_text(std::round(middle / digit) * digit);
  return *name ? "\"" + text + " " + name + "\"" : text;
}

/// NaN after a complaint.
double read_value(const Node& node, const std::string& label, Dimension dimension, Range range,
                  Complaints& complaints) {
  double value = nan;
  std::string written;
  if (node.kind == Node::Kind::String) {
    const Quantity quantity = parse_quantity(node.text, dimension);
    if (!quantity.value) {
      complaints.error("E204", node.place, label + ": " + quantity.problem, unit_help(dimension));
      return nan;
    }
    value = *quantity.value;
    written = quoted(node.text);
    // samples are written in SI, to the last digit
    constexpr size_t longest_by_hand = 20;
    const bool is_sample = node.text.size() > longest_by_hand || node.text.ends_with(" Pa") || node.text.ends_with(' ');
    if (const auto [unit, size] = usual_unit(dimension); is_sample)
      written = *unit ? quoted(number_text(value / size) + " " + unit) : number_text(value);
  } else if (node.kind == Node::Kind::Integer || node.kind == Node::Kind::Float) {
    if (dimension != Dimension::Number) {
      complaints.error("E204", node.place,
                       label + ": a bare number has no unit; a " + name_of(dimension) + " is wanted",
                       unit_help(dimension));
      return nan;
    }
    if (!std::isfinite(node.number)) {
      complaints.error("E204", node.place, label + ": is not a finite number");
      return nan;
    }
    value = node.number;
    written = number_text(value);
  } else {
    complaints.error("E202", node.place,
                     label + ": is " + name_of(node.kind) + "; a " + name_of(dimension) + " is wanted",
                     unit_help(dimension));
    return nan;
  }
  if (!is_within(value, range)) {
    complaints.error(
        "E205", node.place, label + ": " + written + " is out of range",
        "allowed: " + describe(range, dimension, node.kind == Node::Kind::String ? node.text : std::string()) +
            (dimension == Dimension::Number && range.high == 1 && value > 1 && value <= 100 &&
                     node.kind != Node::Kind::String
                 ? "; a percentage is written \"" + number_text(value) + " %\""
                 : ""));
    return nan;
  }
  return value;
}

}  // namespace

double read_quantity(const Node& node, const std::string& label, Dimension dimension, Range range,
                     Complaints& complaints) {
  const double value = read_value(node, label, dimension, range, complaints);
  if (complaints.asked) complaints.asked->push_back({&node, nullptr, {}, dimension, value});
  return value;
}

TableReader::TableReader(const Node& node, std::string label, Complaints& complaints)
    : node_(node), label_(std::move(label)), complaints_(complaints), is_table_(node.kind == Node::Kind::Table) {
  if (!is_table_) complaints_.error("E202", node.place, label_ + ": is " + name_of(node.kind) + "; a table is wanted");
}

const Node* TableReader::find(const std::string& key) {
  known_.push_back(key);
  const Entry* entry = node_.find(key);
  return entry ? &entry->value : nullptr;
}

Place TableReader::place_of(const std::string& key) const {
  const Entry* entry = node_.find(key);
  return entry ? entry->value.place : node_.place;
}

void TableReader::error(const char* code, Place place, const std::string& message, std::string help) const {
  complaints_.error(code, place, label_.empty() ? message : label_ + ": " + message, std::move(help));
}

std::string TableReader::words_of_missing(const std::string& key) const {
  return (label_.empty() ? "missing table " : "missing key ") + quoted(key);
}

void TableReader::missing(const std::string& key, const std::string& help) const {
  if (!is_table_) return;
  error("E201", node_.place, words_of_missing(key), help);
  missing_.push_back(key);
}

double TableReader::quantity(const std::string& key, Dimension dimension, Range range) {
  const Node* node = find(key);
  if (!node) {
    missing(key, "add a line such as " + key + " = " + example_of(dimension, range));
    return nan;
  }
  return read_quantity(*node, label_ + ": " + key, dimension, range, complaints_);
}

double TableReader::quantity(const std::string& key, Dimension dimension, Range range, double fallback) {
  const double value = find_quantity(key, dimension, range).value_or(fallback);
  if (complaints_.asked && !has(key)) complaints_.asked->back().value = fallback;
  return value;
}

std::optional<double> TableReader::find_quantity(const std::string& key, Dimension dimension, Range range) {
  const Node* node = find(key);
  if (node) return read_quantity(*node, label_ + ": " + key, dimension, range, complaints_);
  if (complaints_.asked) complaints_.asked->push_back({nullptr, &node_, key, dimension, nan});
  return std::nullopt;
}

std::string TableReader::text(const std::string& key) {
  if (!has(key)) {
    find(key);
    missing(key, "add a line such as " + key + " = \"...\"");
    return {};
  }
  return text(key, {});
}

std::string TableReader::text(const std::string& key, std::string fallback) {
  const Node* node = find(key);
  if (!node) return fallback;
  if (node->kind != Node::Kind::String) {
    error("E202", node->place, key + ": is " + name_of(node->kind) + "; a string is wanted");
    return {};
  }
  if (node->text.empty() || count_characters(node->text) > longest_text) {
    error("E205", node->place, key + (node->text.empty() ? ": is empty" : ": is too long"),
          "allowed: 1 to " + std::to_string(longest_text) + " characters");
    return {};
  }
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
  if (std::any_of(node->text.begin(), node->text.end(), is_control)) {
    error("E205", node->place, key + ": holds a control character, such as a line break", "one line of text");
    return {};
  }
  return node->text;
}

std::optional<std::string> TableReader::find_choice(const std::string& key, const std::vector<std::string>& choices) {
  const Node* node = find(key);
  if (!node) return std::nullopt;
  if (node->kind != Node::Kind::String) {
    error("E202", node->place, key + ": is " + name_of(node->kind) + "; a string is wanted",
          "one of " + list_of(choices));
    return std::nullopt;
  }
  for (const std::string& choice : choices)
    if (choice == node->text) return choice;
  error("E206", node->place, key + ": " + quoted(node->text) + " is not one of " + list_of(choices),
        did_you_mean(node->text, choices));
  return std::nullopt;
}

std::optional<bool> TableReader::find_flag(const std::string& key) {
  const Node* node = find(key);
  if (!node) return std::nullopt;
  if (node->kind != Node::Kind::Boolean) {
    error("E202", node->place, key + ": is " + name_of(node->kind) + "; true or false is wanted",
          "written without quotes");
    return std::nullopt;
  }
  return node->boolean;
}

std::optional<std::int64_t> TableReader::find_integer(const std::string& key, std::int64_t low, std::int64_t high) {
  const Node* node = find(key);
  if (!node) return std::nullopt;
  if (node->kind != Node::Kind::Integer) {
    error("E202", node->place, key + ": is " + name_of(node->kind) + "; a whole number is wanted",
          "written without quotes and unit");
    return std::nullopt;
  }
  if (node->integer < low || node->integer > high) {
    error("E205", node->place, key + ": " + std::to_string(node->integer) + " is out of range",
          "allowed: between " + std::to_string(low) + " and " + std::to_string(high));
    return std::nullopt;
  }
  return node->integer;
}

std::int64_t TableReader::integer(const std::string& key, std::int64_t low, std::int64_t high) {
  if (!has(key)) missing(key, "add a line such as " + key + " = " + std::to_string(low));
  return find_integer(key, low, high).value_or(low);
}

std::vector<Word> TableReader::words(const std::string& key) {
  const Node* node = find(key);
  std::vector<Word> list;
  const auto add = [&](const Node& item) {
    if (item.text.empty() || item.text.size() > longest_text) {
      error("E205", item.place, key + (item.text.empty() ? ": holds an empty string" : ": holds a very long string"),
            "allowed: 1 to " + std::to_string(longest_text) + " characters");
    } else {
      list.push_back({item.text, item.place});
    }
  };
  if (!node) return list;
  if (node->kind == Node::Kind::String) {
    add(*node);
    return list;
  }
  if (node->kind != Node::Kind::Array) {
    error("E202", node->place, key + ": is " + name_of(node->kind) + "; a string or a list of strings is wanted");
    return list;
  }
  if (node->items.size() > most_words) {
    error("E209", node->place, key + ": holds " + std::to_string(node->items.size()) + " strings",
          "allowed: at most " + std::to_string(most_words));
    return list;
  }
  for (const Node& item : node->items) {
    if (item.kind == Node::Kind::String) {
      add(item);
    } else {
      error("E202", item.place, key + ": holds " + name_of(item.kind) + "; strings are wanted");
    }
  }
  return list;
}

std::vector<Word> TableReader::required_words(const std::string& key, const std::string& example) {
  const int errors_before = complaints_.error_count();
  std::vector<Word> list = words(key);
  if (!has(key)) {
    missing(key, "add a line such as " + key + " = " + example);
  } else if (list.empty() && complaints_.error_count() == errors_before) {
    error("E205", place_of(key), key + ": is an empty list", "write " + key + " = " + example);
  }
  return list;
}

std::vector<const Node*> TableReader::tables(const std::string& key) {
  const Node* node = find(key);
  std::vector<const Node*> list;
  if (!node) return list;
  if (node->kind != Node::Kind::Array) {
    const std::string header = "[[" + (label_.empty() ? "" : label_.substr(0, label_.find('[')) + ".") + key + "]]";
    error("E202", node->place, key + ": is " + name_of(node->kind) + "; a list of tables is wanted",
          "write it with double brackets: " + header);
    return list;
  }
  for (const Node& item : node->items) {
    if (item.kind == Node::Kind::Table) {
      list.push_back(&item);
    } else {
      error("E202", item.place, key + ": holds " + name_of(item.kind) + "; tables are wanted");
    }
  }
  return list;
}

const Node* TableReader::table(const std::string& key) {
  const Node* node = find(key);
  if (!node) return nullptr;
  if (node->kind == Node::Kind::Table) return node;
  error("E202", node->place, key + ": is " + name_of(node->kind) + "; a table is wanted");
  return nullptr;
}

void TableReader::finish() const {
  for (const Entry& entry : node_.entries) {
    if (complaints_.is_full()) return;
    bool is_known = false;
    for (const std::string& key : known_) is_known = is_known || key == entry.key;
    if (is_known) continue;
    error("E203", entry.place, "unknown key " + quoted(entry.key),
          did_you_mean(entry.key, known_, "known here: " + list_of(known_)));
    // the one that is missing is here, misspelt
    if (const std::string near = nearest_name(entry.key, missing_); !near.empty())
      complaints_.take_back(node_.place, (label_.empty() ? "" : label_ + ": ") + words_of_missing(near));
  }
}

}  // namespace topple::product
