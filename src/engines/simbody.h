#pragma once
/// Simbody (https://simtk.org, Apache-2.0) behind the adapter: bodies in relative coordinates along a tree of
/// mobilizers, loops closed by constraints. docs/engines.md.

#include <memory>
#include <string>

#include "engines/engine.h"

namespace topple::engines {

/// Version of the library, empty if the program was built without it.
std::string simbody_version();
std::unique_ptr<Engine> make_simbody_engine(const Accuracy&);

}  // namespace topple::engines
