// Carving one scan against OctoMap's insertPointCloud, the same scan in the same run.
#include <octomap/OcTree.h>

#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "core/model/carve/carve.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/scan_job.h"
#include "tests/bench/scenes.h"
#include "tests/support/resident_memory.h"

namespace vantage::bench {

namespace {

// What OctoMap is given: the samples in the model's frame.
octomap::Pointcloud CloudOf(const sensor::Scan& scan, const Eigen::Isometry3d& pose) {
  octomap::Pointcloud cloud;
  cloud.reserve(scan.image.cells());
  for (int c = 0; c < scan.image.columns(); ++c) {
    for (int r = 0; r < scan.image.rows(); ++r) {
      const float range = scan.image.at(c, r);
      if (!sensor::RangeImage::IsRange(range)) continue;
      const Eigen::Vector3f p =
          (pose * (static_cast<double>(range) * scan.image.Direction(c, r))).cast<float>();
      cloud.push_back(p.x(), p.y(), p.z());
    }
  }
  return cloud;
}

std::unique_ptr<octomap::OcTree> InsertIntoOctomap(const octomap::Pointcloud& cloud,
                                                   const Eigen::Isometry3d& pose,
                                                   double voxel_size) {
  const Eigen::Vector3f o = pose.translation().cast<float>();
  auto tree = std::make_unique<octomap::OcTree>(voxel_size);
  tree->insertPointCloud(cloud, octomap::point3d(o.x(), o.y(), o.z()));
  return tree;
}

std::unique_ptr<model::PartialModel> Insert(const sensor::Scan& scan, const Eigen::Isometry3d& pose,
                                            const model::ModelConfig& config,
                                            parallel::Parallel& parallel) {
  auto model = model::PartialModel::Create(config).value();
  (void)model->Insert("scan", scan, pose, parallel).value();
  return model;
}

// The scan to the planning view, with all threads.
double WorkingSeconds(int runs, const sensor::Scan& scan, const Eigen::Isometry3d& pose,
                      const model::ModelConfig& config, parallel::Parallel& parallel) {
  return MedianSeconds(runs, [&] { (void)Insert(scan, pose, config, parallel)->Publish(); });
}

void BenchSize(const std::string& name, const std::string& aim, const std::string& what,
               const sensor::Scan& scan, const Eigen::Isometry3d& pose,
               const model::ModelConfig& config, parallel::Parallel& parallel, Figures& figures) {
  const octomap::Pointcloud cloud = CloudOf(scan, pose);
  const double octomap_seconds =
      WallSeconds([&] { (void)InsertIntoOctomap(cloud, pose, config.voxel_size); });
  parallel::Serial serial;
  const double carve = MedianSeconds(3, [&] { (void)model::Carve(scan, pose, config, serial); });
  const double working = WorkingSeconds(3, scan, pose, config, parallel);
  figures.Add({absl::StrCat("carve.", name, ".speedup"), octomap_seconds / working, "x", aim,
               absl::StrCat(what, ", planning view out, ", parallel.width(),
                            " threads; insertPointCloud ", octomap_seconds, " s")});
  figures.Add({absl::StrCat("carve.", name, ".layer.speedup"), octomap_seconds / carve, "x", "",
               absl::StrCat(what, ", scan layer out, one thread: no merge, normals or frontier")});
}

void BenchFlatScan(const sensor::Scan& scan, const Eigen::Isometry3d& pose,
                   parallel::Parallel& parallel, Figures& figures) {
  const model::ModelConfig config;
  parallel::Serial serial;
  const octomap::Pointcloud cloud = CloudOf(scan, pose);
  const double octomap_seconds =
      MedianSeconds(3, [&] { (void)InsertIntoOctomap(cloud, pose, config.voxel_size); });
  figures.Add({"carve.octomap.seconds", octomap_seconds, "s", "",
               absl::StrCat("insertPointCloud as it comes, ", cloud.size(), " points")});
  const double carve = MedianSeconds(5, [&] { (void)model::Carve(scan, pose, config, serial); });
  figures.Add({"carve.seconds", carve, "s", "", "scan layer, one thread, median of 5"});
  figures.Add({"carve.layer.speedup", octomap_seconds / carve, "x", "",
               "the same: empty space, surface and its sums, reflections; no merge"});
  const double octree = MedianSeconds(5, [&] { (void)Insert(scan, pose, config, serial); });
  figures.Add({"carve.octree.speedup", octomap_seconds / octree, "x", "15",
               "insertPointCloud over ours: octree out, one thread, surface, normals, densities "
               "and frontier included"});
  const double working = WorkingSeconds(5, scan, pose, config, parallel);
  figures.Add({"carve.working.speedup", octomap_seconds / working, "x", "60",
               absl::StrCat("the same, planning view out, ", parallel.width(), " threads")});

  std::unique_ptr<octomap::OcTree> tree;
  const double theirs = test_support::TransientMegabytes(
      [&] { tree = InsertIntoOctomap(cloud, pose, config.voxel_size); });
  std::unique_ptr<model::PartialModel> model;
  const double ours =
      test_support::TransientMegabytes([&] { model = Insert(scan, pose, config, serial); });
  figures.Add({"carve.octree.extra_mb", ours, "MB", "10",
               absl::StrCat("peak over what is kept, resident; insertPointCloud's ", theirs)});
}

}  // namespace

void BenchCarve(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("carve.")) return;
  const uint64_t seed = SceneSeeds(options.use).front();
  const ScanJob job = MakeFlatJob(seed, 1, parallel);
  const sensor::Scan& scan = job.scans[0];
  const Eigen::Isometry3d& pose = job.poses[0];
  BenchFlatScan(scan, pose, parallel, figures);
  if (figures.Wants("carve.25mm.")) {
    BenchSize("25mm", "60", "2.5 cm voxels", scan, pose, {.voxel_size = 0.025}, parallel, figures);
  }
  if (figures.Wants("carve.10m.")) {
    sensor::Scan dense;
    dense.scanner.azimuth_step = 2 * sensor::kPi / 5000;
    dense.scanner.elevation_step = sensor::Radians(150) / 2000;
    const simulation::SimulatedScanner simulated(simulation::FurnishedFlat(seed).mesh);
    dense.image = simulated.Scan(dense.scanner, pose, simulation::ScanFaults{}, 1, parallel);
    BenchSize("10m", "50", absl::StrCat(dense.image.columns(), " x ", dense.image.rows(), " rays"),
              dense, pose, {}, parallel, figures);
  }
}

}  // namespace vantage::bench
