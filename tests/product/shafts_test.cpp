#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/unit.h"
#include "plan_text.h"
#include "product/plan.h"

namespace topple::product {
namespace {

std::string shaft_plan() {
  return R"toml([concrete.C]
fc = "25 N/mm2"
Ec = "30 GPa"
[steel.S]
fy = "420 N/mm2"
fu = "500 N/mm2"
eps_u = 0.08
[[shafts]]
name = "stack"
position = ["1 m", "2 m"]
height = "40 m"
diameter = "4 m"
diameter_top = "3 m"
thickness = "30 cm"
thickness_top = "20 cm"
concrete = "C"
steel = "S"
as_outer = "6 cm2/m"
cover = "4 cm"
lining = { thickness = "10 cm", density = "1800 kg/m3" }
load = [{ at = "38 m", weight = "50 kN" }]
[[preparation.weaken]]
members = "stack"
at = "2 m"
azimuth = "85 deg"
opening = "10 deg"
cut_concrete = 1
cut_bars = 1
[[stage]]
time = "0.1 s"
[[stage.charge]]
members = "stack"
position = "2 m"
destroyed_length = "1.5 m"
azimuth = "180 deg"
opening = "180 deg"
[analysis]
duration = "1 s"
)toml";
}

std::string codes_of(const std::string& text) {
  std::string codes;
  for (const Diagnostic& d : complaints_about(text)) codes += (codes.empty() ? "" : " ") + d.code;
  return codes;
}

TEST(Shafts, StandWithoutAGrid) {
  EXPECT_EQ(rendered(complaints_about(shaft_plan()), shaft_plan()), "");
  std::vector<Diagnostic> warnings;
  const Plan plan = read_plan(shaft_plan(), "plan.toml", warnings);
  ASSERT_EQ(plan.members.size(), 1u);
  const Member& m = plan.members.front();
  EXPECT_EQ(m.kind, MemberKind::Shaft);
  EXPECT_EQ(m.end, (Vec3{1, 2, 40}));
  const Shaft& s = plan.shafts.at(0);
  EXPECT_DOUBLE_EQ(s.outer(0.5), 1.75);
  EXPECT_DOUBLE_EQ(s.thickness(1), 0.2);
  EXPECT_NEAR(s.loads.at(0).mass, 50e3 / 9.81, 1e-6);
  EXPECT_NEAR(plan.stages.at(0).charges.at(0).azimuth, 3.14159265, 1e-8);
  EXPECT_NEAR(m.weakenings.at(0).opening, 10 * unit::deg, 1e-12);
}

TEST(Shafts, MistakesAreComplaints) {
  const auto with = [](const char* before, const char* after) { return replaced(shaft_plan(), before, after); };
  EXPECT_EQ(codes_of(with("thickness_top = \"20 cm\"", "thickness_top = \"1.45 m\"")), "E207");
  EXPECT_EQ(codes_of(with("cover = \"4 cm\"", "cover = \"12 cm\"")), "E207");
  EXPECT_EQ(codes_of(with("steel = \"S\"\nas", "as")), "E201");
  EXPECT_EQ(codes_of(with("concrete = \"C\"\n", "concrete = \"C\"\ndensity = \"1900 kg/m3\"\n")), "E207");
  EXPECT_EQ(codes_of(with("name = \"stack\"", "name = \"a stack\"")), "E208 E302 E302");
  EXPECT_EQ(codes_of(with("at = \"38 m\"", "at = \"41 m\"")), "E306");
  EXPECT_EQ(codes_of(with("position = \"2 m\"", "position = \"39.5 m\"")), "E405");
  EXPECT_EQ(codes_of(with("azimuth = \"180 deg\"\n", "")), "E201");
  const std::string second =
      "[[stage.charge]]\nmembers = \"stack\"\nposition = \"2 m\"\ndestroyed_length = \"1.5 m\"\nazimuth = \"0 deg\"\n";
  EXPECT_EQ(codes_of(with("[analysis]", (second + "opening = \"90 deg\"\n[analysis]").c_str())), "");
  EXPECT_EQ(codes_of(with("[analysis]", (second + "opening = \"190 deg\"\n[analysis]").c_str())), "E404");
  // nothing false beside what is wrong
  const std::string wrong = replaced(second, "0 deg", "400 deg") + "opening = \"90 deg\"\n";
  EXPECT_EQ(codes_of(with("[analysis]", (wrong + "[analysis]").c_str())), "E205");
}

TEST(Shafts, SectorsBelongToShafts) {
  EXPECT_EQ(codes_of(replaced(small_plan(), "destroyed_length = \"1.2 m\"",
                              "opening = \"90 deg\"\nazimuth = \"0 deg\"\ndestroyed_length = \"1.2 m\"")),
            "E307");
}

/// Complaints about a shaft beside the two bays (5 m by 8 m, two storeys of 3 m), at its position's line and column.
std::string said_of_shaft(const std::string& x, const std::string& y, const std::string& diameter,
                          const std::string& more = "", const std::string& height = "10 m") {
  const std::string shaft = "[[shafts]]\nname = \"stack\"\nposition = «[\"" + x + "\", \"" + y + "\"]»\nheight = \"" +
                            height + "\"\ndiameter = \"" + diameter +
                            "\"\nthickness = \"10 cm\"\nconcrete = \"C25\"\n" + more;
  const Marked marked = take_marks(replaced(small_plan(), "[preparation]\n", shaft + "[preparation]\n"));
  std::string all;
  for (const Diagnostic& d : complaints_about(marked.text)) {
    all += d.code + " " + d.message + "\n";
    EXPECT_EQ(d.where.line, marked.line) << d.message;
    EXPECT_EQ(d.where.column, marked.column) << d.message;
    EXPECT_EQ(d.width, marked.width) << d.message;
  }
  return all;
}

TEST(Shafts, MayNotStandWhereTheBuildingStands) {
  // in the middle of a bay: nothing but slabs; the lower one alone up to 4 m
  EXPECT_EQ(said_of_shaft("2.5 m", "2 m", "1 m"), "E408 stack: stands where others stand: S-A1B2-0, S-A1B2-1\n");
  EXPECT_EQ(said_of_shaft("2.5 m", "2 m", "1 m", "", "4 m"), "E408 stack: stands where others stand: S-A1B2-0\n");
  EXPECT_EQ(said_of_shaft("2.5 m", "2 m", "1 m", "", "2.8 m"), "");
  // beside the bay: the beam at its edge is 0.3 m wide and hangs 0.6 m below the floor
  EXPECT_EQ(said_of_shaft("-0.6 m", "2 m", "1 m", "", "4 m"), "E408 stack: stands where others stand: B-A1A2-0\n");
  EXPECT_EQ(said_of_shaft("-0.6 m", "2 m", "1 m", "", "2.4 m"), "");
  EXPECT_EQ(said_of_shaft("-0.65 m", "2 m", "1 m"), "");
  // at a column, 0.4 m by 0.5 m
  EXPECT_EQ(said_of_shaft("5.65 m", "4 m", "1 m", "", "2.4 m"), "E408 stack: stands where others stand: C-B2-0\n");
  EXPECT_EQ(said_of_shaft("5.7 m", "4 m", "1 m", "", "2.4 m"), "");
  // wide at the foot only: up to where it has left the column's face, and below the beams
  EXPECT_EQ(said_of_shaft("5.9 m", "4 m", "2 m", "diameter_top = \"0.5 m\"\n", "10 m"),
            "E408 stack: stands where others stand: C-B2-0, C-B2-1, B-B1B2-0, B-B2B3-0\n");
  EXPECT_EQ(said_of_shaft("5.9 m", "2 m", "1.6 m", "diameter_top = \"0.5 m\"\n", "4 m"), "");
}

TEST(Shafts, MayNotStandInAWallUnlessItIsRemoved) {
  EXPECT_EQ(said_of_shaft("-0.6 m", "2 m", "1 m", "", "2.3 m"), "");
  const std::string kept = replaced(small_plan(), "removed = [\"W-A1A2-0\"]", "");
  const std::string shaft =
      "[[shafts]]\nname = \"stack\"\nposition = [\"-0.6 m\", \"2 m\"]\nheight = \"2.3 m\"\ndiameter = \"1 m\"\n"
      "thickness = \"10 cm\"\nconcrete = \"C25\"\n";
  const std::vector<Diagnostic> found = complaints_about(replaced(kept, "[preparation]\n", shaft + "[preparation]\n"));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].message, "stack: stands where others stand: W-A1A2-0");
}

