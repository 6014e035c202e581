// The planner that a good engineer would build in a week: brute force with packets on a lattice of
// views and a random sample of cells, refined around the best views; the leaders are scored
// exactly.
#ifndef VANTAGE_TESTS_BENCH_RIVAL_PLANNER_H_
#define VANTAGE_TESTS_BENCH_RIVAL_PLANNER_H_

#include <cstdint>
#include <vector>

#include "core/parallel/budget.h"
#include "core/planning/evaluation/evaluation.h"
#include "tests/bench/planning_job.h"

namespace vantage::bench {

struct RivalSettings {
  int stride = 3;              // of the lattice, viewcells
  size_t draws = 1024;         // of cells
  double refined = 0.05;       // of the lattice, the best, whose neighbours are scored as well
  double lattice_share = 0.5;  // of the time, at most; half of the rest is for refining
};

// Every combination that the rival is tuned over.
std::vector<RivalSettings> RivalChoices();

// One thread. Views scored exactly rank before those that are estimated.
planning::Evaluation RivalEvaluation(const PlanningJob& job, const RivalSettings& settings,
                                     uint64_t seed, const parallel::Budget& budget);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_RIVAL_PLANNER_H_
