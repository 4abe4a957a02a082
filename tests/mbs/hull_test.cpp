// Convex polyhedra as contact shapes, against boxes, closed forms and brute force.

#include "mbs/hull.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "base/error.h"
#include "mbs/polyhedra.h"

namespace topple::mbs {
namespace {

Solid make_solid(const Hull& hull, const Vec3& p, const Mat3& R = Mat3::identity()) {
  Solid s;
  s.kind = Shape::Kind::Hull;
  s.p = p;
  s.R = R;
  s.hull = &hull;
  s.reach = hull.reach;
  return s;
}

Solid make_box_solid(const Vec3& half, const Vec3& p, const Mat3& R) {
  Solid s;
  s.p = p;
  s.R = R;
  s.half = half;
  s.reach = norm(half);
  return s;
}

TEST(Hull, HasTheFacesEdgesAndVerticesOfItsSolid) {
  std::vector<Vec3> cube;
  for (int i = 0; i < 8; ++i) cube.push_back({i & 1 ? 1.0 : -1.0, i & 2 ? 2.0 : -2.0, i & 4 ? 3.0 : -3.0});
  cube.push_back({0.1, 0.2, 0.3});  // inside
  cube.push_back({0.3, 0.4, 3});    // on a face
  const Hull box = make_hull(cube), same = make_box_hull({1, 2, 3});
  for (const Hull* h : {&box, &same}) {
    EXPECT_EQ(h->vertices.size(), 8U);
    EXPECT_EQ(h->faces.size(), 6U);
    EXPECT_EQ(h->edges.size(), 12U);
    EXPECT_EQ(h->directions.size(), 3U);
    for (const Hull::Face& f : h->faces) {
      ASSERT_EQ(f.loop.size(), 4U);
      // counter-clockwise from outside: Newell's normal is the face's, and its length twice the area
      Vec3 newell;
      for (size_t i = 0; i < 4; ++i)
        newell +=
            cross(h->vertices[static_cast<size_t>(f.loop[i])], h->vertices[static_cast<size_t>(f.loop[(i + 1) % 4])]);
      EXPECT_GT(dot(newell, f.normal), 0);
    }
  }
  const Hull tetrahedron = make_hull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}});
  EXPECT_EQ(tetrahedron.faces.size(), 4U);
  EXPECT_EQ(tetrahedron.edges.size(), 6U);
  EXPECT_EQ(tetrahedron.directions.size(), 6U);
}

TEST(Hull, RefusesPointsThatEncloseNothing) {
  EXPECT_THROW(make_hull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), InputError);
  EXPECT_THROW(make_hull({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}}), InputError);
  EXPECT_THROW(make_hull({{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}}), InputError);
  EXPECT_THROW(make_hull({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}}), InputError);
}

TEST(HullContact, FindsWhatBoxesFind) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  int touching = 0, apart = 0;
  for (int i = 0; i < 4000; ++i) {
    const Vec3 half_a{0.6 + 0.4 * unit(random), 0.6 + 0.4 * unit(random), 0.6 + 0.4 * unit(random)};
    const Vec3 half_b{0.6 + 0.4 * unit(random), 0.6 + 0.4 * unit(random), 0.6 + 0.4 * unit(random)};
    const Mat3 Ra = to_matrix(exp_rotation({unit(random), unit(random), unit(random)}));
    const Mat3 Rb = to_matrix(exp_rotation({unit(random), unit(random), unit(random)}));
    const Vec3 pb{1.2 * unit(random), 1.2 * unit(random), 1.2 * unit(random)};
    const Hull ha = make_box_hull(half_a), hb = make_box_hull(half_b);
    BoxContact boxes, hulls;
    int axis_a = 0, axis_b = 0;
    find_contact(make_box_solid(half_a, {}, Ra), make_box_solid(half_b, pb, Rb), axis_a, boxes);
    hull_hull(make_solid(ha, {}, Ra), make_solid(hb, pb, Rb), axis_b, hulls);
    // both look along the same axes; which of nearly equal overlaps is taken depends on their order
    ASSERT_EQ(boxes.count > 0, hulls.count > 0) << i;
    if (boxes.count == 0) {
      ++apart;
      continue;
    }
    ++touching;
    double deepest_a = 0, deepest_b = 0;
    for (int k = 0; k < boxes.count; ++k) deepest_a = std::max(deepest_a, boxes.depth[k]);
    for (int k = 0; k < hulls.count; ++k) deepest_b = std::max(deepest_b, hulls.depth[k]);
    if (dot(boxes.normal, hulls.normal) > 1 - 1e-9 && boxes.count == hulls.count) {
      ASSERT_NEAR(deepest_a, deepest_b, 1e-9) << i;
    }
  }
  EXPECT_GT(touching, 1000);
  EXPECT_GT(apart, 300);
}

