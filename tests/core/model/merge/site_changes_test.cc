// A thing that was moved is told by where it was and where it is; a site that stayed is not.
#include "core/model/merge/site_changes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/mesh_builder.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/core/model/closed_form_scene.h"
#include "tests/support/runs.h"

namespace vantage::model {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

sensor::ScannerModel ChangeScanner() {
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.4);
  return scanner;
}

class SiteChangesTest : public testing::Test {
 protected:
  // Merges a scan of what stands there at the moment.
  MergeReport Merge(const simulation::TriangleMesh& mesh, const std::string& id,
                    const Vector3d& at) {
    const simulation::SimulatedScanner tracer(mesh);
    sensor::Scan scan;
    scan.scanner = ChangeScanner();
    const Eigen::Isometry3d pose = PoseAt(at, 0.3 * static_cast<double>(++scans_));
    scan.image = tracer.Scan(scan.scanner, pose, {}, scans_, pool_);
    return model_->Insert(id, scan, pose, pool_).value();
  }

  static simulation::TriangleMesh RoomWith(const std::vector<AlignedBox3d>& things) {
    simulation::TriangleMesh mesh;
    simulation::MeshBuilder builder(mesh);
    builder.Box({-3, -2.5, 0}, {3, 2.5, 2.7});
    for (const AlignedBox3d& thing : things) builder.Box(thing.min(), thing.max());
    return mesh;
  }

  parallel::ThreadPool pool_{2};
  std::unique_ptr<PartialModel> model_ = PartialModel::Create({}).value();
  uint64_t scans_ = 0;
};

const AlignedBox3d kBefore(Vector3d(1.6, -0.6, 0), Vector3d(2.1, 0.6, 1.9));
const AlignedBox3d kAfter(Vector3d(-0.6, 1.5, 0), Vector3d(0.6, 2.0, 1.9));
const AlignedBox3d kStays(Vector3d(-2.8, -2.3, 0), Vector3d(-2.2, -1.5, 0.8));

// A voxel to either side of where it stands.
bool Within(const AlignedBox3d& box, const AlignedBox3d& place) {
  const Vector3d margin = Vector3d::Constant(0.101);
  return AlignedBox3d(place.min() - margin, place.max() + margin).contains(box);
}

TEST_F(SiteChangesTest, ACupboardThatWasMovedIsGoneAndCame) {
  EXPECT_TRUE(Merge(RoomWith({kBefore, kStays}), "first", {-0.5, -0.5, 1.5}).changes.empty());
  // A second one from elsewhere, which shows the same site.
  EXPECT_TRUE(Merge(RoomWith({kBefore, kStays}), "second", {-1.0, 0.8, 1.5}).changes.empty());
  const MergeReport report = Merge(RoomWith({kAfter, kStays}), "third", {0.2, -0.9, 1.5});
  double came = 0;
  double gone = 0;
  for (const SiteChange& change : report.changes) {
    const bool is_came = change.kind == SiteChange::Kind::kCame;
    EXPECT_TRUE(Within(change.box, is_came ? kAfter : kBefore))
        << change.box.min().transpose() << " to " << change.box.max().transpose();
    EXPECT_TRUE(change.box.contains(change.centre));
    (is_came ? came : gone) = std::max(is_came ? came : gone, change.area);
    EXPECT_EQ(change.since, "second");
  }
  // Of the front, 1.2 x 1.9 m, all but a border of a voxel and what hid it.
  EXPECT_GT(came, 1.1 * 1.6);
  EXPECT_LT(came, 1.35 * 2.0);
  EXPECT_GT(gone, 1.1 * 1.6);
  EXPECT_LT(gone, 1.35 * 2.0);
}

TEST_F(SiteChangesTest, SinceIsTheNewestScanThatKnowsThePlace) {
  Merge(RoomWith({kBefore}), "zebra", {-0.5, -0.5, 1.5});
  Merge(RoomWith({kAfter}), "ape", {0.2, -0.9, 1.5});
  const MergeReport report = Merge(RoomWith({kBefore}), "lion", {-1.0, 0.3, 1.5});
  ASSERT_FALSE(report.changes.empty());
  for (const SiteChange& change : report.changes) {
    // It came back where the second saw through; what the second showed is gone again.
    EXPECT_EQ(change.since, "ape");
  }
}

// Of glass, which one scan meets squarely and another sees through, or a mirror, likewise.
bool OnAPane(const simulation::TriangleMesh& mesh, const SiteChange& change) {
  for (size_t t = 0; t < mesh.triangles.size(); ++t) {
    const simulation::Material material = mesh.material[t];
    if (material != simulation::Material::kGlass && material != simulation::Material::kMirror) {
      continue;
    }
    AlignedBox3d box;
    for (const uint32_t vertex : mesh.triangles[t])
      box.extend(mesh.vertices[vertex].cast<double>());
    const Vector3d voxels = Vector3d::Constant(0.15);
    if (AlignedBox3d(box.min() - voxels, box.max() + voxels).contains(change.centre)) return true;
  }
  return false;
}

TEST_F(SiteChangesTest, AFlatThatStayedAsItWasHasNone) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> off(0, 0.004);  // m, each axis: poses are not exact
  for (int seed = 0; seed < test_support::Runs(3); ++seed) {
    const simulation::Scene flat = simulation::FurnishedFlat(static_cast<uint64_t>(40 + seed));
    const simulation::SimulatedScanner tracer(flat.mesh);
    const auto model = PartialModel::Create({}).value();
    for (uint64_t i = 0; i < 4; ++i) {
      sensor::Scan scan;
      scan.scanner = ChangeScanner();
      Vector3d at;
      do {
        at = flat.starts[i % flat.starts.size()] + 200 * Vector3d(off(random), off(random), 0);
      } while (tracer.Clearance(at, 0.4) < 0.4);
      Eigen::Isometry3d pose = PoseAt(at, static_cast<double>(i));
      scan.image = tracer.Scan(scan.scanner, pose, {}, i + 1, pool_);
      pose.pretranslate(Vector3d(off(random), off(random), off(random)));
      const MergeReport report =
          model->Insert("scan" + std::to_string(i), scan, pose, pool_).value();
      for (const SiteChange& change : report.changes) {
        if (OnAPane(flat.mesh, change)) continue;
        ADD_FAILURE() << "flat " << seed << ", scan " << i << ": " << change.area << " m2 around "
                      << change.centre.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace vantage::model
