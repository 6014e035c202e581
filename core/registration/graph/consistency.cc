#include "core/registration/graph/consistency.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <set>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/registration/align/largest_variance.h"
#include "core/registration/bound/chi_square.h"
#include "core/registration/graph/max_clique.h"
#include "core/registration/graph/solved_graph.h"

namespace vantage::registration {
namespace {

// Pairs looked up for a largest set: half a second at most. Sets of a few dozen links are exact.
constexpr size_t kMostLookups = 100'000'000;
// Sigmas that a shift of one period has to be for what is certain to notice it: 99.9 %.
constexpr double kNoticed = 3.3;
// Two links agree more closely than what is certain could tell where the loop of both leaves open
// less than this share of what the chain does, or nothing that could matter (m).
constexpr double kCloser = 1.0 / 3;
constexpr double kCloseEnough = 0.05;
// An alternative set is no rival when it has at most this share of the links' pairs, or when what
// is certain makes it less likely by this factor of 1,000 (chi-square of one, 99.9 %).
constexpr double kRivalSupport = 0.5;
constexpr double kDecided = 10.83;
// Of links' directions without information: 100 m and 1 rad, one sigma.
constexpr double kLooseShift = 100;
constexpr double kVagueRotation = 1;

using Pair = std::pair<size_t, size_t>;

// Twists [w; v] move a point x by w x x + v; of a pose's change about p, v = t - w x p.
sensor::Matrix6d TwistOfChange(const Eigen::Vector3d& p) {
  sensor::Matrix6d twist = sensor::Matrix6d::Identity();
  twist.bottomLeftCorner<3, 3>() = CrossMatrix(p);
  return twist;
}
sensor::Matrix6d Adjoint(const Eigen::Isometry3d& T) {
  sensor::Matrix6d adjoint = sensor::Matrix6d::Zero();
  adjoint.topLeftCorner<3, 3>() = T.linear();
  adjoint.bottomRightCorner<3, 3>() = T.linear();
  adjoint.bottomLeftCorner<3, 3>() = CrossMatrix(T.translation()) * T.linear();
  return adjoint;
}

// One link in doubt, from a to b.
struct Doubt {
  size_t link = 0;  // of graph.links()
  size_t a = 0;
  size_t b = 0;
  Eigen::Isometry3d T_a_b = Eigen::Isometry3d::Identity();
  sensor::Matrix6d covariance = sensor::Matrix6d::Zero();  // about b's scanner, in a's frame
  bool chained = false;                                    // certain links close a loop
  double chain_chi2 = 0;
  int degrees = 0;
  double chain_sigma = std::numeric_limits<double>::infinity();  // m, that the chain leaves open
  bool refuted = false;                                          // the chain contradicts it

  Pair pair() const { return {a, b}; }
};

// What of a link and its reverse may close a loop with another.
struct Directed {
  size_t a = 0;
  size_t b = 0;
  Eigen::Isometry3d T_a_b = Eigen::Isometry3d::Identity();
  sensor::Matrix6d twist_covariance = sensor::Matrix6d::Zero();  // of a twist in a's frame
};

struct Loop {
  bool closed = false;
  double chi2 = 0;
  double sigma = std::numeric_limits<double>::infinity();  // m, that it leaves open
};

class DoubtfulLinks {
 public:
  DoubtfulLinks(const PoseGraph& graph, const SolvedGraph& solved)
      : graph_(graph), solved_(solved), component_(graph.Components()) {
    for (size_t l = 0; l < graph.links().size(); ++l) {
      if (graph.links()[l].in_doubt) doubts_.push_back(DoubtOf(l));
    }
    Covariances();
    for (Doubt& doubt : doubts_) Chain(doubt);
  }

  const std::vector<Doubt>& doubts() const { return doubts_; }

  Loop LoopOf(const Doubt& i, const Doubt& j) const {
    const Directed first{i.a, i.b, i.T_a_b, TwistCovariance(i)};
    const Directed second{j.a, j.b, j.T_a_b, TwistCovariance(j)};
    Loop best = Close(first, second);
    const Directed reversed = Reverse(second);
    const Loop other = Close(first, reversed);
    if (other.closed && other.sigma < best.sigma) best = other;
    return best;
  }

