// Results as text, which is compared line by line with recorded text. A number that changes by one
// bit shows.
#ifndef VANTAGE_TESTS_SUPPORT_GOLDEN_H_
#define VANTAGE_TESTS_SUPPORT_GOLDEN_H_

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>

#include "absl/strings/string_view.h"

namespace vantage::test_support {

// Labels are terms of the field, not names in the code, since those may change and recorded text
// must not.
class GoldenText {
 public:
  // Begins a group of lines.
  void Section(absl::string_view title);
  // Hexadecimal, to the last bit.
  void Numbers(absl::string_view label, std::span<const double> numbers);
  void Numbers(absl::string_view label, std::initializer_list<double> numbers) {
    Numbers(label, std::span<const double>(numbers.begin(), numbers.size()));
  }
  void Numbers(absl::string_view label, const Eigen::Vector3d& vector) {
    Numbers(label, {vector.x(), vector.y(), vector.z()});
  }
  // Whole numbers, yes (1) and no (0), and values of enumerations.
  void Counts(absl::string_view label, std::span<const int64_t> counts);
  void Counts(absl::string_view label, std::initializer_list<int64_t> counts) {
    Counts(label, std::span<const int64_t>(counts.begin(), counts.size()));
  }
  // Of 64 bits that mean no number.
  void Bits(absl::string_view label, uint64_t bits);
  // Names and other words that are part of what was computed.
  void Word(absl::string_view label, absl::string_view word);
  // Words for people, in a line that begins with 'text:': they may be put differently, so that a
  // change of such lines alone is no change of behaviour.
  void Text(absl::string_view label, absl::string_view words);
  // For results that are too long to be written out: the size and a hash (FNV-1a) of a list,
  // without words for people.
  void Bytes(absl::string_view label, absl::string_view bytes);
  void Lines(absl::string_view label, const GoldenText& list);

  void Append(const GoldenText& more);
  const std::string& text() const { return text_; }

 private:
  std::string text_;
  size_t lines_ = 0;  // without words for people
};

// Fails the test with the first lines that differ from the file's. With VANTAGE_RECORD_GOLDENS=1 in
// the environment it writes the file instead: see with git what changed.
void ExpectGolden(const GoldenText& golden, const std::string& path);

}  // namespace vantage::test_support

#endif  // VANTAGE_TESTS_SUPPORT_GOLDEN_H_
