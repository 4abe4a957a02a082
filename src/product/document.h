#pragma once
/// A TOML text as a tree in which every key and value knows its place. Only document.cpp knows the parser.

#include <cstdint>
#include <string>
#include <vector>

#include "base/error.h"

namespace topple::product {

/// A stretch of one line of the plan.
struct Place {
  int line = 1, column = 1;  // from 1
  int width = 1;             // characters
};

struct Entry;

struct Node {
  enum class Kind { String, Integer, Float, Boolean, Date, Array, Table };
  Kind kind = Kind::Table;
  Place place;  // tables: their header, or their key
  std::string text;
  double number = 0;  // integers too
  std::int64_t integer = 0;
  bool boolean = false;
  std::vector<Node> items;     // of an array
  std::vector<Entry> entries;  // of a table, in the order of the file

  const Entry* find(const std::string& key) const;
};

struct Entry {
  std::string key;
  Place place;
  Node value;
};

/// "a string", "a table", ...
std::string name_of(Node::Kind);

/// Parses a text without a byte order mark. Throws InputError E101 to E105 with one complaint.
///   what, help  what is said of a text without anything in it: which file that is, and what to do
Node parse_document(const std::string& text, const std::string& file, const std::string& what = "the plan",
                    const std::string& help = "`topple new` writes a commented plan to begin with");

}  // namespace topple::product
