// Where a scanner can be carried to, and how far that is (algorithm.md section 7A, 'Reachability').
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_REACH_MAP_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_REACH_MAP_H_

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/feasibility/floor_heights.h"
#include "core/planning/plan/planning_config.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// The first voxel layer over the floor that must be empty. Anything lower (a rug, a threshold, the
// floor's own roughness) counts as floor.
inline int FirstLayerOverFloor(float floor_height, double voxel) {
  return static_cast<int>(std::floor(floor_height / voxel + 0.5)) + 2;
}

// A map over columns of viewcells. The scanner is an upright cylinder of the configured width and
// height that moves between neighbouring columns, diagonals included, whose floors differ by at
// most a step, through space known to be empty. The exceptions near stations and under unknown
// space are in algorithm.md section 7A, 'Reachability'.
class ReachMap {
 public:
  ReachMap() = default;  // of no columns
  // Columns [first, first + size) of `voxels_per_cell` voxels each. CANCELLED when that was
  // requested on the way.
  static absl::StatusOr<ReachMap> Find(const model::PlanningView& model,
                                       const visibility::OpaqueGrid& grid,
                                       const FloorHeights& floor, const PlanningConfig& config,
                                       const Eigen::Vector2i& first, const Eigen::Vector2i& size,
                                       int voxels_per_cell,
                                       const parallel::Cancellation& cancelled = {});

  // True when the scanner fits with its axis at the column's centre.
  bool Passable(int cx, int cy) const { return Inside(cx, cy) && passable_[Index(cx, cy)] != 0; }
  bool Reached(int cx, int cy) const { return Inside(cx, cy) && reached_[Index(cx, cy)] != 0; }
  // z of the floor at the column's centre, m; NaN where there is none.
  float Floor(int cx, int cy) const {
    return Inside(cx, cy) ? floor_[Index(cx, cy)] : std::numeric_limits<float>::quiet_NaN();
  }
  const Eigen::Vector2i& first() const { return first_; }
  const Eigen::Vector2i& size() const { return size_; }
  // Length of the shortest way from the last station, m; absent when there is none.
  std::optional<double> Travel(int cx, int cy) const;

 private:
  bool Inside(int cx, int cy) const {
    return cx >= first_.x() && cy >= first_.y() && cx < first_.x() + size_.x() &&
           cy < first_.y() + size_.y();
  }
  size_t Index(int cx, int cy) const {
    return static_cast<size_t>(cx - first_.x()) +
           static_cast<size_t>(size_.x()) * static_cast<size_t>(cy - first_.y());
  }
  void FindPassable(const model::PlanningView& model, const visibility::OpaqueGrid& grid,
                    const FloorHeights& floor, const PlanningConfig& config,
                    const parallel::Cancellation& cancelled);
  void Flood(const model::PlanningView& model, const parallel::Cancellation& cancelled);

  Eigen::Vector2i first_ = Eigen::Vector2i::Zero();
  Eigen::Vector2i size_ = Eigen::Vector2i::Zero();
  int per_cell_ = 1;  // voxels
  double cell_size_ = 0;
  std::vector<uint8_t> passable_;
  std::vector<uint8_t> reached_;
  std::vector<float> floor_;   // m, of each column (middle voxel column)
  std::vector<float> travel_;  // m from the last station; infinity
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_REACH_MAP_H_
