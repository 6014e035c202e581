// The configuration of a plan (algorithm.md sections 5 to 10).
#ifndef VANTAGE_CORE_PLANNING_PLAN_PLANNING_CONFIG_H_
#define VANTAGE_CORE_PLANNING_PLAN_PLANNING_CONFIG_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "absl/status/status.h"
#include "core/model/view/planning_view.h"
#include "core/model/view/voxel.h"
#include "core/planning/plan/required_region.h"
#include "core/planning/plan/storey.h"
#include "core/planning/plan/target_advice.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/sightings.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// An upright box in which no scanner may stand, or the only one in which it may.
using Region = Eigen::AlignedBox3d;  // m, model frame

// 'I can't stand there': the places within `radius` of `position` (horizontally) are refused, on
// the storey of the floor below it.
struct RejectedPlace {
  Eigen::Vector3d position;
  double radius = 0.5;  // m, > 0
};

// The order in which the evaluation goes through views and patches.
enum class EvaluationOrder {
  kAnytime,  // race, decide, complete: the best answer at any deadline
  kPatches,  // the paper's: the most important patch first, against all views
};

// Where views may stand.
enum class StationBasis {
  kKnown,     // where floor, way and clearance are known
  kExpected,  // also where they are expected: behind doorways of rooms that were not entered
};

// What is required of surface at a place.
struct Requirement {
  double density = 0;  // D there, samples / m^2
  // What a sample there counts beside one elsewhere: the region's weight, times D elsewhere over D
  // there, so that a score over D is the area that was brought to what is required of it.
  double worth = 1;
  std::optional<size_t> region;  // index into PlanningConfig::regions; absent: in none
};

struct PlanningConfig {
  double required_density = 2500;     // D, samples / m^2, > 0
  double viewcell_size = 0.10;        // m, smallest viewcell edge, a multiple of the voxel
  double density_tolerance = 0.02;    // epsilon, in the order of patches: else scores are exact
  double min_viewpoint_height = 1.0;  // m, viewpoint over the floor below it
  double max_viewpoint_height = 2.0;  // m
  std::optional<double> floor_z;      // m, z of the floor; found from the model when absent
  StationBasis station_basis = StationBasis::kKnown;
  bool require_reachable = true;  // only cells connected to where a scanner has stood
  double scanner_width = 0.60;    // m, of the passages it fits through
  double scanner_height = 1.8;    // m
  std::array<double, model::kSurfaceKinds> weights = {1, 1, 1, 1};  // by SurfaceKind, >= 0
  bool pose_sensitivity = false;         // score only what every pose within the error sees
  bool density_on_false_surface = true;  // false: a single sample gains all of a cell
  // What samples are worth (algorithm.md section 5); with 0 for all three, as in the paper.
  double min_deficit_share = 0.5;  // of D; true surface short of D counts as lacking at least this
  double min_counted_density_share =
      0.7;                            // of D, [0, 1): samples on true surface count from here on
  double unknown_depth = 3;           // m, unknown space behind false surface that counts
  double candidate_separation = 0.6;  // m, of candidates checked for registration
  int candidates = 10;                // k, views returned at most
  // Views checked for registration at most; where none of them registers, as many again, farther
  // apart (algorithm.md section 9, 'The check of candidates').
  int max_checked = 60;
  double terminate_below = 0.5;  // m^2 of gain without what is hidden
  double min_patch_area = 0.02;  // m^2, smaller patches don't keep a job open
  double confidence = 0.95;      // of all bounds together, (0, 1)
  EvaluationOrder order = EvaluationOrder::kAnytime;
  // Deficient voxels that are planned for one by one, > 0. Of more, a cell stands for those of a
  // cube of 2, 4 or 8 voxels, so that about so many cells are left: a storey of 1,000 m2 in voxels
  // of 5 cm has a million, a hall of 6,000 m2 sixteen.
  uint64_t max_cells = uint64_t{1} << 21;
  // Memory of a plan besides its model, bytes. Plans that may need more are refused before they
  // begin.
  uint64_t memory_limit = uint64_t{8} << 30;
  uint64_t seed = 1;
  std::optional<Region> region_of_interest;  // views stand inside it, surface outside has no weight
  std::vector<Region> keep_out;              // views never stand inside
  std::vector<RejectedPlace> rejected;
  std::vector<RequiredRegion> regions;  // no two overlap
  std::vector<NamedStorey> storeys;     // for what people are told
  registration::RegistrationConfig registration;
  // For advice on targets: those whose places are known, and the scans in the model; without the
  // latter the model's stations count, as if their poses had no error.
  std::vector<registration::KnownTarget> targets;
  std::vector<ScannedFrom> scanned_from;

  // INVALID_ARGUMENT: one message that names every impossible field, including a D that the scanner
  // cannot reach anywhere in its range.
  absl::Status Validate(const sensor::ScannerModel& scanner) const;

  // What is required of the surface at a place, m, model frame. Nothing where surface does not
  // count: outside of the region of interest, and in regions without weight.
  std::optional<Requirement> RequiredAt(const Eigen::Vector3d& p) const;
};

// PlanningConfig::Validate() and the checks that depend on the model.
absl::Status ValidateFor(const model::PlanningView& model, const sensor::ScannerModel& scanner,
                         const PlanningConfig& config);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PLAN_PLANNING_CONFIG_H_
