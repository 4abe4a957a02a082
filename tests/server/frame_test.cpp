#include "server/frame.h"

#include <gtest/gtest.h>

#include <cstring>

namespace topple::server {
namespace {

TEST(FrameBytes, ListTheEndsThatHaveReceded) {
  record::Record r;
  r.time = {0, 0.5};
  r.bodies.resize(2);
  r.position.assign(12, 1);
  r.orientation.assign(16, 0.5F);
  r.zones.resize(3);
  r.zone_state = {0, 0, 0, 1, 2, 3};
  r.zone_utilisation.assign(6, 0.25F);
  r.crushed_ends = {{0, 0, 2, 1}, {1, 300, 1, -1}};
  r.crushed_length = {0, 0, 0, 0.75F};
  const FrameBody start = make_frame_body(r, 0, 2, {}), f = make_frame_body(r, 1, 2, {});
  EXPECT_EQ(start.crushed, 0U);
  EXPECT_EQ(start.bytes.size(), 28 * 2 + 5 * 3U);
  ASSERT_EQ(f.crushed, 1U);
  ASSERT_EQ(f.bytes.size(), 28 * 2 + 5 * 3 + 12U);
  const std::uint8_t* end = &f.bytes[28 * 2 + 4 * 3];
  const auto number = [end](std::size_t at, std::size_t size) {
    std::uint32_t value = 0;
    std::memcpy(&value, end + at, size);
    return value;
  };
  EXPECT_EQ(number(0, 4), 1U);
  EXPECT_EQ(number(4, 2), 300U);
  EXPECT_EQ(number(6, 1), 1U);
  EXPECT_EQ(number(7, 1), 0U);
  float length = 0;
  std::memcpy(&length, end + 8, 4);
  EXPECT_EQ(length, 0.75F);
  EXPECT_EQ(f.bytes.back(), 3) << "the states of the zones stand behind them";
  const auto header = make_frame_header(f, kAskedFrame, 7);
  EXPECT_EQ(header[44], 1);
}

}  // namespace
}  // namespace topple::server
