#include "core/model/merge/merge.h"

#include <algorithm>
#include <array>
#include <bit>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "core/model/merge/brick_set.h"
#include "core/model/merge/dropouts.h"
#include "core/model/merge/fuse.h"
#include "core/model/merge/local_plane.h"
#include "core/model/merge/merge_region.h"
#include "core/model/merge/open_sky.h"
#include "core/model/merge/publish_region.h"

namespace vantage::model {

namespace {

// Bit 2 * axis stands for the face of a brick on the lower side of the axis, the next one for the
// upper side.
using Faces = uint8_t;
constexpr int kFaceLayers = 2;

// The faces within kFaceLayers of which the set has a voxel.
Faces FacesNear(const BrickMask& mask) {
  constexpr std::array<uint64_t, 4> kInSlice = {0x0303030303030303, 0xc0c0c0c0c0c0c0c0,   // x
                                                0x000000000000ffff, 0xffff000000000000};  // y
  uint64_t all = 0;
  for (const uint64_t word : mask.word) all |= word;
  unsigned faces = 0;
  for (size_t face = 0; face < kInSlice.size(); ++face) {
    faces |= (all & kInSlice[face]) != 0 ? 1u << face : 0u;
  }
  static_assert(kFaceLayers == 2 && Brick::kSide == 8);
  faces |= (mask.word[0] | mask.word[1]) != 0 ? 1u << 4 : 0u;
  faces |= (mask.word[6] | mask.word[7]) != 0 ? 1u << 5 : 0u;
  return static_cast<Faces>(faces);
}

// The faces within kFaceLayers of which there is measured surface that is most nearly parallel to
// them.
Faces FacesWithSurface(const Brick& brick) {
  unsigned faces = 0;
  size_t rank = 0;
  for (int word = 0; word < Brick::kSide; ++word) {
    for (uint64_t left = brick.surface_mask[static_cast<size_t>(word)]; left != 0;
         left &= left - 1) {
      const int local = 64 * word + std::countr_zero(left);
      const SurfaceVoxel surface = brick.surface[rank++];
      if (brick.state[static_cast<size_t>(local)] != VoxelState::kTrueSurface) continue;
      const int axis = DominantAxis(surface.normal);
      const int along = local >> (3 * axis) & 7;
      if (along < kFaceLayers) faces |= 1u << (2 * axis);
      if (along >= Brick::kSide - kFaceLayers) faces |= 1u << (2 * axis + 1);
    }
  }
  return static_cast<Faces>(faces);
}

// The faces of a brick of the layer near which it says anything.
Faces FacesOf(const LayerBrick& brick) {
  BrickMask known = brick.surface;
  for (size_t w = 0; w < known.word.size(); ++w) known.word[w] |= brick.empty.word[w];
  return FacesNear(known);
}

// What a layer that came or went can have an influence on.
class Influence {
 public:
  // `also`: bricks that changed in other layers. `layers`: all there are afterwards.
  Influence(const ScanLayer& touched, LayerChange change, std::span<const BrickKey> also,
            std::span<const ScanLayer* const> layers, const ModelOctree& octree,
            const ModelLeaf& all_empty)
      : touched_(touched), change_(change), octree_(octree), all_empty_(all_empty) {
    for (const BrickKey key : also) also_.Add(BrickOf(key));
    for (const auto& [key, brick] : touched.bricks.own()) changing_.Add(BrickOf(key));
    for (const auto& [page, bricks] : touched.bricks.empty()) changing_.Add(page, bricks);
    if (change == LayerChange::kAdded) {
      FindCertainOfAdded();
      LeaveOutDeep();
    } else {
      FindCertainOfRemoved(layers);
    }
    for (const auto& [page, bricks] : also_.pages()) changing_.Add(page, bricks);
  }

  // All such bricks: those that change, those next to them, and a few farther away.
  BrickSet All(double voxel_size) const {
    BrickSet all = changing_.Grown();
    for (const BrickKey key : BricksWithDropouts(touched_, octree_, voxel_size)) {
      all.Add(BrickOf(key));
    }
    const std::vector<BrickKey> under_sky =
        change_ == LayerChange::kAdded
            ? BricksThatSkyClears(touched_, octree_, voxel_size)
            : BricksThatSkyCleared(touched_, octree_, all_empty_, voxel_size);
    for (const BrickKey key : under_sky) all.Add(BrickOf(key));
    for (const VoxelIndex& brick : TwoAway(all)) all.Add(brick);
    return all;
  }

