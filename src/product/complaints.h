#pragma once
/// Collects everything that is wrong with a plan, so that it can be reported at once.

#include <string>
#include <vector>

#include "base/error.h"
#include "base/unit.h"
#include "product/document.h"

namespace topple::product {

/// A quantity that a reader asked for: `node` as it stands in the plan, or `key` of `table` which is left out.
struct AskedQuantity {
  const Node* node = nullptr;
  const Node* table = nullptr;
  std::string key;
  Dimension dimension = Dimension::Number;
  double value = 0;  // as read, or what it is when it is left out; NaN: not known here
};

class Complaints {
 public:
  explicit Complaints(std::string file) : file_(std::move(file)) {}

  void error(const char* code, Place, std::string message, std::string help = {});
  void warn(const char* code, Place, std::string message, std::string help = {});

  /// Takes back an error that another one says better.
  void take_back(Place, const std::string& message);

  int error_count() const { return errors_; }
  /// True once there are so many errors that looking for more is of no use.
  bool is_full() const { return errors_ >= most; }
  SourcePosition position(Place place) const { return {file_, place.line, place.column}; }
  const std::vector<Diagnostic>& all() const { return all_; }
  /// In the order of the file.
  void sort();

  /// Where readers note every quantity they ask for; nullptr: nowhere.
  std::vector<AskedQuantity>* asked = nullptr;

 private:
  void add(Severity, const char* code, Place, std::string message, std::string help);

  static constexpr int most = 100;
  std::string file_;
  std::vector<Diagnostic> all_;
  int errors_ = 0, warnings_ = 0;
};

/// "did you mean "x"?", or `otherwise` if no name in `known` is near.
std::string did_you_mean(const std::string& word, const std::vector<std::string>& known, std::string otherwise = {});

/// "a, b, c", shortened if there are many.
std::string list_of(const std::vector<std::string>& names);

/// The word in quotes, shortened and without control characters.
std::string quoted(const std::string& word);

}  // namespace topple::product
