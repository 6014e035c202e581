// Reading what instruments deliver: structured PTX, PCD (organised or not). The result is always a
// range image in the scanner's own frame, and the pose that the file states, if it states one.
#ifndef VANTAGE_CORE_SENSOR_IMPORT_H_
#define VANTAGE_CORE_SENSOR_IMPORT_H_

#include <Eigen/Geometry>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/sensor/range_image.h"
#include "core/sensor/scanner_model.h"

namespace vantage {

struct ImportedScan {
  RangeImage image;
  // From the file (PTX header, PCD viewpoint); absent when it is the identity.
  std::optional<Eigen::Isometry3d> T_world_scan;
  // A scanner model that fits the image (spans, elevation interval, native steps); range interval,
  // noise and the rest are the defaults.
  ScannerModel scanner;
  size_t points = 0;      // in the file
  size_t duplicates = 0;  // points whose cell was already taken by the same ray
};

struct ImportLimits {
  size_t max_points = 100'000'000;
  // Nearer returns are the scanner's own body: no information. m.
  double range_min = 0.5;
  // No-return cells connected to the body's cells within this angle are its blind zone, not free
  // space: no information. rad.
  double blind_zone = Radians(30);
};

// Parses the bytes of a file. INVALID_ARGUMENT: not the format it claims, truncated, NaN, empty
// grid, or counts beyond the limits; the message names the line or field and what to do about it.
// UNIMPLEMENTED: a variant of the format that is not read, by name.
absl::StatusOr<ImportedScan> ParsePtx(absl::string_view bytes, const ImportLimits& limits);
absl::StatusOr<ImportedScan> ParsePcd(absl::string_view bytes, const ImportLimits& limits);

// By file name (.ptx, .pcd). NOT_FOUND and PERMISSION_DENIED as the file system says.
absl::StatusOr<ImportedScan> ReadScanFile(const std::string& path, const ImportLimits& limits);

// A range image from points with one known centre of projection (the origin), in any order: the
// stated rule by which anything becomes a range image. See gridding.h for how.
struct GridPoint {
  Eigen::Vector3d point;  // m, scanner frame; a zero vector is a ray with no return
};

}  // namespace vantage

#endif  // VANTAGE_CORE_SENSOR_IMPORT_H_
