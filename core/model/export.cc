#include "core/model/export.h"

#include <octomap/OcTree.h>

#include <array>
#include <bit>
#include <cstring>
#include <sstream>

#include "absl/strings/str_cat.h"

namespace vantage {

static_assert(std::endian::native == std::endian::little, "PLY is written in memory's byte order");

std::string ExportOctomap(const PlanningView& model) {
  octomap::OcTree tree(model.voxel_size());
  const float occupied = tree.getClampingThresMaxLog();
  const float free = tree.getClampingThresMinLog();
  for (const BrickAt& at : model.bricks()) {
    for (int local = 0; local < Brick::kVoxels; ++local) {
      const VoxelState state = at.contents->state[static_cast<size_t>(local)];
      if (state == VoxelState::kUnknown || IsFalseSurface(state)) continue;
      const VoxelIndex v = PlanningView::Global(at.brick, local);
      const octomap::OcTreeKey key(static_cast<octomap::key_type>(v.x() + 32768),
                                   static_cast<octomap::key_type>(v.y() + 32768),
                                   static_cast<octomap::key_type>(v.z() + 32768));
      tree.setNodeValue(key, state == VoxelState::kEmpty ? free : occupied, /*lazy_eval=*/true);
    }
  }
  tree.updateInnerOccupancy();
  tree.prune();
  std::ostringstream out;
  tree.write(out);
  return out.str();
}

std::string ExportSurfacePly(const PlanningView& model) {
  std::string out = absl::StrCat(
      "ply\nformat binary_little_endian 1.0\ncomment voxel ", model.voxel_size(),
      " m\nelement vertex ", model.SurfaceCount(),
      "\nproperty float x\nproperty float y\nproperty float z\nproperty float nx\nproperty float ny"
      "\nproperty float nz\nproperty uchar red\nproperty uchar green\nproperty uchar blue"
      "\nproperty uchar kind\nproperty float density\nproperty float area\nproperty uint samples"
      "\nproperty uchar given_up"
      "\nend_header\n");
  // Grey, vermilion, blue, green: told apart by colour-blind people too.
  constexpr std::array<std::array<uint8_t, 3>, kSurfaceKinds> kColours = {
      {{160, 160, 160}, {213, 94, 0}, {0, 114, 178}, {0, 158, 115}}};
  const auto append = [&out](const auto& value) {
    char bytes[sizeof(value)];
    std::memcpy(bytes, &value, sizeof(value));
    out.append(bytes, sizeof(value));
  };
  model.ForEachSurface([&](const VoxelIndex&, VoxelState state, const SurfaceVoxel& surface) {
    for (int i = 0; i < 3; ++i) append(surface.centroid[i]);
    for (int i = 0; i < 3; ++i) append(surface.normal[i]);
    const uint8_t kind = static_cast<uint8_t>(KindOf(state));
    for (const uint8_t channel : kColours[kind]) append(channel);
    append(kind);
    append(surface.density);
    append(surface.area);
    append(surface.samples);
    append(static_cast<uint8_t>(surface.given_up ? 1 : 0));
  });
  return out;
}

}  // namespace vantage
