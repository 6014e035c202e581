#include "core/registration/graph/model_link.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <optional>
#include <queue>
#include <utility>
#include <vector>

#include "core/registration/align/largest_variance.h"

namespace vantage::registration {
namespace {

using sensor::Matrix6d;

// Of what a scan's links say, and its registration to the model, that counts.
constexpr double kShareOfEach = 0.5;

// Of a tie between two scans, in its worst direction.
struct Looseness {
  double position = 0;  // m^2, of b's scanner as seen from a
  double turn = 0;      // rad^2
};

// Nothing where a tie leaves a direction open.
std::optional<Looseness> LoosenessOf(const Matrix6d& information) {
  const Eigen::LLT<Matrix6d> factor(information);
  if (factor.info() != Eigen::Success) return std::nullopt;
  const Matrix6d covariance = factor.solve(Matrix6d::Identity());
  return Looseness{LargestVariance(covariance.bottomRightCorner<3, 3>()),
                   LargestVariance(covariance.topLeftCorner<3, 3>())};
}

// Scans so far and what ties them to each other.
class Chain {
 public:
  explicit Chain(const PoseGraph& graph) : graph_(graph), ties_(graph.nodes().size()) {}

  void Tie(size_t a, size_t b, const Looseness& loose) {
    ties_[a].push_back({b, loose});
    ties_[b].push_back({a, loose});
  }

  // Of each scan, as tied to `from` along the chain that leaves `at` (m, world) least open: what a
  // tie turns moves it by its distance. Infinite where nothing ties them.
  std::vector<Looseness> From(size_t from, const Eigen::Vector3d& at) const {
    constexpr double kOpen = std::numeric_limits<double>::infinity();
    std::vector<Looseness> best(ties_.size(), Looseness{kOpen, kOpen});
    best[from] = {};
    using Reached = std::pair<double, size_t>;
    std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
    next.push({0, from});
    while (!next.empty()) {
      const auto [position, node] = next.top();
      next.pop();
      if (position > best[node].position) continue;
      for (const auto& [other, loose] : ties_[node]) {
        const double squared =
            (graph_.nodes()[other].T_world_scan.translation() - at).squaredNorm();
        const double open = position + loose.position + squared * loose.turn;
        if (!(open < best[other].position)) continue;
        best[other] = {open, best[node].turn + loose.turn};
        next.push({open, other});
      }
    }
    return best;
  }

 private:
  const PoseGraph& graph_;
  std::vector<std::vector<std::pair<size_t, Looseness>>> ties_;  // by node
};

}  // namespace

absl::StatusOr<PoseGraph> WithModelLinks(const PoseGraph& graph,
                                         std::span<const ModelRegistration> registrations) {
  const std::vector<ScanLink>& links = graph.links();
  std::vector<ScanLink> out = links;
  std::vector<std::vector<size_t>> links_of(graph.nodes().size());
  for (size_t l = 0; l < links.size(); ++l) {
    if (links[l].in_doubt) continue;
    links_of[graph.NodeA(l)].push_back(l);
    links_of[graph.NodeB(l)].push_back(l);
  }
  std::vector<bool> there(graph.nodes().size(), true);
  for (const ModelRegistration& made : registrations) there[graph.IndexOf(made.scan)] = false;
  Chain chain(graph);
  const auto tie = [&](size_t l) {
    if (const auto loose = LoosenessOf(links[l].information); loose.has_value()) {
      chain.Tie(graph.NodeA(l), graph.NodeB(l), *loose);
    }
  };
  for (size_t l = 0; l < links.size(); ++l) {
    if (!links[l].in_doubt && there[graph.NodeA(l)] && there[graph.NodeB(l)]) tie(l);
  }
  for (const ModelRegistration& made : registrations) {
    const size_t scan = graph.IndexOf(made.scan);
    const Eigen::Vector3d at = graph.nodes()[scan].T_world_scan.translation();
    const std::vector<Looseness> beside = chain.From(graph.IndexOf(made.beside), at);
    double known = 0;  // what all its links say of where it is, 1/m^2
    Looseness bent;    // in m and rad, each weighed with its share in `known`
    std::vector<size_t> before;
    for (const size_t l : links_of[scan]) {
      const size_t other = graph.NodeA(l) == scan ? graph.NodeB(l) : graph.NodeA(l);
      if (!there[other]) continue;
      const double share = links[l].information.bottomRightCorner<3, 3>().trace();
      if (!(share > 0)) continue;
      before.push_back(l);
      known += share;
      bent.position += share * std::sqrt(beside[other].position);
      bent.turn += share * std::sqrt(beside[other].turn);
    }
    there[scan] = true;
    for (const size_t l : links_of[scan]) {
      if (there[graph.NodeA(l)] && there[graph.NodeB(l)]) tie(l);
    }
    if (!(known > 0) || !std::isfinite(bent.position)) continue;
    if (Eigen::LLT<Matrix6d>(made.covariance).info() != Eigen::Success) continue;
    Matrix6d covariance = made.covariance;
    covariance.topLeftCorner<3, 3>().diagonal().array() += std::pow(bent.turn / known, 2);
    covariance.bottomRightCorner<3, 3>().diagonal().array() += std::pow(bent.position / known, 2);
    const Eigen::LLT<Matrix6d> factor(covariance);
    ScanLink link;
    link.a = made.beside;
    link.b = made.scan;
    link.T_a_b = made.T_beside_scan;
    const Matrix6d information = kShareOfEach * factor.solve(Matrix6d::Identity());
    link.information = 0.5 * (information + information.transpose());
    link.origin = LinkOrigin::kModel;
    for (const size_t l : before) out[l].information *= 1 - kShareOfEach;
    if (const auto loose = LoosenessOf(link.information); loose.has_value()) {
      chain.Tie(graph.IndexOf(made.beside), scan, *loose);
    }
    out.push_back(link.a < link.b ? std::move(link) : Reversed(link));
  }
  return PoseGraph::Create(graph.nodes(), std::move(out));
}

}  // namespace vantage::registration
