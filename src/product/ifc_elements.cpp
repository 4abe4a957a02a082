#include "product/ifc_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <set>
#include <string_view>

#include "base/error.h"
#include "base/unit.h"
#include "product/clip.h"
#include "product/ifc_angle.h"
#include "product/ifc_kinds.h"

namespace topple::product {

namespace {

using Kind = StepValue::Kind;

/// Of its box, what the volume of a mesh has to fill to be taken for it. Walls have openings.
constexpr double kFilled = 0.9, kFilledWall = 0.5, kOverfilled = 1.02;
constexpr double kLevel = 0.01;          // parts of a slab lie as level as that, or one on the other [m]
constexpr double kPlate = 0.8;           // of a slab's volume, at least in the plate of its parts
constexpr double kLargestCircle = 1.06;  // around a round mesh, over its box: of a polygon with 10 corners at most
constexpr double kFarthest = 1e8;        // coordinate of an element [m]
constexpr double kNear = 1e-3;           // what a boundary has to lie around may stand out as far [m]
constexpr double kStraight = 0.8;        // distance of a bar's ends over its length; ties are bent round
constexpr int kMostItems = 10000;        // of a body or a bar, maps within maps counted each time
constexpr size_t kMostPoints = 100000;   // of a composite curve, likewise
constexpr const char* kTooMany = "its body has more than 10,000 items";

/// What a body is made of. Points in world axes [m].
struct Body {
  Shape shape;
  std::vector<Vec3> points;               // of meshes
  std::vector<Vec3> normals;              // of their faces, as long as twice the area [m²]
  double volume = 0;                      // of meshes [m³]
  bool is_round = false;                  // all of its solids are
  bool is_cut = false, is_whole = false;  // along planes that were read; by bodies that were not
  bool is_partial = false;                // some item of it was not read
  std::string why;                        // what was not understood
};

/// Turn, scale or mirror, and shift.
struct Map {
  Vec3 p;
  Mat3 M;

  Map(const Vec3& shift, const Mat3& matrix) : p(shift), M(matrix) {}
  Map(const Pose& X) : p(X.p), M(to_matrix(X.q)) {}
  Vec3 operator*(const Vec3& v) const { return p + M * v; }
  Map operator*(const Map& X) const { return {p + M * X.p, M * X.M}; }
};

class Reader {
 public:
  Reader(const StepFile& file, const std::string& name) : file_(file), name_(name) {}

  IfcBuilding read() {
    out_.schema = file_.schema;
    check_coordinates();
    check_references();
    read_units();
    for (const StepEntity* b : file_.of_type("IFCBUILDING")) out_.name = b->at(2).text;
    read_storeys();
    std::stable_sort(out_.storeys.begin(), out_.storeys.end(),
                     [](const auto& a, const auto& b) { return a.second < b.second; });
    material_ = read_materials(file_);
    for (const StepEntity* r : file_.of_type("IFCRELDEFINESBYTYPE"))
      for (const StepValue& v : r->at(4).items) type_of_[v.id()] = r->at(5).id();
    for (const StepEntity* r : file_.of_type("IFCRELAGGREGATES"))
      for (const StepValue& part : r->at(5).items) whole_of_[part.id()] = r->at(4).id();
    for (const StepEntity* r : file_.of_type("IFCRELVOIDSELEMENT")) opened_[r->at(4).id()].push_back(get(r->at(5)));
    std::vector<Body> bodies;
    for (const auto& [id, e] : file_.entities) {
      if (element_types().count(e.type) == 0) continue;
      IfcElement element;
      element.type = without_case(e.type);
      element.name = e.at(2).text;
      element.id = id;
      const IfcMaterial material = material_of(id);
      element.material = material.name;
      element.carrying = material.carrying * out_.length_unit;
      element.layers = material.layers * out_.length_unit;
      element.has_opening = opened_.count(id) > 0;
      bodies.push_back(find_body(e));
      element.is_round = bodies.back().is_round;
      out_.elements.push_back(std::move(element));
    }
    count_others();
    find_angle(bodies);
    for (size_t i = 0; i < bodies.size(); ++i) find_box(bodies[i], out_.elements[i]);
    for (IfcElement& e : out_.elements) find_openings(e);
    read_bars();
    return std::move(out_);
  }

 private:
  const StepEntity* get(const StepValue& v) const { return v.kind == Kind::Reference ? file_.find(v.id()) : nullptr; }
  bool is(const StepEntity* e, const char* type) const { return e != nullptr && e->type == type; }

  [[noreturn]] void fail(const std::string& what, const std::string& help) const {
    throw InputError(std::vector<Diagnostic>{{Severity::Error, "E112", {name_, 0, 0}, 1, what, help}});
  }

  /// IFCWALL of IFCWALLSTANDARDCASE.
  static std::string without_case(const std::string& type) {
    for (const char* tail : {"STANDARDCASE", "ELEMENTEDCASE"})
      if (type.ends_with(tail)) return type.substr(0, type.size() - std::string_view(tail).size());
    return type;
  }
  /// What else the building is made of, and what stands in its storeys.
  void count_others() {
    static const std::set<std::string> no_parts{"IFCANNOTATION", "IFCGRID", "IFCREINFORCINGBAR", "IFCELEMENTASSEMBLY"};
    std::set<int> ids;
    for (const auto& [id, e] : file_.entities)
      if (other_types().count(e.type) > 0) ids.insert(id);
    for (const StepEntity* r : file_.of_type("IFCRELCONTAINEDINSPATIALSTRUCTURE"))
      for (const StepValue& v : r->at(4).items)
        if (const StepEntity* e = get(v);
            e != nullptr && element_types().count(e->type) == 0 && no_parts.count(e->type) == 0)
          ids.insert(e->id);
    for (const int id : ids) ++out_.others[without_case(file_.find(id)->type)];
  }

  /// What places and outlines refer to is there; what is not would be zeros.
  void check_references() const {
    static const std::set<std::string> checked{"IFCAXIS2PLACEMENT2D", "IFCAXIS2PLACEMENT3D", "IFCPOLYLINE",
                                               "IFCPOLYLOOP", "IFCINDEXEDPOLYCURVE"};
    for (const auto& [id, e] : file_.entities) {
      if (!checked.contains(e.type)) continue;
      const std::function<void(const StepValue&)> look = [&, n = id, &entity = e](const StepValue& v) {
        if (v.kind == Kind::Reference && get(v) == nullptr)
          throw InputError(std::vector<Diagnostic>{{Severity::Error,
                                                    "E111",
                                                    {name_, entity.line, entity.column},
                                                    1,
                                                    fmt::format("#{} refers to #{}, which is not there", n, v.id()),
                                                    "the file is incomplete: export it again"}});
        for (const StepValue& item : v.items) look(item);
      };
      for (const StepValue& v : e.arguments) look(v);
    }
  }
  /// Coordinates that are no numbers would be zeros.
  void check_coordinates() const {
    const auto is_tuple = [](const StepValue& v, size_t least) {
      return v.kind == Kind::List && v.items.size() >= least && v.items.size() <= 3 &&
             std::all_of(v.items.begin(), v.items.end(), [](const StepValue& x) { return x.kind == Kind::Number; });
    };
    for (const auto& [id, e] : file_.entities) {
      bool is_right = true;
      if (e.type == "IFCCARTESIANPOINT") is_right = is_tuple(e.at(0), 1);
      if (e.type == "IFCDIRECTION") is_right = is_tuple(e.at(0), 2);
      if (e.type == "IFCCARTESIANPOINTLIST2D" || e.type == "IFCCARTESIANPOINTLIST3D")
        is_right =
            std::all_of(e.at(0).items.begin(), e.at(0).items.end(), [&](const StepValue& v) { return is_tuple(v, 2); });
      if (!is_right)
        throw InputError(std::vector<Diagnostic>{{Severity::Error,
                                                  "E111",
                                                  {name_, e.line, e.column},
                                                  1,
                                                  fmt::format("a coordinate of #{} is no number", id),
                                                  "two or three numbers are wanted"}});
    }
  }

