#pragma once
/// Pictures as lists of shapes, and the two ways out of here: SVG inside a page, and PNG. x to the right, y downwards,
/// in points of the picture.

#include <string>
#include <vector>

namespace topple::record {

/// Colours by what they are for; light and dark values stand in one table (drawing.cpp).
enum class Ink {
  None,
  Text,
  Quiet,  // secondary text, axes
  Line,   // frames
  Faint,  // grid
  Panel,  // background
  Series0,
  Series1,
  Series2,
  Series3,
  Series4,
  Series5,
  Uncracked,
  Cracked,
  Open,
  Compressed,
  Crushing,
  Crushed,
  BarTension,
  BarCompression
};

/// One of the six colours for lines, again from the first after the last.
Ink series_ink(std::size_t);

struct Dot {
  double x = 0, y = 0;
};

struct Shape {
  enum class Kind { Line, Area, Circle, Text };
  Kind kind = Kind::Line;
  std::vector<Dot> dots;  // of lines and areas; centre of a circle, anchor of a text
  Ink fill = Ink::None, stroke = Ink::None;
  double width = 1;          // of the stroke
  double opacity = 1;        // of everything
  std::vector<double> dash;  // lengths of strokes and gaps, none: solid
  double radius = 0;         // of a circle
  std::string text;          // UTF-8
  double size = 13;          // of the letters
  double anchor = 0;         // 0: the text begins at its dot, 0.5: its middle, 1: its end
  double turn = 0;           // of the text about its dot, clockwise [deg]
  bool bold = false;
};

struct Drawing {
  double width = 0, height = 0;
  std::string title;  // what it shows, for those who cannot see it
  std::vector<Shape> shapes;

  void line(std::vector<Dot>, Ink, double width = 1, std::vector<double> dash = {}, double opacity = 1);
  void area(std::vector<Dot>, Ink fill, double opacity = 1, Ink stroke = Ink::None);
  void circle(Dot, double radius, Ink fill, Ink stroke = Ink::None);
  void text(Dot, const std::string&, Ink = Ink::Text, double size = 13, double anchor = 0, bool bold = false);
};

/// An <svg> element without its own colours: it needs drawing_css() in the page.
std::string to_svg(const Drawing&);
/// Rules for the classes of to_svg: light, dark where the reader prefers it, light on paper.
std::string drawing_css();
/// The bytes of a PNG of width * scale by height * scale pixels in the light colours.
/// Throws std::runtime_error if it cannot be made.
std::string to_png(const Drawing&, double scale);

/// Text for HTML and SVG: & < > " escaped.
std::string escape_html(const std::string&);

}  // namespace topple::record
