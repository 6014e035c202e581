#include "core/registration/graph/adjust.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "tests/support/graph_scenes.h"

namespace vantage::registration {
namespace {

using sensor::Matrix6d;
using sensor::Vector6d;
using test_support::GraphScene;

Eigen::Isometry3d Shaken(const Eigen::Isometry3d& pose, double metres, double radians,
                         std::mt19937_64& random) {
  std::normal_distribution<double> gauss;
  const auto three = [&] {
    const double x = gauss(random);
    const double y = gauss(random);
    return Eigen::Vector3d(x, y, gauss(random));
  };
  Eigen::Isometry3d shaken = pose;
  shaken.linear() =
      Eigen::AngleAxisd(radians * gauss(random), three().normalized()) * pose.linear();
  shaken.translation() += metres * three();
  return shaken;
}

// The weighted misfit of a link, written down a second time: in the frame of a, with the logarithm
// of Eigen's angle and axis.
Vector6d Misfit(const ScanLink& link, const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
  const Eigen::Isometry3d T = a.inverse() * b;
  const Eigen::AngleAxisd turn(T.linear() * link.T_a_b.linear().transpose());
  Vector6d misfit;
  misfit << turn.angle() * turn.axis(), T.translation() - link.T_a_b.translation();
  return misfit;
}

// Dense Gauss-Newton with derivatives by differences, from the truth.
struct Dense {
  std::vector<Eigen::Isometry3d> poses;
  Eigen::MatrixXd covariance;  // of all but the first
};
Dense DenseAdjustment(const PoseGraph& graph, std::vector<Eigen::Isometry3d> poses) {
  const size_t nodes = graph.nodes().size();
  const auto unknowns = static_cast<Eigen::Index>(6 * (nodes - 1));
  const auto moved = [](const Eigen::Isometry3d& pose, const Vector6d& change) {
    Eigen::Isometry3d result = pose;
    const double angle = change.head<3>().norm();
    if (angle > 0) {
      result.linear() =
          Eigen::AngleAxisd(angle, change.head<3>() / angle).toRotationMatrix() * pose.linear();
    }
    result.translation() += change.tail<3>();
    return result;
  };
  Dense dense;
  for (int step = 0; step < 8; ++step) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(unknowns, unknowns);
    Eigen::VectorXd gradient = Eigen::VectorXd::Zero(unknowns);
    for (size_t l = 0; l < graph.links().size(); ++l) {
      const ScanLink& link = graph.links()[l];
      Eigen::MatrixXd jacobian = Eigen::MatrixXd::Zero(6, unknowns);
      for (const size_t node : {graph.NodeA(l), graph.NodeB(l)}) {
        if (node == 0) continue;
        for (int k = 0; k < 6; ++k) {
          constexpr double kStep = 1e-6;
          const auto misfit = [&](double by) {
            std::vector<Eigen::Isometry3d> at = poses;
            at[node] = moved(poses[node], by * Vector6d::Unit(k));
            return Misfit(link, at[graph.NodeA(l)], at[graph.NodeB(l)]);
          };
          jacobian.col(static_cast<Eigen::Index>(6 * (node - 1)) + k) =
              (misfit(kStep) - misfit(-kStep)) / (2 * kStep);
        }
      }
      const Vector6d value = Misfit(link, poses[graph.NodeA(l)], poses[graph.NodeB(l)]);
      normal += jacobian.transpose() * link.information * jacobian;
      gradient += jacobian.transpose() * link.information * value;
    }
    const Eigen::VectorXd change = -normal.ldlt().solve(gradient);
    for (size_t i = 1; i < nodes; ++i) {
      poses[i] = moved(poses[i], change.segment<6>(static_cast<Eigen::Index>(6 * (i - 1))));
    }
    dense.covariance = normal.ldlt().solve(Eigen::MatrixXd::Identity(unknowns, unknowns));
  }
  dense.poses = std::move(poses);
  return dense;
}

double Chi2(const Vector6d& error, const Matrix6d& covariance) {
  const Vector6d scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Matrix6d unit = scale.asDiagonal() * covariance * scale.asDiagonal();
  const Vector6d scaled = scale.cwiseProduct(error);
  return scaled.dot(unit.ldlt().solve(scaled));
}

TEST(AdjustTest, ExactLinksGiveTheTruth) {
  for (const GraphScene& scene :
       {test_support::RingCorridorGraph(40, 3, 1), test_support::ThreeStoreysGraph(8, 2),
        test_support::StreetGraph(30, 3)}) {
    std::vector<ScanNode> nodes = test_support::NodesOf(scene);
    std::mt19937_64 random(5);
    for (ScanNode& node : nodes) {
      if (!node.fixed) node.T_world_scan = Shaken(node.T_world_scan, 0.5, 0.1, random);
    }
    const auto graph = PoseGraph::Create(nodes, test_support::LinksOf(scene, {.drawn = false}, 7));
    ASSERT_TRUE(graph.ok()) << graph.status();
    const auto adjusted = Adjust(*graph);
    ASSERT_TRUE(adjusted.ok()) << adjusted.status();
    EXPECT_LT(adjusted->chi2, 1e-9);
    EXPECT_EQ(adjusted->variance_factor, 1);
    for (size_t i = 0; i < scene.truth.size(); ++i) {
      const Vector6d error =
          test_support::PoseError(scene.truth[i], adjusted->scans[i].T_world_scan);
      // The grid's half step, and what rounding leaves of a hundred poses on top of each other.
      EXPECT_LT(error.tail<3>().cwiseAbs().maxCoeff(), 0.51 / 1048576) << i;
      EXPECT_LT(error.head<3>().norm(), 5e-7) << i;
      EXPECT_NEAR(
          adjusted->scans[i].moved,
          (graph->nodes()[i].T_world_scan.translation() - scene.truth[i].translation()).norm(),
          2e-6);
    }
  }
}

TEST(AdjustTest, AgreesWithDenseGaussNewton) {
  for (uint64_t seed = 1; seed <= 3; ++seed) {
    const GraphScene scene = test_support::RingCorridorGraph(12, 2, seed);
    const test_support::LinkNoise noise{.position_sigma = 0.02, .turn_sigma = 0.004};
    const PoseGraph graph = test_support::NoisyGraph(scene, noise, seed);
    const auto adjusted = Adjust(graph);
    ASSERT_TRUE(adjusted.ok());
    const Dense dense = DenseAdjustment(graph, scene.truth);
    for (size_t i = 1; i < dense.poses.size(); ++i) {
      const Vector6d off = test_support::PoseError(dense.poses[i], adjusted->scans[i].T_world_scan);
      EXPECT_LT(off.cwiseAbs().maxCoeff(), 1.5e-6);
      const auto at = static_cast<Eigen::Index>(6 * (i - 1));
      const Matrix6d expected = adjusted->variance_factor * dense.covariance.block<6, 6>(at, at);
      EXPECT_TRUE(adjusted->scans[i].covariance.isApprox(expected, 1e-4)) << i;
    }
  }
}

// Over draws of the links' noise, errors are as the covariances say.
TEST(AdjustTest, CovarianceAgainstMonteCarlo) {
  const GraphScene scene = test_support::ThreeStoreysGraph(6, 4);
  double squares = 0;
  int within = 0;
  int count = 0;
  std::vector<double> factors;
  constexpr int kDraws = 60;
  for (uint64_t draw = 0; draw < kDraws; ++draw) {
    const auto adjusted = Adjust(test_support::NoisyGraph(scene, {}, 1000 + draw));
    ASSERT_TRUE(adjusted.ok());
    EXPECT_GT(adjusted->degrees_of_freedom, 50);
    factors.push_back(adjusted->chi2 / adjusted->degrees_of_freedom);
    for (size_t i = 1; i < scene.truth.size(); ++i) {
      const double chi2 =
          Chi2(test_support::PoseError(scene.truth[i], adjusted->scans[i].T_world_scan),
               adjusted->scans[i].covariance);
      squares += chi2 / 6;
      within += chi2 < 12.592 ? 1 : 0;
      ++count;
    }
  }
  // Scans of one draw share their errors: of 60 draws the mean of squares is right to a tenth.
  EXPECT_NEAR(squares / count, 1, 0.15);
  EXPECT_NEAR(static_cast<double>(within) / count, 0.95, 0.03);
  double mean = 0;
  for (const double factor : factors) mean += factor / kDraws;
  EXPECT_NEAR(mean, 1, 0.05);
}

// Each scan has an error of its own that is in all its links: then residuals show nothing of it,
// and the covariance has to.
TEST(AdjustTest, OwnErrorsOfScansAreWithinTheCovariance) {
  const GraphScene scene = test_support::ThreeStoreysGraph(8, 4);
  std::mt19937_64 random(31);
  std::normal_distribution<double> gauss;
  constexpr double kTurn = 0.0002;
  constexpr double kShift = 0.001;
  double squares = 0;
  int within = 0;
  int count = 0;
  for (int draw = 0; draw < 40; ++draw) {
    // Where each scan's measurements seem to have been made, if its surfaces alone are looked at.
    std::vector<Eigen::Isometry3d> seeming = scene.truth;
    for (Eigen::Isometry3d& pose : seeming) {
      Vector6d error;
      for (int k = 0; k < 6; ++k) error[k] = (k < 3 ? kTurn : kShift) * gauss(random);
      pose.linear() = (Eigen::AngleAxisd(error[0], Eigen::Vector3d::UnitX()) *
                       Eigen::AngleAxisd(error[1], Eigen::Vector3d::UnitY()) *
                       Eigen::AngleAxisd(error[2], Eigen::Vector3d::UnitZ())) *
                      pose.linear();
      pose.translation() += error.tail<3>();
    }
    std::vector<ScanLink> links;
    for (const auto& [a, b] : scene.overlaps) {
      ScanLink link;
      link.a = test_support::ScanName(a);
      link.b = test_support::ScanName(b);
      link.T_a_b = seeming[a].inverse(Eigen::Isometry) * seeming[b];
      const double arm = link.T_a_b.translation().norm();
      link.information.diagonal() << Eigen::Vector3d::Constant(1 / (2 * kTurn * kTurn)),
          Eigen::Vector3d::Constant(1 / (2 * kShift * kShift + std::pow(kTurn * arm, 2)));
      links.push_back(link);
    }
    const auto adjusted = Adjust(PoseGraph::Create(test_support::NodesOf(scene), links).value());
    ASSERT_TRUE(adjusted.ok());
    EXPECT_LT(adjusted->chi2, 1e-3 * adjusted->degrees_of_freedom);
    for (size_t i = 1; i < scene.truth.size(); ++i) {
      const double chi2 =
          Chi2(test_support::PoseError(scene.truth[i], adjusted->scans[i].T_world_scan),
               adjusted->scans[i].covariance);
      squares += chi2 / 6;
      within += chi2 < 12.592 ? 1 : 0;
      ++count;
    }
  }
  // The links' independent part, of which there is nothing here, comes on top: so sigmas are too
  // large, but by less than a factor of two.
  EXPECT_LT(squares / count, 1.1);
  EXPECT_GT(squares / count, 0.25);
  EXPECT_GT(static_cast<double>(within) / count, 0.93);
}

TEST(AdjustTest, TheSameBitsInAnyOrderAndFromAnyStart) {
  const GraphScene scene = test_support::RingCorridorGraph(30, 3, 9);
  std::vector<ScanNode> nodes = test_support::NodesOf(scene);
  std::vector<ScanLink> links = test_support::LinksOf(scene, {}, 11);
  nodes[7].targets = {{"a", {1, 2, 0}, nodes[7].T_world_scan * Eigen::Vector3d(1, 2, 0), 0.003},
                      {"b", {3, 0, 1}, nodes[7].T_world_scan * Eigen::Vector3d(3, 0, 1), 0.003}};
  nodes[12].inclinometer = {nodes[12].T_world_scan.linear().transpose() * Eigen::Vector3d::UnitZ(),
                            1e-4};
  const auto first = Adjust(PoseGraph::Create(nodes, links).value());
  ASSERT_TRUE(first.ok());
  std::mt19937_64 random(3);
  for (int round = 0; round < 5; ++round) {
    std::shuffle(nodes.begin(), nodes.end(), random);
    std::shuffle(links.begin(), links.end(), random);
    for (ScanNode& node : nodes) {
      if (!node.fixed) node.T_world_scan = Shaken(node.T_world_scan, 0.3, 0.05, random);
      std::reverse(node.targets.begin(), node.targets.end());
    }
    const auto again = Adjust(PoseGraph::Create(nodes, links).value());
    ASSERT_TRUE(again.ok());
    for (size_t i = 0; i < first->scans.size(); ++i) {
      EXPECT_EQ(first->scans[i].id, again->scans[i].id);
      EXPECT_EQ(first->scans[i].T_world_scan.matrix(), again->scans[i].T_world_scan.matrix());
      EXPECT_EQ(first->scans[i].covariance, again->scans[i].covariance);
      EXPECT_EQ(first->scans[i].worst_link, again->scans[i].worst_link);
    }
  }
}

TEST(AdjustTest, CanonicalPosesStayAsTheyAre) {
  std::mt19937_64 random(21);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int k = 0; k < 2000; ++k) {
    Eigen::Quaterniond turn(unit(random), unit(random), unit(random), unit(random));
    // Quarter and half turns, where numbers of a quaternion are equal or vanish.
    if (k % 4 == 0) {
      turn = Eigen::AngleAxisd(0.5 * std::numbers::pi * (k % 5), Eigen::Vector3d::Unit(k % 3)) *
             Eigen::AngleAxisd(1e-7 * unit(random), Eigen::Vector3d::UnitX());
    }
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.linear() = turn.normalized().toRotationMatrix();
    pose.translation() = 300 * Eigen::Vector3d(unit(random), unit(random), unit(random));
    const Eigen::Isometry3d canonical = CanonicalPose(pose);
    EXPECT_EQ(CanonicalPose(canonical).matrix(), canonical.matrix());
    const Vector6d off = test_support::PoseError(pose, canonical);
    EXPECT_LT(off.tail<3>().cwiseAbs().maxCoeff(), 0.51 / 1048576);
    EXPECT_LT(off.head<3>().norm(), 5e-7);
    // What differs by rounding is the same pose, but for those beside the edge of a cell.
    Eigen::Isometry3d near = pose;
    near.translation() *= 1 + 1e-15;
    near.linear() = Eigen::Quaterniond(near.linear()).normalized().toRotationMatrix();
    EXPECT_EQ(CanonicalPose(near).matrix(), canonical.matrix());
  }
}

