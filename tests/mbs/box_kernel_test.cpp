#include "mbs/box_kernel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>
#include <vector>

#include "base/aligned.h"
#include "mbs/boxes.h"

namespace topple::mbs {
namespace {

Solid make_solid(const Vec3& half, const Vec3& p, const Vec3& turn = {}) {
  Solid s;
  s.p = p;
  s.half = half;
  s.R = to_matrix(exp_rotation(turn));
  s.reach = norm(half);
  return s;
}

struct Corner {
  Vec3 p;
  double depth = 0, weight = 0;
};

/// Cuts a polygon by the half-space dot(n, p) <= offset.
std::vector<Vec3> clip(const std::vector<Vec3>& in, const Vec3& n, double offset) {
  std::vector<Vec3> out;
  for (size_t i = 0; i < in.size(); ++i) {
    const Vec3 &p = in[i], &q = in[(i + 1) % in.size()];
    const double dp = dot(n, p) - offset, dq = dot(n, q) - offset;
    if (dp <= 0) out.push_back(p);
    if ((dp < 0 && dq > 0) || (dp > 0 && dq < 0)) out.push_back(p + (dp / (dp - dq)) * (q - p));
  }
  return out;
}

/// The common area of the faces that look at each other along n, by Sutherland and Hodgman.
std::vector<Corner> find_corners(const Solid& a, const Solid& b, const Vec3& n) {
  const auto side_of = [&](const Solid& s) {
    int side = 0;
    for (int i = 1; i < 3; ++i)
      if (std::abs(dot(s.R.column(i), n)) > std::abs(dot(s.R.column(side), n))) side = i;
    return side;
  };
  const int sa = side_of(a), sb = side_of(b);
  const double along_a = dot(a.R.column(sa), n), along_b = dot(b.R.column(sb), n);
  const Vec3 n_a = std::copysign(1.0, along_a) * a.R.column(sa), p_a = a.p + a.half[sa] * n_a;
  const Vec3 p_b = b.p - std::copysign(b.half[sb], along_b) * b.R.column(sb);
  const Vec3 du = b.half[(sb + 1) % 3] * b.R.column((sb + 1) % 3), dv = b.half[(sb + 2) % 3] * b.R.column((sb + 2) % 3);
  std::vector<Vec3> polygon{p_b + du + dv, p_b - du + dv, p_b - du - dv, p_b + du - dv};
  for (int k = 1; k <= 2; ++k) {
    const int along = (sa + k) % 3, other = (sa + 3 - k) % 3;
    const Vec3 t = cross(n, a.R.column(along));
    const double at = dot(t, p_a), half = std::abs(a.half[other] * dot(t, a.R.column(other)));
    polygon = clip(polygon, t, at + half);
    if (!polygon.empty()) polygon = clip(polygon, -t, -at + half);
  }
  std::vector<double> length(polygon.size());
  double perimeter = 0;
  for (size_t i = 0; i < polygon.size(); ++i)
    perimeter += length[i] = norm(cross(n, polygon[(i + 1) % polygon.size()] - polygon[i]));
  std::vector<Corner> out;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const double depth = dot(n_a, p_a - polygon[i]) / std::abs(along_a);
    if (depth <= 0) continue;
    const double both = length[(i + polygon.size() - 1) % polygon.size()] + length[i];
    out.push_back({polygon[i] + (0.5 * depth) * n, depth, 2 * both / perimeter});
  }
  return out;
}

/// What points do together: the sum of weight, weight times depth, and both moments of it.
struct Sums {
  double weight = 0, pressed = 0;
  Vec3 first;
  double second = 0;
  void add(const Vec3& p, double depth, double w) {
    weight += w;
    pressed += w * depth;
    first += (w * depth) * p;
    second += w * depth * dot(p, p);
  }
};

void expect_like_reference(const Solid& a, const Solid& b, const BoxContact& found, double tolerance) {
  Sums sums, expected;
  for (int i = 0; i < found.count; ++i) sums.add(found.p[i], found.depth[i], found.weight[i]);
  for (const Corner& c : find_corners(a, b, found.normal)) expected.add(c.p, c.depth, c.weight);
  EXPECT_NEAR(sums.weight, expected.weight, tolerance);
  EXPECT_NEAR(sums.pressed, expected.pressed, tolerance);
  EXPECT_NEAR(norm(sums.first - expected.first), 0, tolerance);
  EXPECT_NEAR(sums.second, expected.second, tolerance);
}

TEST(BoxKernel, FindsTheCornersOfTheCommonArea) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  int touching = 0, apart = 0;
  for (int i = 0; i < 20000; ++i) {
    const auto any = [&] { return Vec3{unit(random), unit(random), unit(random)}; };
    const Vec3 half_a = Vec3{1, 1, 1} + 0.9 * any(), half_b = Vec3{1, 1, 1} + 0.9 * any();
    const double turn = i % 3 == 0 ? 1 : i % 3 == 1 ? 1e-2 : 1e-5;
    const Solid a = make_solid(half_a, any(), turn * any()), b = make_solid(half_b, a.p + 1.6 * any(), turn * any());
    BoxContact found;
    int axis = 0;
    find_contact(a, b, axis, found);
    if (found.count == 0) {
      ++apart;
      continue;
    }
    ++touching;
    EXPECT_NEAR(norm(found.normal), 1, 1e-12);
    EXPECT_GE(dot(found.normal, b.p - a.p), 0);
    // two corners may fall together within 1e-12 of an edge
    expect_like_reference(a, b, found, 1e-9);
    if (HasFailure()) FAIL() << "case " << i;
  }
  EXPECT_GT(touching, 5000);
  EXPECT_GT(apart, 2000);
}

