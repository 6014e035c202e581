#include "core/model/merge/merge.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/container/flat_hash_set.h"
#include "core/model/merge/dropouts.h"
#include "core/model/merge/fuse.h"
#include "core/model/merge/local_plane.h"
#include "core/model/merge/merge_region.h"
#include "core/model/merge/publish_brick.h"
#include "core/model/merge/unite.h"

namespace vantage::model {

namespace {

template <typename Fn>
void ForEachAround(const VoxelIndex& brick, Fn&& fn) {
  for (int z = -1; z <= 1; ++z) {
    for (int y = -1; y <= 1; ++y) {
      for (int x = -1; x <= 1; ++x) fn(VoxelIndex(brick + VoxelIndex(x, y, z)));
    }
  }
}

bool SameBits(const Brick& a, const Brick& b) {
  if (a.state != b.state || a.surface.size() != b.surface.size()) return false;
  if (a.surface.empty()) return true;
  if (a.dropouts != b.dropouts) return false;
  // The members have no gaps between them, so comparing the bytes compares all of them. -0 differs
  // from 0 here.
  static_assert(sizeof(SurfaceVoxel) == 2 * sizeof(Eigen::Vector3f) + 2 * sizeof(float) + 8);
  return std::memcmp(reinterpret_cast<const char*>(a.surface.data()),
                     reinterpret_cast<const char*>(b.surface.data()),
                     a.surface.size() * sizeof(SurfaceVoxel)) == 0;
}

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
      const SurfaceVoxel& surface = brick.surface[rank++];
      if (brick.state[static_cast<size_t>(local)] != VoxelState::kTrueSurface) continue;
      const int axis = DominantAxis(surface.normal);
      const int along = local >> (3 * axis) & 7;
      if (along < kFaceLayers) faces |= 1u << (2 * axis);
      if (along >= Brick::kSide - kFaceLayers) faces |= 1u << (2 * axis + 1);
    }
  }
  return static_cast<Faces>(faces);
}

// The bricks, not in `keys`, that a change can influence although they lie two bricks away.
// `changing` has the faces that each brick changes near. A change reaches nine voxels at most: the
// points of a voxel enter the planes of its neighbours (1 voxel); a plane can be taken over by a
// voxel two away (2); it decides what dominates a voxel two away (2), what absorbs such a voxel
// (2), and what the absorbing voxel then holds (2). The last six lead across parallel sheets only.
// One more voxel counts where surface is erased because it was seen through.
std::vector<BrickKey> TwoAway(const std::vector<std::pair<BrickKey, Faces>>& changing,
                              const std::vector<BrickKey>& keys, const ModelOctree& octree,
                              const ModelLeaf& all_empty) {
  const absl::flat_hash_set<BrickKey> within(keys.begin(), keys.end());
  absl::flat_hash_map<BrickKey, Faces> known;
  const auto faces_of = [&](BrickKey key) {
    const auto [it, fresh] = known.try_emplace(key, Faces{0});
    if (fresh) {
      const ModelLeaf leaf = octree.Find(BrickOf(key));
      if (leaf != nullptr && leaf != all_empty) it->second = FacesWithSurface(*leaf);
    }
    return it->second;
  };
  std::vector<BrickKey> found;
  for (const auto& [key, faces] : changing) {
    for (int face = 0; face < 6; ++face) {
      if ((faces >> face & 1) == 0) continue;
      const int axis = face / 2;
      const VoxelIndex far =
          BrickOf(key) + VoxelIndex(VoxelIndex::Unit(axis) * (face % 2 == 0 ? -2 : 2));
      for (int beside = 0; beside < 9; ++beside) {
        VoxelIndex brick = far;
        brick[(axis + 1) % 3] += beside % 3 - 1;
        brick[(axis + 2) % 3] += beside / 3 - 1;
        const BrickKey there = KeyOf(brick);
        if (within.contains(there)) continue;
        // Its face towards the change.
        if ((faces_of(there) >> (face ^ 1) & 1) != 0) found.push_back(there);
      }
    }
  }
  return found;
}

