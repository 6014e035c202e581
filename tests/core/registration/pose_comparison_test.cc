// What a scan at a pose fits and contradicts, against rooms in which that follows in closed form.
#include "core/registration/pose_comparison.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/parallel/thread_pool.h"
#include "tests/core/registration/box_scene.h"

namespace vantage::registration {
namespace {

class PoseComparisonTest : public testing::Test {
 protected:
  // The bare room is 6 x 5 x 2.7 m around the origin.
  static constexpr double kEndWall = 5 * 2.7;  // m2

  PoseComparison Compare(const std::vector<Eigen::Isometry3d>& poses,
                         const ComparisonSize& size = {}, int threads = 2) {
    parallel::ThreadPool pool(threads);
    auto compared = ComparePoses(*model_, scan_, poses, {}, size, pool);
    EXPECT_TRUE(compared.ok()) << compared.status();
    return compared.ok() ? *std::move(compared) : PoseComparison{};
  }
  Eigen::Isometry3d Moved(double x) const {
    Eigen::Isometry3d pose = truth_;
    pose.pretranslate(Eigen::Vector3d(x, 0, 0));
    return pose;
  }
  static const Disagreement* Find(const ComparedPose& pose, DisagreementKind kind) {
    const auto found = std::find_if(pose.disagreements.begin(), pose.disagreements.end(),
                                    [&](const Disagreement& d) { return d.kind == kind; });
    return found == pose.disagreements.end() ? nullptr : &*found;
  }

