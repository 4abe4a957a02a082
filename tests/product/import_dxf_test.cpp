// Layers and arcs of drawings.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "product/import.h"
#include "product/layer_names.h"

namespace topple::product {
namespace {

using testing::Contains;
using testing::HasSubstr;

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

}  // namespace
}  // namespace topple::product
