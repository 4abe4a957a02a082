#include "product/fuzzy_file.h"

#include <gtest/gtest.h>

#include "base/file.h"
#include "base/unit.h"

namespace topple::product {
namespace {

const std::string folder = TOPPLE_SOURCE_DIR "/examples/rcc/";

SectionFile read_section() {
  std::vector<Diagnostic> warnings;
  std::string text;
  return read_section_file(folder + "zone_I.toml", warnings, text);
}

FuzzyFile read(const std::string& text, std::vector<Diagnostic>* warnings_out = nullptr) {
  std::vector<Diagnostic> warnings;
  const FuzzyFile f = read_fuzzy_text(text, "f.toml", read_section(), warnings);
  if (warnings_out) *warnings_out = warnings;
  return f;
}

TEST(FuzzyFile, ReadsTableOne) {
  std::vector<Diagnostic> warnings;
  std::string text;
  const FuzzyFile f = read_fuzzy_file(folder + "zone_I_fuzzy.toml", read_section(), warnings, text);
  EXPECT_TRUE(warnings.empty()) << warnings.front().message;
  ASSERT_EQ(f.inputs.size(), 4u);
  EXPECT_EQ(f.inputs[0].path, "concrete.Ec");
  EXPECT_EQ(f.inputs[1].path, "concrete.fc");
  EXPECT_EQ(f.inputs[2].path, "steel.fy");
  EXPECT_EQ(f.inputs[3].path, "section.steel_area");
  EXPECT_DOUBLE_EQ(f.inputs[1].corners[0].first, 10 * unit::MPa);
  EXPECT_DOUBLE_EQ(f.inputs[1].corners[1].first, 25 * unit::MPa);
  EXPECT_EQ(f.inputs[1].corners[1].second, 1);
  EXPECT_DOUBLE_EQ(f.inputs[3].corners[2].first, 88e-4);
  ASSERT_EQ(f.derived.size(), 3u);
  const std::vector<double> derived = calc_derived(f, std::vector{15e9, 45e6, 420e6, 64e-4});
  EXPECT_NEAR(derived[0], 3.349108e6, 0.5) << "fct of Table 1";
  EXPECT_DOUBLE_EQ(derived[1], 1.3 * 45e6 / 15e9);
  EXPECT_DOUBLE_EQ(derived[2], 1.19 * 420e6);
}

TEST(FuzzyFile, SamplesAreSectionsWithTheirValues) {
  std::vector<Diagnostic> warnings;
  std::string text;
  const SectionFile section = read_section();
  const FuzzyFile f = read_fuzzy_file(folder + "zone_I_fuzzy.toml", section, warnings, text);
  const SectionFile s = make_sample(section, f, std::vector{20e9, 12e6, 250e6, 40e-4});
  EXPECT_DOUBLE_EQ(s.concrete.Ec, 20e9);
  EXPECT_DOUBLE_EQ(s.concrete.fc, 12e6);
  EXPECT_NEAR(s.concrete.fct, 1.4e6 * std::pow(0.4, 2.0 / 3), 1);
  EXPECT_DOUBLE_EQ(s.concrete.Gf, 73 * std::pow(12, 0.18)) << "what the file leaves to fc follows the sample's fc";
  EXPECT_DOUBLE_EQ(s.steel.fy, 250e6);
  EXPECT_DOUBLE_EQ(s.steel.fu, 1.19 * 250e6);
  EXPECT_NEAR(s.section.steel_area(), 40e-4, 1e-15);
  EXPECT_NEAR(s.section.bars[0].diameter, section.section.bars[0].diameter * std::sqrt(40.0 / 64), 1e-12);
  EXPECT_EQ(s.section.bars[0].y, section.section.bars[0].y) << "bars keep their places";
  EXPECT_EQ(s.length, section.length);
  EXPECT_THROW(make_sample(section, f, std::vector{20e9, 7e6, 250e6, 40e-4}), InputError) << "fc below 8 N/mm2";
}

TEST(FuzzyFile, TakesEveryShapeAndNestedValues) {
  const FuzzyFile f = read(R"(
concrete.fc = { trapezoidal = ["20 N/mm2", "24 N/mm2", "26 N/mm2", "30 N/mm2"] }
section.cover = { polygonal = [["1 cm", 0], ["2 cm", 0.5], ["3 cm", 1], ["5 cm", 0]] }
section.ties.spacing = { triangular = ["10 cm", "20 cm", "30 cm"] }
zone.length = { formula = "0.5 * height + 2 * cover" }
[search]
levels = [0, 0.5, 1]
samples = 500
seed = 7
)");
  ASSERT_EQ(f.inputs.size(), 3u);
  EXPECT_EQ(f.inputs[0].corners.size(), 4u);
  EXPECT_EQ(f.inputs[2].name, "ties_spacing");
  EXPECT_EQ(f.levels, (std::vector<double>{0, 0.5, 1}));
  EXPECT_EQ(f.limit, 500);
  EXPECT_EQ(f.seed, 7u);
  const SectionFile s = make_sample(read_section(), f, std::vector{25e6, 0.04, 0.15});
  EXPECT_DOUBLE_EQ(s.section.tie_spacing, 0.15);
  EXPECT_DOUBLE_EQ(s.section.cover, 0.04);
  EXPECT_DOUBLE_EQ(s.length, 0.25 + 0.08) << "formulas count in mm";
  EXPECT_LT(s.section.bars.back().y, 0.25 - 0.04 - 0.01) << "bars move with the cover";
}

struct Mistake {
  const char *text, *code, *message;
  int line, column;
};

TEST(FuzzyFile, ComplainsAtThePlaceOfTheMistake) {
  const Mistake mistakes[] = {
      {"title = \"x\"\n", "E201", "nothing is fuzzy", 1, 1},
      {"concrete.fcc = { triangular = [\"1 N/mm2\", \"2 N/mm2\", \"3 N/mm2\"] }", "E203", "concrete.fcc", 1, 10},
      {"concrete.fc = { triangular = [\"10 m\", \"25 N/mm2\", \"45 N/mm2\"] }", "E204", "a length", 1, 31},
      {"concrete.fc = { triangular = [\"10 N/mm2\", \"25 N/mm2\"] }", "E202", "a list of 3", 1, 30},
      {"concrete.fc = { triangular = [\"30 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }", "E207", "must rise", 1, 30},
      {"concrete.fc = \"25 N/mm2\"", "E202", "a table is wanted", 1, 15},
      {"concrete.fc = { }", "E207", "exactly one", 1, 10},
      {"concrete.fc = { triangular = [\"10 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"], colour = 1 }", "E203", "colour", 1,
       68},
      {"concrete.Ec = { triangular = [\"0.5 GPa\", \"30 GPa\", \"45 GPa\"] }", "E205", "Ec", 1, 10},
      {"concrete.fc = { triangular = [\"7 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\nconcrete.fct = { formula = "
       "\"1.4 * ((fc - 8)/10)^(2/3)\" }",
       "E205", "the formula has no value", 1, 10},
      {"concrete.fc = { triangular = [\"10 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\nconcrete.fct = { formula = "
       "\"1.4 * ((fx - 8)/10)\" }",
       "E208", "no value \"fx\"", 2, 37},
      {"steel.fy = { polygonal = [[\"220 N/mm2\", 0], [\"300 N/mm2\", 0.5], [\"400 N/mm2\", 0]] }", "E207",
       "from 0 up to 1", 1, 26},
      {"section.bars.diameter = { triangular = [\"20 mm\", \"25 mm\", \"32 mm\"] }\n[search]\nsamples = 3", "E205",
       "samples", 3, 11},
      {"bridge.fc = 1", "E203", "bridge", 1, 1},
      {"concrete.fc = { triangular = [\"10 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\n[interaction]\nconstraints = "
       "[\"fc <= 20\"]",
       "E207", "the middle of the fuzzy inputs breaks this constraint", 3, 16},
      {"concrete.fc = { triangular = [\"10 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\n[interaction]\nmembership = "
       "\"0.5 + fc / 100\"",
       "E207", "0.75 in the middle of the fuzzy inputs; 1 is wanted", 3, 14},
      {"concrete.fc = { triangular = [\"10 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\n[interaction]\nconstraints = "
       "[\"fc >= fy\"]",
       "E208", "no value \"fy\"", 3, 23},
  };
  for (const Mistake& m : mistakes) {
    try {
      read(m.text);
      ADD_FAILURE() << "nothing is wrong with " << m.text;
    } catch (const InputError& e) {
      bool found = false;
      std::string all;
      for (const Diagnostic& d : e.diagnostics()) {
        all +=
            d.code + " " + std::to_string(d.where.line) + ":" + std::to_string(d.where.column) + " " + d.message + "\n";
        found = found || (d.code == m.code && d.where.line == m.line && d.where.column == m.column &&
                          d.message.find(m.message) != std::string::npos);
      }
      EXPECT_TRUE(found) << m.text << ":\n" << all;
    }
  }
}

