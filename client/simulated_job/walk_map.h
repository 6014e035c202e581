// Walking distances between places in a scene, around walls and furniture, and over stairs.
#ifndef VANTAGE_CLIENT_SIMULATED_JOB_WALK_MAP_H_
#define VANTAGE_CLIENT_SIMULATED_JOB_WALK_MAP_H_

#include <Eigen/Core>
#include <map>
#include <utility>
#include <vector>

#include "client/simulated_job/site.h"
#include "core/simulation/simulated_scanner.h"
#include "core/simulation/walkable_ground.h"

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

  // A place on the map, and those that one step leads to.
  struct Place {
    Eigen::Vector3d at;  // m, on the ground
    std::vector<int> around;
  };

  void Add(const Eigen::Vector3d& at);
  std::pair<int, int> CellOf(const Eigen::Vector3d& at) const;
  void FromOneFloor(const simulation::SimulatedScanner& tracer, const Site& site);
  void FromGround(const simulation::WalkableGround& ground);
  int Nearest(const Eigen::Vector3d& place) const;
  Ways From(const Eigen::Vector3d& from) const;

  Eigen::Vector2d origin_;  // m, of the lattice
  std::vector<Place> places_;
  std::map<std::pair<int, int>, std::vector<int>> index_;  // by lattice point, into places_
};

}  // namespace vantage::simulated_job

#endif  // VANTAGE_CLIENT_SIMULATED_JOB_WALK_MAP_H_
