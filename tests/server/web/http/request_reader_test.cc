#include "server/web/http/request_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace vantage::web {
namespace {

// Shows a reader `bytes`, at most `step` more at a time, until the request is done or refused. What
// is left is the beginning of the next request.
absl::Status ReadAll(RequestReader& reader, std::string& bytes, size_t step) {
  std::string shown;
  size_t next = 0;
  while (!reader.done()) {
    const absl::StatusOr<size_t> used = reader.Take(shown);
    if (!used.ok()) return used.status();
    shown.erase(0, *used);
    if (*used > 0 && !shown.empty()) continue;
    if (reader.done() || next == bytes.size()) break;
    const size_t more = std::min(step, bytes.size() - next);
    shown.append(bytes, next, more);
    next += more;
  }
  bytes = shown + bytes.substr(next);
  return absl::OkStatus();
}

TEST(RequestReader, ReadsTheSameInWhateverPiecesItComes) {
  const std::string whole =
      "POST /a?b HTTP/1.1\r\nHost: x\r\nX-Two: 1\r\nx-two: 2\r\nContent-Length: 5\r\n\r\nhello";
  for (const size_t step : {size_t{1}, size_t{3}, size_t{17}, whole.size()}) {
    std::string bytes = whole + "GET / HTTP/1.1\r\n";
    RequestReader reader;
    ASSERT_TRUE(ReadAll(reader, bytes, step).ok());
    ASSERT_TRUE(reader.done()) << step;
    EXPECT_EQ(bytes, "GET / HTTP/1.1\r\n") << step;
    EXPECT_EQ(reader.announced(), 5);
    const Request request = reader.Finish();
    EXPECT_EQ(request.method, "POST");
    EXPECT_EQ(request.target, "/a?b");
    EXPECT_EQ(request.body, "hello");
    EXPECT_TRUE(request.keep_alive);
    EXPECT_EQ(request.Count("x-two"), 2);
    EXPECT_EQ(*request.Find("x-two"), "1");
    EXPECT_EQ(request.Find("x-three"), nullptr);
  }
}

TEST(RequestReader, ReadsABodyInChunks) {
  for (const size_t step : {size_t{1}, size_t{7}, size_t{1000}}) {
    std::string bytes =
        "POST / HTTP/1.1\r\nHost: x\r\nTransfer-Encoding: chunked\r\n\r\n"
        "3\r\nabc\r\n0a\r\n0123456789\r\n0\r\n\r\n";
    RequestReader reader;
    ASSERT_TRUE(ReadAll(reader, bytes, step).ok());
    ASSERT_TRUE(reader.done());
    EXPECT_FALSE(reader.announced().has_value());
    EXPECT_EQ(reader.Finish().body, "abc0123456789");
  }
}

TEST(RequestReader, ARequestWithoutABodyEndsWithItsHead) {
  std::string bytes = "GET /x HTTP/1.0\r\n\r\n";
  RequestReader reader;
  EXPECT_FALSE(reader.begun());
  ASSERT_TRUE(ReadAll(reader, bytes, 100).ok());
  EXPECT_TRUE(reader.begun());
  EXPECT_TRUE(reader.done());
  EXPECT_TRUE(reader.head().http_1_0);
  EXPECT_FALSE(reader.head().keep_alive);
}

TEST(RequestReader, RefusesWhatIsNoRequestOrCouldHideAnother) {
  const std::string host = "POST / HTTP/1.1\r\nHost: x\r\n";
  for (const std::string& wrong : {
           std::string("hello\r\n\r\n"),
           std::string("GET / HTTP/2.0\r\n\r\n"),
           std::string("\x16\x03\x01\x02 a handshake\r\n\r\n"),
           std::string("GET / HTTP/1.1\r\n\r\n"),                         // no host
           host + "Host: y\r\n\r\n",                                      // two of them
           host + "Content-Length: 5\r\nContent-Length: 6\r\n\r\nhello",  // which one?
           host + "Content-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
           host + "Transfer-Encoding: chunked\r\nContent-Length: 5\r\n\r\n0\r\n\r\n",
           host + "Transfer-Encoding: gzip, chunked\r\n\r\n0\r\n\r\n",
           host + "Transfer-Encoding: identity\r\n\r\n",
           host + "Content-Length: -1\r\n\r\n",
           host + "Content-Length: 99999999999999999999999\r\n\r\n",
           host + "no colon\r\n\r\n",
           host + "Transfer-Encoding: chunked\r\n\r\nxyz\r\n",
       }) {
    std::string bytes = wrong;
    RequestReader reader;
    EXPECT_FALSE(ReadAll(reader, bytes, 1000).ok()) << wrong;
  }
}

TEST(RequestReader, AHeadHasABound) {
  RequestReader reader;
  std::string bytes = "GET / HTTP/1.1\r\nhost: x\r\n";
  while (bytes.size() < 2 * kMaxHeadBytes) bytes += "x-filler: " + std::string(100, 'x') + "\r\n";
  EXPECT_TRUE(absl::IsResourceExhausted(ReadAll(reader, bytes, 4096)));
  RequestReader endless;
  bytes = "GET /" + std::string(2 * kMaxHeadBytes, 'x');
  EXPECT_TRUE(absl::IsResourceExhausted(ReadAll(endless, bytes, 4096)));
}

}  // namespace
}  // namespace vantage::web
