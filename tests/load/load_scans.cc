#include "tests/load/load_scans.h"

#include <algorithm>
#include <random>
#include <thread>
#include <utility>

#include "core/parallel/thread_pool.h"
#include "tests/bench/scan_job.h"

namespace vantage::load {

std::vector<sensor::Scan> MakeLoadScans(size_t count) {
  constexpr uint64_t kScene = 1;
  constexpr double kOff = 0.1;       // m
  constexpr double kTurned = 0.087;  // rad
  parallel::ThreadPool pool(static_cast<int>(std::max(1U, std::thread::hardware_concurrency())));
  bench::ScanJob job = bench::MakeFlatJob(kScene, count, pool);
  std::mt19937 random(kScene);
  std::uniform_real_distribution<double> error(-1, 1);
  for (size_t i = 0; i < count; ++i) {
    sensor::PosePrior& prior = job.scans[i].prior.emplace();
    prior.T_world_scan = job.poses[i];
    if (i == 0) continue;
    prior.T_world_scan.pretranslate(kOff *
                                    Eigen::Vector3d(error(random), error(random), error(random)));
    prior.T_world_scan.rotate(Eigen::AngleAxisd(kTurned * error(random), Eigen::Vector3d::UnitZ()));
  }
  return std::move(job.scans);
}

sensor::RangeImage Unseen(const sensor::RangeImage& image, uint64_t number) {
  constexpr float kMoved = 0.001F;    // m
  constexpr uint64_t kStride = 7919;  // cells; spreads them over the image
  sensor::RangeImage changed = image;
  size_t cell = static_cast<size_t>(number * kStride) % changed.range.size();
  while (!sensor::RangeImage::IsRange(changed.range[cell]))
    cell = (cell + 1) % changed.range.size();
  changed.range[cell] += kMoved;
  return changed;
}

}  // namespace vantage::load
