#pragma once
/// A model as the text that MuJoCo reads (MJCF). Knows nothing of the library. docs/engines.md says what stands for
/// what.

#include <string>
#include <vector>

#include "engines/articulation.h"
#include "engines/course.h"
#include "engines/ties.h"
#include "mbs/model.h"

namespace topple::engines {

/// Contact bits: what a geom offers (type) meets what another takes (affinity).
inline constexpr int kGroundBit = 1, kBodyBit = 2;

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
