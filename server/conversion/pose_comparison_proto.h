// Conversion of comparisons of a scan's poses to the wire.
#ifndef VANTAGE_SERVER_CONVERSION_POSE_COMPARISON_PROTO_H_
#define VANTAGE_SERVER_CONVERSION_POSE_COMPARISON_PROTO_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "core/registration/pose_comparison.h"
#include "vantage/v1/pose_comparison.pb.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::conversion {

// A pose at which a scan may have been made, and whose it is.
struct PoseOfScan {
  Eigen::Isometry3d T_model_scan = Eigen::Isometry3d::Identity();
  v1::ComparedPoseKind kind = v1::COMPARED_POSE_KIND_UNSPECIFIED;
  int rival_pose = 0;  // as in AcceptScanRequest
};

// Those of a scan that has a registration: the aligned one, its rivals, and the prior where it is
// farther from all of these than people see in a picture.
std::vector<PoseOfScan> PosesOf(const v1::Scan& scan, const Eigen::Vector3d& origin);

// `poses`: those that were compared, in the same order. Model version and time are the caller's.
v1::PoseComparison WritePoseComparison(const registration::PoseComparison& comparison,
                                       std::span<const PoseOfScan> poses,
                                       const Eigen::Vector3d& origin);

}  // namespace vantage::conversion

#endif  // VANTAGE_SERVER_CONVERSION_POSE_COMPARISON_PROTO_H_
