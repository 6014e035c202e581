// Reading what instruments deliver: structured PTX, PCD (organised or not). The result is always a
// range image in the scanner's own frame, and the pose that the file states, if it states one.
#ifndef VANTAGE_CORE_SENSOR_IMPORT_H_
#define VANTAGE_CORE_SENSOR_IMPORT_H_

#include <Eigen/Geometry>
#include <optional>
#include <string>

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
  size_t points = 0;       // in the file, no-return entries included
  size_t duplicates = 0;   // returns whose cell an earlier one had taken
  bool resampled = false;  // the directions formed no grid (see gridding.h): cells are interpolated
};

struct ImportLimits {
  size_t max_points = 100'000'000;
  // Nearer returns are the scanner's own body: no information. m.
  double range_min = 0.5;
  // No-return cells connected to the body's cells within this angle are its blind zone, not free
  // space: no information. rad.
  double blind_zone = Radians(30);
};

// What the parsers read:
//   PTX  One scan, columns x rows, points in the scanner's frame, "0 0 0" for no return; 3 (x y z),
//        4 (+ intensity), 6 or 7 (+ r g b) numbers a line. The 4 x 4 in the header is in row-vector
//        convention: its last row is the translation. It becomes T_world_scan.
//   PCD  0.7 (and 0.6); ascii, binary, binary_compressed; fields x y z of type F, size 4 or 8, any
//        others are skipped. Organised (HEIGHT > 1): NaN or 0 0 0 is no return. Unorganised: every
//        point is a return, the origin is the centre of projection, and directions of the grid
//        without a point are no return. Points are in the scanner's frame and VIEWPOINT is its pose
//        in the world, as pcl_transform_from_viewpoint has it.
//
// Parses the bytes of a file. INVALID_ARGUMENT: not the format it claims, truncated, NaN, empty
// grid, or counts beyond the limits; the message names the line or field and what to do about it.
// UNIMPLEMENTED: a variant of the format that is not read, by name.
absl::StatusOr<ImportedScan> ParsePtx(absl::string_view bytes, const ImportLimits& limits);
absl::StatusOr<ImportedScan> ParsePcd(absl::string_view bytes, const ImportLimits& limits);

// By file name (.ptx, .pcd). NOT_FOUND and PERMISSION_DENIED as the file system says.
absl::StatusOr<ImportedScan> ReadScanFile(const std::string& path, const ImportLimits& limits);

}  // namespace vantage

#endif  // VANTAGE_CORE_SENSOR_IMPORT_H_
