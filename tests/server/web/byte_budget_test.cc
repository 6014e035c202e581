#include "server/web/byte_budget.h"

#include <gtest/gtest.h>

#include <utility>

namespace vantage::web {
namespace {

TEST(ByteBudget, IsNeverExceededAndGetsEverythingBack) {
  ByteBudget budget(100);
  {
    ByteBudget::Share first;
    EXPECT_TRUE(first.GrowTo(budget, 40));
    EXPECT_TRUE(first.GrowTo(budget, 60));
    EXPECT_TRUE(first.GrowTo(budget, 10));  // has that already
    EXPECT_EQ(first.bytes(), 60);
    EXPECT_EQ(budget.left(), 40);
    ByteBudget::Share second;
    EXPECT_FALSE(second.GrowTo(budget, 41));
    EXPECT_EQ(budget.left(), 40);
    EXPECT_TRUE(second.GrowTo(budget, 40));
    EXPECT_FALSE(first.GrowTo(budget, 61));
    EXPECT_EQ(first.bytes(), 60);
    ByteBudget::Share moved = std::move(first);
    EXPECT_EQ(budget.left(), 0);
    moved = ByteBudget::Share();
    EXPECT_EQ(budget.left(), 60);
  }
  EXPECT_EQ(budget.left(), 100);
}

}  // namespace
}  // namespace vantage::web
