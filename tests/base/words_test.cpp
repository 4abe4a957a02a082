#include "base/words.h"

#include <gtest/gtest.h>

namespace topple {
namespace {

TEST(Words, CountOneAndMany) {
  EXPECT_EQ(count_words(1, "row"), "1 row");
  EXPECT_EQ(count_words(0, "row"), "0 rows");
  EXPECT_EQ(count_words(2, "thickness"), "2 thicknesses");
}

TEST(Words, ShowTwoDigitsOfWhatIsSmall) {
  EXPECT_EQ(decimal_words(1234.5678, 2), "1234.57");
  EXPECT_EQ(decimal_words(0.5, 2), "0.50");
  EXPECT_EQ(decimal_words(-0.00347, 2), "-0.0035");
  EXPECT_EQ(decimal_words(0.42, 0), "0.42");
  EXPECT_EQ(decimal_words(12.3, 0), "12");
  EXPECT_EQ(decimal_words(0, 2), "0.00");
}

}  // namespace
}  // namespace topple
