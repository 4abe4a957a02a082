#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <sstream>

#include "../base/own_folder.h"
#include "plan_text.h"
#include "product/plan.h"

namespace topple::product {
namespace {

using testing::HasSubstr;

TEST(ReadPlan, TakesTheSmallPlanWithoutAWord) { EXPECT_EQ(rendered(complaints_about(small_plan()), small_plan()), ""); }

/// One mistake in the small plan: the old words become new ones, and « » mark the place of the complaint.
struct Mistake {
  const char* code;
  const char* old_words;
  const char* new_words;
  const char* message;
  const char* help;
  const char* more_old_words = "";
  const char* more_new_words = "";
};

void PrintTo(const Mistake& mistake, std::ostream* out) { *out << mistake.code << " " << mistake.new_words; }

TEST(ReadPlan, SaysWhereAQuoteIsMissing) {
  const std::vector<Diagnostic> found =
      complaints_about(replaced(small_plan(), "title = \"Two bays\"", "title = \"Two bays"));
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].where.line, 1);
  EXPECT_THAT(found[0].help, HasSubstr("one is missing here"));
}

TEST(ReadPlan, SaysOneThingOfMembersThatCannotBeRead) {
  for (const auto& [old_words, new_words] : {std::pair{"[[columns]]", "[[colums]]"},
                                             {"count = 2", "count = 0"},
                                             {"duration = \"5 s\"", "duratoin = \"5 s\""},
                                             {"[analysis]", "[analisys]"}}) {
    const std::vector<Diagnostic> found = complaints_about(replaced(small_plan(), old_words, new_words));
    EXPECT_EQ(found.size(), 1u) << rendered(found, small_plan());
  }
}

class OneMistake : public testing::TestWithParam<Mistake> {};

TEST_P(OneMistake, IsOneComplaintAtItsPlace) {
  const Mistake& mistake = GetParam();
  std::string text = replaced(small_plan(), mistake.old_words, mistake.new_words);
  if (*mistake.more_old_words) text = replaced(text, mistake.more_old_words, mistake.more_new_words);
  const Marked marked = take_marks(text);
  ASSERT_GT(marked.width, 0) << "no place is marked";
  const std::vector<Diagnostic> complaints = complaints_about(marked.text);
  const std::string all = rendered(complaints, marked.text);
  ASSERT_EQ(complaints.size(), 1u) << all;
  const Diagnostic& d = complaints[0];
  EXPECT_EQ(d.code, mistake.code) << all;
  EXPECT_EQ(d.severity, mistake.code[0] == 'E' ? Severity::Error : Severity::Warning);
  EXPECT_EQ(d.where.file, "plan.toml");
  EXPECT_EQ(d.where.line, marked.line) << all;
  EXPECT_EQ(d.where.column, marked.column) << all;
  EXPECT_EQ(d.width, marked.width) << all;
  EXPECT_THAT(d.message, HasSubstr(mistake.message));
  EXPECT_THAT(d.help, HasSubstr(mistake.help));
}

const Mistake syntax_mistakes[] = {
    {"E101", "height = \"3 m\"", "height = 3 «m»", "saw 'm'", "a string in quotes"},
    {"E101", "[grid]", "[grid «x»]", "expected ']'", ""},
    {"E101", "friction = 0.6", "friction = 0«,»6", "saw ','", "with a point"},
    {"E101", "height = \"3 m\"", "height = «\u201E»3 m\u201C", "value type", "straight quotes"},
    {"E102", "[[columns]]", "[columns]\nsection = \"column\"\n«[[columns]]»", "duplicate key", "two brackets"},
    {"E102", "friction = 0.6", "friction = 0.6\n  «friction» = 0.7", "duplicate key", ""},
    {"E102", "[criteria]", "«[storeys]»", "duplicate key", ""},
    {"E103", "title = \"Two bays\"", "title = \"Two «\xFF»bays\"", "not UTF-8", ""},
    {"E105", "title = \"Two bays\"", "a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q«.»r = 1", "nested deeper", ""},
};

