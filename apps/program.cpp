#include "program.h"

#include "apps/results_identity.h"

namespace topple::apps {

std::string program_version() { return TOPPLE_VERSION "+" TOPPLE_RESULTS_IDENTITY; }

}  // namespace topple::apps
