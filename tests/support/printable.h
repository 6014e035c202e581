// What a person is shown of an error whose words may quote a damaged file.
#ifndef VANTAGE_TESTS_SUPPORT_PRINTABLE_H_
#define VANTAGE_TESTS_SUPPORT_PRINTABLE_H_

#include <string>

#include "absl/status/status.h"

namespace vantage::test_support {

// Without what a terminal would obey.
inline absl::Status Printable(const absl::Status& status) {
  std::string words(status.message());
  for (char& c : words) {
    if ((c >= 0 && c < ' ') || c == '\x7f') c = '?';
  }
  return {status.code(), words};
}

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_PRINTABLE_H_