const Mistake key_mistakes[] = {
    {"E201", "Ec = \"30 GPa\"\n", "", "concrete.C25: missing key \"Ec\"", "Ec = \"10000 N/mm2\"", "[concrete.C25]",
     "«[concrete.C25]»"},
    {"E201", "[analysis]\nduration = \"5 s\"\n", "", "missing table \"analysis\"", "[analysis]", "title = \"Two bays\"",
     "«t»itle = \"Two bays\""},
    {"E201", "bars = { count_y = 3, count_z = 3, diameter = \"20 mm\" }\n", "", "missing key \"bars\"", "count_y",
     "[section.column]", "«[section.column]»"},
    {"E201", "azimuth_tolerance = \"10 deg\"\n", "", "missing key \"azimuth_tolerance\"", "15 deg", "[criteria]",
     "«[criteria]»"},
    {"E202", "title = \"Two bays\"", "title = «7»", "title: is a number; a string is wanted", ""},
    {"E202", "[[cable]]", "«[cable]»", "is a table; a list of tables is wanted", "[[cable]]"},
    {"E202", "ties = { diameter = \"8 mm\", spacing = \"20 cm\" }", "ties = «\"8 mm\"»", "is a string; a table", ""},
    {"E202", "[criteria]", "[criteria]\nstands_between_stages = «\"yes\"»", "true or false is wanted", "quotes"},
    {"E202", "members = \"C-B2-0\"", "members = [\"C-B2-0\", «1»]", "holds a number; strings are wanted", ""},
    {"E202", "footprint = [[\"0 m\", \"20 m\"],", "footprint = [«[\"0 m\"]»,", "a corner is a list of x and y", ""},
    {"E202", "anchor = [\"-40 m\", \"5 m\", \"0 m\"]", "anchor = «\"-40 m\"»", "three lengths", "[\"-40 m\""},
    {"E202", "count = 2", "count = «2.0»", "a whole number is wanted", "without quotes"},
    {"E202", "position = \"1 m\"\nanchor", "position = «1979-05-27»\nanchor", "is a date or time", "units"},
    {"E203", "time = \"2 s\"", "time = \"2 s\"\n«dealy» = \"4 s\"", "stage[1]: unknown key \"dealy\"", "known here"},
    {"E203", "load = \"1 kN/m2\"", "«laod» = \"1 kN/m2\"", "unknown key \"laod\"", "did you mean \"load\"?"},
    {"E203", "[criteria]", "[«zcriteria»]\n[criteria]", "unknown key \"zcriteria\"", "did you mean \"criteria\"?"},
    {"E204", "height = \"3 m\"", "height = «\"3 s\"»", "\"3 s\" is a time; a length is wanted", "mm, cm, m, km"},
    {"E204", "height = \"3 m\"", "height = «3»", "a bare number has no unit; a length is wanted", "\"3 m\""},
    {"E204", "height = \"3 m\"", "height = «\"3\"»", "has no unit", "mm, cm, m, km"},
    {"E204", "height = \"3 m\"", "height = «\"3,2 m\"»", "decimals are written with a point", ""},
    {"E204", "height = \"3 m\"", "height = «\"nan m\"»", "not a finite number", ""},
    {"E204", "height = \"3 m\"", "height = «\"1e300 m\"»", "beyond 1e15", ""},
    {"E204", "eps_u = 0.1", "eps_u = «inf»", "not a finite number", ""},
    {"E204", "eps_u = 0.1", "eps_u = «nan»", "not a finite number", ""},
    {"E204", "cut_bars = 0.5", "cut_bars = «\"0.5 m\"»", "a number is wanted", "percentage"},
    {"E204", "footprint = [[\"0 m\",", "footprint = [[«0»,", "has no unit", ""},
    {"E205", "height = \"3 m\"", "height = «\"-3 m\"»", "out of range", "between 1 and 50 m"},
    {"E205", "friction = 0.6", "friction = «-0.1»", "-0.1 is out of range", "between 0 and 2"},
    {"E205", "destroyed_length = \"1 m\"", "destroyed_length = \"1 m\"\nresidual_bars = «1.1»", "out of range",
     "between 0 and 1"},
    {"E205", "destroyed_length = \"1 m\"", "destroyed_length = \"1 m\"\nresidual_concrete = «0.96»", "out of range",
     "between 0 and 0.95"},
    {"E205", "destroyed_length = \"1 m\"", "destroyed_length = \"1 m\"\ndelay = «\"-1 ms\"»", "out of range",
     "between 0 and 600 s"},
    {"E205", "destroyed_length = \"1 m\"", "destroyed_length = «\"9 mm\"»", "out of range", "between 0.01 and 100 m"},
    {"E205", "title = \"Two bays\"", "title = «\"\"»", "is empty", ""},
    {"E205", "load = \"1 kN/m2\"", "load = «[\"1 kN/m2\"]»", "1 values for 2 storeys", "each storey"},
    {"E205", "members = [\"C-B3-0\"]", "members = «[]»", "empty list", "C-A*-0"},
    {"E205", "fc = \"25 N/mm2\"", "fc = «\"25 kN/m2\"»", "out of range", "between 1 and 200 N/mm2"},
    {"E204", "fc = \"25 N/mm2\"", "fc = «\"25 mpa\"»", "did you mean \"MPa\"?", "units: N/mm2"},
    {"E205", "destroyed_length = \"1 m\"", "destroyed_length = \"1 m\"\nresidual_bars = «10»", "10 is out of range",
     "written \"10 %\""},
    {"E205", "width = \"40 cm\"\nheight = \"50 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\ncover = \"3 cm\"",
     "width = \"40 cm\"\nheight = \"50 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\ncover = «\"60 cm\"»", "out of range",
     "between 0 and 50 cm"},
    {"E206", "mechanism = \"topple\"", "mechanism = «\"tople\"»", "\"tople\" is not one of",
     "did you mean \"topple\"?"},
    {"E207", "fc = \"25 N/mm2\"", "fc = «\"7 N/mm2\"»", "fct: cannot be derived", "fct ="},
    {"E207", "Ec = \"30 GPa\"", "Ec = \"30 GPa\"\neps_c1 = «0.0008»", "eps_c1, must be at least 1.05 fc / Ec",
     "0.000875"},
    {"E207", "fu = \"500 N/mm2\"", "fu = «\"400 N/mm2\"»", "fu must not be smaller than fy", ""},
    {"E207", "width = \"40 cm\"\nheight = \"50 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\ncover = \"3 cm\"",
     "width = \"40 cm\"\nheight = \"50 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\ncover = «\"20 cm\"»", "leaves no room",
     "less than its width"},
    {"E207", "bars = { count_y = 3, count_z = 3, diameter = \"20 mm\" }",
     "bars = «{ count_y = 30, count_z = 3, diameter = \"20 mm\" }»", "30 bars do not fit into the width", "thinner"},
    {"E207", "top = \"4 x 20 mm\"", "top = «\"14 x 20 mm\"»", "14 bars do not fit", ""},
    {"E207",
     "height = \"60 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\ncover = \"3 cm\"\nties = { diameter = \"8 mm\", spacing = "
     "\"15 cm\", legs = 4 }\ntop = \"4 x 20 mm\"\nbottom = \"2 x 20 mm\"",
     "height = \"10 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\ncover = \"3 cm\"\nties = { diameter = \"8 mm\", spacing = "
     "\"15 cm\", legs = 4 }\ntop = \"4 x 20 mm\"\nbottom = «\"2 x 20 mm\"»",
     "overlap those at the top", "thinner"},
    {"E207", "top = \"4 x 20 mm\"", "top = \"4 x 20 mm\"\nsteel_area = «\"900 cm2\"»", "more than 15 %", ""},
    {"E207", "density = \"1800 kg/m3\"\nstrength = \"5 N/mm2\"\nmodulus = \"3 GPa\"",
     "concrete = \"C25\"\nmodulus = «\"3 GPa\"»", "belongs to masonry", "leave it out"},
    {"E207", "count = 2\nheight = \"3 m\"", "count = «2»\nheights = [\"3 m\", \"3 m\"]",
     "count: is not possible beside heights", "either"},
    {"E207", "strength = \"400 kN\"", "strength = «\"400 kN\"»\npretension = \"500 kN\"", "above the pretension", ""},
    {"E208", "top = \"4 x 20 mm\"", "top = «\"four bars\"»", "does not name bars", "6 x 25 mm"},
    {"E208", "rows = { A = \"0 m\", B = \"5 m\" }", "rows = { A = \"0 m\", «B1» = \"5 m\" }", "cannot name a row",
     "letters"},
    {"E208", "storeys = 0", "storeys = «\"ground\"»", "does not name storeys", "all"},
    {"E208", "storeys = 0", "storeys = «\"1..0\"»", "runs downwards", ""},
    {"E205", "count = 2", "count = «2000»", "2000 is out of range", "between 1 and 1000"},
    {"E209", "frames = { 1 = \"0 m\", 2 = \"4 m\", 3 = \"8 m\" }", "frames = «{}»", "has 0 lines", "between 1"},
    {"E210", "B = \"5 m\" }", "B = «\"-5 m\"» }", "not at least 0.3 m beyond A", "rising"},
};

