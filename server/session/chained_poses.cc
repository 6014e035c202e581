#include "server/session/chained_poses.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/registration/align/largest_variance.h"
#include "core/registration/align/pose_step.h"
#include "core/registration/align/targets.h"
#include "core/registration/bound/chi_square.h"
#include "core/registration/graph/consistency.h"
#include "core/registration/graph/model_link.h"
#include "server/conversion/from_proto.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

// Of the required accuracy; WhatMatters() says why.
constexpr double kShareThatMatters = 0.5;
// Of the sigma of a pose: what moves by less was as good before, an error of a third of a sigma
// beside it makes a twentieth more.
constexpr double kShareOfSigma = 1.0 / 3;
// By so many of its sigmas a link has to disagree before it says that poses are off. A job has some
// hundred links of six directions, and links are believed a fifth too much: of those that are right
// one in 1,000 is off by more.
constexpr double kSigmasOff = 4;
// Of what a scan has to move by: those that would move by less when others are moved stay, so that
// a scan at one end of a job does not have all of it merged anew.
constexpr double kShareThatStays = 0.2;
// m: a turn counts as what it moves at the scanner at the other end, or, where that stands closer,
// at this distance, at which the walls of rooms stand.
constexpr double kLeastLever = 2;

using sensor::Matrix6d;
using sensor::Vector6d;

bool SameBytes(const v1::Pose& a, const v1::Pose& b) {
  return a.SerializeAsString() == b.SerializeAsString();
}

Eigen::Vector3d TurnOf(const Eigen::Matrix3d& rotation) {
  const Eigen::AngleAxisd turn(rotation);
  return turn.angle() * turn.axis();
}

// Whether a pose is off by more than `matters` (m) and more than what says so may be: `off` is
// [rotation; translation], `information` that of it, `lever` (m) what a turn counts at.
bool IsOff(const Vector6d& off, const Matrix6d& information, double lever, double matters) {
  Vector6d scale;
  scale << lever, lever, lever, 1, 1, 1;
  const Matrix6d scaled =
      scale.cwiseInverse().asDiagonal() * information * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> solver(0.5 * (scaled + scaled.transpose()));
  for (int k = 0; k < 6; ++k) {
    const double value = solver.eigenvalues()[k];
    if (!(value > 0)) continue;
    const double along = std::abs(solver.eigenvectors().col(k).dot(scale.cwiseProduct(off)));
    if (along > std::max(matters, kSigmasOff / std::sqrt(value))) return true;
  }
  return false;
}

Vector6d Difference(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to) {
  Vector6d difference;
  difference << TurnOf(to.linear() * from.linear().transpose()),
      to.translation() - from.translation();
  return difference;
}

// A link by the places of its scans in the chain.
struct LinkBetween {
  size_t first;
  size_t second;
  registration::ScanLink link;
};

// How a scan was registered to the model, beside the one that ties it best of those before it,
// which are at `poses`, its own the last; nothing where its pose is not of a registration, or where
// it is tied to none.
std::optional<registration::ModelRegistration> RegistrationOf(
    const v1::Scan& scan, const std::vector<LinkBetween>& links,
    std::span<const Eigen::Isometry3d> poses, const ScanChain& chain) {
  const v1::Registration& made = scan.registration();
  if (scan.pose_source() != v1::POSE_SOURCE_REGISTRATION || made.covariance_size() != 36) {
    return std::nullopt;
  }
  const size_t own = poses.size() - 1;
  std::optional<size_t> beside;
  double most = 0;
  for (const LinkBetween& between : links) {
    const double known = between.link.information.bottomRightCorner<3, 3>().trace();
    if (between.link.in_doubt || known <= most) continue;
    most = known;
    beside = between.first == own ? between.second : between.first;
  }
  if (!beside.has_value()) return std::nullopt;
  Matrix6d covariance;
  for (int i = 0; i < 36; ++i) covariance(i / 6, i % 6) = made.covariance(i);
  // Its covariance is about the overlap's centroid, and of where it was registered then.
  const Eigen::Isometry3d then = conversion::ReadOwnPose(UnadjustedPose(scan), chain.origin);
  const Eigen::Vector3d centroid = conversion::ReadOwnVector(made.centroid()) - chain.origin;
  const Eigen::Matrix3d to_beside =
      poses[*beside].linear().transpose() * poses[own].linear() * then.linear().transpose();
  Matrix6d turned = Matrix6d::Zero();
  turned.topLeftCorner<3, 3>() = to_beside;
  turned.bottomRightCorner<3, 3>() = to_beside;
  const Matrix6d move = turned * registration::AboutOther(then.translation() - centroid);
  registration::ModelRegistration out;
  out.scan = scan.name();
  out.beside = chain.scans[*beside].name();
  out.T_beside_scan = poses[*beside].inverse() * poses[own];
  const Matrix6d moved = move * covariance * move.transpose();
  out.covariance = 0.5 * (moved + moved.transpose());
  return out;
}

