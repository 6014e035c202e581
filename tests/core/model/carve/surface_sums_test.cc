// Packed sums, against the list that they were packed from.
#include "core/model/carve/surface_sums.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>
#include <random>
#include <vector>

namespace vantage::model {
namespace {

void ExpectSame(const SurfaceSums& found, const SurfaceSums& expected) {
  EXPECT_EQ(found.samples, expected.samples);
  EXPECT_EQ(found.points, expected.points);
  EXPECT_EQ(found.sample_sum, expected.sample_sum);
  EXPECT_EQ(found.point_sum, expected.point_sum);
  EXPECT_EQ(found.product_sum, expected.product_sum);
}

void ExpectSame(const PackedSums& found, const std::vector<SurfaceSums>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  const PackedSums::View view = found.view();
  ASSERT_EQ(view.size(), expected.size());
  for (size_t i = 0; i < expected.size(); ++i) {
    ExpectSame(found[i], expected[i]);
    ExpectSame(view[i], expected[i]);
  }
}

// Of that many points, anywhere in the voxel, or all in its last corner.
SurfaceSums OfPoints(int points, bool last_corner, std::mt19937_64& random) {
  SurfaceSums sums;
  for (int i = 0; i < points; ++i) {
    std::array<uint32_t, 3> offset;
    for (uint32_t& o : offset) {
      o = last_corner ? SurfaceSums::kUnits - 1
                      : static_cast<uint32_t>(random() % SurfaceSums::kUnits);
    }
    sums.Add(offset, random() % 2 == 0);
  }
  return sums;
}

TEST(PackedSumsTest, ComeBackToTheBit) {
  std::mt19937_64 random(1);
  for (const bool last_corner : {false, true}) {
    for (const int most : {1, 63, 64, 65, 255, 256, 4103, 4105, 70'000}) {
      std::vector<SurfaceSums> sums;
      sums.reserve(10);
      for (int i = 0; i < 9; ++i) {
        sums.push_back(OfPoints(1 + static_cast<int>(random() % 9), last_corner, random));
      }
      sums.push_back(OfPoints(most, last_corner, random));
      ExpectSame(PackedSums(sums), sums);
      PackedSums grown;  // which is packed anew on the way
      for (const SurfaceSums& each : sums) grown.push_back(each);
      grown.push_back(sums.front());
      sums.push_back(sums.front());
      ExpectSame(grown, sums);
    }
  }
  EXPECT_TRUE(PackedSums().empty());
  EXPECT_TRUE(PackedSums(std::vector<SurfaceSums>()).view().empty());
}

// What a damaged file says is kept as it is, too: each part may be the one that needs room.
TEST(PackedSumsTest, HoldAnyNumbers) {
  constexpr uint64_t kMost = std::numeric_limits<uint64_t>::max();
  const auto check = [](auto&& change) {
    for (const uint64_t value : {uint64_t{255}, uint64_t{256}, uint64_t{65'535}, uint64_t{65'536},
                                 (uint64_t{1} << 32) - 1, uint64_t{1} << 32, kMost}) {
      std::vector<SurfaceSums> sums(3);
      change(sums[1], value);
      ExpectSame(PackedSums(sums), sums);
    }
  };
  check([](SurfaceSums& s, uint64_t value) { s.samples = static_cast<uint32_t>(value); });
  check([](SurfaceSums& s, uint64_t value) { s.points = static_cast<uint32_t>(value); });
  check([](SurfaceSums& s, uint64_t value) { s.sample_sum[2] = value; });
  check([](SurfaceSums& s, uint64_t value) { s.point_sum[0] = value; });
  check([](SurfaceSums& s, uint64_t value) { s.product_sum[5] = value; });
}

TEST(PackedSumsTest, OfFewPointsAreSmall) {
  std::mt19937_64 random(2);
  std::vector<SurfaceSums> sums;
  sums.reserve(101);
  for (int i = 0; i < 100; ++i) sums.push_back(OfPoints(64, true, random));
  EXPECT_EQ(PackedSums(sums).bytes(), 100u * 38);
  sums.push_back(OfPoints(4103, true, random));
  EXPECT_EQ(PackedSums(sums).bytes(), 101u * 52);
}

}  // namespace
}  // namespace vantage::model
