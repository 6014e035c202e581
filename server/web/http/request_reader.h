// Reads requests of HTTP/1.1 from bytes as they come.
#ifndef VANTAGE_SERVER_WEB_HTTP_REQUEST_READER_H_
#define VANTAGE_SERVER_WEB_HTTP_REQUEST_READER_H_

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "server/web/http/message.h"

namespace vantage::web {

// Of a request's line and fields, bytes: what gRPC takes (8 KiB), and a client's certificate that
// a proxy adds.
inline constexpr uint32_t kMaxHeadBytes = 16 << 10;

// One request; the next one needs another reader.
class RequestReader {
 public:
  RequestReader();
  ~RequestReader();
  RequestReader(RequestReader&&) noexcept;
  RequestReader& operator=(RequestReader&&) noexcept;

  // Takes what is next of `bytes` and returns how many of them were used; the rest has to be shown
  // again together with what follows it. Stops where the head ends, and where the request ends.
  // INVALID_ARGUMENT: it is no request of HTTP/1. RESOURCE_EXHAUSTED: the head is too long.
  // UNIMPLEMENTED: a transfer coding other than chunked. After an error nothing can be read.
  absl::StatusOr<size_t> Take(absl::string_view bytes);

  bool begun() const { return begun_; }
  bool has_head() const { return has_head_; }
  bool done() const;
  // The bytes that the head announces; nullopt: it does not say how many come.
  std::optional<uint64_t> announced() const;
  // Bytes of the body that have come.
  size_t body_bytes() const;

  // All but the body, once there is a head.
  const Request& head() const { return head_; }
  // The whole request, once it is done. To be called once.
  Request Finish();

 private:
  struct Parser;
  absl::Status ReadHead();

  std::unique_ptr<Parser> parser_;
  Request head_;
  bool begun_ = false;
  bool has_head_ = false;
};

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_HTTP_REQUEST_READER_H_
