#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct ScanWithdrawArguments {
  std::string scan;
  bool json = false;
};

absl::StatusOr<ExitCode> RunScanWithdraw(Environment& environment,
                                         const ScanWithdrawArguments& arguments) {
  v1::WithdrawScanRequest request;
  request.set_name(client::ScanName(arguments.scan));
  const auto withdrawn = environment.client().Call(request);
  if (!withdrawn.ok()) return withdrawn.status();
  if (arguments.json) {
    std::fputs(ToJson(*withdrawn).c_str(), stdout);
    return ExitCode::kOk;
  }
  std::fputs(ScanReport(withdrawn->scan()).c_str(), stdout);
  for (const std::string& name : withdrawn->dependent_scans()) {
    std::printf("  %s had been aligned with its help; 'vantage scan set-pose' aligns it again\n",
                client::IdOf(name).c_str());
  }
  if (withdrawn->has_erase_time()) {
    std::printf("  its data are erased from %s on\n", Time(withdrawn->erase_time()).c_str());
  }
  if (withdrawn->has_backups_forget_time()) {
    std::printf("  the last backup that may hold them is gone about %s\n",
                Time(withdrawn->backups_forget_time()).c_str());
  }
  return ExitCode::kOk;
}

}  // namespace

void AddScanWithdraw(CLI::App& parent, Environment& environment) {
  AddCommand<ScanWithdrawArguments>(
      parent, environment, "withdraw", "Take a scan out, as if it had never come",
      "  vantage scan withdraw flat/s2",
      [](CLI::App& command, ScanWithdrawArguments& a) {
        command.add_option("SCAN", a.scan, "The scan, as SESSION/SCAN")->required();
        command.add_flag("--json", a.json, "Print the answer as JSON");
      },
      RunScanWithdraw);
}

}  // namespace vantage::cli
