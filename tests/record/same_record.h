#pragma once
/// Whether two records are the same to the bit.

#include <gtest/gtest.h>

#include "record/record.h"

namespace topple::record {

inline void expect_same_motion(const Record& a, const Record& b) {
  EXPECT_EQ(a.time, b.time);
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.orientation, b.orientation);
  EXPECT_EQ(a.zone_state, b.zone_state);
  EXPECT_EQ(a.zone_utilisation, b.zone_utilisation);
  EXPECT_EQ(a.crushed_ends, b.crushed_ends);
  EXPECT_EQ(a.crushed_length, b.crushed_length);
  ASSERT_EQ(a.series.size(), b.series.size());
  for (size_t i = 0; i < a.series.size(); ++i) EXPECT_EQ(a.series[i].value, b.series[i].value) << a.series[i].id;
  ASSERT_EQ(a.outputs.size(), b.outputs.size());
  for (size_t i = 0; i < a.outputs.size(); ++i) {
    EXPECT_EQ(a.outputs[i].time, b.outputs[i].time) << a.outputs[i].name;
    EXPECT_EQ(a.outputs[i].value, b.outputs[i].value) << a.outputs[i].name;
  }
}

inline void expect_same_words(const Record& a, const Record& b) {
  ASSERT_EQ(a.events.size(), b.events.size());
  for (size_t i = 0; i < a.events.size(); ++i) {
    EXPECT_EQ(a.events[i].time, b.events[i].time);
    EXPECT_EQ(a.events[i].text, b.events[i].text);
  }
  ASSERT_EQ(a.findings.size(), b.findings.size());
  for (size_t i = 0; i < a.findings.size(); ++i) EXPECT_EQ(a.findings[i].text, b.findings[i].text) << a.findings[i].id;
  EXPECT_EQ(a.ending, b.ending);
  EXPECT_EQ(a.ending_text, b.ending_text);
}

inline void expect_same(const Record& a, const Record& b) {
  expect_same_motion(a, b);
  expect_same_words(a, b);
}

}  // namespace topple::record