TEST(BoxKernel, LosesNoCornerWhereEdgesFallTogether) {
  // boxes of a frame share faces, edges and corners to the last bit, or nearly
  for (const double shift : {0.0, 1e-16, 1e-14, 3e-13, 1e-11, 1e-9, 1e-6, 1e-3})
    for (const Vec3& direction : {Vec3{1, 0, 0}, Vec3{0, 1, 0}, Vec3{1, 1, 0}, Vec3{1, -0.3, 0}})
      for (const double width : {0.5, 1.0, 2.0}) {
        const Solid a = make_solid({1, 2, 0.5}, {}),
                    b = make_solid({width, 2, 0.5}, shift * direction + Vec3{0, 0, 0.99});
        BoxContact found;
        int axis = 0;
        find_contact(a, b, axis, found);
        ASSERT_GE(found.count, 4);
        EXPECT_EQ(found.normal, (Vec3{0, 0, 1}));
        double weight = 0;
        for (int i = 0; i < found.count; ++i) {
          weight += found.weight[i];
          EXPECT_NEAR(found.depth[i], 0.01, 1e-12);
        }
        EXPECT_NEAR(weight, 4, 1e-9);
        SCOPED_TRACE(testing::Message() << "shifted by " << shift << " along " << direction.x << ' ' << direction.y
                                        << ", width " << width);
        expect_like_reference(a, b, found, 1e-9);
      }
}

TEST(BoxKernel, NeverClaimsAGapThatIsNotThere) {
  // the gap is a lower bound of the distance, which the nearest of many points bounds from above
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    const auto any = [&] { return Vec3{unit(random), unit(random), unit(random)}; };
    const Solid a = make_solid({0.5, 0.3, 0.8}, {}, any()), b = make_solid({0.2, 0.6, 0.4}, 1.5 * any(), any());
    BoxContact found;
    int axis = 0;
    find_contact(a, b, axis, found);
    if (found.count > 0) continue;
    // alternating projections find the distance of two convex bodies
    Vec3 p = a.p;
    const auto nearest = [](const Solid& s, const Vec3& to) {
      Vec3 local = transpose_times(s.R, to - s.p);
      for (int k = 0; k < 3; ++k) local[k] = std::clamp(local[k], -s.half[k], s.half[k]);
      return s.p + s.R * local;
    };
    Vec3 q;
    for (int k = 0; k < 300; ++k) q = nearest(b, p), p = nearest(a, q);
    ASSERT_LE(found.gap, norm(p - q) + 1e-9) << i;
  }
}

TEST(BoxKernelReplay, ALaneDoesNotDependOnTheOthers) {
  using namespace kernel;
  const size_t W = lanes();
  std::mt19937 random(11);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int round = 0; round < 200; ++round) {
    AlignedVector<double> boxes(2 * kBoxFields * W), all(kBoxAnswerFields * W, 0);
    std::vector<std::uint32_t> a(W), b(W);
    std::vector<Solid> as, bs;
    for (size_t l = 0; l < W; ++l) {
      const auto any = [&] { return Vec3{unit(random), unit(random), unit(random)}; };
      as.push_back(make_solid({0.7, 0.5, 1}, any(), any()));
      bs.push_back(make_solid({1, 0.4, 0.6}, as.back().p + 1.4 * any(), any()));
      write_box(as[l], &boxes[2 * l * kBoxFields]);
      write_box(bs[l], &boxes[(2 * l + 1) * kBoxFields]);
      a[l] = static_cast<std::uint32_t>(2 * l), b[l] = a[l] + 1;
    }
    find_box_contacts({1, boxes.data(), a.data(), b.data(), all.data()});
    for (size_t l = 0; l < W; ++l) {
      AlignedVector<double> one(kBoxAnswerFields, 0);
      find_box_contacts_singly({1, boxes.data(), &a[l], &b[l], one.data()});
      BoxContact x, y;
      read_box_contact(all.data() + l, W, x);
      read_box_contact(one.data(), 1, y);
      ASSERT_EQ(x.count, y.count);
      EXPECT_EQ(std::memcmp(x.p, y.p, static_cast<size_t>(x.count) * sizeof(Vec3)), 0);
      EXPECT_EQ(std::memcmp(x.depth, y.depth, static_cast<size_t>(x.count) * sizeof(double)), 0);
      EXPECT_EQ(std::memcmp(x.weight, y.weight, static_cast<size_t>(x.count) * sizeof(double)), 0);
      if (x.count > 0) { EXPECT_EQ(x.normal, y.normal); }
    }
  }
}

}  // namespace
}  // namespace topple::mbs
