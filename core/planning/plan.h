// What a plan asks for and what it answers (algorithm.md sections 5 to 10).
#ifndef VANTAGE_CORE_PLANNING_PLAN_H_
#define VANTAGE_CORE_PLANNING_PLAN_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "core/model/voxel.h"
#include "core/registration/verdict.h"
#include "core/sensor/scanner_model.h"

namespace vantage {

// An upright box in which no scanner may stand, or the only one in which it may.
using Region = Eigen::AlignedBox3d;  // m, model frame

// 'I can't stand there': the places within `radius` of `position` (horizontally) are refused.
struct RejectedPlace {
  Eigen::Vector3d position;
  double radius = 0.5;  // m, > 0
};

// How the evaluation goes through views and patches.
enum class EvaluationOrder {
  kAnytime,  // race, decide, complete: answers best at the deadline
  kPatches,  // the paper's: the most important patch first, against all views
};

struct PlanningConfig {
  double required_density = 2500;      // D, samples / m^2, > 0
  double viewcell_size = 0.10;         // m, smallest viewcell edge, a multiple of the voxel
  double density_tolerance = 0.02;     // epsilon, in the order of patches: else scores are exact
  double min_height = 1.0;             // m, viewpoint over the floor below it
  double max_height = 2.0;             // m
  std::optional<double> floor_height;  // m, z of the floor; found from the model when absent
  bool require_reachable = true;       // only cells connected to where a scanner has stood
  double scanner_width = 0.60;         // m, of the passages it fits through
  double scanner_height = 1.8;         // m
  std::array<double, kSurfaceKinds> weights = {1, 1, 1, 1};  // by SurfaceKind, >= 0
  bool pose_sensitivity = false;         // score only what every pose within the error sees
  bool density_on_false_surface = true;  // else it counts in full wherever it is seen
  // What samples are worth; the paper's metric has 0 for all three.
  double least_deficit = 0.5;    // of D, that true surface short of D counts as lacking at least
  double counts_from = 0.7;      // of D, [0, 1): samples on true surface count from here on
  double depth_behind = 3;       // m, unknown space behind false surface that counts
  double separation = 0.6;       // m, of candidates checked for registration
  int candidates = 10;           // k, views returned at most
  int max_checked = 60;          // views checked for registration at most
  double terminate_below = 0.5;  // m^2 of D-equivalent gain
  double min_patch_area = 0.02;  // m^2, smaller patches don't keep a job open
  double confidence = 0.95;      // of all bounds together, (0, 1)
  EvaluationOrder order = EvaluationOrder::kAnytime;
  // Bytes, of a plan besides its model; larger ones are refused before they are begun.
  uint64_t memory_limit = uint64_t{8} << 30;
  uint64_t seed = 1;
  std::optional<Region> region_of_interest;  // views stand inside it, surface outside has no weight
  std::vector<Region> keep_out;              // views never stand inside
  std::vector<RejectedPlace> rejected;
  RegistrationConfig registration;

