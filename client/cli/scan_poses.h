// A scan's poses beside each other, in words and as a picture.
#ifndef VANTAGE_CLIENT_CLI_SCAN_POSES_H_
#define VANTAGE_CLIENT_CLI_SCAN_POSES_H_

#include <string>

#include "absl/status/statusor.h"
#include "client/picture/pose_picture.h"
#include "vantage/v1/pose_comparison.pb.h"
#include "vantage/v1/scan.pb.h"

namespace vantage::cli {

// Figures of each pose and what it contradicts, several lines each, with line ends.
std::string PosesReport(const v1::PoseComparison& comparison);

// The same as a picture. INTERNAL: lists of the comparison differ in length.
absl::StatusOr<picture::PosePicture> PictureOf(const v1::Scan& scan,
                                               const v1::PoseComparison& comparison);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_SCAN_POSES_H_
