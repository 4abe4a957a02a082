// Layers and arcs of drawings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <regex>
#include <string>

#include "base/error.h"
#include "product/import.h"
#include "product/layer_names.h"

namespace topple::product {
namespace {

using testing::Contains;
using testing::HasSubstr;
using testing::Not;

constexpr double kPi = 3.14159265358979323846;

std::string drawing(const std::string& entities) {
  return "0\nSECTION\n2\nENTITIES\n" + entities + "0\nENDSEC\n0\nEOF\n";
}
struct Corner {
  double x, y, bulge = 0;
};
std::string outline(const std::string& layer, const std::vector<Corner>& corners) {
  std::string out = "0\nLWPOLYLINE\n8\n" + layer + "\n70\n1\n";
  for (const Corner& c : corners) {
    out += "10\n" + std::to_string(c.x) + "\n20\n" + std::to_string(c.y) + "\n";
    if (c.bulge != 0) out += "42\n" + std::to_string(c.bulge) + "\n";
  }
  return out;
}
const std::vector<Corner> kSquare{{0, 0}, {4, 0}, {4, 4}, {0, 4}};

/// Corners of the first footprint of a site.
std::vector<Corner> corners_of(const std::string& text) {
  std::vector<Corner> out;
  static const std::regex corner(R"re(\["(-?[0-9.]+) m", "(-?[0-9.]+) m"\])re");
  const std::string line = text.substr(text.find("footprint"), text.find("clearance") - text.find("footprint"));
  for (std::sregex_iterator at(line.begin(), line.end(), corner), end; at != end; ++at)
    out.push_back({std::stod((*at)[1]), std::stod((*at)[2])});
  return out;
}
double area_of(const std::vector<Corner>& c) {
  double sum = 0;
  for (size_t i = 0; i < c.size(); ++i) {
    const Corner &a = c[i], &b = c[(i + 1) % c.size()];
    sum += 0.5 * (a.x * b.y - b.x * a.y);
  }
  return sum;
}
bool holds(const std::vector<Corner>& c, double x, double y) {
  bool is_inside = false;
  for (size_t i = 0, j = c.size() - 1; i < c.size(); j = i++)
    if ((c[i].y > y) != (c[j].y > y) && x < c[j].x + (c[i].x - c[j].x) * (y - c[j].y) / (c[i].y - c[j].y))
      is_inside = !is_inside;
  return is_inside;
}

TEST(ImportDxfLayers, NameUtilitiesByWholeWords) {
  for (const char* layer : {"GAS",
                            "Gasleitung",
                            "Wasserleitungen",
                            "Stromkabel",
                            "Abwasser",
                            "ABWASSERKANAL",
                            "Kanal",
                            "Kanäle",
                            "Fernwärme",
                            "FERNWÄRME-LEITUNG",
                            "DN100_GasLeitung",
                            "Erdkabel",
                            "ELEKTRO",
                            "electricity",
                            "Strom",
                            "water",
                            "WATER_MAIN",
                            "watermain",
                            "Sewer 2",
                            "power lines",
                            "Telekom",
                            "3-pipe",
                            "Haus_Gasleitung",
                            "Rohrleitung",
                            "Entwässerung",
                            "Utilities",
                            "E-Kabel",
                            "HOCHSPANNUNGSLEITUNG"})
    EXPECT_TRUE(names_utility(layer)) << layer;
  for (const char* layer :
       {"Gasthof", "GASSE", "HAUS_GASSE_1", "Powerhouse", "Wasserturm", "Wassermühle", "Strombad", "Bauleitung",
        "Gas station", "WATER TOWER", "Kanalstrasse", "Begleitung", "Gebäude", "H", "0", "", "Kabelwerk", "Ostrom"})
    EXPECT_FALSE(names_utility(layer)) << layer;
}

TEST(ImportDxfLayers, AreNamedInTheReport) {
  const Import made = make_site_text(drawing(outline("Gasthof", kSquare) + outline("ELEKTRO", kSquare) +
                                             outline("Kanal", kSquare) + outline("ELEKTRO", kSquare)),
                                     "s.dxf", 1);
  EXPECT_THAT(made.report.guessed,
              Contains("outlines on layers named like pipes and cables are utilities: ELEKTRO, Kanal"));
  EXPECT_THAT(made.text, HasSubstr("[[site.neighbour]]\nname = \"Gasthof 1\""));
}

TEST(ImportDxfLayers, DecodeCharactersByTheirCode) {
  EXPECT_EQ(decode_dxf_text("\\U+00DCbung \\U+20ac \\U+12 \\U"), "Übung € \\U+12 \\U");
  EXPECT_THAT(make_site_text(drawing(outline("M\\U+00FChle", kSquare)), "s.dxf", 1).text,
              HasSubstr("name = \"Mühle 1\""));
}

TEST(ImportDxfArcs, CirclesLieWithinTheirOutlines) {
  const std::string circle = "0\nCIRCLE\n8\nTank\n10\n10.0\n20\n20.0\n30\n0.0\n40\n5.0\n";
  for (const std::string& entity :
       {circle, outline("Tank", {{5, 20, 1}, {15, 20, 1}}), outline("Tank", {{5, 20, -1}, {15, 20, -1}}),
        outline("Tank", {{5, 20, 1}, {15, 20, 1}, {5, 20, 0}})}) {
    const Import made = make_site_text(drawing(entity), "s.dxf", 1);
    const std::vector<Corner> c = corners_of(made.text);
    ASSERT_GT(c.size(), 30u);
    EXPECT_LE(c.size(), 80u);
    for (int i = 0; i < 360; ++i) {
      const double a = i * kPi / 180;
      EXPECT_TRUE(holds(c, 10 + 4.998 * std::cos(a), 20 + 4.998 * std::sin(a))) << i;
      EXPECT_FALSE(holds(c, 10 + 5.012 * std::cos(a), 20 + 5.012 * std::sin(a))) << i;
    }
    EXPECT_THAT(made.report.guessed, Contains(HasSubstr("arcs of 1 outlines became chords")));
    EXPECT_THAT(made.report.missing, Not(Contains(HasSubstr("CIRCLE"))));
  }
}

TEST(ImportDxfArcs, BentInwardsAreCutOff) {
  // a square with a half circle out of one side and one into another, in both directions of going round
  const double exact = 16;
  for (const bool is_turned : {false, true}) {
    std::vector<Corner> corners{{0, 0, 0}, {4, 0, 1}, {4, 4, 0}, {0, 4, -1}};
    if (is_turned) corners = {{0, 0, 1}, {0, 4, 0}, {4, 4, -1}, {4, 0, 0}};
    const std::vector<Corner> c = corners_of(make_site_text(drawing(outline("H", corners)), "s.dxf", 1).text);
    EXPECT_GT(std::abs(area_of(c)), exact) << is_turned;
    EXPECT_LT(std::abs(area_of(c)), exact + 0.15) << is_turned;
    for (int i = -85; i < 86; ++i) {
      const double a = i * kPi / 180;
      EXPECT_TRUE(holds(c, 4 + 1.998 * std::cos(a), 2 + 1.998 * std::sin(a))) << i;
      EXPECT_TRUE(holds(c, 2.002 * std::cos(a), 2 + 2.002 * std::sin(a))) << i;
    }
  }
}

TEST(ImportDxfArcs, KeepToTheCornersOfAPlanAndToPlanesSeenFromBelow) {
  std::vector<Corner> scallops;  // 60 bays around
  for (int i = 0; i < 60; ++i) scallops.push_back({100 * std::cos(i * kPi / 30), 100 * std::sin(i * kPi / 30), 0.4});
  const std::vector<Corner> c = corners_of(make_site_text(drawing(outline("H", scallops)), "s.dxf", 1).text);
  EXPECT_GT(c.size(), 119u);
  EXPECT_LE(c.size(), 200u);
  std::string below = outline("H", {{2, 0, 1}, {6, 0, 0}});
  below.insert(below.find("10\n2"), "210\n0\n220\n0\n230\n-1\n");
  const std::vector<Corner> half = corners_of(make_site_text(drawing(below), "s.dxf", 1).text);
  EXPECT_TRUE(holds(half, -4, -1.99));
  EXPECT_FALSE(holds(half, -4, 0.1));
}

/// A closed polyline in space over a square, whose third corner has this height.
std::string polyline_in_space(const std::string& height, int frame_vertices = 0) {
  std::string out = "0\nPOLYLINE\n8\nH\n66\n1\n10\n0\n20\n0\n30\n0\n70\n9\n";
  for (const char* corner : {"10\n20\n20\n30\n30\n5\n", "10\n30\n20\n30\n30\n5\n", "10\n30\n20\n45\n30\n"}) {
    out += std::string("0\nVERTEX\n8\nH\n") + corner;
    if (std::string(corner).ends_with("30\n")) out += height + "\n";
    out += "70\n32\n";
  }
  for (int i = 0; i < frame_vertices; ++i) out += "0\nVERTEX\n8\nH\n10\n40\n20\n40\n30\n9\n70\n48\n";
  return out + "0\nVERTEX\n8\nH\n10\n20\n20\n45\n30\n5\n70\n32\n0\nSEQEND\n";
}

TEST(ImportDxfHeights, OfCornersThatDifferLeaveAnOutlineOut) {
  const std::string flat = outline("H", kSquare);
  for (const char* height : {"8", "4.998", "-5", "1e3"}) {
    const Import made = make_site_text(drawing(flat + polyline_in_space(height)), "s.dxf", 1);
    EXPECT_THAT(made.report.taken, Contains("1 closed outlines")) << height;
    EXPECT_THAT(made.report.missing, Contains("1 outlines that do not lie flat are left out")) << height;
  }
  // within rounding, and what only guides a spline
  for (const char* height : {"5", "5.0000000001", "5.0005"})
    EXPECT_THAT(make_site_text(drawing(polyline_in_space(height, 1)), "s.dxf", 1).report.taken,
                Contains("1 closed outlines"))
        << height;
  // in metres, not in the drawing's unit
  EXPECT_THAT(make_site_text(drawing(polyline_in_space("5.005")), "s.dxf", 0.1).report.taken,
              Contains("1 closed outlines"));
  EXPECT_THAT(make_site_text(drawing(flat + polyline_in_space("5.005")), "s.dxf", 1).report.taken,
              Contains("1 closed outlines"));
  // the first corner again, above itself
  std::string helix = polyline_in_space("5");
  helix.insert(helix.find("0\nSEQEND"), "0\nVERTEX\n8\nH\n10\n20\n20\n30\n30\n8\n70\n32\n");
  EXPECT_THAT(make_site_text(drawing(flat + helix), "s.dxf", 1).report.missing,
              Contains("1 outlines that do not lie flat are left out"));
  // a guide, its flag before or behind its place
  const std::string bare = polyline_in_space("5");
  for (const char* guide : {"70\n16\n10\n90\n20\n80\n30\n5\n", "10\n90\n20\n80\n30\n5\n70\n16\n"}) {
    std::string guided = bare;
    guided.insert(guided.find("0\nSEQEND"), std::string("0\nVERTEX\n8\nH\n") + guide);
    EXPECT_EQ(make_site_text(drawing(guided), "s.dxf", 1).text, make_site_text(drawing(bare), "s.dxf", 1).text)
        << guide;
  }
  EXPECT_THROW((void)make_site_text(drawing(polyline_in_space("high")), "s.dxf", 1), InputError);
}

TEST(ImportDxfLines, EndInAnyOfThreeWays) {
  const std::string text = drawing(outline("H", kSquare) + "0\nLINE\n8\nx\n");
  const auto with = [](const std::string& lines, const std::string& end) {
    return std::regex_replace(lines, std::regex("\n"), end);
  };
  const Import made = make_site_text(text, "s.dxf", 1);
  for (const char* end : {"\r", "\r\n", "\r\r\n", " \n"})
    for (const char* behind : {"", "\r", "\n", "\r\n"}) {
      const Import other = make_site_text(with(text, end) + behind, "s.dxf", 1);
      EXPECT_EQ(other.text, made.text);
      EXPECT_EQ(other.report.missing, made.report.missing);
    }
  // lines are counted alike
  const std::string wrong = with(drawing(outline("H", kSquare) + "0\nLWPOLYLINE\n10\nx\n"), "\r");
  try {
    (void)make_site_text(wrong, "s.dxf", 1);
    FAIL() << "a word was taken for a coordinate";
  } catch (const InputError& e) {
    EXPECT_EQ(e.diagnostics()[0].where.line, 30);
    EXPECT_EQ(e.diagnostics()[0].message, "a coordinate is wanted, there is \"x\"");
  }
}

std::string block(const std::string& name, const std::string& base, const std::string& entities) {
  return "0\nBLOCK\n8\n0\n2\n" + name + "\n70\n0\n" + base + entities + "0\nENDBLK\n8\n0\n";
}
std::string with_blocks(const std::string& blocks, const std::string& entities) {
  return "0\nSECTION\n2\nBLOCKS\n" + blocks + "0\nENDSEC\n" + drawing(entities);
}
std::string insertion(const std::string& name, const std::string& layer, const std::string& codes) {
  return "0\nINSERT\n8\n" + layer + "\n2\n" + name + "\n" + codes;
}
const std::vector<Corner> kHouse{{1, 1}, {5, 1}, {5, 3}, {1, 3}};

void expect_corners(const std::string& text, const std::vector<Corner>& wanted) {
  const auto found = corners_of(text);
  ASSERT_EQ(found.size(), wanted.size()) << text;
  for (size_t i = 0; i < wanted.size(); ++i) {
    EXPECT_NEAR(found[i].x, wanted[i].x, 6e-4) << i << text;
    EXPECT_NEAR(found[i].y, wanted[i].y, 6e-4) << i << text;
  }
}

TEST(ImportDxfBlocks, LieWhereTheyAreInserted) {
  // base point (1, 1) to (10, 20), twice and three times as large, then turned by a quarter
  const std::string text = with_blocks(block("House", "10\n1\n20\n1\n", outline("0", kHouse)),
                                       insertion("HOUSE", "Buildings", "10\n10\n20\n20\n41\n2\n42\n3\n50\n90\n"));
  const Import made = make_site_text(text, "site.dxf", 1);
  expect_corners(made.text, {{10, 20}, {10, 28}, {4, 28}, {4, 20}});
  EXPECT_THAT(made.text, HasSubstr("name = \"Buildings 1\""));
  EXPECT_THAT(made.report.guessed, Contains(HasSubstr("symbol only: 1 HOUSE")));
  EXPECT_THAT(made.report.taken, Contains("1 closed outlines"));
  // in decimetres
  expect_corners(make_site_text(text, "site.dxf", 0.1).text, {{1, 2}, {1, 2.8}, {0.4, 2.8}, {0.4, 2}});
}

TEST(ImportDxfBlocks, KeepTheirOwnLayersAndAreSeenFromBelow) {
  const Import made = make_site_text(
      with_blocks(block("H", "", outline("Gasleitung", kHouse)), insertion("H", "B", "10\n10\n20\n0\n230\n-1\n")),
      "site.dxf", 1);
  EXPECT_THAT(made.text, HasSubstr("[[site.utility]]\nname = \"Gasleitung 1\""));
  expect_corners(made.text, {{-11, 1}, {-15, 1}, {-15, 3}, {-11, 3}});
}

TEST(ImportDxfBlocks, HoldBlocksInRowsAndColumns) {
  // a row of two houses 10 apart, put in a grid of 2 x 3 that is turned by a quarter
  const std::string row = insertion("H", "0", "10\n0\n20\n0\n") + insertion("H", "0", "10\n10\n20\n0\n");
  const Import made = make_site_text(with_blocks(block("H", "", outline("0", kHouse)) + block("ROW", "", row),
                                                 insertion("ROW", "Plan", "50\n90\n70\n3\n71\n2\n44\n40\n45\n7\n")),
                                     "site.dxf", 1);
  EXPECT_THAT(made.report.taken, Contains("12 closed outlines"));
  EXPECT_THAT(made.report.guessed, Contains(HasSubstr("symbol only: 12 H")));
  // the last: house 2 of column 3 and row 2, (1, 1) + (10, 0) + (80, 7) turned
  EXPECT_THAT(made.text, HasSubstr("name = \"Plan 12\"\nfootprint = [[\"-8.000 m\", \"91.000 m\"]"));
}

TEST(ImportDxfBlocks, HoldEllipsesOfCircles) {
  // in the block's own unit a circle of 0.05; 400 and 200 times as large, mirrored and turned by 30 degrees
  const std::string circle = "0\nCIRCLE\n8\nTank\n10\n0\n20\n0\n40\n0.05\n";
  const Import made = make_site_text(
      with_blocks(block("T", "", circle), insertion("T", "0", "10\n100\n20\n50\n41\n-400\n42\n200\n50\n30\n")),
      "site.dxf", 1);
  const auto found = corners_of(made.text);
  EXPECT_NEAR(std::abs(area_of(found)), kPi * 20 * 10, 0.003 * kPi * 200);
  for (int k = 0; k < 360; ++k) {
    const double a = k * kPi / 180, x = 19.99 * std::cos(a), y = 9.99 * std::sin(a), c = std::cos(kPi / 6);
    EXPECT_TRUE(holds(found, 100 + c * x - 0.5 * y, 50 + 0.5 * x + c * y)) << k;
  }
}

TEST(ImportDxfBlocks, AreLeftOutWhereTheyCannotLieInThePlan) {
  const std::string house = block("H", "", outline("0", kHouse)) + block("XREF", "", "");
  const Import made =
      make_site_text(with_blocks(house, insertion("H", "A", "") + insertion("H", "A", "67\n1\n") +
                                            insertion("H", "A", "210\n1\n230\n1\n") + insertion("H", "A", "41\n0\n") +
                                            insertion("XREF", "A", "") + insertion("GONE", "A", "") +
                                            "0\nATTRIB\n1\ntext\n0\nSEQEND\n8\nA\n"),
                     "site.dxf", 1);
  EXPECT_THAT(made.report.taken, Contains("1 closed outlines"));
  for (const char* left : {"1 outlines in paper space", "1 outlines that do not lie flat", "1 outlines without area"})
    EXPECT_THAT(made.report.missing, Contains(std::string(left) + " are left out"));
  EXPECT_THAT(made.report.missing, Contains(HasSubstr("are left out: 1 GONE, 1 XREF")));
  EXPECT_THAT(made.report.missing, Not(Contains(HasSubstr("SEQEND"))));
}

TEST(ImportDxfBlocks, ThatGrowWithoutEndAreRefused) {
  const auto message = [](const std::string& text) -> std::string {
    try {
      make_site_text(text, "site.dxf", 1);
    } catch (const InputError& e) { return e.diagnostics()[0].message; }
    return "none";
  };
  EXPECT_EQ(message(with_blocks(block("A", "", insertion("B", "0", "")) + block("B", "", insertion("a", "0", "")),
                                insertion("A", "0", ""))),
            "the block A is inserted into itself");
  const std::string many = "70\n1000\n71\n1000\n";
  EXPECT_EQ(message(with_blocks(block("A", "", outline("0", kHouse)), insertion("A", "0", many))),
            "blocks make more than 100000 outlines and insertions");
  // each twice the one within it
  std::string blocks = block("B0", "", outline("0", kHouse));
  for (int i = 1; i < 40; ++i) {
    const std::string inner = insertion("B" + std::to_string(i - 1), "0", "");
    blocks += block("B" + std::to_string(i), "", inner + inner);
  }
  EXPECT_EQ(message(with_blocks(blocks, insertion("B39", "0", ""))),
            "blocks make more than 100000 outlines and insertions");
}

}  // namespace
}  // namespace topple::product
