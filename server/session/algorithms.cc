#include "server/session/algorithms.h"

#include <optional>

#include "core/fleet/look_ahead.h"
#include "core/planning/outcome.h"
#include "core/registration/place_and_register.h"
#include "core/tour/follow_tour.h"

namespace vantage::session {
namespace {

// Of a plan's time, that is left for following a tour: a station takes some hundredths of a second
// in a flat.
constexpr double kShareOfFollowing = 0.2;

}  // namespace

Algorithms Algorithms::Core() {
  const auto make_plan = [](const PlanningTask& task, const parallel::Budget& budget,
                            parallel::Parallel& parallel,
                            planning::PlanProgress progress) -> absl::StatusOr<planning::Plan> {
    const auto problem = task.prepare(parallel, parallel::Cancellation(budget.cancelled));
    if (absl::IsCancelled(problem.status())) {
      return planning::EndedPreparing(problem.status().message(), task.model, task.config, budget);
    }
    if (!problem.ok()) return problem.status();
    if (task.tour_stations.empty()) {
      return fleet::MakePlanLookingAhead(**problem, budget, parallel, progress);
    }
    parallel::Budget shorter = budget;
    shorter.deadline = budget.Part(1 - kShareOfFollowing, 0).deadline;
    planning::Plan plan = fleet::MakePlanLookingAhead(**problem, shorter, parallel, progress);
    tour::FollowTour(**problem, task.tour_stations, budget.Concluding(), parallel, plan);
    return plan;
  };
  const auto evaluate_view =
      [](const PlanningTask& task, const Eigen::Vector3d& position, parallel::Parallel& parallel,
         std::optional<double> heading) -> absl::StatusOr<planning::ViewEvaluation> {
    const auto problem = task.prepare(parallel, {});
    if (!problem.ok()) return problem.status();
    return planning::EvaluateView(**problem, position, heading);
  };
  const auto measure_site = [](const model::PlanningView& model,
                               std::span<const sensor::ScannerModel> scanners,
                               const planning::PlanningConfig& config) {
    return planning::MeasureSite(model, scanners, config);
  };
  const auto make_tour = [](const PlanningTask& task, const tour::TourRequest& request,
                            const parallel::Budget& budget, parallel::Parallel& parallel,
                            tour::TourProgress progress) -> absl::StatusOr<tour::Tour> {
    const auto problem = task.prepare(parallel, parallel::Cancellation(budget.cancelled));
    if (!problem.ok()) return problem.status();
    return tour::MakeTour(**problem, request, budget, parallel, progress);
  };
  return {registration::LevelFirstScan,
          registration::PlaceAndRegister,
          make_plan,
          evaluate_view,
          measure_site,
          fleet::MakeJointPlan,
          fleet::MeasureCover,
          fleet::ForecastStation,
          planning::MakePlanChoosingSetting,
          registration::ComparePoses,
          make_tour,
          registration::LinkScans,
          registration::Adjust,
          true};
}

}  // namespace vantage::session
