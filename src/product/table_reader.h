#pragma once
/// Typed access to one table of a plan: every wrong type, unit, value and unknown key becomes a complaint.

#include <algorithm>
#include <optional>
#include <string>
#include <vector>

#include "base/unit.h"
#include "product/complaints.h"
#include "product/document.h"

namespace topple::product {

/// Allowed values in SI, both ends included unless said otherwise.
struct Range {
  double low = 0, high = 0;
  bool above_low = false;  // low itself is not allowed
};

inline constexpr Range fraction{0, 1};

bool is_within(double value, const Range&);

/// A string of the plan and its place.
struct Word {
  std::string text;
  Place place;
};

/// "between 1 and 200 N/mm2", in the units people use for the dimension; less than one of these in that of a quantity
/// as it is written.
std::string describe(const Range&, Dimension, const std::string& written = {});

class TableReader {
 public:
  /// Anything but a table is a complaint; the reader then acts like an empty table that complains no more.
  TableReader(const Node&, std::string label, Complaints&);

  const std::string& label() const { return label_; }
  Place place() const { return node_.place; }
  bool is_table() const { return is_table_; }
  bool has(const std::string& key) const { return node_.find(key) != nullptr; }
  const std::vector<Entry>& entries() const { return node_.entries; }
  /// Whether somebody has asked for the key.
  bool has_read(const std::string& key) const { return std::find(known_.begin(), known_.end(), key) != known_.end(); }
  /// The value of a key, nullptr if it is not given; from now on the key is a known one.
  const Node* find(const std::string& key);
  /// Where the key's value stands, or the table's header.
  Place place_of(const std::string& key) const;
  Complaints& complaints() const { return complaints_; }

  // A required value that is missing or wrong is a complaint and reads as NaN or empty; `find_` leaves it out silently.
  double quantity(const std::string& key, Dimension, Range);
  double quantity(const std::string& key, Dimension, Range, double fallback);
  std::optional<double> find_quantity(const std::string& key, Dimension, Range);
  std::string text(const std::string& key);
  std::string text(const std::string& key, std::string fallback);
  std::optional<std::string> find_choice(const std::string& key, const std::vector<std::string>& choices);
  std::optional<bool> find_flag(const std::string& key);
  std::optional<std::int64_t> find_integer(const std::string& key, std::int64_t low, std::int64_t high);
  std::int64_t integer(const std::string& key, std::int64_t low, std::int64_t high);
  /// A string or a list of strings; empty if not given.
  std::vector<Word> words(const std::string& key);
  /// The same, but at least one; `example` helps who forgot it.
  std::vector<Word> required_words(const std::string& key, const std::string& example);
  /// The tables of `[[key]]`, none if not given.
  std::vector<const Node*> tables(const std::string& key);
  /// The table `[key]`, nullptr if not given; a complaint if it is something else.
  const Node* table(const std::string& key);

  void error(const char* code, Place place, const std::string& message, std::string help = {}) const;
  void missing(const std::string& key, const std::string& help) const;
  /// Complains about keys that nobody asked for.
  void finish() const;

 private:
  const Node& node_;
  std::string label_;
  Complaints& complaints_;
  bool is_table_ = true;
  std::string words_of_missing(const std::string& key) const;
  std::vector<std::string> known_;
  mutable std::vector<std::string> missing_;  // complained of
};

/// One quantity out of a value that stands alone (in a list); NaN after a complaint.
double read_quantity(const Node&, const std::string& label, Dimension, Range, Complaints&);

}  // namespace topple::product