// The bricks that the layer can have an influence on, ascending.
std::vector<BrickKey> Influenced(const ScanLayer& touched, LayerChange change,
                                 std::span<const BrickKey> also, const ModelOctree& octree,
                                 double voxel_size, const ModelLeaf& all_empty) {
  absl::flat_hash_map<BrickKey, bool> known;
  const auto stays_empty = [&](const VoxelIndex& b) {
    const auto [it, fresh] = known.try_emplace(KeyOf(b), false);
    if (fresh) {
      const LayerBrick* own = touched.Find(b);
      it->second = (own == nullptr || own->empty.All()) && octree.Find(b) == all_empty;
    }
    return it->second;
  };
  std::vector<BrickKey> keys = BricksWithDropouts(touched, octree, voxel_size);
  std::vector<std::pair<BrickKey, Faces>> changing;
  for (const BrickKey key : also) {
    changing.emplace_back(key, Faces{0x3f});
    ForEachAround(BrickOf(key), [&](const VoxelIndex& b) { keys.push_back(KeyOf(b)); });
  }
  for (const auto& [key, own] : touched.bricks) {
    const VoxelIndex brick = BrickOf(key);
    // Deep inside known-empty space nothing can change, nor touch anything that can.
    if (change == LayerChange::kAdded && stays_empty(brick)) {
      bool deep = true;
      ForEachAround(brick, [&](const VoxelIndex& b) { deep = deep && stays_empty(b); });
      if (deep) continue;
    }
    BrickMask known_voxels = own.surface;
    for (size_t w = 0; w < own.empty.word.size(); ++w) known_voxels.word[w] |= own.empty.word[w];
    changing.emplace_back(key, FacesNear(known_voxels));
    ForEachAround(brick, [&](const VoxelIndex& b) { keys.push_back(KeyOf(b)); });
  }
  const auto in_order = [&keys] {
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  };
  in_order();
  const std::vector<BrickKey> far = TwoAway(changing, keys, octree, all_empty);
  if (!far.empty()) {
    keys.insert(keys.end(), far.begin(), far.end());
    in_order();
  }
  return keys;
}

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
  const std::vector<BrickKey> keys =
      Influenced(touched, change, also, octree, voxel_size, all_empty);
  MergeRegion region(keys, layers, octree, all_empty);
  const size_t recomputed = region.recomputed();

  // Each stage reads what the one before wrote, in the bricks around too, so each is a loop of its
  // own.
  parallel.For(region.with_points(), [&](size_t i) {
    MergedBrick& brick = region.merged(i);
    if (brick.united == nullptr) {
      brick.united = Unite(region.brick(i), region.InLayers(i), layers);
    }
  });
  parallel.For(region.with_planes(), [&](size_t i) {
    MergedBrick& brick = region.merged(i);
    if (brick.united == nullptr || brick.united->sums.empty()) return;
    brick.fitted =
        FitPlanes(region.brick(i), region.UnitedAround(i), region.InLayers(i), layers, voxel_size);
  });
  parallel.For(region.with_planes(), [&](size_t i) {
    if (region.merged(i).fitted.empty()) return;
    region.merged(i).plane = SnapToFlatNeighbours(region.Around(i), voxel_size);
  });
  parallel.For(region.with_planes(), [&](size_t i) {
    MergedBrick& brick = region.merged(i);
    if (brick.plane.empty()) return;
    std::vector<LocalPlane>().swap(brick.fitted);  // no longer needed
    brick.dominated = FindDominated(region.brick(i), region.Around(i), voxel_size);
  });
  parallel.For(region.with_planes(), [&](size_t i) {
    MergedBrick& brick = region.merged(i);
    if (brick.plane.empty()) return;
    brick.absorbed = ChooseAbsorbers(region.brick(i), region.Around(i), voxel_size);
    size_t rank = 0;
    brick.united->surface.ForEach([&](int local) {
      if (brick.absorbed[rank++] >= 0) brick.given_away.Set(local);
    });
  });
  std::vector<ModelLeaf> contents(recomputed);
  std::vector<uint8_t> same(recomputed);
  parallel.For(recomputed, [&](size_t i) {
    contents[i] = PublishBrick(region, i, voxel_size, all_empty);
    const ModelLeaf& before = region.before(i);
    same[i] = contents[i] == before ||
              (contents[i] != nullptr && before != nullptr && SameBits(*contents[i], *before));
  });

  MergeResult result;
  result.recomputed = recomputed;
  for (size_t i = 0; i < recomputed; ++i) {
    if (same[i] != 0) continue;
    octree.Set(region.brick(i), contents[i]);
    result.changed.push_back({region.brick(i), std::move(contents[i])});
  }
  return result;
}

}  // namespace vantage::model
