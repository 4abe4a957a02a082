#pragma once
/// A section file: one section with its materials, and the zone of it whose resistance is asked for (docs/rcc.md).

#include <string>
#include <vector>

#include "product/document.h"
#include "product/plan.h"

namespace topple::product {

/// SI; forces count positive in tension, as everywhere inside.
struct SectionFile {
  std::string title;
  std::string path;  // as given
  std::string text;  // the file's bytes
  Concrete concrete;
  Steel steel;
  Section section;
  double length = 0;         // of the zone, over which curvature localises [m]
  double cut_bars = 0;       // as nearfield::ZoneInput
  double cut_concrete = 0;   //
  double concrete_loss = 0;  // `transition_damage` of the file
  bool cover_lost = false;
  std::vector<double> normal_forces;  // as given, none: left to the program [N]
  bool has_length = false;            // given; otherwise one depth of the section
  SourcePosition where;               // of the section
  SourcePosition where_length;        // of the zone's length, or of the section
};

/// Reads and checks a section file. Every complaint is collected; throws InputError if one of them is an error.
SectionFile read_section_file_text(const std::string& text, const std::string& name, std::vector<Diagnostic>& warnings);
/// The same from a parsed text, without its bytes.
SectionFile read_section_document(const Node&, const std::string& name, std::vector<Diagnostic>& warnings);
/// Reads a file. `text_out` receives its bytes, also on error.
SectionFile read_section_file(const std::string& path, std::vector<Diagnostic>& warnings, std::string& text_out);

}  // namespace topple::product
