#include "core/planning/budget_shares.h"

#include <algorithm>
#include <chrono>
#include <limits>

namespace vantage::planning {
namespace {

using Clock = parallel::Budget::Clock;

constexpr double kEvaluationShare = 0.8;
// Of step D, for the question whether to stop.
constexpr double kStopShare = 0.5;
// Of a flat or a storey all that comes after the evaluation takes less, however long that was.
constexpr double kUsuallyReserved = 0.4;  // s
// s, of one thread, measured in a hall of 16 million cells and in flats.
constexpr double kSecondsOfElement = 5e-7;  // looked at by a prediction
constexpr double kSecondsOfCell = 25e-9;    // that a view is scored on
constexpr double kPassesOfDescription = 2;  // over all cells: what a view scores, and what it gains
// A ranking of which nothing was checked is worth little: the check keeps this part of the work
// even where the evaluation's last batch overran its own.
constexpr uint64_t kLeastCheckedPart = 10;  // 1 / 10
constexpr int kReportPart = 3;              // of the time that is left, 1 / 3
// Pairs of view and cell: a first look at some dozens of views, a hundredth of a second.
constexpr uint64_t kLeastWork = uint64_t{1} << 18;
// People wait for a plan of a second as gladly as for one of a second and a quarter.
constexpr std::chrono::milliseconds kOverrun(250);

}  // namespace

double AnswerSeconds(const PlanningProblem& problem, int threads) {
  const PlanningConfig& config = problem.config();
  const BruteForceScorer& scorer = problem.scoring().scorer();
  const double score =
      kSecondsOfCell * static_cast<double>(scorer.MostRays(problem.scoring().cells()));
  const double check = kSecondsOfElement * static_cast<double>(problem.overlap().MostRays()) +
                       (scorer.headings().all_around() ? 0 : score);
  return (config.max_checked * check + config.candidates * kPassesOfDescription * score) / threads;
}

parallel::Budget EvaluationShare(const parallel::Budget& budget, double answer_seconds) {
  parallel::Budget share = budget.Evaluating();
  if (budget.deadline != Clock::time_point::max()) {
    const auto left = std::max(budget.deadline - budget.now(), Clock::duration::zero());
    const std::chrono::duration<double> most(std::max(kUsuallyReserved, answer_seconds));
    const std::chrono::duration<double> reserved =
        std::min<std::chrono::duration<double>>((1 - kEvaluationShare) * left, most);
    share.deadline = budget.deadline - std::chrono::duration_cast<Clock::duration>(reserved);
  }
  if (budget.work_limit != std::numeric_limits<uint64_t>::max()) {
    share.work_limit =
        static_cast<uint64_t>(kEvaluationShare * static_cast<double>(budget.work_limit));
  }
  return share;
}

parallel::Budget StopShare(const parallel::Budget& evaluating, uint64_t rays) {
  return evaluating.Part(kStopShare, rays);
}

parallel::Budget LeastEvaluation(const parallel::Budget& budget) {
  parallel::Budget least = budget;
  least.ends_in_a_hurry = false;
  least.deadline = Clock::time_point::max();
  least.work_limit = std::min(least.work_limit, kLeastWork);
  return least;
}

parallel::Budget WithTimeToAnswer(const parallel::Budget& budget) {
  parallel::Budget longer = budget;
  if (longer.deadline != Clock::time_point::max()) {
    longer.deadline = std::max(longer.deadline, longer.now() + kOverrun);
  }
  return longer;
}

parallel::Budget Overrun(const parallel::Budget& budget) {
  parallel::Budget longer = budget;
  if (longer.deadline != Clock::time_point::max()) {
    longer.deadline = std::max(longer.deadline, longer.now()) + kOverrun;
  }
  return longer;
}

parallel::Budget CheckShare(const parallel::Budget& budget, uint64_t rays) {
  parallel::Budget share = budget.Concluding();
  if (share.work_limit != std::numeric_limits<uint64_t>::max()) {
    const uint64_t left = share.work_limit - std::min(share.work_limit, rays);
    share.work_limit = std::max(left, share.work_limit / kLeastCheckedPart);
  }
  if (share.deadline != Clock::time_point::max()) {
    share.deadline -= std::max(share.deadline - share.now(), Clock::duration::zero()) / kReportPart;
  }
  return share;
}

}  // namespace vantage::planning
