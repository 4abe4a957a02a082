#include "product/dxf_drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <sstream>

#include "base/error.h"
#include "base/utf8.h"
#include "product/foreign_text.h"
#include "product/layer_names.h"

namespace topple::product {

void fail_dxf(const std::string& name, int line, const std::string& why, const std::string& help) {
  throw InputError(std::vector<Diagnostic>{{Severity::Error, "E113", {name, line, line > 0 ? 1 : 0}, 1, why, help}});
}

std::vector<DxfPair> read_dxf_pairs(const std::string& text, const std::string& name) {
  std::vector<DxfPair> out;
  std::istringstream in{to_line_feeds(std::string(without_mark(text)))};
  std::string code, value;
  int line = 1;
  const auto trimmed = [](const std::string& s) {
    const size_t from = s.find_first_not_of(" \t\r"), to = s.find_last_not_of(" \t\r");
    return from == std::string::npos ? std::string() : s.substr(from, to - from + 1);
  };
  for (; std::getline(in, code) && std::getline(in, value); line += 2) {
    char* end = nullptr;
    const std::string word = trimmed(code);
    const long number = std::strtol(word.c_str(), &end, 10);
    if (word.empty() || *end != '\0')
      fail_dxf(name, line, "is no DXF text: a group code is wanted, there is \"" + word.substr(0, 20) + "\"",
               "save the drawing as DXF in ASCII");
    out.push_back({static_cast<int>(number), trimmed(value), line + 1});
    if (number == 0 && out.back().value == "EOF") return out;
  }
  fail_dxf(name, out.empty() ? 1 : out.back().line, "ends before its EOF",
           "the drawing was cut off; save or copy it again");
}

PlaneMap PlaneMap::operator*(const PlaneMap& f) const {
  const auto at = (*this)({f.x, f.y});
  return {a * f.a + b * f.c, a * f.b + b * f.d, c * f.a + d * f.c, c * f.b + d * f.d, at[0], at[1]};
}

double PlaneMap::stretch() const {
  const double half = 0.5 * (a * a + b * b + c * c + d * d), det = a * d - b * c;
  return std::sqrt(half + std::sqrt(std::max(0.0, half * half - det * det)));
}

namespace {

constexpr int kMostInserted = 100000;

/// Where a block is put: at each place of a grid of rows and columns.
struct Insertion {
  int line = 1;
  std::string layer, block;
  bool is_on_paper = false;
  std::array<double, 3> at{}, scale{1, 1, 1}, extrusion{0, 0, 1};
  double angle = 0;  // [deg]
  int columns = 1, rows = 1;
  std::array<double, 2> spacing{};
};

/// Entities of the drawing itself, or of one of its blocks.
struct Contents {
  std::array<double, 2> base{};  // of a block: the point of it that is put at the place of an insertion
  std::vector<DxfOutline> outlines;
  std::vector<Insertion> insertions;
  std::map<std::string, int> others;
};

/// Names of blocks do not tell capitals from small letters.
std::string as_block_name(const std::string& value) {
  std::string out = decode_dxf_text(value);
  for (char& c : out)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return out;
}

bool is_tilted(const std::array<double, 3>& extrusion) {
  const auto& [x, y, z] = extrusion;
  return !(std::hypot(x, y) < 1e-6 * std::abs(z));
}

class Reader {
 public:
  Reader(const std::vector<DxfPair>& pairs, const std::string& name) : pairs_(pairs), name_(name) {}

  void read() {
    for (size_t i = 0; i < pairs_.size(); ++i) {
      const DxfPair& p = pairs_[i];
      if (p.code == 0)
        begin(i);
      else if (!entity_.empty())
        take(p);
    }
  }

  Contents entities;
  std::map<std::string, Contents> blocks;

 private:
  bool is_outline() const { return entity_ == "LWPOLYLINE" || entity_ == "POLYLINE" || entity_ == "CIRCLE"; }

  void begin(size_t i) {
    const DxfPair& p = pairs_[i];
    if (p.value == "EOF" && section_ == "ENTITIES")
      fail_dxf(name_, p.line, "its entities have no ENDSEC", "the drawing was cut off; save or copy it again");
    if (in_polyline_ && (p.value == "VERTEX" || p.value == "SEQEND")) {
      end_corner();
      drop_frame();
      in_vertex_ = p.value == "VERTEX";
      if (!in_vertex_) {
        finish();
        in_polyline_ = false;
      }
      return;
    }
    // texts of an insertion
    if (in_insertion_ && (p.value == "ATTRIB" || p.value == "SEQEND")) {
      finish();
      in_insertion_ = p.value == "ATTRIB";
      return;
    }
    finish();
    in_polyline_ = in_vertex_ = in_insertion_ = false;
    if (section_ != "ENTITIES" && section_ != "BLOCKS") {
      if (p.value == "SECTION" && i + 1 < pairs_.size()) section_ = pairs_[i + 1].value;
      return;
    }
    if (p.value == "ENDSEC") section_.clear();
    if (p.value == "ENDSEC" || p.value == "ENDBLK") block_ = nullptr;
    if (section_.empty() || p.value == "ENDBLK") return;
    entity_ = p.value;
    outline_.line = insertion_.line = p.line;
    in_polyline_ = entity_ == "POLYLINE";
    in_insertion_ = entity_ == "INSERT";
  }

