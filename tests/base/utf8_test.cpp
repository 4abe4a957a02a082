#include "base/utf8.h"

#include <gtest/gtest.h>

namespace topple {
namespace {

TEST(Utf8, TakesWellFormedCharactersOnly) {
  for (const char* good : {"", "a", "ä", "€", "\xF0\x9F\x98\x80", "\xED\x9F\xBF", "\xEE\x80\x80", "\xF4\x8F\xBF\xBF"})
    EXPECT_TRUE(is_utf8(good)) << good;
  // alone, cut off, longer than need be, half a surrogate pair, beyond the last
  for (const char* bad : {"\x80", "\xC3", "\xE4rger", "\xC0\x80", "\xE0\x9F\xBF", "\xED\xA0\x80", "\xF0\x8F\xBF\xBF",
                          "\xF4\x90\x80\x80", "\xFF", "a\xE2\x82"})
    EXPECT_FALSE(is_utf8(bad)) << bad;
  EXPECT_EQ(utf8_length(""), 0u);
  EXPECT_EQ(utf8_length("äb"), 2u);
}

TEST(Utf8, WritesWhatItReads) {
  for (const std::uint32_t c : {0x41u, 0x7Fu, 0x80u, 0x7FFu, 0x800u, 0xD7FFu, 0xE000u, 0xFFFFu, 0x10000u, 0x10FFFFu}) {
    std::string text;
    append_utf8(text, c);
    EXPECT_EQ(utf8_length(text), text.size()) << c;
  }
  std::string none;
  append_utf8(none, 0xD83D);
  append_utf8(none, 0x110000);
  EXPECT_EQ(none, "\xEF\xBF\xBD\xEF\xBF\xBD");
}

TEST(Utf8, ReadsNamesOfOldFiles) { EXPECT_EQ(latin1_to_utf8("Geb\xE4ude \xFC"), "Gebäude ü"); }

}  // namespace
}  // namespace topple
