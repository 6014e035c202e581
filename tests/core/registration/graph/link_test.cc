// Links of scans in closed-form rooms, where the true relative pose is known.
#include "core/registration/graph/link.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <limits>
#include <random>

#include "core/parallel/thread_pool.h"
#include "core/sensor/presets.h"
#include "core/simulation/scenes/furnished_flat.h"
#include "core/simulation/simulated_scanner.h"
#include "core/simulation/standable_positions.h"
#include "tests/core/registration/box_scene.h"
#include "tests/support/graph_scenes.h"
#include "tests/support/runs.h"

namespace vantage::registration {
namespace {

LinkSurface SurfaceFrom(const BoxScene& scene, const Eigen::Isometry3d& pose, unsigned seed) {
  parallel::ThreadPool pool(2);
  return MakeLinkSurface(ScanScene(scene, pose, {}, seed), {}, pool);
}

// Only errors that the scenes have: white noise.
RegistrationConfig WhiteNoise() {
  RegistrationConfig config;
  config.correlated_sigma = 0;
  return config;
}

struct Placed {
  Eigen::Isometry3d truth;
  LinkSurface surface;
};
Placed PlacedIn(const BoxScene& scene, const Eigen::Isometry3d& truth, unsigned seed) {
  return {truth, SurfaceFrom(scene, truth, seed)};
}

sensor::Vector6d ErrorOf(const ScanLink& link, const Placed& a, const Placed& b) {
  return test_support::PoseError(a.truth.inverse(Eigen::Isometry) * b.truth, link.T_a_b);
}

TEST(LinkTest, FindsTheRelativePoseAndHowWellItIsKnown) {
  std::mt19937_64 random(3);
  double squares = 0;
  int links = 0;
  int within = 0;
  for (unsigned room = 1; room <= 4; ++room) {
    const BoxScene scene = FurnishedRoom(room);
    const Placed a = PlacedIn(scene, PoseAt({-1.0, -0.6, 1.4}, 0.3), 10 * room);
    const Placed b = PlacedIn(scene, PoseAt({0.9, 0.1, 1.5}, 2.1, 0.01, -0.02), 10 * room + 1);
    for (int start = 0; start < 3; ++start) {
      const Eigen::Isometry3d at_b = Disturbed(b.truth, 0.05, 0.01, random);
      const LinkOutcome outcome =
          LinkScans({"a", a.surface, a.truth}, {"b", b.surface, at_b}, WhiteNoise());
      ASSERT_TRUE(outcome.link.has_value()) << outcome.reason;
      EXPECT_FALSE(outcome.link->in_doubt) << outcome.reason;
      EXPECT_EQ(outcome.constrained_directions, 6);
      EXPECT_GT(outcome.overlap_share, 0.5);
      EXPECT_LT(outcome.contradiction_share, 0.02);
      const sensor::Vector6d error = ErrorOf(*outcome.link, a, b);
      EXPECT_LT(error.tail<3>().norm(), 0.001);
      EXPECT_LT(error.head<3>().norm(), 0.0004);
      const double chi2 = error.dot(outcome.link->information * error);
      squares += chi2 / 6;
      within += chi2 < 12.592 ? 1 : 0;
      ++links;
    }
  }
  // Errors are about as large as they are said to be, and hardly larger.
  EXPECT_GT(squares / links, 0.1);
  EXPECT_LT(squares / links, 1.5);
  EXPECT_GE(within, links - 2);
}

TEST(LinkTest, DoesNotDependOnWhichIsCalledFirst) {
  const BoxScene scene = FurnishedRoom(4);
  const Placed a = PlacedIn(scene, PoseAt({-1.0, -0.6, 1.4}, 0.3), 1);
  const Placed b = PlacedIn(scene, PoseAt({0.9, 0.1, 1.5}, 2.1), 2);
  const PlacedSurface first{"a", a.surface, a.truth};
  const PlacedSurface second{"b", b.surface, b.truth};
  const LinkOutcome forth = LinkScans(first, second, {});
  const LinkOutcome back = LinkScans(second, first, {});
  ASSERT_TRUE(forth.link.has_value() && back.link.has_value());
  EXPECT_EQ(back.link->a, "a");
  EXPECT_EQ(forth.link->T_a_b.matrix(), back.link->T_a_b.matrix());
  EXPECT_EQ(forth.link->information, back.link->information);
}

// With errors that are shared it is believed less, as configured.
TEST(LinkTest, SharedErrorsCount) {
  const BoxScene scene = FurnishedRoom(2);
  const Placed a = PlacedIn(scene, PoseAt({-1.0, -0.6, 1.4}, 0.3), 1);
  const Placed b = PlacedIn(scene, PoseAt({0.9, 0.1, 1.5}, 2.1), 2);
  const PlacedSurface first{"a", a.surface, a.truth};
  const PlacedSurface second{"b", b.surface, b.truth};
  const auto sigma = [](const LinkOutcome& outcome) {
    const sensor::Matrix6d c = outcome.link->information.inverse();
    return std::sqrt(c.bottomRightCorner<3, 3>().trace());
  };
  const double white = sigma(LinkScans(first, second, WhiteNoise()));
  const double shared = sigma(LinkScans(first, second, {}));
  EXPECT_GT(shared, 2 * white);
  EXPECT_LT(shared, 0.003);
}

// A bare corridor leaves the slide along it open: there the poses have their way, and the link says
// little of it, but says all the rest.
TEST(LinkTest, ABareCorridorLeavesTheSlideOpen) {
  const BoxScene scene = Corridor();
  const Placed a = PlacedIn(scene, PoseAt({0, 0.1, 1.4}, 0.3), 1);
  const Placed b = PlacedIn(scene, PoseAt({4, -0.1, 1.4}, 1.0), 2);
  Eigen::Isometry3d at_b = b.truth;
  at_b.pretranslate(Eigen::Vector3d(0.04, 0.01, -0.01));
  const LinkOutcome outcome =
      LinkScans({"a", a.surface, a.truth}, {"b", b.surface, at_b}, {}, {.open_sigma = 0.5});
  ASSERT_TRUE(outcome.link.has_value()) << outcome.reason;
  EXPECT_LT(outcome.constrained_directions, 6);
  // In the corridor's axes.
  const Eigen::Matrix3d turn = a.truth.linear();
  const sensor::Matrix6d c = outcome.link->information.inverse();
  const Eigen::Matrix3d position = turn * c.bottomRightCorner<3, 3>() * turn.transpose();
  EXPECT_GT(std::sqrt(position(0, 0)), 0.3);
  EXPECT_LT(std::sqrt(position(0, 0)), 0.8);
  EXPECT_LT(std::sqrt(position(1, 1)), 0.01);
  EXPECT_LT(std::sqrt(position(2, 2)), 0.01);
  const Eigen::Vector3d off = turn * ErrorOf(*outcome.link, a, b).tail<3>();
  EXPECT_NEAR(off.x(), 0.04, 0.01);
  EXPECT_NEAR(off.y(), 0, 0.002);
  EXPECT_NEAR(off.z(), 0, 0.002);
}

// Of a panel in a corridor one scan has the front, the other, beside it, the frame, 6 cm behind.
// They are not one plane, and nothing else tells where along the corridor the scans were made.
TEST(LinkTest, TwoThingsSideBySideAreNotTakenForOne) {
  BoxScene front = Corridor();
  BoxScene frame = Corridor();
  front.solids.emplace_back(Eigen::Vector3d(3.0, -0.4, 0.5), Eigen::Vector3d(3.3, 0.2, 1.6));
  frame.solids.emplace_back(Eigen::Vector3d(3.06, 0.2, 0.5), Eigen::Vector3d(3.3, 0.8, 1.6));
  const Placed a = PlacedIn(front, PoseAt({0, 0.1, 1.4}, 0.3), 1);
  const Placed b = PlacedIn(frame, PoseAt({1, -0.1, 1.4}, 1.0), 2);
  const LinkOutcome outcome =
      LinkScans({"a", a.surface, a.truth}, {"b", b.surface, b.truth}, {}, {.open_sigma = 0.5});
  ASSERT_TRUE(outcome.link.has_value()) << outcome.reason;
  EXPECT_LT(outcome.constrained_directions, 6);
  const Eigen::Vector3d off = a.truth.linear() * ErrorOf(*outcome.link, a, b).tail<3>();
  EXPECT_LT(off.norm(), 0.01);
  const sensor::Matrix6d c = outcome.link->information.inverse();
  const Eigen::Matrix3d position =
      a.truth.linear() * c.bottomRightCorner<3, 3>() * a.truth.linear().transpose();
  EXPECT_GT(std::sqrt(position(0, 0)), 0.3);
}

// Chi-square of six, at 99.9 %: of links of scans all over furnished flats, in which doors, frames
// and cupboards stand side by side, none is off by more than it says. `TwoThingsSideBySide...` is
// what a twentieth of them would fall for.
TEST(LinkTest, InFlatsNoneIsOffByMoreThanItSays) {
  parallel::ThreadPool pool(2);
  size_t links = 0;
  for (const uint64_t seed : {201, 202}) {
    const simulation::Scene flat = simulation::FurnishedFlat(seed);
    const simulation::SimulatedScanner tracer(flat.mesh);
    const sensor::ScannerModel scanner = sensor::FindPreset("leica-rtc360")->model;
    const std::vector<Eigen::Vector3d> places = simulation::StandablePositions(
        tracer, flat.mesh.Bounds(), flat.starts[0], 0, 1.5, 0.35, 0.3);
    ASSERT_FALSE(places.empty());
    std::mt19937_64 random(seed);
    std::vector<Placed> placed;
    for (uint64_t i = 0; i < test_support::Runs(12u); ++i) {
      const Eigen::Vector3d& place = places[random() % places.size()];
      const Eigen::Isometry3d truth =
          PoseAt(place, 0.01 * static_cast<double>(random() % 628), 0.008, -0.005);
      const sensor::Scan scan{
          tracer.Scan(scanner, truth, {}, i + 1, pool, sensor::Radians(0.3)), scanner, {}};
      placed.push_back({truth, MakeLinkSurface(scan, {}, pool)});
    }
    for (size_t i = 0; i < placed.size(); ++i) {
      for (size_t j = 0; j < i; ++j) {
        const PlacedSurface a{"a", placed[i].surface, placed[i].truth};
        const PlacedSurface b{"b", placed[j].surface, placed[j].truth};
        if (!MayOverlap(a, b)) continue;
        const LinkOutcome outcome = LinkScans(a, b, {});
        if (!outcome.link.has_value()) continue;
        ++links;
        const sensor::Vector6d error = ErrorOf(*outcome.link, placed[i], placed[j]);
        EXPECT_LT(error.dot(outcome.link->information * error), 22.458)
            << "flat " << seed << ", scans " << i << " and " << j << ", off by "
            << error.tail<3>().norm() << " m and " << error.head<3>().norm() << " rad";
      }
    }
  }
  EXPECT_GT(links, test_support::Runs(50u));
}

TEST(LinkTest, NoLinkWhereNothingIsShared) {
  const BoxScene scene = FurnishedRoom(5);
  const Placed a = PlacedIn(scene, PoseAt({-1.0, -0.6, 1.4}, 0.3), 1);
  const Placed b = PlacedIn(scene, PoseAt({0.9, 0.1, 1.5}, 2.1), 2);
  const auto link_at = [&](const Eigen::Isometry3d& at_b, const LinkOptions& options = {}) {
    return LinkScans({"a", a.surface, a.truth}, {"b", b.surface, at_b}, {}, options);
  };
  Eigen::Isometry3d away = b.truth;
  away.translation().z() += 40;
  EXPECT_THAT(link_at(away).reason, testing::HasSubstr("too little surface"));
  EXPECT_FALSE(MayOverlap({"a", a.surface, a.truth}, {"b", b.surface, away}));
  EXPECT_TRUE(MayOverlap({"a", a.surface, a.truth}, {"b", b.surface, b.truth}));
  // A pose that is wrong by more than it may be.
  Eigen::Isometry3d wrong = b.truth;
  wrong.translation().x() += 1.5;
  const LinkOutcome refused = link_at(wrong);
  EXPECT_TRUE(!refused.link.has_value() || refused.link->in_doubt) << refused.contradiction_share;
  // Drift of 0.4 m is bridged when it is said.
  Eigen::Isometry3d drifted = b.truth;
  drifted.translation() += Eigen::Vector3d(0.25, -0.2, 0.05);
  const LinkOutcome found = link_at(drifted, {.reach = 0.5});
  ASSERT_TRUE(found.link.has_value()) << found.reason;
  EXPECT_LT(ErrorOf(*found.link, a, b).tail<3>().norm(), 0.003);
  EXPECT_NEAR(found.moved, 0.32, 0.1);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), 1e300, 1e9}) {
    Eigen::Isometry3d pose = b.truth;
    pose.translation().x() = bad;
    EXPECT_THAT(link_at(pose).reason, testing::HasSubstr("too far apart"));
  }
}

TEST(LinkTest, WhatIsKeptOfAScanIsBounded) {
  const Placed a = PlacedIn(FurnishedRoom(5), PoseAt({-1.0, -0.6, 1.4}, 0.3), 1);
  EXPECT_LE(a.surface.samples.size(), kMostPatches);
  EXPECT_GT(a.surface.samples.size(), 500u);
  EXPECT_LT(a.surface.MemoryBytes(), 700'000u);
  // The free range ends before what is seen: towards the wall at x = -3 from x = -1.
  EXPECT_NEAR(a.surface.FreeRangeTowards(a.truth.inverse() * Eigen::Vector3d(-3, -0.6, 1.45)), 2,
              0.6);
  EXPECT_EQ(LinkSurface().FreeRangeTowards({1, 0, 0}), 0);
}

}  // namespace
}  // namespace vantage::registration