  void end_corner() {
    outline_.lacks_y |= !has_y_;
    has_y_ = true;
  }
  void drop_frame() {
    if (is_frame_ && !outline_.corners.empty())
      outline_.corners.pop_back(), outline_.bulges.pop_back(), outline_.heights.pop_back();
    is_frame_ = false;
  }

  /// Where the entity at hand belongs; null: to nothing.
  Contents* now() { return section_ == "ENTITIES" ? &entities : block_; }

  void finish() {
    end_corner();
    drop_frame();
    if (entity_ == "BLOCK") {
      block_ = &blocks[as_block_name(block_name_)];
      *block_ = {base_, {}, {}, {}};
    } else if (Contents* to = now(); to && is_outline()) {
      if (entity_ == "CIRCLE") {  // two halves
        outline_.is_closed = true;
        outline_.corners = {{centre_[0] - radius_, centre_[1]}, {centre_[0] + radius_, centre_[1]}};
        outline_.bulges = {1, 1};
        outline_.lacks_y = false;
      }
      outline_.is_tilted = is_tilted(extrusion_);
      // drawn on a plane that is seen from below: its x axis is the other way round
      if (extrusion_[2] < 0) outline_.place = {-1, 0, 0, 1, 0, 0};
      to->outlines.push_back(outline_);
    } else if (to && entity_ == "INSERT") {
      insertion_.layer = outline_.layer, insertion_.is_on_paper = outline_.is_on_paper;
      insertion_.extrusion = extrusion_;
      to->insertions.push_back(insertion_);
    } else if (to && !entity_.empty()) {
      ++to->others[entity_];
    }
    outline_ = {};
    insertion_ = {};
    extrusion_ = {0, 0, 1};
    centre_ = base_ = {};
    radius_ = 0;
    block_name_.clear();
    entity_.clear();
  }

  double number(const DxfPair& p) const {
    char* end = nullptr;
    const double x = std::strtod(p.value.c_str(), &end);
    if (p.value.empty() || *end != '\0' || !(std::abs(x) < 1e12))
      fail_dxf(name_, p.line, "a coordinate is wanted, there is \"" + p.value.substr(0, 20) + "\"",
               "numbers below 1e12 in size");
    return x;
  }

  void take(const DxfPair& p) {
    if (entity_ == "BLOCK") {
      if (p.code == 2) block_name_ = p.value;
      if (p.code == 10 || p.code == 20) base_[p.code == 20] = number(p);
      return;
    }
    if (!in_vertex_) {
      if (p.code == 8) outline_.layer = decode_dxf_text(p.value);
      if (p.code == 67) outline_.is_on_paper = p.value != "0";
      if (p.code == 210 || p.code == 220 || p.code == 230)
        extrusion_[static_cast<size_t>(p.code / 10 - 21)] = number(p);
    }
    if (entity_ == "INSERT")
      take_insertion(p);
    else if (is_outline())
      take_outline(p);
  }

  void take_insertion(const DxfPair& p) {
    Insertion& o = insertion_;
    switch (p.code) {
      case 2:
        o.block = as_block_name(p.value);
        break;
      case 10:
      case 20:
      case 30:
        o.at[static_cast<size_t>(p.code / 10 - 1)] = number(p);
        break;
      case 41:
      case 42:
      case 43:
        o.scale[static_cast<size_t>(p.code - 41)] = number(p);
        break;
      case 44:
      case 45:
        o.spacing[static_cast<size_t>(p.code - 44)] = number(p);
        break;
      case 50:
        o.angle = number(p);
        break;
      case 70:
        o.columns = std::clamp(std::atoi(p.value.c_str()), 1, kMostInserted);
        break;
      case 71:
        o.rows = std::clamp(std::atoi(p.value.c_str()), 1, kMostInserted);
        break;
      default:
        break;
    }
  }