  /// The units of the project; of a file without one, of all assignments.
  void read_units() {
    std::vector<const StepEntity*> assignments = file_.of_type("IFCUNITASSIGNMENT");
    for (const StepEntity* project : file_.of_type("IFCPROJECT"))
      if (const StepEntity* own = get(project->at(8)); is(own, "IFCUNITASSIGNMENT")) assignments = {own};
    for (const StepEntity* a : assignments)
      for (const StepValue& v : a->at(0).items) {
        const StepEntity* u = get(v);
        if (u != nullptr && u->at(1).text == "PLANEANGLEUNIT" && u->type == "IFCCONVERSIONBASEDUNIT")
          if (const StepEntity* measure = get(u->at(3))) angle_unit_ = measure->at(0).number;
        if (u == nullptr || u->at(1).text != "LENGTHUNIT") continue;
        out_.length_unit = unit_of(u, 0);
        out_.has_unit = true;
        if (!(out_.length_unit > 0))
          fail(fmt::format("its unit of length, #{}, is not understood", u->id),
               "metres with a prefix are, and what is a multiple of them");
      }
  }
  /// Metres of a unit of length; 0: not understood.
  double unit_of(const StepEntity* u, int depth) const {
    static const std::map<std::string, double> prefixes{
        {"EXA", 1e18},  {"PETA", 1e15},  {"TERA", 1e12},   {"GIGA", 1e9},   {"MEGA", 1e6},   {"KILO", 1e3},
        {"HECTO", 1e2}, {"DECA", 1e1},   {"DECI", 1e-1},   {"CENTI", 1e-2}, {"MILLI", 1e-3}, {"MICRO", 1e-6},
        {"NANO", 1e-9}, {"PICO", 1e-12}, {"FEMTO", 1e-15}, {"ATTO", 1e-18}, {"", 1}};
    if (u == nullptr || depth > 5) return 0;
    if (u->type == "IFCSIUNIT") {
      const auto prefix = prefixes.find(u->at(2).text);
      return u->at(3).text == "METRE" && prefix != prefixes.end() ? prefix->second : 0;
    }
    if (u->type != "IFCCONVERSIONBASEDUNIT") return 0;
    const StepEntity* measure = get(u->at(3));
    return measure == nullptr ? 0 : measure->at(0).number * unit_of(get(measure->at(1)), depth + 1);
  }

