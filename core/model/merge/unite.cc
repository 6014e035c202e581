#include "core/model/merge/unite.h"

#include "core/model/merge/brick_neighbourhood.h"
#include "core/model/merge/empty_around.h"

namespace vantage::model {

namespace {

// The surface voxels of `united` that scans have seen through.
BrickMask SeenThrough(const VoxelIndex& brick, const BrickMask& surface,
                      std::span<const LayerBrick* const> own_by_layer,
                      std::span<const ScanLayer* const> layers) {
  std::array<uint16_t, Brick::kVoxels> through{};
  std::array<uint16_t, Brick::kVoxels> measured{};
  for (size_t i = 0; i < layers.size(); ++i) {
    const LayerBrick* own = own_by_layer[i];
    if (own == nullptr) continue;
    const BrickMask candidates = surface & own->empty;
    const bool any = candidates.Any();
    const BrickNeighbourhood<LayerBrick> around(
        brick, [&](const VoxelIndex& b) { return any ? layers[i]->Find(b) : nullptr; });
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

// The sums of the layers in the voxels of `surface`, in order of local.
std::vector<SurfaceSums> AddUp(const BrickMask& surface, std::span<const LayerBrick* const> own) {
  std::vector<SurfaceSums> sums(static_cast<size_t>(surface.Count()));
  for (const LayerBrick* brick : own) {
    if (brick == nullptr || !brick->surface.Any()) continue;
    size_t from = 0;
    size_t to = 0;
    for (size_t w = 0; w < surface.word.size(); ++w) {
      for (uint64_t left = surface.word[w] | brick->surface.word[w]; left != 0; left &= left - 1) {
        const uint64_t bit = left & -left;
        const bool here = (brick->surface.word[w] & bit) != 0;
        if ((surface.word[w] & bit) != 0) {
          if (here) sums[to].Add(brick->sums[from]);
          ++to;
        }
        from += here ? 1 : 0;
      }
    }
  }
  return sums;
}

}  // namespace

std::shared_ptr<const UnitedBrick> Unite(const VoxelIndex& brick,
                                         std::span<const LayerBrick* const> own,
                                         std::span<const ScanLayer* const> layers) {
  int witnesses = 0;
  int with_surface = 0;
  const LayerBrick* any_with_surface = nullptr;
  BrickMask empty;
  BrickMask surface;
  for (const LayerBrick* in_layer : own) {
    if (in_layer == nullptr) continue;
    ++witnesses;
    for (size_t w = 0; w < Brick::kSide; ++w) {
      empty.word[w] |= in_layer->empty.word[w];
      surface.word[w] |= in_layer->surface.word[w];
    }
    if (!in_layer->surface.Any()) continue;
    ++with_surface;
    any_with_surface = in_layer;
  }
  if (witnesses == 0) return nullptr;
  if (witnesses > 2 && with_surface > 0) {
    const BrickMask gone = SeenThrough(brick, surface, own, layers);
    for (size_t w = 0; w < Brick::kSide; ++w) surface.word[w] &= ~gone.word[w];
  }
  for (size_t w = 0; w < Brick::kSide; ++w) empty.word[w] &= ~surface.word[w];
  auto united = std::make_shared<UnitedBrick>(empty, surface);
  if (with_surface == 1 && surface == any_with_surface->surface) {
    united->sums = any_with_surface->sums.view();
  } else {
    united->added = PackedSums(AddUp(surface, own));
    united->sums = united->added.view();
  }
  return united;
}

}  // namespace vantage::model
