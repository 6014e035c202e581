// Draws regret and stated gap over time.
#ifndef VANTAGE_TESTS_BENCH_ANYTIME_CURVES_H_
#define VANTAGE_TESTS_BENCH_ANYTIME_CURVES_H_

#include <string>

#include "core/parallel/parallel.h"
#include "tests/bench/answer_judge.h"
#include "tests/bench/planning_job.h"

namespace vantage::bench {

// The planner's evaluation with options as the planner sets them.
planning::Evaluation AnytimeEvaluation(const PlanningJob& job, uint64_t seed,
                                       const parallel::Budget& budget,
                                       parallel::Parallel& parallel);

// Draws our curves, the paper's patch order and the rival (not tuned) for one scene. False when the
// file cannot be written.
bool DrawAnytimeCurves(const std::string& path, const std::string& scene, const PlanningJob& job,
                       const AnswerJudge& judge, parallel::Parallel& parallel);

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_ANYTIME_CURVES_H_
