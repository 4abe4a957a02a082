#include "record/rcc_fuzzy.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace topple::record {
namespace {

RccFuzzyReport sample_report() {
  RccFuzzyReport r;
  r.title = "Fuzzy <column>", r.zone = "zone of 0.39 m";
  r.source = "section.toml", r.inputs_source = "fuzzy.toml", r.program_version = "9.9.9";
  r.sha256 = std::string(64, 'a'), r.inputs_sha256 = std::string(64, 'b');
  r.inputs = {{"concrete.fc", "fc", "N/mm2", 1e6, {{10e6, 0}, {25e6, 1}, {45e6, 0}}, ""},
              {"concrete.fct", "fct", "N/mm2", 1e6, {}, "1.4 * ((fc - 8) / 10)^(2/3)"}};
  r.crushing = {{0, 3e6, 15e6}, {0.5, 6e6, 12e6}, {1, 9e6, 9e6}};
  RccFan f;
  f.normal_force = 4e6;
  f.rotation = {0, 0.005, 0.01};
  f.levels = {{0, {0, 0, 0}, {0, 9e5, 7e5}}, {1, {0, 6e5, 4e5}, {0, 6e5, 4e5}}};
  f.ordinates = {{"largest moment", -1, {{0, 0, 9e5}, {1, 6e5, 6e5}}}};
  f.outcomes = {{"carries the force and resists", 1, 1, 0},
                {"loses the force while it is turned", 1, 0.4, 1},
                {"loses its moment while it is turned", 0, 0, -1},
                {"crushed by the force alone", 1, 0.1, 2}};
  f.originals = {{0, 1, {25e6, 2e6}, "carries the force and resists", 6e5, {0, 6e5, 4e5}, true},
                 {1, 0.4, {16e6, 1e6}, "loses the force while it is turned", 4e5, {0, 4e5, 0}, true},
                 {2, 0.1, {11e6, 0.6e6}, "crushed by the force alone", 0, {0, 0, 0}, false}};
  f.crushing_possibility = 0.17;
  f.ending = "The search found nothing better.";
  r.fans = {f};
  r.notes = {"A note."};
  r.not_modelled = {"Slip."};
  return r;
}

TEST(RccFuzzy, PageStandsAloneAndSaysWhatCanHappen) {
  const RccFuzzyReport r = sample_report();
  const std::vector<Figure> figures = make_figures(r);
  const std::string page = to_page(r, figures);
  for (const char* outside : {"http:", "https:", "<script", "src=", "@import", "<link", "url("})
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  for (const char* text :
       {"Fuzzy &lt;column&gt;", "To the possibility 0.17 it is crushed by the force alone",
        "To the possibility 0.4 it loses the force while it is turned to 10 mrad, most possibly at fc = 16 N/mm2",
        "With the core values the section under 4 MN carries the force and resists up to 10 mrad",
        "every one of them on the layered route", "the curve of one set of inputs on the layered route; 3 runs in all",
        "1.4 * ((fc - 8) / 10)^(2/3)", "Table of values", "fuzzy.toml", "9.9.9", "A note.", "Slip.", "seed 1"})
    EXPECT_NE(page.find(text), std::string::npos) << text;
  for (const char* id : {"crushing", "fan_1", "switch_1", "inputs"})
    EXPECT_NE(page.find(std::string("<figure id=\"") + id + "\">\n<div class=\"wide\" tabindex=\"0\"><svg"),
              std::string::npos)
        << id << ": a figure's drawing can be wider than a narrow window, so that its texts can be read";
  EXPECT_EQ(page.find("nan"), std::string::npos);
}

TEST(RccFuzzy, DrawsBandsAndOriginals) {
  const std::vector<Figure> figures = make_figures(sample_report());
  const std::string svg = to_svg(figures[1].drawing);
  for (const char* text : {"α = 0<", "core (α = 1)<", "original that ends<"})
    EXPECT_NE(svg.find(text), std::string::npos) << text;
  EXPECT_EQ(svg.find("α = 1<"), std::string::npos) << "a level without width is the core's line";
  EXPECT_EQ(svg.find("original curve<"), std::string::npos) << "the only other one drawn ends";
}

TEST(RccFuzzy, SaysThatNothingCanBeCrushed) {
  RccFuzzyReport r = sample_report();
  r.fans[0].crushing_possibility = 0;
  const auto sentences = describe_switch(r, r.fans[0]);
  ASSERT_GE(sentences.size(), 2u);
  EXPECT_EQ(sentences[1], "No set of inputs lets the force crush it without rotation.");
}

TEST(RccFuzzy, FilesHoldEveryRun) {
  const RccFuzzyReport r = sample_report();
  const auto lines = [](const std::string& text) { return std::count(text.begin(), text.end(), '\n'); };
  EXPECT_EQ(lines(samples_csv(r)), 1 + 3);
  EXPECT_EQ(lines(fan_csv(r)), 1 + 2 * 3);
  EXPECT_EQ(lines(originals_csv(r)), 1 + 2 * 3);
  EXPECT_NE(samples_csv(r).find("4000000,1,0.4,16000000,1000000,loses the force while it is turned,400000"),
            std::string::npos);
  const auto j = nlohmann::json::parse(to_json(r));
  EXPECT_EQ(j["route"], "layered");
  EXPECT_EQ(j["fans"][0]["originals"].size(), 2u);
  EXPECT_EQ(j["fans"][0]["levels"][0]["upper"][1].get<double>(), 9e5);
  EXPECT_EQ(j["inputs"][1]["formula"], r.inputs[1].formula);
}

}  // namespace
}  // namespace topple::record
