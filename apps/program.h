#pragma once

#include <string>

namespace topple::apps {

/// "0.1.0+1f2e3d4c": the version, and behind it what tells builds apart that may give other results.
std::string program_version();

}  // namespace topple::apps
