#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct ScanShowArguments {
  std::string scan;
  bool json = false;
};

absl::StatusOr<ExitCode> RunScanShow(Environment& environment, const ScanShowArguments& arguments) {
  v1::GetScanRequest request;
  request.set_name(client::ScanName(arguments.scan));
  const auto got = environment.client().Call(request);
  if (!got.ok()) return got.status();
  std::fputs(arguments.json ? ToJson(got->scan()).c_str() : ScanReport(got->scan()).c_str(),
             stdout);
  return ExitCode::kOk;
}

}  // namespace

void AddScanShow(CLI::App& parent, Environment& environment) {
  AddCommand<ScanShowArguments>(
      parent, environment, "show", "Show a scan: state, pose, how well it registered",
      "  vantage scan show flat/s2\n  vantage scan show flat/s2 --json",
      [](CLI::App& command, ScanShowArguments& a) {
        command.add_option("SCAN", a.scan, "The scan, as SESSION/SCAN")->required();
        command.add_flag("--json", a.json, "Print it as JSON");
      },
      RunScanShow);
}

}  // namespace vantage::cli