const Mistake member_mistakes[] = {
    {"E301", "[[columns]]\nsection = \"column\"", "[[columns]]\nsection = «\"colum\"»", "there is no section \"colum\"",
     "did you mean \"column\"?"},
    {"E301", "[[slabs]]\npanel = \"floor\"", "[[slabs]]\npanel = «\"brick\"»", "there is no slab \"brick\"",
     "described are: floor"},
    {"E302", "members = [\"C-B3-0\"]", "members = [«\"C-B4-0\"»]", "there is no member \"C-B4-0\"",
     "did you mean \"C-B1-0\"?"},
    {"E302", "members = [\"C-B3-0\"]", "members = [\"C-B3-0\", «\"X-*\"»]", "no member matches \"X-*\"", "C-A1-0"},
    {"E302", "removed = [\"W-A1A2-0\"]", "removed = [\"W-A1A2-0\", «\"W-B*\"»]", "no member matches", ""},
    {"E302", "at = \"A1A2\"", "at = [\"A1A2\", «\"A1A4\"»]", "nothing on the grid matches \"A1A4\"", "did you mean"},
    {"E302", "[[slabs]]\npanel = \"floor\"", "[[slabs]]\npanel = \"floor\"\nexcept = «\"C*\"»",
     "nothing on the grid matches \"C*\"", ""},
    {"E303", "storeys = 0", "storeys = «2»", "there is no storey 2", "from 0 to 1"},
    {"E303", "storeys = 0", "storeys = «\"0..2\"»", "there is no storey 2", "from 0 to 1"},
    {"E305", "height = \"60 cm\"", "height = \"300 cm\"", "B-A1A2-0: is as deep as the storey is high", "", "[[beams]]",
     "«[[beams]]»"},
    {"E305", "height = \"60 cm\"", "height = \"295 cm\"", "W-A1A2-0: no height is left", "", "[[walls]]",
     "«[[walls]]»"},
    {"E306", "{ left = \"1 m\", width = \"1.2 m\", height = \"2.1 m\" }",
     "«{ left = \"3 m\", width = \"1.2 m\", height = \"2.1 m\" }»", "opening[0]: reaches out of W-A1A2-0",
     "from 0.25 m to 3.75 m, up to 2.4 m"},
    {"E306", "height = \"2.1 m\" }", "height = \"2.1 m\" }, «{ left = \"2 m\", width = \"1 m\", height = \"1 m\" }»",
     "overlaps opening[0]", ""},
    {"E306", "at = \"1 m\"", "at = «\"3.1 m\"»", "beyond the end of C-B1-0", "3 m long"},
    {"E306", "position = \"1 m\"\nanchor", "position = «\"3.5 m\"»\nanchor", "beyond the end of C-A2-1", "3 m long"},
    {"E207", "anchor = [\"-40 m\", \"5 m\", \"0 m\"]", "anchor = «[\"0 m\", \"4 m\", \"4 m\"]»",
     "anchor: is where the cable is tied to C-A2-1", "no direction"},
    {"E208", "[[cable]]",
     "[[cable]]\nname = \"cable 2\"\nmember = \"C-A2-1\"\nposition = \"1 m\"\nanchor = [\"-30 m\", \"5 m\", \"0 m\"]\n"
     "stiffness = \"1 MN/m\"\nstrength = \"90 kN\"\n[[cable]]\nname = «\"cable 2\"»",
     "name: another cable is called \"cable 2\"", "tell cables by their names"},
    {"E307", "members = \"C-B2-0\"\nsection = \"column\"", "members = \"S-A1B2-0\"\nsection = «\"column\"»",
     "section: is nothing that S-A1B2-0 has", ""},
    {"E307", "members = [\"C-B3-0\"]", "members = «[\"S-A1B2-0\"]»", "neither a column nor a beam nor a shaft",
     "[preparation]"},
    {"E307", "member = \"C-A2-1\"", "member = «\"C-A?-1\"»", "a cable pulls one member, not 3", ""},
    {"E308", "[[\"0 m\", \"20 m\"], [\"10 m\", \"20 m\"], [\"10 m\", \"30 m\"]]",
     "«[[\"0 m\", \"20 m\"], [\"10 m\", \"20 m\"], [\"20 m\", \"20 m\"]]»", "encloses no area", ""},
    {"E308", "[[\"0 m\", \"20 m\"], [\"10 m\", \"20 m\"], [\"10 m\", \"30 m\"]]",
     "«[[\"0 m\", \"20 m\"], [\"10 m\", \"30 m\"], [\"10 m\", \"20 m\"], [\"0 m\", \"29 m\"]]»", "its edges cross",
     "in order"},
    {"E308", "[[\"0 m\", \"20 m\"], [\"10 m\", \"20 m\"], [\"10 m\", \"30 m\"]]",
     "«[[\"0 m\", \"20 m\"], [\"4 m\", \"20 m\"], [\"4 m\", \"24 m\"], [\"2 m\", \"20 m\"], [\"2 m\", \"16 m\"], [\"0 "
     "m\", \"16 m\"]]»",
     "its edges cross", "in order"},
    {"E308", "[[\"0 m\", \"20 m\"], [\"10 m\", \"20 m\"], [\"10 m\", \"30 m\"]]",
     "«[[\"0 m\", \"20 m\"], [\"10 m\", \"20 m\"], [\"10 m\", \"40 m\"], [\"10 m\", \"30 m\"], [\"0 m\", \"30 m\"]]»",
     "its edges cross", "in order"},
    {"W503", "[slab.floor]", "[slab.«roof»]\nthickness = \"16 cm\"\nconcrete = \"C25\"\n[slab.floor]",
     "roof: no member has this panel", ""},
    {"W505", "footprint = [[\"0 m\", \"20 m\"]", "footprint = [[\"3 m\", \"3 m\"]", "overlaps the building", "",
     "[[site.neighbour]]", "«[[site.neighbour]]»"},
    {"W505", "footprint = [[\"0 m\", \"20 m\"], [\"10 m\", \"20 m\"], [\"10 m\", \"30 m\"]]",
     "footprint = [[\"-5 m\", \"3 m\"], [\"50 m\", \"3 m\"], [\"50 m\", \"4 m\"], [\"-5 m\", \"4 m\"]]",
     "overlaps the building", "", "[[site.neighbour]]", "«[[site.neighbour]]»"},
};

const Mistake blasting_mistakes[] = {
    {"E402", "time = \"2 s\"", "time = «\"0 s\"»", "is not after the stage before it", "order"},
    {"E403", "removed = [\"W-A1A2-0\"]", "removed = [\"W-A1A2-0\", \"C-B3-0\"]",
     "C-B3-0 is taken out in the preparation", "keep it standing", "members = [\"C-B3-0\"]",
     "members = «[\"C-B3-0\"]»"},
    {"E404", "members = [\"C-B3-0\"]\nposition = \"1 m\"", "members = «[\"C-A1-0\"]»\nposition = \"1 m\"",
     "C-A1-0 has another charge", "move them apart"},
    {"E307", "members = [\"C-B3-0\"]\nposition = \"1 m\"",
     "members = [\"C-B3-1\"]\nresidual_concrete = «0.2»\nposition = \"1 m\"",
     "C-B3-1 is neither a column of the ground storey nor a beam along x", "take it out there"},
    {"E404", "members = [\"C-B3-0\"]\nposition = \"1 m\"",
     "members = «[\"C-A1-0\"]»\nresidual_concrete = 0.2\nposition = \"2.2 m\"",
     "C-A1-0 has another charge, and one leaves concrete", "the only one of its member"},
    {"E405", "members = [\"C-B3-0\"]\nposition = \"1 m\"", "members = [\"C-B3-0\"]\nposition = «\"0.3 m\"»",
     "-0.2 m to 0.8 m, reaches out of C-B3-0", "3 m long"},
    {"E406",
     "[[stage]]\ntime = \"2 s\"\n[[stage.charge]]\nmembers = [\"C-B3-0\"]\nposition = \"1 m\"\n"
     "destroyed_length = \"1 m\"\n",
     "«[[stage]]»\ntime = \"2 s\"\n", "the stage has no charge", "[[stage.charge]]"},
    {"E407", "duration = \"5 s\"", "duration = \"1.5 s\"", "the stage fires at or after the end of the analysis",
     "raise duration", "time = \"2 s\"", "time = «\"2 s\"»"},
    {"E407", "duration = \"5 s\"", "duration = \"2 s\"", "the stage fires at or after the end of the analysis",
     "raise duration", "time = \"2 s\"", "time = «\"2 s\"»"},
    {"E407", "destroyed_length = \"1 m\"", "destroyed_length = \"1 m\"\ndelay = «\"3 s\"»",
     "the charge fires at or after the end of the analysis", "shorten its delay"},
    {"W506", "destroyed_length = \"1.2 m\"", "destroyed_length = \"1.2 m\"\ndelay = «\"2.5 s\"»",
     "lasts until the next stage", ""},
    {"W509", "destroyed_length = \"1 m\"", "destroyed_length = \"1 m\"\nscatter = \"1 s\"",
     "the scatter of 1 charge may lead past the end", "they fire until 5 s", "time = \"2 s\"", "time = «\"2 s\"»"},
};

