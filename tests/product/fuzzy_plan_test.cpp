#include "product/fuzzy_plan.h"

#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "plan_text.h"
#include "product/plan_sampler.h"

namespace topple::product {
namespace {

std::string with_fuzzy(const std::string& fuzzy) { return small_plan() + fuzzy; }

Plan read(const std::string& fuzzy, std::vector<Diagnostic>* out = nullptr) {
  std::vector<Diagnostic> warnings;
  Plan plan = read_plan(with_fuzzy(fuzzy), "plan.toml", warnings);
  if (out) *out = warnings;
  return plan;
}

constexpr const char* strengths = R"toml([fuzzy]
concrete.C25.fc = { triangular = ["10 N/mm2", "25 N/mm2", "45 N/mm2"] }
concrete.C25.fct = { formula = "1.4 * ((fc - 8) / 10)^(2/3)" }
)toml";

TEST(FuzzyPlan, TiesNumbersToAnyQuantityByItsPath) {
  const Plan plan = read(R"toml([fuzzy]
site.friction = { trapezoidal = [0.4, 0.5, 0.7, "80 %"] }
site.neighbour.House.footprint.3.2 = { triangular = ["28 m", "30 m", "31 m"] }
storeys.load = { triangular = ["0 kN/m2", "1 kN/m2", "2 kN/m2"] }
grid.rows.B = { triangular = ["4.9 m", "5 m", "5.1 m"] }
stage.front.charge.1.destroyed_length = { tabulated = [[0, "1 m", "1.4 m"], [0.5, "1.1 m", "1.4 m"], [1, "1.2 m", "1.2 m"]] }
stage.2.charge.1.delay = { triangular = ["0 ms", "0 ms", "30 ms"] }
cable.1.anchor.1 = { polygonal = [["-41 m", 0], ["-40 m", 1], ["-30 m", 0]] }
[fuzzy.section.column]
steel_area = { triangular = ["20 cm2", "25.13 cm2", "30 cm2"] }
ties.spacing = { triangular = ["15 cm", "20 cm", "25 cm"] }
)toml");
  ASSERT_EQ(plan.fuzzy.inputs.size(), 9u);
  EXPECT_EQ(plan.fuzzy.inputs[3].path, "grid.rows.B");
  EXPECT_EQ(text_of(plan.fuzzy.inputs[2], 1500), "load = 1.5 kN/m2");
  const PlanSampler sampler = make_sampler(plan);
  const Plan s = make_sample(sampler, std::vector<double>{0.45, 29.5, 1500, 5.05, 1.3, 0.02, -35, 28e-4, 0.18});
  EXPECT_EQ(s.ground.friction, 0.45);
  EXPECT_EQ(s.neighbours[0].footprint[2][1], 29.5);
  EXPECT_DOUBLE_EQ(s.storey_loads[1], 1500 / unit::gravity);
  EXPECT_EQ(s.row_offsets[1], 5.05);
  EXPECT_EQ(s.stages[0].charges[0].destroyed_length, 1.3);
  EXPECT_EQ(s.stages[0].charges[2].destroyed_length, 1.3) << "the rule's charges on all columns of the row";
  EXPECT_EQ(s.stages[1].charges[0].delay, 0.02);
  EXPECT_EQ(s.cables[0].anchor.x, -35);
  EXPECT_NEAR(s.sections[0].steel_area(), 28e-4, 1e-15);
  EXPECT_EQ(s.sections[0].tie_spacing, 0.18);
  EXPECT_EQ(s.text, plan.text) << "a sample belongs to the plan's file";
  // [0.5]-cut of the table: corners hold both branches
  EXPECT_THAT(plan.fuzzy.inputs[4].corners,
              testing::ElementsAre(testing::Pair(1, 0), testing::Pair(1.1, 0.5), testing::Pair(1.2, 1),
                                   testing::Pair(1.2, 1), testing::Pair(1.4, 0.5), testing::Pair(1.4, 0)));
}

TEST(FuzzyPlan, FormulasFollowTheSample) {
  const Plan plan = read(strengths);
  ASSERT_EQ(plan.fuzzy.derived.size(), 1u);
  const PlanSampler sampler = make_sampler(plan);
  const Plan s = make_sample(sampler, std::vector{12e6});
  EXPECT_EQ(s.concretes[0].fc, 12e6);
  EXPECT_NEAR(s.concretes[0].fct, 1.4e6 * std::pow(0.4, 2.0 / 3), 1);
  EXPECT_DOUBLE_EQ(s.concretes[0].Gf, 73 * std::pow(12, 0.18)) << "defaults follow too";
}

TEST(FuzzyPlan, ValuesOfTheSampleAreExact) {
  const PlanSampler sampler = make_sampler(read(strengths));
  double fc = 11.1e6;
  for (int i = 0; i < 20; ++i) {
    fc = std::nextafter(fc * 1.05, std::numeric_limits<double>::infinity());
    EXPECT_EQ(make_sample(sampler, std::vector{fc}).concretes[0].fc, fc);
  }
}

TEST(FuzzyPlan, PatternsShareOneValue) {
  const Plan plan = read(R"toml([fuzzy]
stage."*".charge."*".destroyed_length = { triangular = ["0.8 m", "1.1 m", "1.3 m"], name = "gap" }
stage."*".charge."*".position = { formula = "gap / 2 + 300" }
)toml");
  ASSERT_EQ(plan.fuzzy.inputs.size(), 1u);
  EXPECT_EQ(plan.fuzzy.derived.size(), 2u) << "a formula for each charge";
  const Plan s = make_sample(make_sampler(plan), std::vector{1.0});
  for (const Stage& stage : s.stages)
    for (const Charge& c : stage.charges) {
      EXPECT_EQ(c.destroyed_length, 1.0);
      EXPECT_DOUBLE_EQ(c.position, 0.8);
    }
}

TEST(FuzzyPlan, FormulasSeeTheirOwnMaterialFirst) {
  const Plan plan = read(R"toml([fuzzy]
concrete.C25.Gcl = { formula = "fc * friction" }
site.friction = { triangular = [0.5, 0.6, 0.7] }
)toml");
  const Plan s = make_sample(make_sampler(plan), std::vector{0.65});
  EXPECT_DOUBLE_EQ(s.concretes[0].Gcl, 25 * 0.65 * 1e3);
}

TEST(FuzzyPlan, LeavesThePlanAsItStands) {
  std::vector<Diagnostic> warnings;
  const Plan plain = read_plan(small_plan(), "plan.toml", warnings);
  const Plan fuzzy = read(strengths);
  EXPECT_EQ(fuzzy.concretes[0].fc, plain.concretes[0].fc);
  EXPECT_EQ(fuzzy.members.size(), plain.members.size());
  EXPECT_FALSE(fuzzy.fuzzy.is_empty());
  EXPECT_TRUE(plain.fuzzy.is_empty());
}

TEST(FuzzyPlan, ComplainsWhereTheFaultStands) {
  struct Case {
    const char *text, *code, *message, *help;
  };
  const Case cases[] = {
      {"[fuzzy]\nconcrete.C25.«f_c» = { triangular = [1, 2, 3] }\n", "E203", "\"concrete.C25.f_c\" is no value",
       "did you mean \"concrete.C25.fc\"?"},
      {"[fuzzy]\n«concret».C25.fc = { triangular = [1, 2, 3] }\n", "E203", "\"concret\" is no value", ""},
      {"[fuzzy]\nstoreys.«count» = { triangular = [1, 2, 3] }\n", "E203", "can be fuzzy", ""},
      {"[fuzzy]\nstage.«3».time = { triangular = [1, 2, 3] }\n", "E203", "\"stage.3\" is no value", ""},
      {"[fuzzy]\nsection.column.«concrete» = { triangular = [1, 2, 3] }\n", "E203", "can be fuzzy", ""},
      {"[fuzzy]\nconcrete.C25.fc = { triangular = [«\"10 kN\"», \"25 N/mm2\", \"45 N/mm2\"] }\n", "E204", "kN", ""},
      {"[fuzzy]\nconcrete.C25.fc = { triangular = [«10», \"25 N/mm2\", \"45 N/mm2\"] }\n", "E204", "bare number", ""},
      {"[fuzzy]\nconcrete.C25.fc = { triangular = [«[]», \"25 N/mm2\", \"45 N/mm2\"] }\n", "E202", "is a list", ""},
      {"[fuzzy]\nconcrete.C25.fc = «\"25 N/mm2\"»\n", "E202", "a table is wanted", "triangular"},
      {"[fuzzy]\nconcrete.C25.«fc» = { triangular = [1], formula = \"1\" }\n", "E207", "exactly one of", ""},
      {"[fuzzy]\nconcrete.C25.«fc» = { triangl = [1] }\n", "E207", "exactly one of", ""},
      {"[fuzzy]\nconcrete.C25.fc = { triangular = «[\"30 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"]» }\n", "E207",
       "must rise", ""},
      {"[fuzzy]\nconcrete.C25.fc = { tabulated = [[0.5, \"20 N/mm2\", \"30 N/mm2\"], [«0.5», \"25 N/mm2\", \"25 "
       "N/mm2\"]] }\n",
       "E207", "alpha must rise", ""},
      {"[fuzzy]\nconcrete.C25.Gcl = { formula = \"2 * «fz»\" }\nsite.friction = { triangular = [0.5, 0.6, 0.7] }\n",
       "E208", "fz", ""},
      {"[fuzzy]\nconcrete.C25.«fc» = { triangular = [\"0.1 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\n", "E205",
       "fc = 0.1 N/mm2 is not possible: concrete.C25: fc: \"0.1 N/mm2\" is out of range", ""},
      {"[fuzzy]\nconcrete.C25.fc = { triangular = [\"20 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\n"
       "concrete.\"*\".«fc» = { triangular = [\"20 N/mm2\", \"25 N/mm2\", \"45 N/mm2\"] }\n",
       "E207", "second time", "first on line"},
      {"[fuzzy]\nanalysis.«duration» = { triangular = [\"1 s\", \"2 s\", \"3 s\"] }\n", "E207", "no run depends on it",
       "leave it out"},
      {"«[fuzzy]»\n", "E201", "nothing is fuzzy", ""},
      {"[fuzzy]\nsite.friction = { triangular = [0.5, 0.6, 0.7] }\nsearch = { levels = «[]» }\n", "E202", "levels", ""},
      {"[fuzzy]\nsite.friction = { triangular = [0.5, 0.6, 0.7] }\n"
       "interaction.constraints = [\"2 * friction <= 1.3\", \"1 + «frictoin» <= 2\"]\n",
       "E208", "fuzzy: interaction: constraint: ", "friction"},
      {"[fuzzy]\nsite.friction = { triangular = [0.5, 0.6, 0.7] }\n"
       "interaction.constraints = [\"friction <= 2 * «frictoin»\"]\n",
       "E208", "fuzzy: interaction: constraint: ", "friction"},
      {"[fuzzy]\nsite.friction = { triangular = [0.5, 0.6, 0.7] }\n"
       "interaction.constraints = [«\"friction < 1\"»]\n",
       "E202", "a text with <= or >= is wanted", ""},
      {"[fuzzy]\nsite.friction = { triangular = [0.5, 0.6, 0.7] }\n"
       "interaction.constraints = [\"friction <= 1\", «\"friction >= 0.65\"»]\n",
       "E207", "the middle of the fuzzy values breaks this constraint", ""},
      {"[fuzzy]\nsite.friction = { triangular = [0.5, 0.6, 0.7] }\n"
       "interaction.membership = «\"1 - abs(friction - 0.5)\"»\n",
       "E207", "0.9 in the middle of the fuzzy values; 1 is wanted", ""},
      {"[fuzzy]\nsite.friction = { triangular = [0.5, 0.6, 0.7] }\n"
       "interaction.«constraint» = [\"friction <= 1\"]\n",
       "E203", "constraint", "constraints"},
      {"[fuzzy]\nsite.«friction» = { triangular = [0.7, 0.8, 0.9] }\n", "W508",
       "the plan says friction = 0.6, outside the core", ""},
      {"[fuzzy]\nsite.friction = { triangular = [0.5, 0.6, 0.7] }\nconcrete.C25.«Ec» = { formula = \"1e4 * fc^0.4\" "
       "}\n",
       "W508", "the plan says 30000 N/mm2, the formula gives 36239", ""},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.text);
    const Marked marked = take_marks(with_fuzzy(c.text));
    const std::vector<Diagnostic> found = complaints_about(marked.text);
    ASSERT_FALSE(found.empty());
    const Diagnostic& d = found.front();
    EXPECT_EQ(d.code, c.code) << rendered(found, marked.text);
    EXPECT_THAT(d.message, testing::HasSubstr(c.message));
    EXPECT_THAT(d.help, testing::HasSubstr(c.help));
    EXPECT_EQ(d.where.line, marked.line);
    EXPECT_EQ(d.where.column, marked.column);
    EXPECT_EQ(found.size(), 1u) << rendered(found, marked.text);
  }
}