  void take_outline(const DxfPair& p) {
    DxfOutline& o = outline_;
    const bool has_corner = entity_ == "LWPOLYLINE" || in_vertex_;
    if (p.code == 70 && !in_vertex_) {
      const int flags = std::atoi(p.value.c_str());
      o.is_closed = (flags & 1) != 0;
      o.is_mesh = entity_ == "POLYLINE" && (flags & (16 | 64)) != 0;
    }
    if (p.code == 70 && in_vertex_) is_frame_ = (std::atoi(p.value.c_str()) & 16) != 0;
    if (p.code == 10 && has_corner) {
      end_corner();
      o.corners.push_back({number(p), 0});
      o.bulges.push_back(0), o.heights.push_back(0);
      has_y_ = false;
    }
    if (p.code == 20 && has_corner && !o.corners.empty()) {
      o.corners.back()[1] = number(p);
      has_y_ = true;
    }
    if (p.code == 30 && has_corner && !o.corners.empty()) o.heights.back() = number(p);
    if (p.code == 42 && has_corner && !o.corners.empty()) o.bulges.back() = number(p);
    if (entity_ == "CIRCLE" && (p.code == 10 || p.code == 20)) centre_[p.code == 20] = number(p);
    if (entity_ == "CIRCLE" && p.code == 40) radius_ = std::abs(number(p));
  }

  const std::vector<DxfPair>& pairs_;
  const std::string& name_;
  std::string section_, entity_, block_name_;
  Contents* block_ = nullptr;
  bool in_polyline_ = false, in_vertex_ = false, in_insertion_ = false, has_y_ = true;
  bool is_frame_ = false;  // the vertex only guides a spline
  DxfOutline outline_;
  Insertion insertion_;
  std::array<double, 3> extrusion_{0, 0, 1};
  std::array<double, 2> centre_{}, base_{};  // of a circle, of a block
  double radius_ = 0;
};

/// Puts entities where they are inserted, blocks within blocks as well.
class Placing {
 public:
  Placing(const Reader& reader, const std::string& name, DxfDrawing& out)
      : blocks_(reader.blocks), name_(name), out_(out) {}

  /// What the insertions on the way to some contents do to them.
  struct Way {
    PlaneMap place;
    double height = 1;  // times that of the block
    bool is_on_paper = false, is_tilted = false;
    std::string layer, block;
  };

  void put(const Contents& contents, const Way& way) {
    for (const DxfOutline& own : contents.outlines) {
      DxfOutline& o = out_.outlines.emplace_back(own);
      count(way, own.line);
      o.place = way.place * own.place;
      for (double& z : o.heights) z *= way.height;
      o.is_on_paper |= way.is_on_paper, o.is_tilted |= way.is_tilted;
      o.layer = layer_of(own.layer, way), o.block = way.block;
    }
    for (const auto& [kind, number] : contents.others) out_.others[kind] += number;
    for (const Insertion& i : contents.insertions) insert(i, way);
  }

 private:
  static std::string layer_of(const std::string& own, const Way& way) {
    return (own.empty() || own == "0") && !way.layer.empty() ? way.layer : own;
  }
  void count(const Way& way, int line) {
    if (!way.block.empty() && ++inserted_ > kMostInserted)
      fail_dxf(name_, line, fmt::format("blocks make more than {} outlines and insertions", kMostInserted),
               "leave out what is not near");
  }

  void insert(const Insertion& i, const Way& way) {
    const auto found = blocks_.find(i.block);
    const bool has_some = found != blocks_.end() && !(found->second.outlines.empty() &&
                                                      found->second.insertions.empty() && found->second.others.empty());
    if (!has_some) {
      ++out_.lacking[i.block];
      return;
    }
    if (std::find(open_.begin(), open_.end(), i.block) != open_.end())
      fail_dxf(name_, i.line, "the block " + clean_text(i.block) + " is inserted into itself",
               "save the drawing again");
    open_.push_back(i.block);
    const double angle = i.angle / 180 * std::acos(-1.0), c = std::cos(angle), s = std::sin(angle);
    const double side = i.extrusion[2] < 0 ? -1 : 1;
    const auto& base = found->second.base;
    for (int row = 0; row < i.rows; ++row)
      for (int column = 0; column < i.columns; ++column) {
        count({{}, 1, false, false, {}, i.block}, i.line);
        const PlaneMap to_base{i.scale[0],
                               0,
                               0,
                               i.scale[1],
                               column * i.spacing[0] - i.scale[0] * base[0],
                               row * i.spacing[1] - i.scale[1] * base[1]};
        const PlaneMap turned = PlaneMap{c, -s, s, c, i.at[0], i.at[1]} * to_base;
        put(found->second, {way.place * PlaneMap{side, 0, 0, 1, 0, 0} * turned, way.height * i.scale[2],
                            way.is_on_paper || i.is_on_paper, way.is_tilted || is_tilted(i.extrusion),
                            layer_of(i.layer, way), i.block});
      }
    open_.pop_back();
  }

  const std::map<std::string, Contents>& blocks_;
  const std::string& name_;
  DxfDrawing& out_;
  std::vector<std::string> open_;
  int inserted_ = 0;
};

}  // namespace

DxfDrawing read_dxf_drawing(const std::vector<DxfPair>& pairs, const std::string& name) {
  Reader reader(pairs, name);
  reader.read();
  DxfDrawing out;
  Placing(reader, name, out).put(reader.entities, {});
  return out;
}

}  // namespace topple::product
