#include "core/registration/graph/pose_graph.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <span>
#include <tuple>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace vantage::registration {
namespace {

// Of a rotation's columns from orthonormal ones: poses that were written with nine digits pass.
constexpr double kRigid = 1e-6;
// Share of the largest eigenvalue that rounding may leave of one that is zero.
constexpr double kRounding = 1e-9;

std::string PoseFault(const Eigen::Isometry3d& pose) {
  if (!pose.matrix().allFinite()) return "the pose is not finite";
  const Eigen::Matrix3d r = pose.linear();
  if ((r.transpose() * r - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kRigid ||
      r.determinant() < 0) {
    return "the pose is not rigid";
  }
  if (pose.translation().norm() > PoseGraph::kFarthest) {
    return "the pose is more than 1000 km from the origin";
  }
  return "";
}

std::string InformationFault(const sensor::Matrix6d& information) {
  if (!information.allFinite()) return "the information is not finite";
  const double most = information.cwiseAbs().maxCoeff();
  if (most > PoseGraph::kMostInformation) return "the information is larger than of 1 nm";
  if ((information - information.transpose()).cwiseAbs().maxCoeff() > kRounding * most) {
    return "the information is not symmetric";
  }
  // Scaled to a diagonal of ones, so that radians and metres count alike.
  sensor::Vector6d scale = sensor::Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    if (information(i, i) < 0) return "the information is not positive semidefinite";
    if (information(i, i) > 0) scale[i] = 1 / std::sqrt(information(i, i));
    if (information(i, i) == 0 && information.row(i).cwiseAbs().maxCoeff() > 0) {
      return "the information is not positive semidefinite";
    }
  }
  const sensor::Matrix6d unit = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<sensor::Matrix6d> solver(unit, Eigen::EigenvaluesOnly);
  if (solver.eigenvalues()[0] < -kRounding) return "the information is not positive semidefinite";
  return "";
}

std::string NodeFault(const ScanNode& node) {
  if (std::string fault = PoseFault(node.T_world_scan); !fault.empty()) return fault;
  for (const AbsolutePose& absolute : node.absolute) {
    std::string fault = PoseFault(absolute.T_world_scan);
    if (fault.empty()) fault = InformationFault(absolute.information);
    if (!fault.empty()) return absl::StrCat("of an absolute pose, ", fault);
  }
  if (absl::Status status = ValidateTargets(node.targets); !status.ok()) {
    return std::string(status.message());
  }
  for (const TargetTie& target : node.targets) {
    if (target.in_world.norm() > PoseGraph::kFarthest ||
        target.in_scan.norm() > PoseGraph::kFarthest) {
      return absl::StrCat("target '", target.name, "' is more than 1000 km away");
    }
  }
  if (node.inclinometer.has_value()) {
    const InclinometerReading& reading = *node.inclinometer;
    if (!reading.up_in_scan.allFinite() || std::abs(reading.up_in_scan.norm() - 1) > kRigid) {
      return "the inclinometer's direction is not of length 1";
    }
    if (!(reading.sigma > 1e-9) || !std::isfinite(reading.sigma)) {
      return "the inclinometer's sigma is not positive";
    }
  }
  return "";
}

// Numbers in a fixed order, to order what has them by.
std::array<double, 12> PoseNumbers(const Eigen::Isometry3d& pose) {
  std::array<double, 12> numbers{};
  Eigen::Map<Eigen::Matrix<double, 3, 4>>(numbers.data()) = pose.matrix().topRows<3>();
  return numbers;
}
std::array<double, 36> InformationNumbers(const sensor::Matrix6d& information) {
  std::array<double, 36> numbers{};
  Eigen::Map<sensor::Matrix6d>(numbers.data()) = information;
  return numbers;
}

bool LinkBefore(const ScanLink& l, const ScanLink& r) {
  const auto names = [](const ScanLink& link) {
    return std::tie(link.a, link.b, link.origin, link.in_doubt);
  };
  if (names(l) != names(r)) return names(l) < names(r);
  const auto pose_l = PoseNumbers(l.T_a_b);
  const auto pose_r = PoseNumbers(r.T_a_b);
  if (pose_l != pose_r) return pose_l < pose_r;
  return InformationNumbers(l.information) < InformationNumbers(r.information);
}

std::array<double, 7> TargetNumbers(const TargetTie& target) {
  return {target.in_scan.x(),  target.in_scan.y(),  target.in_scan.z(), target.in_world.x(),
          target.in_world.y(), target.in_world.z(), target.sigma};
}

// The order of a node's evidence must not matter either: sums depend on it in their last digits.
void SortEvidence(ScanNode& node) {
  std::sort(node.absolute.begin(), node.absolute.end(), [](const auto& l, const auto& r) {
    const auto pose_l = PoseNumbers(l.T_world_scan);
    const auto pose_r = PoseNumbers(r.T_world_scan);
    if (pose_l != pose_r) return pose_l < pose_r;
    return InformationNumbers(l.information) < InformationNumbers(r.information);
  });
  std::sort(node.targets.begin(), node.targets.end(), [](const auto& l, const auto& r) {
    if (l.name != r.name) return l.name < r.name;
    return TargetNumbers(l) < TargetNumbers(r);
  });
}

}  // namespace

