#pragma once
/// One frame of a record as bytes (docs/protocol.md, "Frames").

#include <array>
#include <cstdint>
#include <vector>

#include "record/record.h"

namespace topple::server {

inline constexpr unsigned kLiveFrame = 1, kAskedFrame = 2, kLastFrame = 4;  // flags
inline constexpr std::size_t kFrameHeader = 48;                             // bytes

struct FrameBody {
  std::uint32_t session = 0, branch = 0, frame = 0;
  double time = 0;
  std::uint32_t bodies = 0, zones = 0, series = 0;
  std::uint32_t crushed = 0;        // ends that have receded
  std::vector<std::uint8_t> bytes;  // behind the header
};

/// Frame `row` of a record.
///   bodies  of the record that come first; `others` stand behind them
FrameBody make_frame_body(const record::Record&, std::size_t row, std::size_t bodies, const std::vector<Pose>& others);
std::array<std::uint8_t, kFrameHeader> make_frame_header(const FrameBody&, unsigned flags, std::uint32_t sequence);

}  // namespace topple::server
