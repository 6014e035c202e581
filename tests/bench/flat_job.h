// A job in the furnished flat: the scans that a planner would have had made, and the model of them.
#ifndef VANTAGE_TESTS_BENCH_FLAT_JOB_H_
#define VANTAGE_TESTS_BENCH_FLAT_JOB_H_

#include <memory>
#include <vector>

#include "core/model/partial_model.h"
#include "core/parallel/parallel.h"
#include "core/sensor/scan.h"

namespace vantage::bench {

struct FlatJob {
  std::vector<sensor::Scan> scans;
  std::vector<Eigen::Isometry3d> poses;  // true, scanner to model
};

// `count` scans of 1,440 x 600 rays, the first from the flat's first start, the others where the
// planner says, at a fixed work limit.
FlatJob MakeFlatJob(uint64_t seed, size_t count, parallel::Parallel& parallel);

// The model of the first `count` scans.
std::unique_ptr<model::PartialModel> ModelOf(const FlatJob& job, size_t count,
                                             parallel::Parallel& parallel);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_FLAT_JOB_H_
