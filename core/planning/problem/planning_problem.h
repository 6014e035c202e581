// The prepared planning problem: steps A to C, what step D scores views with and what step F checks
// them by (algorithm.md sections 6 to 9).
#ifndef VANTAGE_CORE_PLANNING_PROBLEM_PLANNING_PROBLEM_H_
#define VANTAGE_CORE_PLANNING_PROBLEM_PLANNING_PROBLEM_H_

#include <array>
#include <memory>
#include <optional>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/parallel/parallel.h"
#include "core/planning/expectation/expectation.h"
#include "core/planning/expectation/expected_site.h"
#include "core/planning/feasibility/feasible_views.h"
#include "core/planning/patches/patches.h"
#include "core/planning/plan/coverage.h"
#include "core/planning/plan/opening.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/scoring/overlap_surface.h"
#include "core/planning/scoring/scoring.h"
#include "core/sensor/scanner_model.h"
#include "core/visibility/occlusion_scene.h"
#include "core/visibility/opaque_grid.h"

namespace vantage::planning {

class PlanningProblem;

// What a problem is a function of.
struct PlanningQuestion {
  const model::PlanningView& model;
  const sensor::ScannerModel& scanner;
  const PlanningConfig& config;
  // A problem that was prepared before, perhaps for another model, scanner or configuration. Parts
  // that these differences do not affect are shared with it instead of made again. The result is
  // the same.
  const PlanningProblem* previous = nullptr;
  // What a prior of the site shows, where one is used; what is expected comes from it first. It
  // counts with StationBasis::kExpected alone.
  std::shared_ptr<const ExpectedSite> site = nullptr;
};

// All that depends on the model, a prior of the site, the scanner and the configuration alone:
// plans, what-ifs, fleets and claims start from it. Never changes. Keeps the reference to the
// model. Thread safe.
class PlanningProblem {
 public:
  // The same on any number of threads. INVALID_ARGUMENT: scanner or configuration is impossible, or
  // does not fit the model. RESOURCE_EXHAUSTED: CheckPlanningSize(). CANCELLED when that was
  // requested on the way; the message is the name of the step that it came to (kPlanStageNames).
  static absl::StatusOr<std::shared_ptr<const PlanningProblem>> Prepare(
      const PlanningQuestion& question, parallel::Parallel& parallel,
      const parallel::Cancellation& cancelled = {});

  const model::PlanningView& model() const { return model_; }
  // What is expected beyond the model; null where nothing is, or where views stand on what is known
  // only.
  const Expectation* expectation() const { return occlusion_->expectation.get(); }
  // The model with what is expected: what grid, scene, feasible views and patches are of.
  const model::PlanningView& view() const {
    return expectation() == nullptr ? model_ : expectation()->view();
  }
  // What a prior shows of the site; null where none is used.
  const ExpectedSite* site() const { return site_.get(); }
  const sensor::ScannerModel& scanner() const { return scanner_; }
  const PlanningConfig& config() const { return config_; }

  const visibility::OpaqueGrid& grid() const { return occlusion_->grid; }
  const visibility::OcclusionScene& scene() const { return occlusion_->scene; }
  // A. Where the scanner can stand.
  const FeasibleViews& feasible() const { return feasible_; }
  // What a place is known by: kExpected where `feasible()` has it by what is expected alone.
  StationBasis BasisOf(const Eigen::Vector3d& place) const;
  // B and C. The deficient surface, the most important patch first, and how complete the rest is.
  const PatchSet& patches() const { return *patches_; }
  const Coverage& coverage() const { return *coverage_; }
  // Where the known space leads on.
  const Openings& openings() const { return coverage_->openings; }
  // For D.
  const Scoring& scoring() const { return *scoring_; }
  // For F. Its scene is scene().
  const OverlapSurface& overlap() const { return *overlap_; }

  // What preparing took, by stage, s: what was shared took nothing.
  const std::array<double, kPlanStages>& seconds() const { return seconds_; }

 private:
  // Depends on the model, on where the floor is, and on whether anything is expected.
  struct Occlusion {
    std::shared_ptr<const Expectation> expectation;
    visibility::OpaqueGrid grid;
    visibility::OcclusionScene scene;
  };
  struct Common;
  struct Making;
  explicit PlanningProblem(const PlanningQuestion& question)
      : model_(question.model),
        scanner_(question.scanner),
        config_(question.config),
        site_(question.config.station_basis == StationBasis::kExpected ? question.site : nullptr) {}
  // The steps of Prepare(), in order; each makes what the problem before does not have.
  absl::Status FindViews(const Common& common, Making& making, parallel::Parallel& parallel,
                         const parallel::Cancellation& cancelled);
  absl::Status ExtractSurface(const Common& common, Making& making, parallel::Parallel& parallel,
                              const parallel::Cancellation& cancelled);
  absl::Status MakeScene(Making& making, parallel::Parallel& parallel,
                         const parallel::Cancellation& cancelled);
  absl::Status RankSurface(const Common& common, Making& making,
                           const parallel::Cancellation& cancelled);

  const model::PlanningView& model_;
  const sensor::ScannerModel scanner_;
  const PlanningConfig config_;
  const std::shared_ptr<const ExpectedSite> site_;
  std::shared_ptr<const Occlusion> occlusion_;
  FeasibleViews feasible_;
  FeasibleViews known_;  // by the model alone; empty where nothing is expected
  // Depends on the model and on what the configuration says of surface and of floor_z.
  std::shared_ptr<const PatchSet> patches_;
  std::shared_ptr<const Coverage> coverage_;  // also on what the scanner reaches, and from where
  std::unique_ptr<const Scoring> scoring_;
  std::optional<const OverlapSurface> overlap_;
  std::array<double, kPlanStages> seconds_{};
};

// A plan of which the figures of steps A to C are known.
Plan BeginPlan(const PlanningProblem& problem);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PROBLEM_PLANNING_PROBLEM_H_