TEST(Shafts, HoldMembersInTheirHollowWithAWarning) {
  EXPECT_EQ(said_of_shaft("5 m", "4 m", "30 m"),
            "W510 C-A1-0, C-A2-0, C-A3-0, C-B1-0, C-B2-0, C-B3-0, C-A1-1, C-A2-1, C-A3-1, C-B1-1, C-B2-1, C-B3-1, "
            "and 18 more: inside stack\n");
}

TEST(Shafts, MayNotStandInOneAnother) {
  // 4 m wide at the foot and 3 m at 40 m, walls of 0.3 and 0.2 m with a lining of 0.1 m
  const auto codes_of_second = [](const std::string& x, const std::string& height, const std::string& diameters) {
    return codes_of(replaced(shaft_plan(), "[[preparation.weaken]]",
                             "[[shafts]]\nname = \"other\"\nposition = [\"" + x + "\", \"2 m\"]\nheight = \"" + height +
                                 "\"\nthickness = \"10 cm\"\nconcrete = \"C\"\n" + diameters +
                                 "[[preparation.weaken]]"));
  };
  EXPECT_EQ(codes_of_second("4 m", "20 m", "diameter = \"2 m\"\n"), "");  // they touch
  EXPECT_EQ(codes_of_second("3.9 m", "20 m", "diameter = \"2 m\"\n"), "E408");
  EXPECT_EQ(codes_of_second("1.5 m", "20 m", "diameter = \"4 m\"\n"), "E408");
  // it grows upwards into the other one
  EXPECT_EQ(codes_of_second("4 m", "20 m", "diameter = \"2 m\"\ndiameter_top = \"3 m\"\n"), "E408");
  // a flue in the hollow, and one that reaches the shell where that is narrower
  EXPECT_EQ(codes_of_second("1 m", "40 m", "diameter = \"2.4 m\"\n"), "W510");
  EXPECT_EQ(codes_of_second("1 m", "40 m", "diameter = \"3 m\"\n"), "E408");
  EXPECT_EQ(codes_of_second("1 m", "10 m", "diameter = \"3 m\"\n"), "W510");
  EXPECT_EQ(codes_of_second("1 m", "60 m", "diameter = \"10 m\"\n"), "W510");  // around it
}

TEST(Shafts, TheirValuesMayBeFuzzy) {
  const std::string text = shaft_plan() +
                           "[fuzzy]\nshafts.stack.thickness = { triangular = [\"25 cm\", \"30 cm\", \"35 cm\"] }\n"
                           "stage.1.charge.1.opening = { triangular = [\"170 deg\", \"180 deg\", \"200 deg\"] }\n"
                           "shafts.stack.as_outer = { triangular = [\"4 cm2/m\", \"6 cm2/m\", \"8 cm2/m\"] }\n";
  EXPECT_EQ(rendered(complaints_about(text), text), "");
}

}  // namespace
}  // namespace topple::product
