#include <cstdio>
#include <map>
#include <vector>

#include "client/cli/command.h"
#include "client/cli/completion_words.h"
#include "client/cli/file.h"
#include "client/cli/json.h"
#include "client/cli/pace.h"
#include "client/cli/report.h"
#include "client/cli/terminal.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

const std::map<std::string, v1::ExportFormat>& Formats() {
  static const auto* const kFormats = new std::map<std::string, v1::ExportFormat>{
      {"octomap", v1::EXPORT_FORMAT_OCTOMAP},
      {"octomap-binary", v1::EXPORT_FORMAT_OCTOMAP_BINARY},
      {"surface-ply", v1::EXPORT_FORMAT_SURFACE_PLY},
      {"patch-ply", v1::EXPORT_FORMAT_PATCH_PLY},
      {"scans-ply", v1::EXPORT_FORMAT_SCANS_PLY},
      {"scans-e57", v1::EXPORT_FORMAT_SCANS_E57},
      {"archive", v1::EXPORT_FORMAT_ARCHIVE}};
  return *kFormats;
}

std::vector<std::string> FormatNames() {
  std::vector<std::string> names;
  for (const auto& [name, format] : Formats()) names.push_back(name);
  return names;
}

struct ExportArguments {
  std::string session;
  std::string format = "surface-ply";
  std::string output;
  std::vector<std::string> scans;
  bool json = false;
};

absl::StatusOr<ExitCode> RunExport(Environment& environment, const ExportArguments& arguments) {
  v1::ExportModelRequest request;
  request.set_name(client::SessionName(arguments.session));
  request.set_format(Formats().at(arguments.format));
  for (const std::string& scan : arguments.scans) request.add_scans(client::ScanName(scan));
  AtomicFile file(arguments.output);
  WaitingLine line;
  line.Show("export: the server prepares it");
  Pace pace;
  double written = 0;
  const auto exported = environment.client().Export(
      request, [&](absl::string_view bytes) { return file.Append(bytes); },
      [&](const client::ExportProgress& p) {
        written = static_cast<double>(p.received_bytes);
        line.Show(absl::StrCat("export: ", pace.Of(written, static_cast<double>(p.total_bytes))));
      });
  line.Clear();
  if (!exported.ok()) return exported.status();
  if (absl::Status committed = file.Commit(); !committed.ok()) return committed;
  if (arguments.json) {
    PrintJson({{"file", arguments.output},
               {"format", v1::ExportFormat_Name(request.format())},
               {"sizeBytes", static_cast<int64_t>(written)}});
    return ExitCode::kOk;
  }
  std::printf("%s: %s\n", arguments.output.c_str(), Bytes(written).c_str());
  return ExitCode::kOk;
}

}  // namespace

void AddExport(CLI::App& parent, Environment& environment) {
  AddCommand<ExportArguments>(
      parent, environment, "export", "Save the model as a file",
      "  vantage export flat --format surface-ply -o flat.ply\n"
      "  vantage export flat --format octomap-binary -o flat.bt\n"
      "  vantage export flat --format scans-ply --scan flat/s1 -o s1.ply\n"
      "  vantage export flat --format scans-e57 -o flat.e57\n"
      "  vantage export flat --format archive -o flat.vantage",
      [](CLI::App& command, ExportArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command
            .add_option(
                "--format", a.format,
                "octomap, octomap-binary, surface-ply, patch-ply, scans-ply, scans-e57 or archive")
            ->transform(CLI::IsMember(Formats(), CLI::ignore_case)
                            .description("")
                            .name(OneOf(FormatNames()).get_name()))
            ->capture_default_str();
        command.add_option("-o,--output", a.output, "File to write")->required();
        command.add_option("--scan", a.scans, "scans-ply, scans-e57: only these, as SESSION/SCAN")
            ->allow_extra_args(false);
        command.add_flag("--json", a.json, "Say what was written as JSON");
      },
      RunExport);
}

}  // namespace vantage::cli
