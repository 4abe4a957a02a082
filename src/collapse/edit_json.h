#pragma once
/// Edits as the protocol and the action log write them (docs/protocol.md).

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "collapse/edit.h"

namespace topple::collapse {

/// Whether a command is an edit.
bool is_edit(const std::string& command);
std::vector<std::string> edit_words();
/// Of an object with the key `command`. Throws InputError E912: a key is missing, unknown, of a wrong type, not finite.
/// Keys of every command (id, session, branch, name, in_place) are passed over.
Edit read_edit(const nlohmann::ordered_json&);

/// A text of a client or a log. Throws InputError E910 if it is nested deeper than a command ever is, or a number of it
/// is out of range; discarded if it is no JSON.
nlohmann::ordered_json parse_command(const std::string& text);

// For readers of other commands; all throw InputError E912.
double read_number(const nlohmann::ordered_json& command, const char* key);
double read_number(const nlohmann::ordered_json& command, const char* key, double otherwise);
int read_integer(const nlohmann::ordered_json& command, const char* key, int low, int high);
std::string read_text(const nlohmann::ordered_json& command, const char* key);
std::string read_text(const nlohmann::ordered_json& command, const char* key, const std::string& otherwise);
bool read_flag(const nlohmann::ordered_json& command, const char* key, bool otherwise);
/// Refuses keys that are neither listed nor of every command.
void check_keys(const nlohmann::ordered_json& command, const std::vector<std::string>& known);

}  // namespace topple::collapse
