#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/pose_flags.h"
#include "client/cli/report.h"
#include "client/cli/target_file.h"
#include "client/cli/terminal.h"
#include "client/library/error.h"
#include "client/library/geometry.h"
#include "client/library/resource_names.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/scan_file.h"

namespace vantage::cli {
namespace {

struct ScanPushArguments {
  std::string session;
  std::vector<std::string> files;
  PoseFlags pose;
  std::string targets;
  std::optional<double> target_sigma;
  std::optional<size_t> setup;  // from 1
  std::string name;
  std::string scanner;
  std::string by;
  bool ignore_file_pose = false;
  bool no_wait = false;
  bool json = false;
};

absl::StatusOr<v1::Upload> Describe(const ScanPushArguments& arguments, const std::string& name,
                                    const sensor::ImportedScan& scan) {
  v1::Upload upload;
  upload.set_display_name(name);
  if (!arguments.by.empty()) {
    upload.set_scanner(client::ScannerName(arguments.session, arguments.by));
  }
  if (arguments.scanner.empty()) {
    *upload.mutable_scanner_model() = client::ToProto(scan.scanner, "from-file");
  } else {
    upload.set_scanner_model_id(arguments.scanner);
  }
  const auto prior = PriorFrom(arguments.pose, name);
  if (!prior.ok()) return prior.status();
  if (*prior) {
    *upload.mutable_prior() = client::ToProto(**prior);
  } else if (scan.T_world_scan && !arguments.ignore_file_pose) {
    sensor::PosePrior from_file;
    from_file.T_world_scan = *scan.T_world_scan;
    *upload.mutable_prior() = client::ToProto(from_file);
  }
  if (!arguments.targets.empty()) {
    const auto targets = ReadTargets(arguments.targets, name);
    if (!targets.ok()) return targets.status();
    for (const v1::TargetSighting& target : *targets) {
      v1::TargetSighting& added = *upload.add_targets();
      added = target;
      if (arguments.target_sigma) added.set_sigma_m(*arguments.target_sigma);
    }
  }
  return upload;
}

// Of a file with one set-up, the file's; of others, the set-ups' own where they have one and no two
// the same.
std::string NameOf(const ScanPushArguments& arguments, const std::string& path,
                   const sensor::ScanFile& file, size_t setup) {
  if (!arguments.name.empty()) return arguments.name;
  std::string stem = std::filesystem::path(path).stem().string();
  const std::vector<std::string>& names = file.setups();
  if (names.size() == 1) return stem;
  const bool unique = std::count(names.begin(), names.end(), names[setup]) == 1;
  return !names[setup].empty() && unique ? names[setup] : absl::StrCat(stem, "-", setup + 1);
}

absl::StatusOr<v1::Scan> PushOne(Environment& environment, const ScanPushArguments& arguments,
                                 const std::string& name, const sensor::ScanFile& file,
                                 size_t setup) {
  const auto scan = file.Read(setup, sensor::ImportLimits());
  if (!scan.ok()) return scan.status();
  if (scan->far > 0) {
    std::fprintf(stderr, "%s: %zu points farther than 1 km are taken as rays without a return\n",
                 name.c_str(), scan->far);
  }
  const auto upload = Describe(arguments, name, *scan);
  if (!upload.ok()) return upload.status();

  ProgressLine line;
  client::Client& client = environment.client();
  const auto pushed = client.Upload(
      client::SessionName(arguments.session), *upload, scan->image,
      [&](const client::UploadProgress& p) {
        const double share = static_cast<double>(p.acknowledged_bytes) / p.total_bytes;
        line.Show(
            absl::StrFormat("%s %s %s of %s%s", name, Bar(share, 30), Bytes(p.acknowledged_bytes),
                            Bytes(p.total_bytes),
                            p.reconnects > 0 ? absl::StrFormat(", %d breaks", p.reconnects) : ""));
      });
  if (!pushed.ok()) return pushed.status();
  if (arguments.no_wait) {
    v1::GetScanRequest get;
    get.set_name(*pushed);
    const auto got = client.Call(get);
    if (!got.ok()) return got.status();
    return got->scan();
  }
  return client.WaitForScan(
      *pushed, [&](const v1::Scan& s) { line.Show(absl::StrCat(name, ": ", Word(s.state()))); });
}

// Prints what became of a scan, and says what helps where that is not welcome.
ExitCode Report(const ScanPushArguments& arguments, const std::string& name, const v1::Scan& scan) {
  std::fputs(arguments.json ? ToJson(scan).c_str() : ScanReport(scan).c_str(), stdout);
  std::fflush(stdout);
  if (scan.state() != v1::SCAN_STATE_DOUBTFUL && scan.state() != v1::SCAN_STATE_FAILED) {
    return ExitCode::kOk;
  }
  const std::string id =
      absl::StrCat(client::IdOf(client::SessionOf(scan.name())), "/", client::IdOf(scan.name()));
  std::fprintf(stderr,
               "vantage: %s is kept but not in the model\n"
               "  fix: a better pose ('vantage scan set-pose %s --prior ...')%s, or 'vantage scan "
               "withdraw %s'\n",
               name.c_str(), id.c_str(),
               scan.state() == v1::SCAN_STATE_DOUBTFUL
                   ? absl::StrFormat(", or 'vantage scan accept %s' if it is right", id).c_str()
                   : "",
               id.c_str());
  return ExitCode::kUnwelcome;
}

absl::StatusOr<ExitCode> RunScanPush(Environment& environment, const ScanPushArguments& arguments) {
  const bool of_one = !arguments.name.empty() || !arguments.pose.prior.empty();
  const auto several = [](absl::string_view what) {
    return client::WithFix(
        absl::InvalidArgumentError(absl::StrCat("--name and --prior belong to one scan, ", what)),
        "push one at a time (--setup), or give the poses by name with --prior-file");
  };
  if (arguments.files.size() > 1 && of_one) return several("and there are several files");
  ExitCode code = ExitCode::kOk;
  for (const std::string& path : arguments.files) {
    const auto file = sensor::ScanFile::Open(path);
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
      // One that is not there is refused when it is read.
      const std::string name =
          setup < file->setups().size() ? NameOf(arguments, path, *file, setup) : arguments.name;
      const auto scan = PushOne(environment, arguments, name, *file, setup);
      if (!scan.ok()) return scan.status();
      if (Report(arguments, name, *scan) != ExitCode::kOk) code = ExitCode::kUnwelcome;
    }
  }
  return code;
}

}  // namespace

