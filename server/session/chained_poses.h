// Where the scans of a session belong, by what ties them to each other (algorithm.md section 9,
// 'The chain closes').
#ifndef VANTAGE_SERVER_SESSION_CHAINED_POSES_H_
#define VANTAGE_SERVER_SESSION_CHAINED_POSES_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/registration/graph/adjust.h"
#include "core/registration/graph/model_link.h"
#include "core/registration/graph/pose_graph.h"
#include "server/session/algorithms.h"
#include "server/session/scan_chain.h"
#include "vantage/v1/geometry.pb.h"
#include "vantage/v1/pose_graph.pb.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

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

// How the scans of a chain, which stand at `poses` (as many), were registered to the model, each
// beside the scan before it that ties it best. Not of scans that nothing ties to one before them,
// and whose poses are no registrations.
std::vector<registration::ModelRegistration> RegistrationsOf(
    const ScanChain& chain, std::span<const Eigen::Isometry3d> poses);

// m: what matters is half of the required accuracy. Errors add by squares: poses that are off by so
// much less cost an eighth of what is allowed. What a link of two scans says is less exact than
// registration to all, and merging all scans anew takes as long as several scans do.
double WhatMatters(const ScanChain& chain);

// Where a scan goes that was registered at `pose` beside another, which stands at `now` by now.
v1::Pose CarriedAlong(const v1::Pose& pose, const v1::PoseReference& reference, const v1::Pose& now,
                      const Eigen::Vector3d& origin);

// How the worst link of a scan fits an adjustment of that graph; nothing where none is checked.
std::optional<v1::LinkTest> WorstLink(const registration::PoseGraph& graph,
                                      const registration::Adjustment& adjustment, size_t node);
// LinkTest.test_ratio of the `link`-th link; 0 where nothing checks it.
double TestRatio(const registration::Adjustment& adjustment, size_t link);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_CHAINED_POSES_H_
