#include "core/planning/expectation/expected_site.h"

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

}  // namespace vantage::planning
