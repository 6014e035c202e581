// What a snapshot keeps of one scan (snapshot.h): its layer.
#ifndef VANTAGE_CORE_MODEL_SNAPSHOT_LAYER_CODEC_H_
#define VANTAGE_CORE_MODEL_SNAPSHOT_LAYER_CODEC_H_

#include <memory>
#include <optional>
#include <string>

#include "absl/strings/string_view.h"
#include "core/model/carve/scan_layer.h"
#include "core/model/reflections/aperture.h"
#include "core/model/scan/range_surface.h"
#include "core/model/snapshot/snapshot_header.h"

namespace vantage::model {

class SnapshotReader;
class SnapshotWriter;

// Writes and reads a layer as it was before reflections were taken out of it, since the apertures
// follow from all layers together. Reading checks everything that is later used as an index or a
// size; nothing if the bytes are not a layer.
class LayerCodec {
 public:
  static std::string Write(const ScanLayer& layer);
  // `header`: of the snapshot. The layer's algorithm version may be newer than this release's.
  static std::unique_ptr<ScanLayer> Read(absl::string_view bytes, const SnapshotHeader& header);

 private:
  static void WriteSuspects(const ScanLayer& layer, SnapshotWriter& out);
  static void ReadSuspects(SnapshotReader& in, ScanLayer& layer);
  static void WriteAperture(const Aperture& aperture, SnapshotWriter& out);
  static Aperture ReadAperture(SnapshotReader& in);
  static void WriteSurface(const RangeSurface& surface, SnapshotWriter& out);
  static std::optional<RangeSurface> ReadSurface(SnapshotReader& in);
};

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_SNAPSHOT_LAYER_CODEC_H_