TEST(AdjustTest, PiecesAreHeldByThemselves) {
  GraphScene scene = test_support::RingCorridorGraph(12, 2, 5);
  std::vector<ScanLink> links = test_support::LinksOf(scene, {}, 5);
  std::erase_if(links,
                [](const ScanLink& l) { return (l.a < "scan-0006") != (l.b < "scan-0006"); });
  const auto graph = PoseGraph::Create(test_support::NodesOf(scene), links);
  ASSERT_TRUE(graph.ok());
  const auto adjusted = Adjust(*graph);
  ASSERT_TRUE(adjusted.ok());
  for (const size_t held : {size_t{0}, size_t{6}}) {
    EXPECT_TRUE(adjusted->scans[held].held);
    EXPECT_EQ(adjusted->scans[held].T_world_scan.matrix(), scene.truth[held].matrix());
    EXPECT_EQ(adjusted->scans[held].covariance, Matrix6d::Zero());
  }
  for (size_t i = 0; i < 12; ++i) {
    EXPECT_EQ(adjusted->scans[i].component, i < 6 ? 0u : 1u);
    EXPECT_LT((adjusted->scans[i].T_world_scan.translation() - scene.truth[i].translation()).norm(),
              0.1);
  }
  // A scan without links stays where it is.
  const auto alone = Adjust(PoseGraph::Create(test_support::NodesOf(scene), {}).value());
  ASSERT_TRUE(alone.ok());
  for (const AdjustedScan& scan : alone->scans) EXPECT_TRUE(scan.held);
  EXPECT_TRUE(Adjust(PoseGraph::Create({}, {}).value()).ok());
}

