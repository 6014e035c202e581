// Doorways that were only seen from along their walls (algorithm.md section 7D).
#ifndef VANTAGE_CORE_PLANNING_OPENINGS_GLIMPSES_H_
#define VANTAGE_CORE_PLANNING_OPENINGS_GLIMPSES_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/parallel/cancellation.h"
#include "core/planning/openings/gap.h"
#include "core/planning/openings/storey_section.h"

namespace vantage::planning {

// A doorway behind which next to nothing is known.
struct Glimpse {
  Gap gap;
  Eigen::Vector2d across = Eigen::Vector2d::Zero();  // unit, in columns: towards the unknown
};

// From along its wall so little is seen through a doorway that what is known behind it is no basin.
// So free space is taken to go on a little into what is unknown, also beyond the section, and gaps
// are sought in that: those with a lintel and floor, free on one side and hardly on the other, that
// are not `known`. `squared`: the distance to the nearest wall by column of the section; `voxel` in
// m. Nothing when cancelled on the way.
std::optional<std::vector<Glimpse>> FindGlimpses(const GapFinder& finder,
                                                 const StoreySection& section,
                                                 const std::vector<int32_t>& squared,
                                                 std::span<const Gap> known, double voxel,
                                                 const parallel::Cancellation& cancelled);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_OPENINGS_GLIMPSES_H_
