#include "farfield/grid.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fem/explicit_model.h"
#include "plans.h"

namespace topple::farfield {
namespace {

double volume_of(const Grid& g, const Cell& c) {
  std::array<Vec3, 8> p;
  for (size_t i = 0; i < 8; ++i) p[i] = g.nodes[static_cast<size_t>(c.node[i])];
  return fem::calc_hex_volume(p);
}

/// Box around the cells of a member.
std::pair<Vec3, Vec3> extent_of(const Grid& g, int member) {
  Vec3 low{1e9, 1e9, 1e9}, high{-1e9, -1e9, -1e9};
  for (const Cell& c : g.cells) {
    if (c.member != member) continue;
    for (const int n : c.node)
      for (int i = 0; i < 3; ++i) {
        low[i] = std::min(low[i], g.nodes[static_cast<size_t>(n)][i]);
        high[i] = std::max(high[i], g.nodes[static_cast<size_t>(n)][i]);
      }
  }
  return {low, high};
}

Grid make(const product::Plan& plan, double size) {
  GridOptions o;
  o.size = size;
  return make_grid(plan, o);
}

TEST(Grid, FollowsTheFacesOfMembers) {
  const product::Plan plan = read(portal());
  const Grid g = make(plan, 0.25);
  // 3 m high, 0.3 x 0.4 m; and the beam between the columns' faces, 0.3 x 0.5 m, its top at the floor
  const auto column = extent_of(g, plan.find_member("C-A1-0"));
  EXPECT_NEAR(norm(column.first - Vec3{-0.15, -0.2, 0}), 0, 1e-12);
  EXPECT_NEAR(norm(column.second - Vec3{0.15, 0.2, 3}), 0, 1e-12);
  const auto beam = extent_of(g, plan.find_member("B-A1B1-0"));
  EXPECT_NEAR(beam.first.z, 2.5, 1e-12);
  EXPECT_NEAR(beam.second.z, 3, 1e-12);
  EXPECT_NEAR(beam.first.x, 0.15, 1e-12);
  EXPECT_NEAR(beam.second.x, 4.85, 1e-12);
}

TEST(Grid, HasTheVolumeOfMembersThatShareNoFace) {
  // fine enough that the faces of columns and beams, 5 cm apart, keep lines of their own
  const product::Plan plan = read(portal());
  const Grid g = make(plan, 0.15);
  for (size_t i = 0; i < plan.members.size(); ++i) {
    EXPECT_NEAR(g.fits[i].volume, g.fits[i].plan_volume, 1e-12);
    EXPECT_EQ(g.fits[i].shift, 0);
  }
}

TEST(Grid, KeepsEdgesNearTheSizeAskedFor) {
  for (const double size : {0.2, 0.3, 0.5}) {
    const Grid g = make(read(house()), size);
    for (const auto& lines : g.lines)
      for (size_t i = 0; i + 1 < lines.size(); ++i) EXPECT_LE(lines[i + 1] - lines[i], 1.25 * size + 1e-9);
  }
}

TEST(Grid, PutsNearFacesOnOneLineAndEachNodeWhereItsMemberWantsIt) {
  // columns of 30 x 40 and beams of 30 cm: faces at 15 and 20 cm from the axis share a line across x
  const product::Plan plan = read(house());
  const Grid coarse = make(plan, 0.4), fine = make(plan, 0.1);
  const int column = plan.find_member("C-A2-0");
  for (const Grid* g : {&coarse, &fine}) {
    const auto box = extent_of(*g, column);
    EXPECT_NEAR(box.second.y - box.first.y, 0.4, 1e-12);
    EXPECT_NEAR(box.second.x - box.first.x, 0.3, 1e-12);
  }
  double least = 1e9;
  for (size_t i = 0; i + 1 < coarse.lines[1].size(); ++i)
    least = std::min(least, coarse.lines[1][i + 1] - coarse.lines[1][i]);
  EXPECT_GT(least, 0.0999);  // no sliver of the 5 cm between the faces; the wall is 10 cm thick
  // beams give way by at most those 5 cm, where they meet columns
  for (size_t i = 0; i < plan.members.size(); ++i)
    if (plan.members[i].kind == product::MemberKind::Beam) { EXPECT_LE(coarse.fits[i].shift, 0.05 + 1e-9); }
}

TEST(Grid, HasAsManyCellsAcrossColumnsAndBeamsAsAskedFor) {
  const product::Plan plan = read(house());
  const auto count_lines = [](const Grid& g, size_t axis, double from, double to) {
    return std::count_if(g.lines[axis].begin(), g.lines[axis].end(),
                         [&](double at) { return at > from - 1e-9 && at < to + 1e-9; });
  };
  const int column = plan.find_member("C-A2-0"), beam = plan.find_member("B-A1B1-0");
  for (const int across : {2, 3, 4, 6}) {
    GridOptions o;
    o.size = 0.8;
    o.least_across = across;
    const Grid g = make_grid(plan, o);
    const auto c = extent_of(g, column);
    for (size_t axis : {0UL, 1UL}) {
      const int a = static_cast<int>(axis);
      EXPECT_GE(count_lines(g, axis, c.first[a], c.second[a]), across + 1) << across << " " << axis;
    }
    // its top is the floor's, which is one of them
    const auto b = extent_of(g, beam);
    EXPECT_EQ(count_lines(g, 2, b.first.z, b.second.z), across + 1) << across;
  }
}

TEST(Grid, NeverClosesAMemberThatIsThinnerThanTheReach) {
  // walls of 10 cm at a size of 0.8 m
  const product::Plan plan = read(house());
  const auto box = extent_of(make(plan, 0.8), plan.find_member("W-A1A2-1"));
  EXPECT_NEAR(box.second.x - box.first.x, 0.1, 1e-12);
}

TEST(Grid, AWallReachesTheAxisOfAColumnThatWasTakenOut) {
  const auto length = [](const std::string& more) {
    const product::Plan plan = read(house(more));
    const auto box = extent_of(make(plan, 0.2), plan.find_member("W-A1A2-1"));
    return box.second.y - box.first.y;
  };
  // columns of 40 cm 4 m apart
  EXPECT_NEAR(length(""), 3.6, 1e-9);
  EXPECT_NEAR(length("[preparation]\nremoved = [\"C-A2-1\"]\n"), 3.8, 1e-9);
}

TEST(Grid, LeavesOpeningsOpen) {
  const product::Plan plan = read(house());
  const Grid g = make(plan, 0.3);
  const int wall = plan.find_member("W-A1A2-1");
  const product::Member& m = plan.members[static_cast<size_t>(wall)];
  const product::Opening& o = m.openings.front();
  for (const Cell& c : g.cells) {
    if (c.member != wall) continue;
    const double along = c.centre.y - m.start.y, above = c.centre.z - m.start.z;
    EXPECT_FALSE(along > o.left && along < o.left + o.width && above > o.sill && above < o.sill + o.height);
  }
}

TEST(Grid, BoundsWhatChargesDestroy) {
  const product::Plan plan = read(portal(charge("C-A1-0")));
  const Grid g = make(plan, 0.4);
  double volume = 0;
  for (const Cell& c : g.cells)
    if (c.member == plan.find_member("C-A1-0") && c.centre.z > 0.5 && c.centre.z < 1.5) volume += volume_of(g, c);
  EXPECT_NEAR(volume, 0.3 * 0.4 * 1, 1e-12);
}

TEST(Grid, JoinsAllMembers) {
  const Grid g = make(read(house()), 0.5);
  std::vector<int> parent(g.nodes.size());
  for (size_t i = 0; i < parent.size(); ++i) parent[i] = static_cast<int>(i);
  const auto root = [&](int i) {
    while (parent[static_cast<size_t>(i)] != i) i = parent[static_cast<size_t>(i)];
    return i;
  };
  for (const Cell& c : g.cells)
    for (const int n : c.node) {
      const int a = root(c.node[0]), b = root(n);
      parent[static_cast<size_t>(std::max(a, b))] = std::min(a, b);
    }
  for (size_t i = 0; i < parent.size(); ++i) ASSERT_EQ(root(static_cast<int>(i)), 0);
}

TEST(Grid, RefusesASizeWithMoreCellsThanItCanNumber) {
  const product::Plan plan = read(portal());
  for (const double size : {1e-3, 1e-10, 1e-300}) {
    try {
      (void)make(plan, size);
      FAIL();
    } catch (const InputError& e) { EXPECT_EQ(e.diagnostics()[0].code, "E676"); }
  }
}

TEST(Grid, RefusesChargesThatLeaveConcrete) {
  const auto code = [](const std::string& more) -> std::string {
    try {
      (void)make(read(portal(charge("C-A1-0", "0 s", "residual_concrete = 0.2\n" + more))), 0.2);
    } catch (const InputError& e) {
      EXPECT_GT(e.diagnostics()[0].where.line, 0);
      return e.diagnostics()[0].code;
    }
    return "";
  };
  EXPECT_EQ(code(""), "E675");
  EXPECT_EQ(code("fails = true\n"), "");
}

TEST(Grid, RefusesMembersWithoutRoomWithTheirLine) {
  // rows so near that the beam between them lies inside the columns
  const std::string text = materials() + grid("A = \"0 m\", B = \"0.3 m\"", "1 = \"0 m\"", 2) +
                           "[[columns]]\nsection = \"column\"\n[[beams]]\nsection = \"beam\"\nalong = \"x\"\n" +
                           analysis();
  const product::Plan plan = read(text);
  try {
    (void)make(plan, 0.3);
    FAIL();
  } catch (const InputError& e) {
    const product::Member& beam = plan.members[static_cast<size_t>(plan.find_member("B-A1B1-0"))];
    EXPECT_EQ(e.diagnostics()[0].code, "E670");
    EXPECT_EQ(e.diagnostics()[0].where.line, beam.where.line);
    // one complaint for both beams of the line
    EXPECT_THAT(e.diagnostics()[0].message, testing::StartsWith("B-A1B1-0, B-A1B1-1: "));
  }
}

}  // namespace
}  // namespace topple::farfield