// Control alone holds a job: the poses as registered may be off by metres.
TEST(AdjustTest, ControlTargetsHoldEverything) {
  const GraphScene scene = test_support::RingCorridorGraph(20, 2, 6);
  std::vector<ScanNode> nodes = test_support::NodesOf(scene);
  Eigen::Isometry3d off = Eigen::Isometry3d::Identity();
  off.rotate(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()));
  off.translate(Eigen::Vector3d(3, -2, 0.2));
  for (ScanNode& node : nodes) {
    node.fixed = false;
    node.T_world_scan = off * node.T_world_scan;
  }
  const Eigen::Vector3d seen(2, 1, 0.5);
  for (const size_t i : {size_t{2}, size_t{8}, size_t{15}}) {
    nodes[i].targets = {{"t", seen, scene.truth[i] * seen, 0.002}};
  }
  const auto links = test_support::LinksOf(scene, {}, 6);
  const auto adjusted = Adjust(PoseGraph::Create(nodes, links).value());
  ASSERT_TRUE(adjusted.ok()) << adjusted.status();
  double squares = 0;
  for (size_t i = 0; i < scene.truth.size(); ++i) {
    EXPECT_FALSE(adjusted->scans[i].held);
    const Vector6d error = test_support::PoseError(scene.truth[i], adjusted->scans[i].T_world_scan);
    EXPECT_LT(error.tail<3>().norm(), 0.05);
    squares += Chi2(error, adjusted->scans[i].covariance) / 6;
  }
  EXPECT_LT(squares / static_cast<double>(scene.truth.size()), 4);
  // An inclinometer takes tilts: with it, they are known better.
  nodes[5].inclinometer = {scene.truth[5].linear().transpose() * Eigen::Vector3d::UnitZ(), 1e-5};
  const auto levelled = Adjust(PoseGraph::Create(nodes, links).value());
  ASSERT_TRUE(levelled.ok());
  EXPECT_LT(levelled->scans[5].covariance(0, 0), 1.01e-10);
  EXPECT_LT(levelled->scans[5].covariance(0, 0), 0.1 * adjusted->scans[5].covariance(0, 0));
  // One target leaves turns open, and says so.
  for (ScanNode& node : nodes) node.targets.clear();
  nodes[2].targets = {{"t", seen, scene.truth[2] * seen, 0.002}};
  nodes[5].inclinometer.reset();
  const auto open = Adjust(PoseGraph::Create(nodes, links).value());
  ASSERT_TRUE(open.ok());
  EXPECT_GT(open->scans[12].position_sigma, 5);
}

