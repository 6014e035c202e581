#include <cstdio>
#include <string>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/scan_poses.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct ScanShowArguments {
  std::string scan;
  std::string picture;
  bool compare = false;
  bool json = false;
};

absl::StatusOr<ExitCode> RunScanShow(Environment& environment, const ScanShowArguments& arguments) {
  v1::GetScanRequest request;
  request.set_name(client::ScanName(arguments.scan));
  const auto got = environment.client().Call(request);
  if (!got.ok()) return got.status();
  const bool compare = arguments.compare || !arguments.picture.empty();
  v1::CompareScanPosesResponse compared;
  if (compare) {
    v1::CompareScanPosesRequest comparison;
    comparison.set_name(request.name());
    auto answer = environment.client().Call(comparison);
    if (!answer.ok()) return answer.status();
    compared = *std::move(answer);
  }
  if (!arguments.picture.empty()) {
    const auto picture = PictureOf(got->scan(), compared.comparison());
    if (!picture.ok()) return picture.status();
    const absl::Status written = picture::WritePosePicture(*picture, arguments.picture);
    if (!written.ok()) return written;
  }
  if (arguments.json) {
    std::fputs(
        arguments.compare ? ToJson(compared.comparison()).c_str() : ToJson(got->scan()).c_str(),
        stdout);
    return ExitCode::kOk;
  }
  std::fputs(ScanReport(got->scan()).c_str(), stdout);
  if (compare) std::fputs(PosesReport(compared.comparison()).c_str(), stdout);
  return ExitCode::kOk;
}

}  // namespace

void AddScanShow(CLI::App& parent, Environment& environment) {
  AddCommand<ScanShowArguments>(
      parent, environment, "show", "Show a scan: state, pose, how well it registered",
      "  vantage scan show flat/s2\n"
      "  vantage scan show flat/s2 --compare             (what each pose fits and contradicts)\n"
      "  vantage scan show flat/s2 --picture s2.png      (the same, and where)\n"
      "  vantage scan show flat/s2 --json",
      [](CLI::App& command, ScanShowArguments& a) {
        command.add_option("SCAN", a.scan, "The scan, as SESSION/SCAN")->required();
        command.add_flag("--compare", a.compare,
                         "Compare it with the model at each pose at which it may have been made");
        command.add_option("--picture", a.picture,
                           "Draw that comparison, the poses side by side, into this file (PNG)");
        command.add_flag("--json", a.json, "Print the scan as JSON; with --compare the comparison");
      },
      RunScanShow);
}

}  // namespace vantage::cli
