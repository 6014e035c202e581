#include <cstdio>

#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/pose_flags.h"
#include "client/cli/report.h"
#include "client/cli/scan_sending.h"
#include "client/library/error.h"
#include "client/library/geometry.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct ScanSetPoseArguments {
  std::string scan;
  PoseFlags pose;
  std::string name;
  bool as_is = false;
  bool json = false;
};

absl::StatusOr<ExitCode> RunScanSetPose(Environment& environment,
                                        const ScanSetPoseArguments& arguments) {
  const auto prior = PriorFrom(arguments.pose, arguments.name);
  if (!prior.ok()) return prior.status();
  if (!*prior) {
    return client::WithFix(absl::InvalidArgumentError("no pose was given"),
                           "give one with --prior x,y,z,heading or --prior-file FILE --name NAME");
  }
  v1::SetScanPoseRequest request;
  request.set_name(client::ScanName(arguments.scan));
  *request.mutable_prior() = client::ToProto(**prior);
  request.set_use(arguments.as_is ? v1::POSE_USE_AS_IS : v1::POSE_USE_ALIGN);
  const auto set = environment.client().Call(request);
  if (!set.ok()) return set.status();
  const auto scan = WaitShowing(environment, request.name());
  if (!scan.ok()) return scan.status();
  PrintAnswer(arguments.json, *scan, ScanReport(*scan));
  return scan->state() == v1::SCAN_STATE_MERGED ? ExitCode::kOk : ExitCode::kUnwelcome;
}

}  // namespace

void AddScanSetPose(CLI::App& parent, Environment& environment) {
  AddCommand<ScanSetPoseArguments>(
      parent, environment, "set-pose", "Give a scan another pose, to align from or to stand",
      "  vantage scan set-pose flat/s2 --prior 1.9,0.1,0,40\n"
      "  vantage scan set-pose flat/s2 --prior-file poses.txt --name room_scan2 --as-is",
      [](CLI::App& command, ScanSetPoseArguments& a) {
        command.add_option("SCAN", a.scan, "The scan, as SESSION/SCAN")->required();
        AddPoseFlags(command, a.pose);
        command.add_option("--name", a.name, "Which line of the --prior-file");
        command.add_flag("--as-is", a.as_is, "Merge at exactly this pose, without aligning");
        command.add_flag("--json", a.json, "Print the scan as JSON");
      },
      RunScanSetPose);
}

}  // namespace vantage::cli
