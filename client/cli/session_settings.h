// The settings of a session on the command line, for creating and for updating it.
#ifndef VANTAGE_CLIENT_CLI_SESSION_SETTINGS_H_
#define VANTAGE_CLIENT_CLI_SESSION_SETTINGS_H_

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/file_flags.h"
#include "vantage/v1/session.pb.h"

namespace vantage::cli {

struct SessionSettings {
  std::string config;               // file, JSON form of a Session
  std::string scanner_from;         // scan file whose grid makes the scanner model
  FileFlags file;                   // of that scan file
  std::string preset;               // instrument whose figures make the scanner model
  std::string setting;              // of the preset; empty: its usual one
  std::vector<std::string> set;     // PATH=VALUE
  std::optional<std::string> name;  // display name
  std::optional<double> voxel;
  std::optional<double> density;
  std::optional<double> accuracy;
};

void AddSettings(CLI::App& command, SessionSettings& settings);

// Writes the settings into the session: those of the file, then those of the flags. Returns the
// paths that were set, in the form of an update mask.
absl::StatusOr<std::vector<std::string>> ApplySettings(const SessionSettings& settings,
                                                       v1::Session& session);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_SESSION_SETTINGS_H_
