// What each candidate of a tour would bring, and which of them could be aligned with each other:
// what its stations are chosen by (algorithm.md section 12, 'The table').
#ifndef VANTAGE_CORE_TOUR_TOUR_TABLE_H_
#define VANTAGE_CORE_TOUR_TOUR_TABLE_H_

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/cover/cover_problem.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/scoring/constraints.h"
#include "core/tour/overlap_table.h"
#include "core/tour/spread_views.h"

namespace vantage::tour {

// Deficient cells of a problem, expected ones among them, each with what it weighs: every n-th of
// those that count, n times as heavy, so that there are `most` of them at most. The order of the
// cells has neighbours side by side, so this thins evenly.
struct GainElements {
  planning::CellArrays cells;   // as GainCells() has them, padded
  std::vector<double> weights;  // m^2, by cell; above 0
  double total = 0;             // m^2

  static GainElements Of(const planning::PlanningProblem& problem, size_t most, size_t first,
                         parallel::Parallel& parallel);
};

// The elements that a scan from a candidate brings to the required density, by the scorer that
// defines exact scores. Nothing when the budget expired on the way. Adds to `rays`.
std::optional<cover::ElementSet> Brought(const planning::PlanningProblem& problem,
                                         const Candidate& candidate, const GainElements& elements,
                                         const parallel::Budget& budget, uint64_t& rays);

// References are kept.
class TourTable {
 public:
  TourTable(const planning::PlanningProblem& problem, const OverlapTable& overlap,
            const GainElements& elements);

  // Adds candidates; those that are there already are left out. CANCELLED when the budget expired
  // on the way: then none was added. The same on any number of threads.
  absl::Status Add(std::span<const Candidate> candidates, const parallel::Budget& budget,
                   parallel::Parallel& parallel);

  const std::vector<Candidate>& candidates() const { return candidates_; }
  const cover::CoverProblem& cover() const { return cover_; }
  const OverlapTable::Sight& sight(size_t candidate) const { return sights_[candidate]; }
  const OverlapTable& overlap() const { return overlap_; }
  const GainElements& elements() const { return elements_; }
  // m^2 that all candidates together bring.
  double attainable() const { return attainable_; }
  // m^2 that a set of candidates brings.
  double Weight(std::span<const uint32_t> stations) const;
  double Weight(const cover::ElementSet& covered) const;
  cover::ElementSet Covered(std::span<const uint32_t> stations) const;
  uint64_t rays() const { return rays_; }

 private:
  const planning::PlanningProblem& problem_;
  const OverlapTable& overlap_;
  const GainElements& elements_;
  std::vector<Candidate> candidates_;
  std::vector<OverlapTable::Sight> sights_;
  cover::CoverProblem cover_;
  double attainable_ = 0;
  uint64_t rays_ = 0;
};

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_TOUR_TABLE_H_
