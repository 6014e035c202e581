// The cells that neighbouring views can see at most; from one room that is a small part of a
// building (algorithm.md section 8, 'Visibility of a shaft').
#ifndef VANTAGE_CORE_PLANNING_SCORING_POTENTIALLY_VISIBLE_SETS_H_
#define VANTAGE_CORE_PLANNING_SCORING_POTENTIALLY_VISIBLE_SETS_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/ordered_cells.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// Groups of neighbouring cells, halved down to some hundreds, and a test whether a layer of voxels
// hides all of a group from a whole box of views. Building it and asking it each take a fraction of
// the time of one exact score. Keeps `grid`. Thread safe.
class PotentiallyVisibleSets {
 public:
  PotentiallyVisibleSets(const OrderedCells& cells, const visibility::OpaqueGrid& grid);

  // All cells except those that are hidden from every point of `views` (scene coordinates), in
  // order.
  std::vector<PacketRange> From(const Eigen::AlignedBox3d& views) const;

 private:
  struct Group {
    uint32_t begin = 0;  // packets
    uint32_t end = 0;
    uint32_t half = 0;  // the first of its halves, the other next to it; 0: it is not halved
    Eigen::AlignedBox3f targets;
  };
  void AddFrom(const Eigen::AlignedBox3d& views, const Group& group,
               std::vector<PacketRange>& ranges) const;

  const visibility::OpaqueGrid& grid_;
  std::vector<Group> groups_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SCORING_POTENTIALLY_VISIBLE_SETS_H_