TEST(FuzzyPlan, APathThatIsOnesPlaceAndAnothersNameIsRefused) {
  const std::string fuzzy = "[fuzzy]\nstage.1.charge.1.residual_bars = { triangular = [0, 0, 0.1] }\n";
  std::vector<Diagnostic> warnings;
  EXPECT_EQ(read_plan(with_fuzzy(fuzzy), "plan.toml", warnings).fuzzy.inputs.size(), 1U);
  const std::string named = replaced(with_fuzzy(fuzzy), "time = \"2 s\"", "name = \"1\"\ntime = \"2 s\"");
  const std::vector<Diagnostic> found = complaints_about(named);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.front().code, "E203");
  EXPECT_THAT(found.front().message, testing::HasSubstr("\"1\" is the place of one item and the name of another"));
}

TEST(FuzzyPlan, TellsCornersThatAreNoPlan) {
  std::vector<Diagnostic> warnings;
  read(R"toml([fuzzy]
stage.front.charge.1.position = { triangular = ["0.75 m", "1 m", "1 m"] }
stage.front.charge.1.destroyed_length = { triangular = ["1 m", "1.2 m", "1.8 m"] }
)toml",
       &warnings);
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_EQ(warnings[0].code, "W507");
  EXPECT_THAT(warnings[0].message, testing::HasSubstr("1 of 4 corners"));
}

