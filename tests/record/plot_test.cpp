#include "record/plot.h"

#include <gtest/gtest.h>

#include <cmath>

namespace topple::record {
namespace {

using Numbers = std::vector<double>;

int count(const std::string& text, const std::string& what) {
  int n = 0;
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++n;
  return n;
}

TEST(Plot, TicksAreRoundAndInside) {
  EXPECT_EQ(find_ticks(0, 10, 5), (Numbers{0, 2, 4, 6, 8, 10}));
  EXPECT_EQ(find_ticks(0, 100, 4), (Numbers{0, 25, 50, 75, 100}));
  EXPECT_EQ(find_ticks(-1, 1, 4), (Numbers{-1, -0.5, 0, 0.5, 1}));
  for (const auto& [low, high] : {std::pair{-3.7e-5, 9.1e-4}, {12345.6, 12346.1}, {-8e9, 3e9}, {0.0, 0.3}}) {
    const Numbers t = find_ticks(low, high, 6);
    EXPECT_GE(t.size(), 2u);
    EXPECT_LE(t.size(), 8u);
    const double step = t[1] - t[0];
    EXPECT_GE(t.front(), low - 1e-6 * step);
    EXPECT_LE(t.back(), high + 1e-6 * step);
  }
}

TEST(Plot, TicksHaveTheDecimalsOfTheirStep) {
  EXPECT_EQ(tick_text(0.25, 0.25), "0.25");
  EXPECT_EQ(tick_text(0.5, 0.25), "0.50");
  EXPECT_EQ(tick_text(2000, 500), "2000");
  EXPECT_EQ(tick_text(-1.5, 0.5), "-1.5");
  EXPECT_EQ(tick_text(1e-17, 0.1), "0");
}

TEST(Plot, LinesEndAtTheBox) {
  const auto one = clip_line({{-1, 0.5}, {3, 0.5}}, {0, 0}, {2, 1});
  ASSERT_EQ(one.size(), 1u);
  EXPECT_DOUBLE_EQ(one[0][0].x, 0);
  EXPECT_DOUBLE_EQ(one[0][1].x, 2);
  const auto two = clip_line({{0.5, 0.5}, {0.5, 2}, {1, 2}, {1, 0.5}}, {0, 0}, {2, 1});
  ASSERT_EQ(two.size(), 2u) << "it leaves the box and comes back";
  EXPECT_DOUBLE_EQ(two[0].back().y, 1);
  EXPECT_DOUBLE_EQ(two[1].front().y, 1);
  const auto whole = clip_line({{0.1, 0.1}, {0.2, 0.3}, {0.4, 0.2}}, {0, 0}, {2, 1});
  ASSERT_EQ(whole.size(), 1u);
  EXPECT_EQ(whole[0].size(), 3u);
  EXPECT_TRUE(clip_line({{-1, 5}, {3, 5}}, {0, 0}, {2, 1}).empty());
}

TEST(Plot, AreasAreCutToTheBox) {
  const std::vector<Dot> cut = clip_area({{-1, -1}, {3, -1}, {3, 0.5}, {-1, 0.5}}, {0, 0}, {2, 1});
  double area = 0;
  for (size_t i = 0; i < cut.size(); ++i) {
    const Dot &a = cut[i], &b = cut[(i + 1) % cut.size()];
    area += 0.5 * (a.x * b.y - b.x * a.y);
  }
  EXPECT_NEAR(std::abs(area), 2 * 0.5, 1e-12);
  EXPECT_TRUE(clip_area({{5, 5}, {6, 5}, {6, 6}}, {0, 0}, {2, 1}).empty());
}

TEST(Plot, NamesAxesLinesAndMarksOnce) {
  Plot p;
  p.title = "Two lines";
  p.x_title = "x [m]", p.y_title = "y [kN]", p.legend_title = "which";
  p.lines.push_back({"first", {0, 1, 2}, {0, 1, 4}, Ink::Series0, {}, 2, 1});
  p.lines.push_back({"second", {0, 2}, {0, -3}, Ink::Series1, {4, 2}, 2, 1});
  p.bands.push_back({"band", {0, 2}, {0, 1}, {1, 2}, Ink::Series2, 0.3});
  p.marks.push_back({"mark", 1, 1, Mark::Circle, Ink::Series0});
  p.marks.push_back({"mark", 2, 4, Mark::Circle, Ink::Series0});
  p.marks.push_back({"far away", 50, 1, Mark::Cross, Ink::Series0});
  const std::string svg = to_svg(draw(p));
  for (const char* text : {">Two lines<", ">x [m]<", ">y [kN]<", ">which<", ">first<", ">second<", ">band<", ">mark<"})
    EXPECT_EQ(count(svg, text), 1) << text;
  EXPECT_EQ(count(svg, "far away"), 0) << "a mark outside needs no name";
  EXPECT_EQ(count(svg, "stroke-dasharray=\"4 2\""), 2) << "the line and its sign in the legend";
}

TEST(Plot, EverythingStaysInThePicture) {
  Plot p;
  p.x_title = "x", p.y_title = "y";
  p.x_low = 0, p.x_high = 1, p.y_low = 0, p.y_high = 1;
  p.lines.push_back({"", {-5, 0.5, 9}, {-7, 0.5, 30}, Ink::Series0, {}, 2, 1});
  p.bands.push_back({"", {-5, 9}, {-3, -3}, {4, 4}, Ink::Series0, 0.2});
  const Drawing d = draw(p);
  for (const Shape& s : d.shapes)
    for (const Dot& at : s.dots) {
      EXPECT_GE(at.x, 0);
      EXPECT_LE(at.x, d.width);
      EXPECT_GE(at.y, 0);
      EXPECT_LE(at.y, d.height);
    }
}

TEST(Plot, NothingToShowIsAnEmptyFrame) {
  const std::string svg = to_svg(draw({}));
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

}  // namespace
}  // namespace topple::record