  // INVALID_ARGUMENT naming every field that is impossible (a D that the scanner cannot reach
  // anywhere in its range among them), in one message.
  absl::Status Validate(const ScannerModel& scanner) const;
};

// A planar group of voxels that need work, of one kind (section 7B).
struct Patch {
  SurfaceKind kind = SurfaceKind::kTrue;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();   // m, of the bounding rectangle
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();  // unit
  Eigen::Vector3d axis_u = Eigen::Vector3d::UnitX();  // unit, along the rectangle's longer side
  double length_u = 0;                                // m, full sides of the rectangle
  double length_v = 0;
  double area = 0;          // m^2, sum over its cells
  double mean_density = 0;  // mean q, samples / m^2
  double deficit = 0;       // samples lacking: (D - mean q) * area, and what space behind it needs
  double importance = 0;    // w * deficit
  std::vector<uint32_t> cells;  // into PlanInput's needy cells, ascending
};

// Where a candidate is, in a room's own terms (section 11, 'Findable answers').
struct WallOffset {
  Eigen::Vector3d wall_point;   // m, on the wall
  Eigen::Vector3d wall_normal;  // unit, horizontal, towards the candidate
  double distance = 0;          // m
};
struct Findable {
  std::vector<WallOffset> walls;   // two distinct walls where there are any
  double last_stand_distance = 0;  // m, horizontally
  double last_stand_bearing = 0;   // rad, counter-clockwise from the model's +x
  std::string words;  // 'from station 2: 1.84 m towards ...; 1.10 m and 2.35 m from the walls'
};

// The connected viewcells around a candidate that score at least 95 % of it.
struct GoodRegion {
  Region box;         // m
  double volume = 0;  // m^3
  int cells = 0;
};

struct PatchGain {
  int patch = 0;    // index into Plan::patches
  double gain = 0;  // samples
};

struct RankedView {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  // m, model frame
  // Samples: expected useful new ones, weighted (`weights`, what samples are worth).
  double score = 0;
  double lower = 0;  // samples, score's bounds at the plan's confidence
  double upper = 0;
  bool exact = false;                                // lower == score == upper, confidence 1
  std::array<double, kSurfaceKinds> gain_by_kind{};  // samples, weighted, sums to score
  double height_over_floor = 0;                      // m
  double clearance = 0;                              // m, to the nearest thing not empty
  std::optional<double> travel;                      // m, from the last stand through free space
  std::vector<PatchGain> patches;                    // the most gained first, at most 5
  Findable where;
  GoodRegion region;
  RegistrationVerdict verdict;
};

enum class PlanOutcome {
  kViews,              // `views` is not empty
  kNoFeasibleView,     // nowhere to stand; `message` says which constraint leaves nothing
  kNoRegistrableView,  // candidates exist, none registers: `refused` with remedies
  kNothingToGain,      // every surface meets D, or no view gains anything
  kBudgetTooSmall,     // nothing could be said in the time
  kCancelled,
};

enum class PlanStage { kFeasible, kPatches, kRankPatches, kEvaluate, kRankViews, kCheck };
inline constexpr int kPlanStages = 6;
inline constexpr std::array<const char*, kPlanStages> kPlanStageNames = {
    "feasible views", "extract patches", "rank patches",
    "evaluate views", "rank views",      "registration check"};

struct Termination {
  bool suggested = false;
  std::string reason;             // with the numbers, also when not suggested
  double best_upper = 0;          // samples, over all views
  double largest_patch_area = 0;  // m^2
  double unseeable_area = 0;      // m^2 of needy surface that gains nothing from any feasible view
  bool unseeable_known = false;   // only a complete evaluation knows
};

// One viewcell of the map of scores.
struct ScoredCell {
  Eigen::Vector3f centre;  // m
  float score = 0;         // samples
  float lower = 0;
  float upper = 0;
};

struct Coverage {
  std::array<double, kSurfaceKinds> area{};  // m^2 by kind
  double area_at_density = 0;                // m^2 of true surface with q >= D
  double area_given_up = 0;                  // m^2
  // Area at density over all area that is true, false or under-sampled: the planner's estimate.
  double estimated_coverage = 0;  // [0, 1]
};

struct Plan {
  PlanOutcome outcome = PlanOutcome::kBudgetTooSmall;
  std::string message;
  uint64_t model_version = 0;
  uint64_t seed = 0;
  std::vector<RankedView> views;      // registrable, best first, at most k
  std::vector<RankedView> refused;    // the best that fail the check, best first, at most k
  std::vector<Patch> patches;         // most important first
  std::vector<ScoredCell> score_map;  // every feasible viewcell that was scored
  double optimality_gap = 1;          // section 8; 0 when exact
  double confidence = 1;              // of all bounds together
  bool complete = false;              // every view scored exactly
  Termination termination;
  Coverage coverage;
  double required_density = 0;  // D that the figures refer to
  size_t feasible_cells = 0;
  size_t needy_cells = 0;
  double needy_area = 0;  // m^2
  uint64_t rays = 0;      // the work done in evaluating and checking
  std::array<double, kPlanStages> seconds{};
};

}  // namespace vantage

#endif  // VANTAGE_CORE_PLANNING_PLAN_H_
