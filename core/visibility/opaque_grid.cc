#include "core/visibility/opaque_grid.h"

#include <algorithm>
#include <bit>
#include <memory>

namespace vantage::visibility {
namespace {

using model::Brick;
using model::BrickMask;
using model::BrickPage;

// Bits [first, last] of eight.
uint64_t Bits(int first, int last) { return (uint64_t{2} << last) - (uint64_t{1} << first); }

// The places [low.x, high.x] x [low.y, high.y] of a slice of a mask, corners in [0, 8).
uint64_t InSlice(int x0, int x1, int y0, int y1) {
  const uint64_t row = Bits(x0, x1);
  const uint64_t all = row * 0x0101010101010101;
  return all >> (8 * (7 - (y1 - y0))) << (8 * y0);
}

// The part of a box [low, high], voxels, that lies in the cube of edge `side` with this corner,
// counted from it.
struct Part {
  Eigen::Vector3i low, high;
  Part(const Eigen::Vector3i& box_low, const Eigen::Vector3i& box_high,
       const Eigen::Vector3i& corner, int side)
      : low((box_low - corner).cwiseMax(0)), high((box_high - corner).cwiseMin(side - 1)) {}
};

// Whether any voxel of the part is set, or clear where `kSet` is false.
template <bool kSet>
bool AnyInBrick(const BrickMask& mask, const Part& part) {
  const uint64_t wanted = InSlice(part.low.x(), part.high.x(), part.low.y(), part.high.y());
  for (int z = part.low.z(); z <= part.high.z(); ++z) {
    const uint64_t word = mask.word[static_cast<size_t>(z)];
    if (((kSet ? word : ~word) & wanted) != 0) return true;
  }
  return false;
}

// Whether any voxel of the part of the page is opaque, or empty where `kOpaque` is false.
template <bool kOpaque>
bool AnyInPage(const BrickPage& page, const Part& part) {
  if (kOpaque ? page.all_empty() : page.all_opaque()) return false;
  if (kOpaque ? page.all_opaque() : page.all_empty()) return true;
  const BrickMask& with = kOpaque ? page.with_opaque() : page.with_empty();
  const Eigen::Vector3i first = part.low / Brick::kSide;
  const Eigen::Vector3i last = part.high / Brick::kSide;
  const uint64_t in_slice = InSlice(first.x(), last.x(), first.y(), last.y());
  for (int z = first.z(); z <= last.z(); ++z) {
    for (uint64_t left = with.word[static_cast<size_t>(z)] & in_slice; left != 0;
         left &= left - 1) {
      const int at = std::countr_zero(left);
      const Eigen::Vector3i brick(at & 7, at >> 3, z);
      const Part in_brick(part.low, part.high, brick * Brick::kSide, Brick::kSide);
      if (AnyInBrick<kOpaque>(page.Opaque(Brick::Local(brick.x(), brick.y(), z)), in_brick)) {
        return true;
      }
    }
  }
  return false;
}

// `page_of` (page coordinates) -> const BrickPage&. The box [low, high], voxels of the model.
template <bool kOpaque>
bool Any(const OpaqueGrid& grid, const Eigen::Vector3i& low, const Eigen::Vector3i& high) {
  const Eigen::Vector3i first = BrickPage::Of(Brick::Of(low));
  const Eigen::Vector3i last = BrickPage::Of(Brick::Of(high));
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        const Eigen::Vector3i at(x, y, z);
        if (AnyInPage<kOpaque>(grid.Page(at),
                               Part(low, high, at * BrickPage::kVoxels, BrickPage::kVoxels))) {
          return true;
        }
      }
    }
  }
  return false;
}

}  // namespace

OpaqueGrid::OpaqueGrid(const model::PlanningView& model)
    : model_(&model),
      box_{model.bounds().min - model::VoxelIndex::Ones(),
           model.bounds().max + model::VoxelIndex::Ones()},
      unknown_(std::make_shared<const BrickPage>()) {}

bool OpaqueGrid::AllOpaque(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const {
  if ((low.array() >= high.array()).any()) return true;
  return !Any<false>(*this, low + box_.min, high + box_.min - Eigen::Vector3i::Ones());
}

bool OpaqueGrid::AllEmpty(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const {
  if ((low.array() >= high.array()).any()) return true;
  return !Any<true>(*this, low + box_.min, high + box_.min - Eigen::Vector3i::Ones());
}

void OpaqueGrid::Rows(int layer, int first_y, int end_y, int first_page_x, size_t words,
                      std::span<uint64_t> rows) const {
  const int page_z = layer >> 6;
  const int brick_z = layer >> 3 & 7;
  const auto slice = static_cast<size_t>(layer & 7);
  for (size_t w = 0; w < words; ++w) {
    for (int y = first_y; y < end_y;) {
      const BrickPage& page = Page({first_page_x + static_cast<int>(w), y >> 6, page_z});
      const bool alike = page.all_opaque() || page.all_empty();
      const int until = std::min(end_y, alike ? (y | 63) + 1 : (y | 7) + 1);
      std::array<uint64_t, Brick::kSide> row;  // of a row of bricks
      row.fill(page.all_opaque() ? ~uint64_t{0} : 0);
      if (!alike) {
        for (int x = 0; x < BrickPage::kSide; ++x) {
          const uint64_t bits = page.Opaque(Brick::Local(x, y >> 3 & 7, brick_z)).word[slice];
          for (size_t r = 0; r < row.size(); ++r) row[r] |= (bits >> (8 * r) & 0xff) << (8 * x);
        }
      }
      for (; y < until; ++y) {
        rows[static_cast<size_t>(y - first_y) * words + w] = row[static_cast<size_t>(y & 7)];
      }
    }
  }
}

}  // namespace vantage::visibility
