#include <cstdio>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
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
  bool proposed = false;
  std::string seen;
  bool json = false;
};

// 'at pose 2, (1.20, 0.30, 1.50), heading 12.00 deg'; nothing where there is no such pose, which
// the server says.
std::string ChosenWords(const v1::Scan& scan, const ScanAcceptArguments& arguments) {
  const v1::Registration& aligned = scan.registration();
  if (arguments.proposed) {
    if (!scan.has_pose_proposal()) return "";
    const v1::PoseProposal& proposal = scan.pose_proposal();
    return absl::StrCat("at the proposed pose, ", Text(proposal.registration().pose()), ": ",
                        proposal.message());
  }
  if (!scan.has_registration() || arguments.pose > 1 + aligned.rival_poses_size()) return "";
  return absl::StrFormat(
      "at pose %d of %d, %s", arguments.pose, 1 + aligned.rival_poses_size(),
      Text(arguments.pose == 1 ? aligned.pose() : aligned.rival_poses(arguments.pose - 2).pose()));
}

absl::StatusOr<ExitCode> RunScanAccept(Environment& environment,
                                       const ScanAcceptArguments& arguments) {
  v1::GetScanRequest get;
  get.set_name(client::ScanName(arguments.scan));
  const auto before = environment.client().Call(get);
  if (!before.ok()) return before.status();
  v1::AcceptScanRequest request;
  request.set_name(get.name());
  request.set_proposed(arguments.proposed);
  if (!arguments.proposed) request.set_rival_pose(arguments.pose - 1);
  // Of what is said below to be accepted, and not of what comes meanwhile.
  request.set_etag(arguments.seen.empty() ? before->scan().etag() : arguments.seen);
  const auto accepted = environment.client().Call(request);
  if (!accepted.ok()) return accepted.status();
  const std::string chosen = ChosenWords(before->scan(), arguments);
  if (!arguments.json && !chosen.empty()) {
    std::printf("%s accepted %s\n", client::IdOf(get.name()).c_str(), chosen.c_str());
    std::fflush(stdout);
  }
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
      "  vantage scan accept flat/s2 --pose 2      (poses as 'vantage scan show' numbers them)\n"
      "  vantage scan accept flat/s2 --proposed    (what scans that came since say)\n"
      "  vantage scan accept flat/s2 --pose 2 --seen 3f9a01c7",
      [](CLI::App& command, ScanAcceptArguments& a) {
        command.add_option("SCAN", a.scan, "The scan, as SESSION/SCAN")->required();
        CLI::Option* pose =
            command
                .add_option(
                    "--pose", a.pose,
                    "Which of the poses at which it fits; 1 is where its alignment put it [1]")
                ->check(CLI::Range(1, 100));
        command.add_flag("--proposed", a.proposed, "The pose that 'vantage scan show' proposes")
            ->excludes(pose);
        command.add_option("--seen", a.seen,
                           "What 'vantage scan show' printed beside the poses: accepted is what it "
                           "showed, or nothing where poses are others since");
        command.add_flag("--json", a.json, "Print the scan as JSON");
      },
      RunScanAccept);
}

}  // namespace vantage::cli