// The links of each scan to those before it.
std::vector<std::vector<LinkBetween>> LinksBefore(const ScanChain& chain,
                                                  const std::map<std::string, size_t>& place) {
  std::vector<std::vector<LinkBetween>> links(chain.scans.size());
  for (const v1::ScanLink& link : chain.links) {
    const size_t first = place.at(link.first_scan());
    const size_t second = place.at(link.second_scan());
    links[std::max(first, second)].push_back({first, second, ReadLink(link)});
  }
  return links;
}

std::map<std::string, size_t> PlacesOf(const ScanChain& chain) {
  std::map<std::string, size_t> place;
  for (size_t k = 0; k < chain.scans.size(); ++k) place[chain.scans[k].name()] = k;
  return place;
}

// Whether what is known of a scan beside those before it says that poses are off: its links to
// those, and control.
bool SaysOff(const v1::Scan& scan, const std::vector<LinkBetween>& links,
             const std::vector<Eigen::Isometry3d>& poses, const ScanChain& chain) {
  const double matters = WhatMatters(chain);
  for (const LinkBetween& between : links) {
    const Eigen::Isometry3d now = poses[between.first].inverse() * poses[between.second];
    const double lever = std::max(kLeastLever, now.translation().norm());
    if (IsOff(Difference(between.link.T_a_b, now), between.link.information, lever, matters)) {
      return true;
    }
  }
  const Eigen::Isometry3d& own = poses.back();
  const auto absolute = BelievedPose(scan, chain.origin);
  if (absolute.has_value() &&
      IsOff(Difference(absolute->T_world_scan, own), absolute->information, kLeastLever, matters)) {
    return true;
  }
  const std::vector<registration::TargetTie> control = ControlOf(scan, chain.origin);
  return std::any_of(control.begin(), control.end(), [&](const registration::TargetTie& target) {
    const double off = (own * target.in_scan - target.in_world).norm();
    return off > std::max(matters, kSigmasOff * target.sigma);
  });
}

// Links between the same pieces, without those that contradict the rest most.
struct SoundAdjustment {
  registration::PoseGraph graph;
  registration::Adjustment adjustment;
};

size_t PiecesOf(const registration::PoseGraph& graph) {
  const std::vector<size_t> pieces = graph.Components();
  return pieces.empty() ? 0 : *std::max_element(pieces.begin(), pieces.end()) + 1;
}

