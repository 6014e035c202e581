// The interface by which a session calls the core's algorithms. Tests replace it to decide the
// outcome of an alignment or a plan.
#ifndef VANTAGE_SERVER_SESSION_ALGORITHMS_H_
#define VANTAGE_SERVER_SESSION_ALGORITHMS_H_

#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/fleet/claim_cover.h"
#include "core/fleet/joint_plan.h"
#include "core/fleet/pending_stations.h"
#include "core/planning/evaluate_view.h"
#include "core/planning/openings/measure_coverage.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/planner.h"
#include "core/planning/problem/planning_problem.h"
#include "core/planning/setting_choice.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/align/targets.h"
#include "core/registration/bound/registration_result.h"
#include "core/registration/graph/adjust.h"
#include "core/registration/graph/link.h"
#include "core/registration/graph/pose_graph.h"
#include "core/registration/levelling.h"
#include "core/registration/pose_comparison.h"
#include "core/sensor/scan.h"
#include "core/tour/make_tour.h"

namespace vantage::session {

// What to plan for, and the problem of it.
struct PlanningTask {
  const model::PlanningView& model;
  const sensor::ScannerModel& scanner;
  const planning::PlanningConfig& config;
  // The prepared problem: there already, or made now. Errors as of PlanningProblem::Prepare().
  std::function<absl::StatusOr<std::shared_ptr<const planning::PlanningProblem>>(
      parallel::Parallel&, const parallel::Cancellation&)>
      prepare;
  // Of a tour that a plan follows, in their order, m, model frame; empty: it follows none.
  std::span<const Eigen::Vector3d> tour_stations = {};
};

struct Algorithms {
  std::function<absl::StatusOr<registration::Levelling>(const sensor::Scan&)> level;
  std::function<absl::StatusOr<registration::RegistrationResult>(
      const model::PlanningView&, const sensor::Scan&, const Eigen::Isometry3d& last_pose,
      std::span<const registration::TargetTie>, const registration::RegistrationConfig&,
      parallel::Parallel&)>
      register_scan;
  std::function<absl::StatusOr<planning::Plan>(const PlanningTask&, const parallel::Budget&,
                                               parallel::Parallel&, planning::PlanProgress)>
      make_plan;
  std::function<absl::StatusOr<planning::ViewEvaluation>(
      const PlanningTask&, const Eigen::Vector3d& position, parallel::Parallel&,
      std::optional<double> heading)>
      evaluate_view;
  std::function<absl::StatusOr<planning::CoveredSite>(const model::PlanningView&,
                                                      std::span<const sensor::ScannerModel>,
                                                      const planning::PlanningConfig&)>
      measure_site;
  std::function<absl::StatusOr<fleet::JointPlan>(
      const model::PlanningView&, const fleet::FleetRequest&, const planning::PlanningConfig&,
      const parallel::Budget&, parallel::Parallel&, planning::PlanProgress)>
      make_joint_plan;
  std::function<absl::StatusOr<fleet::CoveredView>(
      const model::PlanningView&, const sensor::ScannerModel&, const planning::PlanningConfig&,
      const Eigen::Vector3d& position, std::span<const fleet::PledgedView> claims,
      parallel::Parallel&, std::optional<double> heading, std::span<const fleet::PledgedView> made,
      std::shared_ptr<const planning::ExpectedSite>)>
      measure_cover;
  std::function<absl::StatusOr<fleet::StationForecast>(
      const model::PlanningView&, const sensor::ScannerModel&, const planning::PlanningConfig&,
      const Eigen::Vector3d& position, std::optional<double> heading,
      std::span<const fleet::PledgedView> before, parallel::Parallel&)>
      forecast_station;

  std::function<absl::StatusOr<planning::Plan>(
      const model::PlanningView&, std::span<const planning::SettingOption>,
      const planning::PlanningConfig&, const parallel::Budget&, parallel::Parallel&,
      planning::PlanProgress, std::shared_ptr<const planning::ExpectedSite>)>
      make_plan_choosing_setting;
  std::function<absl::StatusOr<registration::PoseComparison>(
      const model::PlanningView&, const sensor::Scan&, std::span<const Eigen::Isometry3d> poses,
      const registration::RegistrationConfig&, const registration::ComparisonSize&,
      parallel::Parallel&)>
      compare_poses;

  std::function<absl::StatusOr<tour::Tour>(const PlanningTask&, const tour::TourRequest&,
                                           const parallel::Budget&, parallel::Parallel&,
                                           tour::TourProgress)>
      make_tour;

  // Empty: scans are tied to nothing, and stay where they were registered.
  std::function<registration::LinkOutcome(
      const registration::PlacedSurface&, const registration::PlacedSurface&,
      const registration::RegistrationConfig&, const registration::LinkOptions&)>
      link_scans;
  std::function<absl::StatusOr<registration::Adjustment>(const registration::PoseGraph&)>
      adjust_poses;
  // Scans in doubt are aligned again when the model has changed (DoubtProposals).
  bool try_doubts_again = false;

  // The core's algorithms.
  static Algorithms Core();
};

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_ALGORITHMS_H_
