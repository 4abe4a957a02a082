#pragma once
/// Fuzzy values and values that follow from others, as they stand in files: one syntax for plans and section files
/// (docs/rcc.md, "Fuzzy inputs").

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "base/error.h"
#include "base/unit.h"
#include "product/expression.h"

namespace topple::product {

/// One fuzzy value: corners (x, μ) of its membership function in SI, x rising, μ from 0 up to 1 and down to 0.
struct FuzzyValue {
  std::string path;    // "concrete.fc"
  std::string name;    // "fc", in formulas
  std::string symbol;  // unit for people, "N/mm2"
  double unit = 1;     // SI value of one of that unit
  std::vector<std::pair<double, double>> corners;
  SourcePosition where;
};

/// One value that follows from others.
struct DerivedValue {
  std::string path, name, symbol;
  double unit = 1;
  std::string text;  // the formula
  Expression expression;
  SourcePosition where;
};

/// Units of formulas, N, mm and s, those that people read in results, and the SI unit's name in files.
struct FuzzyUnits {
  double formula = 1, shown = 1;
  const char* symbol = "";
  const char* si = "";
};
FuzzyUnits fuzzy_units(Dimension);

/// The values with membership 1: from, to.
std::pair<double, double> core_of(const FuzzyValue&);
/// "fc = 25 N/mm2"
std::string text_of(const FuzzyValue&, double value);

/// What is asked of the analysis.
struct FuzzySearch {
  std::vector<double> levels;  // given ones; empty: left to the program
  int limit = 0;               // of samples; 0: left to the program
  std::uint64_t seed = 1;
  double after = 0;  // of a plan: runs end so long after its last stage; 0: with its analysis [s]
};

}  // namespace topple::product
