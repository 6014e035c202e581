// What it costs to merge anew what an adjustment of poses has moved: all scans of a building.
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/time/clock.h"
#include "core/model/partial_model.h"
#include "core/parallel/thread_pool.h"
#include "core/sensor/encoding.h"
#include "core/simulation/scenes/office_storey.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/simulated_scanner.h"
#include "tests/bench/benchmarks.h"
#include "tests/bench/scenes.h"

namespace vantage::bench {

// A hundred scans of an office storey, with the steps that previews have; each is decoded again
// from what is stored, as a session does, and all but the first are moved by centimetres.
void BenchRemerge(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures) {
  if (!figures.Wants("loop.remerge.")) return;
  constexpr size_t kScans = 100;
  const uint64_t seed = SceneSeeds(options.use).front();
  const simulation::Scene scene = simulation::OfficeStorey(seed, 1500);
  const simulation::SimulatedScanner simulated(scene.mesh);
  sensor::ScannerModel scanner;
  scanner.azimuth_step = scanner.elevation_step = sensor::Radians(0.25);
  scanner.range_max = 30;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> share(0, 1);
  std::normal_distribution<double> off(0, 0.02);
  auto model = model::PartialModel::Create({}).value();
  std::vector<std::string> stored;
  std::vector<model::ScanMove> moves;
  double insert_seconds = 0;
  while (stored.size() < kScans) {
    // Around a place where a scanner can start, as far as it is free.
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translate(scene.starts[stored.size() % scene.starts.size()] +
                   Eigen::Vector3d(share(random) - 0.5, share(random) - 0.5, 0));
    if (simulated.Clearance(pose.translation(), 0.3) < 0.3) continue;
    pose.rotate(Eigen::AngleAxisd(2 * M_PI * share(random), Eigen::Vector3d::UnitZ()));
    sensor::Scan scan;
    scan.scanner = scanner;
    scan.image = simulated.Scan(scanner, pose, {}, stored.size() + 1, parallel);
    const std::string id = absl::StrCat("scan", stored.size());
    stored.push_back(sensor::EncodeRangeImage(scan.image));
    const absl::Time start = absl::Now();
    (void)model->Insert(id, scan, pose, parallel).value();
    insert_seconds += absl::ToDoubleSeconds(absl::Now() - start);
    if (stored.size() == 1) continue;
    pose.pretranslate(Eigen::Vector3d(off(random), off(random), 0.2 * off(random)));
    moves.push_back({id, pose});
  }
  const auto load = [&](absl::string_view id) -> absl::StatusOr<sensor::Scan> {
    sensor::Scan scan;
    scan.scanner = scanner;
    auto image =
        sensor::DecodeRangeImage(stored[std::stoul(std::string(id.substr(4)))], size_t{1} << 30);
    if (!image.ok()) return image.status();
    scan.image = *std::move(image);
    return scan;
  };
  const absl::Time start = absl::Now();
  const model::MergeReport moved =
      model
          ->Move(moves, load, parallel, std::numeric_limits<int64_t>::max(),
                 static_cast<size_t>(parallel.width()))
          .value();
  const double seconds = absl::ToDoubleSeconds(absl::Now() - start);
  figures.Add({"loop.remerge.seconds", seconds, "s", "20",
               absl::StrCat(kScans,
                            " scans of 1,500 m2 of offices, 0.25 degrees, all but the first "
                            "moved; of it carving ",
                            moved.carve_seconds, " s, merging ", moved.merge_seconds, " s")});
  figures.Add({"loop.remerge.share", seconds / insert_seconds, "", "0.7",
               "of what merging them one after the other took"});
}

}  // namespace vantage::bench
