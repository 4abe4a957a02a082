#include "product/ifc_kinds.h"

#include <vector>

#include "product/ifc_names.h"

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

/// Of several layers that which carries, and their thicknesses.
IfcMaterial find_carrying(const StepFile& file, const std::vector<StepValue>& items) {
  IfcMaterial out;
  std::map<std::string, double> all;
  bool carries = false;
  double thickest = -1;
  for (const StepValue& item : items) {
    const StepEntity* layer = get(file, item);
    if (!is_layer(layer)) continue;
    const StepEntity* material = get(file, layer->at(0));
    const std::string name = is(material, "IFCMATERIAL") ? material->at(0).text : "";
    const double t = layer->at(1).number;
    const bool is_structure = t > 0 && (find_class(name) || is_concrete(name) || is_masonry(name));
    all[name] += t, out.layers += t;
    if (carries && (!is_structure || t <= thickest)) continue;
    if (!carries && !is_structure && t <= thickest) continue;
    carries = is_structure, thickest = t, out.name = name;
  }
  out.carrying = all[out.name];
  return out;
}

IfcMaterial find_material(const StepFile& file, const StepValue& v, int depth) {
  const StepEntity* e = get(file, v);
  if (e == nullptr || depth > 6) return {};
  if (e->type == "IFCMATERIAL") return {e->at(0).text, 0, 0};
  if (is_layer(e) || e->type == "IFCMATERIALLAYERSETUSAGE" || e->type == "IFCMATERIALPROFILESETUSAGE" ||
      e->type == "IFCMATERIALPROFILESETUSAGETAPERING")
    return find_material(file, e->at(0), depth + 1);
  if (e->type == "IFCMATERIALPROFILE" || e->type == "IFCMATERIALPROFILEWITHOFFSETS" ||
      e->type == "IFCMATERIALCONSTITUENT")
    return find_material(file, e->at(2), depth + 1);
  if (e->type == "IFCMATERIALLAYERSET") return find_carrying(file, e->at(0).items);
  const StepValue& list = e->at(e->type == "IFCMATERIALPROFILESET" || e->type == "IFCMATERIALCONSTITUENTSET" ? 2 : 0);
  // of constituents the largest share, or the first
  double largest = -1;
  const StepValue* found = nullptr;
  for (const StepValue& item : list.items) {
    const StepEntity* part = get(file, item);
    const double share = is(part, "IFCMATERIALCONSTITUENT") ? part->at(3).number : 0;
    if (share > largest) largest = share, found = &item;
  }
  return found == nullptr ? IfcMaterial{} : find_material(file, *found, depth + 1);
}

}  // namespace

std::map<int, IfcMaterial> read_materials(const StepFile& file) {
  std::map<int, IfcMaterial> out;
  for (const StepEntity* r : file.of_type("IFCRELASSOCIATESMATERIAL"))
    for (const StepValue& v : r->at(4).items) out[v.id()] = find_material(file, r->at(5), 0);
  return out;
}

}  // namespace topple::product
