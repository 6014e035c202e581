// Steps B and C: deficient surface, grouped into planar patches and ranked (algorithm.md
// section 7).
#ifndef VANTAGE_CORE_PLANNING_PATCHES_PATCHES_H_
#define VANTAGE_CORE_PLANNING_PATCHES_PATCHES_H_

#include <Eigen/Core>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/cancellation.h"
#include "core/planning/patches/skyline.h"
#include "core/planning/plan/patch.h"
#include "core/planning/plan/planning_config.h"

namespace vantage::planning {

// A deficient voxel: false surface, or true surface below the density that is required there, that
// is not given up, lies where surface counts and not in the sky.
struct DeficientCell {
  model::VoxelIndex voxel;
  model::SurfaceKind kind = model::SurfaceKind::kTrue;
  Eigen::Vector3f position;  // m, the model's centroid of it
  Eigen::Vector3f normal;    // unit, towards the empty side
  float area = 0;            // m^2
  float density = 0;         // q, samples / m^2
  float spread = 1;          // density at the voxel's middle over q, in the scan that recorded q
  float required = 0;        // samples / m^2: D there
  float enough = 0;          // samples / m^2: D, or more where unknown space lies behind it
  float success = 1;         // probability that measuring it works, from earlier attempts
  float worth = 1;           // what a sample counts: Requirement::worth
  SkylineSines skyline;      // what is to be expected behind it, where it is under the open sky
  // Places from which rays to it dropped out: [dropouts, dropouts + dropout_count) of
  // PatchSet::dropouts.
  uint32_t dropouts = 0;
  uint32_t dropout_count = 0;
  bool expected = false;  // it is not known, but expected (algorithm.md section 7E)
};

// How far a patch may stray from its plane.
struct PatchTolerance {
  double angle = 0.35;   // rad, of a cell's normal from the plane's
  double offset = 0.75;  // voxels, of a cell's position from the plane
};

struct PatchSet {
  std::vector<DeficientCell> cells;       // those of a patch side by side, patches in order
  std::vector<Patch> patches;             // before ranking: in the order of their first cells
  std::vector<Eigen::Vector3f> dropouts;  // m, model frame
  double area = 0;                        // m^2, of all cells
};

// B. Each deficient voxel is in exactly one patch; a patch is connected (26 neighbours), of one
// kind, and planar within the tolerance. CANCELLED when that was requested on the way.
absl::StatusOr<PatchSet> ExtractPatches(const model::PlanningView& model,
                                        const PlanningConfig& config,
                                        const PatchTolerance& tolerance = {},
                                        const parallel::Cancellation& cancelled = {});

// C. The patches by importance = weight * deficit, the most important first, and the cells with
// them. CANCELLED when that was requested on the way.
absl::StatusOr<PatchSet> RankPatches(const PlanningConfig& config, PatchSet set,
                                     const parallel::Cancellation& cancelled = {});

// The success probability of algorithm.md section 4, 'What never comes', after `failures` attempts
// that failed: 1 / (2 + f), normalised to 1 for no attempt. Successes do not matter, since surface
// that was measured is not deficient.
double SuccessProbability(int missed);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_PATCHES_PATCHES_H_
