#include "core/planning/budget_shares.h"

#include <algorithm>
#include <chrono>
#include <limits>

namespace vantage::planning {
namespace {

using Clock = parallel::Budget::Clock;

constexpr double kEvaluationShare = 0.8;
// A check of all candidates takes less, however long the evaluation.
constexpr auto kMostReserved = std::chrono::milliseconds(400);
// A ranking of which nothing was checked is worth little: the check keeps this part of the work
// even where the evaluation's last batch overran its own.
constexpr uint64_t kLeastCheckedPart = 10;  // 1 / 10
constexpr int kReportPart = 3;              // of the time that is left, 1 / 3

}  // namespace

parallel::Budget EvaluationShare(const parallel::Budget& budget) {
  parallel::Budget share = budget.Evaluating();
  if (budget.deadline != Clock::time_point::max()) {
    const auto left = std::max(budget.deadline - budget.now(), Clock::duration::zero());
    const auto reserved =
        std::chrono::duration_cast<Clock::duration>((1 - kEvaluationShare) * left);
    share.deadline = budget.deadline - std::min<Clock::duration>(reserved, kMostReserved);
  }
  if (budget.work_limit != std::numeric_limits<uint64_t>::max()) {
    share.work_limit =
        static_cast<uint64_t>(kEvaluationShare * static_cast<double>(budget.work_limit));
  }
  return share;
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
