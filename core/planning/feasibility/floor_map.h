// The floors of a site: their heights in every column of voxels, any number over one another
// (algorithm.md section 7A, 'The floor').
#ifndef VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_MAP_H_
#define VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_MAP_H_

#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/feasibility/floor_columns.h"
#include "core/planning/feasibility/floor_pieces.h"
#include "core/planning/feasibility/storeys.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/plan/storey.h"

namespace vantage::planning {

// Floor that is expected in a column of voxels.
struct ExpectedFloor {
  Eigen::Vector2i voxel = Eigen::Vector2i::Zero();  // x and y of its voxels
  float height = 0;                                 // m, z
};

// Finds floors in measured surface that faces up, and fills gaps between measured floor; nowhere
// does a floor go on beyond what was measured.
class FloorMap {
 public:
  // `given`: z of the floor everywhere, m; when absent floors are found in the model. CANCELLED
  // when that was requested on the way.
  static absl::StatusOr<FloorMap> Find(const model::PlanningView& model,
                                       std::optional<double> given,
                                       const parallel::Cancellation& cancelled = {});

  // This map and the floors that are expected where it has none within a step, for all columns of
  // `view`, whose bounds hold those of this map's model. Storeys stay as they are.
  FloorMap With(std::span<const ExpectedFloor> expected, const model::PlanningView& view) const;

  // This map and the floor that is expected in shadows: what may be walked over. `model`: what is
  // known. CANCELLED when that was requested on the way.
  absl::StatusOr<FloorMap> WithShadows(const model::PlanningView& model,
                                       const parallel::Cancellation& cancelled = {}) const;

  const FloorColumns& columns() const { return columns_; }
  const Storeys& storeys() const { return storeys_; }

  bool found() const { return !columns_.floors().empty(); }
  // Lowest and highest z of any floor, m; NaN when there is none.
  float lowest() const { return lowest_; }
  float highest() const { return highest_; }

 private:
  void FindExtremes();
  bool FindIn(const model::PlanningView& model, const parallel::Cancellation& cancelled);

  FloorColumns columns_;
  Storeys storeys_;
  float lowest_ = std::numeric_limits<float>::quiet_NaN();
  float highest_ = std::numeric_limits<float>::quiet_NaN();
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_FEASIBILITY_FLOOR_MAP_H_
