#include "core/planning/ranking/termination.h"

#include <algorithm>

#include "absl/strings/str_format.h"

namespace vantage::planning {

Termination JudgeTermination(const PatchSet& patches, const Evaluation& evaluation,
                             const PlanningConfig& config,
                             std::optional<double> unobservable_area) {
  Termination termination;
  for (const Patch& patch : patches.patches) {
    termination.largest_patch_area = std::max(termination.largest_patch_area, patch.area);
  }
  for (const ViewEstimate& view : evaluation.views) {
    termination.best_upper = std::max(termination.best_upper, view.upper);
  }
  if (unobservable_area.has_value()) {
    termination.unobservable_area = *unobservable_area;
    termination.unobservable_known = true;
  }
  const double best_area = termination.best_upper / config.required_density;
  if (patches.patches.empty()) {
    termination.suggested = true;
    termination.reason = absl::StrFormat(
        "every surface has the required density of %.0f samples/m2 or is given up on",
        config.required_density);
  } else if (termination.largest_patch_area < config.min_patch_area) {
    termination.suggested = true;
    termination.reason =
        absl::StrFormat("the largest patch that needs work has %.4f m2, less than %.4f m2",
                        termination.largest_patch_area, config.min_patch_area);
  } else if (!evaluation.views.empty() && best_area < config.terminate_below) {
    termination.suggested = true;
    termination.reason = absl::StrFormat(
        "no view can gain more than %.3f m2 at the required density (upper bound), less than "
        "%.3f m2; %.2f m2 still need work",
        best_area, config.terminate_below, patches.area);
  } else if (evaluation.views.empty()) {
    termination.reason = absl::StrFormat(
        "%.2f m2 still need work, and no view of them could be evaluated", patches.area);
  } else {
    termination.reason = absl::StrFormat(
        "a view may still gain %.2f m2 at the required density (upper bound), at least %.2f m2; "
        "%.2f m2 still need work, the largest patch has %.2f m2",
        best_area, config.terminate_below, patches.area, termination.largest_patch_area);
  }
  return termination;
}

}  // namespace vantage::planning
