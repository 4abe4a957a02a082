#pragma once
/// How a model hangs together for engines that work in relative coordinates: a tree of bodies, each moving against the
/// one before it as a joint allows, and the joints that close loops.

#include <vector>

#include "mbs/model.h"

namespace topple::engines {

struct Branch {
  int body = -1;          // of the model, moving
  int inboard = -1;       // body it hangs on; -1: the ground, to which fixed bodies belong
  int joint = -1;         // between the two; -1: none, the body is free against the ground
  bool reversed = false;  // the inboard body is the joint's child
};

struct Articulation {
  std::vector<Branch> branches;  // one for each moving body, the inboard body before those that hang on it
  std::vector<int> loops;        // live joints that no branch stands for, rising; distance joints are always here
};

/// Breadth first from the ground, joints in the order of the model; joints between bodies that never move count for
/// nothing.
///   joint_live  joints that are there (J)
Articulation make_articulation(const mbs::Model&, const std::vector<unsigned char>& joint_live);

/// Loops whose joints hold wherever the branches go, such as a door's second hinge on the line of the first, rising.
///   distance  that distance joints keep (J) [m]
std::vector<int> find_idle_loops(const mbs::Model&, const Articulation&, const std::vector<double>& distance);

/// Whether a body never moves.
inline bool is_ground(const mbs::Model& model, int body) {
  return body < 0 || model.bodies[static_cast<size_t>(body)].fixed;
}

}  // namespace topple::engines
