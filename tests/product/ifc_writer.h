#pragma once
/// Small IFC files for tests, entity by entity.

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "product/import.h"

namespace topple::product {

inline std::string ifc_file(const std::string& schema, const std::string& body) {
  return "ISO-10303-21;\nHEADER;\nFILE_SCHEMA(('" + schema + "'));\nENDSEC;\nDATA;\n" + body +
         "ENDSEC;\nEND-ISO-10303-21;\n";
}

/// Writes entities and gives their references, "#7".
class Writer {
 public:
  std::string add(const std::string& text) {
    const std::string id = "#" + std::to_string(++last_);
    body_ += id + "=" + text + ";\n";
    return id;
  }
  static std::string tuple(std::initializer_list<double> values) {
    std::string out;
    for (const double v : values) out += (out.empty() ? "(" : ",") + std::to_string(v);
    return out + ")";
  }
  std::string point(double x, double y, double z) { return add("IFCCARTESIANPOINT(" + tuple({x, y, z}) + ")"); }
  std::string placement(const std::string& parent, double x, double y, double z) {
    return add("IFCLOCALPLACEMENT(" + parent + "," + add("IFCAXIS2PLACEMENT3D(" + point(x, y, z) + ",$,$)") + ")");
  }
  std::string shape(const std::string& type, const std::string& items) {
    return add("IFCPRODUCTDEFINITIONSHAPE($,$,(" +
               add("IFCSHAPEREPRESENTATION($,'Body','" + type + "',(" + items + "))") + "))");
  }
  std::string extrusion(const std::string& profile, double depth) {
    return add("IFCEXTRUDEDAREASOLID(" + profile + ",$," + add("IFCDIRECTION((0.,0.,1.))") + "," +
               std::to_string(depth) + ")");
  }
  std::string rectangle(double x, double y) {
    return add("IFCRECTANGLEPROFILEDEF(.AREA.,$,$," + std::to_string(x) + "," + std::to_string(y) + ")");
  }
  std::string element(const std::string& type, const std::string& place, const std::string& body) {
    return add(type + "('g',$,'" + type + "',$,$," + place + "," + body + ",'1',$)");
  }
  /// A box from its foot's middle, as a triangulated face set.
  std::string triangulated(double w, double d, double h) {
    const double x = w / 2, y = d / 2;
    const std::string list = add("IFCCARTESIANPOINTLIST3D((" + tuple({-x, -y, 0}) + "," + tuple({x, -y, 0}) + "," +
                                 tuple({x, y, 0}) + "," + tuple({-x, y, 0}) + "," + tuple({-x, -y, h}) + "," +
                                 tuple({x, -y, h}) + "," + tuple({x, y, h}) + "," + tuple({-x, y, h}) + "))");
    return add(
        "IFCTRIANGULATEDFACESET(" + list +
        ",$,.T.,((1,3,2),(1,4,3),(5,6,7),(5,7,8),(1,2,6),(1,6,5),(2,3,7),(2,7,6),(3,4,8),(3,8,7),(4,1,5),(4,5,8)),$)");
  }
  /// The same as a brep of polyloops, its foot's area `share` of its head's (a prism if 1).
  std::string brep(double w, double d, double h, double share = 1) {
    std::vector<std::string> p;
    for (int i = 0; i < 8; ++i) {
      const double s = i < 4 ? share : 1;
      p.push_back(
          point((i % 4 == 1 || i % 4 == 2 ? 0.5 : -0.5) * w * s, (i % 4 >= 2 ? 0.5 : -0.5) * d * s, i < 4 ? 0 : h));
    }
    std::string faces;
    for (const auto& f :
         {std::array{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}) {
      std::string loop;
      for (const int i : f) loop += (loop.empty() ? "" : ",") + p[static_cast<size_t>(i)];
      faces += (faces.empty() ? "" : ",") +
               add("IFCFACE((" + add("IFCFACEOUTERBOUND(" + add("IFCPOLYLOOP((" + loop + "))") + ",.T.)") + "))");
    }
    return add("IFCFACETEDBREP(" + add("IFCCLOSEDSHELL((" + faces + "))") + ")");
  }
  void material(const std::string& name, const std::string& elements) {
    add("IFCRELASSOCIATESMATERIAL('g',$,$,$,(" + elements + ")," + add("IFCMATERIAL('" + name + "')") + ")");
  }
  void metres() { add("IFCUNITASSIGNMENT((" + add("IFCSIUNIT(*,.LENGTHUNIT.,$,.METRE.)") + "))"); }
  const std::string& str() const { return body_; }

 private:
  std::string body_;
  int last_ = 0;
};

inline Import import(const std::string& schema, const Writer& w) {
  return make_plan_text(read_ifc(ifc_file(schema, w.str()), "b.ifc"), "b.ifc");
}

/// Columns of two storeys at the corners of 6 m x 5 m.
inline void add_columns(Writer& w, const std::string& site, const std::function<std::string()>& make_body) {
  for (int s = 0; s < 2; ++s)
    for (const double x : {0.0, 6.0})
      for (const double y : {0.0, 5.0}) w.element("IFCCOLUMN", w.placement(site, x, y, 3 * s), make_body());
}

/// Columns of 40 cm x 40 cm, 3 m high, at the corners of 6 m x 5 m; their references, "#7,#12".
inline std::string add_square_columns(Writer& w) {
  std::string columns;
  for (const double x : {0.0, 6.0})
    for (const double y : {0.0, 5.0})
      columns += (columns.empty() ? "" : ",") + w.element("IFCCOLUMN", w.placement("$", x, y, 0),
                                                          w.shape("SweptSolid", w.extrusion(w.rectangle(0.4, 0.4), 3)));
  return columns;
}

}  // namespace topple::product
