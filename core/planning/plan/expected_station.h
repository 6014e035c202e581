// A place to scan from that is expected and not known (algorithm.md section 7E).
#ifndef VANTAGE_CORE_PLANNING_PLAN_EXPECTED_STATION_H_
#define VANTAGE_CORE_PLANNING_PLAN_EXPECTED_STATION_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>

namespace vantage::planning {

// A place where floor, way or clearance are not all known.
struct ExpectedStation {
  // m, model frame, on the floor: the place lies in the room behind it. Absent: in space that is
  // known in part.
  std::optional<Eigen::Vector3d> doorway;
  double radius = 0;               // m, horizontally: free spots of the room within it are as good
  double chance = 0;               // that one of them is free, [0, 1]
  std::optional<size_t> fallback;  // into Plan::views: the best that stands on what is known
  bool by_site_prior = false;      // a prior of the site shows it
};

// What is assumed, for a person. `origin`: of the model frame in the world, m.
std::string ExpectedStationWords(const ExpectedStation& expected, const Eigen::Vector3d& origin);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_EXPECTED_STATION_H_
