// What a prior of the site shows, as planning expects it (algorithm.md section 7E).
#ifndef VANTAGE_CORE_PLANNING_EXPECTATION_EXPECTED_SITE_H_
#define VANTAGE_CORE_PLANNING_EXPECTATION_EXPECTED_SITE_H_

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/feasibility/floor_map.h"

namespace vantage::planning {

// Empty space and surface at no density, in the model's frame and voxels, and the floors in it.
// Never changes. Thread safe.
class ExpectedSite {
 public:
  // `view`: of the model's voxel size, without stations. CANCELLED when that was requested on the
  // way.
  static absl::StatusOr<std::shared_ptr<const ExpectedSite>> Of(
      model::PlanningView view, const parallel::Cancellation& cancelled = {});

  const model::PlanningView& view() const { return view_; }
  std::span<const ExpectedFloor> floors() const { return floors_; }
  // Those in a column of voxels, from the lowest up.
  std::span<const ExpectedFloor> FloorsIn(const Eigen::Vector2i& column) const;

  // Where it says what is behind false surface, m: where it shows nothing there, nothing is. Its
  // own box, and beside it as far as mirrors at its outer walls show rooms; not above and below,
  // where storeys may be of which it has no floor.
  Region Told() const;

 private:
  ExpectedSite(model::PlanningView view, std::vector<ExpectedFloor> floors)
      : view_(std::move(view)), floors_(std::move(floors)) {}

  const model::PlanningView view_;
  const std::vector<ExpectedFloor> floors_;  // by y, x, height
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EXPECTATION_EXPECTED_SITE_H_
