#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>

#include "base/bytes.h"
#include "base/error.h"
#include "base/file.h"
#include "base/utf8.h"
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

/// Of a line of a table: its text without quotes, where it stands, and bytes there.
struct Field {
  std::string text;
  size_t at = 0, width = 0;
};
/// Fields between commas, in quotes or not (RFC 4180); nothing where quotes are wrong.
std::optional<std::vector<Field>> split_line(const std::string& line) {
  std::vector<Field> out;
  for (size_t at = 0;; ++at) {
    const size_t begin = std::min(line.find_first_not_of(" \t\r", at), line.size());
    Field field{"", begin, 0};
    size_t end = begin;
    if (begin < line.size() && line[begin] == '"') {
      for (end = begin + 1;; ++end) {
        if (end >= line.size()) return std::nullopt;
        if (line[end] == '"' && (end + 1 >= line.size() || line[end + 1] != '"')) break;
        if (line[end] == '"') ++end;
        field.text += line[end];
      }
      field.width = ++end - begin;
      end = std::min(line.find_first_not_of(" \t\r", end), line.size());
      if (end < line.size() && line[end] != ',') return std::nullopt;
    } else {
      end = std::min(line.find(',', begin), line.size());
      field.text = trimmed(line.substr(begin, end - begin));
      field.width = field.text.size();
    }
    out.push_back(std::move(field));
    if (end >= line.size()) return out;
    at = end;
  }
}

}  // namespace

std::vector<Photo> read_photos(const std::string& path) {
  const std::string whole = read_file(path), text(without_mark(whole));
  std::vector<Photo> photos;
  int number = 0;
  for (size_t from = 0; from < text.size();) {
    const size_t end = std::min(text.find('\n', from), text.size());
    const std::string line = text.substr(from, end - from);
    from = end + 1;
    ++number;
    // `at` in bytes of the line
    const auto refuse = [&](const std::string& why, const char* help, size_t at, size_t width) {
      throw InputError({Diagnostic{Severity::Error,
                                   "E681",
                                   {path, number, 1 + static_cast<int>(count_characters(line.substr(0, at)))},
                                   static_cast<int>(std::max<size_t>(width, 1)),
                                   why,
                                   help}});
    };
    const std::string bare = trimmed(line);
    if (bare.empty() || bare[0] == '#') continue;
    std::optional<std::vector<Field>> fields = split_line(line);
    if (fields && fields->size() > 2 && line.find('"') == std::string::npos) {  // a name with commas
      Field& name = fields->at(1);
      name.text = trimmed(line.substr(name.at));
      name.width = name.text.size();
      fields->resize(2);
    }
    if (fields && fields->size() == 2 && (*fields)[0].text == "time" && (*fields)[1].text == "file") continue;
    if (!fields || fields->size() != 2)
      refuse("a line is a time in seconds, a comma and a file",
             "such as: 1.25,frame-031.jpg; a name with a comma stands in quotes", 0, bare.size());
    const Field &time = fields->at(0), &name = fields->at(1);
    Photo photo;
    const auto [stop, failure] = std::from_chars(time.text.data(), time.text.data() + time.text.size(), photo.time);
    if (failure != std::errc{} || stop != time.text.data() + time.text.size() || !std::isfinite(photo.time))
      refuse(fmt::format("the time \"{}\" is no number of seconds", time.text.substr(0, 40)),
             "a line is a time in seconds, a comma and a file: 1.25,frame-031.jpg", time.at, time.width);
    const auto refuse_file = [&](const std::string& why, const char* help) { refuse(why, help, name.at, name.width); };
    const fs::path folder = fs::path(path).parent_path(), file = folder / name.text;
    photo.name = fs::path(name.text).filename().string();
    std::error_code unknown;
    const fs::path home = fs::weakly_canonical(folder.empty() ? fs::path(".") : folder, unknown);
    const fs::path real = unknown ? fs::path() : fs::weakly_canonical(home / name.text, unknown);
    if (fs::path(name.text).is_absolute() || unknown ||
        std::mismatch(home.begin(), home.end(), real.begin(), real.end()).first != home.end())
      refuse_file(name.text + " lies outside of the table's folder", "pictures lie beside the table or below it");
    if (!fs::is_regular_file(file, unknown))
      refuse_file(name.text + " is not there", "paths start from the table's folder");
    const std::string bytes = read_file(file.string());
    const char* type = find_type(bytes);
    if (!type) refuse_file(name.text + " is neither JPEG, PNG nor WebP", "");
    photo.data =
        fmt::format("data:{};base64,{}", type,
                    encode_base64(std::span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size())));
    photos.push_back(std::move(photo));
  }
  if (photos.empty())
    throw InputError("E681", path + ": the table names no picture",
                     "a line is a time in seconds, a comma and a file: 1.25,frame-031.jpg");
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
