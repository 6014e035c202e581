// The groups of figures, each of which measures itself against a reference in the same run.
#ifndef VANTAGE_TESTS_BENCH_BENCHMARKS_H_
#define VANTAGE_TESTS_BENCH_BENCHMARKS_H_

#include "core/parallel/parallel.h"
#include "tests/bench/figures.h"

namespace vantage {

void BenchCycle(Parallel& parallel, Figures& figures);     // cycle.*
void BenchCarve(Parallel& parallel, Figures& figures);     // carve.*
void BenchSnapshot(Parallel& parallel, Figures& figures);  // snapshot.*
void BenchPlanning(Parallel& parallel, Figures& figures);  // plan.*
// merge.*, model.*: what many scans cost; `full` adds a whole floor.
void BenchModel(bool full, Parallel& parallel, Figures& figures);
// plan.exact.*: the hierarchy against brute force; `full` adds what takes minutes.
void BenchEvaluator(bool full, Parallel& parallel, Figures& figures);

}  // namespace vantage

#endif  // VANTAGE_TESTS_BENCH_BENCHMARKS_H_
