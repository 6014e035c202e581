#include "server/session/coverage.h"

#include <algorithm>
#include <vector>

#include "server/contract/error.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/given_up.h"

namespace vantage::session {
namespace {

constexpr int kCoveragePatches = 100;

// A plan that ran out of time before it evaluated a view, or found no feasible view, does not.
bool SaysWhatRemains(const v1::Plan& plan) {
  if (plan.state() != v1::PLAN_STATE_SUCCEEDED) return false;
  switch (plan.result().outcome()) {
    case v1::PLAN_OUTCOME_VIEWS:
    case v1::PLAN_OUTCOME_NO_REGISTRABLE_VIEW:
    case v1::PLAN_OUTCOME_NOTHING_TO_GAIN:
      return true;
    case v1::PLAN_OUTCOME_SEARCH_UNFINISHED:
      return plan.result().termination().has_best_score_upper();
    default:
      return false;
  }
}

// What the scans of pending stations should bring.
void AddPending(const SessionContext& context, v1::Coverage& coverage) {
  context.journal().Read([&](const SessionState& state) {
    coverage.set_pending_station_count(static_cast<int32_t>(state.stations.size()));
    double area = 0;
    for (const auto& [name, station] : state.stations) {
      area += station.model_gain_m2() * (1 - station.loss_chance());
    }
    coverage.set_area_pending_m2(area);
  });
  if (coverage.pending_station_count() == 0 || !(coverage.estimated_coverage() > 0)) return;
  // All that is attainable.
  const double whole = coverage.area_at_density_m2() / coverage.estimated_coverage();
  coverage.set_expected_coverage(
      std::min(1.0, (coverage.area_at_density_m2() + coverage.area_pending_m2()) / whole));
}

}  // namespace

absl::StatusOr<v1::GetCoverageResponse> MeasureCoverage(const SessionContext& context,
                                                        ModelMemory& memory, const Plans& plans) {
  v1::GetCoverageResponse response;
  v1::Session described;
  context.journal().Read([&](const SessionState& state) { described = state.session; });
  const ModelSnapshot model = memory.Current();
  if (model.view == nullptr) {
    // Before the first scan nothing is covered, and that is returned.
    absl::Status why = memory.WhyNone();
    if (!absl::IsFailedPrecondition(why)) return why;
  }
  response.set_model_version(model.version);
  response.mutable_coverage()->set_required_density_per_m2(
      described.planning_config().required_density_per_m2());
  if (model.view != nullptr) {
    contract::Violations violations;
    const planning::PlanningConfig config = conversion::ReadPlanningConfig(
        described.planning_config(), described.site_rules(), context.origin(),
        model.view->voxel_size(), "planning_config", "site_rules", violations);
    std::vector<sensor::ScannerModel> scanners;
    for (const v1::ScannerModel& scanner : described.scanner_models()) {
      scanners.push_back(conversion::ReadScannerModel(scanner, "scanner_models", violations));
    }
    const auto site = context.dependencies().algorithms.measure_site(*model.view, scanners, config);
    if (!site.ok()) return site.status();
    *response.mutable_coverage() =
        conversion::WriteCoverage(site->coverage, config.required_density, context.origin());
    FindGivenUp(*model.view, context.origin(), response);
    for (const planning::Storey& storey : site->storeys) {
      *response.add_storeys() = conversion::WriteStorey(storey, context.origin());
    }
  }
  AddPending(context, *response.mutable_coverage());
  v1::Plan last;
  context.journal().Read([&](const SessionState& state) {
    for (auto it = state.plan_order.rbegin(); it != state.plan_order.rend(); ++it) {
      const v1::Plan& plan = state.plans.at(*it).plan;
      if (!SaysWhatRemains(plan)) continue;
      last = plan;
      return;
    }
  });
  if (!last.name().empty()) {
    response.set_plan(last.name());
    const v1::Termination& end = last.result().termination();
    response.set_best_remaining_model_gain_m2(end.best_model_gain_upper_m2());
    response.set_best_remaining_model_gain_lower_m2(end.best_model_gain_lower_m2());
    // Plans of earlier versions have their expected gain in the fields of model gain.
    response.set_best_remaining_expected_gain_m2(end.has_best_expected_gain_upper_m2()
                                                     ? end.best_expected_gain_upper_m2()
                                                     : end.best_model_gain_upper_m2());
    response.set_best_remaining_expected_gain_lower_m2(end.has_best_expected_gain_lower_m2()
                                                           ? end.best_expected_gain_lower_m2()
                                                           : end.best_model_gain_lower_m2());
    absl::StatusOr<v1::PlanResult> full = plans.GetFullResult(last.name());
    if (full.ok()) {
      const int count = std::min(full->patches_size(), kCoveragePatches);
      for (int i = 0; i < count; ++i) *response.add_patches() = full->patches(i);
    }
  }
  return response;
}

}  // namespace vantage::session
