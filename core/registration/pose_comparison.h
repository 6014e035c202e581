// A scan beside what the model knows, at each of several poses: what fits, what contradicts, and
// where; for who has to decide between them.
#ifndef VANTAGE_CORE_REGISTRATION_POSE_COMPARISON_H_
#define VANTAGE_CORE_REGISTRATION_POSE_COMPARISON_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/parallel.h"
#include "core/registration/align/known_surface.h"
#include "core/registration/align/registration_config.h"
#include "core/registration/disagreements.h"
#include "core/sensor/scan.h"

namespace vantage::registration {

// As SampleAgreement, and how a sample contradicts. A ray that has gone through known surface says
// that, also where it ends in space known to be empty.
enum class SampleState : uint8_t {
  kFits,
  kNothingKnown,
  kFitsNothing,
  kInEmptySpace,
  kBehindSurface
};

// A scan at a pose. The shares are of the samples that were compared, by what they stand for.
struct ComparedPose {
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();
  double overlap_share = 0;        // as RegistrationVerdict::overlap_share
  double rms_residual = 0;         // m, as RegistrationResult::rms_residual
  double contradiction_share = 0;  // of what fits or contradicts
  double fits_nothing_share = 0;
  double nothing_known_share = 0;
  double surface_in_sight = 0;              // m2, where the scan has a return or none
  double surface_seen_through = 0;          // m2, of it
  std::vector<Disagreement> disagreements;  // the largest first
  std::vector<SampleState> states;          // of each sample
  std::vector<float> residuals;             // m, of each sample that fits, positive before the
                                            // surface; else 0
  std::vector<SurfaceSight> sights;         // of each piece of the known surface
};

struct PoseComparison {
  std::vector<ComparedPose> poses;       // in the order in which they were asked for
  std::vector<Eigen::Vector3f> points;   // m, scanner frame: the samples, spread evenly over space
  std::vector<Eigen::Vector3f> normals;  // unit, scanner frame, of the same, to the scanner
  KnownSurface surface;                  // around the scan at all poses
  double reach = 0;                      // m: samples farther from known surface don't fit
};

struct ComparisonSize {
  size_t samples = 10'000;
  size_t surface = 30'000;  // pieces
};

// Compares `scan` with the model at each of `poses`, of which there is at least one. Reflections
// are left out where the scan contradicts at the first of them and shows by itself what they are,
// as in Register(). Errors as of ValidateRegistration().
absl::StatusOr<PoseComparison> ComparePoses(const model::PlanningView& model,
                                            const sensor::Scan& scan,
                                            std::span<const Eigen::Isometry3d> poses,
                                            const RegistrationConfig& config,
                                            const ComparisonSize& size,
                                            parallel::Parallel& parallel);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_POSE_COMPARISON_H_
