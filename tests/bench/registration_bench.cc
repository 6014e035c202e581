// Alignment beside PCL's point-to-plane ICP, predictions, and scans without a prior.
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/model/partial_model.h"
#include "core/planning/ranking/registration_check.h"
#include "core/registration/align/align.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/bound/registration_result.h"
#include "core/registration/global_registration.h"
#include "core/registration/registration.h"
#include "core/simulation/random_sequence.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/scenes/small_scenes.h"
#include "core/simulation/simulated_scanner.h"
#include "core/visibility/occlusion_scene.h"
#include "core/visibility/opaque_grid.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/scenes.h"
#include "tests/core/registration/align/pcl_icp.h"

namespace vantage::bench {
namespace {

using Eigen::Vector3d;

constexpr size_t kPairs = 50;
constexpr size_t kPerScene = 10;
// Priors that PCL's ICP can still begin from.
constexpr double kPriorMetres = 0.05;
constexpr double kPriorRadians = sensor::Radians(1);
constexpr double kPclReach = 0.15;  // m, of its correspondences

Eigen::Isometry3d Upright(const Vector3d& position, double heading) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translate(position);
  pose.rotate(Eigen::AngleAxisd(heading, Vector3d::UnitZ()));
  return pose;
}

sensor::Scan Measure(const simulation::SimulatedScanner& tracer,
                     const sensor::ScannerModel& scanner, const Eigen::Isometry3d& pose,
                     uint64_t seed, parallel::Parallel& parallel) {
  sensor::Scan scan;
  scan.scanner = scanner;
  scan.image = tracer.Scan(scanner, pose, simulation::ScanFaults{}, seed, parallel);
  return scan;
}

double Metres(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  return (a.translation() - b.translation()).norm();
}

void BenchAlign(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  std::vector<double> seconds, ours, theirs, speedup, our_error, their_error;
  double samples = 0;
  const sensor::ScannerModel scanner;
  parallel::Serial serial;
  for (uint64_t seed = SceneSeeds(options.use).front(); seconds.size() < kPairs; ++seed) {
    const simulation::Scene scene = simulation::FurnishedFlat(seed);
    const simulation::SimulatedScanner tracer(scene.mesh);
    simulation::RandomSequence random(seed);
    const Vector3d first = scene.starts[0];
    auto model = model::PartialModel::Create({}).value();
    const Eigen::Isometry3d T_first = Upright(first, 0.3);
    model->Insert("first", Measure(tracer, scanner, T_first, seed, parallel), T_first, parallel)
        .value();
    const auto view = model->Publish();
    size_t made = 0;
    for (int tries = 0; made < kPerScene && tries < 1000 && seconds.size() < kPairs; ++tries) {
      const Vector3d at = first + Vector3d(random.Between(-2.5, 2.5), random.Between(-2.5, 2.5),
                                           random.Between(-0.2, 0.2));
      if (tracer.Clearance(at, 0.35) < 0.35 || !tracer.Visible(first, at)) continue;
      const Eigen::Isometry3d truth = Upright(at, random.Between(0, 2 * sensor::kPi));
      const sensor::Scan scan = Measure(tracer, scanner, truth, 1000 * seed + made, parallel);
      sensor::PosePrior prior;
      const double heading = random.Between(0, 2 * sensor::kPi);
      const double axis = random.Between(0, 2 * sensor::kPi);
      prior.T_world_scan = truth;
      prior.T_world_scan.pretranslate(kPriorMetres *
                                      Vector3d(std::cos(heading), std::sin(heading), 0));
      prior.T_world_scan.rotate(
          Eigen::AngleAxisd(kPriorRadians, Vector3d(std::cos(axis), std::sin(axis), 0)));
      registration::RegistrationResult result;
      seconds.push_back(WallSeconds(
          [&] { result = registration::Register(*view, scan, prior, {}, parallel).value(); }));
      samples += static_cast<double>(scan.image.SampleCount());
      // PCL takes many seconds for each.
      if (made++ > 0 && !options.full) continue;
      const registration::ScanSurface surface = registration::SampleSurface(
          scan, registration::RegistrationConfig().sample_spacing, serial);
      registration::Alignment alignment;
      ours.push_back(ThreadSeconds(
          [&] { alignment = registration::Align(*view, surface, prior, {}, serial); }));
      Eigen::Isometry3d pcl;
      const size_t most = std::min<size_t>(24'000, surface.samples.size());
      theirs.push_back(ThreadSeconds([&] {
        pcl = registration::AlignByPcl(*view, {surface.samples.data(), most}, prior.T_world_scan,
                                       kPclReach);
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
void BenchPredict(const char* name, const char* of, const simulation::Scene& scene, const char* aim,
                  parallel::Parallel& parallel, Figures& figures) {
  const simulation::SimulatedScanner tracer(scene.mesh);
  const sensor::ScannerModel scanner;
  const Eigen::Isometry3d pose = Upright(scene.starts[0], 0);
  auto model = model::PartialModel::Create({}).value();
  model->Insert("first", Measure(tracer, scanner, pose, 1, parallel), pose, parallel).value();
  const auto view = model->Publish();
  size_t surface = 0;
  view->ForEachSurface(
      [&](const model::VoxelIndex&, model::VoxelState state, const model::SurfaceVoxel&) {
        surface += state == model::VoxelState::kTrueSurface ? 1 : 0;
      });
  const visibility::OpaqueGrid grid(*view);
  const auto occlusion = visibility::OcclusionScene::Create(grid, parallel).value();
  const auto overlap =
      planning::OverlapSurface::Create(*view, grid, occlusion, scanner, parallel).value();
  std::vector<double> milliseconds;
  for (size_t k = 0; k < kPairs; ++k) {
    const double angle = 0.37 * static_cast<double>(k);
    const Vector3d at = scene.starts[0] + Vector3d(1.2 * std::cos(angle), 1.2 * std::sin(angle), 0);
    milliseconds.push_back(1000 * ThreadSeconds([&] {
                             (void)overlap.Predict(at, occlusion, {},
                                                   parallel::Budget::Unlimited());
                           }));
  }
  figures.Add({name, Percentile(milliseconds, 0.5), "ms", aim,
               absl::StrFormat("a candidate, one thread, visibility included; %s of %dk true "
                               "surface voxels",
                               of, surface / 1000)});
}

void BenchGlobalRegistration(const BenchOptions& options, parallel::Parallel& parallel,
                             Figures& figures) {
  std::vector<double> seconds;
  int right = 0;
  int wrong = 0;
  const sensor::ScannerModel scanner;
  const uint64_t flats = options.full ? 4 : 2;
  const uint64_t first = SceneSeeds(options.use).front();
  for (uint64_t seed = first; seed < first + flats; ++seed) {
    const simulation::Scene flat = simulation::FurnishedFlat(seed);
    const simulation::SimulatedScanner tracer(flat.mesh);
    auto model = model::PartialModel::Create({}).value();
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
      const sensor::Scan scan = Measure(tracer, scanner, truth, 100 * seed + i, parallel);
      registration::RegistrationResult result;
      seconds.push_back(WallSeconds([&] {
        result = registration::RegisterGlobally(*model->Publish(), scan,
                                                Upright(flat.starts.back(), 0), {}, parallel)
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

// Two storeys side by side.
simulation::Scene BesideEachOther(simulation::Scene a, const simulation::Scene& b) {
  const float away =
      a.mesh.Bounds().max().cast<float>().x() + 2.0f - b.mesh.Bounds().min().cast<float>().x();
  const auto first = static_cast<uint32_t>(a.mesh.vertices.size());
  for (const Eigen::Vector3f& vertex : b.mesh.vertices) {
    a.mesh.vertices.push_back(vertex + Eigen::Vector3f(away, 0, 0));
  }
  for (const std::array<uint32_t, 3>& t : b.mesh.triangles) {
    a.mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  a.mesh.material.insert(a.mesh.material.end(), b.mesh.material.begin(), b.mesh.material.end());
  for (const Vector3d& start : b.starts) {
    a.starts.push_back(start + Vector3d(static_cast<double>(away), 0, 0));
  }
  return a;
}

// 10,000 m2 of which 40 rooms and corridors were scanned, and scans without a prior in some of
// them.
void BenchLargeSite(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  constexpr double kArea = 5000;  // m2, of each of two
  constexpr size_t kStations = 40;
  constexpr size_t kWithoutPrior = 6;
  const uint64_t seed = SceneSeeds(options.use).front();
  const simulation::Scene storey = BesideEachOther(simulation::OfficeStorey(seed, kArea),
                                                   simulation::OfficeStorey(seed + 1, kArea));
  const simulation::SimulatedScanner tracer(storey.mesh);
  const sensor::ScannerModel scanner;
  auto model = model::PartialModel::Create({}).value();
  const auto start = [&](size_t i) { return storey.starts[i * storey.starts.size() / kStations]; };
  for (size_t i = 0; i < kStations; ++i) {
    const Eigen::Isometry3d pose = Upright(start(i), 0.7 * static_cast<double>(i));
    model
        ->Insert(std::to_string(i), Measure(tracer, scanner, pose, seed + i, parallel), pose,
                 parallel)
        .value();
  }
  const auto view = model->Publish();
  const Eigen::Vector3d size =
      view->voxel_size() * (view->bounds().max - view->bounds().min).cast<double>();
  std::vector<double> seconds;
  int right = 0;
  int wrong = 0;
  for (size_t i = 0; i < kWithoutPrior; ++i) {
    const Eigen::Isometry3d truth =
        Upright(start(i * kStations / kWithoutPrior) + Vector3d(0.3, -0.2, 0),
                2.0 + static_cast<double>(i));
    const sensor::Scan scan = Measure(tracer, scanner, truth, 100 * seed + i, parallel);
    registration::RegistrationResult result;
    seconds.push_back(WallSeconds([&] {
      result = registration::RegisterGlobally(*view, scan, Upright(start(kStations - 1), 0), {},
                                              parallel)
                   .value();
    }));
    if (!result.verdict.registered()) continue;
    (Metres(result.T_world_scan, truth) < 0.02 ? right : wrong) += 1;
  }
  figures.Add(
      {"align.coarse.10000m2.seconds", Percentile(seconds, 0.5), "s", "5",
       absl::StrFormat("median; slowest %.2f s; model of %.0f x %.0f x %.0f m; of %d scans without "
                       "a prior %d registered within 20 mm, %d wrong, the rest left open",
                       Percentile(seconds, 1), size.x(), size.y(), size.z(), seconds.size(), right,
                       wrong)});
}

}  // namespace

void BenchRegistration(const BenchOptions& options, parallel::Parallel& parallel,
                       Figures& figures) {
  const uint64_t seed = SceneSeeds(options.use).front();
  if (figures.Wants("align.seconds") || figures.Wants("align.speedup") ||
      figures.Wants("align.accuracy_ratio")) {
    BenchAlign(options, parallel, figures);
  }
  if (figures.Wants("predict.ms")) {
    BenchPredict("predict.ms", "furnished flat", simulation::FurnishedFlat(seed), "2", parallel,
                 figures);
  }
  if (figures.Wants("predict.hall.ms")) {
    BenchPredict("predict.hall.ms", "hall", simulation::PillarHall(seed), "", parallel, figures);
  }
  if (figures.Wants("align.coarse.seconds")) BenchGlobalRegistration(options, parallel, figures);
  if (options.full && figures.Wants("align.coarse.10000m2.seconds")) {
    BenchLargeSite(options, parallel, figures);
  }
}

}  // namespace vantage::bench
