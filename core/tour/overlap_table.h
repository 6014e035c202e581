// What scans from a tour's candidates would have in common with what is measured and with each
// other (algorithm.md section 12, 'Links').
#ifndef VANTAGE_CORE_TOUR_OVERLAP_TABLE_H_
#define VANTAGE_CORE_TOUR_OVERLAP_TABLE_H_

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/parallel/budget.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/scoring/overlap_surface.h"
#include "core/registration/bound/verdict.h"
#include "core/tour/spread_views.h"

namespace vantage::tour {

// Surface that is measured, surface that is expected, and false surface, which is taken for
// surface since that is where something will be; thinned as step F thins it. References are kept.
// Thread safe.
class OverlapTable {
 public:
  // Elements of false surface, at most: half as many as there may be of the model's, since less
  // rests on them.
  static constexpr size_t kMostFalse = 8'000;

  // CANCELLED when that was requested on the way.
  static absl::StatusOr<OverlapTable> Create(const planning::PlanningProblem& problem,
                                             parallel::Parallel& parallel,
                                             const parallel::Cancellation& cancelled = {});

  size_t elements() const { return known_.size(); }
  // True where a scan has measured the element.
  bool Known(size_t element) const { return known_[element] != 0; }
  // Whether anything was measured that a scan could register to.
  bool AnyKnown() const;
  // What a scan sees of the elements.
  struct Sight {
    std::vector<uint32_t> elements;  // ascending
    std::vector<float> share;        // of all directions of the scan, by element
  };
  // Nothing when the budget expired on the way. Adds to `rays`.
  std::optional<Sight> SightFrom(const Candidate& candidate, const parallel::Budget& budget,
                                 uint64_t& rays) const;

  // Whether a scan of `sight` could be aligned to the elements in `seen` (one flag each; absent:
  // all that are known), by its share of overlap and the directions that this faces alone: what a
  // verdict begins with, without its bound and without rivals.
  bool MayRegister(const Sight& sight, const std::vector<uint8_t>& seen) const;
  bool MayRegisterToKnown(const Sight& sight) const;
  // The same of two scans, both ways, each with what is known besides; every fourth element counts.
  bool Linked(const Sight& a, const Sight& b) const;

  // What a verdict takes into account.
  enum class Judging { kBeforeRivals, kWhole };
  // The verdict that step F would give on a scan, were the elements in `seen` measured; or what it
  // would be if no rival was found, at a twentieth of the cost. Nothing when the budget expired on
  // the way. Adds to `rays`.
  std::optional<registration::RegistrationVerdict> Judge(const Candidate& candidate,
                                                         const std::vector<uint8_t>& seen,
                                                         Judging judging,
                                                         const parallel::Budget& budget,
                                                         uint64_t& rays) const;

 private:
  OverlapTable(const planning::PlanningProblem& problem, planning::OverlapSurface surface)
      : problem_(problem), surface_(std::move(surface)) {}
  // What a scan sees: the model's elements, then false surface. Nothing when the budget expired.
  struct Seen {
    std::vector<uint32_t> at;
    std::vector<registration::OverlapElement> elements;
  };
  std::optional<Seen> See(const Candidate& candidate, const parallel::Budget& budget,
                          uint64_t& rays) const;

  const planning::PlanningProblem& problem_;
  planning::OverlapSurface surface_;
  planning::CellArrays false_;
  float false_weight_ = 1;                // elements of the same size that one of these stands for
  std::vector<uint8_t> known_;            // by element
  std::vector<Eigen::Vector3f> normals_;  // unit, by element
  double least_share_ = 0;                // of overlap
};

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_OVERLAP_TABLE_H_
