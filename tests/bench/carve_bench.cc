// Carving one scan against OctoMap's insertPointCloud, the same scan in the same run.
#include <octomap/OcTree.h>

#include "absl/strings/str_cat.h"
#include "core/model/carve.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/flat_job.h"

namespace vantage {

void BenchCarve(Parallel& parallel, Figures& figures) {
  if (!figures.Wants("carve.") && !figures.Wants("merge.")) return;
  const FlatJob job = MakeFlatJob(1, 4, parallel);
  const Scan& scan = job.scans[0];
  const Eigen::Isometry3d& pose = job.poses[0];
  const ModelConfig config;
  Serial serial;

  octomap::Pointcloud cloud;
  for (int c = 0; c < scan.image.columns(); ++c) {
    for (int r = 0; r < scan.image.rows(); ++r) {
      const float range = scan.image.at(c, r);
      if (!RangeImage::IsRange(range)) continue;
      const Eigen::Vector3f p =
          (pose * (static_cast<double>(range) * scan.image.Direction(c, r))).cast<float>();
      cloud.push_back(p.x(), p.y(), p.z());
    }
  }
  const Eigen::Vector3f o = pose.translation().cast<float>();
  const double octomap_seconds = MedianSeconds(3, [&] {
    octomap::OcTree tree(config.voxel_size);
    tree.insertPointCloud(cloud, octomap::point3d(o.x(), o.y(), o.z()));
  });
  figures.Add({"carve.octomap.seconds", octomap_seconds, "s", "",
               absl::StrCat("insertPointCloud as it comes, ", cloud.size(), " points")});

  const double carve = MedianSeconds(5, [&] { (void)Carve(scan, pose, config, serial); });
  figures.Add({"carve.seconds", carve, "s", "", "scan layer, one thread, median of 5"});
  const double octree = MedianSeconds(5, [&] {
    auto model = PartialModel::Create(config).value();
    (void)model->Insert("scan", scan, pose, serial).value();
  });
  figures.Add({"carve.octree.speedup", octomap_seconds / octree, "x", "15",
               "insertPointCloud over ours: octree out, one thread, surface, normals, densities "
               "and frontier included"});
  const double working = MedianSeconds(5, [&] {
    auto model = PartialModel::Create(config).value();
    (void)model->Insert("scan", scan, pose, parallel).value();
    (void)model->Publish();
  });
  figures.Add({"carve.working.speedup", octomap_seconds / working, "x", "60",
               absl::StrCat("the same, planning view out, ", parallel.width(), " threads")});

  const auto model = ModelOf(job, 3, parallel);
  const MergeReport fourth = model->Insert("last", job.scans[3], job.poses[3], serial).value();
  figures.Add({"merge.fourth.share", fourth.merge_seconds / fourth.carve_seconds, "of its carve",
               "", "merge of a job's fourth scan over its carve, one thread"});
}

}  // namespace vantage
