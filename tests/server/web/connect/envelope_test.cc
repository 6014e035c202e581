#include "server/web/connect/envelope.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

namespace vantage::web {
namespace {

using ::testing::HasSubstr;

TEST(Envelope, HasFlagsAndALengthThatBeginsWithTheHighestByte) {
  EXPECT_EQ(Enveloped(2, "{}"), std::string("\x02\0\0\0\x02{}", 7));
  EXPECT_EQ(EnvelopeHead(0, 0x01020304), std::string("\0\x01\x02\x03\x04", 5));
}

TEST(Envelope, GivesBackWhatWasPutIn) {
  for (const size_t bytes : {size_t{0}, size_t{1}, size_t{255}, size_t{256}, size_t{70'000}}) {
    const std::string message(bytes, 'm');
    const std::string body = Enveloped(0, message);
    const absl::StatusOr<absl::string_view> only = OnlyMessage(body);
    ASSERT_TRUE(only.ok()) << only.status();
    EXPECT_EQ(*only, message);
  }
}

TEST(Envelope, ARequestHasExactlyOneMessage) {
  EXPECT_TRUE(absl::IsInvalidArgument(OnlyMessage("").status()));
  EXPECT_TRUE(absl::IsInvalidArgument(OnlyMessage(Enveloped(0, "abc").substr(0, 4)).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(OnlyMessage(Enveloped(0, "abc").substr(0, 7)).status()));
  EXPECT_TRUE(
      absl::IsInvalidArgument(OnlyMessage(Enveloped(0, "abc") + Enveloped(0, "d")).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(OnlyMessage(std::string(5, '\xff')).status()));
  EXPECT_TRUE(absl::IsInvalidArgument(OnlyMessage(Enveloped(kEndOfStreamFlag, "{}")).status()));
  EXPECT_TRUE(absl::IsUnimplemented(OnlyMessage(Enveloped(kCompressedFlag, "abc")).status()));
  EXPECT_THAT(std::string(OnlyMessage(EnvelopeHead(0, 0xffffffff)).status().message()),
              HasSubstr("4294967295"));
}

}  // namespace
}  // namespace vantage::web