INSTANTIATE_TEST_SUITE_P(Syntax, OneMistake, testing::ValuesIn(syntax_mistakes));
INSTANTIATE_TEST_SUITE_P(Keys, OneMistake, testing::ValuesIn(key_mistakes));
INSTANTIATE_TEST_SUITE_P(Members, OneMistake, testing::ValuesIn(member_mistakes));
INSTANTIATE_TEST_SUITE_P(Blasting, OneMistake, testing::ValuesIn(blasting_mistakes));

TEST(ReadPlan, RendersAMistakeInTheCompilersManner) {
  const std::string text = R"toml(title = "Storehouse"
[concrete.core]
fc = "25 N/mm2"
Ec = "30e3 N/mm2"
[steel.core]
fy = "420 N/mm2"
fu = "500 N/mm2"
eps_u = "10 %"

[[stage]]
name = "Rows A and B"
time = "0 s"
[[stage.charge]]
members = ["C-A1-0"]
position = "1 m"
destroyed_length = "1 m"
dealy = "4 s"
)toml";
  std::vector<Diagnostic> warnings;
  try {
    read_plan(text, "storehouse.toml", warnings);
    FAIL() << "the plan was taken";
  } catch (const InputError& error) {
    std::string found;
    for (const Diagnostic& d : error.diagnostics())
      if (d.code == "E203") found = render(d, text, false);
    EXPECT_EQ(found,
              "storehouse.toml:17:1: error E203: charge[0]: unknown key \"dealy\"\n"
              " 17 | dealy = \"4 s\"\n"
              "    | ^^^^^\n"
              "    = help: did you mean \"delay\"?\n");
  }
}

TEST(ReadPlan, ReportsEverythingAtOnceInTheOrderOfTheFile) {
  std::string text = replaced(small_plan(), "friction = 0.6", "friction = \"much\"");
  text = replaced(text, "height = \"3 m\"", "height = \"3 ms\"");
  text = replaced(text, "time = \"2 s\"", "time = \"2 s\"\ntiem = 1");
  text = replaced(text, "mechanism = \"topple\"", "mechanism = \"fly\"");
  const std::vector<Diagnostic> complaints = complaints_about(text);
  std::vector<std::string> codes;
  for (const Diagnostic& d : complaints) codes.push_back(d.code);
  EXPECT_EQ(codes, (std::vector<std::string>{"E204", "E204", "E203", "E206"})) << rendered(complaints, text);
}

TEST(ReadPlan, SaysOnceThatAStageIsLate) {
  std::string text = replaced(small_plan(), "duration = \"5 s\"", "duration = \"1.5 s\"");
  text += "[[stage.charge]]\nmembers = [\"C-B3-0\"]\nposition = \"2.6 m\"\ndestroyed_length = \"0.2 m\"\n";
  const std::vector<Diagnostic> complaints = complaints_about(text);
  ASSERT_EQ(complaints.size(), 1u) << rendered(complaints, text);
  EXPECT_EQ(complaints[0].code, "E407");
}

TEST(ReadPlan, StopsCountingAtAHundredErrors) {
  std::string text = small_plan();
  for (int i = 0; i < 1000; ++i) text += "key" + std::to_string(i) + " = 1\n";
  EXPECT_EQ(complaints_about(text).size(), 100u);
}

// ---------------------------------------------------------------------------------------------- hanging in the air

/// Complaints E304 and W502 of a plan with these lines for its members.
std::string said_about_frame(const std::string& rules) {
  const std::string whole = small_plan();
  const size_t begin = whole.find("[[columns]]"), end = whole.find("[criteria]");
  std::vector<Diagnostic> support;
  for (const Diagnostic& d : complaints_about(whole.substr(0, begin) + rules + whole.substr(end)))
    if (d.code == "E304" || d.code == "W502") support.push_back(d);
  std::string all;
  for (const Diagnostic& d : support)
    all += d.code + " line " + std::to_string(d.where.line - 48) + ": " + d.message + "\n";
  return all;
}

TEST(HangingMembers, LineNumbersOfThisFixtureCountFromTheFirstRule) {
  const std::string whole = small_plan();
  const std::string head = whole.substr(0, whole.find("[[columns]]"));
  EXPECT_EQ(std::count(head.begin(), head.end(), '\n'), 48);
}

TEST(HangingMembers, AreNotFoundInAWholeFrame) {
  EXPECT_EQ(said_about_frame(
                "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\n[[slabs]]\npanel = \"floor\"\n"),
            "");
}

TEST(HangingMembers, ColumnOverNothing) {
  EXPECT_EQ(said_about_frame("[[columns]]\nsection = \"column\"\nstoreys = 0\nexcept = \"A2\"\n"
                             "[[columns]]\nsection = \"column\"\nstoreys = 1\n"),
            "E304 line 5: C-A2-1: hangs in the air: no column, wall or beam below\n");
}

TEST(HangingMembers, ColumnOnABeamIsAWarning) {
  EXPECT_EQ(said_about_frame("[[columns]]\nsection = \"column\"\nstoreys = 0\nexcept = \"A2\"\n"
                             "[[columns]]\nsection = \"column\"\nstoreys = 1\n"
                             "[[beams]]\nsection = \"beam\"\nat = [\"A1A2\", \"A2A3\"]\nstoreys = 0\n"),
            "W502 line 5: C-A2-1: stands on a beam, with no column below\n"
            "W502 line 8: B-A1A2-0, B-A2A3-0: ends at A2 on other beams, with no column below\n");
}

/// "line: message" of each complaint with this code.
std::vector<std::string> said_with(const std::string& code, const std::string& text) {
  std::vector<std::string> said;
  for (const Diagnostic& d : complaints_about(text))
    if (d.code == code) said.push_back(std::to_string(d.where.line) + ": " + d.message);
  return said;
}

TEST(LongSpans, AreWarnedOfWhereAllSlabsHaveThem) {
  const auto said = [](const std::string& text) { return said_with("W512", text); };
  const std::string plan = small_plan();
  EXPECT_THAT(said(plan), testing::IsEmpty());
  const std::string wide = replaced(plan, "2 = \"4 m\", 3 = \"8 m\"", "2 = \"8 m\", 3 = \"16 m\"");
  EXPECT_THAT(said(wide),
              testing::ElementsAre(testing::HasSubstr(
                  "and 1 more: spans along y, 8 m between beams along x, though its beams along y are 5 m")));
  // without beams along x slabs bear both ways
  EXPECT_THAT(said(replaced(wide, "[[beams]]\nsection = \"beam\"", "[[beams]]\nsection = \"beam\"\nalong = \"y\"")),
              testing::IsEmpty());
  // one bay that spans the short way is a reason to lay them so
  EXPECT_THAT(said(replaced(wide, "2 = \"8 m\", 3 = \"16 m\"", "2 = \"8 m\", 3 = \"13 m\"")), testing::IsEmpty());
}

