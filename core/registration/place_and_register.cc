#include "core/registration/place_and_register.h"

#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/registration/global_registration.h"
#include "core/registration/levelling.h"
#include "core/registration/registration.h"
#include "core/sensor/pose_prior.h"
#include "core/sensor/scanner_model.h"

namespace vantage::registration {
namespace {

// Of the samples, in space known to be empty or behind walls: more than furniture that was moved
// makes of a scan where it was made.
constexpr double kContradicted = 0.1;
// m and rad: the search and the alignment from the prior ended in the same place. Aligned poses of
// one minimum lie within a centimetre of each other, and no two rooms lie so near.
constexpr double kSamePlace = 0.2;
constexpr double kSameTurn = 0.05;

double Turn(const Eigen::Isometry3d& change) { return Eigen::AngleAxisd(change.linear()).angle(); }

bool AreOnePlace(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::Isometry3d apart = a.inverse() * b;
  return apart.translation().norm() < kSamePlace && Turn(apart) < kSameTurn;
}

// Whether the scan speaks against where it was said to be made, and not only against how firmly its
// shape holds it there, or between places as good.
bool DoesNotFit(const RegistrationResult& as_given, const RegistrationConfig& config) {
  if (as_given.verdict.registered()) return false;
  if (as_given.contradiction_share > kContradicted) return true;
  return as_given.verdict.outcome == RegistrationOutcome::kFailed &&
         (!as_given.converged || as_given.verdict.overlap_share < config.minimum_overlap);
}

// Whether a search without the prior found where the scan fits: for certain but for places that
// look the same, which it names, or less exactly than is required since its instrument knows no
// better.
bool FoundPlaces(const RegistrationVerdict& verdict) {
  if (verdict.registered()) return true;
  const auto rests_on = [&](RegistrationBasis basis) {
    return verdict.bases == std::vector<RegistrationBasis>{basis};
  };
  return verdict.outcome == RegistrationOutcome::kDoubtful &&
         (rests_on(RegistrationBasis::kRivalPose) ||
          (rests_on(RegistrationBasis::kResiduals) && verdict.attainable_accuracy.has_value()));
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
  if (!found.ok() || !FoundPlaces(found->verdict)) return std::nullopt;
  if (AreOnePlace(found->T_world_scan, as_given.T_world_scan)) return std::nullopt;
  const Eigen::Isometry3d apart = scan.prior->T_world_scan.inverse() * found->T_world_scan;
  const std::string distance = absl::StrFormat(
      "%.2f m, and %.0f degrees,", apart.translation().norm(), sensor::Degrees(Turn(apart)));
  RegistrationVerdict& verdict = found->verdict;
  verdict.outcome = RegistrationOutcome::kDoubtful;
  if (found->rival_poses.empty()) verdict.bases = {RegistrationBasis::kNoPosePrior};
  verdict.reason = absl::StrFormat(
      "the pose %s does not fit: it is %s off what the surfaces say, unless the scan was made in a "
      "place that looks the same (as given: %s%s)",
      scan.prior->from_file_header ? "in the file's header" : "given", distance,
      as_given.verdict.reason,
      found->rival_poses.empty() ? "" : "; several known places look the same");
  verdict.remedy =
      scan.prior->from_file_header
          ? "accept it if it was made there; else give a prior pose, and leave out the "
            "file's"
          : "accept it if it was made there, or give a better prior pose";
  found->residuals.reset();
  found->seconds += as_given.seconds;
  return *std::move(found);
}

absl::StatusOr<RegistrationResult> Place(const model::PlanningView& model, const sensor::Scan& scan,
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

}  // namespace

absl::StatusOr<RegistrationResult> PlaceAndRegister(const model::PlanningView& model,
                                                    const sensor::Scan& scan,
                                                    const Eigen::Isometry3d& last_pose,
                                                    std::span<const TargetTie> targets,
                                                    const RegistrationConfig& config,
                                                    parallel::Parallel& parallel) {
  auto placed = Place(model, scan, last_pose, targets, config, parallel);
  if (!placed.ok() || placed->verdict.registered()) return placed;
  // Places are looked for upright alone: this may be why.
  std::string& remedy = placed->verdict.remedy;
  if (const std::string tilt = TiltInDoubt(scan); !tilt.empty()) {
    remedy = remedy.empty() ? tilt : absl::StrCat(remedy, "; ", tilt);
  }
  return placed;
}

}  // namespace vantage::registration