 private:
  Doubt DoubtOf(size_t l) const {
    const ScanLink& link = graph_.links()[l];
    Doubt doubt;
    doubt.link = l;
    doubt.a = graph_.NodeA(l);
    doubt.b = graph_.NodeB(l);
    doubt.T_a_b = link.T_a_b;
    sensor::Vector6d vague;
    vague << Eigen::Vector3d::Constant(1 / (kVagueRotation * kVagueRotation)),
        Eigen::Vector3d::Constant(1 / (kLooseShift * kLooseShift));
    sensor::Matrix6d information = link.information;
    information.diagonal() += vague;
    const sensor::Vector6d scale = information.diagonal().cwiseSqrt().cwiseInverse();
    const sensor::Matrix6d unit = scale.asDiagonal() * information * scale.asDiagonal();
    doubt.covariance =
        scale.asDiagonal() * unit.ldlt().solve(sensor::Matrix6d::Identity()) * scale.asDiagonal();
    return doubt;
  }

  // Of the ends of all doubts, with each other.
  void Covariances() {
    place_.assign(graph_.nodes().size(), 0);
    std::set<size_t> ends;
    for (const Doubt& doubt : doubts_) ends.insert({doubt.a, doubt.b});
    const std::vector<size_t> order(ends.begin(), ends.end());
    for (size_t k = 0; k < order.size(); ++k) place_[order[k]] = k;
    const GraphNormals normals = solved_.Normals();
    for (const size_t node : order) {
      const std::vector<sensor::Matrix6d> column = normals.Column(node);
      std::vector<sensor::Matrix6d>& kept = covariances_.emplace_back();
      for (const size_t other : order) {
        kept.push_back(solved_.variance_factor * column[other]);
      }
    }
  }
  // Rows are the first's.
  const sensor::Matrix6d& Covariance(size_t node, size_t with) const {
    return covariances_[place_[with]][place_[node]];
  }

  void Chain(Doubt& doubt) const {
    if (component_[doubt.a] != component_[doubt.b]) return;
    doubt.chained = true;
    const ScanLink& link = graph_.links()[doubt.link];
    PoseTerm term = TermOf(link, doubt.a, doubt.b);
    doubt.degrees = RankOf(term);
    const auto predicted = [&](const Residual& r) {
      const Eigen::MatrixXd cross = r.by_a * Covariance(doubt.a, doubt.b) * r.by_b.transpose();
      return sensor::Matrix6d(r.by_a * Covariance(doubt.a, doubt.a) * r.by_a.transpose() +
                              r.by_b * Covariance(doubt.b, doubt.b) * r.by_b.transpose() + cross +
                              cross.transpose());
    };
    const Residual residual = ResidualOf(term, solved_.poses);
    const sensor::Matrix6d covariance = sensor::Matrix6d::Identity() + predicted(residual);
    doubt.chain_chi2 = residual.value.dot(covariance.ldlt().solve(residual.value));
    doubt.refuted =
        doubt.degrees > 0 && doubt.chain_chi2 > ChiSquareQuantile(doubt.degrees, kNormal999);
    term.w.setIdentity();
    doubt.chain_sigma = LargestPositionSigma(predicted(ResidualOf(term, solved_.poses)));
  }

  static sensor::Matrix6d TwistCovariance(const Doubt& doubt) {
    const sensor::Matrix6d twist = TwistOfChange(doubt.T_a_b.translation());
    return twist * doubt.covariance * twist.transpose();
  }
  static Directed Reverse(const Directed& link) {
    Directed reversed;
    reversed.a = link.b;
    reversed.b = link.a;
    reversed.T_a_b = link.T_a_b.inverse(Eigen::Isometry);
    const sensor::Matrix6d adjoint = Adjoint(reversed.T_a_b);
    reversed.twist_covariance = adjoint * link.twist_covariance * adjoint.transpose();
    return reversed;
  }

