#include <cstdio>

#include "absl/strings/str_cat.h"
#include "client/cli/command.h"
#include "client/cli/json.h"
#include "client/cli/report.h"
#include "client/cli/table.h"
#include "client/library/resource_names.h"

namespace vantage::cli {
namespace {

struct SessionListArguments {
  std::string text;
  bool json = false;
};

absl::StatusOr<ExitCode> RunSessionList(Environment& environment,
                                        const SessionListArguments& arguments) {
  Table table({"session", "name", ">merged", ">undecided", ">model", "last change"});
  v1::ListSessionsRequest request;
  request.set_text(arguments.text);
  v1::ListSessionsResponse all;
  const absl::Status listed =
      environment.client().CallForPages(request, [&](const v1::ListSessionsResponse& page) {
        all.mutable_sessions()->MergeFrom(page.sessions());
      });
  if (!listed.ok()) return listed;
  if (arguments.json) {
    std::fputs(ToJson(all).c_str(), stdout);
    return ExitCode::kOk;
  }
  for (const v1::Session& session : all.sessions()) {
    const v1::ScanCounts& n = session.scan_counts();
    table.Add({client::IdOf(session.name()), session.display_name(), absl::StrCat(n.merged_count()),
               absl::StrCat(n.unmerged_count() + n.doubtful_count()),
               absl::StrCat(session.model_version()), Time(session.update_time())});
  }
  if (all.sessions().empty()) {
    std::puts(arguments.text.empty() ? "no sessions; 'vantage session create' opens one"
                                     : "no session has that in its id or name");
  } else {
    std::fputs(table.ToString().c_str(), stdout);
  }
  return ExitCode::kOk;
}

}  // namespace

void AddSessionList(CLI::App& parent, Environment& environment) {
  AddCommand<SessionListArguments>(
      parent, environment, "list", "List the jobs, oldest first",
      "  vantage session list\n  vantage session list --text flat --json",
      [](CLI::App& command, SessionListArguments& a) {
        command.add_option("--text", a.text, "Only those with this in their id or name");
        command.add_flag("--json", a.json, "Print them as JSON");
      },
      RunSessionList);
}

}  // namespace vantage::cli
