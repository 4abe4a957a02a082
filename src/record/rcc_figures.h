#pragma once
/// The pictures of a report of resistance curves, each with the table of what it shows.

#include <string>
#include <vector>

#include "record/drawing.h"
#include "record/rcc_report.h"

namespace topple::record {

/// Numbers beside a picture, as text.
struct FigureTable {
  std::vector<std::string> heads;
  std::vector<std::vector<std::string>> rows;
};

struct Figure {
  std::string id;       // of the PNG file and of the anchor in the page
  std::string heading;  // figures that follow each other under one heading stand together
  std::string caption;  // a sentence or two
  Drawing drawing;
  FigureTable table;
  bool is_detail = false;  // folded away at first
};

std::vector<Figure> make_figures(const RccReport&);

/// Dash of the k-th line: inks come again after six lines, but never with the same dash; 54 lines differ.
const std::vector<double>& dash_of(size_t k);

/// A number for people: `digits` significant ones, "-" if there is none.
std::string shown(double value, double unit, int digits = 4);

}  // namespace topple::record
