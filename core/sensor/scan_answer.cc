#include "core/sensor/scan_answer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <initializer_list>
#include <utility>

#include "absl/strings/str_cat.h"

namespace vantage::sensor {
namespace {

using confinement::HearValue;
using confinement::HearVector;
using confinement::SayValue;
using confinement::SayVector;

enum Flag : uint32_t {
  kFullTurn = 1,
  kPosed = 2,
  kLoose = 4,
  kResampled = 8,
  kLeaning = 16,
  kFileIntensity = 32,
  kFileColour = 64,
  kIntensity = 128,
  kColour = 256,
  kAllFlags = 511,
};

// Everything of a scan but names and what there is one of for each column, row or cell.
struct Fixed {
  uint64_t columns = 0;
  uint64_t rows = 0;
  uint64_t points = 0;
  uint64_t duplicates = 0;
  uint64_t far = 0;
  double apart = 0;
  double native_azimuth_step = 0;
  double native_elevation_step = 0;
  std::array<double, 12> pose{};  // three rows
  std::array<double, 12> scanner{};
  uint32_t flags = 0;
  uint32_t name_bytes = 0;  // of the scanner
};
static_assert(sizeof(Fixed) == 5 * 8 + 3 * 8 + 24 * 8 + 8);  // no byte between that says nothing

constexpr size_t kMaxNameBytes = 256;

// The figures of a scanner, all of them.
std::array<double*, 12> Figures(ScannerModel& s) {
  return {&s.azimuth_span,    &s.elevation_min, &s.elevation_max, &s.azimuth_step,
          &s.elevation_step,  &s.range_min,     &s.range_max,     &s.range_noise,
          &s.range_noise_ppm, &s.max_incidence, &s.clearance,     &s.positioning_error};
}

absl::Status Senseless(absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("scan: ", what));
}

bool IsPose(const Eigen::Isometry3d& pose) {
  const Eigen::Matrix3d turn = pose.linear();
  return pose.translation().allFinite() && turn.allFinite() &&
         (turn * turn.transpose() - Eigen::Matrix3d::Identity()).norm() < 1e-6 &&
         turn.determinant() > 0;
}

absl::Status CheckFixed(const Fixed& fixed, uint64_t max_bytes) {
  if ((fixed.flags & ~kAllFlags) != 0) return Senseless("unknown flags");
  constexpr uint64_t kMost = uint64_t{1} << 31;
  if (fixed.columns >= kMost || fixed.rows >= kMost) return Senseless("columns or rows");
  const uint64_t of_cell =
      4 + ((fixed.flags & kIntensity) != 0 ? 2 : 0) + ((fixed.flags & kColour) != 0 ? 3 : 0);
  // Both products stay below 2^62, and below 2^64 with a cell's nine bytes.
  const uint64_t cells = fixed.columns * fixed.rows;
  if (cells > max_bytes / of_cell || 8 * (fixed.columns + fixed.rows) > max_bytes) {
    return Senseless(
        absl::StrCat(fixed.columns, " columns x ", fixed.rows, " rows are more than is allowed"));
  }
  if (fixed.name_bytes > kMaxNameBytes) return Senseless("a scanner's name without end");
  if (fixed.duplicates > fixed.points || fixed.far > fixed.points) {
    return Senseless("more of its points than there are");
  }
  const auto is_zero = [](double value) { return value == 0 && !std::signbit(value); };
  if ((fixed.flags & kPosed) == 0 && !std::all_of(fixed.pose.begin(), fixed.pose.end(), is_zero)) {
    return Senseless("a pose that is not told");
  }
  if (!(fixed.apart >= 0 && fixed.apart <= 1)) return Senseless("a share beyond the whole");
  for (const double figure : fixed.scanner) {
    if (!std::isfinite(figure)) return Senseless("a scanner without figures");
  }
  return absl::OkStatus();
}

}  // namespace