  // Of these, the bricks of which it is plain what they are afterwards. Among them those that were
  // unknown and are wholly empty, and those that were wholly empty and are unknown.
  const BrickSet& certain() const { return certain_; }
  const BrickSet& emptied() const { return emptied_; }
  const BrickSet& forgotten() const { return forgotten_; }

 private:
  // What the layer that came saw wholly empty, and was so or unknown before, is wholly empty,
  // whatever is around it.
  void FindCertainOfAdded() {
    for (const auto& [page, bricks] : touched_.bricks.empty()) {
      const ModelOctree::PageContents before = octree_.In(BrickOf(page), all_empty_);
      const BrickMask also = also_.In(page);
      BrickMask certain;
      BrickMask emptied;
      for (size_t w = 0; w < certain.word.size(); ++w) {
        const uint64_t own = bricks.word[w] & ~also.word[w];
        emptied.word[w] = own & ~before.known.word[w];
        certain.word[w] = emptied.word[w] | (own & before.same.word[w]);
      }
      certain_.Add(page, certain);
      emptied_.Add(page, emptied);
    }
  }

  // What the layer that went saw wholly empty stays so where another saw it so, too, and none saw
  // surface. It is unknown where no other layer says anything of it, nor of what is around it.
  void FindCertainOfRemoved(std::span<const ScanLayer* const> layers) {
    BrickSet known;
    BrickSet whole;
    BrickSet with_surface;
    for (const ScanLayer* layer : layers) {
      for (const auto& [key, brick] : layer->bricks.own()) {
        known.Add(BrickOf(key));
        if (brick.surface.Any()) with_surface.Add(BrickOf(key));
      }
      for (const auto& [page, bricks] : layer->bricks.empty()) {
        known.Add(page, bricks);
        whole.Add(page, bricks);
      }
    }
    const BrickSet near = known.Grown();
    for (const auto& [page, bricks] : touched_.bricks.empty()) {
      const BrickMask before = octree_.In(BrickOf(page), all_empty_).same;
      const BrickMask also = also_.In(page);
      const BrickMask in_whole = whole.In(page);
      const BrickMask in_surface = with_surface.In(page);
      const BrickMask in_near = near.In(page);
      BrickMask certain;
      BrickMask forgotten;
      for (size_t w = 0; w < certain.word.size(); ++w) {
        const uint64_t own = bricks.word[w] & before.word[w] & ~also.word[w];
        forgotten.word[w] = own & ~in_near.word[w];
        certain.word[w] = forgotten.word[w] | (own & in_whole.word[w] & ~in_surface.word[w]);
      }
      certain_.Add(page, certain);
      forgotten_.Add(page, forgotten);
    }
  }

  // Deep inside known-empty space nothing can change, nor touch anything that can.
  void LeaveOutDeep() {
    // The bricks that do not stay empty, in the pages that are touched and those around.
    BrickSet pages;  // as if they were bricks
    for (const auto& [page, bricks] : changing_.pages()) pages.Add(BrickOf(page));
    BrickSet not_empty;
    for (const BrickKey page : pages.Grown().Keys()) {
      BrickMask rest = octree_.In(BrickOf(page), all_empty_).same;
      for (uint64_t& word : rest.word) word = ~word;
      not_empty.Add(page, rest);
    }
    for (const auto& [key, brick] : touched_.bricks.own()) {
      if (!brick.WhollyEmpty()) not_empty.Add(BrickOf(key));
    }
    const BrickSet near = not_empty.Grown();
    BrickSet deep = changing_;
    deep.Remove(near);
    changing_.Remove(deep);
  }

