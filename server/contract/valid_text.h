// Text of strangers as text for people.
#ifndef VANTAGE_SERVER_CONTRACT_VALID_TEXT_H_
#define VANTAGE_SERVER_CONTRACT_VALID_TEXT_H_

#include <cstddef>
#include <string>

#include "absl/strings/string_view.h"

namespace vantage::contract {

// The first `bytes` of a text, or fewer, in whole characters of UTF-8, with '?' for what is none,
// and blanks for control characters: whoever parses a message of Protobuf with other bytes in a
// string gets nothing of that message.
std::string ValidText(absl::string_view text, size_t bytes);

}  // namespace vantage::contract

#endif  // VANTAGE_SERVER_CONTRACT_VALID_TEXT_H_
