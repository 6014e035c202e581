// How far it is from candidate to candidate (algorithm.md section 12, 'The order').
#ifndef VANTAGE_CORE_TOUR_WAYS_H_
#define VANTAGE_CORE_TOUR_WAYS_H_

#include <Eigen/Core>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "core/fleet/travel.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/problem/planning_problem.h"
#include "core/tour/spread_views.h"

namespace vantage::tour {

// Ways over the floors (fleet::TravelMap), each looked for once. References are kept.
class Ways {
 public:
  explicit Ways(const planning::PlanningProblem& problem);

  // m from each of `from` to each of `to`. Where no way is known, over floor that nobody has seen,
  // it is the way around known walls, and half as much again as the straight line at least; kNoWay
  // where the budget expired before it was looked for.
  std::vector<std::vector<double>> Between(std::span<const Eigen::Vector3d> from,
                                           std::span<const Eigen::Vector3d> to,
                                           const parallel::Budget& budget,
                                           parallel::Parallel& parallel);
  // The corners of the way, m. Over floor that nobody has seen only between places of which
  // Between() was asked; none where known walls leave no way.
  std::vector<Eigen::Vector3d> Way(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

 private:
  struct Less {
    bool operator()(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const {
      return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
    }
  };
  // The floor that two places share, m, z; nothing where none is known under either.
  std::optional<double> FloorOf(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;
  // Null where none was assumed yet.
  const fleet::WalkGrid* Assumed(std::optional<double> floor) const;

  const planning::PlanningProblem& problem_;
  fleet::WalkGrid grid_;
  std::map<int, fleet::WalkGrid> assumed_;  // by height
  std::map<Eigen::Vector3d, std::map<Eigen::Vector3d, double, Less>, Less> known_;
};

}  // namespace vantage::tour

#endif  // VANTAGE_CORE_TOUR_WAYS_H_
