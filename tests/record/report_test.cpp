#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "record/building_plan.h"
#include "record/record.h"

namespace topple::record {
namespace {

using nlohmann::json;

std::vector<std::uint8_t> decode_base64(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::vector<std::uint8_t> bytes;
  std::uint32_t word = 0;
  int bits = 0;
  for (const char c : text) {
    const std::size_t value = digits.find(c);
    if (value == std::string::npos) continue;
    word = word << 6 | static_cast<std::uint32_t>(value);
    bits += 6;
    if (bits >= 8) {
      bits -= 8;
      bytes.push_back(static_cast<std::uint8_t>(word >> bits & 255U));
    }
  }
  return bytes;
}

std::vector<float> decode_floats(const std::string& text) {
  const std::vector<std::uint8_t> bytes = decode_base64(text);
  std::vector<float> values;
  for (std::size_t i = 0; i + 3 < bytes.size(); i += 4)
    values.push_back(std::bit_cast<float>(
        static_cast<std::uint32_t>(bytes[i]) | static_cast<std::uint32_t>(bytes[i + 1]) << 8 |
        static_cast<std::uint32_t>(bytes[i + 2]) << 16 | static_cast<std::uint32_t>(bytes[i + 3]) << 24));
  return values;
}

/// Two frames, two bodies, one zone.
Record make_record() {
  Record r;
  r.provenance.title = "Storehouse";
  r.provenance.plan_text = "title = \"Storehouse\"\n";
  r.provenance.seed = std::numeric_limits<std::uint64_t>::max();
  r.provenance.step = 1e-4;
  r.counts = {2, 1, 0, 6, 0, 5000};
  r.plan_values = {{"Building", "Height", "22 m"}};
  r.bodies.resize(2);
  r.bodies[0].name = "C-A1-0";
  r.bodies[0].kind = "column";
  r.bodies[0].mass = 2000;
  r.bodies[0].shapes = {{{{0, 0, 1.5}, Quat{0.6, 0, 0.8, 0}}, {0.25, 0.25, 1.5}, "concrete"}};
  r.bodies[1].name = "B-A1A2-0";
  r.bodies[1].kind = "beam";
  r.bodies[1].mass = 3000;
  r.zones = {{"C-A1-0/foot", "C-A1-0", "six-component element", -1, 0, {1, 2, 3}}};
  r.neighbours = {{"no. 7", {{10, 0}, {20, 0}, {20, 8}}, false}};
  r.building_outline = {{0, 0}, {12, 0}, {12, 22}, {0, 22}};
  r.time = {0, 0.5};
  for (int i = 0; i < 12; ++i) r.position.push_back(0.1F * static_cast<float>(i) - 0.3F);
  r.orientation = {1, 0, 0, 0, 1, 0, 0, 0, 0.6F, 0.8F, 0, 0, 1, 0, 0, 0};
  r.zone_state = {0, 3};
  r.zone_utilisation = {0.5F, 1.25F};
  r.series = {{"tilt_angle", "Tilt angle", "rad", "angle", {0, 0.1}}};
  r.events = {{0.25, "stage", "Stage 1", "Stage 1 fires."}};
  r.findings = {{"mechanism", "Mechanism", "Mechanism", "Topples.", 1.6, "rad", Status::Good},
                {"vibration", "Vibration", "Vibration", "Not asked.", std::nan(""), "", Status::Warning}};
  r.not_modelled = {"Dust"};
  r.ending = "time_limit";
  r.ending_text = "Stopped while moving.";
  return r;
}

std::string temporary(const std::string& name) { return testing::TempDir() + "topple_report_test_" + name; }

/// What a browser takes for the data: from the opening tag to the first closing one.
json data_of_page(const std::string& page) {
  const std::string open = R"(<script type="application/json" id="topple-data">)";
  const std::size_t begin = page.find(open) + open.size();
  return json::parse(page.substr(begin, page.find("</script", begin) - begin));
}

TEST(ReportJson, OutlinesTheBuildingAsItIs) {
  // an L of two slabs, the second turned by a quarter and settled by a millimetre; a shaft of two staves; later frames
  // change nothing
  Record r = make_record();
  const Quat quarter{std::sqrt(0.5), 0, 0, std::sqrt(0.5)};
  const Quat eighth{std::cos(M_PI / 8), 0, 0, std::sin(M_PI / 8)};
  r.bodies.resize(3);
  r.bodies[0] = {"S-A1B2-0", "slab", 0, 1, false, {{{{2, 1, 0}, {}}, {2, 1, 0.1}, "concrete"}}};
  r.bodies[1] = {"S-A2B3-0", "slab", 0, 1, false, {{{}, {2, 0.5, 0.1}, "concrete"}}};
  r.bodies[2] = {"tower/1", "shaft", 0, 1, false, {{{{0, 0, 0}, eighth}, {1, 1, 2}, "concrete"}}};
  r.position = {0, 0, 3, 0.5F, 3.999F, 3, 20, 0, 2, 9, 9, 0, 9, 9, 0, 9, 9, 0};
  r.orientation.clear();
  for (int frame = 0; frame < 2; ++frame)
    for (const Quat& q : {Quat{}, quarter, Quat{}})
      for (const double c : {q.w, q.x, q.y, q.z}) r.orientation.push_back(static_cast<float>(c));
  const json plan = json::parse(to_report_json(r))["building_plan"];
  ASSERT_EQ(plan.size(), 2U) << plan;
  const double l[6][2] = {{0, 0}, {4, 0}, {4, 2}, {1, 2}, {1, 6}, {0, 6}};
  ASSERT_EQ(plan[0].size(), 6U) << plan;
  for (size_t i = 0; i < 6; ++i)
    for (size_t k = 0; k < 2; ++k) EXPECT_NEAR(plan[0][i][k].get<double>(), l[i][k], 0.002) << i;
  ASSERT_EQ(plan[1].size(), 4U) << "a square on its corner";
  EXPECT_NEAR(plan[1][0][0].get<double>(), 20 - std::sqrt(2), 1e-6);
  r.time.clear();
  EXPECT_TRUE(calc_building_plan(r).empty()) << "nothing is known of where it stood";
}

TEST(ReportJson, CarriesEveryPartOfTheRecord) {
  const json j = json::parse(to_report_json(make_record()));
  EXPECT_EQ(j["format"], "topple-report");
  EXPECT_EQ(j["version"], 1);
  EXPECT_EQ(j["provenance"]["title"], "Storehouse");
  EXPECT_EQ(j["provenance"]["seed"], "18446744073709551615");  // beyond the integers a browser can hold
  EXPECT_EQ(j["ending"]["kind"], "time_limit");
  EXPECT_EQ(j["counts"]["force_elements"], 6);
  EXPECT_EQ(j["bodies"][0]["shapes"][0]["half"], json({0.25, 0.25, 1.5}));
  EXPECT_EQ(j["bodies"][0]["shapes"][0]["orientation"], json({0.6, 0.0, 0.8, 0.0}));
  EXPECT_EQ(j["zones"][0]["body_a"], -1);
  EXPECT_EQ(j["zones"][0]["place"], json({1.0, 2.0, 3.0}));
  EXPECT_EQ(j["neighbours"][0]["footprint"][2], json({20.0, 8.0}));
  EXPECT_EQ(j["building_outline"].size(), 4U);
  EXPECT_EQ(j["time"], json({0.0, 0.5}));
  EXPECT_EQ(j["series"][0]["value"], json({0.0, 0.1}));
  EXPECT_EQ(j["events"][0]["text"], "Stage 1 fires.");
  EXPECT_EQ(j["findings"][1]["id"], "vibration");
  EXPECT_EQ(j["findings"][1]["status"], "warning");
  EXPECT_EQ(j["plan_values"][0]["value"], "22 m");
  EXPECT_EQ(j["not_modelled"], json({"Dust"}));
}

TEST(ReportJson, KeepsTheBitsOfPosesAndZones) {
  const Record r = make_record();
  const json j = json::parse(to_report_json(r));
  EXPECT_EQ(decode_floats(j["position"]), r.position);
  EXPECT_EQ(decode_floats(j["orientation"]), r.orientation);
  EXPECT_EQ(decode_floats(j["zone_utilisation"]), r.zone_utilisation);
  EXPECT_EQ(decode_base64(j["zone_state"]), r.zone_state);
}

TEST(ReportJson, PadsBase64ByTheRules) {
  // RFC 4648: one byte takes "==", two take "=", three none.
  for (const auto& [count, expected] : {std::pair{1, "AQ=="}, {2, "AQI="}, {3, "AQID"}, {4, "AQIDBA=="}}) {
    Record r;
    r.time = {0};
    r.zones.resize(static_cast<std::size_t>(count));
    r.zone_utilisation.assign(static_cast<std::size_t>(count), 0);
    for (int i = 1; i <= count; ++i) r.zone_state.push_back(static_cast<std::uint8_t>(i));
    EXPECT_EQ(json::parse(to_report_json(r))["zone_state"], expected);
  }
}

TEST(ReportJson, WritesFloatsLittleEndian) {
  Record r;
  r.time = {0};
  r.bodies.resize(1);
  r.position = {1, 0, 0};  // 1.0f is 0x3f800000
  r.orientation = {1, 0, 0, 0};
  const std::vector<std::uint8_t> bytes = decode_base64(json::parse(to_report_json(r))["position"]);
  EXPECT_THAT(bytes, testing::ElementsAre(0, 0, 0x80, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0));
}

TEST(ReportJson, TurnsNotANumberAndInfinityIntoNull) {
  Record r = make_record();
  r.series[0].value = {std::nan(""), std::numeric_limits<double>::infinity()};
  r.counts.mass = std::nan("");
  const json j = json::parse(to_report_json(r));
  EXPECT_TRUE(j["findings"][1]["value"].is_null());
  EXPECT_TRUE(j["series"][0]["value"][0].is_null());
  EXPECT_TRUE(j["series"][0]["value"][1].is_null());
  EXPECT_TRUE(j["counts"]["mass"].is_null());
}

TEST(ReportJson, AcceptsAnEmptyRecord) {
  const json j = json::parse(to_report_json(Record{}));
  EXPECT_TRUE(j["bodies"].is_array());
  EXPECT_TRUE(j["findings"].empty());
  EXPECT_EQ(j["position"], "");
}

TEST(ReportJson, ReplacesBytesThatAreNotUtf8) {
  Record r = make_record();
  r.bodies[0].name = "C\xff";
  EXPECT_EQ(json::parse(to_report_json(r))["bodies"][0]["name"], "C\xef\xbf\xbd");
}

TEST(ReportJson, SaysTheSameTwice) { EXPECT_EQ(to_report_json(make_record()), to_report_json(make_record())); }

TEST(ReportJson, RefusesARecordWhoseArraysDoNotFit) {
  Record r = make_record();
  r.position.pop_back();
  EXPECT_THROW(to_report_json(r), std::logic_error);
}

TEST(ReportPage, TakesThePlaceOfTheMarker) {
  const std::string path = temporary("page.html");
  write_report(make_record(), "<body><!--TOPPLE-DATA--><p>end</p></body>", path);
  const std::string page = read_file(path);
  EXPECT_THAT(page, testing::StartsWith("<body><script type=\"application/json\" id=\"topple-data\">{"));
  EXPECT_THAT(page, testing::EndsWith("}</script><p>end</p></body>"));
  EXPECT_EQ(data_of_page(page), json::parse(to_report_json(make_record())));
  std::filesystem::remove(path);
}

TEST(ReportPage, LetsNoNameCloseOrOpenATag) {
  Record r = make_record();
  r.bodies[0].name = "</script><script>alert(1)</script>";
  r.provenance.plan_text = "<!-- <script> <!--TOPPLE-DATA-->";
  const std::string path = temporary("hostile.html");
  write_report(r, "<!--TOPPLE-DATA-->", path);
  const std::string page = read_file(path);
  EXPECT_EQ(page.find('<', 1), page.rfind("</script>"));
  const json j = data_of_page(page);
  EXPECT_EQ(j["bodies"][0]["name"], r.bodies[0].name);
  EXPECT_EQ(j["provenance"]["plan_text"], r.provenance.plan_text);
  std::filesystem::remove(path);
}

TEST(ReportPage, RefusesAPageWithoutOneMarker) {
  const std::string path = temporary("refused.html");
  EXPECT_THROW(write_report(make_record(), "<body></body>", path), std::runtime_error);
  EXPECT_THROW(write_report(make_record(), "<!--TOPPLE-DATA--><!--TOPPLE-DATA-->", path), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(path));
}

TEST(ReportPage, NamesThePathItCannotWrite) {
  const std::string file = temporary("file");
  std::ofstream(file) << "not a folder";
  const std::string path = file + "/report.html";
  try {
    write_report(make_record(), "<!--TOPPLE-DATA-->", path);
    FAIL() << "wrote below a file";
  } catch (const std::runtime_error& error) { EXPECT_THAT(error.what(), testing::HasSubstr(path)); }
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace topple::record
