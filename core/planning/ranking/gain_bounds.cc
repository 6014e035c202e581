#include "core/planning/ranking/gain_bounds.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/planning/scoring/gain_cells.h"

namespace vantage::planning {
namespace {

constexpr size_t kViewsAtOnce = 64;  // so that a work limit is overrun by no more than these

}  // namespace

double LargestGainWithoutHidden(std::span<const RankedView> views) {
  double most = 0;
  for (const RankedView& view : views) most = std::max(most, view.gain_without_hidden.value_or(0));
  return most;
}

double LargestModelGain(std::span<const RankedView> views) {
  double most = 0;
  for (const RankedView& view : views) most = std::max(most, view.model_gain.value_or(0));
  return most;
}

GainBounds BoundGainWithoutHidden(const GainQuestion& question, uint64_t done,
                                  const parallel::Budget& budget, parallel::Parallel& parallel) {
  const PlanningProblem& problem = question.problem;
  const Evaluation& evaluation = question.evaluation;
  const double enough = problem.config().terminate_below;
  const CellArrays& gains = question.gains;
  const double per_sample = MostGainPerSample(question.cells, gains);
  GainBounds bounds;
  bounds.lower = question.known_gain_without_hidden;
  bounds.model_gain = question.known_model_gain;
  std::vector<uint32_t> left;  // that may gain enough
  double others = 0;           // the most that any other may
  for (uint32_t i = 0; i < evaluation.views.size(); ++i) {
    const double most = per_sample * evaluation.views[i].upper;
    if (most >= enough) {
      left.push_back(i);
    } else {
      others = std::max(others, most);
    }
  }
  std::stable_sort(left.begin(), left.end(), [&](uint32_t a, uint32_t b) {
    return evaluation.views[a].upper > evaluation.views[b].upper;
  });
  size_t next = 0;
  while (next < left.size() && bounds.lower < enough && !budget.Expired() &&
         done + bounds.rays < budget.work_limit) {
    const size_t count = std::min(kViewsAtOnce, left.size() - next);
    std::vector<ViewScore> scores(count);
    parallel.For(count, [&](size_t k) {
      scores[k] = problem.scoring().scorer().Score(problem.feasible().Centre(left[next + k]), gains,
                                                   budget);
    });
    for (const ViewScore& score : scores) {
      bounds.rays += score.rays;
      if (!score.finished) break;
      bounds.lower = std::max(bounds.lower, score.score);
      ++next;
    }
  }
  bounds.upper = std::max(bounds.lower, others);
  if (next < left.size()) {
    bounds.upper = std::max(bounds.upper, per_sample * evaluation.views[left[next]].upper);
  }
  // No view brings more than is missing, whatever a sample may stand for.
  bounds.upper = std::max(bounds.lower, std::min(bounds.upper, problem.patches().area));
  return bounds;
}

}  // namespace vantage::planning