  // b -> a by the first, a -> c by the chain, c -> d by the second, d -> b by the chain.
  Loop Close(const Directed& i, const Directed& j) const {
    Loop loop;
    if (component_[i.a] != component_[j.a] || component_[i.b] != component_[j.b]) return loop;
    loop.closed = true;
    // About a's place, so that a site's coordinates do not cost digits.
    const Eigen::Vector3d origin = solved_.poses[i.a].translation();
    const auto pose = [&](size_t node) {
      Eigen::Isometry3d placed = solved_.poses[node];
      placed.translation() -= origin;
      return placed;
    };
    const Eigen::Isometry3d to_b = i.T_a_b.inverse(Eigen::Isometry);
    const Eigen::Isometry3d world_to_a = pose(i.a).inverse(Eigen::Isometry);
    const Eigen::Isometry3d a_to_c = world_to_a * pose(j.a);
    const Eigen::Isometry3d world_to_d = pose(j.b).inverse(Eigen::Isometry);
    const Eigen::Isometry3d error = to_b * a_to_c * j.T_a_b * world_to_d * pose(i.b);
    const sensor::Matrix6d by_start = Adjoint(to_b * world_to_a);
    const sensor::Matrix6d by_end = Adjoint(to_b * a_to_c * j.T_a_b * world_to_d);
    const std::array<size_t, 4> nodes = {i.a, i.b, j.a, j.b};
    std::array<sensor::Matrix6d, 4> by;
    for (size_t k = 0; k < 4; ++k) {
      const sensor::Matrix6d twist = TwistOfChange(pose(nodes[k]).translation());
      const sensor::Matrix6d moved = (k % 2 == 0 ? by_start : by_end) * twist;
      by[k] = (k == 0 || k == 3) ? sensor::Matrix6d(-moved) : moved;
    }
    sensor::Matrix6d covariance = sensor::Matrix6d::Zero();
    for (size_t k = 0; k < 4; ++k) {
      for (size_t m = 0; m < 4; ++m) {
        covariance += by[k] * Covariance(nodes[k], nodes[m]) * by[m].transpose();
      }
    }
    const sensor::Matrix6d by_i = Adjoint(to_b);
    const sensor::Matrix6d by_j = Adjoint(to_b * a_to_c);
    covariance += by_i * i.twist_covariance * by_i.transpose();
    covariance += by_j * j.twist_covariance * by_j.transpose();
    // A twist at where the loop ends, as a change of the pose there.
    const sensor::Matrix6d change = TwistOfChange(-error.translation());
    covariance = (change * covariance * change.transpose()).eval();
    covariance = (0.5 * (covariance + covariance.transpose())).eval();
    const sensor::Vector6d off = PoseDifference(Eigen::Isometry3d::Identity(), error);
    const sensor::Vector6d scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
    const sensor::Matrix6d unit = scale.asDiagonal() * covariance * scale.asDiagonal();
    const sensor::Vector6d scaled = scale.cwiseProduct(off);
    loop.chi2 = scaled.dot(unit.ldlt().solve(scaled));
    loop.sigma = LargestPositionSigma(covariance);
    return loop;
  }

