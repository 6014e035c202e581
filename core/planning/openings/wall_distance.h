// How far the nearest wall of a section is, exactly (Felzenszwalb and Huttenlocher 2012).
#ifndef VANTAGE_CORE_PLANNING_OPENINGS_WALL_DISTANCE_H_
#define VANTAGE_CORE_PLANNING_OPENINGS_WALL_DISTANCE_H_

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

namespace vantage::planning {

inline constexpr int32_t kNoWall = std::numeric_limits<int32_t>::max();

// By cell of a grid, rows along x: the square of the distance from its middle to that of the
// nearest solid cell, in cells; kNoWall everywhere when none is solid.
std::vector<int32_t> SquaredWallDistance(const Eigen::Vector2i& size,
                                         const std::vector<uint8_t>& solid);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_OPENINGS_WALL_DISTANCE_H_
