#include "uncertainty/starts.h"

#include <gtest/gtest.h>

namespace topple::uncertainty {
namespace {

// Two valleys on a grid of a line with their bottoms at 0.2 and 0.7, the second one higher.
RankedPlaces make_valleys() { return {1, {0.2, 0.1, 0.3, 0.7, 0.0, 0.4, 0.6, 0.8, 0.9, 0.5, 1.0}}; }

TEST(RankedPlaces, KnowBottomsByTheirNeighbours) {
  const RankedPlaces places = make_valleys();
  ASSERT_EQ(places.size(), 11u);
  for (std::size_t k = 0; k < places.size(); ++k)
    EXPECT_EQ(places.is_bottom(k), places.at[k] == 0.2 || places.at[k] == 0.7) << places.at[k];
  EXPECT_FALSE((RankedPlaces{1, {0.5, 0.4}}.is_bottom(0))) << "too few neighbours";
}

TEST(RankedPlaces, AreChosenApart) {
  const RankedPlaces places = make_valleys();
  const auto choose = [&](std::vector<double> taken, double least, std::size_t count) {
    std::vector<double> at;
    for (const std::size_t k : choose_apart(places, taken, least, count, [](std::size_t) { return true; }))
      at.push_back(places.at[k]);
    return at;
  };
  EXPECT_EQ(choose({}, 0.25, 3), (std::vector{0.2, 0.7, 1.0}));
  EXPECT_EQ(choose({}, 0.25, 1), (std::vector{0.2}));
  EXPECT_EQ(choose({0.25}, 0.16, 2), (std::vector{0.7, 0.0}));
  std::vector<double> taken;
  const auto chosen = choose_apart(places, taken, 0.25, 9, [&](std::size_t k) { return places.is_bottom(k); });
  EXPECT_EQ(chosen, (std::vector<std::size_t>{0, 3}));
  EXPECT_EQ(taken, (std::vector{0.2, 0.7}));
}

TEST(RankedPlaces, AreMeasuredByTheLargestCoordinate) {
  const RankedPlaces places{2, {0, 0, 0.1, 0.3, 0.1, 0.35, 0.5, 0}};
  EXPECT_DOUBLE_EQ(places.calc_distance(&places.at[0], &places.at[2]), 0.3);
  std::vector<double> taken;
  EXPECT_EQ(choose_apart(places, taken, 0.29, 4, [](std::size_t) { return true; }),
            (std::vector<std::size_t>{0, 1, 3}));
}

}  // namespace
}  // namespace topple::uncertainty