// Adjusts all. Links in doubt count where consistency decides so. A link that the others contradict
// moves nobody: the one that is off most is left out, and so on, as long as what is left hangs
// together as before.
absl::StatusOr<SoundAdjustment> AdjustSoundly(registration::PoseGraph graph,
                                              const Algorithms& algorithms) {
  constexpr size_t kShareLeftOut = 10;  // one of so many: where more are wrong, which is not plain
  const bool doubts = std::any_of(graph.links().begin(), graph.links().end(),
                                  [](const registration::ScanLink& link) { return link.in_doubt; });
  if (doubts) {
    const absl::StatusOr<registration::LinkDecisions> decided = registration::DecideLinks(graph);
    if (!decided.ok()) return decided.status();
    graph = graph.WithLinks(decided->keep);
  }
  const size_t most = std::max<size_t>(1, graph.links().size() / kShareLeftOut);
  const size_t pieces = PiecesOf(graph);
  absl::StatusOr<registration::Adjustment> adjustment = algorithms.adjust_poses(graph);
  for (size_t left_out = 0; adjustment.ok() && left_out < most; ++left_out) {
    std::optional<size_t> worst;
    for (size_t l = 0; l < graph.links().size(); ++l) {
      // Registration to the model has passed its verdict, and rests on more than any pair.
      const bool of_model = graph.links()[l].origin == registration::LinkOrigin::kModel;
      if (of_model || !adjustment->links[l].suspect) continue;
      if (!worst || TestRatio(*adjustment, l) > TestRatio(*adjustment, *worst)) worst = l;
    }
    if (!worst.has_value()) break;
    std::vector<bool> keep(graph.links().size(), true);
    keep[*worst] = false;
    registration::PoseGraph without = graph.WithLinks(keep);
    if (PiecesOf(without) != pieces) break;
    graph = std::move(without);
    adjustment = algorithms.adjust_poses(graph);
  }
  if (!adjustment.ok()) return adjustment.status();
  return SoundAdjustment{std::move(graph), *std::move(adjustment)};
}

// How far an adjustment moves a scan, as a share of what it has to move by to be moved at all: what
// matters, or what its pose is not known to anyway.
double ShareMoved(const SoundAdjustment& made, size_t node, double matters) {
  double lever = kLeastLever;
  for (size_t l = 0; l < made.graph.links().size(); ++l) {
    if (made.graph.NodeA(l) != node && made.graph.NodeB(l) != node) continue;
    lever = std::max(lever, made.graph.links()[l].T_a_b.translation().norm());
  }
  const registration::AdjustedScan& scan = made.adjustment.scans[node];
  const double sigma = std::sqrt(
      registration::LargestVariance(scan.covariance.bottomRightCorner<3, 3>()) +
      lever * lever * registration::LargestVariance(scan.covariance.topLeftCorner<3, 3>()));
  return std::hypot(scan.moved, lever * scan.turned) / std::max(matters, kShareOfSigma * sigma);
}

v1::PoseAdjustment WriteAdjustment(const v1::Scan& scan, const SoundAdjustment& made, size_t node) {
  v1::PoseAdjustment out;
  *out.mutable_unadjusted_pose() = UnadjustedPose(scan);
  const registration::AdjustedScan& adjusted = made.adjustment.scans[node];
  for (int i = 0; i < 36; ++i) out.add_covariance(adjusted.covariance(i / 6, i % 6));
  out.set_position_sigma_m(adjusted.position_sigma);
  if (auto worst = WorstLink(made.graph, made.adjustment, node); worst.has_value()) {
    *out.mutable_worst_link() = *std::move(worst);
  }
  return out;
}

}  // namespace

double WhatMatters(const ScanChain& chain) { return kShareThatMatters * chain.required_accuracy; }

v1::Pose CarriedAlong(const v1::Pose& pose, const v1::PoseReference& reference, const v1::Pose& now,
                      const Eigen::Vector3d& origin) {
  if (SameBytes(reference.pose(), now)) return pose;
  const Eigen::Isometry3d then = conversion::ReadOwnPose(reference.pose(), origin);
  return conversion::WritePose(
      registration::CanonicalPose(conversion::ReadOwnPose(now, origin) * then.inverse() *
                                  conversion::ReadOwnPose(pose, origin)),
      origin);
}

double TestRatio(const registration::Adjustment& adjustment, size_t link) {
  const registration::LinkFit& fit = adjustment.links[link];
  if (fit.test_degrees == 0) return 0;
  return fit.test / (registration::ChiSquareQuantile(fit.test_degrees, registration::kNormal999) *
                     adjustment.variance_factor);
}

std::optional<v1::LinkTest> WorstLink(const registration::PoseGraph& graph,
                                      const registration::Adjustment& adjustment, size_t node) {
  const std::optional<size_t> worst = adjustment.scans[node].worst_link;
  if (!worst.has_value()) return std::nullopt;
  v1::LinkTest test;
  const size_t other = graph.NodeA(*worst) == node ? graph.NodeB(*worst) : graph.NodeA(*worst);
  test.set_scan(graph.nodes()[other].id);
  test.set_test_ratio(TestRatio(adjustment, *worst));
  return test;
}

