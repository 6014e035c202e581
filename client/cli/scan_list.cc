#include <cstdio>

#include "absl/strings/str_cat.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/scan_sending.h"
#include "client/cli/table.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct ScanListArguments {
  std::string session;
  bool json = false;
};

absl::StatusOr<ExitCode> RunScanList(Environment& environment, const ScanListArguments& arguments) {
  const auto scans = ScansOf(environment, arguments.session);
  if (!scans.ok()) return scans.status();
  v1::ListScansResponse all;
  all.mutable_scans()->Assign(scans->begin(), scans->end());
  if (arguments.json) {
    std::fputs(ToJson(all).c_str(), stdout);
    return ExitCode::kOk;
  }
  Table table({"scan", "name", "state", ">samples", "pose", ">overlap", ">error", "note"});
  for (const v1::Scan& scan : all.scans()) {
    const v1::RegistrationVerdict& verdict = scan.registration().verdict();
    table.Add({client::IdOf(scan.name()), scan.display_name(),
               absl::StrCat(Word(scan.state()), scan.preview() ? ", preview" : ""),
               absl::StrCat(scan.sample_count()), scan.has_pose() ? Text(scan.pose()) : "",
               scan.has_registration() ? Percent(verdict.overlap_share()) : "",
               scan.has_registration() ? Length(verdict.error_bound_m()) : "",
               scan.state_message()});
  }
  if (all.scans().empty()) {
    std::puts("no scans; 'vantage scan push' sends one");
  } else {
    std::fputs(table.ToString().c_str(), stdout);
  }
  return ExitCode::kOk;
}

}  // namespace

void AddScanList(CLI::App& parent, Environment& environment) {
  AddCommand<ScanListArguments>(
      parent, environment, "list", "List a job's scans, oldest first",
      "  vantage scan list flat\n  vantage scan list flat --json",
      [](CLI::App& command, ScanListArguments& a) {
        command.add_option("SESSION", a.session, "The job")->required();
        command.add_flag("--json", a.json, "Print them as JSON");
      },
      RunScanList);
}

}  // namespace vantage::cli
