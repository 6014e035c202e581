// What a snapshot's sections hold (snapshot.h): one scan's layer, or a run of bricks of the octree.
#ifndef VANTAGE_CORE_MODEL_SNAPSHOT_SECTIONS_H_
#define VANTAGE_CORE_MODEL_SNAPSHOT_SECTIONS_H_

#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/string_view.h"
#include "core/model/brick_pages.h"
#include "core/model/model_octree.h"
#include "core/model/scan_layer.h"
#include "core/model/snapshot_header.h"

namespace vantage {

// A layer as it was before anything was taken out of it as a phantom: which apertures there are is
// for all layers together to say. Reading checks everything that is later used as an index or a
// size; nothing if the bytes are not a layer.
class LayerCodec {
 public:
  static std::string Write(const ScanLayer& layer);
  // `header`: of the snapshot. The layer's algorithm version may be newer than there are.
  static std::unique_ptr<ScanLayer> Read(absl::string_view bytes, const SnapshotHeader& header);

 private:
  static void WriteAperture(const Aperture& aperture, class SnapshotWriter& out);
  static Aperture ReadAperture(class SnapshotReader& in);
  static void WriteSurface(const RangeSurface& surface, class SnapshotWriter& out);
  static std::optional<RangeSurface> ReadSurface(class SnapshotReader& in);
};

// Bricks in order of their keys. `all_empty` is the shared brick of nothing but empty voxels, in
// what is written and in what is read.
std::string WriteBricks(std::span<const BrickAt> bricks, const ModelLeaf& all_empty);
std::optional<std::vector<BrickAt>> ReadBricks(absl::string_view bytes, uint16_t format_version,
                                               const ModelLeaf& all_empty);

// Masks with the sums of the voxels in the second, as layers have them.
void WriteMasksAndSums(const BrickMask& empty, const BrickMask& surface,
                       std::span<const SurfaceSums> sums, SnapshotWriter& out);
// Fails `in` when the masks overlap.
void ReadMasksAndSums(SnapshotReader& in, BrickMask& empty, BrickMask& surface,
                      std::vector<SurfaceSums>& sums);

}  // namespace vantage

#endif  // VANTAGE_CORE_MODEL_SNAPSHOT_SECTIONS_H_
