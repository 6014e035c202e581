// Sending a set-up of a scan file: as a whole, as a preview, or as the whole scan of a preview that
// the job has. Shared by 'scan push' and 'follow'.
#ifndef VANTAGE_CLIENT_CLI_SCAN_SENDING_H_
#define VANTAGE_CLIENT_CLI_SCAN_SENDING_H_

#include <CLI/CLI.hpp>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/cli/command.h"
#include "client/cli/file_flags.h"
#include "client/cli/pose_flags.h"
#include "client/cli/reading_progress.h"
#include "core/sensor/confined_scan_file.h"
#include "vantage/v1/scan.pb.h"
#include "vantage/v1/upload.pb.h"

namespace vantage::cli {

// What is said of all scans that are sent.
struct SendingFlags {
  std::string session;
  PoseFlags pose;
  std::string targets;
  std::optional<double> target_sigma;
  std::string scanner;
  std::string by;
  double preview_step = 0.25;  // degrees
  bool ignore_file_pose = false;
  bool json = false;
};

void AddSendingFlags(CLI::App& command, SendingFlags& flags);

struct Sending {
  std::string name;      // for people
  bool preview = false;  // thinned, where it is finer than previews are
  std::string replaces;  // id of the preview that it is the whole scan of; empty: the preview of
                         // its name, if there is one
  bool wait = true;      // until it is merged or refused
  sensor::ImportLimits limits;
  ReadingProgress reading{""};  // of its file, which shows until it is read
};

// Reads a set-up, sends it with a progress line, and returns the scan that it became.
absl::StatusOr<v1::Scan> Send(Environment& environment, const SendingFlags& flags,
                              const Sending& sending, sensor::ConfinedScanFile& file, size_t setup);

// What flags say of a file that the server reads, for an upload with a name.
absl::Status DescribeFile(const SendingFlags& flags, const FileFlags& file, v1::Upload& upload);

// What a set-up is called where no name is given: as the file, if it has one set-up; else as the
// file calls it, where no two are called the same.
std::string NameOf(const std::string& path, const sensor::ConfinedScanFile& file, size_t setup);

// All scans of the job, withdrawn ones included, oldest first.
absl::StatusOr<std::vector<v1::Scan>> ScansOf(Environment& environment, const std::string& session);

// Follows a scan until it is decided, and shows meanwhile what is done with it and for how long.
absl::StatusOr<v1::Scan> WaitShowing(Environment& environment, const std::string& scan);

// Prints what became of a scan, and says what helps where that is not welcome. `whole`: it was sent
// in place of a preview.
ExitCode ReportSent(const SendingFlags& flags, const Sending& sending, const v1::Scan& scan);

}  // namespace vantage::cli

#endif  // VANTAGE_CLIENT_CLI_SCAN_SENDING_H_
