#pragma once
/// Plots of lines and bands over one pair of axes, as drawings.

#include <string>
#include <vector>

#include "record/drawing.h"

namespace topple::record {

struct PlotLine {
  std::string name;  // in the legend; empty: not there
  std::vector<double> x, y;
  Ink ink = Ink::Series0;
  std::vector<double> dash;
  double width = 2, opacity = 1;
};

/// Area between two curves over common x.
struct PlotBand {
  std::string name;
  std::vector<double> x, low, high;
  Ink ink = Ink::Series0;
  double opacity = 0.2;
  double legend_opacity = 0;  // of its sign; 0: the same
};

enum class Mark { Circle, Square, Triangle, Cross };

struct PlotMark {
  std::string name;  // in the legend, once for each name
  double x = 0, y = 0;
  Mark mark = Mark::Circle;
  Ink ink = Ink::Text;
};

struct Plot {
  std::string title, x_title, y_title;  // axes with their units
  std::string legend_title;
  double x_low = 0, x_high = 0, y_low = 0, y_high = 0;  // equal: from what is shown
  std::vector<PlotBand> bands;
  std::vector<PlotLine> lines;
  std::vector<PlotMark> marks;
  double width = 900, height = 500;
};

Drawing draw(const Plot&);

/// Rising round numbers (1, 2, 2.5 or 5 times a power of ten apart) inside [low, high], `most` at most but at least 2.
std::vector<double> find_ticks(double low, double high, int most);
/// With as many decimals as the step between the ticks needs.
std::string tick_text(double value, double step);

/// The parts of a polyline inside a box.
std::vector<std::vector<Dot>> clip_line(const std::vector<Dot>&, Dot low, Dot high);
/// A polygon cut to a box.
std::vector<Dot> clip_area(std::vector<Dot>, Dot low, Dot high);

void draw_mark(Drawing&, Mark, Dot, Ink, double size = 4.5);

}  // namespace topple::record
