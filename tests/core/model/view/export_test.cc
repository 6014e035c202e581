// Exports, read back by OctoMap's own library and by hand.
#include "core/model/view/export.h"

#include <gtest/gtest.h>
#include <octomap/OcTree.h>

#include <memory>
#include <sstream>

#include "core/bytes/byte_order.h"
#include "core/model/partial_model.h"
#include "tests/core/model/closed_form_scene.h"

namespace vantage::model {
namespace {

class ExportTest : public testing::Test {
 protected:
  void SetUp() override {
    const ClosedFormScene scene = BoxInRoom();
    parallel::Serial serial;
    auto model = PartialModel::Create({}).value();
    for (size_t i = 0; i < scene.stations.size(); ++i) {
      const Eigen::Isometry3d pose = PoseAt(scene.stations[i]);
      ASSERT_TRUE(
          model->Insert("s" + std::to_string(i), ScanScene(scene, pose, {}), pose, serial).ok());
    }
    view_ = model->Publish();
  }
  std::shared_ptr<const PlanningView> view_;
};

// Both formats have comments that readers skip and people read.
TEST_F(ExportTest, OctomapFilesSayWhereTheyLie) {
  const Eigen::Vector3d origin(450'000.25, 5'412'000.5, 312.125);
  for (const std::string& file :
       {ExportOctomap(*view_, origin), ExportBinaryOctomap(*view_, origin)}) {
    EXPECT_NE(file.find("origin of this tree is (450000.2500, 5412000.5000, 312.1250)"),
              std::string::npos);
  }
  std::istringstream in(ExportBinaryOctomap(*view_, origin));
  octomap::OcTree binary(1.0);
  ASSERT_TRUE(binary.readBinary(in));
  EXPECT_DOUBLE_EQ(binary.getResolution(), view_->voxel_size());
}

TEST_F(ExportTest, OctomapReadsTheTree) {
  std::istringstream in(ExportOctomap(*view_, {450'000.25, 5'412'000.5, 312.125}));
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
  constexpr size_t kVertex = 3 * 8 + 3 * 4 + 4 + 3 * 4 + 1;
  EXPECT_EQ(ply.size(), header.size() + kVertex * view_->SurfaceCount());
}

// All bytes: other people's tools read them.
TEST(ExportSurfacePlyTest, WritesOneVertexPerVoxelWithArea) {
  auto brick = std::make_shared<Brick>();
  brick->state[5] = VoxelState::kFalseImage;
  brick->surface_mask[0] = uint64_t{1} << 5;
  brick->surface.push_back({Eigen::Vector3f(0.275f, 0.025f, 0.03f), Eigen::Vector3f(0.6f, 0, -0.8f),
                            0.0025f, 1.5f, 7, 0, 0, false, true});
  const PlanningView view(0.05, 1, {{VoxelIndex::Zero(), brick}}, {});
  std::string expected =
      "ply\nformat binary_little_endian 1.0\ncomment surface of voxels of 0.05 m\n"
      "comment x y z: mean of the samples, m, world; nx ny nz: unit normal\n"
      "comment kind: 1 measured, 2 occlusion, 3 hole, 4 image boundary\n"
      "comment density: samples per m2; area: m2; samples: measured; given_up: 1 where no scan "
      "will bring more\n"
      "element vertex 1\n"
      "property double x\nproperty double y\nproperty double z\nproperty float nx\n"
      "property float ny\nproperty float nz\nproperty uchar red\nproperty uchar green\n"
      "property uchar blue\nproperty uchar kind\nproperty float density\nproperty float area\n"
      "property uint samples\nproperty uchar given_up\nend_header\n";
  // A national grid, where a float tells half a metre from nothing.
  const Eigen::Vector3d origin(450'000.25, 5'412'000.5, 312.125);
  for (const double value : {origin.x() + 0.275f, origin.y() + 0.025f, origin.z() + 0.03f}) {
    bytes::AppendLittleEndian(value, expected);
  }
  for (const float value : {0.6f, 0.0f, -0.8f}) bytes::AppendLittleEndian(value, expected);
  for (const uint8_t value : {0, 158, 115, 4}) bytes::AppendLittleEndian(value, expected);
  bytes::AppendLittleEndian(1.5f, expected);
  bytes::AppendLittleEndian(0.0025f, expected);
  bytes::AppendLittleEndian(uint32_t{7}, expected);
  bytes::AppendLittleEndian(uint8_t{1}, expected);
  EXPECT_EQ(ExportSurfacePly(view, origin), expected);
}

}  // namespace
}  // namespace vantage::model
