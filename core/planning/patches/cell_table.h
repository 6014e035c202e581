// From a cell to the cells around it (26 neighbours), by bricks, since growing patches looks up all
// of them.
#ifndef VANTAGE_CORE_PLANNING_PATCHES_CELL_TABLE_H_
#define VANTAGE_CORE_PLANNING_PATCHES_CELL_TABLE_H_

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/view/brick_key.h"
#include "core/model/view/brick_mask.h"
#include "core/model/view/voxel.h"
#include "core/parallel/cancellation.h"
#include "core/planning/patches/deficient_cells.h"

namespace vantage::planning {

// How many cells are put into a table between two looks at whether it was cancelled.
inline constexpr uint32_t kTableCellsBetweenPolls = 8192;

// A value for each brick, and for a place those of its own brick and of the up to seven others that
// its neighbours lie in, each looked up at most once.
template <typename Value>
class BrickTable {
 public:
  class Around {
   public:
    Around(const BrickTable& table, const model::VoxelIndex& own) : table_(table), own_(own) {}
    // Null where the brick, which is the place's own or beside it to one side only, has none.
    const Value* At(const model::VoxelIndex& brick) {
      const auto which = static_cast<size_t>((brick.x() != own_.x()) + 2 * (brick.y() != own_.y()) +
                                             4 * (brick.z() != own_.z()));
      if (!looked_up_[which]) {
        looked_up_[which] = true;
        const auto it = table_.slot_.find(model::KeyOf(brick));
        if (it != table_.slot_.end()) beside_[which] = &table_.values_[it->second];
      }
      return beside_[which];
    }

   private:
    const BrickTable& table_;
    const model::VoxelIndex own_;
    std::array<const Value*, 8> beside_{};
    std::array<bool, 8> looked_up_{};
  };

  // The value of a brick; of bricks that were not the last one asked for, a new one.
  Value& Next(const model::VoxelIndex& brick) {
    const uint64_t key = model::KeyOf(brick);
    if (key != last_) {
      slot_.emplace(key, static_cast<uint32_t>(values_.size()));
      values_.emplace_back();
      last_ = key;
    }
    return values_.back();
  }

 private:
  uint64_t last_ = ~uint64_t{0};
  absl::flat_hash_map<model::BrickKey, uint32_t> slot_;
  std::vector<Value> values_;
};

// Of cells that are voxels. They come in the model's order: those of a brick side by side, by place
// in it.
class CellTable {
 public:
  // Nothing when cancelled on the way.
  static std::optional<CellTable> Of(const DeficientCells& cells,
                                     const parallel::Cancellation& cancelled) {
    CellTable table;
    for (uint32_t i = 0; i < cells.size(); ++i) {
      if (i % kTableCellsBetweenPolls == 0 && cancelled.Requested()) return std::nullopt;
      const model::VoxelIndex voxel = cells.Voxel(i);
      BrickCells& brick = table.bricks_.Next(model::Brick::Of(voxel));
      if (!brick.mask.Any()) brick.first.fill(i);
      const int local = model::Brick::LocalOf(voxel);
      brick.mask.Set(local);
      for (size_t w = static_cast<size_t>(local / 64) + 1; w < brick.first.size(); ++w) {
        brick.first[w] = i + 1;
      }
    }
    return table;
  }

