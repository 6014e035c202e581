#include "client/study/median.h"

#include <gtest/gtest.h>

namespace vantage::study {
namespace {

TEST(MedianTest, OfAnyNumberOfValues) {
  EXPECT_EQ(Median({}), 0);
  EXPECT_EQ(Median({3, 1, 2}), 2);
  EXPECT_EQ(Median({4, 1, 2, 3}), 2.5);
}

}  // namespace
}  // namespace vantage::study
