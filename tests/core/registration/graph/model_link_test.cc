#include "core/registration/graph/model_link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/registration/graph/adjust.h"
#include "core/registration/graph/weak_links.h"

namespace vantage::registration {
namespace {

using sensor::Matrix6d;

constexpr double kTurnSigma = 1e-4;  // rad

Matrix6d Diagonal(double turn, double position) {
  sensor::Vector6d diagonal;
  diagonal << turn, turn, turn, position, position, position;
  return diagonal.asDiagonal();
}

Matrix6d InformationOf(double position_sigma) {
  return Diagonal(std::pow(kTurnSigma, -2), std::pow(position_sigma, -2));
}

// Scans in a row, 5 m apart along x, not turned.
class ModelLinkTest : public testing::Test {
 protected:
  static constexpr double kApart = 5;

  explicit ModelLinkTest(int scans = 4) {
    for (int i = 0; i < scans; ++i) {
      ScanNode node;
      node.id = std::string(1, static_cast<char>('a' + i));
      node.T_world_scan.translation().x() = kApart * i;
      node.fixed = i == 0;
      nodes_.push_back(std::move(node));
    }
  }

  const Eigen::Isometry3d& PoseOf(const std::string& id) const {
    return nodes_[static_cast<size_t>(id[0] - 'a')].T_world_scan;
  }

  ScanLink& Link(const std::string& a, const std::string& b, double position_sigma) {
    ScanLink& link = links_.emplace_back();
    link.a = a;
    link.b = b;
    link.T_a_b = PoseOf(a).inverse() * PoseOf(b);
    link.information = InformationOf(position_sigma);
    return link;
  }

  ModelRegistration Registered(const std::string& scan, const std::string& beside,
                               double position_sigma) const {
    ModelRegistration made;
    made.scan = scan;
    made.beside = beside;
    made.T_beside_scan = PoseOf(beside).inverse() * PoseOf(scan);
    made.covariance = InformationOf(position_sigma).inverse();
    return made;
  }

  PoseGraph Graph() const { return PoseGraph::Create(nodes_, links_).value(); }

  // The link of the model between two scans.
  static std::optional<ScanLink> ModelLinkOf(const PoseGraph& graph, const std::string& a,
                                             const std::string& b) {
    for (const ScanLink& link : graph.links()) {
      if (link.origin == LinkOrigin::kModel && link.a == a && link.b == b) return link;
    }
    return std::nullopt;
  }

