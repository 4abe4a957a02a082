// The files of `topple rcc` against the library that they come from.

#include "nearfield/rcc.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "../base/own_folder.h"
#include "base/file.h"
#include "nearfield/fibres.h"
#include "nearfield/solid.h"
#include "product/fuzzy_file.h"
#include "product/section_file.h"

namespace topple {
namespace {

namespace fs = std::filesystem;

const std::string section = TOPPLE_SOURCE_DIR "/examples/rcc/zone_I.toml";

fs::path run(const std::string& name, const std::string& more, const std::string& file = section,
             bool is_again = false) {
  const fs::path folder = fs::path(testing::TempDir()) / "topple_rcc" / name;
  if (!is_again) fs::remove_all(folder);
  const std::string command =
      std::string(TOPPLE_PROGRAM) + " rcc " + file + " " + more + " -o " + folder.string() + " >/dev/null";
  EXPECT_EQ(std::system(command.c_str()), 0) << command;
  return folder;
}

nearfield::Rcc make_expected() {
  std::vector<Diagnostic> warnings;
  std::string text;
  const product::SectionFile f = product::read_section_file(section, warnings, text);
  nearfield::ZoneInput in;
  in.section = f.section, in.concrete = f.concrete, in.steel = f.steel, in.length = f.length;
  return nearfield::make_rcc(in);
}

TEST(RccCommand, FamiliesAreThoseOfMakeRcc) {
  const nearfield::Rcc rcc = make_expected();
  const auto j = nlohmann::json::parse(read_file((run("families", "") / "rcc.json").string()));
  const nearfield::MomentFamily* expected[] = {&rcc.y_pos, &rcc.y_neg, &rcc.z_pos, &rcc.z_neg};
  ASSERT_EQ(j["families"].size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    const auto& f = j["families"][i];
    const size_t K = expected[i]->normal_force.size(), J = expected[i]->rotation.size();
    EXPECT_EQ(f["rotation"].get<std::vector<double>>(), expected[i]->rotation);
    const auto moment = f["moment"].get<std::vector<double>>();
    ASSERT_EQ(moment.size(), K * J);
    for (size_t k = 0; k < K; ++k) {
      EXPECT_EQ(f["normal_force"][k].get<double>(), -expected[i]->normal_force[K - 1 - k]) << "compression is positive";
      for (size_t n = 0; n < J; ++n) EXPECT_EQ(moment[k * J + n], expected[i]->moment[(K - 1 - k) * J + n]);
    }
  }
  EXPECT_EQ(j["stiffness"]["EA"].get<double>(), rcc.EA);
  EXPECT_EQ(j["capacity"]["crushing"].get<double>(), -rcc.y_pos.normal_force.front());
}

TEST(RccCommand, CurvesPassThroughTheFamily) {
  // N = 0 is a level of the family; beyond 0.03 rad the section leaps between branches (tests/nearfield)
  const auto j = nlohmann::json::parse(read_file((run("curves", "--normal-force 0") / "rcc.json").string()));
  const auto& family = j["families"][0];
  const auto rotation = family["rotation"].get<std::vector<double>>();
  size_t k = 0;
  while (family["normal_force"][k].get<double>() != 0) ++k;
  const auto curve_rotation = j["curves"][0]["rotation"].get<std::vector<double>>();
  const auto curve_moment = j["curves"][0]["moment"].get<std::vector<double>>();
  int compared = 0;
  for (size_t n = 0; n < rotation.size() && rotation[n] < 0.03; ++n)
    for (size_t i = 0; i < curve_rotation.size(); ++i) {
      if (curve_rotation[i] != rotation[n]) continue;
      EXPECT_NEAR(curve_moment[i], family["moment"][k * rotation.size() + n].get<double>(), 1e-5 * 533e3);
      ++compared;
    }
  EXPECT_GT(compared, 20);
}

TEST(RccCommand, TablesHoldTheNumbersOfTheJson) {
  const fs::path folder = run("tables", "--normal-force \"3.7 MN\" --normal-force \"1 MN\"");
  const auto j = nlohmann::json::parse(read_file((folder / "rcc.json").string()));
  std::istringstream lines(read_file((folder / "curves.csv").string()));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "route,axis,direction,normal force [N],rotation [rad],moment [N·m]\r");
  ASSERT_EQ(j["curves"].size(), 8u);
  EXPECT_EQ(j["curves"][0]["normal_force"].get<double>(), 3.7e6);
  for (const auto& c : j["curves"])
    for (size_t i = 0; i < c["rotation"].size(); ++i) {
      ASSERT_TRUE(std::getline(lines, line));
      std::vector<std::string> cells;
      std::istringstream in(line);
      for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
      ASSERT_EQ(cells.size(), 6u);
      EXPECT_EQ(cells[1], c["axis"].get<std::string>());
      EXPECT_EQ(std::stod(cells[3]), c["normal_force"].get<double>());
      EXPECT_EQ(std::stod(cells[4]), c["rotation"][i].get<double>());
      EXPECT_EQ(std::stod(cells[5]), c["moment"][i].get<double>());
    }
  EXPECT_FALSE(std::getline(lines, line));
}

TEST(RccCommand, PicturesArePngsOfTheStatedSize) {
  const fs::path folder = run("pictures", "--normal-force \"1 MN\"");
  int pictures = 0;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() != ".png") continue;
    ++pictures;
    const std::string bytes = read_file(entry.path().string());
    ASSERT_EQ(bytes.substr(0, 8), std::string("\x89PNG\r\n\x1a\n", 8)) << entry.path();
    const auto size = [&](size_t at) {
      int v = 0;
      for (size_t i = 0; i < 4; ++i) v = v * 256 + static_cast<unsigned char>(bytes[at + i]);
      return v;
    };
    const std::string name = entry.path().filename().string();
    const bool is_section = name.rfind("section", 0) == 0, is_biaxial = name == "biaxial.png";
    EXPECT_EQ(size(16), is_section ? 1920 : is_biaxial ? 1440 : 1800) << entry.path();
    EXPECT_EQ(size(20), is_section ? 1600 : is_biaxial ? 1120 : 1000) << entry.path();
  }
  EXPECT_GE(pictures, 8);
}

