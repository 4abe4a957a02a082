#pragma once
/// MuJoCo (https://mujoco.org, Apache-2.0) behind the adapter: bodies in relative coordinates along a tree of joints,
/// loops closed by soft welds. docs/engines.md.

#include <memory>
#include <string>

#include "engines/engine.h"

namespace topple::engines {

/// Version of the library, empty if the program was built without it.
std::string mujoco_version();
std::unique_ptr<Engine> make_mujoco_engine();

}  // namespace topple::engines
