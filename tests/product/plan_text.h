#pragma once
/// A small complete plan to make mistakes in, and the comparison of complaints with marked places.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "product/plan.h"

namespace topple::product {

inline std::string small_plan() {
  return R"toml(title = "Two bays"
[site]
friction = 0.6
[[site.neighbour]]
name = "House"
footprint = [["0 m", "20 m"], ["10 m", "20 m"], ["10 m", "30 m"]]
clearance = "3 m"
[concrete.C25]
fc = "25 N/mm2"
Ec = "30 GPa"
[steel.S]
fy = "420 N/mm2"
fu = "500 N/mm2"
eps_u = 0.1
[section.column]
width = "40 cm"
height = "50 cm"
concrete = "C25"
steel = "S"
cover = "3 cm"
ties = { diameter = "8 mm", spacing = "20 cm" }
bars = { count_y = 3, count_z = 3, diameter = "20 mm" }
[section.beam]
width = "30 cm"
height = "60 cm"
concrete = "C25"
steel = "S"
cover = "3 cm"
ties = { diameter = "8 mm", spacing = "15 cm", legs = 4 }
top = "4 x 20 mm"
bottom = "2 x 20 mm"
[slab.floor]
thickness = "16 cm"
concrete = "C25"
steel = "S"
as_top = "4 cm2/m"
[wall.brick]
thickness = "24 cm"
density = "1800 kg/m3"
strength = "5 N/mm2"
modulus = "3 GPa"
[grid]
rows = { A = "0 m", B = "5 m" }
frames = { 1 = "0 m", 2 = "4 m", 3 = "8 m" }
[storeys]
count = 2
height = "3 m"
load = "1 kN/m2"
[[columns]]
section = "column"
[[beams]]
section = "beam"
[[slabs]]
panel = "floor"
[[walls]]
panel = "brick"
at = "A1A2"
storeys = 0
opening = [{ left = "1 m", width = "1.2 m", height = "2.1 m" }]
[[override]]
members = "C-B2-0"
section = "column"
[preparation]
removed = ["W-A1A2-0"]
[[preparation.weaken]]
members = ["C-B1-0"]
at = "1 m"
cut_bars = 0.5
[[stage]]
name = "front"
time = "0 s"
[[stage.charge]]
members = ["C-A*-0"]
position = "1 m"
destroyed_length = "1.2 m"
[[stage]]
time = "2 s"
[[stage.charge]]
members = ["C-B3-0"]
position = "1 m"
destroyed_length = "1 m"
[[cable]]
member = "C-A2-1"
position = "1 m"
anchor = ["-40 m", "5 m", "0 m"]
stiffness = "2 MN/m"
strength = "400 kN"
[criteria]
mechanism = "topple"
azimuth = "180 deg"
azimuth_tolerance = "10 deg"
[analysis]
duration = "5 s"
)toml";
}

/// The text with its only `old_words` replaced.
inline std::string replaced(std::string text, const std::string& old_words, const std::string& new_words) {
  const size_t at = text.find(old_words);
  EXPECT_NE(at, std::string::npos) << "not in the plan: " << old_words;
  if (at == std::string::npos) return text;
  EXPECT_EQ(text.find(old_words, at + 1), std::string::npos) << "twice in the plan: " << old_words;
  return text.replace(at, old_words.size(), new_words);
}

/// A text without its marks « and », and the place between them.
struct Marked {
  std::string text;
  int line = 0, column = 0, width = 0;
};

inline Marked take_marks(const std::string& text) {
  Marked marked;
  int line = 1, column = 1;
  for (size_t i = 0; i < text.size(); ++i) {
    if (text.compare(i, 2, "\u00AB") == 0) {
      marked.line = line, marked.column = column, ++i;
    } else if (text.compare(i, 2, "\u00BB") == 0) {
      marked.width = column - marked.column, ++i;
    } else {
      marked.text += text[i];
      if (text[i] == '\n') {
        ++line, column = 1;
      } else if ((static_cast<unsigned char>(text[i]) & 0xC0) != 0x80) {
        ++column;
      }
    }
  }
  return marked;
}

/// Everything that is said about a plan, errors or warnings.
inline std::vector<Diagnostic> complaints_about(const std::string& text) {
  std::vector<Diagnostic> warnings;
  try {
    read_plan(text, "plan.toml", warnings);
  } catch (const InputError& error) { return error.diagnostics(); }
  return warnings;
}

inline std::string rendered(const std::vector<Diagnostic>& complaints, const std::string& text) {
  std::string all;
  for (const Diagnostic& d : complaints) all += render(d, text, false);
  return all;
}

}  // namespace topple::product
