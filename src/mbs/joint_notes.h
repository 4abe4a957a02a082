#pragma once
/// Words about joints.

#include <string>
#include <vector>

#include "mbs/model.h"

namespace topple::mbs {

/// Up to six joints by name, in the order of the model; how many more there are.
///   list  into Model::joints, not empty
std::string list_joints(const Model&, std::vector<int> list);

}  // namespace topple::mbs
