#pragma once
/// A file of fuzzy inputs for a section file: which of its values are fuzzy, which follow from others by a formula
/// (docs/rcc.md). What the numbers mean for an analysis is the caller's.

#include <span>
#include <string>
#include <vector>

#include "product/document.h"
#include "product/fuzzy_values.h"
#include "product/interaction.h"
#include "product/section_file.h"

namespace topple::product {

/// Where a value of the section file is replaced.
struct ValuePlace {
  std::vector<std::string> keys;  // from the root of the document
  std::string si;                 // name of the SI unit in files
};

/// Fuzzy inputs bound to a section. Formulas count in N and mm: N/mm2, mm, mm2, N/mm, N.
struct FuzzyFile : FuzzySearch {
  std::string title, path, text;
  std::vector<FuzzyValue> inputs;
  std::vector<DerivedValue> derived;
  std::vector<ValuePlace> places;    // of the inputs, then of the derived values
  std::vector<double> formula_unit;  // SI value of one unit in formulas: inputs, derived, then crisp values
  Interaction interaction;           // of inputs and derived values, in formula units
  std::vector<double> crisp;         // other values of the section that formulas may use, in formula units
  Node section;                      // the section file, parsed
};

/// Reads fuzzy inputs for a section that has been read. Every complaint is collected, formulas and values are tried at
/// the centre and at all corners of the support; throws InputError.
FuzzyFile read_fuzzy_text(const std::string& text, const std::string& name, const SectionFile&,
                          std::vector<Diagnostic>& warnings);
FuzzyFile read_fuzzy_file(const std::string& path, const SectionFile&, std::vector<Diagnostic>& warnings,
                          std::string& text_out);

/// The section with the values of one point, one for each input in SI; what follows by a formula is computed. Every
/// rule of the section file holds. Throws InputError.
SectionFile make_sample(const SectionFile&, const FuzzyFile&, std::span<const double> point);
/// The derived values of a point in SI.
std::vector<double> calc_derived(const FuzzyFile&, std::span<const double> point);
/// What the interaction sees of a point: inputs and derived values in formula units.
std::vector<double> calc_interacting(const FuzzyFile&, std::span<const double> point);

}  // namespace topple::product
