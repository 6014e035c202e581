// The grid against a dense array of what the model says of each voxel.
#include "core/visibility/opaque_grid.h"

#include <gtest/gtest.h>

#include <memory>
#include <random>
#include <stop_token>
#include <vector>

#include "core/parallel/thread_pool.h"
#include "tests/support/closed_form_view.h"
#include "tests/support/runs.h"

namespace vantage::visibility {
namespace {

// One byte a voxel, over the grid's box.
class DenseGrid {
 public:
  explicit DenseGrid(const model::PlanningView& model)
      : min_(model.bounds().min - model::VoxelIndex::Ones()),
        size_(model.bounds().max + model::VoxelIndex::Ones() - min_) {
    for (int z = 0; z < size_.z(); ++z) {
      for (int y = 0; y < size_.y(); ++y) {
        for (int x = 0; x < size_.x(); ++x) {
          opaque_.push_back(!model.Empty(min_ + model::VoxelIndex(x, y, z)));
        }
      }
    }
  }
  const Eigen::Vector3i& size() const { return size_; }
  const model::VoxelIndex& min() const { return min_; }
  bool At(const Eigen::Vector3i& v) const {
    return opaque_[static_cast<size_t>(v.x() + size_.x() * (v.y() + size_.y() * v.z()))] != 0;
  }
  int Count(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const {
    int count = 0;
    for (int z = low.z(); z < high.z(); ++z) {
      for (int y = low.y(); y < high.y(); ++y) {
        for (int x = low.x(); x < high.x(); ++x) count += At({x, y, z}) ? 1 : 0;
      }
    }
    return count;
  }

 private:
  model::VoxelIndex min_;
  Eigen::Vector3i size_;
  std::vector<uint8_t> opaque_;
};

// Bricks that are wholly empty, wholly unknown, wholly opaque, or anything: in cubes of up to some
// pages, so that whole pages are all alike, too.
model::PlanningView Blocks(uint64_t seed) {
  std::mt19937_64 random(seed);
  auto empty = std::make_shared<model::Brick>();
  empty->state.fill(model::VoxelState::kEmpty);
  auto solid = std::make_shared<model::Brick>();
  solid->state.fill(model::VoxelState::kAbsorbed);
  std::vector<model::BrickAt> bricks;
  const model::VoxelIndex first(-11, -17, -3);
  const model::VoxelIndex size(29, 33, 24);
  const auto kind_of = [&](const model::VoxelIndex& at, int shift) {
    const auto hash =
        static_cast<uint64_t>((at.x() >> shift) * 73856093 ^ (at.y() >> shift) * 19349663 ^
                              (at.z() >> shift) * 83492791) +
        seed;
    std::mt19937_64 draw(hash);
    draw.discard(3);
    return draw() % 8;
  };
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x) {
        const model::VoxelIndex at = first + model::VoxelIndex(x, y, z);
        // Pages first, then cubes of two bricks.
        uint64_t kind = kind_of(at, 3);
        if (kind >= 4) kind = kind_of(at, 1);
        if (kind < 3) {
          bricks.push_back({at, empty});
        } else if (kind == 3) {
          bricks.push_back({at, solid});
        } else if (kind == 4) {
          auto mixed = std::make_shared<model::Brick>();
          const int sparse = 1 + static_cast<int>(random() % 200);
          const bool mostly_empty = random() % 2 == 0;
          for (model::VoxelState& state : mixed->state) {
            const bool odd = random() % static_cast<uint64_t>(sparse) == 0;
            if (odd != mostly_empty) state = model::VoxelState::kEmpty;
          }
          bricks.push_back({at, mixed});
        }
      }
    }
  }
  return {0.1, seed, std::move(bricks), {}};
}

TEST(OpaqueGridTest, SaysWhatTheModelSays) {
  for (const model::PlanningView& model :
       {Blocks(1), test_support::BuildView(test_support::FurnishedRoom(3))}) {
    const OpaqueGrid grid(model);
    const DenseGrid dense(model);
    OpaqueGrid::Walk walk(grid);
    ASSERT_EQ(grid.box().min, dense.min());
    ASSERT_EQ(grid.box().max, dense.min() + dense.size());
    for (int z = -3; z < dense.size().z() + 3; ++z) {
      for (int y = -3; y < dense.size().y() + 3; ++y) {
        for (int x = -3; x < dense.size().x() + 3; ++x) {
          const Eigen::Vector3i at(x, y, z);
          const bool inside = (at.array() >= 0).all() && (at.array() < dense.size().array()).all();
          const bool opaque = !inside || dense.At(at);
          ASSERT_EQ(grid.Opaque(at + dense.min()), opaque) << at.transpose();
          if (!inside) continue;
          ASSERT_EQ(grid.OpaqueAt(at), opaque) << at.transpose();
          ASSERT_EQ(walk.OpaqueAt(at), opaque) << at.transpose();
        }
      }
    }
  }
}