  const ScanSettings settings_{.step = sensor::Radians(0.5), .noise = 0.001, .blind = {}};
  const Eigen::Isometry3d truth_ = PoseAt({0.3, 0.2, 1.4}, 0.7);
  const std::shared_ptr<const model::PlanningView> model_ =
      ModelFromScan(BareRoom(), PoseAt({-0.4, -0.3, 1.5}, 0), settings_, 3);
  sensor::Scan scan_ = ScanScene(BareRoom(), truth_, settings_, 4);
};

TEST_F(PoseComparisonTest, AtItsPlaceAScanFitsAndContradictsNothing) {
  const PoseComparison compared = Compare({truth_});
  const ComparedPose& pose = compared.poses.front();
  EXPECT_GT(pose.overlap_share, 0.9);
  EXPECT_LT(pose.rms_residual, 0.003);
  EXPECT_LT(pose.contradiction_share, 0.002);
  EXPECT_TRUE(pose.disagreements.empty()) << pose.disagreements.front().words;
  EXPECT_EQ(pose.surface_seen_through, 0);
  EXPECT_GT(pose.surface_in_sight, 2 * kEndWall) << "both end walls";
  EXPECT_EQ(compared.points.size(), pose.states.size());
  EXPECT_EQ(compared.points.size(), pose.residuals.size());
  EXPECT_EQ(compared.points.size(), compared.normals.size());
  EXPECT_EQ(compared.surface.pieces.size(), pose.sights.size());
}

// Half a metre along x: one end wall seems to lie behind the known one, which is then seen through,
// and the other stands in the room.
TEST_F(PoseComparisonTest, MovedThroughAWallItSaysWhichAndHowMuch) {
  constexpr double kMoved = 0.5;
  const PoseComparison compared = Compare({truth_, Moved(kMoved)});
  const ComparedPose& pose = compared.poses[1];
  const Disagreement* behind = Find(pose, DisagreementKind::kBehindSurface);
  ASSERT_NE(behind, nullptr);
  // With the strips of side walls, floor and ceiling that lie behind it with it.
  const double strips = 2 * (5 + 2.7) * kMoved;
  EXPECT_GT(behind->area, 0.9 * kEndWall);
  EXPECT_LT(behind->area, 1.1 * (kEndWall + strips));
  EXPECT_GT(behind->centre.x(), 3 + kMoved / 2);
  EXPECT_LT(behind->centre.x(), 3 + kMoved + 0.05);
  EXPECT_NEAR(behind->centre.y(), 0, 0.3);
  EXPECT_EQ(behind->words, "sees through a wall");
  const Disagreement* inside = Find(pose, DisagreementKind::kInEmptySpace);
  ASSERT_NE(inside, nullptr);
  // Nearer than two and a half voxels to other surface nothing is sure to be empty.
  const double sure = (5 - 5 * model_->voxel_size()) * (2.7 - 5 * model_->voxel_size());
  EXPECT_NEAR(inside->area, sure, 0.1 * sure);
  EXPECT_NEAR(inside->centre.x(), -3 + kMoved, 0.05);
  const Disagreement* through = Find(pose, DisagreementKind::kSeenThrough);
  ASSERT_NE(through, nullptr);
  EXPECT_NEAR(through->area, kEndWall, 0.15 * kEndWall);
  EXPECT_NEAR(through->centre.x(), 3, 0.05);
  EXPECT_LT(pose.overlap_share, compared.poses[0].overlap_share);
  EXPECT_GT(pose.contradiction_share, 0.15);
}

TEST_F(PoseComparisonTest, ResidualsAreDistancesBeforeTheSurface) {
  constexpr double kMoved = 0.02;  // m, within reach
  const PoseComparison compared = Compare({Moved(kMoved)});
  const ComparedPose& pose = compared.poses.front();
  double before = 0;
  double behind = 0;
  int on_first = 0;
  int on_second = 0;
  for (size_t i = 0; i < compared.points.size(); ++i) {
    if (pose.states[i] != SampleState::kFits) continue;
    EXPECT_LE(std::abs(pose.residuals[i]), compared.reach);
    const Eigen::Vector3d normal = pose.T_world_scan.linear() * compared.normals[i].cast<double>();
    if (normal.x() > 0.95) before += pose.residuals[i], ++on_first;    // the wall at -x
    if (normal.x() < -0.95) behind += pose.residuals[i], ++on_second;  // at +x
  }
  ASSERT_GT(on_first, 100);
  ASSERT_GT(on_second, 100);
  EXPECT_NEAR(before / on_first, kMoved, 0.002);
  EXPECT_NEAR(behind / on_second, -kMoved, 0.002);
}

TEST_F(PoseComparisonTest, ThinnedSurfaceKeepsItsArea) {
  const Eigen::AlignedBox3d box(Eigen::Vector3d(-4, -4, -1), Eigen::Vector3d(4, 4, 4));
  const KnownSurface all = SurfaceIn(*model_, box, 1'000'000);
  EXPECT_EQ(all.spacing, model_->voxel_size());
  const auto area = [](const KnownSurface& surface) {
    double sum = 0;
    for (const SurfacePiece& piece : surface.pieces) sum += piece.area;
    return sum;
  };
  double spacing = all.spacing;
  for (const size_t most : {5000, 1000, 100}) {
    const KnownSurface some = SurfaceIn(*model_, box, most);
    EXPECT_LE(some.pieces.size(), most);
    EXPECT_NEAR(area(some), area(all), 1e-3 * area(all));
    EXPECT_GT(some.spacing, spacing) << "fewer pieces are larger";
    spacing = some.spacing;
  }
  // As many as there are room for, or nearly: a picture is made of them.
  EXPECT_GT(SurfaceIn(*model_, box, 1000).pieces.size(), 350U);
  EXPECT_TRUE(SurfaceIn(*model_,
                        Eigen::AlignedBox3d(Eigen::Vector3d(50, 0, 0), Eigen::Vector3d(60, 1, 1)),
                        100)
                  .pieces.empty());
}

TEST_F(PoseComparisonTest, AsFewAsWereAskedForAndTheSameOnAnyNumberOfThreads) {
  const ComparisonSize size{.samples = 500, .surface = 800};
  const PoseComparison a = Compare({truth_, Moved(1)}, size, 1);
  const PoseComparison b = Compare({truth_, Moved(1)}, size, 3);
  EXPECT_EQ(a.points.size(), 500U);
  EXPECT_LE(a.surface.pieces.size(), 800U);
  for (size_t i = 0; i < a.poses.size(); ++i) {
    EXPECT_EQ(a.poses[i].states, b.poses[i].states);
    EXPECT_EQ(a.poses[i].residuals, b.poses[i].residuals);
    EXPECT_EQ(a.poses[i].sights, b.poses[i].sights);
    EXPECT_EQ(a.poses[i].contradiction_share, b.poses[i].contradiction_share);
    ASSERT_EQ(a.poses[i].disagreements.size(), b.poses[i].disagreements.size());
    for (size_t k = 0; k < a.poses[i].disagreements.size(); ++k) {
      EXPECT_EQ(a.poses[i].disagreements[k].centre, b.poses[i].disagreements[k].centre);
    }
  }
}

// What a column hides from the pose, what lies behind the scanner's zenith, and what has no return.
TEST_F(PoseComparisonTest, OnlySurfaceInSightCounts) {
  BoxScene with_column = BareRoom();
  with_column.solids.emplace_back(Eigen::Vector3d(1.2, -0.4, 0), Eigen::Vector3d(1.6, 0.4, 2.7));
  const auto model = ModelFromScan(with_column, PoseAt({2.3, 1.9, 1.4}, 0), settings_, 5);
  const Eigen::Isometry3d pose = PoseAt({-0.5, 0, 1.4}, 0.4);
  sensor::Scan scan = ScanScene(with_column, pose, settings_, 6);
  parallel::Serial serial;
  const auto on_end_wall = [](double y, double z) {
    return SurfacePiece{Eigen::Vector3f(3, static_cast<float>(y), static_cast<float>(z)),
                        -Eigen::Vector3f::UnitX(), 1};
  };
  // From x = -0.5 the column, 0.8 m wide at 1.7 m, hides the wall at 3.5 m for |y| < 0.82.
  std::vector<SurfacePiece> pieces = {on_end_wall(0, 1.4), on_end_wall(0.5, 1.4),
                                      on_end_wall(1.8, 1.4)};
  pieces.push_back(pieces.back());
  pieces.back().normal *= -1;  // turned away
  auto sights = SightsOf(*model, pieces, scan, pose, serial);
  EXPECT_EQ(sights[0], SurfaceSight::kOutOfSight);
  EXPECT_EQ(sights[1], SurfaceSight::kOutOfSight);
  EXPECT_EQ(sights[2], SurfaceSight::kSeen);
  EXPECT_EQ(sights[3], SurfaceSight::kOutOfSight);
  const auto all = [&](float range) {
    std::fill(scan.image.range.begin(), scan.image.range.end(), range);
    return SightsOf(*model, pieces, scan, pose, serial)[2];
  };
  EXPECT_EQ(all(sensor::RangeImage::kNoReturn), SurfaceSight::kNoReturn);
  EXPECT_EQ(all(sensor::RangeImage::kNoInformation), SurfaceSight::kOutOfSight);
  EXPECT_EQ(all(1.0f), SurfaceSight::kHidden);
  EXPECT_EQ(all(20.0f), SurfaceSight::kSeenThrough);
}

TEST(GroupDisagreementsTest, NeighboursOfAKindAreOneGroupAndTheLargestComesFirst) {
  std::vector<DisagreeingPiece> pieces;
  const auto add = [&](DisagreementKind kind, double x, int count, const Eigen::Vector3f& through) {
    for (int i = 0; i < count; ++i) {
      pieces.push_back({kind, {x + 0.1 * i, 0, 1}, through, 0.5});
    }
  };
  add(DisagreementKind::kInEmptySpace, 0, 4, Eigen::Vector3f::Zero());
  add(DisagreementKind::kBehindSurface, 0, 10, Eigen::Vector3f::UnitX());
  add(DisagreementKind::kBehindSurface, 5, 5, Eigen::Vector3f::UnitX());
  add(DisagreementKind::kBehindSurface, 5, 3, Eigen::Vector3f::UnitZ());
  add(DisagreementKind::kSeenThrough, 9, 2, Eigen::Vector3f::UnitX());  // too few
  const auto groups = GroupDisagreements(pieces, {}, 0.2, 10);
  ASSERT_EQ(groups.size(), 4U);
  EXPECT_DOUBLE_EQ(groups[0].area, 5);
  EXPECT_NEAR(groups[0].centre.x(), 0.45, 1e-12);
  EXPECT_EQ(groups[0].words, "sees through a wall");
  EXPECT_DOUBLE_EQ(groups[1].area, 2.5);
  EXPECT_DOUBLE_EQ(groups[2].area, 2);
  EXPECT_EQ(groups[2].kind, DisagreementKind::kInEmptySpace);
  EXPECT_DOUBLE_EQ(groups[3].area, 1.5);
  EXPECT_EQ(groups[3].words, "sees through the floor");
  EXPECT_EQ(GroupDisagreements(pieces, {}, 0.2, 2).size(), 2U);
  // The second lies in the cube of none that is behind surface.
  const std::vector<UnknownPiece> unknown = {{{0.15, 0, 1}, 0.25}, {{0.05, 3, 1}, 0.25}};
  EXPECT_DOUBLE_EQ(GroupDisagreements(pieces, unknown, 0.2, 10)[0].area, 5.25);
  std::reverse(pieces.begin(), pieces.end());
  EXPECT_EQ(GroupDisagreements(pieces, {}, 0.2, 10)[0].words, groups[0].words);
}

}  // namespace
}  // namespace vantage::registration
