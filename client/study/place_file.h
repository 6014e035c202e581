// Places as a file: a line 'x_m,y_m,z_m', then a place a line, in m, scene frame.
#ifndef VANTAGE_CLIENT_STUDY_PLACE_FILE_H_
#define VANTAGE_CLIENT_STUDY_PLACE_FILE_H_

#include <Eigen/Core>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace vantage::study {

// NOT_FOUND: no such file. INVALID_ARGUMENT: another heading, or a line that is no place; the
// message names the line. Empty lines and what stands behind a # are nothing.
absl::StatusOr<std::vector<Eigen::Vector3d>> ReadPlaces(const std::string& path);

// PERMISSION_DENIED: it cannot be written.
absl::Status WritePlaces(const std::string& path, const std::vector<Eigen::Vector3d>& places);

}  // namespace vantage::study

#endif  // VANTAGE_CLIENT_STUDY_PLACE_FILE_H_
