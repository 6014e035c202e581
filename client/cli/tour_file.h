// Tours that `vantage tour --json` wrote.
#ifndef VANTAGE_CLIENT_CLI_TOUR_FILE_H_
#define VANTAGE_CLIENT_CLI_TOUR_FILE_H_

#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "vantage/v1/geometry.pb.h"

namespace vantage::cli {

// Where its stops are, in their order, m, world. INVALID_ARGUMENT: it is no tour.
absl::StatusOr<std::vector<v1::Vector3>> ReadTourStations(const std::string& path);
// The same of a tour that one scanner makes. INVALID_ARGUMENT: several do.
absl::StatusOr<std::vector<v1::Vector3>> ReadTourOfOne(const std::string& path);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_TOUR_FILE_H_
