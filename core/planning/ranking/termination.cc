#include "core/planning/ranking/termination.h"

#include <algorithm>

#include "absl/strings/str_format.h"

namespace vantage::planning {

std::optional<double> UnobservableArea(const PatchSet& patches, const Evaluation& evaluation) {
  if (!evaluation.complete) return std::nullopt;
  double area = 0;
  for (size_t i = 0; i < patches.cells.size(); ++i) {
    const bool seen = i < evaluation.seen.size() && evaluation.seen[i] != 0;
    if (!seen) area += static_cast<double>(patches.cells.Area(i));
  }
  return area;
}

Termination JudgeTermination(const PatchSet& patches, const Evaluation& evaluation,
                             const PlanningConfig& config, std::optional<double> unobservable_area,
                             const std::optional<GainBounds>& gains) {
  Termination termination;
  for (const Patch& patch : patches.patches) {
    termination.largest_patch_area = std::max(termination.largest_patch_area, patch.area);
  }
  for (const ViewEstimate& view : evaluation.views) {
    termination.best_upper = std::max(termination.best_upper.value_or(0), view.upper);
  }
  if (unobservable_area.has_value()) {
    termination.unobservable_area = *unobservable_area;
    termination.unobservable_known = true;
  }
  if (gains.has_value()) {
    termination.best_gain_without_hidden = gains->lower;
    termination.best_gain_without_hidden_upper = gains->upper;
    termination.best_model_gain = gains->model_gain;
  }
  if (patches.patches.empty()) {
    termination.suggested = true;
    termination.reason = absl::StrFormat(
        "every surface has the required density of %.0f samples/m2%s or is given up on",
        config.required_density, config.regions.empty() ? "" : ", or that of its region,");
  } else if (termination.largest_patch_area < config.min_patch_area) {
    termination.suggested = true;
    termination.reason =
        absl::StrFormat("the largest deficient patch has %.4f m2, less than %.4f m2",
                        termination.largest_patch_area, config.min_patch_area);
  } else if (!gains.has_value()) {
    termination.reason = absl::StrFormat(
        "%.2f m2 are still deficient, and no view of them could be evaluated", patches.area);
  } else if (gains->upper < config.terminate_below) {
    termination.suggested = true;
    termination.reason = absl::StrFormat(
        "no view brings %.3f m2 to the required density: the best brings %.3f m2 at least and "
        "%.3f m2 at most; %.2f m2 are still deficient",
        config.terminate_below, gains->lower, gains->upper, patches.area);
  } else if (gains->lower < config.terminate_below) {
    termination.reason = absl::StrFormat(
        "a view that was looked at brings %.2f m2 to the required density, less than %.2f m2, but "
        "not all were; %.2f m2 are still deficient, the largest patch has %.2f m2",
        gains->lower, config.terminate_below, patches.area, termination.largest_patch_area);
  } else {
    termination.reason = absl::StrFormat(
        "a view brings %.2f m2 to the required density; stopping is suggested when none brings "
        "%.2f m2; %.2f m2 are still deficient, the largest patch has %.2f m2",
        gains->lower, config.terminate_below, patches.area, termination.largest_patch_area);
  }
  return termination;
}

}  // namespace vantage::planning
