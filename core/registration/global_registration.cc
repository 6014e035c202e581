#include "core/registration/global_registration.h"

#include <Eigen/Geometry>
#include <chrono>
#include <limits>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/registration/align/align.h"
#include "core/registration/align/correspondence_field.h"
#include "core/registration/align/global_search.h"
#include "core/registration/align/scan_surface.h"
#include "core/registration/align/voxel_search.h"
#include "core/registration/bound/instrument_limit.h"
#include "core/registration/bound/qualify.h"
#include "core/registration/mirrors_told.h"
#include "core/registration/registration_input.h"

namespace vantage::registration {
namespace {

// Two rooms can look alike, and one of them may not have been scanned yet. So without a prior, a
// scan with little overlap or much contradiction does not merge by itself.
void DoubtWhatShapeAloneFound(RegistrationResult& result) {
  // Share, a choice: with less, two thirds of what the scan shows could be another room's.
  constexpr double kLeastOverlap = 0.35;
  RegistrationVerdict& verdict = result.verdict;
  if (!verdict.registered() || (verdict.overlap_share >= kLeastOverlap &&
                                result.contradiction_share <= kLittleContradiction)) {
    return;
  }
  result.residuals.reset();
  verdict.outcome = RegistrationOutcome::kDoubtful;
  verdict.bases = {RegistrationBasis::kNoPosePrior};
  verdict.reason = absl::StrFormat(
      "without a pose prior its place was found by shape alone: %.0f %% overlap, %.0f %% in "
      "contradiction",
      100 * verdict.overlap_share, 100 * result.contradiction_share);
  verdict.remedy = "accept the pose if it is right, or give a prior pose";
}

RegistrationResult RegisterReturnsGlobally(const model::PlanningView& model,
                                           const sensor::Scan& scan,
                                           const sensor::PosePrior& near_last,
                                           const RegistrationConfig& config,
                                           parallel::Parallel& parallel) {
  const ScanSurface surface = SampleSurface(scan, config.sample_spacing, parallel);
  const double h = model.voxel_size();
  const Eigen::AlignedBox3d everywhere(model.bounds().min.cast<double>() * h,
                                       model.bounds().max.cast<double>() * h);
  const CorrespondenceField field(model, everywhere, config.max_correspondence, parallel,
                                  CorrespondenceField::kCellsAllOver);
  const VoxelSearch search(model, everywhere);
  const GlobalSearch found = SearchGlobally(model, field, surface, config.sample_spacing, parallel);
  std::vector<Eigen::Isometry3d> starts = StartsAroundPrior(near_last);
  starts.insert(starts.begin(), found.places.begin(), found.places.end());
  Alignment alignment = AlignFrom(model, field, search, surface, near_last, StartKind::kPlaces,
                                  starts, config, parallel);
  if (found.more_places) alignment.open_within = std::numeric_limits<double>::infinity();
  alignment.left_out = found.left_out;
  sensor::PosePrior there;
  there.T_world_scan = alignment.T_world_scan;
  RegistrationResult result = Qualify(model, surface, alignment, there, config, parallel).result;
  SayInstrumentLimit(surface, config, result);
  DoubtWhatShapeAloneFound(result);
  if (!result.verdict.registered() && !found.why_not.empty()) {
    result.verdict.reason = absl::StrCat("there is no pose prior, and ", found.why_not,
                                         "; near the last station: ", result.verdict.reason);
    result.verdict.remedy = "give a prior pose";
  }
  return result;
}

}  // namespace

absl::StatusOr<RegistrationResult> RegisterGlobally(const model::PlanningView& model,
                                                    const sensor::Scan& scan,
                                                    const Eigen::Isometry3d& T_world_last,
                                                    const RegistrationConfig& config,
                                                    parallel::Parallel& parallel) {
  const auto started = std::chrono::steady_clock::now();
  sensor::PosePrior near_last;
  near_last.T_world_scan = T_world_last;
  const absl::Status valid = ValidateRegistration(model, scan, near_last, config);
  if (!valid.ok()) return valid;
  RegistrationResult result = WithMirrorsTold(scan, parallel, [&](const sensor::Scan& returns) {
    return RegisterReturnsGlobally(model, returns, near_last, config, parallel);
  });
  result.seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - started).count();
  return result;
}

}  // namespace vantage::registration
