
#include <cstdio>
#include <filesystem>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/cli/command.h"
#include "client/cli/file_flags.h"
#include "client/cli/mapped_file.h"
#include "client/cli/pace.h"
#include "client/cli/reading_progress.h"
#include "client/cli/scan_sending.h"
#include "client/cli/terminal.h"
#include "client/library/error.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct ScanPushArguments {
  SendingFlags flags;
  std::vector<std::string> files;
  std::optional<size_t> setup;  // from 1
  FileFlags file;
  std::string name;
  std::string replaces;
  bool preview = false;
  bool no_wait = false;
  bool on_server = false;
};

// Sends the file as it is; the server reads it.
absl::StatusOr<ExitCode> PushForServer(Environment& environment, const ScanPushArguments& arguments,
                                       const std::string& path) {
  const absl::StatusOr<MappedFile> file = MappedFile::Open(path);
  if (!file.ok()) return file.status();
  const std::filesystem::path name(path);
  v1::Upload upload;
  upload.set_display_name(arguments.name.empty() ? name.stem().string() : arguments.name);
  absl::Status described = DescribeFile(arguments.flags, arguments.file, upload);
  if (!described.ok()) return described;
  upload.mutable_file()->set_name(name.filename().string());
  upload.set_preview(arguments.preview);
  if (!arguments.replaces.empty()) {
    upload.set_replaces(
        absl::StrCat(client::SessionName(arguments.flags.session), "/scans/", arguments.replaces));
  }
  ProgressLine line;
  Pace pace;
  const auto sent = environment.client().UploadFile(
      client::SessionName(arguments.flags.session), upload, file->bytes(),
      [&](const client::UploadProgress& p) {
        line.Show(absl::StrCat(path, ": ",
                               pace.Of(static_cast<double>(p.acknowledged_bytes),
                                       static_cast<double>(p.total_bytes))));
      },
      [&](const v1::Upload& reading) {
        line.Show(absl::StrCat(path, ": read on the server, ", reading.scans_size(), " of ",
                               reading.setup_count(), " scans ", reading.state_message()));
      });
  line.Clear();
  if (!sent.ok()) return sent.status();
  if (!sent->state_message().empty()) {
    std::fprintf(stderr, "%s: %s\n", path.c_str(), sent->state_message().c_str());
  }
  ExitCode code = ExitCode::kOk;
  for (const std::string& scan_name : sent->scans()) {
    v1::GetScanRequest get;
    get.set_name(scan_name);
    absl::StatusOr<v1::Scan> scan = absl::InternalError("");
    if (arguments.no_wait) {
      const auto got = environment.client().Call(get);
      if (!got.ok()) return got.status();
      scan = got->scan();
    } else {
      scan = WaitShowing(environment, scan_name);
    }
    if (!scan.ok()) return scan.status();
    Sending sending;
    sending.name = scan->display_name();
    sending.preview = arguments.preview;
    if (ReportSent(arguments.flags, sending, *scan) != ExitCode::kOk) code = ExitCode::kUnwelcome;
  }
  return code;
}

