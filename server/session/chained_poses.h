// Where the scans of a session belong, by what ties them to each other (algorithm.md section 9,
// 'The chain closes').
#ifndef VANTAGE_SERVER_SESSION_CHAINED_POSES_H_
#define VANTAGE_SERVER_SESSION_CHAINED_POSES_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/registration/graph/adjust.h"
#include "core/registration/graph/model_link.h"
#include "core/registration/graph/pose_graph.h"
#include "server/session/algorithms.h"
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

// A scan's pose: with an adjustment, or without one where it is as it was registered.
struct ChainedPose {
  v1::Pose pose;
  v1::PoseAdjustment adjustment;
  bool adjusted = false;
};

struct ChainedPoses {
  std::vector<ChainedPose> poses;     // as ScanChain::scans
  std::vector<std::string> failures;  // adjustments that had no solution, in words
};

// The poses are a function of the chain: of the set of scans as they were registered, and of their
// links, whatever happened in which order, so that a scan that is withdrawn leaves no trace. They
// go through the scans in the order of their creation. Each begins where it was registered, carried
// along with the scan beside which it was. Where its links disagree with that by more than matters
// and more than they may be off (or control says so), all up to it are adjusted together; and where
// that moves any of them by more than matters, all go there. So a job whose loops close to within
// what matters is never moved, and one whose loops do not is moved when they close, and not again
// for every scan that comes after.
ChainedPoses ChainPoses(const ScanChain& chain, const Algorithms& algorithms);

// m: what matters is half of the required accuracy. Errors add by squares: poses that are off by so
// much less cost an eighth of what is allowed. What a link of two scans says is less exact than
// registration to all, and merging all scans anew takes as long as several scans do.
double WhatMatters(const ScanChain& chain);

// The graph of the first `count` scans of a chain at these poses (as many), with what registration
// to the model says of them (registration::WithModelLinks()). Poses need that: a scan that sees
// what six others saw is held better than by any of them alone, and a single link that is wrong
// would move it. Of what ties pairs of scans to each other it says nothing.
absl::StatusOr<registration::PoseGraph> GraphOf(
    const ScanChain& chain, size_t count, const std::vector<Eigen::Isometry3d>& poses,
    const std::vector<registration::ModelRegistration>& registrations);

// Where a scan goes that was registered at `pose` beside another, which stands at `now` by now.
v1::Pose CarriedAlong(const v1::Pose& pose, const v1::PoseReference& reference, const v1::Pose& now,
                      const Eigen::Vector3d& origin);

// T_world_scan as it was registered, accepted or believed, before any adjustment.
const v1::Pose& UnadjustedPose(const v1::Scan& scan);

// How the worst link of a scan fits an adjustment of that graph; nothing where none is checked.
std::optional<v1::LinkTest> WorstLink(const registration::PoseGraph& graph,
                                      const registration::Adjustment& adjustment, size_t node);
// LinkTest.test_ratio of the `link`-th link; 0 where nothing checks it.
double TestRatio(const registration::Adjustment& adjustment, size_t link);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_CHAINED_POSES_H_
