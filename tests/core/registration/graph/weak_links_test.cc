#include "core/registration/graph/weak_links.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
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
  EXPECT_THAT(weak->advice[0].words, testing::HasSubstr("tie scan scan-00"));
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
  for (size_t k = 1; k < weak->links.size(); ++k) {
    EXPECT_GE(weak->links[k - 1].relative_sigma, weak->links[k].relative_sigma);
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