TEST(AdjustTest, AWrongLinkIsSuspect) {
  const GraphScene scene = test_support::RingCorridorGraph(30, 3, 2);
  std::vector<ScanLink> links = test_support::LinksOf(scene, {}, 2);
  links[40].T_a_b.translation() += Eigen::Vector3d(0.1, 0, 0);
  const auto graph = PoseGraph::Create(test_support::NodesOf(scene), links);
  ASSERT_TRUE(graph.ok());
  const auto adjusted = Adjust(*graph);
  ASSERT_TRUE(adjusted.ok());
  size_t worst = 0;
  for (size_t l = 0; l < adjusted->links.size(); ++l) {
    if (adjusted->links[l].test > adjusted->links[worst].test) worst = l;
  }
  EXPECT_EQ(graph->links()[worst].a, links[40].a);
  EXPECT_EQ(graph->links()[worst].b, links[40].b);
  EXPECT_TRUE(adjusted->links[worst].suspect);
  EXPECT_EQ(adjusted->scans[graph->NodeA(worst)].worst_link, worst);
  EXPECT_GT(adjusted->variance_factor, 1);
  // Where nothing checks a link it is never suspect.
  const GraphScene chain = test_support::RingCorridorGraph(6, 1, 2);
  std::vector<ScanLink> open = test_support::LinksOf(chain, {}, 2);
  std::erase_if(open, [](const ScanLink& l) { return l.b == "scan-0005" && l.a == "scan-0000"; });
  const auto unchecked = Adjust(PoseGraph::Create(test_support::NodesOf(chain), open).value());
  ASSERT_TRUE(unchecked.ok());
  for (const LinkFit& fit : unchecked->links) {
    EXPECT_EQ(fit.test_degrees, 0);
    EXPECT_FALSE(fit.suspect);
  }
  EXPECT_EQ(unchecked->degrees_of_freedom, 0);
}

