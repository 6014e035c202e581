#include "core/registration/place_and_register.h"

#include <Eigen/Geometry>
#include <optional>
#include <utility>

#include "absl/strings/str_format.h"
#include "core/registration/global_registration.h"
#include "core/registration/registration.h"
#include "core/sensor/pose_prior.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

// Of the samples, in space known to be empty or behind walls: more than furniture that was moved
// makes of a scan where it was made.
constexpr double kContradicted = 0.1;

// Whether the scan speaks against where it was said to be made, and not only against how firmly its
// shape holds it there, or between places as good.
bool DoesNotFit(const RegistrationResult& as_given, const RegistrationConfig& config) {
  if (as_given.verdict.registered()) return false;
  if (as_given.contradiction_share > kContradicted) return true;
  return as_given.verdict.outcome == RegistrationOutcome::kFailed &&
         (!as_given.converged || as_given.verdict.overlap_share < config.minimum_overlap);
}

// What the search without the prior found, as a doubtful result; nothing where it found no other
// pose that would register.
std::optional<RegistrationResult> FoundElsewhere(const model::PlanningView& model,
                                                 const sensor::Scan& scan,
                                                 const Eigen::Isometry3d& last_pose,
                                                 const RegistrationResult& as_given,
                                                 const RegistrationConfig& config,
                                                 parallel::Parallel& parallel) {
  auto found = RegisterGlobally(model, scan, last_pose, config, parallel);
  if (!found.ok() || !found->verdict.registered()) return std::nullopt;
  const Eigen::Isometry3d apart = scan.prior->T_world_scan.inverse() * found->T_world_scan;
  const double turned = Eigen::AngleAxisd(apart.linear()).angle();
  RegistrationVerdict& verdict = found->verdict;
  verdict.outcome = RegistrationOutcome::kDoubtful;
  verdict.bases = {RegistrationBasis::kNoPosePrior};
  verdict.reason = absl::StrFormat(
      "the pose given does not fit (%s); the scan fits %.2f m from there, turned by %.0f degrees, "
      "but a room that looks the same would, too",
      as_given.verdict.reason, apart.translation().norm(), sensor::Degrees(turned));
  verdict.remedy = "accept it if it was made there, or give a better prior pose";
  found->residuals.reset();
  found->seconds += as_given.seconds;
  return *std::move(found);
}

}  // namespace

absl::StatusOr<RegistrationResult> PlaceAndRegister(const model::PlanningView& model,
                                                    const sensor::Scan& scan,
                                                    const Eigen::Isometry3d& last_pose,
                                                    std::span<const TargetTie> targets,
                                                    const RegistrationConfig& config,
                                                    parallel::Parallel& parallel) {
  if (scan.prior.has_value()) {
    auto as_given = RegisterWithTargets(model, scan, *scan.prior, targets, config, parallel);
    // Targets say more than the shape of a room.
    if (!as_given.ok() || scan.prior->trusted || !targets.empty()) return as_given;
    if (!DoesNotFit(*as_given, config)) return as_given;
    auto elsewhere = FoundElsewhere(model, scan, last_pose, *as_given, config, parallel);
    if (elsewhere.has_value()) return *std::move(elsewhere);
    return as_given;
  }
  sensor::PosePrior start;
  if (const std::optional<TargetPose> pose = PoseFromTargets(targets)) {
    start.T_world_scan = pose->T_world_scan;
  } else {
    auto found = RegisterGlobally(model, scan, last_pose, config, parallel);
    if (!found.ok() || targets.empty()) return found;
    start.T_world_scan = found->T_world_scan;
  }
  return RegisterWithTargets(model, scan, start, targets, config, parallel);
}

}  // namespace vantage::registration
