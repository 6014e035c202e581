#include "core/planning/feasibility/floor_map.h"

#include <cmath>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "core/planning/feasibility/floor_gaps.h"
#include "core/planning/feasibility/floor_pieces.h"
#include "core/planning/feasibility/hidden_steps.h"

namespace vantage::planning {

absl::StatusOr<FloorMap> FloorMap::Find(const model::PlanningView& model,
                                        std::optional<double> given,
                                        const parallel::Cancellation& cancelled) {
  FloorMap map;
  map.columns_ = FloorColumns(model.bounds());
  if (given.has_value()) {
    std::vector<PlacedFloor> everywhere(map.columns_.columns());
    for (uint32_t column = 0; column < everywhere.size(); ++column) {
      everywhere[column] = {column, {static_cast<float>(*given), FloorSource::kGiven}};
    }
    map.columns_.Assign(everywhere);
    map.storeys_ = Storeys(*given);
  } else if (!map.FindIn(model, cancelled)) {
    return absl::CancelledError("floor map");
  }
  map.FindExtremes();
  return map;
}

FloorMap FloorMap::With(std::span<const ExpectedFloor> expected,
                        const model::PlanningView& view) const {
  FloorMap map;
  map.columns_ = FloorColumns(view.bounds());
  map.storeys_ = storeys_;
  std::vector<PlacedFloor> placed = columns_.Placed();
  for (PlacedFloor& floor : placed) {
    const Eigen::Vector2i at = columns_.Voxel(floor.column);
    floor.column = map.columns_.ColumnOf(at.x(), at.y());
  }
  for (const ExpectedFloor& floor : expected) {
    if (columns_.Near(floor.voxel.x(), floor.voxel.y(), floor.height, kMaxStep) != nullptr) {
      continue;
    }
    placed.push_back({map.columns_.ColumnOf(floor.voxel.x(), floor.voxel.y()),
                      {floor.height, FloorSource::kExpected}});
  }
  map.columns_.Assign(placed);
  map.FindExtremes();
  return map;
}

absl::StatusOr<FloorMap> FloorMap::WithShadows(const model::PlanningView& model,
                                               const parallel::Cancellation& cancelled) const {
  const auto shadows = FloorInShadows(model, columns_, cancelled);
  if (!shadows.has_value()) return absl::CancelledError("floor map");
  FloorMap map = *this;
  std::vector<PlacedFloor> placed = columns_.Placed();
  placed.insert(placed.end(), shadows->begin(), shadows->end());
  map.columns_.Assign(placed);
  map.FindExtremes();
  return map;
}

void FloorMap::FindExtremes() {
  for (const Floor& floor : columns_.floors()) {
    lowest_ = std::fmin(lowest_, floor.height);
    highest_ = std::fmax(highest_, floor.height);
  }
}

// False when cancelled on the way.
bool FloorMap::FindIn(const model::PlanningView& model, const parallel::Cancellation& cancelled) {
  std::optional<std::vector<PlacedFloor>> measured = MeasuredFloor(model, columns_, cancelled);
  if (!measured.has_value()) return false;
  columns_.Assign(*measured);
  const auto add = [&](const std::vector<PlacedFloor>& more) {
    std::vector<PlacedFloor> all = columns_.Placed();
    all.insert(all.end(), more.begin(), more.end());
    columns_.Assign(all);
  };
  const auto at_walls = FloorAtWalls(model, columns_, cancelled);
  if (!at_walls.has_value()) return false;
  add(*at_walls);
  add(FloorUnderStations(model, columns_));
  const auto hidden = HiddenSteps(model, columns_, cancelled);
  if (!hidden.has_value()) return false;
  add(*hidden);
  const auto between = FloorBetween(model, columns_, cancelled);
  if (!between.has_value()) return false;
  add(*between);
  storeys_ = Storeys::Of(columns_, model.voxel_size());
  return !cancelled.Requested();
}

}  // namespace vantage::planning
