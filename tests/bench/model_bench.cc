// The cost of a model of many scans: time to merge and memory.
#include <memory>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/model/carve/carve.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/scan_job.h"
#include "tests/bench/scenes.h"
#include "tests/support/resident_memory.h"

namespace vantage::bench {

namespace {

void BenchMerge(const ScanJob& job, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("merge.")) return;
  parallel::Serial serial;
  const size_t last = job.scans.size() - 1;
  const auto model = ModelOf(job, last, parallel);
  std::vector<double> shares;
  for (int run = 0; run < 5; ++run) {
    const model::MergeReport report =
        model->Insert("last", job.scans[last], job.poses[last], serial).value();
    shares.push_back(report.merge_seconds / report.carve_seconds);
    (void)model->Withdraw("last", serial).value();
  }
  figures.Add({"merge.tenth.share", Percentile(shares, 0.5), "of its carve", "1",
               "merge, normals, frontier of a job's tenth scan over its carve, one thread, median "
               "of 5"});
}

// Resident memory of a model and of what each scan leaves with it, MB.
struct Footprint {
  double model = 0;   // octree and planning view
  double layers = 0;  // of the scans: to withdraw them, and to merge others exactly
  size_t surface_voxels = 0;
};

// `scan` makes the scan of a number at its pose; what it returns is gone again before the next.
template <typename MakeScan>
Footprint Measure(size_t scans, MakeScan&& make_scan, parallel::Parallel& parallel) {
  Footprint footprint;
  {
    const double before = test_support::ResidentMegabytes();
    auto model = model::PartialModel::Create({}).value();
    for (size_t i = 0; i < scans; ++i) {
      const auto [scan, pose] = make_scan(i);
      (void)model->Insert(absl::StrCat("scan", i), scan, pose, parallel).value();
    }
    const std::shared_ptr<const model::PlanningView> view = model->Publish();
    footprint.model = test_support::ResidentMegabytes() - before;
    footprint.surface_voxels = view->SurfaceCount();
  }
  const double before = test_support::ResidentMegabytes();
  std::vector<std::unique_ptr<model::ScanLayer>> layers;
  for (size_t i = 0; i < scans; ++i) {
    const auto [scan, pose] = make_scan(i);
    layers.push_back(model::Carve(scan, pose, {}, parallel));
  }
  footprint.layers = test_support::ResidentMegabytes() - before;
  footprint.model -= footprint.layers;
  return footprint;
}

void BenchFlatMemory(const ScanJob& job, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("model.bytes_per_voxel") && !figures.Wants("model.layer.mb")) return;
  const Footprint flat = Measure(
      job.scans.size(), [&](size_t i) { return std::pair(job.scans[i], job.poses[i]); }, parallel);
  const auto voxels = static_cast<double>(flat.surface_voxels);
  const std::string after =
      absl::StrCat("flat, ", job.scans.size(), " scans, ", flat.surface_voxels, " surface voxels");
  figures.Add({"model.bytes_per_voxel", flat.model * 1e6 / voxels, "bytes", "120",
               absl::StrCat("octree and planning view, resident; ", after)});
  figures.Add({"model.layer.mb", flat.layers / static_cast<double>(job.scans.size()), "MB", "",
               "what the model keeps of each scan, to forget it bit for bit"});
}

// A storey of 1,000 m2 with range 30 m, as a building is scanned.
void BenchStoreyMemory(uint64_t seed, parallel::Parallel& parallel, Figures& figures) {
  constexpr size_t kScans = 30;
  const simulation::Scene scene = simulation::OfficeStorey(seed, 1000);
  const simulation::SimulatedScanner simulated(scene.mesh);
  sensor::ScannerModel scanner;
  scanner.range_max = 30;
  const auto make_scan = [&](size_t i) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(scene.starts[i * scene.starts.size() / kScans]);
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = simulated.Scan(scanner, pose, simulation::ScanFaults{}, i, parallel);
    return std::pair(std::move(scan), pose);
  };
  const Footprint storey = Measure(kScans, make_scan, parallel);
  figures.Add({"model.1000m2.mb", storey.model, "MB", "400",
               absl::StrCat("octree and planning view of ", storey.surface_voxels,
                            " surface voxels after ", kScans, " scans, resident")});
  figures.Add({"model.1000m2.layers.mb", storey.layers, "MB", "", "what is kept of the scans"});
}

}  // namespace

void BenchModel(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  const uint64_t seed = SceneSeeds(options.use).front();
  if (figures.Wants("merge.") || figures.Wants("model.bytes_per_voxel") ||
      figures.Wants("model.layer.mb")) {
    const ScanJob job = MakeFlatJob(seed, 10, parallel);
    BenchMerge(job, parallel, figures);
    BenchFlatMemory(job, parallel, figures);
  }
  if (options.full && figures.Wants("model.1000m2.")) BenchStoreyMemory(seed, parallel, figures);
}

}  // namespace vantage::bench
