#include "server/session/header_frame.h"

#include "core/registration/align/prior_search.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

bool IsUnvouchedHeader(const v1::Scan& scan) {
  return scan.has_prior() && !scan.prior().trusted() &&
         scan.prior().source() == v1::POSE_PRIOR_SOURCE_FILE_HEADER;
}

// Whether a scan was merged farther from its prior than that may be wrong.
bool LiesOutOfReach(const v1::Scan& scan, const Eigen::Isometry3d& from_prior,
                    const Eigen::Vector3d& origin) {
  contract::Violations violations;
  const registration::PriorReach reach =
      registration::ReachOf(conversion::ReadPosePrior(scan.prior(), origin, "prior", violations));
  return from_prior.translation().norm() > reach.shift ||
         Eigen::AngleAxisd(from_prior.linear()).angle() > reach.turn;
}

}  // namespace

HeaderAdvice AdviseOnHeader(const SessionState& state, const v1::Scan& scan,
                            const Eigen::Vector3d& origin) {
  HeaderAdvice advice;
  if (!IsUnvouchedHeader(scan)) return advice;
  const Eigen::Isometry3d T_header_scan = conversion::ReadOwnPose(scan.prior().pose(), origin);
  for (const std::string& name : state.scan_order) {
    const ScanRecord& record = state.scans.at(name);
    if (!record.in_model || name == scan.name() || !IsUnvouchedHeader(record.scan)) continue;
    const v1::Pose& stated = record.scan.prior().pose();
    if (stated.SerializeAsString() == scan.prior().pose().SerializeAsString() &&
        record.scan.sha256() != scan.sha256()) {
      advice.repeated = true;
    }
    const Eigen::Isometry3d T_header_other = conversion::ReadOwnPose(stated, origin);
    const Eigen::Isometry3d T_model_other = conversion::ReadOwnPose(record.scan.pose(), origin);
    // The newest decides. From one scan to the other first: coordinates of another frame may be
    // millions.
    advice.in_frame.reset();
    if (LiesOutOfReach(record.scan, T_header_other.inverse() * T_model_other, origin)) {
      advice.in_frame = T_model_other * (T_header_other.inverse() * T_header_scan);
    }
  }
  return advice;
}

}  // namespace vantage::session
