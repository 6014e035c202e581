// Text that is cut where a character ends.
#ifndef VANTAGE_SERVER_CONTRACT_WHOLE_CHARACTERS_H_
#define VANTAGE_SERVER_CONTRACT_WHOLE_CHARACTERS_H_

#include <cstddef>

#include "absl/strings/string_view.h"

namespace vantage::contract {

// As much of a text in UTF-8 as `bytes` hold. Half a character is no text: whoever parses a message
// of Protobuf with it in gets nothing of that message.
inline absl::string_view WholeCharacters(absl::string_view text, size_t bytes) {
  if (text.size() <= bytes) return text;
  // All bytes of a character but its first begin with the bits 10.
  while (bytes > 0 && (static_cast<unsigned char>(text[bytes]) & 0xC0) == 0x80) --bytes;
  return text.substr(0, bytes);
}

}  // namespace vantage::contract

#endif  // VANTAGE_SERVER_CONTRACT_WHOLE_CHARACTERS_H_
