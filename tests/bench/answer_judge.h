// Measures how good an evaluation's answer is when the exact score of every view is known.
#ifndef VANTAGE_TESTS_BENCH_ANSWER_JUDGE_H_
#define VANTAGE_TESTS_BENCH_ANSWER_JUDGE_H_

#include <cstdint>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/planning/evaluation/evaluation.h"
#include "core/planning/plan/plan.h"
#include "core/planning/ranking/registration_check.h"
#include "tests/bench/planning_job.h"

namespace vantage::bench {

// Scores all views exactly, by the hierarchy. Keeps the reference. Thread safe.
class AnswerJudge {
 public:
  AnswerJudge(const PlanningJob& job, parallel::Parallel& parallel);

  // The regret, [0, 1]: the share of the score that is lost by taking the first registrable view of
  // the evaluation's ranking (views apart by the separation) instead of that of the exact ranking.
  // 1: none was found.
  double Regret(const planning::Evaluation& evaluation) const;
  // The same of a whole plan's first view.
  double Regret(const planning::Plan& plan) const;
  // Whether every view's true score lies within its bounds.
  bool BoundsHold(const planning::Evaluation& evaluation) const;

  double best() const { return best_; }
  const std::vector<double>& truth() const { return truth_; }
  // CPU of one thread that brute force takes for all views, from a sample of them.
  double brute_seconds() const { return brute_seconds_; }

 private:
  int FirstRegistrable(const planning::Evaluation& evaluation) const;

  const PlanningJob& job_;
  const planning::OverlapSurface& overlap_;
  std::vector<double> truth_;
  double best_ = 0;
  double brute_seconds_ = 0;
};

}  // namespace vantage::bench

#endif  // VANTAGE_TESTS_BENCH_ANSWER_JUDGE_H_
