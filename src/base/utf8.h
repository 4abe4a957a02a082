#pragma once
/// Text in UTF-8 (RFC 3629).

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace topple {

/// Bytes of the well-formed character at the front of `text`, 0 if there is none.
std::size_t utf8_length(std::string_view text);

/// Whether all of it is well-formed.
bool is_utf8(std::string_view text);

/// What stands behind the byte order mark, of a text that begins with one.
std::string_view without_mark(std::string_view text);

/// Characters of a well-formed text.
std::size_t count_characters(std::string_view text);

/// Appends a character by its code point; U+FFFD for what is none, such as a half of a surrogate pair.
void append_utf8(std::string& text, std::uint32_t code_point);

/// Bytes of ISO 8859-1, whose letters are those of Windows-1252 too.
std::string latin1_to_utf8(std::string_view text);

}  // namespace topple
