#include "uncertainty/fuzzy_number.h"

#include <gtest/gtest.h>

#include <limits>

#include "base/error.h"

namespace topple::uncertainty {
namespace {

TEST(FuzzyNumber, TriangularHasStraightBranches) {
  const FuzzyNumber f = make_triangular(10, 25, 45);
  EXPECT_EQ(f.support(), (AlphaCut{0, 10, 45}));
  EXPECT_EQ(f.core(), (AlphaCut{1, 25, 25}));
  EXPECT_EQ(f.cut(0.5), (AlphaCut{0.5, 17.5, 35}));
  EXPECT_DOUBLE_EQ(f.membership(17.5), 0.5);
  EXPECT_DOUBLE_EQ(f.membership(40), 0.25);
  EXPECT_EQ(f.membership(10), 0);
  EXPECT_EQ(f.membership(25), 1);
  EXPECT_EQ(f.membership(9.9), 0);
  EXPECT_EQ(f.membership(45.1), 0);
  EXPECT_EQ(f.width(), 35);
}

TEST(FuzzyNumber, FeetWithoutMembershipAreNotInTheSupport) {
  const FuzzyNumber f = make_polygonal({{0, 0}, {0.5, 0}, {1, 1}, {2, 0}, {3, 0}});
  EXPECT_EQ(f.support(), (AlphaCut{0, 0.5, 2}));
  EXPECT_EQ(f.cut(0), (AlphaCut{0, 0.5, 2}));
  EXPECT_DOUBLE_EQ(f.membership(0.75), 0.5);
  EXPECT_EQ(f.membership(0.2), 0);
  const FuzzyNumber tabulated({{0, 0, 3}, {0, 0.5, 2}, {1, 1, 1}});
  EXPECT_EQ(tabulated.support(), (AlphaCut{0, 0.5, 2}));
}

TEST(FuzzyNumber, TrapezoidalKeepsItsCore) {
  const FuzzyNumber f = make_trapezoidal(0, 1, 3, 7);
  EXPECT_EQ(f.core(), (AlphaCut{1, 1, 3}));
  EXPECT_EQ(f.centre(), 2);
  EXPECT_EQ(f.membership(1), 1);
  EXPECT_EQ(f.membership(2.5), 1);
  EXPECT_DOUBLE_EQ(f.membership(5), 0.5);
  EXPECT_EQ(f.cut(0.25), (AlphaCut{0.25, 0.25, 6}));
}

TEST(FuzzyNumber, CrispNumberIsOnePoint) {
  const FuzzyNumber f(3.0);
  EXPECT_EQ(f.cut(0.3), (AlphaCut{0.3, 3, 3}));
  EXPECT_EQ(f.membership(3), 1);
  EXPECT_EQ(f.membership(3.1), 0);
}

TEST(FuzzyNumber, PolygonalHasBranchesOfItsOwnCorners) {
  const FuzzyNumber f = make_polygonal({{0, 0}, {1, 0.6}, {2, 1}, {3, 1}, {5, 0.2}, {9, 0}});
  EXPECT_DOUBLE_EQ(f.membership(0.5), 0.3);
  EXPECT_DOUBLE_EQ(f.membership(1.5), 0.8);
  EXPECT_EQ(f.membership(2.5), 1);
  EXPECT_DOUBLE_EQ(f.membership(4), 0.6);
  EXPECT_DOUBLE_EQ(f.membership(7), 0.1);
  EXPECT_DOUBLE_EQ(f.cut(0.3).left, 0.5);
  EXPECT_DOUBLE_EQ(f.cut(0.1).right, 7);
  EXPECT_DOUBLE_EQ(f.cut(0.6).right, 4);
}

TEST(FuzzyNumber, StepsTakeTheWiderCutAndTheUpperDegree) {
  // level at 0.5 from 1 to 2 on the left; upright on the right
  const FuzzyNumber f = make_polygonal({{0, 0}, {1, 0.5}, {2, 0.5}, {3, 1}, {4, 1}, {4, 0}});
  EXPECT_EQ(f.cut(0.5).left, 1);
  EXPECT_DOUBLE_EQ(f.cut(0.500001).left, 2.000002);
  EXPECT_DOUBLE_EQ(f.membership(1.5), 0.5);
  EXPECT_EQ(f.membership(4), 1);
  EXPECT_EQ(f.cut(0).right, 4);
}

TEST(FuzzyNumber, MembershipOfACutsEndIsItsAlpha) {
  const FuzzyNumber f({{0, -3, 8}, {0.3, -1, 6}, {0.7, 0, 2.5}, {1, 1, 2}});
  for (double a = 0; a <= 1; a += 0.0625) {
    EXPECT_NEAR(f.membership(f.cut(a).left), a, 1e-15) << "round-off";
    EXPECT_NEAR(f.membership(f.cut(a).right), a, 1e-15);
  }
}

TEST(FuzzyNumber, RefusesWhatIsNone) {
  EXPECT_THROW(make_triangular(2, 1, 3), InputError);
  EXPECT_THROW(make_triangular(0, 4, 3), InputError);
  EXPECT_THROW(make_trapezoidal(0, 2, 1, 3), InputError);
  EXPECT_THROW(make_triangular(0, std::numeric_limits<double>::quiet_NaN(), 3), InputError);
  EXPECT_THROW(make_triangular(1e308, 1.2e308, 1.7e308), InputError) << "its middle would be infinite";
  EXPECT_THROW(make_triangular(-1e308, 0, 1e308), InputError) << "its width would be infinite";
  const FuzzyNumber large = make_trapezoidal(-4e307, 3e307, 4e307, 4e307);
  EXPECT_DOUBLE_EQ(large.centre(), 3.5e307);
  EXPECT_DOUBLE_EQ(large.width(), 8e307);
  EXPECT_THROW(FuzzyNumber(std::vector<AlphaCut>{{0, 0, 1}}), InputError) << "one cut";
  EXPECT_THROW(FuzzyNumber(std::vector<AlphaCut>{{0.1, 0, 1}, {1, 0, 1}}), InputError) << "no support";
  EXPECT_THROW(FuzzyNumber(std::vector<AlphaCut>{{0, 0, 1}, {0.5, -1, 1}, {1, 0, 1}}), InputError) << "not nested";
  EXPECT_THROW(FuzzyNumber(std::vector<AlphaCut>{{0, 0, 5}, {0.5, 1, 4}, {0.2, 2, 3}, {1, 2, 2}}), InputError);
  EXPECT_THROW(make_polygonal({{0, 0}, {1, 0.9}, {2, 0}}), InputError) << "does not reach 1";
  EXPECT_THROW(make_polygonal({{0, 0.1}, {1, 1}, {2, 0}}), InputError) << "does not start at 0";
  EXPECT_THROW(make_polygonal({{0, 0}, {1, 1}, {2, 0.5}, {3, 1}, {4, 0}}), InputError) << "two cores";
  EXPECT_THROW(make_polygonal({{0, 0}, {1, 1}, {2, 0.2}, {3, 0.5}, {4, 0}}), InputError) << "not convex";
  EXPECT_THROW(make_polygonal({{0, 0}, {2, 1}, {1, 0}}), InputError) << "x falls";
  EXPECT_THROW(make_triangular(0, 1, 2).cut(1.1), InputError);
}

}  // namespace
}  // namespace topple::uncertainty
