#include "record/rcc_page.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

namespace topple::record {
namespace {

RccCurve sample_curve(char axis, int direction, double N) {
  RccCurve c;
  c.axis = axis, c.direction = direction, c.normal_force = N;
  c.rotation = {0, 0.002, 0.006, 0.02};
  c.moment = {0, 3e5, 5e5 + 0.1 * N, 2e5};
  c.yield = {0.002, 3e5}, c.peak = {0.006, c.moment[2]}, c.ultimate = {0.01, 4e5}, c.residual = {0.02, 2e5};
  c.end = {0.02, 2e5};
  c.stiffness_uncracked = 2e8, c.stiffness_effective = 7.5e7;
  c.ending = "ends, \"so\" to say";
  return c;
}

RccReport sample_report() {
  RccReport r;
  r.title = "Column <1> & co", r.source = "section.toml", r.sha256 = std::string(64, 'a'), r.program_version = "9.9.9";
  r.zone = "zone of 0.5 m";
  r.width = 0.4, r.height = 0.5, r.length = 0.5;
  r.inputs = {{"Concrete", "fc", "25 N/mm2"}};
  for (const char axis : {'y', 'z'})
    for (const int direction : {1, -1}) {
      for (const double N : {0.0, 1e6}) r.curves.push_back(sample_curve(axis, direction, N));
      r.interactions.push_back({"layered", axis, direction, {-1e6, 0, 5e6}, {0, 3e5, 0}, {0, 5e5, 0}});
    }
  RccCurve none;
  none.normal_force = 9e6;
  none.ending = "cannot be carried";
  r.curves.push_back(none);
  r.biaxial.push_back({1e6, {6e5, 4e5, 0}, {0, 4e5, 6e5}});
  r.biaxial_exponent = 1.71;
  r.axial.push_back({"layered", {-0.01, 0, 0.001, 0.01}, {-1e6, 0, 5e6, 2e6}});
  RccState s;
  s.point = "peak", s.normal_force = 1e6, s.rotation = 0.006, s.moment = 6e5, s.eps_0 = -2e-4, s.curvature = 0.012;
  s.layers = {{-0.25, -0.2, 0, 0.4, -2.5e-3, 0, -20e6, "", "crushing"},
              {-0.2, 0.2, 0.3, 0.1, -2e-4, -6e6, -6e6, "compressed", "compressed"},
              {0.2, 0.25, 0, 0.4, 2e-3, 0, 0, "", "open crack"}};
  s.bars = {{0.1, 0.2, 0.02, 2.1e-3, 420e6, "yields in tension"}, {0.1, -0.2, 0.02, -2e-3, -400e6, "elastic"}};
  r.states.push_back(s);
  r.families.push_back({'y', 1, {-1e6, 5e6}, {0, 0.1}, {0, 0, 0, 0}});
  r.notes = {"A note <b>."};
  r.not_modelled = {"Slip & more."};
  return r;
}

std::vector<std::vector<std::string>> parse_csv(const std::string& text) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_EQ(line.back(), '\r');
    line.pop_back();
    rows.push_back({""});
    bool is_quoted = false;
    for (size_t i = 0; i < line.size(); ++i) {
      if (line[i] == '"' && is_quoted && i + 1 < line.size() && line[i + 1] == '"') {
        rows.back().back() += '"', ++i;
      } else if (line[i] == '"') {
        is_quoted = !is_quoted;
      } else if (line[i] == ',' && !is_quoted) {
        rows.back().push_back("");
      } else {
        rows.back().back() += line[i];
      }
    }
  }
  return rows;
}