TEST(AdjustTest, LinksInDoubtDoNotCountAndAreCompared) {
  const GraphScene scene = test_support::RingCorridorGraph(20, 2, 4);
  std::vector<ScanLink> links = test_support::LinksOf(scene, {}, 4);
  const auto without = Adjust(PoseGraph::Create(test_support::NodesOf(scene), links).value());
  ASSERT_TRUE(without.ok());
  ScanLink doubt = links[3];
  doubt.in_doubt = true;
  doubt.T_a_b.translation().x() += 2.5;
  links.push_back(doubt);
  const auto graph = PoseGraph::Create(test_support::NodesOf(scene), links);
  const auto with = Adjust(*graph);
  ASSERT_TRUE(with.ok());
  for (size_t i = 0; i < scene.truth.size(); ++i) {
    EXPECT_EQ(with->scans[i].T_world_scan.matrix(), without->scans[i].T_world_scan.matrix());
  }
  for (size_t l = 0; l < links.size(); ++l) {
    if (!graph->links()[l].in_doubt) continue;
    EXPECT_TRUE(with->links[l].suspect);
  }
}

TEST(AdjustTest, WhatNothingHoldsIsNamed) {
  const GraphScene scene = test_support::RingCorridorGraph(5, 1, 4);
  std::vector<ScanLink> links = test_support::LinksOf(scene, {}, 4);
  std::erase_if(links, [](const ScanLink& l) { return l.b == "scan-0004" && l.a == "scan-0000"; });
  // The last hangs on a link that knows no slide along x.
  for (ScanLink& link : links) {
    if (link.b != "scan-0004") continue;
    link.information.row(3).setZero();
    link.information.col(3).setZero();
  }
  const auto adjusted = Adjust(PoseGraph::Create(test_support::NodesOf(scene), links).value());
  ASSERT_FALSE(adjusted.ok());
  EXPECT_EQ(adjusted.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(adjusted.status().message()), testing::HasSubstr("scan-0004"));
}

// Links that hold some directions alone suffice together.
TEST(AdjustTest, PartialLinksSumUp) {
  const GraphScene scene = test_support::RingCorridorGraph(4, 1, 4);
  std::vector<ScanLink> links = test_support::LinksOf(scene, {.drawn = false}, 4);
  std::vector<ScanLink> split;
  for (const ScanLink& link : links) {
    for (int part = 0; part < 2; ++part) {
      ScanLink half = link;
      half.information.setZero();
      for (int k = 3 * part; k < 3 * part + 3; ++k) half.information(k, k) = 1e6;
      split.push_back(half);
    }
  }
  const auto adjusted = Adjust(PoseGraph::Create(test_support::NodesOf(scene), split).value());
  ASSERT_TRUE(adjusted.ok()) << adjusted.status();
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_LT(test_support::PoseError(scene.truth[i], adjusted->scans[i].T_world_scan)
                  .cwiseAbs()
                  .maxCoeff(),
              2e-6);
  }
}

}  // namespace
}  // namespace vantage::registration
