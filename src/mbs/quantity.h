#pragma once
/// What triggers wait for and outputs write: numbers of the running system, read from a View alone.

#include <string>
#include <vector>

#include "mbs/model.h"
#include "mbs/solver.h"

namespace topple::mbs {

/// How a kind of quantity is called, and what its numbers are.
struct QuantityTraits {
  const char* item;   // whose it is: "body", "joint", "element", "rotational", "bushing", ...
  const char* word;   // "position", "force", ...; unique for an item
  int components;     // of an output: 1, 3, or 4 of a quaternion w x y z
  const char* unit;   // "m", "N m"; "1" of a quaternion
  const char* frame;  // "world"; "F" of the joint, element or bushing; "" of a scalar
};

inline constexpr int kQuantityKinds = static_cast<int>(Quantity::Kind::CableForce) + 1;

const QuantityTraits& traits_of(Quantity::Kind);

/// Headers of the columns of an output: x y z, w x y z, or the word of a scalar.
std::vector<std::string> column_names(Quantity::Kind);

/// The quantity at the view's time, as many values as the traits say; the orientation as a unit quaternion w x y z.
/// NaN where the view knows nothing of it (an engine without that item).
std::vector<double> calc_quantity(const Quantity&, const View&);

/// What a trigger compares: component 0 1 2 is x y z (0 of a scalar), 3 the magnitude; the orientation as the rotation
/// vector of R_WB [rad]. NaN as above. Allocates nothing.
double calc_component(const Quantity&, int component, const View&);

}  // namespace topple::mbs
