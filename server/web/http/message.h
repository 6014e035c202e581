// Requests and answers of HTTP/1.1, as values.
#ifndef VANTAGE_SERVER_WEB_HTTP_MESSAGE_H_
#define VANTAGE_SERVER_WEB_HTTP_MESSAGE_H_

#include <memory>
#include <string>
#include <vector>

#include "absl/strings/string_view.h"

namespace vantage::web {

struct Field {
  std::string name;  // lower case
  std::string value;
};

struct Request {
  std::string method;  // as it was sent: methods are case sensitive
  std::string target;  // what was asked for, with its query
  bool http_1_0 = false;
  bool keep_alive = true;  // the client means to send another one by this connection
  std::vector<Field> fields;
  std::string body;

  // The first value of a field, null where there is none. `name` is in lower case.
  const std::string* Find(absl::string_view name) const;
  size_t Count(absl::string_view name) const;
  // The target without its query.
  absl::string_view path() const;
};

struct Response {
  int status = 200;
  std::vector<Field> fields;
  // Null: there is none.
  std::shared_ptr<const std::string> body;
  // The connection ends after this answer.
  bool close = false;
};

// An answer of one line for people.
Response TextResponse(int status, absl::string_view line);

// The head of an answer whose body has `body_bytes`. `length_only`: to HEAD, which gets no body.
std::string HeadOf(const Response& response, bool keep_alive);
// The head of an answer whose body comes in chunks.
std::string ChunkedHead(const Response& response, bool keep_alive);
// One chunk; not empty, since an empty one ends the body.
std::string ChunkOf(absl::string_view data);
// What ends a body of chunks.
inline constexpr absl::string_view kLastChunk = "0\r\n\r\n";

// Whether a list of codings, as in accept-encoding (RFC 9110 section 12.5.3), lets gzip pass.
bool AcceptsGzip(absl::string_view accept_encoding);

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_HTTP_MESSAGE_H_
