#include "core/sensor/point_cloud.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/sensor/grid_directions.h"
#include "core/sensor/loose_grid.h"
#include "core/sensor/resampling.h"

namespace vantage::sensor {
namespace {

// A point is hidden by what its direction shows when it lies farther away by this: more than what
// is left of a surface that is seen at a grazing angle, half a cell to the side. The same for one
// that hides it.
constexpr double kApart = 0.5;        // m
constexpr double kApartShare = 0.25;  // of the range
// Of the points of one station, edges put 0.2 % there at most (two real scans of a room, twenty of
// a simulated flat, hall, street, facade and slope); of four stations in one file 1.3 to 13 %,
// least in the open, and of two in a room 5 %. Between the two a person is told
// (ImportedScan::apart).
constexpr double kMostApart = 0.04;

// How many of the points lie far before or behind what the image shows in their direction.
size_t CountApart(const RangeImage& image, const std::vector<Eigen::Vector3f>& points) {
  size_t apart = 0;
  for (const Eigen::Vector3f& point : points) {
    if (point.isZero(0)) continue;
    const float shown = image.at(static_cast<int>(NearestAround(image.azimuth, AzimuthOf(point))),
                                 static_cast<int>(Nearest(image.elevation, ElevationOf(point))));
    if (!RangeImage::IsRange(shown)) continue;
    const double range = point.norm();
    const double farther = std::abs(range - static_cast<double>(shown));
    apart += farther > kApart + kApartShare * std::min<double>(range, shown) ? 1 : 0;
  }
  return apart;
}

}  // namespace

absl::Status PointCloud::Add(const Eigen::Vector3d& point, absl::FunctionRef<std::string()> where) {
  if (!point.allFinite()) {
    return absl::InvalidArgumentError(
        absl::StrCat(where(), ": NaN or infinite coordinate; remove invalid points"));
  }
  const Eigen::Vector3d seen = point - station_;
  points_.push_back(far_.Near(seen, where).value_or(Eigen::Vector3f::Zero()));
  return absl::OkStatus();
}

absl::StatusOr<ImportedScan> PointCloud::ToScan(const ImportLimits& limits) const {
  if (absl::Status near = far_.Check(); !near.ok()) {
    return absl::InvalidArgumentError(
        absl::StrCat(near.message(), "; is the place of the scanner given in the file's frame?"));
  }
  absl::StatusOr<GriddedScan> gridded = GridDirections(points_);
  if (!gridded.ok()) return gridded.status();
  absl::StatusOr<ImportedScan> scan =
      FinishImport(*std::move(gridded), points_.size(), limits, appearance_);
  if (!scan.ok()) return scan.status();
  scan->apart =
      static_cast<double>(CountApart(scan->image, points_)) / static_cast<double>(points_.size());
  if (scan->apart > kMostApart) {
    return absl::InvalidArgumentError(absl::StrFormat(
        "points: %.0f %% lie far before or behind others in the same direction, so they were not "
        "all seen from (%.3f, %.3f, %.3f); give the place where the scanner stood, in the file's "
        "frame, and a file with the points of that station alone",
        100 * scan->apart, station_.x(), station_.y(), station_.z()));
  }
  scan->appearance = has_;
  scan->far = far_.count();
  scan->loose = true;
  if (!station_.isZero(0)) {
    scan->T_world_scan = Eigen::Isometry3d(Eigen::Translation3d(unit_ * station_));
  }
  return scan;
}

}  // namespace vantage::sensor
