// Lines and numbers of text files, with line numbers for messages.
#ifndef VANTAGE_CORE_BYTES_TEXT_SCANNER_H_
#define VANTAGE_CORE_BYTES_TEXT_SCANNER_H_

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <system_error>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/ascii.h"
#include "absl/strings/string_view.h"
#include "core/bytes/byte_source.h"

namespace vantage::bytes {

// Reads `text` line by line; '\n', with or without '\r' before it, ends a line.
class TextScanner {
 public:
  explicit TextScanner(ByteSource text) : text_(std::move(text)) {}

  // The next line without its end, valid until the next call; of a text in memory as long as that.
  // False at the end of the text, and where it cannot be read on.
  bool NextLine(absl::string_view& line) {
    if (at_ >= text_.size()) return false;
    size_t end = window_.find('\n', within_);
    if (end == absl::string_view::npos) {
      if (!Refill()) return false;
      end = window_.find('\n');
    }
    const size_t stop = end == absl::string_view::npos ? window_.size() : end;
    line = window_.substr(within_, stop - within_);
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    const size_t next = end == absl::string_view::npos ? window_.size() : end + 1;
    at_ += next - within_;
    within_ = next;
    ++line_;
    return true;
  }

  size_t line_number() const { return line_; }  // of the line read last; the first is 1
  uint64_t offset() const { return at_; }       // of the byte after that line
  // Whether all that was asked for could be read; then NextLine() is false at the end alone.
  const absl::Status& status() const { return status_; }

 private:
  static constexpr size_t kWindow = 1 << 20;  // bytes

  // Makes the window begin with the next line, and hold all of it.
  bool Refill() {
    for (size_t size = kWindow;; size *= 2) {
      const uint64_t left = text_.size() - at_;
      const auto view = text_.View(at_, static_cast<size_t>(size < left ? uint64_t{size} : left));
      if (!view.ok()) {
        status_ = view.status();
        return false;
      }
      window_ = *view;
      within_ = 0;
      if (size >= left || window_.find('\n') != absl::string_view::npos) return true;
    }
  }

  ByteSource text_;
  absl::string_view window_;
  size_t within_ = 0;  // the window
  uint64_t at_ = 0;
  size_t line_ = 0;
  absl::Status status_;
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
