// What no view of a neighbourhood can see: from any one room, most of a building (algorithm.md
// section 8, 'Visibility of a shaft').
#ifndef VANTAGE_CORE_PLANNING_IN_SIGHT_H_
#define VANTAGE_CORE_PLANNING_IN_SIGHT_H_

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/planning/brute_force.h"
#include "core/planning/constraints.h"
#include "core/planning/opaque_grid.h"

namespace vantage {

// Groups of cells that lie close together, halved down to some hundreds, and a test whether some
// layer of voxels hides all of a group from all of a neighbourhood. Building it takes a fraction of
// what one exact score does, and so does asking it. Keeps `grid`. Thread safe.
class InSight {
 public:
  // `cells` in the order of PatchOrder(); `grid` has axes {0, 1, 2}.
  InSight(const CellArrays& cells, const OpaqueGrid& grid);

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

  const OpaqueGrid& grid_;
  std::vector<Group> groups_;
};

}  // namespace vantage

#endif  // VANTAGE_CORE_PLANNING_IN_SIGHT_H_
