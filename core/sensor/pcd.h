// Reading PCD, organised or not.
#ifndef VANTAGE_CORE_SENSOR_PCD_H_
#define VANTAGE_CORE_SENSOR_PCD_H_

#include <Eigen/Core>
#include <optional>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/sensor/imported_scan.h"

namespace vantage::sensor {

// 0.7 (and 0.6); ascii, binary, binary_compressed; fields x y z of type F, size 4 or 8, any
// others are skipped. Organised (HEIGHT > 1): NaN or 0 0 0 is no return. Unorganised: every
// point is a return, the origin is the centre of projection, and directions of the grid
// without a point are no return. Points are in the scanner's frame and VIEWPOINT is its pose
// in the world, as pcl_transform_from_viewpoint has it; unless a `station` is given (m): then
// points are in the world's frame, in which the scanner stood there, and VIEWPOINT says nothing.
//
// Parses the bytes of a file. INVALID_ARGUMENT: not the format it claims, truncated, NaN, empty
// grid, or counts beyond the limits; the message names the line or field and what to do about it.
// UNIMPLEMENTED: a variant of the format that is not read, by name.
absl::StatusOr<ImportedScan> ParsePcd(absl::string_view bytes, const ImportLimits& limits,
                                      const std::optional<Eigen::Vector3d>& station = {});

}  // namespace vantage::sensor

#endif  // VANTAGE_CORE_SENSOR_PCD_H_