void AddScanPush(CLI::App& parent, Environment& environment) {
  AddCommand<ScanPushArguments>(
      parent, environment, "push",
      "Send scans (structured E57 or PTX, organised PCD) and wait for them",
      "  vantage scan push flat scan1.ptx\n"
      "  vantage scan push flat scan2.pcd --prior 1.9,0.1,0,40\n"
      "  vantage scan push school project.e57\n"
      "  vantage scan push flat scan2.ptx scan3.ptx --prior-file poses.txt\n"
      "  vantage scan push hall s7.ptx --prior-file network.txt --trusted --sigma 0.004,0.02\n"
      "  vantage scan push corridor s3.ptx --prior 12,0,0,90 --targets targets.txt",
      [](CLI::App& command, ScanPushArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_option("FILE", a.files, "Scan files, pushed one after the other")->required();
        AddPoseFlags(command, a.pose);
        command.add_option(
            "--targets", a.targets,
            "Targets that the scans saw: lines of 'SCAN TARGET X Y Z' in the scanner's "
            "frame, m, and another X Y Z where a control network has it");
        command
            .add_option("--target-sigma", a.target_sigma,
                        "How well they are known, m per axis, one sigma [0.002]")
            ->check(CLI::Range(1e-6, 1.0))
            ->needs("--targets");
        command.add_flag("--ignore-file-pose", a.ignore_file_pose,
                         "Don't use the pose that the file states as prior");
        command
            .add_option("--setup", a.setup,
                        "Of a file with several set-ups this one, from 1 [all, in order]")
            ->check(CLI::Range(size_t{1}, size_t{1'000'000}));
        command.add_option("--name", a.name, "Name for people [the file's]");
        command.add_option("--scanner", a.scanner,
                           "Id of one of the session's scanner models [read from the file]");
        command.add_option("--by", a.by, "Id of the fleet's scanner that made them [not known]");
        command.add_flag("--no-wait", a.no_wait, "Return when the scan is stored");
        command.add_flag("--json", a.json, "Print the scans as JSON");
      },
      RunScanPush);
}

}  // namespace vantage::cli
