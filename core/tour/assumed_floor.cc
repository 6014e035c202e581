#include "core/tour/assumed_floor.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "core/model/view/voxel.h"

namespace vantage::tour {
namespace {

// Over the floor, m: what is lower is stepped over or is the floor itself, what is higher is a
// lintel.
constexpr double kSteppedOver = 0.3;
constexpr double kPassedUnder = 1.8;
constexpr double kSameFloor = 0.3;  // m

}  // namespace

std::optional<double> FloorBelow(const planning::PlanningProblem& problem,
                                 const Eigen::Vector3d& place) {
  const double over = problem.feasible().HeightOverFloor(place);
  if (std::isnan(over)) return std::nullopt;
  return place.z() - over;
}

fleet::WalkGrid AssumedFloor(const planning::PlanningProblem& problem, double height) {
  const planning::ReachMap& reach = problem.feasible().reach();
  const planning::FloorNodes& known = reach.nodes();
  fleet::WalkGrid grid{planning::FloorNodes(known.first(), known.size(), known.cell_size()), {}};
  const auto z = static_cast<float>(height);
  const auto columns =
      static_cast<size_t>(known.size().x()) * static_cast<size_t>(known.size().y());
  for (size_t i = 0; i < columns; ++i) grid.nodes.AddColumn({z});
  grid.passable.assign(columns, 1);
  // Columns in whose middle the scanner does not fit beside a piece of surface.
  const double cell = known.cell_size();
  const double half = problem.config().scanner_width / 2;
  const auto block = [&](const model::VoxelIndex&, model::VoxelState state,
                         const model::SurfaceVoxel& voxel) {
    const double over = voxel.centroid.z() - height;
    if (state != model::VoxelState::kTrueSurface || over < kSteppedOver || over > kPassedUnder) {
      return;
    }
    const Eigen::Vector2d at = voxel.centroid.head<2>().cast<double>();
    const Eigen::Vector2i low = ((at.array() - half) / cell - 0.5).ceil().cast<int>();
    const Eigen::Vector2i high = ((at.array() + half) / cell - 0.5).floor().cast<int>();
    for (int y = low.y(); y <= high.y(); ++y) {
      for (int x = low.x(); x <= high.x(); ++x) {
        const Eigen::Vector2d centre(cell * (x + 0.5), cell * (y + 0.5));
        const auto [node, end] = grid.nodes.In({x, y});
        if (node != end && (centre - at).norm() < half) grid.passable[node] = 0;
      }
    }
  };
  const double edge = model::Brick::kSide * problem.view().voxel_size();
  for (const model::BrickAt& at : problem.view().bricks()) {
    const double over = edge * at.brick.z() - height;
    if (over + edge >= kSteppedOver && over <= kPassedUnder) {
      model::PlanningView::ForEachSurfaceOf(at, block);
    }
  }
  for (uint32_t node = 0; node < known.count(); ++node) {
    if (!reach.Passable(node) || std::abs(known.Height(node) - z) > kSameFloor) continue;
    grid.passable[grid.nodes.In(known.Column(node)).first] = 1;
  }
  return grid;
}

}  // namespace vantage::tour
