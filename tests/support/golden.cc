#include "tests/support/golden.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"

namespace vantage::test_support {
namespace {

constexpr char kWords[] = "text: ";
constexpr size_t kShown = 12;  // lines that differ

uint64_t Fnv1a(absl::string_view bytes) {
  uint64_t hash = 0xCBF29CE484222325u;
  for (const char c : bytes) hash = (hash ^ static_cast<uint8_t>(c)) * 0x100000001B3u;
  return hash;
}

// Goldens are recorded as g++ compiles: clang, which sanitizers need, contracts and orders sums of
// floating point otherwise, which shows in the last bits.
#ifdef __clang__
constexpr double kRounding = 1e-9;  // of the larger number
#else
constexpr double kRounding = 0;
#endif

bool IsTheSame(absl::string_view a, absl::string_view b) {
  if (a == b) return true;
  if (!absl::StrContains(a, "0x") || !absl::StrContains(b, "0x")) return false;
  const double x = std::strtod(std::string(a).c_str(), nullptr);
  const double y = std::strtod(std::string(b).c_str(), nullptr);
  return std::abs(x - y) <= kRounding * std::max(std::abs(x), std::abs(y));
}

bool LinesAreTheSame(absl::string_view a, absl::string_view b) {
  if (a == b) return true;
  const std::vector<absl::string_view> was = absl::StrSplit(a, ' ');
  const std::vector<absl::string_view> is = absl::StrSplit(b, ' ');
  return std::equal(was.begin(), was.end(), is.begin(), is.end(), IsTheSame);
}

}  // namespace

void GoldenText::Section(absl::string_view title) {
  absl::StrAppend(&text_, "# ", title, "\n");
  ++lines_;
}

void GoldenText::Numbers(absl::string_view label, std::span<const double> numbers) {
  text_.append(label.data(), label.size());
  for (const double number : numbers) absl::StrAppendFormat(&text_, " %a", number);
  text_ += '\n';
  ++lines_;
}

void GoldenText::Counts(absl::string_view label, std::span<const int64_t> counts) {
  text_.append(label.data(), label.size());
  for (const int64_t count : counts) absl::StrAppend(&text_, " ", count);
  text_ += '\n';
  ++lines_;
}

void GoldenText::Bits(absl::string_view label, uint64_t bits) {
  absl::StrAppendFormat(&text_, "%s %016x\n", label, bits);
  ++lines_;
}

void GoldenText::Word(absl::string_view label, absl::string_view word) {
  absl::StrAppend(&text_, label, " '", absl::CEscape(word), "'\n");
  ++lines_;
}

void GoldenText::Text(absl::string_view label, absl::string_view words) {
  absl::StrAppend(&text_, kWords, label, " '", absl::CEscape(words), "'\n");
}

void GoldenText::Bytes(absl::string_view label, absl::string_view bytes) {
  absl::StrAppendFormat(&text_, "%s %d bytes %016x\n", label, bytes.size(), Fnv1a(bytes));
  ++lines_;
}

void GoldenText::Lines(absl::string_view label, const GoldenText& list) {
  std::string lines;
  for (const absl::string_view line : absl::StrSplit(list.text_, '\n')) {
    if (!absl::StartsWith(line, kWords)) absl::StrAppend(&lines, line, "\n");
  }
  absl::StrAppendFormat(&text_, "%s %d lines %016x\n", label, list.lines_, Fnv1a(lines));
  ++lines_;
}

void GoldenText::Append(const GoldenText& more) {
  text_ += more.text_;
  lines_ += more.lines_;
}

void ExpectGolden(const GoldenText& golden, const std::string& path) {
  const char* record = std::getenv("VANTAGE_RECORD_GOLDENS");
  if (record != nullptr && absl::string_view(record) == "1") {
    std::ofstream(path, std::ios::binary) << golden.text();
    return;
  }
  std::ifstream file(path, std::ios::binary);
  ASSERT_TRUE(file) << path << " cannot be read";
  std::stringstream recorded;
  recorded << file.rdbuf();
  const std::string before = recorded.str();
  if (before == golden.text()) return;
  const std::vector<absl::string_view> was = absl::StrSplit(before, '\n');
  const std::vector<absl::string_view> is = absl::StrSplit(golden.text(), '\n');
  std::string differences;
  size_t different = 0;
  for (size_t i = 0; i < std::max(was.size(), is.size()); ++i) {
    const absl::string_view old_line = i < was.size() ? was[i] : "(nothing)";
    const absl::string_view new_line = i < is.size() ? is[i] : "(nothing)";
    if (LinesAreTheSame(old_line, new_line)) continue;
    if (++different > kShown) continue;
    absl::StrAppend(&differences, "line ", i + 1, "\n  was ", old_line, "\n  is  ", new_line, "\n");
  }
  if (different == 0) return;
  ADD_FAILURE() << path << ": " << different << " lines differ\n" << differences;
}

}  // namespace vantage::test_support