TEST(LostLoads, AreWarnedOf) {
  const auto said = [](const std::string& text) { return said_with("W514", text); };
  const std::string plan = small_plan(), bare = replaced(plan, "panel = \"floor\"", "panel = \"floor\"\nstoreys = 1");
  EXPECT_THAT(said(plan), testing::IsEmpty());
  EXPECT_THAT(said(bare),
              testing::ElementsAre("48: load: is left out above storey 0, where there is no slab to carry it"));
  EXPECT_THAT(said(replaced(bare, "load = \"1 kN/m2\"", "load = [\"0 kN/m2\", \"1 kN/m2\"]")), testing::IsEmpty());
  EXPECT_THAT(said(replaced(bare, "load = \"1 kN/m2\"", "load = [\"1 kN/m2\", \"0 kN/m2\"]")), testing::SizeIs(1));
}

TEST(IdleWalls, AreWarnedOf) {
  // walls along x take shear from the beam that lies on them
  const auto idle = [](const std::string& text) { return said_with("W511", text); };
  const std::string plan = small_plan(), along_x = replaced(plan, "at = \"A1A2\"\nstoreys", "at = \"A2B2\"\nstoreys");
  EXPECT_THAT(idle(plan), testing::IsEmpty());
  EXPECT_THAT(idle(along_x), testing::IsEmpty());
  const std::string without =
      replaced(along_x, "[[beams]]\nsection = \"beam\"", "[[beams]]\nsection = \"beam\"\nalong = \"y\"");
  EXPECT_THAT(idle(without),
              testing::ElementsAre(testing::HasSubstr(": W-A2B2-0: bears and stiffens nothing: no beam lies on it")));
  // and walls along y resist nothing, which matters where the fall is along them
  const std::string along_y = replaced(plan, "azimuth = \"180 deg\"", "azimuth = \"90 deg\"");
  EXPECT_THAT(idle(along_y), testing::IsEmpty()) << "it is taken out before";
  const std::string stays = replaced(along_y, "removed = [\"W-A1A2-0\"]\n", "");
  EXPECT_THAT(idle(stays),
              testing::ElementsAre(testing::HasSubstr("azimuth: the fall is along y, and 1 wall along y counts")));
  EXPECT_THAT(idle(replaced(stays, "90 deg", "0 deg")), testing::IsEmpty());
}

TEST(HangingMembers, BeamWithAFreeEnd) {
  EXPECT_EQ(said_about_frame("[[columns]]\nsection = \"column\"\nexcept = \"A2\"\n"
                             "[[beams]]\nsection = \"beam\"\nat = \"A1A2\"\n"),
            "E304 line 4: B-A1A2-0, B-A1A2-1: hangs in the air at A2: no column or wall below its end\n");
}

TEST(HangingMembers, RingOfBeamsWithoutAColumn) {
  EXPECT_THAT(
      said_about_frame("[[columns]]\nsection = \"column\"\nat = \"?3\"\n"
                       "[[beams]]\nsection = \"beam\"\nat = [\"A1A2\", \"B1B2\", \"A1B1\", \"A2B2\"]\nstoreys = 1\n"),
      HasSubstr("E304 line 4: B-A1A2-1, B-A1B1-1: hangs in the air at A1"));
}

TEST(HangingMembers, SlabWithoutAnythingAtACorner) {
  EXPECT_EQ(said_about_frame("[[columns]]\nsection = \"column\"\nexcept = \"B2\"\n"
                             "[[slabs]]\npanel = \"floor\"\nat = \"A1B2\"\nstoreys = 0\n"),
            "E304 line 4: S-A1B2-0: hangs in the air at B2: no column, beam or wall at its corner\n");
}

TEST(HangingMembers, WallOverNothing) {
  EXPECT_EQ(said_about_frame("[[walls]]\npanel = \"brick\"\nat = \"A1A2\"\nstoreys = 1\n"),
            "E304 line 1: W-A1A2-1: hangs in the air: no beam, slab or wall below\n");
  EXPECT_EQ(said_about_frame("[[walls]]\npanel = \"brick\"\nat = \"A1A2\"\n"), "");
  EXPECT_EQ(
      said_about_frame("[[columns]]\nsection = \"column\"\n[[slabs]]\npanel = \"floor\"\nat = \"A1B2\"\nstoreys = 0\n"
                       "[[walls]]\npanel = \"brick\"\nat = \"B1B2\"\nstoreys = 1\n"),
      "");
}

TEST(HangingMembers, AreReportedAtTheRuleThatPutThemThereNotAtAnOverride) {
  EXPECT_EQ(said_about_frame("[[columns]]\nsection = \"column\"\nat = \"A1\"\nstoreys = 1\n"
                             "[[override]]\nmembers = \"C-A1-1\"\nsection = \"beam\"\n"),
            "E304 line 1: C-A1-1: hangs in the air: no column, wall or beam below\n");
}

TEST(HangingMembers, ManyOfARuleAreOneComplaint) {
  const std::string said = said_about_frame("[[columns]]\nsection = \"column\"\nstoreys = 1\n");
  EXPECT_EQ(said, "E304 line 1: C-A1-1, C-A2-1, C-A3-1 and 3 more: hangs in the air: no column, wall or beam below\n");
}

TEST(HangingMembers, AreNotToldWhereColumnsCouldNotBeRead) {
  const std::string beams = "[[beams]]\nsection = \"beam\"\n";
  EXPECT_EQ(said_about_frame("[columns]\nsection = \"column\"\n" + beams), "");
  EXPECT_NE(said_about_frame(beams), "");
}

// ------------------------------------------------------------------------------------------------ blasting concept

std::string with_charges_on(const std::string& members, const std::string& more = "") {
  const std::string whole = small_plan();
  const size_t begin = whole.find("[[stage]]"), end = whole.find("[[cable]]");
  return whole.substr(0, begin) + "[[stage]]\ntime = \"0 s\"\n[[stage.charge]]\nmembers = " + members +
         "\nposition = \"1 m\"\ndestroyed_length = \"1 m\"\n" + more + whole.substr(end);
}

TEST(Charges, ThatRemoveNoSupportAreAnError) {
  const std::string text = with_charges_on("\"B-A1A2-0\"");
  const std::vector<Diagnostic> complaints = complaints_about(text);
  ASSERT_EQ(complaints.size(), 1u) << rendered(complaints, text);
  EXPECT_EQ(complaints[0].code, "E401");
  EXPECT_EQ(complaints[0].message, "nothing removes a support; the building will stand");
  EXPECT_EQ(text.substr(0, text.find("[[stage]]")).size() - 1,
            text.find('\n', text.find("cut_bars")));  // the header follows the weakening's last line
  const auto lines = std::count(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(text.find("[[stage]]")), '\n');
  EXPECT_EQ(complaints[0].where.line, lines + 1);
  EXPECT_EQ(complaints[0].where.column, 1);
}

TEST(Charges, OnAnUpperColumnRemoveASupport) { EXPECT_TRUE(complaints_about(with_charges_on("\"C-A1-1\"")).empty()); }

