#include "core/visibility/opaque_grid.h"

#include <algorithm>
#include <bit>
#include <memory>
#include <utility>

namespace vantage::visibility {
namespace {

using model::Brick;
using model::BrickMask;
using model::BrickPage;

// The places [x0, x1] x [y0, y1] of a slice of a mask, in [0, 8).
uint64_t InSlice(int x0, int x1, int y0, int y1) {
  const uint64_t row = (uint64_t{2} << x1) - (uint64_t{1} << x0);
  const uint64_t all = row * 0x0101010101010101;
  return all >> (8 * (7 - (y1 - y0))) << (8 * y0);
}

// A box of voxels, both corners included. Plain numbers: these are the innermost loops of step D.
struct Box {
  int x0, y0, z0, x1, y1, z1;

  // The part in the cube of edge `side` with this corner, counted from it.
  Box In(int x, int y, int z, int side) const {
    return {std::max(x0 - x, 0),        std::max(y0 - y, 0),        std::max(z0 - z, 0),
            std::min(x1 - x, side - 1), std::min(y1 - y, side - 1), std::min(z1 - z, side - 1)};
  }
};

// Whether any voxel of the part of the page is opaque, or empty where `kOpaque` is false.
template <bool kOpaque>
bool AnyInPage(const BrickPage& page, const Box& part) {
  if (kOpaque ? page.all_empty() : page.all_opaque()) return false;
  if (kOpaque ? page.all_opaque() : page.all_empty()) return true;
  const BrickMask& with = kOpaque ? page.with_opaque() : page.with_empty();
  const uint64_t in_slice = InSlice(part.x0 >> 3, part.x1 >> 3, part.y0 >> 3, part.y1 >> 3);
  for (int bz = part.z0 >> 3; bz <= part.z1 >> 3; ++bz) {
    for (uint64_t left = with.word[static_cast<size_t>(bz)] & in_slice; left != 0;
         left &= left - 1) {
      const int at = std::countr_zero(left);
      const BrickMask& mask = page.Opaque(at + 64 * bz);
      const Box in = part.In((at & 7) << 3, at & ~7, bz << 3, Brick::kSide);
      const uint64_t wanted = InSlice(in.x0, in.x1, in.y0, in.y1);
      for (int z = in.z0; z <= in.z1; ++z) {
        const uint64_t word = mask.word[static_cast<size_t>(z)];
        if (((kOpaque ? word : ~word) & wanted) != 0) return true;
      }
    }
  }
  return false;
}

// The same for the box [low, high], voxels of the model.
template <bool kOpaque>
bool Any(const OpaqueGrid& grid, const Eigen::Vector3i& low, const Eigen::Vector3i& high) {
  const Box box{low.x(), low.y(), low.z(), high.x(), high.y(), high.z()};
  for (int pz = box.z0 >> 6; pz <= box.z1 >> 6; ++pz) {
    for (int py = box.y0 >> 6; py <= box.y1 >> 6; ++py) {
      for (int px = box.x0 >> 6; px <= box.x1 >> 6; ++px) {
        if (AnyInPage<kOpaque>(grid.Page({px, py, pz}),
                               box.In(px << 6, py << 6, pz << 6, BrickPage::kVoxels))) {
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

void OpaqueGrid::Walk::Enter(int x, int y, int z) {
  x_ = x;
  y_ = y;
  z_ = z;
  const model::VoxelIndex brick(x, y, z);
  mask_ = &grid_.Page(BrickPage::Of(brick)).Opaque(Brick::LocalOf(brick));
}

absl::StatusOr<OpaqueGrid> OpaqueGrid::Summed(parallel::Parallel& parallel,
                                              const parallel::Cancellation& cancelled) const {
  const Eigen::Vector3i size = box_.max - box_.min;
  if (!SummedVolumeTable::Fits(size)) return *this;
  const int first_page_x = box_.min.x() >> 6;
  const auto words = static_cast<size_t>(((box_.max.x() - 1) >> 6) - first_page_x + 1);
  auto table = SummedVolumeTable::Create(
      size, words, static_cast<size_t>(box_.min.x() & 63),
      [&](int z, std::span<uint64_t> rows) {
        Rows(box_.min.z() + z, box_.min.y(), box_.max.y(), first_page_x, words, rows);
      },
      parallel, cancelled);
  if (!table.ok()) return table.status();
  OpaqueGrid summed = *this;
  summed.table_ = std::make_shared<const SummedVolumeTable>(*std::move(table));
  return summed;
}

bool OpaqueGrid::AllOpaqueByBricks(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const {
  return !Any<false>(*this, low + box_.min, high + box_.min - Eigen::Vector3i::Ones());
}

bool OpaqueGrid::AllEmptyByBricks(const Eigen::Vector3i& low, const Eigen::Vector3i& high) const {
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

size_t MixedBricks(const model::PlanningView& model) {
  size_t mixed = 0;
  for (const std::shared_ptr<const model::BrickPage>& page : model.page_list()) {
    mixed += static_cast<size_t>((page->with_opaque() & page->with_empty()).Count());
  }
  return mixed;
}

}  // namespace vantage::visibility
