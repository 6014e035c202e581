// What views that lie close together can see at most: from any one room, little of a building
// (algorithm.md section 8, 'Visibility of a shaft').
#ifndef VANTAGE_CORE_PLANNING_SCORING_POTENTIALLY_VISIBLE_SETS_H_
#define VANTAGE_CORE_PLANNING_SCORING_POTENTIALLY_VISIBLE_SETS_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/planning/scoring/brute_force.h"
#include "core/planning/scoring/ordered_cells.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

// Groups of cells that lie close together, halved down to some hundreds, and a test whether some
// layer of voxels hides all of a group from a whole box of views. Building it takes a fraction of
// what one exact score does, and so does asking it. Keeps `grid`. Thread safe.
class PotentiallyVisibleSets {
 public:
  PotentiallyVisibleSets(const OrderedCells& cells, const visibility::OpaqueGrid& grid);

  // All cells but those that are hidden from every point of `views` (scene coordinates), in order.
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
