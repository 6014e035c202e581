// The groups of figures, each of which measures itself against a reference in the same run.
#ifndef VANTAGE_TESTS_BENCH_BENCHMARKS_H_
#define VANTAGE_TESTS_BENCH_BENCHMARKS_H_

#include <string>

#include "core/parallel/parallel.h"
#include "tests/bench/figures.h"

namespace vantage::bench {

struct BenchOptions {
  bool full = false;     // what takes many minutes as well
  std::string pictures;  // folder for curves; empty: none are drawn
};

void BenchCycle(parallel::Parallel& parallel, Figures& figures);     // cycle.*
void BenchCarve(parallel::Parallel& parallel, Figures& figures);     // carve.*
void BenchSnapshot(parallel::Parallel& parallel, Figures& figures);  // snapshot.*
// plan.*: packets, budgets, memory.
void BenchPlanning(bool full, parallel::Parallel& parallel, Figures& figures);
// merge.*, model.*: what many scans cost; `full` adds a whole storey.
void BenchModel(bool full, parallel::Parallel& parallel, Figures& figures);
// plan.exact.*: the hierarchy against brute force; `full` adds what takes minutes.
void BenchEvaluator(bool full, parallel::Parallel& parallel, Figures& figures);
// fleet.*: several scanners on one job; `full`: on 1,000 m^2, with 1 to 8 scanners.
void BenchFleet(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures);
// align.*, predict.ms: registration, beside PCL's ICP, which `full` gives all of the pairs.
void BenchRegistration(bool full, parallel::Parallel& parallel, Figures& figures);
// site.*: views in the air, and places without a view; `full`: in 1,000 scenes.
void BenchSite(bool full, parallel::Parallel& parallel, Figures& figures);
// plan.anytime.*, plan.threads2.*: what is answered at a budget.
void BenchAnytime(const BenchOptions& options, parallel::Parallel& parallel, Figures& figures);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_BENCHMARKS_H_
