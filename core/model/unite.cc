#include "core/model/unite.h"

#include "core/model/brick_neighbourhood.h"

namespace vantage {

namespace {

bool EmptyAllAround(const BrickNeighbourhood<LayerBrick>& around, int local) {
  const int x = local & 7, y = local >> 3 & 7, z = local >> 6;
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        const auto [brick, at] = around.At(x + dx, y + dy, z + dz);
        if (brick == nullptr || !brick->empty.Has(at)) return false;
      }
    }
  }
  return true;
}

// The surface voxels of `united` that scans have seen through.
BrickMask SeenThrough(const VoxelIndex& brick, const BrickMask& surface,
                      std::span<const ScanLayer* const> layers) {
  std::array<uint16_t, Brick::kVoxels> through{};
  std::array<uint16_t, Brick::kVoxels> measured{};
  for (const ScanLayer* layer : layers) {
    const LayerBrick* own = layer->Find(brick);
    if (own == nullptr) continue;
    BrickMask candidates;
    for (size_t w = 0; w < surface.word.size(); ++w) {
      candidates.word[w] = surface.word[w] & own->empty.word[w];
    }
    const bool any = candidates.Any();
    const BrickNeighbourhood<LayerBrick> around(
        brick, [&](const VoxelIndex& b) { return any ? layer->Find(b) : nullptr; });
    for (int local = 0; local < Brick::kVoxels; ++local) {
      if (own->surface.Has(local)) ++measured[static_cast<size_t>(local)];
      if (candidates.Has(local) && EmptyAllAround(around, local)) {
        ++through[static_cast<size_t>(local)];
      }
    }
  }
  BrickMask seen_through;
  for (int local = 0; local < Brick::kVoxels; ++local) {
    const size_t i = static_cast<size_t>(local);
    if (through[i] >= 2 && through[i] > measured[i]) seen_through.Set(local);
  }
  return seen_through;
}

}  // namespace

std::shared_ptr<const UnitedBrick> Unite(const VoxelIndex& brick,
                                         std::span<const ScanLayer* const> layers) {
  auto united = std::make_shared<UnitedBrick>();
  int witnesses = 0;
  for (const ScanLayer* layer : layers) {
    const LayerBrick* own = layer->Find(brick);
    if (own == nullptr) continue;
    ++witnesses;
    for (size_t w = 0; w < Brick::kSide; ++w) {
      united->empty.word[w] |= own->empty.word[w];
      united->surface.word[w] |= own->surface.word[w];
    }
  }
  if (witnesses == 0) return nullptr;
  if (witnesses > 2 && united->surface.Any()) {
    const BrickMask gone = SeenThrough(brick, united->surface, layers);
    for (size_t w = 0; w < Brick::kSide; ++w) united->surface.word[w] &= ~gone.word[w];
  }
  for (size_t w = 0; w < Brick::kSide; ++w) united->empty.word[w] &= ~united->surface.word[w];
  united->sums.resize(static_cast<size_t>(united->surface.Count()));
  for (const ScanLayer* layer : layers) {
    const LayerBrick* own = layer->Find(brick);
    if (own == nullptr) continue;
    size_t from = 0;
    size_t to = 0;
    for (int local = 0; local < Brick::kVoxels; ++local) {
      const bool here = own->surface.Has(local);
      if (united->surface.Has(local)) {
        if (here) united->sums[to].Add(own->sums[from]);
        ++to;
      }
      from += here ? 1 : 0;
    }
  }
  return united;
}

}  // namespace vantage
