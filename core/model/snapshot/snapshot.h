// A partial model as bytes: versioned, checksummed, compressed, and complete. What is loaded goes
// on as if it had never been away: the same merge, withdrawal or plan gives the same bits.
//
//   offset  size       what
//        0     4       magic "VSNP"
//        4     2       format version (u16)
//        6     2       0
//        8     4       algorithm version (u32): the oldest that a scan was carved with
//       12     4       number of sections (u32)
//       16    24 each  per section: kind (u32), CRC-32C of its bytes (u32), their number (u64), and
//                      how many they are decompressed (u64)
//        .     4       CRC-32C of everything before
//   then the sections one after the other, each a Zstandard frame: the site, one a scan's layer
//   (with its range image, as carving left it), and runs of the octree's bricks.
//
// Little-endian; one model has exactly one encoding. Format 1 is read, too: a layer does not say
// which version carved it (the header's did), and a brick also has the sums and planes that it was
// merged from.
#ifndef VANTAGE_CORE_MODEL_SNAPSHOT_SNAPSHOT_H_
#define VANTAGE_CORE_MODEL_SNAPSHOT_SNAPSHOT_H_

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/model/carve/scan_layer.h"
#include "core/model/merge/model_octree.h"
#include "core/model/view/algorithm_version.h"
#include "core/model/view/brick_pages.h"
#include "core/model/view/model_config.h"
#include "core/parallel/parallel.h"

namespace vantage::model {

struct SavedSite {
  ModelConfig config;
  uint64_t version = 0;
  uint32_t algorithm_version = kModelAlgorithmVersion;
};

// The parts of a model that a snapshot keeps.
struct ModelParts {
  SavedSite site;
  std::vector<std::string> order;  // of the scans, as they came
  std::map<std::string, std::unique_ptr<ScanLayer>> layers;
  std::vector<BrickAt> bricks;  // that are not unknown, by z, y, x
};

// `bricks` by z, y, x. PartialModel::Save is for everyone else.
std::string EncodeSnapshot(const SavedSite& site, const std::vector<std::string>& order,
                           const std::map<std::string, std::unique_ptr<ScanLayer>>& layers,
                           const std::vector<BrickAt>& bricks, const ModelLeaf& all_empty,
                           parallel::Parallel& parallel);

// Errors as ReadSnapshotHeader; RESOURCE_EXHAUSTED: more than `max_bytes` decompressed.
// Reflections are not masked in the layers yet.
absl::StatusOr<ModelParts> DecodeSnapshot(absl::string_view bytes, size_t max_bytes,
                                          const ModelLeaf& all_empty, parallel::Parallel& parallel);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_SNAPSHOT_SNAPSHOT_H_