const char* const beam =
    "[concrete.c]\nfc = \"30 N/mm2\"\nEc = \"31 GPa\"\n[steel.s]\nfy = \"500 N/mm2\"\nfu = \"550 N/mm2\"\neps_u = \"5 "
    "%\"\n"
    "[section.beam]\nwidth = \"30 cm\"\nheight = \"60 cm\"\nconcrete = \"c\"\nsteel = \"s\"\ncover = \"3 cm\"\n"
    "ties = { diameter = \"8 mm\", spacing = \"15 cm\" }\ntop = \"2 x 12 mm\"\nbottom = \"4 x 25 mm\"\n"
    "[zone]\nlength = \"30 cm\"\n";

TEST(RccCommand, SectionsAtThePeakHaveAllTheirBars) {
  // the moment rises until a bar tears
  const OwnFolder own;
  replace_file(own / "beam.toml", beam);
  const fs::path folder = run("all_bars", "--normal-force \"0 MN\"", own / "beam.toml");
  const auto j = nlohmann::json::parse(read_file((folder / "rcc.json").string()));
  int peaks = 0;
  for (const auto& s : j["states"]) {
    if (s["point"] != "peak") continue;
    ++peaks;
    double pulled = 0;
    for (const auto& bar : s["bars"]) {
      EXPECT_NE(bar["condition"], "torn") << s["axis"] << s["direction"];
      pulled = std::max(pulled, bar["stress"].get<double>());
    }
    EXPECT_GT(pulled, 500e6) << s["axis"] << s["direction"];
  }
  EXPECT_GE(peaks, 4);
}

