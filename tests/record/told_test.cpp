#include "record/told.h"

#include <gtest/gtest.h>

namespace topple::record {
namespace {

TEST(Told, TakesTheSignFromNumbersThatAreZeroAsWritten) {
  EXPECT_EQ(drop_negative_zeros("0.10 MJ and -0.00 MN s"), "0.10 MJ and 0.00 MN s");
  EXPECT_EQ(drop_negative_zeros("-0"), "0");
  EXPECT_EQ(drop_negative_zeros("at (-0.0, 3.1, -0) m, -0.000."), "at (0.0, 3.1, 0) m, 0.000.");
  EXPECT_EQ(drop_negative_zeros("-0 deg: -0."), "0 deg: 0.");
}

TEST(Told, AzimuthsLieBetween0And360Degrees) {
  const double deg = 3.14159265358979323846 / 180;
  EXPECT_EQ(tell_azimuth(-0.25 * deg, 2), "359.75 deg");
  EXPECT_EQ(tell_azimuth(-0.25 * deg), "0 deg");
  EXPECT_EQ(tell_azimuth(359.75 * deg), "0 deg");
  EXPECT_EQ(tell_azimuth(-90 * deg), "270 deg");
  EXPECT_EQ(tell_azimuth(360 * deg), "0 deg");
  EXPECT_EQ(tell_azimuth(-1e-12, 3), "0.000 deg");
  EXPECT_EQ(tell_azimuth(101.5 * deg, count_digits_of_angle(101.5 * deg)), "101.5 deg");
}

TEST(Told, LeavesNamesExponentsAndOtherNumbersAlone) {
  for (const char* text : {"-0.05 m", "-0.50", "C-A1-0 and C-A1-0/foot", "1.0e-05 J, 2e-0", "-10", "1.5 - 0.0",
                           "S-A1B2-0", "-0x", "10-0", "-0.0001", "- 0", "towards -x", "-"})
    EXPECT_EQ(drop_negative_zeros(text), text);
}

TEST(Told, CleansTextsOnTheirWayIntoTheRecord) {
  Record r;
  add_finding(r, {"debris.reach", "", "", "-0.0 m towards -x", -0.0, "m", Status::Info});
  add_event(r, {1, "touchdown", "C-A1-0", "C-A1-0 touches the ground (-0.00 MN s)"});
  EXPECT_EQ(r.findings[0].text, "0.0 m towards -x");
  EXPECT_EQ(r.events[0].text, "C-A1-0 touches the ground (0.00 MN s)");
}

TEST(Told, GivesMeasuresInUnitsThatShowDigits) {
  EXPECT_EQ(tell_measure(22.13e6, "J", 1), "22.1 MJ");
  EXPECT_EQ(tell_measure(1e6, "J", 1), "1.0 MJ");
  EXPECT_EQ(tell_measure(0.192e6, "J", 1), "192.0 kJ");
  EXPECT_EQ(tell_measure(0.192e6, "J", 2), "0.19 MJ");
  EXPECT_EQ(tell_measure(4321, "J", 2), "4.3 kJ");
  EXPECT_EQ(tell_measure(1444, "N s", 2), "1.4 kN s");
  EXPECT_EQ(tell_measure(7.25, "N s", 2), "7.2 N s");
  EXPECT_EQ(tell_measure(0, "J", 2), "0.00 MJ");
}

}  // namespace
}  // namespace topple::record
