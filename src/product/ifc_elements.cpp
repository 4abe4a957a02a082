#include "product/ifc_elements.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/error.h"
#include "base/unit.h"

namespace topple::product {

namespace {

using Kind = StepValue::Kind;

const std::set<std::string>& element_types() {
  static const std::set<std::string> types{"IFCCOLUMN",
                                           "IFCBEAM",
                                           "IFCSLAB",
                                           "IFCWALL",
                                           "IFCWALLSTANDARDCASE",
                                           "IFCFOOTING",
                                           "IFCMEMBER",
                                           "IFCCOLUMNSTANDARDCASE",
                                           "IFCBEAMSTANDARDCASE",
                                           "IFCSLABSTANDARDCASE",
                                           "IFCPILE",
                                           "IFCSTAIR",
                                           "IFCROOF"};
  return types;
}

class Reader {
 public:
  Reader(const StepFile& file) : file_(file) {}

  IfcBuilding read() {
    out_.schema = file_.schema;
    read_units();
    for (const StepEntity* b : file_.of_type("IFCBUILDING")) out_.name = b->at(2).text;
    for (const StepEntity* s : file_.of_type("IFCBUILDINGSTOREY")) {
      const double z = s->at(9).kind == Kind::Number ? s->at(9).number * out_.length_unit : placement(s->at(5)).p.z;
      out_.storeys.emplace_back(s->at(2).text, z);
    }
    std::stable_sort(out_.storeys.begin(), out_.storeys.end(),
                     [](const auto& a, const auto& b) { return a.second < b.second; });
    read_materials();
    for (const StepEntity* r : file_.of_type("IFCRELAGGREGATES"))
      for (const StepValue& part : r->at(5).items) whole_of_[part.id()] = r->at(4).id();
    std::vector<std::vector<Vec3>> corners;
    for (const auto& [id, e] : file_.entities) {
      if (element_types().count(e.type) == 0) continue;
      IfcElement element;
      element.type = e.type;
      if (const size_t tail = element.type.find("STANDARDCASE"); tail != std::string::npos) element.type.resize(tail);
      element.name = e.at(2).text;
      element.id = id;
      element.material = material_of(id);
      corners.emplace_back();
      element.has_box = find_corners(e, corners.back(), element.is_round);
      out_.elements.push_back(std::move(element));
    }
    find_angle(corners);
    for (size_t i = 0; i < corners.size(); ++i) {
      IfcElement& e = out_.elements[i];
      if (!e.has_box) continue;
      e.low = {1e30, 1e30, 1e30};
      e.high = {-1e30, -1e30, -1e30};
      for (const Vec3& c : corners[i]) {
        const Vec3 p = turn(c);
        for (int k = 0; k < 3; ++k) e.low[k] = std::min(e.low[k], p[k]), e.high[k] = std::max(e.high[k], p[k]);
      }
    }
    read_bars();
    return std::move(out_);
  }

 private:
  const StepEntity* get(const StepValue& v) const { return v.kind == Kind::Reference ? file_.find(v.id()) : nullptr; }
  bool is(const StepEntity* e, const char* type) const { return e != nullptr && e->type == type; }

