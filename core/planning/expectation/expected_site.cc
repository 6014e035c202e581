#include "core/planning/expectation/expected_site.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "absl/memory/memory.h"

namespace vantage::planning {

absl::StatusOr<std::shared_ptr<const ExpectedSite>> ExpectedSite::Of(
    model::PlanningView view, const parallel::Cancellation& cancelled) {
  const auto found = FloorMap::Find(view, std::nullopt, cancelled);
  if (!found.ok()) return found.status();
  std::vector<ExpectedFloor> floors;
  const FloorColumns& columns = found->columns();
  for (uint32_t column = 0; column < columns.columns(); ++column) {
    for (const Floor& floor : columns.In(column)) {
      floors.push_back({columns.Voxel(column), floor.height});
    }
  }
  floors.shrink_to_fit();  // it is kept
  return absl::WrapUnique<const ExpectedSite>(new ExpectedSite(std::move(view), std::move(floors)));
}

std::span<const ExpectedFloor> ExpectedSite::FloorsIn(const Eigen::Vector2i& column) const {
  const auto place = [](const Eigen::Vector2i& at) { return std::pair(at.y(), at.x()); };
  const auto begin = std::partition_point(floors_.begin(), floors_.end(), [&](const auto& floor) {
    return place(floor.voxel) < place(column);
  });
  const auto end = std::partition_point(begin, floors_.end(),
                                        [&](const auto& floor) { return floor.voxel == column; });
  return {begin, end};
}

Region ExpectedSite::Told() const {
  constexpr double kRoom = 6;     // m, the length of a large room
  constexpr double kSlab = 0.25;  // m, of a floor or a ceiling
  const double h = view_.voxel_size();
  const model::VoxelBox& bounds = view_.bounds();
  Region told;
  if (bounds.empty()) return told;
  for (const model::VoxelIndex& corner : {bounds.min, bounds.max}) {
    told.extend(Eigen::Vector3d(h * corner.cast<double>()));
  }
  told.min() -= Eigen::Vector3d(kRoom, kRoom, kSlab);
  told.max() += Eigen::Vector3d(kRoom, kRoom, kSlab);
  return told;
}

}  // namespace vantage::planning
