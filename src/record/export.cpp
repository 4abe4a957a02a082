#include "record/export.h"

#include <filesystem>

#include "base/file.h"
#include "record/record_json.h"

namespace topple::record {

Record keep_frames(const Record& r, double interval) {
  Record out = r;
  out.time.clear(), out.position.clear(), out.orientation.clear();
  out.zone_state.clear(), out.zone_utilisation.clear(), out.crushed_length.clear();
  for (Series& series : out.series) series.value.clear();
  const auto copy_row = [](const auto& from, auto& to, std::size_t row, std::size_t width) {
    const auto begin = from.begin() + static_cast<std::ptrdiff_t>(row * width);
    to.insert(to.end(), begin, begin + static_cast<std::ptrdiff_t>(width));
  };
  const std::size_t S = r.time.size(), B = r.bodies.size(), Z = r.zones.size();
  for (std::size_t s = 0; s < S; ++s) {
    // frames of 60 Hz are kept at 20 Hz in spite of round-off
    if (s > 0 && s + 1 < S && r.time[s] - out.time.back() < interval * (1 - 1e-9)) continue;
    out.time.push_back(r.time[s]);
    copy_row(r.position, out.position, s, 3 * B);
    copy_row(r.orientation, out.orientation, s, 4 * B);
    copy_row(r.zone_state, out.zone_state, s, Z);
    copy_row(r.zone_utilisation, out.zone_utilisation, s, Z);
    copy_row(r.crushed_length, out.crushed_length, s, r.crushed_ends.size());
    for (std::size_t i = 0; i < r.series.size(); ++i) out.series[i].value.push_back(r.series[i].value[s]);
  }
  return out;
}

std::vector<std::string> export_json(const Record& r, const std::string& folder) {
  const std::string path = (std::filesystem::path(folder) / "record.json").string();
  replace_file(
      path, make_json(r, Packing::Lists).dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
  return {path};
}

}  // namespace topple::record
