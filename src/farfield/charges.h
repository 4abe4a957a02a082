#pragma once
/// What charges do to the elements of their members, and what they leave of them; docs/fe.md, "Charges".

#include <string>
#include <vector>

#include "collapse/knowledge.h"
#include "farfield/grid.h"
#include "fem/explicit_model.h"

namespace topple::farfield {

/// Elements that a charge takes away.
struct ChargeElements {
  int stage = 0, charge = 0;  // indices into the plan
  std::vector<int> elements;
};

struct ChargePlan {
  std::vector<ChargeElements> charges;
  std::vector<int> taken_by;       // charge whose material an element has because it is taken away; -1: none (cells)
  std::vector<int> damaged_by;     // the same beside what is taken away (cells)
  std::vector<double> transition;  // share of the concrete's strength that this one takes (cells)
  std::vector<fem::ExplicitBar> bars;
  std::vector<std::vector<int>> bars_of;  // of each charge
  std::vector<std::string> notes;         // what was left out, in sentences
};

/// Charges take the cells within their destroyed lengths; bars that stay run between the faces of what is left, each as
/// nearfield::make_residual_cage has it, without bending. Charges that fail leave all as it is.
ChargePlan plan_charges(const product::Plan&, const collapse::Knowledge&, const Grid&);

}  // namespace topple::farfield
