#include "base/unit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace topple {
namespace {

using testing::HasSubstr;

struct Reads {
  const char* text;
  Dimension dimension;
  double value;
};

class UnitReads : public testing::TestWithParam<Reads> {};

TEST_P(UnitReads, InSi) {
  const auto& [text, dimension, value] = GetParam();
  const Quantity q = parse_quantity(text, dimension);
  ASSERT_TRUE(q.value) << text << ": " << q.problem;
  EXPECT_TRUE(q.problem.empty());
  // one rounding of the number, one of the factor, one of their product
  EXPECT_NEAR(*q.value, value, 4e-16 * std::abs(value)) << text;
}

INSTANTIATE_TEST_SUITE_P(
    EveryUnit, UnitReads,
    testing::Values(
        Reads{"0.5", Dimension::Number, 0.5}, Reads{"50 %", Dimension::Number, 0.5}, Reads{"-3", Dimension::Number, -3},
        Reads{"+3", Dimension::Number, 3}, Reads{"2.2e-3", Dimension::Number, 2.2e-3},
        Reads{"3140 mm", Dimension::Length, 3.14}, Reads{"314 cm", Dimension::Length, 3.14},
        Reads{"3.14 m", Dimension::Length, 3.14}, Reads{"3.14m", Dimension::Length, 3.14},
        Reads{"  3.14\tm ", Dimension::Length, 3.14}, Reads{"-2 km", Dimension::Length, -2000},
        Reads{"6400 mm2", Dimension::Area, 64e-4}, Reads{"64 cm2", Dimension::Area, 64e-4},
        Reads{"64 cm\u00B2", Dimension::Area, 64e-4}, Reads{"64 cm^2", Dimension::Area, 64e-4},
        Reads{"2 m2", Dimension::Area, 2}, Reads{"500 mm2/m", Dimension::AreaPerLength, 5e-4},
        Reads{"5 cm2/m", Dimension::AreaPerLength, 5e-4}, Reads{"1 m2/m", Dimension::AreaPerLength, 1},
        Reads{"250 ms", Dimension::Time, 0.25}, Reads{"4 s", Dimension::Time, 4}, Reads{"2 min", Dimension::Time, 120},
        Reads{"7 kg", Dimension::Mass, 7}, Reads{"7 t", Dimension::Mass, 7000}, Reads{"8 N", Dimension::Force, 8},
        Reads{"8 kN", Dimension::Force, 8e3}, Reads{"8 MN", Dimension::Force, 8e6},
        Reads{"25 N/mm2", Dimension::Stress, 25e6}, Reads{"30e3 N/mm\u00B2", Dimension::Stress, 30e9},
        Reads{"2 kN/cm2", Dimension::Stress, 20e6}, Reads{"9 N/m2", Dimension::Stress, 9},
        Reads{"1.6 kN/m2", Dimension::AreaLoad, 1600}, Reads{"16 N/m\u00B2", Dimension::AreaLoad, 16},
        Reads{"2 kPa", Dimension::AreaLoad, 2e3}, Reads{"1.6 kN/m2", Dimension::Stress, 1600},
        Reads{"2 MN/m2", Dimension::Stress, 2e6}, Reads{"2 Pa", Dimension::Stress, 2},
        Reads{"2 kPa", Dimension::Stress, 2e3}, Reads{"2 MPa", Dimension::Stress, 2e6},
        Reads{"200 GPa", Dimension::Stress, 200e9}, Reads{"2500 kg/m3", Dimension::Density, 2500},
        Reads{"2.5 t/m\u00B3", Dimension::Density, 2500}, Reads{"3 J", Dimension::Energy, 3},
        Reads{"3 kJ", Dimension::Energy, 3e3}, Reads{"3 MJ", Dimension::Energy, 3e6},
        Reads{"130 J/m2", Dimension::EnergyPerArea, 130}, Reads{"15 kJ/m2", Dimension::EnergyPerArea, 15e3},
        Reads{"130 N/m", Dimension::EnergyPerArea, 130}, Reads{"15 N/mm", Dimension::EnergyPerArea, 15e3},
        Reads{"5 mm/s", Dimension::Velocity, 5e-3}, Reads{"5 m/s", Dimension::Velocity, 5},
        Reads{"9.81 m/s2", Dimension::Acceleration, 9.81}, Reads{"180 deg", Dimension::Angle, 3.14159265358979323846},
        Reads{"180\u00B0", Dimension::Angle, 3.14159265358979323846}, Reads{"1 rad", Dimension::Angle, 1},
        Reads{"60 Hz", Dimension::Frequency, 60}, Reads{"60 1/s", Dimension::Frequency, 60},
        Reads{"2 N/m", Dimension::StiffnessPerLength, 2}, Reads{"2 N/mm", Dimension::StiffnessPerLength, 2e3},
        Reads{"2 kN/m", Dimension::StiffnessPerLength, 2e3}, Reads{"2 kN/mm", Dimension::StiffnessPerLength, 2e6},
        Reads{"2 MN/m", Dimension::StiffnessPerLength, 2e6}, Reads{"4 Nm", Dimension::Moment, 4},
        Reads{"4 kNm", Dimension::Moment, 4e3}, Reads{"4 MN\u00B7m", Dimension::Moment, 4e6}));

struct Refused {
  const char* text;
  Dimension dimension;
  const char* problem;
};

class UnitRefuses : public testing::TestWithParam<Refused> {};

TEST_P(UnitRefuses, WithWords) {
  const auto& [text, dimension, problem] = GetParam();
  const Quantity q = parse_quantity(text, dimension);
  EXPECT_FALSE(q.value) << text;
  EXPECT_THAT(q.problem, HasSubstr(problem));
}

INSTANTIATE_TEST_SUITE_P(EveryMistake, UnitRefuses,
                         testing::Values(Refused{"", Dimension::Length, "is empty; a length is wanted"},
                                         Refused{"   ", Dimension::Area, "is empty; an area is wanted"},
                                         Refused{"3.14", Dimension::Length, "\"3.14\" has no unit; a length is wanted"},
                                         Refused{"3 s", Dimension::Length, "\"3 s\" is a time; a length is wanted"},
                                         Refused{"3 m", Dimension::Time, "\"3 m\" is a length; a time is wanted"},
                                         Refused{"25 N/mm", Dimension::Stress, "a stress is wanted"},
                                         Refused{"25 N", Dimension::Stress, "\"25 N\" is a force"},
                                         Refused{"5 cm2", Dimension::AreaPerLength,
                                                 "is an area; an area per length is wanted"},
                                         Refused{"3 m", Dimension::Number, "is a length; a number is wanted"},
                                         Refused{"3 %", Dimension::Length, "is a number; a length is wanted"},
                                         Refused{"3 mtr", Dimension::Length, "unknown unit \"mtr\""},
                                         Refused{"3 M", Dimension::Length, "unknown unit \"M\""},
                                         Refused{"3,14 m", Dimension::Length, "decimals are written with a point"},
                                         Refused{"three m", Dimension::Length, "does not begin with a number"},
                                         Refused{"m", Dimension::Length, "does not begin with a number"},
                                         Refused{"+-3 m", Dimension::Length, "does not begin with a number"},
                                         Refused{"++3 m", Dimension::Length, "does not begin with a number"},
                                         Refused{"nan m", Dimension::Length, "not a finite number"},
                                         Refused{"inf m", Dimension::Length, "not a finite number"},
                                         Refused{"-inf s", Dimension::Time, "not a finite number"},
                                         Refused{"1e400 m", Dimension::Length, "beyond what a number can hold"},
                                         Refused{"2e15 m", Dimension::Length, "beyond 1e15"},
                                         Refused{"2e12 km", Dimension::Length, "beyond 1e15"},
                                         Refused{"0x10 m", Dimension::Length, "unknown unit"},
                                         Refused{"3 m m", Dimension::Length, "unknown unit \"m m\""}));

TEST(Unit, ListsWhatIsUnderstood) {
  EXPECT_EQ(name_of(Dimension::Length), "length");
  EXPECT_EQ(units_of(Dimension::Length), "mm, cm, m, km");
  EXPECT_EQ(units_of(Dimension::Angle), "deg, rad");
}

TEST(Unit, EveryListedUnitIsRead) {
  for (int d = 0; d <= static_cast<int>(Dimension::Moment); ++d) {
    const auto dimension = static_cast<Dimension>(d);
    const std::string list = units_of(dimension);
    for (size_t begin = 0; begin < list.size();) {
      const size_t end = std::min(list.find(", ", begin), list.size());
      EXPECT_TRUE(parse_quantity("1 " + list.substr(begin, end - begin), dimension).value) << list;
      begin = end + 2;
    }
  }
}

TEST(Unit, KeepsAVeryLongTextOutOfTheMessage) {
  const Quantity q = parse_quantity("1 " + std::string(100000, 'x'), Dimension::Length);
  EXPECT_FALSE(q.value);
  EXPECT_LT(q.problem.size(), 200u);
}

}  // namespace
}  // namespace topple