void SayScan(const ImportedScan& scan, confinement::SayBytes say) {
  const RangeImage& image = scan.image;
  Fixed fixed;
  fixed.columns = image.azimuth.size();
  fixed.rows = image.elevation.size();
  fixed.points = scan.points;
  fixed.duplicates = scan.duplicates;
  fixed.far = scan.far;
  fixed.apart = scan.apart;
  fixed.native_azimuth_step = image.native_azimuth_step;
  fixed.native_elevation_step = image.native_elevation_step;
  const AppearanceKinds kinds = image.appearance.kinds();
  for (const auto& [flag, set] :
       std::initializer_list<std::pair<Flag, bool>>{{kFullTurn, image.full_turn},
                                                    {kPosed, scan.T_world_scan.has_value()},
                                                    {kLoose, scan.loose},
                                                    {kResampled, scan.resampled},
                                                    {kLeaning, scan.leaning},
                                                    {kFileIntensity, scan.appearance.intensity},
                                                    {kFileColour, scan.appearance.colour},
                                                    {kIntensity, kinds.intensity},
                                                    {kColour, kinds.colour}}) {
    if (set) fixed.flags |= flag;
  }
  if (scan.T_world_scan) {
    for (int i = 0; i < 12; ++i) {
      fixed.pose[static_cast<size_t>(i)] = scan.T_world_scan->matrix()(i / 4, i % 4);
    }
  }
  ScannerModel scanner = scan.scanner;
  const std::array<double*, 12> figures = Figures(scanner);
  for (size_t i = 0; i < figures.size(); ++i) fixed.scanner[i] = *figures[i];
  fixed.name_bytes = static_cast<uint32_t>(std::min(scanner.name.size(), kMaxNameBytes));
  SayValue(fixed, say);
  say(absl::string_view(scanner.name).substr(0, kMaxNameBytes));
  SayVector(image.azimuth, say);
  SayVector(image.elevation, say);
  SayVector(image.range, say);
  SayVector(image.appearance.intensity, say);
  SayVector(image.appearance.colour, say);
}

absl::StatusOr<ImportedScan> HearScan(confinement::HearBytes hear, uint64_t max_bytes) {
  Fixed fixed;
  absl::Status heard = HearValue(hear, fixed);
  if (!heard.ok()) return heard;
  if (absl::Status sense = CheckFixed(fixed, max_bytes); !sense.ok()) return sense;
  const auto is = [&](Flag flag) { return (fixed.flags & flag) != 0; };
  ImportedScan scan;
  scan.points = fixed.points;
  scan.duplicates = fixed.duplicates;
  scan.far = fixed.far;
  scan.apart = fixed.apart;
  scan.loose = is(kLoose);
  scan.resampled = is(kResampled);
  scan.leaning = is(kLeaning);
  scan.appearance = {is(kFileIntensity), is(kFileColour)};
  if (is(kPosed)) {
    scan.T_world_scan = Eigen::Isometry3d::Identity();
    for (int i = 0; i < 12; ++i) {
      scan.T_world_scan->matrix()(i / 4, i % 4) = fixed.pose[static_cast<size_t>(i)];
    }
    if (!IsPose(*scan.T_world_scan)) return Senseless("a pose that is none");
  }
  const std::array<double*, 12> figures = Figures(scan.scanner);
  for (size_t i = 0; i < figures.size(); ++i) *figures[i] = fixed.scanner[i];
  scan.scanner.name.resize(fixed.name_bytes);
  heard = hear(scan.scanner.name.data(), fixed.name_bytes);
  RangeImage& image = scan.image;
  image.full_turn = is(kFullTurn);
  image.native_azimuth_step = fixed.native_azimuth_step;
  image.native_elevation_step = fixed.native_elevation_step;
  const size_t cells = fixed.columns * fixed.rows;
  if (heard.ok()) heard = HearVector(hear, fixed.columns, image.azimuth);
  if (heard.ok()) heard = HearVector(hear, fixed.rows, image.elevation);
  if (heard.ok()) heard = HearVector(hear, cells, image.range);
  if (heard.ok() && is(kIntensity)) heard = HearVector(hear, cells, image.appearance.intensity);
  if (heard.ok() && is(kColour)) heard = HearVector(hear, cells, image.appearance.colour);
  if (!heard.ok()) return heard;
  if (absl::Status valid = image.Validate(); !valid.ok()) return valid;
  return scan;
}

void SaySetups(const std::vector<std::string>& setups, confinement::SayBytes say) {
  SayValue(uint64_t{setups.size()}, say);
  for (const std::string& name : setups) {
    SayValue(uint64_t{name.size()}, say);
    say(name);
  }
}

absl::StatusOr<std::vector<std::string>> HearSetups(confinement::HearBytes hear,
                                                    uint64_t max_bytes) {
  uint64_t count = 0;
  absl::Status heard = HearValue(hear, count);
  if (!heard.ok()) return heard;
  if (count == 0) return Senseless("a file without set-ups");
  // Each comes with its length, and takes as much here.
  uint64_t left = max_bytes / (sizeof(count) + sizeof(std::string));
  if (count > left) return Senseless(absl::StrCat(count, " set-ups"));
  left = max_bytes;
  std::vector<std::string> setups;
  while (setups.size() < count) {
    uint64_t size = 0;
    heard = HearValue(hear, size);
    if (!heard.ok()) return heard;
    if (size > left) return Senseless("names without end");
    left -= size;
    std::string name(size, '\0');
    heard = hear(name.data(), size);
    if (!heard.ok()) return heard;
    setups.push_back(std::move(name));
  }
  return setups;
}

}  // namespace vantage::sensor