TEST(RccCommand, ForcesCarriedToOneSideHaveNoYield) {
  const OwnFolder own;
  replace_file(own / "beam.toml", beam);
  const fs::path folder = run("one_side", "--normal-force \"5.7 MN\"", own / "beam.toml");
  const auto j = nlohmann::json::parse(read_file((folder / "rcc.json").string()));
  const auto& c = j["curves"][0];
  EXPECT_GT(c["peak"]["moment"].get<double>(), 250e3);
  EXPECT_TRUE(c["yield"]["rotation"].is_null());
  EXPECT_TRUE(c["yield"]["moment"].is_null());
  EXPECT_TRUE(c["stiffness_effective"].is_null());
  for (const auto& s : j["states"]) EXPECT_FALSE(s["axis"] == "y" && s["point"] == "yield");
  EXPECT_TRUE(j["biaxial_exponent"].is_null());
  EXPECT_NE(j["notes"].dump().find("5.7 MN, there is no moment about z alone"), std::string::npos);
}

TEST(RccCommand, NotesTellWhatStiffnessAndMomentsAreWorth) {
  const OwnFolder own;
  replace_file(own / "beam.toml", beam);
  const fs::path folder = run("notes", "--normal-force 0", own / "beam.toml");
  const auto j = nlohmann::json::parse(read_file((folder / "rcc.json").string()));
  const std::string notes = j["notes"].dump();
  EXPECT_NE(notes.find("EI eff is that before cracking about +y under 0 MN"), std::string::npos) << notes;
  EXPECT_NE(notes.find("turning about z alone"), std::string::npos) << notes;
  const auto& line = j["biaxial"][0];
  EXPECT_EQ(line["moment_y"].back().get<double>(), 0);
  EXPECT_NEAR(line["moment_z"].back().get<double>(), 107e3, 1.5e3);
}

TEST(RccCommand, LeavesNothingOfAnEarlierRun) {
  const fs::path folder = run("again", "--normal-force \"1 MN\" --normal-force \"2 MN\"");
  EXPECT_TRUE(fs::exists(folder / "section_y_pos_2.png"));
  replace_file((folder / "section_y_pos_2b.png").string(), "mine");
  replace_file((folder / "fan_1.png").string(), "of a fuzzy run");
  run("again", "--normal-force \"1 MN\"", section, true);
  EXPECT_TRUE(fs::exists(folder / "section_y_pos_1.png"));
  EXPECT_FALSE(fs::exists(folder / "section_y_pos_2.png"));
  EXPECT_FALSE(fs::exists(folder / "fan_1.png"));
  EXPECT_TRUE(fs::exists(folder / "section_y_pos_2b.png"));
}

TEST(RccFuzzyCommand, CoreIsTheCrispCurveOfLongZonesToo) {
  const OwnFolder own;
  std::string text = read_file(section);
  const std::string length = "length = \"39 cm\"";
  text.replace(text.find(length), length.size(), "length = \"94 cm\"");  // 0.97 of the longest
  replace_file(own / "long.toml", text);
  replace_file(own / "fuzzy.toml",
               "steel.fy = { triangular = [\"400 N/mm2\", \"420 N/mm2\", \"440 N/mm2\"] }\n[search]\nlevels = [0, "
               "1]\nsamples = 60\n");
  const fs::path folder = run("long", "--normal-force \"2.9 MN\" --fuzzy " + (own / "fuzzy.toml"), own / "long.toml");
  const auto crisp = nlohmann::json::parse(read_file((folder / "rcc.json").string()));
  const auto j = nlohmann::json::parse(read_file((folder / "fuzzy.json").string()));
  const auto core = j["fans"][0]["core"].get<std::vector<double>>();
  const double peak = crisp["curves"][0]["peak"]["moment"].get<double>();
  EXPECT_NEAR(*std::max_element(core.begin(), core.end()), peak, 2e-3 * peak);
  EXPECT_TRUE(j["notes"].empty());
  // twice the ultimate rotation, and the page says so
  const double turned = j["fans"][0]["turned_to"].get<double>();
  EXPECT_NEAR(turned, 2 * crisp["curves"][0]["ultimate"]["rotation"].get<double>(), 1e-6);
  EXPECT_NE(read_file((folder / "fuzzy.html").string()).find("turned to 35."), std::string::npos);
}

