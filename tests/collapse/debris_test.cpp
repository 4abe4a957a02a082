#include "collapse/debris.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "collapse/debris_tables.h"
#include "collapse/outcome.h"
#include "collapse/run.h"
#include "plans.h"

namespace topple::collapse {
namespace {

const Polygon kSquare{{0, 0}, {1, 0}, {1, 1}, {0, 1}};

TEST(Debris, HullLeavesOutInnerPointsAndPointsOnEdges) {
  const Polygon hull = calc_hull({{0, 0}, {2, 0}, {1, 0}, {1, 1}, {2, 2}, {0, 2}, {0, 1}, {2, 0}});
  ASSERT_EQ(hull.size(), 4u);
  EXPECT_NEAR(calc_area(hull), 4, 1e-15);
  EXPECT_LE(calc_hull({{1, 1}, {1, 1}}).size(), 1u);
}

TEST(Debris, DistanceOfPolygons) {
  const Polygon right{{3, 0}, {4, 0}, {4, 1}};
  EXPECT_NEAR(calc_distance(kSquare, right), 2, 1e-15);
  const Polygon corner{{2, 3}, {3, 3}, {3, 4}};
  EXPECT_NEAR(calc_distance(kSquare, corner), std::hypot(1, 2), 1e-15);
  EXPECT_EQ(calc_distance(kSquare, {{0.4, 0.4}, {0.6, 0.4}, {0.5, 0.6}}), 0);        // one inside the other
  EXPECT_EQ(calc_distance(kSquare, {{0.5, -1}, {0.6, -1}, {0.6, 2}, {0.5, 2}}), 0);  // crossing without corners inside
}

TEST(Debris, OutlineOfATurnedBox) {
  const double eighth = std::acos(-1.0) / 4;
  const Polygon p = calc_outline({{{0, 0, 1}, exp_rotation({0, 0, eighth})}, {1, 1, 1}});
  EXPECT_NEAR(calc_area(p), 4, 1e-12);
  EXPECT_NEAR(calc_distance(p, {{2, -1}, {3, -1}, {3, 1}, {2, 1}}), 2 - std::sqrt(2.0), 1e-12);
}

TEST(Debris, HeapCountsWhatLiesUnderItsSurface) {
  // a slab on two blocks: the space under it counts as bulk
  const std::vector<PlacedBox> boxes{
      {{{0.5, 1, 0.5}, {}}, {0.5, 1, 0.5}}, {{{3.5, 1, 0.5}, {}}, {0.5, 1, 0.5}}, {{{2, 1, 1.1}, {}}, {2, 1, 0.1}}};
  const Heap heap = calc_heap(boxes, 0.25);
  EXPECT_NEAR(heap.height, 1.2, 1e-12);
  EXPECT_NEAR(heap.volume, 4 * 2 * 1.2, 1e-9);  // edges lie on the grid
  // a cube on its edge: a roof of slope 1, sampled in the middle of cells, within a cell of its outline
  const double eighth = std::acos(-1.0) / 4, half = std::sqrt(2.0);
  const Heap roof = calc_heap({{{{0, 0, half}, exp_rotation({0, eighth, 0})}, {1, 1, 1}}}, 0.05);
  EXPECT_NEAR(roof.height, 2 * half, 1e-12);
  EXPECT_NEAR(roof.volume, 2 * (2 * half * half + half * half), 0.05 * 2 * 2 * half);
}

/// Puts a frame behind the others: the bodies at x, y, 1 m high and turned about z.
void add_frame(record::Record& r, const std::vector<std::array<double, 3>>& x_y_turn) {
  for (const auto& [x, y, turn] : x_y_turn) {
    for (const double p : {x, y, 1.0}) r.position.push_back(static_cast<float>(p));
    for (const double q : {std::cos(turn / 2), 0.0, 0.0, std::sin(turn / 2)})
      r.orientation.push_back(static_cast<float>(q));
  }
  r.time.push_back(static_cast<double>(r.time.size()));
}

/// Three parts of 1, 1 and 2 t on a footprint of 4 m x 4 m: in the end one inside, one 1 m and one 5 m beyond it
/// towards +x.
record::Record make_three() {
  record::Record r;
  r.building_outline = {{0, 0}, {4, 0}, {4, 4}, {0, 4}};
  for (int b = 0; b < 3; ++b) {
    record::BodyInfo body;
    body.name = std::to_string(b);
    body.mass = b == 0 ? 2000 : 1000;
    body.shapes = {{{}, {0.5, 0.5, 1}, "concrete"}};
    r.bodies.push_back(body);
  }
  add_frame(r, {{2, 2, 0}, {2, 2, 0}, {2, 2, 0}});
  add_frame(r, {{2, 2, 0}, {4.5, 2, 0}, {8.5, 2, 0}});
  return r;
}

TEST(Reach, CountsTheMassTowardsEachSide) {
  const record::Record r = make_three();
  const Reach reach = calc_reach(r, 1);
  EXPECT_NEAR(reach.largest, 5, 1e-6);
  EXPECT_NEAR(reach.side[1], 5, 1e-6);
  EXPECT_EQ(reach.side[0], 0);
  EXPECT_NEAR(reach.side_most[1], 5, 1e-6);  // the last quarter of the mass is more than 5 %
  EXPECT_EQ(reach.side_most[2], 0);
  EXPECT_EQ(reach.farthest, 2);
  // outlines from the nearest part on: 1 m2, then from x = 1.5 to 5 m
  EXPECT_NEAR(calc_area(calc_share_outline(r, 1, 0.5)), 1, 1e-6);
  EXPECT_NEAR(calc_area(calc_share_outline(r, 1, 0.7)), 3.5, 1e-6);
  EXPECT_NEAR(calc_area(calc_share_outline(r, 1, 1)), 7.5, 1e-6);
}

TEST(Reach, CountsWhatIsThrownOutOnceWithItsMember) {
  record::Record r = make_three();
  r.bodies[2].kind = "debris";  // its tonne is in those of the others
  EXPECT_NEAR(calc_reach(r, 1).largest, 5, 1e-6);
  EXPECT_NEAR(calc_reach(r, 1).most_mass, 1, 1e-6);
}

TEST(Approach, WhatOnlyTouchesIsNotOverIt) {
  // far out, where a record's poses are rounded to 3e-5 m
  for (const double far : {0.0, 777.3}) {
    record::Record r = make_three();
    r.bodies.resize(1);
    r.time.clear(), r.position.clear(), r.orientation.clear();
    add_frame(r, {{2 + far, 2 + far, 0}});
    const auto area = [far](double x) {
      return Polygon{{x + far, far}, {x + far + 5, far}, {x + far + 5, far + 4}, {x + far, far + 4}};
    };
    const Approach touching = find_approach(r, area(2.5));
    EXPECT_EQ(touching.least, 0) << far;
    EXPECT_FALSE(std::isfinite(touching.lowest)) << far;
    const Approach over = find_approach(r, area(2.45));
    EXPECT_EQ(over.least, 0) << far;
    EXPECT_NEAR(over.lowest, 0, 1e-6) << far;
    EXPECT_NEAR(find_approach(r, area(2.6)).least, 0.1, 1e-4) << far;
  }
}

TEST(Approach, WhatLeansOverFromItsFootLandsOnNothing) {
  record::Record r = make_three();
  r.bodies.resize(1);
  r.time.clear(), r.position.clear(), r.orientation.clear();
  add_frame(r, {{2, 2, 0}});
  // its side leans by 2 cm a metre and lies 2 mm over the area at the ground, 4.2 cm at its head
  const Quat lean = exp_rotation({0, 0.02, 0});
  r.orientation = {static_cast<float>(lean.w), static_cast<float>(lean.x), static_cast<float>(lean.y),
                   static_cast<float>(lean.z)};
  const Approach a = find_approach(r, {{2.478, 0}, {8, 0}, {8, 4}, {2.478, 4}});
  EXPECT_EQ(a.least, 0);
  EXPECT_NEAR(a.lowest, 0.4, 0.02) << "where it is 1 cm over";
}

TEST(DebrisTables, HoldEverySquareAndEveryCorner) {
  const std::string heights = make_height_table(make_three(), 0.5);
  // three boxes of 1 m x 1 m, each over four squares, 2 m high
  EXPECT_EQ(std::count(heights.begin(), heights.end(), '\n'), 1 + 3 * 4);
  EXPECT_NE(heights.find("1.75,1.75,2\r\n"), std::string::npos) << heights;
  const std::string outlines = make_outline_table(make_three());
  EXPECT_EQ(std::count(outlines.begin(), outlines.end(), '\n'), 1 + 4 * 4);  // four rectangles
  EXPECT_EQ(make_height_table({}, 0.5), "x [m],y [m],height [m]\r\n");
}

/// One part of 1 m x 1 m over a corner or a side of a footprint of 4 m x 4 m.
record::Record make_one(double x, double y, double turn = 0) {
  record::Record r = make_three();
  r.bodies.resize(1);
  r.time.clear(), r.position.clear(), r.orientation.clear();
  add_frame(r, {{2, 2, 0}});
  add_frame(r, {{x, y, turn}});
  return r;
}

TEST(Reach, IsTheDistanceFromTheFootprintInPlan) {
  const Reach corner = calc_reach(make_one(6.5, 7.5), 1);  // its farthest corner 3 m and 4 m beyond
  EXPECT_NEAR(corner.side[1], 3, 1e-6);
  EXPECT_NEAR(corner.side[3], 4, 1e-6);
  EXPECT_NEAR(corner.largest, 5, 1e-6);
  EXPECT_NEAR(corner.most_mass, 5, 1e-6);
  EXPECT_NEAR(calc_reach(make_one(6.5, 2), 1).largest, 3, 1e-6);
  EXPECT_EQ(calc_reach(make_one(2, 2), 1).largest, 0);
}

TEST(Reach, IsTheSameWhicheverWaySomethingLies) {
  // a round footprint of 2 m, a part that reaches from it to 10 m along a direction
  for (const double azimuth : {0.0, 0.3, 0.785, 1.2}) {
    record::Record r = make_one(6 * std::cos(azimuth), 6 * std::sin(azimuth), azimuth);
    r.position[0] = r.position[1] = 0;  // it stood upright within
    r.building_outline.clear();
    for (int i = 0; i < 64; ++i) {
      const double a = azimuth + i * std::acos(-1.0) / 32;
      r.building_outline.push_back({2 * std::cos(a), 2 * std::sin(a)});
    }
    r.bodies[0].shapes = {{{}, {4, 0, 0.5}, "concrete"}};
    r.orientation[0] = r.orientation[2] = static_cast<float>(std::sqrt(0.5));
    EXPECT_NEAR(calc_reach(r, 1).largest, 8, 1e-5) << azimuth;
  }
}

TEST(Reach, LeavesOutWhatStandsBesideTheBuilding) {
  record::Record r = make_one(6.5, 2);
  record::BodyInfo post = r.bodies[0];
  post.belongs = record::Belonging::Beside;
  r.bodies.push_back(post);
  r.time.clear(), r.position.clear(), r.orientation.clear();
  add_frame(r, {{2, 2, 0}, {-60, 2, 0}});
  add_frame(r, {{6.5, 2, 0}, {-60, 2, 0}});
  add_frame(r, {{6.5, 2, 0}, {-62, 2, 0}});  // pushed over
  EXPECT_NEAR(calc_reach(r, 1).largest, 3, 1e-5);
  EXPECT_NEAR(calc_reach(r, 1).area, 1, 1e-5);
  EXPECT_NEAR(calc_reach(r, 2).largest, 3, 1e-5);
  EXPECT_NEAR(calc_reach(r, 2).side[0], 2, 1e-5);
  EXPECT_GT(calc_reach(r, 2).area, 60);
  // nor does it belong to the hill, until it is pushed over
  EXPECT_FALSE(stays_beside(r, 0, 1));
  EXPECT_TRUE(stays_beside(r, 1, 1));
  EXPECT_FALSE(stays_beside(r, 1, 2));
  EXPECT_EQ(find_moving_boxes(r, 1).size(), 1u);
  EXPECT_EQ(find_moving_boxes(r, 2).size(), 2u);
  // records of earlier versions do not say what stands beside
  for (record::BodyInfo& b : r.bodies) b.belongs = record::Belonging::Unknown;
  EXPECT_NEAR(calc_reach(r, 1).largest, 3, 1e-5);
  EXPECT_TRUE(stays_beside(r, 1, 1));
}

TEST(Reach, CountsPartsOfTheBuildingThatLeanBeyondItsOutlineAtRest) {
  record::Record r = make_one(0.5, 2);
  r.time.clear(), r.position.clear(), r.orientation.clear();
  add_frame(r, {{3.52, 2, 0}});  // 2 cm beyond
  add_frame(r, {{3.52, 2, 0}});
  add_frame(r, {{-2.5, 2, 0}});
  EXPECT_FALSE(stays_beside(r, 0, 1)) << "it may have come straight down";
  EXPECT_EQ(find_moving_boxes(r, 1).size(), 1u);
  EXPECT_NEAR(calc_reach(r, 1).largest, 0.02, 1e-6);
  EXPECT_NEAR(calc_reach(r, 2).largest, 3, 1e-6) << "from the building's outline";
}

/// Four slender storeys of one bay that come down as they stand, and a stack on which no charge acts.
product::Plan read_heavy_bay() {
  return read(
      materials() +
      "[section.post]\nwidth = \"40 cm\"\nheight = \"40 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\ncover = \"3 cm\"\n"
      "ties = { diameter = \"8 mm\", spacing = \"20 cm\" }\nbars = { count_y = 3, count_z = 3, diameter = \"20 mm\" }\n"
      "[section.girder]\nwidth = \"30 cm\"\nheight = \"50 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\ncover = \"3 cm\"\n"
      "ties = { diameter = \"8 mm\", spacing = \"15 cm\" }\ntop = \"4 x 20 mm\"\nbottom = \"4 x 20 mm\"\n"
      "[slab.thick]\nthickness = \"20 cm\"\nconcrete = \"C25\"\nsteel = \"S\"\nas_top = \"4 cm2/m\"\n"
      "as_bottom = \"4 cm2/m\"\n" +
      grid("A = \"0 m\", B = \"5 m\"", "1 = \"0 m\", 2 = \"5 m\"", 4, "10 kN/m2") +
      "[[columns]]\nsection = \"post\"\n[[beams]]\nsection = \"girder\"\n[[slabs]]\npanel = \"thick\"\n"
      "[[shafts]]\nname = \"stack\"\nposition = [\"30 m\", \"2.5 m\"]\nconcrete = \"C25\"\nsteel = \"S\"\n"
      "height = \"20 m\"\ndiameter = \"3 m\"\nthickness = \"20 cm\"\nas_outer = \"6 cm2/m\"\n" +
      charge("C-*-0", "0 s", "scatter = \"0 ms\"") + analysis("0.8 s"));
}

TEST(Heap, HoldsAllOfTheBuildingAndNothingBesideIt) {
  const product::Plan plan = read_heavy_bay();
  ModelMap map;
  const mbs::Model model = make_model(plan, default_knowledge(), map);
  const record::Record run = run_plan(plan, default_knowledge(), {}, {});
  const std::string path = testing::TempDir() + "topple-heap-" + std::to_string(getpid()) + ".h5";
  record::write_hdf5(run, path);
  const record::Record back = record::read_hdf5(path);
  std::filesystem::remove(path);
  const size_t last = run.time.size() - 1;
  double volume = 0, most = 0, out = 0;
  for (size_t b = 0; b < run.bodies.size(); ++b) {
    const bool is_beside = run.bodies[b].name.rfind("stack", 0) == 0;
    EXPECT_EQ(run.bodies[b].belongs == record::Belonging::Beside, is_beside) << run.bodies[b].name;
    if (run.bodies[b].fixed || is_beside) continue;
    volume += b < map.bodies.size() ? map.bodies[b].volume : 0;
    for (size_t i = 0; i < run.bodies[b].shapes.size(); ++i)
      for (const bool is_start : {true, false}) {
        const record::BoxShape s = record::shape_at(run, is_start ? 0 : last, b, i);
        const PlacedBox box{record::pose_at(run, is_start ? 0 : last, b) * s.X_BS, s.half};
        if (is_start)
          for (const Point2& p : calc_outline(box)) out = std::max(out, calc_distance(p, run.building_outline));
        else
          most = std::max(most, calc_heap_height({box}));
      }
  }
  for (const DebrisEntry& d : map.debris) volume += d.volume;
  EXPECT_GT(out, 1.2e-3) << "or no part leans beyond the outline at rest";
  EXPECT_NEAR(find_heap(run, last).height, most, 1e-9);
  EXPECT_EQ(find_heap(back, last).height, find_heap(run, last).height);
  EXPECT_EQ(find_heap(back, last).volume, find_heap(run, last).volume);
  EXPECT_EQ(calc_reach(back, last).largest, calc_reach(run, last).largest);
  const auto found = std::find_if(run.findings.begin(), run.findings.end(),
                                  [](const record::Finding& f) { return f.id == "debris.volume"; });
  ASSERT_NE(found, run.findings.end());
  EXPECT_NE(found->text.find(fmt::format("have {:.0f} m3", volume)), std::string::npos) << found->text << volume;
}

TEST(Debris, LowestPointOverAnArea) {
  constexpr double infinity = std::numeric_limits<double>::infinity();
  const PlacedBox flat{{{0, 0, 5}, {}}, {2, 1, 0.5}};
  EXPECT_NEAR(calc_lowest_over(flat, kSquare), 4.5, 1e-12);                                       // within the box
  EXPECT_NEAR(calc_lowest_over(flat, {{-9, -9}, {9, -9}, {9, 9}, {-9, 9}}), 4.5, 1e-12);          // around it
  EXPECT_NEAR(calc_lowest_over(flat, {{-0.1, -9}, {0.1, -9}, {0.1, 9}, {-0.1, 9}}), 4.5, 1e-12);  // across it
  EXPECT_EQ(calc_lowest_over(flat, {{3, 0}, {4, 0}, {4, 1}}), infinity);
  // one end of a leaning bar is on the ground, the other one over the square: z = x there
  const double eighth = std::acos(-1.0) / 4, length = 2 * std::sqrt(2.0);
  const PlacedBox bar{{{-1, 0.5, 2}, exp_rotation({0, -eighth, 0})}, {length, 0.1, 0}};
  EXPECT_NEAR(calc_lowest_over(bar, kSquare), 3, 1e-12);
  EXPECT_NEAR(calc_lowest_over(bar, {{-4, 0}, {4, 0}, {4, 1}, {-4, 1}}), 0, 1e-12);
}

}  // namespace
}  // namespace topple::collapse
