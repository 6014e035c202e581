#include "server/web/connect/envelope.h"

#include "absl/strings/str_cat.h"

namespace vantage::web {

std::string EnvelopeHead(uint8_t flags, size_t bytes) {
  std::string head(kEnvelopeBytes, '\0');
  head[0] = static_cast<char>(flags);
  for (size_t i = 1; i < kEnvelopeBytes; ++i) {
    head[i] = static_cast<char>(bytes >> 8 * (kEnvelopeBytes - 1 - i) & 0xff);
  }
  return head;
}

std::string Enveloped(uint8_t flags, absl::string_view message) {
  return absl::StrCat(EnvelopeHead(flags, message.size()), message);
}

absl::StatusOr<absl::string_view> OnlyMessage(absl::string_view body) {
  if (body.size() < kEnvelopeBytes) {
    return absl::InvalidArgumentError("the request has no message in an envelope");
  }
  const auto flags = static_cast<uint8_t>(body[0]);
  if (flags == kCompressedFlag) {
    return absl::UnimplementedError("this server takes no compressed messages");
  }
  if (flags != 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("a request's message cannot have the flags ", static_cast<int>(flags)));
  }
  uint64_t length = 0;
  for (size_t i = 1; i < kEnvelopeBytes; ++i) {
    length = length << 8 | static_cast<uint8_t>(body[i]);
  }
  const absl::string_view rest = body.substr(kEnvelopeBytes);
  if (rest.size() < length) {
    return absl::InvalidArgumentError(
        absl::StrCat("the envelope announces ", length, " bytes, and ", rest.size(), " came"));
  }
  if (rest.size() > length) {
    return absl::InvalidArgumentError("the request has more than one message");
  }
  return rest;
}

}  // namespace vantage::web