constexpr const char* tied = R"toml([fuzzy]
concrete.C25.fc = { triangular = ["10 N/mm2", "25 N/mm2", "45 N/mm2"] }
concrete.C25.fct = { formula = "1.4 * ((fc - 8) / 10)^(2/3)" }
section.column.steel_area = { triangular = ["20 cm2", "25.13 cm2", "30 cm2"] }
[fuzzy.interaction]
constraints = ["steel_area <= 2513 + 30 * (fc - 25)", "fct <= 3"]
membership = "max(0, 1 - abs(steel_area - 2513) / 1000)"
)toml";

// In N, mm and s, as formulas. The middle lies on a constraint: its 25.13 cm2 are 2513 mm2 but for round-off.
TEST(FuzzyPlan, InteractionSeesValuesAndWhatFollowsFromThem) {
  std::vector<Diagnostic> warnings;
  const FuzzyPlan f = read(tied, &warnings).fuzzy;
  for (const Diagnostic& d : warnings) EXPECT_EQ(d.code, "W508") << d.message << ": the plan has other bars";
  ASSERT_EQ(f.interaction.constraints.size(), 2u);
  const std::vector<double> values = calc_interacting(f, std::vector{18e6, 28e-4});
  ASSERT_EQ(values.size(), 3u);
  EXPECT_DOUBLE_EQ(values[0], 18);
  EXPECT_DOUBLE_EQ(values[1], 2800);
  EXPECT_DOUBLE_EQ(values[2], 1.4);
  EXPECT_NEAR(calc_excess(f.interaction, 0, values), 2800 - (2513 - 210), 1e-8);
  EXPECT_NEAR(calc_excess(f.interaction, 1, values), 1.4 - 3, 1e-8);
  EXPECT_NEAR(calc_joint(f.interaction, values), 1 - 0.287, 1e-12);
  EXPECT_EQ(calc_joint(f.interaction, calc_interacting(f, calc_centre(f))), 1);
  EXPECT_TRUE(is_possible(f, calc_centre(f)));
  EXPECT_FALSE(is_possible(f, std::vector{18e6, 28e-4}));
  // what has no value makes a failed run and no broken constraint
  std::vector<double> without = values;
  without[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(calc_excess(f.interaction, 1, without), 0);
  EXPECT_NEAR(calc_joint(f.interaction, without), 1 - 0.287, 1e-12) << "it uses others";
  without[1] = without[2];
  EXPECT_EQ(calc_joint(f.interaction, without), 1);
  EXPECT_TRUE(is_possible(f, std::vector{35e6, 28e-4}));
  EXPECT_FALSE(is_possible(f, std::vector{45e6, 28e-4})) << "fct = 3.35 N/mm2";
  EXPECT_FALSE(is_possible(f, std::vector{7e6, 20e-4})) << "fct has no value";
  EXPECT_FALSE(is_possible(f, std::vector{35e6, 10e-4})) << "joint membership 0";
}

TEST(FuzzyPlan, InteractionCallsWhatFollowsByItsPathWhereNamesAreTaken) {
  const Plan plan = read(R"toml([fuzzy]
stage."*".charge."*".destroyed_length = { triangular = ["0.8 m", "1.1 m", "1.3 m"], name = "gap" }
stage."*".charge."*".position = { formula = "gap / 2 + 300" }
[fuzzy.interaction]
constraints = ["stage_1_charge_1_position + stage_2_charge_1_position <= gap + 601"]
)toml");
  const auto values = calc_interacting(plan.fuzzy, std::vector{1.0});
  EXPECT_NEAR(calc_excess(plan.fuzzy.interaction, 0, values), -1, 1e-8);
}

// The only corner that is no plan is cut away.
TEST(FuzzyPlan, AsksForNoPlanWhereTheInteractionLeavesNoSample) {
  std::vector<Diagnostic> warnings;
  read(R"toml([fuzzy]
stage.front.charge.1.position = { triangular = ["0.75 m", "1 m", "1 m"] }
stage.front.charge.1.destroyed_length = { triangular = ["1 m", "1.2 m", "1.8 m"] }
interaction.constraints = ["destroyed_length <= 2 * position"]
)toml",
       &warnings);
  EXPECT_TRUE(warnings.empty()) << rendered(warnings, "");
}