TEST(HullContact, FaceOnFaceHasTheCornersOfTheOverlap) {
  const Hull a = make_box_hull({1, 1, 0.5}), b = make_box_hull({0.4, 2, 0.5});
  BoxContact out;
  int axis = -1;
  hull_hull(make_solid(a, {}), make_solid(b, {0.2, 0, 0.98}), axis, out);
  ASSERT_EQ(out.count, 4);
  EXPECT_NEAR(out.normal.z, 1, 1e-12);
  double weights = 0;
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(out.depth[i], 0.02, 1e-12);
    EXPECT_NEAR(std::abs(out.p[i].x - 0.2), 0.4, 1e-12);
    EXPECT_NEAR(std::abs(out.p[i].y), 1, 1e-12);
    EXPECT_NEAR(out.p[i].z, 0.49, 1e-12);
    weights += out.weight[i];
  }
  EXPECT_NEAR(weights, 4, 1e-12);
}

TEST(HullContact, CrossedEdgesMeetInAPoint) {
  // two square prisms on edge, crossed at a right angle
  const double c = std::sqrt(0.5);
  const Mat3 along_x = Mat3::from_columns({1, 0, 0}, {0, c, c}, {0, -c, c});
  const Mat3 along_y = Mat3::from_columns({0, 1, 0}, {-c, 0, c}, {c, 0, c});
  const Hull rod = make_box_hull({2, 0.5, 0.5});
  BoxContact out;
  int axis = -1;
  hull_hull(make_solid(rod, {}, along_x), make_solid(rod, {0, 0, 2 * std::sqrt(0.5) - 0.01}, along_y), axis, out);
  ASSERT_EQ(out.count, 1);
  EXPECT_NEAR(out.normal.z, 1, 1e-9);
  EXPECT_NEAR(out.depth[0], 0.01, 1e-9);
  EXPECT_NEAR(out.p[0].x, 0, 1e-9);
  EXPECT_NEAR(out.p[0].y, 0, 1e-9);
}

TEST(HullContact, ManyCornersAreThinned) {
  std::vector<Vec3> points;
  for (int i = 0; i < 20; ++i)
    for (const double z : {-0.5, 0.5}) points.push_back({std::cos(0.314159265 * i), std::sin(0.314159265 * i), z});
  const Hull drum = make_hull(points);
  EXPECT_EQ(drum.faces.size(), 22U);
  for (const double turn : {0.0, 0.157}) {  // 20 corners, and 40 of which most are kept
    BoxContact out;
    int axis = -1;
    hull_hull(make_solid(drum, {}), make_solid(drum, {0, 0, 0.99}, to_matrix(exp_rotation({0, 0, turn}))), axis, out);
    ASSERT_EQ(out.count, turn == 0 ? 20 : 32);
    double weights = 0;
    for (int i = 0; i < out.count; ++i) {
      EXPECT_NEAR(out.depth[i], 0.01, 1e-12);
      weights += out.weight[i];
    }
    EXPECT_NEAR(weights, 4, 1e-12);
  }
}

