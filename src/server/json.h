#pragma once
/// The objects of the protocol as JSON (docs/protocol.md).

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "base/error.h"
#include "collapse/steering.h"

namespace topple::server {

using Json = nlohmann::ordered_json;

/// Bytes that are not UTF-8 become U+FFFD.
std::string dump(const Json&);
/// null for NaN and infinities.
Json number(double);
Json numbers(const std::vector<double>&);

/// Answers of commands.
Json make_ack(std::int64_t id, Json result);
Json make_error(Json id, Json error);

/// {"code", "message", "help", "diagnostics"} of the first complaint, and all of them.
Json describe_error(const InputError&);
Json describe_diagnostics(const std::vector<Diagnostic>&);
Json describe_event(const record::Event&);
Json describe_finding(const record::Finding&);
Json describe_branch(const collapse::Steering&, const collapse::Branch&, const std::string& plan_sha256);
/// Report data of a branch with its first frame, or none. `before` holds that frame (as make_frame_body's record): the
/// branch's own record may begin later.
Json describe_scene(const record::Record& own, const record::Record& before, std::size_t bodies,
                    const std::vector<Pose>& others);
/// A member as the plan has it, with what edits have cut: section or build-up, reinforcement, materials. SI.
Json describe_member(const product::Plan&, const product::Member&);
/// Moment families of a zone's law.
Json describe_law(const mbs::ZoneLaw&);

}  // namespace topple::server
