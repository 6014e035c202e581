// A pose prior as a person types it, or from a file.
#ifndef VANTAGE_CLIENT_CLI_POSE_FLAGS_H_
#define VANTAGE_CLIENT_CLI_POSE_FLAGS_H_

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/sensor/pose_prior.h"

namespace vantage::cli {

struct PoseFlags {
  std::vector<double> prior;       // x, y, z (m), yaw [, pitch, roll] (degrees)
  std::string prior_file;          // lines of 'name' and 16 numbers, row after row
  std::optional<double> levelled;  // degrees, one sigma
  std::vector<double> sigma;       // m, degrees: one sigma of position and rotation
  bool trusted = false;
  bool vendor_registered = false;
};

void AddPoseFlags(CLI::App& command, PoseFlags& flags);

// The prior that the flags give for a scan of this name (a file's name without folder and ending);
// where they give no pose, `stated` (that of the scan's file), as sure as the flags say; nothing
// when there is none. INVALID_ARGUMENT names the flag, or the file's line.
absl::StatusOr<std::optional<sensor::PosePrior>> PriorFrom(
    const PoseFlags& flags, const std::string& scan_name,
    const std::optional<Eigen::Isometry3d>& stated = {});

// Poses by name from lines of a name and a 4x4 row-major matrix (scanner to world); '#' begins a
// comment.
absl::StatusOr<std::vector<std::pair<std::string, Eigen::Isometry3d>>> ParsePoses(
    const std::string& text, const std::string& what);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_POSE_FLAGS_H_
