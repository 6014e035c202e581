// Lines and numbers of text files, with line numbers for messages.
#ifndef VANTAGE_CORE_BYTES_TEXT_SCANNER_H_
#define VANTAGE_CORE_BYTES_TEXT_SCANNER_H_

#include <charconv>
#include <cstddef>
#include <span>
#include <string>
#include <system_error>

#include "absl/strings/ascii.h"
#include "absl/strings/string_view.h"

namespace vantage::bytes {

// Reads `text` line by line; '\n', with or without '\r' before it, ends a line.
class TextScanner {
 public:
  explicit TextScanner(absl::string_view text) : text_(text) {}

  // The next line without its end; false at the end of the text.
  bool NextLine(absl::string_view& line) {
    if (at_ >= text_.size()) return false;
    const size_t end = text_.find('\n', at_);
    const size_t stop = end == absl::string_view::npos ? text_.size() : end;
    line = text_.substr(at_, stop - at_);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    at_ = end == absl::string_view::npos ? text_.size() : end + 1;
    ++line_;
    return true;
  }

  size_t line_number() const { return line_; }  // of the line read last; the first is 1
  size_t offset() const { return at_; }         // of the byte after that line

 private:
  absl::string_view text_;
  size_t at_ = 0;
  size_t line_ = 0;
};

// A line as it may be shown in a message: printable and short.
inline std::string ShownLine(absl::string_view line) {
  std::string shown;
  for (const char c : line.substr(0, 40)) shown += absl::ascii_isprint(c) ? c : '?';
  if (line.size() > 40) shown += "...";
  return shown;
}

// Numbers separated by blanks. Returns how many were read, or npos when something is no number or
// there are more than `values` holds. NaN and infinities are numbers here.
inline size_t ParseNumbers(absl::string_view line, std::span<double> values) {
  const char* at = line.data();
  const char* const end = at + line.size();
  size_t count = 0;
  while (true) {
    while (at != end && absl::ascii_isspace(*at)) ++at;
    if (at == end) return count;
    if (count == values.size()) return absl::string_view::npos;
    if (*at == '+') ++at;
    const auto [next, error] = std::from_chars(at, end, values[count]);
    if (error == std::errc::result_out_of_range) return absl::string_view::npos;
    if (error != std::errc() || (next != end && !absl::ascii_isspace(*next))) {
      return absl::string_view::npos;
    }
    ++count;
    at = next;
  }
}

}  // namespace vantage::bytes

#endif  // VANTAGE_CORE_BYTES_TEXT_SCANNER_H_
