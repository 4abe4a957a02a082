#include "collapse/stability.h"

#include <algorithm>
#include <limits>
#include <map>

namespace topple::collapse {

std::vector<MemberMargin> find_margins(const record::Record& r, size_t frame, const std::vector<bool>& counts) {
  std::map<std::string, MemberMargin> of;
  const size_t Z = r.zones.size();
  for (size_t z = 0; z < Z; ++z) {
    const auto state = static_cast<record::ZoneState>(r.zone_state[frame * Z + z]);
    const double use = r.zone_utilisation[frame * Z + z];
    if (state >= record::ZoneState::Broken || !(use > 0) || (!counts.empty() && !counts[z])) continue;
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

namespace {

/// Structures that a charge acts on.
std::vector<bool> find_structures_of(const product::Plan& plan, const ModelMap& map, const Firing& f) {
  const product::Charge& c = plan.stages[static_cast<size_t>(f.stage)].charges[static_cast<size_t>(f.charge)];
  const std::string& member = plan.members[static_cast<size_t>(c.member)].name;
  std::vector<bool> out(map.structures.size(), false);
  const auto mark = [&](int body) {
    if (body < 0) return;
    const int structure = map.bodies[static_cast<size_t>(body)].structure;
    if (structure >= 0) out[static_cast<size_t>(structure)] = true;
  };
  for (const auto* list : {&map.elements, &map.rotationals, &map.joints})
    for (const ZoneEntry& z : *list)
      if (z.member == member) mark(z.body_a), mark(z.body_b);
  return out;
}

}  // namespace

std::vector<bool> find_structures_to_stand(const product::Plan& plan, const ModelMap& map, double from) {
  const size_t S = map.structures.size();
  if (S < 2) return std::vector<bool>(S, true);
  std::vector<bool> out(S, false);
  for (const Firing& f : map.schedule) {
    if (f.time < from - 1e-9) continue;
    const std::vector<bool> on = find_structures_of(plan, map, f);
    for (size_t s = 0; s < S; ++s)
      if (on[s]) out[s] = true;
  }
  return std::find(out.begin(), out.end(), true) != out.end() ? out : std::vector<bool>(S, true);
}

double find_last_charge(const product::Plan& plan, const ModelMap& map, const std::vector<bool>& counts,
                        const std::vector<size_t>& stages) {
  double last = -std::numeric_limits<double>::infinity();
  for (const Firing& f : map.schedule) {
    if (f.fails || std::find(stages.begin(), stages.end(), static_cast<size_t>(f.stage)) == stages.end()) continue;
    const std::vector<bool> on = find_structures_of(plan, map, f);
    bool is_counted = counts.size() < 2;
    for (size_t s = 0; s < on.size(); ++s) is_counted |= on[s] && counts[s];
    if (is_counted) last = std::max(last, f.time);
  }
  return last;
}

std::vector<bool> find_zones_of(const std::vector<bool>& structures, const ModelMap& map, const record::Record& r) {
  std::vector<bool> out;
  const auto is_of = [&](int body) {
    if (body < 0) return false;
    const int structure = map.bodies[static_cast<size_t>(body)].structure;
    return structure >= 0 && structures[static_cast<size_t>(structure)];
  };
  for (const record::ZoneInfo& z : r.zones) out.push_back(is_of(z.body_a) || is_of(z.body_b));
  return out;
}

std::vector<ZoneFrame> find_zone_frames(const record::Record& r, const std::vector<bool>& counts) {
  using enum record::ZoneState;
  const size_t Z = r.zones.size();
  std::vector<ZoneFrame> out(r.time.size());
  for (size_t f = 0; f < out.size(); ++f) {
    ZoneFrame& zf = out[f];
    zf.time = r.time[f];
    for (size_t z = 0; z < Z; ++z) {
      if (!counts[z]) continue;
      const auto state = static_cast<record::ZoneState>(r.zone_state[f * Z + z]);
      const double use = r.zone_utilisation[f * Z + z];
      zf.broken += state == Broken;
      zf.yielded += state == Yielded || state == Softening;
      if (state < Broken && use > zf.utilisation) zf.utilisation = use, zf.zone = static_cast<int>(z);
    }
  }
  return out;
}

}  // namespace topple::collapse
