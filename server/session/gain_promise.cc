#include "server/session/gain_promise.h"

#include <array>
#include <cmath>

#include "core/fleet/claims.h"
#include "core/fleet/same_sector.h"
#include "core/planning/openings/measure_coverage.h"
#include "core/sensor/scanner_model.h"
#include "server/conversion/fleet_proto.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

// rad, that a plan's scanner sees.
double SpanOf(const v1::Plan& plan, const v1::Session& session) {
  const v1::ScannerModel* model = conversion::FindModel(plan.scanner_model_id(), session);
  if (model == nullptr && session.scanner_models_size() > 0) model = &session.scanner_models(0);
  return model != nullptr && model->has_azimuth_span_rad() ? model->azimuth_span_rad()
                                                           : 2 * sensor::kPi;
}

// Views have a heading where the scanner sees a sector.
bool Faces(const v1::RankedView& view, const v1::Pose& pose, double span) {
  if (!view.has_heading_rad()) return true;
  const Eigen::Vector3d front =
      conversion::ReadOwnPose(pose, Eigen::Vector3d::Zero()).linear().col(0);
  return fleet::ShowsSameSector(view.heading_rad(), std::atan2(front.y(), front.x()), span);
}

bool IsThere(const v1::RankedView& view, const v1::Vector3& place) {
  // As for claims: how far people set up from where they were sent.
  const double apart = std::hypot(view.position().x() - place.x(), view.position().y() - place.y());
  // m: not on another storey. People choose a tripod's height.
  constexpr double kHeights = 1.5;
  return apart <= fleet::ClaimRules().arrival_tolerance &&
         std::abs(view.position().z() - place.z()) <= kHeights;
}

// Both gains come of one computation; the bounds of one of them tell whether the plan's time
// sufficed for it.
bool GainIsKnown(const v1::RankedView& view) {
  return view.model_gain_lower_m2() == view.model_gain_upper_m2();
}

}  // namespace

std::optional<v1::GainPromise> PromiseOf(const SessionState& state, const v1::Scan& scan) {
  for (auto name = state.plan_order.rbegin(); name != state.plan_order.rend(); ++name) {
    const v1::Plan& plan = state.plans.at(*name).plan;
    if (!plan.has_result()) continue;
    if (plan.result().model_version() < state.model_version) return std::nullopt;
    const double span = SpanOf(plan, state.session);
    for (int i = 0; i < plan.result().views_size(); ++i) {
      const v1::RankedView& view = plan.result().views(i);
      if (!GainIsKnown(view) || !IsThere(view, scan.pose().translation()) ||
          !Faces(view, scan.pose(), span)) {
        continue;
      }
      v1::GainPromise promise;
      promise.set_plan(*name);
      promise.set_view_index(i);
      promise.set_model_gain_m2(view.model_gain_m2());
      promise.set_expected_gain_m2(view.expected_gain_m2());
      promise.set_expected_gain_lower_m2(view.expected_gain_lower_m2());
      promise.set_expected_gain_upper_m2(view.expected_gain_upper_m2());
      return promise;
    }
  }
  return std::nullopt;
}

double ObtainedGain(const SessionContext& context, const model::PlanningView* before,
                    const model::PlanningView& after, parallel::Parallel& parallel) {
  v1::Session session;
  context.journal().Read([&](const SessionState& state) { session = state.session; });
  contract::Violations violations;  // none: it was checked when it was set
  const planning::PlanningConfig config = conversion::ReadPlanningConfig(
      session.planning_config(), session.site_rules(), context.origin(), after.voxel_size(),
      "planning_config", "site_rules", violations);
  const std::array<const model::PlanningView*, 2> models{before, &after};
  std::array<double, 2> area{};
  parallel.For(models.size(), [&](size_t i) {
    if (models[i] != nullptr) area[i] = planning::AreaAtDensity(*models[i], config);
  });
  return area[1] - area[0];
}

}  // namespace vantage::session
