#include "server/session/scan_chain.h"

#include <Eigen/LU>
#include <algorithm>
#include <map>
#include <utility>

#include "server/contract/error.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

std::optional<registration::InclinometerReading> InclinometerOf(const v1::Scan& scan,
                                                                const Eigen::Vector3d& origin) {
  if (!scan.prior().has_levelled_sigma_rad()) return std::nullopt;
  const Eigen::Isometry3d prior = conversion::ReadOwnPose(scan.prior().pose(), origin);
  registration::InclinometerReading reading;
  reading.up_in_scan = prior.linear().transpose() * Eigen::Vector3d::UnitZ();
  reading.sigma = scan.prior().levelled_sigma_rad();
  return reading;
}

// The scans of a chain as nodes; those that a control network holds, else the first one, are where
// the world is.
std::vector<registration::ScanNode> NodesOf(const ScanChain& chain, size_t count,
                                            const std::vector<Eigen::Isometry3d>& poses) {
  std::vector<registration::ScanNode> nodes;
  std::vector<registration::TargetTie> places;  // each target at its place in the world
  bool believed = false;
  for (size_t i = 0; i < count; ++i) {
    const v1::Scan& scan = chain.scans[i];
    registration::ScanNode node;
    node.id = scan.name();
    node.T_world_scan = poses[i];
    if (auto pose = BelievedPose(scan, chain.origin); pose.has_value()) {
      node.absolute.push_back(*std::move(pose));
      believed = true;
    }
    node.targets = ControlOf(scan, chain.origin);
    node.inclinometer = InclinometerOf(scan, chain.origin);
    for (const registration::TargetTie& target : node.targets) {
      const bool known = std::any_of(places.begin(), places.end(),
                                     [&](const auto& place) { return place.name == target.name; });
      if (known) continue;
      places.push_back(target);
      places.back().in_scan = target.in_world;
    }
    nodes.push_back(std::move(node));
  }
  const bool control = believed || registration::PoseFromTargets(places).has_value();
  for (size_t i = 0; i < count; ++i) {
    const v1::Scan& scan = chain.scans[i];
    if (scan.pose_source() != v1::POSE_SOURCE_FIRST_SCAN) continue;
    // Without a prior and without targets the world is where it says, which control then refers to.
    const bool says_where = !scan.has_prior() && nodes[i].targets.empty();
    nodes[i].fixed = says_where || !control;
  }
  // What ties scans of earlier releases to each other is not known: they stay.
  bool held = control;
  for (size_t i = 0; i < count; ++i) {
    nodes[i].fixed = nodes[i].fixed || !chain.scans[i].merge().has_link_count();
    held = held || nodes[i].fixed;
  }
  if (!held) nodes.front().fixed = true;
  return nodes;
}

}  // namespace

const v1::Pose& UnadjustedPose(const v1::Scan& scan) {
  return scan.has_adjustment() ? scan.adjustment().unadjusted_pose() : scan.pose();
}

bool IsChained(const v1::Scan& scan) {
  return scan.has_pose() &&
         (scan.pose_source() != v1::POSE_SOURCE_SET || scan.prior().covariance_size() == 36);
}

ScanChain ReadChain(const SessionState& state, const Eigen::Vector3d& origin) {
  ScanChain chain;
  chain.origin = origin;
  const v1::RegistrationConfig& config = state.session.planning_config().registration();
  if (config.has_required_accuracy_m()) chain.required_accuracy = config.required_accuracy_m();
  std::map<std::string, bool> chained;
  for (const std::string& name : state.scan_order) {
    const ScanRecord& record = state.scans.at(name);
    // One whose preview is in the model until the whole scan is merged at the same pose.
    const bool swaps =
        record.scan.state() == v1::SCAN_STATE_MERGING && !record.preview_blob.empty();
    if (!record.in_model || (record.scan.state() != v1::SCAN_STATE_MERGED && !swaps)) continue;
    if (!IsChained(record.scan)) continue;
    chain.scans.push_back(record.scan);
    chained[name] = true;
  }
  for (const auto& [ends, link] : state.links) {
    if (chained.contains(ends.first) && chained.contains(ends.second)) chain.links.push_back(link);
  }
  return chain;
}

registration::ScanLink ReadLink(const v1::ScanLink& link) {
  registration::ScanLink out;
  out.a = link.first_scan();
  out.b = link.second_scan();
  // Between scans: in no frame that has an origin.
  out.T_a_b = conversion::ReadOwnPose(link.pose(), Eigen::Vector3d::Zero());
  for (int i = 0; i < std::min(36, link.information_size()); ++i) {
    out.information(i / 6, i % 6) = link.information(i);
  }
  out.in_doubt = link.in_doubt();
  return out;
}

std::optional<registration::AbsolutePose> BelievedPose(const v1::Scan& scan,
                                                       const Eigen::Vector3d& origin) {
  const bool believed =
      scan.pose_source() == v1::POSE_SOURCE_SET ||
      (scan.prior().trusted() && (scan.pose_source() == v1::POSE_SOURCE_FIRST_SCAN ||
                                  scan.pose_source() == v1::POSE_SOURCE_TRUSTED_PRIOR));
  if (!believed || scan.prior().covariance_size() != 36) return std::nullopt;
  contract::Violations violations;
  const sensor::PosePrior prior =
      conversion::ReadPosePrior(scan.prior(), origin, "prior", violations);
  if (!violations.ToStatus().ok() || !prior.covariance.has_value()) return std::nullopt;
  registration::AbsolutePose pose;
  pose.T_world_scan = prior.T_world_scan;
  const sensor::Matrix6d information = prior.covariance->inverse();
  pose.information = 0.5 * (information + information.transpose());
  return pose;
}

std::vector<registration::TargetTie> ControlOf(const v1::Scan& scan,
                                               const Eigen::Vector3d& origin) {
  std::vector<registration::TargetTie> ties;
  for (const v1::TargetSighting& target : scan.targets()) {
    if (!target.has_in_world()) continue;
    registration::TargetTie tie;
    tie.name = target.name();
    tie.in_scan = conversion::ReadOwnVector(target.in_scan());
    tie.in_world = conversion::ReadOwnVector(target.in_world()) - origin;
    if (target.has_sigma_m()) tie.sigma = target.sigma_m();
    ties.push_back(std::move(tie));
  }
  return ties;
}

absl::StatusOr<registration::PoseGraph> GraphOf(
    const ScanChain& chain, size_t count, const std::vector<Eigen::Isometry3d>& poses,
    const std::vector<registration::ModelRegistration>& registrations) {
  std::vector<registration::ScanNode> nodes = NodesOf(chain, count, poses);
  std::map<std::string, bool> known;
  for (const registration::ScanNode& node : nodes) known[node.id] = true;
  std::vector<registration::ScanLink> links;
  for (const v1::ScanLink& link : chain.links) {
    if (known.contains(link.first_scan()) && known.contains(link.second_scan())) {
      links.push_back(ReadLink(link));
    }
  }
  absl::StatusOr<registration::PoseGraph> graph =
      registration::PoseGraph::Create(std::move(nodes), std::move(links));
  if (!graph.ok() || registrations.empty()) return graph;
  return registration::WithModelLinks(*graph, registrations);
}

}  // namespace vantage::session
