#include "server/session/scan_links.h"

#include <algorithm>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"
#include "server/session/chained_poses.h"
#include "server/session/stored_scans.h"

namespace vantage::session {
namespace {

struct OtherScan {
  v1::Scan scan;
  Eigen::Isometry3d T_model_scan = Eigen::Isometry3d::Identity();
  double distance = 0;   // m, between the scanners; the least of all poses
  uint64_t entered = 0;  // the version of the model that was the first with it in
  LinkSurfaces::Surface surface;
};

// The scans in the model that may be linked and are nearest to one of the poses of another.
std::vector<OtherScan> NearestOf(const SessionContext& context, const v1::Scan& scan,
                                 std::span<const Eigen::Isometry3d> poses) {
  std::vector<OtherScan> others;
  context.journal().Read([&](const SessionState& state) {
    for (const std::string& name : state.scan_order) {
      const ScanRecord& record = state.scans.at(name);
      if (!record.in_model || name == scan.name() || !IsChained(record.scan)) continue;
      if (record.scan.state() != v1::SCAN_STATE_MERGED) continue;
      OtherScan other;
      other.scan = record.scan;
      other.T_model_scan = conversion::ReadOwnPose(record.scan.pose(), context.origin());
      other.entered = record.entered;
      other.distance = std::numeric_limits<double>::infinity();
      for (const Eigen::Isometry3d& pose : poses) {
        other.distance = std::min(other.distance,
                                  (other.T_model_scan.translation() - pose.translation()).norm());
      }
      others.push_back(std::move(other));
    }
  });
  std::stable_sort(others.begin(), others.end(),
                   [](const OtherScan& a, const OtherScan& b) { return a.distance < b.distance; });
  if (others.size() > kMostLinkedScans) others.resize(kMostLinkedScans);
  std::sort(others.begin(), others.end(),
            [](const OtherScan& a, const OtherScan& b) { return a.scan.name() < b.scan.name(); });
  return others;
}

v1::ScanLink WriteLink(const registration::LinkOutcome& outcome) {
  v1::ScanLink out;
  const registration::ScanLink& link = *outcome.link;
  out.set_first_scan(link.a);
  out.set_second_scan(link.b);
  *out.mutable_pose() = conversion::WritePose(link.T_a_b, Eigen::Vector3d::Zero());
  for (int i = 0; i < 36; ++i) out.add_information(link.information(i / 6, i % 6));
  out.set_correspondence_count(static_cast<int64_t>(outcome.correspondences));
  out.set_overlap_share(outcome.overlap_share);
  out.set_rms_residual_m(outcome.rms_residual);
  out.set_expected_residual_m(outcome.expected_residual);
  out.set_constrained_direction_count(outcome.constrained_directions);
  out.set_in_doubt(link.in_doubt);
  return out;
}

// A scan and those around it, enough to seek links at any of its poses.
struct Neighbourhood {
  registration::RegistrationConfig config;
  LinkSurfaces::Surface own;
  std::vector<OtherScan> others;  // by name
};

Neighbourhood AroundPoses(SessionContext& context, ModelMemory& model, const v1::Scan& scan,
                          const sensor::Scan& data, std::span<const Eigen::Isometry3d> poses,
                          parallel::Parallel& parallel) {
  const SessionDependencies& dependencies = context.dependencies();
  Neighbourhood around;
  v1::PlanningConfig written;
  context.journal().Read(
      [&](const SessionState& state) { written = state.session.planning_config(); });
  contract::Violations violations;
  around.config =
      conversion::ReadPlanningConfig(written, {}, context.origin(), model.config().voxel_size,
                                     "planning_config", "", violations)
          .registration;
  LinkSurfaces& surfaces = model.link_surfaces();
  const auto make = [&](const std::string& sha256, const sensor::Scan& samples) {
    auto surface = std::make_shared<const registration::LinkSurface>(
        registration::MakeLinkSurface(samples, around.config, parallel));
    surfaces.Keep(sha256, surface, dependencies.memory, context.tenant());
    return surface;
  };
  around.others = NearestOf(context, scan, poses);
  around.own = make(scan.sha256(), data);
  for (OtherScan& other : around.others) {
    other.surface = surfaces.Find(other.scan.sha256());
    if (other.surface != nullptr) continue;
    const absl::StatusOr<sensor::Scan> samples = LoadScan(context, other.scan);
    if (samples.ok()) other.surface = make(other.scan.sha256(), *samples);
  }
  return around;
}

// Of the `i`-th of those around it.
registration::LinkOutcome LinkAt(const SessionContext& context, const Neighbourhood& around,
                                 const v1::Scan& scan, const Eigen::Isometry3d& T_model_scan,
                                 size_t i) {
  const OtherScan& other = around.others[i];
  if (other.surface == nullptr) return {};
  const std::string& name = other.scan.name();
  const registration::PlacedSurface a{scan.name(), *around.own, T_model_scan};
  const registration::PlacedSurface b{name, *other.surface, other.T_model_scan};
  if (!registration::MayOverlap(a, b)) return {};
  return context.dependencies().algorithms.link_scans(a, b, around.config, {});
}

}  // namespace

std::vector<v1::ScanLink> LinksOf(SessionContext& context, ModelMemory& model, const v1::Scan& scan,
                                  const sensor::Scan& data, parallel::Parallel& parallel) {
  if (!context.dependencies().algorithms.link_scans || !IsChained(scan)) return {};
  const Eigen::Isometry3d T_model_scan = conversion::ReadOwnPose(scan.pose(), context.origin());
  const Neighbourhood around =
      AroundPoses(context, model, scan, data, std::span(&T_model_scan, 1), parallel);
  std::vector<registration::LinkOutcome> outcomes(around.others.size());
  parallel.For(outcomes.size(),
               [&](size_t i) { outcomes[i] = LinkAt(context, around, scan, T_model_scan, i); });
  std::vector<v1::ScanLink> links;
  for (const registration::LinkOutcome& outcome : outcomes) {
    if (outcome.link.has_value()) links.push_back(WriteLink(outcome));
  }
  return links;
}

std::vector<std::vector<registration::PairAtPose>> PairsAtPoses(
    SessionContext& context, ModelMemory& model, const v1::Scan& scan, const sensor::Scan& data,
    std::span<const Eigen::Isometry3d> poses, uint64_t judged, parallel::Parallel& parallel) {
  std::vector<std::vector<registration::PairAtPose>> pairs(poses.size());
  if (!context.dependencies().algorithms.link_scans) return pairs;
  const Neighbourhood around = AroundPoses(context, model, scan, data, poses, parallel);
  const size_t others = around.others.size();
  for (std::vector<registration::PairAtPose>& at_pose : pairs) {
    at_pose.resize(others);
    for (size_t i = 0; i < others; ++i) {
      at_pose[i].scan = around.others[i].scan.name();
      at_pose[i].came_since = around.others[i].entered > judged;
    }
  }
  parallel.For(poses.size() * others, [&](size_t k) {
    const size_t pose = k / others;
    pairs[pose][k % others].outcome = LinkAt(context, around, scan, poses[pose], k % others);
  });
  // It may never come into the model, and what is kept is for those that are.
  model.link_surfaces().Drop(scan.sha256());
  return pairs;
}

}  // namespace vantage::session
