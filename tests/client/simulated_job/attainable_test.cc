#include "client/simulated_job/attainable.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "client/library/error.h"
#include "client/simulated_job/oracle_route.h"
#include "core/parallel/parallel.h"

namespace vantage::simulated_job {
namespace {

using ::testing::HasSubstr;

JobOptions Coarse() {
  JobOptions options;
  options.scanner.azimuth_step = options.scanner.elevation_step = sensor::Radians(1);
  options.required_density = 150;
  options.truth_samples = 4000;
  options.max_scans = 5;
  return options;
}

TEST(Attainable, AStartFromWhichNothingIsReachedIsSaidInsteadOfNaughtPercent) {
  Site site = GeneratedSite(SceneKind::kFlat, 1, 0, std::nullopt).value();
  parallel::Serial serial;
  site.start.x() = site.mesh.Bounds().max().x() + 5;  // in front of the house
  const absl::Status status =
      FollowOracle(site, Coarse(), serial, [](const OracleScan&) { FAIL() << "a scan was made"; });
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(status.message(), HasSubstr("nothing to attain"));
  EXPECT_THAT(client::Explain(status).fix, HasSubstr("--start"));
}

TEST(Attainable, ADensityThatNoPlaceGivesIsSaid) {
  const Site site = GeneratedSite(SceneKind::kFlat, 1, 0, std::nullopt).value();
  parallel::Serial serial;
  JobOptions options = Coarse();
  options.required_density = 1e7;
  const absl::Status status = FollowOracle(site, options, serial, [](const OracleScan&) {});
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(client::Explain(status).fix, HasSubstr("--density"));
}

TEST(OracleRoute, EachScanBringsNoMoreThanTheOneBefore) {
  const Site site = GeneratedSite(SceneKind::kTwoRooms, 1, 0, std::nullopt).value();
  parallel::Serial serial;
  std::vector<OracleScan> scans;
  ASSERT_TRUE(FollowOracle(site, Coarse(), serial, [&](const OracleScan& scan) {
                scans.push_back(scan);
              }).ok());
  ASSERT_GE(scans.size(), 3u);
  EXPECT_EQ(scans.front().at, site.start);
  // The second may bring more than the start did, which nobody chose.
  for (size_t i = 2; i < scans.size(); ++i) EXPECT_LE(scans[i].gain, scans[i - 1].gain + 1e-6);
  EXPECT_GT(scans.back().truth.attained_share(), scans.front().truth.attained_share());
}

}  // namespace
}  // namespace vantage::simulated_job
