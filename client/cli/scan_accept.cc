#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/scan_sending.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct ScanAcceptArguments {
  std::string scan;
  int pose = 1;
  bool json = false;
};

absl::StatusOr<ExitCode> RunScanAccept(Environment& environment,
                                       const ScanAcceptArguments& arguments) {
  v1::AcceptScanRequest request;
  request.set_name(client::ScanName(arguments.scan));
  request.set_rival_pose(arguments.pose - 1);
  const auto accepted = environment.client().Call(request);
  if (!accepted.ok()) return accepted.status();
  const auto scan = WaitShowing(environment, request.name());
  if (!scan.ok()) return scan.status();
  PrintAnswer(arguments.json, *scan, ScanReport(*scan));
  return scan->state() == v1::SCAN_STATE_MERGED ? ExitCode::kOk : ExitCode::kUnwelcome;
}

}  // namespace

void AddScanAccept(CLI::App& parent, Environment& environment) {
  AddCommand<ScanAcceptArguments>(
      parent, environment, "accept",
      "Merge a doubtful scan where its alignment put it, or at another pose that fits as well",
      "  vantage scan accept flat/s2\n"
      "  vantage scan accept flat/s2 --pose 2      (poses as 'vantage scan show' numbers them)",
      [](CLI::App& command, ScanAcceptArguments& a) {
        command.add_option("SCAN", a.scan, "The scan, as SESSION/SCAN")->required();
        command
            .add_option("--pose", a.pose,
                        "Which of the poses at which it fits; 1 is where its alignment put it [1]")
            ->check(CLI::Range(1, 100));
        command.add_flag("--json", a.json, "Print the scan as JSON");
      },
      RunScanAccept);
}

}  // namespace vantage::cli
