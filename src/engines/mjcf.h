#pragma once
/// A model as the text that MuJoCo reads (MJCF). Knows nothing of the library. docs/engines.md says what stands for
/// what.

#include <string>
#include <utility>
#include <vector>

#include "engines/articulation.h"
#include "engines/course.h"
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

/// Damping over critical damping of a spring that gives back the share e of the speed with which it was hit, if it
/// cannot pull: e = exp(-2 ζ acos ζ / √(1 - ζ²)), and its continuation above 1. For e in (0, 1].
double find_damping_ratio(double restitution);

struct Mjcf {
  std::string text;
  std::vector<int> twin_of_loop;  // number of the twin that closes each loop of the articulation; -1: a distance
  int twins = 0;
};

/// A loop is closed by halving the mass of a body between itself and a twin, which moves as the joint allows, and
/// welding the two; a distance by a tendon of fixed length. Names: body "b3" of the model, its geoms "g3.0", ...;
/// joints "j5.0", "j5.1" of joint 5 (first what acts first) or "f3" of the free body 3; twin "t0"; equality "e5" of
/// joint 5; ground plane "ground". Masses, inertias and poses are those of the course now; joints stand at 0 there.
Mjcf make_mjcf(const Course&, const Articulation&, const Ties&, double step);

}  // namespace topple::engines