  void read_units() {
    for (const StepEntity* a : file_.of_type("IFCUNITASSIGNMENT"))
      for (const StepValue& v : a->at(0).items) {
        const StepEntity* u = get(v);
        if (u == nullptr || u->at(1).text != "LENGTHUNIT") continue;
        if (u->type == "IFCSIUNIT") {
          const std::string prefix = u->at(2).text;
          out_.length_unit = prefix == "MILLI"   ? 1e-3
                             : prefix == "CENTI" ? 1e-2
                             : prefix == "DECI"  ? 0.1
                             : prefix == "KILO"  ? 1e3
                                                 : 1.0;
        } else if (u->type == "IFCCONVERSIONBASEDUNIT") {
          const StepEntity* measure = get(u->at(3));
          const StepEntity* base = measure == nullptr ? nullptr : get(measure->at(1));
          if (measure == nullptr) continue;
          out_.length_unit = measure->at(0).number * (base != nullptr && base->at(2).text == "MILLI" ? 1e-3 : 1.0);
        }
      }
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
  Pose placement(const StepValue& v, int depth = 0) const {
    const StepEntity* e = get(v);
    if (!is(e, "IFCLOCALPLACEMENT") || depth > 50) return {};
    return placement(e->at(0), depth + 1) * axis_placement(e->at(1));
  }

  /// Corners of a profile's box in its own plane.
  bool find_profile(const StepValue& v, std::vector<Vec3>& out, bool& is_round) const {
    const StepEntity* e = get(v);
    if (e == nullptr) return false;
    const double u = out_.length_unit;
    double x = 0, y = 0;
    if (e->type == "IFCRECTANGLEPROFILEDEF" || e->type == "IFCROUNDEDRECTANGLEPROFILEDEF") {
      x = 0.5 * e->at(3).number * u, y = 0.5 * e->at(4).number * u;
    } else if (e->type == "IFCCIRCLEPROFILEDEF") {
      x = y = e->at(3).number * u;
      is_round = true;
    } else if (e->type == "IFCARBITRARYCLOSEDPROFILEDEF" || e->type == "IFCARBITRARYPROFILEDEFWITHVOIDS") {
      const StepEntity* curve = get(e->at(2));
      if (!is(curve, "IFCPOLYLINE")) return false;
      for (const StepValue& p : curve->at(0).items) out.push_back(u * point(p));
      return out.size() >= 3;
    } else {
      return false;
    }
    const Pose at = axis_placement(e->at(2));
    for (const Vec3& c : {Vec3{-x, -y, 0}, Vec3{x, -y, 0}, Vec3{x, y, 0}, Vec3{-x, y, 0}}) out.push_back(at * c);
    return x > 0 && y > 0;
  }

  bool find_item(const StepValue& v, const Pose& X, std::vector<Vec3>& out, bool& is_round, int depth) const {
    const StepEntity* e = get(v);
    if (e == nullptr || depth > 10) return false;
    if (e->type == "IFCEXTRUDEDAREASOLID") {
      std::vector<Vec3> profile;
      if (!find_profile(e->at(0), profile, is_round)) return false;
      const Pose X_WP = X * axis_placement(e->at(1));
      const Vec3 way = e->at(3).number * out_.length_unit * direction(e->at(2), {0, 0, 1});
      for (const Vec3& p : profile) {
        out.push_back(X_WP * p);
        out.push_back(X_WP * (p + way));
      }
      return true;
    }
    if (e->type == "IFCBOOLEANCLIPPINGRESULT" || e->type == "IFCBOOLEANRESULT")
      return find_item(e->at(1), X, out, is_round, depth + 1);
    if (e->type == "IFCMAPPEDITEM") {
      const StepEntity *map = get(e->at(0)), *target = get(e->at(1));
      if (map == nullptr || target == nullptr) return false;
      const Vec3 x = direction(target->at(0), {1, 0, 0}), y = direction(target->at(1), {0, 1, 0});
      const Vec3 z = direction(target->at(4), cross(x, y));
      const Pose at{out_.length_unit * point(target->at(2)), to_quat(Mat3::from_columns(x, y, z))};
      const StepEntity* body = get(map->at(1));
      bool any = false;
      if (body != nullptr)
        for (const StepValue& item : body->at(3).items)
          any |= find_item(item, X * at * inverse(axis_placement(map->at(0))), out, is_round, depth + 1);
      return any;
    }
    return false;
  }

  bool find_corners(const StepEntity& e, std::vector<Vec3>& out, bool& is_round) const {
    const StepEntity* shape = get(e.at(6));
    if (shape == nullptr) return false;
    const Pose X = placement(e.at(5));
    bool any = false;
    for (const StepValue& v : shape->at(2).items) {
      const StepEntity* r = get(v);
      if (r == nullptr || (r->at(1).kind == Kind::Text && r->at(1).text != "Body")) continue;
      for (const StepValue& item : r->at(3).items) any |= find_item(item, X, out, is_round, 0);
    }
    return any && out.size() >= 6;
  }

  void read_materials() {
    for (const StepEntity* r : file_.of_type("IFCRELASSOCIATESMATERIAL"))
      for (const StepValue& v : r->at(4).items) material_[v.id()] = name_of_material(r->at(5), 0);
    for (const StepEntity* r : file_.of_type("IFCRELDEFINESBYTYPE"))
      for (const StepValue& v : r->at(4).items) type_of_[v.id()] = r->at(5).id();
  }
  std::string name_of_material(const StepValue& v, int depth) const {
    const StepEntity* e = get(v);
    if (e == nullptr || depth > 6) return {};
    if (e->type == "IFCMATERIAL") return e->at(0).text;
    if (e->type == "IFCMATERIALLAYER" || e->type == "IFCMATERIALLAYERSETUSAGE" ||
        e->type == "IFCMATERIALPROFILESETUSAGE")
      return name_of_material(e->at(0), depth + 1);
    if (e->type == "IFCMATERIALPROFILE") return name_of_material(e->at(2), depth + 1);
    const StepValue& list = e->at(e->type == "IFCMATERIALPROFILESET" ? 2 : 0);
    // of several layers the thickest one carries
    double thickest = -1;
    std::string name;
    for (const StepValue& item : list.items) {
      const StepEntity* layer = get(item);
      const double t = is(layer, "IFCMATERIALLAYER") ? layer->at(1).number : 0;
      if (t > thickest) thickest = t, name = name_of_material(item, depth + 1);
    }
    return name;
  }
  std::string material_of(int id) const {
    if (const auto own = material_.find(id); own != material_.end()) return own->second;
    if (const auto type = type_of_.find(id); type != type_of_.end())
      if (const auto of = material_.find(type->second); of != material_.end()) return of->second;
    return {};
  }

  /// The direction that most of the plan's edges have, modulo a right angle, by their length.
  void find_angle(const std::vector<std::vector<Vec3>>& corners) {
    double c = 0, s = 0;
    for (const auto& all : corners)
      for (size_t i = 0; i + 2 < all.size(); i += 2) {
        const Vec3 d = all[i + 2] - all[i];
        const double length = std::hypot(d.x, d.y), a = 4 * std::atan2(d.y, d.x);
        c += length * std::cos(a), s += length * std::sin(a);
      }
    out_.angle = std::hypot(c, s) > 0 ? std::atan2(s, c) / 4 : 0;
    if (std::abs(out_.angle) < 1e-4) out_.angle = 0;
  }
  Vec3 turn(const Vec3& p) const {
    const double c = std::cos(out_.angle), s = std::sin(out_.angle);
    return {c * p.x + s * p.y, -s * p.x + c * p.y, p.z};
  }

  void read_bars() {
    for (const StepEntity* e : file_.of_type("IFCREINFORCINGBAR")) {
      IfcBar bar;
      bar.grade = e->at(8).text;
      bar.diameter = e->at(9).number * out_.length_unit;
      const std::string role = e->at(12).text;
      bar.is_main = !(role == "LIGATURE" || role == "SHEAR" || role == "RING");
      if (const auto whole = whole_of_.find(e->id); whole != whole_of_.end()) bar.host = whole->second;
      Pose X = placement(e->at(5));
      bar.has_place = e->at(5).kind == Kind::Reference;
      if (const StepEntity* shape = get(e->at(6)))
        for (const StepValue& v : shape->at(2).items)
          if (const StepEntity* r = get(v))
            for (const StepValue& item : r->at(3).items)
              if (const StepEntity* disk = get(item); is(disk, "IFCSWEPTDISKSOLID"))
                if (const StepEntity* line = get(disk->at(0)); is(line, "IFCPOLYLINE") && !line->at(0).items.empty())
                  X = X * Pose{out_.length_unit * point(line->at(0).items[0]), {}};
      bar.place = turn(X.p);
      out_.bars.push_back(std::move(bar));
    }
  }

  const StepFile& file_;
  IfcBuilding out_;
  std::map<int, std::string> material_;
  std::map<int, int> type_of_, whole_of_;
};

}  // namespace

IfcBuilding read_ifc(const std::string& text, const std::string& name) {
  const StepFile file = read_step(text, name);
  const auto fail = [&](const std::string& what, const std::string& help) {
    throw InputError(std::vector<Diagnostic>{{Severity::Error, "E112", {name, 0, 0}, 1, what, help}});
  };
  if (file.schema.rfind("IFC2X3", 0) != 0 && file.schema.rfind("IFC4", 0) != 0)
    fail("its schema is \"" + file.schema + "\"", "IFC2X3 and IFC4 are understood");
  IfcBuilding out = Reader(file).read();
  if (std::none_of(out.elements.begin(), out.elements.end(),
                   [](const IfcElement& e) { return e.type == "IFCCOLUMN" && e.has_box; }))
    fail("it has no columns whose body is an extruded profile", "a plan's grid is made from its columns");
  return out;
}

}  // namespace topple::product