TEST(RccFiles, TablesHoldWhatTheReportHolds) {
  const RccReport r = sample_report();
  for (const std::string& text :
       {points_csv(r), curves_csv(r), interaction_csv(r), biaxial_csv(r), axial_csv(r), states_csv(r)}) {
    const auto rows = parse_csv(text);
    for (const auto& row : rows) EXPECT_EQ(row.size(), rows[0].size()) << text.substr(0, 60);
  }
  const auto points = parse_csv(points_csv(r));
  ASSERT_EQ(points.size(), 1 + r.curves.size());
  EXPECT_EQ(points[1][16], "ends, \"so\" to say");
  EXPECT_EQ(std::stod(points[2][3]), 1e6);
  EXPECT_EQ(points.back()[6], "") << "no yield without a curve";
  const auto curves = parse_csv(curves_csv(r));
  ASSERT_EQ(curves.size(), 1u + 8 * 4);
  EXPECT_EQ(std::stod(curves[3][4]), 0.006);
  EXPECT_EQ(std::stod(curves[3][5]), 5e5);
  EXPECT_EQ(parse_csv(states_csv(r)).size(), 1u + 4 + 2) << "three layers, one of them with core and cover, two bars";
}

TEST(RccFiles, JsonHoldsTheNumbersExactly) {
  RccReport r = sample_report();
  r.curves[0].moment[1] = 1.0 / 3;
  const auto j = nlohmann::json::parse(to_json(r));
  EXPECT_EQ(j["format"], "topple-rcc");
  EXPECT_EQ(j["curves"].size(), r.curves.size());
  EXPECT_EQ(j["curves"][0]["moment"][1].get<double>(), 1.0 / 3);
  EXPECT_TRUE(j["curves"].back()["yield"]["moment"].is_null());
  EXPECT_EQ(j["states"][0]["bars"][0]["condition"], "yields in tension");
  EXPECT_FALSE(j["states"][0]["layers"][0].contains("core")) << "cover alone";
  EXPECT_EQ(j["provenance"]["sha256"], r.sha256);
}

TEST(RccFiles, EqualCurvesStandTogether) {
  RccReport r = sample_report();
  auto groups = group_curves(r);
  ASSERT_EQ(groups.size(), 3u);
  EXPECT_EQ(groups[0].about, "+y -y +z -z");
  r.curves[2].moment[2] *= 1.01;  // about -y at N = 0
  groups = group_curves(r);
  ASSERT_EQ(groups.size(), 4u);
  EXPECT_EQ(groups[0].about, "+y +z -z");
}

TEST(RccPage, StandsAloneAndSaysEverything) {
  const RccReport r = sample_report();
  const std::vector<Figure> figures = make_figures(r);
  const std::string page = to_page(r, figures);
  for (const char* outside : {"http:", "https:", "<script", "src=", "@import", "<link", "url("})
    EXPECT_EQ(page.find(outside), std::string::npos) << outside;
  for (const char* text : {"Column &lt;1&gt; &amp; co", "zone of 0.5 m", "A note &lt;b&gt;.", "Slip &amp; more.",
                           "9.9.9", "section.toml", "Not modelled", "cannot be carried", "residual", "crushing",
                           "@media print", "prefers-color-scheme:dark", "Table of values", "25 N/mm2", "p = 1.71"})
    EXPECT_NE(page.find(text), std::string::npos) << text;
  EXPECT_NE(page.find(r.sha256), std::string::npos);
  EXPECT_EQ(page.find("<1>"), std::string::npos) << "a title cannot make tags";
  for (const Figure& f : figures) EXPECT_NE(page.find("id=\"" + f.id + "\""), std::string::npos) << f.id;
  EXPECT_EQ(page.find("nan"), std::string::npos);
}

TEST(RccPage, KeepsHeadingsWithWhatFollowsThemOnPaper) {
  const std::string head = page_head("");
  EXPECT_NE(head.find("h2,h3{break-after:avoid}", head.find("@media print")), std::string::npos);
}

TEST(RccPage, HasEveryPlotOnceWithItsTable) {
  const std::vector<Figure> figures = make_figures(sample_report());
  std::set<std::string> ids;
  for (const Figure& f : figures) {
    EXPECT_TRUE(ids.insert(f.id).second) << f.id << " twice";
    EXPECT_FALSE(f.drawing.title.empty()) << f.id;
    EXPECT_FALSE(f.caption.empty()) << f.id;
    if (f.id == "interaction_y") {
      const std::string svg = to_svg(f.drawing);
      EXPECT_NE(svg.find("largest moment (peak)"), std::string::npos);
      EXPECT_EQ(svg.find("ultimate"), std::string::npos) << "which lies behind the peak";
    }
    if (f.id == "axial") continue;  // its table stands beside the whole curve
    EXPECT_FALSE(f.table.rows.empty()) << f.id;
    for (const auto& row : f.table.rows) EXPECT_EQ(row.size(), f.table.heads.size()) << f.id;
  }
  for (const char* id :
       {"moment_y", "moment_z", "interaction_y", "interaction_z", "axial", "axial_whole", "section_y_pos_2"})
    EXPECT_TRUE(ids.count(id)) << id;
}

