// What a snapshot's sections of bricks hold (snapshot.h): a run of those of the octree, or those of
// a layer.
#ifndef VANTAGE_CORE_MODEL_SNAPSHOT_SNAPSHOT_BRICKS_H_
#define VANTAGE_CORE_MODEL_SNAPSHOT_SNAPSHOT_BRICKS_H_

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"
#include "core/model/carve/scan_layer.h"
#include "core/model/merge/model_octree.h"
#include "core/model/view/brick_mask.h"
#include "core/model/view/brick_pages.h"

namespace vantage::model {

class SnapshotReader;
class SnapshotWriter;

// Bricks in order of their keys. `all_empty` is the shared brick of nothing but empty voxels, in
// what is written and in what is read. `voxel_size` in m.
std::string WriteBricks(std::span<const BrickAt> bricks, const ModelLeaf& all_empty);
std::optional<std::vector<BrickAt>> ReadBricks(absl::string_view bytes, uint16_t format_version,
                                               double voxel_size, const ModelLeaf& all_empty);

// Masks with the sums of the voxels in the second, as layers have them.
void WriteMasksAndSums(const BrickMask& empty, const BrickMask& surface, const PackedSums& sums,
                       SnapshotWriter& out);
// Fails `in` when the masks overlap.
void ReadMasksAndSums(SnapshotReader& in, BrickMask& empty, BrickMask& surface, PackedSums& sums);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_SNAPSHOT_SNAPSHOT_BRICKS_H_
