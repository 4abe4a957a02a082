#pragma once
/// What an import takes over from files of other programs, made fit for a plan.

#include <string>
#include <vector>

namespace topple::product {

/// Text for a string or a remark of a plan: UTF-8, at most 80 bytes of whole characters, without quotes, backslashes
/// and control characters. Bytes that are not UTF-8 are read as ISO 8859-1.
std::string clean_text(const std::string&);

/// Text whose lines end with CR alone, with LF instead; any other as it is.
std::string to_line_feeds(std::string);

/// The last look at a plan or site that was made: only its gaps may be wrong with it. Throws InputError `code` at
/// `file`.
void check_import(const std::string& text, const char* code, const std::string& file);
/// The same of a plan whose gaps hold values that fit; returns what is wrong with its building (members that hang in
/// the air, E302 and above), which is for people to mend.
std::vector<std::string> check_filled_import(const std::string& text, const char* code, const std::string& file);

}  // namespace topple::product
