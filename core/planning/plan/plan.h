// The result of a plan (algorithm.md sections 5 to 10).
#ifndef VANTAGE_CORE_PLANNING_PLAN_PLAN_H_
#define VANTAGE_CORE_PLANNING_PLAN_PLAN_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/model/view/planning_view.h"
#include "core/planning/plan/copy_on_write_vector.h"
#include "core/planning/plan/coverage.h"
#include "core/planning/plan/followed_tour.h"
#include "core/planning/plan/narrow_way.h"
#include "core/planning/plan/patch.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/plan/ranked_view.h"
#include "core/planning/plan/storey.h"

namespace vantage::planning {

enum class PlanOutcome {
  kViews,              // `views` is not empty
  kNoFeasibleView,     // nowhere to stand; `message` says which constraint leaves nothing
  kNoRegistrableView,  // candidates exist, none registers: `refused` with remedies
  kNothingToGain,      // every surface meets D, or no view gains anything
  kSearchUnfinished,   // the budget ended before a view was found that registers
  kCancelled,
};

enum class PlanStage { kFeasible, kPatches, kRankPatches, kEvaluate, kRankViews, kCheck };
inline constexpr int kPlanStages = 6;
inline constexpr std::array<const char*, kPlanStages> kPlanStageNames = {
    "feasible views", "extract patches", "rank patches",
    "evaluate views", "rank views",      "registration check"};

struct Termination {
  bool suggested = false;
  std::string reason;                // with the numbers; also when stopping is not suggested
  std::optional<double> best_upper;  // samples, over all views; absent when none was evaluated
  // RankedView::gain_without_hidden of the best view lies between these, m^2; absent when none was
  // evaluated.
  std::optional<double> best_gain_without_hidden;
  std::optional<double> best_gain_without_hidden_upper;
  // Some view has so much model gain, m^2; absent when none was evaluated. None has more than
  // `best_gain_without_hidden_upper`.
  std::optional<double> best_model_gain;
  double largest_patch_area = 0;  // m^2
  double unobservable_area =
      0;  // m^2 of deficient surface that gains nothing from any feasible view
  bool unobservable_known = false;  // only a complete evaluation knows
};

// One viewcell of the map of scores.
struct ScoredCell {
  Eigen::Vector3f centre;  // m
  float score = 0;         // samples
  float lower = 0;
  float upper = 0;
};

struct Plan {
  PlanOutcome outcome = PlanOutcome::kSearchUnfinished;
  std::string message;
  uint64_t model_version = 0;
  uint64_t seed = 0;
  std::vector<RankedView> views;      // registrable, best first, at most k
  std::vector<RankedView> refused;    // the best that fail the check, best first, at most k
  CopyOnWriteVector<Patch> patches;   // most important first
  std::vector<ScoredCell> score_map;  // every feasible viewcell that was scored
  double optimality_gap = 1;          // algorithm.md section 8; 0 when exact
  double confidence = 1;              // of all bounds together
  bool complete = false;              // every view scored exactly
  Termination termination;
  std::vector<NarrowWay> narrow_ways;         // the largest gain first; hardly ever any
  std::optional<FollowedTour> followed_tour;  // absent where no tour was to be followed
  std::optional<Coverage> coverage;           // absent until it was measured
  std::vector<Storey> storeys;                // from the lowest up; empty until they were found
  double required_density = 0;                // D that the figures refer to
  // Where no view registers since the required accuracy cannot be met with the scanner: the bound
  // that can, m.
  std::optional<double> attainable_accuracy;
  size_t feasible_cells = 0;
  size_t deficient_cells = 0;
  int surface_cube = 1;       // PatchSet::cube
  double deficient_area = 0;  // m^2
  uint64_t rays = 0;          // work done by evaluation and checks
  std::array<double, kPlanStages> seconds{};
};

// A plan of which nothing is known yet but what it is for.
Plan BeginPlan(const model::PlanningView& model, const PlanningConfig& config);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_PLAN_H_
