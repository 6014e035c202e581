// A running evaluation. It scores views in batches, on all cells or on a sample, within a budget.
#ifndef VANTAGE_CORE_PLANNING_EVALUATION_EVALUATION_RUN_H_
#define VANTAGE_CORE_PLANNING_EVALUATION_EVALUATION_RUN_H_

#include <Eigen/Core>
#include <atomic>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/evaluation/cell_sample.h"
#include "core/planning/evaluation/evaluation.h"
#include "core/planning/evaluation/visibility_cache.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/scoring/brute_force.h"

namespace vantage::planning {

// Called when the evaluation has improved.
using EvaluationProgress = absl::FunctionRef<void(const Evaluation&)>;

// Relative rounding error of a sum of scores in float, at most.
inline constexpr double kRounding = 1e-5;

// References are kept.
class EvaluationRun {
 public:
  // `potential`: the most that any view can gain, samples. `worth`: AnytimeOptions. With a cache,
  // of the same views and cells, cells that are hidden from a view are left out.
  EvaluationRun(const BruteForceScorer& scorer, const FeasibleViews& views, const CellArrays& cells,
                double potential, const parallel::Budget& budget, parallel::Parallel& parallel,
                std::span<const double> worth = {},
                std::optional<VisibilityCache> visibility_cache = std::nullopt);

  const BruteForceScorer& scorer() const { return scorer_; }
  const FeasibleViews& views() const { return views_; }
  const CellArrays& cells() const { return cells_; }
  const parallel::Budget& budget() const { return budget_; }
  parallel::Parallel& parallel() const { return parallel_; }
  size_t size() const { return evaluation_.views.size(); }

  const Evaluation& evaluation() const { return evaluation_; }
  const ViewEstimate& view(uint32_t i) const { return evaluation_.views[i]; }
  ViewEstimate& view(uint32_t i) { return evaluation_.views[i]; }
  // The factor of the view's score in the ranking.
  double Worth(uint32_t i) const { return worth_.empty() ? 1 : worth_[i]; }
  double Rank(uint32_t i) const { return Worth(i) * view(i).Rank(); }
  std::span<std::atomic<uint8_t>> seen() { return seen_; }

  // A share of the time and work that are left.
  parallel::Budget Share(double share) const { return budget_.Part(share, evaluation_.rays); }
  bool Spent(const parallel::Budget& part) const {
    return evaluation_.rays >= part.work_limit || part.Expired();
  }
  uint64_t WorkLeft(const parallel::Budget& part) const {
    return part.work_limit > evaluation_.rays ? part.work_limit - evaluation_.rays : 0;
  }
  // Views that may be scored together on `cells`: a work limit is overrun by one view at most.
  size_t Affordable(const CellArrays& cells, size_t most, const parallel::Budget& part) const;

  // Called with a view's score with each of the scorer's headings.
  using NoteScores = absl::FunctionRef<void(uint32_t view, std::span<const double> by_heading)>;
  // Scores views together, on `sample` or, when it is null, on all cells, and calls `note` for
  // each. Returns false when the budget ended first; `note` is then not called for unfinished
  // views.
  bool Score(std::span<const uint32_t> which, const CellSample* sample,
             const parallel::Budget& part, NoteScores note);
  bool ScoreExactly(std::span<const uint32_t> which, const parallel::Budget& part);

  void AddRays(uint64_t rays) { evaluation_.rays += rays; }
  void SetExact(uint32_t i, double score, size_t heading);
  void SetDecided() { evaluation_.decided = true; }
  void SetComplete() { evaluation_.complete = evaluation_.decided = true; }

  Evaluation Finish();

 private:
  // A view is scored in parts, so that a few views keep several threads busy.
  struct Part {
    uint32_t view;   // of those scored together
    uint32_t begin;  // ranges_
    uint32_t end;
  };
  // Divides the cells that are potentially visible from the views into parts.
  void Divide(std::span<const uint32_t> which, const CellSample* sample);
  // Scores the parts of `batch`.
  void ScoreParts(std::span<const uint32_t> batch, const CellArrays& cells,
                  const parallel::Budget& part);

  const BruteForceScorer& scorer_;
  const FeasibleViews& views_;
  const CellArrays& cells_;
  const parallel::Budget& budget_;
  parallel::Parallel& parallel_;
  const std::span<const double> worth_;     // by view
  std::vector<std::atomic<uint8_t>> seen_;  // by deficient cell
  std::optional<VisibilityCache> visibility_cache_;
  std::vector<PacketRange> ranges_;
  std::vector<Part> parts_;
  std::vector<ViewScore> scores_;  // by part
  std::vector<double> bins_;       // by part and bin, where the scanner sees a sector
  Evaluation evaluation_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EVALUATION_EVALUATION_RUN_H_
