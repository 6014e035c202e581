// What headers of earlier scans say of the next one's.
#include "server/session/header_frame.h"

#include <gtest/gtest.h>

#include <string>

#include "core/sensor/scanner_model.h"
#include "server/conversion/to_proto.h"

namespace vantage::session {
namespace {

Eigen::Isometry3d PlaceAt(double x, double y, double degrees) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() =
      Eigen::AngleAxisd(sensor::Radians(degrees), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  pose.translation() = Eigen::Vector3d(x, y, 1.5);
  return pose;
}

class HeaderFrameTest : public testing::Test {
 protected:
  // A scan whose file states `header`, and that was merged at `merged` (both in the model frame).
  v1::Scan& Add(const std::string& id, const Eigen::Isometry3d& header,
                const Eigen::Isometry3d& merged) {
    const std::string name = "sessions/job/scans/" + id;
    ScanRecord& record = state_.scans[name];
    record.in_model = true;
    record.scan = New(id, header);
    *record.scan.mutable_pose() = conversion::WritePose(merged, origin_);
    state_.scan_order.push_back(name);
    return record.scan;
  }
  v1::Scan New(const std::string& id, const Eigen::Isometry3d& header) const {
    v1::Scan scan;
    scan.set_name("sessions/job/scans/" + id);
    scan.set_sha256(id);
    *scan.mutable_prior()->mutable_pose() = conversion::WritePose(header, origin_);
    scan.mutable_prior()->set_source(v1::POSE_PRIOR_SOURCE_FILE_HEADER);
    return scan;
  }
  HeaderAdvice Advise(const v1::Scan& scan) const { return AdviseOnHeader(state_, scan, origin_); }

  const Eigen::Vector3d origin_{4'512'000, 5'234'000, 0};
  SessionState state_;
};

TEST_F(HeaderFrameTest, ThatFitAdviseNothing) {
  Add("a", PlaceAt(0, 0, 0), PlaceAt(0, 0, 0));
  Add("b", PlaceAt(5, 0, 40), PlaceAt(5.4, 0.1, 41));
  const HeaderAdvice advice = Advise(New("c", PlaceAt(8, 2, 10)));
  EXPECT_FALSE(advice.repeated);
  EXPECT_FALSE(advice.in_frame.has_value());
}

TEST_F(HeaderFrameTest, ThePoseOfAnotherScanSaysNothing) {
  Add("a", PlaceAt(3, 1, 20), PlaceAt(3, 1, 20));
  EXPECT_TRUE(Advise(New("b", PlaceAt(3, 1, 20))).repeated);
  EXPECT_FALSE(Advise(New("b", PlaceAt(3.001, 1, 20))).repeated);
  EXPECT_FALSE(Advise(New("a", PlaceAt(3, 1, 20))).repeated) << "it is not another one";
  v1::Scan copy = New("b", PlaceAt(3, 1, 20));
  copy.set_sha256("a");
  EXPECT_FALSE(Advise(copy).repeated) << "the same samples twice: that is said elsewhere";
}

// A frame that is turned by a right angle and lies 3 km away.
TEST_F(HeaderFrameTest, HeadersInAnotherFrameFollowTheNewestThatWasMerged) {
  const Eigen::Isometry3d frame = Eigen::Translation3d(3000, -200, 40) *
                                  Eigen::AngleAxisd(sensor::kPi / 2, Eigen::Vector3d::UnitZ());
  Add("a", PlaceAt(0, 0, 0), PlaceAt(0, 0, 0));
  Add("b", frame * PlaceAt(5, 0, 40), PlaceAt(5, 0, 40));
  const Eigen::Isometry3d truth = PlaceAt(9, -3, 100);
  const HeaderAdvice advice = Advise(New("c", frame * truth));
  ASSERT_TRUE(advice.in_frame.has_value());
  EXPECT_LT((advice.in_frame->matrix() - truth.matrix()).norm(), 1e-6);
  Add("d", PlaceAt(1, 1, 0), PlaceAt(1, 1, 0));
  EXPECT_FALSE(Advise(New("c", frame * truth)).in_frame.has_value());
}

TEST_F(HeaderFrameTest, OnlyHeadersThatNobodyVouchesForCount) {
  Add("b", PlaceAt(50, 0, 40), PlaceAt(5, 0, 40));
  v1::Scan scan = New("c", PlaceAt(50, 0, 40));
  EXPECT_TRUE(Advise(scan).repeated);
  scan.mutable_prior()->set_trusted(true);
  EXPECT_FALSE(Advise(scan).repeated);
  EXPECT_FALSE(Advise(scan).in_frame.has_value());
  scan.mutable_prior()->set_trusted(false);
  scan.mutable_prior()->clear_source();
  EXPECT_FALSE(Advise(scan).repeated);
  scan.clear_prior();
  EXPECT_FALSE(Advise(scan).in_frame.has_value());
  state_.scans.begin()->second.in_model = false;
  EXPECT_FALSE(Advise(New("c", PlaceAt(50, 0, 40))).repeated) << "withdrawn, or in doubt itself";
}

}  // namespace
}  // namespace vantage::session
