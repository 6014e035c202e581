#include "core/sensor/xyz.h"

#include <charconv>
#include <optional>
#include <string>
#include <system_error>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/bytes/text_scanner.h"

namespace vantage::sensor {
namespace {

constexpr int kMostHeaderLines = 100;

// The first three numbers of a line whose columns are set apart by blanks.
std::optional<Eigen::Vector3d> FirstThree(absl::string_view line) {
  Eigen::Vector3d numbers;
  const char* at = line.data();
  const char* const end = at + line.size();
  for (double& number : numbers) {
    while (at != end && absl::ascii_isspace(*at)) ++at;
    if (at != end && *at == '+') ++at;
    const auto [next, error] = std::from_chars(at, end, number);
    if (error != std::errc() || (next != end && !absl::ascii_isspace(*next))) return std::nullopt;
    at = next;
  }
  return numbers;
}

std::optional<Eigen::Vector3d> PointOf(absl::string_view line, std::string& blanks) {
  if (!absl::StrContains(line, ',') && !absl::StrContains(line, ';')) return FirstThree(line);
  const bool semicolons = absl::StrContains(line, ';');
  blanks.assign(line.data(), line.size());
  for (char& c : blanks) {
    if (c == ';') c = ' ';
    if (c == ',') c = semicolons ? '.' : ' ';
  }
  return FirstThree(blanks);
}

}  // namespace

absl::Status ReadXyz(const bytes::ByteSource& file, const ImportLimits& limits, PointCloud& cloud) {
  bytes::TextScanner text(file);
  absl::string_view line;
  std::string blanks;
  int skipped = 0;
  while (text.NextLine(line)) {
    const absl::string_view words = absl::StripAsciiWhitespace(line);
    if (words.empty() || words.front() == '#' || absl::StartsWith(words, "//")) continue;
    const std::optional<Eigen::Vector3d> point = PointOf(words, blanks);
    const auto where = [&] { return absl::StrCat("line ", text.line_number()); };
    if (!point.has_value()) {
      if (cloud.size() == 0 && ++skipped <= kMostHeaderLines) continue;
      return absl::InvalidArgumentError(absl::StrCat(where(), ": '", bytes::ShownLine(words),
                                                     "' where x, y and z were expected"));
    }
    if (cloud.size() >= limits.max_points) {
      return absl::InvalidArgumentError(absl::StrCat(where(), ": more points than the limit of ",
                                                     limits.max_points,
                                                     "; export the scan at a lower resolution"));
    }
    if (absl::Status added = cloud.Add(*point, where); !added.ok()) return added;
  }
  if (!text.status().ok()) return text.status();
  if (cloud.size() == 0) {
    return absl::InvalidArgumentError("no line begins with x, y and z; is this a file of points?");
  }
  return absl::OkStatus();
}

}  // namespace vantage::sensor
