#include "core/model/view/export.h"

#include <octomap/OcTree.h>

#include <array>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "core/bytes/ply_writer.h"

namespace vantage::model {

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
  const bytes::PlyElement vertex = {"vertex",
                                    model.SurfaceCount(),
                                    {{"x", bytes::PlyType::kFloat},
                                     {"y", bytes::PlyType::kFloat},
                                     {"z", bytes::PlyType::kFloat},
                                     {"nx", bytes::PlyType::kFloat},
                                     {"ny", bytes::PlyType::kFloat},
                                     {"nz", bytes::PlyType::kFloat},
                                     {"red", bytes::PlyType::kUint8},
                                     {"green", bytes::PlyType::kUint8},
                                     {"blue", bytes::PlyType::kUint8},
                                     {"kind", bytes::PlyType::kUint8},
                                     {"density", bytes::PlyType::kFloat},
                                     {"area", bytes::PlyType::kFloat},
                                     {"samples", bytes::PlyType::kUint32},
                                     {"given_up", bytes::PlyType::kUint8}}};
  std::string out =
      bytes::EncodePlyHeader(absl::StrCat("voxel ", model.voxel_size(), " m"), {vertex});
  // Grey, vermilion, blue, green: told apart by colour-blind people too.
  constexpr std::array<std::array<uint8_t, 3>, kSurfaceKinds> kColours = {
      {{160, 160, 160}, {213, 94, 0}, {0, 114, 178}, {0, 158, 115}}};
  model.ForEachSurface([&](const VoxelIndex&, VoxelState state, const SurfaceVoxel& surface) {
    const Eigen::Vector3f& c = surface.centroid;
    const Eigen::Vector3f& n = surface.normal;
    const auto kind = static_cast<uint8_t>(KindOf(state));
    const auto& [red, green, blue] = kColours[kind];
    bytes::AppendPlyValues(out, c.x(), c.y(), c.z(), n.x(), n.y(), n.z(), red, green, blue, kind,
                           surface.density, surface.area, surface.samples,
                           static_cast<uint8_t>(surface.given_up ? 1 : 0));
  });
  return out;
}

}  // namespace vantage::model
