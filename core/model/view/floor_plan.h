// A storey from above, as a raster: what is floor, what stands on it, and what is missing over it.
#ifndef VANTAGE_CORE_MODEL_VIEW_FLOOR_PLAN_H_
#define VANTAGE_CORE_MODEL_VIEW_FLOOR_PLAN_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/functional/function_ref.h"
#include "core/model/view/planning_view.h"

namespace vantage::model {

// What a cell shows, in the order in which one hides the other where both are there.
enum class PlanCell : uint8_t {
  kNothing,
  kFloor,      // at the required density
  kThinFloor,  // below it
  kFurniture,  // stands on the floor, lower than a wall
  kWall,
};

// The part of the model that is a storey, m, model frame.
struct StoreyBand {
  double floor = 0;
  double top = 0;  // where the next storey begins
};

struct FloorPlan {
  // The lower left corner of the first cell, m, model frame, and the edge of a cell, m.
  Eigen::Vector2d corner = Eigen::Vector2d::Zero();
  double edge = 0;
  int columns = 0;
  int rows = 0;
  // Row by row from the smallest y.
  std::vector<PlanCell> cells;
  // Which kind of surface is missing most over the cell (SurfaceKind::kTrue for surface that is
  // there and too thin); nothing where there is none to speak of.
  std::vector<std::optional<SurfaceKind>> missing;
  // The walls' direction, rad, [0, pi/2): of most of them, against x.
  double direction = 0;
  // Places at the edge of what is shown, m, model frame: all of it lies between them but a few
  // stray cells. Empty where nothing is.
  std::vector<Eigen::Vector2d> extent;

  size_t At(int x, int y) const { return static_cast<size_t>(y) * columns + x; }
};

// `required`: D at a place, m, model frame; nothing where surface does not count, which is then
// never too thin and never missing. Cells are voxels, or 2, 4, ... of them where there would be
// more than `most_cells`; memory is about 24 bytes for each.
FloorPlan DrawFloorPlan(const PlanningView& model, const StoreyBand& storey,
                        absl::FunctionRef<std::optional<double>(const Eigen::Vector3d&)> required,
                        size_t most_cells);

}  // namespace vantage::model

#endif  // VANTAGE_CORE_MODEL_VIEW_FLOOR_PLAN_H_
