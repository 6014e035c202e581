#include "core/registration/graph/adjust.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "core/registration/align/largest_variance.h"
#include "core/registration/bound/chi_square.h"
#include "core/registration/graph/graph_normals.h"
#include "core/registration/graph/residuals.h"
#include "core/registration/graph/solved_graph.h"

namespace vantage::registration {
namespace {

// Of a residual's own variance, that other links have to leave unexplained for them to check it.
constexpr double kLeastRedundancy = 0.01;
// Of a scan's information in any direction, what is the least.
constexpr double kLeastKnown = 1e-9;
// Steps of the grid of canonical poses in a metre, and in a unit of a quaternion's ratio: about
// 1 um, and half a microradian, 5 um at ten metres. Both are powers of two, so that numbers on the
// grid are exact.
constexpr double kGridOfMetre = 1048576;  // 2^20
constexpr double kGridOfRatio = 4194304;  // 2^22
// Numbers of a quaternion that differ by less are as large as each other.
constexpr double kEqual = 1e-9;

// The covariance of a term's residual that the adjusted poses have, in sigmas squared.
Eigen::MatrixXd CovarianceOf(const Residual& residual, const sensor::Matrix6d& aa,
                             const sensor::Matrix6d& ab, const sensor::Matrix6d& bb) {
  const Eigen::MatrixXd cross = residual.by_a * ab * residual.by_b.transpose();
  return residual.by_a * aa * residual.by_a.transpose() +
         residual.by_b * bb * residual.by_b.transpose() + cross + cross.transpose();
}

// Fills in the test of a link that was used: its residual against what is left of its variance.
void TestUsed(const ResidualVector& value, const Eigen::MatrixXd& explained, LinkFit& fit,
              const PoseTerm& term) {
  sensor::Matrix6d left = -explained;
  for (int k = 0; k < 6; ++k) {
    if (term.w.row(k).squaredNorm() > 0) left(k, k) += 1;
  }
  const Eigen::SelfAdjointEigenSolver<sensor::Matrix6d> solver(0.5 * (left + left.transpose()));
  for (int k = 0; k < 6; ++k) {
    const double variance = solver.eigenvalues()[k];
    if (variance < kLeastRedundancy) continue;
    const double along = solver.eigenvectors().col(k).dot(value);
    fit.test += along * along / variance;
    ++fit.test_degrees;
  }
}

void TestUnused(const ResidualVector& value, const Eigen::MatrixXd& predicted, LinkFit& fit) {
  const sensor::Matrix6d covariance = sensor::Matrix6d::Identity() + predicted;
  fit.test = value.dot(covariance.ldlt().solve(value));
  fit.test_degrees = fit.degrees;
}

// The error that all links of a scan between surfaces share, since its own measurements are in each
// of them: half of the covariance of its best link, with the registration to the model that goes
// along with it, which rests on most of what the others rest on. About world axes.
sensor::Matrix6d OwnError(const PoseGraph& graph, const SolvedGraph& solved, size_t node) {
  std::map<size_t, sensor::Matrix6d> by_other;
  std::set<size_t> seen;  // scans that a link between surfaces ties it to
  for (size_t k = 0; k < solved.datum.links.size(); ++k) {
    const PoseTerm& link = solved.datum.links[k];
    const LinkOrigin origin = graph.links()[solved.datum.link_of[k]].origin;
    if ((link.a != node && link.b != node) ||
        (origin != LinkOrigin::kSurfaces && origin != LinkOrigin::kModel)) {
      continue;
    }
    const size_t other = link.a == node ? link.b : link.a;
    if (origin == LinkOrigin::kSurfaces) seen.insert(other);
    const Residual residual = ResidualOf(link, solved.poses);
    const ResidualJacobian& by = link.a == node ? residual.by_a : residual.by_b;
    const auto it = by_other.try_emplace(other, sensor::Matrix6d::Zero()).first;
    it->second += by.transpose() * by;
  }
  sensor::Matrix6d best = sensor::Matrix6d::Zero();
  double most = -std::numeric_limits<double>::infinity();
  for (const auto& [other, information] : by_other) {
    if (!seen.contains(other)) continue;
    // Vague where the link says nothing: what the adjustment says of that is larger.
    sensor::Vector6d scale = information.diagonal().cwiseSqrt();
    for (int i = 0; i < 6; ++i) scale[i] = scale[i] > 0 ? 1 / scale[i] : 1;
    sensor::Matrix6d unit = scale.asDiagonal() * information * scale.asDiagonal();
    unit.diagonal().array() += kLeastKnown;
    const Eigen::LDLT<sensor::Matrix6d> factor(unit);
    // The logarithm of its determinant: how small a volume of poses it leaves.
    const double known = factor.vectorD().array().max(kLeastKnown * kLeastKnown).log().sum() -
                         2 * scale.array().log().sum();
    if (!(known > most)) continue;
    most = known;
    const sensor::Matrix6d inverse = factor.solve(sensor::Matrix6d::Identity());
    best = scale.asDiagonal() * inverse * scale.asDiagonal();
  }
  return 0.25 * (best + best.transpose());
}

// Adds the scans' own errors to covariances that take links to be independent: that of each scan,
// and that of the one scan that holds its component, if it is only one.
void AddOwnErrors(const PoseGraph& graph, const SolvedGraph& solved,
                  std::vector<sensor::Matrix6d>& own) {
  const std::vector<size_t> component = graph.Components();
  std::vector<size_t> held_by(own.size(), 0);
  std::vector<size_t> holders(own.size(), 0);  // by component
  for (size_t i = 0; i < own.size(); ++i) {
    if (!solved.datum.held[i]) continue;
    ++holders[component[i]];
    held_by[component[i]] = i;
  }
  std::vector<sensor::Matrix6d> errors(own.size());
  for (size_t i = 0; i < own.size(); ++i) errors[i] = OwnError(graph, solved, i);
  for (size_t i = 0; i < own.size(); ++i) {
    if (solved.datum.held[i]) continue;
    own[i] += errors[i];
    if (holders[component[i]] != 1) continue;
    // A turn of what holds the rest moves it all.
    const size_t holder = held_by[component[i]];
    sensor::Matrix6d carried = sensor::Matrix6d::Identity();
    carried.bottomLeftCorner<3, 3>() =
        -CrossMatrix(solved.poses[i].translation() - solved.poses[holder].translation());
    own[i] += carried * errors[holder] * carried.transpose();
  }
}

// Covariances of scans and the tests of links, at the adjusted poses.
void Judge(const PoseGraph& graph, const SolvedGraph& solved, Adjustment& adjustment) {
  const size_t nodes = graph.nodes().size();
  const size_t links = graph.links().size();
  auto [own, between] = CovariancesOf(graph, solved.Normals());
  std::vector<bool> used(links, false);
  for (const size_t l : solved.datum.link_of) used[l] = true;
  for (size_t l = 0; l < links; ++l) {
    LinkFit& fit = adjustment.links[l];
    const size_t a = graph.NodeA(l);
    const size_t b = graph.NodeB(l);
    const PoseTerm term = TermOf(graph.links()[l], a, b);
    const Residual residual = ResidualOf(term, solved.poses);
    fit.chi2 = residual.value.squaredNorm();
    fit.degrees = RankOf(term);
    const Eigen::MatrixXd covariance = CovarianceOf(residual, own[a], between[l], own[b]);
    if (used[l]) {
      TestUsed(residual.value, covariance, fit, term);
    } else if (adjustment.scans[a].component == adjustment.scans[b].component) {
      TestUnused(residual.value, covariance, fit);
    }
  }
  std::vector<double> worst(nodes, 0);
  for (size_t l = 0; l < links; ++l) {
    LinkFit& fit = adjustment.links[l];
    if (fit.test_degrees == 0) continue;
    const double most = ChiSquareQuantile(fit.test_degrees, kNormal999);
    fit.suspect = fit.test > most * solved.variance_factor;
    if (!used[l]) continue;
    for (const size_t node : {graph.NodeA(l), graph.NodeB(l)}) {
      if (!(fit.test / most > worst[node])) continue;
      worst[node] = fit.test / most;
      adjustment.scans[node].worst_link = l;
    }
  }
  AddOwnErrors(graph, solved, own);
  for (size_t i = 0; i < nodes; ++i) {
    adjustment.scans[i].covariance = solved.variance_factor * own[i];
    adjustment.scans[i].position_sigma = LargestPositionSigma(adjustment.scans[i].covariance);
  }
}

}  // namespace

Eigen::Isometry3d CanonicalPose(const Eigen::Isometry3d& pose) {
  const Eigen::Quaterniond turn(pose.linear());
  const Eigen::Vector4d q(turn.w(), turn.x(), turn.y(), turn.z());
  const double most = q.cwiseAbs().maxCoeff();
  int base = 0;
  while (std::abs(q[base]) < (1 - kEqual) * most) ++base;
  // Ratios to the largest number, which is positive: at most 1 each.
  Eigen::Vector4d ratios = q / q[base];
  for (int i = 0; i < 4; ++i) ratios[i] = std::round(ratios[i] * kGridOfRatio) / kGridOfRatio;
  // Of several that are as large on the grid the first is the base, and positive.
  for (int i = 0; i < 4; ++i) {
    if (std::abs(ratios[i]) < 1) continue;
    ratios *= ratios[i];
    break;
  }
  Eigen::Isometry3d canonical = Eigen::Isometry3d::Identity();
  const double length = ratios.norm();
  canonical.linear() = Eigen::Quaterniond(ratios[0] / length, ratios[1] / length,
                                          ratios[2] / length, ratios[3] / length)
                           .toRotationMatrix();
  for (int i = 0; i < 3; ++i) {
    // Adding zero makes that of -0.
    canonical.translation()[i] =
        std::round(pose.translation()[i] * kGridOfMetre) / kGridOfMetre + 0.0;
  }
  return canonical;
}

absl::StatusOr<Adjustment> Adjust(const PoseGraph& graph) {
  absl::StatusOr<SolvedGraph> solved = SolveGraph(graph);
  if (!solved.ok()) return solved.status();
  Adjustment adjustment;
  adjustment.chi2 = solved->chi2;
  adjustment.degrees_of_freedom = solved->degrees_of_freedom;
  adjustment.variance_factor = solved->variance_factor;
  adjustment.iterations = solved->iterations;
  adjustment.links.resize(graph.links().size());
  const std::vector<ScanNode>& nodes = graph.nodes();
  const std::vector<size_t> component = graph.Components();
  for (size_t i = 0; i < nodes.size(); ++i) {
    AdjustedScan scan;
    scan.id = nodes[i].id;
    scan.held = solved->datum.held[i];
    scan.T_world_scan = scan.held ? nodes[i].T_world_scan : CanonicalPose(solved->poses[i]);
    const sensor::Vector6d change = PoseDifference(nodes[i].T_world_scan, scan.T_world_scan);
    scan.turned = change.head<3>().norm();
    scan.moved = change.tail<3>().norm();
    scan.component = component[i];
    adjustment.scans.push_back(std::move(scan));
  }
  Judge(graph, *solved, adjustment);
  return adjustment;
}

}  // namespace vantage::registration
