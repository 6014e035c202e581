// Finds the scans that must be in before another one registers (algorithm.md sections 9 and 11).
#ifndef VANTAGE_CORE_FLEET_PENDING_SURFACE_H_
#define VANTAGE_CORE_FLEET_PENDING_SURFACE_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "core/fleet/remaining_gain.h"
#include "core/parallel/budget.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/ranking/registration_check.h"

namespace vantage::fleet {

// The walls of a room that is expected behind a doorway through which some of it was seen. That is
// a guess of what is not known at all: nobody is sent where a scan registers by it alone, but what
// a first scan makes possible is foreseen by it.
enum class ExpectedRooms { kLeaveOut, kCount };

// The surface that pending scans, which are the steps of RemainingGain, are expected to add for
// alignment: false surface that they see, and at which no attempt has failed yet, is taken for
// surface. Holes are left out, since rays went in and none came back. References are kept.
class PendingSurface {
 public:
  PendingSurface(const planning::PlanningProblem& problem, const planning::OverlapSurface& overlap,
                 ExpectedRooms rooms);

  struct Verdict {
    registration::RegistrationVerdict verdict;
    // Steps whose scans it needs; empty: it registers without them, or not at all.
    std::vector<size_t> waits_for;
    size_t heading = 0;  // of planning::Headings: the one that the verdict is of
  };
  // The verdict on a scan from `view`, with the heading of most gain that registers: `by_heading`
  // has what each gains beyond the steps, samples. Only when it fails on the present surface, the
  // surface expected from the steps so far is added; steps that are not needed are then left out
  // again, the latest first. Nothing when the budget expired. Adds to `rays`. `heading`, where
  // given, is the one that is judged (rad), and `by_heading` says nothing.
  std::optional<Verdict> Judge(const Eigen::Vector3d& view, const RemainingGain& remaining,
                               const registration::RegistrationConfig& config,
                               const parallel::Budget& budget, uint64_t& rays,
                               std::span<const double> by_heading = {},
                               std::optional<double> heading = std::nullopt);

 private:
  planning::CellArrays Of(const RemainingGain& remaining, const std::vector<size_t>& steps) const;

  const planning::PlanningProblem& problem_;
  const planning::OverlapSurface& overlap_;
  const ExpectedRooms rooms_;
  std::vector<uint32_t> at_;  // by deficient cell: its index in the problem's scored cells
};

}  // namespace vantage::fleet

#endif  // VANTAGE_CORE_FLEET_PENDING_SURFACE_H_