  // Calls fn(cell) for those of the voxels around `v`.
  template <typename Fn>
  void ForEachNeighbour(const model::VoxelIndex& v, Fn&& fn) const {
    BrickTable<BrickCells>::Around around(bricks_, model::Brick::Of(v));
    for (int dz = -1; dz <= 1; ++dz) {
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) {
          if (dx == 0 && dy == 0 && dz == 0) continue;
          const model::VoxelIndex to = v + model::VoxelIndex(dx, dy, dz);
          const BrickCells* const brick = around.At(model::Brick::Of(to));
          if (brick == nullptr) continue;
          const int local = model::Brick::LocalOf(to);
          if (brick->mask.Has(local)) fn(brick->CellAt(local));
        }
      }
    }
  }

 private:
  struct BrickCells {
    model::BrickMask mask;
    std::array<uint32_t, model::Brick::kSide> first;  // the first cell in or after each word

    // Of a voxel in the mask.
    uint32_t CellAt(int local) const {
      const auto w = static_cast<size_t>(local / 64);
      const uint64_t below = (uint64_t{1} << (local % 64)) - 1;
      return first[w] + static_cast<uint32_t>(std::popcount(mask.word[w] & below));
    }
  };

  CellTable() = default;
  BrickTable<BrickCells> bricks_;
};

// Of cells that stand for cubes of 2^shift voxels, 1 <= shift <= 3. They come as CollectDeficient()
// has them: those of a brick side by side, and in it those of a cube, by x, then y, then z.
class CoarseCellTable {
 public:
  // Nothing when cancelled on the way.
  static std::optional<CoarseCellTable> Of(const DeficientCells& cells, int shift,
                                           const parallel::Cancellation& cancelled) {
    CoarseCellTable table(cells, shift);
    for (uint32_t i = 0; i < cells.size(); ++i) {
      if (i % kTableCellsBetweenPolls == 0 && cancelled.Requested()) return std::nullopt;
      const model::VoxelIndex voxel = cells.Voxel(i);
      BrickCells& brick = table.bricks_.Next(model::Brick::Of(voxel));
      if (brick.end.back() == 0) brick.first = i;
      const auto after = static_cast<uint16_t>(i + 1 - brick.first);
      for (size_t c = CubeIn(voxel, shift); c < brick.end.size(); ++c) brick.end[c] = after;
    }
    return table;
  }

  // Where in its brick the cube of a voxel lies.
  static size_t CubeIn(const model::VoxelIndex& voxel, int shift) {
    const auto along = [&](int axis) {
      return static_cast<size_t>((voxel[axis] & (model::Brick::kSide - 1)) >> shift);
    };
    const size_t side = static_cast<size_t>(model::Brick::kSide) >> shift;
    return along(0) + side * (along(1) + side * along(2));
  }

  // Calls fn(cell) for those of the cube of voxel `v` and of the cubes around it, but not for that
  // of `v` itself.
  template <typename Fn>
  void ForEachNeighbour(const model::VoxelIndex& v, Fn&& fn) const {
    BrickTable<BrickCells>::Around around(bricks_, model::Brick::Of(v));
    const int step = 1 << shift_;
    for (int dz = -step; dz <= step; dz += step) {
      for (int dy = -step; dy <= step; dy += step) {
        for (int dx = -step; dx <= step; dx += step) {
          const model::VoxelIndex to = v + model::VoxelIndex(dx, dy, dz);
          const BrickCells* const brick = around.At(model::Brick::Of(to));
          if (brick == nullptr) continue;
          const size_t cube = CubeIn(to, shift_);
          const uint32_t begin = brick->first + (cube == 0 ? 0 : brick->end[cube - 1]);
          const uint32_t end = brick->first + brick->end[cube];
          const bool own = dx == 0 && dy == 0 && dz == 0;
          for (uint32_t i = begin; i < end; ++i) {
            if (!own || cells_.Voxel(i) != v) fn(i);
          }
        }
      }
    }
  }

 private:
  struct BrickCells {
    uint32_t first = 0;
    // Behind the cells of each cube, from `first` on: 512 at most.
    std::array<uint16_t, 64> end{};
  };

  // The cells are kept: they outlive this, and stay in their order.
  CoarseCellTable(const DeficientCells& cells, int shift) : cells_(cells), shift_(shift) {}

  const DeficientCells& cells_;
  int shift_;
  BrickTable<BrickCells> bricks_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PATCHES_CELL_TABLE_H_