std::vector<registration::ModelRegistration> RegistrationsOf(
    const ScanChain& chain, std::span<const Eigen::Isometry3d> poses) {
  const std::vector<std::vector<LinkBetween>> links = LinksBefore(chain, PlacesOf(chain));
  std::vector<registration::ModelRegistration> registrations;
  for (size_t k = 0; k < chain.scans.size(); ++k) {
    if (auto made = RegistrationOf(chain.scans[k], links[k], poses.first(k + 1), chain);
        made.has_value()) {
      registrations.push_back(*std::move(made));
    }
  }
  return registrations;
}

ChainedPoses ChainPoses(const ScanChain& chain, const Algorithms& algorithms) {
  const double matters = WhatMatters(chain);
  ChainedPoses out;
  const std::map<std::string, size_t> place = PlacesOf(chain);
  const std::vector<std::vector<LinkBetween>> links = LinksBefore(chain, place);
  std::vector<Eigen::Isometry3d> at;  // out.poses
  std::vector<registration::ModelRegistration> registrations;
  for (size_t k = 0; k < chain.scans.size(); ++k) {
    const v1::Scan& scan = chain.scans[k];
    ChainedPose& begins = out.poses.emplace_back();
    begins.pose = UnadjustedPose(scan);
    if (scan.has_pose_reference()) {
      const auto beside = place.find(scan.pose_reference().scan());
      if (beside != place.end() && beside->second < k) {
        begins.pose = CarriedAlong(begins.pose, scan.pose_reference(),
                                   out.poses[beside->second].pose, chain.origin);
      }
    }
    begins.adjusted = !SameBytes(begins.pose, UnadjustedPose(scan));
    if (begins.adjusted) {
      *begins.adjustment.mutable_unadjusted_pose() = UnadjustedPose(scan);
    }
    at.push_back(conversion::ReadOwnPose(begins.pose, chain.origin));
    if (!algorithms.adjust_poses) continue;
    if (auto made = RegistrationOf(scan, links[k], at, chain); made.has_value()) {
      registrations.push_back(*std::move(made));
    }
    if (!SaysOff(scan, links[k], at, chain)) continue;
    absl::StatusOr<registration::PoseGraph> graph = GraphOf(chain, k + 1, at, registrations);
    if (!graph.ok()) {
      out.failures.push_back(std::string(graph.status().message()));
      continue;
    }
    std::vector<size_t> node_of(k + 1);
    for (size_t i = 0; i <= k; ++i) node_of[i] = graph->IndexOf(chain.scans[i].name());
    absl::StatusOr<SoundAdjustment> made = AdjustSoundly(*std::move(graph), algorithms);
    if (!made.ok()) {
      out.failures.push_back(std::string(made.status().message()));
      continue;
    }
    // Other pieces of the chain are not concerned.
    const std::vector<registration::AdjustedScan>& scans = made->adjustment.scans;
    const size_t piece = scans[node_of[k]].component;
    const bool far = std::any_of(node_of.begin(), node_of.end(), [&](size_t node) {
      return scans[node].component == piece && ShareMoved(*made, node, matters) > 1;
    });
    if (!far) continue;
    for (size_t i = 0; i <= k; ++i) {
      const registration::AdjustedScan& adjusted = scans[node_of[i]];
      if (adjusted.component != piece) continue;
      ChainedPose& pose = out.poses[i];
      if (ShareMoved(*made, node_of[i], matters) > kShareThatStays) {
        pose.pose = conversion::WritePose(adjusted.T_world_scan, chain.origin);
        at[i] = conversion::ReadOwnPose(pose.pose, chain.origin);
      }
      pose.adjusted = !SameBytes(pose.pose, UnadjustedPose(chain.scans[i]));
      pose.adjustment = v1::PoseAdjustment();
      if (pose.adjusted || !adjusted.held) {
        pose.adjustment = WriteAdjustment(chain.scans[i], *made, node_of[i]);
        pose.adjusted = true;
      }
    }
  }
  return out;
}

}  // namespace vantage::session