TEST(Charges, ThatAllFailAreAWarning) {
  const std::vector<Diagnostic> complaints = complaints_about(with_charges_on("\"C-A1-0\"", "fails = true\n"));
  ASSERT_EQ(complaints.size(), 1u);
  EXPECT_EQ(complaints[0].code, "W504");
  EXPECT_THAT(complaints[0].message, HasSubstr("the building will stand"));
}

TEST(Charges, ThatMayScatterPastTheEndAreAWarningOfTheirStage) {
  EXPECT_TRUE(complaints_about(with_charges_on("\"C-A1-0\"", "scatter = \"1 s\"\ndelay = \"1.9 s\"\n")).empty());
  EXPECT_EQ(complaints_about(with_charges_on("\"C-A1-0\"", "scatter = \"1 s\"\ndelay = \"2 s\"\n")).size(), 1u);
  const std::vector<Diagnostic> late =
      complaints_about(with_charges_on("\"C-A*-0\"", "scatter = \"1 s\"\ndelay = \"2.1 s\"\n"));
  ASSERT_EQ(late.size(), 1u);
  EXPECT_EQ(late[0].code, "W509");
  EXPECT_THAT(late[0].message, HasSubstr("the scatter of 3 charges may lead past the end"));
  EXPECT_THAT(late[0].help, HasSubstr("they fire until 5.1 s"));
  const std::vector<Diagnostic> failing =
      complaints_about(with_charges_on("\"C-A1-0\"", "scatter = \"1 s\"\ndelay = \"2 s\"\nfails = true\n"));
  ASSERT_EQ(failing.size(), 1u);
  EXPECT_EQ(failing[0].code, "W504");
}

TEST(Charges, AreNotNeededForAStandingCheck) {
  const std::string whole = small_plan();
  const std::string text = whole.substr(0, whole.find("[[stage]]")) + whole.substr(whole.find("[[cable]]"));
  const std::vector<Diagnostic> complaints = complaints_about(text);
  ASSERT_EQ(complaints.size(), 1u) << rendered(complaints, text);
  EXPECT_EQ(complaints[0].code, "W501");
  EXPECT_EQ(complaints[0].severity, Severity::Warning);
}

TEST(Charges, OneAboveTheOtherOnAColumnAreTaken) {
  const std::string text = with_charges_on(
      "\"C-A*-0\"", "[[stage.charge]]\nmembers = \"C-A1-0\"\nposition = \"2.2 m\"\ndestroyed_length = \"1.4 m\"\n");
  EXPECT_EQ(rendered(complaints_about(text), text), "");
}

// -------------------------------------------------------------------------------------------------------- contents

Plan taken(const std::string& text) {
  std::vector<Diagnostic> warnings;
  return read_plan(text, "plan.toml", warnings);
}

const Member& member_of(const Plan& plan, const std::string& name) {
  const int index = plan.find_member(name);
  EXPECT_GE(index, 0) << name;
  return plan.members.at(static_cast<size_t>(index));
}

TEST(PlanContents, MaterialsTakeTheirDefaultsFromTheConcrete) {
  const Plan plan = taken(small_plan());
  const Concrete& c = plan.concretes.at(0);
  EXPECT_EQ(c.fc, 25e6);
  // equation (1) of Table 1's note; the paper rounds to 1.994 N/mm2
  EXPECT_NEAR(c.fct, 1.994e6, 0.0005e6);
  EXPECT_EQ(c.eps_c1, 2.2e-3);
  EXPECT_NEAR(c.Gf, 73 * std::pow(25, 0.18), 1e-9);
  EXPECT_EQ(c.Gcl, 15000);
  EXPECT_EQ(c.density, 2500);
  EXPECT_EQ(plan.steels.at(0).Es, 200e9);
}

TEST(PlanContents, BarsStandAroundTheSectionBetweenTheTies) {
  const Section s = taken(small_plan()).sections.at(0);
  ASSERT_EQ(s.bars.size(), 8u);
  // half the section less cover 30, tie 8 and half a bar 10 mm
  double sum_y = 0, sum_z = 0, largest_y = 0, largest_z = 0;
  for (const Bar& b : s.bars) {
    sum_y += b.y, sum_z += b.z;
    largest_y = std::max(largest_y, b.y), largest_z = std::max(largest_z, b.z);
    EXPECT_FALSE(b.y == 0 && b.z == 0) << "a bar in the middle";
  }
  EXPECT_NEAR(largest_y, 0.152, 1e-12);
  EXPECT_NEAR(largest_z, 0.202, 1e-12);
  EXPECT_NEAR(sum_y, 0, 1e-12);
  EXPECT_NEAR(sum_z, 0, 1e-12);
  EXPECT_NEAR(s.steel_area(), 8 * 314.159e-6, 1e-8);
}

TEST(PlanContents, BarsLieInLayersAtTopAndBottom) {
  const Section s = taken(small_plan()).sections.at(1);
  ASSERT_EQ(s.bars.size(), 6u);
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(s.bars[static_cast<size_t>(i)].z, i < 4 ? 0.252 : -0.252, 1e-12);
  EXPECT_NEAR(s.bars[0].y, -0.102, 1e-12);
  EXPECT_NEAR(s.bars[1].y, -0.034, 1e-12);
  EXPECT_NEAR(s.bars[5].y, 0.102, 1e-12);
  EXPECT_EQ(s.tie_legs_y, 4);
  EXPECT_EQ(s.tie_legs_z, 4);
  EXPECT_NEAR(s.tie_spacing, 0.15, 1e-15);
}

TEST(PlanContents, AFaceWithoutBarsIsSaidToBeSo) {
  const std::string beam = "top = \"4 x 20 mm\"\nbottom = \"2 x 20 mm\"";
  const Section s = taken(replaced(small_plan(), beam, "top = \"4 x 20 mm\"\nbottom = \"0 x 20 mm\"")).sections.at(1);
  ASSERT_EQ(s.bars.size(), 4u);
  for (const Bar& bar : s.bars) EXPECT_GT(bar.z, 0);
  for (const char* key : {"top", "bottom"}) {
    const std::string kept = key == std::string("top") ? "bottom = \"2 x 20 mm\"" : "top = \"4 x 20 mm\"";
    const std::vector<Diagnostic> found = complaints_about(replaced(small_plan(), beam, kept));
    ASSERT_EQ(found.size(), 1u) << key;
    EXPECT_EQ(found[0].code, "E201");
    EXPECT_NE(found[0].message.find(key), std::string::npos) << found[0].message;
  }
}

TEST(PlanContents, EachHalfOfABeamEndsBelowTheSlabOnItsSide) {
  // edge beams of 0.3 x 0.14 m beside a slab of 0.16 m: the outer half is left; those between two slabs have none
  std::string text = replaced(small_plan(), "height = \"60 cm\"", "height = \"14 cm\"");
  const Plan plan = taken(text);
  const double clear = 4 - 0.5;  // [m]
  EXPECT_NEAR(calc_mass(plan, member_of(plan, "B-A1A2-0")), 2500 * 0.15 * 0.14 * clear, 1e-9);
  EXPECT_EQ(calc_mass(plan, member_of(plan, "B-A2B2-0")), 0);
}

