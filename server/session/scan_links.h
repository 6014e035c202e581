// Finds what ties a scan to those in the model.
#ifndef VANTAGE_SERVER_SESSION_SCAN_LINKS_H_
#define VANTAGE_SERVER_SESSION_SCAN_LINKS_H_

#include <span>
#include <vector>

#include "core/parallel/parallel.h"
#include "core/registration/graph/link.h"
#include "core/registration/graph/settled_doubt.h"
#include "core/sensor/scan.h"
#include "server/session/model_memory.h"
#include "server/session/session_context.h"
#include "vantage/v1/pose_graph.pb.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::session {

// Links are sought to so many scans, the nearest first: more than see a place of a building, where
// walls stand between most; and a job's log and its adjustment grow with its scans, not with their
// square.
inline constexpr size_t kMostLinkedScans = 24;

// The links of a scan that is merged at its pose to the others in the model, by name of the other.
// Empty where the session's algorithms link no scans. Scans whose data cannot be read are left out.
// To be called on the strand.
std::vector<v1::ScanLink> LinksOf(SessionContext& context, ModelMemory& model, const v1::Scan& scan,
                                  const sensor::Scan& data, parallel::Parallel& parallel);

// What scans in the model, the kMostLinkedScans nearest to any of the poses (model frame), say of
// each of them, at which a scan that is not in the model may have been made: for each pose the same
// scans, by name. `came_since`: they are there since a later version of the model than `judged`. As
// above otherwise.
std::vector<std::vector<registration::PairAtPose>> PairsAtPoses(
    SessionContext& context, ModelMemory& model, const v1::Scan& scan, const sensor::Scan& data,
    std::span<const Eigen::Isometry3d> poses, uint64_t judged, parallel::Parallel& parallel);

}  // namespace vantage::session

#endif  // VANTAGE_SERVER_SESSION_SCAN_LINKS_H_
