// Links that break in the middle of scans: each arrives once, and a link that went silent is given
// up at both ends. With loss, delay and little bandwidth, between network namespaces: ./dev faults.
#include <gtest/gtest.h>

#include "tests/faults/faulty_proxy.h"
#include "tests/faults/link_job.h"
#include "tests/integration/process.h"

namespace vantage::faults {
namespace {

TEST(LinkFaults, ScansArriveOnceAndSilenceIsNoticed) {
  integration::ServerProcess server;
  ASSERT_FALSE(server.address().empty());
  using Kind = LinkFault::Kind;
  // A scan is about 20 kB: within the first, between two, twice in one, in its last bytes.
  FaultyProxy link(server.address(), {{Kind::kCut, 9'000},
                                      {Kind::kHalfOpen, 50'000},
                                      {Kind::kCut, 4'000},
                                      {Kind::kCut, 4'000},
                                      {Kind::kCut, 300}});
  LinkJob job;
  job.server = link.address();
  job.name = "link";
  job.scans = 6;
  const LinkJobResult result = PushOverLink(job);
  EXPECT_EQ(result.arrived, job.scans) << result.failure;
  EXPECT_EQ(link.faults(), 5);
  EXPECT_GE(result.sent_bytes, result.once_bytes);
  // The system would wait for a quarter of an hour.
  const std::vector<Noticed> noticed = link.WaitUntilNoticed(60);
  ASSERT_EQ(noticed.size(), 1U);
  EXPECT_GE(noticed[0].client, 0);
  EXPECT_GE(noticed[0].server, 0);
  RecordProperty("noticed_client_seconds", std::to_string(noticed[0].client));
  RecordProperty("noticed_server_seconds", std::to_string(noticed[0].server));
}

}  // namespace
}  // namespace vantage::faults
