#include "mbs/model.h"

#include <utility>

#include "base/error.h"
#include "mbs/model_check.h"

namespace topple::mbs {

BodyId add_body(Model& model, Body body) {
  model.bodies.push_back(std::move(body));
  return {static_cast<int>(model.bodies.size()) - 1};
}

JointId add_joint(Model& model, Joint joint) {
  model.joints.push_back(std::move(joint));
  return {static_cast<int>(model.joints.size()) - 1};
}

ElementId add_element(Model& model, ZoneElement element) {
  model.elements.push_back(std::move(element));
  return {static_cast<int>(model.elements.size()) - 1};
}

LawId add_law(Model& model, SharedLaw law) {
  model.laws.push_back(std::move(law));
  return {static_cast<int>(model.laws.size()) - 1};
}

void check_model(const Model& model) {
  std::vector<Diagnostic> found;
  for (const Complaint& c : find_complaints(model)) {
    Diagnostic d;
    d.code = "E601";
    d.message = c.message();
    found.push_back(std::move(d));
  }
  if (!found.empty()) throw InputError(std::move(found));
}

}  // namespace topple::mbs
