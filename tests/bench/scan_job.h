// A job in a generated scene: the scans that a planner would have had made, and the model of them.
#ifndef VANTAGE_TESTS_BENCH_SCAN_JOB_H_
#define VANTAGE_TESTS_BENCH_SCAN_JOB_H_

#include <cstdint>
#include <memory>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/sensor/scan.h"
#include "core/simulation/scenes/scene.h"

namespace vantage::bench {

struct ScanJob {
  std::vector<sensor::Scan> scans;
  std::vector<Eigen::Isometry3d> poses;  // true, scanner to model
};

// `count` scans of 1,440 x 600 rays, the first from the scene's first start, the others where the
// planner says, at a fixed work limit. `seed`: of the scanner's faults.
ScanJob MakeScanJob(const simulation::Scene& scene, uint64_t seed, size_t count,
                    parallel::Parallel& parallel);
// In the furnished flat of a seed.
ScanJob MakeFlatJob(uint64_t seed, size_t count, parallel::Parallel& parallel);

// The model of the first `count` scans.
std::unique_ptr<model::PartialModel> ModelOf(const ScanJob& job, size_t count,
                                             parallel::Parallel& parallel);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_SCAN_JOB_H_
