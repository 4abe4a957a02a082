// Buildings that come down in each of the ways that the classes name, and some that do not (docs/theory/findings.md).
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "collapse/run.h"
#include "plans.h"

namespace topple::collapse {
namespace {

using testing::HasSubstr;

/// Columns, beams and slabs everywhere; thin walls around the upper storeys if asked for.
std::string frame(const std::string& rows, const std::string& frames, int storeys, const std::string& load,
                  bool walls) {
  return materials() + grid(rows, frames, storeys, load) +
         "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = \"floor\"\n" +
         (walls
              ? "[[walls]]\npanel = \"thin\"\nperimeter = true\nstoreys = \"1.." + std::to_string(storeys - 1) + "\"\n"
              : "");
}

/// Four rows of three columns, four storeys, walls above the ground storey.
std::string block() {
  return frame("A = \"0 m\", B = \"3 m\", C = \"6 m\", D = \"9 m\"", "1 = \"0 m\", 2 = \"5 m\", 3 = \"10 m\"", 4,
               "1 kN/m2", true);
}
/// A long open frame under heavy floors.
std::string gallery(int rows, int storeys, const std::string& load = "4 kN/m2") {
  std::string all;
  for (int i = 0; i < rows; ++i)
    all += std::string(i > 0 ? ", " : "") + static_cast<char>('A' + i) + " = \"" + std::to_string(4 * i) + " m\"";
  return frame(all, "1 = \"0 m\", 2 = \"5 m\"", storeys, load, false);
}
std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}
/// A stocky box on strong columns, stiff enough to survive landing.
std::string bin(int storeys) {
  std::string text = frame("A = \"0 m\", B = \"4 m\"", "1 = \"0 m\", 2 = \"4 m\"", storeys, "1 kN/m2", true);
  text = replaced(text, "width = \"30 cm\"\nheight = \"40 cm\"", "width = \"80 cm\"\nheight = \"80 cm\"");
  text = replaced(text, "count_y = 2, count_z = 2, diameter = \"20 mm\"",
                  "count_y = 5, count_z = 5, diameter = \"25 mm\"");
  text = replaced(text, "width = \"30 cm\"\nheight = \"50 cm\"", "width = \"50 cm\"\nheight = \"120 cm\"");
  return replaced(text, "top = \"4 x 20 mm\"\nbottom = \"3 x 20 mm\"", "top = \"8 x 28 mm\"\nbottom = \"8 x 28 mm\"");
}

std::string fire(const std::vector<std::string>& members, const std::string& destroyed_length = "1 m") {
  std::string list;
  for (const std::string& m : members) list += (list.empty() ? "\"" : ", \"") + m + "\"";
  return "[[stage]]\nname = \"all\"\ntime = \"0.1 s\"\n[[stage.charge]]\nmembers = [" + list +
         "]\nposition = \"1 m\"\ndestroyed_length = \"" + destroyed_length + "\"\nresidual_bars = 0.1\n";
}

record::Finding find_mechanism(const std::string& text, const std::string& duration) {
  const record::Record r = run_plan(read(text + analysis(duration)), default_knowledge(), {}, {});
  const auto at = std::find_if(r.findings.begin(), r.findings.end(), [](const auto& f) { return f.id == "mechanism"; });
  EXPECT_NE(at, r.findings.end());
  return *at;
}

/// Three blocks of nine bays in a row, tied by weak beams above the ground storey.
std::string three_blocks() {
  return materials() +
         "[section.link]\nwidth = \"15 cm\"\nheight = \"20 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\ncover = \"2 cm\"\n"
         "ties = { diameter = \"6 mm\", spacing = \"15 cm\" }\ntop = \"2 x 6 mm\"\nbottom = \"2 x 6 mm\"\n" +
         grid(
             "A = \"0 m\", B = \"4 m\", C = \"8 m\", D = \"12 m\", E = \"16 m\", F = \"20 m\", G = \"24 m\", "
             "H = \"28 m\", I = \"32 m\"",
             "1 = \"0 m\", 2 = \"5 m\"", 2, "1 kN/m2") +
         "[[columns]]\nsection = \"column\"\n"
         "[[beams]]\nsection = \"beam\"\nexcept = [\"C1D1\", \"C2D2\", \"F1G1\", \"F2G2\"]\n"
         "[[beams]]\nsection = \"link\"\nstoreys = 0\nat = [\"C1D1\", \"C2D2\", \"F1G1\", \"F2G2\"]\n"
         "[[slabs]]\npanel = \"floor\"\nat = [\"A1B2\", \"B1C2\", \"D1E2\", \"E1F2\", \"G1H2\", \"H1I2\"]\n";
}

TEST(MechanismRunPhysics, WhatIsLeftOfABuildingInPiecesMayStandInItsPlace) {
  // the block in the middle comes down, of those beside it neither holds half of the mass
  const std::string middle = fire({"C-D*-0", "C-E*-0", "C-F*-0"});
  const auto m = find_mechanism(three_blocks() + middle, "4 s");
  EXPECT_THAT(m.text, HasSubstr("Partial collapse"));
  EXPECT_THAT(m.text, HasSubstr("30 % of the mass has come down"));
  const std::string ends =
      "[[stage]]\nname = \"ends\"\ntime = \"4 s\"\n[[stage.charge]]\n"
      "members = [\"C-A*-0\", \"C-B*-0\", \"C-C*-0\", \"C-G*-0\", \"C-H*-0\", \"C-I*-0\"]\n"
      "position = \"1 m\"\ndestroyed_length = \"1 m\"\nresidual_bars = 0.1\n";
  const record::Record r =
      run_plan(read(three_blocks() + middle + ends + analysis("4.1 s")), default_knowledge(), {}, {});
  const auto at =
      std::find_if(r.findings.begin(), r.findings.end(), [](const auto& f) { return f.id == "stability.stage_1"; });
  ASSERT_NE(at, r.findings.end());
  EXPECT_THAT(at->text, testing::Not(HasSubstr("It does not stand")));
  EXPECT_THAT(at->text, HasSubstr("The upper block has moved by 0."));
}

TEST(MechanismRunPhysics, WithTheFrontRowsGoneItTopples) {
  const auto m = find_mechanism(block() + fire({"C-A*-0", "C-B*-0"}), "4 s");
  EXPECT_EQ(m.title, "Mechanism: topple") << m.text;
}

TEST(MechanismRunPhysics, ThePlanDecidesWhatTheWrongDirectionIs) {
  const std::string away = "[criteria]\nazimuth = \"0 deg\"\nazimuth_tolerance = \"30 deg\"\n";
  const auto m = find_mechanism(block() + fire({"C-A*-0", "C-B*-0"}) + away, "4 s");
  EXPECT_EQ(m.title, "Mechanism: wrong direction") << m.text;
  EXPECT_EQ(m.status, record::Status::Bad);
}

TEST(MechanismRunPhysics, WithAllColumnsGoneItComesDownVertically) {
  const auto m = find_mechanism(block() + fire({"C-*-0"}), "5 s");
  EXPECT_EQ(m.title, "Mechanism: vertical") << m.text;
}

TEST(MechanismRunPhysics, WithTheMiddleGoneBothEndsFoldInwards) {
  // two fifths each way at any step; of eight rows a quarter does, and the rest falls apart or not
  const auto m = find_mechanism(gallery(6, 2) + fire({"C-B*-0", "C-C*-0", "C-D*-0", "C-E*-0"}), "4 s");
  EXPECT_EQ(m.title, "Mechanism: fold") << m.text;
}

TEST(MechanismRunPhysics, ALossThatSpreadsIsProgressive) {
  // with 5 kN/m2 it stands, and with 6.25 to 7 kN/m2 a quarter of it turns each way: it "folds"
  const auto m = find_mechanism(gallery(6, 3, "9 kN/m2") + fire({"C-C*-0", "C-D*-0"}), "4 s");
  EXPECT_EQ(m.title, "Mechanism: progressive") << m.text;
}

TEST(MechanismRunPhysics, WithOneEndGoneTheRestStands) {
  const auto m = find_mechanism(gallery(8, 2) + fire({"C-G*-0", "C-H*-0"}), "6 s");
  EXPECT_EQ(m.title, "Mechanism: partial") << m.text;
  EXPECT_THAT(m.text, HasSubstr("Partial collapse"));
}

TEST(MechanismRunPhysics, WithOneColumnGoneItStands) {
  EXPECT_EQ(find_mechanism(block() + fire({"C-B2-0"}), "2 s").title, "Mechanism: stands");
  EXPECT_EQ(find_mechanism(block(), "1 s").title, "Mechanism: stands");
}

TEST(MechanismRunPhysics, ABinThatSinksAndStandsIsAborted) {
  // from 1.5 m on its floors come off as it lands, and what stands then hangs on the step
  for (const char* length : {"0.3 m", "0.6 m", "1.2 m"}) {
    const auto m = find_mechanism(bin(4) + fire({"C-*-0"}, length), "8 s");
    EXPECT_EQ(m.title, "Mechanism: aborted") << length << ": " << m.text;
    EXPECT_THAT(m.text, HasSubstr("Aborted collapse: the upper block has sunk by")) << length;
  }
}

TEST(MechanismRunPhysics, ATowerThatDropsAndStandsIsAborted) {
  const auto m = find_mechanism(bin(10) + fire({"C-*-0"}, "0.6 m"), "8 s");
  EXPECT_EQ(m.title, "Mechanism: aborted") << m.text;
  // it falls through the destroyed length and a little further, where stumps crush
  EXPECT_THAT(m.text, HasSubstr("has sunk by 0.6"));
}

}  // namespace
}  // namespace topple::collapse
