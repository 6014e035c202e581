// Where a scanner can stand in a scene of which some scans are known: by brute force on the mesh
// and on single voxels, without any of the maps that the planner makes.
#ifndef VANTAGE_TESTS_SUPPORT_STANDING_ORACLE_H_
#define VANTAGE_TESTS_SUPPORT_STANDING_ORACLE_H_

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/plan/planning_config.h"
#include "core/sensor/scanner_model.h"
#include "core/simulation/scenes/scene.h"
#include "core/simulation/tracer.h"

namespace vantage::test_support {

// The model after a scan from each of the scene's starts, with all faults of a scanner.
std::shared_ptr<const model::PlanningView> ScanFromStarts(const simulation::Scene& scene,
                                                          const sensor::ScannerModel& scanner,
                                                          parallel::Parallel& parallel);

struct StandingFigures {
  size_t feasible = 0;  // views
  size_t in_air = 0;    // of those, below which the mesh has no floor at the height that is stated
  std::vector<Eigen::Vector3d> air;  // m, the first few of them
  size_t allowed = 0;  // places over measured floor with seen clearance, that can be walked to
  size_t found = 0;    // of those, that are feasible
  std::vector<Eigen::Vector3d> missed;  // m, the first few that are not

  double recall() const {
    return allowed == 0 ? 1 : static_cast<double>(found) / static_cast<double>(allowed);
  }
};

// What is below places in a scene, by its mesh.
class MeshFloor {
 public:
  explicit MeshFloor(const simulation::Scene& scene) : tracer_(scene.mesh) {}

  // z of what is straight below, m; nothing where there is nothing.
  std::optional<double> Below(const Eigen::Vector3d& place) const;
  // False where a view that states its height over the floor (m) stands in the air.
  bool Carries(const Eigen::Vector3d& view, double height_over_floor) const;
  // Whether a tripod can be turned so that each of its three feet, `away` m from its middle, stands
  // within a step of the floor below that.
  bool CarriesTripod(const Eigen::Vector3d& view, double away) const;

 private:
  simulation::Tracer tracer_;
};

// Asks of each view what is straight below it, and looks for places that should be views.
StandingFigures JudgeStanding(const simulation::Scene& scene, const model::PlanningView& model,
                              const planning::FeasibleViews& views,
                              const sensor::ScannerModel& scanner,
                              const planning::PlanningConfig& config);

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_STANDING_ORACLE_H_
