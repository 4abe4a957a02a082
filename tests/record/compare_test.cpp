#include "record/compare.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "../base/own_folder.h"
#include "base/error.h"
#include "base/file.h"

namespace topple::record {
namespace {

using testing::HasSubstr;

/// Two bodies of 1 and 3 t that move along x by `speed`, from `offset` on; a tilt of 0.1 rad a second times `turn`.
Record make_run(const std::string& engine, double interval, int frames, double speed, double offset, double turn) {
  Record r;
  r.provenance.engine = engine;
  r.provenance.title = "House";
  for (const auto& [name, mass] : {std::pair{"C-A1-0", 1e3}, std::pair{"S-A1B2-0", 3e3}}) {
    BodyInfo b;
    b.name = name;
    b.mass = mass;
    r.bodies.push_back(b);
  }
  r.series = {{"tilt_angle", "Tilt angle", "rad", "angle", {}}, {"own " + engine, "Own", "N", "force", {}}};
  for (int i = 0; i < frames; ++i) {
    const double t = interval * i;
    r.time.push_back(t);
    for (int b = 0; b < 2; ++b) {
      for (const double x : {offset + speed * t + b, 2.0 * b, 3.0}) r.position.push_back(static_cast<float>(x));
      for (const double q : {1.0, 0.0, 0.0, 0.0}) r.orientation.push_back(static_cast<float>(q));
    }
    r.series[0].value.push_back(0.1 * turn * t);
    r.series[1].value.push_back(1);
  }
  return r;
}

/// Positions are stored as float32.
constexpr double kSingle = 1e-6;

TEST(Compare, FindsTheDistanceOfTheSameBodiesAtTheSameInstants) {
  const Record a = make_run("native", 0.25, 9, 1, 0, 1), b = make_run("finite elements", 0.1, 31, 3, 0.5, 1);
  const Comparison c = compare(a, b);
  ASSERT_EQ(c.time.size(), 9u);
  EXPECT_EQ(c.matched, 2);
  for (size_t i = 0; i < c.time.size(); ++i) {
    // both bodies are apart by what the speeds make; where they began is told
    EXPECT_NEAR(c.rms[i], 2 * c.time[i], 8 * kSingle);
    EXPECT_NEAR(c.largest[i], 2 * c.time[i], 8 * kSingle);
    EXPECT_NEAR(c.centre[i], 0.5 + 2 * c.time[i], 8 * kSingle);
  }
  EXPECT_THAT(c.points, HasSubstr("In the first frames their origins lie up to 0.50 m apart"));
}

TEST(Compare, FollowsAPointOfBodiesWhoseMassCentresDiffer) {
  // the same body, its origin 0.4 m higher in B, turns by 0.1 rad a frame about the foot of A's
  Record a = make_run("a", 0.25, 3, 0, 0, 1), b = make_run("b", 0.25, 3, 0, 0, 1);
  for (size_t s = 0; s < 3; ++s) {
    const double angle = 0.1 * static_cast<double>(s);
    for (auto& [r, lever] : {std::pair{&a, 0.0}, std::pair{&b, 0.4}}) {
      r->position[6 * s] = static_cast<float>(lever * std::sin(angle));
      r->position[6 * s + 2] = static_cast<float>(3 + lever * std::cos(angle));
      r->orientation[8 * s] = static_cast<float>(std::cos(angle / 2));
      r->orientation[8 * s + 2] = static_cast<float>(std::sin(angle / 2));
    }
  }
  const Comparison c = compare(a, b);
  for (size_t i = 0; i < 3; ++i) EXPECT_NEAR(c.largest[i], 0, 4 * kSingle) << i;
  EXPECT_THAT(c.points, HasSubstr("up to 0.40 m apart"));
}

TEST(Compare, TiltsTowardsDifferentSidesAreNotCompared) {
  Record a = make_run("a", 0.25, 5, 0, 0, 1), b = make_run("b", 0.25, 5, 0, 0, 1);
  a.findings = b.findings = {{"touchdown.first", "", "", "", 0.8, "s"}};
  a.fall_azimuth = 3.141592653589793, b.fall_azimuth = -3.141592653589793;
  EXPECT_EQ(compare(a, b).tilt_difference, 0) << "one azimuth";
  b.fall_azimuth = 0;
  const Comparison c = compare(a, b);
  EXPECT_TRUE(std::isnan(c.tilt_difference));
  EXPECT_TRUE(std::none_of(c.series.begin(), c.series.end(), [](const SeriesPair& s) { return s.id == "tilt_angle"; }));
  EXPECT_THAT(describe(c, a, b),
              HasSubstr("Tilt: A counts it towards 180 deg, B towards 0 deg, so it is not compared"));
  const auto j = nlohmann::json::parse(to_json(c, a));
  EXPECT_NEAR(j["fall_azimuth"][0].get<double>(), 3.14159, 1e-5);
  a.fall_azimuth = std::nan("");
  EXPECT_EQ(compare(a, b).tilt_difference, 0) << "of a record that does not know";
}

TEST(Compare, WeighsByMass) {
  Record a = make_run("a", 0.25, 3, 0, 0, 1), b = a;
  b.provenance.engine = "b";
  for (size_t s = 1; s < 3; ++s) b.position[6 * s + 1] += 2;  // the light body, to the side
  const Comparison c = compare(a, b);
  EXPECT_NEAR(c.rms[1], std::sqrt(1.0 / 4 * 4), kSingle);
  EXPECT_NEAR(c.largest[1], 2, kSingle);
  EXPECT_EQ(c.farthest[1], 0);
  EXPECT_NEAR(c.centre[1], 0.5, kSingle);
}

TEST(Compare, KeepsToTheTimeThatBothHave) {
  const Comparison c = compare(make_run("a", 0.5, 11, 1, 0, 1), make_run("b", 0.5, 4, 1, 0, 1));
  EXPECT_EQ(c.time.back(), 1.5);
  Record late = make_run("b", 0.5, 4, 1, 0, 1);
  for (double& t : late.time) t += 100;
  EXPECT_THROW((void)compare(make_run("a", 0.5, 11, 1, 0, 1), late), InputError);
}

TEST(Compare, SetsSeriesOfBothBesideEachOtherBetweenFrames) {
  const Comparison c = compare(make_run("a", 0.25, 9, 1, 0, 1), make_run("b", 0.1, 31, 1, 0, 0.8));
  ASSERT_EQ(c.series.size(), 1u);  // the other series has no counterpart
  for (size_t i = 0; i < c.time.size(); ++i) {
    EXPECT_NEAR(c.series[0].a[i], 0.1 * c.time[i], 1e-15);
    EXPECT_NEAR(c.series[0].b[i], 0.08 * c.time[i], 1e-15);  // straight, so that interpolation is exact
  }
}

TEST(Compare, JudgesTheTiltUpToTheEarlierTouchdown) {
  Record a = make_run("a", 0.25, 9, 1, 0, 1), b = make_run("b", 0.25, 9, 1, 0, 0.9);
  a.findings.push_back({"touchdown.first", "", "", "", 1.5, "s", Status::Info});
  b.findings.push_back({"touchdown.first", "", "", "", 1.75, "s", Status::Info});
  const Comparison c = compare(a, b);
  EXPECT_EQ(c.until, 1.5);
  EXPECT_NEAR(c.tilt_difference, 0.01 * 1.5, 1e-15);
  EXPECT_NEAR(c.tilt_share, 0.1, 1e-12);
  EXPECT_THAT(describe(c, a, b), HasSubstr("A 1.50 s, B 1.75 s, difference +0.250 s"));
}

TEST(Compare, OfARecordThatEndsEarlierSaysUpToWhen) {
  Record a = make_run("a", 0.25, 9, 1, 0, 1), b = make_run("b", 0.25, 3, 1, 0, 1);
  a.findings.push_back({"touchdown.first", "", "", "", 1.5, "s", Status::Info});
  b.findings.push_back({"touchdown.first", "", "", "", std::nan(""), "s", Status::Info});
  a.events = {{1.5, "touchdown", "C-A1-0", ""}};
  const Comparison c = compare(a, b);
  EXPECT_THAT(describe(c, a, b), HasSubstr("of the upper block: A 1.50 s, B not up to 0.50 s."));
  EXPECT_THAT(describe(c, a, b), HasSubstr("A   1.50 s  B not up to 0.50 s\n"));
  EXPECT_EQ(nlohmann::json::parse(to_json(c, a))["end"], (nlohmann::json{2.0, 0.5}));
}

TEST(Compare, OfNoTiltKnowsNoDifference) {
  Record a = make_run("a", 0.25, 5, 1, 0, 1), b = make_run("b", 0.25, 5, 1, 0, 1);
  const auto expect_none = [&] {
    const Comparison c = compare(a, b);
    EXPECT_THAT(describe(c, a, b), HasSubstr("Tilt up to 1.00 s: not known of both."));
    EXPECT_TRUE(nlohmann::json::parse(to_json(c, a))["tilt_difference"].is_null());
    EXPECT_TRUE(nlohmann::json::parse(to_json(c, a))["tilt_time"].is_null());
  };
  for (double& v : b.series[0].value) v = std::nan("");
  expect_none();
  std::erase_if(b.series, [](const Series& s) { return s.id == "tilt_angle"; });
  expect_none();
}

TEST(Compare, FindsTheLeanOfAllBodiesOfBoth) {
  // four bodies in a tetrahedron; those of A turn about y by 0.2 rad a second, those of B about x by half of it; all
  // fall
  Record a = make_run("a", 0.25, 5, 0, 0, 1), b = make_run("b", 0.25, 5, 0, 0, 1);
  const Vec3 corner[] = {{0, 0, 0}, {2, 0, 0}, {0, 3, 0}, {0, 0, 4}};
  for (Record* r : {&a, &b}) {
    r->bodies.resize(4, r->bodies[0]);
    r->position.clear(), r->orientation.clear();
    for (int i = 0; i < 4; ++i) r->bodies[static_cast<size_t>(i)].name = "body " + std::to_string(i);
    for (const double t : r->time)
      for (const Vec3& p : corner) {
        const Mat3 R = to_matrix(exp_rotation(r == &a ? Vec3{0, 0.2 * t, 0} : Vec3{0.1 * t, 0, 0}));
        const Vec3 x = R * p + Vec3{0, 0, -t};
        for (const double v : {x.x, x.y, x.z}) r->position.push_back(static_cast<float>(v));
        for (const double q : {1.0, 0.0, 0.0, 0.0}) r->orientation.push_back(static_cast<float>(q));
      }
  }
  const Comparison c = compare(a, b);
  const SeriesPair& lean = c.series.back();
  EXPECT_EQ(lean.id, "lean_compared");
  for (size_t i = 0; i < c.time.size(); ++i) {
    EXPECT_NEAR(lean.a[i], 0.2 * c.time[i], 4 * kSingle);
    EXPECT_NEAR(lean.b[i], 0.1 * c.time[i], 4 * kSingle);
    // of two axes at right angles to each other in plan
    EXPECT_NEAR(std::cos(c.lean_apart[i]), std::cos(0.2 * c.time[i]) * std::cos(0.1 * c.time[i]), 4 * kSingle);
  }
  EXPECT_THAT(describe(c, a, b),
              HasSubstr("At 1.00 s all bodies compared lean by 11.46 deg in A, 5.73 deg in B: 12.79 deg apart.\nThey "
                        "lean towards 0 deg in A, 270 deg in B.\nLeans up to 1.00 s: at most 12.79 deg apart."));
}

TEST(Compare, PairsTouchdownsByBody) {
  Record a = make_run("a", 0.25, 9, 1, 0, 1), b = make_run("b", 0.25, 9, 1, 0, 1);
  a.events = {{1.0, "touchdown", "S-A1B2-0", ""}, {1.2, "touchdown", "S-A1B2-0", ""}};
  b.events = {{0.5, "touchdown", "C-A1-0", ""}, {1.1, "touchdown", "S-A1B2-0", ""}};
  const Comparison c = compare(a, b);
  ASSERT_EQ(c.touchdowns.size(), 2u);
  EXPECT_EQ(c.touchdowns[0].body, "C-A1-0");
  EXPECT_TRUE(std::isnan(c.touchdowns[0].a));
  EXPECT_EQ(c.touchdowns[1].a, 1.0);
  EXPECT_EQ(c.touchdowns[1].b, 1.1);
}

TEST(Compare, OfUnlikeBodiesKeepsToMassCentresAndSaysSo) {
  Record a = make_run("a", 0.25, 3, 1, 0, 1), b = make_run("b", 0.25, 3, 1, 2, 1);
  b.bodies[0].name = "piece 1", b.bodies[1].name = "piece 2";
  const Comparison c = compare(a, b);
  EXPECT_EQ(c.matched, 0);
  EXPECT_THAT(c.points, HasSubstr("no body in common"));
  EXPECT_TRUE(std::isnan(c.rms[0]));
  EXPECT_NEAR(c.centre[2], 2, 4 * kSingle);
}

TEST(Compare, QuotesNamesInItsTable) {
  Record a = make_run("a", 0.25, 3, 1, 0, 1), b = make_run("b", 0.25, 3, 3, 0, 1);
  for (Record* r : {&a, &b}) r->bodies[0].name = "C, \"1\"";
  EXPECT_THAT(to_csv(compare(a, b), a), HasSubstr(",\"C, \"\"1\"\"\",0.5,\r\n"));
}

TEST(Compare, WritesTablesThatHoldTheNumbers) {
  const Record a = make_run("a", 0.25, 3, 1, 0, 1);
  Record b = make_run("a", 0.25, 3, 3, 0, 1);
  b.series.pop_back();
  const Comparison c = compare(a, b);
  EXPECT_EQ(c.name_a, "a (first)");
  const std::string csv = to_csv(c, a);
  EXPECT_THAT(csv,
              testing::StartsWith("time [s],tilt_angle A [rad],tilt_angle B [rad],tilt_angle B - A [rad],distance"));
  EXPECT_THAT(csv, HasSubstr("\r\n0.25,0.025,0.025,0,0.5,0.5,C-A1-0,0.5,\r\n"));
  const auto j = nlohmann::json::parse(to_json(c, a));
  EXPECT_EQ(j["format"], "topple-comparison");
  EXPECT_EQ(j["series"][0]["b"][2], 0.05);
  EXPECT_TRUE(j["touchdown"][0].is_null());
}

TEST(Compare, NamesRecordsOfOneEngineByTheirFiles) {
  const auto apart = [](const char* a, const char* b) { return tell_files_apart(a, b); };
  using Names = std::pair<std::string, std::string>;
  EXPECT_EQ(apart("left/record.h5", "right/record.h5"), Names("left", "right"));
  EXPECT_EQ(apart("left/out/record.h5", "right/./out/record.h5"), Names("left", "right"));
  EXPECT_EQ(apart("out/v1.5.h5", "out/v1.6.h5"), Names("v1.5", "v1.6"));
  EXPECT_EQ(apart("out/run.h5", "out/run.hdf5"), Names("run.h5", "run.hdf5"));
  EXPECT_EQ(apart("out/../left/record.h5", "left/record.h5"), Names());
  EXPECT_EQ(apart("", "left/record.h5"), Names());
  const Record a = make_run("native", 0.25, 3, 1, 0, 1), b = make_run("native", 0.25, 3, 1, 0.5, 1);
  const Comparison c = compare(a, b, "left/record.h5", "right/record.h5");
  EXPECT_EQ(c.name_a, "native (left)");
  EXPECT_EQ(c.name_b, "native (right)");
  const Record other = make_run("finite elements", 0.25, 3, 1, 0.5, 1);
  EXPECT_EQ(compare(a, other, "left/record.h5", "right/record.h5").name_b, "finite elements");
}

TEST(Compare, SaysThatTitlesDifferWhereItIsRead) {
  const Record a = make_run("a", 0.25, 3, 1, 0, 1);
  Record b = make_run("b", 0.25, 3, 1, 0.5, 1);
  EXPECT_TRUE(nlohmann::json::parse(to_json(compare(a, b), a))["note"].is_null());
  EXPECT_EQ(describe(compare(a, b), a, b).find("one building"), std::string::npos);
  b.provenance.title = "Another";
  const std::string note = "A is of \"House\", B of \"Another\": see that both are of one building.";
  const Comparison c = compare(a, b);
  EXPECT_THAT(describe(c, a, b), HasSubstr("\n" + note + "\n"));
  const auto j = nlohmann::json::parse(to_json(c, a));
  EXPECT_EQ(j["note"], note);
  EXPECT_EQ(j["titles"], (nlohmann::json{"House", "Another"}));
}

TEST(Compare, WritesNoMinusZero) {
  Record a = make_run("a", 0.25, 3, 1, 0, 1), b = make_run("b", 0.25, 3, 1, 0, 1);
  a.series[0].value[0] = b.series[0].value[0] = -0.0;
  EXPECT_THAT(to_csv(compare(a, b), a), HasSubstr("\r\n0,0,0,0,0,0,,0,\r\n"));
}

TEST(Compare, TellsNoTiltOfABlockBesideThatOfAllBodies) {
  Record a = make_run("a", 0.25, 5, 1, 0, 1), b = make_run("b", 0.25, 5, 1, 0, 0.9);
  EXPECT_THAT(describe(compare(a, b), a, b), HasSubstr("  0.25       1.43     1.29"));
  a.findings.push_back({"touchdown.first", "", "", "", 0.75, "s", Status::Info});
  const std::string text = describe(compare(a, b), a, b);
  EXPECT_THAT(text, HasSubstr("  0.25          -        -"));
  EXPECT_THAT(text, HasSubstr("\nTilt up to 0.75 s: not known of both.\n"));
}

TEST(Compare, TellsNoTiltOfABlockThatHasBrokenUp) {
  Record a = make_run("a", 0.25, 5, 1, 0, 1), b = make_run("b", 0.25, 5, 1, 0, 0.9);
  a.series.push_back({"connected_share", "", "1", "", {1, 1, 1, 0.5, 0.4}});
  b.series.push_back({"connected_share", "", "1", "", {1, 1, 0.4, 0.4, 0.6}});
  const std::string text = describe(compare(a, b), a, b);
  EXPECT_THAT(text, HasSubstr("  0.25       1.43     1.29"));
  EXPECT_THAT(text, HasSubstr("  0.50       2.86        -"));
  EXPECT_THAT(text, HasSubstr("  0.75       4.30        -"));
  EXPECT_THAT(text, HasSubstr("  1.00          -        -"));
  EXPECT_THAT(
      text,
      HasSubstr(
          "\nTilt: A ends at 1.00 s, B ends at 0.50 s, when less than half of the upper block holds together.\n"));
}

TEST(Compare, PrintsNoNumberWhereThereIsNone) {
  Record a = make_run("a", 0.25, 3, 1, 0, 1), b = make_run("b", 0.25, 3, 1, 2, 1);
  b.bodies[0].name = "piece 1", b.bodies[1].name = "piece 2";
  b.series.clear();
  const std::string text = describe(compare(a, b), a, b);
  EXPECT_EQ(text.find("nan"), std::string::npos) << text;
  EXPECT_THAT(
      text, HasSubstr("  0.00          -        -          -          -         -         -            -        -\n"));
}

class Photos : public testing::Test {
 protected:
  std::string write(const std::string& name, const std::string& text) const {
    replace_file(folder / name, text);
    return folder / name;
  }
  OwnFolder folder;
};

TEST_F(Photos, AreReadFromATableBesideThem) {
  write("one.png", "\x89PNG\r\n");
  write("two.jpg", "\xff\xd8\xff\xe0");
  const auto photos = read_photos(write("table.csv", "time,file\n# the first\n0.5,one.png\r\n\n1.25, two.jpg\n"));
  ASSERT_EQ(photos.size(), 2u);
  EXPECT_EQ(photos[0].time, 0.5);
  EXPECT_EQ(photos[0].data, "data:image/png;base64,iVBORw0K");
  EXPECT_EQ(photos[1].name, "two.jpg");
  EXPECT_THAT(photos[1].data, testing::StartsWith("data:image/jpeg;"));
}

TEST_F(Photos, ThatAreWrongAreRefusedWithTheirLine) {
  write("text.png", "not a picture");
  for (const char* line : {"1.25 one.png", "soon,one.png", "nan,text.png", "inf,text.png", "1e999,text.png",
                           "1,missing.png", "1,text.png", "1,\"text.png", "1,text.png,2"}) {
    const std::string table = write("table.csv", std::string("time,file\n") + line + "\n");
    try {
      (void)read_photos(table);
      FAIL() << line;
    } catch (const InputError& e) {
      EXPECT_EQ(e.diagnostics()[0].code, "E681");
      EXPECT_EQ(e.diagnostics()[0].where.line, 2) << line;
    }
  }
}

TEST_F(Photos, OfATableWithoutOneAreRefused) {
  for (const char* text : {"", "time,file\n", "# none\n\n"}) {
    try {
      (void)read_photos(write("table.csv", text));
      ADD_FAILURE() << text;
    } catch (const InputError& e) { EXPECT_THAT(e.diagnostics()[0].message, HasSubstr("names no picture")) << text; }
  }
}

TEST_F(Photos, ThatAreMissingAreSaidToBeSoHoweverTheTableIsNamed) {
  namespace fs = std::filesystem;
  write("table.csv", "1,none.png\n");
  const fs::path before = fs::current_path();
  for (const char* table : {"table.csv", "./table.csv"}) {
    fs::current_path(folder.path());
    try {
      (void)read_photos(table);
      ADD_FAILURE() << table;
    } catch (const InputError& e) { EXPECT_EQ(e.diagnostics()[0].message, "none.png is not there") << table; }
    fs::current_path(before);
  }
}

TEST_F(Photos, AreReadFromTablesOfSpreadsheets) {
  write("a, \"b\".png", "\x89PNG\r\n");
  const auto photos = read_photos(write(
      "table.csv", "\xEF\xBB\xBF\"time\",\"file\"\r\n\"0.5\",\"a, \"\"b\"\".png\"\r\n 1 , \"a, \"\"b\"\".png\" \r\n"));
  ASSERT_EQ(photos.size(), 2u);
  EXPECT_EQ(photos[0].name, "a, \"b\".png");
  EXPECT_EQ(photos[1].time, 1);
  write("c, d.png", "\x89PNG\r\n");
  EXPECT_EQ(read_photos(write("table.csv", "2,c, d.png\n")).at(0).name, "c, d.png") << "without quotes";
}

TEST_F(Photos, OutsideOfTheFolderAreRefused) {
  namespace fs = std::filesystem;
  write("outside.png", "\x89PNG\r\n");
  write("in/below/one.png", "\x89PNG\r\n");
  const fs::path outside = folder / "outside.png";
  fs::create_symlink(outside, folder / "in/link.png");
  fs::create_symlink("below/one.png", folder / "in/inner.png");
  for (const std::string& name : {std::string("../outside.png"), outside.string(), std::string("link.png"),
                                  std::string("below/../../outside.png")}) {
    try {
      (void)read_photos(write("in/table.csv", "1," + name + "\n"));
      ADD_FAILURE() << name;
    } catch (const InputError& e) {
      EXPECT_EQ(e.diagnostics()[0].code, "E681");
      EXPECT_EQ(e.diagnostics()[0].where.column, 3);
      EXPECT_THAT(e.diagnostics()[0].message, HasSubstr("outside of the table's folder")) << name;
    }
  }
  EXPECT_EQ(read_photos(write("in/table.csv", "1,below/one.png\n2,inner.png\n3,below/../inner.png\n")).size(), 3u);
}

}  // namespace
}  // namespace topple::record
