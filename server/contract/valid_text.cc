#include "server/contract/valid_text.h"

#include <cstdint>

#include "server/contract/whole_characters.h"

namespace vantage::contract {
namespace {

// Bytes of the character that `text` begins with; 0: it begins with none (RFC 3629: no longer forms
// than needed, no surrogates, nothing beyond U+10FFFF).
size_t CharacterBytes(absl::string_view text) {
  const auto byte = [&](size_t i) {
    return i < text.size() ? static_cast<unsigned char>(text[i]) : 0u;
  };
  const unsigned first = byte(0);
  if (first < 0x80) return 1;
  const size_t size = first >= 0xC2 && first <= 0xDF   ? 2
                      : first >= 0xE0 && first <= 0xEF ? 3
                      : first >= 0xF0 && first <= 0xF4 ? 4
                                                       : 0;
  for (size_t i = 1; i < size; ++i) {
    if ((byte(i) & 0xC0) != 0x80) return 0;
  }
  if (first == 0xE0 && byte(1) < 0xA0) return 0;
  if (first == 0xED && byte(1) > 0x9F) return 0;
  if (first == 0xF0 && byte(1) < 0x90) return 0;
  if (first == 0xF4 && byte(1) > 0x8F) return 0;
  return size;
}

}  // namespace

std::string ValidText(absl::string_view text, size_t bytes) {
  std::string valid;
  while (!text.empty() && valid.size() < bytes) {
    const size_t size = CharacterBytes(text);
    const auto first = static_cast<unsigned char>(text[0]);
    if (size == 0) {
      valid += '?';
    } else if (first < 0x20 || first == 0x7F) {
      valid += ' ';
    } else {
      valid.append(text.data(), size);
    }
    text.remove_prefix(size == 0 ? 1 : size);
  }
  return std::string(WholeCharacters(valid, bytes));
}

}  // namespace vantage::contract
