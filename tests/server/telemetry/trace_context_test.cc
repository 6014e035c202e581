#include "server/telemetry/trace_context.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

namespace vantage::telemetry {
namespace {

using ::testing::MatchesRegex;

constexpr char kTrace[] = "0af7651916cd43dd8448eb211c80319c";
constexpr char kSpan[] = "b7ad6b7169203331";

// The example of W3C's recommendation, and its variations.
TEST(TraceContext, GoesOnWithTheTraceOfTheHeader) {
  const std::string header = std::string("00-") + kTrace + "-" + kSpan + "-01";
  const TraceContext context = TraceContext::From(header);
  EXPECT_EQ(context.trace_id, kTrace);
  EXPECT_EQ(context.parent_id, kSpan);
  EXPECT_TRUE(context.sampled);
  EXPECT_NE(context.span_id, kSpan);
  EXPECT_EQ(context.ToHeader(), std::string("00-") + kTrace + "-" + context.span_id + "-01");
  EXPECT_FALSE(TraceContext::From(std::string("00-") + kTrace + "-" + kSpan + "-fe").sampled);
  // A later version may have more.
  EXPECT_EQ(TraceContext::From("cc" + header.substr(2) + "-what-ever").trace_id, kTrace);
}

TEST(TraceContext, BeginsAnewWhereTheHeaderIsNone) {
  const std::string trace = kTrace;
  const std::string span = kSpan;
  std::set<std::string> seen;
  for (const std::string& bad :
       {std::string(), std::string("x"), "ff-" + trace + "-" + span + "-01",
        "00-" + trace + "-" + span + "-01-more", "00-" + trace + "-" + span + "-0",
        "00-" + trace + "-" + span + "-0g", "00-" + std::string(32, '0') + "-" + span + "-01",
        "00-" + trace + "-" + std::string(16, '0') + "-01",
        "00-0AF7651916CD43DD8448EB211C80319C-" + span + "-01", "00_" + trace + "-" + span + "-01",
        "cc-" + trace + "-" + span + "-01more", std::string(10'000, 'a')}) {
    const TraceContext context = TraceContext::From(bad);
    EXPECT_THAT(context.ToHeader(), MatchesRegex("00-[0-9a-f]{32}-[0-9a-f]{16}-00")) << bad;
    EXPECT_EQ(context.parent_id, "") << bad;
    EXPECT_NE(context.trace_id, trace) << bad;
    EXPECT_TRUE(seen.insert(context.trace_id).second);
  }
}

}  // namespace
}  // namespace vantage::telemetry
