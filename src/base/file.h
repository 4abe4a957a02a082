#pragma once
/// Whole files in one go.

#include <string>
#include <string_view>
#include <vector>

namespace topple {

/// The bytes of a file; InputError (E701) if it cannot be read.
std::string read_file(const std::string& path);

/// Writes `bytes` beside `path` and renames the result over it, so that a failure leaves an old file as it was.
/// A link stays, and what it stands for is replaced; an old file's rights stay, too. Devices and pipes are written to.
/// The name beside is nobody else's. Missing parent folders are made. Throws std::runtime_error that names the path and
/// the reason.
void replace_file(const std::string& path, std::string_view bytes);

/// What replace_file of processes that are no more has left in a folder, sorted.
std::vector<std::string> find_unfinished_files(const std::string& folder);
/// Takes that away; nothing else.
void remove_unfinished_files(const std::string& folder);

}  // namespace topple