  const PoseGraph& graph_;
  const SolvedGraph& solved_;
  std::vector<size_t> component_;
  std::vector<Doubt> doubts_;
  std::vector<size_t> place_;
  std::vector<std::vector<sensor::Matrix6d>> covariances_;
};

// How the links in doubt stand to each other; indices are those of doubts.
struct Relations {
  std::vector<std::vector<bool>> consistent;
  std::vector<std::vector<bool>> closely;  // and more so than the chain could tell
};

Relations Compare(const DoubtfulLinks& links) {
  const std::vector<Doubt>& doubts = links.doubts();
  const double most = ChiSquareQuantile(6, kNormal999);
  Relations relations;
  relations.consistent.assign(doubts.size(), std::vector<bool>(doubts.size(), false));
  relations.closely = relations.consistent;
  for (size_t i = 0; i < doubts.size(); ++i) {
    for (size_t j = 0; j < i; ++j) {
      const Loop loop = links.LoopOf(doubts[i], doubts[j]);
      const bool consistent = !loop.closed || loop.chi2 <= most;
      relations.consistent[i][j] = relations.consistent[j][i] = consistent;
      if (!consistent || !loop.closed || doubts[i].pair() == doubts[j].pair()) continue;
      const auto closer = [&](const Doubt& doubt) {
        const double needed = std::max(kCloseEnough, kCloser * doubt.chain_sigma);
        return loop.sigma <= std::min(needed, kLeastPeriod / kNoticed);
      };
      relations.closely[i][j] = closer(doubts[i]);
      relations.closely[j][i] = closer(doubts[j]);
    }
  }
  return relations;
}

// A largest set of those given that all agree; indices of doubts.
Clique LargestSet(const std::vector<size_t>& among, const Relations& relations) {
  std::vector<std::vector<bool>> neighbours(among.size(), std::vector<bool>(among.size(), false));
  for (size_t i = 0; i < among.size(); ++i) {
    for (size_t j = 0; j < among.size(); ++j) {
      neighbours[i][j] = i != j && relations.consistent[among[i]][among[j]];
    }
  }
  Clique clique = LargestClique(neighbours, kMostLookups);
  for (size_t& v : clique.vertices) v = among[v];
  return clique;
}

size_t PairsOf(const std::vector<size_t>& set, const std::vector<Doubt>& doubts) {
  std::set<Pair> pairs;
  for (const size_t i : set) pairs.insert(doubts[i].pair());
  return pairs.size();
}

double MedianChainChi2(const std::vector<size_t>& set, const std::vector<Doubt>& doubts) {
  std::vector<double> values;
  for (const size_t i : set) {
    if (!doubts[i].chained) return 0;
    values.push_back(doubts[i].chain_chi2);
  }
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

// Whether other links that contradict `i` and agree among themselves are about as good.
bool HasRivalSet(size_t i, const std::vector<size_t>& set, const std::vector<size_t>& candidates,
                 const Relations& relations, const std::vector<Doubt>& doubts) {
  std::vector<size_t> against;
  for (const size_t j : candidates) {
    if (!relations.consistent[i][j] && i != j) against.push_back(j);
  }
  if (against.empty()) return false;
  const std::vector<size_t> rival = LargestSet(against, relations).vertices;
  std::vector<size_t> contradicted;
  for (const size_t k : set) {
    if (std::any_of(rival.begin(), rival.end(),
                    [&](size_t r) { return !relations.consistent[k][r]; })) {
      contradicted.push_back(k);
    }
  }
  if (static_cast<double>(PairsOf(rival, doubts)) <=
      kRivalSupport * static_cast<double>(PairsOf(contradicted, doubts))) {
    return false;
  }
  return MedianChainChi2(rival, doubts) - MedianChainChi2(contradicted, doubts) < kDecided;
}

// Whether another link between the same scans, which contradicts it and nothing refutes, is
// supported about as well: then not even all others that agree with both tell which is right.
bool HasRivalOfPair(size_t i, const std::vector<size_t>& candidates, const Relations& relations,
                    const std::vector<Doubt>& doubts) {
  const auto support = [&](size_t of) {
    std::set<Pair> pairs;
    for (const size_t j : candidates) {
      if (relations.closely[of][j]) pairs.insert(doubts[j].pair());
    }
    return static_cast<double>(pairs.size());
  };
  const double own = support(i);
  return std::any_of(candidates.begin(), candidates.end(), [&](size_t j) {
    if (i == j || doubts[i].pair() != doubts[j].pair() || relations.consistent[i][j]) return false;
    return support(j) > kRivalSupport * own &&
           doubts[j].chain_chi2 - doubts[i].chain_chi2 < kDecided;
  });
}

LinkJudgement JudgeLink(size_t i, const std::vector<size_t>& set,
                        const std::vector<size_t>& candidates, const Relations& relations,
                        const std::vector<Doubt>& doubts) {
  const Doubt& doubt = doubts[i];
  LinkJudgement judgement;
  judgement.decision = LinkDecision::kOpen;
  std::set<Pair> agreeing;
  for (const size_t j : set) {
    if (relations.closely[i][j]) agreeing.insert(doubts[j].pair());
  }
  judgement.agrees = agreeing.size();
  if (doubt.degrees > 0) {
    judgement.chain_test = doubt.chain_chi2 / ChiSquareQuantile(doubt.degrees, kNormal999);
  }
  if (doubt.refuted) {
    judgement.decision = LinkDecision::kRejected;
    judgement.reason = absl::StrFormat(
        "it contradicts the links that are certain (%.1f times what chance explains)",
        judgement.chain_test);
    return judgement;
  }
  if (!std::binary_search(set.begin(), set.end(), i)) {
    judgement.reason = "more links in doubt agree on something else";
    return judgement;
  }
  if (HasRivalSet(i, set, candidates, relations, doubts) ||
      HasRivalOfPair(i, candidates, relations, doubts)) {
    judgement.reason = "as many links in doubt agree on something else";
    return judgement;
  }
  if (!(kNoticed * doubt.chain_sigma < kLeastPeriod)) {
    judgement.reason =
        doubt.chained ? absl::StrFormat(
                            "what is certain leaves %.1f m open, as far as sites repeat themselves",
                            kNoticed * doubt.chain_sigma)
                      : "nothing that is certain ties its scans";
    return judgement;
  }
  const auto alternative = [&](const Doubt& other) {
    return other.pair() == doubt.pair() && other.link != doubt.link;
  };
  const bool alternatives_refuted =
      std::any_of(doubts.begin(), doubts.end(), alternative) &&
      std::all_of(doubts.begin(), doubts.end(),
                  [&](const Doubt& other) { return !alternative(other) || other.refuted; });
  if (agreeing.empty() && !alternatives_refuted) {
    judgement.reason = "no other link agrees with it closely";
    return judgement;
  }
  judgement.decision = LinkDecision::kAccepted;
  judgement.reason =
      agreeing.empty()
          ? "its alternatives contradict the links that are certain"
          : absl::StrFormat("links between %d other pairs of scans agree with it", agreeing.size());
  return judgement;
}

}  // namespace

absl::StatusOr<LinkDecisions> DecideLinks(const PoseGraph& graph) {
  LinkDecisions decisions;
  decisions.links.resize(graph.links().size());
  decisions.keep.assign(graph.links().size(), true);
  const auto in_doubt =
      static_cast<size_t>(std::count_if(graph.links().begin(), graph.links().end(),
                                        [](const ScanLink& link) { return link.in_doubt; }));
  if (in_doubt == 0) return decisions;
  if (in_doubt > kMostDoubtfulLinks) {
    return absl::ResourceExhaustedError(absl::StrCat(
        "at most ", kMostDoubtfulLinks, " links in doubt are decided together, not ", in_doubt));
  }
  const absl::StatusOr<SolvedGraph> solved = SolveGraph(graph);
  if (!solved.ok()) return solved.status();
  const DoubtfulLinks links(graph, *solved);
  const std::vector<Doubt>& doubts = links.doubts();
  const Relations relations = Compare(links);
  std::vector<size_t> candidates;
  for (size_t i = 0; i < doubts.size(); ++i) {
    if (!doubts[i].refuted) candidates.push_back(i);
  }
  const Clique set = LargestSet(candidates, relations);
  decisions.largest_set = set.vertices.size();
  decisions.largest_bound = set.bound;
  std::vector<bool> accepted(doubts.size(), false);
  for (size_t i = 0; i < doubts.size(); ++i) {
    LinkJudgement& judgement = decisions.links[doubts[i].link];
    judgement = JudgeLink(i, set.vertices, candidates, relations, doubts);
    accepted[i] = judgement.decision == LinkDecision::kAccepted;
    decisions.keep[doubts[i].link] = accepted[i];
  }
  // What was accepted decides against what contradicts it.
  for (size_t i = 0; i < doubts.size(); ++i) {
    LinkJudgement& judgement = decisions.links[doubts[i].link];
    if (judgement.decision != LinkDecision::kOpen) continue;
    for (size_t j = 0; j < doubts.size(); ++j) {
      if (!accepted[j] || relations.consistent[i][j] || i == j) continue;
      judgement.decision = LinkDecision::kRejected;
      judgement.reason =
          absl::StrCat("it contradicts the link between scans '", graph.nodes()[doubts[j].a].id,
                       "' and '", graph.nodes()[doubts[j].b].id, "', which was accepted");
      break;
    }
  }
  return decisions;
}

}  // namespace vantage::registration
