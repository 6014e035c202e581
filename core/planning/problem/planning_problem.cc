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
         a.weights == b.weights && a.regions == b.regions && a.max_cells == b.max_cells &&
         same_region(a.region_of_interest, b.region_of_interest);
}

// Whether what one scanner looked at in vain the other would have, too.
bool SameLooks(const sensor::ScannerModel& a, const sensor::ScannerModel& b) {
  return a.TurnsAllAround() == b.TurnsAllAround() && a.range_max == b.range_max &&
         a.elevation_min == b.elevation_min && a.elevation_max == b.elevation_max;
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

// Which parts of the problem before are those of the question, too.
struct PlanningProblem::Common {
  explicit Common(const PlanningQuestion& question) : previous(question.previous) {
    const bool same_model = previous != nullptr && &previous->model_ == &question.model;
    floor = same_model && previous->config_.floor_z == question.config.floor_z;
    const bool expects = question.config.station_basis == StationBasis::kExpected;
    scene = floor && SameExpectation(previous->config_, question.config) &&
            previous->site_ == (expects ? question.site : nullptr) &&
            (previous->site_ == nullptr || SameLooks(previous->scanner_, question.scanner));
    surface = scene && SameSurface(previous->config_, question.config);
    coverage = surface && SameReach(*previous, question);
  }
  const PlanningProblem* previous;
  bool floor;
  bool scene;
  bool surface;
  bool coverage;
};

// What is made on the way.
struct PlanningProblem::Making {
  std::optional<visibility::OpaqueGrid> grid;  // of the scene, where that is not the one before
  absl::StatusOr<Openings> openings = Openings();
  std::shared_ptr<const Expectation> expectation;
  PatchSet patches;  // not ranked yet
};

absl::StatusOr<std::shared_ptr<const PlanningProblem>> PlanningProblem::Prepare(
    const PlanningQuestion& question, parallel::Parallel& parallel,
    const parallel::Cancellation& cancelled) {
  const model::PlanningView& model = question.model;
  const PlanningConfig& config = question.config;
  if (absl::Status valid = ValidateFor(model, question.scanner, config); !valid.ok()) return valid;
  PlanningSize size(model, config);
  if (question.site != nullptr && config.station_basis == StationBasis::kExpected) {
    size.Add(PlanningSize(question.site->view(), config));
  }
  if (absl::Status fits = CheckPlanningSize(size, config); !fits.ok()) return fits;
  const Common common(question);
  auto problem = absl::WrapUnique(new PlanningProblem(question));
  Making making;
  StageClock clock(problem->seconds_);

  // A. Feasible views, and where rooms lead on.
  const absl::Status found = problem->FindViews(common, making, parallel, cancelled);
  if (!found.ok()) return During(PlanStage::kFeasible, found);
  if (absl::Status fits = CheckPlanningSize(size, config, problem->feasible_.cells().size());
      !fits.ok()) {
    return fits;
  }
  clock.Book(PlanStage::kFeasible);

  // B. Extract patches. C. Rank patches.
  const absl::Status extracted = problem->ExtractSurface(common, making, parallel, cancelled);
  if (!extracted.ok()) return extracted;
  clock.Book(PlanStage::kPatches);
  const absl::Status ranked = problem->RankSurface(common, making, cancelled);
  if (!ranked.ok()) return During(PlanStage::kRankPatches, ranked);
  clock.Book(PlanStage::kRankPatches);

  // What D needs.
  auto cells = Scoring::CellsOf(problem->grid(), problem->patches(), problem->scanner_, config,
                                parallel, cancelled);
  if (!cells.ok()) return During(PlanStage::kEvaluate, cells.status());
  auto scoring = Scoring::Create(model.voxel_size(), problem->grid(), problem->scene(),
                                 *std::move(cells), problem->scanner_, config, parallel, cancelled);
  if (!scoring.ok()) return During(PlanStage::kEvaluate, scoring.status());
  problem->scoring_ = *std::move(scoring);
  clock.Book(PlanStage::kEvaluate);
  return std::shared_ptr<const PlanningProblem>(std::move(problem));
}

absl::Status PlanningProblem::FindViews(const Common& common, Making& making,
                                        parallel::Parallel& parallel,
                                        const parallel::Cancellation& cancelled) {
  if (common.scene) occlusion_ = common.previous->occlusion_;
  // What is known has a grid of its own where something is expected.
  const bool has_grid = common.scene && expectation() == nullptr;
  absl::StatusOr<FloorMap> floor = FloorMap();
  parallel.For(2, [&](size_t part) {
    if (part == 0) floor = FloorMap::Find(model_, config_.floor_z, cancelled);
    if (part == 1 && !has_grid) making.grid.emplace(model_);
  });
  if (!floor.ok()) return floor.status();
  absl::StatusOr<FeasibleViews> known = FeasibleViews();
  parallel.For(2, [&](size_t part) {
    if (part == 0) {
      known = FeasibleViews::Find(model_, *floor, has_grid ? grid() : *making.grid, scanner_,
                                  config_, parallel, cancelled);
    } else {
      making.openings = common.floor ? absl::StatusOr<Openings>(common.previous->openings())
                                     : FindOpenings(model_, *floor, cancelled);
    }
  });
  if (!known.ok()) return known.status();
  if (!making.openings.ok()) return making.openings.status();
  if (common.scene) {
    making.expectation = occlusion_->expectation;
  } else if (config_.station_basis == StationBasis::kExpected) {
    auto found = Expectation::Of(model_, *floor, *making.openings, config_.rejected, site_.get(),
                                 scanner_, parallel, cancelled);
    if (!found.ok()) return found.status();
    making.expectation = *std::move(found);
    if (making.expectation != nullptr) making.grid.emplace(making.expectation->view());
  }
  if (making.expectation == nullptr) {
    feasible_ = *std::move(known);
    return absl::OkStatus();
  }
  known_ = *std::move(known);
  const Expectation& expected = *making.expectation;
  const FloorMap with_rooms = known_.floor().With(expected.floors(), expected.view());
  const auto ways = with_rooms.WithShadows(model_, cancelled);
  if (!ways.ok()) return During(PlanStage::kFeasible, ways.status());
  auto feasible = FeasibleViews::FindExpected(expected.standing(), with_rooms, *ways,
                                              common.scene ? grid() : *making.grid, known_,
                                              scanner_, config_, parallel, cancelled);
  if (!feasible.ok()) return feasible.status();
  feasible_ = *std::move(feasible);
  return absl::OkStatus();
}

// Coverage, patches, and the scene with what F needs need nothing of one another. Patches grow on
// one thread, and take longest.
absl::Status PlanningProblem::ExtractSurface(const Common& common, Making& making,
                                             parallel::Parallel& parallel,
                                             const parallel::Cancellation& cancelled) {
  if (common.surface) patches_ = common.previous->patches_;
  if (common.coverage) coverage_ = common.previous->coverage_;
  const Expectation* const expected = making.expectation.get();
  absl::StatusOr<Coverage> coverage = Coverage();
  absl::StatusOr<PatchSet> patches = PatchSet();
  absl::Status scene;
  absl::StatusOr<OverlapSurface> overlap = absl::UnknownError("not made");
  parallel.For(3, [&](size_t part) {
    if (part == 1 && !common.coverage) {
      const FeasibleViews& known = expected != nullptr ? known_ : feasible_;
      coverage = MeasureCoverage(model_, std::span(&scanner_, 1), config_, known.floor(),
                                 *std::move(making.openings), cancelled);
    }
    if (part == 0 && !common.surface) {
      patches = ExtractPatches(expected != nullptr ? expected->view() : model_, config_, {},
                               cancelled, site_ != nullptr ? site_->Told() : Region());
      if (patches.ok() && expected != nullptr) MarkExpected(*expected, *patches);
    }
    if (part == 2) {
      if (!common.scene) scene = MakeScene(making, parallel, cancelled);
      if (scene.ok()) {
        overlap =
            OverlapSurface::Create(model_, grid(), this->scene(), scanner_, parallel, cancelled);
      }
    }
  });
  if (!coverage.ok()) return During(PlanStage::kPatches, coverage.status());
  if (!patches.ok()) return During(PlanStage::kPatches, patches.status());
  if (!scene.ok()) return During(PlanStage::kEvaluate, scene);
  if (!overlap.ok()) return During(PlanStage::kCheck, overlap.status());
  overlap_.emplace(*std::move(overlap));
  if (!common.coverage) coverage_ = std::make_shared<const Coverage>(*std::move(coverage));
  if (!common.surface) making.patches = *std::move(patches);
  return absl::OkStatus();
}

absl::Status PlanningProblem::MakeScene(Making& making, parallel::Parallel& parallel,
                                        const parallel::Cancellation& cancelled) {
  auto scene = visibility::OcclusionScene::Create(*making.grid, parallel, cancelled);
  if (!scene.ok()) return scene.status();
  occlusion_ = std::make_shared<const Occlusion>(
      Occlusion{making.expectation, *std::move(making.grid), *std::move(scene)});
  return absl::OkStatus();
}

absl::Status PlanningProblem::RankSurface(const Common& common, Making& making,
                                          const parallel::Cancellation& cancelled) {
  if (common.surface) return absl::OkStatus();
  auto ranked = RankPatches(config_, std::move(making.patches), cancelled);
  if (!ranked.ok()) return ranked.status();
  patches_ = std::make_shared<const PatchSet>(*std::move(ranked));
  return absl::OkStatus();
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
  plan.surface_cube = problem.patches().cube;
  plan.deficient_area = problem.patches().area;
  plan.patches = problem.patches().patches;
  plan.seconds = problem.seconds();
  return plan;
}

}  // namespace vantage::planning
