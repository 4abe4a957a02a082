#include "study/inputs_file.h"

#include <gtest/gtest.h>

#include <cmath>

namespace topple::study {
namespace {

const char* const whole = R"toml(title = "Strength"
[inputs]
fc = { triangular = [10, 25, 45], unit = "N/mm2" }
a = { trapezoidal = [1, 2, 3, 4] }
b = { polygonal = [[0, 0], [1, 0.5], [2, 1], [5, 0]] }
c = { tabulated = [[0, -1, 4], [0.5, 0, 1], [1, 0.5, 0.5]] }
d = { value = 7 }
[derived]
fct = { formula = "1.4 * ((fc - 8) / 10)^(2/3)", unit = "N/mm2" }
twice = "2 * fct"
[interaction]
constraints = ["a + b <= 6", "twice >= a - 10"]
membership = "max(0, 1 - abs(a - 2.5) / 2)"
[search]
levels = [0, 0.5, 1]
samples = 500
seed = 3
)toml";

TEST(InputsFile, ReadsNumbersFormulasAndInteraction) {
  const Problem p = read_inputs_text(whole, "inputs.toml");
  EXPECT_EQ(p.title, "Strength");
  ASSERT_EQ(p.inputs.size(), 5u);
  EXPECT_EQ(p.inputs[0].name, "fc");
  EXPECT_EQ(p.inputs[0].unit, "N/mm2");
  EXPECT_EQ(p.space.inputs[0].cut(0.5).left, 17.5);
  EXPECT_EQ(p.space.inputs[1].core().right, 3);
  EXPECT_EQ(p.space.inputs[2].membership(1), 0.5);
  EXPECT_EQ(p.space.inputs[3].cut(0.5).right, 1);
  EXPECT_EQ(p.space.inputs[4].width(), 0);
  const Point x = uncertainty::calc_centre(p.space);
  ASSERT_EQ(p.derived.size(), 2u);
  EXPECT_NEAR(p.calc_derived(x)[0], 1.994163, 1e-6);  // the paper's Table 1
  EXPECT_EQ(p.calc_derived(x)[1], 2 * p.calc_derived(x)[0]);
  EXPECT_EQ(p.space.constraints.size(), 2u);
  EXPECT_TRUE(uncertainty::is_allowed(p.space, x));
  EXPECT_FALSE(uncertainty::is_allowed(p.space, {25, 4, 5, 0.5, 7}));
  EXPECT_EQ(p.space.joint(x), 1);
  EXPECT_EQ(p.space.joint({25, 1.5, 2, 0.5, 7}), 0.5);
  EXPECT_EQ(p.levels, (std::vector<double>{0, 0.5, 1}));
  EXPECT_EQ(p.limit, 500);
  EXPECT_EQ(p.seed, 3u);
}

struct Wrong {
  const char *from, *to;
  int line;
  const char* code;
};

TEST(InputsFile, PointsAtEveryMistake) {
  for (const Wrong& w : std::vector<Wrong>{
           {"[10, 25, 45]", "[10, 55, 45]", 3, "E207"},
           {"[10, 25, 45]", "[10, 45]", 3, "E202"},
           {"[10, 25, 45]", "[10, \"25 m\", 45]", 3, "E202"},
           {"triangular", "triangle", 3, "E203"},
           {"[5, 0]]", "[5, 0.5]]", 5, "E207"},
           {"[0, -1, 4]", "[0, 1, 4]", 6, "E207"},
           {"value = 7", "value = 7, triangular = [1, 2, 3]", 7, "E207"},
           {"value = 7", "value = 1.7e308", 7, "E207"},
           {"[10, 25, 45]", "[10, 25, 1.7e308]", 3, "E207"},
           {"d = {", "2d = {", 7, "E203"},
           {"(fc - 8)", "(fx - 8)", 9, "E208"},
           {"(fc - 8)", "(fc - 80)", 9, "E207"},
           {"twice = ", "fc = ", 10, "E203"},
           {"a + b <= 6", "a + b < 6", 12, "E202"},
           {"a + b <= 6", "a + g <= 6", 12, "E208"},
           {"a + b <= 6", "a + b <= 3", 12, "E207"},
           {"abs(a - 2.5)", "abs(a - 2)", 13, "E207"},
           {"1 - abs(a - 2.5)", "1 + abs(a - 2.5)", 13, "E207"},
           {"levels = [0, 0.5, 1]", "levels = [0, 1.5]", 15, "E205"},
           {"samples = 500", "samples = 5", 16, "E205"},
           {"seed = 3", "sed = 3", 17, "E203"},
       }) {
    std::string text = whole;
    text.replace(text.find(w.from), std::string(w.from).size(), w.to);
    try {
      read_inputs_text(text, "inputs.toml");
      ADD_FAILURE() << "accepted: " << w.to;
    } catch (const InputError& e) {
      bool is_there = false;
      std::string found;
      for (const Diagnostic& d : e.diagnostics()) {
        is_there = is_there || (d.where.line == w.line && d.code == w.code);
        found += d.code + " line " + std::to_string(d.where.line) + ": " + d.message + "\n";
      }
      EXPECT_EQ(found.find("inputs.fc: inputs.fc"), std::string::npos) << found;
      EXPECT_TRUE(is_there) << w.to << "\n" << found;
    }
  }
}

TEST(InputsFile, WantsInputs) {
  const auto complaint_of = [](const char* text) {
    try {
      read_inputs_text(text, "f");
    } catch (const InputError& e) { return e.diagnostics().front(); }
    return Diagnostic{};
  };
  EXPECT_NE(complaint_of("title = \"x\"\n").message.find("missing table"), std::string::npos);
  const auto hint_of = [&](const std::string& number) {
    return complaint_of(("[inputs]\na = { triangular = [1, " + number + ", 3] }\n").c_str()).help;
  };
  EXPECT_EQ(hint_of("\"2 m\"").substr(0, 13), "give the unit");
  for (const char* number : {"nan", "inf", "\"x\""}) EXPECT_EQ(hint_of(number).substr(0, 7), "numbers") << number;
  EXPECT_EQ(complaint_of("").message, "the file of fuzzy inputs is empty");
  const Diagnostic none = complaint_of("title = \"x\"\n[inputs]\n");
  EXPECT_EQ(none.message, "there is no input in [inputs]");
  EXPECT_EQ(none.where.line, 2);
}

}  // namespace
}  // namespace topple::study
