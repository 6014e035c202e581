#include "core/planning/feasibility/storeys.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>
#include <vector>

namespace vantage::planning {
namespace {

constexpr double kVoxel = 0.05;

// Floors of a site of 10 x 5 m, in m.
class StoreysTest : public ::testing::Test {
 protected:
  StoreysTest() {
    model::VoxelBox box;
    box.max = {200, 100, 1};
    floor_ = FloorColumns(box);
  }
  void Add(double x0, double y0, double x1, double y1, double z, double slope = 0) {
    for (int y = static_cast<int>(y0 / kVoxel); y < static_cast<int>(y1 / kVoxel); ++y) {
      for (int x = static_cast<int>(x0 / kVoxel); x < static_cast<int>(x1 / kVoxel); ++x) {
        const auto height = static_cast<float>(z + slope * (x * kVoxel - x0));
        placed_.push_back({floor_.ColumnOf(x, y), {height, FloorSource::kMeasured}});
      }
    }
  }
  Storeys Find() {
    floor_.Assign(placed_);
    return Storeys::Of(floor_, kVoxel);
  }

  FloorColumns floor_;
  std::vector<PlacedFloor> placed_;
};

TEST_F(StoreysTest, AreLevelFloorOverOneAnotherAndStairsDoNotMergeThem) {
  Add(0, 0, 10, 5, 0);
  Add(0, 0, 5, 5, 3);
  for (int k = 1; k < 18; ++k) Add(5 + 0.28 * (18 - k), 0, 5 + 0.28 * (19 - k), 2, k / 6.0);
  const Storeys storeys = Find();
  ASSERT_EQ(storeys.count(), 2u);
  EXPECT_NEAR(*storeys.Height(0), 0, 0.03);
  EXPECT_NEAR(*storeys.Height(1), 3, 0.03);
  for (const auto& [z, storey] :
       {std::pair{-1.0, 0}, {0.0, 0}, {0.75, 0}, {2.4, 0}, {2.6, 1}, {3.0, 1}, {3.3, 1}}) {
    EXPECT_EQ(storeys.At(z), storey) << z;
  }
}

TEST_F(StoreysTest, ALandingASplitLevelAndARampAreNone) {
  Add(0, 0, 4, 5, 0);
  Add(4, 0, 6, 5, 1.2);           // half a storey up, large
  Add(6, 0, 7.5, 2, 2.4);         // a landing
  Add(7.5, 0, 10, 5, 2.5, 0.25);  // a ramp, with more than 4 m2 at any height
  EXPECT_EQ(Find().count(), 1u);
}

TEST_F(StoreysTest, AreNumberedFromTheLowestThatIsKnown) {
  Add(0, 0, 10, 5, 0);
  Add(0, 0, 10, 5, 2.9);
  EXPECT_EQ(Find().At(2.9), 1);
  Add(0, 0, 3, 3, -2.6);
  EXPECT_EQ(Find().At(2.9), 2);
  EXPECT_EQ(Find().At(0), 1);
  EXPECT_EQ(Find().At(-2.6), 0);
}

TEST_F(StoreysTest, WithoutLevelFloorThereIsOneAtNoKnownHeight) {
  EXPECT_EQ(Find().count(), 1u);
  EXPECT_EQ(Find().At(7), 0);
  const std::vector<Storey> told = Find().DescribeAll({});
  ASSERT_EQ(told.size(), 1u);
  EXPECT_EQ(told[0].number, 0);
  EXPECT_FALSE(told[0].floor_z.has_value());
}

TEST_F(StoreysTest, AreToldFromTheLowestUp) {
  Add(0, 0, 10, 5, 2.9);
  Add(0, 0, 10, 5, 0);
  const std::vector<NamedStorey> named = {{"upstairs", 2.9}, {"attic", 5.8}};
  const std::vector<Storey> told = Find().DescribeAll(named);
  ASSERT_EQ(told.size(), 2u);
  for (const int k : {0, 1}) EXPECT_EQ(told[static_cast<size_t>(k)].number, k);
  EXPECT_NEAR(*told[0].floor_z, 0, 0.03);
  EXPECT_NEAR(*told[1].floor_z, 2.9, 0.03);
  EXPECT_EQ(told[0].name, "");
  EXPECT_EQ(told[1].name, "upstairs");
  EXPECT_EQ(Storeys(1.5).DescribeAll({})[0].floor_z, 1.5);
}

}  // namespace
}  // namespace vantage::planning
