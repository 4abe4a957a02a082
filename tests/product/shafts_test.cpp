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
}

TEST(Shafts, SectorsBelongToShafts) {
  EXPECT_EQ(codes_of(replaced(small_plan(), "destroyed_length = \"1.2 m\"",
                              "opening = \"90 deg\"\nazimuth = \"0 deg\"\ndestroyed_length = \"1.2 m\"")),
            "E307");
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
