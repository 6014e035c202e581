#include "core/registration/graph/weak_links.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_format.h"
#include "core/registration/align/largest_variance.h"
#include "core/registration/graph/link.h"
#include "core/registration/graph/solved_graph.h"

namespace vantage::registration {
namespace {

// Ties that are worked out, of those that look best at the worst scan alone.
constexpr size_t kWorkedOut = 40;
// Of the worst sigma: what lowers it by less is no advice.
constexpr double kWorthwhile = 0.1;

// Of a link's error, from the covariances of its ends, without weights: in a's frame.
struct Relative {
  ResidualJacobian by_a;
  ResidualJacobian by_b;
};
Relative RelativeOf(size_t a, size_t b, const std::vector<Eigen::Isometry3d>& poses) {
  PoseTerm term;
  term.a = a;
  term.b = b;
  term.measured = poses[a].inverse(Eigen::Isometry) * poses[b];
  term.w.setIdentity();
  const Residual residual = ResidualOf(term, poses);
  return {residual.by_a, residual.by_b};
}

// Registration to the model goes along with a link of two scans, and is no tie of its own.
bool OfModel(const PoseGraph& graph, size_t link) {
  return graph.links()[link].origin == LinkOrigin::kModel;
}

// Information that a tie is expected to have: the median of the graph's links between surfaces, in
// each scan's own axes as far as they are known, of shifts and of turns.
sensor::Matrix6d ExpectedInformation(const PoseGraph& graph) {
  std::vector<double> turns;
  std::vector<double> shifts;
  for (const ScanLink& link : graph.links()) {
    if (link.in_doubt || link.origin == LinkOrigin::kModel) continue;
    turns.push_back(link.information.topLeftCorner<3, 3>().trace() / 3);
    shifts.push_back(link.information.bottomRightCorner<3, 3>().trace() / 3);
  }
  const auto median = [](std::vector<double>& values) {
    if (values.empty()) return 0.0;
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  };
  sensor::Matrix6d information = sensor::Matrix6d::Zero();
  information.diagonal() << Eigen::Vector3d::Constant(median(turns)),
      Eigen::Vector3d::Constant(median(shifts));
  return information;
}

// Covariances of two scans, and of a third with them (rows are its own).
struct TieBlocks {
  sensor::Matrix6d aa;
  sensor::Matrix6d ab;
  sensor::Matrix6d bb;
  sensor::Matrix6d scan_a;
  sensor::Matrix6d scan_b;
};

sensor::Matrix6d RelativeCovariance(const Relative& relative, const sensor::Matrix6d& aa,
                                    const sensor::Matrix6d& ab, const sensor::Matrix6d& bb) {
  const sensor::Matrix6d cross = relative.by_a * ab * relative.by_b.transpose();
  return relative.by_a * aa * relative.by_a.transpose() +
         relative.by_b * bb * relative.by_b.transpose() + cross + cross.transpose();
}

// The covariance of a scan with a tie, of covariance `noise`, between a and b.
sensor::Matrix6d CovarianceWith(const Relative& relative, const TieBlocks& blocks,
                                const sensor::Matrix6d& noise, const sensor::Matrix6d& own) {
  const sensor::Matrix6d spread =
      noise + RelativeCovariance(relative, blocks.aa, blocks.ab, blocks.bb);
  const sensor::Matrix6d with =
      blocks.scan_a * relative.by_a.transpose() + blocks.scan_b * relative.by_b.transpose();
  return own - with * spread.ldlt().solve(with.transpose());
}

// By the link's own information; infinite where that leaves a direction open.
double OwnSigma(const sensor::Matrix6d& information) {
  // m: along directions that surfaces leave open a link has what the poses were taken to be good
  // for (LinkOptions::open_sigma), and less than it searches them for.
  const double open = LinkOptions().reach;
  constexpr double kInfinite = std::numeric_limits<double>::infinity();
  const Eigen::SelfAdjointEigenSolver<sensor::Matrix6d> solver(information);
  const double largest = solver.eigenvalues()[5];
  if (!(solver.eigenvalues()[0] > 1e-12 * largest)) return kInfinite;
  const double sigma = LargestPositionSigma(
      sensor::Matrix6d(solver.eigenvectors() * solver.eigenvalues().cwiseInverse().asDiagonal() *
                       solver.eigenvectors().transpose()));
  return sigma < open ? sigma : kInfinite;
}

// Fills sigmas and connectivity of `result`.
absl::Status MeasureLinks(const PoseGraph& graph, const SolvedGraph& solved,
                          const PoseCovariances& covariances, WeakLinks& result) {
  constexpr double kLeast = 1e-9;  // m: of links that are stated to be exact
  result.sigmas.assign(graph.links().size(), 0);
  std::vector<connectivity::StationLink> links;
  std::vector<size_t> link_of;  // by those, the index in graph.links()
  for (size_t k = 0; k < solved.datum.links.size(); ++k) {
    const PoseTerm& term = solved.datum.links[k];
    const size_t link = solved.datum.link_of[k];
    if (OfModel(graph, link)) continue;
    double sigma = OwnSigma(graph.links()[link].information);
    if (!std::isfinite(sigma)) {
      sigma = LargestPositionSigma(
          RelativeCovariance(RelativeOf(term.a, term.b, solved.poses), covariances.own[term.a],
                             covariances.between[link], covariances.own[term.b]));
    }
    result.sigmas[link] = std::max(kLeast, std::sqrt(solved.variance_factor) * sigma);
    links.push_back(
        {static_cast<uint32_t>(term.a), static_cast<uint32_t>(term.b), result.sigmas[link]});
    link_of.push_back(link);
  }
  auto measured = connectivity::MeasureConnectivity(graph.nodes().size(), links);
  if (!measured.ok()) return measured.status();
  for (connectivity::Bridge& bridge : measured->bridges) {
    bridge.link = link_of[bridge.link];
  }
  result.connectivity = *std::move(measured);
  return absl::OkStatus();
}

std::vector<WeakLink> Weakest(const PoseGraph& graph, const SolvedGraph& solved,
                              const PoseCovariances& covariances,
                              const std::vector<connectivity::Bridge>& bridges) {
  std::vector<size_t> cut_off(graph.links().size(), 0);  // by link; of bridges it is 1 at least
  for (const connectivity::Bridge& bridge : bridges) cut_off[bridge.link] = bridge.cut_off;
  std::vector<WeakLink> weak;
  for (size_t k = 0; k < solved.datum.links.size(); ++k) {
    if (OfModel(graph, solved.datum.link_of[k])) continue;
    const PoseTerm& link = solved.datum.links[k];
    WeakLink found;
    found.link = solved.datum.link_of[k];
    found.hangs_on = cut_off[found.link];
    found.bridge = found.hangs_on > 0;
    found.relative_sigma = LargestPositionSigma(
        solved.variance_factor *
        RelativeCovariance(RelativeOf(link.a, link.b, solved.poses), covariances.own[link.a],
                           covariances.between[found.link], covariances.own[link.b]));
    weak.push_back(found);
  }
  std::stable_sort(weak.begin(), weak.end(), [](const WeakLink& l, const WeakLink& r) {
    return l.relative_sigma > r.relative_sigma;
  });
  if (weak.size() > kMostWeakLinks) weak.resize(kMostWeakLinks);
  return weak;
}

// Ties within a component that are not there yet, the best for `scan` first.
std::vector<TieAdvice> PossibleTies(const PoseGraph& graph, const SolvedGraph& solved,
                                    const GraphNormals& normals, const PoseCovariances& covariances,
                                    const sensor::Matrix6d& noise, size_t scan, double farthest) {
  const size_t nodes = graph.nodes().size();
  const std::vector<size_t> component = graph.Components();
  std::set<std::pair<size_t, size_t>> linked;
  for (size_t l = 0; l < graph.links().size(); ++l) {
    if (!graph.links()[l].in_doubt) linked.insert({graph.NodeA(l), graph.NodeB(l)});
  }
  const std::vector<sensor::Matrix6d> of_scan = normals.Column(scan);
  std::vector<TieAdvice> ties;
  for (size_t a = 0; a < nodes; ++a) {
    if (component[a] != component[scan]) continue;
    std::vector<sensor::Matrix6d> of_a;  // when it is needed
    for (size_t b = a + 1; b < nodes; ++b) {
      const double distance =
          (solved.poses[a].translation() - solved.poses[b].translation()).norm();
      if (distance > farthest || component[b] != component[scan] || linked.contains({a, b})) {
        continue;
      }
      if (of_a.empty()) of_a = normals.Column(a);
      const TieBlocks blocks{covariances.own[a], of_a[b].transpose(), covariances.own[b],
                             of_scan[a].transpose(), of_scan[b].transpose()};
      TieAdvice tie;
      tie.a = a;
      tie.b = b;
      tie.distance = distance;
      tie.worst_after = LargestPositionSigma(
          CovarianceWith(RelativeOf(a, b, solved.poses), blocks, noise, covariances.own[scan]));
      ties.push_back(tie);
    }
  }
  return ties;
}

// 'sessions/job/scans/scan-7' is for programs.
std::string LastPartOf(const std::string& id) { return id.substr(id.rfind('/') + 1); }

bool BetterTie(const TieAdvice& l, const TieAdvice& r) { return l.worst_after < r.worst_after; }

}  // namespace

absl::StatusOr<WeakLinks> FindWeakLinks(const PoseGraph& graph, const Adjustment& adjustment,
                                        double farthest) {
  if (!(farthest > 0) || !std::isfinite(farthest)) {
    return absl::InvalidArgumentError("how far scans overlap has to be positive and finite");
  }
  const size_t nodes = graph.nodes().size();
  bool same = adjustment.scans.size() == nodes && adjustment.links.size() == graph.links().size();
  for (size_t i = 0; same && i < nodes; ++i) same = adjustment.scans[i].id == graph.nodes()[i].id;
  if (!same) return absl::InvalidArgumentError("the adjustment is of another graph");
  WeakLinks result;
  if (nodes == 0) return result;
  const absl::StatusOr<SolvedGraph> solved = SolveGraph(graph);
  if (!solved.ok()) return solved.status();
  const GraphNormals normals = solved->Normals();
  const PoseCovariances covariances = CovariancesOf(graph, normals);
  if (absl::Status measured = MeasureLinks(graph, *solved, covariances, result); !measured.ok()) {
    return measured;
  }
  result.links = Weakest(graph, *solved, covariances, result.connectivity.bridges);
  for (size_t i = 0; i < nodes; ++i) {
    const double sigma =
        std::sqrt(solved->variance_factor) * LargestPositionSigma(covariances.own[i]);
    if (sigma > result.worst_sigma) {
      result.worst_sigma = sigma;
      result.worst_scan = i;
    }
  }
  const sensor::Matrix6d information = ExpectedInformation(graph);
  if (!(information.diagonal().minCoeff() > 0) || !(result.worst_sigma > 0)) return result;
  // Covariances here are without the variance factor, and so is the tie's.
  const sensor::Matrix6d noise = information.inverse();
  std::vector<TieAdvice> ties =
      PossibleTies(graph, *solved, normals, covariances, noise, result.worst_scan, farthest);
  std::stable_sort(ties.begin(), ties.end(), BetterTie);
  if (ties.size() > kWorkedOut) ties.resize(kWorkedOut);
  for (TieAdvice& tie : ties) {
    const Relative relative = RelativeOf(tie.a, tie.b, solved->poses);
    const std::vector<sensor::Matrix6d> of_a = normals.Column(tie.a);
    const std::vector<sensor::Matrix6d> of_b = normals.Column(tie.b);
    double worst = 0;
    for (size_t i = 0; i < nodes; ++i) {
      const TieBlocks blocks{covariances.own[tie.a], of_b[tie.a], covariances.own[tie.b], of_a[i],
                             of_b[i]};
      worst = std::max(
          worst, LargestPositionSigma(CovarianceWith(relative, blocks, noise, covariances.own[i])));
    }
    tie.worst_before = result.worst_sigma;
    tie.worst_after = std::sqrt(solved->variance_factor) * worst;
  }
  std::erase_if(ties, [](const TieAdvice& tie) {
    return tie.worst_after > (1 - kWorthwhile) * tie.worst_before;
  });
  std::stable_sort(ties.begin(), ties.end(), BetterTie);
  if (ties.size() > kMostAdvice) ties.resize(kMostAdvice);
  for (TieAdvice& tie : ties) {
    tie.words = absl::StrFormat(
        "tie %s to %s, %.1f m apart: the worst scan (%s) is known to %.1f mm (one "
        "sigma), and none would be to more than %.1f mm",
        LastPartOf(graph.nodes()[tie.a].id), LastPartOf(graph.nodes()[tie.b].id), tie.distance,
        LastPartOf(graph.nodes()[result.worst_scan].id), 1000 * tie.worst_before,
        1000 * tie.worst_after);
  }
  result.advice = std::move(ties);
  return result;
}

}  // namespace vantage::registration
