#include "fem/contact_cells.h"

#include <gtest/gtest.h>

#include <random>

namespace topple::fem {
namespace {

std::vector<ContactBox> make_boxes(int count, double largest) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> at(-10, 10), size(0, largest);
  std::vector<ContactBox> boxes(static_cast<size_t>(count));
  for (ContactBox& box : boxes) {
    const Vec3 p{at(random), 0.3 * at(random), at(random)};
    box.add(p, 0), box.add(p + Vec3{size(random), size(random), size(random)}, 0);
  }
  boxes[3] = {};                       // of nothing
  boxes[5].add({400, -300, 200}, 30);  // far outside
  boxes[9].add({390, -290, 210}, 5);
  return boxes;
}

TEST(ContactCells, FindTheBoxesThatMeetAsLookingAtAllPairsDoes) {
  for (const double largest : {0.3, 2.0, 15.0}) {
    const std::vector<ContactBox> boxes = make_boxes(400, largest);
    ContactBox bounds;
    bounds.add({-8, -2, -9}, 0), bounds.add({9, 3, 8}, 0);
    const ContactCells cells(boxes, bounds, 0.5);
    size_t count = 0;
    std::vector<std::uint32_t> found, expected;
    for (std::uint32_t a = 0; a < boxes.size(); ++a) {
      expected.clear();
      for (std::uint32_t b = 0; b < a; ++b)
        if (boxes[a].meets(boxes[b])) expected.push_back(b);
      cells.find_before(boxes, a, found);
      EXPECT_EQ(found, expected) << a;
      count += found.size();
    }
    EXPECT_GT(count, 0U);
  }
}

TEST(ContactCells, FindTheBoxesThatMeetAnyOther) {
  const std::vector<ContactBox> boxes = make_boxes(400, 2);
  ContactBox bounds;
  bounds.add({-8, -2, -9}, 0), bounds.add({9, 3, 8}, 0);
  const ContactCells cells(boxes, bounds, 0.5);
  std::vector<ContactBox> others = make_boxes(60, 15);
  for (ContactBox& box : others)
    if (!box.is_empty()) box.add(box.low + Vec3{0.1, 0.2, 0.3}, 0.05);
  size_t count = 0;
  std::vector<std::uint32_t> found, expected;
  for (const ContactBox& other : others) {
    expected.clear();
    for (std::uint32_t b = 0; b < boxes.size(); ++b)
      if (other.meets(boxes[b])) expected.push_back(b);
    cells.find_met(boxes, other, found);
    EXPECT_EQ(found, expected);
    count += found.size();
  }
  EXPECT_GT(count, 100U);
}

TEST(ContactCells, GapIsTheDistanceOfTheNearestPoints) {
  ContactBox a, b;
  a.add({0, 0, 0}, 1), b.add({5, 0, 0}, 1);
  EXPECT_DOUBLE_EQ(a.calc_gap(b), 3);
  b = {}, b.add({5, -6, 0}, 1);
  EXPECT_DOUBLE_EQ(a.calc_gap(b), 5);
  EXPECT_DOUBLE_EQ(b.calc_gap(a), 5);
  b = {}, b.add({0.5, 0.5, 1.5}, 1);
  EXPECT_EQ(a.calc_gap(b), 0);
}

}  // namespace
}  // namespace topple::fem
