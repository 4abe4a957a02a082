#include "base/disjoint_sets.h"

#include <gtest/gtest.h>

namespace topple {
namespace {

TEST(DisjointSets, JoinsWhatIsLinked) {
  DisjointSets s(6);
  s.join(4, 1);
  s.join(1, 3);
  EXPECT_EQ(s.find(4), 3);
  EXPECT_EQ(s.find(1), 3);
  EXPECT_EQ(s.find(0), 0);
  EXPECT_NE(s.find(5), s.find(2));
}

TEST(DisjointSets, TheLowestLeadsInAnyOrder) {
  for (const bool backward : {false, true}) {
    DisjointSets s(5);
    for (int k = 0; k < 4; ++k) {
      const int i = backward ? 3 - k : k;
      s.join_under_lower(i + 1, i);
    }
    for (int i = 0; i < 5; ++i) EXPECT_EQ(s.find(i), 0) << i;
  }
}

}  // namespace
}  // namespace topple