absl::StatusOr<ExitCode> RunScanPush(Environment& environment, const ScanPushArguments& arguments) {
  const bool of_one = !arguments.name.empty() || !arguments.flags.pose.prior.empty() ||
                      !arguments.replaces.empty() || !arguments.file.station.empty();
  const auto several = [](absl::string_view what) {
    return client::WithFix(
        absl::InvalidArgumentError(
            absl::StrCat("--name, --prior, --station and --replaces belong to one scan, ", what)),
        "push one at a time (--setup), or give the poses by name with --prior-file");
  };
  if (arguments.files.size() > 1 && of_one) return several("and there are several files");
  ExitCode code = ExitCode::kOk;
  for (const std::string& path : arguments.files) {
    if (arguments.on_server) {
      const auto pushed = PushForServer(environment, arguments, path);
      if (!pushed.ok() || *pushed != ExitCode::kOk) code = ExitCode::kUnwelcome;
      if (!pushed.ok()) return pushed.status();
      continue;
    }
    const ReadingProgress reading(std::filesystem::path(path).filename().string());
    auto file = sensor::ConfinedScanFile::Open(path, StationOf(arguments.file),
                                               arguments.file.reader, reading.Watch());
    reading.Clear();
    if (!file.ok()) return file.status();
    size_t first = 0;
    size_t end = file->setups().size();
    if (arguments.setup) {
      first = *arguments.setup - 1;
      end = *arguments.setup;
    }
    if (end - first > 1 && of_one) {
      return several(absl::StrCat("and ", path, " has ", end, " set-ups"));
    }
    for (size_t setup = first; setup < end; ++setup) {
      Sending sending;
      sending.name = arguments.name;
      // One that is not there is refused when it is read.
      if (sending.name.empty() && setup < file->setups().size()) {
        sending.name = NameOf(path, *file, setup);
      }
      sending.limits = LimitsOf(arguments.file);
      sending.reading = reading;
      sending.preview = arguments.preview;
      sending.replaces = arguments.replaces;
      sending.wait = !arguments.no_wait;
      const auto scan = Send(environment, arguments.flags, sending, *file, setup);
      if (!scan.ok()) return scan.status();
      if (ReportSent(arguments.flags, sending, *scan) != ExitCode::kOk) code = ExitCode::kUnwelcome;
    }
  }
  return code;
}

}  // namespace

void AddScanPush(CLI::App& parent, Environment& environment) {
  AddCommand<ScanPushArguments>(
      parent, environment, "push",
      "Send scans (structured E57 or PTX, organised PCD; points with a station) and wait for them",
      "  vantage scan push flat scan1.ptx\n"
      "  vantage scan push flat scan2.pcd --prior 1.9,0.1,0,40\n"
      "  vantage scan push school project.e57\n"
      "  vantage scan push school office3.las --station 4412.31,5120.02,101.62\n"
      "  vantage scan push flat scan2.ptx scan3.ptx --prior-file poses.txt\n"
      "  vantage scan push hall s7.ptx --prior-file network.txt --trusted --sigma 0.004,0.02\n"
      "  vantage scan push corridor s3.ptx --prior 12,0,0,90 --targets targets.txt\n"
      "  vantage scan push flat scan4.e57 --preview; vantage scan push flat scan4.e57\n"
      "  vantage scan push flat scan5.e57 --on-server",
      [](CLI::App& command, ScanPushArguments& a) {
        command.add_option("SESSION", a.flags.session, "The job")->required();
        command.add_option("FILE", a.files, "Scan files, pushed one after the other")->required();
        AddSendingFlags(command, a.flags);
        command
            .add_option("--setup", a.setup,
                        "Of a file with several set-ups this one, from 1 [all, in order]")
            ->check(CLI::Range(size_t{1}, size_t{1'000'000}));
        AddFileFlags(command, a.file);
        AddAppearanceFlag(command, a.file);
        command
            .add_flag("--on-server", a.on_server,
                      "Send the file as it is, and have the server read it: for machines with "
                      "little memory")
            ->excludes("--setup")
            ->excludes(command.get_option("--reader-memory"))
            ->excludes(command.get_option("--reader-seconds"));
        command.add_option("--name", a.name, "Name for people [the file's]");
        CLI::Option* preview =
            command.add_flag("--preview", a.preview,
                             "Thin the scans first: what planning needs, in a hundredth of the "
                             "bytes. The whole scan, pushed later, takes its preview's place");
        command
            .add_option("--replaces", a.replaces,
                        "Id of the preview that this is the whole scan of [that of its name]")
            ->excludes(preview);
        command.add_flag("--no-wait", a.no_wait, "Return when the scan is stored");
      },
      RunScanPush);
}

}  // namespace vantage::cli
