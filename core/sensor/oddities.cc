#include "core/sensor/oddities.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "absl/strings/str_format.h"
#include "core/sensor/range_image.h"

namespace vantage::sensor {
namespace {

// Of the directions between these, steep enough to meet floor or ceiling beside the tripod and not
// the far walls.
constexpr double kFlattest = Radians(40);
constexpr double kSteepest = Radians(70);
constexpr size_t kFewest = 50;  // returns there, of which half lie on the floor, or above it

// m: how high scanners stand, and how high rooms are.
constexpr double kLowestScanner = 0.8;
constexpr double kHighestScanner = 2.2;
constexpr double kLowestRoom = 2.1;
constexpr double kHighestRoom = 4.5;

// Of so many columns and rows as many are looked at as tell: 500.
int Stride(int lines) { return 1 + lines / 500; }

struct Unit {
  const char* name;  // as people and --unit have it
  double metres;
};
constexpr Unit kUnits[] = {{"ft", 0.3048}, {"in", 0.0254}, {"cm", 0.01}};

// The median height over the scanner of what was seen between the two angles above (`up`) or below
// the horizon; m, as the file's pose has the vertical.
std::optional<double> MedianHeight(const ImportedScan& scan, bool up) {
  const Eigen::Matrix3d upright = scan.T_world_scan ? Eigen::Matrix3d(scan.T_world_scan->linear())
                                                    : Eigen::Matrix3d::Identity();
  const double low = std::sin(kFlattest);
  const double high = std::sin(kSteepest);
  std::vector<double> heights;
  for (int column = 0; column < scan.image.columns(); column += Stride(scan.image.columns())) {
    for (int row = 0; row < scan.image.rows(); row += Stride(scan.image.rows())) {
      const float range = scan.image.at(column, row);
      if (!RangeImage::IsRange(range)) continue;
      const double steepness = (upright * scan.image.Direction(column, row)).z();
      const double towards = up ? steepness : -steepness;
      if (towards < low || towards > high) continue;
      heights.push_back(static_cast<double>(range) * steepness);
    }
  }
  if (heights.size() < kFewest) return std::nullopt;
  const auto middle = heights.begin() + static_cast<std::ptrdiff_t>(heights.size() / 2);
  std::nth_element(heights.begin(), middle, heights.end());
  return *middle;
}

std::optional<std::string> OtherUnit(const ImportedScan& scan) {
  const std::optional<double> floor = MedianHeight(scan, false);
  const std::optional<double> ceiling = MedianHeight(scan, true);
  if (!floor.has_value() || !ceiling.has_value() || -*floor <= kHighestScanner) {
    return std::nullopt;
  }
  const double room = *ceiling - *floor;
  for (const Unit& unit : kUnits) {
    const double stands = -*floor * unit.metres;
    const double height = room * unit.metres;
    if (stands < kLowestScanner || stands > kHighestScanner || height < kLowestRoom ||
        height > kHighestRoom) {
      continue;
    }
    return absl::StrFormat(
        "the floor lies %.1f below the scanner and the ceiling %.1f above it, farther than in a "
        "room: if the coordinates are in %s, not in metres, read it with --unit %s (a factor of "
        "%g)",
        -*floor, *ceiling, unit.name, unit.name, unit.metres);
  }
  return std::nullopt;
}

std::optional<std::string> CameraFrame(const ImportedScan& scan) {
  // Length of the mean direction: of a scanner that turns, whose scan is even in azimuth, 0.64 at
  // most, where it saw nothing but the ground, all of it; of a cone of 90 degrees 0.85 and more.
  constexpr double kCone = 0.75;
  constexpr double kVertical = 0.9;  // cosine, 25 degrees
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  size_t count = 0;
  for (int column = 0; column < scan.image.columns(); column += Stride(scan.image.columns())) {
    for (int row = 0; row < scan.image.rows(); row += Stride(scan.image.rows())) {
      if (!RangeImage::IsRange(scan.image.at(column, row))) continue;
      sum += scan.image.Direction(column, row);
      ++count;
    }
  }
  const Eigen::Vector3d mean = sum / static_cast<double>(std::max<size_t>(1, count));
  if (mean.norm() < kCone || std::abs(mean.z()) < kVertical * mean.norm()) return std::nullopt;
  return absl::StrFormat(
      "all of it was seen straight %s: a depth camera's frame has z ahead; turn the points so that "
      "z points up",
      mean.z() > 0 ? "up" : "down");
}

}  // namespace

std::vector<std::string> Oddities(const ImportedScan& scan) {
  std::vector<std::string> oddities;
  if (auto unit = OtherUnit(scan)) oddities.push_back(*std::move(unit));
  if (auto frame = CameraFrame(scan)) oddities.push_back(*std::move(frame));
  if (scan.resampled && !scan.loose) {
    oddities.push_back(absl::StrFormat(
        "%s, so it was interpolated: %d returns are left, %d shared a cell with another%s",
        scan.leaning ? "its lines lean" : "its directions form no grid", scan.image.SampleCount(),
        scan.duplicates,
        scan.leaning ? ""
                     : "; if it was converted, export it again from the instrument's program"));
  }
  return oddities;
}

}  // namespace vantage::sensor
