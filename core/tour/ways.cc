#include "core/tour/ways.h"

#include <algorithm>

#include "core/tour/ordering.h"

namespace vantage::tour {
namespace {

// Of the straight line: floor between two places of which no way is known, but which are taken to
// be reachable, since it is only assumed.
constexpr double kDetour = 1.5;

}  // namespace

Ways::Ways(const planning::PlanningProblem& problem)
    : grid_(fleet::WalkGridOf(problem.feasible(), {})) {}

std::vector<std::vector<double>> Ways::Between(std::span<const Eigen::Vector3d> from,
                                               std::span<const Eigen::Vector3d> to,
                                               const parallel::Budget& budget,
                                               parallel::Parallel& parallel) {
  std::vector<std::vector<double>> lengths(from.size(), std::vector<double>(to.size(), kNoWay));
  parallel.For(from.size(), [&](size_t i) {
    const auto row = known_.find(from[i]);
    bool all = row != known_.end();
    for (size_t j = 0; j < to.size() && all; ++j) {
      const auto length = row->second.find(to[j]);
      all = length != row->second.end();
      if (all) lengths[i][j] = length->second;
    }
    if (all || budget.Expired()) return;
    const fleet::TravelMap travel(grid_, from[i], budget);
    for (size_t j = 0; j < to.size(); ++j) {
      lengths[i][j] = travel.Length(to[j]).value_or(kDetour * (to[j] - from[i]).head<2>().norm());
    }
  });
  if (budget.Expired()) return lengths;  // some may be unknown for that alone
  for (size_t i = 0; i < from.size(); ++i) {
    for (size_t j = 0; j < to.size(); ++j) known_[from[i]][to[j]] = lengths[i][j];
  }
  return lengths;
}

std::vector<Eigen::Vector3d> Ways::Way(const Eigen::Vector3d& from,
                                       const Eigen::Vector3d& to) const {
  return fleet::TravelMap(grid_, from).Way(to);
}

}  // namespace vantage::tour
