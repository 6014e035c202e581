// Exports, read back by OctoMap's own library and by hand.
#include "core/model/export.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <memory>
#include <sstream>

#include "core/model/partial_model.h"
#include "tests/core/model/closed_form_scene.h"

namespace vantage {
namespace {

class ExportTest : public testing::Test {
 protected:
  void SetUp() override {
    const ClosedFormScene scene = BoxInRoom();
    Serial serial;
    auto model = PartialModel::Create({}).value();
    for (size_t i = 0; i < scene.stands.size(); ++i) {
      const Eigen::Isometry3d pose = PoseAt(scene.stands[i]);
      ASSERT_TRUE(
          model->Insert("s" + std::to_string(i), ScanScene(scene, pose, {}), pose, serial).ok());
    }
    view_ = model->Publish();
  }
  std::shared_ptr<const PlanningView> view_;
};

TEST_F(ExportTest, OctomapReadsTheTree) {
  std::istringstream in(ExportOctomap(*view_));
  const std::unique_ptr<octomap::AbstractOcTree> read(octomap::AbstractOcTree::read(in));
  const auto* tree = dynamic_cast<const octomap::OcTree*>(read.get());
  ASSERT_NE(tree, nullptr);
  EXPECT_DOUBLE_EQ(tree->getResolution(), view_->voxel_size());
  const VoxelBox box = view_->bounds();
  size_t compared = 0;
  for (int z = box.min.z(); z < box.max.z(); ++z) {
    for (int y = box.min.y(); y < box.max.y(); ++y) {
      for (int x = box.min.x(); x < box.max.x(); ++x) {
        const VoxelIndex v(x, y, z);
        const Eigen::Vector3d c = view_->Centre(v);
        const octomap::OcTreeNode* node = tree->search(c.x(), c.y(), c.z());
        const VoxelState state = view_->State(v);
        if (state == VoxelState::kEmpty) {
          ASSERT_TRUE(node != nullptr && !tree->isNodeOccupied(node));
        } else if (state == VoxelState::kTrueSurface || state == VoxelState::kAbsorbed) {
          ASSERT_TRUE(node != nullptr && tree->isNodeOccupied(node));
        } else {
          ASSERT_EQ(node, nullptr);
        }
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 100'000u);
}

TEST_F(ExportTest, PlyHoldsEverySurfaceVoxel) {
  const std::string ply = ExportSurfacePly(*view_);
  const std::string header = ply.substr(0, ply.find("end_header\n") + 11);
  EXPECT_EQ(header.rfind("ply\nformat binary_little_endian 1.0\n", 0), 0u);
  EXPECT_NE(header.find("element vertex " + std::to_string(view_->SurfaceCount()) + "\n"),
            std::string::npos);
  constexpr size_t kVertex = 6 * 4 + 4 + 3 * 4 + 1;
  EXPECT_EQ(ply.size(), header.size() + kVertex * view_->SurfaceCount());
}

}  // namespace
}  // namespace vantage
