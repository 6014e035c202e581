#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/report.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct ScanAcceptArguments {
  std::string scan;
};

absl::StatusOr<ExitCode> RunScanAccept(Environment& environment,
                                       const ScanAcceptArguments& arguments) {
  v1::AcceptScanRequest request;
  request.set_name(client::ScanName(arguments.scan));
  const auto accepted = environment.client().Call(request);
  if (!accepted.ok()) return accepted.status();
  const auto scan = environment.client().WaitForScan(request.name(), [](const v1::Scan&) {});
  if (!scan.ok()) return scan.status();
  std::fputs(ScanReport(*scan).c_str(), stdout);
  return scan->state() == v1::SCAN_STATE_MERGED ? ExitCode::kOk : ExitCode::kUnwelcome;
}

}  // namespace

void AddScanAccept(CLI::App& parent, Environment& environment) {
  AddCommand<ScanAcceptArguments>(
      parent, environment, "accept", "Merge a doubtful scan where its alignment put it",
      "  vantage scan accept flat/s2",
      [](CLI::App& command, ScanAcceptArguments& a) {
        command.add_option("SCAN", a.scan, "The scan, as SESSION/SCAN")->required();
      },
      RunScanAccept);
}

}  // namespace vantage::cli
