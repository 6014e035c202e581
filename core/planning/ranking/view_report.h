// Describes candidate views as a plan returns them (algorithm.md section 11).
#ifndef VANTAGE_CORE_PLANNING_RANKING_VIEW_REPORT_H_
#define VANTAGE_CORE_PLANNING_RANKING_VIEW_REPORT_H_

#include <algorithm>
#include <span>
#include <vector>

#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluation/evaluation.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/ranking/registration_check.h"
#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/gain_cells.h"
#include "core/planning/scoring/headings.h"

namespace vantage::planning {

// Keeps the reference.
class ViewReport {
 public:
  explicit ViewReport(const PlanningProblem& problem)
      : problem_(problem),
        gains_(GainCells(problem.scoring().cells(), problem.patches())),
        most_gain_per_sample_(MostGainPerSample(problem.scoring().cells(), gains_)) {}
  // The same, made on several threads.
  ViewReport(const PlanningProblem& problem, parallel::Parallel& parallel)
      : problem_(problem),
        gains_(GainCells(problem.scoring().cells(), problem.patches(), parallel)),
        most_gain_per_sample_(MostGainPerSample(problem.scoring().cells(), gains_)) {}

  // The GainCells() of all that the problem's views were scored on.
  const CellArrays& gains() const { return gains_; }
  double most_gain_per_sample() const { return most_gain_per_sample_; }

  // Sets the model gain of a view, and what it is expected to bring, from what it gains of each of
  // the GainCells() of the problem's patches, m2.
  static void SetGain(const CellArrays& gains, const PatchSet& patches,
                      std::span<const float> cell_gains, RankedView& view);

  // Of views in places that are expected, names the first that stands on what is known.
  static void NameFallback(std::vector<RankedView>& views);

  // Describes the first `count` of `checked`, in order. Scores are split exactly; when the budget
  // expires first, score_by_kind and patch_scores stay empty.
  std::vector<RankedView> Describe(std::span<const CheckedView> checked,
                                   const Evaluation& evaluation, size_t count,
                                   const parallel::Budget& budget,
                                   parallel::Parallel& parallel) const;

  // Sets the exact score of any position, feasible or not, its split, its model gain and the scores
  // by heading. Of a scanner that sees a sector, score and gain are those of `view.heading`, or of
  // the best heading when that is absent, which is then set. Returns false, and leaves the split
  // empty, when the budget expired first.
  bool Exact(const Eigen::Vector3d& position, const parallel::Budget& budget,
             parallel::Parallel& parallel, RankedView& view) const;
  // The same where the cells were scored from there already (BruteForceScorer::ScoreCells).
  bool Exact(const Eigen::Vector3d& position, const ViewScore& score, std::vector<float> by_cell,
             const parallel::Budget& budget, parallel::Parallel& parallel, RankedView& view) const;

  // The same of a view that was described: its score and all that it gains, where its budget had
  // not sufficed for that.
  bool DescribeGain(const parallel::Budget& budget, parallel::Parallel& parallel,
                    RankedView& view) const;

  // The plan while the evaluation is running: the best views so far, unchecked. Only the final plan
  // has patches and a map of scores.
  Plan Interim(const Plan& base, const Evaluation& evaluation) const;

  // Sets a position's height, storey, clearance and way from the last station.
  void Place(const Eigen::Vector3d& position, RankedView& view) const;

 private:
  // What a view with this score (samples) may bring to density at most, m^2.
  double MostGain(double score) const {
    return std::min(most_gain_per_sample_ * score, problem_.patches().area);
  }

  const PlanningProblem& problem_;
  const CellArrays gains_;
  const double most_gain_per_sample_;  // m^2
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_RANKING_VIEW_REPORT_H_
