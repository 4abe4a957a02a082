#include "collapse/stability.h"

#include <algorithm>
#include <map>

namespace topple::collapse {

std::vector<MemberMargin> find_margins(const record::Record& r, size_t frame) {
  std::map<std::string, MemberMargin> of;
  const size_t Z = r.zones.size();
  for (size_t z = 0; z < Z; ++z) {
    const auto state = static_cast<record::ZoneState>(r.zone_state[frame * Z + z]);
    const double use = r.zone_utilisation[frame * Z + z];
    if (state >= record::ZoneState::Broken || !(use > 0)) continue;
    const record::ZoneInfo& zone = r.zones[z];
    const std::string& name = zone.member.empty() ? zone.name : zone.member;
    const auto [at, is_new] = of.try_emplace(name, MemberMargin{name, zone.name, 1 / use, state});
    if (!is_new && 1 / use < at->second.margin) at->second = {name, zone.name, 1 / use, state};
  }
  std::vector<MemberMargin> out;
  for (auto& [name, m] : of) out.push_back(std::move(m));
  std::stable_sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.margin < b.margin; });
  return out;
}

}  // namespace topple::collapse
