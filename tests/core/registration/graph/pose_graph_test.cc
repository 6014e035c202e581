#include "core/registration/graph/pose_graph.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "core/registration/graph/residuals.h"
#include "tests/support/graph_scenes.h"

namespace vantage::registration {
namespace {

using test_support::GraphScene;
using testing::HasSubstr;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

GraphScene SmallScene() { return test_support::RingCorridorGraph(8, 2, 3); }

std::string RefusalOf(const std::vector<ScanNode>& nodes, const std::vector<ScanLink>& links) {
  const auto graph = PoseGraph::Create(nodes, links);
  EXPECT_FALSE(graph.ok());
  EXPECT_EQ(graph.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(graph.status().message());
}

TEST(PoseGraphTest, RefusesByName) {
  const GraphScene scene = SmallScene();
  const std::vector<ScanNode> nodes = test_support::NodesOf(scene);
  const std::vector<ScanLink> links = test_support::LinksOf(scene, {}, 1);
  ASSERT_TRUE(PoseGraph::Create(nodes, links).ok());
  const auto with_node = [&](auto change) {
    std::vector<ScanNode> changed = nodes;
    change(changed[3]);
    return RefusalOf(changed, links);
  };
  const auto with_link = [&](auto change) {
    std::vector<ScanLink> changed = links;
    change(changed[4]);
    return RefusalOf(nodes, changed);
  };
  EXPECT_THAT(with_node([](ScanNode& n) { n.id = "scan-0002"; }),
              HasSubstr("scan-0002' is there twice"));
  EXPECT_THAT(with_node([](ScanNode& n) { n.id = ""; }), HasSubstr("no id"));
  EXPECT_THAT(with_node([](ScanNode& n) { n.T_world_scan.translation().x() = kNan; }),
              HasSubstr("scan-0003': the pose is not finite"));
  EXPECT_THAT(with_node([](ScanNode& n) { n.T_world_scan.translation().x() = 1e7; }),
              HasSubstr("from the origin"));
  EXPECT_THAT(with_node([](ScanNode& n) { n.T_world_scan.linear() *= 1.001; }),
              HasSubstr("not rigid"));
  EXPECT_THAT(with_node([](ScanNode& n) {
                n.T_world_scan.linear().col(0) = -n.T_world_scan.linear().col(0);
              }),
              HasSubstr("not rigid"));
  EXPECT_THAT(with_node([](ScanNode& n) {
                n.absolute.push_back({{}, {}});
                n.absolute[0].T_world_scan.setIdentity();
                n.absolute[0].information.setConstant(kNan);
              }),
              HasSubstr("of an absolute pose, the information is not finite"));
  EXPECT_THAT(with_node([](ScanNode& n) {
                n.inclinometer = {Eigen::Vector3d(0, 0, 2), 1e-4};
              }),
              HasSubstr("length 1"));
  EXPECT_THAT(with_node([](ScanNode& n) {
                n.inclinometer = {Eigen::Vector3d::UnitZ(), 0};
              }),
              HasSubstr("sigma"));
  EXPECT_THAT(with_node([](ScanNode& n) {
                n.targets.push_back({"B7", Eigen::Vector3d::Constant(kNan), {0, 0, 0}, 0.002});
              }),
              HasSubstr("B7"));
  EXPECT_THAT(with_link([](ScanLink& l) { l.b = "scan-9"; }),
              HasSubstr("there is no scan 'scan-9'"));
  EXPECT_THAT(with_link([](ScanLink& l) { l.b = l.a; }), HasSubstr("is of one scan"));
  EXPECT_THAT(with_link([](ScanLink& l) { l.T_a_b.translation().z() = 1e300; }),
              HasSubstr("from the origin"));
  EXPECT_THAT(with_link([](ScanLink& l) { l.information(0, 1) += 1e6; }), HasSubstr("symmetric"));
  EXPECT_THAT(with_link([](ScanLink& l) { l.information(2, 2) = -1; }),
              HasSubstr("positive semidefinite"));
  EXPECT_THAT(with_link([](ScanLink& l) { l.information *= 1e200; }), HasSubstr("larger than"));
  EXPECT_THAT(with_link([](ScanLink& l) {
                l.information.row(0).setZero();
                l.information.col(0).setZero();
                l.information(0, 1) = l.information(1, 0) = 1e-3;
              }),
              HasSubstr("positive semidefinite"));
}

// The first fault that is named does not depend on the order, either.
TEST(PoseGraphTest, OrderDoesNotMatter) {
  const GraphScene scene = SmallScene();
  std::vector<ScanNode> nodes = test_support::NodesOf(scene);
  std::vector<ScanLink> links = test_support::LinksOf(scene, {}, 1);
  links.push_back(links[2]);  // a second link between two scans, in doubt
  links.back().in_doubt = true;
  links.push_back(links[2]);
  links.back().T_a_b.translation().x() += 0.001;
  const auto first = PoseGraph::Create(nodes, links);
  ASSERT_TRUE(first.ok());
  std::mt19937 random(4);
  for (int round = 0; round < 20; ++round) {
    std::shuffle(nodes.begin(), nodes.end(), random);
    std::shuffle(links.begin(), links.end(), random);
    const auto again = PoseGraph::Create(nodes, links);
    ASSERT_TRUE(again.ok());
    for (size_t i = 0; i < nodes.size(); ++i) {
      EXPECT_EQ(first->nodes()[i].id, again->nodes()[i].id);
      EXPECT_EQ(again->IndexOf(again->nodes()[i].id), i);
    }
    for (size_t l = 0; l < links.size(); ++l) {
      EXPECT_LT(again->NodeA(l), again->NodeB(l));
      EXPECT_EQ(first->links()[l].T_a_b.matrix(), again->links()[l].T_a_b.matrix());
      EXPECT_EQ(first->links()[l].information, again->links()[l].information);
      EXPECT_EQ(first->links()[l].in_doubt, again->links()[l].in_doubt);
    }
  }
}

// What a link says does not depend on the end that it is seen from.
TEST(PoseGraphTest, ReversedLinksSayTheSame) {
  const GraphScene scene = SmallScene();
  std::mt19937_64 random(8);
  std::normal_distribution<double> gauss;
  for (const ScanLink& link : test_support::LinksOf(scene, {}, 2)) {
    const ScanLink reversed = Reversed(link);
    EXPECT_EQ(reversed.a, link.b);
    const ScanLink twice = Reversed(reversed);
    EXPECT_TRUE(twice.T_a_b.isApprox(link.T_a_b, 1e-12));
    EXPECT_TRUE(twice.information.isApprox(link.information, 1e-9));
    for (int draw = 0; draw < 5; ++draw) {
      // Errors so small that the square of their ratio to a metre does not show.
      sensor::Vector6d change;
      for (int k = 0; k < 6; ++k) change[k] = 1e-6 * gauss(random);
      Eigen::Isometry3d T_a_b = ChangedPose(link.T_a_b, change);
      const sensor::Vector6d forth = PoseDifference(link.T_a_b, T_a_b);
      const sensor::Vector6d back = PoseDifference(reversed.T_a_b, T_a_b.inverse(Eigen::Isometry));
      const double chi2 = forth.dot(link.information * forth);
      EXPECT_NEAR(back.dot(reversed.information * back) / chi2, 1, 1e-4);
    }
  }
}

TEST(PoseGraphTest, ComponentsHangTogetherByCertainLinks) {
  const GraphScene scene = SmallScene();
  std::vector<ScanLink> links = test_support::LinksOf(scene, {}, 1);
  std::erase_if(links,
                [](const ScanLink& l) { return (l.a < "scan-0004") != (l.b < "scan-0004"); });
  ScanLink doubt = links.front();
  doubt.a = "scan-0001";
  doubt.b = "scan-0006";
  doubt.in_doubt = true;
  links.push_back(doubt);
  ScanLink empty = doubt;
  empty.in_doubt = false;
  empty.information.setZero();
  links.push_back(empty);
  const auto graph = PoseGraph::Create(test_support::NodesOf(scene), links);
  ASSERT_TRUE(graph.ok());
  EXPECT_THAT(graph->Components(), testing::ElementsAre(0, 0, 0, 0, 1, 1, 1, 1));
  const PoseGraph kept = graph->WithLinks(std::vector<bool>(links.size(), true));
  EXPECT_THAT(kept.Components(), testing::Each(0));
  EXPECT_TRUE(PoseGraph::Create({}, {}).ok());
}

}  // namespace
}  // namespace vantage::registration