ScanLink Reversed(const ScanLink& link) {
  ScanLink reversed = link;
  std::swap(reversed.a, reversed.b);
  reversed.T_a_b = link.T_a_b.inverse(Eigen::Isometry);
  // A small change [w; t] of (R, p) is one of [-R^T w; -R^T (t - w x p)] of its inverse, whose
  // point is a's scanner. The other way round: w = -R w', t = -R t' - (R w') x p.
  const Eigen::Matrix3d r = link.T_a_b.linear();
  const Eigen::Vector3d p = link.T_a_b.translation();
  Eigen::Matrix3d cross;
  cross << 0, -p.z(), p.y(), p.z(), 0, -p.x(), -p.y(), p.x(), 0;
  sensor::Matrix6d change = sensor::Matrix6d::Zero();
  change.topLeftCorner<3, 3>() = -r;
  change.bottomRightCorner<3, 3>() = -r;
  change.bottomLeftCorner<3, 3>() = cross * r;
  const sensor::Matrix6d moved = change.transpose() * link.information * change;
  reversed.information = 0.5 * (moved + moved.transpose());
  return reversed;
}

absl::StatusOr<PoseGraph> PoseGraph::Create(std::vector<ScanNode> nodes,
                                            std::vector<ScanLink> links) {
  PoseGraph graph;
  std::sort(nodes.begin(), nodes.end(), [](const auto& l, const auto& r) { return l.id < r.id; });
  for (size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].id.empty()) return absl::InvalidArgumentError("a scan has no id");
    if (i > 0 && nodes[i].id == nodes[i - 1].id) {
      return absl::InvalidArgumentError(absl::StrCat("scan '", nodes[i].id, "' is there twice"));
    }
    if (const std::string fault = NodeFault(nodes[i]); !fault.empty()) {
      return absl::InvalidArgumentError(absl::StrCat("scan '", nodes[i].id, "': ", fault));
    }
    SortEvidence(nodes[i]);
  }
  graph.nodes_ = std::move(nodes);
  // Ids first, so that the first fault is named in an order that does not depend on what is wrong.
  std::sort(links.begin(), links.end(), [](const ScanLink& l, const ScanLink& r) {
    return std::minmax(l.a, l.b) < std::minmax(r.a, r.b);
  });
  for (ScanLink& link : links) {
    const std::string name = absl::StrCat("the link between scans '", std::min(link.a, link.b),
                                          "' and '", std::max(link.a, link.b), "'");
    if (link.a == link.b) return absl::InvalidArgumentError(absl::StrCat(name, " is of one scan"));
    for (const std::string& id : {std::min(link.a, link.b), std::max(link.a, link.b)}) {
      const size_t at = graph.IndexOf(id);
      if (at >= graph.nodes_.size() || graph.nodes_[at].id != id) {
        return absl::InvalidArgumentError(absl::StrCat(name, ": there is no scan '", id, "'"));
      }
    }
    std::string fault = PoseFault(link.T_a_b);
    if (fault.empty()) fault = InformationFault(link.information);
    if (!fault.empty()) return absl::InvalidArgumentError(absl::StrCat(name, ": ", fault));
    if (link.b < link.a) link = Reversed(link);
  }
  std::sort(links.begin(), links.end(), LinkBefore);
  graph.links_ = std::move(links);
  graph.FindEnds();
  return graph;
}

void PoseGraph::FindEnds() {
  ends_.clear();
  for (const ScanLink& link : links_) ends_.push_back({IndexOf(link.a), IndexOf(link.b)});
}

size_t PoseGraph::IndexOf(std::string_view id) const {
  const auto at = std::lower_bound(
      nodes_.begin(), nodes_.end(), id,
      [](const ScanNode& node, std::string_view v) { return std::string_view(node.id) < v; });
  return static_cast<size_t>(at - nodes_.begin());
}

std::vector<size_t> PoseGraph::Components() const {
  std::vector<size_t> root(nodes_.size());
  std::iota(root.begin(), root.end(), size_t{0});
  const auto find = [&](size_t i) {
    while (root[i] != i) {
      root[i] = root[root[i]];
      i = root[i];
    }
    return i;
  };
  for (size_t l = 0; l < links_.size(); ++l) {
    if (links_[l].in_doubt || !(links_[l].information.diagonal().maxCoeff() > 0)) continue;
    const size_t a = find(NodeA(l));
    const size_t b = find(NodeB(l));
    root[std::max(a, b)] = std::min(a, b);  // so that a root comes first in its component
  }
  std::vector<size_t> component(nodes_.size());
  size_t count = 0;
  for (size_t i = 0; i < nodes_.size(); ++i) {
    const size_t first = find(i);
    component[i] = first == i ? count++ : component[first];
  }
  return component;
}

PoseGraph PoseGraph::WithLinks(const std::vector<bool>& keep) const {
  PoseGraph graph;
  graph.nodes_ = nodes_;
  for (size_t l = 0; l < links_.size(); ++l) {
    if (!keep[l]) continue;
    graph.links_.push_back(links_[l]);
    graph.links_.back().in_doubt = false;
  }
  std::sort(graph.links_.begin(), graph.links_.end(), LinkBefore);
  graph.FindEnds();
  return graph;
}

}  // namespace vantage::registration
