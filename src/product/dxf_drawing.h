#pragma once
/// Outlines of a DXF drawing, where its blocks are inserted as well.

#include <array>
#include <map>
#include <string>
#include <vector>

namespace topple::product {

/// A pair of lines of the file: group code and value.
struct DxfPair {
  int code = 0;
  std::string value;
  int line = 1;  // of the value
};

/// All pairs of an ASCII DXF file up to that of its end, `0 EOF`. Throws InputError E113.
std::vector<DxfPair> read_dxf_pairs(const std::string& text, const std::string& file_name);

/// x' = [a b; c d] x + (x, y)
struct PlaneMap {
  double a = 1, b = 0, c = 0, d = 1, x = 0, y = 0;

  std::array<double, 2> operator()(const std::array<double, 2>& p) const {
    return {a * p[0] + b * p[1] + x, c * p[0] + d * p[1] + y};
  }
  PlaneMap operator*(const PlaneMap& first) const;
  double stretch() const;  // the largest of a length
};

/// A polyline or circle in the drawing's unit.
struct DxfOutline {
  int line = 1;  // where it begins
  std::string layer;
  std::string block;  // that holds it; empty: it lies in the drawing itself
  bool is_closed = false, is_on_paper = false, is_mesh = false, is_tilted = false, lacks_y = false;
  std::vector<std::array<double, 2>> corners;  // of its block, before `place`
  std::vector<double> bulges;   // of the edge behind each corner: tan of a quarter of its arc's angle; 0: straight
  std::vector<double> heights;  // of corners, after it
  PlaneMap place;
};

struct DxfDrawing {
  std::vector<DxfOutline> outlines;
  std::map<std::string, int> others;   // entities that are none, by kind, as often as they are inserted
  std::map<std::string, int> lacking;  // blocks that are inserted and have nothing in this file, by name
};

/// What lies in the drawing, with the entities of its blocks wherever they are inserted, each on the layer of its
/// insertion where it has none of its own ("0"). Throws InputError E113: numbers that are none, a block within itself,
/// more than 100,000 outlines and insertions of blocks.
DxfDrawing read_dxf_drawing(const std::vector<DxfPair>&, const std::string& file_name);

/// Throws InputError E113 at a line; 0: of the whole file.
[[noreturn]] void fail_dxf(const std::string& file_name, int line, const std::string& why, const std::string& help);

}  // namespace topple::product
