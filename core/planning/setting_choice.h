// Plans with several settings of one scanner and chooses the setting of each view.
#ifndef VANTAGE_CORE_PLANNING_SETTING_CHOICE_H_
#define VANTAGE_CORE_PLANNING_SETTING_CHOICE_H_

#include <memory>
#include <span>
#include <string>

#include "absl/status/statusor.h"
#include "core/model/view/planning_view.h"
#include "core/parallel/budget.h"
#include "core/parallel/parallel.h"
#include "core/planning/expectation/expected_site.h"
#include "core/planning/plan/plan.h"
#include "core/planning/plan/planning_config.h"
#include "core/planning/planner.h"
#include "core/sensor/scanner_model.h"

namespace vantage::planning {

// To carry the tripod on and set it up: about what it takes indoors. Without it the quickest
// setting would win wherever there is anything to gain.
inline constexpr double kSetUpMinutes = 1;

// A way to scan: the scanner as it is at a setting.
struct SettingOption {
  std::string name;
  sensor::ScannerModel scanner;
  double minutes = 0;  // of one scan, without setting up; >= 0
};

// Plans with each of `options` (at least one) within an equal share of the budget. Returns the
// views that gain most for each minute of setting up and scanning, apart from each other, each with
// the setting that makes it so. Termination and map of scores are those of the first option,
// so the finest setting should come first. `site`: what a prior shows, as PlanningQuestion has it.
// Errors as of MakePlan(), and INVALID_ARGUMENT without options.
absl::StatusOr<Plan> MakePlanChoosingSetting(
    const model::PlanningView& model, std::span<const SettingOption> options,
    const PlanningConfig& config, const parallel::Budget& budget, parallel::Parallel& parallel,
    PlanProgress progress, const std::shared_ptr<const ExpectedSite>& site = nullptr);

}  // namespace vantage::planning

#endif  // VANTAGE_CORE_PLANNING_SETTING_CHOICE_H_