// By bricks and by a summed volume table.
TEST(OpaqueGridTest, BoxesAreThoseOfTheVoxels) {
  parallel::ThreadPool pool(2);
  int all_opaque = 0;
  int all_empty = 0;
  for (uint64_t seed = 1; seed <= 2; ++seed) {
    const model::PlanningView model = Blocks(seed);
    const OpaqueGrid grid(model);
    const OpaqueGrid summed = grid.Summed(pool).value();
    ASSERT_TRUE(summed.summed());
    const DenseGrid dense(model);
    std::mt19937_64 random(seed);
    for (int k = 0; k < test_support::Runs(20000); ++k) {
      Eigen::Vector3i low;
      Eigen::Vector3i high;
      for (int a = 0; a < 3; ++a) {
        const int most = k % 3 == 0 ? 90 : k % 3 == 1 ? 20 : 3;
        const int at = static_cast<int>(random() % static_cast<uint64_t>(dense.size()[a]));
        const int side = static_cast<int>(random() % static_cast<uint64_t>(most));
        low[a] = at;
        high[a] = std::min(dense.size()[a], at + side);
      }
      const int volume = (high - low).prod();
      const int count = dense.Count(low, high);
      for (const OpaqueGrid* asked : {&grid, &summed}) {
        ASSERT_EQ(asked->AllOpaque(low, high), count == volume)
            << low.transpose() << " to " << high.transpose() << " " << asked->summed();
        ASSERT_EQ(asked->AllEmpty(low, high), count == 0)
            << low.transpose() << " to " << high.transpose() << " " << asked->summed();
      }
      all_opaque += volume > 1 && count == volume ? 1 : 0;
      all_empty += volume > 1 && count == 0 ? 1 : 0;
    }
  }
  EXPECT_GT(all_opaque, 500);
  EXPECT_GT(all_empty, 500);
}

TEST(OpaqueGridTest, RowsAreThoseOfTheVoxels) {
  const model::PlanningView model = Blocks(3);
  const OpaqueGrid grid(model);
  const model::VoxelIndex& low = grid.box().min;
  const model::VoxelIndex& high = grid.box().max;
  const int first_page = (low.x() >> 6) - 1;  // and one beyond on the other side
  const auto words = static_cast<size_t>((high.x() >> 6) + 2 - first_page);
  for (int z = low.z() - 2; z < high.z() + 2; ++z) {
    const int first_y = low.y() - 5 + (z & 7);
    const int end_y = high.y() + 70;
    std::vector<uint64_t> rows(words * static_cast<size_t>(end_y - first_y), 12345);
    grid.Rows(z, first_y, end_y, first_page, words, rows);
    for (int y = first_y; y < end_y; ++y) {
      for (int i = 0; i < static_cast<int>(64 * words); ++i) {
        const uint64_t word =
            rows[static_cast<size_t>(y - first_y) * words + static_cast<size_t>(i) / 64];
        ASSERT_EQ((word >> (i % 64) & 1) != 0, grid.Opaque({64 * first_page + i, y, z}))
            << i << " " << y << " " << z;
      }
    }
  }
}

// What is dense over the box is bounded, however little surface there is in it.
TEST(OpaqueGridTest, ALargeBoxHasNoTable) {
  auto empty = std::make_shared<model::Brick>();
  empty->state.fill(model::VoxelState::kEmpty);
  parallel::Serial serial;
  const auto of_height = [&](int bricks) {
    return model::PlanningView(0.1, 1, {{{-1, -1, 0}, empty}, {{29, 29, bricks - 1}, empty}}, {});
  };
  // 250 x 250 voxels with the grid's margin; 16.8 million with 268 on top of each other.
  const model::PlanningView small = of_height(33);
  const model::PlanningView large = of_height(34);
  ASSERT_EQ(OpaqueGrid(small).box().max - OpaqueGrid(small).box().min,
            Eigen::Vector3i(250, 250, 266));
  EXPECT_TRUE(OpaqueGrid(small).Summed(serial)->summed());
  EXPECT_EQ(SummedVolumeTable::Bytes({250, 250, 266}), uint64_t{4} * 251 * 251 * 267);
  EXPECT_FALSE(OpaqueGrid(large).Summed(serial)->summed());
  EXPECT_EQ(SummedVolumeTable::Bytes({250, 250, 274}), 0U);
  // A site of 400 x 400 x 100 m, which is more than 32 bits count.
  EXPECT_FALSE(SummedVolumeTable::Fits({8000, 8000, 2000}));
}

TEST(OpaqueGridTest, ATableThatNobodyWantsIsNotMade) {
  const model::PlanningView model = Blocks(1);
  std::stop_source source;
  source.request_stop();
  parallel::Serial serial;
  EXPECT_EQ(
      OpaqueGrid(model).Summed(serial, parallel::Cancellation(source.get_token())).status().code(),
      absl::StatusCode::kCancelled);
}

}  // namespace
}  // namespace vantage::visibility
