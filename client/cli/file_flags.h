// What a person knows of a scan file that it does not say itself.
#ifndef VANTAGE_CLIENT_CLI_FILE_FLAGS_H_
#define VANTAGE_CLIENT_CLI_FILE_FLAGS_H_

#include <CLI/CLI.hpp>
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "core/confinement/allowance.h"
#include "core/sensor/imported_scan.h"

namespace vantage::cli {

struct FileFlags {
  std::vector<double> station;    // x, y, z, in the file's frame and unit; empty: not said
  std::string unit = "m";         // of the file's coordinates
  std::vector<std::string> with;  // "intensity", "colour": what is to come along
  confinement::AllowanceSettings reader;
};

void AddFileFlags(CLI::App& command, FileFlags& flags);  // those of the reader, too
// The flag for what is to come along.
void AddAppearanceFlag(CLI::App& command, FileFlags& flags);
// What the process that reads a file may take, for files that need more than they seem to.
void AddReaderFlags(CLI::App& command, confinement::AllowanceSettings& reader);
std::optional<Eigen::Vector3d> StationOf(const FileFlags& flags);
sensor::ImportLimits LimitsOf(const FileFlags& flags);

// Says on stderr what looks wrong with a scan called `name`.
void PrintOddities(const std::string& name, const sensor::ImportedScan& scan);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_FILE_FLAGS_H_
