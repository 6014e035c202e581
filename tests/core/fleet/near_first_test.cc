#include "core/fleet/near_first.h"

#include <gtest/gtest.h>

namespace vantage::fleet {
namespace {

void Refuse(NearFirst& near, int count, double away) {
  for (int i = 0; i < count; ++i) near.Refused(away);
}

TEST(NearFirstTest, AllAreJudgedWhileSomethingRegistersInADozen) {
  NearFirst near(0.1);
  Refuse(near, 11, 4);
  EXPECT_FALSE(near.Change(false));
  EXPECT_TRUE(near.Take());
  Refuse(near, 20, 4);
  EXPECT_FALSE(near.Change(false)) << "further views, after one was taken";
  EXPECT_FALSE(near.Change(true));
  EXPECT_TRUE(near.all());
}

TEST(NearFirstTest, HalvesTheDistanceUntilOneRegistersAndLooksTwiceAsFar) {
  NearFirst near(0.1);
  Refuse(near, 7, 8);
  Refuse(near, 5, 2);
  EXPECT_TRUE(near.Change(false));
  EXPECT_EQ(near.within(), 4);
  EXPECT_FALSE(near.Change(false));
  EXPECT_TRUE(near.Change(true)) << "none is left";
  EXPECT_EQ(near.within(), 2);
  EXPECT_FALSE(near.Take());
  EXPECT_EQ(near.within(), 4);
  Refuse(near, 12, 3);
  EXPECT_TRUE(near.Change(false));
  EXPECT_EQ(near.within(), 2) << "nothing better: back to what was found";
  EXPECT_TRUE(near.Take());
  EXPECT_TRUE(near.Change(true)) << "further views may lie anywhere";
  EXPECT_TRUE(near.all());
  EXPECT_FALSE(near.Change(true));
}

TEST(NearFirstTest, WhereNothingRegistersNearTheRestIsJudgedOnce) {
  NearFirst near(0.5);
  Refuse(near, 12, 4);
  int changes = 0;
  while (near.Change(true)) ++changes;
  EXPECT_EQ(changes, 3) << "2 m, 1 m, all";
  EXPECT_TRUE(near.all());
  Refuse(near, 30, 4);
  EXPECT_FALSE(near.Change(false));
}

}  // namespace
}  // namespace vantage::fleet
