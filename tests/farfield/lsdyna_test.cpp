// The keyword file read back by the widths of its fields.
#include "farfield/lsdyna.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <sstream>

#include "plans.h"

namespace topple::farfield {
namespace {

/// Cards by keyword, comments left out.
struct Block {
  std::string keyword;
  std::vector<std::string> cards;
};

std::vector<Block> read_blocks(const std::string& text) {
  std::vector<Block> blocks;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) {
    if (line.empty() || line[0] == '$') continue;
    if (line[0] == '*')
      blocks.push_back({line.substr(1), {}});
    else
      blocks.back().cards.push_back(line);
  }
  return blocks;
}

/// Field number `index` of `width` characters; 0 where it is blank.
double number(const std::string& card, size_t index, size_t width) {
  if (index * width >= card.size()) return 0;
  const std::string text = card.substr(index * width, width);
  return text.find_first_not_of(' ') == std::string::npos ? 0 : std::stod(text);
}
int whole(const std::string& card, size_t index, size_t width) { return static_cast<int>(number(card, index, width)); }

struct Deck {
  std::map<int, Vec3> nodes;
  std::map<int, std::array<int, 8>> elements;
  std::map<int, int> part_of, material_of;
  std::map<int, double> density, modulus, fails_at;
  std::map<int, std::vector<std::pair<double, double>>> curves;
  std::map<int, std::pair<int, int>> yield_curves;
  int held = 0;
};

Deck read_deck(const std::string& text) {
  Deck d;
  for (const Block& b : read_blocks(text)) {
    const auto& c = b.cards;
    if (b.keyword == "NODE")
      for (const std::string& card : c)
        d.nodes[std::stoi(card.substr(0, 8))] = {std::stod(card.substr(8, 16)), std::stod(card.substr(24, 16)),
                                                 std::stod(card.substr(40, 16))};
    if (b.keyword == "ELEMENT_SOLID")
      for (const std::string& card : c) {
        const int id = whole(card, 0, 8);
        d.part_of[id] = whole(card, 1, 8);
        for (size_t i = 0; i < 8; ++i) d.elements[id][i] = whole(card, i + 2, 8);
      }
    if (b.keyword == "PART") d.material_of[whole(c[1], 0, 10)] = whole(c[1], 2, 10);
    if (b.keyword == "MAT_PLASTICITY_COMPRESSION_TENSION") {
      const int id = whole(c[0], 0, 10);
      d.density[id] = number(c[0], 1, 10);
      d.modulus[id] = number(c[0], 2, 10);
      d.yield_curves[id] = {whole(c[1], 0, 10), whole(c[1], 1, 10)};
    }
    if (b.keyword == "MAT_ADD_EROSION") d.fails_at[whole(c[0], 0, 10)] = number(c[1], 7, 10);
    if (b.keyword == "DEFINE_CURVE")
      for (size_t i = 1; i < c.size(); ++i)
        d.curves[whole(c[0], 0, 10)].emplace_back(number(c[i], 0, 20), number(c[i], 1, 20));
    if (b.keyword == "BOUNDARY_SPC_NODE") d.held += static_cast<int>(c.size());
  }
  return d;
}

TEST(LsDyna, HoldsTheSameMeshMassesAndLaws) {
  const product::Plan plan = read(portal(charge("C-A1-0", "100 ms", "scatter = \"0 ms\"")));
  collapse::ModelMap map;
  const mbs::Model model = collapse::make_model(plan, collapse::default_knowledge(), map);
  GridOptions options;
  options.size = 0.4;
  const Whole w = make_whole(plan, collapse::default_knowledge(), options, model, map);
  const std::string text = to_lsdyna(plan, w, map, 2, 0.6);
  EXPECT_EQ(text.rfind("*KEYWORD\n", 0), 0u);
  EXPECT_EQ(text.substr(text.size() - 5), "*END\n");
  const Deck d = read_deck(text);
  ASSERT_EQ(d.nodes.size(), w.fe.nodes.size());
  ASSERT_EQ(d.elements.size(), w.fe.elements.size());
  EXPECT_EQ(static_cast<size_t>(d.held), w.fe.supports.size());
  // coordinates have at least nine digits in sixteen characters
  for (const auto& [id, p] : d.nodes) EXPECT_LT(norm(p - w.fe.nodes[static_cast<size_t>(id - 1)]), 1e-8);
  double mass = 0;
  int charged = 0;
  for (const auto& [id, nodes] : d.elements) {
    std::array<Vec3, 8> p;
    for (size_t i = 0; i < 8; ++i) {
      EXPECT_EQ(nodes[i] - 1, w.fe.elements[static_cast<size_t>(id - 1)].node[i]);
      p[i] = d.nodes.at(nodes[i]);
    }
    const int material = d.material_of.at(d.part_of.at(id));
    mass += d.density.at(material) * fem::calc_hex_volume(p);
    if (const auto it = d.fails_at.find(material); it != d.fails_at.end()) {
      ++charged;
      EXPECT_NEAR(it->second, 0.1, 1e-9);
    }
  }
  // densities have at least six digits in ten characters
  const double wanted = collapse::calc_standing_mass(plan);
  EXPECT_NEAR(mass, wanted, 1e-5 * wanted);
  EXPECT_EQ(static_cast<size_t>(charged), w.charges.at(0).elements.size());
  // the yield curves of the first element's material
  const int material = d.material_of.at(d.part_of.at(1));
  const auto& law = w.fe.materials[static_cast<size_t>(w.fe.elements[0].material)].yield;
  const auto& compression = d.curves.at(d.yield_curves.at(material).first);
  const auto& tension = d.curves.at(d.yield_curves.at(material).second);
  ASSERT_EQ(compression.size(), law.size());
  for (size_t i = 0; i < law.size(); ++i) {
    EXPECT_NEAR(compression[i].second, law[i].compression, 1e-9 * law[i].compression);
    EXPECT_NEAR(tension[i].second, law[i].tension, 1e-9 * law[i].tension);
    EXPECT_NEAR(compression[i].first, law[i].strain, 1e-9);
  }
}

TEST(LsDyna, KeepsChargesThatFail) {
  const product::Plan plan = read(portal(charge("C-A1-0", "100 ms", "fails = true")));
  collapse::ModelMap map;
  const mbs::Model model = collapse::make_model(plan, collapse::default_knowledge(), map);
  const Whole w = make_whole(plan, collapse::default_knowledge(), {}, model, map);
  EXPECT_TRUE(read_deck(to_lsdyna(plan, w, map, 2, 0.6)).fails_at.empty());
}

TEST(LsDyna, TitlesAreNoKeywordsAndEndWithACharacter) {
  product::Plan plan = read(portal(charge("C-A1-0", "100 ms", "scatter = \"0 ms\"")));
  collapse::ModelMap map;
  const mbs::Model model = collapse::make_model(plan, collapse::default_knowledge(), map);
  const Whole w = make_whole(plan, collapse::default_knowledge(), {}, model, map);
  const auto title = [&](const std::string& given) {
    plan.title = given;
    const std::string text = to_lsdyna(plan, w, map, 2, 0.6);
    const size_t from = text.find("*TITLE\n") + 7;
    return text.substr(from, text.find('\n', from) - from);
  };
  EXPECT_EQ(title("*NODE of the building"), " *NODE of the building");
  EXPECT_EQ(title("$ it costs"), " $ it costs");
  EXPECT_EQ(title(std::string(79, 'x') + "\u00e4y"), std::string(79, 'x')) << "two bytes do not fit";
  EXPECT_EQ(title(std::string(78, 'x') + "\u00e4y"), std::string(78, 'x') + "\u00e4");
}

}  // namespace
}  // namespace topple::farfield
