// Links in doubt at the end of a chain of scans around a corridor that repeats itself every 2.5 m.
#include "core/registration/graph/consistency.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "core/registration/graph/adjust.h"
#include "tests/support/graph_scenes.h"

namespace vantage::registration {
namespace {

using test_support::GraphScene;
using test_support::LinkNoise;

constexpr double kBay = 2.5;  // m
// One sigma of a link of the chain and of a turn: at the end of forty, 5 cm are open, and 2 m.
constexpr LinkNoise kGoodChain = {.position_sigma = 0.002, .turn_sigma = 0.0001};
constexpr LinkNoise kVagueChain = {.position_sigma = 0.15, .turn_sigma = 0.0005};

// A chain of forty scans, and links in doubt between its last and its first.
class RepeatingCorridor {
 public:
  RepeatingCorridor(uint64_t seed, const LinkNoise& chain)
      : scene_(test_support::RingCorridorGraph(40, 1, seed)) {
    nodes_ = test_support::NodesOf(scene_);
    links_ = test_support::LinksOf(scene_, chain, seed);
    std::erase_if(links_,
                  [](const ScanLink& l) { return l.a == "scan-0000" && l.b != "scan-0001"; });
    GraphScene closures = scene_;
    closures.overlaps = {{0, 36}, {0, 37}, {1, 38}, {1, 39}, {2, 38}, {2, 39}};
    right_ = test_support::LinksOf(closures, {.position_sigma = 0.002}, seed + 1000);
  }

  // The link that closes the loop with that number, as if b lay `along` the corridor (m) from where
  // it lies.
  void Doubt(size_t number, double along) {
    ScanLink link = right_[number];
    link.T_a_b.pretranslate(scene_.truth[IndexOf(link.a)].linear().transpose() *
                            Eigen::Vector3d(0, along, 0));
    link.in_doubt = true;
    links_.push_back(link);
  }

  PoseGraph Graph() const { return PoseGraph::Create(nodes_, links_).value(); }
  const GraphScene& scene() const { return scene_; }
  size_t closures() const { return right_.size(); }

  // Whether a link in doubt is one of the right ones.
  bool Right(const ScanLink& link) const {
    return std::any_of(right_.begin(), right_.end(), [&](const ScanLink& r) {
      return r.a == link.a && r.b == link.b && r.T_a_b.matrix() == link.T_a_b.matrix();
    });
  }

 private:
  size_t IndexOf(const std::string& id) const {
    for (size_t i = 0; i < nodes_.size(); ++i) {
      if (nodes_[i].id == id) return i;
    }
    return 0;
  }
  GraphScene scene_;
  std::vector<ScanNode> nodes_;
  std::vector<ScanLink> links_;
  std::vector<ScanLink> right_;
};

struct Count {
  int right_accepted = 0;
  int right_rejected = 0;
  int right_open = 0;
  int wrong_accepted = 0;
  int wrong_rejected = 0;
  int wrong_open = 0;
};
Count CountOf(const RepeatingCorridor& corridor, LinkDecisions* out = nullptr) {
  const PoseGraph graph = corridor.Graph();
  const auto decisions = DecideLinks(graph);
  EXPECT_TRUE(decisions.ok()) << decisions.status();
  Count count;
  for (size_t l = 0; l < graph.links().size(); ++l) {
    const LinkJudgement& judgement = decisions->links[l];
    if (!graph.links()[l].in_doubt) {
      EXPECT_EQ(judgement.decision, LinkDecision::kCertain);
      EXPECT_TRUE(decisions->keep[l]);
      continue;
    }
    EXPECT_FALSE(judgement.reason.empty());
    EXPECT_EQ(decisions->keep[l], judgement.decision == LinkDecision::kAccepted);
    const bool right = corridor.Right(graph.links()[l]);
    switch (judgement.decision) {
      case LinkDecision::kAccepted:
        ++(right ? count.right_accepted : count.wrong_accepted);
        break;
      case LinkDecision::kRejected:
        ++(right ? count.right_rejected : count.wrong_rejected);
        break;
      default:
        ++(right ? count.right_open : count.wrong_open);
    }
  }
  if (out != nullptr) *out = *decisions;
  return count;
}

TEST(ConsistencyTest, RightLinksThatAgreeCloseTheLoop) {
  int accepted = 0;
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    RepeatingCorridor corridor(seed, kGoodChain);
    for (size_t k = 0; k < corridor.closures(); ++k) corridor.Doubt(k, 0);
    LinkDecisions decisions;
    accepted += CountOf(corridor, &decisions).right_accepted;
    EXPECT_EQ(decisions.largest_bound, decisions.largest_set);
    const auto closed = Adjust(corridor.Graph().WithLinks(decisions.keep));
    ASSERT_TRUE(closed.ok());
    EXPECT_LT(
        (closed->scans[39].T_world_scan.translation() - corridor.scene().truth[39].translation())
            .norm(),
        0.03);
  }
  // Of sixty right links one in a thousand contradicts by chance, and of pairs one more.
  EXPECT_GE(accepted, 57);
}

// All wrong ones are one bay off, so that they agree with each other as well as right ones do.
TEST(ConsistencyTest, PeriodicLinksThatTheChainContradictsAreRejected) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    RepeatingCorridor wrong(seed, kGoodChain);
    for (size_t k = 0; k < wrong.closures(); ++k) wrong.Doubt(k, seed % 2 == 0 ? kBay : -kBay);
    EXPECT_EQ(CountOf(wrong).wrong_rejected, 6);
    RepeatingCorridor both(seed, kGoodChain);
    for (size_t k = 0; k < both.closures(); ++k) both.Doubt(k, kBay);
    for (size_t k = 0; k < 2; ++k) both.Doubt(k, 0);
    const Count count = CountOf(both);
    EXPECT_EQ(count.wrong_accepted, 0);
    EXPECT_GE(count.wrong_rejected, 5);
  }
}

