// Which of the rays that dropped out are kept.
#include "core/model/merge/dropouts.h"

#include <gtest/gtest.h>

#include <vector>

namespace vantage::model {
namespace {

TEST(NearestDropouts, KeepsTheNearestOfADirection) {
  const Eigen::Vector3f at(1, 2, 3);
  const auto along = [&](float x, float y, float range) {
    return Eigen::Vector3f(at + range * Eigen::Vector3f(x, y, 0).normalized());
  };
  const std::vector<Eigen::Vector3f> kept = NearestDropouts(
      at, {along(1, 0, 5), along(1, 0.01f, 2), along(0, 1, 9), along(1, -0.01f, 3)});
  ASSERT_EQ(kept.size(), 2u);
  EXPECT_EQ(kept[0], along(1, 0.01f, 2));
  EXPECT_EQ(kept[1], along(0, 1, 9));
}

}  // namespace
}  // namespace vantage::model
