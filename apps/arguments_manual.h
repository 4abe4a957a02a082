#pragma once
/// The manual page out of the table that the parser reads.

#include <CLI/App.hpp>
#include <string>

namespace topple::apps {

/// topple.1, for man(7).
std::string make_manual(const CLI::App&);

}  // namespace topple::apps