TEST(PlanContents, SteelAreaRescalesEveryBar) {
  const Section s = taken(replaced(small_plan(), "top = \"4 x 20 mm\"", "top = \"4 x 20 mm\"\nsteel_area = \"12 cm2\""))
                        .sections.at(1);
  EXPECT_NEAR(s.steel_area(), 12e-4, 1e-15);
  EXPECT_NEAR(s.bars[0].area, 2e-4, 1e-15);
  EXPECT_NEAR(s.bars[0].diameter, std::sqrt(4 * 2e-4 / 3.14159265358979), 1e-12);
  EXPECT_NEAR(s.bars[0].z, 0.252, 1e-12);  // the bars stay where they were drawn
}

TEST(PlanContents, AxesFollowTheGridAndTheFloors) {
  const Plan plan = taken(small_plan());
  const Member& column = member_of(plan, "C-B3-1");
  EXPECT_EQ(column.start, (Vec3{5, 8, 3}));
  EXPECT_EQ(column.end, (Vec3{5, 8, 6}));
  const Member& beam = member_of(plan, "B-A2B2-0");  // 60 cm deep, its top in the floor's
  EXPECT_EQ(beam.start, (Vec3{0, 4, 2.7}));
  EXPECT_EQ(beam.end, (Vec3{5, 4, 2.7}));
  const Member& slab = member_of(plan, "S-A2B3-1");
  EXPECT_EQ(slab.start, (Vec3{0, 4, 6 - 0.08}));
  EXPECT_EQ(slab.end, (Vec3{5, 8, 6 - 0.08}));
  const Member& wall = member_of(plan, "W-A1A2-0");
  EXPECT_EQ(wall.start, (Vec3{0, 0, 0}));
  EXPECT_EQ(wall.end, (Vec3{0, 4, 0}));
  EXPECT_NEAR(wall.height, 3 - 0.6, 1e-12);
  EXPECT_TRUE(wall.removed);
  EXPECT_EQ(wall.openings.size(), 1u);
  EXPECT_EQ(plan.find_member("C-C1-0"), -1);
  EXPECT_EQ(plan.level(1), 6);
}

TEST(PlanContents, LaterRulesAndOverridesReplaceEarlierOnes) {
  const std::string text =
      replaced(small_plan(), "[[beams]]",
               "[[columns]]\nsection = \"beam\"\nat = [\"A?\", \"B1\"]\nexcept = \"A3\"\nstoreys = [1]\n"
               "[[beams]]");
  const Plan plan = taken(replaced(text, "members = \"C-B2-0\"\nsection = \"column\"",
                                   "members = [\"C-B2-*\", \"C-A3-1\"]\nsection = \"beam\""));
  for (const char* name : {"C-A1-1", "C-A2-1", "C-B1-1", "C-B2-0", "C-B2-1", "C-A3-1"})
    EXPECT_EQ(member_of(plan, name).section, 1) << name;
  for (const char* name : {"C-A1-0", "C-A3-0", "C-B3-1", "C-B1-0"}) EXPECT_EQ(member_of(plan, name).section, 0) << name;
  EXPECT_EQ(member_of(plan, "C-A1-1").where.line, 51);
}

TEST(PlanContents, ChargesStandOnTheirMembersWithTheirPlaces) {
  const Plan plan = taken(small_plan());
  ASSERT_EQ(plan.stages.size(), 2u);
  ASSERT_EQ(plan.stages[0].charges.size(), 3u);
  EXPECT_EQ(plan.stages[0].name, "front");
  EXPECT_EQ(plan.stages[1].name, "stage 2");
  EXPECT_EQ(plan.stages[1].time, 2);
  const Charge& charge = plan.stages[1].charges.at(0);
  EXPECT_EQ(plan.members[static_cast<size_t>(charge.member)].name, "C-B3-0");
  EXPECT_EQ(charge.where.line, plan.stages[1].where.line + 2);
  EXPECT_EQ(charge.where.file, "plan.toml");
  EXPECT_EQ(member_of(plan, "C-B1-0").weakenings.at(0).cut_bars, 0.5);
  EXPECT_EQ(plan.cables.at(0).stiffness, 2e6);
  EXPECT_EQ(plan.members[static_cast<size_t>(plan.cables.at(0).member)].name, "C-A2-1");
}

TEST(PlanContents, FloorLoadsAreMasses) {
  const Plan plan = taken(small_plan());
  ASSERT_EQ(plan.storey_loads.size(), 2u);
  EXPECT_NEAR(plan.storey_loads[1], 1000 / 9.81, 1e-9);
}

TEST(PlanContents, NeighboursAndUtilitiesHaveNamesOfTheirOwn) {
  const std::string more =
      "[[site.utility]]\nname = \"House\"\nfootprint = [[\"40 m\", \"0 m\"], [\"41 m\", \"0 m\"], [\"41 m\", \"9 "
      "m\"]]\n";
  const std::string doubled = small_plan() + more;
  const std::string name = taken(small_plan()).neighbours.at(0).name;
  const std::string same =
      replaced(doubled, "name = \"House\"\nfootprint = [[\"40 m\"", "name = \"" + name + "\"\nfootprint = [[\"40 m\"");
  const std::vector<Diagnostic> all = complaints_about(same);
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].code, "E208");
  EXPECT_THAT(all[0].message, testing::HasSubstr("is the name of another neighbour or utility"));
  const size_t at = same.find("name = \"" + name + "\"\nfootprint = [[\"40 m\"");
  EXPECT_EQ(all[0].where.line, 1 + std::count(same.begin(), same.begin() + static_cast<std::ptrdiff_t>(at), '\n'));
}

TEST(PlanContents, FootprintsTurnCounterClockwise) {
  const std::string text = replaced(small_plan(), "[[\"0 m\", \"20 m\"], [\"10 m\", \"20 m\"], [\"10 m\", \"30 m\"]]",
                                    "[[\"10 m\", \"30 m\"], [\"10 m\", \"20 m\"], [\"0 m\", \"20 m\"]]");
  const auto corners = taken(text).neighbours.at(0).footprint;
  double twice = 0;
  for (size_t i = 0; i < 3; ++i)
    twice += corners[i][0] * corners[(i + 1) % 3][1] - corners[i][1] * corners[(i + 1) % 3][0];
  EXPECT_NEAR(twice, 100, 1e-9);
}

TEST(Mass, CountsEveryPieceOfConcreteOnce) {
  const Plan plan = taken(small_plan());
  const auto mass = [&](const char* name) { return calc_mass(plan, member_of(plan, name)); };
  EXPECT_NEAR(mass("C-A1-0"), 2500 * 0.4 * 0.5 * 3, 1e-9);
  // between columns 40 cm wide; both halves of the width below the slab
  EXPECT_NEAR(mass("B-A2B2-0"), 2500 * 0.3 * (0.6 - 0.16) * (5 - 0.4), 1e-9);
  // an edge beam: a slab on one side only; columns 50 cm deep along y
  EXPECT_NEAR(mass("B-A1A2-0"), 2500 * 0.3 * (0.6 - 0.08) * (4 - 0.5), 1e-9);
  // a quarter of a column is missing at each corner
  EXPECT_NEAR(mass("S-A1B2-0"), 2500 * 0.16 * (5 * 4 - 4 * 0.2 * 0.25), 1e-9);
  EXPECT_NEAR(mass("W-A1A2-0"), 1800 * 0.24 * ((4 - 0.5) * 2.4 - 1.2 * 2.1), 1e-9);
}