TEST(FuzzyFile, InteractionSeesInputsAndWhatFollowsInTheirUnits) {
  const FuzzyFile f = read(
      "steel.fy = { triangular = [\"380 N/mm2\", \"420 N/mm2\", \"460 N/mm2\"] }\n"
      "section.steel_area = { triangular = [\"50 cm2\", \"64 cm2\", \"80 cm2\"] }\n"
      "steel.fu = { formula = \"1.2 * fy\" }\n"
      "[interaction]\nconstraints = [\"steel_area <= 6400 + 10 * (460 - fy)\", \"fu >= 480\"]\n"
      "membership = \"max(0, 1 - abs(fy - 420) / 30)\"\n");
  const std::vector<double> seen = calc_interacting(f, std::vector{400e6, 70e-4});
  ASSERT_EQ(seen.size(), 3u);
  EXPECT_NEAR(seen[0], 400, 1e-9);
  EXPECT_NEAR(seen[1], 7000, 1e-9);
  EXPECT_NEAR(seen[2], 480, 1e-9);
  EXPECT_TRUE(is_possible(f.interaction, seen)) << "6400 + 600 mm2, to round-off";
  EXPECT_NEAR(calc_joint(f.interaction, seen), 1.0 / 3, 1e-12);
  EXPECT_FALSE(is_possible(f.interaction, calc_interacting(f, std::vector{400e6, 71e-4})));
  EXPECT_FALSE(is_possible(f.interaction, calc_interacting(f, std::vector{399e6, 64e-4}))) << "fu = 478.8";
}

TEST(FuzzyFile, EndsThatTheInteractionRulesOutNeedNotBeSections) {
  const std::string values =
      "concrete.fc = { triangular = [\"5 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\n"
      "concrete.fct = { formula = \"1.4 * ((fc - 8)/10)^(2/3)\" }\n";
  EXPECT_THROW(read(values), InputError);
  EXPECT_EQ(read(values + "[interaction]\nconstraints = [\"fc >= 9\"]\n").inputs.size(), 1u);
}

TEST(FuzzyFile, WarnsOfCornersThatAreNoSection) {
  std::vector<Diagnostic> warnings;
  read(
      "concrete.fc = { triangular = [\"10 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\n"
      "concrete.Ec = { triangular = [\"15e3 N/mm2\", \"30e3 N/mm2\", \"52e3 N/mm2\"] }\n",
      &warnings);
  ASSERT_EQ(warnings.size(), 1u) << "fc = 45 with Ec = 15e3 reaches fc beyond eps_c1";
  EXPECT_EQ(warnings[0].code, "W507");
  EXPECT_NE(warnings[0].message.find("1 of 4"), std::string::npos) << warnings[0].message;
}

}  // namespace
}  // namespace topple::product
