#pragma once
/// Who does not touch whom because of what holds them, as in the native engine (docs/theory/contact.md).

#include <utility>
#include <vector>

#include "engines/forces.h"
#include "mbs/model.h"

namespace topple::engines {

/// Bodies that do not touch each other because of what holds them: joined by a live element, bushing or joint, or
/// joined to the same third body, or a pair that the contact says does not touch; and bodies held by the ground, which
/// do not touch it.
struct Ties {
  std::vector<std::pair<int, int>> pairs;  // a < b, not both fixed, rising
  std::vector<unsigned char> is_grounded;  // (B)
};
///   joint_live  joints that are there (J); elements and bushings as the forces have them
Ties find_ties(const mbs::Model&, const Forces&, const std::vector<unsigned char>& joint_live);

}  // namespace topple::engines
