#include "client/cli/scan_poses.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace vantage::cli {
namespace {

using ::testing::HasSubstr;

// A sample a metre ahead of the scanner and a piece of surface, at two poses.
v1::PoseComparison TwoPoses() {
  v1::PoseComparison comparison;
  for (const float f : {1.0f, 0.0f, 0.0f}) comparison.add_sample_points(f);
  for (const float f : {-1.0f, 0.0f, 0.0f}) comparison.add_sample_normals(f);
  for (const float f : {3.0f, 4.0f, 1.0f}) comparison.add_surface_points(f);
  for (const float f : {0.0f, 0.0f, 1.0f}) comparison.add_surface_normals(f);
  comparison.add_surface_areas_m2(0.5f);
  comparison.mutable_surface_origin()->set_x(500'000);
  comparison.set_reach_m(0.08);
  for (int i = 0; i < 2; ++i) {
    v1::ComparedPose& pose = *comparison.add_poses();
    pose.set_kind(i == 0 ? v1::COMPARED_POSE_KIND_ALIGNED : v1::COMPARED_POSE_KIND_RIVAL);
    pose.set_rival_pose(i);
    // Turned by a quarter.
    pose.mutable_pose()->mutable_rotation()->set_w(std::sqrt(0.5));
    pose.mutable_pose()->mutable_rotation()->set_z(std::sqrt(0.5));
    pose.mutable_pose()->mutable_translation()->set_x(500'002 + i);
    pose.set_rms_residual_m(0.002);
    pose.add_agreements(i == 0 ? v1::SAMPLE_AGREEMENT_FITS : v1::SAMPLE_AGREEMENT_BEHIND_SURFACE);
    pose.add_residuals_m(i == 0 ? 0.003f : 0.0f);
    pose.add_sights(i == 0 ? v1::SURFACE_SIGHT_SEEN : v1::SURFACE_SIGHT_SEEN_THROUGH);
  }
  v1::Disagreement& wall = *comparison.mutable_poses(1)->add_disagreements();
  wall.set_area_m2(1.23);
  wall.mutable_centre()->set_x(500'001);
  wall.set_description("sees through a wall");
  return comparison;
}

TEST(ScanPoses, ReportNumbersPosesAsTheyAreAcceptedAndSaysWhatTheyContradict) {
  const std::string report = PosesReport(TwoPoses());
  EXPECT_THAT(report, HasSubstr("pose 1"));
  EXPECT_THAT(report, HasSubstr("pose 2"));
  EXPECT_THAT(report, HasSubstr("contradicts 1.2 m² around (500001.00, 0.00, 0.00): sees through "
                                "a wall"));
}

TEST(ScanPoses, SamplesAreWhereThePosePutsThem) {
  v1::Scan scan;
  scan.set_name("sessions/job/scans/s2");
  scan.set_state(v1::SCAN_STATE_DOUBTFUL);
  const auto picture = PictureOf(scan, TwoPoses());
  ASSERT_TRUE(picture.ok()) << picture.status();
  ASSERT_EQ(picture->poses.size(), 2U);
  const picture::PosePicture::Pose& pose = picture->poses[0];
  EXPECT_NEAR((pose.station - Eigen::Vector3d(2, 0, 0)).norm(), 0, 1e-9);
  EXPECT_NEAR((pose.samples[0].at - Eigen::Vector3d(2, 1, 0)).norm(), 0, 1e-6);
  EXPECT_NEAR((pose.samples[0].normal - Eigen::Vector3f(0, -1, 0)).norm(), 0, 1e-6);
  EXPECT_NEAR((pose.ahead - Eigen::Vector2d(0, 1)).norm(), 0, 1e-9);
  EXPECT_EQ(pose.samples[0].mark, picture::PosePicture::Mark::kFits);
  EXPECT_TRUE(pose.seen_through.empty());
  EXPECT_EQ(picture->poses[1].samples[0].mark, picture::PosePicture::Mark::kBehindSurface);
  EXPECT_EQ(picture->poses[1].seen_through.size(), 1U);
  ASSERT_EQ(picture->poses[1].places.size(), 1U);
  EXPECT_NEAR(picture->poses[1].places[0].centre.x(), 1, 1e-9);
  EXPECT_EQ(picture->largest_residual, 0.01) << "three times the best residual, in round figures";
}

TEST(ScanPoses, ListsThatDifferInLengthAreRefused) {
  for (int list = 0; list < 4; ++list) {
    v1::PoseComparison comparison = TwoPoses();
    if (list == 0) comparison.add_sample_points(1);
    if (list == 1) comparison.mutable_poses(1)->clear_residuals_m();
    if (list == 2) comparison.mutable_poses(0)->add_sights(v1::SURFACE_SIGHT_SEEN);
    if (list == 3) comparison.clear_surface_normals();
    EXPECT_FALSE(PictureOf(v1::Scan(), comparison).ok()) << list;
  }
}

}  // namespace
}  // namespace vantage::cli
