#pragma once
/// Showing a page to the person at the machine.

#include <string>

namespace topple::apps {

/// Opens an address or a file in the desktop's browser and does not wait for it; nothing happens where there is no
/// desktop.
void open_browser(const std::string& address);

}  // namespace topple::apps