TEST(FuzzyPlan, RefusesSamplesThatAreNoPlan) {
  const PlanSampler sampler = make_sampler(read(strengths));
  EXPECT_THROW(make_sample(sampler, std::vector{7e6}), InputError) << "the formula has no value";
  EXPECT_THROW(make_sample(sampler, std::vector{500e6}), InputError) << "out of the plan's range";
}

TEST(FuzzyPlan, SaysOtherFaultsOfThePlanWithoutBlamingPaths) {
  const std::string text = replaced(with_fuzzy(strengths), "[concrete.C25]", "[concrete.C26]");
  for (const Diagnostic& d : complaints_about(text)) EXPECT_THAT(d.message, testing::Not(testing::HasSubstr("fuzzy")));
}

TEST(FuzzyPlan, ReadsTableOneOfTheStorehouse) {
  std::vector<Diagnostic> warnings;
  std::string text;
  const Plan plan = read_plan_file(TOPPLE_SOURCE_DIR "/examples/weida/plan-fuzzy.toml", warnings, text);
  EXPECT_TRUE(warnings.empty()) << rendered(warnings, text);
  const Plan core = read_plan_file(TOPPLE_SOURCE_DIR "/examples/weida/plan.toml", warnings, text);
  const Plan left = read_plan_file(TOPPLE_SOURCE_DIR "/examples/weida/plan-left-values.toml", warnings, text);
  ASSERT_EQ(plan.fuzzy.inputs.size(), 4u);
  const PlanSampler sampler = make_sampler(plan);
  std::vector<double> ends;
  for (const FuzzyValue& v : plan.fuzzy.inputs) ends.push_back(v.corners.front().first);
  EXPECT_EQ(ends, (std::vector<double>{15e9, 10e6, 220e6, 33.6e-4}));
  const auto column = [](const Plan& p) {
    const Section& s = p.sections[static_cast<size_t>(p.members[static_cast<size_t>(p.find_member("C-D1-0"))].section)];
    return std::pair{p.concretes[static_cast<size_t>(s.concrete)], s};
  };
  const auto [concrete, section] = column(make_sample(sampler, ends));
  const auto [wanted, wanted_section] = column(left);
  EXPECT_EQ(concrete.fc, wanted.fc);
  EXPECT_NEAR(concrete.fct, 0.479e6, 500);  // Table 1, to its digits
  EXPECT_DOUBLE_EQ(concrete.fct, wanted.fct);
  EXPECT_NEAR(section.steel_area(), wanted_section.steel_area(), 1e-15);
  const auto [middle, middle_section] = column(make_sample(sampler, calc_centre(plan.fuzzy)));
  EXPECT_DOUBLE_EQ(middle.fct, column(core).first.fct);
  EXPECT_EQ(core.members.size(), plan.members.size());
  ends = {52e9, 45e6, 500e6, 88e-4};
  EXPECT_NEAR(column(make_sample(sampler, ends)).first.fct, 3.349e6, 500);  // Table 1
}

}  // namespace
}  // namespace topple::product
