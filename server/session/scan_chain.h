// The scans of a session and what ties them, as the pose graph that their poses follow from
// (algorithm.md section 9, 'The chain closes').
#ifndef VANTAGE_SERVER_SESSION_SCAN_CHAIN_H_
#define VANTAGE_SERVER_SESSION_SCAN_CHAIN_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <vector>

#include "absl/status/statusor.h"
#include "core/registration/align/targets.h"
#include "core/registration/graph/model_link.h"
#include "core/registration/graph/pose_graph.h"
#include "server/session/session_state.h"
#include "vantage/v1/geometry.pb.h"
#include "vantage/v1/pose_graph.pb.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

// What the poses of a session follow from. A value.
struct ScanChain {
  // The scans in the model, but for those whose poses a person set without saying how good they
  // are: these stay, and nothing moves for their sake. In the order of their creation.
  std::vector<v1::Scan> scans;
  // Those between them, by first and second scan.
  std::vector<v1::ScanLink> links;
  double required_accuracy = 0.010;                  // m, of registrations in the session
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // m, world frame, of the model frame
};

ScanChain ReadChain(const SessionState& state, const Eigen::Vector3d& origin);

// Whether a scan is among those of a chain once it is in the model.
bool IsChained(const v1::Scan& scan);

// T_world_scan as it was registered, accepted or believed, before any adjustment.
const v1::Pose& UnadjustedPose(const v1::Scan& scan);

// The graph of the first `count` scans of a chain at these poses (as many), with what registration
// to the model says of them (registration::WithModelLinks()). Poses need that: a scan that sees
// what six others saw is held better than by any of them alone, and a single link that is wrong
// would move it.
absl::StatusOr<registration::PoseGraph> GraphOf(
    const ScanChain& chain, size_t count, const std::vector<Eigen::Isometry3d>& poses,
    const std::vector<registration::ModelRegistration>& registrations);

registration::ScanLink ReadLink(const v1::ScanLink& link);

// What a scan's prior says of its pose for certain, in the model frame, whose origin lies at
// `origin` (m, world); nothing where it is a guess.
std::optional<registration::AbsolutePose> BelievedPose(const v1::Scan& scan,
                                                       const Eigen::Vector3d& origin);

// The targets of a scan whose places a control network has, in the model frame.
std::vector<registration::TargetTie> ControlOf(const v1::Scan& scan, const Eigen::Vector3d& origin);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SCAN_CHAIN_H_
