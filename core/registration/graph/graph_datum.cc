#include "core/registration/graph/graph_datum.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <numeric>
#include <optional>

namespace vantage::registration {
namespace {

// One sigma of what holds the first scan of a component along directions that its control leaves
// open: sites are no larger than some hundred metres, and a turn has no more than a radian or so.
constexpr double kVagueMetres = 100;
constexpr double kVagueRadians = 1;
// m: what a turn moves at the far end of a scan, to compare turns with shifts by.
constexpr double kArm = 10;

// The information of the direction that is known least.
double Strength(const sensor::Matrix6d& information) {
  sensor::Vector6d unit;
  unit << Eigen::Vector3d::Constant(1 / kArm), Eigen::Vector3d::Ones();
  const sensor::Matrix6d scaled = unit.asDiagonal() * information * unit.asDiagonal();
  return Eigen::SelfAdjointEigenSolver<sensor::Matrix6d>(scaled, Eigen::EigenvaluesOnly)
      .eigenvalues()[0];
}

}  // namespace

GraphDatum DatumOf(const PoseGraph& graph) {
  const std::vector<ScanNode>& nodes = graph.nodes();
  GraphDatum datum;
  datum.held.assign(nodes.size(), false);
  const std::vector<size_t> component = graph.Components();
  const size_t count =
      component.empty() ? 0 : *std::max_element(component.begin(), component.end()) + 1;
  std::vector<std::optional<size_t>> first(count);
  std::vector<bool> fixed(count, false);
  std::vector<bool> tied(count, false);
  for (size_t i = 0; i < nodes.size(); ++i) {
    const size_t c = component[i];
    if (!first[c].has_value()) first[c] = i;
    datum.held[i] = nodes[i].fixed;
    fixed[c] = fixed[c] || nodes[i].fixed;
    tied[c] = tied[c] || nodes[i].Tied();
  }
  for (size_t i = 0; i < nodes.size(); ++i) {
    // Evidence of what does not move says nothing of the others.
    if (!datum.held[i]) AddEvidence(nodes[i], i, datum.terms);
  }
  for (size_t c = 0; c < count; ++c) {
    if (fixed[c]) continue;
    const size_t node = *first[c];
    if (!tied[c]) {
      datum.held[node] = true;
      continue;
    }
    AbsolutePose vague;
    vague.T_world_scan = nodes[node].T_world_scan;
    vague.information.diagonal() << Eigen::Vector3d::Constant(1 / (kVagueRadians * kVagueRadians)),
        Eigen::Vector3d::Constant(1 / (kVagueMetres * kVagueMetres));
    datum.terms.push_back(TermOf(vague, node));
    datum.vague_equations += 6;
  }
  // A component's first scan that is held by its place has no say of its levelling, either.
  std::erase_if(datum.terms, [&](const PoseTerm& term) { return datum.held[term.a]; });
  for (size_t l = 0; l < graph.links().size(); ++l) {
    const ScanLink& link = graph.links()[l];
    if (link.in_doubt || !(link.information.diagonal().maxCoeff() > 0)) continue;
    datum.links.push_back(TermOf(link, graph.NodeA(l), graph.NodeB(l)));
    datum.link_of.push_back(l);
  }
  return datum;
}

std::vector<Eigen::Isometry3d> StartPoses(const PoseGraph& graph, const GraphDatum& datum) {
  const std::vector<ScanNode>& nodes = graph.nodes();
  std::vector<Eigen::Isometry3d> poses;
  poses.reserve(nodes.size());
  for (const ScanNode& node : nodes) poses.push_back(node.T_world_scan);
  // Roots: what is held; else the scan whose absolute pose is known best, else the first.
  const std::vector<size_t> component = graph.Components();
  const size_t count =
      component.empty() ? 0 : *std::max_element(component.begin(), component.end()) + 1;
  std::vector<std::optional<size_t>> best(count);
  std::vector<double> strength(count, 0);
  std::vector<bool> reached = datum.held;
  std::vector<bool> rooted(count, false);
  for (size_t i = 0; i < nodes.size(); ++i) {
    const size_t c = component[i];
    rooted[c] = rooted[c] || datum.held[i];
    if (!best[c].has_value()) best[c] = i;
    for (const AbsolutePose& absolute : nodes[i].absolute) {
      const double known = Strength(absolute.information);
      if (!(known > strength[c])) continue;
      strength[c] = known;
      best[c] = i;
      poses[i] = absolute.T_world_scan;
    }
  }
  for (size_t c = 0; c < count; ++c) {
    if (!rooted[c]) reached[*best[c]] = true;
  }
  // Of all links that lead on, the one that holds best; equal ones in canonical order.
  std::vector<size_t> order(datum.links.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::vector<double> holds(order.size());
  for (size_t k = 0; k < order.size(); ++k) {
    holds[k] = Strength(graph.links()[datum.link_of[k]].information);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t l, size_t r) { return holds[l] > holds[r]; });
  std::vector<size_t> tree(nodes.size());
  std::iota(tree.begin(), tree.end(), size_t{0});
  const auto find = [&](size_t i) {
    while (tree[i] != i) {
      tree[i] = tree[tree[i]];
      i = tree[i];
    }
    return i;
  };
  std::vector<std::vector<size_t>> branches(nodes.size());
  // Roots are one tree to begin with, so that none is reached from another.
  std::optional<size_t> root;
  for (size_t i = 0; i < nodes.size(); ++i) {
    if (!reached[i]) continue;
    if (root.has_value()) tree[find(i)] = find(*root);
    root = i;
  }
  for (const size_t k : order) {
    const size_t a = find(datum.links[k].a);
    const size_t b = find(datum.links[k].b);
    if (a == b) continue;
    tree[a] = b;
    branches[datum.links[k].a].push_back(k);
    branches[datum.links[k].b].push_back(k);
  }
  std::vector<size_t> queue;
  for (size_t i = 0; i < nodes.size(); ++i) {
    if (reached[i]) queue.push_back(i);
  }
  for (size_t next = 0; next < queue.size(); ++next) {
    const size_t at = queue[next];
    for (const size_t k : branches[at]) {
      const PoseTerm& link = datum.links[k];
      const size_t to = link.a == at ? link.b : link.a;
      if (reached[to]) continue;
      reached[to] = true;
      poses[to] = poses[at] * (link.a == at ? link.measured : link.measured.inverse());
      queue.push_back(to);
    }
  }
  return poses;
}

}  // namespace vantage::registration
