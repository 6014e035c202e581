// Walking distances between places in a scene, around walls and furniture.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_WALK_MAP_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_WALK_MAP_H_

#include <Eigen/Core>
#include <vector>

#include "client/simulated_job/site.h"
#include "core/simulation/simulated_scanner.h"

namespace vantage::simulated_job {

class WalkMap {
 public:
  // Ways are 0.6 m wide and lead from the site's start.
  WalkMap(const simulation::SimulatedScanner& tracer, const Site& site);

  // Lengths of the shortest ways from `from` (m, scene frame) to each of `to`, m. A place off the
  // map counts as its nearest place on it; the distance to a place that cannot be reached is the
  // straight line's.
  std::vector<double> Distances(const Eigen::Vector3d& from,
                                const std::vector<Eigen::Vector3d>& to) const;
  double Distance(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const {
    return Distances(from, {to}).front();
  }
  // The way itself, both ends included, seen from above, m. The straight line where there is none.
  std::vector<Eigen::Vector2d> Way(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

 private:
  // For every place on the map: its distance, m, and the place before it on the way.
  struct Ways {
    std::vector<double> length;
    std::vector<int> before;  // -1: none
  };

  int Nearest(const Eigen::Vector3d& place) const;
  Ways From(const Eigen::Vector3d& from) const;

  Eigen::Vector2d origin_ = Eigen::Vector2d::Zero();
  int columns_ = 0;
  int rows_ = 0;
  std::vector<int> index_;               // by cell, into places_; -1: blocked
  std::vector<Eigen::Vector2d> places_;  // m
};

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_WALK_MAP_H_
