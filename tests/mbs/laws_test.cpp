#include "mbs/laws.h"

#include <gtest/gtest.h>

#include "mbs/zone_law.h"
#include "models.h"

namespace topple::mbs {
namespace {

TEST(Laws, CopiesShareWhatIsCompiledUntilOneIsEdited) {
  Model one;
  add_law(one, test::plastic_hinge(1e5));
  add_law(one, test::plastic_hinge(2e5));
  Model other = one;
  EXPECT_EQ(other.laws.shared(0).identity(), one.laws.shared(0).identity());
  EXPECT_EQ(other.laws.shared(0).compile(), one.laws.shared(0).compile());
  other.laws.edit(0, [](ZoneLaw& law) { law.damage_share = 0.25; });
  EXPECT_EQ(other.laws[0].damage_share, 0.25);
  EXPECT_NE(one.laws[0].damage_share, 0.25);
  EXPECT_EQ(other.laws.shared(0).compile()->damage_share, 0.25);
  EXPECT_NE(one.laws.shared(0).compile()->damage_share, 0.25);
  EXPECT_EQ(other.laws.shared(1).identity(), one.laws.shared(1).identity());
}

TEST(Laws, OnlyThoseThatAreGoodAreNotCheckedAgain) {
  Model model;
  ZoneLaw bad;
  bad.crush_length = -1;
  add_law(model, test::plastic_hinge(1e5));
  add_law(model, bad);
  for (int round = 0; round < 2; ++round) EXPECT_ANY_THROW(check_model(model));
  EXPECT_TRUE(model.laws.shared(0).is_checked());
  EXPECT_FALSE(model.laws.shared(1).is_checked());
  model.laws.edit(1, [](ZoneLaw& law) { law.crush_length = 1; });
  EXPECT_NO_THROW(check_model(model));
}

}  // namespace
}  // namespace topple::mbs
