// Where a scanner can be carried to, and how far that is (algorithm.md section 7A, 'Reachability').
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_REACH_MAP_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_REACH_MAP_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/planning/feasibility/floor_map.h"
#include "core/planning/feasibility/floor_nodes.h"
#include "core/planning/plan/planning_config.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// The first voxel layer over the floor that must be empty. Anything lower (a rug, a threshold, the
// floor's own roughness) counts as floor.
inline int FirstLayerOverFloor(float floor_height, double voxel) {
  return static_cast<int>(std::floor(floor_height / voxel + 0.5)) + 2;
}

// A map over the floors in columns of viewcells. The scanner is an upright cylinder of the
// configured width and height that moves between floors of neighbouring columns, diagonals
// included, that differ by at most a step, through space known to be empty: up and down stairs and
// ramps from storey to storey. Where none has stood yet it can be carried to the largest part of
// the site that hangs together. The exceptions near stations and under unknown space are in
// algorithm.md section 7A, 'Reachability'.
class ReachMap {
 public:
  ReachMap() = default;  // of no columns
  // Columns [first, first + size) of `voxels_per_cell` voxels each. The same on any number of
  // threads. CANCELLED when that was requested on the way.
  static absl::StatusOr<ReachMap> Find(const model::PlanningView& model,
                                       const visibility::OpaqueGrid& grid, const FloorMap& floor,
                                       const PlanningConfig& config, const Eigen::Vector2i& first,
                                       const Eigen::Vector2i& size, int voxels_per_cell,
                                       parallel::Parallel& parallel,
                                       const parallel::Cancellation& cancelled = {});

  const FloorNodes& nodes() const { return nodes_; }
  // True when the scanner fits with its axis at the middle of the node's column.
  bool Passable(uint32_t node) const { return clear_width_[node] >= width_; }
  // True when the scanner fits over the floor under the place, whether it can be carried there or
  // not.
  bool Fits(const Eigen::Vector3d& place) const;
  // True when the scanner can be carried to the floor under the place.
  bool Reached(const Eigen::Vector3d& place) const;
  // Length of the shortest way there from the last station, m; absent when there is none.
  std::optional<double> Travel(const Eigen::Vector3d& place) const;

  // By node: the widest scanner that could be carried there from where one has stood, up to the
  // configured one, and the node at which its way is narrowest.
  struct WidestWay {
    float width = 0;  // m; 0 where no way leads
    uint32_t narrowest = 0;
  };
  std::vector<WidestWay> FindWidestWays(const model::PlanningView& model) const;

 private:
  void AddNodes(const FloorColumns& floor);
  // Which column of voxels lies in the middle of a column of viewcells, on one axis.
  int Middle(int column) const;
  void FindPassable(const model::PlanningView& model, const visibility::OpaqueGrid& grid,
                    const FloorColumns& floor, const PlanningConfig& config,
                    parallel::Parallel& parallel, const parallel::Cancellation& cancelled);
  std::optional<uint32_t> NodeOf(const model::Station& station);
  std::vector<uint32_t> StationNodes(const model::PlanningView& model) const;
  void Flood(const model::PlanningView& model, const parallel::Cancellation& cancelled);
  void ReachLargest();

  int per_cell_ = 1;    // voxels
  bool given_ = false;  // the floor is, so that all stations stand on it
  float width_ = 0;     // m, of the scanner
  FloorNodes nodes_;
  // By node.
  std::vector<float> clear_width_;  // m, of what fits with its axis at the node, up to width_
  std::vector<uint8_t> reached_;
  std::vector<float> travel_;  // m from the last station; infinity
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_REACH_MAP_H_
