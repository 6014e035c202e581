#include "core/planning/problem/planning_problem.h"

#include <algorithm>
#include <optional>
#include <span>
#include <utility>

#include "absl/memory/memory.h"
#include "absl/status/status.h"
#include "core/planning/openings/measure_coverage.h"
#include "core/planning/openings/openings.h"
#include "core/planning/plan/stage_clock.h"
#include "core/planning/problem/planning_estimate.h"

namespace vantage::planning {
namespace {

// A cancelled part reports the step of the plan that it belongs to.
absl::Status During(PlanStage stage, const absl::Status& status) {
  if (!absl::IsCancelled(status)) return status;
  return absl::CancelledError(kPlanStageNames[static_cast<size_t>(stage)]);
}

bool SameSurface(const PlanningConfig& a, const PlanningConfig& b) {
  const auto same_region = [](const std::optional<Region>& x, const std::optional<Region>& y) {
    if (!x.has_value() || !y.has_value()) return x.has_value() == y.has_value();
    return x->min() == y->min() && x->max() == y->max();
  };
  return a.required_density == b.required_density && a.unknown_depth == b.unknown_depth &&
         a.weights == b.weights && a.regions == b.regions &&
         same_region(a.region_of_interest, b.region_of_interest);
}

// Whether a problem's scanner reaches from the places of its plans what the question's does.
bool SameReach(const PlanningProblem& problem, const PlanningQuestion& question) {
  const sensor::ScannerModel& a = problem.scanner();
  const sensor::ScannerModel& b = question.scanner;
  return a.azimuth_step == b.azimuth_step && a.elevation_step == b.elevation_step &&
         a.range_max == b.range_max && a.max_incidence == b.max_incidence &&
         problem.config().min_viewpoint_height == question.config.min_viewpoint_height &&
         problem.config().max_viewpoint_height == question.config.max_viewpoint_height;
}

bool SameExpectation(const PlanningConfig& a, const PlanningConfig& b) {
  if (a.station_basis != b.station_basis) return false;
  return a.station_basis == StationBasis::kKnown ||
         std::equal(a.rejected.begin(), a.rejected.end(), b.rejected.begin(), b.rejected.end(),
                    [](const RejectedPlace& x, const RejectedPlace& y) {
                      return x.position == y.position && x.radius == y.radius;
                    });
}

void MarkExpected(const Expectation& expectation, PatchSet& patches) {
  for (size_t i = 0; i < patches.cells.size(); ++i) {
    if (expectation.Expected(patches.cells.Voxel(i))) patches.cells.SetExpected(i);
  }
}

}  // namespace

absl::StatusOr<std::shared_ptr<const PlanningProblem>> PlanningProblem::Prepare(
    const PlanningQuestion& question, parallel::Parallel& parallel,
    const parallel::Cancellation& cancelled) {
  const model::PlanningView& model = question.model;
  const PlanningConfig& config = question.config;
  if (absl::Status valid = ValidateFor(model, question.scanner, config); !valid.ok()) return valid;
  const PlanningSize size(model, config);
  if (absl::Status fits = CheckPlanningSize(size, config); !fits.ok()) return fits;
  const PlanningProblem* previous = question.previous;
  const bool same_model = previous != nullptr && &previous->model_ == &model;
  const bool same_floor = same_model && previous->config_.floor_z == config.floor_z;
  const bool same_scene = same_floor && SameExpectation(previous->config_, config);
  auto problem = absl::WrapUnique(new PlanningProblem(question));
  StageClock clock(problem->seconds_);

  // A. Feasible views, and where rooms lead on.
  std::optional<visibility::OpaqueGrid> grid;
  if (same_scene) {
    problem->occlusion_ = previous->occlusion_;
  } else {
    grid.emplace(model);
  }
  const auto find = [&](const model::PlanningView& view, const visibility::OpaqueGrid& opaque) {
    return FeasibleViews::Find(view, opaque, question.scanner, config, parallel, cancelled);
  };
  const bool expects = same_scene && problem->expectation() != nullptr;
  auto feasible =
      find(model, same_scene && !expects ? problem->grid() : visibility::OpaqueGrid(model));
  if (!feasible.ok()) return During(PlanStage::kFeasible, feasible.status());
  auto openings =
      same_floor ? previous->openings() : FindOpenings(model, feasible->floor(), cancelled);
  if (!openings.ok()) return During(PlanStage::kFeasible, openings.status());
  std::shared_ptr<const Expectation> expectation =
      same_scene ? previous->occlusion_->expectation : nullptr;
  if (!same_scene && config.station_basis == StationBasis::kExpected) {
    auto found = Expectation::Of(model, *openings, config.rejected, cancelled);
    if (!found.ok()) return During(PlanStage::kFeasible, found.status());
    expectation = *std::move(found);
    if (expectation != nullptr) grid.emplace(expectation->view());
  }
  if (expectation != nullptr) {
    problem->known_ = *std::move(feasible);
    const FloorMap floor = problem->known_.floor().With(expectation->floors(), expectation->view());
    feasible = FeasibleViews::FindExpected(expectation->standing(), floor,
                                           same_scene ? problem->grid() : *grid, problem->known_,
                                           question.scanner, config, parallel, cancelled);
    if (!feasible.ok()) return During(PlanStage::kFeasible, feasible.status());
  }
  problem->feasible_ = *std::move(feasible);
  if (absl::Status fits = CheckPlanningSize(size, config, problem->feasible_.cells().size());
      !fits.ok()) {
    return fits;
  }
  const model::PlanningView& view = expectation == nullptr ? model : expectation->view();
  clock.Book(PlanStage::kFeasible);

  // Coverage needs nothing of the patches, and they nothing of it.
  const bool same_surface = same_scene && SameSurface(previous->config_, config);
  const bool same_coverage = same_surface && SameReach(*previous, question);
  if (same_surface) problem->patches_ = previous->patches_;
  if (same_coverage) problem->coverage_ = previous->coverage_;
  absl::StatusOr<PatchSet> patches = PatchSet();
  absl::Status measured = absl::OkStatus();
  parallel.For(2, [&](size_t part) {
    if (part == 0 && !same_coverage) {
      const FeasibleViews& known = expectation != nullptr ? problem->known_ : problem->feasible_;
      auto coverage = MeasureCoverage(model, std::span(&question.scanner, 1), config, known.floor(),
                                      *std::move(openings), cancelled);
      measured = During(PlanStage::kPatches, coverage.status());
      if (coverage.ok())
        problem->coverage_ = std::make_shared<const Coverage>(*std::move(coverage));
    }
    // B. Extract patches.
    if (part == 1 && !same_surface) {
      patches = ExtractPatches(view, config, {}, cancelled);
      if (patches.ok() && expectation != nullptr) MarkExpected(*expectation, *patches);
    }
  });
  if (!measured.ok()) return measured;
  if (!patches.ok()) return During(PlanStage::kPatches, patches.status());
  clock.Book(PlanStage::kPatches);

  // C. Rank patches.
  if (!same_surface) {
    auto ranked = RankPatches(config, *std::move(patches), cancelled);
    if (!ranked.ok()) return During(PlanStage::kRankPatches, ranked.status());
    problem->patches_ = std::make_shared<const PatchSet>(*std::move(ranked));
    clock.Book(PlanStage::kRankPatches);
  }

  // What D needs. The scene takes most, so it comes when what making the cells took is free again.
  auto cells = Scoring::CellsOf(same_scene ? problem->grid() : *grid, problem->patches(),
                                problem->scanner_, config, parallel, cancelled);
  if (!cells.ok()) return During(PlanStage::kEvaluate, cells.status());
  if (!same_scene) {
    auto scene = visibility::OcclusionScene::Create(*grid, parallel, cancelled);
    if (!scene.ok()) return During(PlanStage::kEvaluate, scene.status());
    problem->occlusion_ = std::make_shared<const Occlusion>(
        Occlusion{std::move(expectation), *std::move(grid), *std::move(scene)});
  }
  auto scoring = Scoring::Create(model.voxel_size(), problem->grid(), problem->scene(),
                                 *std::move(cells), problem->scanner_, config, parallel, cancelled);
  if (!scoring.ok()) return During(PlanStage::kEvaluate, scoring.status());
  problem->scoring_ = *std::move(scoring);
  clock.Book(PlanStage::kEvaluate);

  // What F needs.
  auto overlap = OverlapSurface::Create(model, problem->grid(), problem->scene(), problem->scanner_,
                                        parallel, cancelled);
  if (!overlap.ok()) return During(PlanStage::kCheck, overlap.status());
  problem->overlap_.emplace(*std::move(overlap));
  clock.Book(PlanStage::kCheck);
  return std::shared_ptr<const PlanningProblem>(std::move(problem));
}

StationBasis PlanningProblem::BasisOf(const Eigen::Vector3d& place) const {
  const bool known = expectation() == nullptr || known_.IndexOf(known_.CellOf(place)) >= 0;
  return known ? StationBasis::kKnown : StationBasis::kExpected;
}

Plan BeginPlan(const PlanningProblem& problem) {
  Plan plan = BeginPlan(problem.model(), problem.config());
  plan.feasible_cells = problem.feasible().cells().size();
  plan.coverage = problem.coverage();
  plan.storeys = problem.feasible().floor().storeys().DescribeAll(problem.config().storeys);
  plan.deficient_cells = problem.patches().cells.size();
  plan.deficient_area = problem.patches().area;
  plan.patches = problem.patches().patches;
  plan.seconds = problem.seconds();
  return plan;
}

}  // namespace vantage::planning
