#include "core/planning/plan/copy_on_write_vector.h"

#include <gtest/gtest.h>

#include <utility>
#include <vector>

namespace vantage::planning {
namespace {

std::vector<int> Elements(const CopyOnWriteVector<int>& values) {
  return {values.begin(), values.end()};
}

TEST(CopyOnWriteVectorTest, SharesUntilACopyIsChanged) {
  CopyOnWriteVector<int> values(std::vector<int>{1, 2, 3});
  const CopyOnWriteVector<int> before = values;
  EXPECT_EQ(before.data(), values.data());
  EXPECT_TRUE(before == values);
  values.Mutable()[1] = 5;
  EXPECT_NE(before.data(), values.data());
  EXPECT_EQ(Elements(before), (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(Elements(values), (std::vector<int>{1, 5, 3}));
  EXPECT_FALSE(before == values);
  // What nobody shares is changed where it is.
  const int* const own = values.data();
  values.Mutable()[0] = 4;
  EXPECT_EQ(values.data(), own);
}

TEST(CopyOnWriteVectorTest, IsAVectorOtherwise) {
  CopyOnWriteVector<int> values;
  EXPECT_TRUE(values.empty());
  EXPECT_EQ(values.begin(), values.end());
  for (int i = 0; i < 100; ++i) {
    const CopyOnWriteVector<int> before = values;
    values.push_back(i);
    ASSERT_EQ(before.size() + 1, values.size());
    ASSERT_EQ(values.back(), i);
  }
  EXPECT_EQ(values.front(), 0);
  EXPECT_EQ(values[63], 63);
  const CopyOnWriteVector<int> longer = values;
  values.resize(3);
  values.resize(5, 7);
  EXPECT_EQ(Elements(values), (std::vector<int>{0, 1, 2, 7, 7}));
  EXPECT_EQ(longer.size(), 100u);
}

TEST(CopyOnWriteVectorTest, MovesLeaveNothing) {
  CopyOnWriteVector<int> values(std::vector<int>{1, 2, 3});
  CopyOnWriteVector<int> moved = std::move(values);
  EXPECT_EQ(Elements(moved), (std::vector<int>{1, 2, 3}));
  EXPECT_EQ(values.size(), 0u);  // NOLINT: that is what is tested
  values = std::move(moved);
  EXPECT_EQ(Elements(values), (std::vector<int>{1, 2, 3}));
  const CopyOnWriteVector<int>& same = values;
  values = same;
  EXPECT_EQ(values.size(), 3u);
}

}  // namespace
}  // namespace vantage::planning