TEST(HullContact, DrumsOf64CornersMeet) {
  std::vector<Vec3> points;
  for (int i = 0; i < kMostFaceCorners; ++i)
    for (const double z : {-0.5, 0.5})
      points.push_back({std::cos(2 * std::numbers::pi * i / kMostFaceCorners),
                        std::sin(2 * std::numbers::pi * i / kMostFaceCorners), z});
  const Hull drum = make_hull(points);
  EXPECT_EQ(drum.faces.size(), 66U);
  for (const double turn : {0.0, std::numbers::pi / 64}) {  // 64 corners, and 128
    BoxContact out;
    int axis = -1;
    hull_hull(make_solid(drum, {}), make_solid(drum, {0, 0, 0.99}, to_matrix(exp_rotation({0, 0, turn}))), axis, out);
    ASSERT_EQ(out.count, 32);
    double weights = 0;
    Vec3 centre;
    for (int i = 0; i < out.count; ++i) {
      EXPECT_NEAR(out.depth[i], 0.01, 1e-12);
      EXPECT_NEAR(norm(Vec3{out.p[i].x, out.p[i].y, 0}), 1, 2e-3);  // 1 - cos(pi / 64) less at most
      weights += out.weight[i];
      centre += (0.25 * out.weight[i]) * out.p[i];
    }
    EXPECT_NEAR(weights, 4, 1e-12);
    EXPECT_LT(norm(Vec3{centre.x, centre.y, 0}), 0.02);
  }
}

TEST(HullContact, SphereMeetsFacesEdgesAndCorners) {
  const Hull cube = make_box_hull({1, 1, 1});
  Solid sphere;
  sphere.kind = Shape::Kind::Sphere;
  sphere.radius = 0.5;
  sphere.R = Mat3::identity();
  const auto meet = [&](const Vec3& p) {
    sphere.p = p;
    BoxContact out;
    sphere_hull(sphere, make_solid(cube, {}), false, out);
    return out;
  };
  const BoxContact face = meet({0.2, 0.3, 1.4}), edge = meet({0, 1.3, 1.3}), corner = meet({1.2, 1.2, 1.2}),
                   inside = meet({0.9, 0, 0}), none = meet({0, 0, 1.6}), beside = meet({0, 1.4, 1.4});
  ASSERT_EQ(face.count, 1);
  EXPECT_NEAR(face.depth[0], 0.1, 1e-12);
  EXPECT_NEAR(face.normal.z, -1, 1e-12);
  ASSERT_EQ(edge.count, 1);
  EXPECT_NEAR(edge.depth[0], 0.5 - 0.3 * std::sqrt(2.0), 1e-12);
  ASSERT_EQ(corner.count, 1);
  EXPECT_NEAR(corner.depth[0], 0.5 - 0.2 * std::sqrt(3.0), 1e-12);
  ASSERT_EQ(inside.count, 1);
  EXPECT_NEAR(inside.depth[0], 0.6, 1e-12);
  EXPECT_EQ(none.count, 0);
  EXPECT_NEAR(none.gap, 0.1, 1e-12);
  EXPECT_EQ(beside.count, 0);
  EXPECT_NEAR(beside.gap, 0.4 * std::sqrt(2.0) - 0.5, 1e-12);
}

TEST(PlaneContact, TakesTheVerticesBelow) {
  const double slope = 0.3;
  Solid plane;
  plane.kind = Shape::Kind::Plane;
  plane.R = to_matrix(exp_rotation({0, slope, 0}));
  const Vec3 n = plane.R.column(2);
  const Hull cube = make_box_hull({0.5, 0.5, 0.5});
  BoxContact out;
  plane_solid(plane, make_solid(cube, 0.49 * n, plane.R), false, out);
  ASSERT_EQ(out.count, 4);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(out.depth[i], 0.01, 1e-12);
  EXPECT_NEAR(dot(out.normal, n), 1, 1e-12);
  plane_solid(plane, make_box_solid({0.5, 0.5, 0.5}, 0.49 * n, plane.R), true, out);
  EXPECT_EQ(out.count, 4);
  EXPECT_NEAR(dot(out.normal, n), -1, 1e-12);
  plane_solid(plane, make_solid(cube, 0.8 * n, plane.R), false, out);
  EXPECT_EQ(out.count, 0);
  EXPECT_NEAR(out.gap, 0.3, 1e-12);
}

}  // namespace
}  // namespace topple::mbs
