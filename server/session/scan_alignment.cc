#include "server/session/scan_alignment.h"

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "core/registration/align/targets.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/header_frame.h"
#include "server/session/instrument.h"
#include "server/session/sightings.h"

namespace vantage::session {

absl::StatusOr<registration::RegistrationResult> AlignToModel(const SessionContext& context,
                                                              const model::PlanningView& model,
                                                              const v1::Scan& scan,
                                                              sensor::Scan& data,
                                                              parallel::Parallel& parallel) {
  Eigen::Isometry3d last_pose = Eigen::Isometry3d::Identity();
  std::vector<registration::TargetTie> targets;
  v1::PlanningConfig config;
  registration::InstrumentResiduals instrument;
  HeaderAdvice header;
  context.journal().Read([&](const SessionState& state) {
    targets = TiesOf(state, scan, context.origin());
    config = state.session.planning_config();
    instrument = InstrumentShown(state, scan.scanner_model(), scan.name());
    header = AdviseOnHeader(state, scan, context.origin());
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (record.in_model) {
        last_pose = conversion::ReadOwnPose(record.scan.pose(), context.origin());
      }
    }
  });
  contract::Violations violations;
  planning::PlanningConfig planning = conversion::ReadPlanningConfig(
      config, {}, context.origin(), model.voxel_size(), "planning_config", "", violations);
  planning.registration.instrument = instrument;
  if (header.repeated) data.prior.reset();
  const auto align = [&] {
    return context.dependencies().algorithms.register_scan(model, data, last_pose, targets,
                                                           planning.registration, parallel);
  };
  absl::StatusOr<registration::RegistrationResult> result = align();
  if (result.ok() && !result->verdict.registered() && data.prior && header.in_frame) {
    data.prior->T_world_scan = *header.in_frame;
    absl::StatusOr<registration::RegistrationResult> in_frame = align();
    if (in_frame.ok() && in_frame->verdict.registered()) result = std::move(in_frame);
  }
  return result;
}

v1::PoseReference NearestInModel(const SessionContext& context, const v1::Scan& scan,
                                 const Eigen::Isometry3d& T_model_scan) {
  v1::PoseReference nearest;
  double least = std::numeric_limits<double>::infinity();
  context.journal().Read([&](const SessionState& state) {
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (!record.in_model || name == scan.name()) continue;
      const Eigen::Isometry3d pose = conversion::ReadOwnPose(record.scan.pose(), context.origin());
      const double apart = (pose.translation() - T_model_scan.translation()).norm();
      if (!(apart < least)) continue;
      least = apart;
      nearest.set_scan(name);
      *nearest.mutable_pose() = record.scan.pose();
    }
  });
  return nearest;
}

}  // namespace vantage::session
