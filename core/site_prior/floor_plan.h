// A floor plan as a raster of walls, and what stands on it: walls as boxes from the floor to a
// height, floor and ceiling of what they enclose. Doors are where there is no wall.
#ifndef VANTAGE_CORE_SITE_PRIOR_FLOOR_PLAN_H_
#define VANTAGE_CORE_SITE_PRIOR_FLOOR_PLAN_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "absl/status/statusor.h"
#include "core/site_prior/prior_mesh.h"

namespace vantage::site_prior {

// Cells of `cell` m; cell (x, y) covers origin + [x, x + 1) x [y, y + 1) cells.
struct PlanRaster {
  int width = 0;
  int height = 0;
  double cell = 0;                                   // m
  Eigen::Vector2d origin = Eigen::Vector2d::Zero();  // m, prior's frame
  std::vector<uint8_t> wall;                         // by y, x: 1 where a wall is
  double unit = 1;                                   // as PriorMesh::unit

  uint8_t& At(int x, int y) {
    return wall[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
  uint8_t At(int x, int y) const {
    return wall[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
};

inline constexpr size_t kMostPlanCells = 64'000'000;
// Gaps in the outer walls that are no wider than this are doors: what is outside does not come in
// by them. m.
inline constexpr double kWidestOuterGap = 1.4;

// INVALID_ARGUMENT: there is no wall, or no room of 1 m2 is enclosed: gaps of outer walls are wider
// than kWidestOuterGap.
absl::StatusOr<PriorMesh> ExtrudePlan(const PlanRaster& plan, double floor, double wall_height);

}  // namespace vantage::site_prior

#endif  // VANTAGE_CORE_SITE_PRIOR_FLOOR_PLAN_H_
