// How far poses are from what links and evidence say of them, and how that changes with the poses.
#ifndef VANTAGE_CORE_REGISTRATION_GRAPH_RESIDUALS_H_
#define VANTAGE_CORE_REGISTRATION_GRAPH_RESIDUALS_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstddef>
#include <span>
#include <vector>

#include "core/registration/graph/pose_graph.h"
#include "core/sensor/pose_prior.h"

namespace vantage::registration {

// A pose's change is [rotation about world axes; translation], about the scanner (pose_graph.h).
using ResidualJacobian = Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor, 6, 6>;
using ResidualVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 6, 1>;

// What one link, or one piece of evidence, says of one or two poses: least squares of
// W (difference), W^T W being its information.
struct PoseTerm {
  enum class Kind : uint8_t { kLink, kAbsolute, kTarget, kInclinometer };
  Kind kind = Kind::kLink;
  size_t a = 0;                                                // node
  size_t b = 0;                                                // node, of links
  Eigen::Isometry3d measured = Eigen::Isometry3d::Identity();  // of links and absolute poses
  sensor::Matrix6d w = sensor::Matrix6d::Zero();               // of the same
  Eigen::Vector3d in_scan = Eigen::Vector3d::Zero();           // target, m, or direction of up
  Eigen::Vector3d in_world = Eigen::Vector3d::Zero();          // target, m
  double sigma = 1;  // m of a target, rad of an inclinometer

  int size() const { return kind == Kind::kTarget ? 3 : kind == Kind::kInclinometer ? 2 : 6; }
};

// A matrix W with W^T W = information, with a row of zeros for each direction without.
sensor::Matrix6d RootOf(const sensor::Matrix6d& information);

PoseTerm TermOf(const ScanLink& link, size_t a, size_t b);
PoseTerm TermOf(const AbsolutePose& absolute, size_t node);
// All evidence of a node.
void AddEvidence(const ScanNode& node, size_t index, std::vector<PoseTerm>& terms);

struct Residual {
  ResidualVector value;  // in sigmas
  ResidualJacobian by_a;
  ResidualJacobian by_b;  // of links
};
Residual ResidualOf(const PoseTerm& term, std::span<const Eigen::Isometry3d> poses);

// [rotation; translation] by which `to` differs from `from`, in the frame that both lead to.
sensor::Vector6d PoseDifference(const Eigen::Isometry3d& from, const Eigen::Isometry3d& to);

// The pose after a change.
Eigen::Isometry3d ChangedPose(const Eigen::Isometry3d& pose, const sensor::Vector6d& change);

// The matrix of v x.
Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v);

}  // namespace vantage::registration

#endif  // VANTAGE_CORE_REGISTRATION_GRAPH_RESIDUALS_H_
