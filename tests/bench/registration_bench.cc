// Alignment beside PCL's point-to-plane ICP, predictions, and scans without a prior.
#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/model/partial_model.h"
#include "core/planning/occlusion_scene.h"
#include "core/planning/opaque_grid.h"
#include "core/planning/registration_check.h"
#include "core/registration/align.h"
#include "core/registration/anywhere.h"
#include "core/registration/registration.h"
#include "core/registration/scan_surface.h"
#include "core/simulation/counter_random.h"
#include "core/simulation/scene.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/benchmarks.h"
#include "tests/core/registration/pcl_icp.h"

namespace vantage {
namespace {

using Eigen::Vector3d;

constexpr size_t kPairs = 50;
constexpr size_t kPerScene = 10;
// Priors that PCL's ICP can still begin from.
constexpr double kPriorMetres = 0.05;
constexpr double kPriorRadians = Radians(1);
constexpr double kPclReach = 0.15;  // m, of its correspondences

Eigen::Isometry3d Upright(const Vector3d& position, double heading) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(position);
  pose.rotate(Eigen::AngleAxisd(heading, Vector3d::UnitZ()));
  return pose;
}

Scan Measure(const SimulatedScanner& tracer, const ScannerModel& scanner,
             const Eigen::Isometry3d& pose, uint64_t seed, Parallel& parallel) {
  Scan scan;
  scan.scanner = scanner;
  scan.image = tracer.Scan(scanner, pose, ScanFaults{}, seed, parallel);
  return scan;
}

double Metres(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}

void BenchAlign(bool full, Parallel& parallel, Figures& figures) {
  std::vector<double> seconds, ours, theirs, speedup, our_error, their_error;
  double samples = 0;
  const ScannerModel scanner;
  Serial serial;
  for (uint64_t seed = 1; seconds.size() < kPairs; ++seed) {
    const Scene scene = FurnishedFlat(seed);
    const SimulatedScanner tracer(scene.mesh);
    RandomSequence random(seed);
    const Vector3d first = scene.starts[0];
    auto model = PartialModel::Create({}).value();
    const Eigen::Isometry3d T_first = Upright(first, 0.3);
    model->Insert("first", Measure(tracer, scanner, T_first, seed, parallel), T_first, parallel)
        .value();
    const auto view = model->Publish();
    size_t made = 0;
    for (int tries = 0; made < kPerScene && tries < 1000 && seconds.size() < kPairs; ++tries) {
      const Vector3d at = first + Vector3d(random.Between(-2.5, 2.5), random.Between(-2.5, 2.5),
                                           random.Between(-0.2, 0.2));
      if (tracer.Clearance(at, 0.35) < 0.35 || !tracer.Visible(first, at)) continue;
      const Eigen::Isometry3d truth = Upright(at, random.Between(0, 2 * kPi));
      const Scan scan = Measure(tracer, scanner, truth, 1000 * seed + made, parallel);
      PosePrior prior;
      const double heading = random.Between(0, 2 * kPi);
      const double axis = random.Between(0, 2 * kPi);
      prior.T_world_scan = truth;
      prior.T_world_scan.pretranslate(kPriorMetres *
                                      Vector3d(std::cos(heading), std::sin(heading), 0));
      prior.T_world_scan.rotate(
          Eigen::AngleAxisd(kPriorRadians, Vector3d(std::cos(axis), std::sin(axis), 0)));
      RegistrationResult result;
      seconds.push_back(
          WallSeconds([&] { result = Register(*view, scan, prior, {}, parallel).value(); }));
      samples += static_cast<double>(scan.image.SampleCount());
      // PCL takes many seconds for each.
      if (made++ > 0 && !full) continue;
      const ScanSurface surface = SampleSurface(scan, RegistrationConfig().sample_spacing, serial);
      Alignment alignment;
      ours.push_back(ThreadSeconds([&] { alignment = Align(*view, surface, prior, {}, serial); }));
      Eigen::Isometry3d pcl;
      const size_t most = std::min<size_t>(24'000, surface.samples.size());
      theirs.push_back(ThreadSeconds([&] {
        pcl = AlignByPcl(*view, {surface.samples.data(), most}, prior.T_world_scan, kPclReach);
      }));
      speedup.push_back(theirs.back() / ours.back());
      our_error.push_back(Metres(alignment.T_world_scan, truth));
      their_error.push_back(Metres(pcl, truth));
    }
  }
  const std::string of = absl::StrFormat("median of %d pairs in furnished flats, %.0fk samples",
                                         seconds.size(), samples / 1000 / double(seconds.size()));
  figures.Add({"align.seconds", Percentile(seconds, 0.5), "s", "0.1",
               absl::StrCat(of, "; scan to verdict, all threads")});
  figures.Add(
      {"align.speedup", Percentile(speedup, 0.5), "times", "5",
       absl::StrFormat("median of %d pairs; %.2f s against PCL's point-to-plane ICP "
                       "%.2f s, CPU, same samples, centroids and prior (%g m, 1 degree)",
                       ours.size(), Percentile(ours, 0.5), Percentile(theirs, 0.5), kPriorMetres)});
  figures.Add(
      {"align.accuracy_ratio", Percentile(their_error, 0.5) / Percentile(our_error, 0.5), "times",
       "10",
       absl::StrFormat("%.3f mm against PCL's %.3f mm, medians", 1000 * Percentile(our_error, 0.5),
                       1000 * Percentile(their_error, 0.5))});
}

// `name`: of the figure; `of`: of the scene, which one scan has seen.
void BenchPredict(const char* name, const char* of, const Scene& scene, const char* aim,
                  Parallel& parallel, Figures& figures) {
  const SimulatedScanner tracer(scene.mesh);
  const ScannerModel scanner;
  const Eigen::Isometry3d pose = Upright(scene.starts[0], 0);
  auto model = PartialModel::Create({}).value();
  model->Insert("first", Measure(tracer, scanner, pose, 1, parallel), pose, parallel).value();
  const auto view = model->Publish();
  size_t surface = 0;
  view->ForEachSurface([&](const VoxelIndex&, VoxelState state, const SurfaceVoxel&) {
    surface += state == VoxelState::kTrueSurface ? 1 : 0;
  });
  const OpaqueGrid grid(*view);
  const OcclusionScene occlusion(grid, OpaqueGrid(*view, {1, 2, 0}), parallel);
  const OverlapSurface overlap(*view, grid, occlusion, scanner);
  std::vector<double> milliseconds;
  for (size_t k = 0; k < kPairs; ++k) {
    const double angle = 0.37 * static_cast<double>(k);
    const Vector3d at = scene.starts[0] + Vector3d(1.2 * std::cos(angle), 1.2 * std::sin(angle), 0);
    milliseconds.push_back(1000 * ThreadSeconds([&] {
                             (void)overlap.Predict(at, occlusion, {}, Budget::Unlimited());
                           }));
  }
  figures.Add({name, Percentile(milliseconds, 0.5), "ms", aim,
               absl::StrFormat("a candidate, one thread, visibility included; %s of %dk true "
                               "surface voxels",
                               of, surface / 1000)});
}

void BenchAnywhere(bool full, Parallel& parallel, Figures& figures) {
  std::vector<double> seconds;
  int right = 0;
  int wrong = 0;
  const ScannerModel scanner;
  const uint64_t flats = full ? 4 : 2;
  for (uint64_t seed = 1; seed <= flats; ++seed) {
    const Scene flat = FurnishedFlat(seed);
    const SimulatedScanner tracer(flat.mesh);
    auto model = PartialModel::Create({}).value();
    for (size_t i = 0; i < flat.starts.size(); ++i) {
      const Eigen::Isometry3d pose = Upright(flat.starts[i], 0.7 * static_cast<double>(i));
      model
          ->Insert(std::to_string(i), Measure(tracer, scanner, pose, seed + i, parallel), pose,
                   parallel)
          .value();
    }
    for (size_t i = 0; i < flat.starts.size(); ++i) {
      const Eigen::Isometry3d truth =
          Upright(flat.starts[i] + Vector3d(0.3, -0.2, 0.1), 2.0 + 1.3 * static_cast<double>(i));
      const Scan scan = Measure(tracer, scanner, truth, 100 * seed + i, parallel);
      RegistrationResult result;
      seconds.push_back(WallSeconds([&] {
        result =
            RegisterAnywhere(*model->Publish(), scan, Upright(flat.starts.back(), 0), {}, parallel)
                .value();
      }));
      if (!result.verdict.registered()) continue;
      (Metres(result.T_world_scan, truth) < 0.02 ? right : wrong) += 1;
    }
  }
  figures.Add({"align.coarse.seconds", Percentile(seconds, 0.5), "s", "5",
               absl::StrFormat("median; slowest %.2f s; of %d scans without a prior in %d flats %d "
                               "registered within 20 mm, %d wrong, the rest left open",
                               Percentile(seconds, 1), seconds.size(), flats, right, wrong)});
}

}  // namespace

void BenchRegistration(bool full, Parallel& parallel, Figures& figures) {
  if (figures.Wants("align.seconds") || figures.Wants("align.speedup") ||
      figures.Wants("align.accuracy_ratio")) {
    BenchAlign(full, parallel, figures);
  }
  if (figures.Wants("predict.ms")) {
    BenchPredict("predict.ms", "furnished flat", FurnishedFlat(1), "2", parallel, figures);
  }
  if (figures.Wants("predict.hall.ms")) {
    BenchPredict("predict.hall.ms", "hall", PillarHall(1), "", parallel, figures);
  }
  if (figures.Wants("align.coarse.")) BenchAnywhere(full, parallel, figures);
}

}  // namespace vantage
