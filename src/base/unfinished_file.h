#pragma once
/// For signal handlers.

namespace topple {

/// Takes away what replace_file has begun to write and not yet given its name. Safe in a signal handler; to be called
/// where the program ends at once.
void remove_unfinished_file();

}  // namespace topple
