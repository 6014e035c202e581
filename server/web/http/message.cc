#include "server/web/http/message.h"

#include <algorithm>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "absl/time/clock.h"
#include "absl/time/time.h"

namespace vantage::web {
namespace {

// The words of a status are for people; clients go by the number.
absl::string_view Words(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 204:
      return "No Content";
    case 304:
      return "Not Modified";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 409:
      return "Conflict";
    case 413:
      return "Content Too Large";
    case 415:
      return "Unsupported Media Type";
    case 421:
      return "Misdirected Request";
    case 429:
      return "Too Many Requests";
    case 431:
      return "Request Header Fields Too Large";
    case 499:
      return "Client Closed Request";
    case 501:
      return "Not Implemented";
    case 503:
      return "Service Unavailable";
    case 504:
      return "Gateway Timeout";
    case 505:
      return "HTTP Version Not Supported";
    default:
      return "Error";
  }
}

std::string BeginningOf(const Response& response, bool keep_alive) {
  std::string head = absl::StrCat(
      "HTTP/1.1 ", response.status, " ", Words(response.status),
      "\r\ndate: ", absl::FormatTime("%a, %d %b %Y %H:%M:%S GMT", absl::Now(), absl::UTCTimeZone()),
      "\r\n");
  for (const Field& field : response.fields) {
    absl::StrAppend(&head, field.name, ": ", field.value, "\r\n");
  }
  if (!keep_alive || response.close) absl::StrAppend(&head, "connection: close\r\n");
  return head;
}

}  // namespace

const std::string* Request::Find(absl::string_view name) const {
  const auto found = std::find_if(fields.begin(), fields.end(),
                                  [&](const Field& field) { return field.name == name; });
  return found == fields.end() ? nullptr : &found->value;
}

size_t Request::Count(absl::string_view name) const {
  return static_cast<size_t>(std::count_if(fields.begin(), fields.end(),
                                           [&](const Field& field) { return field.name == name; }));
}

absl::string_view Request::path() const {
  const absl::string_view whole = target;
  return whole.substr(0, whole.find('?'));
}

Response TextResponse(int status, absl::string_view line) {
  return {status,
          {{"content-type", "text/plain; charset=utf-8"},
           {"cache-control", "no-store"},
           {"x-content-type-options", "nosniff"}},
          std::make_shared<const std::string>(absl::StrCat(line, "\n"))};
}

std::string HeadOf(const Response& response, bool keep_alive) {
  std::string head = BeginningOf(response, keep_alive);
  // These two have no body, and no length (RFC 9110 section 8.6).
  if (response.status != 204 && response.status != 304) {
    absl::StrAppend(&head, "content-length: ", response.body == nullptr ? 0 : response.body->size(),
                    "\r\n");
  }
  return absl::StrCat(head, "\r\n");
}

std::string ChunkedHead(const Response& response, bool keep_alive) {
  return absl::StrCat(BeginningOf(response, keep_alive), "transfer-encoding: chunked\r\n\r\n");
}

std::string ChunkOf(absl::string_view data) {
  return absl::StrCat(absl::Hex(data.size()), "\r\n", data, "\r\n");
}

bool AcceptsGzip(absl::string_view accept_encoding) {
  bool any = false;
  for (const absl::string_view part : absl::StrSplit(accept_encoding, ',')) {
    const std::pair<absl::string_view, absl::string_view> coding =
        absl::StrSplit(part, absl::MaxSplits(';', 1));
    const absl::string_view name = absl::StripAsciiWhitespace(coding.first);
    absl::string_view weight = absl::StripAsciiWhitespace(coding.second);
    double quality = 1;
    if (absl::StartsWithIgnoreCase(weight, "q=") && !absl::SimpleAtod(weight.substr(2), &quality)) {
      quality = 0;
    }
    if (absl::EqualsIgnoreCase(name, "gzip")) return quality > 0;
    if (name == "*") any = quality > 0;
  }
  return any;
}

}  // namespace vantage::web
