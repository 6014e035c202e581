// All poses of a graph together (algorithm.md section 9, 'Adjustment').
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_ADJUST_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_ADJUST_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/registration/graph/pose_graph.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// How a link fits the adjusted poses.
struct LinkFit {
  double chi2 = 0;       // of its residual, by its own information
  int degrees = 0;       // directions (of six) of which it says anything
  double test = 0;       // chi2 of the residual by its covariance after adjustment: chi-square of
                         // `test_degrees` when the link is right; 0 where nothing checks it
  int test_degrees = 0;  // directions that other links and evidence check
  bool suspect = false;  // `test` beyond 99.9 % of right links
};

// A scan after adjustment.
struct AdjustedScan {
  std::string id;
  Eigen::Isometry3d T_world_scan = Eigen::Isometry3d::Identity();  // canonical (CanonicalPose())
  // Of the error of T_world_scan [rotation about world axes, rad; translation of the scanner, m],
  // with respect to what its component is held by. With the error that all its links between
  // surfaces share, being of one scan's measurements. Zero of a fixed scan, and of the one that
  // holds a component.
  sensor::Matrix6d covariance = sensor::Matrix6d::Zero();
  double position_sigma = 0;         // m, in the worst direction
  double moved = 0;                  // m, from ScanNode::T_world_scan
  double turned = 0;                 // rad
  size_t component = 0;              // PoseGraph::Components()
  bool held = false;                 // fixed, or what its component is held by
  std::optional<size_t> worst_link;  // of graph.links(): the largest test over its 99.9 % quantile
};

struct Adjustment {
  std::vector<AdjustedScan> scans;  // as graph.nodes()
  std::vector<LinkFit> links;       // as graph.links(); those in doubt are not used, but compared
  double chi2 = 0;                  // of all links used and all evidence
  int degrees_of_freedom = 0;       // equations less unknowns
  // chi2 / degrees_of_freedom where that is above 1 by more than chance, else 1. Covariances have
  // it as a factor.
  double variance_factor = 1;
  int iterations = 0;
};

// The pose on a grid far finer than any sigma (2^-20 m and 2^-21 rad): equal poses have equal bits.
// Canonical poses stay as they are.
Eigen::Isometry3d CanonicalPose(const Eigen::Isometry3d& pose);

// Least squares over all links that are not in doubt and all evidence; one thread. The answer
// depends on the set of nodes and links alone, to the bit; the poses of nodes enter only where they
// hold something. What holds a component: its fixed scans; else absolute poses and targets, where
// they suffice (their directions that nothing says anything of are held by 100 m and 1 rad about
// the poses of its first scan); else its first scan in canonical order, which stays at its pose.
// FAILED_PRECONDITION: the normal equations have no solution, or the iteration did not converge;
// the message says of which scan. OUT_OF_RANGE: more than kMostAdjustedScans.
absl::StatusOr<Adjustment> Adjust(const PoseGraph& graph);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_ADJUST_H_
