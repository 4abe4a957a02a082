#include <fmt/format.h>

#include <charconv>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <span>

#include "base/bytes.h"
#include "base/error.h"
#include "base/file.h"
#include "record/compare.h"
#include "record/page.h"

namespace topple::record {

namespace {

namespace fs = std::filesystem;

std::string trimmed(const std::string& text) {
  const size_t from = text.find_first_not_of(" \t\r"), to = text.find_last_not_of(" \t\r");
  return from == std::string::npos ? std::string() : text.substr(from, to - from + 1);
}

/// By the first bytes: what the file is, whatever it is called.
const char* find_type(const std::string& bytes) {
  if (bytes.rfind("\x89PNG", 0) == 0) return "image/png";
  if (bytes.rfind("\xff\xd8\xff", 0) == 0) return "image/jpeg";
  if (bytes.size() > 12 && bytes.rfind("RIFF", 0) == 0 && bytes.compare(8, 4, "WEBP") == 0) return "image/webp";
  return nullptr;
}

}  // namespace

std::vector<Photo> read_photos(const std::string& path) {
  const std::string text = read_file(path);
  std::vector<Photo> photos;
  int number = 0;
  for (size_t from = 0; from < text.size();) {
    const size_t end = std::min(text.find('\n', from), text.size());
    const std::string line = trimmed(text.substr(from, end - from));
    from = end + 1;
    ++number;
    const auto refuse = [&](const std::string& why, const char* help) {
      throw InputError(
          {Diagnostic{Severity::Error, "E681", {path, number, 1}, static_cast<int>(line.size()), why, help}});
    };
    if (line.empty() || line[0] == '#' || line == "time,file") continue;
    const size_t comma = line.find(',');
    Photo photo;
    const auto [stop, failure] = std::from_chars(line.data(), line.data() + line.size(), photo.time);
    if (comma == std::string::npos || failure != std::errc{} || stop != line.data() + comma)
      refuse("a line is a time in seconds, a comma and a file", "such as: 1.25,frame-031.jpg");
    const std::string name = trimmed(line.substr(comma + 1));
    const fs::path file = fs::path(path).parent_path() / name;
    photo.name = fs::path(name).filename().string();
    std::error_code ignored;
    if (!fs::is_regular_file(file, ignored)) refuse(name + " is not there", "paths start from the table's folder");
    const std::string bytes = read_file(file.string());
    const char* type = find_type(bytes);
    if (!type) refuse(name + " is neither JPEG, PNG nor WebP", "");
    photo.data =
        fmt::format("data:{};base64,{}", type,
                    encode_base64(std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size())));
    photos.push_back(std::move(photo));
  }
  return photos;
}

void write_compare_page(const Comparison& c, const Record& a, const Record& b, const std::vector<Photo>& photos,
                        const std::string& bundle, const std::string& path) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Photo& p : photos) list.push_back({{"time", p.time}, {"name", p.name}, {"data", p.data}});
  write_page("{\"comparison\":" + to_json(c, a) + ",\"a\":" + to_report_json(a) + ",\"b\":" + to_report_json(b) +
                 ",\"photos\":" + list.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "}",
             bundle, path);
}

}  // namespace topple::record
