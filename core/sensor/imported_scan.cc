#include "core/sensor/imported_scan.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/sensor/scanner_body.h"

namespace vantage::sensor {
namespace {

// The lowest row of which at least half the cells hold information; the lowest of all when there is
// none.
int LowestUsefulRow(const RangeImage& image) {
  for (int row = 0; row < image.rows(); ++row) {
    int useful = 0;
    for (int column = 0; column < image.columns(); ++column) {
      useful += image.at(column, row) != RangeImage::kNoInformation ? 1 : 0;
    }
    if (2 * useful >= image.columns()) return row;
  }
  return 0;
}

ScannerModel ModelOf(const RangeImage& image, double range_min) {
  ScannerModel scanner;
  scanner.azimuth_step = image.native_azimuth_step;
  scanner.elevation_step = image.native_elevation_step;
  scanner.azimuth_span =
      image.full_turn
          ? 2 * kPi
          : std::min(2 * kPi, image.azimuth.back() - image.azimuth.front() + scanner.azimuth_step);
  const double half_row = 0.5 * scanner.elevation_step;
  const auto lowest = static_cast<size_t>(LowestUsefulRow(image));
  scanner.elevation_min = std::max(-kPi / 2, image.elevation[lowest] - half_row);
  scanner.elevation_max = std::min(kPi / 2, image.elevation.back() + half_row);
  scanner.range_min = range_min;
  return scanner;
}

// Of the points that the cells' ranges are from.
void PutAppearance(const Appearance& appearance, const std::vector<uint32_t>& source,
                   RangeImage& image) {
  const auto put = [&](const auto& of_points, auto& of_cells) {
    if (of_points.empty()) return;
    of_cells.assign(image.cells(), {});
    for (size_t cell = 0; cell < of_cells.size(); ++cell) {
      if (RangeImage::IsRange(image.range[cell])) of_cells[cell] = of_points[source[cell]];
    }
  };
  put(appearance.intensity, image.appearance.intensity);
  put(appearance.colour, image.appearance.colour);
}

}  // namespace

absl::StatusOr<ImportedScan> FinishImport(GriddedScan gridded, size_t points,
                                          const ImportLimits& limits,
                                          const Appearance& appearance) {
  ImportedScan scan;
  scan.image = std::move(gridded.image);
  scan.points = points;
  scan.duplicates = gridded.duplicates;
  scan.resampled = gridded.resampled;
  scan.leaning = gridded.leaning;
  MaskScannerBody(limits.range_min, limits.blind_zone, scan.image);
  if (scan.image.SampleCount() == 0) {
    return absl::InvalidArgumentError(
        absl::StrCat("points: every return is nearer than ", limits.range_min,
                     " m, where the scanner sees only itself; are the coordinates in metres?"));
  }
  PutAppearance(appearance, gridded.source, scan.image);
  scan.scanner = ModelOf(scan.image, limits.range_min);
  return scan;
}

ImportedScan ImportImage(RangeImage image, const ImportLimits& limits) {
  ImportedScan scan;
  scan.points = image.cells();
  scan.scanner = ModelOf(image, limits.range_min);
  scan.image = std::move(image);
  return scan;
}

std::optional<Eigen::Vector3f> FarReturns::Near(const Eigen::Vector3d& point,
                                                absl::FunctionRef<std::string()> where) {
  ++returns_;
  const Eigen::Vector3d metres = unit_ * point;
  if (metres.norm() <= kMaxImportRange) return metres.cast<float>();
  if (count_++ == 0) first_ = absl::StrCat(where(), ": a point ", metres.norm(), " m away");
  return std::nullopt;
}

absl::Status FarReturns::Check() const {
  if (2 * count_ <= returns_) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(first_, ", and ", count_, " of ", returns_, " farther than ", kMaxImportRange,
                   " m from the scanner; coordinates must be in metres and in one frame with it"));
}

}  // namespace vantage::sensor
