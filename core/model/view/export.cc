#include "core/model/view/export.h"

#include <octomap/OcTree.h>

#include <array>
#include <sstream>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/bytes/ply_writer.h"

namespace vantage::model {

namespace {

octomap::OcTree TreeOf(const PlanningView& model) {
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
  return tree;
}

// Behind the first line, which tells readers what the file is. They skip comments.
std::string WithFrame(std::string file, const Eigen::Vector3d& origin) {
  file.insert(file.find('\n') + 1,
              absl::StrFormat("# m; the origin of this tree is (%.4f, %.4f, %.4f) in the world\n",
                              origin.x(), origin.y(), origin.z()));
  return file;
}

}  // namespace

std::string ExportOctomap(const PlanningView& model, const Eigen::Vector3d& origin) {
  std::ostringstream out;
  TreeOf(model).write(out);
  return WithFrame(out.str(), origin);
}

std::string ExportBinaryOctomap(const PlanningView& model, const Eigen::Vector3d& origin) {
  std::ostringstream out;
  TreeOf(model).writeBinary(out);
  return WithFrame(out.str(), origin);
}

std::string ExportSurfacePly(const PlanningView& model, const Eigen::Vector3d& origin) {
  const bytes::PlyElement vertex = {"vertex",
                                    model.SurfaceCount(),
                                    {{"x", bytes::PlyType::kDouble},
                                     {"y", bytes::PlyType::kDouble},
                                     {"z", bytes::PlyType::kDouble},
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
  std::string out = bytes::EncodePlyHeader(
      absl::StrCat("surface of voxels of ", model.voxel_size(),
                   " m\n"
                   "x y z: mean of the samples, m, world; nx ny nz: unit normal\n"
                   "kind: 1 measured, 2 occlusion, 3 hole, 4 image boundary\n"
                   "density: samples per m2; area: m2; samples: measured; given_up: 1 where no "
                   "scan will bring more"),
      {vertex});
  // Grey, vermilion, blue, green: told apart by colour-blind people too.
  constexpr std::array<std::array<uint8_t, 3>, kSurfaceKinds> kColours = {
      {{160, 160, 160}, {213, 94, 0}, {0, 114, 178}, {0, 158, 115}}};
  model.ForEachSurface([&](const VoxelIndex&, VoxelState state, const SurfaceVoxel& surface) {
    const Eigen::Vector3d c = origin + surface.centroid.cast<double>();
    const Eigen::Vector3f& n = surface.normal;
    const auto kind = static_cast<uint8_t>(KindOf(state));
    const auto& [red, green, blue] = kColours[kind];
    bytes::AppendPlyValues(out, c.x(), c.y(), c.z(), n.x(), n.y(), n.z(), red, green, blue,
                           static_cast<uint8_t>(kind + 1), surface.density, surface.area,
                           surface.samples, static_cast<uint8_t>(surface.given_up ? 1 : 0));
  });
  return out;
}

}  // namespace vantage::model