TEST(RccPage, ManyForcesCanBeToldApart) {
  RccReport r = sample_report();
  r.curves.clear();
  for (int i = 0; i < 50; ++i) r.curves.push_back(sample_curve('y', 1, 1e5 * i));
  std::set<std::pair<size_t, std::vector<double>>> seen;
  for (size_t k = 0; k < 50; ++k) EXPECT_TRUE(seen.insert({k % 6, dash_of(k)}).second) << k;
  const std::vector<Figure> figures = make_figures(r);
  std::set<std::pair<int, std::vector<double>>> drawn;
  for (const Shape& s : figures.front().drawing.shapes)
    if (s.kind == Shape::Kind::Line && s.dots.size() == 4) drawn.insert({static_cast<int>(s.stroke), s.dash});
  EXPECT_GE(drawn.size(), 50u);
}

TEST(RccPage, EndsOfUnsymmetricSectionsAreDrawnWhereTheyAre) {
  RccReport r = sample_report();
  r.interactions = {{"layered", 'y', 1, {-1e6, 0, 5e6}, {std::nan(""), 3e5, std::nan("")}, {-1e5, 5e5, 2e5}},
                    {"layered", 'y', -1, {-1e6, 0, 5e6}, {std::nan(""), 3e5, std::nan("")}, {1e5, 5e5, -2e5}}};
  for (const Figure& f : make_figures(r))
    if (f.id == "interaction_y") {
      EXPECT_NE(f.caption.find("without a moment"), std::string::npos);
      EXPECT_EQ(f.table.rows.back()[1], "-");
      EXPECT_EQ(f.table.rows.back()[4], "-200");
      EXPECT_EQ(to_svg(f.drawing).find("nan"), std::string::npos);
    }
}

TEST(RccPage, PicturesHoldSectionsOfAnyShape) {
  for (const auto& [width, height] : {std::pair{0.3, 1.5}, {1.5, 0.3}, {5.0, 0.2}}) {
    RccReport r = sample_report();
    r.width = width, r.height = height;
    for (const char axis : {'y', 'z'}) {
      r.states[0].axis = axis;
      const double depth = axis == 'y' ? height : width, breadth = axis == 'y' ? width : height;
      r.states[0].layers = {
          {-0.5 * depth, 0.5 * depth, 0.8 * breadth, 0.2 * breadth, 1e-3, 0, 0, "cracked", "cracked"}};
      r.states[0].bars = {{0.45 * width, 0.45 * height, 0.02, 1e-3, 2e8, "elastic"}};
      for (const Figure& f : make_figures(r))
        for (const Shape& s : f.drawing.shapes)
          for (const Dot& at : s.dots) {
            EXPECT_GE(at.x, 0) << f.id;
            EXPECT_LE(at.x, f.drawing.width) << f.id;
            EXPECT_GE(at.y, 0) << f.id;
            EXPECT_LE(at.y, f.drawing.height) << f.id;
          }
    }
  }
}

TEST(RccPage, NumbersForPeopleKeepTheirDigits) {
  EXPECT_EQ(shown(498512.3, 1e3), "498.5");
  EXPECT_EQ(shown(0.0024789, 1e-3), "2.479");
  EXPECT_EQ(shown(2.9e6, 1e6), "2.9");
  EXPECT_EQ(shown(0, 1), "0");
  EXPECT_EQ(shown(123456, 1), "123456");
  EXPECT_EQ(shown(std::nan(""), 1), "-");
  EXPECT_EQ(shown(-0.5, 1), "-0.5");
}

}  // namespace
}  // namespace topple::record
