#include "fem/explicit_chunks.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "explicit_mesh.h"

namespace topple::fem {
namespace {

/// A slab on a column, in one body, of which the elements' axes lie any way round.
ExplicitModel make_table() {
  ExplicitModel model;
  model.materials = {make_explicit_elastic(2400, 30e9, 0.2)};
  model.gravity = {};
  add_brick(model, {0, 0, 0}, {4, 2.4, 4}, 20, 12, 20);
  std::erase_if(model.elements, [](const ExplicitElement& e) {
    const int number = e.node[0] % (21 * 13), k = e.node[0] / (21 * 13);
    const int i = number % 21, j = number / 21;
    return k < 18 && (i < 8 || i > 11 || j < 4 || j > 7);
  });
  int turn = 0;
  for (ExplicitElement& e : model.elements) e.node = turn_corners(e.node, turn++ % 3);
  return model;
}

TEST(ExplicitChunks, PutEachElementInOneSlotAndStripsFaceToFace) {
  ExplicitModel model = make_table();
  for (size_t e = 0; e < model.elements.size(); ++e)  // all the same way round, or there are no strips
    model.elements[e].node = turn_corners(model.elements[e].node, (3 - static_cast<int>(e) % 3) % 3);
  for (const size_t lanes : {1U, 2U, 4U, 8U}) {
    const ExplicitChunks c = make_chunks(model, lanes, 300);
    std::vector<int> seen(model.elements.size(), 0);
    size_t empty = 0;
    for (const int e : c.element_of_slot)
      if (e >= 0)
        ++seen[static_cast<size_t>(e)];
      else
        ++empty;
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), static_cast<long>(seen.size()));
    EXPECT_LT(empty, lanes * c.chunks.size()) << "no block but the last of a chunk may have empty lanes";
    size_t joined = 0;
    for (const ElementChunk& chunk : c.chunks) {
      EXPECT_EQ(c.joined[chunk.first_block], 0);
      for (size_t block = chunk.first_block + 1; block < chunk.first_block + chunk.blocks; ++block) {
        if (c.joined[block] == 0) continue;
        ++joined;
        for (size_t i = 0; i < 4 * lanes; ++i)
          ASSERT_EQ(c.corners[block * 8 * lanes + i], c.corners[((block - 1) * 8 + 4) * lanes + i]);
      }
    }
    EXPECT_GT(joined, c.joined.size() / 2) << lanes << " lanes";
  }
}

TEST(ExplicitChunks, AreSmallerWhereTheirNodesWouldNotFit) {
  ExplicitModel model;  // bricks that share no node
  model.materials = {make_explicit_elastic(2400, 30e9, 0.2)};
  for (int i = 0; i < 1500; ++i) add_brick(model, {2.0 * i, 0, 0}, {2.0 * i + 1, 1, 1}, 1, 1, 1);
  const ExplicitChunks c = make_chunks(model, 4, 1500);
  EXPECT_EQ(c.chunks.size(), 2U);
  EXPECT_EQ(c.most_nodes, 8U * 750);
  std::vector<std::uint16_t> offsets(c.corners.begin(),
                                     c.corners.begin() + static_cast<std::ptrdiff_t>(8 * 4 * c.chunks[0].blocks));
  std::sort(offsets.begin(), offsets.end());
  offsets.erase(std::unique(offsets.begin(), offsets.end()), offsets.end());
  EXPECT_EQ(offsets.size(), 8U * 750) << "nodes that wrap round would be the same";
}

TEST(ExplicitChunks, TurnCornersWithoutMirroring) {
  const std::array<int, 8> node{0, 1, 2, 3, 4, 5, 6, 7};
  EXPECT_EQ(turn_corners(turn_corners(node, 1), 1), turn_corners(node, 2));
  EXPECT_EQ(turn_corners(turn_corners(node, 1), 2), node);
  // ξ η ζ of the turned one are η ζ ξ: along its first edge the corner beside 0 along η
  EXPECT_EQ(turn_corners(node, 1)[1], 3);
  EXPECT_EQ(turn_corners(node, 1)[3], 4);
  EXPECT_EQ(turn_corners(node, 1)[4], 1);
}

// A body thrown in a spin, with elements whose axes lie any way round and all alike: strips differ, the
// motion does not but for round-off, which a chaotic motion would multiply and this one does not.
TEST(ExplicitStrips, TheWayElementsLieDoesNotCount) {
  ExplicitModel mixed = make_table(), alike = mixed;
  for (size_t e = 0; e < alike.elements.size(); ++e)
    alike.elements[e].node = turn_corners(alike.elements[e].node, (3 - static_cast<int>(e) % 3) % 3);
  std::vector<Vec3> speed;
  for (const Vec3& x : mixed.nodes) speed.push_back({0.3 * x.z * x.z, -0.2 * x.x * x.y, 0.1 * x.y});
  ExplicitSystem a(mixed, {}), b(alike, {});
  a.set_velocities(speed), b.set_velocities(speed);
  ASSERT_EQ(a.advance(200 * a.step()), ExplicitEnding::ReachedTime);
  ASSERT_EQ(b.advance(200 * b.step()), ExplicitEnding::ReachedTime);
  const ExplicitEnergy one = a.calc_energy(), other = b.calc_energy();
  EXPECT_NEAR(one.elastic, other.elastic, 1e-9 * one.elastic);
  EXPECT_NEAR(one.elastic_hourglass, other.elastic_hourglass, 1e-9 * one.elastic);
  for (size_t n = 0; n < mixed.nodes.size(); ++n)
    EXPECT_LT(norm(a.p(static_cast<int>(n)) - b.p(static_cast<int>(n))), 1e-12);
}

// Whole blocks in the middle of strips go: what is left moves as if they had never been there.
TEST(ExplicitStrips, GapsPassNothingOn) {
  ExplicitModel whole;
  whole.materials = {make_explicit_elastic(2400, 30e9, 0.2)};
  whole.gravity = {};
  add_brick(whole, {0, 0, 0}, {0.8, 0.8, 3.4}, 4, 4, 17);
  std::vector<int> gap;
  ExplicitModel parts = whole;
  parts.elements.clear();
  for (size_t e = 0; e < whole.elements.size(); ++e) {
    const double z = whole.nodes[static_cast<size_t>(whole.elements[e].node[0])].z;
    if (z > 1.3 && z < 1.9)
      gap.push_back(static_cast<int>(e));
    else
      parts.elements.push_back(whole.elements[e]);
  }
  std::vector<Vec3> speed;
  for (const Vec3& x : whole.nodes) speed.push_back({0, 0.2 * x.z, x.z > 1.7 ? 1.0 : -1.0});
  ExplicitSystem a(whole, {}), b(parts, {});
  a.set_velocities(speed), b.set_velocities(speed);
  a.remove(gap);
  const double until = 200 * a.step();
  ASSERT_EQ(a.advance(until), ExplicitEnding::ReachedTime);
  ASSERT_EQ(b.advance(until), ExplicitEnding::ReachedTime);
  double most = 0;
  for (size_t n = 0; n < whole.nodes.size(); ++n)
    if (b.node_mass(static_cast<int>(n)) > 0)
      most = std::max(most, norm(a.p(static_cast<int>(n)) - b.p(static_cast<int>(n))));
  EXPECT_LT(most, 1e-12);
}

}  // namespace
}  // namespace topple::fem
