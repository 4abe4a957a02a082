#pragma once
/// How far a standing building is from its resistance, member by member.

#include <string>
#include <vector>

#include "collapse/manager.h"
#include "collapse/recorder.h"
#include "record/record.h"

namespace topple::collapse {

struct MemberMargin {
  std::string member;
  std::string zone;   // its most used one
  double margin = 0;  // capacity over demand
  record::ZoneState state = record::ZoneState::Elastic;
};
/// Of every member at a frame, lowest first: the zones that are neither broken nor fired and carry something.
///   counts  which zones are looked at; empty: all (zones)
std::vector<MemberMargin> find_margins(const record::Record&, size_t frame, const std::vector<bool>& counts = {});

/// Structures on which charges act at a time or later, as these alone are to stand until then; of a single one it is
/// true. (structures)
std::vector<bool> find_structures_to_stand(const product::Plan&, const ModelMap&, double from);
/// When the last charge fired, of some stages, on structures that count: charges that fail do not. None: minus infinity
/// [s].
///   stages  indices into the plan's
double find_last_charge(const product::Plan&, const ModelMap&, const std::vector<bool>& counts,
                        const std::vector<size_t>& stages);
/// Zones of such structures. (zones)
std::vector<bool> find_zones_of(const std::vector<bool>& structures, const ModelMap&, const record::Record&);
/// As Recorder::zone_frames, of the zones that count.
std::vector<ZoneFrame> find_zone_frames(const record::Record&, const std::vector<bool>& counts);

}  // namespace topple::collapse
