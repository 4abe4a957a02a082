#include "engines/mujoco.h"

namespace topple::engines {

std::string mujoco_version() { return {}; }
std::unique_ptr<Engine> make_mujoco_engine() { return nullptr; }

}  // namespace topple::engines
