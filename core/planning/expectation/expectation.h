// What is expected where nothing is known: what a prior of the site shows, that a room goes on
// behind its doorway, and that stairs lead to a storey (algorithm.md section 7E).
#ifndef VANTAGE_CORE_PLANNING_EXPECTATION_EXPECTATION_H_
#define VANTAGE_CORE_PLANNING_EXPECTATION_EXPECTATION_H_

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/planning/expectation/expected_site.h"
#include "core/planning/feasibility/floor_map.h"
#include "core/planning/plan/opening.h"
#include "core/planning/plan/planning_config.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// An offered place counts as good when some spot within kStationRadius (m) of it is free to stand
// on; that this is so has the probability kStationChance.
// Choices: beds and tables are up to 2 m wide, so past the middle of one this is as far as beside
// it with the scanner's clearance; and what is behind a doorway may be a cupboard.
inline constexpr double kStationRadius = 1.2;
inline constexpr double kStationChance = 0.9;

// A model in which each room that was seen through a doorway and not entered goes on behind it, as
// far as nothing that was measured speaks against it: floor at the doorway's height, free space
// over it, and walls and a ceiling around, at no density; and stairs that end between two storeys
// lead to a hall like the one that they leave, in which nobody is expected to stand before more of
// the stairs is known. It differs from the model only where the model knows nothing. Never changes.
// Thread safe.
class Expectation {
 public:
  // A room in which places were rejected twice is not expected any more. `site`: what a prior
  // shows, which goes before all else; null where there is none. `scanner`: whose scans the model
  // is of. Keeps the reference to the model. The same on any number of threads. CANCELLED when that
  // was requested on the way.
  static absl::StatusOr<std::shared_ptr<const Expectation>> Of(
      const model::PlanningView& model, const FloorMap& floor, const Openings& openings,
      std::span<const RejectedPlace> rejected, const ExpectedSite* site,
      const sensor::ScannerModel& scanner, parallel::Parallel& parallel,
      const parallel::Cancellation& cancelled = {});

  // The model with what is expected.
  const model::PlanningView& view() const { return view_; }
  // The same, with all space that was not measured taken for empty: only measured surface is in
  // anybody's way, and of that no voxel that floats by itself.
  const model::PlanningView& standing() const { return standing_; }
  // The floors of its rooms.
  std::span<const ExpectedFloor> floors() const { return floors_; }
  // True when what the view says of a voxel is expected and not known.
  bool Expected(const model::VoxelIndex& v) const { return view_.State(v) != model_.State(v); }
  // True in and around rooms whose doorways were only glimpsed: of what they are like nothing was
  // seen.
  bool OnlyGlimpsed(const model::VoxelIndex& v) const { return glimpsed_.contains({v.x(), v.y()}); }
  // True where a prior of the site shows the place, and nothing that is known.
  bool ByPrior(const Eigen::Vector3d& place) const {
    const model::VoxelIndex v = view_.At(place);
    return by_prior_.contains({v.x(), v.y()}) && Expected(v);
  }
  // The doorway, by its place in Openings::openings, behind which a place lies; nothing where it
  // does not.
  std::optional<size_t> Behind(const Eigen::Vector3d& place) const;

 private:
  // The columns of voxels that a room is expected to have, beside those that are known.
  struct Room {
    size_t opening = 0;
    std::vector<Eigen::Vector2i> columns;
    float floor = 0;  // m, z
  };
  Expectation(const model::PlanningView& model, model::PlanningView view,
              std::vector<ExpectedFloor> floors, std::vector<Room> rooms,
              absl::flat_hash_set<std::pair<int, int>> glimpsed,
              absl::flat_hash_set<std::pair<int, int>> by_prior, parallel::Parallel& parallel);

  const model::PlanningView& model_;
  const model::PlanningView view_;
  const model::PlanningView standing_;
  const std::vector<ExpectedFloor> floors_;
  const std::vector<Room> rooms_;
  const absl::flat_hash_set<std::pair<int, int>> glimpsed_;  // x and y of voxels
  const absl::flat_hash_set<std::pair<int, int>> by_prior_;  // the same
};

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_EXPECTATION_EXPECTATION_H_
