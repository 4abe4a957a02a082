#pragma once
/// Self-contained pages: a built page with a marker, into which data go as JSON.

#include <string>

namespace topple::record {

/// The page with its data. No text of the data can close or open a tag.
///   data    JSON
///   bundle    the built page, with the marker <!--TOPPLE-DATA--> once; throws std::runtime_error otherwise
///   language  "en" or "de", of the page's words
std::string make_page(const std::string& data, const std::string& bundle, const std::string& language = "en");
/// Writes a page (beside, then renamed).
void write_page(const std::string& data, const std::string& bundle, const std::string& path,
                const std::string& language = "en");

}  // namespace topple::record
