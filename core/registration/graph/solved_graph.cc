#include "core/registration/graph/solved_graph.h"

#include <algorithm>
#include <cmath>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/registration/bound/chi_square.h"
#include "core/registration/graph/least_squares.h"

namespace vantage::registration {
namespace {

// m and rad: steps below it are rounding, at a kilometre.
constexpr double kStill = 1e-11;
// What the grid of canonical poses still forgives.
constexpr double kStillEnough = 1e-8;
constexpr int kLastSteps = 10;

std::vector<PoseTerm> AllTerms(const GraphDatum& datum) {
  std::vector<PoseTerm> terms = datum.links;
  terms.insert(terms.end(), datum.terms.begin(), datum.terms.end());
  return terms;
}

// How well all fits, and whether that is worse than chance explains.
void CountFreedom(SolvedGraph& solved) {
  const std::vector<bool>& held = solved.datum.held;
  int equations = 0;
  for (const PoseTerm& term : AllTerms(solved.datum)) {
    solved.chi2 += ResidualOf(term, solved.poses).value.squaredNorm();
    // What ties two scans that are held says nothing of any pose.
    const bool idle = held[term.a] && (term.kind != PoseTerm::Kind::kLink || held[term.b]);
    if (!idle) equations += RankOf(term);
  }
  const auto free = static_cast<int>(std::count(held.begin(), held.end(), false));
  solved.degrees_of_freedom = std::max(0, equations - 6 * free);
  if (solved.degrees_of_freedom > 0 &&
      solved.chi2 > ChiSquareQuantile(solved.degrees_of_freedom, kNormal95)) {
    solved.variance_factor = std::max(1.0, solved.chi2 / solved.degrees_of_freedom);
  }
}

}  // namespace

int RankOf(const PoseTerm& term) {
  if (term.kind == PoseTerm::Kind::kTarget || term.kind == PoseTerm::Kind::kInclinometer) {
    return term.size();
  }
  int rank = 0;
  for (int k = 0; k < 6; ++k) rank += term.w.row(k).squaredNorm() > 0 ? 1 : 0;
  return rank;
}

PoseCovariances CovariancesOf(const PoseGraph& graph, const GraphNormals& normals) {
  const size_t nodes = graph.nodes().size();
  // Links by the first of their scans, since a column of covariances serves all of them.
  std::vector<std::vector<size_t>> links_from(nodes);
  for (size_t l = 0; l < graph.links().size(); ++l) links_from[graph.NodeA(l)].push_back(l);
  PoseCovariances covariances;
  covariances.own.resize(nodes);
  covariances.between.resize(graph.links().size());
  for (size_t i = 0; i < nodes; ++i) {
    const std::vector<sensor::Matrix6d> column = normals.Column(i);
    covariances.own[i] = 0.5 * (column[i] + column[i].transpose());
    for (const size_t l : links_from[i]) {
      covariances.between[l] = column[graph.NodeB(l)].transpose();
    }
  }
  return covariances;
}

GraphNormals SolvedGraph::Normals() const { return {AllTerms(datum), poses, datum.held}; }

absl::StatusOr<SolvedGraph> SolveGraph(const PoseGraph& graph) {
  const std::vector<ScanNode>& nodes = graph.nodes();
  if (nodes.size() > kMostAdjustedScans) {
    return absl::OutOfRangeError(absl::StrCat("at most ", kMostAdjustedScans,
                                              " scans are adjusted together, not ", nodes.size()));
  }
  SolvedGraph solved;
  solved.datum = DatumOf(graph);
  solved.poses = StartPoses(graph, solved.datum);
  const std::vector<PoseTerm> terms = AllTerms(solved.datum);
  const auto unsolvable = [&](const GraphNormals& normals) {
    return absl::FailedPreconditionError(
        absl::StrCat("nothing holds scan '", nodes[normals.weakest()].id,
                     "' along some direction: its links say nothing of it"));
  };
  if (const GraphNormals normals = solved.Normals(); !normals.solvable()) {
    return unsolvable(normals);
  }
  solved.iterations = FitPoses(terms, solved.datum.held, solved.poses).iterations;
  // From there to where rounding ends it, so that the answer does not show the way.
  for (int step = 0; step < kLastSteps; ++step) {
    const GraphNormals normals = solved.Normals();
    if (!normals.solvable()) return unsolvable(normals);
    const std::vector<sensor::Vector6d> changes = normals.Step();
    double largest = 0;
    size_t farthest = 0;
    for (size_t i = 0; i < nodes.size(); ++i) {
      if (solved.datum.held[i]) continue;
      const double change = changes[i].cwiseAbs().maxCoeff();
      if (!(change <= largest)) {
        largest = change;
        farthest = i;
      }
      solved.poses[i] = ChangedPose(solved.poses[i], changes[i]);
    }
    if (!std::isfinite(largest) || (step + 1 == kLastSteps && largest > kStillEnough)) {
      return absl::FailedPreconditionError(
          absl::StrCat("the adjustment does not settle at scan '", nodes[farthest].id,
                       "': its links contradict each other by more than their information allows"));
    }
    if (largest < kStill) break;
  }
  CountFreedom(solved);
  return solved;
}

}  // namespace vantage::registration
