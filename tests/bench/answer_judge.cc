#include "tests/bench/answer_judge.h"

#include <algorithm>

#include "core/planning/evaluation/hierarchy.h"
#include "core/planning/ranking/rank_views.h"
#include "tests/bench/figures.h"

namespace vantage::bench {
namespace {

constexpr size_t kTimedViews = 300;  // by brute force

}  // namespace

AnswerJudge::AnswerJudge(const PlanningJob& job, parallel::Parallel& parallel)
    : job_(job), overlap_(job.problem->overlap()) {
  const auto hierarchy =
      planning::HierarchicalScorer::Create(job.scoring->scorer(), job.grid, job.scoring->cells(),
                                           job.feasible.cells(), job.feasible.cell_size(), {},
                                           parallel::Budget::Unlimited(), parallel)
          .value();
  planning::Evaluation all;
  for (const planning::ViewScore& score :
       planning::ScoreEveryView(*hierarchy, parallel::Budget::Unlimited(), parallel)) {
    truth_.push_back(score.score);
    all.views.push_back({score.score, score.score, score.score, true, true, 0});
  }
  const int best = FirstRegistrable(all);
  best_ = best >= 0 ? truth_[static_cast<size_t>(best)] : 0;
  const size_t stride = std::max<size_t>(1, job.views.size() / kTimedViews);
  size_t timed = 0;
  const double seconds = ThreadSeconds([&] {
    for (size_t i = stride / 2; i < job.views.size(); i += stride, ++timed) {
      (void)job.scoring->scorer().Score(job.views[i], job.scoring->cells(),
                                        parallel::Budget::Unlimited());
    }
  });
  brute_seconds_ = seconds * static_cast<double>(job.views.size()) / static_cast<double>(timed);
}

int AnswerJudge::FirstRegistrable(const planning::Evaluation& evaluation) const {
  const std::vector<uint32_t> ranked =
      planning::RankViews(evaluation, job_.feasible, job_.config.candidate_separation,
                          static_cast<size_t>(job_.config.max_checked));
  parallel::Serial serial;
  const planning::RegistrationCheck check = planning::CheckRegistration(
      *job_.problem, overlap_, evaluation, ranked, 1, parallel::Budget::Unlimited(), serial);
  return check.registrable.empty() ? -1 : static_cast<int>(check.registrable.front().view);
}

double AnswerJudge::Regret(const planning::Evaluation& evaluation) const {
  const int answer = FirstRegistrable(evaluation);
  if (answer < 0) return 1;
  return std::max(0.0, 1 - truth_[static_cast<size_t>(answer)] / best_);
}

double AnswerJudge::Regret(const planning::Plan& plan) const {
  if (plan.views.empty()) return 1;
  const int answer = job_.feasible.IndexOf(job_.feasible.CellOf(plan.views.front().position));
  if (answer < 0) return 1;
  return std::max(0.0, 1 - truth_[static_cast<size_t>(answer)] / best_);
}

bool AnswerJudge::BoundsHold(const planning::Evaluation& evaluation) const {
  for (size_t i = 0; i < truth_.size(); ++i) {
    const double slack = 1e-6 * (1 + truth_[i]);
    if (truth_[i] > evaluation.views[i].upper + slack) return false;
    if (truth_[i] < evaluation.views[i].lower - slack) return false;
  }
  return true;
}

}  // namespace vantage::bench