  // The bricks, not in `within`, that a change can influence although they lie two bricks away. A
  // change reaches nine voxels at most: the points of a voxel enter the planes of its neighbours (1
  // voxel); a plane can be taken over by a voxel two away (2); it decides what dominates a voxel
  // two away (2), what absorbs such a voxel (2), and what the absorbing voxel then holds (2). The
  // last six lead across parallel sheets only. One more voxel counts where surface is erased
  // because it was seen through.
  std::vector<VoxelIndex> TwoAway(const BrickSet& within) const {
    absl::flat_hash_map<BrickKey, Faces> known;
    const auto faces_of = [&](const VoxelIndex& brick) {
      const auto [it, fresh] = known.try_emplace(KeyOf(brick), Faces{0});
      if (fresh) {
        const ModelLeaf leaf = octree_.Find(brick);
        if (leaf != nullptr && leaf != all_empty_) it->second = FacesWithSurface(*leaf);
      }
      return it->second;
    };
    std::vector<VoxelIndex> found;
    for (const auto& [page, bricks] : changing_.pages()) {
      const VoxelIndex first = BrickOf(page) * BrickPage::kSide;
      for (int face = 0; face < 6; ++face) {
        const int axis = face / 2;
        const int direction = face % 2 == 0 ? -1 : 1;
        // Where the brick beside changes, too, those two away are next to that one.
        changing_.EdgeIn(page, axis, direction).ForEach([&](int local) {
          const VoxelIndex brick = first + VoxelIndex(local & 7, local >> 3 & 7, local >> 6);
          if ((ChangesNear(brick) >> face & 1) == 0) return;
          const VoxelIndex far = brick + VoxelIndex(VoxelIndex::Unit(axis) * (2 * direction));
          for (int beside = 0; beside < 9; ++beside) {
            VoxelIndex there = far;
            there[(axis + 1) % 3] += beside % 3 - 1;
            there[(axis + 2) % 3] += beside / 3 - 1;
            if (within.Has(there)) continue;
            // Its face towards the change.
            if ((faces_of(there) >> (face ^ 1) & 1) != 0) found.push_back(there);
          }
        });
      }
    }
    return found;
  }

  // The faces near which a brick changes.
  Faces ChangesNear(const VoxelIndex& brick) const {
    const LayerBrick* own = also_.Has(brick) ? nullptr : touched_.Find(brick);
    return own == nullptr ? Faces{0x3f} : FacesOf(*own);
  }

  const ScanLayer& touched_;
  const LayerChange change_;
  const ModelOctree& octree_;
  const ModelLeaf& all_empty_;
  BrickSet also_;
  BrickSet changing_;
  BrickSet certain_;
  BrickSet emptied_;
  BrickSet forgotten_;
};

}  // namespace

ModelLeaf MakeAllEmpty() {
  auto contents = std::make_shared<Brick>();
  contents->state.fill(VoxelState::kEmpty);
  return contents;
}

MergeResult MergeAround(const ScanLayer& touched, LayerChange change,
                        std::span<const BrickKey> also, std::span<const ScanLayer* const> layers,
                        double voxel_size, const ModelLeaf& all_empty, parallel::Parallel& parallel,
                        ModelOctree& octree) {
  MergeResult result;
  std::vector<BrickKey> keys;
  {
    const Influence influence(touched, change, also, layers, octree, all_empty);
    BrickSet influenced = influence.All(voxel_size);
    result.recomputed = influenced.size();
    influenced.Remove(influence.certain());
    keys = influenced.Keys();
    result.emptied = {influence.emptied().pages(), all_empty};
    for (const BrickKey key : influence.forgotten().Keys()) {
      result.changed.push_back({BrickOf(key), nullptr});
    }
  }
  // Those around them are to find what they are now.
  for (const BrickAt& forgotten : result.changed) octree.Set(forgotten.brick, nullptr);
  for (const auto& [page, bricks] : result.emptied.by_page) {
    octree.SetUnknown(BrickOf(page), bricks, all_empty);
  }
  MergeRegion region(keys, layers, octree, all_empty);
  std::vector<ModelLeaf> contents = PublishRegion(region, layers, voxel_size, all_empty, parallel);
  std::vector<uint8_t> same(contents.size());
  parallel.For(contents.size(),
               [&](size_t i) { same[i] = SameContents(contents[i], region.before(i)) ? 1 : 0; });

  for (size_t i = 0; i < contents.size(); ++i) {
    if (same[i] != 0) continue;
    octree.Set(region.brick(i), contents[i]);
    result.changed.push_back({region.brick(i), std::move(contents[i])});
  }
  std::sort(result.changed.begin(), result.changed.end(),
            [](const BrickAt& a, const BrickAt& b) { return KeyOf(a.brick) < KeyOf(b.brick); });
  return result;
}

}  // namespace vantage::model
