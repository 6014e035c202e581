#include "server/web/http/message.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace vantage::web {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

TEST(HttpMessage, AHeadSaysHowLongTheBodyIsAndWhetherTheConnectionGoesOn) {
  const Response hello = TextResponse(404, "no");
  EXPECT_THAT(HeadOf(hello, true), StartsWith("HTTP/1.1 404 Not Found\r\n"));
  EXPECT_THAT(HeadOf(hello, true), HasSubstr("\r\ncontent-length: 3\r\n"));
  EXPECT_THAT(HeadOf(hello, true), EndsWith("\r\n\r\n"));
  EXPECT_THAT(HeadOf(hello, true), Not(HasSubstr("connection:")));
  EXPECT_THAT(HeadOf(hello, false), HasSubstr("\r\nconnection: close\r\n"));
  Response none;
  none.status = 304;
  EXPECT_THAT(HeadOf(none, true), Not(HasSubstr("content-length")));
  EXPECT_THAT(ChunkedHead(hello, true), HasSubstr("\r\ntransfer-encoding: chunked\r\n\r\n"));
  EXPECT_THAT(ChunkedHead(hello, true), Not(HasSubstr("content-length")));
}

TEST(HttpMessage, AChunkHasItsLengthInHexadecimal) {
  EXPECT_EQ(ChunkOf("hello"), "5\r\nhello\r\n");
  EXPECT_EQ(ChunkOf(std::string(26, 'x')), "1a\r\n" + std::string(26, 'x') + "\r\n");
}

TEST(HttpMessage, GzipPassesWhereItIsNamedAndNotRefused) {
  for (const char* yes :
       {"gzip", "br, gzip", "GZIP;q=0.5", "deflate, gzip;q=1.0", "*", "br;q=0, *"}) {
    EXPECT_TRUE(AcceptsGzip(yes)) << yes;
  }
  for (const char* no :
       {"", "br", "gzip;q=0", "gzip; q=0.0", "*;q=0", "gzip;q=0, *", "xgzip", "gzip;q=nonsense"}) {
    EXPECT_FALSE(AcceptsGzip(no)) << no;
  }
}

TEST(HttpMessage, APathEndsWhereTheQueryBegins) {
  Request request;
  request.target = "/a/b?c=/d";
  EXPECT_EQ(request.path(), "/a/b");
}

}  // namespace
}  // namespace vantage::web
