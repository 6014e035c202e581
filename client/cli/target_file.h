// Targets that scans saw, as a person keeps them in a file.
#ifndef VANTAGE_CLIENT_CLI_TARGET_FILE_H_
#define VANTAGE_CLIENT_CLI_TARGET_FILE_H_

#include <string>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "vantage/v1/target.pb.h"

namespace vantage::cli {

// Sightings by scan, in order, from lines of a scan's name, a target's name, its place in the
// scanner's frame and, where a control network has it, in the world (x y z each, m); '#' begins a
// comment. `what` is the text's name in errors, which name the line.
absl::StatusOr<std::vector<std::pair<std::string, v1::TargetSighting>>> ParseTargets(
    const std::string& text, const std::string& what);

// Those of one scan (a file's name without folder and ending) in a file. INVALID_ARGUMENT when the
// file has none for it.
absl::StatusOr<std::vector<v1::TargetSighting>> ReadTargets(const std::string& file,
                                                            const std::string& scan_name);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_TARGET_FILE_H_
