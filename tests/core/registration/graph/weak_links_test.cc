#include "core/registration/graph/weak_links.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "tests/support/graph_scenes.h"

namespace vantage::registration {
namespace {

using test_support::GraphScene;

sensor::Matrix6d LinkInformationOf(double position_sigma, double turn_sigma) {
  sensor::Matrix6d information = sensor::Matrix6d::Zero();
  information.diagonal() << Eigen::Vector3d::Constant(1 / (turn_sigma * turn_sigma)),
      Eigen::Vector3d::Constant(1 / (position_sigma * position_sigma));
  return information;
}

// Exact links that are all as good as each other.
std::vector<ScanLink> EvenLinks(const GraphScene& scene) {
  std::vector<ScanLink> links = test_support::LinksOf(scene, {.drawn = false}, 1);
  for (ScanLink& link : links) link.information = LinkInformationOf(0.002, 0.0003);
  return links;
}

double WorstSigma(const Adjustment& adjustment) {
  double worst = 0;
  for (const AdjustedScan& scan : adjustment.scans) worst = std::max(worst, scan.position_sigma);
  return worst;
}

// A corridor that nearly closes: what would help most is to close it, and by as much as it does.
TEST(WeakLinksTest, AdviceIsWorthWhatItSays) {
  const GraphScene scene = test_support::RingCorridorGraph(30, 1, 3);
  std::vector<ScanLink> links = EvenLinks(scene);
  std::erase_if(links, [](const ScanLink& l) { return l.a == "scan-0000" && l.b == "scan-0029"; });
  const std::vector<ScanNode> nodes = test_support::NodesOf(scene);
  const auto graph = PoseGraph::Create(nodes, links);
  ASSERT_TRUE(graph.ok());
  const auto adjusted = Adjust(*graph);
  ASSERT_TRUE(adjusted.ok());
  const auto weak = FindWeakLinks(*graph, *adjusted, 15);
  ASSERT_TRUE(weak.ok()) << weak.status();
  EXPECT_NEAR(weak->worst_sigma, WorstSigma(*adjusted), 1e-12);
  ASSERT_FALSE(weak->advice.empty());
  double best = std::numeric_limits<double>::infinity();
  // All ties that are possible, each tried.
  for (size_t a = 0; a < nodes.size(); ++a) {
    for (size_t b = a + 2; b < nodes.size(); ++b) {
      const double apart = (scene.truth[a].translation() - scene.truth[b].translation()).norm();
      if (apart > 15) continue;
      std::vector<ScanLink> tied = links;
      ScanLink tie;
      tie.a = nodes[a].id;
      tie.b = nodes[b].id;
      tie.origin = LinkOrigin::kStated;
      tie.T_a_b = scene.truth[a].inverse(Eigen::Isometry) * scene.truth[b];
      tie.information = LinkInformationOf(0.002, 0.0003);
      tied.push_back(tie);
      const auto with = Adjust(PoseGraph::Create(nodes, tied).value());
      ASSERT_TRUE(with.ok());
      const double worst = WorstSigma(*with);
      best = std::min(best, worst);
      for (const TieAdvice& advice : weak->advice) {
        if (advice.a != a || advice.b != b) continue;
        EXPECT_NEAR(advice.worst_after / worst, 1, 1e-3);
        EXPECT_NEAR(advice.distance, apart, 1e-3);
      }
    }
  }
  EXPECT_NEAR(weak->advice[0].worst_after / best, 1, 1e-3);
  EXPECT_LT(weak->advice[0].worst_after, 0.6 * weak->worst_sigma);
  EXPECT_THAT(weak->advice[0].words, testing::HasSubstr("tie scan-00"));
}

TEST(WeakLinksTest, BridgesAsByTakingEachAway) {
  GraphScene scene = test_support::ThreeStoreysGraph(6, 2);
  const std::vector<ScanLink> links = EvenLinks(scene);
  const auto graph = PoseGraph::Create(test_support::NodesOf(scene), links);
  ASSERT_TRUE(graph.ok());
  const auto weak = FindWeakLinks(*graph, Adjust(*graph).value(), 10);
  ASSERT_TRUE(weak.ok());
  EXPECT_EQ(weak->links.size(), std::min(kMostWeakLinks, links.size()));
  int bridges = 0;
  for (const WeakLink& found : weak->links) {
    std::vector<bool> keep(links.size(), true);
    keep[found.link] = false;
    const std::vector<size_t> parts = graph->WithLinks(keep).Components();
    const auto other = static_cast<size_t>(std::count(parts.begin(), parts.end(), 1u));
    EXPECT_EQ(found.bridge, other > 0);
    EXPECT_EQ(found.hangs_on, std::min(other, parts.size() - other));
    bridges += found.bridge ? 1 : 0;
  }
  // Of each landing both links.
  EXPECT_EQ(bridges, 4);
  // The same in numbers, each of them by taking away what it is about.
  const connectivity::Connectivity& all = weak->connectivity;
  EXPECT_EQ(all.pieces, 1u);
  EXPECT_EQ(all.bridges.size(), 4u);
  const size_t scans = graph->nodes().size();
  EXPECT_EQ(all.tied_pairs, scans * (scans - 1) / 2);
  size_t cuts = 0;
  for (size_t i = 0; i < scans; ++i) {
    std::vector<bool> keep(links.size(), true);
    for (size_t l = 0; l < links.size(); ++l) {
      keep[l] = graph->NodeA(l) != i && graph->NodeB(l) != i;
    }
    const std::vector<size_t> parts = graph->WithLinks(keep).Components();
    const std::set<size_t> pieces(parts.begin(), parts.end());
    if (pieces.size() > 2) ++cuts;  // of which it is one
    EXPECT_EQ(std::any_of(all.cuts.begin(), all.cuts.end(),
                          [&](const auto& cut) { return cut.station == i; }),
              pieces.size() > 2)
        << graph->nodes()[i].id;
  }
  EXPECT_EQ(all.cuts.size(), cuts);
  EXPECT_GT(cuts, 0u);
  // All links are as good as each other, of 2 mm, and the storeys are many links apart.
  const double factor = std::sqrt(Adjust(*graph)->variance_factor);
  for (const double sigma : weak->sigmas) EXPECT_NEAR(sigma, 0.002 * factor, 1e-9);
  EXPECT_GT(all.mean_path_sigma, 0.002 * factor);
  EXPECT_LT(all.mean_path_sigma, all.longest_path_sigma);
  for (size_t k = 1; k < weak->links.size(); ++k) {
    EXPECT_GE(weak->links[k - 1].relative_sigma, weak->links[k].relative_sigma);
  }
}

// Registration to the model goes along with links of surfaces: who hangs on a bridge still does.
TEST(WeakLinksTest, RegistrationToTheModelIsNoTieInTheNumbers) {
  const GraphScene scene = test_support::ThreeStoreysGraph(6, 2);
  std::vector<ScanLink> links = EvenLinks(scene);
  const auto graph = PoseGraph::Create(test_support::NodesOf(scene), links);
  const auto weak = FindWeakLinks(*graph, Adjust(*graph).value(), 10);
  ASSERT_TRUE(weak.ok()) << weak.status();
  const size_t count = links.size();
  for (size_t l = 0; l < count; ++l) {
    links.push_back(links[l]);
    links.back().origin = LinkOrigin::kModel;
  }
  const auto doubled = PoseGraph::Create(test_support::NodesOf(scene), links);
  ASSERT_TRUE(doubled.ok()) << doubled.status();
  const auto same = FindWeakLinks(*doubled, Adjust(*doubled).value(), 10);
  ASSERT_TRUE(same.ok()) << same.status();
  EXPECT_EQ(same->connectivity.bridges.size(), weak->connectivity.bridges.size());
  EXPECT_EQ(same->connectivity.cuts.size(), weak->connectivity.cuts.size());
  for (const connectivity::Bridge& bridge : same->connectivity.bridges) {
    EXPECT_NE(doubled->links()[bridge.link].origin, LinkOrigin::kModel);
  }
}

TEST(WeakLinksTest, RefusesWhatDoesNotFit) {
  const GraphScene scene = test_support::RingCorridorGraph(6, 1, 3);
  const auto graph = PoseGraph::Create(test_support::NodesOf(scene), EvenLinks(scene));
  const auto adjusted = Adjust(*graph);
  ASSERT_TRUE(adjusted.ok());
  EXPECT_FALSE(FindWeakLinks(*graph, *adjusted, 0).ok());
  EXPECT_FALSE(FindWeakLinks(*graph, *adjusted, std::numeric_limits<double>::quiet_NaN()).ok());
  EXPECT_FALSE(FindWeakLinks(*graph, Adjustment(), 10).ok());
  const auto none = PoseGraph::Create({}, {});
  const auto empty = FindWeakLinks(*none, Adjust(*none).value(), 10);
  ASSERT_TRUE(empty.ok());
  EXPECT_TRUE(empty->links.empty());
}

}  // namespace
}  // namespace vantage::registration
