// Envelopes of the Connect protocol, in which the messages of a stream travel: a byte of flags, the
// length of the message as four bytes, the highest first, and the message.
#ifndef VANTAGE_SERVER_WEB_CONNECT_ENVELOPE_H_
#define VANTAGE_SERVER_WEB_CONNECT_ENVELOPE_H_

#include <cstddef>
#include <cstdint>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace vantage::web {

inline constexpr size_t kEnvelopeBytes = 5;
inline constexpr uint8_t kCompressedFlag = 1;
inline constexpr uint8_t kEndOfStreamFlag = 2;

// What goes before a message of `bytes`.
std::string EnvelopeHead(uint8_t flags, size_t bytes);
std::string Enveloped(uint8_t flags, absl::string_view message);

// The only message of a request, which is a part of `body`. INVALID_ARGUMENT: there is none, more
// than one, or one that is cut short or has unknown flags. UNIMPLEMENTED: it is compressed.
absl::StatusOr<absl::string_view> OnlyMessage(absl::string_view body);

}  // namespace vantage::web

#endif  // VANTAGE_SERVER_WEB_CONNECT_ENVELOPE_H_