// Where nothing certain would notice a bay, a set that agrees is no evidence, however large it is.
TEST(ConsistencyTest, PeriodicLinksThatNothingToldApartStayOpen) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    RepeatingCorridor wrong(seed, kVagueChain);
    for (size_t k = 0; k < wrong.closures(); ++k) wrong.Doubt(k, kBay);
    EXPECT_EQ(CountOf(wrong).wrong_accepted, 0);
    RepeatingCorridor both(seed, kVagueChain);
    for (size_t k = 0; k < both.closures(); ++k) {
      both.Doubt(k, 0);
      both.Doubt(k, kBay);
      both.Doubt(k, -kBay);
    }
    const Count count = CountOf(both);
    EXPECT_EQ(count.wrong_accepted + count.right_accepted, 0);
    EXPECT_GT(count.right_open, 0);
  }
}

// A scan in doubt between bays: the chain tells them apart, link by link.
TEST(ConsistencyTest, TheChainDecidesBetweenAlternatives) {
  for (uint64_t seed = 1; seed <= 10; ++seed) {
    RepeatingCorridor corridor(seed, kGoodChain);
    for (const double along : {0.0, kBay, -kBay}) corridor.Doubt(2, along);
    const Count count = CountOf(corridor);
    EXPECT_EQ(count.wrong_rejected, 2);
    EXPECT_EQ(count.right_accepted + count.right_rejected, 1);
    // Without them, nothing speaks for the link but itself.
    RepeatingCorridor alone(seed, kGoodChain);
    alone.Doubt(2, 0);
    EXPECT_EQ(CountOf(alone).right_accepted, 0);
  }
}

TEST(ConsistencyTest, WrongLinksWithinWhatTheChainLeavesOpen) {
  std::mt19937_64 random(77);
  int right = 0;
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    RepeatingCorridor corridor(seed, {.position_sigma = 0.008, .turn_sigma = 0.0003});
    for (size_t k = 0; k < corridor.closures(); ++k) corridor.Doubt(k, 0);
    std::uniform_real_distribution<double> off(0.25, 0.4);
    for (size_t k = 0; k < 4; ++k) corridor.Doubt(k, (k % 2 == 0 ? 1 : -1) * off(random));
    const Count count = CountOf(corridor);
    EXPECT_EQ(count.wrong_accepted, 0);
    right += count.right_accepted;
  }
  // Of 120; what the wrong ones leave open is not all.
  EXPECT_GE(right, 80);
}

TEST(ConsistencyTest, DependsOnTheSetAlone) {
  RepeatingCorridor corridor(3, kGoodChain);
  for (size_t k = 0; k < corridor.closures(); ++k) {
    corridor.Doubt(k, 0);
    if (k % 2 == 0) corridor.Doubt(k, 0.3);
  }
  const PoseGraph graph = corridor.Graph();
  const auto first = DecideLinks(graph);
  ASSERT_TRUE(first.ok());
  std::vector<ScanNode> nodes = graph.nodes();
  std::vector<ScanLink> links = graph.links();
  std::mt19937_64 random(5);
  for (int round = 0; round < 5; ++round) {
    std::shuffle(nodes.begin(), nodes.end(), random);
    std::shuffle(links.begin(), links.end(), random);
    for (size_t l = 0; l < links.size(); l += 3) links[l] = Reversed(Reversed(links[l]));
    links = graph.links();
    std::shuffle(links.begin(), links.end(), random);
    const auto again = DecideLinks(PoseGraph::Create(nodes, links).value());
    ASSERT_TRUE(again.ok());
    for (size_t l = 0; l < links.size(); ++l) {
      EXPECT_EQ(first->links[l].decision, again->links[l].decision);
      EXPECT_EQ(first->links[l].chain_test, again->links[l].chain_test);
      EXPECT_EQ(first->links[l].reason, again->links[l].reason);
    }
  }
}

TEST(ConsistencyTest, ScansThatNothingCertainTiesStayOpen) {
  const GraphScene scene = test_support::RingCorridorGraph(12, 2, 5);
  std::vector<ScanLink> links = test_support::LinksOf(scene, {}, 5);
  for (ScanLink& link : links) link.in_doubt = (link.a < "scan-0006") != (link.b < "scan-0006");
  const auto decisions =
      DecideLinks(PoseGraph::Create(test_support::NodesOf(scene), links).value());
  ASSERT_TRUE(decisions.ok());
  int open = 0;
  for (const LinkJudgement& judgement : decisions->links) {
    EXPECT_NE(judgement.decision, LinkDecision::kAccepted);
    if (judgement.decision == LinkDecision::kOpen) {
      ++open;
      EXPECT_THAT(judgement.reason, testing::HasSubstr("nothing that is certain"));
      EXPECT_GT(judgement.agrees, 0u);
    }
  }
  EXPECT_EQ(open, 6);
}

TEST(ConsistencyTest, TooManyInDoubtAreRefused) {
  const GraphScene scene = test_support::RingCorridorGraph(12, 1, 5);
  std::vector<ScanLink> links = test_support::LinksOf(scene, {}, 5);
  ScanLink doubt = links[0];
  doubt.in_doubt = true;
  links.insert(links.end(), kMostDoubtfulLinks + 1, doubt);
  const auto decisions =
      DecideLinks(PoseGraph::Create(test_support::NodesOf(scene), links).value());
  EXPECT_EQ(decisions.status().code(), absl::StatusCode::kResourceExhausted);
}

}  // namespace
}  // namespace vantage::registration
