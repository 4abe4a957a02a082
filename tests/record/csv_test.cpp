#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>

#include "base/file.h"
#include "record/record.h"
#include "sample.h"

namespace topple::record {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;
using Rows = std::vector<std::vector<std::string>>;

/// Reads the grammar of RFC 4180, section 2, strictly.
Rows parse(const std::string& text) {
  Rows rows;
  std::size_t i = 0;
  while (i < text.size()) {
    rows.emplace_back();
    for (;;) {
      std::string field;
      if (text[i] == '"') {
        for (++i; text.at(i) != '"' || (i + 1 < text.size() && text[i + 1] == '"'); ++i) {
          if (text[i] == '"') ++i;
          field += text[i];
        }
        ++i;
      } else {
        for (; text.at(i) != ',' && text[i] != '\r'; ++i) {
          EXPECT_TRUE(text[i] != '"' && text[i] != '\n') << "needs quotes";
          field += text[i];
        }
      }
      rows.back().push_back(field);
      if (text.at(i) != ',') break;
      ++i;
    }
    EXPECT_EQ(text.substr(i, 2), "\r\n");
    i += 2;
  }
  return rows;
}

class Csv : public testing::Test {
 protected:
  Csv() : folder_(fs::path(testing::TempDir()) / ("topple_csv_" + std::to_string(getpid()))) {}
  ~Csv() override { fs::remove_all(folder_); }
  Rows rows(const std::string& name) const { return parse(read_file(folder_ / name)); }

  fs::path folder_;
};

TEST_F(Csv, WritesFourFilesIntoAMissingFolder) {
  write_csv(make_sample(), folder_ / "deep/er");
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder_ / "deep/er")) names.push_back(entry.path().filename());
  EXPECT_THAT(names, testing::UnorderedElementsAre("series.csv", "events.csv", "bodies.csv", "findings.csv"));
}

TEST_F(Csv, SeriesStandInColumnsBesideTheTime) {
  const Record r = make_sample();
  write_csv(r, folder_);
  const Rows table = rows("series.csv");
  ASSERT_EQ(table.size(), r.time.size() + 1);
  EXPECT_THAT(table[0], ElementsAre("time [s]", "tilt_angle [rad]", "energy/kinetic [J]"));
  for (std::size_t s = 0; s < r.time.size(); ++s) {
    ASSERT_EQ(table[s + 1].size(), 3u);
    // written with as many digits as bring the same bits back
    EXPECT_EQ(std::strtod(table[s + 1][0].c_str(), nullptr), r.time[s]);
    EXPECT_EQ(std::strtod(table[s + 1][1].c_str(), nullptr), r.series[0].value[s]);
    if (std::isnan(r.series[1].value[s]))
      EXPECT_EQ(table[s + 1][2], "");
    else
      EXPECT_EQ(std::strtod(table[s + 1][2].c_str(), nullptr), r.series[1].value[s]);
  }
}

TEST_F(Csv, QuotesCommasQuotesAndLineBreaks) {
  Record r;
  r.events = {{0.25, "yield", "C-A1-0, foot", "says \"crack\"\r\nand\nbends"}, {1, "plain", "", "größer"}};
  write_csv(r, folder_);
  EXPECT_EQ(read_file(folder_ / "events.csv"),
            "time [s],kind,subject,text\r\n"
            "0.25,yield,\"C-A1-0, foot\",\"says \"\"crack\"\"\r\nand\nbends\"\r\n"
            "1,plain,,größer\r\n");
  EXPECT_THAT(rows("events.csv")[1], ElementsAre("0.25", "yield", "C-A1-0, foot", "says \"crack\"\r\nand\nbends"));
}

TEST_F(Csv, BodiesShowWhereTheyStartAndEnd) {
  Record r;
  r.bodies.resize(2);
  r.bodies[0] = {"C-A1-0", "column", 0, 2500.5, false, {}};
  r.bodies[1] = {"G", "stump", -1, 0, true, {}};
  r.time = {0, 1, 2};
  r.position = {1, 2, 3, 0, 0, 0, 9, 9, 9, 0, 0, 0, 4, 5.5, 0.1F, 0, 0, 0};
  write_csv(r, folder_);
  EXPECT_EQ(read_file(folder_ / "bodies.csv"),
            "name,kind,storey,mass [kg],fixed,start x [m],start y [m],start z [m],end x [m],end y [m],end z [m]\r\n"
            "C-A1-0,column,0,2500.5,0,1,2,3,4,5.5,0.1\r\n"
            "G,stump,-1,0,1,0,0,0,0,0,0\r\n");
}

TEST_F(Csv, BodiesWithoutFramesHaveNoPlace) {
  Record r;
  r.bodies.resize(1);
  r.bodies[0] = {"a", "node", 2, 1, false, {}};
  write_csv(r, folder_);
  EXPECT_THAT(rows("bodies.csv")[1], ElementsAre("a", "node", "2", "1", "0", "", "", "", "", "", ""));
}

TEST_F(Csv, FindingsNameTheirStatusAndLeaveNoNumberEmpty) {
  write_csv(make_sample(), folder_);
  const Rows table = rows("findings.csv");
  ASSERT_EQ(table.size(), 5u);
  EXPECT_THAT(table[1], ElementsAre("mechanism", "Mechanism", "Mechanism", "The building topples to 12°.", "0.21",
                                    "rad", "good"));
  EXPECT_THAT(table[2], ElementsAre("reach", "Debris", "Reach", "", "", "", "bad"));
  EXPECT_EQ(table[4].back(), "not_judged");
}

TEST_F(Csv, EachOutputIsATableOfItsOwn) {
  write_output_csv(make_sample(), folder_ / "run");
  EXPECT_EQ(read_file(folder_ / "run/outputs/reaction [top].csv"),
            "time [s],x [N],y [N],z [N]\r\n0,1,0,\r\n0.25,inf,5,6\r\n");
  EXPECT_EQ(read_file(folder_ / "run/outputs/empty.csv"), "time [s],force [N]\r\n");
  EXPECT_EQ(read_file(folder_ / "run/outputs/tilt.csv"), "time [s],w [1],x [1],y [1],z [1]\r\n0,1,0,0,0\r\n");
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_ / "run/outputs"), {}), 4);
  Record wrong = make_sample();
  wrong.outputs[1].time.push_back(1);
  EXPECT_THROW(write_output_csv(wrong, folder_), std::logic_error);
}

TEST_F(Csv, AnEmptyRecordGivesHeadingsAlone) {
  write_csv({}, folder_);
  for (const auto* name : {"series.csv", "events.csv", "bodies.csv", "findings.csv"})
    EXPECT_EQ(rows(name).size(), 1u) << name;
}

TEST_F(Csv, NamesThePathThatCannotBeWritten) {
  replace_file(folder_ / "plain", "x");
  EXPECT_THAT([&] { write_csv({}, folder_ / "plain"); },
              ThrowsMessage<std::runtime_error>(HasSubstr((folder_ / "plain/series.csv").string())));
}

TEST_F(Csv, RefusesSeriesThatDoNotFitTheFrames) {
  Record r = make_sample();
  r.series[0].value.pop_back();
  EXPECT_THROW(write_csv(r, folder_), std::logic_error);
}

}  // namespace
}  // namespace topple::record
