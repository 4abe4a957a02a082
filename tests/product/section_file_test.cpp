#include "product/section_file.h"

#include <gtest/gtest.h>

#include <string>

#include "base/unit.h"

namespace topple::product {
namespace {

std::string small_section() {
  return R"toml(title = "Column"
[concrete.C25]
fc = "25 N/mm2"
Ec = "30 GPa"
[steel.S]
fy = "420 N/mm2"
fu = "500 N/mm2"
eps_u = 0.1
[section.column]
width = "40 cm"
height = "50 cm"
concrete = "C25"
steel = "S"
cover = "3 cm"
ties = { diameter = "8 mm", spacing = "20 cm" }
bars = { count_y = 3, count_z = 3, diameter = "20 mm" }
[zone]
length = "30 cm"
normal_force = ["0 kN", "1.5 MN", "-200 kN"]
cut_bars = 0.25
cut_concrete = "10 %"
transition_damage = 0.2
cover_lost = true
)toml";
}

std::string replaced(std::string text, const std::string& old_words, const std::string& new_words) {
  const size_t at = text.find(old_words);
  EXPECT_NE(at, std::string::npos) << old_words;
  return at == std::string::npos ? text : text.replace(at, old_words.size(), new_words);
}

SectionFile read(const std::string& text) {
  std::vector<Diagnostic> warnings;
  return read_section_file_text(text, "s.toml", warnings);
}

TEST(SectionFile, GivesSectionMaterialsAndZone) {
  const SectionFile f = read(small_section());
  EXPECT_EQ(f.title, "Column");
  EXPECT_EQ(f.section.name, "column");
  EXPECT_DOUBLE_EQ(f.section.width, 0.4);
  EXPECT_EQ(f.section.bars.size(), 8u);
  EXPECT_DOUBLE_EQ(f.concrete.fc, 25 * unit::MPa);
  EXPECT_DOUBLE_EQ(f.steel.fy, 420 * unit::MPa);
  EXPECT_DOUBLE_EQ(f.length, 0.3);
  EXPECT_TRUE(f.has_length);
  ASSERT_EQ(f.normal_forces.size(), 3u);
  EXPECT_DOUBLE_EQ(f.normal_forces[1], -1.5e6) << "compression is positive in the file, negative inside";
  EXPECT_DOUBLE_EQ(f.normal_forces[2], 2e5);
  EXPECT_DOUBLE_EQ(f.cut_bars, 0.25);
  EXPECT_DOUBLE_EQ(f.cut_concrete, 0.1);
  EXPECT_DOUBLE_EQ(f.concrete_loss, 0.2);
  EXPECT_TRUE(f.cover_lost);
  EXPECT_EQ(f.where.line, 9);
  EXPECT_EQ(f.where_length.line, 18);
}

TEST(SectionFile, TakesOneDepthAsLengthWithoutAZone) {
  const SectionFile f = read(small_section().substr(0, small_section().find("[zone]")));
  EXPECT_DOUBLE_EQ(f.length, 0.5);
  EXPECT_FALSE(f.has_length);
  EXPECT_TRUE(f.normal_forces.empty());
  EXPECT_EQ(f.where_length.line, 9) << "a length that does not fit is then the section's fault";
}

struct Mistake {
  const char *old_words, *new_words, *code, *message;
  int line, column;
};

TEST(SectionFile, ComplainsAtThePlaceOfTheMistake) {
  const Mistake mistakes[] = {
      {"fc = \"25 N/mm2\"", "fc = \"25 m\"", "E204", "fc", 3, 6},
      {"height = \"50 cm\"", "heigth = \"50 cm\"", "E203", "heigth", 11, 1},
      {"concrete = \"C25\"", "concrete = \"C52\"", "E301", "C52", 12, 12},
      {"[zone]", "[zone]\nlenght = \"1 m\"", "E203", "lenght", 18, 1},
      {"length = \"30 cm\"", "length = \"0 cm\"", "E205", "length", 18, 10},
      {"length = \"30 cm\"", "length = 0.3", "E204", "length", 18, 10},
      {"\"1.5 MN\"", "\"1.5 m\"", "E204", "normal_force", 19, 25},
      {"[\"0 kN\", \"1.5 MN\", \"-200 kN\"]", "[]", "E209", "normal_force", 19, 16},
      {"cut_bars = 0.25", "cut_bars = 1.25", "E205", "cut_bars", 20, 12},
      {"cut_bars = 0.25\ncut_concrete = \"10 %\"\ntransition_damage = 0.2",
       "cut_bars = 1\ncut_concrete = \"10 %\"\ntransition_damage = 1", "E205", "nothing is left", 20, 12},
      {"cover_lost = true", "cover_lost = 1", "E202", "cover_lost", 23, 14},
      {"[section.column]", "[section.other]\n[section.column]", "E209", "one section", 10, 10},
      {"[zone]", "[grid]\n[zone]", "E203", "this is a plan", 17, 2},
      {"[section.column]", "[sections.column]", "E203", "sections", 9, 2},
      {"title = \"Column\"", "title = Column", "E101", "", 1, 9},
  };
  for (const Mistake& m : mistakes) {
    try {
      read(replaced(small_section(), m.old_words, m.new_words));
      ADD_FAILURE() << "nothing is wrong with " << m.new_words;
    } catch (const InputError& e) {
      bool found = false;
      std::string all;
      for (const Diagnostic& d : e.diagnostics()) {
        all +=
            d.code + " " + std::to_string(d.where.line) + ":" + std::to_string(d.where.column) + " " + d.message + "\n";
        found = found || (d.code == m.code && d.where.line == m.line && d.where.column == m.column &&
                          d.message.find(m.message) != std::string::npos);
      }
      EXPECT_TRUE(found) << m.new_words << ":\n" << all;
    }
  }
}

TEST(SectionFile, NeedsASection) {
  EXPECT_THROW(read("title = \"x\"\n"), InputError);
  EXPECT_THROW(read("[concrete]\n[steel]\n[section]\n"), InputError);
}

}  // namespace
}  // namespace topple::product