  std::vector<ScanNode> nodes_;
  std::vector<ScanLink> links_;
};

TEST_F(ModelLinkTest, SaysWhatRegistrationKnewAndHowFarTheModelMayBeBent) {
  Link("a", "b", 0.001);
  Link("b", "c", 0.002);
  // d overlaps a and c alike, and is beside a; between a and c lie two links, whose turns move
  // what is seen from d by d's distance from b and c.
  Link("a", "d", 0.003);
  Link("c", "d", 0.003);
  const std::vector<ModelRegistration> made = {Registered("d", "a", 0.0005)};
  const PoseGraph with = WithModelLinks(Graph(), made).value();
  const std::optional<ScanLink> link = ModelLinkOf(with, "a", "d");
  ASSERT_TRUE(link.has_value());
  EXPECT_TRUE(link->T_a_b.isApprox(made[0].T_beside_scan, 1e-12));
  const double loose = std::sqrt(std::pow(0.001, 2) + std::pow(2 * kApart * kTurnSigma, 2) +
                                 std::pow(0.002, 2) + std::pow(kApart * kTurnSigma, 2));
  const double bent = 0.5 * loose;  // c has half a share, and a is where it is
  const double turned = 0.5 * std::sqrt(2.0) * kTurnSigma;
  const Matrix6d expected = Diagonal(0.5 / (std::pow(kTurnSigma, 2) + std::pow(turned, 2)),
                                     0.5 / (std::pow(0.0005, 2) + std::pow(bent, 2)));
  EXPECT_TRUE(link->information.isApprox(expected, 1e-9)) << link->information << "\n\n"
                                                          << expected;
}

// What one other scan shows of a scan may leave a direction open, and what all show together hold
// it: then its pose is known as its registration knows it, and no tie is called weak for that.
TEST_F(ModelLinkTest, WhatPairsLeaveOpenRegistrationMayHold) {
  const double open = 1;  // m, one sigma along x
  Link("a", "b", 0.001);
  Link("a", "c", 0.001).information(3, 3) = 1 / (open * open);
  Link("b", "c", 0.001).information(3, 3) = 1 / (open * open);
  nodes_.pop_back();
  const PoseGraph with = WithModelLinks(Graph(), {{Registered("c", "a", 0.002)}}).value();
  const Adjustment adjustment = Adjust(with).value();
  const size_t c = with.IndexOf("c");
  EXPECT_LT(adjustment.scans[c].position_sigma, 0.006);
  EXPECT_GT(adjustment.scans[c].position_sigma, 0.001);
  const WeakLinks weak = FindWeakLinks(with, adjustment, 50).value();
  EXPECT_EQ(weak.links.size(), 3u);
  for (const WeakLink& link : weak.links) EXPECT_LT(link.relative_sigma, 0.006);
  EXPECT_LT(weak.connectivity.longest_path_sigma, 0.006);
  EXPECT_GT(Adjust(Graph()).value().scans[c].position_sigma, 0.3);
}

// Where a scan hangs on one other, a registration beside that one is no second tie.
TEST_F(ModelLinkTest, ARegistrationIsNoTieOfItsOwn) {
  Link("a", "b", 0.001);
  Link("b", "c", 0.001);
  nodes_.pop_back();
  const PoseGraph with = WithModelLinks(Graph(), {{Registered("c", "b", 0.002)}}).value();
  const WeakLinks weak = FindWeakLinks(with, Adjust(with).value(), 50).value();
  ASSERT_EQ(weak.links.size(), 2u);
  for (const WeakLink& link : weak.links) EXPECT_TRUE(link.bridge);
}

TEST_F(ModelLinkTest, WhatAScanSaysOfItselfCountsOnce) {
  Link("a", "b", 0.001);
  Link("a", "c", 0.001);
  const PoseGraph with =
      WithModelLinks(Graph(), std::vector<ModelRegistration>{Registered("b", "a", 0.001)}).value();
  Matrix6d known = Matrix6d::Zero();
  Matrix6d other = Matrix6d::Zero();
  for (const ScanLink& link : with.links()) {
    (link.b == "b" ? known : other) += link.information;
  }
  EXPECT_TRUE(known.isApprox(InformationOf(0.001), 1e-9)) << known;
  EXPECT_TRUE(other.isApprox(InformationOf(0.001), 1e-9)) << other;
}

TEST_F(ModelLinkTest, OneWrongLinkMovesNoScanThatTheModelHolds) {
  Link("a", "b", 0.0005);
  Link("b", "c", 0.0005);
  // The link from a to c is 8 mm wrong, and says that it is good to a millimetre.
  Link("a", "c", 0.001).T_a_b.translation().y() += 0.008;
  const std::vector<ModelRegistration> made = {Registered("b", "a", 0.0003),
                                               Registered("c", "b", 0.0003)};
  const Adjustment pairs = Adjust(Graph()).value();
  const Adjustment with = Adjust(WithModelLinks(Graph(), made).value()).value();
  EXPECT_GT(pairs.scans[2].moved, 0.002);
  EXPECT_LT(with.scans[2].moved, 0.5 * pairs.scans[2].moved);
}

TEST_F(ModelLinkTest, AScanThatClosesALongChainGoesWhereItsLinksSay) {
  std::vector<ModelRegistration> made;
  Link("a", "b", 0.004);
  Link("b", "c", 0.004);
  made.push_back(Registered("b", "a", 0.002));
  made.push_back(Registered("c", "b", 0.002));
  // d was registered half way between where a and c have it: each says that it is 8 mm off.
  Link("a", "d", 0.0005).T_a_b.translation().y() += 0.008;
  Link("c", "d", 0.0005).T_a_b.translation().y() -= 0.008;
  made.push_back(Registered("d", "a", 0.0002));
  const Adjustment closed = Adjust(WithModelLinks(Graph(), made).value()).value();
  const double d = closed.scans[3].T_world_scan.translation().y();
  const double c = closed.scans[2].T_world_scan.translation().y();
  EXPECT_GT(d, 0.006);
  EXPECT_NEAR(c - d, 0.008, 0.003);
}

TEST_F(ModelLinkTest, ThereIsNoneWhereNothingTiesWhatTheScanOverlaps) {
  Link("a", "b", 0.001);
  // c is there, and nothing ties it to a; a link in doubt does not.
  Link("a", "c", 0.001).in_doubt = true;
  Link("a", "d", 0.001);
  Link("c", "d", 0.001);
  const std::vector<ModelRegistration> made = {Registered("d", "a", 0.001)};
  const PoseGraph with = WithModelLinks(Graph(), made).value();
  EXPECT_EQ(ModelLinkOf(with, "a", "d"), std::nullopt);
  for (const ScanLink& link : with.links()) {
    EXPECT_TRUE(link.information.isApprox(InformationOf(0.001))) << link.a << link.b;
  }
}

TEST_F(ModelLinkTest, ThereIsNoneOfAScanWithoutALinkToThoseBeforeIt) {
  Link("c", "d", 0.001);
  const std::vector<ModelRegistration> made = {Registered("c", "a", 0.001),
                                               Registered("d", "c", 0.001)};
  const PoseGraph with = WithModelLinks(Graph(), made).value();
  EXPECT_EQ(ModelLinkOf(with, "a", "c"), std::nullopt);  // d came later
  EXPECT_TRUE(ModelLinkOf(with, "c", "d").has_value());
}

}  // namespace
}  // namespace vantage::registration
