#include "client/cli/scan_sending.h"

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "client/cli/file_flags.h"
#include "client/cli/json.h"
#include "client/cli/pace.h"
#include "client/cli/report.h"
#include "client/cli/target_file.h"
#include "client/cli/terminal.h"
#include "client/library/error.h"
#include "client/library/geometry.h"
#include "client/library/resource_names.h"
#include "core/sensor/imported_scan.h"
#include "core/sensor/scanner_model.h"
#include "core/sensor/thinning.h"

namespace vantage::cli {
namespace {

// Of loose points that lie apart: five times what one station has at its edges (point_cloud.cc).
constexpr double kSeveralStations = 0.01;

// What the flags say of an upload that has its name. `stated`: the pose that the file states.
absl::Status DescribeByFlags(const SendingFlags& flags,
                             const std::optional<Eigen::Isometry3d>& stated, v1::Upload& upload) {
  const std::string& name = upload.display_name();
  if (!flags.by.empty()) {
    upload.set_scanner(client::ScannerName(flags.session, flags.by));
  }
  if (!flags.scanner.empty()) upload.set_scanner_model_id(flags.scanner);
  const auto prior = PriorFrom(flags.pose, name, stated);
  if (!prior.ok()) return prior.status();
  if (*prior) *upload.mutable_prior() = client::ToProto(**prior);
  if (!flags.targets.empty()) {
    const auto targets = ReadTargets(flags.targets, name);
    if (!targets.ok()) return targets.status();
    for (const v1::TargetSighting& target : *targets) {
      v1::TargetSighting& added = *upload.add_targets();
      added = target;
      if (flags.target_sigma) added.set_sigma_m(*flags.target_sigma);
    }
  }
  return absl::OkStatus();
}

// What the job says of the scanner: of the fleet's that made the scan, else its first. `--set
// scanner.FIELD` and a preset are there.
absl::StatusOr<sensor::ScannerModel> JobsScanner(Environment& environment,
                                                 const SendingFlags& flags) {
  v1::GetSessionRequest get;
  get.set_name(client::SessionName(flags.session));
  const auto session = environment.client().Call(get);
  if (!session.ok()) return session.status();
  std::string id;
  if (!flags.by.empty()) {
    v1::GetScannerRequest by;
    by.set_name(client::ScannerName(flags.session, flags.by));
    const auto scanner = environment.client().Call(by);
    if (!scanner.ok()) return scanner.status();
    id = scanner->scanner().scanner_model_id();
  }
  for (const v1::ScannerModel& model : session->session().scanner_models()) {
    if (id.empty() || model.id() == id) return client::FromProto(model);
  }
  return sensor::ScannerModel();
}

// What a file shows is its rays; how far and how well the scanner measures, the job knows.
sensor::ScannerModel WithRaysOf(const sensor::ScannerModel& rays, sensor::ScannerModel scanner) {
  scanner.azimuth_span = rays.azimuth_span;
  scanner.azimuth_step = rays.azimuth_step;
  scanner.elevation_min = rays.elevation_min;
  scanner.elevation_max = rays.elevation_max;
  scanner.elevation_step = rays.elevation_step;
  return scanner;
}

absl::StatusOr<v1::Upload> Describe(Environment& environment, const SendingFlags& flags,
                                    const std::string& name, const sensor::ImportedScan& scan) {
  v1::Upload upload;
  upload.set_display_name(name);
  if (flags.scanner.empty()) {
    const auto scanner = JobsScanner(environment, flags);
    if (!scanner.ok()) return scanner.status();
    *upload.mutable_scanner_model() =
        client::ToProto(WithRaysOf(scan.scanner, *scanner), "from-file");
  }
  const absl::Status described =
      DescribeByFlags(flags, flags.ignore_file_pose ? std::nullopt : scan.T_world_scan, upload);
  if (!described.ok()) return described;
  return upload;
}

// The resource name of the preview that a scan of this name is to come in the place of; empty:
// none.
absl::StatusOr<std::string> PreviewOf(Environment& environment, const SendingFlags& flags,
                                      const Sending& sending) {
  if (!sending.replaces.empty()) {
    return absl::StrCat(client::SessionName(flags.session), "/scans/", sending.replaces);
  }
  const auto scans = ScansOf(environment, flags.session);
  if (!scans.ok()) return scans.status();
  std::string preview;
  for (const v1::Scan& scan : *scans) {
    if (scan.state() == v1::SCAN_STATE_WITHDRAWN) continue;
    if (scan.preview() && scan.display_name() == sending.name) preview = scan.name();
  }
  return preview;
}

}  // namespace

absl::StatusOr<std::vector<v1::Scan>> ScansOf(Environment& environment,
                                              const std::string& session) {
  v1::ListScansRequest request;
  request.set_parent(client::SessionName(session));
  std::vector<v1::Scan> scans;
  const absl::Status listed =
      environment.client().CallForPages(request, [&](v1::ListScansResponse page) {
        for (v1::Scan& scan : *page.mutable_scans()) scans.push_back(std::move(scan));
      });
  if (!listed.ok()) return listed;
  return scans;
}

absl::Status DescribeFile(const SendingFlags& flags, const FileFlags& file, v1::Upload& upload) {
  if (absl::Status described = DescribeByFlags(flags, std::nullopt, upload); !described.ok()) {
    return described;
  }
  v1::ScanFile& sent = *upload.mutable_file();
  if (const auto station = StationOf(file)) *sent.mutable_station() = client::ToProto(*station);
  const sensor::ImportLimits limits = LimitsOf(file);
  sent.set_unit_m(limits.unit);
  sent.set_intensity(limits.appearance.intensity);
  sent.set_colour(limits.appearance.colour);
  sent.set_ignore_poses(flags.ignore_file_pose);
  sent.set_preview_step_rad(sensor::Radians(flags.preview_step));
  return absl::OkStatus();
}

std::string NameOf(const std::string& path, const sensor::ConfinedScanFile& file, size_t setup) {
  std::string stem = std::filesystem::path(path).stem().string();
  const std::vector<std::string>& names = file.setups();
  if (names.size() == 1) return stem;
  const bool unique = std::count(names.begin(), names.end(), names[setup]) == 1;
  return !names[setup].empty() && unique ? names[setup] : absl::StrCat(stem, "-", setup + 1);
}

absl::StatusOr<v1::Scan> Send(Environment& environment, const SendingFlags& flags,
                              const Sending& sending, sensor::ConfinedScanFile& file,
                              size_t setup) {
  auto scan = file.Read(setup, sending.limits);
  sending.reading.Clear();
  if (!scan.ok()) return scan.status();
  const std::string& name = sending.name;
  const auto lacks = [&](bool wanted, bool has, const char* what) {
    return wanted && !has
               ? client::WithFix(absl::InvalidArgumentError(absl::StrCat(
                                     name, ": there is no ", what,
                                     " in it to bring along; E57, PTX, LAS and PLY may have it")),
                                 absl::StrCat("leave ", what, " out of --with"))
               : absl::OkStatus();
  };
  const sensor::AppearanceKinds& wanted = sending.limits.appearance;
  absl::Status there = lacks(wanted.intensity, scan->appearance.intensity, "intensity");
  there.Update(lacks(wanted.colour, scan->appearance.colour, "colour"));
  if (!there.ok()) return there;
  if (scan->far > 0) {
    std::fprintf(stderr, "%s: %zu points farther than 1 km are taken as rays without a return\n",
                 name.c_str(), scan->far);
  }
  PrintOddities(name, *scan);
  if (scan->loose) {
    std::fprintf(
        stderr,
        "%s: made of loose points: %d x %d directions%s; those without a point are taken "
        "as rays without a return, and %zu points share one with another and are left out\n",
        name.c_str(), scan->image.columns(), scan->image.rows(),
        scan->resampled ? ", interpolated" : "", scan->duplicates);
    if (scan->apart > kSeveralStations) {
      std::fprintf(stderr,
                   "%s: %.1f %% of the points lie far before or behind others: if the file has the "
                   "points of several stations, push those of each by themselves\n",
                   name.c_str(), 100 * scan->apart);
    }
  }
  auto upload = Describe(environment, flags, name, *scan);
  if (!upload.ok()) return upload.status();
  if (sending.preview) {
    sensor::RangeImage thin = sensor::Thinned(scan->image, sensor::Radians(flags.preview_step));
    if (thin.cells() < scan->image.cells()) {
      upload->set_preview(true);
      scan->image = std::move(thin);
    } else {
      std::fprintf(stderr, "%s: no finer than %.2f degrees, so it is sent whole\n", name.c_str(),
                   flags.preview_step);
    }
  } else {
    const auto preview = PreviewOf(environment, flags, sending);
    if (!preview.ok()) return preview.status();
    upload->set_replaces(*preview);
  }

  ProgressLine line;
  Pace pace;
  client::Client& client = environment.client();
  const auto sent = client.Upload(
      client::SessionName(flags.session), *upload, scan->image,
      [&](const client::UploadProgress& p) {
        const double share = static_cast<double>(p.acknowledged_bytes) / p.total_bytes;
        line.Show(absl::StrFormat(
            "%s %s %s%s", name, Bar(share, 20),
            pace.Of(static_cast<double>(p.acknowledged_bytes), static_cast<double>(p.total_bytes)),
            p.reconnects > 0 ? absl::StrFormat(", %d breaks", p.reconnects) : ""));
      });
  if (!sent.ok()) return sent.status();
  if (!sending.wait) {
    v1::GetScanRequest get;
    get.set_name(*sent);
    const auto got = client.Call(get);
    if (!got.ok()) return got.status();
    return got->scan();
  }
  line.Clear();
  return WaitShowing(environment, *sent);
}

absl::StatusOr<v1::Scan> WaitShowing(Environment& environment, const std::string& scan) {
  WaitingLine line;
  return environment.client().WaitForScan(scan, [&](const v1::Scan& s) {
    line.Show(absl::StrCat(s.display_name().empty() ? client::IdOf(scan) : s.display_name(), ": ",
                           Word(s.state())));
  });
}

ExitCode ReportSent(const SendingFlags& flags, const Sending& sending, const v1::Scan& scan) {
  const std::string& name = sending.name;
  std::fputs(flags.json ? ToJson(scan).c_str() : ScanReport(scan).c_str(), stdout);
  std::fflush(stdout);
  const std::string id =
      absl::StrCat(client::IdOf(client::SessionOf(scan.name())), "/", client::IdOf(scan.name()));
  if (scan.preview() && !sending.preview && !scan.state_message().empty()) {
    std::fprintf(stderr,
                 "vantage: %s was not taken: %s\n"
                 "  fix: push it under another name (--name), or withdraw the preview first "
                 "('vantage scan withdraw %s')\n",
                 name.c_str(), scan.state_message().c_str(), id.c_str());
    return ExitCode::kUnwelcome;
  }
  if (scan.state() != v1::SCAN_STATE_DOUBTFUL && scan.state() != v1::SCAN_STATE_FAILED) {
    return ExitCode::kOk;
  }
  std::fprintf(stderr,
               "vantage: %s is kept but not in the model\n"
               "  fix: a better pose ('vantage scan set-pose %s --prior ...')%s, or 'vantage scan "
               "withdraw %s'\n",
               name.c_str(), id.c_str(),
               scan.state() == v1::SCAN_STATE_DOUBTFUL
                   ? absl::StrFormat(", or 'vantage scan accept %s%s' if it is right", id,
                                     scan.registration().rival_poses_size() > 0 ? " --pose N" : "")
                         .c_str()
                   : "",
               id.c_str());
  return ExitCode::kUnwelcome;
}

void AddSendingFlags(CLI::App& command, SendingFlags& flags) {
  AddPoseFlags(command, flags.pose);
  command.add_option("--targets", flags.targets,
                     "Targets that the scans saw: lines of 'SCAN TARGET X Y Z' in the scanner's "
                     "frame, m, and another X Y Z where a control network has it");
  command
      .add_option("--target-sigma", flags.target_sigma,
                  "How well they are known, m per axis, one sigma [0.002]")
      ->check(CLI::Range(1e-6, 1.0))
      ->needs("--targets");
  command.add_flag("--ignore-file-pose", flags.ignore_file_pose,
                   "Don't use the pose that the file states as prior");
  command.add_option("--scanner", flags.scanner,
                     "Id of one of the session's scanner models [read from the file]");
  command.add_option("--by", flags.by, "Id of the fleet's scanner that made them [not known]");
  command
      .add_option("--preview-step", flags.preview_step,
                  "Degrees between the rays of a preview [0.25]")
      ->check(CLI::Range(0.01, 10.0));
  command.add_flag("--json", flags.json, "Print the scans as JSON");
}

}  // namespace vantage::cli