TEST(RccFuzzyCommand, TensionTears) {
  const OwnFolder own;
  replace_file(own / "fuzzy.toml",
               "steel.fu = { triangular = [\"480 N/mm2\", \"500 N/mm2\", \"540 N/mm2\"] }\n[search]\nlevels = [0, "
               "1]\nsamples = 60\n");
  const fs::path folder = run("tension", "--normal-force=\"-3.3 MN\" --fuzzy " + (own / "fuzzy.toml"));
  const auto j = nlohmann::json::parse(read_file((folder / "fuzzy.json").string()));
  EXPECT_NEAR(j["tearing_force"].back()["left"].get<double>(), 3.2e6, 1e3);
  EXPECT_EQ(j["fans"][0]["outcomes"][3]["name"], "torn by the force alone");
  EXPECT_EQ(j["fans"][0]["outcomes"][3]["possibility"].get<double>(), 1);
  EXPECT_EQ(j["fans"][0]["tearing_possibility"].get<double>(), 1);
  EXPECT_EQ(j["fans"][0]["crushing_possibility"].get<double>(), 0);
  EXPECT_EQ(read_file((folder / "fuzzy.html").string()).find("crushed by the force alone"), std::string::npos);
}

std::vector<std::vector<std::string>> read_table(const fs::path& path) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(read_file(path.string()));
  for (std::string line; std::getline(lines, line);) {
    rows.emplace_back();
    std::istringstream in(line);
    for (std::string cell; std::getline(in, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

TEST(RccSolidCommand, BothRoutesStandInOneReport) {
  const fs::path folder =
      run("solid", "--normal-force \"1 MN\" --route both --element-size \"15 cm\" --rotation \"0.002 rad\"");
  const auto j = nlohmann::json::parse(read_file((folder / "rcc.json").string()));
  ASSERT_EQ(j["curves"].size(), 5u) << "four layered ones, one solid";
  const auto& solid = j["curves"][4];
  EXPECT_EQ(solid["route"], "solid");
  std::vector<Diagnostic> warnings;
  std::string text;
  const product::SectionFile f = product::read_section_file(section, warnings, text);
  nearfield::ZoneInput in;
  in.section = f.section, in.concrete = f.concrete, in.steel = f.steel, in.length = f.length;
  nearfield::SolidOptions options;
  options.element_size = 0.15, options.largest_rotation = 0.002;
  const nearfield::SolidMarch march = nearfield::march_solid(in, -1e6, 0, 1, options, {});
  const auto rotation = solid["rotation"].get<std::vector<double>>(),
             moment = solid["moment"].get<std::vector<double>>();
  ASSERT_EQ(rotation.size(), march.rotation.size());
  for (size_t i = 0; i < rotation.size(); ++i) {
    EXPECT_EQ(rotation[i], march.rotation[i]);
    EXPECT_EQ(moment[i], std::max(0.0, march.moment[i]));
  }
  // the cut is integrated from the stresses of the elements; it balances the force to the residual of the steps
  ASSERT_GE(j["solid_states"].size(), 1u);
  for (const auto& state : j["solid_states"]) EXPECT_NEAR(state["cut_normal_force"].get<double>(), 1e6, 0.02e6);
  const std::string page = read_file((folder / "rcc.html").string());
  for (const char* text_of_page : {"1 MN, layered", "1 MN, solid", "degrees of freedom", "The zone on the solid route"})
    EXPECT_NE(page.find(text_of_page), std::string::npos) << text_of_page;
}

TEST(RccFuzzyCommand, FanIsNestedAndHoldsItsOriginals) {
  const OwnFolder own;
  const std::string inputs = own / "inputs.toml";
  const std::string table_1 = read_file(TOPPLE_SOURCE_DIR "/examples/rcc/zone_I_fuzzy.toml");
  replace_file(inputs, table_1 + "[search]\nlevels = [0, 0.5, 1]\nsamples = 600\n");
  const fs::path folder = run("fuzzy", "--normal-force \"2.9 MN\" --fuzzy " + inputs);
  const auto j = nlohmann::json::parse(read_file((folder / "fuzzy.json").string()));
  const auto& fan = j["fans"][0];
  const size_t J = fan["rotation"].size();
  ASSERT_EQ(fan["levels"].size(), 3u);
  for (size_t l = 1; l < 3; ++l)
    for (size_t i = 0; i < J; ++i) {
      EXPECT_LE(fan["levels"][l - 1]["lower"][i].get<double>(), fan["levels"][l]["lower"][i].get<double>());
      EXPECT_GE(fan["levels"][l - 1]["upper"][i].get<double>(), fan["levels"][l]["upper"][i].get<double>());
    }
  EXPECT_EQ(fan["levels"][2]["lower"], fan["core"]) << "the inputs' cores are points";
  ASSERT_GT(fan["originals"].size(), 20u);
  for (const auto& original : fan["originals"])
    for (const auto& level : fan["levels"]) {
      if (original["membership"].get<double>() < level["alpha"].get<double>()) continue;
      for (size_t i = 0; i < J; ++i) {
        EXPECT_GE(original["moment"][i].get<double>(), level["lower"][i].get<double>());
        EXPECT_LE(original["moment"][i].get<double>(), level["upper"][i].get<double>());
      }
    }
  EXPECT_EQ(read_table(folder / "samples.csv").size(), 1u + fan["runs"].get<size_t>());
  EXPECT_EQ(read_table(folder / "fan.csv").size(), 1u + 3 * J);
}

TEST(RccFuzzyCommand, InteractionCutsTheInputs) {
  // what ties values together leaves the same as inputs that end there
  const OwnFolder own;
  const auto bounds = [&](const std::string& name, const std::string& areas, const std::string& interaction) {
    const std::string inputs = own / "inputs.toml";
    replace_file(inputs,
                 "steel.fy = { triangular = [\"380 N/mm2\", \"420 N/mm2\", \"460 N/mm2\"] }\n"
                 "section.steel_area = { triangular = " +
                     areas + " }\n" + interaction + "[search]\nlevels = [0, 0.5, 1]\nsamples = 2000\n");
    const fs::path folder = run(name, "--normal-force \"1 MN\" --fuzzy " + inputs);
    const auto j = nlohmann::json::parse(read_file((folder / "fuzzy.json").string()));
    std::vector<double> out;
    for (const auto& cut : j["fans"][0]["ordinates"][0]["cuts"])
      for (const char* end : {"left", "right"}) out.push_back(cut[end].get<double>());
    const std::string page = read_file((folder / "fuzzy.html").string());
    EXPECT_EQ(page.find("steel_area &lt;= 6400") != std::string::npos, interaction.find("<=") != std::string::npos);
    return out;
  };
  const std::string wide = "[\"50 cm2\", \"64 cm2\", \"80 cm2\"]";
  const auto whole = bounds("tied_not", wide, "");
  const auto below = bounds("tied_below", wide, "[interaction]\nconstraints = [\"steel_area <= 6400\"]\n");
  const auto joint =
      bounds("tied_joint", wide, "[interaction]\nmembership = \"max(0, 1 - abs(steel_area - 6400) / 600)\"\n");
  const auto cut = bounds("cut_below", "[\"50 cm2\", \"64 cm2\", \"64 cm2\"]", "");
  const auto narrow = bounds("narrow", "[\"58 cm2\", \"64 cm2\", \"70 cm2\"]", "");
  ASSERT_EQ(whole.size(), 6u);
  const double width = whole[1] - whole[0];
  for (size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(below[i], cut[i], 1e-4 * width) << i;
    EXPECT_NEAR(joint[i], narrow[i], 1e-4 * width) << i;
  }
  EXPECT_LT(below[1], whole[1] - 0.1 * width);
  EXPECT_GT(joint[0], whole[0] + 0.1 * width);
}

TEST(RccFuzzyCommand, EveryOriginalIsTheCurveOfItsInputs) {
  const OwnFolder own;
  const std::string inputs = own / "inputs.toml";
  const std::string table_1 = read_file(TOPPLE_SOURCE_DIR "/examples/rcc/zone_I_fuzzy.toml");
  replace_file(inputs, table_1 + "[search]\nlevels = [0, 1]\nsamples = 300\n");
  const fs::path folder = run("originals", "--normal-force \"2.9 MN\" --fuzzy " + inputs);
  const auto j = nlohmann::json::parse(read_file((folder / "fuzzy.json").string()));
  std::vector<Diagnostic> warnings;
  std::string text;
  const product::SectionFile file = product::read_section_file(section, warnings, text);
  const product::FuzzyFile fuzzy = product::read_fuzzy_file(inputs, file, warnings, text);
  const auto& fan = j["fans"][0];
  const auto rotation = fan["rotation"].get<std::vector<double>>();
  int compared = 0;
  for (const auto& original : fan["originals"]) {
    std::vector<double> point;
    for (const product::FuzzyValue& v : fuzzy.inputs) point.push_back(original["values"][v.path].get<double>());
    const product::SectionFile s = product::make_sample(file, fuzzy, point);
    nearfield::ZoneInput in;
    in.section = s.section, in.concrete = s.concrete, in.steel = s.steel;
    const double longest = nearfield::calc_largest_zone_length(s.concrete);
    in.length = s.length < longest ? s.length : 0.9 * longest;
    std::vector<double> kappa(rotation);
    for (double& k : kappa) k /= in.length;
    const auto march = nearfield::march_curvature(nearfield::make_fibres(in, nearfield::Axis::Y), -2.9e6, 1, kappa);
    EXPECT_EQ(original["moment"].get<std::vector<double>>(), march.moment);
    EXPECT_EQ(original["values"]["concrete.fct"].get<double>(), s.concrete.fct);
    ++compared;
  }
  EXPECT_GT(compared, 10);
}

TEST(RccFuzzyCommand, CrushingForceHasTheEndsOfTableOne) {
  // left values of Table 1 crush at about 3.2 MN, core values at 8.9 MN (docs/weida.md)
  const OwnFolder own;
  const std::string inputs = own / "inputs.toml";
  const std::string table_1 = read_file(TOPPLE_SOURCE_DIR "/examples/rcc/zone_I_fuzzy.toml");
  replace_file(inputs, table_1 + "[search]\nlevels = [0, 1]\nsamples = 300\n");
  const fs::path folder = run("crushing", "--normal-force \"3.7 MN\" --fuzzy " + inputs);
  const auto j = nlohmann::json::parse(read_file((folder / "fuzzy.json").string()));
  const auto& cuts = j["crushing_force"];
  EXPECT_NEAR(cuts.front()["left"].get<double>(), 3.27e6, 0.02e6);
  EXPECT_NEAR(cuts.back()["left"].get<double>(), 8.91e6, 0.01e6);
  EXPECT_EQ(cuts.back()["left"], cuts.back()["right"]);
  const double possibility = j["fans"][0]["crushing_possibility"].get<double>();
  EXPECT_GT(possibility, 0.05) << "3.7 MN lies above the left end";
  EXPECT_LT(possibility, 0.15);
}

TEST(RccCommand, SameInputGivesTheSameBytes) {
  const fs::path a = run("once", "--normal-force \"2 MN\""), b = run("twice", "--normal-force \"2 MN\" --threads 2");
  for (const char* name : {"rcc.json", "rcc.html", "states.csv", "moment_y.png"})
    EXPECT_EQ(read_file((a / name).string()), read_file((b / name).string())) << name;
}

}  // namespace
}  // namespace topple
