// What a narrow place between two basins is: how wide between its jambs, how high, and whether its
// jambs are wall (algorithm.md section 7D).
#ifndef VANTAGE_CORE_PLANNING_OPENINGS_GAP_H_
#define VANTAGE_CORE_PLANNING_OPENINGS_GAP_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/planning/feasibility/floor_map.h"
#include "core/planning/openings/basins.h"
#include "core/planning/openings/storey_section.h"

namespace vantage::planning {

// What a narrow place between two basins turns out to be.
enum class Narrow {
  kGap,    // a gap in a wall
  kSpace,  // space between furniture, or in the open: both sides are one
  kCrack,  // nobody gets through
};

// A gap in a wall.
struct Gap {
  Eigen::Vector2d jamb = Eigen::Vector2d::Zero();  // columns of voxels from the section's corner
  Eigen::Vector2d other_jamb = Eigen::Vector2d::Zero();
  double head = 0;             // m over the floor, of the lintel or the ceiling
  double sill = 0;             // m over the floor, of what stands in it; 0 for nothing
  bool floor_through = false;  // floor is known in it or close by, and there is no sill
  bool lintel = false;         // wall goes on over it
  float floor = 0;             // m, z

  Eigen::Vector2d middle() const { return 0.5 * (jamb + other_jamb); }
  double columns() const { return (other_jamb - jamb).norm(); }  // from jamb to jamb
  Eigen::Vector2d along() const { return (other_jamb - jamb).normalized(); }
  Eigen::Vector2d across() const { return {-along().y(), along().x()}; }
};

// Measures narrow places. References are kept.
class GapFinder {
 public:
  GapFinder(const model::PlanningView& model, const FloorMap& floor, const StoreySection& section)
      : model_(model), floor_(floor), section_(section) {}

  // How much of a gap has to be known to be empty: on the line between its jambs, or along either
  // face of its wall, which is all that is seen of a doorway from along it.
  enum class Seen { kBetweenJambs, kAlongAFace };
  // `squared`: the distance to the nearest wall by column. Sets `gap` where the place is one.
  Narrow Measure(const NarrowPlace& narrow, const std::vector<int32_t>& squared, Gap& gap,
                 Seen seen = Seen::kBetweenJambs) const;

 private:
  std::optional<std::pair<Eigen::Vector2i, Eigen::Vector2i>> Jambs(uint32_t cell,
                                                                   int32_t squared) const;
  // True when there is wall where a line ends, or right behind.
  bool EndsInWall(const Eigen::Vector2d& end, const Eigen::Vector2d& outward) const;
  std::vector<uint32_t> Between(const Eigen::Vector2d& a, const Eigen::Vector2d& b) const;
  // m over the floor of the lowest measured surface over the section; nothing where there is none.
  std::optional<double> LowestOver(uint32_t column) const;
  // The median of that in some of the free columns around.
  std::optional<double> CeilingAround(const Eigen::Vector2d& at) const;
  bool Measured(uint32_t column, double over_floor) const;
  double SillIn(uint32_t column) const;
  // `across`: unit, through the gap. In its wall something was measured up to near the ceiling.
  bool IsWall(const Eigen::Vector2d& jamb, const Eigen::Vector2d& across, double ceiling) const;
  // True when walls recede from the line straight out of the gap's middle.
  bool Recedes(const Gap& gap, const Eigen::Vector2d& out,
               const std::vector<int32_t>& squared) const;
  // True when a column is known to be empty from a threshold up to the section.
  bool FreeBelow(uint32_t column) const;
  bool FloorKnownNear(const Eigen::Vector2d& at) const;
  bool Solid(const Eigen::Vector2i& at) const {
    return section_.Inside(at) && section_.State(section_.Column(at)) == SectionState::kSolid;
  }
  bool Free(const Eigen::Vector2i& at) const {
    return section_.Inside(at) && section_.State(section_.Column(at)) == SectionState::kFree;
  }
  model::VoxelIndex Voxel(uint32_t column, double over_floor) const;

  const model::PlanningView& model_;
  const FloorMap& floor_;
  const StoreySection& section_;
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_OPENINGS_GAP_H_
