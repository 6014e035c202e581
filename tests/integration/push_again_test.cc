// A tablet that was switched off in the middle pushes its scan again: it arrives once.
#include <gtest/gtest.h>

#include "client/library/client.h"
#include "tests/integration/process.h"
#include "tests/server/fixture/room_scan.h"

namespace vantage::integration {
namespace {

TEST(PushAgain, IsTheSameScanUntilThatIsWithdrawn) {
  ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  client::ClientOptions options;
  options.server = server.address();
  client::Client client(options);
  v1::CreateSessionRequest open;
  open.set_session_id("job");
  ASSERT_TRUE(client.Call(open).ok());
  const sensor::RangeImage image = fixture::ScanRoom({2.0, 1.5, 1.4}, 3.0);
  const auto push = [&](const v1::Upload& upload) {
    return client.Upload("sessions/job", upload, image, [](const client::UploadProgress&) {})
        .value();
  };
  const std::string first = push({});
  EXPECT_EQ(push({}), first);
  v1::Upload placed;
  v1::Pose& pose = *placed.mutable_prior()->mutable_pose();
  pose.mutable_rotation()->set_w(1);
  pose.mutable_translation()->set_x(2.0);
  EXPECT_NE(push(placed), first) << "with a prior of its own it is another attempt";
  v1::WithdrawScanRequest withdraw;
  withdraw.set_name(first);
  ASSERT_TRUE(client.Call(withdraw).ok());
  const std::string again = push({});
  EXPECT_NE(again, first);
  EXPECT_EQ(push({}), again);
}

}  // namespace
}  // namespace vantage::integration