// ------------------------------------------------------------------------------------------------ files and encodings

class PlanFile : public testing::Test {
 protected:
  std::string write(const std::string& bytes) {
    const std::string path = folder_ / "plan.toml";
    std::ofstream(path, std::ios::binary) << bytes;
    return path;
  }
  /// The code of the only complaint.
  std::string code_of(const std::string& path) {
    std::vector<Diagnostic> warnings;
    try {
      read_plan_file(path, warnings, text_);
    } catch (const InputError& error) {
      return error.diagnostics().size() == 1 ? error.diagnostics()[0].code : "several";
    }
    return "none";
  }
  std::string text_;
  OwnFolder folder_;
};

TEST_F(PlanFile, IsReadWithItsBytes) {
  EXPECT_EQ(code_of(write(small_plan())), "none");
  EXPECT_EQ(text_, small_plan());
}

TEST_F(PlanFile, MayHaveAByteOrderMark) {
  EXPECT_EQ(code_of(write("\xEF\xBB\xBF" + small_plan())), "none");
  EXPECT_EQ(text_, small_plan());  // columns of the first line count without it
}

TEST_F(PlanFile, MayHaveWindowsLineEnds) {
  std::string text;
  for (const char c : small_plan()) text += c == '\n' ? std::string("\r\n") : std::string(1, c);
  EXPECT_EQ(code_of(write(text)), "none");
  const std::vector<Diagnostic> complaints = complaints_about(replaced(text, "count = 2", "count = 0"));
  ASSERT_EQ(complaints.size(), 1u);
  EXPECT_EQ(complaints[0].where.column, 9);
}

TEST_F(PlanFile, ThatIsNotThere) { EXPECT_EQ(code_of(testing::TempDir() + "no/such/plan.toml"), "E106"); }
TEST_F(PlanFile, ThatIsAFolder) { EXPECT_EQ(code_of(testing::TempDir()), "E106"); }
TEST_F(PlanFile, ThatIsEmpty) { EXPECT_EQ(code_of(write("")), "E104"); }
TEST_F(PlanFile, ThatIsBlank) { EXPECT_EQ(code_of(write(" \r\n\t\n")), "E104"); }
TEST_F(PlanFile, ThatIsTooLarge) { EXPECT_EQ(code_of(write(std::string((8u << 20) + 1, '\n'))), "E107"); }
TEST_F(PlanFile, ThatIsEndless) { EXPECT_EQ(code_of("/dev/zero"), "E107"); }
TEST_F(PlanFile, ThatHasZeroBytes) { EXPECT_EQ(code_of(write(small_plan() + std::string(3, '\0'))), "E103"); }
TEST_F(PlanFile, ThatIsLatin1) {
  EXPECT_EQ(code_of(write("title = \"Lagerhaus Wei\xDF"
                          "a\"\n")),
            "E103");
}

TEST(Limits, TooManyMembersAreAnError) {
  std::string frames;
  for (int i = 1; i <= 500; ++i)
    frames += (i > 1 ? ", " : "") + std::to_string(i) + " = \"" + std::to_string(i) + " m\"";
  const std::string lines = "frames = { 1 = \"0 m\", 2 = \"4 m\", 3 = \"8 m\" }";
  const std::string few = replaced(small_plan(), "count = 2", "count = 12");
  const std::string many = replaced(few, lines, "frames = { " + frames + " }");
  std::vector<std::string> codes;
  for (const Diagnostic& d : complaints_about(many)) codes.push_back(d.code);
  EXPECT_THAT(codes, testing::Contains("E209"));
  const std::string too_many = replaced(small_plan(), "count = 2", "count = 1000");
  codes.clear();
  for (const Diagnostic& d : complaints_about(replaced(too_many, lines, "frames = { " + frames + " }")))
    codes.push_back(d.code);
  EXPECT_THAT(codes, testing::Contains("E209"));
}

TEST(Documentation, ListsExactlyTheCodesThatAreUsed) {
  const std::filesystem::path root = TOPPLE_SOURCE_DIR;
  const auto collect = [](const std::filesystem::path& path, const std::regex& pattern, std::set<std::string>& codes) {
    std::ifstream file(path);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    for (std::sregex_iterator it(text.begin(), text.end(), pattern), end; it != end; ++it) codes.insert((*it)[1]);
  };
  std::set<std::string> used, listed;
  for (const auto& entry : std::filesystem::directory_iterator(root / "src/product"))
    if (entry.path().extension() == ".cpp") collect(entry.path(), std::regex("\"([EW][0-9]{3})\""), used);
  for (const char* page : {"docs/plan.md", "docs/imports.md"})
    collect(root / page, std::regex("\\| ([EW][0-9]{3}) \\|"), listed);
  EXPECT_GT(used.size(), 30u);
  EXPECT_EQ(used, listed);
}

std::string with_vibration(const std::string& frequency) {
  return replaced(small_plan(), "clearance = \"3 m\"\n",
                  "clearance = \"3 m\"\nbuilding_class = \"residential\"\n[site.vibration]\nvelocity = \"2 mm/s\"\n"
                  "energy = \"1 MJ\"\ndistance = \"10 m\"\nenergy_exponent = 0.5\ndistance_exponent = 1.5\nfactor = 2\n"
                  "source = \"report 12\"\nfrequency = " +
                      frequency + "\n");
}

TEST(ReadPlan, ReadsTheSitesVibrationLaw) {
  std::vector<Diagnostic> warnings;
  const Plan plan = read_plan(with_vibration("[\"5 Hz\", \"25 Hz\"]"), "plan.toml", warnings);
  ASSERT_TRUE(plan.vibration.has_value());
  EXPECT_DOUBLE_EQ(plan.vibration->velocity, 2e-3);
  EXPECT_DOUBLE_EQ(plan.vibration->energy, 1e6);
  EXPECT_EQ(plan.vibration->high_frequency, 25);
  EXPECT_EQ(plan.vibration->window, 0.25);
  EXPECT_EQ(plan.vibration->source, "report 12");
  EXPECT_EQ(plan.neighbours.at(0).building_class, BuildingClass::Residential);
}

TEST(ReadPlan, RefusesFrequenciesThatAreNoRange) {
  for (const char* wrong : {"[\"25 Hz\", \"5 Hz\"]", "[\"5 Hz\"]", "\"5 Hz\"", "[\"5 m\", \"6 m\"]"})
    EXPECT_NE(rendered(complaints_about(with_vibration(wrong)), "").find("frequency"), std::string::npos) << wrong;
}

TEST(ReadPlan, RefusesLawsThatLeadBeyondAllNumbers) {
  const std::string text = with_vibration("[\"5 Hz\", \"25 Hz\"]");
  for (const auto& [old, wrong] : {std::pair{"\"1 MJ\"", "\"1e-300 J\""},
                                   {"distance = \"10 m\"", "distance = \"1e-9 m\""},
                                   {"factor = 2", "factor = 2\nleast_distance = \"1e-9 m\""}}) {
    const std::string said = rendered(complaints_about(replaced(text, old, wrong)), "");
    EXPECT_NE(said.find("E205"), std::string::npos) << wrong << said;
  }
}

}  // namespace
}  // namespace topple::product