  Vec3 point(const StepValue& v) const {
    const StepEntity* e = get(v);
    Vec3 p;
    if (e != nullptr)
      for (size_t i = 0; i < std::min<size_t>(3, e->at(0).items.size()); ++i)
        p[static_cast<int>(i)] = e->at(0).items[i].number;
    return p;
  }
  Vec3 direction(const StepValue& v, const Vec3& otherwise) const {
    const Vec3 d = point(v);
    const double n = norm(d);
    return n > 1e-9 ? (1 / n) * d : otherwise;
  }
  /// IfcAxis2Placement3D or 2D [m].
  Pose axis_placement(const StepValue& v) const {
    const StepEntity* e = get(v);
    if (e == nullptr) return {};
    const Vec3 p = out_.length_unit * point(e->at(0));
    const bool flat = e->type == "IFCAXIS2PLACEMENT2D";
    const Vec3 z = flat ? Vec3{0, 0, 1} : direction(e->at(1), {0, 0, 1});
    Vec3 x = direction(e->at(flat ? 1 : 2), std::abs(z.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
    x = x - dot(x, z) * z;
    if (!(norm(x) > 1e-9)) return {p, {}};
    x = (1 / norm(x)) * x;
    return {p, to_quat(Mat3::from_columns(x, cross(z, x), z))};
  }
  bool has_axes(const StepValue& v) const {
    const StepEntity* e = get(v);
    return (is(e, "IFCAXIS2PLACEMENT3D") || is(e, "IFCAXIS2PLACEMENT2D")) && is(get(e->at(0)), "IFCCARTESIANPOINT");
  }
  /// Of local placements one on another; grids are not understood.
  std::optional<Pose> find_placement(const StepValue& v, int depth = 0) const {
    const StepEntity* e = get(v);
    if (!is(e, "IFCLOCALPLACEMENT") || depth > 50 || !has_axes(e->at(1))) return std::nullopt;
    if (e->at(0).kind == Kind::Null) return axis_placement(e->at(1));
    const std::optional<Pose> parent = find_placement(e->at(0), depth + 1);
    if (!parent) return std::nullopt;
    return *parent * axis_placement(e->at(1));
  }

  /// Heights of storeys: those of their placements, which know where site and building lie; of files that place all
  /// storeys at one height, their elevations.
  void read_storeys() {
    double low = 1e30, high = -1e30;
    int placed = 0;
    const auto storeys = file_.of_type("IFCBUILDINGSTOREY");
    for (const StepEntity* s : storeys)
      if (const auto X = find_placement(s->at(5))) ++placed, low = std::min(low, X->p.z), high = std::max(high, X->p.z);
    const double ground = low <= high ? low : 0;
    for (const StepEntity* s : storeys) {
      const auto X = find_placement(s->at(5));
      const bool has_elevation = s->at(9).kind == Kind::Number;
      if (X && (placed == 1 || high - low > 1e-3 || !has_elevation)) {
        out_.storeys.emplace_back(s->at(2).text, X->p.z);
      } else if (has_elevation) {
        out_.storeys.emplace_back(s->at(2).text, ground + s->at(9).number * out_.length_unit);
      }
    }
  }

  /// Points along a curve, in its own axes [m].
  bool find_points(const StepValue& v, std::vector<Vec3>& out, int depth = 0) const {
    const StepEntity* e = get(v);
    if (e == nullptr || depth > 10) return false;
    const double u = out_.length_unit;
    if (e->type == "IFCPOLYLINE") {
      for (const StepValue& p : e->at(0).items) out.push_back(u * point(p));
    } else if (e->type == "IFCINDEXEDPOLYCURVE") {
      const StepEntity* list = get(e->at(0));
      if (list == nullptr) return false;
      if (e->at(1).items.empty())
        for (size_t i = 0; i < list->at(0).items.size(); ++i) out.push_back(listed(*list, static_cast<double>(i + 1)));
      for (const StepValue& segment : e->at(1).items) {
        std::vector<Vec3> points;
        for (const StepValue& i : segment.items) points.push_back(listed(*list, i.number));
        if (segment.text != "IFCARCINDEX")
          out.insert(out.end(), points.begin(), points.end());
        else if (points.size() != 3)
          return false;
        else
          add_arc(points[0], points[1], points[2], out);
      }
    } else if (e->type == "IFCCOMPOSITECURVE") {
      for (const StepValue& part : e->at(0).items) {
        const StepEntity* segment = get(part);
        if (segment == nullptr) return false;
        std::vector<Vec3> points;
        if (!find_points(segment->at(2), points, depth + 1) || out.size() + points.size() > kMostPoints) return false;
        if (segment->at(1).text == "F") std::reverse(points.begin(), points.end());
        out.insert(out.end(), points.begin(), points.end());
      }
    } else if (e->type == "IFCTRIMMEDCURVE") {
      return find_trimmed(*e, out);
    } else if (e->type == "IFCCIRCLE") {
      add_arc(*e, 0, 2 * std::acos(-1.0), out);
    } else {
      return false;
    }
    return !out.empty();
  }
  /// A point of an IfcCartesianPointList; the first is 1.
  Vec3 listed(const StepEntity& list, double index) const {
    Vec3 p;
    const size_t i = static_cast<size_t>(index) - 1;
    if (!(index >= 1) || i >= list.at(0).items.size()) return p;
    const std::vector<StepValue>& given = list.at(0).items[i].items;
    for (size_t k = 0; k < std::min<size_t>(3, given.size()); ++k) p[static_cast<int>(k)] = given[k].number;
    return out_.length_unit * p;
  }
  void add_arc(const StepEntity& circle, double from, double to, std::vector<Vec3>& out) const {
    constexpr int pieces = 16;
    const Pose X = axis_placement(circle.at(0));
    const double r = circle.at(1).number * out_.length_unit;
    for (int i = 0; i <= pieces; ++i) {
      const double a = from + (to - from) * i / pieces;
      out.push_back(X * Vec3{r * std::cos(a), r * std::sin(a), 0});
    }
  }
  /// From a to the centre of the circle through three points; nothing where they lie on a line.
  static std::optional<Vec3> find_centre(const Vec3& a, const Vec3& b, const Vec3& c) {
    const Vec3 u = b - a, v = c - a, n = cross(u, v);
    if (!(norm(n) > 1e-9 * norm(u) * norm(v))) return std::nullopt;
    return (0.5 / dot(n, n)) * cross(dot(u, u) * v - dot(v, v) * u, n);
  }
  /// From a over b to c; straight where they lie on a line.
  static void add_arc(const Vec3& a, const Vec3& b, const Vec3& c, std::vector<Vec3>& out) {
    constexpr int pieces = 16;
    const std::optional<Vec3> to_centre = find_centre(a, b, c);
    if (!to_centre) {
      out.insert(out.end(), {a, b, c});
      return;
    }
    const Vec3 n = cross(b - a, c - a), x = -*to_centre, y = (1 / norm(n)) * cross(n, x), last = c - a - *to_centre;
    double sweep = std::atan2(dot(last, y), dot(last, x));
    if (sweep <= 0) sweep += 2 * std::acos(-1.0);
    for (int i = 0; i < pieces; ++i) {
      const double t = sweep * i / pieces;
      out.push_back(a - x + std::cos(t) * x + std::sin(t) * y);
    }
    out.push_back(c);
  }
  /// A piece of a line or a circle, between points or parameters.
  bool find_trimmed(const StepEntity& e, std::vector<Vec3>& out) const {
    const StepEntity* basis = get(e.at(0));
    if (basis == nullptr || !(basis->type == "IFCLINE" || basis->type == "IFCCIRCLE")) return false;
    const Pose X = axis_placement(basis->at(0));
    double parameters[2] = {};
    Vec3 ends[2];
    for (size_t side = 0; side < 2; ++side) {
      bool has_point = false;
      for (const StepValue& t : e.at(1 + side).items) {
        if (t.kind == Kind::Number) parameters[side] = t.number;
        if (t.kind == Kind::Reference) ends[side] = out_.length_unit * point(t), has_point = true;
      }
      if (basis->type == "IFCLINE") {
        const StepEntity* way = get(basis->at(1));
        if (!has_point && way != nullptr)
          ends[side] = out_.length_unit *
                       (point(basis->at(0)) + parameters[side] * way->at(1).number * direction(way->at(0), {1, 0, 0}));
      } else if (has_point) {
        const Vec3 p = inverse(X) * ends[side];
        parameters[side] = std::atan2(p.y, p.x);
      } else {
        parameters[side] *= angle_unit_;
      }
    }
    if (basis->type == "IFCLINE") {
      out.push_back(ends[0]), out.push_back(ends[1]);
      return true;
    }
    const double turn = 2 * std::acos(-1.0);
    const bool is_forward = e.at(3).text != "F";
    double from = parameters[0], to = parameters[1];
    constexpr double largest = 1e6;  // beyond it no angle is left of a parameter
    if (!(std::abs(from) < largest && std::abs(to) < largest)) return false;
    to = from + std::fmod(to - from, turn);
    if (is_forward && to <= from) to += turn;
    if (!is_forward && to >= from) to -= turn;
    add_arc(*basis, from, to, out);
    return true;
  }

  /// Of arcs that are one circle.
  static bool is_circle(const Loop& loop) {
    constexpr size_t least = 24;  // fewer corners are those of a polygon
    if (loop.size() < least) return false;
    const Vec3& a = loop.front();
    const std::optional<Vec3> to_centre = find_centre(a, loop[loop.size() / 3], loop[2 * loop.size() / 3]);
    if (!to_centre) return false;
    const double r = norm(*to_centre);
    double longest = 0;
    for (size_t i = 0; i < loop.size(); ++i) longest = std::max(longest, norm(loop[(i + 1) % loop.size()] - loop[i]));
    return longest < 0.4 * r && std::all_of(loop.begin(), loop.end(), [&](const Vec3& p) {
             return std::abs(norm(p - a - *to_centre) - r) < 1e-3 * r;
           });
  }
  /// Outline and holes of a profile in its own plane; a circle as a polygon.
  bool find_profile(const StepValue& v, std::vector<Loop>& out, bool& is_round, std::string& why, int depth = 0) const {
    const StepEntity* e = get(v);
    if (e == nullptr) return false;
    if (depth > 10) {
      why = "its profile is nested too deeply";
      return false;
    }
    const double u = out_.length_unit;
    why = "its profile is " + e->type;
    if (e->type == "IFCRECTANGLEPROFILEDEF" || e->type == "IFCROUNDEDRECTANGLEPROFILEDEF") {
      const Pose at = axis_placement(e->at(2));
      const double x = 0.5 * e->at(3).number * u, y = 0.5 * e->at(4).number * u;
      const double radius = e->type == "IFCROUNDEDRECTANGLEPROFILEDEF"
                                ? std::clamp(e->at(5).number * u, 0.0, std::max(0.0, std::min(x, y)))
                                : 0;
      if (!(radius > 0)) {
        out.push_back({at * Vec3{-x, -y, 0}, at * Vec3{x, -y, 0}, at * Vec3{x, y, 0}, at * Vec3{-x, y, 0}});
        return x > 0 && y > 0;
      }
      Loop loop;
      const auto add = [&loop](const Vec3& p) {
        if (loop.empty() || norm(p - loop.back()) > 1e-6) loop.push_back(p);
      };
      constexpr int pieces = 18;  // of a quarter
      for (int corner = 0; corner < 4; ++corner)
        for (int i = 0; i <= pieces; ++i) {
          const double angle = (corner + 2 + static_cast<double>(i) / pieces) * 0.5 * std::acos(-1.0);
          const double sx = corner == 1 || corner == 2 ? 1 : -1, sy = corner >= 2 ? 1 : -1;
          add(at * Vec3{sx * (x - radius) + radius * std::cos(angle), sy * (y - radius) + radius * std::sin(angle), 0});
        }
      if (norm(loop.front() - loop.back()) <= 1e-6) loop.pop_back();
      is_round |= is_circle(loop);
      out.push_back(std::move(loop));
      return x > 0 && y > 0;
    }
    if (e->type == "IFCCIRCLEPROFILEDEF") {
      const Pose at = axis_placement(e->at(2));
      constexpr int corners = 72;
      const double radius = e->at(3).number * u, step = 2 * std::acos(-1.0) / corners;
      out.emplace_back();
      for (int i = 0; i < corners; ++i)
        out.back().push_back(at * Vec3{radius * std::cos(i * step), radius * std::sin(i * step), 0});
      is_round = true;
      return radius > 0;
    }
    if (e->type == "IFCARBITRARYCLOSEDPROFILEDEF" || e->type == "IFCARBITRARYPROFILEDEFWITHVOIDS") {
      out.emplace_back();
      if (!find_points(e->at(2), out.back()) || out.back().size() < 3) return false;
      is_round |= is(get(e->at(2)), "IFCCIRCLE") || is_circle(out.back());
      for (const StepValue& hole : e->at(3).items) {
        out.emplace_back();
        if (!find_points(hole, out.back())) return false;
      }
      return true;
    }
    if (e->type == "IFCDERIVEDPROFILEDEF" || e->type == "IFCMIRROREDPROFILEDEF") {
      const StepEntity* moved = get(e->at(3));
      if (moved == nullptr && e->type == "IFCDERIVEDPROFILEDEF") return false;
      if (!find_profile(e->at(2), out, is_round, why, depth + 1)) return false;
      for (Loop& loop : out)
        for (Vec3& p : loop) p = moved == nullptr ? Vec3{-p.x, p.y, p.z} : transform(*moved) * p;
      return true;
    }
    return false;
  }

  /// IfcCartesianTransformationOperator, 2D or 3D, of one scale or several. Mirrors have left-handed axes.
  Map transform(const StepEntity& e) const {
    const bool is_3d = e.type.find("3D") != std::string::npos;
    const Vec3 z = is_3d ? direction(e.at(4), {0, 0, 1}) : Vec3{0, 0, 1};
    const auto across = [](Vec3 v, const Vec3& a, const Vec3& b) {
      v = v - dot(v, a) * a;
      v = v - dot(v, b) * b;
      return norm(v) > 1e-6 ? (1 / norm(v)) * v : Vec3{};
    };
    Vec3 x = across(direction(e.at(0), {1, 0, 0}), z, {});
    if (!is_3d && get(e.at(0)) == nullptr && get(e.at(1)) != nullptr)
      x = cross(across(direction(e.at(1), {0, 1, 0}), z, {}), z);
    if (!(norm(x) > 0)) x = across({0, 1, 0}, z, {});
    Vec3 y = across(direction(e.at(1), is_3d ? Vec3{0, 1, 0} : cross(z, x)), z, x);
    if (!(norm(y) > 0)) y = cross(z, x);
    const auto scale = [&e](size_t i, double otherwise) {
      return e.at(i).kind == Kind::Number ? e.at(i).number : otherwise;
    };
    const double first = scale(3, 1);
    const bool has_several = e.type.find("NONUNIFORM") != std::string::npos;
    const double second = has_several ? scale(is_3d ? 5 : 4, first) : first;
    const double third = has_several && is_3d ? scale(6, first) : first;
    return {out_.length_unit * point(e.at(2)), Mat3::from_columns(first * x, second * y, third * z)};
  }

  /// Points, normals and volume of a mesh, which add up to that of a closed one.
  static void measure_mesh(Body& out) {
    for (const Loop& face : out.shape.faces) {
      out.points.insert(out.points.end(), face.begin(), face.end());
      const Vec3 normal = calc_normal(face);
      if (!face.empty()) out.volume += dot(face.front() - out.points.front(), normal) / 6;
      out.normals.push_back(normal);
    }
  }
  bool find_mesh(const StepEntity& e, const Map& X, Body& out) const {
    const size_t before = out.shape.faces.size();
    const bool is_mirrored = determinant(X.M) < 0;
    const auto add_loops = [&](const StepValue& shell) {
      const StepEntity* faces = get(shell);
      if (faces == nullptr) return;
      for (const StepValue& f : faces->at(0).items)
        if (const StepEntity* face = get(f))
          for (const StepValue& b : face->at(0).items) {
            const StepEntity* bound = get(b);
            const StepEntity* loop = bound == nullptr ? nullptr : get(bound->at(0));
            if (!is(loop, "IFCPOLYLOOP")) continue;
            std::vector<Vec3> corners;
            for (const StepValue& p : loop->at(0).items) corners.push_back(X * (out_.length_unit * point(p)));
            if ((bound->at(1).text == "F") != is_mirrored) std::reverse(corners.begin(), corners.end());
            out.shape.faces.push_back(std::move(corners));
          }
    };
    const auto add_indexed = [&](const StepEntity& list, const StepValue& indices, const StepValue& places) {
      std::vector<Vec3> corners;
      for (const StepValue& i : indices.items) {
        double index = i.number;
        if (!places.items.empty()) {
          const bool is_there = index >= 1 && index <= static_cast<double>(places.items.size());
          index = is_there ? places.items[static_cast<size_t>(index) - 1].number : 0;
        }
        corners.push_back(X * listed(list, index));
      }
      if (is_mirrored) std::reverse(corners.begin(), corners.end());
      out.shape.faces.push_back(std::move(corners));
    };
    if (e.type == "IFCFACETEDBREP") {
      add_loops(e.at(0));
    } else if (e.type == "IFCSHELLBASEDSURFACEMODEL" || e.type == "IFCFACEBASEDSURFACEMODEL") {
      for (const StepValue& shell : e.at(0).items) add_loops(shell);
    } else if (const StepEntity* list = get(e.at(0)); list != nullptr && e.type == "IFCTRIANGULATEDFACESET") {
      for (const StepValue& triangle : e.at(3).items) add_indexed(*list, triangle, e.at(4));
    } else if (list != nullptr && e.type == "IFCPOLYGONALFACESET") {
      for (const StepValue& f : e.at(2).items)
        if (const StepEntity* face = get(f)) add_indexed(*list, face->at(0), e.at(3));
    }
    size_t corners = 0;
    for (size_t i = before; i < out.shape.faces.size(); ++i) corners += out.shape.faces[i].size();
    return corners > 5;
  }

  /// Calls use(item, its pose) for every item of the representation that a mapped item places.
  template <typename Use>
  void for_mapped_items(const StepEntity& mapped, const Map& X, const Use& use) const {
    const StepEntity *map = get(mapped.at(0)), *target = get(mapped.at(1));
    const StepEntity* body = map == nullptr ? nullptr : get(map->at(1));
    if (body == nullptr || target == nullptr) return;
    const Map X_WI = X * transform(*target) * inverse(axis_placement(map->at(0)));
    for (const StepValue& item : body->at(3).items) use(item, X_WI);
  }

  /// Of a solid that is about to be added.
  static void note_round(Body& out, bool is_round) {
    out.is_round = is_round && (out.is_round || out.shape.solids.empty());
  }
  bool find_item(const StepValue& v, const Map& X, Body& out, int depth) const {
    const StepEntity* e = get(v);
    if (depth > 10) out.why = "its body is nested too deeply";
    if (++items_ > kMostItems) {
      out.why = kTooMany;
      return false;
    }
    if (e == nullptr || depth > 10) return false;
    if (e->type == "IFCEXTRUDEDAREASOLID") {
      Solid solid;
      if (e->at(1).kind != Kind::Null && !has_axes(e->at(1))) {
        out.why = "the placement of its body is not understood";
        return false;
      }
      bool is_round = false;
      if (!find_profile(e->at(0), solid.loops, is_round, out.why)) return false;
      note_round(out, is_round);
      const Map X_WP = X * axis_placement(e->at(1));
      const Vec3 way = e->at(3).number * out_.length_unit * direction(e->at(2), {0, 0, 1});
      for (Loop& loop : solid.loops)
        for (Vec3& p : loop) p = X_WP * p;
      solid.way = X_WP.M * way;
      out.shape.solids.push_back(std::move(solid));
      return true;
    }
    if (is_boolean(e)) return find_boolean(e, X, out, depth);
    if (e->type == "IFCMAPPEDITEM") {
      const int source = e->at(0).id();
      if (std::find(open_maps_.begin(), open_maps_.end(), source) != open_maps_.end()) {
        out.why = "its body is part of itself";
        return false;
      }
      open_maps_.push_back(source);
      bool any = false, all = true;
      for_mapped_items(*e, X, [&](const StepValue& item, const Map& X_WI) {
        const bool is_read = find_item(item, X_WI, out, depth + 1);
        any |= is_read, all &= is_read;
      });
      open_maps_.pop_back();
      out.is_partial |= any && !all;
      return any;
    }
    out.why = "its body is " + e->type;
    return find_mesh(*e, X, out);
  }

  static bool is_boolean(const StepEntity* e) {
    return e != nullptr && (e->type == "IFCBOOLEANCLIPPINGRESULT" || e->type == "IFCBOOLEANRESULT");
  }
  /// Unions, and what half spaces cut off; what else cuts is not read.
  bool find_boolean(const StepEntity* e, const Map& X, Body& out, int depth) const {
    std::vector<const StepEntity*> cuts;  // the last one first, as they are nested
    for (; is_boolean(e) && e->at(0).text != "UNION" && cuts.size() < 1000; e = get(e->at(1))) cuts.push_back(e);
    Body part;
    if (e == nullptr || cuts.size() == 1000) {
      out.why = "its body is nested too deeply, or incomplete";
      return false;
    }
    bool is_read = false;
    if (is_boolean(e)) {
      is_read = find_item(e->at(1), X, part, depth + 1);
      is_read &= find_item(e->at(2), X, part, depth + 1);
    } else {
      StepValue base;
      base.kind = Kind::Reference, base.number = e->id;
      is_read = find_item(base, X, part, depth + 1);
    }
    for (auto cut = cuts.rbegin(); cut != cuts.rend() && is_read; ++cut)
      if (!clip_by((*cut)->at(2), (*cut)->at(0).text == "INTERSECTION", X, part)) part.is_whole = true;
    if (!part.why.empty()) out.why = part.why;
    if (!is_read) return false;
    const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
    note_round(out, part.is_round);
    append(out.shape.solids, part.shape.solids);
    append(out.shape.faces, part.shape.faces);
    out.is_cut |= part.is_cut, out.is_whole |= part.is_whole, out.is_partial |= part.is_partial;
    if (part.is_cut && part.shape.solids.empty() && part.shape.faces.empty()) out.why = "nothing is left of its body";
    return true;
  }
  /// Cuts off a half space, or all but it; false: that is not understood.
  bool clip_by(const StepValue& v, bool keeps, const Map& X, Body& part) const {
    const StepEntity* space = get(v);
    const bool is_bounded = is(space, "IFCPOLYGONALBOUNDEDHALFSPACE");
    if (!is_bounded && !is(space, "IFCHALFSPACESOLID") && !is(space, "IFCBOXEDHALFSPACE")) return false;
    const StepEntity* surface = get(space->at(0));
    if (!is(surface, "IFCPLANE") || !has_axes(surface->at(0))) return false;
    const Map X_WP = X * axis_placement(surface->at(0));
    const auto column = [](const Mat3& M, int k) { return Vec3{M(0, k), M(1, k), M(2, k)}; };
    Vec3 normal = cross(column(X_WP.M, 0), column(X_WP.M, 1));
    const double size = norm(normal);
    if (!(size > 0)) return false;
    // the normal points away from the half space if its flag is true
    const bool is_against = (space->at(1).text != "F") != (determinant(X_WP.M) < 0);
    normal = ((is_against != keeps ? -1 : 1) / size) * normal;
    if (is_bounded) {
      Shape off = part.shape;
      clip(off, {X_WP.p, -normal});
      if (off.solids.empty() && off.faces.empty()) return true;
      if (keeps || !is_bounded_around(*space, X, off)) return false;
    }
    const auto measure = [&part] {
      std::vector<double> areas;
      for (const Solid& solid : part.shape.solids) areas.push_back(norm(calc_normal(solid.loops.front())));
      return areas;
    };
    const std::vector<double> before = measure();
    part.is_cut |= clip(part.shape, {X_WP.p, normal});
    const std::vector<double> after = measure();  // a part of a circle is round no more
    part.is_round = part.is_round && std::equal(before.begin(), before.end(), after.begin(), after.end(),
                                                [](double x, double y) { return std::abs(x - y) < 1e-6 * x; });
    return true;
  }
  /// Whether the boundary of a half space lies around a shape: no corner outside, none of its own within.
  bool is_bounded_around(const StepEntity& space, const Map& X, const Shape& shape) const {
    Loop bound;
    if (!has_axes(space.at(2)) || !find_points(space.at(3), bound) || bound.size() < 3) return false;
    const Map X_WB = X * axis_placement(space.at(2));
    if (std::abs(determinant(X_WB.M)) < 1e-12) return false;
    const Mat3 back = inverse(X_WB.M);
    double x_low = 1e30, x_high = -1e30, y_low = 1e30, y_high = -1e30;
    bool is_around = true;
    const auto look = [&](const Vec3& world) {
      const Vec3 p = back * (world - X_WB.p);
      x_low = std::min(x_low, p.x), x_high = std::max(x_high, p.x);
      y_low = std::min(y_low, p.y), y_high = std::max(y_high, p.y);
      const auto is_on_edge = [&](const Vec3& a, const Vec3& b) {
        const Vec3 edge{b.x - a.x, b.y - a.y, 0}, to{p.x - a.x, p.y - a.y, 0};
        const double length = norm(edge), along = length > 1e-9 ? dot(edge, to) / length : -1;
        return along > -kNear && along < length + kNear && norm(cross(edge, to)) < kNear * length;
      };
      bool is_inside = lies_within(bound, p.x, p.y);
      for (size_t i = 0; i < bound.size() && !is_inside; ++i)
        is_inside = is_on_edge(bound[i], bound[(i + 1) % bound.size()]);
      is_around &= is_inside;
    };
    for (const Solid& solid : shape.solids)
      for (const Loop& loop : solid.loops)
        for (const Vec3& p : loop) look(p), look(p + solid.way);
    for (const Loop& face : shape.faces)
      for (const Vec3& p : face) look(p);
    return is_around && std::none_of(bound.begin(), bound.end(), [&](const Vec3& p) {
             return p.x > x_low + kNear && p.x < x_high - kNear && p.y > y_low + kNear && p.y < y_high - kNear;
           });
  }

  Body find_body(const StepEntity& e) const {
    Body out;
    const StepEntity* shape = get(e.at(6));
    if (shape == nullptr) {
      out.why = "it has no body";
      return out;
    }
    const std::optional<Pose> X = find_placement(e.at(5));
    if (!X) {
      out.why = "its placement is not understood";
      return out;
    }
    bool any = false, all = true;
    items_ = 0;
    for (const StepValue& v : shape->at(2).items) {
      const StepEntity* r = get(v);
      if (r == nullptr || (r->at(1).kind == Kind::Text && r->at(1).text != "Body")) continue;
      for (const StepValue& item : r->at(3).items) {
        const bool is_read = find_item(item, *X, out, 0);
        any |= is_read, all &= is_read;
      }
    }
    out.is_partial |= any && !all;
    if (items_ > kMostItems) out.why = kTooMany;
    measure_mesh(out);
    return out;
  }

  void find_box(const Body& body, IfcElement& e) const {
    e.is_mesh = !body.points.empty();
    e.is_cut = body.is_cut;
    e.is_whole = body.is_whole;
    e.why = body.why;
    if (body.shape.solids.empty() && body.points.size() < 6) return;
    if (body.is_partial) {
      e.why = "only a part of its body is read: " + body.why;
      return;
    }
    e.low = {1e30, 1e30, 1e30};
    e.high = {-1e30, -1e30, -1e30};
    const auto add = [&e, this](const Vec3& c) {
      const Vec3 p = turn(c);
      for (int k = 0; k < 3; ++k) e.low[k] = std::min(e.low[k], p[k]), e.high[k] = std::max(e.high[k], p[k]);
    };
    for (const Solid& solid : body.shape.solids)
      for (const Vec3& p : solid.loops.front()) add(p), add(p + solid.way);
    for (const Vec3& p : body.points) add(p);
    const Vec3 reach{std::max(-e.low.x, e.high.x), std::max(-e.low.y, e.high.y), std::max(-e.low.z, e.high.z)};
    if (!(reach.x < kFarthest && reach.y < kFarthest && reach.z < kFarthest)) {
      e.why = "its place or its size is out of range";
      return;
    }
    const Vec3 size = e.high - e.low;
    double volume = std::abs(body.volume);
    volume += calc_volume(body.shape.solids, e.low, e.high);
    const double filled = volume / (size.x * size.y * size.z), round = std::acos(-1.0) / 4;
    if (body.shape.solids.empty()) {
      e.is_round =
          e.type == "IFCCOLUMN" && std::abs(size.x - size.y) < 0.02 * size.x && std::abs(filled - round) < 0.04;
      if (e.is_round) e.diameter = find_diameter(body, 0.5 * (e.low + e.high));
      // corners of L, T and hollow shapes that fill as much of their box lie up to 1.41 of its half away
      e.is_round = e.is_round && e.diameter < kLargestCircle * size.x;
      e.has_box = filled < kOverfilled && (e.is_round || filled >= (e.type == "IFCWALL" ? kFilledWall : kFilled));
      if (!e.has_box)
        e.why = filled < kOverfilled ? "its body is a mesh that is no upright box"
                                     : "its body is a mesh that overlaps itself, or is not closed";
      if (e.has_box && e.type == "IFCWALL" && !lies_flat(body, e)) {
        e.has_box = false;
        e.why = "it is turned against the grid, or inclined";
      }
      return;
    }
    if (!(volume > 0)) {
      e.why = "its body has no volume";
      return;
    }
    const bool is_column = e.type == "IFCCOLUMN";
    const double across = is_column ? size.y : size.z, other = is_column ? size.x : std::min(size.x, size.y);
    const bool is_stretched =
        e.is_round && (is_column || e.type == "IFCBEAM") && std::abs(across - other) >= 0.02 * other;
    if (is_stretched) e.is_round = false;
    if (e.is_round) e.diameter = find_diameter(body, 0.5 * (e.low + e.high));
    const bool is_panel = e.type == "IFCWALL" || e.type == "IFCSLAB";
    if (e.type == "IFCSLAB") find_outlines(body, e);
    if (e.type == "IFCWALL") e.filled = filled;
    if (!(is_panel ? lies_flat(body, e) : filled >= kFilled * (e.is_round ? round : 1))) {
      e.why = is_stretched ? "its profile is round, but as wide as high it is not"
                           : "it is turned against the grid, or inclined";
      // an upright rectangle is turned
      const bool is_shape = std::any_of(body.shape.solids.begin(), body.shape.solids.end(), [](const Solid& solid) {
        return std::hypot(solid.way.x, solid.way.y) < 1e-3 * std::abs(solid.way.z) &&
               (solid.loops.size() > 1 || solid.loops.front().size() > 5);
      });
      if (!is_panel && !is_stretched && ((is_column && is_shape) || (!e.is_round && lies_along_axes(body))))
        e.why = "its profile does not fill its box";
    } else if (is_panel && e.outlines.empty() && !(filled >= (e.type == "IFCWALL" ? kFilledWall : kFilled))) {
      e.why = "its profile does not fill its box";
    } else if (e.plate < kPlate) {
      e.why = "its parts have several thicknesses, or lie at several heights";
    } else {
      e.has_box = true;
    }
  }
  /// Of the circle on which the corners of a round body lie, whose box hangs on the turn of its corners [m].
  double find_diameter(const Body& body, const Vec3& middle) const {
    double radius = 0;
    for (const Solid& solid : body.shape.solids) {
      const Loop& c = solid.loops.front();
      if (const auto to_centre = find_centre(c.front(), c[c.size() / 3], c[2 * c.size() / 3]))
        radius = std::max(radius, norm(*to_centre));
    }
    if (body.shape.solids.empty())
      for (const Vec3& p : body.points) {
        const Vec3 own = turn(p);
        radius = std::max(radius, std::hypot(own.x - middle.x, own.y - middle.y));
      }
    return 2 * radius;
  }
  /// Of solids that may overlap, in world axes; their box is that of building axes [m³].
  double calc_volume(const std::vector<Solid>& solids, const Vec3& low, const Vec3& high) const {
    double sum = 0;
    std::vector<std::pair<Vec3, Vec3>> boxes;
    for (const Solid& solid : solids) {
      sum += solid.volume();
      Vec3 from{1e30, 1e30, 1e30}, to{-1e30, -1e30, -1e30};
      for (const Vec3& corner : solid.loops.front())
        for (const Vec3& p : {turn(corner), turn(corner + solid.way)})
          for (int k = 0; k < 3; ++k) from[k] = std::min(from[k], p[k]), to[k] = std::max(to[k], p[k]);
      boxes.emplace_back(from, to);
    }
    const auto overlap = [](const auto& a, const auto& b) {
      for (int k = 0; k < 3; ++k)
        if (!(std::min(a.second[k], b.second[k]) - std::max(a.first[k], b.first[k]) > kNear)) return false;
      return true;
    };
    bool overlaps = false;
    for (size_t i = 0; i < boxes.size(); ++i)
      for (size_t j = 0; j < i; ++j) overlaps |= overlap(boxes[i], boxes[j]);
    constexpr size_t many = 50;
    if (!overlaps || solids.size() > many) return sum;
    std::vector<Prism> prisms;
    for (const Solid& solid : solids) prisms.emplace_back(solid);
    // by places in the middle of cells
    constexpr int cells = 32;
    const Vec3 cell = (1.0 / cells) * (high - low);
    int inside = 0;
    for (int i = 0; i < cells; ++i)
      for (int j = 0; j < cells; ++j)
        for (int k = 0; k < cells; ++k) {
          const Vec3 own{low.x + (i + 0.5) * cell.x, low.y + (j + 0.5) * cell.y, low.z + (k + 0.5) * cell.z};
          const Vec3 p = turn_back(own);
          inside += std::any_of(prisms.begin(), prisms.end(), [&](const Prism& one) { return one.contains(p); });
        }
    return cell.x * cell.y * cell.z * inside;
  }
  /// A solid, its profile in the profile's own axes.
  struct Prism {
    explicit Prism(const Solid& solid) : foot(solid.loops.front().front()), way(solid.way) {
      const Vec3 normal = calc_normal(solid.loops.front()), z = (1 / norm(normal)) * normal;
      const Vec3 across = cross(z, std::abs(z.x) < 0.9 ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
      x = (1 / norm(across)) * across, y = cross(z, x);
      per_height = (1 / dot(way, z)) * z;
      for (const Loop& loop : solid.loops) {
        flat.emplace_back();
        for (const Vec3& c : loop) flat.back().push_back({dot(c - foot, x), dot(c - foot, y), 0});
      }
    }
    bool contains(const Vec3& p) const {
      const double t = dot(p - foot, per_height);
      if (!(t >= 0 && t <= 1)) return false;
      const Vec3 q = p - t * way - foot;
      bool is_inside = false;
      for (const Loop& loop : flat) is_inside ^= lies_within(loop, dot(q, x), dot(q, y));
      return is_inside;
    }

    Vec3 foot, way, x, y, per_height;
    std::vector<Loop> flat;
  };
  /// Boxes of what is taken out of a wall. Cut, round and turned ones are not read.
  void find_openings(IfcElement& wall) const {
    if (wall.type != "IFCWALL" || !wall.has_opening) return;
    for (const StepEntity* opening : opened_.at(wall.id)) {
      IfcElement e;
      e.type = "IFCOPENINGELEMENT";
      if (opening != nullptr) {
        const Body body = find_body(*opening);
        e.is_round = body.is_round;
        find_box(body, e);
      }
      if (e.has_box && !e.is_round && !e.is_cut && !e.is_whole) {
        wall.openings.emplace_back(e.low, e.high);
      } else {
        ++wall.openings_not_read;
      }
    }
  }
  /// Whether a wall or a slab is as thick as its box.
  bool lies_flat(const Body& body, const IfcElement& e) const {
    Vec3 across;
    const auto look = [&](const Vec3& n) {
      if (norm(n) > norm(across) && (e.type == "IFCSLAB" || std::abs(n.z) < 0.5 * norm(n))) across = n;
    };
    for (const Solid& solid : body.shape.solids)
      for (const Vec3& n : solid.faces()) look(n);
    for (const Vec3& n : body.normals) look(n);
    if (!(norm(across) > 0)) return false;
    double low = 1e30, high = -1e30;
    const auto measure = [&](const Vec3& p) {
      const double d = dot(p, across) / norm(across);
      low = std::min(low, d), high = std::max(high, d);
    };
    for (const Solid& solid : body.shape.solids)
      for (const Vec3& p : solid.loops.front()) measure(p), measure(p + solid.way);
    for (const Vec3& p : body.points) measure(p);
    const Vec3 size = e.high - e.low;
    return high - low >= kFilled * (e.type == "IFCSLAB" ? size.z : std::min(size.x, size.y));
  }
  /// Whether nearly all of its faces do.
  bool lies_along_axes(const Body& body) const {
    double along = 0, all = 0;
    for (const Solid& solid : body.shape.solids)
      for (const Vec3& n : solid.faces()) {
        const Vec3 own = turn(n);
        all += norm(n);
        if (std::max({std::abs(own.x), std::abs(own.y), std::abs(own.z)}) > 0.999 * norm(n)) along += norm(n);
      }
    return along >= kFilled * all;
  }
  /// Outlines of a slab whose solids are upright. It is a plate, which ribs, kerbs and drop panels stand on or hang
  /// from: what has the height of the solid that covers most.
  void find_outlines(const Body& body, IfcElement& e) const {
    if (!body.points.empty()) return;
    for (const Solid& solid : body.shape.solids)
      if (std::hypot(solid.way.x, solid.way.y) > 1e-3 * std::abs(solid.way.z)) return;
    struct Layer {
      double low = 0, high = 0, area = 0;
    };
    const auto layer_of = [](const Solid& solid) {
      const double z = solid.loops.front().front().z;
      const auto [low, high] = std::minmax({z, z + solid.way.z});
      return Layer{low, high, solid.volume() / (high - low)};
    };
    const auto is_near = [](double a, double b) { return std::abs(a - b) < kLevel; };
    Layer most;
    for (const Solid& solid : body.shape.solids)
      if (const Layer layer = layer_of(solid); layer.area > most.area) most = layer;
    // what covers as much right above or below it is a layer of the plate
    std::vector<Layer> layers{most};
    double low = most.low, high = most.high;
    for (size_t known = 0; known != layers.size();) {
      known = layers.size();
      for (const Solid& solid : body.shape.solids) {
        const Layer layer = layer_of(solid);
        if (layer.area < kFilled * most.area || !(is_near(layer.low, high) || is_near(layer.high, low))) continue;
        low = std::min(low, layer.low), high = std::max(high, layer.high);
        layers.push_back(layer);
      }
    }
    double all = 0, plate = 0;
    for (const Solid& solid : body.shape.solids) {
      all += solid.volume();
      const Layer own = layer_of(solid);
      if (std::none_of(layers.begin(), layers.end(),
                       [&](const Layer& l) { return is_near(own.low, l.low) && is_near(own.high, l.high); }))
        continue;
      plate += solid.volume();
      std::vector<Loop> loops = solid.loops;
      for (Loop& loop : loops)
        for (Vec3& p : loop) p = turn(p);
      e.outlines.push_back(std::move(loops));
    }
    e.plate = plate / all;
    if (e.plate >= kPlate) e.low.z = low, e.high.z = high;
  }

  IfcMaterial material_of(int id) const {
    if (const auto own = material_.find(id); own != material_.end()) return own->second;
    if (const auto type = type_of_.find(id); type != type_of_.end())
      if (const auto of = material_.find(type->second); of != material_.end()) return of->second;
    return {};
  }

  /// Of the edges of all bodies and the middles of columns.
  void find_angle(const std::vector<Body>& bodies) {
    std::vector<Vec3> edges;
    const auto add = [&](const Vec3& d) {
      const double length = std::hypot(d.x, d.y);
      if (length > 1e-6 && length < kFarthest) edges.push_back(d);
    };
    std::vector<Vec3> columns;
    for (size_t b = 0; b < bodies.size(); ++b) {
      Vec3 sum;
      size_t n = 0;
      for (const Solid& solid : bodies[b].shape.solids) {
        const Loop& c = solid.loops.front();
        for (size_t i = 0; i < c.size(); ++i) {
          sum += c[i] + 0.5 * solid.way, ++n;
          if (!bodies[b].is_round) add(c[(i + 1) % c.size()] - c[i]), add(solid.way);
        }
      }
      for (const Vec3& p : bodies[b].points) sum += p, ++n;
      // upright faces, as triangles have diagonals
      for (const Vec3& f : bodies[b].normals)
        if (std::abs(f.z) < 1e-3 * norm(f)) add(f);
      if (n > 0 && out_.elements[b].type == "IFCCOLUMN" &&
          std::hypot(sum.x, sum.y) < kFarthest * static_cast<double>(n))
        columns.push_back((1.0 / static_cast<double>(n)) * sum);
    }
    out_.angle = find_grid_angle(edges, columns);
  }
  Vec3 turn(const Vec3& p) const {
    const double c = std::cos(out_.angle), s = std::sin(out_.angle);
    return {c * p.x + s * p.y, -s * p.x + c * p.y, p.z};
  }
  Vec3 turn_back(const Vec3& p) const {
    const double c = std::cos(out_.angle), s = std::sin(out_.angle);
    return {c * p.x - s * p.y, s * p.x + c * p.y, p.z};
  }

  /// Axes of bars, in world axes before the turn.
  void find_disks(const StepValue& v, const Map& X, std::vector<std::vector<Vec3>>& out, double& radius,
                  int depth) const {
    const StepEntity* e = get(v);
    if (++items_ > kMostItems || e == nullptr || depth > 10) return;
    if (e->type == "IFCSWEPTDISKSOLID" || e->type == "IFCSWEPTDISKSOLIDPOLYGONAL") {
      std::vector<Vec3> line;
      if (!find_points(e->at(0), line)) return;
      for (Vec3& p : line) p = X * p;
      out.push_back(std::move(line));
      radius = e->at(1).number * out_.length_unit * std::cbrt(std::abs(determinant(X.M)));
    } else if (e->type == "IFCEXTRUDEDAREASOLID") {
      const StepEntity* profile = get(e->at(0));
      if (!is(profile, "IFCCIRCLEPROFILEDEF")) return;
      const Map X_WP = X * axis_placement(e->at(1));
      out.push_back({X_WP.p, X_WP * (e->at(3).number * out_.length_unit * direction(e->at(2), {0, 0, 1}))});
      radius = profile->at(3).number * out_.length_unit * std::cbrt(std::abs(determinant(X.M)));
    } else if (e->type == "IFCMAPPEDITEM") {
      const int source = e->at(0).id();
      if (std::find(open_maps_.begin(), open_maps_.end(), source) != open_maps_.end()) {
        items_ = kMostItems + 1;
        return;
      }
      open_maps_.push_back(source);
      for_mapped_items(*e, X,
                       [&](const StepValue& item, const Map& X_WI) { find_disks(item, X_WI, out, radius, depth + 1); });
      open_maps_.pop_back();
    }
  }

  /// The element that a part belongs to, also through assemblies; 0 if none.
  int host_of(int id) const {
    for (int depth = 0; depth < 10; ++depth) {
      const auto whole = whole_of_.find(id);
      if (whole == whole_of_.end()) return 0;
      id = whole->second;
      const StepEntity* e = file_.find(id);
      if (e != nullptr && element_types().count(e->type) != 0) return id;
    }
    return 0;
  }

  /// One bar of the plan for each axis of an entity, as programs write groups of bars into one; what the bar does not
  /// say its type does.
  void read_bars() {
    for (const StepEntity* e : file_.of_type("IFCREINFORCINGBAR")) {
      IfcBar bar;
      const auto type_id = type_of_.find(e->id);
      const StepEntity* type = type_id == type_of_.end() ? nullptr : file_.find(type_id->second);
      if (!is(type, "IFCREINFORCINGBARTYPE")) type = nullptr;
      bar.grade = e->at(8).text.empty() ? material_of(e->id).name : e->at(8).text;
      bar.diameter = e->at(9).number * out_.length_unit;
      std::string role = e->at(12).text;
      if (role.empty() && type != nullptr) role = type->at(9).text;
      if (bar.diameter <= 0 && type != nullptr) bar.diameter = type->at(10).number * out_.length_unit;
      bar.host = host_of(e->id);
      const std::optional<Pose> placed = find_placement(e->at(5));
      const Pose X = placed.value_or(Pose{});
      bar.has_place = placed.has_value();
      std::vector<std::vector<Vec3>> axes;
      double radius = 0;
      items_ = 0;
      if (const StepEntity* shape = get(e->at(6)); shape != nullptr && placed)
        for (const StepValue& v : shape->at(2).items)
          if (const StepEntity* r = get(v); r != nullptr && r->at(1).text != "Axis")
            for (const StepValue& item : r->at(3).items) find_disks(item, X, axes, radius, 0);
      if (items_ > kMostItems) {
        ++out_.bars_left_out;
        continue;
      }
      if (bar.diameter <= 0) bar.diameter = 2 * radius;
      const bool is_told = !role.empty() && role != "NOTDEFINED" && role != "USERDEFINED";
      bar.is_main = !(role == "LIGATURE" || role == "SHEAR" || role == "RING");
      if (axes.empty()) {
        bar.place = turn(X.p);
        out_.bars.push_back(std::move(bar));
        continue;
      }
      for (const std::vector<Vec3>& line : axes) {
        double length = 0, longest = 0;
        bar.has_place = bar.has_axis = true;
        bar.place = bar.low = bar.high = turn(line.front());
        for (size_t i = 1; i < line.size(); ++i) {
          const Vec3 a = turn(line[i - 1]), b = turn(line[i]);
          const double part = norm(b - a);
          length += part;
          if (part > longest) {
            longest = part;
            bar.place = 0.5 * (a + b);
          }
          bar.low = {std::min(bar.low.x, b.x), std::min(bar.low.y, b.y), std::min(bar.low.z, b.z)};
          bar.high = {std::max(bar.high.x, b.x), std::max(bar.high.y, b.y), std::max(bar.high.z, b.z)};
        }
        if (!is_told) bar.is_main = norm(line.back() - line.front()) >= kStraight * length;
        out_.bars.push_back(bar);
      }
    }
  }

  const StepFile& file_;
  mutable std::vector<int> open_maps_;  // sources of the mapped items that are being read
  mutable int items_ = 0;               // of the body or bar that is being read
  const std::string& name_;
  IfcBuilding out_;
  double angle_unit_ = 1;  // of parameters of circles [rad]
  std::map<int, IfcMaterial> material_;
  std::map<int, int> type_of_, whole_of_;
  std::map<int, std::vector<const StepEntity*>> opened_;  // openings of elements
};

}  // namespace

IfcBuilding read_ifc(const std::string& text, const std::string& name) {
  const StepFile file = read_step(text, name);
  const auto fail = [&](const std::string& what, const std::string& help) {
    throw InputError(std::vector<Diagnostic>{{Severity::Error, "E112", {name, 0, 0}, 1, what, help}});
  };
  // IFC2X3, also as IFC2X3_TC1, and IFC4 with its addenda
  static const std::set<std::string, std::less<>> known{"IFC2X3",    "IFC2X3_TC1", "IFC2X3_FINAL", "IFC4",
                                                        "IFC4_ADD1", "IFC4_ADD2",  "IFC4_ADD2_TC1"};
  if (known.count(file.schema) == 0)
    fail("its schema is \"" + file.schema + "\"", "IFC2X3 and IFC4 are read; export it as one of them");
  IfcBuilding out = Reader(file, name).read();
  if (std::none_of(out.elements.begin(), out.elements.end(),
                   [](const IfcElement& e) { return e.type == "IFCCOLUMN" && e.has_box; })) {
    std::string help = "a plan's grid is made from its columns";
    for (const IfcElement& e : out.elements)
      if (e.type == "IFCCOLUMN" && !e.why.empty()) {
        help += "; of the first one, " + e.why;
        break;
      }
    fail("it has no columns whose body is an extruded profile", help);
  }
  return out;
}

}  // namespace topple::product
