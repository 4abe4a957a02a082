#include "product/ifc_kinds.h"

namespace topple::product {

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
                                           "IFCSLABELEMENTEDCASE",
                                           "IFCWALLELEMENTEDCASE",
                                           "IFCPILE",
                                           "IFCSTAIR",
                                           "IFCROOF"};
  return types;
}

const std::set<std::string>& other_types() {
  static const std::set<std::string> types{"IFCBEARING",
                                           "IFCBUILDINGELEMENTCOMPONENT",
                                           "IFCBUILDINGELEMENTPART",
                                           "IFCBUILDINGELEMENTPROXY",
                                           "IFCCAISSONFOUNDATION",
                                           "IFCCHIMNEY",
                                           "IFCCOVERING",
                                           "IFCCURTAINWALL",
                                           "IFCDEEPFOUNDATION",
                                           "IFCDOOR",
                                           "IFCDOORSTANDARDCASE",
                                           "IFCMEMBERSTANDARDCASE",
                                           "IFCPLATE",
                                           "IFCPLATESTANDARDCASE",
                                           "IFCRAILING",
                                           "IFCRAMP",
                                           "IFCRAMPFLIGHT",
                                           "IFCREINFORCINGMESH",
                                           "IFCSHADINGDEVICE",
                                           "IFCSTAIRFLIGHT",
                                           "IFCTENDON",
                                           "IFCTENDONANCHOR",
                                           "IFCWINDOW",
                                           "IFCWINDOWSTANDARDCASE"};
  return types;
}

namespace {

const StepEntity* get(const StepFile& file, const StepValue& v) {
  return v.kind == StepValue::Kind::Reference ? file.find(v.id()) : nullptr;
}
bool is(const StepEntity* e, const char* type) { return e != nullptr && e->type == type; }
bool is_layer(const StepEntity* e) { return is(e, "IFCMATERIALLAYER") || is(e, "IFCMATERIALLAYERWITHOFFSETS"); }

std::string name_of_material(const StepFile& file, const StepValue& v, int depth) {
  const StepEntity* e = get(file, v);
  if (e == nullptr || depth > 6) return {};
  if (e->type == "IFCMATERIAL") return e->at(0).text;
  if (is_layer(e) || e->type == "IFCMATERIALLAYERSETUSAGE" || e->type == "IFCMATERIALPROFILESETUSAGE" ||
      e->type == "IFCMATERIALPROFILESETUSAGETAPERING")
    return name_of_material(file, e->at(0), depth + 1);
  if (e->type == "IFCMATERIALPROFILE" || e->type == "IFCMATERIALPROFILEWITHOFFSETS" ||
      e->type == "IFCMATERIALCONSTITUENT")
    return name_of_material(file, e->at(2), depth + 1);
  const StepValue& list = e->at(e->type == "IFCMATERIALPROFILESET" || e->type == "IFCMATERIALCONSTITUENTSET" ? 2 : 0);
  // of several layers the thickest one carries, of constituents the largest share, or the first
  double thickest = -1;
  const StepValue* carrying = nullptr;
  for (const StepValue& item : list.items) {
    const StepEntity* layer = get(file, item);
    const double t = is_layer(layer)                       ? layer->at(1).number
                     : is(layer, "IFCMATERIALCONSTITUENT") ? layer->at(3).number
                                                           : 0;
    if (t > thickest) thickest = t, carrying = &item;
  }
  return carrying == nullptr ? std::string() : name_of_material(file, *carrying, depth + 1);
}

}  // namespace

std::map<int, std::string> read_materials(const StepFile& file) {
  std::map<int, std::string> out;
  for (const StepEntity* r : file.of_type("IFCRELASSOCIATESMATERIAL"))
    for (const StepValue& v : r->at(4).items) out[v.id()] = name_of_material(file, r->at(5), 0);
  return out;
}

}  // namespace topple::product
